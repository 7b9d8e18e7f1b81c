"""`report.html` of what was solved or judged: which cases it shows, and pictures of the pair and of new verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from fecontact.creep import Creep
from fecontact.criteria import Criteria
from fecontact.outcome import usable
from fecontact.outputs.documents.study import PAIR, ShownPair, most_used, reported_case, shown_pair, write_study_report
from fecontact.outputs.figures.case import case_figure
from fecontact.outputs.figures.study import study_figure
from fecontact.outputs.paraview.scene import begin_scene
from fecontact.outputs.records.results import Row, result_record
from fecontact.outputs.tables.cases import ReportedCase
from fecontact.outputs.words.cases import case_words
from fecontact.runs.casefile import Study
from fecontact.runs.identity import case_id
from fecontact.runs.store import Told, case_folder, keep_solved, keep_told, read_case, seal_case
from fecontact.solving.placing import place_case
from fecontact.solving.solve import CaseResult

# Each takes up to a second to draw, and judging shall not take minutes.
_MOST_JUDGED_PICTURES = 12


def study_pair(study: Study, rows: Sequence[Row], out: Path) -> ShownPair | None:
    """The pair of the case that uses most of a limit, of a study that lies in `out`; None where no case can be used."""
    for row in most_used(_usable(rows), 1):
        case = next(case for case in study.cases if case_id(case) == row["id"])
        return shown_pair(row, place_case(case), case_folder(out, str(row["id"])), out)
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
    """Put the files of a solved case into a folder, as `store.keep_case` does, and its report."""
    keep_solved(result, result.case, folder)
    scene = begin_scene(folder, folder / PAIR)
    keep_told(result, told, folder)
    seal_case(result.case, folder)
    return write_study_report(
        case_words(result.case, result.placement),
        [ReportedCase(row=told.row, record=told.record, picture=folder / "case.png")],
        folder,
        shown=ShownPair(row=told.row, placement=result.placement, scene=folder / PAIR, no_scene=scene),
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
            path = case_figure(result, Path(temporary) / str(row["id"]) / "case.png")
            cases.append(ReportedCase(row=row, record=result_record(result), picture=path))
            if row is most[0]:
                shown = shown_pair(row, result.placement, folder, out)
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
