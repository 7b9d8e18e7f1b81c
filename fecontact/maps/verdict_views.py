"""Views of verdicts: where a theory of the pressure holds, and where Hertz does by what features judge."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.feature_registry import offered
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import PLASTIC
from fecontact.judging.readings import MappedVerdicts
from fecontact.judging.verdict import AT_JUNCTION, ELEMENTS, NOT_IN_IT, PROFILE, Judgement
from fecontact.maps.load_limits import intervals_of
from fecontact.maps.model import FIRST_YIELD, ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.maps.telling import all_ellipses_instead, ellipses_instead, judged_by
from fecontact.maps.view import YIELD_WORDS, Band, CellView, ColumnView, MapView, part_words
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.verdict_words import YIELDING
from fecontact.outputs.words import WORDS, limits_text

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
    PLASTIC.cause: ("Y", "the bodies yield"),
}
"""Marks of the causes, and what is said of them in a sentence."""
CAUSE_LETTERS = {cause: letter for cause, (letter, _) in CAUSES.items()}
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

    A letter says why Hertz does not hold, and a diamond that another theory does there. Where the
    theory is undefined, Hertz is shown.
    """
    words, of_hertz = THEORIES[theory].in_sentence, theory == HERTZ
    name, instead = (words, all_ellipses_instead(made)) if of_hertz else ("it", "")
    cells = {cell: _verdict_cell(cell, theory) for cell in made.cells}
    of_load = any("%" in cell.text for cell in cells.values())
    return _verdicts(
        made,
        cells,
        lambda position: position.limit if of_hertz else _limit_of(position, theory),
        name,
        {cause: mark for cause, mark in CAUSES.items() if of_hertz},
        title=f"where {words} holds{against(made, of_hertz)}",
        criterion=limits_text(made.case.criteria),
        number=f"share of the error limit\nthat {name} uses; above 1 it does not hold"
        + "\n%: load on separate patches" * of_load,
        notes=[
            f"{_SIGN_WORDS} could not be solved; peak pressure, {words} against FE in %",
            f"decided by {', '.join(f'{WORDS[one].letter} {WORDS[one].short}' for one in made.case.criteria.limits)}",
            *["where the theory is undefined, Hertz is shown"] * (not of_hertz),
            *yield_notes(made),
            *[f"{_OTHER_HOLDS} {instead} holds"] * bool(instead),
        ],
        diamond=f"{instead}, holds" if instead else "",
    )


def offered_view(made: ApplicabilityMap, name: str) -> MapView:
    """Where Hertz holds by the verdict of a feature, with the part of its limit that Hertz uses.

    Load limits are only as sharp as the spacing of the loads that were solved for the pressure's limits.
    """
    of: MappedVerdicts = offered("MAPS")[name]
    within = of.criterion(made.case)
    return _verdicts(
        made,
        {cell: _offered_cell(cell, of) for cell in made.cells},
        lambda position: position.limits_of.get(name, position.limit),
        THEORIES[HERTZ].words,
        of.causes,
        title=of.title,
        criterion=within,
        number="share of the error limit\nthat Hertz uses; above 1 it does not hold",
        notes=[
            f"{_SIGN_WORDS} {of.lost}; part of the limit of {within}",
            f"off by {', '.join(f'{letter} {cause}' for cause, (letter, _) in of.causes.items())}",
        ],
    )


def _verdicts(
    made: ApplicabilityMap,
    cells: Mapping[MapCell, CellView],
    limit_of: Callable[[MapPosition], LoadLimit],
    name: str,
    causes: Mapping[str, tuple[str, str]],
    **words: Any,
) -> MapView:
    """A map of the verdicts of what has a name, with letters of causes and what they stand for."""
    columns = [_column(one, limit_of(one), [cells[cell] for cell in one.cells]) for one in made.positions]
    painted = {answer for column in columns for _, _, answer in column.bands}
    painted |= {"failed" for column in columns if not column.bands}
    letters = {cell.letter for cell in cells.values()}
    of_lines = any(cell.share is not None for cell in cells.values())
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=tuple(columns),
        colours=ANSWERS,
        answers=[(answer, said.replace("Hertz", name)) for answer, said in ANSWER_WORDS.items() if answer in painted],
        marks=[
            *[("$!$", "not to be used")] * (not made.all_solved),
            *[("$8/12$", "on how many lines of the points\nit holds, and their colour")] * of_lines,
            *((rf"$\mathbf{{{letter}}}$", cause) for letter, cause in causes.values() if letter in letters),
        ],
        **words,
    )


def against(made: ApplicabilityMap, yielding: bool) -> str:
    """Which bodies a verdict is against, for the end of a title; empty without a yield stress."""
    if not made.case.may_yield:
        return ""
    return f", {YIELDING if yielding else 'against elastic bodies'}"


def yield_notes(made: ApplicabilityMap) -> list[str]:
    """Loads of first yield, with what a first loading does not say; none where no yield stress is given."""
    loads_kN = [loads[FIRST_YIELD] / 1e3 for one in made.positions if FIRST_YIELD in (loads := one.yield_loads_N)]
    return [f"first yield from {min(loads_kN):.3g} kN on; {NOT_IN_IT}"] if loads_kN else []


def bands_of(limit: LoadLimit, open_kN: Collection[float]) -> tuple[Band, ...]:
    """Smallest and largest load (kN) and answer of each stretch of loads; `open_kN` are loads with open verdicts.

    A stretch without any of them lies between two loads with different verdicts, and nothing was solved there.
    """
    bands = ((one.low_N / 1e3, one.high_N / 1e3, str(one.answer)) for one in limit.intervals)
    return tuple(
        (low, high, answer if answer != "UNRESOLVED" or any(low <= load <= high for load in open_kN) else BETWEEN)
        for low, high, answer in bands
    )


def limit_text(limit: LoadLimit, open_kN: Collection[float]) -> str:
    """At which loads a theory holds, in words; `open_kN` as in `bands_of`."""
    parts = [
        f"{_LIMIT_WORDS[answer]} {low:.4g}" + (f" to {high:.4g}" if high > low else "")
        for low, high, answer in bands_of(limit, open_kN)
        if answer != BETWEEN or high - low > _KNOWN_WELL * high
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def _column(position: MapPosition, limit: LoadLimit, cells: Sequence[CellView]) -> ColumnView:
    open_kN = {cell.load_kN for cell in cells if cell.answer == "UNRESOLVED"}
    open_kN |= {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"}
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=bands_of(limit, open_kN),
        solved_kN=solved_loads_kN(position) + tuple(load_N / 1e3 for load_N, _ in limit.tried),
        cells=tuple(cells),
        limit=limit_text(limit, open_kN),
        lines=[(load_N / 1e3, YIELD_WORDS[name]) for name, load_N in position.yield_loads_N.items()],
    )


def solved_loads_kN(position: MapPosition) -> tuple[float, ...]:
    """Loads (kN) of a position with a judged cell."""
    return tuple(cell.load_kN for cell in position.cells if cell.judged is not None)


def _limit_of(position: MapPosition, theory: str) -> LoadLimit:
    """At which loads another theory than Hertz holds, from the loads that were solved for the map."""
    told = [(cell, judged_by(cell.judged, theory)) for cell in position.cells if cell.usable]
    known = [(cell.load_N, judged.verdict.answer) for cell, judged in told if judged is not None]
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else position.limit.reason or f"no contact by {THEORIES[theory].in_sentence}",
        note=position.limit.note,
    )


def _verdict_cell(cell: MapCell, theory: str) -> CellView:
    judged, of_hertz = judged_by(cell.judged, theory), theory == HERTZ
    if judged is None or not cell.usable:
        # no measure leaves open what did not converge
        answer = "failed" if judged is None else judged.verdict.answer
        return _marked(cell, answer, "!", "", " " * 8)
    instead = of_hertz and ellipses_instead(cell.judged) is not None
    answer, percent = judged.verdict.answer, 1e2 * judged.deviation["p_max_MPa"]
    by = " " if answer == "HOLDS" else WORDS[judged.verdict.measure].letter
    off = f"{percent:+z.1f}" if math.isfinite(percent) else ""
    letter = CAUSE_LETTERS[cell.cause] if of_hertz and cell.cause is not None else ""
    printed = by + off.rjust(6) + (_OTHER_HOLDS if instead else " ")
    shown = _marked(cell, answer, _number(judged), letter, printed, diamond=instead)
    lines = [*judged.verdict.lines.values()]
    if answer != "UNRESOLVED" or len({*lines}) < 2:
        return shown
    holds = lines.count("HOLDS")
    return replace(shown, text=f"{holds}/{len(lines)} {letter}".strip(), share=holds / len(lines))


def _offered_cell(cell: MapCell, of: MappedVerdicts) -> CellView:
    judged = of.read(cell.usable) if cell.usable else None
    if judged is None:
        return _marked(cell, "failed", "!", "", "")
    letter, part = of.causes.get(judged.verdict.cause or "", ("", ""))[0], part_words(judged.limit_used)
    return _marked(cell, judged.verdict.answer, part, letter, f"{letter or ' '}{part:>6}")


def _marked(cell: MapCell, answer: str, number: str, letter: str, printed: str, *, diamond: bool = False) -> CellView:
    """A cell with its number and a letter, printed behind the sign of its answer."""
    return CellView(
        load_kN=cell.load_kN,
        answer=answer,
        text=f"{number} {letter}".strip(),
        letter="!" if number == "!" else letter,
        printed=_SIGNS[answer] + printed,
        bold=answer == "FAILS",
        diamond=diamond,
    )


def _number(judged: JudgedLoad | Judgement) -> str:
    """The part of a limit that is used; of load on separate patches, whose limit is next to nothing, the load."""
    if judged.verdict.measure != SEPARATE or judged.verdict.answer == "HOLDS":
        return part_words(judged.limit_used)
    return f"{1e2 * judged.deviation[SEPARATE]:.2g}%"
