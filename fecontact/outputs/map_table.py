"""A map as text: verdicts and numbers, a line for each position, and the load limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from textwrap import wrap

from fecontact.case import Case
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.roll_words import other_wheel_label, roll_words
from fecontact.outputs.theories import all_ellipses_instead, ellipses_instead

_MEASURE_LETTERS = {
    "p_max_MPa": "p",
    "area_mm2": "A",
    "a_mm": "a",
    "b_mm": "b",
    "centre_over_b": "c",
    "valley": "v",
    "separate_load": "s",
    "misplaced_load": "m",
}


ANSWER_SIGNS: Mapping[str, str] = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
"""How verdicts are told in a table."""
_ANSWER_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "open"}


def limit_text(limit: LoadLimit) -> str:
    """At which loads Hertz holds, in words."""
    parts = [
        f"{_ANSWER_WORDS[one.answer]} {one.low_N / 1e3:.4g}"
        + (f" to {one.high_N / 1e3:.4g}" if one.high_N > one.low_N else "")
        for one in limit.intervals
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def _deviation_text(cell: MapCell) -> str:
    if cell.judged is None or cell.status != "converged":
        return ""
    percent = 1e2 * cell.judged.deviation["p_max_MPa"]
    return f"{percent:+z.1f}" if math.isfinite(percent) else ""


def map_table(made: ApplicabilityMap, *, width: int | None = None) -> str:
    """Verdicts and peak deviations in percent, and the load limits."""
    texts = [[_cell_text(cell) for cell in position.cells] for position in made.positions]
    notes = ["+ holds, x fails, ? unresolved, ! could not be solved; peak pressure, Hertz against FE in %"]
    letters = ", ".join(f"{letter} {WORDS[measure].short}" for measure, letter in _MEASURE_LETTERS.items())
    notes.append(f"decided by {letters}")
    if instead := all_ellipses_instead(made):
        notes.append(f"{_OTHER_HOLDS} {instead} holds")
    return load_table(made, texts, [limit_text(one) for one in made.limits], notes=notes, width=width)


def load_table(
    made: ApplicabilityMap,
    texts: Sequence[Sequence[str]],
    limits: Sequence[str] | None = None,
    *,
    notes: Sequence[str],
    width: int | None = None,
) -> str:
    """A line for each position, with a text of a cell for each load and its load limit, and notes below.

    Where a line is longer than `width`, the limits stand below, and cells are closer; a table that is still too wide
    is cut into tables of fewer loads.
    """
    heads = [f"{load / 1e3:g}" for load in made.loads_N]
    lines = _lines(made, heads, texts, range(len(heads)), 10)
    ends = [f"  {limit}" for limit in limits] if limits else [""] * len(texts)
    widest = max((len(line) + len(end) for line, end in zip(lines[1:], ends, strict=True)), default=0)
    if width is None or widest <= width:
        lines[1:] = [f"{line}{end}" for line, end in zip(lines[1:], ends, strict=True)]
    else:
        room = max(1, (width - 13) // 9)
        parts = [range(first, min(first + room, len(heads))) for first in range(0, len(heads), room)]
        lines = [line for part in parts for line in _lines(made, heads, texts, part, 9)]
        if limits:
            lines.append("load limits:")
        for position, limit in zip(made.positions, limits or (), strict=bool(limits)):
            lines += wrap(
                f"{position.lateral_shift_mm:+z8.2f}  {limit}", width, subsequent_indent=" " * 10, drop_whitespace=True
            )
    every = (*notes, _position_text(made.case))
    return "\n".join(lines + [line for note in every for line in (wrap(note, width) if width else [note])])


def _position_text(case: Case) -> str:
    other = other_wheel_label(case)
    same = "; the other wheel at a shift is this one at the opposite shift" if other else ""
    return f"{case.side} wheel, {roll_words(case)}{same}"


def _lines(
    made: ApplicabilityMap, heads: Sequence[str], texts: Sequence[Sequence[str]], part: range, column: int
) -> list[str]:
    """A line of loads, and a line for each position."""
    head = "shift mm " + "".join(heads[k].rjust(column) for k in part) + "  kN"
    return [head] + [
        f"{shift:+z8.2f} " + "".join(row[k].rjust(column) for k in part)
        for shift, row in zip(made.lateral_shifts_mm, texts, strict=True)
    ]


_OTHER_HOLDS = "*"


def _cell_text(cell: MapCell) -> str:
    mark = _OTHER_HOLDS if ellipses_instead(cell.judged) else " "
    return ANSWER_SIGNS[cell.verdict] + _decided_by(cell) + _deviation_text(cell).rjust(6) + mark


def _decided_by(cell: MapCell) -> str:
    # no measure leaves open what did not converge
    if cell.judged is None or cell.status != "converged" or cell.verdict == "HOLDS":
        return " "
    return _MEASURE_LETTERS[cell.judged.verdict.measure]
