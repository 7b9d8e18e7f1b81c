"""Pictures that reports have beside those of a study or a map: the pair in section, the ladder, patches in small."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.ladder import STEPS
from fecontact.geometry.placement import Placement
from fecontact.outcome import usable
from fecontact.outputs.figures.case import draw_lateral_cut
from fecontact.outputs.figures.pressure import PressureFields, draw_pressure
from fecontact.outputs.figures.style import HERTZ, RAIL, SERIES, WHEEL, blank_figure, finish, legend_beside
from fecontact.outputs.words.roll import SHIFT
from fecontact.outputs.words.series import series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Row = Mapping[str, Any]

# Of the wheel what lies this far about the touch point is drawn.
_ABOUT_MM = 75.0


def pair_figure(placement: Placement) -> Figure:
    """Draw rail and wheel in section through the first touch point, true to scale, with all touch points."""
    first = placement.first
    lines = []
    for of in ("rail", "wheel"):
        y, z = _section(placement, of)
        near = np.abs(y - first.y_mm) < _ABOUT_MM
        lines.append((y[near], z[near]))
    extent = float(np.ptp(np.concatenate([z for _, z in lines])))
    figure = blank_figure(10.0, max(2.0, 1.4 + 7.5 * extent / (2.0 * _ABOUT_MM)))
    ax = figure.add_subplot()
    for number, (of, (y, z)) in enumerate(zip(("rail", "wheel"), lines, strict=True)):
        end = float(np.min(z)) - 8.0 if of == "rail" else float(np.max(z)) + 10.0
        ax.fill_between(y, z, end, color=("0.82", "0.9")[number], lw=0.0)
        ax.plot(y, z, color=(RAIL, WHEEL)[number], lw=1.8, label=of)
    for number, touch in enumerate(placement.touch_points):
        label = "touch point" if number == 0 else ("further touch points" if number == 1 else None)
        mark: dict[str, Any] = {"mfc": HERTZ if number == 0 else "white", "mec": HERTZ, "ms": 8, "zorder": 5}
        ax.plot(touch.y_mm, touch.z_mm, "o", label=label, **mark)
    ax.set(aspect="equal", xlabel="y in mm, from the track centre  (gauge side ←  → field side)", ylabel="z in mm")
    legend_beside(ax)
    finish(ax)
    return figure


def _section(placement: Placement, of: str) -> tuple[Any, Any]:
    profile = (placement.rail if of == "rail" else placement.wheel).profile
    u = np.linspace(0.0, len(profile.segments) - 1e-9, 1500)
    if of == "rail":
        y, z, _ = placement.rail.section(u)
        return y, z
    _, _, y, z = placement.wheel.silhouette(u)
    return y, z


def ladder_figure(rows: Sequence[Row]) -> Figure | None:
    """Draw over the shift what moves the peak pressure away from Hertz; None where no row tells it.

    A panel a step of the ladder that all rows have, in percent of the peak: from Hertz's gap to the true one on a
    half-space, from there to the finite bodies, and to bodies that yield, with its uncertainty.
    """
    told = [row for row in rows if usable(row)]
    every = {f"p_max_step_{step.column}": step.cause for step in STEPS if step.column}
    steps = {
        name: cause for name, cause in every.items() if all(row.get(f"{name}_percent") is not None for row in told)
    }
    if not told or not steps:
        return None
    figure = blank_figure(9.0, 2.6 * len(steps))
    panels = figure.subplots(len(steps), 1, sharex=True)
    found = series(told)
    for number, one in enumerate(found):
        colour = SERIES[number % len(SERIES)]
        for ax, name in zip(panels, steps, strict=True):
            label = one.label if ax is panels[0] and len(found) <= len(SERIES) else ""
            _draw_step(ax, one.rows, name, colour, label or None)
    for ax, cause in zip(panels, steps.values(), strict=True):
        ax.set_ylabel(f"{cause}:\npeak changes by %")
        ax.axhline(0.0, color="0.3", lw=0.9, zorder=0)
    panels[-1].set_xlabel(SHIFT)
    finish(*panels)
    if panels[0].get_legend_handles_labels()[0]:
        legend_beside(panels[0])
    return figure


def _draw_step(ax: Axes, rows: Sequence[Row], name: str, colour: str, label: str | None) -> None:
    shifts = [float(row["lateral_shift_mm"]) for row in rows]
    values = [float(row[f"{name}_percent"]) for row in rows]
    unsure = [row.get(f"{name}_uncertainty_percent") for row in rows]
    ax.plot(shifts, values, "o", color=colour, ms=5, label=label)
    ax.vlines(shifts, 0.0, values, color=colour, lw=1.4)
    if all(value is not None for value in unsure):
        ax.errorbar(shifts, values, yerr=np.array(unsure, dtype=float), fmt="none", ecolor="0.2", capsize=3, lw=1.0)


def patches_figure(loads: Sequence[tuple[JudgedLoad, Placement]]) -> Figure:
    """Draw the pressure and the lateral cut of several loads in small, each with its shift, load and verdict."""
    columns = min(4, len(loads))
    lines = -(-len(loads) // columns)
    figure = blank_figure(3.9 * columns, 5.2 * lines)
    axes = figure.subplots(2 * lines, columns, squeeze=False, height_ratios=[1.1, 1.0] * lines)
    for ax in axes.ravel():
        ax.set_axis_off()
    for number, (load, placement) in enumerate(loads):
        line, column = divmod(number, columns)
        over, below = axes[2 * line, column], axes[2 * line + 1, column]
        fields = PressureFields.of(load)
        for ax in (over, below):
            ax.set_axis_on()
        draw_pressure(over, load, "finite elements", fields)
        draw_lateral_cut(below, load, placement, fields, label=True)
        shift, kilonewtons = load.case.lateral_shift_mm, load.load_N / 1e3
        over.set(title=f"{shift:+z.2f} mm, {kilonewtons:.4g} kN: {load.verdict.answer}", xlabel="", ylabel="x in mm")
        below.set(title="", xlabel="s across in mm")
        if number:
            below.get_legend().remove()
    return figure
