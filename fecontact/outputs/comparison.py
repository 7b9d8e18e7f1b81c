"""A comparison of two tables of results: record, tables, terminal, and one HTML file without time stamps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from fecontact.files import write_json, write_text
from fecontact.outputs.flat_records import Record, picked
from fecontact.outputs.pair_names import short_name
from fecontact.outputs.parts import Details, Heading, Items, Lead, Part
from fecontact.outputs.style import page
from fecontact.outputs.tables import Column, Item, Table, number, table_of, text
from fecontact.outputs.terminal import count

if TYPE_CHECKING:
    from pathlib import Path

    import pandas

    from fecontact.outputs.terminal import Lines
    from fecontact.regression.compare import TableComparison


def comparison_record(comparison: TableComparison) -> Record:
    """The whole comparison; numbers that are infinite (nothing was allowed) become null in the file."""
    columns = comparison.columns
    return {
        "schema": "fecontact/comparison/2",
        **picked(comparison, "same verdict"),
        "baseline": str(comparison.baseline.path),
        "new": str(comparison.new.path),
        "matched_by": list(comparison.baseline.key),
        "cases": comparison.cases,
        **{what.replace(" ", "_"): names for what, names in comparison.one_sided.items()},
        "later_columns": comparison.later_columns,
        "default_tolerance_columns": list(columns.column[columns.kind == "default"]),
        **{
            what: {name: {"baseline": was, "new": now} for name, (was, now) in getattr(comparison, what).items()}
            for what in ("versions", "settings")
        },
        "columns": columns.to_dict("records"),
        "differences": comparison.differences.to_dict("records"),
        "not_compared": comparison.efforts.to_dict("records"),
        "changed_verdicts": changed_verdicts(comparison),
    }


# --- Verdicts that are others: how many, which, and where.


def changed_verdicts(comparison: TableComparison) -> list[Record]:
    """Each change of a verdict, the most frequent first, with its number of cases and their shifts and loads."""
    verdicts = comparison.verdicts
    if verdicts.empty:
        return []
    changed = verdicts[verdicts.baseline != verdicts.new]
    found = [
        {"baseline": was, "new": now, "cases": len(own), "where": _where(own)}
        for (was, now), own in changed.groupby(["baseline", "new"])
    ]
    return sorted(found, key=lambda one: -one["cases"])


def _where(cases: pandas.DataFrame) -> str:
    by_shift = cases.sort_values(["lateral_shift_mm", "load_kN"]).groupby("lateral_shift_mm").load_kN
    return "; ".join(f"{shift:+g} mm: {', '.join(f'{load:g}' for load in loads)} kN" for shift, loads in by_shift)


def verdict_lines(comparison: TableComparison) -> Lines:
    """How many verdicts of Hertz are others, in a sentence, and which, where and how often, in a table."""
    found, cases = changed_verdicts(comparison), count(len(comparison.verdicts), "case")
    if not found:
        yield from [f"Hertz's verdict is the same in all of {cases}."] * (not comparison.verdicts.empty)
        return
    told = ", ".join(f"{one['baseline']} -> {one['new']} {count(one['cases'], 'time')}" for one in found)
    yield f"Hertz's verdict is another one in {sum(one['cases'] for one in found)} of {cases}: {told}."
    yield table_of("Verdicts that are others", _CHANGES, found)


_CHANGES = (
    text("baseline", "baseline"),
    text("new", "new"),
    number("cases", "cases", "{:.0f}"),
    text("where", "where", wraps=True),
)


# --- Tables of a comparison of two tables of results, and what they call its cases.

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


# --- A comparison of two tables of results on the terminal.

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5
# The worst columns are shown, with so many characters of a text: more hide the answer.
_MOST_COLUMNS, _MOST_LETTERS = 30, 20


def comparison_lines(comparison: TableComparison) -> Lines:
    """What differs, the worst column first, or what is closest to it where nothing does, and the verdict.

    Columns in which all values are equal are not shown.
    """
    yield from head_lines(comparison)
    columns, efforts = comparison.columns, comparison.efforts
    if columns.differing.any():
        differing = columns[columns.differing > 0]
        shown = differing[:_MOST_COLUMNS]
        numbers = shown.difference.notna()
        shown = shown.assign(
            **{side: shown[side].where(numbers, shown[side].map(_cut)) for side in ("baseline", "new")}
        )
        yield value_table("Columns that differ", COLUMN_TABLE, shown, comparison)
        if more := len(differing) - len(shown):
            yield f"{count(more, 'further column')} differ{'s' * (more == 1)}: --out FOLDER or --json has all"
    elif (columns.times_tolerance > 0.0).any():
        closest = columns[columns.times_tolerance > 0.0][:_CLOSEST]
        yield value_table("Closest to their tolerance", COLUMN_TABLE, closest, comparison)
    changed = efforts[efforts.baseline != efforts.new].to_dict("records")
    if changed:
        told = (f"{one['column']} {value_text(one, 'baseline')} -> {value_text(one, 'new')}" for one in changed)
        yield f"not compared: {', '.join(told)}"
    yield from verdict_lines(comparison)
    yield comparison.verdict


def _cut(text: str) -> str:
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."


# --- Files of a comparison: JSON, a picture, and one HTML file without time stamps.


def write_comparison(comparison: TableComparison, folder: Path) -> Path:
    """Write the record, the page, and a picture where each verdict has a shift and a load of its own."""
    write_json(folder / "comparison.json", comparison_record(comparison))
    write_text(folder / "comparison.html", comparison_html(comparison))
    if not comparison.verdicts.empty and not comparison.verdicts.duplicated(["lateral_shift_mm", "load_kN"]).any():
        from fecontact.outputs.figures.verdicts import verdicts_figure

        verdicts_figure(comparison, folder / "comparison.png")
    return folder


# More values than these are folded away.
_MOST_OPEN = 40


def comparison_html(comparison: TableComparison) -> str:
    """The comparison as one HTML page that needs no other file; well-formed XML as well."""
    columns, differences = comparison.columns, comparison.differences
    changed, equal = columns[columns.times_tolerance > 0.0], columns[columns.times_tolerance == 0.0]
    beyond = "All values beyond their tolerance, the worst first"
    many = len(differences) > _MOST_OPEN
    values = value_table("" if many else beyond, VALUE_TABLE, differences, comparison)
    below = {
        f"Columns with equal values: {len(equal)}": value_table("", COLUMN_TABLE, equal, comparison),
        "Not compared; where they are furthest apart": value_table("", VALUE_TABLE, comparison.efforts, comparison),
        "Tolerances": tolerance_table(comparison),
        "Versions": version_table(comparison),
    }
    parts: list[Part] = [
        Heading("Comparison of results", 1),
        Lead(comparison.verdict, "same" if comparison.same else "different"),
        Items(list(head_lines(comparison))),
        *verdict_lines(comparison),
        value_table("Columns, the worst first", COLUMN_TABLE, changed, comparison),
        Details(f"{beyond}: {len(differences)}", [values]) if many else values,
        *(Details(title, [one]) for title, one in below.items()),
    ]
    return page(comparison.verdict, parts)
