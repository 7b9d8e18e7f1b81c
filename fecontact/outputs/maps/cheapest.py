"""Maps of the cheapest theory that holds: of the laws of creep forces, and of the theories of the pressure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain, repeat
from string import ascii_uppercase

from fecontact.comparison.creep_theories import CREEP_LAWS, REAL
from fecontact.comparison.judgement import FORCE, Judgement, Standing, cheapest, standings
from fecontact.comparison.theories import THEORIES
from fecontact.map.cells import ApplicabilityMap, MapCell
from fecontact.map.load_limit import stretches
from fecontact.outputs.figures.style import ANSWER_WORDS, ANSWERS, BETWEEN
from fecontact.outputs.maps.verdicts import force_criterion
from fecontact.outputs.maps.view import CellView, ColumnView, MapView, part_words
from fecontact.outputs.records.theories import theories_of_cell
from fecontact.outputs.words.measures import limits_text

# Blue where Hertz's ellipse is enough, green for several, orange where the real patch is needed; darker where dearer.
_LAWS = {
    "polach": ("P", "#d3ebf8"),
    "fastsim": ("F", "#8fcbed"),
    "exact": ("E", "#56a5d8"),
    "multi_hertz": ("S", "#66c2a5"),
    "strips": ("T", "#f5b878"),
    "real": ("R", "#d55e00"),
}
# Of theories of the pressure, from the cheapest; a further one has the last.
_PRESSURE_COLOURS = (
    *("#d3ebf8", "#8fcbed", "#56a5d8"),
    *("#d5efd0", "#a5dba2", "#66c2a5", "#2a9d78"),
    *("#f5d2a8", "#f5b878"),
)
_OPEN, _NONE, _LOST = "UNRESOLVED", "FAILS", "failed"
_OUT, _OUT_WORDS = "*", "out of its range"


@dataclass(frozen=True, kw_only=True)
class _Theories:
    """Theories that are shown: their judgements in a cell, and of each its letter and colour, words and number."""

    of: Callable[[MapCell], Mapping[str, Judgement]]
    marks: Mapping[str, tuple[str, str]]
    words: Mapping[str, str]
    number: Callable[[str, Judgement], str]
    lost: str
    in_range: bool = False

    def cheapest(self, cell: MapCell) -> Standing:
        """The cheapest of them in a cell."""
        return cheapest(standings(self.of(cell)), in_range=self.in_range)


def law_view(made: ApplicabilityMap) -> MapView:
    """The cheapest law of creep forces that holds, and by how much of mu N it is off at most."""
    within = force_criterion(made)
    laws = _Theories(
        of=lambda cell: {} if cell.judged is None else cell.judged.creep_laws,
        marks=_LAWS,
        words={name: law.words for name, law in CREEP_LAWS.items()},
        number=lambda name, judged: "" if name == REAL else f"{1e2 * judged.deviation[FORCE]:.1f}",
        lost="no forces: not solved",
    )
    note = f"the cheapest theory of creep forces within {within}, and by how much of µN it is off, %"
    title = "the cheapest theory of creep forces that holds"
    return _view(made, laws, title, within, number="off by at most, % of µN", note=note)


def theory_view(made: ApplicabilityMap) -> MapView:
    """The cheapest theory of the pressure that holds, and the largest part of a limit that it uses."""
    judged = {name for cell in made.cells for name in theories_of_cell(cell)}
    names = [name for name in THEORIES if name in judged]
    colours = chain(_PRESSURE_COLOURS, repeat(_PRESSURE_COLOURS[-1]))
    theories = _Theories(
        of=theories_of_cell,
        marks=dict(zip(names, zip(ascii_uppercase, colours, strict=False), strict=False)),
        words={name: THEORIES[name].words for name in names},
        number=lambda _, judged: part_words(judged.limit_used),
        lost="could not be solved",
        in_range=made.case.criteria.theories_in_range,
    )
    title = "the cheapest theory that holds" + " in its range" * theories.in_range
    note = f"{title}, and the largest part of a limit that it uses"
    number = "largest part of a limit\nthat it uses; off from 1 on"
    return _view(made, theories, title, limits_text(made.case.criteria), number=number, note=note)


def _view(
    made: ApplicabilityMap, theories: _Theories, title: str, criterion: str, *, number: str, note: str
) -> MapView:
    """A stretch between two loads with different answers was not solved; a load whose answer is open is unresolved."""
    columns = tuple(_column(position.lateral_shift_mm, position.cells, theories) for position in made.positions)
    given = {cell.answer for column in columns for cell in column.cells}
    painted = given | {answer for column in columns for _, _, answer in column.bands}
    found = [theories.cheapest(cell) for cell in made.cells]
    standing, out_of_range = {one.name for one in found}, any(one.out_of_range for one in found)
    letters = {name: f"{theories.marks[name][0]}  {words}" for name, words in theories.words.items()}
    others = {_NONE: "none holds", _LOST: theories.lost, _OPEN: "unresolved", BETWEEN: ANSWER_WORDS[BETWEEN]}
    marks = {_NONE: ("$x$", "none holds"), _LOST: ("$!$", theories.lost), _OPEN: ("$?$", "open whether it holds")}
    return MapView(
        case=made.case,
        loads_N=made.loads_N,
        columns=columns,
        title=title,
        criterion=criterion,
        colours={**ANSWERS, **{name: colour for name, (_, colour) in theories.marks.items()}},
        answers=[
            *((name, words) for name, words in letters.items() if name in standing),
            *((answer, words) for answer, words in others.items() if answer in painted),
        ],
        marks=[mark for answer, mark in marks.items() if answer in given] + [(f"${_OUT}$", _OUT_WORDS)] * out_of_range,
        number=number,
        notes=[
            note,
            ", ".join(f"{theories.marks[name][0]} {words}" for name, words in theories.words.items()),
            f"? open whether it holds{', x none holds' * (_NONE in given)}, ! {theories.lost}"
            + f", {_OUT} {_OUT_WORDS}" * out_of_range,
        ],
    )


def _column(shift_mm: float, cells: tuple[MapCell, ...], theories: _Theories) -> ColumnView:
    shown = tuple(_cell(cell, theories) for cell in cells)
    known = [(cell.load_kN, cell.answer) for cell in shown if cell.answer != _LOST]
    return ColumnView(
        shift_mm=shift_mm,
        bands=stretches(known, BETWEEN),
        solved_kN=tuple(cell.load_kN for cell in cells if cell.judged is not None),
        cells=shown,
    )


def _cell(cell: MapCell, theories: _Theories) -> CellView:
    judged, load_kN, found = theories.of(cell), cell.load_kN, theories.cheapest(cell)
    if not found.name:
        text = "x" if judged else "!"
        return CellView(load_kN=load_kN, answer=_NONE if judged else _LOST, text=text, letter=text, printed=text)
    letter = theories.marks[found.name][0] + "?" * (found.answer == _OPEN) + _OUT * found.out_of_range
    text = f"{letter} {theories.number(found.name, judged[found.name])}".strip()
    return CellView(
        load_kN=load_kN, answer=found.label, text=text, letter=letter, printed=text, out_of_range=found.out_of_range
    )
