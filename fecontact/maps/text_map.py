"""Map as a text: a line for each position, its load limits, and the meaning of the signs."""

from __future__ import annotations

from textwrap import wrap

from fecontact.case import Case
from fecontact.maps.view import MapView
from fecontact.outputs.case_words import other_wheel_hint, roll_words


def format_map_table(view: MapView, *, width: int | None = None) -> str:
    """Text table of a map, with a line for each position and notes.

    Each line has a text for each load and the load limit. If a line is longer than `width`, the limits are below the
    table and the cells are closer. A table that is still too wide is divided into tables of fewer loads.

    Parameters
    ----------
    view
        View of the map.
    width
        Width in characters; None without a limit.

    Returns
    -------
    str
        Lines of the table.
    """
    loads = range(len(view.loads_N))
    lines = _format_lines(view, loads, 10)
    ends = [f"  {column.limit}" if column.limit else "" for column in view.columns]
    widest = max((len(line) + len(end) for line, end in zip(lines[1:], ends, strict=True)), default=0)
    if width is None or widest <= width:
        lines[1:] = [f"{line}{end}" for line, end in zip(lines[1:], ends, strict=True)]
    else:
        room = max(1, (width - 13) // 9)
        load_groups = [loads[first : first + room] for first in range(0, len(loads), room)]
        lines = [line for load_group in load_groups for line in _format_lines(view, load_group, 9)]
        if any(ends):
            lines.append("load limits:")
        for column, end in zip(view.columns, ends, strict=True):
            limit_line = f"{column.shift_mm:+z8.2f}{end}"
            lines += wrap(limit_line, width, subsequent_indent=" " * 10, drop_whitespace=True) if end else []
    notes = (*view.notes, _position_text(view.case))
    return "\n".join(lines + [line for note in notes for line in (wrap(note, width) if width else [note])])


def _position_text(case: Case) -> str:
    hint = other_wheel_hint(case)
    return f"{case.side} wheel, {roll_words(case)}{hint and f'; {hint}'}"


def _format_lines(view: MapView, load_indices: range, width: int) -> list[str]:
    """Line of loads, and a line for each position."""
    heading = "shift mm " + "".join(f"{view.loads_N[index] / 1e3:g}".rjust(width) for index in load_indices) + "  kN"
    texts = [[(cell.printed or cell.text).rjust(width) for cell in column.cells] for column in view.columns]
    return [heading] + [
        f"{column.shift_mm:+z8.2f} {''.join(cells[index] for index in load_indices)}"
        for column, cells in zip(view.columns, texts, strict=True)
    ]
