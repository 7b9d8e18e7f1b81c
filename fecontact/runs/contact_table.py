"""Contact tables for vehicle codes: lines over shift and load, with the verdicts of a stored map where it has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.alone.contact_table import table_lines
from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.outputs.records.contact_table import map_columns, ordered, table_row
from fecontact.runs.map_rows import map_rows

Record = dict[str, Any]

# Decimals to which shifts (mm) and loads (kN) are the same.
_SAME = 6


def table(
    case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float], *, map_folder: str | Path | None = None
) -> list[Record]:
    """A contact table over lateral shift and load, as flat dictionaries with units in their keys; nothing is solved.

    >>> import fecontact
    >>> rows = fecontact.table(fecontact.Case(roll="touching"), [0.0, 4.0], [50e3, 100e3])
    >>> [(row["lateral_shift_mm"], row["load_kN"], row["cheapest_theory"]) for row in rows]
    [(0.0, 50.0, 'strip'), (0.0, 100.0, 'strip'), (4.0, 50.0, 'hertz'), (4.0, 100.0, 'hertz')]

    Parameters
    ----------
    case
        Everything but lateral shift and load; its criteria say how near a cheap theory must be to the strips.
    lateral_shifts_mm, loads_N
        Of the wheelset, and wheel loads.
    map_folder
        A map that `fecontact map` wrote of the same pair: columns `map_*` have its verdicts at its shifts and loads.

    Raises
    ------
    InputError
        Without shifts and loads, or for a map of another pair. A position that has no contact is a row with its
        `problem`.
    """
    shifts, loads = tuple(map(float, lateral_shifts_mm)), tuple(map(float, loads_N))
    if not shifts or not loads:
        raise InputError("table: give at least one lateral shift and one load")
    cells = None if map_folder is None else {_key(row): row for row in map_rows(Path(map_folder), case)}
    rows = []
    for line in table_lines(case, shifts, loads):
        row = table_row(line)
        if cells is not None:
            row |= map_columns(cells.get(_key(row)))
        rows.append(row)
    return ordered(rows)


def _key(row: Mapping[str, Any]) -> tuple[float, float]:
    return round(float(row["lateral_shift_mm"]), _SAME), round(float(row["load_kN"]), _SAME)
