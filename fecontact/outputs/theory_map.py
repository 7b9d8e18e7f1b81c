"""The cheapest creep theory that is right, over lateral shift and load: as picture, CSV and text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

from fecontact.comparison.creep_comparison import creep_of
from fecontact.comparison.creep_theories import Theory, TheoryVerdicts, theory_verdicts
from fecontact.comparison.creep_verdict import ForceVerdict
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.multi_hertz import MultiHertz
from fecontact.geometry.placement import Placement
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.map.load_limit import stretches
from fecontact.outputs.force_map import force_criterion
from fecontact.outputs.map_drawing import Column, Sizes, Words, colour_handles, draw_columns, first_marks, mark_handles
from fecontact.outputs.map_figure import pair_words
from fecontact.outputs.map_table import load_table
from fecontact.outputs.multi_hertz import ellipses_of
from fecontact.outputs.roll_words import roll_words
from fecontact.outputs.style import ANSWERS, save_figure
from fecontact.outputs.tables import write_csv

_LETTERS: dict[Theory, str] = {
    "polach": "P",
    "fastsim": "F",
    "exact": "E",
    "springs": "S",
    "strips": "T",
    "real": "R",
}
THEORY_WORDS: dict[Theory, str] = {
    "polach": "Polach on Hertz's ellipse",
    "fastsim": "FASTSIM on Hertz's ellipse",
    "exact": "exact theory on Hertz's ellipse",
    "springs": "FASTSIM on several ellipses",
    "strips": "FASTSIM on the real patch",
    "real": "exact theory on the real patch",
}
# Blue where Hertz's ellipse is enough, green for several, orange where the real patch is needed; darker where dearer.
_COLOURS: dict[str, str] = {
    "polach": "#d3ebf8",
    "fastsim": "#8fcbed",
    "exact": "#56a5d8",
    "springs": "#66c2a5",
    "strips": "#f5b878",
    "real": "#d55e00",
}
_OPEN = "open"
# a cell takes seconds, and is drawn, written and printed
_JUDGED: WeakKeyDictionary[JudgedLoad, TheoryVerdicts] = WeakKeyDictionary()
MapOver: TypeAlias = Callable[..., Iterable[TheoryVerdicts]]
"""Calls a function with the first of some sequences, their second, and so on, as `map` does, or several at a time."""


def write_theory_map(made: ApplicabilityMap, out: Path, *, map_over: MapOver = map) -> None:
    """Write map_theory.csv and map_theory.png into a folder; cells are judged by `map_over`."""
    _judge([_inputs(cell, position) for position in made.positions for cell in position.cells], map_over)
    write_csv([row for position in made.positions for row in _rows(position)], out / "map_theory.csv")
    theory_map_figure(made, out / "map_theory.png")


def theory_map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw over lateral shift and load the cheapest theory whose creep force is within the limit of forces.

    Each load of the map has the theory's letter, and by how much of mu N it is off at most. A stretch between two loads
    with different theories, and a load whose answer is open, has the colour of what is unresolved.
    """
    columns = [_column(position) for position in made.positions]
    figure = draw_columns(
        made.case,
        made.loads_N,
        columns,
        title=f"{pair_words(made.case)}: the cheapest theory of creep forces that holds,\n"
        f"{roll_words(made.case)},\nwithin {force_criterion(made)}",
        handles=_handles(made),
    )
    return save_figure(figure, path)


def theory_table(made: ApplicabilityMap, *, width: int | None = None) -> str:
    """The cheapest theory at each position and load, a line for each position."""
    texts = [[_text(cell, position) for cell in position.cells] for position in made.positions]
    notes = [f"the cheapest theory of creep forces within {force_criterion(made)}, and by how much of µN it is off, %"]
    notes.append(", ".join(f"{_LETTERS[name]} {words}" for name, words in THEORY_WORDS.items()))
    notes.append("? open whether it holds, ! no forces: not solved")
    return load_table(made, texts, notes=notes, width=width)


_Inputs: TypeAlias = tuple[JudgedLoad, Placement, MultiHertz | None, ForceVerdict]


def _inputs(cell: MapCell, position: MapPosition) -> _Inputs | None:
    judged, placement = cell.judged, position.placement
    if judged is None or placement is None or cell.status != "converged":
        return None
    compared = creep_of(judged, placement)
    return None if compared is None else (judged, placement, ellipses_of(judged, placement), compared.verdict)


def _judge(cells: Sequence[_Inputs | None], map_over: MapOver = map) -> None:
    new = [one for one in cells if one is not None and one[0] not in _JUDGED]
    if new:
        _JUDGED.update(zip((load for load, *_ in new), map_over(theory_verdicts, *zip(*new, strict=True)), strict=True))


def _theories(cell: MapCell, position: MapPosition) -> TheoryVerdicts | None:
    if cell.judged is not None and cell.judged in _JUDGED:
        return _JUDGED[cell.judged]
    inputs = _inputs(cell, position)
    _judge([inputs])
    return None if inputs is None else _JUDGED[inputs[0]]


def _text(cell: MapCell, position: MapPosition) -> str:
    found = _theories(cell, position)
    if found is None:
        return "!"
    name = found.first
    letter = _LETTERS[name] + "?" * (found.cheapest is None)
    return letter if name == "real" else f"{letter} {1e2 * found.verdicts[name].worst.deviation:.1f}"


def _column(position: MapPosition) -> Column:
    known, words = [], []
    for cell in position.cells:
        found, text = _theories(cell, position), _text(cell, position)
        if found is not None:
            known.append((cell.load_N / 1e3, str(found.cheapest or _OPEN)))
        colour = ANSWERS["failed"] if found is None else _colour(found.cheapest or _OPEN)
        words.append(Words(load_kN=cell.load_N / 1e3, text=text, letter=text.split()[0], colour=colour))
    return Column(
        shift_mm=position.lateral_shift_mm,
        bands=tuple((low, high, _colour(word)) for low, high, word in stretches(known, _OPEN)),
        solved_kN=tuple(cell.load_N / 1e3 for cell in position.cells if cell.judged is not None),
        words=tuple(words),
    )


def _colour(word: str) -> str:
    return ANSWERS["UNRESOLVED"] if word == _OPEN else _COLOURS[word]


def _handles(made: ApplicabilityMap) -> list[Any]:
    found = [_theories(cell, position) for position in made.positions for cell in position.cells]
    shown = {one.first for one in found if one is not None}
    colours = [(_COLOURS[name], f"{_LETTERS[name]}  {words}") for name, words in THEORY_WORDS.items() if name in shown]
    # every load that was solved has its number, so that there are no ticks
    marks = first_marks(Sizes(len(made.positions)).font, "off by at most, % of µN")[-1:]
    if None in found:
        colours.append((ANSWERS["failed"], "no forces: not solved"))
        marks.append(("$!$", "no forces: not solved"))
    if any(one is not None and one.cheapest is None for one in found):
        marks.append(("$?$", "open whether it holds"))
    colours.append((ANSWERS["UNRESOLVED"], "unresolved"))
    return colour_handles(colours) + mark_handles(marks)


def _rows(position: MapPosition) -> list[dict[str, Any]]:
    rows = []
    for cell in position.cells:
        row: dict[str, Any] = {
            "lateral_shift_mm": cell.lateral_shift_mm,
            "load_kN": cell.load_N / 1e3,
            "status": cell.status,
        }
        if (found := _theories(cell, position)) is not None:
            row["cheapest_theory"] = found.cheapest or "UNRESOLVED"
            for name, verdict in found.verdicts.items():
                row[f"{name}_verdict"] = verdict.answer
                row[f"{name}_off_percent_of_muN"] = 1e2 * verdict.worst.deviation
                row[f"{name}_uncertainty_percent_of_muN"] = 1e2 * verdict.worst.uncertainty
                row[f"{name}_xi"], row[f"{name}_eta"] = verdict.worst.creepages.xi, verdict.worst.creepages.eta
        rows.append(row)
    return rows
