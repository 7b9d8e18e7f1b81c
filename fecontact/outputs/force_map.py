"""The picture of the creep forces of a map: where Hertz's are right, over lateral shift and load."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.creep_verdict import ForceVerdict, creep_of
from fecontact.map.cells import ApplicabilityMap, MapCell, MapPosition
from fecontact.outputs.map_figure import draw_other_wheel
from fecontact.outputs.roll_words import roll_words, shift_label
from fecontact.outputs.series import short_name
from fecontact.outputs.style import ANSWER_WORDS, ANSWERS, blank_figure, save_figure
from fecontact.profiles.identity import profile_identity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]


def force_map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw the verdicts of forces over lateral shift and load, with how far Hertz is off at most in % of mu N.

    What was not solved has none.
    """
    from matplotlib.patches import Patch

    figure = blank_figure(max(9.0, min(16.0, 5.0 + 0.45 * len(made.lateral_shifts_mm))), 6.4)
    ax = figure.add_subplot()
    shifts, loads = np.array(made.lateral_shifts_mm), np.array(made.loads_N) / 1e3
    verdicts = [_force_verdict(cell, position) for position in made.positions for cell in position.cells]
    found = np.array([verdict.answer if verdict else "failed" for verdict in verdicts], dtype=object)
    answers = found.reshape(shifts.size, loads.size).T
    _draw_answers(ax, shifts, loads, answers)
    for k, verdict in enumerate(verdicts):
        if verdict is not None:
            place = (float(shifts[k // loads.size]), float(loads[k % loads.size]))
            ax.text(*place, f"{1e2 * verdict.worst.deviation:.0f}", ha="center", va="center", fontsize=9)
    labels = ANSWER_WORDS | {"failed": "not solved"}
    ax.legend(
        handles=[Patch(fc=c, ec="0.4", label=labels[v]) for v, c in ANSWERS.items() if v in answers],
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        fontsize=9.5,
    )
    creep = made.case.creep
    rail, wheel = (short_name(profile_identity(spec)) for spec in (made.case.rail, made.case.wheel))
    ax.set(
        title=f"rail {rail}, wheel {wheel}, {roll_words(made.case)}:\n"
        f"where Hertz's creep force is within {1e2 * creep.force_limit:g} % of µN,\n"
        f"friction {creep.friction:g}, creepage up to {1e2 * creep.largest_creepage:g} %; numbers: off by at most, %",
        xlabel=shift_label(made.case),
        ylabel=f"{made.case.load_kind} load in kN",
    )
    draw_other_wheel(ax, made.case)
    return save_figure(figure, path)


def _force_verdict(cell: MapCell, position: MapPosition) -> ForceVerdict | None:
    if cell.judged is None or position.placement is None:
        return None
    found = creep_of(cell.judged, position.placement)
    return None if found is None else found.verdict


def _cell_edges(centres: Floats) -> Floats:
    """Edges of cells half way between their centres; a single one is 1 wide."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[:-1] + centres[1:])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def _draw_answers(ax: Axes, shifts: Floats, loads: Floats, answers: NDArray[Any]) -> None:
    """Colour the cells by verdicts (loads, shifts)."""
    from matplotlib.colors import ListedColormap

    names = list(ANSWERS)
    codes = np.vectorize(names.index, otypes=[float])(answers)
    y = _cell_edges(loads)
    # a load below zero does not exist
    y[0] = max(y[0], 0.0)
    ax.pcolormesh(
        _cell_edges(shifts),
        y,
        codes,
        cmap=ListedColormap(list(ANSWERS.values())),
        vmin=-0.5,
        vmax=len(names) - 0.5,
        edgecolors="white",
        linewidth=0.6,
        alpha=0.85,
    )
    ax.set_yticks(loads)
