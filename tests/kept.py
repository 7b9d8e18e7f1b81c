"""A solved case kept without a report, and under a name that the test chooses."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.runs.store import Told, keep_solved, keep_told, seal_case
from fecontact.solving.solve import CaseResult


def keep_as(result: CaseResult, folder: Path) -> dict[str, Any]:
    """Put the files of a case into a folder that names it; returns its row."""
    record = Told.of(result)
    record = replace(record, row={**record.row, "id": folder.name})
    keep_solved(result, result.case, folder)
    keep_told(result, record, folder)
    return record.row


def keep_case(result: CaseResult, folder: Path) -> Told:
    """Put all files of a case into a folder, as `load` and `judge` read them; other files there stay."""
    record = Told.of(result)
    keep_solved(result, result.case, folder)
    keep_told(result, record, folder, svg=True)
    seal_case(result.case, folder)
    return record
