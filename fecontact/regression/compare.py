"""Comparison of two tables of results case by case: matching of rows, and agreement within tolerances."""

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

# --- Matching cases by columns if their ids differ, such as quick and standard, or a new and a worn wheel.

SHORT_FORMS = {"shift": "lateral_shift_mm", "load": "load_kN", "roll": "roll_mrad", "yaw": "yaw_mrad"}
"""Short names of columns."""

# Inputs of a position, in their usual order.
_POSITION, _VERDICT = ("lateral_shift_mm", "load_kN"), "verdict_answer"
_MATCHED_INPUTS = (*_POSITION, "rail", "wheel", "inclination_rad", "roll_mrad", "yaw_mrad", "load_kind", "resolution")
_IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
# Ends of names: the measure of a verdict that uses most of its limit, and the share of the limit that it uses.
_MEASURE, _SHARES = "verdict_measure", ("limit_used", "verdict_limit_used")
# Inputs only if the resolution has no name; else they follow from the patch.
_SIZES = ("solver_element_size_mm_x", "solver_element_size_mm_y")


def match_columns(names: Sequence[str], baseline: ResultTable, new: ResultTable) -> list[str]:
    """The columns, each once, for names of columns or short names of `SHORT_FORMS`.

    Raises
    ------
    InputError
        If a table has no such column; the message gives similar names and all common columns.
    """
    shared = [column for column in baseline.rows if column in new.rows]
    columns = []
    for name in map(str.strip, names):
        # the short form comes first: there is also a column `roll`, the choice of the roll, which is not meant here
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
    """A table whose cases are named by the values of some columns, for a comparison with another; these are dropped.

    Raises
    ------
    InputError
        If a case has no value in one of the columns, or two cases have the same values in all of them.
    """

    def further(two: pandas.DataFrame) -> str:
        """Hint how to tell apart two cases that have the same values in the columns so far."""
        filled = [name for name in two if name in other.rows and name not in columns and "" not in set(two[name])]
        differing = [name for name in filled if _count(two, name) > 1]
        # a column without a known kind may be an input in a table from another program
        inputs = (*_MATCHED_INPUTS, *_IRREGULAR, *(name for name in differing if kind_of(name) == "default"))
        hints = [name for name in inputs if name in differing] or [name for name in _SIZES if name in differing]
        if hints:
            return f"add to --match a column in which they differ: {', '.join(hints)}"
        return "they differ in no input that both tables have; remove one of them, or leave out --match"

    rows = named_by(table.path, table.rows, columns, further).drop(columns=list(columns))
    return replace(table, key=tuple(columns), rows=rows)


def _count(rows: pandas.DataFrame, column: str) -> int:
    return int(matched_text(column, rows[column]).nunique())


def match_example(baseline: ResultTable, new: ResultTable) -> str:
    """Hint how to use --match for two tables without a common case name.

    The hint says how many cases --match finds, if any; it is empty if the tables have no input in common.
    """
    both = baseline.rows, new.rows
    # a failed case has no value of some inputs
    inputs = [name for name in _MATCHED_INPUTS if all(name in rows and "" not in set(rows[name]) for rows in both)]
    varied = [name for name in inputs if any(_count(rows, name) > 1 for rows in both)]
    # the position is kept also if it does not vary: two loads are not the same case
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


# --- Comparison of two tables of results: changes beyond the tolerance, the worst first.


@dataclass(frozen=True, kw_only=True)
class TableComparison:
    """Differences of two tables of results.

    Data frames have a line for each value of a case in both tables: `column`, its `kind`, `case`, `baseline` and `new`
    as texts, their `difference` and its `tolerance` in the column's unit (NaN if a value is text or missing),
    `times_tolerance`, which is infinite if no difference is allowed, and the parts and the reason of the tolerance.

    Attributes
    ----------
    cases
        Cases in both tables.
    columns
        Compared columns, each with the case in which the tables differ most, the worst first; `differing` columns are
        beyond the tolerance.
    efforts
        Columns that are shown and not compared.
    differences
        Every value beyond its tolerance, the worst first.
    one_sided
        Missing cases and columns, which only the baseline has, and extra cases and columns in the new results only.
    later_columns
        Columns in the new results only, because the baseline is older than these columns.
    versions, settings
        (baseline, new) of each entry that is recorded on both sides and not equal.
    verdicts
        Of each case in both tables its `lateral_shift_mm` and `load_kN`, and Hertz's verdicts `baseline` and `new`,
        `failed` where there is none; empty for tables without shifts, loads or verdicts.
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
    verdicts: pandas.DataFrame

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
        Tolerances; `KINDS` if not given.
    match
        Columns, or their short forms, by which cases of both tables are matched instead of by name. These columns are
        not compared.

    Returns
    -------
    TableComparison
        With at least one case, and at least one column that is compared or shown.

    Raises
    ------
    InputError
        If the tables have no case in common, name their cases differently, cannot be matched by the columns of `match`,
        have no other columns, or a tolerance is for a column that is not compared.
    """
    tolerances, places = tolerances or Tolerances(), baseline.rows
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
    # if no difference is allowed, the size of the difference decides
    size = values.difference.abs().fillna(0.0).sort_values(ascending=False, kind="stable")
    worst = _worst_first(values.loc[size.index]).drop_duplicates("column").sort_index()
    beyond = values[values.times_tolerance > 1.0]
    worst["differing"] = worst.column.map(beyond.column.value_counts()).fillna(0).astype(int)
    missing, extra = (
        [name for name in here.columns if name not in there.rows and tolerances.compares(name)]
        for here, there in ((baseline, new), (new, baseline))
    )
    # a baseline with one column of a kind is not older than this kind
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
        verdicts=_verdicts(places.set_axis(was.index), now, cases),
    )


def _verdicts(was: pandas.DataFrame, now: pandas.DataFrame, cases: Sequence[str]) -> pandas.DataFrame:
    """Both verdicts of each case, at its shift and load."""
    if not {*_POSITION, _VERDICT} <= {*was} or _VERDICT not in now:
        return pandas.DataFrame()
    places = {name: was.loc[cases, name].map(number) for name in _POSITION}
    answers = {
        side: rows.loc[cases, _VERDICT].replace("", "failed") for side, rows in (("baseline", was), ("new", now))
    }
    return pandas.DataFrame({**places, **answers}).rename_axis(None)


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
    """Differences of two tables that have the same cases and columns, column by column."""
    values = pandas.DataFrame(
        {
            "column": [name for name in baseline for _ in baseline.index],
            "case": [case for _ in baseline for case in baseline.index],
            "baseline": baseline.to_numpy().ravel("F"),
            "new": new.to_numpy().ravel("F"),
        }
    )
    by_column = {name: tolerances.of(name) or Tolerance() for name in baseline}
    kinds = pandas.DataFrame(
        [(name, kind_of(name), one.relative, one.absolute, one.reason) for name, one in by_column.items()],
        columns=["column", "kind", "relative", "absolute", "reason"],
    )
    values = values.merge(kinds, on="column")
    was, now = (values[side].where(values.kind != TEXT, "").map(number).astype(float) for side in ("baseline", "new"))
    # infinite minus infinite is NaN, though both are equal
    difference = (now - was).mask(was == now, 0.0)
    # no difference from an infinite value is allowed
    allowed = np.maximum(values.absolute, values.relative * was.abs()).where(np.isfinite(was), 0.0)
    of_texts = (values.baseline != values.new).map({False: 0.0, True: math.inf})
    excess = (difference.abs() / allowed).mask(difference == 0.0, 0.0).where(difference.notna(), of_texts)
    return _with_ties(
        values.assign(difference=difference, tolerance=allowed.where(difference.notna()), times_tolerance=excess)
    )


def _with_ties(values: pandas.DataFrame) -> pandas.DataFrame:
    """The measure that uses most of its limit may be another one where two of them use as much of their limits.

    So it is, if the share of the limit is the same within its tolerance. What the measures say is compared by itself.
    """
    times = values.set_index(["column", "case"]).times_tolerance
    for line in values.index[values.column.str.endswith(_MEASURE) & (values.times_tolerance > 1.0)]:
        name, case = values.column[line].removesuffix(_MEASURE), values.case[line]
        if any(times.get((name + share, case), math.inf) <= 1.0 for share in _SHARES):
            values.loc[line, "times_tolerance"] = 1.0
    return values
