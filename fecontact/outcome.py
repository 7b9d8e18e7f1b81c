"""How solving something ended, in the words that rows and records keep: `converged`, or why it must not be used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

CONVERGED = "converged"


@dataclass(frozen=True)
class Unusable:
    """A result that has numbers, which must not be used: `short` is what a table has room for."""

    short: str
    remedy: str


UNUSABLE = {
    "elements too soft or too stiff": Unusable(
        "elements off",
        "finer ones tell whether they are only too coarse: --resolution standard, or more --refine-degrees-of-freedom",
    ),
    "patch at the edge of the fine mesh": Unusable(
        "at edge", "a note says what keeps the mesh from growing; another lateral shift or a smaller load may go"
    ),
    "not converged": Unusable("not conv.", "a lateral shift 0.2 mm beside it, or another load, may go"),
}
"""What is to be said of each status but `CONVERGED`."""


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
    if not has_numbers(row):
        return "no result"
    return UNUSABLE[status].short if status in UNUSABLE else status


def with_remedy(row: Mapping[str, object]) -> str:
    """The status of a row, or of a record, that must not be used, and what may help."""
    status = str(row["status"])
    return f"{status}; {UNUSABLE[status].remedy}" if status in UNUSABLE else status
