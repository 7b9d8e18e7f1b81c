"""Pictures of models on an irregularity: the map over wavelength and amplitude, and the forces along a line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.outputs.figures.style import MARKS, SERIES, blank_figure, finish, legend_beside, plain_log, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Record = Mapping[str, Any]
_NONE = "0.8"


def irregular_figure(record: Record, path: str | Path) -> Path:
    """Draw a map or a line, whichever the record has."""
    return _map_figure(record, path) if "cells" in record else _line_figure(record, path)


def _map_figure(record: Record, path: str | Path) -> Path:
    """Cells by the cheapest model that holds, the limits of all models as curves, eq. 6 in closed form dashed."""
    figure = blank_figure(10.5, 6.0)
    ax = figure.subplots()
    names = list(record["models"])
    colour = dict(zip(names, SERIES, strict=False))
    for number, name in enumerate((*names, None)):
        own = [cell for cell in record["cells"] if cell["cheapest"] == name]
        if own:
            ax.plot(
                [cell["wavelength_mm"] for cell in own],
                [1e3 * cell["amplitude_mm"] for cell in own],
                (MARKS[number % len(MARKS)]) if name else "x",
                color=colour.get(name or "", _NONE),
                alpha=0.55,
                label=f"{name} is the cheapest that holds" if name else "none of them holds: half-space",
            )
    for name in names:
        for key, line, of in (("amplitude_mm", "-", ""), ("force_amplitude_mm", ":", "in force ")):
            limits = [(one["wavelength_mm"], one[key][name]) for one in record["limits"]]
            known = [(x, 1e3 * y) for x, y in limits if y is not None]
            if len(known) > 1:
                ax.plot(*zip(*known, strict=True), line, color=colour[name], label=f"{name} holds {of}below")
    closed = [(one["wavelength_mm"], 1e3 * one["closed_form_mm"]["eq6_mm"]) for one in record["limits"]]
    low, high = (end(1e3 * cell["amplitude_mm"] for cell in record["cells"]) for end in (min, max))
    inside = [(x, y) for x, y in closed if low <= y <= high]
    if inside:
        ax.plot(*zip(*inside, strict=True), "k--", label="eq6, closed form")
    pair = record["pair"]
    ax.axvline(2.0 * pair["a_mm"], color="0.5", linewidth=0.8)
    ax.annotate("patch", (2.0 * pair["a_mm"], high), fontsize=8, ha="right", rotation=90, va="top")
    ax.set(xlabel="wavelength, mm", ylabel="amplitude (half of peak to valley), um")
    plain_log(ax)
    finish(ax)
    legend_beside(ax)
    ax.set_title(
        f"Within {100 * record['limit']:g} % of force and peak: patch {2 * pair['a_mm']:.1f} mm, approach"
        f" {1e3 * pair['approach_mm']:.0f} um, {1e-3 * pair['normal_force_N']:.4g} kN",
        fontsize=10,
    )
    return save_figure(figure, path)


def _line_figure(record: Record, path: str | Path) -> Path:
    """Force of each model over the distance, at the approach of the half-space under the load; below it e."""
    figure = blank_figure(10.5, 6.5)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    places = record["places"]
    s = [one["s_mm"] for one in places]
    top.axhline(1e-3 * record["pair"]["normal_force_N"], color="black", label="half-space (the load)")
    for number, name in enumerate(record["models"]):
        force = [(one["models"].get(name) or {}).get("force_N") for one in places]
        top.plot(
            s,
            [float("nan") if one is None else 1e-3 * one for one in force],
            MARKS[number] + "-",
            markersize=3,
            color=SERIES[number],
            label=name,
        )
    _mark_worst(top, record)
    top.set(ylabel="force at the half-space's approach, kN")
    bottom.plot(s, [1e3 * one["opening_mm"] for one in places], color="0.3")
    bottom.set(xlabel="s along the track, mm", ylabel="e, um")
    finish(top, bottom)
    legend_beside(top)
    return save_figure(figure, path)


def _mark_worst(ax: Axes, record: Record) -> None:
    for number, (name, worst) in enumerate(record["worst"].items()):
        at = worst["force_error_at_mm"]
        if at is not None:
            place = next(one for one in record["places"] if one["s_mm"] == at)
            ax.plot(at, 1e-3 * place["models"][name]["force_N"], "o", mfc="none", color=SERIES[number], markersize=9)
