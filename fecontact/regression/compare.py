"""Two tables of results side by side: what has changed by more than its tolerance, the worst first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas

from fecontact.errors import InputError
from fecontact.regression.matching import match_columns, match_example, matched_by
from fecontact.regression.tables import ResultTable, number
from fecontact.regression.tolerances import LATER, TEXT, Tolerance, Tolerances, kind_of


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
