"""Files and record of both wheels of a wheelset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.errors import ConvergenceError, InputError, describe_failure, is_usable_status
from fecontact.feature_registry import load_offers
from fecontact.files import write_json
from fecontact.inputs.texts import count_text
from fecontact.outputs.case_words import case_words
from fecontact.outputs.cases import ReportedCase
from fecontact.outputs.study_report import REPORT_FILE, DrawnCase, write_study_report
from fecontact.outputs.tables import write_csv
from fecontact.runs.folder import prepare_for_case, refuse_foreign_files
from fecontact.runs.report import keep_with_report
from fecontact.runs.store import SOLUTION_FILE, CaseRecords
from fecontact.solving.solve import CaseResult
from fecontact.solving.wheelset_solution import WheelsetCases, WheelsetResults

WHEELSET_TABLE, WHEELSET_FILE = "wheelset.csv", "wheelset.json"
"""Table with the row of each wheel, and record of both wheels."""


def prepare_for_wheelset(out: Path, cases: WheelsetCases, *, force: bool = False) -> None:
    """Create the folders of a wheelset, and check that they can be written.

    Parameters
    ----------
    out
        Folder.
    cases
        Case of each wheel.
    force
        Whether to write into folders with other results.

    Raises
    ------
    InputError
        If a folder has other results, or files of the user; the message names them.
    OSError
        If a folder cannot be written.
    """
    if not force and not any((out / side / SOLUTION_FILE).is_file() for side in cases):
        refuse_foreign_files(out, (WHEELSET_TABLE, WHEELSET_FILE, REPORT_FILE))
    for side, case in cases.items():
        prepare_for_case(out / side, case, force=force)


def make_wheelset_record(results: WheelsetResults, case_records: Mapping[Any, CaseRecords]) -> dict[str, Any]:
    """Make the record of both wheels.

    Parameters
    ----------
    results
        Result of each wheel.
    case_records
        Record and row of each wheel with a result.

    Returns
    -------
    dict
        `answer` has the sentences on the wheelset, and `left` and `right` the records of the wheels as in their
        `result.json`. A wheel without a result has its `status` alone.
    """
    records: dict[str, Mapping[str, Any]] = {
        side: case_records[side].record if isinstance(result, CaseResult) else {"status": describe_failure(result)}
        for side, result in results.items()
    }
    usable_records = [record if is_usable_status(record) else None for record in records.values()]
    answers = {
        side: record["verdict"]["answer"] if "verdict" in record else record["status"]
        for side, record in records.items()
    }
    holding = sum(answer == "HOLDS" for answer in answers.values())
    answer_words = ", ".join(f"{side} wheel {answer}" for side, answer in answers.items())
    sentences = [f"wheelset: Hertz holds for {holding} of {count_text(len(records), 'wheel')} ({answer_words})"]
    for name, telling in load_offers("TELLINGS").items():
        sentences += telling.total([None if record is None else record[name] for record in usable_records])
    return {"schema": "fecontact/wheelset/1", "answer": sentences, **records}


def keep_wheelset(
    results: WheelsetResults, case_records: Mapping[Any, CaseRecords], record: Mapping[str, Any], out: Path
) -> None:
    """Write the files of both wheels: a folder for each wheel, a table, a record and a common report.

    Parameters
    ----------
    results, case_records
        Result of each wheel, and records of each wheel with a result.
    record
        Record of both wheels.
    out
        Folder of the results.
    """
    reported_cases, drawn_case = [], None
    solved_results = {side: result for side, result in results.items() if isinstance(result, CaseResult)}
    for side, result in solved_results.items():
        records = case_records[side]
        keep_with_report(result, records, out / side)
        reported_cases.append(ReportedCase(row=records.row, record=records.record, picture=out / side / "case.png"))
        drawn_case = drawn_case or DrawnCase(row=records.row, placement=result.placement)
    write_csv([case_records[side].row for side in solved_results], out / WHEELSET_TABLE)
    write_json(out / WHEELSET_FILE, record)
    first_records, first_result = next((case_records[side], result) for side, result in solved_results.items())
    write_study_report(
        f"Wheelset: {case_words(first_records.record['case'])}",
        reported_cases,
        out,
        shown=drawn_case,
        criteria=first_result.case.criteria,
        conclusion="\n".join(record["answer"]),
    )


def list_wheelset_errors(results: WheelsetResults) -> dict[str, InputError | ConvergenceError]:
    """List the wheels without a result, with their errors."""
    return {side: result for side, result in results.items() if not isinstance(result, CaseResult)}
