"""Views of the cheapest theory that holds: theories of the pressure, and laws of features."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain, repeat

from fecontact.contact_theories.registry import THEORIES
from fecontact.feature_registry import load_offers
from fecontact.judging.readings import LawReadingView
from fecontact.judging.verdict import (
    Judgement,
    TheoryAnswer,
    find_cheaper_possible_theory,
    find_cheapest_theory,
    list_theory_answers,
)
from fecontact.maps.load_limits import find_stretches
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.maps.telling import read_laws
from fecontact.maps.verdict_views import describe_bodies, list_solved_loads_kN
from fecontact.maps.view import CellView, ColumnView, MapView, format_utilisation
from fecontact.outputs.records.cheapest import judgements_by_theory
from fecontact.outputs.style import ANSWER_COLOURS, ANSWER_WORDS, BETWEEN_VERDICTS
from fecontact.outputs.words import limits_text

# Colours of the theories of the pressure, from the cheapest. Theories beyond the list have the last colour.
_PRESSURE_COLOURS = (
    *("#d3ebf8", "#8fcbed", "#56a5d8"),
    *("#d5efd0", "#a5dba2", "#66c2a5", "#2a9d78"),
    *("#f5d2a8", "#f5b878"),
)
_OPEN, _NONE, _LOST = "UNRESOLVED", "FAILS", "failed"
_OUT_MARK, _OUT_WORDS = "*", "out of range"


def find_judged_laws(applicability_map: ApplicabilityMap) -> dict[str, LawReadingView]:
    """Laws of features that were judged in a map.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    dict of LawReadingView
        Laws by the name of the feature's entry.
    """
    return {
        name: laws
        for name, laws in load_offers("LAWS").items()
        if any(read_laws(cell, laws) for cell in applicability_map.cells)
    }


def build_theory_view(applicability_map: ApplicabilityMap) -> MapView:
    """View of the cheapest theory of the pressure that holds, with its largest limit utilisation.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    MapView
        View.
    """
    judged_names = {
        name for cell in applicability_map.cells if cell.usable for name in judgements_by_theory(cell.usable)
    }
    names = [name for name in THEORIES if name in judged_names]
    colours = chain(_PRESSURE_COLOURS, repeat(_PRESSURE_COLOURS[-1]))
    title = "the cheapest theory that holds"
    theories = LawReadingView(
        title=f"{title}{describe_bodies(applicability_map, yielding=False)}",
        criterion=lambda case: limits_text(case.criteria),
        lost="could not be solved",
        laws={name: {"words": THEORIES[name].words} for name in names},
        read=judgements_by_theory,
        marks={name: (THEORIES[name].letter, colour) for name, colour in zip(names, colours, strict=False)},
        note=f"{title}, with its limit utilisation",
        number="limit utilisation;\nabove 1 the theory does not hold",
        of=lambda _, judged_names: format_utilisation(judged_names.limit_utilisation),
        in_range=not applicability_map.case.criteria.theories_out_of_range,
    )
    return build_law_view(applicability_map, theories)


def build_law_view(applicability_map: ApplicabilityMap, theories: LawReadingView) -> MapView:
    """View of the cheapest theory or law that holds.

    A stretch between two loads with different answers was not solved. A load without a certain answer is unresolved.

    Parameters
    ----------
    applicability_map
        Map.
    theories
        Theories of the pressure, or laws of a feature.

    Returns
    -------
    MapView
        View.
    """
    columns = tuple(_build_column(position, theories) for position in applicability_map.positions)
    cell_answers = {cell.answer for column in columns for cell in column.cells}
    drawn_answers = cell_answers | {answer for column in columns for _, _, answer in column.bands}
    cheapest_theories = [_find_cheapest(read_laws(cell, theories), theories) for cell in applicability_map.cells]
    criterion = theories.criterion(applicability_map.case) or ""
    cheapest_names, out_of_range = (
        {theory.name for theory in cheapest_theories},
        any(theory.out_of_range for theory in cheapest_theories),
    )
    words_of = {name: law["words"] for name, law in theories.laws.items()}
    letters = {name: f"{theories.marks[name][0]}  {words}" for name, words in words_of.items()}
    other_answers = {
        _NONE: "none holds",
        _LOST: theories.lost,
        _OPEN: "unresolved",
        BETWEEN_VERDICTS: ANSWER_WORDS[BETWEEN_VERDICTS],
    }
    marks = {_NONE: ("$x$", "none holds"), _LOST: ("$!$", theories.lost), _OPEN: ("$?$", "unresolved")}
    return MapView(
        case=applicability_map.case,
        loads_N=applicability_map.loads_N,
        columns=columns,
        title=theories.title,
        criterion=criterion,
        colours={**ANSWER_COLOURS, **{name: colour for name, (_, colour) in theories.marks.items()}},
        answers=[
            *((name, words) for name, words in letters.items() if name in cheapest_names),
            *((answer, words) for answer, words in other_answers.items() if answer in drawn_answers),
        ],
        marks=[mark for answer, mark in marks.items() if answer in cell_answers]
        + [(f"${_OUT_MARK}$", _OUT_WORDS)] * out_of_range,
        number=theories.number,
        notes=[
            theories.note.format(within=criterion),
            ", ".join(f"{theories.marks[name][0]} {words}" for name, words in words_of.items()),
            f"? unresolved{', x none holds' * (_NONE in cell_answers)}, ! {theories.lost}"
            + f", {_OUT_MARK} {_OUT_WORDS}" * out_of_range,
            *_describe_cheaper_theories(applicability_map, theories, words_of),
        ],
    )


def _describe_cheaper_theories(
    applicability_map: ApplicabilityMap, theories: LawReadingView, words_of: Mapping[str, str]
) -> list[str]:
    """List a footnote on the cheaper theories that may hold, if there are any."""
    cheaper_theories = [
        find_cheaper_possible_theory(list_theory_answers(read_laws(cell, theories)), in_range=theories.in_range)
        for cell in applicability_map.cells
    ]
    names = [theory.name for theory in cheaper_theories if theory.name]
    words = " or ".join(words_of[name] for name in dict.fromkeys(names))
    return [f"cells in which a cheaper one may hold: {len(names)} ({words})"] if names else []


def _find_cheapest(judgements: Mapping[str, Judgement], theories: LawReadingView) -> TheoryAnswer:
    """Cheapest theory or law that holds, from the judgements of a cell."""
    return find_cheapest_theory(list_theory_answers(judgements), in_range=theories.in_range)


def _build_column(position: MapPosition, theories: LawReadingView) -> ColumnView:
    """Column of the cheapest theory or law that holds at a position."""
    cell_views = tuple(_build_cell_view(cell, theories) for cell in position.cells)
    answers_by_load = [(cell.load_kN, cell.answer) for cell in cell_views if cell.answer != _LOST]
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=find_stretches(answers_by_load, BETWEEN_VERDICTS),
        solved_kN=list_solved_loads_kN(position),
        cells=cell_views,
    )


def _build_cell_view(cell: MapCell, theories: LawReadingView) -> CellView:
    """View of a cell with the cheapest theory or law that holds."""
    judgements, load_kN = read_laws(cell, theories), cell.load_kN
    theory = _find_cheapest(judgements, theories)
    if not theory.name:
        text = "x" if judgements else "!"
        return CellView(load_kN=load_kN, answer=_NONE if judgements else _LOST, text=text, letter=text)
    letter = theories.marks[theory.name][0] + "?" * (theory.answer == _OPEN) + _OUT_MARK * theory.out_of_range
    text = f"{letter} {theories.of(theory.name, judgements[theory.name])}".strip()
    return CellView(load_kN=load_kN, answer=theory.label, text=text, letter=letter, out_of_range=theory.out_of_range)
