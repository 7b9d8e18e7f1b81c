"""Maps of verdicts: where a theory of the pressure holds, and where Hertz does for creep forces."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import partial

from fecontact.comparison.creep_verdict import PLACE, SHAPE
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.plastic_verdict import NOT_IN_IT
from fecontact.comparison.theories import HERTZ, THEORIES
from fecontact.comparison.verdict import AT_JUNCTION, ELEMENTS, PROFILE
from fecontact.map.cells import (
    FIRST_YIELD,
    PLASTIC_LIMIT,
    ApplicabilityMap,
    LoadInterval,
    LoadLimit,
    MapCell,
    MapPosition,
)
from fecontact.map.load_limit import stretches
from fecontact.outputs.figures.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.maps.view import Band, CellView, ColumnView, MapView, part_words
from fecontact.outputs.records.theories import all_ellipses_instead, ellipses_instead, judged_by
from fecontact.outputs.words.measures import WORDS, limits_text

CAUSES: Mapping[str, tuple[str, str]] = {
    "finite bodies": ("B", "the finite bodies change the pressure"),
    "second patch": ("S", "a second patch takes load"),
    "second lobe": ("L", "the pressure has a second lobe"),
    "curvature change within the patch": ("J", "the patch reaches a change of curvature"),
    "conformity": ("C", "the surfaces conform"),
    "curvature varies over the patch": ("V", "the curvature varies over the patch"),
    AT_JUNCTION: ("U", "the curvature jumps at the touch point"),
    PROFILE: ("P", PROFILE),
    ELEMENTS: ("E", ELEMENTS),
}
"""Marks of the causes, and what is said of them in a sentence."""
CAUSE_LETTERS = {cause: letter for cause, (letter, _) in CAUSES.items()}
_FORCE_CAUSES = {PLACE: ("P", "centre of pressure beside\nthe touch point"), SHAPE: ("F", SHAPE)}
YIELD_WORDS: Mapping[str, str] = {
    FIRST_YIELD: "first yield of virgin steel",
    PLASTIC_LIMIT: "yielding alone takes up a limit\nat first loading",
}
"""What the lines of a map stand for where a yield stress is given."""
_SIGNS = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
_SIGN_WORDS = "+ holds, x fails, ? unresolved, !"
_LIMIT_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "open", BETWEEN: "not solved"}
# A change of the verdict that is known to this part of its load needs no words of what lies between.
_KNOWN_WELL = 0.05
_OTHER_HOLDS = "*"
SEPARATE = "separate_load"
"""The measure of load on separate patches."""


def verdict_view(made: ApplicabilityMap, theory: str = HERTZ) -> MapView:
    """Where a theory of the pressure holds, with the largest part of a limit that it uses.

    A letter says why Hertz does not hold, and a diamond that another theory does there. A theory that says nothing of
    its own at a position is Hertz there.
    """
    words, of_hertz = THEORIES[theory].words, theory == HERTZ
    name = words if of_hertz else "it"
    columns = [
        _column(
            position,
            position.limit if of_hertz else _limit_of(position, theory),
            [_verdict_cell(cell, theory) for cell in position.cells],
        )
        for position in made.positions
    ]
    causes = {cell.cause for cell in made.cells} if of_hertz else set()
    measures = made.case.criteria.limits
    notes = [
        f"{_SIGN_WORDS} could not be solved; peak pressure, {words} against FE in %",
        f"decided by {', '.join(f'{WORDS[name].letter} {WORDS[name].short}' for name in measures)}",
    ]
    if not of_hertz:
        notes.append("where it says nothing of its own it is Hertz")
    notes += yield_notes(made)
    instead = all_ellipses_instead(made) if of_hertz else ""
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=tuple(columns),
        title=f"where {words} holds",
        criterion=limits_text(made.case.criteria),
        colours=ANSWERS,
        answers=_answers(columns, name),
        marks=[
            *_unsolved(made),
            *(_mark(letter, cause) for cause, letter in CAUSE_LETTERS.items() if cause in causes),
        ],
        number=f"largest part of a limit\nthat {name} uses; off from 1 on"
        + "\n%: load on separate patches" * any("%" in cell.text for column in columns for cell in column.cells),
        notes=[*notes, f"{_OTHER_HOLDS} {instead} holds"] if instead else notes,
        diamond=f"{instead}, holds" if instead else "",
        lines=[words for words in YIELD_WORDS.values() if any(words in dict(one.lines).values() for one in columns)],
    )


def yield_notes(made: ApplicabilityMap) -> list[str]:
    """Loads of first yield, with what a first loading does not say; none where no yield stress is given."""
    loads_kN = [loads[FIRST_YIELD] / 1e3 for one in made.positions if FIRST_YIELD in (loads := one.yield_loads_N)]
    return [f"first yield from {min(loads_kN):.3g} kN on; {NOT_IN_IT}"] if loads_kN else []


def force_view(made: ApplicabilityMap) -> MapView:
    """Where Hertz holds for creep forces, with the part of the limit of forces that it uses.

    Load limits are as sharp as the loads that were solved for those of pressure. What was not solved has no forces.
    """
    columns = [
        _column(position, position.force_limit or position.limit, [_force_cell(cell) for cell in position.cells])
        for position in made.positions
    ]
    causes = {cell.force.verdict.cause for cell in made.cells if cell.force}
    within = force_criterion(made)
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=tuple(columns),
        title="where Hertz holds for creep forces",
        criterion=within,
        colours=ANSWERS,
        answers=_answers(columns, THEORIES[HERTZ].words),
        marks=[
            *_unsolved(made),
            *(_mark(letter, words) for cause, (letter, words) in _FORCE_CAUSES.items() if cause in causes),
        ],
        number="part of the limit that\nHertz uses; off from 1 on",
        notes=[
            f"{_SIGN_WORDS} no forces: not solved; part of the limit of {within}",
            f"off by {', '.join(f'{letter} {cause}' for cause, (letter, _) in _FORCE_CAUSES.items())}",
        ],
    )


def bands_of(limit: LoadLimit, open_kN: Collection[float]) -> tuple[Band, ...]:
    """Smallest and largest load (kN) and answer of each stretch of loads, of which those of open verdicts are given.

    A stretch without any of them lies between two loads with different verdicts, and nothing was solved there.
    """
    bands = []
    for one in limit.intervals:
        low, high, answer = one.low_N / 1e3, one.high_N / 1e3, str(one.answer)
        if answer == "UNRESOLVED" and not any(low <= load <= high for load in open_kN):
            answer = BETWEEN
        bands.append((low, high, answer))
    return tuple(bands)


def limit_text(limit: LoadLimit, open_kN: Collection[float]) -> str:
    """At which loads a theory holds, in words; `open_kN` as in `bands_of`."""
    parts = [
        f"{_LIMIT_WORDS[answer]} {low:.4g}" + (f" to {high:.4g}" if high > low else "")
        for low, high, answer in bands_of(limit, open_kN)
        if answer != BETWEEN or high - low > _KNOWN_WELL * high
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def force_criterion(made: ApplicabilityMap) -> str:
    """Limit, friction and creepages in words."""
    creep = made.case.creep
    assert creep.friction is not None
    surfaces = ", which follow the curved surfaces" if creep.curved else ""
    return (
        f"{1e2 * creep.force_limit:g} % of µN, friction {creep.friction:g}, creepages up to"
        f" {1e2 * creep.largest_creepage:g} %{surfaces}"
    )


def _column(position: MapPosition, limit: LoadLimit, cells: Sequence[CellView]) -> ColumnView:
    own = (cell.load_N for cell in position.cells if cell.judged is not None)
    open_kN = {cell.load_kN for cell in cells if cell.answer == "UNRESOLVED"}
    open_kN |= {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"}
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=bands_of(limit, open_kN),
        solved_kN=tuple(load_N / 1e3 for load_N in (*own, *(load_N for load_N, _ in limit.tried))),
        cells=tuple(cells),
        limit=limit_text(limit, open_kN),
        lines=[(load_N / 1e3, YIELD_WORDS[name]) for name, load_N in position.yield_loads_N.items()],
    )


def _limit_of(position: MapPosition, theory: str) -> LoadLimit:
    """At which loads another theory than Hertz holds, from the loads that were solved for the map."""
    told = [(cell, judged_by(cell.judged, theory)) for cell in position.cells if cell.usable]
    known = [(cell.load_N, judged.verdict.answer) for cell, judged in told if judged is not None]
    found = stretches(known, "UNRESOLVED")
    return LoadLimit(
        intervals=tuple(LoadInterval(low_N=low_N, high_N=high_N, answer=answer) for low_N, high_N, answer in found),
        reason=None if known else position.limit.reason or f"no contact by {THEORIES[theory].words}",
        note=position.limit.note,
    )


def _verdict_cell(cell: MapCell, theory: str) -> CellView:
    judged, of_hertz = judged_by(cell.judged, theory), theory == HERTZ
    answer = "failed" if judged is None else judged.verdict.answer
    shown = partial(CellView, load_kN=cell.load_kN, answer=answer, bold=answer == "FAILS")
    if judged is None or not cell.usable:
        # no measure leaves open what did not converge
        return shown(text="!", letter="!", printed=_SIGNS[answer] + " " * 8)
    letter = CAUSE_LETTERS[cell.cause] if of_hertz and cell.cause is not None else ""
    instead = of_hertz and ellipses_instead(cell.judged) is not None
    by = " " if answer == "HOLDS" else WORDS[judged.verdict.measure].letter
    percent = 1e2 * judged.deviation["p_max_MPa"]
    off = f"{percent:+z.1f}" if math.isfinite(percent) else ""
    return shown(
        text=f"{_number(judged)} {letter}".strip(),
        letter=letter,
        printed=_SIGNS[answer] + by + off.rjust(6) + (_OTHER_HOLDS if instead else " "),
        diamond=instead,
    )


def _number(judged: JudgedLoad | Judgement) -> str:
    """The part of a limit that is used; of load on separate patches, whose limit is next to nothing, the load."""
    if judged.verdict.measure != SEPARATE or judged.verdict.answer == "HOLDS":
        return part_words(judged.limit_used)
    return f"{1e2 * judged.deviation[SEPARATE]:.2g}%"


def _force_cell(cell: MapCell) -> CellView:
    force, load_kN = cell.force, cell.load_kN
    if force is None:
        return CellView(load_kN=load_kN, answer="failed", text="!", letter="!", printed="!")
    answer, letter = force.verdict.answer, _FORCE_CAUSES.get(force.verdict.cause or "", ("", ""))[0]
    part = part_words(force.limit_used)
    return CellView(
        load_kN=load_kN,
        answer=answer,
        text=f"{part} {letter}".strip(),
        letter=letter,
        printed=f"{_SIGNS[answer]}{letter or ' '}{part:>6}",
        bold=answer == "FAILS",
    )


def _answers(columns: Sequence[ColumnView], words: str) -> list[tuple[str, str]]:
    """The verdicts that are shown, and what their colours stand for."""
    shown = {answer for column in columns for _, _, answer in column.bands}
    shown |= {"failed" for column in columns if not column.bands}
    return [(answer, said.replace("Hertz", words)) for answer, said in ANSWER_WORDS.items() if answer in shown]


def _unsolved(made: ApplicabilityMap) -> list[tuple[str, str]]:
    return [] if made.all_solved else [("$!$", "not to be used")]


def _mark(letter: str, words: str) -> tuple[str, str]:
    return rf"$\mathbf{{{letter}}}$", words
