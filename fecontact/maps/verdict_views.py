"""Views of verdicts: theories of the pressure, and Hertz by the verdicts of features."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import PLASTIC_STEP
from fecontact.judging.readings import VerdictReadingView
from fecontact.judging.verdict import ELEMENTS_CAUSE, JUNCTION_CAUSE, PLASTIC_VALIDITY, PROFILE_CAUSE, Judgement
from fecontact.maps.load_limits import find_intervals
from fecontact.maps.measure_views import list_verdict_measures
from fecontact.maps.model import FIRST_YIELD, ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.maps.telling import describe_ellipse_theories, find_ellipse_theory, select_judgement
from fecontact.maps.view import YIELD_WORDS, Band, CellView, ColumnView, MapView, format_utilisation
from fecontact.outputs.style import ANSWER_COLOURS, ANSWER_WORDS, BETWEEN_VERDICTS
from fecontact.outputs.verdict_words import AGAINST_YIELDING_BODIES
from fecontact.outputs.words import MEASURE_WORDS, limits_text

CAUSES: Mapping[str, tuple[str, str]] = {
    "finite bodies": ("B", "the finite bodies change the pressure"),
    "second patch": ("S", "a second patch takes load"),
    "second lobe": ("L", "the pressure has a second lobe"),
    "curvature change within the patch": ("J", "the patch reaches a change of curvature"),
    "conformity": ("C", "the surfaces conform"),
    "curvature varies over the patch": ("V", "the curvature varies over the patch"),
    JUNCTION_CAUSE: ("U", "the curvature jumps at the contact point"),
    PROFILE_CAUSE: ("P", PROFILE_CAUSE),
    ELEMENTS_CAUSE: ("E", ELEMENTS_CAUSE),
    PLASTIC_STEP.cause: ("Y", "the bodies yield"),
}
"""Letter of each cause, and its wording in a sentence."""
CAUSE_LETTERS = {cause: letter for cause, (letter, _) in CAUSES.items()}
"""Letters of the causes in a map."""
_SIGNS = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
_SIGN_WORDS = "+ holds, x fails, ? unresolved, !"
_LIMIT_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "unresolved", BETWEEN_VERDICTS: "not solved"}
# Fraction of the load up to which the range between two verdicts is left out of texts.
_OMITTED_RANGE = 0.05
_OTHER_HOLDS = "*"
SEPARATE_LOAD = "separate_load"
"""Measure of load on separate patches."""


def build_verdict_view(applicability_map: ApplicabilityMap, theory: str = HERTZ) -> MapView:
    """View of the verdicts on a theory of the pressure, with its largest limit utilisation.

    A letter is the cause for which Hertz does not hold. A diamond marks a cell in which another theory holds instead.
    If the theory is undefined in a cell, the cell has the verdict on Hertz.

    Parameters
    ----------
    applicability_map
        Map.
    theory
        Name of a theory of the pressure.

    Returns
    -------
    MapView
        View.
    """
    words, is_hertz = THEORIES[theory].in_sentence, theory == HERTZ
    name, other_theories = (words, describe_ellipse_theories(applicability_map)) if is_hertz else ("it", "")
    cells = {cell: _build_verdict_cell(cell, theory) for cell in applicability_map.cells}
    limits = applicability_map.case.criteria.limits
    return _build_view(
        applicability_map,
        cells,
        lambda position: position.limit if is_hertz else _find_theory_limit(position, theory),
        name,
        {cause: mark for cause, mark in CAUSES.items() if is_hertz},
        title=f"where {words} holds{describe_bodies(applicability_map, is_hertz)}",
        criterion=limits_text(applicability_map.case.criteria),
        number=f"limit utilisation of {name};\nabove 1 it does not hold",
        notes=[
            f"{_SIGN_WORDS} could not be solved; peak pressure, deviation of {words} from FE in %",
            f"decided by {', '.join(f'{MEASURE_WORDS[key].letter} {MEASURE_WORDS[key].short}' for key in limits)}",
            *["Hertz is shown where the theory is undefined"] * (not is_hertz),
            *describe_first_yield(applicability_map),
            *[f"{_OTHER_HOLDS} {other_theories} holds"] * bool(other_theories),
        ],
        diamond=f"{other_theories}, holds" if other_theories else "",
    )


def build_feature_view(applicability_map: ApplicabilityMap, name: str) -> MapView:
    """View of the verdicts on Hertz by a feature or a user's criterion.

    The numbers are limit utilisations.

    The load limits are only as sharp as the spacing of the loads that were solved for the pressure's limits.

    Parameters
    ----------
    applicability_map
        Map.
    name
        Measure of the map.

    Returns
    -------
    MapView
        View.
    """
    verdicts = list_verdict_measures(applicability_map.case)[name]
    criterion = verdicts.criterion(applicability_map.case)
    return _build_view(
        applicability_map,
        {cell: _build_feature_cell(cell, verdicts) for cell in applicability_map.cells},
        lambda position: position.limits_of.get(name, position.limit),
        THEORIES[HERTZ].words,
        verdicts.causes,
        title=verdicts.title,
        criterion=criterion,
        number="limit utilisation of Hertz;\nabove 1 it does not hold",
        notes=[
            f"{_SIGN_WORDS} {verdicts.lost}; number: limit utilisation, limit {criterion}",
            *[f"cause: {', '.join(f'{letter} {cause}' for cause, (letter, _) in verdicts.causes.items())}"]
            * bool(verdicts.causes),
        ],
    )


def _build_view(
    applicability_map: ApplicabilityMap,
    cells: Mapping[MapCell, CellView],
    limit_of: Callable[[MapPosition], LoadLimit],
    name: str,
    causes: Mapping[str, tuple[str, str]],
    **words: Any,
) -> MapView:
    """View of verdicts, with the letters of causes and their meaning.

    Parameters
    ----------
    applicability_map
        Map.
    cells
        View of each cell.
    limit_of
        Function from a position to its load limit.
    name
        Name of the theory in the legend.
    causes
        Letter and meaning of each cause.
    words
        Further attributes of `MapView`.

    Returns
    -------
    MapView
        View.
    """
    columns = [
        _build_column(position, limit_of(position), [cells[cell] for cell in position.cells])
        for position in applicability_map.positions
    ]
    drawn_answers = {answer for column in columns for _, _, answer in column.bands}
    drawn_answers |= {"failed" for column in columns if not column.bands}
    letters = {cell.letter for cell in cells.values()}
    has_shares = any(cell.share is not None for cell in cells.values())
    return MapView(
        case=applicability_map.case,
        loads_N=applicability_map.loads_N,
        columns=tuple(columns),
        colours=ANSWER_COLOURS,
        answers=[
            (answer, meaning.replace("Hertz", name))
            for answer, meaning in ANSWER_WORDS.items()
            if answer in drawn_answers
        ],
        marks=[
            *[("$!$", "no usable result")] * (not applicability_map.all_solved),
            *[("$8/12$", "profile variants on which it holds,\nwith their colour")] * has_shares,
            *((rf"$\mathbf{{{letter}}}$", cause) for letter, cause in causes.values() if letter in letters),
        ],
        **words,
    )


def describe_bodies(applicability_map: ApplicabilityMap, yielding: bool) -> str:
    """Bodies of a verdict as the end of a title: elastic or yielding.

    Parameters
    ----------
    applicability_map
        Map.
    yielding
        Whether the verdict is against yielding bodies, if there is a yield stress.

    Returns
    -------
    str
        Text after a comma; empty without a yield stress.
    """
    if not applicability_map.case.may_yield:
        return ""
    return f", {AGAINST_YIELDING_BODIES if yielding else 'against elastic bodies'}"


def describe_first_yield(applicability_map: ApplicabilityMap) -> list[str]:
    """Smallest load of first yield, with a note on the limits of a first loading.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    list of str
        Note; empty without a yield stress.
    """
    loads_kN = [
        loads[FIRST_YIELD] / 1e3
        for position in applicability_map.positions
        if FIRST_YIELD in (loads := position.yield_loads_N)
    ]
    return [f"smallest load of first yield {min(loads_kN):.3g} kN; {PLASTIC_VALIDITY}"] if loads_kN else []


def list_bands(limit: LoadLimit, open_kN: Collection[float]) -> tuple[Band, ...]:
    """Bands of a load limit: smallest load (kN), largest load (kN) and answer.

    An unresolved stretch without an unresolved load lies between two loads with different verdicts; nothing was
    solved there.

    Parameters
    ----------
    limit
        Load limit.
    open_kN
        Loads with open verdicts, in kN.

    Returns
    -------
    tuple of Band
        Bands by increasing load.
    """
    bands = ((interval.low_N / 1e3, interval.high_N / 1e3, str(interval.answer)) for interval in limit.intervals)
    return tuple(
        (
            low,
            high,
            answer if answer != "UNRESOLVED" or any(low <= load <= high for load in open_kN) else BETWEEN_VERDICTS,
        )
        for low, high, answer in bands
    )


def format_limit(limit: LoadLimit, open_kN: Collection[float]) -> str:
    """Loads at which a theory holds, in words.

    Parameters
    ----------
    limit
        Load limit.
    open_kN
        Loads with open verdicts, in kN.

    Returns
    -------
    str
        Text on the bands, or the reason for missing bands, with the note of the limit.
    """
    texts = [
        f"{_LIMIT_WORDS[answer]} {low:.4g}" + (f" to {high:.4g}" if high > low else "")
        for low, high, answer in list_bands(limit, open_kN)
        if answer != BETWEEN_VERDICTS or high - low > _OMITTED_RANGE * high
    ]
    text = f"{', '.join(texts)} kN" if texts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def _build_column(position: MapPosition, limit: LoadLimit, cells: Sequence[CellView]) -> ColumnView:
    """Column of verdicts at a position."""
    open_kN = {cell.load_kN for cell in cells if cell.answer == "UNRESOLVED"}
    open_kN |= {load_N / 1e3 for load_N, answer in limit.tried if answer == "UNRESOLVED"}
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=list_bands(limit, open_kN),
        solved_kN=list_solved_loads_kN(position) + tuple(load_N / 1e3 for load_N, _ in limit.tried),
        cells=tuple(cells),
        limit=format_limit(limit, open_kN),
        lines=[(load_N / 1e3, YIELD_WORDS[name]) for name, load_N in position.yield_loads_N.items()],
    )


def list_solved_loads_kN(position: MapPosition) -> tuple[float, ...]:
    """Loads (kN) of a position with a judged cell."""
    return tuple(cell.load_kN for cell in position.cells if cell.judged is not None)


def _find_theory_limit(position: MapPosition, theory: str) -> LoadLimit:
    """Load limit of another theory than Hertz, from the map's solved loads."""
    judgements = [(cell, select_judgement(cell.judged, theory)) for cell in position.cells if cell.usable]
    answers_by_load = [
        (cell.load_N, judgement.verdict.answer) for cell, judgement in judgements if judgement is not None
    ]
    return LoadLimit(
        intervals=find_intervals(answers_by_load),
        reason=None
        if answers_by_load
        else position.limit.reason or f"no contact predicted by {THEORIES[theory].in_sentence}",
        note=position.limit.note,
    )


def _build_verdict_cell(cell: MapCell, theory: str) -> CellView:
    """View of a cell with the verdict on a theory of the pressure."""
    judgement, is_hertz = select_judgement(cell.judged, theory), theory == HERTZ
    if judgement is None or not cell.usable:
        # A verdict on an unconverged result has no deciding measure.
        answer = "failed" if judgement is None else judgement.verdict.answer
        return _build_cell_view(cell, answer, "!", "", " " * 8)
    has_ellipse_theory = is_hertz and find_ellipse_theory(cell.judged) is not None
    answer, percent = judgement.verdict.answer, 1e2 * judgement.deviation["p_max_MPa"]
    measure_letter = " " if answer == "HOLDS" else MEASURE_WORDS[judgement.verdict.measure].letter
    deviation_text = f"{percent:+z.1f}" if math.isfinite(percent) else ""
    letter = CAUSE_LETTERS[cell.cause] if is_hertz and cell.cause is not None else ""
    printed = measure_letter + deviation_text.rjust(6) + (_OTHER_HOLDS if has_ellipse_theory else " ")
    view = _build_cell_view(cell, answer, _format_number(judgement), letter, printed, diamond=has_ellipse_theory)
    variant_answers = [*judgement.verdict.variant_answers.values()]
    if answer != "UNRESOLVED" or len({*variant_answers}) < 2:
        return view
    count = variant_answers.count("HOLDS")
    return replace(view, text=f"{count}/{len(variant_answers)} {letter}".strip(), share=count / len(variant_answers))


def _build_feature_cell(cell: MapCell, verdicts: VerdictReadingView) -> CellView:
    """View of a cell with the verdict on Hertz by a feature."""
    judgement = verdicts.read(cell.usable) if cell.usable else None
    if judgement is None:
        return _build_cell_view(cell, "failed", "!", "", "")
    letter, utilisation = (
        verdicts.causes.get(judgement.verdict.cause or "", ("", ""))[0],
        format_utilisation(judgement.limit_utilisation),
    )
    return _build_cell_view(cell, judgement.verdict.answer, utilisation, letter, f"{letter or ' '}{utilisation:>6}")


def _build_cell_view(
    cell: MapCell, answer: str, number: str, letter: str, printed: str, *, diamond: bool = False
) -> CellView:
    """View of a cell with a number and a letter.

    In the table they follow the sign of the answer.

    Parameters
    ----------
    cell
        Cell of a map.
    answer
        Verdict, or `failed`.
    number
        Number in the cell, or "!".
    letter
        Letter of the cause.
    printed
        Text in the table after the sign.
    diamond
        Whether a diamond is drawn below the text.

    Returns
    -------
    CellView
        View.
    """
    return CellView(
        load_kN=cell.load_kN,
        answer=answer,
        text=f"{number} {letter}".strip(),
        letter="!" if number == "!" else letter,
        printed=_SIGNS[answer] + printed,
        bold=answer == "FAILS",
        diamond=diamond,
    )


def _format_number(judgement: JudgedLoad | Judgement) -> str:
    """Limit utilisation as a text; empty if load on separate patches decides.

    The limit of load on separate patches is close to zero, so its utilisation says little.
    """
    if judgement.verdict.measure != SEPARATE_LOAD or judgement.verdict.answer == "HOLDS":
        return format_utilisation(judgement.limit_utilisation)
    return ""
