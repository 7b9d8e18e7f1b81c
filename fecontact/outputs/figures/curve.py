"""Pictures of a vehicle in curves: over the curvature, and on a map."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.figures.style import (
    ANSWER_WORDS,
    ANSWERS,
    MARKS,
    blank_figure,
    finish,
    save_figure,
    series_style,
)
from fecontact.outputs.words.curve import difference_words
from fecontact.vehicle.visits import Curves, MapCell, Visit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def curves_figure(found: Curves, path: str | Path) -> Path:
    """Draw shift, angle of attack, Y/Q of the leading outer wheel and resistance over the curvature, by theory."""
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    for number, (theory, runs) in enumerate(found.runs.items()):
        good = sorted((run for run in runs if run.is_balanced), key=lambda run: 1.0 / run.radius_m)
        style = series_style(number)
        x = [1e3 / run.radius_m for run in good]
        for place, dash in zip(range(len(good[0].wheelsets) if good else 0), ("-", "--"), strict=False):
            label = f"{theory}, {'leading' if place == 0 else 'trailing'}" if len(good[0].wheelsets) > 1 else theory
            axes[0, 0].plot(x, [r.wheelsets[place].lateral_shift_mm for r in good], dash, label=label, **style)
            axes[0, 1].plot(x, [r.wheelsets[place].yaw_mrad for r in good], dash, label=label, **style)
        outer = [run.wheelsets[0].wheels[0 if run.radius_m > 0.0 else 1].y_over_q for run in good]
        axes[1, 0].plot(x, outer, label=theory, **style)
        axes[1, 1].plot(x, [run.resistance_N_per_kN for run in good], label=theory, **style)
    labels = ("lateral shift, mm", "yaw (angle of attack), mrad", "Y/Q, leading outer wheel", "curve resistance, N/kN")
    for ax, label in zip(axes.flat, labels, strict=True):
        ax.set(xlabel="curvature 1000/R, 1/m (> 0: to the right)", ylabel=label)
    finish(*axes.flat)
    for ax in axes.flat:
        if ax.lines:
            ax.legend(fontsize=8)
    headline = [difference_words(one) for one in found.differences]
    figure.suptitle(
        "\n".join([*headline, f"{found.vehicle.name}, friction {found.conditions.friction:g}"]), fontsize=10
    )
    return save_figure(figure, Path(path))


def visits_figure(found: Curves, path: str | Path) -> Path:
    """Draw the paths of all wheels over the map of the left wheel, on the verdicts of its cells."""
    figure = blank_figure(10.0, 6.0)
    axes = figure.subplots()
    _draw_cells(axes, found.cells)
    for number, theory in enumerate(found.runs):
        _draw_paths(axes, [visit for visit in found.visits if visit.theory == theory], MARKS[number % len(MARKS)])
    axes.set(xlabel="lateral shift towards the wheel's own rail, mm", ylabel="vertical force, kN")
    finish(axes)
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    axes.set_title(f"{found.vehicle.name}: all wheels on the map; numbers are radii in m", fontsize=10)
    return save_figure(figure, Path(path))


def _draw_cells(axes: Axes, cells: Sequence[MapCell]) -> None:
    """Cells as rectangles in the colour of the verdict, each as far as half way to the next."""
    shifts, loads = (sorted({getattr(cell, name) for cell in cells}) for name in ("lateral_shift_mm", "load_kN"))
    across, up = (dict(zip(places, _sides(places), strict=True)) for places in (shifts, loads))
    shown = set()
    for cell in cells:
        (left, right), (low, high) = across[cell.lateral_shift_mm], up[cell.load_kN]
        words = ANSWER_WORDS.get(cell.verdict, cell.verdict)
        axes.bar(
            *(left, high - low, right - left, low),
            align="edge",
            color=ANSWERS.get(cell.verdict, "white"),
            edgecolor="white",
            label=None if words in shown else words,
        )
        shown.add(words)


def _sides(places: Sequence[float]) -> list[tuple[float, float]]:
    """From half way to the place before to half way to the next, the outermost as far as the other way."""
    if len(places) == 1:
        return [(places[0] - 0.5, places[0] + 0.5)]
    inner = [0.5 * (a + b) for a, b in pairwise(places)]
    edges = [2.0 * places[0] - inner[0], *inner, 2.0 * places[-1] - inner[-1]]
    return list(pairwise(edges))


def _draw_paths(axes: Axes, visits: Sequence[Visit], mark: str) -> None:
    """A line a wheel from the widest curve to the tightest."""
    for wheelset, side in sorted({(visit.wheelset, visit.side) for visit in visits}):
        own = [visit for visit in visits if (visit.wheelset, visit.side) == (wheelset, side)]
        own.sort(key=lambda visit: 1.0 / visit.radius_m)
        axes.plot(
            [visit.lateral_shift_mm for visit in own],
            [1e-3 * visit.vertical_force_N for visit in own],
            *("-", "--")[wheelset - 1 : wheelset],
            color="black" if side == "left" else "#7a3b9a",
            marker=mark,
            ms=5,
            label=f"{own[0].theory}: {side} wheel of wheelset {wheelset}",
        )
        for visit in own:
            place = (visit.lateral_shift_mm, 1e-3 * visit.vertical_force_N)
            axes.annotate(f"{abs(visit.radius_m):g}", place, xytext=(3, 3), textcoords="offset points", fontsize=6)
