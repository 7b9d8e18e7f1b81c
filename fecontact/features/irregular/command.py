"""The command `fecontact irregular`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from fecontact.case import describe_unusual_inputs
from fecontact.console.messages import print_geometry, print_notes, reporting_replaced_files
from fecontact.console.options import POSITION_GROUPS, CaseOptions, add_case_options
from fecontact.console.progress import show_job_progress
from fecontact.errors import InputError
from fecontact.features.irregular.limit import LIMIT
from fecontact.inputs.texts import count_text, parse_numbers
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.terminal import print_answer


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class IrregularOptions:
    """The irregularities, and the settings for judging the models.

    Attributes
    ----------
    wavelengths_mm
        Wavelengths of a map in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as 10:200:10.
    amplitudes_um
        Amplitudes of a map in micrometres (half of peak to valley), in the same form.
    irregularity
        Irregularity, instead of a map: sine:wavelength_mm=30,amplitude_um=25 (a cosine: highest at distance 0),
        chord:length_mm=40, haversine:length_mm=52,depth_mm=0.4, or table:FILE,distance=mm,opening=um. Missing material
        is positive.
    table
        Measured irregularity: FILE,distance=mm,opening=um, or only FILE if its heading has the units.
    positions_mm
        Positions along the irregularity in mm, in the same form; positions over its length if not given.
    limit_percent
        Largest error of force and peak pressure with which a model holds, in percent.
    workers
        Number of processes; one per core if not given.
    """

    wavelengths_mm: str = ""
    amplitudes_um: str = ""
    irregularity: str = ""
    table: str = ""
    positions_mm: Annotated[str, Parameter(allow_leading_hyphen=True)] = ""
    limit_percent: float = 100.0 * LIMIT
    workers: int | None = None


_DEFAULT_OPTIONS = IrregularOptions()
# CPU seconds of a cell or a place, for all models and the half-space: 18 cells took 2.6 s, and 12 places 0.9 s.
_SECONDS_PER_PLACE = 0.15


@add_case_options(*POSITION_GROUPS)
def irregular(
    *,
    options: CaseOptions,
    irregular_options: IrregularOptions = _DEFAULT_OPTIONS,
    json: bool = False,
    out: Path | None = None,
) -> int:
    """Hertz's spring (eq. 6) and similar models over corrugation, flats and welds, against the half-space (no mesh).

    With wavelengths and amplitudes the result is a map of the models that hold. With a single irregularity,
    the result is the force of each model at each position along it.

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for irregular.json, irregular.png and report.html.
    """
    from fecontact.features.irregular.running import irregular as judge_irregularity
    from fecontact.features.irregular.telling import draw_irregular, format_irregular, write_irregular_report
    from fecontact.files import write_json
    from fecontact.jobs.workers import count_default_workers

    if irregular_options.irregularity and irregular_options.table:
        raise InputError("irregular: give --irregularity or --table, not both")

    def numbers(text: str, name: str) -> tuple[float, ...]:
        return parse_numbers(text, name) if text else ()

    case, text = (
        options.case(),
        f"table:{irregular_options.table}" if irregular_options.table else irregular_options.irregularity,
    )
    print_notes(describe_unusual_inputs([case]))
    print_geometry([case])
    workers = count_default_workers() if irregular_options.workers is None else irregular_options.workers
    unit = "place" if text else "cell"
    with show_job_progress(
        f"{unit}s",
        before=lambda number: (
            f"{count_text(number, unit)}: about {format_duration(max(1.0, _SECONDS_PER_PLACE * number / workers))}"
        ),
    ) as progress:
        record = judge_irregularity(
            case,
            wavelengths_mm=numbers(irregular_options.wavelengths_mm, "wavelengths"),
            amplitudes_mm=[1e-3 * amplitude for amplitude in numbers(irregular_options.amplitudes_um, "amplitudes")],
            irregularity=text or None,
            positions_mm=numbers(irregular_options.positions_mm, "positions"),
            limit=0.01 * irregular_options.limit_percent,
            workers=workers,
            progress=progress,
        )
    if out is not None:
        with reporting_replaced_files(out):
            write_json(out / "irregular.json", record)
            picture = draw_irregular(record, out / "irregular.png")
            write_irregular_report(record, picture, out)
    print_answer(record, format_irregular, json=json, written=out)
    results = record["cells"] if "cells" in record else record["places"]
    return 3 if any(result["problem"] for result in results) else 0
