"""A comparison of two tables of results for the terminal, as JSON and as one HTML file; without time stamps."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fecontact.outputs.html import folded, heading, items, page, paragraph, table
from fecontact.outputs.series import short_name
from fecontact.outputs.terminal import say, standard_console, titled_table
from fecontact.regression.compare import ColumnComparison, Difference, TableComparison, counted

if TYPE_CHECKING:
    from rich.console import Console

Record = dict[str, Any]

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5
# Terminals that are narrower show fewer columns.
_ROOMY_WIDTH = 110

_HEADINGS = ("column", "differ", "worst case", "baseline", "new", "difference", "tolerance", "times")
_NUMBERS = ("differ", "baseline", "new", "difference", "tolerance", "times")
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
        _print_table(console, "Columns that differ", differing, names)
    elif closest:
        _print_table(console, "Closest to their tolerance", closest, names)
    changed = [column for column in comparison.efforts if column.worst.baseline != column.worst.new]
    if changed:
        say(console, f"not compared: {', '.join(_effort(column) for column in changed)}")
    say(console, comparison.verdict)


def _print_table(console: Console, title: str, columns: Sequence[ColumnComparison], names: Mapping[str, str]) -> None:
    from rich.text import Text

    tight = console.is_terminal and console.width < _ROOMY_WIDTH
    shown = [name for name in _HEADINGS if not (tight and name in ("differ", "tolerance"))]
    printed = titled_table(console, title=title, roomy_width=_ROOMY_WIDTH)
    for name in shown:
        left = name in ("column", "worst case")
        # a name is not broken where another column can give way
        whole = tight and name != "worst case"
        printed.add_column(name, justify="left" if left else "right", overflow="fold", min_width=6, no_wrap=whole)
    for column in columns:
        cells = dict(zip(_HEADINGS, _cells(column, names), strict=True))
        # as text and not as markup: names of profiles may have brackets
        printed.add_row(*(Text(cells[name]) for name in shown), style="red" if column.differing else "")
    console.print(printed)


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


def _cells(column: ColumnComparison, names: Mapping[str, str]) -> tuple[str, ...]:
    worst = column.worst
    return (
        column.column,
        f"{column.differing}/{column.cases}",
        names[worst.case],
        _value(worst.baseline, worst.difference),
        _value(worst.new, worst.difference),
        "-" if worst.difference is None else f"{worst.difference:+.3g}",
        column.kind if worst.allowed is None else f"{worst.allowed:.3g}",
        f"{worst.excess:.3g}" if math.isfinite(worst.excess) else "-",
    )


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
    columns = [(_cells(column, names), column.differing > 0) for column in comparison.columns if not column.unchanged]
    unchanged = [(_cells(column, names), False) for column in comparison.columns if column.unchanged]
    values = [(_difference_cells(difference, names), True) for difference in comparison.differences]
    efforts = [(_cells(c, names)[:1] + _cells(c, names)[2:6], False) for c in comparison.efforts]
    headings = ("column", "case", "baseline", "new", "difference", "tolerance", "times")
    beyond = "All values beyond their tolerance, the worst first"
    few = len(values) <= _MOST_OPEN
    return page(
        comparison.verdict,
        [
            heading("Comparison of results", 1),
            paragraph(comparison.verdict, "same" if comparison.same else "different"),
            items(_head_lines(comparison)),
            table("Columns, the worst first", _HEADINGS, columns, numbers=_NUMBERS),
            table(beyond, headings, values, numbers=_NUMBERS) if few else "",
            "" if few else folded(f"{beyond}: {len(values)}", table("", headings, values, numbers=_NUMBERS)),
            folded(
                f"{counted(len(unchanged), 'column')} with equal values",
                table("", _HEADINGS, unchanged, numbers=_NUMBERS),
            ),
            folded("Not compared; where they are furthest apart", table("", headings[:5], efforts, numbers=_NUMBERS)),
            folded("Tolerances", _tolerance_table(comparison)),
            folded("Versions", _version_table(comparison)),
        ],
    )


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


def _difference_cells(difference: Difference, names: Mapping[str, str]) -> tuple[str, ...]:
    return (
        difference.column,
        names[difference.case],
        _value(difference.baseline, difference.difference),
        _value(difference.new, difference.difference),
        "-" if difference.difference is None else f"{difference.difference:+.3g}",
        "-" if difference.allowed is None else f"{difference.allowed:.3g}",
        f"{difference.excess:.3g}" if math.isfinite(difference.excess) else "-",
    )


def _tolerance_table(comparison: TableComparison) -> str:
    rows = [
        ((c.column, c.kind, f"{c.tolerance.relative:g}", f"{c.tolerance.absolute:g}", c.tolerance.reason), False)
        if c.tolerance
        else ((c.column, c.kind, "-", "-", "the same text"), False)
        for c in sorted(comparison.columns, key=lambda c: comparison.baseline.columns.index(c.column))
    ]
    return table("", ("column", "kind", "relative", "absolute", "why"), rows, numbers=("relative", "absolute"))


def _version_table(comparison: TableComparison) -> str:
    was, now = comparison.baseline.versions, comparison.new.versions
    rows = [((name, was.get(name, "-"), now.get(name, "-")), False) for name in dict.fromkeys((*was, *now))]
    return table("", ("package", "baseline", "new"), rows)
