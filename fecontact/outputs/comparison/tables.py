"""Tables of a comparison of two tables of results, and names of its cases."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fecontact.outputs.pair_names import short_name
from fecontact.outputs.tables import Column, Item, Table, number, table_of, text

if TYPE_CHECKING:
    import pandas

    from fecontact.regression.compare import TableComparison


# Terminals that are narrower have columns closer together.
_ROOMY_WIDTH = 110


def value_text(item: Item, side: str) -> str:
    """A value, with eight digits if both sides are numbers."""
    return str(item[side]) or "(none)" if math.isnan(item["difference"]) else f"{float(item[side]):.8g}"


def _form(of: str, form: str, otherwise: str) -> Callable[[Item], str]:
    """A number in a format, or of what has none another entry."""
    return lambda item: str(item.get(otherwise, "-")) if math.isnan(item[of]) else form.format(item[of])


VALUE_TABLE = (
    text("column", "column"),
    text("case", "called", wraps=True),
    text("baseline", lambda item: value_text(item, "baseline"), "number"),
    text("new", lambda item: value_text(item, "new"), "number"),
    text("difference", _form("difference", "{:+.3g}", "-"), "number"),
    text("tolerance", _form("tolerance", "{:.3g}", "kind"), "number", rank=2, name="tolerance"),
    number("times", "times_tolerance", "{:.3g}"),
)
"""Single values."""
_DIFFER = text("differ", lambda item: f"{item['differing']}/{item['cases']}", "number", rank=1, name="how many differ")
COLUMN_TABLE = (VALUE_TABLE[0], _DIFFER, replace(VALUE_TABLE[1], heading="worst case"), *VALUE_TABLE[2:])
"""Columns of tables, each with the case in which both are furthest apart."""


def value_table(title: str, columns: Sequence[Column], values: pandas.DataFrame, comparison: TableComparison) -> Table:
    """Values, or the worst ones of columns, of which those beyond their tolerance are marked."""
    called = values.case.map(case_names(comparison))
    items = values.assign(called=called, cases=len(comparison.cases)).to_dict("records")
    table = table_of(title, columns, items, lambda item: "fails" if item["times_tolerance"] > 1.0 else "plain")
    return replace(table, roomy_width=_ROOMY_WIDTH)


def head_lines(comparison: TableComparison) -> list[str]:
    """What is not in the columns: the two tables, versions, settings, and what only one of them has."""
    tables = comparison.baseline, comparison.new
    lines = [f"baseline {comparison.baseline.path}", f"new      {comparison.new.path}"]
    if comparison.baseline.key != ("id",):
        lines.append(f"cases are matched by {', '.join(comparison.baseline.key)}")
    for what, pairs in (("version", comparison.versions), ("setting", comparison.settings)):
        lines += [f"{what} {name}: {was} -> {now}" for name, (was, now) in pairs.items()]
    lines += [f"{table.path} does not say its versions" for table in tables if not table.versions]
    unknown = comparison.columns.column[comparison.columns.kind == "default"]
    named = {
        **comparison.one_sided,
        "not compared, the baseline has none of their kind": comparison.later_columns,
        "of no known unit, compared as the kind 'default'": list(unknown),
    }
    return lines + [f"{what}: {', '.join(names)}" for what, names in named.items() if names]


def case_names(comparison: TableComparison) -> dict[str, str]:
    """What cases are called for a reader: an id by what was solved, as far as that tells them apart."""
    rows = comparison.baseline.rows
    if not {*comparison.baseline.key} <= {*rows}:
        # matched by columns, which name them
        return {case: case for case in comparison.cases}
    told = rows.filter(("lateral_shift_mm", "load_kN", "wheel", "rail")).loc[comparison.cases].to_dict("index")
    pairs = {
        case: " on ".join(short_name(row[body]) for body in ("wheel", "rail") if row.get(body))
        for case, row in told.items()
    }
    # one pair of all cases tells none from another
    several = len({*pairs.values()}) > 1
    named = {case: _case_name(row, pairs[case] if several else "") or case for case, row in told.items()}
    count = Counter(named.values())
    return {case: f"{name} ({case[-8:]})" if count[name] > 1 else name for case, name in named.items()}


def _case_name(row: Mapping[str, str], pair: str) -> str:
    shift, load = row.get("lateral_shift_mm"), row.get("load_kN")
    if not shift or not load:
        return ""
    return ", ".join(filter(None, (pair, f"{float(shift):+g} mm", f"{float(load):g} kN")))


def tolerance_table(comparison: TableComparison) -> Table:
    """What is allowed in each column, and why."""
    columns = comparison.columns.sort_index()
    allowed = (number("relative", "relative"), number("absolute", "absolute"))
    why = text("why", "reason", none="the same text")
    return table_of("", (VALUE_TABLE[0], text("kind", "kind"), *allowed, why), columns.to_dict("records"))


def version_table(comparison: TableComparison) -> Table:
    """Versions on both sides."""
    was, now = comparison.baseline.versions, comparison.new.versions
    items = ({"package": name, "baseline": was.get(name), "new": now.get(name)} for name in {**was, **now})
    return table_of("", [text(heading, heading, none="-") for heading in ("package", "baseline", "new")], items)
