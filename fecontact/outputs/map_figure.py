"""The picture of an applicability map: at which loads Hertz holds, over the lateral shift."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.comparison.verdict import AT_JUNCTION
from fecontact.criteria import Criteria
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.map_drawing import (
    DIAMOND,
    Column,
    Sizes,
    Words,
    colour_handles,
    draw_columns,
    first_marks,
    mark_handles,
)
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.roll_words import roll_words
from fecontact.outputs.series import short_name
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, save_figure
from fecontact.outputs.theories import all_ellipses_instead, ellipses_instead
from fecontact.outputs.verdict_words import inclination_words
from fecontact.profiles.identity import profile_identity

CAUSE_LETTERS = {
    "finite bodies": "B",
    "second patch": "S",
    "second lobe": "L",
    "curvature change within the patch": "J",
    "conformity": "C",
    "curvature varies over the patch": "V",
    AT_JUNCTION: "U",
}
"""Marks of the causes in the picture."""


def map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw over lateral shift and load where Hertz holds, as PNG and as SVG.

    The load axis is linear. The colour of a column changes at the loads at which the verdict does, as far as they are
    known: a range left open between two verdicts has its own colour. Each load of the map has the largest part of a
    limit that Hertz uses (he is off from 1 on), with a letter for the cause where he does not hold; every other load
    that was solved is a tick at both sides of its column. A diamond says that he holds there at all touch points, if
    they share the load as springs. Of a symmetric wheelset the axis above is
    that of the other wheel.
    """
    columns = [_column(position) for position in made.positions]
    title = f"{pair_words(made.case)}: where Hertz holds,\n{roll_words(made.case)},\nwithin "
    figure = draw_columns(
        made.case,
        made.loads_N,
        columns,
        title=title + criteria_words(made.case.criteria),
        handles=_handles(made, Sizes(len(columns)).font),
    )
    return save_figure(figure, path)


def pair_words(case: Case) -> str:
    """Rail and wheel, for the title of a picture."""
    rail, wheel = (short_name(profile_identity(spec)) for spec in (case.rail, case.wheel))
    return f"rail {rail}{inclination_words(case.inclination_rad)}, wheel {wheel}"


def answer_bands(limit: LoadLimit) -> tuple[tuple[float, float, str], ...]:
    """Bands of a column in the colours of the verdicts."""
    return tuple((one.low_N / 1e3, one.high_N / 1e3, ANSWERS[one.answer]) for one in limit.intervals)


def solved_loads_kN(cells: Sequence[MapCell], limit: LoadLimit) -> tuple[float, ...]:
    """The loads of a position that were solved, its own and those that its limits come from."""
    own = (cell.load_N for cell in cells if cell.judged is not None)
    return tuple(load / 1e3 for load in (*own, *(load for load, _ in limit.tried)))


def part_words(used: float) -> str:
    """A part of a limit in three characters, whatever it is."""
    return f"{used:.{2 if used < 1.0 else 1 if used < 10.0 else 0}f}"


def _column(position: MapPosition) -> Column:
    return Column(
        shift_mm=position.lateral_shift_mm,
        bands=answer_bands(position.limit),
        solved_kN=solved_loads_kN(position.cells, position.limit),
        words=tuple(_words(cell, position) for cell in position.cells),
    )


def _words(cell: MapCell, position: MapPosition) -> Words:
    letter = "" if cell.cause is None else CAUSE_LETTERS[cell.cause]
    text = "" if cell.judged is None else f"{part_words(cell.judged.limit_used)} {letter}".strip()
    usable = cell.status == "converged"
    return Words(
        load_kN=cell.load_N / 1e3,
        text=text if usable else "!",
        letter=letter if usable else "!",
        colour=ANSWERS[cell.verdict],
        bold=cell.verdict == "FAILS",
        diamond=ellipses_instead(cell.judged) is not None,
    )


def _handles(made: ApplicabilityMap, font: float) -> list[Any]:
    from matplotlib.lines import Line2D

    handles = answer_handles(made.limits)
    if instead := all_ellipses_instead(made):
        handles.append(Line2D([], [], ms=6, label=f"{instead}, holds", **DIAMOND))
    words = first_marks(font, "largest part of a limit\nthat Hertz uses; off from 1 on")
    if not made.all_solved:
        words.append(("$!$", "not to be used"))
    causes = {cell.cause for cell in made.cells}
    words += [(rf"$\mathbf{{{letter}}}$", cause) for cause, letter in CAUSE_LETTERS.items() if cause in causes]
    return handles + mark_handles(words)


def answer_handles(limits: Sequence[LoadLimit]) -> list[Any]:
    """What the colours of the verdicts stand for, of those that are shown."""
    shown: set[str] = {one.answer for limit in limits for one in limit.intervals}
    shown |= {"failed" for limit in limits if not limit.intervals}
    return colour_handles([(ANSWERS[answer], words) for answer, words in ANSWER_WORDS.items() if answer in shown])


def criteria_words(criteria: Criteria) -> str:
    """Measures that decide by their limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre"."""
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}", []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())
