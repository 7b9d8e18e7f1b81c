"""A comparison of two tables of results for the terminal, as JSON and as one HTML file; without time stamps."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from fecontact.regression.compare import ColumnComparison, Difference, TableComparison, counted

if TYPE_CHECKING:
    from rich.console import Console

Record = dict[str, Any]

# Columns that are shown where none differs, so that one sees how close it is.
_CLOSEST = 5
# Width of a table that goes to a file or a pipe.
_PLAIN_WIDTH = 120

_HEADINGS = ("column", "differ", "worst case", "baseline", "new", "difference", "tolerance", "times")

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 78em; padding: 0 1em; color: #222; }
table { border-collapse: collapse; margin: 0.5em 0 1.5em; }
caption { text-align: left; font-weight: bold; padding: 0.3em 0; }
th, td { border-bottom: 1px solid #ddd; padding: 0.2em 0.7em; text-align: left; vertical-align: top; }
td { overflow-wrap: anywhere; }
th { background: #f3f3f3; }
.same { border-left: 0.4em solid #0072b2; padding-left: 0.7em; }
.different { border-left: 0.4em solid #d55e00; padding-left: 0.7em; }
tr.beyond td { background: #fdeadd; }
"""


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
    console = console or _console()
    for line in _head_lines(comparison):
        _say(console, line)
    differing = [column for column in comparison.columns if column.differing]
    closest = [column for column in comparison.columns if not column.unchanged][:_CLOSEST]
    if differing:
        _print_table(console, "Columns that differ", differing)
    elif closest:
        _print_table(console, "Closest to their tolerance", closest)
    changed = [column for column in comparison.efforts if column.worst.baseline != column.worst.new]
    if changed:
        _say(console, f"not compared: {', '.join(_effort(column) for column in changed)}")
    _say(console, comparison.verdict)


def _print_table(console: Console, title: str, columns: Sequence[ColumnComparison]) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(title),
        title_justify="left",
        title_style="bold",
        box=box.SIMPLE_HEAD if console.is_terminal else None,
        pad_edge=False,
    )
    for heading in _HEADINGS:
        left = heading in ("column", "worst case")
        table.add_column(heading, justify="left" if left else "right", overflow="fold", min_width=6)
    for column in columns:
        # as text and not as markup: names of profiles may have brackets
        table.add_row(*(Text(cell) for cell in _cells(column)), style="red" if column.differing else "")
    console.print(table)


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
    if comparison.unknown_columns:
        lines.append(f"of no known unit, compared as the kind 'default': {', '.join(comparison.unknown_columns)}")
    return lines


def _cells(column: ColumnComparison) -> tuple[str, ...]:
    worst = column.worst
    return (
        column.column,
        f"{column.differing}/{column.cases}",
        worst.case,
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
    state = "same" if comparison.same else "different"
    head = "".join(f"<li>{escape(line)}</li>" for line in _head_lines(comparison))
    changed = [(_cells(column), column.differing > 0) for column in comparison.columns if not column.unchanged]
    unchanged = [(_cells(column), False) for column in comparison.columns if column.unchanged]
    values = [(_difference_cells(difference), True) for difference in comparison.differences]
    efforts = [(_cells(c)[:1] + _cells(c)[2:6], False) for c in comparison.efforts]
    names = ("column", "case", "baseline", "new", "difference", "tolerance", "times")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        f"<title>{escape(comparison.verdict)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f'<h1>Comparison of results</h1>\n<p class="{state}">{escape(comparison.verdict)}</p>\n<ul>{head}</ul>\n'
        + _html_table("Columns, the worst first", _HEADINGS, changed)
        + _html_folded(f"{counted(len(unchanged), 'column')} with equal values", _HEADINGS, unchanged)
        + _html_table("All values beyond their tolerance, the worst first", names, values)
        + _html_table("Not compared; where they are furthest apart", names[:5], efforts)
        + _tolerance_table(comparison)
        + "</body>\n</html>\n"
    )


def _difference_cells(difference: Difference) -> tuple[str, ...]:
    return (
        difference.column,
        difference.case,
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
    return _html_table("Tolerances", ("column", "kind", "relative", "absolute", "why"), rows)


def _html_table(caption: str, headings: Sequence[str], rows: Sequence[tuple[Sequence[str], bool]]) -> str:
    """A table of (cells, marked) rows; nothing where there are none."""
    if not rows:
        return ""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    lines = []
    for cells, marked in rows:
        texts = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        lines.append(f'<tr class="beyond">{texts}</tr>\n' if marked else f"<tr>{texts}</tr>\n")
    title = f"<caption>{escape(caption)}</caption>\n" if caption else ""
    return f"<table>\n{title}<tr>{head}</tr>\n{''.join(lines)}</table>\n"


def _html_folded(summary: str, headings: Sequence[str], rows: Sequence[tuple[Sequence[str], bool]]) -> str:
    """A table that is shown on demand only; nothing where it has no rows."""
    if not rows:
        return ""
    return f"<details>\n<summary>{escape(summary)}</summary>\n{_html_table('', headings, rows)}</details>\n"


def _console() -> Console:
    """Standard output: as wide as the terminal, or `_PLAIN_WIDTH` and without any colour where there is none."""
    from rich.console import Console

    console = Console(highlight=False)
    return console if console.is_terminal else Console(width=_PLAIN_WIDTH, no_color=True, highlight=False)


def _say(console: Console, text: str) -> None:
    console.print(text, markup=False, soft_wrap=not console.is_terminal)
