"""An applicability map as CSV, JSON and picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case, case_record
from fecontact.comparison.measures import MEASURES
from fecontact.comparison.verdict import AT_JUNCTION
from fecontact.files import write_json
from fecontact.jobs.provenance import input_files, makers
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.figures import blank_figure, save_figure
from fecontact.outputs.map_record import cell_record, limit_record
from fecontact.outputs.record import versions
from fecontact.outputs.series import short_name
from fecontact.outputs.tables import write_csv
from fecontact.solving.stiffness_fit import fit_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Record = dict[str, Any]

MAP_SCHEMA = "fecontact/map/1"
_FEWEST_LOADS = 3

# Okabe and Ito's colours, told apart by the colour-blind and in grey.
_COLOURS = {"HOLDS": "#56b4e9", "UNRESOLVED": "#f0e442", "FAILS": "#d55e00", "failed": "#c8c8c8"}
_LABELS = {
    "HOLDS": "Hertz holds",
    "UNRESOLVED": "unresolved",
    "FAILS": "Hertz fails",
    "failed": "could not be solved",
}
CAUSE_LETTERS = {
    "finite bodies": "B",
    "second patch": "S",
    "curvature change within the patch": "J",
    "conformity": "C",
    "curvature varies over the patch": "V",
    AT_JUNCTION: "U",
}
"""Marks of the causes in the picture."""


def write_map(made: ApplicabilityMap, out: Path) -> None:
    """Write map.csv, stiffness.csv, map.json and map.png into a folder."""
    write_csv([cell_row(cell) for cell in made.cells], out / "map.csv")
    write_csv([row for position in made.positions for row in stiffness_rows(position)], out / "stiffness.csv")
    write_json(out / "map.json", map_record(made))
    map_figure(made, out / "map.png")


def cell_row(cell: MapCell) -> Record:
    """A cell as one flat row; deviations and uncertainties in percent."""
    row: Record = {
        "lateral_shift_mm": cell.shift_mm,
        "load_kN": cell.load_N / 1e3,
        "status": cell.status,
        "verdict": cell.verdict,
        "solved": cell.solved,
        "cause": cell.cause,
    }
    if cell.inferred is not None:
        for measure, deviation in cell.inferred.deviation.items():
            name = measure.rsplit("_", 1)[0]
            row[f"{name}_deviation_percent"] = 1e2 * deviation
            row[f"{name}_uncertainty_percent"] = 1e2 * cell.inferred.uncertainty[measure]
    point = cell.point
    if point is None:
        return row
    row |= {"verdict_measure": point.verdict.measure, "normal_force_kN": point.normal_force_N / 1e3}
    for measure in MEASURES:
        name, unit = measure.rsplit("_", 1)
        row[f"{name}_fe_{unit}"] = getattr(point.fe, measure)
        row[f"{name}_hertz_{unit}"] = getattr(point.hertz, measure)
        row[f"{name}_deviation_percent"] = 1e2 * point.deviation[measure]
        row[f"{name}_uncertainty_percent"] = 1e2 * point.uncertainty[measure]
    return row | {
        "p_max_half_space_MPa": point.half_space_p_max_MPa,
        "hertz_stiffness_N_per_mm15": point.hertz_stiffness_N_per_mm15,
        "pieces": point.pieces,
        "meshes": point.meshes,
        "warnings": "; ".join(point.warnings),
    }


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from a fit over all of them; none for fewer than three.

    Two loads would be met exactly, which says nothing about the fit's error.
    """
    points = [cell.point for cell in position.cells if cell.point is not None and cell.status == "converged"]
    if len(points) < _FEWEST_LOADS:
        return []
    fit = fit_stiffness(points)
    rows = []
    for point in points:
        tangent = fit.tangent(point.normal_force_N)
        rows.append(
            {
                "lateral_shift_mm": position.shift_mm,
                "load_kN": point.load_N / 1e3,
                "normal_force_kN": point.normal_force_N / 1e3,
                "approach_fe_mm": point.fe.approach_mm,
                "approach_hertz_mm": point.hertz.approach_mm,
                "tangent_with_bulk_kN_per_mm": tangent.with_bulk_N_per_mm / 1e3,
                "tangent_with_bulk_error_kN_per_mm": tangent.error_N_per_mm / 1e3,
                "tangent_contact_kN_per_mm": tangent.contact_N_per_mm / 1e3,
                "tangent_contact_error_kN_per_mm": tangent.contact_error_N_per_mm / 1e3,
                "tangent_hertz_kN_per_mm": tangent.hertz_N_per_mm / 1e3,
                "tangent_deviation_percent": 1e2 * tangent.deviation,
                "c1_mm_per_N23": fit.c1_mm_per_N23,
                "c1_error_mm_per_N23": fit.c1_error,
                "c1_hertz_mm_per_N23": fit.hertz_c1_mm_per_N23,
                "c2_mm_per_N": fit.c2_mm_per_N,
                "c2_error_mm_per_N": fit.c2_error,
                "fit_residual_percent": 1e2 * fit.residual,
            }
        )
    return rows


def map_record(made: ApplicabilityMap) -> Record:
    """The whole map with the base case, its criteria, and what made it."""
    return {
        "schema": MAP_SCHEMA,
        "case": _base_record(made.case),
        "criteria": asdict(made.case.criteria),
        "lateral_shifts_mm": list(made.shifts_mm),
        "loads_N": list(made.loads_N),
        "cells": [cell_record(cell) for cell in made.cells],
        "limits": [limit_record(shift, limit) for shift, limit in zip(made.shifts_mm, made.limits, strict=True)],
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": _provenance(made.case),
    }


def _provenance(case: Case) -> Record:
    return {"made_by": makers(case), "input_files": {body: f["sha256"] for body, f in input_files(case).items()}}


def _base_record(case: Case) -> Record:
    # shift and load are the map's own
    return {k: v for k, v in case_record(case).items() if k not in ("lateral_shift_mm", "load_N")}


def map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw the verdicts over lateral shift and load.

    Lines of equal deviation of the peak pressure, a letter for the cause of each cell that does not hold, and the load
    limit of each position.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = blank_figure(max(9.0, min(16.0, 5.0 + 0.45 * len(made.shifts_mm))), 6.4)
    ax = figure.add_subplot()
    shifts, loads = np.array(made.shifts_mm), np.array(made.loads_N) / 1e3
    cells = np.array(made.cells, dtype=object).reshape(shifts.size, loads.size).T
    _draw_cells(ax, shifts, loads, cells)
    lines = _draw_deviation(ax, shifts, loads, cells)
    limits = _draw_limits(ax, shifts, made.limits)
    causes = _draw_causes(ax, shifts, loads, cells)
    inferred = _draw_inferred(ax, shifts, loads, cells)
    verdicts = {cell.verdict for cell in made.cells}
    handles: list[Any] = [Patch(fc=c, ec="0.4", label=_LABELS[v]) for v, c in _COLOURS.items() if v in verdicts]
    if limits:
        handles.append(Line2D([], [], color="k", lw=2.4, marker="o", label="load limit $F_{max}$"))
    if inferred:
        handles.append(Line2D([], [], ls="none", marker="$i$", color="k", ms=6, label="inferred, not solved"))
    if lines:
        handles.append(Line2D([], [], color="0.15", lw=1.0, ls="--", label="peak pressure, Hertz\nagainst FE in %"))
    handles += [
        Line2D([], [], ls="none", marker=rf"$\mathbf{{{letter}}}$", color="k", ms=8, label=cause)
        for cause, letter in CAUSE_LETTERS.items()
        if cause in causes
    ]
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, fontsize=9.5)
    criteria = made.case.criteria
    ax.set(
        title=f"rail {short_name(made.case.rail)}, wheel {short_name(made.case.wheel)}: Hertz holds within"
        f" ±{1e2 * criteria.p_max:g} % of the peak pressure\nand ±{1e2 * criteria.area:g} % of the area",
        xlabel="lateral shift of the wheelset in mm  (positive: towards this rail)",
        ylabel=f"{made.case.load_kind} load in kN",
    )
    return save_figure(figure, path)


def _edges(centres: Floats) -> Floats:
    """Edges of cells half way between their centres; a single one is 1 wide."""
    if centres.size == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[:-1] + centres[1:])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def _draw_cells(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> None:
    from matplotlib.colors import ListedColormap

    names = list(_COLOURS)
    codes = np.vectorize(lambda cell: names.index(cell.verdict), otypes=[float])(cells)
    y = _edges(loads)
    # a load below zero does not exist
    y[0] = max(y[0], 0.0)
    ax.pcolormesh(
        _edges(shifts),
        y,
        codes,
        cmap=ListedColormap(list(_COLOURS.values())),
        vmin=-0.5,
        vmax=len(names) - 0.5,
        edgecolors="white",
        linewidth=0.6,
        alpha=0.85,
    )
    ax.set_yticks(loads)


def _draw_deviation(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> bool:
    """Lines of equal deviation of the peak pressure in percent; whether there are any."""
    values = np.vectorize(_deviation_percent, otypes=[float])(cells)
    if min(values.shape) < 2:
        return False
    shown = [v for v in (-40, -20, -10, -5, 5, 10, 20, 40) if np.nanmin(values) < v < np.nanmax(values)]
    if not shown:
        return False
    lines = ax.contour(
        shifts, loads, np.ma.masked_invalid(values), levels=shown, colors="0.15", linewidths=1.0, linestyles="--"
    )
    ax.clabel(lines, fmt=lambda v: f"{v:+g}", fontsize=8)
    return True


def _deviation_percent(cell: MapCell) -> float:
    usable = cell.status in ("converged", "inferred")
    return 1e2 * cell.deviation["p_max_MPa"] if usable else math.nan


def _draw_limits(ax: Axes, shifts: Floats, limits: tuple[LoadLimit, ...]) -> bool:
    found = np.array([math.nan if limit.F_max_N is None else limit.F_max_N / 1e3 for limit in limits])
    ax.plot(shifts, found, color="white", lw=4.6, marker="o", ms=8.5, zorder=4)
    ax.plot(shifts, found, color="k", lw=2.4, marker="o", ms=6, zorder=5)
    return bool(np.isfinite(found).any())


def _draw_causes(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> set[str]:
    causes = set()
    for (i, j), cell in np.ndenumerate(cells):
        if cell.cause is not None:
            causes.add(cell.cause)
            place = (float(shifts[j]), float(loads[i]))
            ax.text(*place, CAUSE_LETTERS[cell.cause], ha="center", va="center", fontsize=9, weight="bold")
    return causes


def _draw_inferred(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> bool:
    found = False
    for (i, j), cell in np.ndenumerate(cells):
        if not cell.solved:
            found = True
            ax.text(float(shifts[j]), float(loads[i]), "$i$", ha="center", va="center", fontsize=9)
    return found


def limit_text(limit: LoadLimit) -> str:
    """A load limit in words."""
    found = limit.F_max_N
    text = f"no limit: {limit.reason}" if found is None else f"holds up to {found / 1e3:.1f} kN"
    return f"{text} ({limit.note})" if limit.note else text


def map_table(made: ApplicabilityMap) -> str:
    """Verdicts and peak deviations in percent, a line for each position, and the load limits."""
    marks: Mapping[str, str] = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
    lines = ["shift mm " + "".join(f"{load / 1e3:>10g}" for load in made.loads_N) + "  kN"]
    for k, (shift, limit) in enumerate(zip(made.shifts_mm, made.limits, strict=True)):
        row = made.cells[k * len(made.loads_N) : (k + 1) * len(made.loads_N)]
        texts = [
            marks[c.verdict] + (f"{_deviation_percent(c):+z.1f}" if c.deviation else "").rjust(7) + "i "[c.solved]
            for c in row
        ]
        lines.append(f"{shift:+z8.2f} " + "".join(text.rjust(10) for text in texts) + f"  {limit_text(limit)}")
    lines.append("+ holds, x fails, ? unresolved, ! could not be solved; peak pressure, Hertz against FE in %")
    if not all(cell.solved for cell in made.cells):
        lines.append("i inferred from the half-space and both neighbours, not solved")
    return "\n".join(lines)
