"""The picture of the creep forces of a map: at which loads Hertz's are right, over the lateral shift."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fecontact.comparison.creep_verdict import PLACE, SHAPE
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.outputs.map_drawing import Column, Sizes, Words, draw_columns, first_marks, mark_handles
from fecontact.outputs.map_figure import answer_bands, answer_handles, pair_words, part_words, solved_loads_kN
from fecontact.outputs.map_table import ANSWER_SIGNS, limit_text, load_table
from fecontact.outputs.roll_words import roll_words
from fecontact.outputs.style import ANSWERS, save_figure

FORCE_LETTERS = {PLACE: "P", SHAPE: "F"}
"""Marks of the causes of forces in the picture."""


def force_map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw over lateral shift and load where Hertz holds for creep forces, as the picture of pressure is drawn.

    Each load of the map has the part of the limit of forces that Hertz uses. Load limits are as sharp as the loads that
    were solved for those of pressure. What was not solved has no forces.
    """
    columns = [_column(position) for position in made.positions]
    figure = draw_columns(
        made.case,
        made.loads_N,
        columns,
        title=f"{pair_words(made.case)}: where Hertz holds for creep forces,\n{roll_words(made.case)},\nwithin "
        + force_criterion(made),
        handles=_handles(made, Sizes(len(columns)).font),
    )
    return save_figure(figure, path)


def force_table(made: ApplicabilityMap, *, width: int | None = None) -> str:
    """Verdicts of forces with the part of their limit that Hertz uses, and the load limits of forces."""
    texts = [[_cell_text(cell) for cell in position.cells] for position in made.positions]
    limits = [limit_text(position.force_limit or position.limit) for position in made.positions]
    causes = ", ".join(f"{letter} {cause}" for cause, letter in FORCE_LETTERS.items())
    notes = [f"+ holds, x fails, ? unresolved, ! no forces: not solved; part of the limit of {force_criterion(made)}"]
    return load_table(made, texts, limits, notes=[*notes, f"off by {causes}"], width=width)


def force_criterion(made: ApplicabilityMap) -> str:
    """Limit, friction and creepages in words."""
    creep = made.case.creep
    assert creep.friction is not None
    surfaces = ", which follow the curved surfaces" if creep.curved else ""
    return (
        f"{1e2 * creep.force_limit:g} % of µN, friction {creep.friction:g}, creepages up to"
        f" {1e2 * creep.largest_creepage:g} %{surfaces}"
    )


def _cell_text(cell: MapCell) -> str:
    force = cell.force
    if force is None:
        return "!"
    letter = FORCE_LETTERS.get(force.verdict.cause or "", " ")
    return f"{ANSWER_SIGNS[force.verdict.answer]}{letter}{part_words(force.limit_used):>6}"


def _column(position: MapPosition) -> Column:
    limit = position.force_limit or position.limit
    return Column(
        shift_mm=position.lateral_shift_mm,
        bands=answer_bands(limit),
        solved_kN=solved_loads_kN(position.cells, limit),
        words=tuple(_words(cell) for cell in position.cells),
    )


def _words(cell: MapCell) -> Words:
    force, at = cell.force, cell.load_N / 1e3
    if force is None:
        return Words(load_kN=at, text="!", letter="!", colour=ANSWERS["failed"])
    letter = FORCE_LETTERS.get(force.verdict.cause or "", "")
    return Words(
        load_kN=at,
        text=f"{part_words(force.limit_used)} {letter}".strip(),
        letter=letter,
        colour=ANSWERS[force.verdict.answer],
        bold=force.verdict.answer == "FAILS",
    )


def _handles(made: ApplicabilityMap, font: float) -> list[Any]:
    limits = [position.force_limit or position.limit for position in made.positions]
    marks = first_marks(font, "part of the limit that\nHertz uses; off from 1 on")
    if not made.all_solved:
        marks.append(("$!$", "not to be used"))
    found = {cell.force.verdict.cause for cell in made.cells if cell.force}
    words = {PLACE: "centre of pressure beside\nthe touch point", SHAPE: SHAPE}
    marks += [(rf"$\mathbf{{{FORCE_LETTERS[cause]}}}$", words[cause]) for cause in words if cause in found]
    return answer_handles(limits) + mark_handles(marks)
