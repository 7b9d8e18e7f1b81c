"""Two tables of results compared case by case: which rows belong together, and by what tolerances they agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
import pandas

from fecontact.errors import InputError
from fecontact.regression.tables import (
    LATER,
    TEXT,
    ResultTable,
    Tolerance,
    Tolerances,
    kind_of,
    matched_text,
    named_by,
    number,
)

# --- Matching cases by columns where their ids differ, as of quick and standard or of a new wheel and a worn one.

SHORT_FORMS = {"shift": "lateral_shift_mm", "load": "load_kN", "roll": "roll_mrad", "yaw": "yaw_mrad"}
"""Columns that may be given by a shorter name."""

# What is given, in the order in which one thinks of it.
_POSITION = ("lateral_shift_mm", "load_kN")
_MATCHED_INPUTS = (*_POSITION, "rail", "wheel", "inclination_rad", "roll_mrad", "yaw_mrad", "load_kind", "resolution")
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
        inputs = (*_MATCHED_INPUTS, *_IRREGULAR, *(name for name in differing if kind_of(name) == "default"))
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
    inputs = [name for name in _MATCHED_INPUTS if all(name in rows and "" not in set(rows[name]) for rows in both)]
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


# --- Two tables of results side by side: what has changed by more than its tolerance, the worst first.


@dataclass(frozen=True, kw_only=True)
class TableComparison:
    """Everything that two tables of results have not in common.

    Data frames have a line for a value of a case in both tables: `column`, its `kind`, `case`, `baseline` and `new` as
    texts, their `difference` and the `tolerance` of it in the column's unit (NaN where a value is text or missing),
    `times_tolerance`, which is infinite where nothing is allowed, and the parts and the reason of the tolerance.

    Attributes
    ----------
    cases
        Those that both have.
    columns
        Compared columns by the case in which both tables are furthest apart, the worst first; `differing` of them are
        beyond the tolerance.
    efforts
        Columns that are only shown.
    differences
        Every value beyond its tolerance, the worst first.
    one_sided
        Missing cases and columns, which only the baseline has, and extra ones, which only the new results have.
    later_columns
        What only the new results have because the baseline was made before there were such columns.
    versions, settings
        (baseline, new) of what is recorded on both sides and is not equal.
    """

    baseline: ResultTable
    new: ResultTable
    cases: Sequence[str]
    columns: pandas.DataFrame
    efforts: pandas.DataFrame
    differences: pandas.DataFrame
    one_sided: Mapping[str, list[str]]
    later_columns: Sequence[str]
    versions: Mapping[str, tuple[str, str]]
    settings: Mapping[str, tuple[str, str]]

    @property
    def same(self) -> bool:
        """Whether both hold the same cases and columns, with all values within their tolerances."""
        return len(self.differences) == 0 and not any(self.one_sided.values())

    @property
    def verdict(self) -> str:
        """The outcome in one line."""
        common = f"{counted(len(self.cases), 'case')}, {counted(len(self.columns), 'column')}"
        if self.same:
            worst = self.columns.iloc[0]
            if worst.times_tolerance == 0.0:
                return f"SAME, all values are equal ({common})"
            closest = f"closest: {worst.column} at {worst.times_tolerance:.2g} of its tolerance"
            return f"SAME within tolerance ({common}; {closest})"
        parts = []
        if len(self.differences):
            worst = self.differences.iloc[0]
            times = (
                f" ({worst.times_tolerance:.3g} times its tolerance)" if math.isfinite(worst.times_tolerance) else ""
            )
            parts = [f"{counted(len(self.differences), 'value')} beyond tolerance", f"worst {worst.column}{times}"]
        parts += [counted(len(names), what.removesuffix("s")) for what, names in self.one_sided.items() if names]
        return f"DIFFERENT: {', '.join(parts)} ({common} in common)"


def counted(number_of: int, noun: str) -> str:
    """A number of things in words, such as "1 case" or "2 cases"."""
    return f"{number_of} {noun}{'' if number_of == 1 else 's'}"


def compare_tables(
    baseline: ResultTable, new: ResultTable, tolerances: Tolerances | None = None, *, match: Sequence[str] = ()
) -> TableComparison:
    """Compare new results with a baseline, case by case and column by column.

    Parameters
    ----------
    baseline, new
        Tables that name their cases in the same way, unless `match` is given.
    tolerances
        Those of `KINDS`, if not given.
    match
        Columns, or short forms of them, that say which case of one table is which of the other, instead of what the
        tables name their cases by. They are not compared.

    Returns
    -------
    TableComparison
        At least one case, and at least one column in one of the two.

    Raises
    ------
    InputError
        If the tables have no case in common, name their cases differently, cannot be matched by the columns of `match`,
        have nothing else than these, or a tolerance is for a column that is not compared.
    """
    tolerances = tolerances or Tolerances()
    if match:
        by = match_columns(match, baseline, new)
        baseline, new = matched_by(baseline, by, new), matched_by(new, by, baseline)
    was, now = baseline.rows, new.rows
    cases = [case for case in was.index if case in now.index]
    if not cases:
        remedy = "choose fewer or other columns for --match"
        if not match:
            remedy = f"compare results of the same study, at the same size{match_example(baseline, new)}"
        raise InputError(
            f"{baseline.path} and {new.path} have no case in common (such as {was.index[0]} and"
            f" {now.index[0]}); {remedy}"
        )
    _check_columns(baseline, new, tolerances)
    columns = [name for name in baseline.columns if name in now]
    values = _values(was.loc[cases, columns], now.loc[cases, columns], tolerances)
    # where nothing is allowed the size of the difference decides
    size = values.difference.abs().fillna(0.0).sort_values(ascending=False, kind="stable")
    worst = _worst_first(values.loc[size.index]).drop_duplicates("column").sort_index()
    beyond = values[values.times_tolerance > 1.0]
    worst["differing"] = worst.column.map(beyond.column.value_counts()).fillna(0).astype(int)
    missing, extra = (
        [name for name in here.columns if name not in there.rows and tolerances.compares(name)]
        for here, there in ((baseline, new), (new, baseline))
    )
    # a baseline that has one of a kind knows them all
    later = tuple(kind for kind in LATER if not any(name.startswith(kind) for name in was))
    shown = [name for name in worst.column if not tolerances.compares(name)]
    return TableComparison(
        baseline=baseline,
        new=new,
        cases=cases,
        columns=_worst_first(worst[~worst.column.isin(shown)]),
        efforts=worst[worst.column.isin(shown)].assign(tolerance=math.nan, times_tolerance=math.nan, differing=None),
        differences=_worst_first(beyond[~beyond.column.isin(shown)]),
        one_sided={
            "missing cases": [case for case in was.index if case not in now.index],
            "extra cases": [case for case in now.index if case not in was.index],
            "missing columns": missing,
            "extra columns": [name for name in extra if not name.startswith(later)],
        },
        later_columns=[name for name in extra if name.startswith(later)],
        versions=_unequal(baseline.versions, new.versions),
        settings=_unequal(baseline.settings, new.settings),
    )


def _check_columns(baseline: ResultTable, new: ResultTable, tolerances: Tolerances) -> None:
    columns = dict.fromkeys((*baseline.columns, *new.columns))
    for name in tolerances.columns:
        if name not in columns:
            known = ", ".join(columns)
            raise InputError(f"tolerance of column {name!r}: it is not compared; columns that are: {known}")
    if not any(map(tolerances.compares, columns)):
        raise InputError(
            f"{baseline.path} and {new.path} have no column to compare besides {' and '.join(baseline.key)};"
            " give tables with results, or fewer columns to match by"
        )


def _unequal(baseline: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    return {name: (text, new[name]) for name, text in baseline.items() if name in new and new[name] != text}


def _worst_first(values: pandas.DataFrame) -> pandas.DataFrame:
    return values.sort_values("times_tolerance", ascending=False, kind="stable")


def _values(baseline: pandas.DataFrame, new: pandas.DataFrame, tolerances: Tolerances) -> pandas.DataFrame:
    """Each value of two tables that have the same cases and columns, column by column."""
    values = pandas.DataFrame(
        {
            "column": [name for name in baseline for _ in baseline.index],
            "case": [case for _ in baseline for case in baseline.index],
            "baseline": baseline.to_numpy().ravel("F"),
            "new": new.to_numpy().ravel("F"),
        }
    )
    own = {name: tolerances.of(name) or Tolerance() for name in baseline}
    kinds = pandas.DataFrame(
        [(name, kind_of(name), one.relative, one.absolute, one.reason) for name, one in own.items()],
        columns=["column", "kind", "relative", "absolute", "reason"],
    )
    values = values.merge(kinds, on="column")
    was, now = (values[side].where(values.kind != TEXT, "").map(number).astype(float) for side in ("baseline", "new"))
    # infinite minus infinite is no number, though both are the same
    difference = (now - was).mask(was == now, 0.0)
    # nothing is allowed beside an infinite value
    allowed = np.maximum(values.absolute, values.relative * was.abs()).where(np.isfinite(was), 0.0)
    of_texts = (values.baseline != values.new).map({False: 0.0, True: math.inf})
    excess = (difference.abs() / allowed).mask(difference == 0.0, 0.0).where(difference.notna(), of_texts)
    return values.assign(difference=difference, tolerance=allowed.where(difference.notna()), times_tolerance=excess)
