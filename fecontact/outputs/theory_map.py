"""The cheapest creep theory that is right, over lateral shift and load: as picture, CSV and text."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.comparison.creep_theories import CREEP_LAWS, REAL
from fecontact.comparison.judgement import FORCE, Judgement, cheapest, first_standing
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.map.load_limit import stretches
from fecontact.outputs.force_map import force_criterion
from fecontact.outputs.map_drawing import Column, Sizes, Words, colour_handles, draw_columns, first_marks, mark_handles
from fecontact.outputs.map_figure import pair_words
from fecontact.outputs.map_table import load_table
from fecontact.outputs.roll_words import roll_words
from fecontact.outputs.style import ANSWERS, save_figure
from fecontact.outputs.tables import write_csv

_LETTERS: dict[str, str] = {
    "polach": "P",
    "fastsim": "F",
    "exact": "E",
    "multi_hertz": "S",
    "strips": "T",
    "real": "R",
}
# Blue where Hertz's ellipse is enough, green for several, orange where the real patch is needed; darker where dearer.
_COLOURS: dict[str, str] = {
    "polach": "#d3ebf8",
    "fastsim": "#8fcbed",
    "exact": "#56a5d8",
    "multi_hertz": "#66c2a5",
    "strips": "#f5b878",
    "real": "#d55e00",
}
_OPEN = "open"


def write_theory_map(made: ApplicabilityMap, out: Path) -> None:
    """Write map_theory.csv and map_theory.png into a folder."""
    write_csv([_row(cell) for cell in made.cells], out / "map_theory.csv")
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
    texts = [[_text(cell) for cell in position.cells] for position in made.positions]
    notes = [f"the cheapest theory of creep forces within {force_criterion(made)}, and by how much of µN it is off, %"]
    notes.append(", ".join(f"{_LETTERS[name]} {words}" for name, words in CREEP_LAWS.items()))
    notes.append("? open whether it holds, ! no forces: not solved")
    return load_table(made, texts, notes=notes, width=width)


def _text(cell: MapCell) -> str:
    laws = _laws(cell)
    name = first_standing(laws)
    if name is None:
        return "!"
    letter = _LETTERS[name] + "?" * (cheapest(laws) is None)
    return letter if name == REAL else f"{letter} {1e2 * laws[name].deviation[FORCE]:.1f}"


def _column(position: MapPosition) -> Column:
    known, words = [], []
    for cell in position.cells:
        laws, text = _laws(cell), _text(cell)
        holds = cheapest(laws) or _OPEN
        if laws:
            known.append((cell.load_N / 1e3, holds))
        colour = _colour(holds) if laws else ANSWERS["failed"]
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
    found = [_laws(cell) for cell in made.cells]
    shown = {first_standing(laws) for laws in found}
    colours = [(_COLOURS[name], f"{_LETTERS[name]}  {words}") for name, words in CREEP_LAWS.items() if name in shown]
    # every load that was solved has its number, so that there are no ticks
    marks = first_marks(Sizes(len(made.positions)).font, "off by at most, % of µN")[-1:]
    if {} in found:
        colours.append((ANSWERS["failed"], "no forces: not solved"))
        marks.append(("$!$", "no forces: not solved"))
    if any(laws and cheapest(laws) is None for laws in found):
        marks.append(("$?$", "open whether it holds"))
    colours.append((ANSWERS["UNRESOLVED"], "unresolved"))
    return colour_handles(colours) + mark_handles(marks)


def _laws(cell: MapCell) -> Mapping[str, Judgement]:
    return {} if cell.judged is None else cell.judged.creep_laws


def _row(cell: MapCell) -> dict[str, Any]:
    row: dict[str, Any] = {
        "lateral_shift_mm": cell.lateral_shift_mm,
        "load_kN": cell.load_N / 1e3,
        "status": cell.status,
    }
    laws = _laws(cell)
    if laws:
        row["cheapest_theory"] = cheapest(laws) or "UNRESOLVED"
    for name, judged in laws.items():
        if name == REAL:
            continue
        row[f"{name}_verdict"] = judged.verdict.answer
        row[f"{name}_off_percent_of_muN"] = 1e2 * judged.deviation[FORCE]
        row[f"{name}_uncertainty_percent_of_muN"] = 1e2 * judged.uncertainty[FORCE]
        worst = judged.decided[0].creepages
        row[f"{name}_xi"], row[f"{name}_eta"] = worst.xi, worst.eta
    return row
