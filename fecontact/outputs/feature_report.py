"""Report of a command that prints its results as parts: answer, tables and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fecontact.files import write_text
from fecontact.outputs.parts import Heading, Lead, Part, Parts, Picture
from fecontact.outputs.study_report import REPORT_FILE, closing_parts
from fecontact.outputs.style import render_page


def write_feature_report(title: str, lead: Lead, parts: Parts, pictures: Sequence[Picture], out: Path) -> Path:
    """Write `report.html` of a command into its folder.

    Parameters
    ----------
    title
        Title of the page.
    lead
        Answer with the judged inputs.
    parts
        Parts that the command prints.
    pictures
        Pictures, shown before the parts.
    out
        Folder of the results.

    Returns
    -------
    Path
        The written page.
    """
    page_parts: list[Part] = [lead, *pictures, Heading("Results"), *parts, *closing_parts((), laws=False)]
    return write_text(out / REPORT_FILE, render_page(title, page_parts))
