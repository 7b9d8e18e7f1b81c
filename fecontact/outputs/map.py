"""An applicability map as CSV, JSON and picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Criteria
from fecontact.comparison.verdict import AT_JUNCTION
from fecontact.files import write_json
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.figures import blank_figure, save_figure
from fecontact.outputs.force_map import COLOURS, LABELS, cell_edges, draw_answers, force_map_figure
from fecontact.outputs.measure_words import WORDS
from fecontact.outputs.record import load_record, shown_case_record, versions
from fecontact.outputs.rows import cell_row
from fecontact.outputs.series import short_name
from fecontact.outputs.tables import write_csv
from fecontact.profiles.identity import profile_identity
from fecontact.solving.stiffness_fit import fit_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Record = dict[str, Any]

MAP_SCHEMA = "fecontact/map/3"
_FEWEST_LOADS = 3

CAUSE_LETTERS = {
    "finite bodies": "B",
    "second patch": "S",
    "second lobe": "L",
    "curvature change within the patch": "J",
    "conformity": "C",
    "curvature varies over the patch": "V",
    AT_JUNCTION: "U",
}
"""Marks of the causes in the picture."""


def write_map(made: ApplicabilityMap, out: Path, name: str = "map", *, provenance: Record | None = None) -> None:
    """Write NAME.csv, NAME.json and NAME.png, and stiffness.csv for the whole map, into a folder."""
    rows = [cell_row(cell, position.placement) for position in made.positions for cell in position.cells]
    write_csv(rows, out / f"{name}.csv")
    if name == "map":
        write_csv([row for position in made.positions for row in stiffness_rows(position)], out / "stiffness.csv")
    write_json(out / f"{name}.json", map_record(made, provenance))
    if made.positions:
        map_figure(made, out / f"{name}.png")
    if made.positions and made.case.creep.asked:
        force_map_figure(made, out / f"{name}_force.png")


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from a fit over all of them; none for fewer than three.

    Two loads would be met exactly, which says nothing about the fit's error.
    """
    points = [c.judged for c in position.cells if c.judged is not None and c.status == "converged"]
    if len(points) < _FEWEST_LOADS:
        return []
    fit = fit_stiffness(points)
    rows = []
    for point in points:
        tangent = fit.tangent(point.normal_force_N)
        rows.append(
            {
                "lateral_shift_mm": position.lateral_shift_mm,
                "load_kN": point.load_N / 1e3,
                "normal_force_kN": point.normal_force_N / 1e3,
                "approach_fe_mm": point.comparison.fe.approach_mm,
                "approach_hertz_mm": point.comparison.hertz.approach_mm,
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


def map_record(made: ApplicabilityMap, provenance: Record | None = None) -> Record:
    """The whole map with the base case, its criteria, and what made it."""
    return {
        "schema": MAP_SCHEMA,
        # shift and load are the map's own
        "case": {k: v for k, v in shown_case_record(made.case).items() if k not in ("lateral_shift_mm", "load_N")},
        "criteria": asdict(made.case.criteria),
        "lateral_shifts_mm": list(made.lateral_shifts_mm),
        "loads_N": list(made.loads_N),
        "cells": [cell_record(cell) for cell in made.cells],
        "limits": [limit_record(position) for position in made.positions],
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": provenance or {},
    }


def cell_record(cell: MapCell) -> Record:
    """A cell with all that is known of it."""
    return {
        "lateral_shift_mm": cell.lateral_shift_mm,
        "load_N": cell.load_N,
        "status": cell.status,
        "verdict": cell.verdict,
        "solved": cell.solved,
        "cause": cell.cause,
        "load": None if cell.judged is None else load_record(cell.judged),
        "inferred": None if cell.inferred is None else asdict(cell.inferred),
    }


def limit_record(position: MapPosition) -> Record:
    """The load limit of a position."""
    limit = position.limit
    return {
        "lateral_shift_mm": position.lateral_shift_mm,
        "F_max_N": limit.F_max_N,
        "intervals": [asdict(interval) for interval in limit.intervals],
        "reason": limit.reason,
        "note": limit.note,
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


def map_figure(made: ApplicabilityMap, path: str | Path) -> Path:
    """Draw the verdicts over lateral shift and load.

    Lines of equal deviation of the peak pressure, a letter for the cause of each cell that does not hold, and bars
    where ranges of the load end in which Hertz holds.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = blank_figure(max(9.0, min(16.0, 5.0 + 0.45 * len(made.lateral_shifts_mm))), 6.4)
    ax = figure.add_subplot()
    shifts, loads = np.array(made.lateral_shifts_mm), np.array(made.loads_N) / 1e3
    cells = np.array(made.cells, dtype=object).reshape(shifts.size, loads.size).T
    _draw_cells(ax, shifts, loads, cells)
    lines = _draw_deviation(ax, shifts, loads, cells)
    limits = _draw_limits(ax, shifts, made.limits)
    causes = _draw_causes(ax, shifts, loads, cells)
    inferred = _draw_inferred(ax, shifts, loads, cells)
    verdicts = {cell.verdict for cell in made.cells}
    handles: list[Any] = [Patch(fc=c, ec="0.4", label=LABELS[v]) for v, c in COLOURS.items() if v in verdicts]
    if limits:
        handles.append(Line2D([], [], color="k", lw=2.4, label="end of a range of loads\nin which Hertz holds"))
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
    rail, wheel = (short_name(profile_identity(spec)) for spec in (made.case.rail, made.case.wheel))
    ax.set(
        title=f"rail {rail}, wheel {wheel}: where Hertz holds,\n{_criteria_words(made.case.criteria)}",
        xlabel="lateral shift of the wheelset in mm  (positive: towards this rail)",
        ylabel=f"{made.case.load_kind} load in kN",
    )
    return save_figure(figure, path)


_MEASURE_LETTERS = {
    "p_max_MPa": "p",
    "area_mm2": "A",
    "a_mm": "a",
    "b_mm": "b",
    "centre_over_b": "c",
    "valley": "v",
    "separate_load": "s",
    "misplaced_load": "m",
}


def _criteria_words(criteria: Criteria) -> str:
    """Measures that decide by their limits, such as "5 % p_max; 10 % area, a, b; 0.15 b centre"."""
    groups: dict[str, list[str]] = {}
    for measure, limit in criteria.limits.items():
        words = WORDS[measure]
        groups.setdefault(f"{words.factor * limit:.4g} {words.off_unit}", []).append(words.short)
    return "; ".join(f"{limit} {', '.join(names)}" for limit, names in groups.items())


def _draw_cells(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> None:
    draw_answers(ax, shifts, loads, np.vectorize(lambda cell: cell.verdict, otypes=[object])(cells))


def _draw_deviation(ax: Axes, shifts: Floats, loads: Floats, cells: NDArray[Any]) -> bool:
    """Lines of equal deviation of the peak pressure in percent; whether there are any."""
    values = np.vectorize(_deviation_percent, otypes=[float])(cells)
    if min(values.shape) < 2 or not np.isfinite(values).any():
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
    """Bars at the loads where a range ends in which Hertz holds; whether there are any."""
    edges, found = cell_edges(shifts), False
    for low, high, limit in zip(edges[:-1], edges[1:], limits, strict=True):
        # the smallest and the largest load of the map are no limits
        changes = {one.high_N for one in limit.intervals[:-1]} & {one.low_N for one in limit.intervals[1:]}
        for one in limit.intervals:
            for end in sorted(changes & {one.low_N, one.high_N}) if one.answer == "HOLDS" else []:
                ax.plot([low, high], [end / 1e3] * 2, color="white", lw=4.6, solid_capstyle="butt", zorder=4)
                ax.plot([low, high], [end / 1e3] * 2, color="k", lw=2.4, solid_capstyle="butt", zorder=5)
                found = True
    return found


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


_ANSWER_WORDS = {"HOLDS": "holds", "FAILS": "fails", "UNRESOLVED": "open"}


def limit_text(limit: LoadLimit) -> str:
    """At which loads Hertz holds, in words."""
    parts = [
        f"{_ANSWER_WORDS[one.answer]} {one.low_N / 1e3:.4g}"
        + (f" to {one.high_N / 1e3:.4g}" if one.high_N > one.low_N else "")
        for one in limit.intervals
    ]
    text = f"{', '.join(parts)} kN" if parts else f"{limit.reason}"
    return f"{text} ({limit.note})" if limit.note else text


def _deviation_text(cell: MapCell) -> str:
    percent = _deviation_percent(cell)
    return f"{percent:+z.1f}" if math.isfinite(percent) else ""


def map_table(made: ApplicabilityMap) -> str:
    """Verdicts and peak deviations in percent, a line for each position, and the load limits."""
    marks: Mapping[str, str] = {"HOLDS": "+", "FAILS": "x", "UNRESOLVED": "?", "failed": "!"}
    lines = ["shift mm " + "".join(f"{load / 1e3:>10g}" for load in made.loads_N) + "  kN"]
    for k, (shift, limit) in enumerate(zip(made.lateral_shifts_mm, made.limits, strict=True)):
        row = made.cells[k * len(made.loads_N) : (k + 1) * len(made.loads_N)]
        texts = [marks[c.verdict] + _decided_by(c) + _deviation_text(c).rjust(6) + "i "[c.solved] for c in row]
        lines.append(f"{shift:+z8.2f} " + "".join(text.rjust(10) for text in texts) + f"  {limit_text(limit)}")
    letters = ", ".join(f"{letter} {WORDS[measure].short}" for measure, letter in _MEASURE_LETTERS.items())
    lines.append("+ holds, x fails, ? unresolved, ! could not be solved; peak pressure, Hertz against FE in %")
    lines.append(f"decided by {letters}")
    if not all(cell.solved for cell in made.cells):
        lines.append("i inferred from the half-space and both neighbours, not solved")
    return "\n".join(lines)


def _decided_by(cell: MapCell) -> str:
    found = cell.judged or cell.inferred
    # no measure leaves open what did not converge
    usable = cell.status in ("converged", "inferred")
    return " " if found is None or not usable or cell.verdict == "HOLDS" else _MEASURE_LETTERS[found.verdict.measure]
