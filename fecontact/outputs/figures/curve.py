"""Pictures of a vehicle in curves: over the curvature, and on a map."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.figures.style import ANSWERS, MARKS, SERIES, blank_figure, finish, save_figure
from fecontact.outputs.words.curve import ZONES
from fecontact.vehicle.visits import Curves, Visit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def curves_figure(found: Curves, path: str | Path) -> Path:
    """Draw shift, angle of attack, Y/Q of the leading outer wheel and resistance over the curvature, by theory."""
    figure = blank_figure(12.0, 8.0)
    axes = figure.subplots(2, 2)
    for number, (theory, runs) in enumerate(found.runs.items()):
        good = sorted((run for run in runs if run.status != "no equilibrium"), key=lambda run: 1.0 / run.radius_m)
        style = {"color": SERIES[number % len(SERIES)], "marker": MARKS[number % len(MARKS)]}
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
    figure.suptitle(f"{found.vehicle.name}, friction {found.conditions.friction:g}")
    return save_figure(figure, Path(path))


def visits_figure(found: Curves, path: str | Path) -> Path:
    """Draw where all wheels are on the map of the left wheel: shift and load, coloured by what the map says there."""
    figure = blank_figure(9.0, 5.5)
    axes = figure.subplots()
    draw_visits(axes, found.visits)
    axes.legend(fontsize=8)
    finish(axes)
    axes.set_title(f"{found.vehicle.name}: wheels on the map; numbers are radii in m", fontsize=10)
    return save_figure(figure, Path(path))


def draw_visits(axes: Axes, visits: Sequence[Visit]) -> None:
    """Wheels as points over shift and load, with their radii."""
    theories = list(dict.fromkeys(visit.theory for visit in visits))
    for zone in ZONES:
        for number, theory in enumerate(theories):
            own = [visit for visit in visits if visit.verdict == zone and visit.theory == theory]
            if own:
                axes.plot(
                    [visit.lateral_shift_mm for visit in own],
                    [1e-3 * visit.vertical_force_N for visit in own],
                    MARKS[number % len(MARKS)],
                    color=ANSWERS.get(zone, "white"),
                    markeredgecolor="black",
                    label=f"{theory}: {zone}",
                )
    for visit in visits:
        axes.annotate(f"{abs(visit.radius_m):g}", (visit.lateral_shift_mm, 1e-3 * visit.vertical_force_N), fontsize=6)
    axes.set(xlabel="lateral shift towards the wheel's own rail, mm", ylabel="vertical force, kN")
