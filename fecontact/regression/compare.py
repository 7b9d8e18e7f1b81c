"""Two tables of results side by side: what has changed by more than its tolerance, the worst first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from fecontact.errors import InputError
from fecontact.regression.matching import match_columns, match_example, matched_by
from fecontact.regression.tables import ResultTable, number
from fecontact.regression.tolerances import EFFORT, LATER, TEXT, Tolerance, Tolerances, kind_of


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One value of one case in both tables.

    Attributes
    ----------
    difference, allowed
        Numbers in the column's unit; None where a value is text or missing.
    excess
        Difference over what is allowed; infinite where nothing is allowed.
    """

    column: str
    case: str
    baseline: str
    new: str
    difference: float | None
    allowed: float | None
    excess: float


@dataclass(frozen=True, kw_only=True)
class ColumnComparison:
    """A column over all common cases: kind, tolerance, how many differ, and where the two are furthest apart."""

    column: str
    kind: str
    tolerance: Tolerance | None
    compared: bool
    cases: int
    differing: int
    worst: Difference

    @property
    def unchanged(self) -> bool:
        """Whether all values are equal, as numbers where they are numbers."""
        return self.worst.excess == 0.0


@dataclass(frozen=True, kw_only=True)
class TableComparison:
    """Everything that two tables of results have not in common.

    Attributes
    ----------
    cases
        Those that both have.
    columns
        Compared columns, the worst first.
    efforts
        Columns that are only shown.
    differences
        Every value beyond its tolerance, the worst first.
    missing_cases, extra_cases, missing_columns, extra_columns
        What only the baseline has, and what only the new results have.
    later_columns
        What only the new results have because the baseline was made before there were such columns.
    versions, settings
        (baseline, new) of what is recorded on both sides and is not equal.
    """

    baseline: ResultTable
    new: ResultTable
    cases: tuple[str, ...]
    columns: tuple[ColumnComparison, ...]
    efforts: tuple[ColumnComparison, ...]
    differences: tuple[Difference, ...]
    missing_cases: tuple[str, ...]
    extra_cases: tuple[str, ...]
    missing_columns: tuple[str, ...]
    extra_columns: tuple[str, ...]
    later_columns: tuple[str, ...]
    versions: Mapping[str, tuple[str, str]]
    settings: Mapping[str, tuple[str, str]]

    @property
    def same(self) -> bool:
        """Whether both hold the same cases and columns, with all values within their tolerances."""
        one_sided = self.missing_cases, self.extra_cases, self.missing_columns, self.extra_columns
        return not self.differences and not any(one_sided)

    @property
    def unknown_columns(self) -> tuple[str, ...]:
        """Columns that were compared with the default tolerance."""
        return tuple(c.column for c in self.columns if c.kind == "default")

    @property
    def verdict(self) -> str:
        """The outcome in one line."""
        common = f"{counted(len(self.cases), 'case')}, {counted(len(self.columns), 'column')}"
        if self.same:
            worst = self.columns[0]
            if worst.unchanged:
                return f"SAME, all values are equal ({common})"
            near = f"closest: {worst.column} at {worst.worst.excess:.2g} of its tolerance"
            return f"SAME within tolerance ({common}; {near})"
        parts = []
        if self.differences:
            first = self.differences[0]
            parts = [f"{counted(len(self.differences), 'value')} beyond tolerance"]
            parts.append(f"worst {first.column}{_times(first.excess)}")
        for what in ("missing case", "extra case", "missing column", "extra column"):
            if count := len(getattr(self, f"{what.replace(' ', '_')}s")):
                parts.append(counted(count, what))
        return f"DIFFERENT: {', '.join(parts)} ({common} in common)"


def counted(number_of: int, noun: str) -> str:
    """A number of things in words, such as "1 case" or "2 cases"."""
    return f"{number_of} {noun}{'' if number_of == 1 else 's'}"


def _times(excess: float) -> str:
    return f" ({excess:.3g} times its tolerance)" if math.isfinite(excess) else ""


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
        columns_of_match = match_columns(match, baseline, new)
        baseline, new = matched_by(baseline, columns_of_match, new), matched_by(new, columns_of_match, baseline)
    common = _common_cases(baseline, new, matched=bool(match))
    extra = _only_compared(new.columns, baseline.columns, tolerances)
    # a baseline that has one column of a kind knows them all
    later = tuple(kind for kind in LATER if not any(name.startswith(kind) for name in baseline.columns))
    _check_columns(tolerances, baseline, new)
    shared = [name for name in baseline.columns if name in new.columns]
    columns = [_compare_column(name, baseline, new, common, tolerances) for name in shared]
    compared = [column for column, _ in columns if column.compared]
    return TableComparison(
        baseline=baseline,
        new=new,
        cases=common,
        columns=tuple(sorted(compared, key=lambda column: -column.worst.excess)),
        efforts=tuple(column for column, _ in columns if not column.compared),
        differences=tuple(sorted((d for _, beyond in columns for d in beyond), key=lambda d: -d.excess)),
        missing_cases=_only(baseline.rows, new.rows),
        extra_cases=_only(new.rows, baseline.rows),
        missing_columns=_only_compared(baseline.columns, new.columns, tolerances),
        extra_columns=tuple(name for name in extra if not name.startswith(later)),
        later_columns=tuple(name for name in extra if name.startswith(later)),
        versions=_unequal(baseline.versions, new.versions),
        settings=_unequal(baseline.settings, new.settings),
    )


def _common_cases(baseline: ResultTable, new: ResultTable, *, matched: bool) -> tuple[str, ...]:
    if baseline.key != new.key:
        example = match_example(baseline, new)
        raise InputError(
            f"{baseline.path} names its cases by {' and '.join(baseline.key)}, {new.path} by {' and '.join(new.key)};"
            f" compare a study with a study, a map with a map{example and f', or {example}'}"
        )
    common = tuple(case for case in baseline.rows if case in new.rows)
    if common:
        return common
    if matched:
        remedy = f"both have to have the same {' and '.join(baseline.key)}; choose fewer or other columns for --match"
    else:
        example = match_example(baseline, new)
        remedy = f"compare results of the same study, at the same size{example and f', or {example}'}"
    raise InputError(
        f"{baseline.path} and {new.path} have no case in common (such as {next(iter(baseline.rows))} and"
        f" {next(iter(new.rows))}); {remedy}"
    )


def _check_columns(tolerances: Tolerances, baseline: ResultTable, new: ResultTable) -> None:
    columns = dict.fromkeys((*baseline.columns, *new.columns))
    for name in tolerances.columns:
        if name in columns:
            continue
        if name in baseline.key:
            raise InputError(f"tolerance of column {name!r}: cases are matched by it; take it out of one of the two")
        raise InputError(f"tolerance of column {name!r}: no such column; columns that exist: {', '.join(columns)}")
    if not any(_is_compared(name, tolerances) for name in columns):
        raise InputError(
            f"{baseline.path} and {new.path} have no column to compare besides {' and '.join(baseline.key)};"
            " give tables with results, or fewer columns to match by"
        )


def _only(here: Iterable[str], there: Iterable[str]) -> tuple[str, ...]:
    known = set(there)
    return tuple(name for name in here if name not in known)


def _only_compared(here: Iterable[str], there: Iterable[str], tolerances: Tolerances) -> tuple[str, ...]:
    return tuple(name for name in _only(here, there) if _is_compared(name, tolerances))


def _is_compared(column: str, tolerances: Tolerances) -> bool:
    return kind_of(column) != EFFORT or column in tolerances.columns


def _unequal(baseline: Mapping[str, str], new: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    return {k: (v, new[k]) for k, v in baseline.items() if k in new and new[k] != v}


def _compare_column(
    name: str, baseline: ResultTable, new: ResultTable, cases: tuple[str, ...], tolerances: Tolerances
) -> tuple[ColumnComparison, tuple[Difference, ...]]:
    """A column, and its differences beyond tolerance."""
    tolerance = tolerances.of(name)
    all_of = [_difference(name, case, baseline.rows[case][name], new.rows[case][name], tolerance) for case in cases]
    beyond = tuple(difference for difference in all_of if difference.excess > 1.0)
    compared = _is_compared(name, tolerances)
    column = ColumnComparison(
        column=name,
        kind=kind_of(name),
        tolerance=tolerance,
        compared=compared,
        cases=len(cases),
        differing=len(beyond),
        # where nothing is allowed the size of the difference decides
        worst=max(all_of, key=lambda difference: (difference.excess, abs(difference.difference or 0.0))),
    )
    return column, beyond if compared else ()


def _difference(column: str, case: str, baseline: str, new: str, tolerance: Tolerance | None) -> Difference:
    was, now = (None, None) if kind_of(column) == TEXT else (number(baseline), number(new))
    if was is None or now is None:
        excess = 0.0 if baseline == new else math.inf
        return Difference(
            column=column, case=case, baseline=baseline, new=new, difference=None, allowed=None, excess=excess
        )
    # infinite minus infinite is no number, though both are the same
    difference = 0.0 if was == now else now - was
    allowed = (tolerance or Tolerance()).allowed(was) if math.isfinite(was) else 0.0
    return Difference(
        column=column,
        case=case,
        baseline=baseline,
        new=new,
        difference=difference,
        allowed=allowed,
        excess=_excess(abs(difference), allowed),
    )


def _excess(difference: float, allowed: float) -> float:
    if difference == 0.0:
        return 0.0
    return difference / allowed if allowed > 0.0 else math.inf
