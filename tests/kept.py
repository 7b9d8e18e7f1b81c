"""A solved case kept under a name of the test's own."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.runs.store import Told, keep_solved, keep_told
from fecontact.solving.solve import CaseResult


def keep_as(result: CaseResult, folder: Path) -> dict[str, Any]:
    """Put the files of a case into a folder that names it; returns its row."""
    told = Told.of(result)
    told = replace(told, row={**told.row, "id": folder.name})
    keep_solved(result, result.case, folder)
    keep_told(result, told, folder)
    return told.row
