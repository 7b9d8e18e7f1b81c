"""How solving something ended, in the words that rows and records keep: `converged`, or why it must not be used."""

from __future__ import annotations

from collections.abc import Mapping

CONVERGED = "converged"
SHORT = {
    "elements too soft or too stiff": "elements off",
    "patch at the edge of the fine mesh": "at edge",
    "not converged": "not conv.",
}
"""What a table has room for, of what must not be used although it has numbers."""


def failed(why: object) -> str:
    """The status, in one line, of what gave no numbers at all."""
    return " ".join(f"failed: {why}".split())


def usable(row: Mapping[str, object]) -> bool:
    """Whether the numbers of a row, or of a record, may be used."""
    return row["status"] == CONVERGED


def has_numbers(row: Mapping[str, object]) -> bool:
    """Whether a row has numbers, be it that they must not be used."""
    return not str(row["status"]).startswith("failed")


def short_status(row: Mapping[str, object]) -> str:
    """The status of a row that must not be used, for a table."""
    status = str(row["status"])
    return SHORT.get(status, status) if has_numbers(row) else "no result"
