"""Comparison of two tables of results case by case: matched rows, and agreement within tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
import pandas

from fecontact.errors import InputError
from fecontact.files import OWN_FUNCTIONS_SETTING
from fecontact.inputs.texts import count_text
from fecontact.regression.tables import (
    LATER_COLUMN_PREFIXES,
    OWN_LIMITS_SETTING,
    TEXT_KIND,
    ResultTable,
    Tolerance,
    Tolerances,
    find_kind,
    name_rows,
    normalise_for_match,
    parse_number,
)

# --- Matching cases by columns if their ids differ, such as quick and standard, or a new and a worn wheel.

SHORT_FORMS = {"shift": "lateral_shift_mm", "load": "load_kN", "roll": "roll_mrad", "yaw": "yaw_mrad"}
"""Short names of columns."""

# Inputs of a position, in their usual order.
_POSITION_COLUMNS, _VERDICT_COLUMN = ("lateral_shift_mm", "load_kN"), "verdict_answer"
_YAW_COLUMN = SHORT_FORMS["yaw"]
_MATCH_COLUMNS = (
    *_POSITION_COLUMNS,
    "rail",
    "wheel",
    "inclination_rad",
    "roll_mrad",
    "yaw_mrad",
    "load_kind",
    "resolution",
)
_IRREGULARITY_COLUMNS = ("rail_irregularity", "wheel_irregularity", "distance_mm")
# Ends of column names: the measure with the largest limit utilisation in a verdict, and that limit utilisation.
_MEASURE_SUFFIX, _UTILISATION_SUFFIXES = "verdict_measure", ("limit_utilisation", "verdict_limit_utilisation")
# Settings of tables that record their criteria: studies and cases, and maps.
_LIMITS_SETTINGS = {"limits", "criteria.p_max"}
# These are inputs only if the resolution has no name; else they follow from the patch.
_ELEMENT_SIZE_COLUMNS = ("solver_element_size_mm_x", "solver_element_size_mm_y")


def match_columns(names: Sequence[str], baseline: ResultTable, new: ResultTable) -> list[str]:
    """Columns for names of columns or short names of `SHORT_FORMS`.

    Parameters
    ----------
    names
        Names of columns, or short names.
    baseline, new
        Tables that must both have the columns.

    Returns
    -------
    columns
        Each column once, in the order of the names.

    Raises
    ------
    InputError
        If a table has no such column. The message gives similar names and all common columns.
    """
    shared = [column for column in baseline.rows if column in new.rows]
    columns = []
    for name in map(str.strip, names):
        # The short form comes first: there is also a column `roll`, the choice of the roll, which is not meant here.
        column = SHORT_FORMS.get(name, name)
        if column not in shared and name in shared:
            column = name
        if column not in shared:
            lacking = " and in ".join(str(table.path) for table in (baseline, new) if column not in table.rows)
            allowed_names = [*(form for form, full in SHORT_FORMS.items() if full in shared), *shared]
            near = get_close_matches(name, allowed_names, n=3)
            hint = f"did you mean {' or '.join(near)}? " if near else ""
            raise InputError(
                f"--match {name!r}: no column {column!r} in {lacking}; {hint}allowed:"
                f" {', '.join(allowed_names) or 'none, because the tables have no column in common'}"
            )
        columns.append(column)
    return list(dict.fromkeys(columns))


def match_cases(table: ResultTable, columns: Sequence[str], other_table: ResultTable) -> ResultTable:
    """Name the cases of a table by the values of some columns.

    This is for a comparison with another table. These columns are dropped.

    Parameters
    ----------
    table
        Table of results.
    columns
        Columns that name the cases.
    other_table
        The other table of the comparison, for advice in messages.

    Returns
    -------
    ResultTable
        The table with new names of its cases, without the columns.

    Raises
    ------
    InputError
        If a case has no value in a column, or two cases have equal values in all columns.
    """

    def advise_columns(two: pandas.DataFrame) -> str:
        """Advice how to distinguish two cases with equal values in the columns."""
        filled = [name for name in two if name in other_table.rows and name not in columns and "" not in set(two[name])]
        differing = [name for name in filled if _count_values(two, name) > 1]
        # A column without a known kind may be an input in a table from another program.
        inputs = (
            *_MATCH_COLUMNS,
            *_IRREGULARITY_COLUMNS,
            *(name for name in differing if find_kind(name) == "default"),
        )
        hints = [name for name in inputs if name in differing] or [
            name for name in _ELEMENT_SIZE_COLUMNS if name in differing
        ]
        if hints:
            return f"add to --match a column in which they differ: {', '.join(hints)}"
        return "no input in both tables distinguishes them; remove one of them, or leave out --match"

    rows = name_rows(table.path, table.rows, columns, advise_columns).drop(columns=list(columns))
    return replace(table, key=tuple(columns), rows=rows)


def _count_values(rows: pandas.DataFrame, column: str) -> int:
    """Number of different values of a column."""
    return int(normalise_for_match(column, rows[column]).nunique())


def suggest_match(baseline: ResultTable, new: ResultTable) -> str:
    """Advice how to use --match for two tables without a common case name.

    Parameters
    ----------
    baseline, new
        Tables of results.

    Returns
    -------
    advice
        Text with the number of cases that --match finds, if any. It is empty if the tables have no input in common.
    """
    tables = baseline.rows, new.rows
    # A failed case has no value of some inputs.
    inputs = [name for name in _MATCH_COLUMNS if all(name in rows and "" not in set(rows[name]) for rows in tables)]
    varied = [name for name in inputs if any(_count_values(rows, name) > 1 for rows in tables)]
    # The position is kept also if it does not vary: two loads are different cases.
    position = [name for name in inputs if name in _POSITION_COLUMNS or name in varied]
    short = {column: form for form, column in SHORT_FORMS.items()}
    for columns in filter(None, (position, varied)):
        match_text = ",".join(short.get(name, name) for name in columns)
        with suppress(InputError):
            common = set(match_cases(baseline, columns, new).rows.index) & set(
                match_cases(new, columns, baseline).rows.index
            )
            if common:
                return f", or match the cases by inputs with --match {match_text} ({len(common)} in common)"
    return (
        f", or choose columns to match by, such as --match {','.join(short.get(name, name) for name in position)}"
        if position
        else ""
    )


# --- Comparison of two tables of results: changes beyond the tolerance, the worst first.


@dataclass(frozen=True, kw_only=True)
class TableComparison:
    """Differences of two tables of results.

    Data frames have a row for each value of a case in both tables: `column`, its `kind`, `case`, `baseline` and `new`
    as texts, their `difference` and its `tolerance` in the column's unit (NaN if a value is text or missing),
    `times_tolerance`, which is infinite if no difference is allowed, and the parts and the reason of the tolerance.

    Attributes
    ----------
    baseline, new
        The two tables.
    cases
        Cases in both tables.
    columns
        Compared columns, each with the case of the largest difference, the worst first. `differing` is the number of
        values beyond the tolerance.
    efforts
        Columns that are shown and not compared.
    differences
        Every value beyond its tolerance, the worst first.
    one_sided
        Missing cases and columns, which only the baseline has, and extra cases and columns, which only the new results
        have.
    later_columns
        Columns in the new results only, because the baseline is older than these columns.
    versions, settings
        (baseline, new) of each entry that is recorded on both sides and differs.
    verdicts
        For each case in both tables its `lateral_shift_mm` and `load_kN`, `yaw_mrad` if there are several yaws, and
        Hertz's verdicts `baseline` and `new`, `failed` without a verdict. It is empty for tables without shifts, loads
        or verdicts.
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
        """Whether both tables have equal cases and columns, with all values within their tolerances."""
        return len(self.differences) == 0 and not any(self.one_sided.values())

    @property
    def verdict(self) -> str:
        """The outcome in a single line."""
        common_text = f"{count_text(len(self.cases), 'case')}, {count_text(len(self.columns), 'column')}"
        if self.same:
            worst = self.columns.iloc[0]
            if worst.times_tolerance == 0.0:
                return f"SAME, all values are equal ({common_text})"
            closest = f"closest: {worst.column} at {worst.times_tolerance:.2g} of its tolerance"
            return f"SAME within tolerance ({common_text}; {closest})"
        outcomes = []
        if len(self.differences):
            worst = self.differences.iloc[0]
            times_text = (
                f" ({worst.times_tolerance:.3g} times its tolerance)" if math.isfinite(worst.times_tolerance) else ""
            )
            outcomes = [
                f"{count_text(len(self.differences), 'value')} beyond tolerance",
                f"worst {worst.column}{times_text}",
            ]
        outcomes += [
            count_text(len(names), side_name.removesuffix("s")) for side_name, names in self.one_sided.items() if names
        ]
        return f"DIFFERENT: {', '.join(outcomes)} ({common_text} in common)"


def compare_tables(
    baseline: ResultTable, new: ResultTable, tolerances: Tolerances | None = None, *, match: Sequence[str] = ()
) -> TableComparison:
    """Compare new results with a baseline, case by case and column by column.

    Parameters
    ----------
    baseline, new
        Tables with equal names for equal cases, unless `match` is given.
    tolerances
        Tolerances; `TOLERANCES_BY_KIND` if not given.
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
        match_names = match_columns(match, baseline, new)
        baseline, new = match_cases(baseline, match_names, new), match_cases(new, match_names, baseline)
    was, now = baseline.rows, new.rows
    cases = [case for case in was.index if case in now.index]
    if not cases:
        remedy = "choose fewer or different columns for --match"
        if not match:
            remedy = (
                f"compare results of the same study, both with or both without --quick{suggest_match(baseline, new)}"
            )
        raise InputError(
            f"{baseline.path} and {new.path} have no case in common (such as {was.index[0]} and"
            f" {now.index[0]}); {remedy}"
        )
    _check_columns(baseline, new, tolerances)
    columns = [name for name in baseline.columns if name in now]
    values = _compare_values(was.loc[cases, columns], now.loc[cases, columns], tolerances)
    # If no difference is allowed, the size of the difference decides.
    size = values.difference.abs().fillna(0.0).sort_values(ascending=False, kind="stable")
    worst = _sort_worst_first(values.loc[size.index]).drop_duplicates("column").sort_index()
    differing = values[values.times_tolerance > 1.0]
    worst["differing"] = worst.column.map(differing.column.value_counts()).fillna(0).astype(int)
    missing, extra = (
        [name for name in table.columns if name not in other_table.rows and tolerances.compares(name)]
        for table, other_table in ((baseline, new), (new, baseline))
    )
    # A baseline with any column of a kind is not older than this kind.
    later = tuple(kind for kind in LATER_COLUMN_PREFIXES if not any(name.startswith(kind) for name in was))
    effort_columns = [name for name in worst.column if not tolerances.compares(name)]
    return TableComparison(
        baseline=baseline,
        new=new,
        cases=cases,
        columns=_sort_worst_first(worst[~worst.column.isin(effort_columns)]),
        efforts=worst[worst.column.isin(effort_columns)].assign(
            tolerance=math.nan, times_tolerance=math.nan, differing=None
        ),
        differences=_sort_worst_first(differing[~differing.column.isin(effort_columns)]),
        one_sided={
            "missing cases": [case for case in was.index if case not in now.index],
            "extra cases": [case for case in now.index if case not in was.index],
            "missing columns": missing,
            "extra columns": [name for name in extra if not name.startswith(later)],
        },
        later_columns=[name for name in extra if name.startswith(later)],
        versions=_find_changes(baseline.versions, new.versions),
        settings=_find_changes(*_complete_own_settings(baseline.settings, new.settings)),
        verdicts=_verdict_table(places.set_axis(was.index), now, cases),
    )


def _verdict_table(was: pandas.DataFrame, now: pandas.DataFrame, cases: Sequence[str]) -> pandas.DataFrame:
    """Both verdicts of each case, at its shift, load and yaw."""
    if not {*_POSITION_COLUMNS, _VERDICT_COLUMN} <= {*was} or _VERDICT_COLUMN not in now:
        return pandas.DataFrame()
    # the yaw is part of the place in maps of several yaws
    has_yaws = _YAW_COLUMN in was and _count_values(was, _YAW_COLUMN) > 1
    columns = (*_POSITION_COLUMNS, *[_YAW_COLUMN] * has_yaws)
    places = {name: was.loc[cases, name].map(parse_number) for name in columns}
    answers = {
        side: rows.loc[cases, _VERDICT_COLUMN].replace("", "failed") for side, rows in (("baseline", was), ("new", now))
    }
    return pandas.DataFrame({**places, **answers}).rename_axis(None)


def _check_columns(baseline: ResultTable, new: ResultTable, tolerances: Tolerances) -> None:
    """Refuse tolerances of missing columns, and tables without a column to compare."""
    columns = dict.fromkeys((*baseline.columns, *new.columns))
    for name in tolerances.columns:
        if name not in columns:
            column_names = ", ".join(columns)
            raise InputError(f"tolerance of column {name!r}: this column is not compared; allowed: {column_names}")
    if not any(map(tolerances.compares, columns)):
        raise InputError(
            f"{baseline.path} and {new.path} have no column to compare except {' and '.join(baseline.key)};"
            " give tables with results, or match by fewer columns"
        )


def _find_changes(baseline: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Entries (baseline, new) that are in both documents and differ."""
    return {name: (text, new[name]) for name, text in baseline.items() if name in new and new[name] != text}


def _complete_own_settings(*settings_of_tables: Mapping[str, str]) -> list[dict[str, str]]:
    """Settings of two tables with entries for all criteria of a user.

    An entry is `none` if its table does not have the criterion.

    A table whose limits are not recorded is unchanged.
    """
    own_names = [
        name
        for settings in settings_of_tables
        for name in settings
        if name.startswith((f"{OWN_FUNCTIONS_SETTING}.", f"{OWN_LIMITS_SETTING}."))
    ]
    return [
        {**dict.fromkeys(own_names, "none"), **settings} if _LIMITS_SETTINGS & settings.keys() else dict(settings)
        for settings in settings_of_tables
    ]


def _sort_worst_first(values: pandas.DataFrame) -> pandas.DataFrame:
    """Values with the largest difference per tolerance first."""
    return values.sort_values("times_tolerance", ascending=False, kind="stable")


def _compare_values(baseline: pandas.DataFrame, new: pandas.DataFrame, tolerances: Tolerances) -> pandas.DataFrame:
    """Differences of two tables with equal cases and columns, column by column.

    The result has a row for each case and column, with both values, the tolerance, and the difference as a multiple of
    its tolerance.
    """
    values = pandas.DataFrame(
        {
            "column": [name for name in baseline for _ in baseline.index],
            "case": [case for _ in baseline for case in baseline.index],
            "baseline": baseline.to_numpy().ravel("F"),
            "new": new.to_numpy().ravel("F"),
        }
    )
    tolerance_by_column = {name: tolerances.of(name) or Tolerance() for name in baseline}
    kinds = pandas.DataFrame(
        [
            (name, find_kind(name), tolerance.relative, tolerance.absolute, tolerance.reason)
            for name, tolerance in tolerance_by_column.items()
        ],
        columns=["column", "kind", "relative", "absolute", "reason"],
    )
    values = values.merge(kinds, on="column")
    was, now = (
        values[side].where(values.kind != TEXT_KIND, "").map(parse_number).astype(float) for side in ("baseline", "new")
    )
    # infinite minus infinite is NaN, though both are equal
    difference = (now - was).mask(was == now, 0.0)
    # No difference from an infinite value is allowed.
    allowed_difference = np.maximum(values.absolute, values.relative * was.abs()).where(np.isfinite(was), 0.0)
    text_excess = (values.baseline != values.new).map({False: 0.0, True: math.inf})
    excess = (difference.abs() / allowed_difference).mask(difference == 0.0, 0.0).where(difference.notna(), text_excess)
    return _accept_ties(
        values.assign(
            difference=difference, tolerance=allowed_difference.where(difference.notna()), times_tolerance=excess
        )
    )


def _accept_ties(values: pandas.DataFrame) -> pandas.DataFrame:
    """Accept another measure of a verdict if two measures have nearly equal limit utilisation.

    They do if the limit utilisation is equal within its tolerance. The values of the measures are compared separately.
    """
    times_tolerance = values.set_index(["column", "case"]).times_tolerance
    for row in values.index[values.column.str.endswith(_MEASURE_SUFFIX) & (values.times_tolerance > 1.0)]:
        name, case = values.column[row].removesuffix(_MEASURE_SUFFIX), values.case[row]
        if any(times_tolerance.get((name + suffix, case), math.inf) <= 1.0 for suffix in _UTILISATION_SUFFIXES):
            values.loc[row, "times_tolerance"] = 1.0
    return values
