"""A comparison of two tables of results for the terminal, as JSON and as one HTML file; without time stamps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outputs.case_words import short_name
from fecontact.outputs.html import folded, heading, items, page, paragraph, table
from fecontact.outputs.table import Column, Table, TableRow, columns_of
from fecontact.outputs.terminal import print_table, say, standard_console
from fecontact.regression.compare import ColumnComparison, Difference, TableComparison, counted

if TYPE_CHECKING:
    from rich.console import Console

Record = dict[str, Any]

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5
# Terminals that are narrower show fewer columns.
_ROOMY_WIDTH = 110

_COLUMNS = (
    Column(heading="column", kind="text"),
    Column(heading="differ", rank=1, name="how many differ"),
    Column(heading="worst case", kind="text", wraps=True),
    *columns_of("baseline", "new", "difference"),
    Column(heading="tolerance", rank=2, name="tolerance"),
    Column(heading="times"),
)
_CASE = Column(heading="case", kind="text", wraps=True)
# More values than these are folded away.
_MOST_OPEN = 40


def comparison_record(comparison: TableComparison) -> Record:
    """The whole comparison; numbers that are infinite (nothing was allowed) become null in the file."""
    return {
        "schema": "fecontact/comparison/1",
        "same": comparison.same,
        "verdict": comparison.verdict,
        "baseline": str(comparison.baseline.path),
        "new": str(comparison.new.path),
        "matched_by": list(comparison.baseline.key),
        "cases": list(comparison.cases),
        "missing_cases": list(comparison.missing_cases),
        "extra_cases": list(comparison.extra_cases),
        "missing_columns": list(comparison.missing_columns),
        "extra_columns": list(comparison.extra_columns),
        "later_columns": list(comparison.later_columns),
        "default_tolerance_columns": list(comparison.unknown_columns),
        "versions": _pairs_record(comparison.versions.items()),
        "settings": _pairs_record(comparison.settings.items()),
        "columns": [_column_record(column) for column in comparison.columns],
        "differences": [_difference_record(difference) for difference in comparison.differences],
        "not_compared": [_column_record(column) for column in comparison.efforts],
    }


def _pairs_record(pairs: Iterable[tuple[str, tuple[str, str]]]) -> Record:
    return {name: {"baseline": was, "new": now} for name, (was, now) in pairs}


def _column_record(column: ColumnComparison) -> Record:
    tolerance = column.tolerance
    return {
        "column": column.column,
        "kind": column.kind,
        "tolerance": None
        if tolerance is None
        else {"relative": tolerance.relative, "absolute": tolerance.absolute, "reason": tolerance.reason},
        "cases": column.cases,
        "differing": column.differing if column.compared else None,
        "worst": _difference_record(column.worst),
    }


def _difference_record(difference: Difference) -> Record:
    return {
        "column": difference.column,
        "case": difference.case,
        "baseline": difference.baseline,
        "new": difference.new,
        "difference": difference.difference,
        "tolerance": difference.allowed,
        "times_tolerance": difference.excess,
    }


def print_comparison(comparison: TableComparison, *, console: Console | None = None) -> None:
    """Print what differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Parameters
    ----------
    comparison
        What is shown; columns in which all values are equal are not.
    console
        Standard output, if not given.
    """
    console = console or standard_console()
    for line in _head_lines(comparison):
        say(console, line)
    names = case_names(comparison)
    differing = [column for column in comparison.columns if column.differing]
    closest = [column for column in comparison.columns if not column.unchanged][:_CLOSEST]
    if differing:
        print_table(console, _column_table("Columns that differ", differing, names), roomy_width=_ROOMY_WIDTH)
    elif closest:
        print_table(console, _column_table("Closest to their tolerance", closest, names), roomy_width=_ROOMY_WIDTH)
    changed = [column for column in comparison.efforts if column.worst.baseline != column.worst.new]
    if changed:
        say(console, f"not compared: {', '.join(_effort(column) for column in changed)}")
    say(console, comparison.verdict)


def _column_table(title: str, columns: Sequence[ColumnComparison], names: Mapping[str, str]) -> Table:
    """Columns with the case in which both tables are furthest apart."""
    rows = []
    for one in columns:
        head = (one.column, f"{one.differing}/{one.cases}")
        cells = (*head, *_difference_cells(one.worst, names, unknown=one.kind)[1:])
        rows.append(TableRow(cells=cells, tone="fails" if one.differing else "plain"))
    return Table(title=title, columns=_COLUMNS, rows=rows)


def _value_table(title: str, differences: Sequence[Difference], names: Mapping[str, str]) -> Table:
    """Single values."""
    columns = [_COLUMNS[0], _CASE, *_COLUMNS[3:]]
    rows = [TableRow(cells=_difference_cells(one, names), tone="fails") for one in differences]
    return Table(title=title, columns=columns, rows=rows)


def _head_lines(comparison: TableComparison) -> list[str]:
    """What is not in the columns: the two tables, versions, settings, and what only one of them has."""
    lines = [f"baseline {comparison.baseline.path}", f"new      {comparison.new.path}"]
    if comparison.baseline.key != ("id",):
        lines.append(f"cases are matched by {', '.join(comparison.baseline.key)}")
    for what, pairs in (("version", comparison.versions), ("setting", comparison.settings)):
        lines += [f"{what} {name}: {was} -> {now}" for name, (was, now) in pairs.items()]
    lines += [
        f"{table.path} does not say its versions"
        for table in (comparison.baseline, comparison.new)
        if not table.versions
    ]
    for what in ("missing_cases", "extra_cases", "missing_columns", "extra_columns"):
        if names := getattr(comparison, what):
            lines.append(f"{what.replace('_', ' ')}: {', '.join(names)}")
    if comparison.later_columns:
        lines.append(f"not compared, the baseline is older than they are: {', '.join(comparison.later_columns)}")
    if comparison.unknown_columns:
        lines.append(f"of no known unit, compared as the kind 'default': {', '.join(comparison.unknown_columns)}")
    return lines


def _value(text: str, difference: float | None) -> str:
    if not text:
        return "(none)"
    return text if difference is None else f"{float(text):.8g}"


def _effort(column: ColumnComparison) -> str:
    worst = column.worst
    return f"{column.column} {_value(worst.baseline, worst.difference)} -> {_value(worst.new, worst.difference)}"


def comparison_html(comparison: TableComparison) -> str:
    """The comparison as one HTML page that needs no other file; well-formed XML as well."""
    names = case_names(comparison)
    changed = [column for column in comparison.columns if not column.unchanged]
    unchanged = [column for column in comparison.columns if column.unchanged]
    beyond = "All values beyond their tolerance, the worst first"
    values = table(_value_table(beyond, comparison.differences, names))
    if len(comparison.differences) > _MOST_OPEN:
        open_values = _value_table("", comparison.differences, names)
        values = folded(f"{beyond}: {len(comparison.differences)}", table(open_values))
    equal = f"{counted(len(unchanged), 'column')} with equal values"
    return page(
        comparison.verdict,
        [
            heading("Comparison of results", 1),
            paragraph(comparison.verdict, "same" if comparison.same else "different"),
            items(_head_lines(comparison)),
            table(_column_table("Columns, the worst first", changed, names)),
            values,
            folded(equal, table(_column_table("", unchanged, names))),
            folded("Not compared; where they are furthest apart", table(_effort_table(comparison, names))),
            folded("Tolerances", table(_tolerance_table(comparison))),
            folded("Versions", table(_version_table(comparison))),
        ],
    )


def _effort_table(comparison: TableComparison, names: Mapping[str, str]) -> Table:
    rows = [TableRow(cells=_difference_cells(column.worst, names)[:5]) for column in comparison.efforts]
    return Table(title="", columns=[_COLUMNS[0], _CASE, *_COLUMNS[3:6]], rows=rows)


def case_names(comparison: TableComparison) -> dict[str, str]:
    """What cases are called for a reader: an id by what was solved, as far as that tells them apart."""
    if comparison.baseline.key != ("id",):
        return {case: case for case in comparison.cases}
    named = {case: _case_name(comparison.baseline.rows[case]) or case for case in comparison.cases}
    shared = {name for name, count in Counter(named.values()).items() if count > 1}
    return {case: f"{name} ({case[-8:]})" if name in shared else name for case, name in named.items()}


def _case_name(row: Mapping[str, str]) -> str:
    shift, load = row.get("lateral_shift_mm"), row.get("load_kN")
    if not shift or not load:
        return ""
    pair = " on ".join(short_name(row[body]) for body in ("wheel", "rail") if row.get(body))
    return f"{pair}, {float(shift):+g} mm, {float(load):g} kN"


def _difference_cells(difference: Difference, names: Mapping[str, str], unknown: str = "-") -> tuple[str, ...]:
    """Column, case, both values, their difference, what is allowed (`unknown` of texts), and their ratio."""
    return (
        difference.column,
        names[difference.case],
        _value(difference.baseline, difference.difference),
        _value(difference.new, difference.difference),
        "-" if difference.difference is None else f"{difference.difference:+.3g}",
        unknown if difference.allowed is None else f"{difference.allowed:.3g}",
        f"{difference.excess:.3g}" if math.isfinite(difference.excess) else "-",
    )


def _tolerance_table(comparison: TableComparison) -> Table:
    rows = []
    for column in sorted(comparison.columns, key=lambda one: comparison.baseline.columns.index(one.column)):
        told = ("-", "-", "the same text")
        if (of := column.tolerance) is not None:
            told = (f"{of.relative:g}", f"{of.absolute:g}", of.reason)
        rows.append(TableRow(cells=(column.column, column.kind, *told)))
    headings = ("column", "kind", "relative", "absolute", "why")
    return Table(title="", columns=columns_of(*headings, texts=("column", "kind", "why")), rows=rows)


def _version_table(comparison: TableComparison) -> Table:
    was, now = comparison.baseline.versions, comparison.new.versions
    headings = ("package", "baseline", "new")
    rows = [TableRow(cells=(name, was.get(name, "-"), now.get(name, "-"))) for name in dict.fromkeys((*was, *now))]
    return Table(title="", columns=columns_of(*headings, texts=headings), rows=rows)
