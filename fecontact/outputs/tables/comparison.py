"""Tables of a comparison of two tables of results, and what they call its cases."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from fecontact.outputs.tables.table import Column, Table, TableRow, columns_of
from fecontact.outputs.words.pairs import short_name
from fecontact.regression.compare import ColumnComparison, Difference, TableComparison

Record = dict[str, Any]

# Terminals that are narrower have columns closer together.
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


def column_table(title: str, columns: Sequence[ColumnComparison], names: Mapping[str, str]) -> Table:
    """Columns with the case in which both tables are furthest apart."""
    rows = []
    for one in columns:
        head = (one.column, f"{one.differing}/{one.cases}")
        cells = (*head, *_difference_cells(one.worst, names, unknown=one.kind)[1:])
        rows.append(TableRow(cells=cells, tone="fails" if one.differing else "plain"))
    return Table(title=title, columns=_COLUMNS, rows=rows, roomy_width=_ROOMY_WIDTH)


def value_table(title: str, differences: Sequence[Difference], names: Mapping[str, str]) -> Table:
    """Single values."""
    columns = [_COLUMNS[0], _CASE, *_COLUMNS[3:]]
    rows = [TableRow(cells=_difference_cells(one, names), tone="fails") for one in differences]
    return Table(title=title, columns=columns, rows=rows)


def head_lines(comparison: TableComparison) -> list[str]:
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


def value_text(text: str, difference: float | None) -> str:
    """A value with eight digits if it is a number."""
    if not text:
        return "(none)"
    return text if difference is None else f"{float(text):.8g}"


def effort_table(comparison: TableComparison, names: Mapping[str, str]) -> Table:
    """Columns that are only shown."""
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
        value_text(difference.baseline, difference.difference),
        value_text(difference.new, difference.difference),
        "-" if difference.difference is None else f"{difference.difference:+.3g}",
        unknown if difference.allowed is None else f"{difference.allowed:.3g}",
        f"{difference.excess:.3g}" if math.isfinite(difference.excess) else "-",
    )


def tolerance_table(comparison: TableComparison) -> Table:
    """What is allowed in each column, and why."""
    rows = []
    for column in sorted(comparison.columns, key=lambda one: comparison.baseline.columns.index(one.column)):
        told = ("-", "-", "the same text")
        if (of := column.tolerance) is not None:
            told = (f"{of.relative:g}", f"{of.absolute:g}", of.reason)
        rows.append(TableRow(cells=(column.column, column.kind, *told)))
    headings = ("column", "kind", "relative", "absolute", "why")
    return Table(title="", columns=columns_of(*headings, texts=("column", "kind", "why")), rows=rows)


def version_table(comparison: TableComparison) -> Table:
    """Versions on both sides."""
    was, now = comparison.baseline.versions, comparison.new.versions
    headings = ("package", "baseline", "new")
    rows = [TableRow(cells=(name, was.get(name, "-"), now.get(name, "-"))) for name in dict.fromkeys((*was, *now))]
    return Table(title="", columns=columns_of(*headings, texts=headings), rows=rows)
