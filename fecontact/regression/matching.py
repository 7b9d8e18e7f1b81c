"""Matching cases by columns where their ids differ, as of quick and standard or of a new wheel and a worn one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches

from fecontact.errors import InputError
from fecontact.regression.tables import ResultTable, key_text, number
from fecontact.regression.tolerances import TEXT, kind_of

SHORT_FORMS: Mapping[str, str] = {
    "shift": "lateral_shift_mm",
    "load": "load_kN",
    "roll": "roll_mrad",
    "yaw": "yaw_mrad",
}
"""Columns that may be given by a shorter name."""

# What is given, in the order in which one thinks of it.
_POSITION = ("lateral_shift_mm", "load_kN")
_INPUTS = (*_POSITION, "rail", "wheel", "inclination_rad", "roll_mrad", "yaw_mrad", "load_kind", "resolution")
_IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
# Given only where the resolution has no name; elsewhere they come from the patch.
_SIZES = ("element_size_x_mm", "element_size_y_mm")


def match_columns(names: Sequence[str], baseline: ResultTable, new: ResultTable) -> tuple[str, ...]:
    """The columns that names stand for.

    Parameters
    ----------
    names
        Names of columns, or of `SHORT_FORMS`; blanks around them and repetitions do not matter.
    baseline, new
        Tables that both have to have the columns.

    Returns
    -------
    tuple of str
        Each column once.

    Raises
    ------
    InputError
        If a table has no such column; with the names that are close to it and all that both have.
    """
    shared = _shared(baseline, new)
    found = []
    for given in names:
        name = given.strip()
        # before the name itself: the choice of the roll is a column too, which nobody means who matches by roll
        column = next((one for one in (SHORT_FORMS.get(name), name) if one in shared), SHORT_FORMS.get(name, name))
        if column not in shared:
            lacking = [str(table.path) for table in (baseline, new) if column not in table.all_columns]
            where = " and in ".join(lacking)
            raise InputError(f"--match {name!r}: no column {column!r} in {where}; {_allowed(name, shared)}")
        found.append(column)
    return tuple(dict.fromkeys(found))


def _shared(baseline: ResultTable, new: ResultTable) -> tuple[str, ...]:
    there = set(new.all_columns)
    return tuple(column for column in baseline.all_columns if column in there)


def _allowed(name: str, shared: Sequence[str]) -> str:
    short = [form for form, column in SHORT_FORMS.items() if column in shared]
    near = get_close_matches(name, [*short, *shared], n=3)
    hint = f"did you mean {' or '.join(near)}? " if near else ""
    return f"{hint}allowed are {', '.join([*short, *shared]) or 'none, as the tables have no column in common'}"


def matched_by(table: ResultTable, columns: tuple[str, ...], other: ResultTable) -> ResultTable:
    """A table whose cases are named by the values of columns instead of by what they are named by now.

    Parameters
    ----------
    table
        Has the columns.
    columns
        Numbers are the same if nine significant digits of them are, texts letter by letter.
    other
        The table that it will be compared with, for the remedy in a message.

    Returns
    -------
    ResultTable
        The same rows in the same order; its `columns` are without those that it is matched by.

    Raises
    ------
    InputError
        If a case has no value in one of the columns, or two cases have the same values in all of them.
    """
    _check_filled(table, columns)
    names: dict[str, str] = {}
    rows: dict[str, Mapping[str, str]] = {}
    for case, row in table.rows.items():
        name = ", ".join(f"{column} {_match_text(column, row[column])}" for column in columns)
        if name in rows:
            raise InputError(
                f"results {table.path}: cases {names[name]!r} and {case!r} are both {name}; each may be there once;"
                f" {_further(rows[name], row, columns, _shared(table, other))}"
            )
        names[name], rows[name] = case, row
    return replace(table, key=columns, columns=tuple(c for c in table.columns if c not in columns), rows=rows)


def _check_filled(table: ResultTable, columns: Sequence[str]) -> None:
    for column in columns:
        without = [case for case, row in table.rows.items() if not row[column]]
        if without:
            raise InputError(
                f"results {table.path}: case {without[0]!r} has no value of {column} ({len(without)} of"
                f" {len(table.rows)} have none); each case needs one to be matched by; take {column} out of --match, or"
                " solve the case again"
            )


def _match_text(column: str, text: str) -> str:
    value = None if kind_of(column) == TEXT else number(text)
    return text if value is None else key_text(value)


def _further(one: Mapping[str, str], two: Mapping[str, str], columns: Sequence[str], shared: Sequence[str]) -> str:
    """What tells two cases apart that are the same by the columns so far."""

    def differing(candidates: Sequence[str]) -> list[str]:
        filled = [c for c in candidates if c in shared and c not in columns and one[c] and two[c]]
        return [c for c in filled if _match_text(c, one[c]) != _match_text(c, two[c])]

    # a column of no known kind may be an input of a table from elsewhere
    others = [column for column in shared if kind_of(column) == "default"]
    found = differing((*_INPUTS, *_IRREGULAR, *others)) or differing(_SIZES)
    if found:
        return f"add to --match a column in which they differ: {', '.join(found)}"
    return "they differ in no input that both tables have; remove one of them, or leave out --match"


def match_example(baseline: ResultTable, new: ResultTable) -> str:
    """Words that show how --match is used where two tables have no case in common by name.

    Parameters
    ----------
    baseline, new
        Two tables.

    Returns
    -------
    str
        With the number of cases that it finds, if any; empty if the tables have no input in common.
    """
    shared = [column for column in _INPUTS if column in _shared(baseline, new)]
    values = [
        {column: {_match_text(column, row[column]) for row in table.rows.values()} for column in shared}
        for table in (baseline, new)
    ]
    # a case that failed has no value in some
    inputs = [column for column in shared if not any("" in of[column] for of in values)]
    varied = [column for column in inputs if any(len(of[column]) > 1 for of in values)]
    # the position also where there is one only: two loads are not the same case
    position = [column for column in inputs if column in _POSITION or column in varied]
    for columns in (position, varied):
        if count := _common(tuple(columns), baseline, new):
            return f"match them by their inputs with --match {_short(columns)} ({count} in common)"
    return f"choose what to match them by, such as --match {_short(position)}" if position else ""


def _common(columns: tuple[str, ...], baseline: ResultTable, new: ResultTable) -> int:
    if not columns:
        return 0
    try:
        return len(matched_by(baseline, columns, new).rows.keys() & matched_by(new, columns, baseline).rows.keys())
    except InputError:
        return 0


def _short(columns: Sequence[str]) -> str:
    short = {column: form for form, column in SHORT_FORMS.items()}
    return ",".join(short.get(column, column) for column in columns)
