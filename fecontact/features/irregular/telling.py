"""Records, pictures and terminal output of models of a wheel on an irregularity."""

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
    find_largest_amplitude_mm,
)
from fecontact.features.irregular.models import MODELS, compute_eq6_limits
from fecontact.inputs.texts import count_text
from fecontact.outputs.feature_report import write_feature_report
from fecontact.outputs.flat_records import Record, select_attributes, to_plain
from fecontact.outputs.pair_names import row_pair_text
from fecontact.outputs.parts import Lead, Picture
from fecontact.outputs.records.results import case_inputs, package_versions
from fecontact.outputs.style import (
    SERIES_COLOURS,
    SERIES_MARKS,
    add_grid,
    add_legend_beside,
    blank_figure,
    save_figure,
    set_plain_log_scale,
)
from fecontact.outputs.tables import Table, TableRecord, make_table, number_column, text_column
from fecontact.outputs.terminal import OutputLines, note_lines
from fecontact.placement.irregularity import Irregularity

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def make_irregular_map_record(smooth: SmoothPair, cells: Sequence[Cell], *, limit: float) -> Record:
    """Make the record of a map over wavelength and amplitude.

    Parameters
    ----------
    smooth
        Smooth pair of the case.
    cells
        Judged cells, by increasing wavelength and amplitude.
    limit
        Largest error with which a model holds.

    Returns
    -------
    Record
        Cells, largest amplitudes of each model, and closed forms.
    """
    by_wavelength = [list(group) for _, group in groupby(cells, key=lambda cell: cell.wavelength_mm)]
    record = _make_head(smooth, limit) | {
        "phases": list(PHASES),
        "cells": [_make_cell_record(cell, smooth, limit) for cell in cells],
        "limits": [_make_limits_record(column, smooth, limit) for column in by_wavelength],
    }
    largest_amplitude = max(cell.amplitude_mm for cell in cells)
    if largest_amplitude > smooth.hertz.approach_mm:
        record["notes"].append(
            f"amplitudes of up to {1e3 * largest_amplitude:.0f} um exceed the approach of"
            f" {1e3 * smooth.hertz.approach_mm:.0f} um: a wheel at constant height leaves the rail over the hollows."
            " All results are for the constant load. The real load depends on the dynamics: take it from the vehicle"
            " code, or give smaller amplitudes"
        )
    return record


def make_irregularity_record(
    smooth: SmoothPair, irregularity: Irregularity, places: Mapping[float, JudgedPlace | str], *, limit: float
) -> Record:
    """Make the record of the models along an irregularity.

    Parameters
    ----------
    smooth
        Smooth pair of the case.
    irregularity
        Irregularity of wheel and rail.
    places
        Judged places by their distance (mm), or the reason why a place is not solved.
    limit
        Largest error with which a model holds.

    Returns
    -------
    Record
        All places, and the largest errors of each model with their places.
    """
    solved_places = {s: place for s, place in places.items() if isinstance(place, JudgedPlace)}
    record = _make_head(smooth, limit) | {
        "irregularity": {key: value for key, value in to_plain(irregularity).items() if value not in (None, [], 0.0)},
        "places": [_make_place_record(s, place, irregularity, smooth, limit) for s, place in places.items()],
        "worst": {name: _make_worst_record(name, solved_places, limit) for name in MODELS} if solved_places else {},
    }
    lost_positions = [s for s, place in solved_places.items() if place.models["eq6"].force_N == 0.0]
    if lost_positions:
        record["notes"].append(
            f"eq6 has no contact at {len(lost_positions)} of {count_text(len(solved_places), 'place')}, the first at"
            f" {lost_positions[0]:g} mm, where the half-space carries the whole load: use path, fitted or local"
        )
    if any(place.truth.p_max_MPa is None for place in solved_places.values()):
        record["notes"].append(
            "an edge is in the patch: the elastic pressure is unbounded there, so no peak is given; round the edge with"
            " a haversine or a table that has its radius, or solve the contact with yielding"
        )
    return record


def _make_head(smooth: SmoothPair, limit: float) -> Record:
    """Make the common part of both records: case, pair, models, half-space and notes."""
    hertz = smooth.hertz
    return {
        "schema": "fecontact/irregular/1",
        "case": case_inputs(smooth.case, smooth.placement),
        "pair": {
            **to_plain(smooth.pair),
            **select_attributes(hertz, "normal_force_N a_mm b_mm approach_mm stiffness_N_per_mm15"),
            "p_max_MPa": hertz.p0_MPa,
        },
        "models": {name: select_attributes(model, "words cost source range") for name, model in MODELS.items()},
        "half_space": select_attributes(smooth, "approach_error peak_error"),
        "without_irregularity": _make_smooth_record(smooth.on_profiles, limit),
        "limit": limit,
        **select_attributes(smooth, "notes"),
        "versions": package_versions(),
    }


def _make_smooth_record(errors: ModelErrors | str, limit: float) -> Record:
    """Make the record of Hertz on the whole profiles without an irregularity.

    Parameters
    ----------
    errors
        Errors of the force and of the peak pressure, or the reason for which they do not exist.
    limit
        Largest error with which Hertz holds (-).

    Returns
    -------
    dict
        `force_error`, `peak_error` (-), `holds` and `problem`. Without errors the first three are None, and `problem`
        is the reason; with errors `problem` is None.
    """
    if isinstance(errors, str):
        return {"force_error": None, "peak_error": None, "holds": None, "problem": errors}
    return {**to_plain(errors), "holds": errors.holds(limit), "problem": None}


def _make_cell_record(cell: Cell, smooth: SmoothPair, limit: float) -> Record:
    """Make the record of a cell, with the cheapest model that holds.

    The wavelength is also given in lengths of Hertz's patch, and the amplitude in Hertz's approaches. `limit` is the
    largest error (-) with which a model holds. Numbers without a value are None.
    """
    models = {
        name: _pick_finite(model_errors, "force_error peak_error") | {"holds": model_errors.holds(limit)}
        for name, model_errors in cell.models.items()
    }
    return {
        **select_attributes(cell, "wavelength_mm amplitude_mm"),
        "patch_lengths": 0.5 * cell.wavelength_mm / smooth.hertz.a_mm,
        "approaches": cell.amplitude_mm / smooth.hertz.approach_mm,
        "models": models,
        # models are in the order of their cost
        "cheapest": next((name for name, model in models.items() if model["holds"]), None),
        **_pick_finite(cell, "p_max_MPa patch_count residual"),
        "problem": cell.problem or None,
    }


def _make_limits_record(column: Sequence[Cell], smooth: SmoothPair, limit: float) -> Record:
    """Make the record of the largest amplitudes at a wavelength.

    Parameters
    ----------
    column
        Cells of a wavelength.
    smooth
        Smooth bodies with their ellipse.
    limit
        Largest magnitude of both errors of a model that holds (-).

    Returns
    -------
    dict
        Wavelength, and largest amplitudes in mm: for force and peak and for the force alone by the model (None if no
        cells show them), and in closed form for Hertz's spring.
    """
    wavelength = column[0].wavelength_mm
    closed_form = compute_eq6_limits(smooth.pair, smooth.hertz.normal_force_N, wavelength, limit)
    return {
        "wavelength_mm": wavelength,
        "amplitude_mm": {name: find_largest_amplitude_mm(column, name, limit=limit) for name in MODELS},
        "force_amplitude_mm": {
            name: find_largest_amplitude_mm(column, name, ("force_error",), limit) for name in MODELS
        },
        "closed_form_mm": {**to_plain(closed_form), "eq6_mm": min(closed_form.force_mm, closed_form.peak_mm)},
    }


def _make_place_record(
    s_mm: float, place: JudgedPlace | str, irregularity: Irregularity, smooth: SmoothPair, limit: float
) -> Record:
    """Make the record of a place, with the errors of all models.

    Parameters
    ----------
    s_mm
        Position along the irregularity in mm.
    place
        Contact on the half-space with the models; the reason if there is no solution.
    irregularity
        Irregularity, for the opening at the position.
    smooth
        Smooth bodies with their ellipse.
    limit
        Largest magnitude of both errors of a model that holds (-).

    Returns
    -------
    dict
        Contact on the half-space, and for each model its force, its errors of force and peak, and whether it holds.
    """
    record: Record = {"s_mm": s_mm, "opening_mm": float(irregularity.opening_mm(s_mm))}
    if isinstance(place, str):
        return record | {"models": {}, "problem": place}
    models = {
        name: _pick_finite(model, "force_N force_error peak_error approach_mm")
        | {"holds": model.holds(limit), "problem": model.problem or None}
        for name, model in place.models.items()
    }
    record |= {
        "load_N": smooth.hertz.normal_force_N,
        **select_attributes(place.truth, "approach_mm p_max_MPa residual"),
    }
    return record | select_attributes(place.truth.patch, "area_mm2 patch_count") | {"models": models, "problem": None}


def _make_worst_record(name: str, places: Mapping[float, JudgedPlace], limit: float) -> Record:
    """Make the record of the largest errors of a model in force and peak.

    The record has the places of these errors, and the number of places without a result of the model.
    """
    answered = {s: place.models[name] for s, place in places.items() if not place.models[name].problem}
    record: Record = {"silent": len(places) - len(answered)}
    for error in ("force_error", "peak_error"):
        errors = {s: value for s, model in answered.items() if math.isfinite(value := getattr(model, error))}
        position = max(errors, key=lambda s: abs(errors[s]), default=None)
        record[error] = None if position is None else errors[position]
        record[f"{error}_at_mm"] = position
    holding_count = sum(place.models[name].holds(limit) for place in places.values())
    return record | {"share_within_limit": holding_count / len(places)}


def _pick_finite(value: object, names: str) -> Record:
    """Pick numbers of a value by their names; None for a number that is not finite."""
    return {name: number if math.isfinite(number) else None for name, number in select_attributes(value, names).items()}


# --- Pictures of models on an irregularity: the map over wavelength and amplitude, and the forces along it.

_NO_MODEL_COLOUR = "0.8"


def draw_irregular(record: Record, path: str | Path) -> Path:
    """Draw the map of a record, or the forces along an irregularity.

    Parameters
    ----------
    record
        Record of models on an irregularity.
    path
        File of the picture.

    Returns
    -------
    Path
        The written file.
    """
    return _draw_map(record, path) if "cells" in record else _draw_forces(record, path)


def _draw_map(record: Record, path: str | Path) -> Path:
    """Draw the cells by the cheapest model that holds, and the limits of all models.

    The limits are curves; the closed form of eq. 6 is dashed.
    """
    figure = blank_figure(10.5, 6.0)
    ax = figure.subplots()
    names = list(record["models"])
    colour = dict(zip(names, SERIES_COLOURS, strict=False))
    for index, name in enumerate((*names, None)):
        cheapest_cells = [cell for cell in record["cells"] if cell["cheapest"] == name]
        limits = [
            limit_record[key].get(name)
            for limit_record in record["limits"]
            for key in ("amplitude_mm", "force_amplitude_mm")
        ]
        # a model that is the cheapest at no cell still has its curves, and needs a label
        if cheapest_cells or any(limits):
            ax.plot(
                [cell["wavelength_mm"] for cell in cheapest_cells],
                [1e3 * cell["amplitude_mm"] for cell in cheapest_cells],
                (SERIES_MARKS[index % len(SERIES_MARKS)]) if name else "x",
                color=colour.get(name or "", _NO_MODEL_COLOUR),
                alpha=0.55,
                label=_describe_model(record, name) if name else "no model holds: half-space",
            )
    for name in names:
        for key, style in (("amplitude_mm", "-"), ("force_amplitude_mm", ":")):
            limits = [(limit_record["wavelength_mm"], limit_record[key][name]) for limit_record in record["limits"]]
            points = [(x, 1e3 * y) for x, y in limits if y is not None]
            if len(points) > 1:
                ax.plot(*zip(*points, strict=True), style, color=colour[name])
    for style, label in (("-", "a model holds below its curve"), (":", "its force holds below this curve")):
        ax.plot([], [], style, color="0.4", label=label)
    closed_form = [
        (limit_record["wavelength_mm"], 1e3 * limit_record["closed_form_mm"]["eq6_mm"])
        for limit_record in record["limits"]
    ]
    low, high = (end(1e3 * cell["amplitude_mm"] for cell in record["cells"]) for end in (min, max))
    visible = [(x, y) for x, y in closed_form if low <= y <= high]
    if visible:
        ax.plot(*zip(*visible, strict=True), "k--", label="eq6, closed form")
    pair = record["pair"]
    ax.axvline(2.0 * pair["a_mm"], color="0.5", linewidth=0.8)
    ax.annotate("patch", (2.0 * pair["a_mm"], high), fontsize=8, ha="right", rotation=90, va="top")
    ax.set(xlabel="wavelength, mm", ylabel="amplitude (half of peak to valley), µm")
    set_plain_log_scale(ax)
    add_grid(ax)
    add_legend_beside(ax, title="mark: the cheapest model that holds")
    ax.set_title(
        f"{_describe_pair(record)}\nmodels of the irregular contact within {100 * record['limit']:g} % in force"
        f" and peak (solved at the marks, where curves end)\npatch {2 * pair['a_mm']:.1f} mm long, approach"
        f" {1e3 * pair['approach_mm']:.0f} µm",
        fontsize=10,
    )
    return save_figure(figure, path)


def _describe_pair(record: TableRecord) -> str:
    """Describe the pair, the shift and the normal force in a title."""
    case, pair = record["case"], record["pair"]
    return (
        f"{row_pair_text(case)}; shift {case['lateral_shift_mm']:+z.2f} mm; normal force"
        f" {1e-3 * pair['normal_force_N']:.4g} kN"
    )


def _describe_model(record: Record, name: str) -> str:
    """Name and description of a model in several lines."""
    return fill(f"{name}: {record['models'][name]['words']}", 36)


def _draw_forces(record: Record, path: str | Path) -> Path:
    """Draw the force of each model along an irregularity, and e below.

    The forces are at the approach of the half-space under the load.
    """
    figure = blank_figure(10.5, 6.5)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    places = record["places"]
    positions = [place["s_mm"] for place in places]
    top.axhline(1e-3 * record["pair"]["normal_force_N"], color="black", label="half-space (the load)")
    for index, name in enumerate(record["models"]):
        force = 1e-3 * np.array([_model_force_N(name, place) for place in places], dtype=float)
        top.plot(
            positions,
            force,
            SERIES_MARKS[index] + "-",
            markersize=3,
            color=SERIES_COLOURS[index],
            label=_describe_model(record, name),
        )
    _mark_worst_places(top, record)
    top.plot([], [], "o", mfc="none", color="0.4", markersize=9, label="largest error of a model")
    top.set(ylabel="force at the approach of the half-space, kN")
    top.set_title(f"{_describe_pair(record)}\nforces of the models at the approach of the half-space", fontsize=10)
    bottom.plot(positions, [1e3 * place["opening_mm"] for place in places], color="0.3")
    bottom.set(xlabel="s along the track, mm", ylabel="irregularity e, µm")
    add_grid(top, bottom)
    add_legend_beside(top)
    return save_figure(figure, path)


def _mark_worst_places(ax: Axes, record: Record) -> None:
    """Mark the largest force error of each model."""
    for index, (name, worst) in enumerate(record["worst"].items()):
        position = worst["force_error_at_mm"]
        if position is not None:
            place = next(candidate for candidate in record["places"] if candidate["s_mm"] == position)
            ax.plot(
                position,
                1e-3 * place["models"][name]["force_N"],
                "o",
                mfc="none",
                color=SERIES_COLOURS[index],
                markersize=9,
            )


# --- Models of a wheel on an irregularity on the terminal: the limits of a map, or the forces along it.

_WORST_COLUMNS = (
    text_column("model", "name"),
    number_column("force\n%", "force_error", "{:+.1f}", 1e2),
    number_column("at\nmm", "force_error_at_mm"),
    number_column("peak\n%", "peak_error", "{:+.1f}", 1e2),
    number_column("at \nmm", "peak_error_at_mm"),
    number_column("no result\nplaces", "silent", "{:.0f}"),
    number_column("holds\n% of places", "share_within_limit", "{:.0f}", 1e2),
)


def format_irregular(record: TableRecord) -> OutputLines:
    """Format a record for the terminal.

    Parameters
    ----------
    record
        Record of models on an irregularity.

    Yields
    ------
    str or Table
        The smooth pair, the limits or forces of each model, and notes.
    """
    pair = record["pair"]
    yield (
        f"Hertz without the irregularity: a {pair['a_mm']:.3f}, b {pair['b_mm']:.3f} mm, {pair['p_max_MPa']:.1f} MPa,"
        f" approach {1e3 * pair['approach_mm']:.2f} um under {1e-3 * pair['normal_force_N']:.2f} kN;"
        f" A {pair['A_per_mm']:.4g}, B {pair['B_per_mm']:.4g} 1/mm"
    )
    yield _describe_smooth_pair(record)
    kind = "cells" if "cells" in record else "places"
    if kind == "cells":
        yield _make_limits_table(record)
    else:
        yield _make_places_table(record)
        yield make_table(
            "Worst places", _WORST_COLUMNS, ({**worst, "name": name} for name, worst in record["worst"].items())
        )
    approach, peak = (f"{100 * error:+.2f} %" for error in record["half_space"].values())
    yield f"discretisation error of the half-space (against Hertz): approach {approach}, peak {peak}"
    yield from note_lines(record["notes"])
    if problems := [result["problem"] for result in record[kind] if result["problem"]]:
        yield from note_lines(
            [f"{len(problems)} of {len(record[kind])} {kind} have no solution; the first: {problems[0]}"]
        )


def write_irregular_report(record: TableRecord, picture: Path, out: Path) -> Path:
    """Write `report.html` of models on an irregularity.

    Parameters
    ----------
    record
        Record of models on an irregularity.
    picture
        PNG of the record; an SVG has the same name.
    out
        Folder of the results.

    Returns
    -------
    Path
        The written page.
    """
    words = {
        True: "The cheapest model that holds over wavelength and amplitude, and the limits of the models.",
        False: "Force of each model along the irregularity, at the approach of the half-space under the load.",
    }
    return write_feature_report(
        f"Hertz's spring on an irregularity: {_describe_pair(record)}",
        Lead(_describe_spring(record), subject=_describe_pair(record)),
        format_irregular(record),
        [Picture(content=picture.with_suffix(".svg"), words=words["cells" in record])],
        out,
    )


def _describe_spring(record: TableRecord) -> str:
    """Answer on Hertz's spring: cells of a map, or share of the places, in which it holds."""
    limit = f"force and peak pressure within {100 * record['limit']:g} %"
    if "cells" not in record:
        if not record["worst"]:
            return "Hertz's spring (eq6): no place has a solution"
        share = record["worst"]["eq6"]["share_within_limit"]
        return f"Hertz's spring (eq6) holds at {100 * share:.0f} % of {len(record['places'])} places: {limit}"
    solved_cells = [cell for cell in record["cells"] if not cell["problem"]]
    holding_count = sum(cell["models"]["eq6"]["holds"] for cell in solved_cells)
    unsolved_count = len(record["cells"]) - len(solved_cells)
    unsolved_part = f"; {unsolved_count} could not be solved" if unsolved_count else ""
    return (
        f"Hertz's spring (eq6) holds in {holding_count} of {count_text(len(record['cells']), 'cell')} of wavelength and"
        f" amplitude: {limit}{unsolved_part}"
    )


def _describe_smooth_pair(record: TableRecord) -> str:
    """Describe the errors of Hertz on the whole profiles without the irregularity.

    All models begin with this contact.
    """
    smooth_errors = record["without_irregularity"]
    if smooth_errors["problem"]:
        return f"Hertz could not be checked on the full profiles without the irregularity: {smooth_errors['problem']}"
    force, peak = (f"{100 * smooth_errors[f'{name}_error']:+z.1f} %" for name in ("force", "peak"))
    return (
        f"Hertz's force and peak {'hold' if smooth_errors['holds'] else 'FAIL'} on the full profiles without the"
        f" irregularity: {force} and {peak} from the half-space, limit {100 * record['limit']:g} %"
        + "; the errors of each model come on top of this error"
        * (not smooth_errors["holds"])
    )


def _make_limits_table(record: TableRecord) -> Table:
    """Make a table with the largest amplitudes of each model, a line for each wavelength.

    Amplitudes are in um: up to them the errors of force and peak are within the limit of the record. Wavelengths are in
    mm and in lengths of the patch.
    """
    columns = [
        number_column("wavelength\nmm", "wavelength_mm"),
        number_column("in patch\nlengths", lambda row: row["cells"][0]["patch_lengths"], "{:.2f}"),
        *(text_column(f"{name}\num", partial(_format_amplitude, name), "number") for name in record["models"]),
        text_column("eq6, closed\nform um", lambda row: f"{1e3 * row['closed_form_mm']['eq6_mm']:.3g}", "number"),
    ]
    rows = [
        {**row, "cells": [cell for cell in record["cells"] if cell["wavelength_mm"] == row["wavelength_mm"]]}
        for row in record["limits"]
    ]
    title = f"Largest amplitude with errors of force and peak within {100 * record['limit']:g} %"
    return make_table(title, columns, rows)


def _format_amplitude(name: str, limits: TableRecord) -> str:
    """Format the largest amplitude, or the solved amplitude above or below it."""
    amplitude, cells = limits["amplitude_mm"][name], limits["cells"]
    if amplitude is not None:
        return f"{1e3 * amplitude:.3g}"
    holds = bool(cells[0]["models"]) and cells[0]["models"][name]["holds"]
    return f"{'>' if holds else '<'}{1e3 * cells[-1 if holds else 0]['amplitude_mm']:.3g}"


def _make_places_table(record: TableRecord) -> Table:
    """Make a table of all places.

    Each line has approach and peak pressure of the half-space, and the force of each model at this approach.
    """
    columns = [
        number_column("s\nmm", "s_mm"),
        number_column("e\num", "opening_mm", "{:.1f}", 1e3),
        number_column("approach\nmm", "approach_mm", "{:.5f}"),
        number_column("p_max\nMPa", "p_max_MPa", "{:.0f}"),
        *(number_column(f"{name}\nkN", partial(_model_force_N, name), "{:.2f}", 1e-3) for name in record["models"]),
    ]
    title = "Half-space under the load, and force of each model at the same approach"
    return make_table(title, columns, record["places"], lambda place: "open" if place["problem"] else "plain")


def _model_force_N(name: str, place: TableRecord) -> float | None:
    """Force (N) of a model at a place; None without a result."""
    force_N: float | None = place["models"].get(name, {}).get("force_N")
    return force_N
