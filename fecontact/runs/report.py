"""`report.html` of solved or judged results: its cases, and pictures of the pair and of new verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from fecontact.criteria import Criteria
from fecontact.errors import is_usable_status
from fecontact.outputs.case_words import case_words
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.figures.case import write_case_figure
from fecontact.outputs.figures.relief import relief_picture
from fecontact.outputs.figures.study import draw_study
from fecontact.outputs.records.results import Row, result_record
from fecontact.outputs.study_report import DrawnCase, read_reported_case, rows_by_utilisation, write_study_report
from fecontact.runs.casefile import Study
from fecontact.runs.identity import make_case_id
from fecontact.runs.store import (
    CaseRecords,
    ChangedCase,
    name_case_folder,
    seal_case,
    write_case_records,
    write_solution,
)
from fecontact.solving.placing import place_case
from fecontact.solving.solve import CaseResult

# A picture takes up to 1 s, and judging must not take minutes.
_MAX_JUDGED_PICTURES = 12


def study_pair(study: Study, rows: Sequence[Row]) -> DrawnCase | None:
    """Place the pair of the case with the largest limit utilisation.

    Parameters
    ----------
    study
        Study with the cases.
    rows
        Rows of the cases.

    Returns
    -------
    DrawnCase or None
        The pair; None without a usable case.
    """
    for row in rows_by_utilisation(_select_usable(rows), 1):
        case = next(case for case in study.cases if make_case_id(case) == row["id"])
        return DrawnCase(row=row, placement=place_case(case))
    return None


def report_study(
    study: Study,
    rows: Sequence[Row],
    out: Path,
    criteria: Criteria | None,
    conclusion: str | None,
    shown_pair: DrawnCase | None,
) -> Path:
    """Write the report of a study with its results in `out`.

    Parameters
    ----------
    study
        Study.
    rows
        Rows of its cases.
    out
        Folder of the results and of the report.
    criteria
        Criteria of all cases; None if the cases have different criteria.
    conclusion
        Text of the conclusion; None without a conclusion.
    shown_pair
        Pair for the picture; None without a picture.

    Returns
    -------
    Path
        The report.
    """
    return write_study_report(
        study.name,
        [read_reported_case(row, name_case_folder(out, str(row["id"]))) for row in rows],
        out,
        shown=shown_pair,
        criteria=criteria,
        conclusion=conclusion,
    )


def keep_with_report(result: CaseResult, case_records: CaseRecords, folder: Path) -> Path:
    """Write the files of a solved case for `load` and `judge`, and its report.

    Parameters
    ----------
    result
        Solved case.
    case_records
        Row and record of the case.
    folder
        Folder for the files.

    Returns
    -------
    Path
        The report.
    """
    write_solution(result, result.case, folder)
    write_case_records(result, case_records, folder, svg=True)
    seal_case(result.case, folder)
    relief = relief_picture(result.load, result.placement)
    return write_study_report(
        case_words(case_records.record["case"]),
        [ReportedCase(row=case_records.row, record=case_records.record, picture=folder / "case.png", relief=relief)],
        folder,
        shown=DrawnCase(row=case_records.row, placement=result.placement),
        criteria=result.case.criteria,
    )


def report_judged(
    name: str,
    rows: Sequence[Row],
    folders: Sequence[Path],
    out: Path,
    changed_cases: Sequence[ChangedCase | None],
) -> Path:
    """Write the report, and the picture, of rows that were judged by different criteria.

    Pictures of cases have the new verdicts; only the report has these pictures.

    Parameters
    ----------
    name
        Name of the study.
    rows
        New rows.
    folders
        Folders of the cases, a folder per row.
    out
        Folder for the report.
    changed_cases
        Cases with their new criteria, a case per row; None for rows without a result.

    Returns
    -------
    Path
        The report.
    """
    rails = {str(row["rail"]) for row in rows}
    pictured_rows = rows_by_utilisation(_select_usable(rows), _MAX_JUDGED_PICTURES)
    distinct_criteria = {changed_case.criteria for changed_case in changed_cases if changed_case is not None}
    criteria = distinct_criteria.pop() if len(distinct_criteria) == 1 else None
    shown_pair = None
    with TemporaryDirectory() as temporary:
        cases = []
        for row, folder, changed_case in zip(rows, folders, changed_cases, strict=True):
            if row not in pictured_rows or changed_case is None:
                stored_case = read_reported_case(row, folder)
                cases.append(ReportedCase(row=row, record={"solver": stored_case.record.get("solver", {})}))
                continue
            result = changed_case.read()
            path = write_case_figure(result, Path(temporary) / str(row["id"]) / "case.png", svg=False)
            relief = relief_picture(result.load, result.placement) if len(rows) == 1 else None
            cases.append(ReportedCase(row=row, record=result_record(result), picture=path, relief=relief))
            if row is pictured_rows[0]:
                shown_pair = DrawnCase(row=row, placement=result.placement)
        rail = shown_pair.placement.rail.profile if shown_pair is not None and len(rails) == 1 else None
        # a single case gives no curve over the shift
        if sum(row.get("fe_p_max_MPa") is not None for row in rows) > 1:
            draw_study(rows, out / "study.png", rail, criteria)
        return write_study_report(
            f"{name}, judged again",
            cases,
            out,
            shown=shown_pair,
            criteria=criteria,
            pictures="judge a single case to see its picture",
        )


def _select_usable(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if is_usable_status(row)]
