"""`report.html` of what was solved or judged: which cases it shows, and pictures of the pair and of new verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from fecontact.criteria import Creep, Criteria
from fecontact.errors import usable
from fecontact.outputs.case_words import case_words
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.figures.case import case_figure
from fecontact.outputs.figures.relief import relief_picture
from fecontact.outputs.figures.study import study_figure
from fecontact.outputs.records.results import Row, result_record
from fecontact.outputs.study_report import ShownPair, most_used, reported_case, write_study_report
from fecontact.runs.casefile import Study
from fecontact.runs.identity import case_id
from fecontact.runs.store import Told, case_folder, keep_solved, keep_told, read_case, seal_case
from fecontact.solving.placing import place_case
from fecontact.solving.solve import CaseResult

# Each takes up to a second to draw, and judging shall not take minutes.
_MOST_JUDGED_PICTURES = 12


def study_pair(study: Study, rows: Sequence[Row]) -> ShownPair | None:
    """The pair of the case that uses most of a limit; None where no case can be used."""
    for row in most_used(_usable(rows), 1):
        case = next(case for case in study.cases if case_id(case) == row["id"])
        return ShownPair(row=row, placement=place_case(case))
    return None


def report_study(
    study: Study,
    rows: Sequence[Row],
    out: Path,
    criteria: Criteria | None,
    conclusion: str | None,
    shown: ShownPair | None,
) -> Path:
    """Write the report of a study that lies in `out`."""
    return write_study_report(
        study.name,
        [reported_case(row, case_folder(out, str(row["id"]))) for row in rows],
        out,
        shown=shown,
        criteria=criteria,
        conclusion=conclusion,
    )


def keep_with_report(result: CaseResult, told: Told, folder: Path) -> Path:
    """Put the files of a solved case into a folder, as `load` and `judge` read them, with its report."""
    keep_solved(result, result.case, folder)
    keep_told(result, told, folder, svg=True)
    seal_case(result.case, folder)
    relief = relief_picture(result.load, result.placement)
    return write_study_report(
        case_words(result.case, result.placement),
        [ReportedCase(row=told.row, record=told.record, picture=folder / "case.png", relief=relief)],
        folder,
        shown=ShownPair(row=told.row, placement=result.placement),
        criteria=result.case.criteria,
    )


def report_judged(
    name: str, rows: Sequence[Row], folders: Sequence[Path], out: Path, criteria: Criteria, creep: Creep | None
) -> Path:
    """Write the report, and the picture, of rows that were judged by other criteria; their cases are in the folders.

    Pictures of cases have the new verdicts; they are in the report alone.
    """
    rails = {str(row["rail"]) for row in rows}
    most = most_used(_usable(rows), _MOST_JUDGED_PICTURES)
    shown = None
    with TemporaryDirectory() as temporary:
        cases = []
        for row, folder in zip(rows, folders, strict=True):
            if row not in most:
                kept = reported_case(row, folder)
                cases.append(ReportedCase(row=row, record={"solver": kept.record.get("solver", {})}))
                continue
            result = read_case(folder, criteria=criteria, creep=creep)
            path = case_figure(result, Path(temporary) / str(row["id"]) / "case.png", svg=False)
            relief = relief_picture(result.load, result.placement) if len(rows) == 1 else None
            cases.append(ReportedCase(row=row, record=result_record(result), picture=path, relief=relief))
            if row is most[0]:
                shown = ShownPair(row=row, placement=result.placement)
        rail = shown.placement.rail.profile if shown is not None and len(rails) == 1 else None
        # a single case is no line over the shift
        if sum(row.get("fe_p_max_MPa") is not None for row in rows) > 1:
            study_figure(rows, out / "study.png", rail, criteria)
        return write_study_report(
            f"{name}, judged again",
            cases,
            out,
            shown=shown,
            criteria=criteria,
            pictures="judge a case alone to see another one",
        )


def _usable(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if usable(row)]
