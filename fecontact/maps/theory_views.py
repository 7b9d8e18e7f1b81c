"""Views of the cheapest theory that holds: of the pressure, and of the laws of features."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain, repeat

from fecontact.contact_theories.registry import THEORIES
from fecontact.feature_registry import offered
from fecontact.judging.readings import MappedLaws
from fecontact.judging.verdict import Judgement, Standing, cheapest, standings
from fecontact.maps.load_limits import stretches
from fecontact.maps.model import ApplicabilityMap, MapCell, MapPosition
from fecontact.maps.telling import laws_of
from fecontact.maps.verdict_views import against, solved_loads_kN
from fecontact.maps.view import CellView, ColumnView, MapView, part_words
from fecontact.outputs.records.cheapest import theories_of
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.words import limits_text

# Of theories of the pressure, from the cheapest; a further one has the last.
_PRESSURE_COLOURS = (
    *("#d3ebf8", "#8fcbed", "#56a5d8"),
    *("#d5efd0", "#a5dba2", "#66c2a5", "#2a9d78"),
    *("#f5d2a8", "#f5b878"),
)
_OPEN, _NONE, _LOST = "UNRESOLVED", "FAILS", "failed"
_OUT, _OUT_WORDS = "*", "out of its range"


def laws_judged(made: ApplicabilityMap) -> dict[str, MappedLaws]:
    """Laws of features that were judged in a map, by its name."""
    return {name: laws for name, laws in offered("LAWS").items() if any(laws_of(cell, laws) for cell in made.cells)}


def theory_view(made: ApplicabilityMap) -> MapView:
    """The cheapest theory of the pressure that holds, and the largest part of a limit that it uses."""
    judged = {name for cell in made.cells if cell.usable for name in theories_of(cell.usable)}
    names = [name for name in THEORIES if name in judged]
    colours = chain(_PRESSURE_COLOURS, repeat(_PRESSURE_COLOURS[-1]))
    title = "the cheapest theory that holds" + " in its range" * made.case.criteria.theories_in_range
    theories = MappedLaws(
        title=f"{title}{against(made, yielding=False)}",
        criterion=lambda case: limits_text(case.criteria),
        lost="could not be solved",
        laws={name: {"words": THEORIES[name].words} for name in names},
        read=theories_of,
        marks={name: (THEORIES[name].letter, colour) for name, colour in zip(names, colours, strict=False)},
        note=f"{title}, and the largest share of a limit that it uses",
        number="share of the error limit\nthat it uses; above 1 it does not hold",
        of=lambda _, judged: part_words(judged.limit_used),
        in_range=made.case.criteria.theories_in_range,
    )
    return law_view(made, theories)


def law_view(made: ApplicabilityMap, theories: MappedLaws) -> MapView:
    """The cheapest of some theories or laws that holds.

    A stretch between two loads with different answers was not solved; a load whose answer is open is unresolved.
    """
    columns = tuple(_cheapest_column(position, theories) for position in made.positions)
    given = {cell.answer for column in columns for cell in column.cells}
    painted = given | {answer for column in columns for _, _, answer in column.bands}
    found = [_cheapest(laws_of(cell, theories), theories) for cell in made.cells]
    within = theories.criterion(made.case) or ""
    standing, out_of_range = {one.name for one in found}, any(one.out_of_range for one in found)
    words_of = {name: law["words"] for name, law in theories.laws.items()}
    letters = {name: f"{theories.marks[name][0]}  {words}" for name, words in words_of.items()}
    others = {_NONE: "none holds", _LOST: theories.lost, _OPEN: "unresolved", BETWEEN: ANSWER_WORDS[BETWEEN]}
    marks = {_NONE: ("$x$", "none holds"), _LOST: ("$!$", theories.lost), _OPEN: ("$?$", "open whether it holds")}
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=columns,
        title=theories.title,
        criterion=within,
        colours={**ANSWERS, **{name: colour for name, (_, colour) in theories.marks.items()}},
        answers=[
            *((name, words) for name, words in letters.items() if name in standing),
            *((answer, words) for answer, words in others.items() if answer in painted),
        ],
        marks=[mark for answer, mark in marks.items() if answer in given] + [(f"${_OUT}$", _OUT_WORDS)] * out_of_range,
        number=theories.number,
        notes=[
            theories.note.format(within=within),
            ", ".join(f"{theories.marks[name][0]} {words}" for name, words in words_of.items()),
            f"? open whether it holds{', x none holds' * (_NONE in given)}, ! {theories.lost}"
            + f", {_OUT} {_OUT_WORDS}" * out_of_range,
        ],
    )


def _cheapest(judged: Mapping[str, Judgement], theories: MappedLaws) -> Standing:
    return cheapest(standings(judged), in_range=theories.in_range)


def _cheapest_column(position: MapPosition, theories: MappedLaws) -> ColumnView:
    shown = tuple(_cell(cell, theories) for cell in position.cells)
    known = [(cell.load_kN, cell.answer) for cell in shown if cell.answer != _LOST]
    return ColumnView(
        shift_mm=position.lateral_shift_mm,
        bands=stretches(known, BETWEEN),
        solved_kN=solved_loads_kN(position),
        cells=shown,
    )


def _cell(cell: MapCell, theories: MappedLaws) -> CellView:
    judged, load_kN = laws_of(cell, theories), cell.load_kN
    found = _cheapest(judged, theories)
    if not found.name:
        text = "x" if judged else "!"
        return CellView(load_kN=load_kN, answer=_NONE if judged else _LOST, text=text, letter=text)
    letter = theories.marks[found.name][0] + "?" * (found.answer == _OPEN) + _OUT * found.out_of_range
    text = f"{letter} {theories.of(found.name, judged[found.name])}".strip()
    return CellView(load_kN=load_kN, answer=found.label, text=text, letter=letter, out_of_range=found.out_of_range)
