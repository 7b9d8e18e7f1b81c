"""Matching cases by columns where their ids differ, as of quick and standard or of a new wheel and a worn one."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from difflib import get_close_matches

import pandas

from fecontact.errors import InputError
from fecontact.regression.tables import ResultTable, matched_text, named_by
from fecontact.regression.tolerances import kind_of

SHORT_FORMS = {"shift": "lateral_shift_mm", "load": "load_kN", "roll": "roll_mrad", "yaw": "yaw_mrad"}
"""Columns that may be given by a shorter name."""

# What is given, in the order in which one thinks of it.
_POSITION = ("lateral_shift_mm", "load_kN")
_INPUTS = (*_POSITION, "rail", "wheel", "inclination_rad", "roll_mrad", "yaw_mrad", "load_kind", "resolution")
_IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
# Given only where the resolution has no name; elsewhere they come from the patch.
_SIZES = ("solver_element_size_mm_x", "solver_element_size_mm_y")


def match_columns(names: Sequence[str], baseline: ResultTable, new: ResultTable) -> list[str]:
    """The columns, each once, that names of columns or of `SHORT_FORMS` stand for.

    Raises
    ------
    InputError
        If a table has no such column; with the names that are close to it and all that both have.
    """
    shared = [column for column in baseline.rows if column in new.rows]
    columns = []
    for name in map(str.strip, names):
        # before the name itself: the choice of the roll is a column too, which nobody means who matches by roll
        column = SHORT_FORMS.get(name, name)
        if column not in shared and name in shared:
            column = name
        if column not in shared:
            lacking = " and in ".join(str(table.path) for table in (baseline, new) if column not in table.rows)
            allowed = [*(form for form, full in SHORT_FORMS.items() if full in shared), *shared]
            near = get_close_matches(name, allowed, n=3)
            hint = f"did you mean {' or '.join(near)}? " if near else ""
            raise InputError(
                f"--match {name!r}: no column {column!r} in {lacking}; {hint}allowed are"
                f" {', '.join(allowed) or 'none, as the tables have no column in common'}"
            )
        columns.append(column)
    return list(dict.fromkeys(columns))


def matched_by(table: ResultTable, columns: Sequence[str], other: ResultTable) -> ResultTable:
    """A table whose cases are named by the values of columns, which it is without, as it will be compared with another.

    Raises
    ------
    InputError
        If a case has no value in one of the columns, or two cases have the same values in all of them.
    """

    def further(two: pandas.DataFrame) -> str:
        """What tells two cases apart that are the same by the columns so far."""
        filled = [name for name in two if name in other.rows and name not in columns and "" not in set(two[name])]
        differing = [name for name in filled if _count(two, name) > 1]
        # a column of no known kind may be an input of a table from elsewhere
        inputs = (*_INPUTS, *_IRREGULAR, *(name for name in differing if kind_of(name) == "default"))
        found = [name for name in inputs if name in differing] or [name for name in _SIZES if name in differing]
        if found:
            return f"add to --match a column in which they differ: {', '.join(found)}"
        return "they differ in no input that both tables have; remove one of them, or leave out --match"

    rows = named_by(table.path, table.rows, columns, further).drop(columns=list(columns))
    return replace(table, key=tuple(columns), rows=rows)


def _count(rows: pandas.DataFrame, column: str) -> int:
    return int(matched_text(column, rows[column]).nunique())


def match_example(baseline: ResultTable, new: ResultTable) -> str:
    """Words that show how --match is used where two tables have no case in common by name.

    They have the number of cases that it finds, if any; they are empty if the tables have no input in common.
    """
    both = baseline.rows, new.rows
    # a case that failed has no value in some
    inputs = [name for name in _INPUTS if all(name in rows and "" not in set(rows[name]) for rows in both)]
    varied = [name for name in inputs if any(_count(rows, name) > 1 for rows in both)]
    # the position also where there is one only: two loads are not the same case
    position = [name for name in inputs if name in _POSITION or name in varied]
    short = {column: form for form, column in SHORT_FORMS.items()}
    for columns in filter(None, (position, varied)):
        by = ",".join(short.get(name, name) for name in columns)
        with suppress(InputError):
            common = set(matched_by(baseline, columns, new).rows.index) & set(
                matched_by(new, columns, baseline).rows.index
            )
            if common:
                return f", or match them by their inputs with --match {by} ({len(common)} in common)"
    return (
        f", or choose what to match them by, such as --match {','.join(short.get(name, name) for name in position)}"
        if position
        else ""
    )
