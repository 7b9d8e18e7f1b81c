"""A map as text: a line for each position, its load limit, and the meaning of the signs."""

from __future__ import annotations

from textwrap import wrap

from fecontact.case import Case
from fecontact.maps.view import MapView
from fecontact.outputs.case_words import other_wheel_label, roll_words


def map_table(view: MapView, *, width: int | None = None) -> str:
    """A line for each position, with a text of a cell for each load and its load limit, and notes below.

    Where a line is longer than `width`, the limits stand below, and cells are closer; a table that is still too wide
    is cut into tables of fewer loads.
    """
    loads = range(len(view.loads_N))
    lines = _lines(view, loads, 10)
    ends = [f"  {column.limit}" if column.limit else "" for column in view.columns]
    widest = max((len(line) + len(end) for line, end in zip(lines[1:], ends, strict=True)), default=0)
    if width is None or widest <= width:
        lines[1:] = [f"{line}{end}" for line, end in zip(lines[1:], ends, strict=True)]
    else:
        room = max(1, (width - 13) // 9)
        parts = [loads[first : first + room] for first in range(0, len(loads), room)]
        lines = [line for part in parts for line in _lines(view, part, 9)]
        if any(ends):
            lines.append("load limits:")
        for column, end in zip(view.columns, ends, strict=True):
            own = f"{column.shift_mm:+z8.2f}{end}"
            lines += wrap(own, width, subsequent_indent=" " * 10, drop_whitespace=True) if end else []
    every = (*view.notes, _position_text(view.case))
    return "\n".join(lines + [line for note in every for line in (wrap(note, width) if width else [note])])


def _position_text(case: Case) -> str:
    other = other_wheel_label(case)
    same = "; the other wheel at a shift is this one at the opposite shift" if other else ""
    return f"{case.side} wheel, {roll_words(case)}{same}"


def _lines(view: MapView, part: range, width: int) -> list[str]:
    """A line of loads, and a line for each position."""
    head = "shift mm " + "".join(f"{view.loads_N[k] / 1e3:g}".rjust(width) for k in part) + "  kN"
    shown = [[(cell.printed or cell.text).rjust(width) for cell in column.cells] for column in view.columns]
    return [head] + [
        f"{column.shift_mm:+z8.2f} {''.join(cells[k] for k in part)}"
        for column, cells in zip(view.columns, shown, strict=True)
    ]
