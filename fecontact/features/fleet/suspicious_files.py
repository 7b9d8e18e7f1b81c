"""Suspicious files of a fleet in its report: a table and small pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import FecontactError
from fecontact.features.fleet.checking import ScreenedFleet
from fecontact.features.fleet.screening_rows import Row
from fecontact.features.fleet.table_columns import SUSPICIOUS
from fecontact.inputs.texts import count_text
from fecontact.outputs.parts import Heading, Part, Picture
from fecontact.outputs.style import blank_figure, render_image
from fecontact.outputs.tables import make_table, text_column
from fecontact.profiles.library import load_library_profile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLUMNS_OF_PICTURES, _MOST_PICTURES = 4, 40
_WIDTH_IN, _HEIGHT_IN = 2.9, 2.2
# Profile in the picture of a file without a recognised profile: it shows the axes and the sides.
_COMPARED = {"wheel": "S1002", "rail": "60E1"}
_COLUMNS = [
    text_column("", "body"),
    text_column("name", "name"),
    text_column("suspicion", "suspicions"),
    text_column("observation", "reason", wraps=True),
    text_column("how to settle it", "remedy", wraps=True),
]


def make_suspicious_parts(fleet: ScreenedFleet) -> Iterator[Part]:
    """Yield the section of the suspicious files; nothing without such files.

    Parameters
    ----------
    fleet
        Screened fleet.

    Returns
    -------
    iterator
        Heading, sentence, pictures and table.
    """
    rows = [row for row in fleet.profile_rows if row["status"] == SUSPICIOUS]
    if not rows:
        return
    yield Heading("Suspicious files")
    yield (
        f"{count_text(len(rows), 'file')} may be mirrored, canted, shifted, incomplete or damaged, and"
        f" {1e2 * fleet.record.get('suspicious_share', 0.0):.1f} % of the pairs, by weight, are left out of the answer"
        " for them. Settle each in its row of the table, and run the same command again."
    )
    picture_rows = rows[:_MOST_PICTURES]
    words = (
        "Points (blue), and a profile of the library in its own axes (grey) with the origin (+): the nominal profile of"
        f" the file, or a usual one if none was recognised; at most the first {_MOST_PICTURES} files."
    )
    yield Picture(content=render_image(draw_suspicious_files(fleet, picture_rows)), words=words, width=1100)
    yield make_table("", _COLUMNS, rows)


def draw_suspicious_files(fleet: ScreenedFleet, rows: Sequence[Row]) -> Figure:
    """Draw the points of files and their nominal profiles, a small picture for each file.

    Parameters
    ----------
    fleet
        Screened fleet.
    rows
        Rows of `profiles.parquet`.

    Returns
    -------
    Figure
        Grid of pictures. A file that cannot be read, or was changed, has a text in place of its points.
    """
    columns = min(_COLUMNS_OF_PICTURES, len(rows))
    count = -(-len(rows) // columns)
    figure = blank_figure(_WIDTH_IN * columns, _HEIGHT_IN * count)
    for number, row in enumerate(rows, start=1):
        _draw_file(figure.add_subplot(count, columns, number), fleet, row)
    return figure


def _draw_file(ax: Axes, fleet: ScreenedFleet, row: Row) -> None:
    """Draw the points of a file over its nominal profile."""
    nominal = row["nominal"] or _COMPARED[row["body"]]
    profile = load_library_profile(nominal)
    surface = profile.evaluate(profile.at_arc_length(np.linspace(0.0, profile.length_mm, 400)))
    ax.plot(surface.y, surface.z, color="0.7", lw=1.0)
    ax.plot(0.0, 0.0, "+", color="0.4")
    try:
        points = fleet.read_points(row["body"], row["name"])
    except FecontactError:
        ax.text(0.5, 0.5, "the file cannot be read or was changed", ha="center", transform=ax.transAxes, fontsize=6)
    else:
        _plot_points(ax, points)
    ax.set_title(f"{Path(row['name']).name[:28]}: {row['suspicions']}\ngrey: {nominal}", fontsize=7)
    ax.set_xlabel("y in mm", fontsize=6)
    ax.set_ylabel("z in mm", fontsize=6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.tick_params(labelsize=6)


def _plot_points(ax: Axes, points: Floats) -> None:
    """Plot points (n, 2) in mm."""
    ax.plot(*points.T, color="tab:blue", lw=1.2)
