"""Pictures of reports: the ladder over the shift, and small pictures of patches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fecontact.errors import is_usable_status
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import LADDER_STEPS
from fecontact.outputs.case_words import SHIFT_LABEL
from fecontact.outputs.pair_names import RowMapping
from fecontact.outputs.records.results import lobe_records
from fecontact.outputs.series import split_into_series
from fecontact.outputs.style import (
    SERIES_COLOURS,
    add_grid,
    add_legend_beside,
    blank_figure,
)
from fecontact.placement.wheel_on_rail import Placement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
from fecontact.outputs.figures.case import draw_lateral_cut
from fecontact.outputs.figures.pressure_maps import PressureFields, draw_pressure


def ladder_figure(rows: Sequence[RowMapping]) -> Figure | None:
    """Draw the changes of the peak pressure by each ladder step over the shift.

    There is a panel for each ladder step that all rows have, in percent of the peak with its uncertainty: from Hertz's
    gap to the true gap on a half-space, from the half-space to the finite bodies, and to bodies that yield.

    Parameters
    ----------
    rows
        Rows of a study.

    Returns
    -------
    Figure or None
        None if no row is usable or no ladder step is in all rows.
    """
    usable_rows = [row for row in rows if is_usable_status(row)]
    steps = {
        step.name: step.cause
        for step in LADDER_STEPS
        if step.shown and all(row.get(f"steps_{step.name}_p_max_percent") is not None for row in usable_rows)
    }
    if not usable_rows or not steps:
        return None
    figure = blank_figure(9.0, 2.6 * len(steps))
    panels = figure.subplots(len(steps), 1, sharex=True)
    all_series = split_into_series(usable_rows)
    for number, series_ in enumerate(all_series):
        colour = SERIES_COLOURS[number % len(SERIES_COLOURS)]
        for ax, name in zip(panels, steps, strict=True):
            label = series_.label if ax is panels[0] and len(all_series) <= len(SERIES_COLOURS) else ""
            _draw_step(ax, series_.rows, name, colour, label or None)
    for ax, cause in zip(panels, steps.values(), strict=True):
        ax.set_ylabel(f"{cause}:\nchange of peak in %")
        ax.axhline(0.0, color="0.3", lw=0.9, zorder=0)
    panels[-1].set_xlabel(SHIFT_LABEL)
    add_grid(*panels)
    if panels[0].get_legend_handles_labels()[0]:
        add_legend_beside(panels[0])
    return figure


def _draw_step(ax: Axes, rows: Sequence[RowMapping], name: str, colour: str, label: str | None) -> None:
    """Draw the changes (%) by a ladder step over the shift, with uncertainties if all rows have them."""
    shifts = [float(row["lateral_shift_mm"]) for row in rows]
    values = [float(row[f"steps_{name}_p_max_percent"]) for row in rows]
    uncertainties = [row.get(f"steps_uncertainty_{name}_p_max_percent") for row in rows]
    ax.plot(shifts, values, "o", color=colour, ms=5, label=label)
    ax.vlines(shifts, 0.0, values, color=colour, lw=1.4)
    if all(value is not None for value in uncertainties):
        ax.errorbar(
            shifts, values, yerr=np.array(uncertainties, dtype=float), fmt="none", ecolor="0.2", capsize=3, lw=1.0
        )


# Largest number of ticks on an axis of a small picture.
_MAX_TICKS = 4


def small_figure(load: JudgedLoad, placement: Placement) -> Figure:
    """Draw a small picture of the pressure and the lateral cut of a load.

    As in `draw_case`, there is no layout engine. Ticks and scales take most of the time of a picture, and a report has
    a hundred pictures. So the cut has the scale of the map.

    Parameters
    ----------
    load
        Judged load.
    placement
        Placement of the load.

    Returns
    -------
    Figure
        The figure.
    """
    figure = blank_figure(4.0, 5.0)
    figure.set_layout_engine(None)
    pressure_axes, cut_axes = figure.add_axes((0.17, 0.5, 0.79, 0.45)), figure.add_axes((0.17, 0.1, 0.79, 0.3))
    _draw_small(pressure_axes, cut_axes, load, placement)
    return figure


def _draw_small(pressure_axes: Axes, cut_axes: Axes, load: JudgedLoad, placement: Placement) -> None:
    """Draw the pressure map and the lateral cut of a load into two small axes."""
    fields = PressureFields.of(load)
    for ax in (pressure_axes, cut_axes):
        # a narrow map gets fewer ticks
        ax.locator_params(nbins=_MAX_TICKS)
    draw_pressure(pressure_axes, "finite elements", fields, lobe_records(load), scale=False)
    draw_lateral_cut(cut_axes, placement, fields, label=True)
    pressure_axes.set(xlabel="", ylabel="x in mm")
    cut_axes.set(title="", xlabel="s across in mm")


def patches_figure(loads: Sequence[tuple[JudgedLoad, Placement]]) -> Figure:
    """Draw small pictures of pressure and lateral cut for several loads.

    Parameters
    ----------
    loads
        Judged loads with their placements, at least one.

    Returns
    -------
    Figure
        Figure in which each picture has its shift, load and verdict as title.
    """
    columns = min(4, len(loads))
    lines = -(-len(loads) // columns)
    figure = blank_figure(3.9 * columns, 5.2 * lines)
    axes = figure.subplots(2 * lines, columns, squeeze=False, height_ratios=[1.1, 1.0] * lines)
    for ax in axes.ravel():
        ax.set_axis_off()
    for number, (load, placement) in enumerate(loads):
        line, column = divmod(number, columns)
        pressure_axes, cut_axes = axes[2 * line, column], axes[2 * line + 1, column]
        for ax in (pressure_axes, cut_axes):
            ax.set_axis_on()
        _draw_small(pressure_axes, cut_axes, load, placement)
        shift, load_kN = load.case.lateral_shift_mm, load.load_N / 1e3
        pressure_axes.set(title=f"{shift:+z.2f} mm, {load_kN:.4g} kN: {load.verdict.answer}")
        if number:
            cut_axes.get_legend().remove()
    return figure
