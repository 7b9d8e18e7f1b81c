"""Models of a wheel on an irregularity as records: the map over waves, and the forces along one irregularity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby

from fecontact.alone.irregular import SmoothPair
from fecontact.comparison.irregular import MODELS, JudgedPlace
from fecontact.comparison.irregular_map import PHASES, Cell, largest_amplitude_mm
from fecontact.comparison.judgement import Standing, cheapest
from fecontact.irregularity.shapes import Irregularity
from fecontact.outputs.records.results import case_inputs, versions
from fecontact.outputs.records.told import Record, picked
from fecontact.theory.irregular_limits import eq6_limits

SCHEMA = "fecontact/irregular/1"


def map_record(smooth: SmoothPair, cells: Sequence[Cell], *, limit: float) -> Record:
    """The map over wavelength and amplitude: cells, largest amplitudes of each model, closed forms."""
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
    """What the models say along an irregularity, and where they are worst."""
    solved = {s: place for s, place in places.items() if isinstance(place, JudgedPlace)}
    record = _head(smooth, limit) | {
        "irregularity": {key: value for key, value in asdict(line).items() if value not in (None, (), 0.0)},
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
    hertz, pair = smooth.hertz, smooth.pair
    return {
        "schema": SCHEMA,
        "case": case_inputs(smooth.case, smooth.placement),
        "pair": {
            **asdict(pair),
            **picked(hertz, "normal_force_N a_mm b_mm approach_mm"),
            "p_max_MPa": hertz.p0_MPa,
            "stiffness_N_per_mm15": hertz.stiffness_N_per_mm15,
        },
        "models": {name: picked(model, "words cost source range") for name, model in MODELS.items()},
        "half_space": picked(smooth, "approach_error peak_error"),
        "limit": limit,
        "notes": list(smooth.notes),
        "versions": versions(),
    }


def _cell_record(cell: Cell, smooth: SmoothPair, limit: float) -> Record:
    return {
        **picked(cell, "wavelength_mm amplitude_mm"),
        "patch_lengths": 0.5 * cell.wavelength_mm / smooth.hertz.a_mm,
        "approaches": cell.amplitude_mm / smooth.hertz.approach_mm,
        "models": {
            name: _known(one, "force_error peak_error") | {"holds": one.holds(limit)}
            for name, one in cell.models.items()
        },
        "cheapest": cheapest(
            Standing(name=name, answer="HOLDS" if one.holds(limit) else "FAILS") for name, one in cell.models.items()
        ).name
        or None,
        **_known(cell, "p_max_MPa pieces residual"),
        "problem": cell.problem or None,
    }


def _limits_record(column: Sequence[Cell], smooth: SmoothPair, limit: float) -> Record:
    """Largest amplitudes of one wavelength, of force and peak and of the force alone: None where no cells show it."""
    wavelength = column[0].wavelength_mm
    closed = eq6_limits(smooth.pair, smooth.hertz.normal_force_N, wavelength, limit)
    return {
        "wavelength_mm": wavelength,
        "amplitude_mm": {name: largest_amplitude_mm(column, name, limit=limit) for name in MODELS},
        "force_amplitude_mm": {name: largest_amplitude_mm(column, name, ("force_error",), limit) for name in MODELS},
        "closed_form_mm": {**asdict(closed), "eq6_mm": min(closed.force_mm, closed.peak_mm)},
    }


def _place_record(
    s_mm: float, place: JudgedPlace | str, line: Irregularity, smooth: SmoothPair, limit: float
) -> Record:
    record: Record = {"s_mm": s_mm, "opening_mm": float(line.opening_mm(s_mm))}
    if isinstance(place, str):
        return record | {"models": {}, "problem": place}
    truth = place.truth
    return record | {
        "load_N": smooth.hertz.normal_force_N,
        **picked(truth, "approach_mm p_max_MPa"),
        **picked(truth.patch, "area_mm2 pieces"),
        "residual": truth.residual,
        "models": {
            name: {
                **_known(one, "force_N force_error peak_error approach_mm"),
                "holds": one.holds(limit),
                "problem": one.problem or None,
            }
            for name, one in place.models.items()
        },
        "problem": None,
    }


def _worst_record(name: str, places: Mapping[float, JudgedPlace], limit: float) -> Record:
    """Where a model is worst: of the force, and of the peak where both have one; how often it says nothing."""
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
    """Numbers of a value by their names, None where one is not finite."""
    return {name: number if math.isfinite(number) else None for name, number in picked(value, names).items()}
