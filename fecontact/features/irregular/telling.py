"""Models of a wheel on an irregularity: records, pictures, terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import groupby
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from fecontact.features.irregular.model_errors import (
    PHASES,
    Cell,
    JudgedPlace,
    ModelErrors,
    SmoothPair,
    largest_amplitude_mm,
)
from fecontact.features.irregular.models import MODELS, eq6_limits
from fecontact.outputs.flat_records import Record, picked, told
from fecontact.outputs.pair_names import pair_of_row
from fecontact.outputs.records.results import case_inputs, versions
from fecontact.outputs.style import MARKS, SERIES, blank_figure, finish, legend_beside, plain_log, save_figure
from fecontact.outputs.tables import Item, Table, number, table_of, text
from fecontact.outputs.terminal import Lines, notes
from fecontact.placement.irregularity import Irregularity

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def map_record(smooth: SmoothPair, cells: Sequence[Cell], *, limit: float) -> Record:
    """Record of the map over wavelength and amplitude: cells, largest amplitudes of each model, closed forms."""
    by_wavelength = [list(group) for _, group in groupby(cells, key=lambda cell: cell.wavelength_mm)]
    record = _head(smooth, limit) | {
        "phases": list(PHASES),
        "cells": [_cell_record(cell, smooth, limit) for cell in cells],
        "limits": [_limits_record(column, smooth, limit) for column in by_wavelength],
    }
    above = max(cell.amplitude_mm for cell in cells)
    if above > smooth.hertz.approach_mm:
        record["notes"].append(
            f"amplitudes go up to {1e3 * above:.0f} um, and the approach is {1e3 * smooth.hertz.approach_mm:.0f} um: a"
            " wheel that keeps its height leaves the rail over the hollows. All here is under the constant load; what"
            " the load is there is a matter of dynamics: take it from the vehicle code, or give smaller amplitudes"
        )
    return record


def along_record(
    smooth: SmoothPair, line: Irregularity, places: Mapping[float, JudgedPlace | str], *, limit: float
) -> Record:
    """Record of the models along an irregularity, and of the places with their largest errors."""
    solved = {s: place for s, place in places.items() if isinstance(place, JudgedPlace)}
    record = _head(smooth, limit) | {
        "irregularity": {key: value for key, value in told(line).items() if value not in (None, [], 0.0)},
        "places": [_place_record(s, place, line, smooth, limit) for s, place in places.items()],
        "worst": {name: _worst_record(name, solved, limit) for name in MODELS} if solved else {},
    }
    lost = [s for s, place in solved.items() if place.models["eq6"].force_N == 0.0]
    if lost:
        record["notes"].append(
            f"eq6 sees wheel and rail apart at {len(lost)} of {len(solved)} places, at {lost[0]:g} mm first, where the"
            " half-space carries the whole load: give it the path of the wheel's centre, or take fitted or local"
        )
    if any(place.truth.p_max_MPa is None for place in solved.values()):
        record["notes"].append(
            "an edge lies in the patch: the elastic pressure there has no bound, and none is given; round the edge by"
            " giving it as a haversine or a table with its radius, or ask what yields"
        )
    return record


def _head(smooth: SmoothPair, limit: float) -> Record:
    hertz = smooth.hertz
    return {
        "schema": "fecontact/irregular/1",
        "case": case_inputs(smooth.case, smooth.placement),
        "pair": {
            **told(smooth.pair),
            **picked(hertz, "normal_force_N a_mm b_mm approach_mm stiffness_N_per_mm15"),
            "p_max_MPa": hertz.p0_MPa,
        },
        "models": {name: picked(model, "words cost source range") for name, model in MODELS.items()},
        "half_space": picked(smooth, "approach_error peak_error"),
        "without_irregularity": _smooth_record(smooth.on_profiles, limit),
        "limit": limit,
        **picked(smooth, "notes"),
        "versions": versions(),
    }


def _smooth_record(found: ModelErrors | str, limit: float) -> Record:
    """Hertz on the whole profiles without an irregularity; None for what is not known, with the reason."""
    if isinstance(found, str):
        return {"force_error": None, "peak_error": None, "holds": None, "problem": found}
    return {**told(found), "holds": found.holds(limit), "problem": None}


def _cell_record(cell: Cell, smooth: SmoothPair, limit: float) -> Record:
    models = {
        name: _known(one, "force_error peak_error") | {"holds": one.holds(limit)} for name, one in cell.models.items()
    }
    return {
        **picked(cell, "wavelength_mm amplitude_mm"),
        "patch_lengths": 0.5 * cell.wavelength_mm / smooth.hertz.a_mm,
        "approaches": cell.amplitude_mm / smooth.hertz.approach_mm,
        "models": models,
        # in the order of their cost
        "cheapest": next((name for name, one in models.items() if one["holds"]), None),
        **_known(cell, "p_max_MPa pieces residual"),
        "problem": cell.problem or None,
    }


def _limits_record(column: Sequence[Cell], smooth: SmoothPair, limit: float) -> Record:
    """Largest amplitudes at a wavelength, for force and peak and for the force alone; None if no cells show them."""
    wavelength = column[0].wavelength_mm
    closed = eq6_limits(smooth.pair, smooth.hertz.normal_force_N, wavelength, limit)
    return {
        "wavelength_mm": wavelength,
        "amplitude_mm": {name: largest_amplitude_mm(column, name, limit=limit) for name in MODELS},
        "force_amplitude_mm": {name: largest_amplitude_mm(column, name, ("force_error",), limit) for name in MODELS},
        "closed_form_mm": {**told(closed), "eq6_mm": min(closed.force_mm, closed.peak_mm)},
    }


def _place_record(
    s_mm: float, place: JudgedPlace | str, line: Irregularity, smooth: SmoothPair, limit: float
) -> Record:
    record: Record = {"s_mm": s_mm, "opening_mm": float(line.opening_mm(s_mm))}
    if isinstance(place, str):
        return record | {"models": {}, "problem": place}
    models = {
        name: _known(one, "force_N force_error peak_error approach_mm")
        | {"holds": one.holds(limit), "problem": one.problem or None}
        for name, one in place.models.items()
    }
    record |= {"load_N": smooth.hertz.normal_force_N, **picked(place.truth, "approach_mm p_max_MPa residual")}
    return record | picked(place.truth.patch, "area_mm2 pieces") | {"models": models, "problem": None}


def _worst_record(name: str, places: Mapping[float, JudgedPlace], limit: float) -> Record:
    """Largest errors of a model in force and peak, with their places, and the number of places without an answer."""
    said = {s: place.models[name] for s, place in places.items() if not place.models[name].problem}
    record: Record = {"silent": len(places) - len(said)}
    for error in ("force_error", "peak_error"):
        known = {s: value for s, one in said.items() if math.isfinite(value := getattr(one, error))}
        at = max(known, key=lambda s: abs(known[s]), default=None)
        record[error] = None if at is None else known[at]
        record[f"{error}_at_mm"] = at
    good = sum(place.models[name].holds(limit) for place in places.values())
    return record | {"share_within_limit": good / len(places)}


def _known(value: object, names: str) -> Record:
    """Numbers of a value by their names, None for a number that is not finite."""
    return {name: index if math.isfinite(index) else None for name, index in picked(value, names).items()}


# --- Pictures of models on an irregularity: the map over wavelength and amplitude, and the forces along a line.

_NONE = "0.8"


def irregular_figure(record: Record, path: str | Path) -> Path:
    """Draw the map or the line of a record."""
    return _map_figure(record, path) if "cells" in record else _line_figure(record, path)


def _map_figure(record: Record, path: str | Path) -> Path:
    """Cells by the cheapest model that holds, the limits of all models as curves, eq. 6 in closed form dashed."""
    figure = blank_figure(10.5, 6.0)
    ax = figure.subplots()
    names = list(record["models"])
    colour = dict(zip(names, SERIES, strict=False))
    for index, name in enumerate((*names, None)):
        own = [cell for cell in record["cells"] if cell["cheapest"] == name]
        limits = [one[key].get(name) for one in record["limits"] for key in ("amplitude_mm", "force_amplitude_mm")]
        # a model that is nowhere the cheapest has a line, and a name
        if own or any(limits):
            ax.plot(
                [cell["wavelength_mm"] for cell in own],
                [1e3 * cell["amplitude_mm"] for cell in own],
                (MARKS[index % len(MARKS)]) if name else "x",
                color=colour.get(name or "", _NONE),
                alpha=0.55,
                label=_model(record, name) if name else "no model holds: half-space",
            )
    for name in names:
        for key, line in (("amplitude_mm", "-"), ("force_amplitude_mm", ":")):
            limits = [(one["wavelength_mm"], one[key][name]) for one in record["limits"]]
            known = [(x, 1e3 * y) for x, y in limits if y is not None]
            if len(known) > 1:
                ax.plot(*zip(*known, strict=True), line, color=colour[name])
    for line, words in (("-", "a model holds below its line"), (":", "its force holds below")):
        ax.plot([], [], line, color="0.4", label=words)
    closed = [(one["wavelength_mm"], 1e3 * one["closed_form_mm"]["eq6_mm"]) for one in record["limits"]]
    low, high = (end(1e3 * cell["amplitude_mm"] for cell in record["cells"]) for end in (min, max))
    inside = [(x, y) for x, y in closed if low <= y <= high]
    if inside:
        ax.plot(*zip(*inside, strict=True), "k--", label="eq6, closed form")
    pair = record["pair"]
    ax.axvline(2.0 * pair["a_mm"], color="0.5", linewidth=0.8)
    ax.annotate("patch", (2.0 * pair["a_mm"], high), fontsize=8, ha="right", rotation=90, va="top")
    ax.set(xlabel="wavelength, mm", ylabel="amplitude (half of peak to valley), µm")
    plain_log(ax)
    finish(ax)
    legend_beside(ax, title="mark: the cheapest model that holds")
    ax.set_title(
        f"{_of_pair(record)}\nwhich model of the irregular contact is within {100 * record['limit']:g} % of force and"
        f" peak (solved at the marks: lines end with them)\npatch {2 * pair['a_mm']:.1f} mm long, approach"
        f" {1e3 * pair['approach_mm']:.0f} µm",
        fontsize=10,
    )
    return save_figure(figure, path)


def _of_pair(record: Record) -> str:
    case, pair = record["case"], record["pair"]
    return (
        f"{pair_of_row(case)}; shift {case['lateral_shift_mm']:+z.2f} mm; normal force"
        f" {1e-3 * pair['normal_force_N']:.4g} kN"
    )


def _model(record: Record, name: str) -> str:
    return fill(f"{name}: {record['models'][name]['words']}", 36)


def _line_figure(record: Record, path: str | Path) -> Path:
    """Force of each model over the distance, at the approach of the half-space under the load, and e below."""
    figure = blank_figure(10.5, 6.5)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    places = record["places"]
    s = [one["s_mm"] for one in places]
    top.axhline(1e-3 * record["pair"]["normal_force_N"], color="black", label="half-space (the load)")
    for index, name in enumerate(record["models"]):
        force = 1e-3 * np.array([_force(name, place) for place in places], dtype=float)
        top.plot(s, force, MARKS[index] + "-", markersize=3, color=SERIES[index], label=_model(record, name))
    _mark_worst(top, record)
    top.plot([], [], "o", mfc="none", color="0.4", markersize=9, label="largest error of a model")
    top.set(ylabel="force at the half-space's approach, kN")
    top.set_title(f"{_of_pair(record)}\nforces of the models at the approach of the half-space", fontsize=10)
    bottom.plot(s, [1e3 * one["opening_mm"] for one in places], color="0.3")
    bottom.set(xlabel="s along the track, mm", ylabel="irregularity e, µm")
    finish(top, bottom)
    legend_beside(top)
    return save_figure(figure, path)


def _mark_worst(ax: Axes, record: Record) -> None:
    for index, (name, worst) in enumerate(record["worst"].items()):
        at = worst["force_error_at_mm"]
        if at is not None:
            place = next(one for one in record["places"] if one["s_mm"] == at)
            ax.plot(at, 1e-3 * place["models"][name]["force_N"], "o", mfc="none", color=SERIES[index], markersize=9)


# --- Models of a wheel on an irregularity on the terminal: the limits of a map, or the forces along a line.

_WORST = (
    text("model", "name"),
    number("force\n%", "force_error", "{:+.1f}", 1e2),
    number("at\nmm", "force_error_at_mm"),
    number("peak\n%", "peak_error", "{:+.1f}", 1e2),
    number("at \nmm", "peak_error_at_mm"),
    number("says\nnothing", "silent", "{:.0f}"),
    number("holds\n% of places", "share_within_limit", "{:.0f}", 1e2),
)


def irregular_lines(record: Item) -> Lines:
    """The smooth pair, the limits or forces of each model, and notes."""
    pair = record["pair"]
    yield (
        f"Hertz without it: a {pair['a_mm']:.3f}, b {pair['b_mm']:.3f} mm, {pair['p_max_MPa']:.1f} MPa, approach"
        f" {1e3 * pair['approach_mm']:.2f} um under {1e-3 * pair['normal_force_N']:.2f} kN;"
        f" A {pair['A_per_mm']:.4g}, B {pair['B_per_mm']:.4g} 1/mm"
    )
    yield _smooth_text(record)
    kind = "cells" if "cells" in record else "places"
    if kind == "cells":
        yield _limits_table(record)
    else:
        yield _places_table(record)
        yield table_of("Worst places", _WORST, ({**one, "name": name} for name, one in record["worst"].items()))
    approach, peak = (f"{100 * error:+.2f} %" for error in record["half_space"].values())
    yield f"the half-space on its nodes is {approach} (approach) and {peak} (peak) from Hertz without the irregularity"
    yield from notes(record["notes"])
    if found := [one["problem"] for one in record[kind] if one["problem"]]:
        yield from notes([f"{len(found)} of {len(record[kind])} {kind} have no solution; the first: {found[0]}"])


def _smooth_text(record: Item) -> str:
    """Whether Hertz, with which all models begin, is right on the whole profiles without the irregularity."""
    found = record["without_irregularity"]
    if found["problem"]:
        return f"whether Hertz's force and peak hold on these profiles without it is not known: {found['problem']}"
    force, peak = (f"{100 * found[f'{name}_error']:+z.1f} %" for name in ("force", "peak"))
    return (
        f"Hertz's force and peak {'hold' if found['holds'] else 'FAIL'} on these profiles without it: {force} and"
        f" {peak} off the half-space, limit {100 * record['limit']:g} %"
        + "; each model has this error beside its own"
        * (not found["holds"])
    )


def _limits_table(record: Item) -> Table:
    """Amplitude up to which each model holds, a line for each wavelength."""
    columns = [
        number("wavelength\nmm", "wavelength_mm"),
        number("lengths of\nthe patch", lambda one: one["cells"][0]["patch_lengths"], "{:.2f}"),
        *(text(f"{name}\num", partial(_amplitude, name), "number") for name in record["models"]),
        text("eq6, closed\nform um", lambda one: f"{1e3 * one['closed_form_mm']['eq6_mm']:.3g}", "number"),
    ]
    items = [
        {**one, "cells": [cell for cell in record["cells"] if cell["wavelength_mm"] == one["wavelength_mm"]]}
        for one in record["limits"]
    ]
    title = f"Amplitude up to which a model is within {100 * record['limit']:g} % of force and peak"
    return table_of(title, columns, items)


def _amplitude(name: str, limits: Item) -> str:
    """The largest amplitude, or the solved amplitude above or below which it lies."""
    found, cells = limits["amplitude_mm"][name], limits["cells"]
    if found is not None:
        return f"{1e3 * found:.3g}"
    holds = bool(cells[0]["models"]) and cells[0]["models"][name]["holds"]
    return f"{'>' if holds else '<'}{1e3 * cells[-1 if holds else 0]['amplitude_mm']:.3g}"


def _places_table(record: Item) -> Table:
    """Approach and peak of the half-space, and the force of each model at this approach, a line for each place."""
    columns = [
        number("s\nmm", "s_mm"),
        number("e\num", "opening_mm", "{:.1f}", 1e3),
        number("approach\nmm", "approach_mm", "{:.5f}"),
        number("p_max\nMPa", "p_max_MPa", "{:.0f}"),
        *(number(f"{name}\nkN", partial(_force, name), "{:.2f}", 1e-3) for name in record["models"]),
    ]
    title = "Half-space under the load, and forces of the models at its approach"
    return table_of(title, columns, record["places"], lambda one: "open" if one["problem"] else "plain")


def _force(name: str, place: Item) -> float | None:
    force_N: float | None = place["models"].get(name, {}).get("force_N")
    return force_N
