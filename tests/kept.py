"""A solved case kept without a report, and under a name that the test chooses."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.runs.store import CaseRecords, seal_case, write_case_records, write_solution
from fecontact.solving.solve import CaseResult


def keep_as(result: CaseResult, folder: Path) -> dict[str, Any]:
    """Put the files of a case into a folder that names it; returns its row."""
    record = CaseRecords.of(result)
    record = replace(record, row={**record.row, "id": folder.name})
    write_solution(result, result.case, folder)
    write_case_records(result, record, folder)
    return record.row


def keep_case(result: CaseResult, folder: Path) -> CaseRecords:
    """Put all files of a case into a folder, as `load` and `judge` read them; other files there stay."""
    record = CaseRecords.of(result)
    write_solution(result, result.case, folder)
    write_case_records(result, record, folder, svg=True)
    seal_case(result.case, folder)
    return record
