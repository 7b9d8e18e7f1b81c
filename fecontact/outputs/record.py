"""Results as plain dictionaries with units in their keys: what the JSON and CSV files hold."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from dataclasses import asdict
from importlib import metadata
from typing import Any

from fecontact import __version__
from fecontact.case import Case, case_record
from fecontact.comparison.measures import MEASURES, hertz_measures
from fecontact.geometry.touch_points import RelativeCurvature, TouchPoint
from fecontact.solving.position import hertz_of_case, hertz_points_of_case, place_case
from fecontact.solving.solve import CaseResult, SolverRecord
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import HertzPoints, sides

Record = dict[str, Any]

_PACKAGES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio", "pyvista", "vtk", "pypardiso", "pyamg", "matplotlib")
_STEP_MEASURES = ("p_max_MPa", "area_mm2", "approach_mm")


def result_record(result: CaseResult) -> Record:
    """Everything that a case gives, without its fields; lengths of infinite radii are None."""
    comparison = result.comparison
    return {
        "schema": "fecontact/result/1",
        "status": result.status,
        "case": case_record(result.case),
        "normal_force_N": result.normal_force_N,
        "contact_angle_rad": result.placement.first.contact_angle_rad,
        "touch_points": [touch_record(touch) for touch in result.placement.touch_points],
        "fe": comparison.fe.as_dict(),
        "hertz": comparison.hertz.as_dict(),
        "deviation": {name: float(comparison.deviation[name]) for name in MEASURES},
        "pressure_l2": comparison.pressure_l2,
        "overlap": comparison.overlap,
        "centre_of_pressure_mm": [comparison.centre_x_mm, comparison.centre_y_mm],
        "pieces": comparison.pieces,
        "hertz_stiffness_GN_per_m15": result.hertz.stiffness_GN_per_m15,
        "rungs": {name: rung.as_dict() for name, rung in result.ladder.rungs.items()},
        "steps": {
            name: {measure: step[measure] for measure in _STEP_MEASURES} for name, step in result.ladder.steps.items()
        },
        "bodies_step_uncertainty": {name: result.bodies_step_uncertainty[name] for name in _STEP_MEASURES},
        "uncertainty": {name: result.uncertainty[name] for name in MEASURES},
        "geometry": asdict(result.geometry),
        "hertz_points": points_record(result.hertz_points),
        "verdict": {
            "verdict": result.verdict.verdict,
            "measure": result.verdict.measure,
            "cause": result.verdict.cause,
            "sides": [
                {
                    "side": side.side,
                    "verdict": side.judgement.verdict,
                    "measure": side.judgement.measure,
                    "hertz": side.hertz.as_dict(),
                    "deviation": {name: float(side.deviation[name]) for name in MEASURES},
                    "uncertainty": {name: float(side.uncertainty[name]) for name in MEASURES},
                }
                for side in result.verdict.sides
            ],
            "warnings": list(result.verdict.warnings),
        },
        "von_mises": {body: asdict(peak) for body, peak in result.von_mises.items()},
        "solver": _solver_record(result.solver),
        "warnings": list(result.warnings),
        "versions": versions(),
    }


def touch_record(touch: TouchPoint) -> Record:
    """A touch point with its curvatures: one entry, or two (gauge side, field side) at a junction."""
    return {
        "x_mm": touch.x_mm,
        "y_mm": touch.y_mm,
        "z_mm": touch.z_mm,
        "rail_y_mm": touch.rail_y_mm,
        "wheel_y_mm": touch.wheel_y_mm,
        "contact_angle_rad": touch.contact_angle_rad,
        "vertical_gap_mm": touch.vertical_gap_mm,
        "at_junction": touch.at_junction,
        "curvatures": [
            _curvature_record(side, curvature) for side, curvature in zip(sides(touch), touch.curvatures, strict=True)
        ],
    }


def _curvature_record(side: str, curvature: RelativeCurvature) -> Record:
    return {
        "side": side,
        **asdict(curvature),
        "rail_radius_mm": _radius_mm(curvature.rail_per_mm),
        "wheel_lateral_radius_mm": _radius_mm(curvature.wheel_lateral_per_mm),
        "wheel_rolling_radius_mm": _radius_mm(curvature.wheel_rolling_per_mm),
    }


def _radius_mm(curvature_per_mm: float) -> float | None:
    # straight lines come out of sums of large numbers with a curvature of rounding size
    return 1.0 / curvature_per_mm if abs(curvature_per_mm) > 1e-9 else None


def _solver_record(solver: SolverRecord) -> Record:
    record = asdict(solver)
    record["element_size_mm"] = list(solver.element_size_mm)
    return record


def versions() -> dict[str, str | None]:
    """Versions of this package, of Python and of the packages that decide about numbers; None where one is absent."""
    found: dict[str, str | None] = {
        "fecontact": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = None
    return found


MEASURED_COLUMNS = ("seconds", "peak_memory_MB")
"""Columns of a row that differ from run to run; all others are the same to the last bit."""


def row(record: Mapping[str, Any]) -> Record:
    """A result record as one flat row; deviations and L2 in percent, degrees of freedom and seconds summed up.

    A record that was read from a file gives the same row: what is no number is null there and NaN here.
    """
    case, solver, touch = record["case"], record["solver"], record["touch_points"][0]
    flat: Record = {
        "status": record["status"],
        "rail": case["rail"],
        "wheel": case["wheel"],
        "lateral_shift_mm": case["lateral_shift_mm"],
        "load_kN": case["load_N"] / 1e3,
        "load_kind": case["load_kind"],
        "inclination_rad": case["inclination_rad"],
        "roll_mrad": 1e3 * case["roll_rad"],
        "yaw_mrad": 1e3 * case["yaw_rad"],
        "normal_force_kN": record["normal_force_N"] / 1e3,
        "contact_angle_mrad": 1e3 * record["contact_angle_rad"],
        "touch_rail_y_mm": touch["rail_y_mm"],
        "touch_wheel_y_mm": touch["wheel_y_mm"],
        "at_junction": touch["at_junction"],
        "touch_points": len(record["touch_points"]),
    }
    for measure in MEASURES:
        name, unit = measure.rsplit("_", 1)
        flat[f"{name}_fe_{unit}"] = _number(record["fe"][measure])
        flat[f"{name}_hertz_{unit}"] = _number(record["hertz"][measure])
        flat[f"{name}_deviation_percent"] = 1e2 * _number(record["deviation"][measure])
        flat[f"{name}_uncertainty_percent"] = 1e2 * _number(record["uncertainty"][measure])
    steps = record["steps"]
    for measure in _STEP_MEASURES:
        name = measure.rsplit("_", 1)[0]
        flat[f"{name}_step_true_gap_percent"] = 1e2 * _number(steps["quadratic_to_true_gap"][measure])
        flat[f"{name}_step_bodies_percent"] = 1e2 * _number(steps["half_space_to_bodies"][measure])
        flat[f"{name}_step_bodies_uncertainty_percent"] = 1e2 * _number(record["bodies_step_uncertainty"][measure])
    for name in ("junction_distance_mm", "junction_distance_over_b", "curvature_variation", "normal_turn_rad"):
        # no junction is null in JSON
        value = record["geometry"][name]
        flat[name] = math.inf if value is None and name.startswith("junction") else _number(value)
    return flat | {
        "junction_in_patch": record["geometry"]["junction_in_patch"],
        "verdict": record["verdict"]["verdict"],
        "verdict_measure": record["verdict"]["measure"],
        "verdict_cause": record["verdict"]["cause"],
        "verdict_warnings": "; ".join(record["verdict"]["warnings"]),
        "p_max_half_space_MPa": _number(record["rungs"]["half_space"]["p_max_MPa"]),
        "p_max_shared_hertz_MPa": record["hertz_points"]["shared"]["p_max_MPa"],
        **_von_mises_columns(record["von_mises"]),
        "pressure_l2_percent": 1e2 * _number(record["pressure_l2"]),
        "overlap": _number(record["overlap"]),
        "centre_x_mm": _number(record["centre_of_pressure_mm"][0]),
        "centre_y_mm": _number(record["centre_of_pressure_mm"][1]),
        "pieces": record["pieces"],
        "hertz_stiffness_GN_per_m15": record["hertz_stiffness_GN_per_m15"],
        "resolution": case["resolution"],
        "element_size_x_mm": solver["element_size_mm"][0],
        "element_size_y_mm": solver["element_size_mm"][1],
        "degrees_of_freedom": sum(solver["degrees_of_freedom"].values()),
        "iterations": solver["iterations"],
        "load_balance": _number(solver["load_balance"]),
        "seconds": sum(solver["seconds"].values()),
        "peak_memory_MB": solver["peak_memory_MB"],
        "warnings": "; ".join(record["warnings"]),
    }


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _von_mises_columns(bodies: Mapping[str, Any]) -> Record:
    return {
        f"von_mises_{column}_{body}_{unit}": _number(peak[key])
        for body, peak in bodies.items()
        for column, unit, key in (("max", "MPa", "von_mises_MPa"), ("depth", "mm", "depth_mm"))
    }


def hertz_record(case: Case) -> Record:
    """Hertz's theory alone at a case's position: `hertz` is what a result is compared with.

    `ellipses` has every touch point, and both sides of a junction, as if each carried the whole load; where the
    surfaces conform there is no ellipse, and `problem` says so.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    placement = place_case(case)
    hertz = hertz_of_case(case, placement)
    return {
        "schema": "fecontact/hertz/1",
        "case": case_record(case),
        "normal_force_N": hertz.normal_force_N,
        "contact_angle_rad": placement.first.contact_angle_rad,
        "touch_points": [touch_record(touch) for touch in placement.touch_points],
        "hertz": _ellipse_record(hertz),
        **points_record(hertz_points_of_case(case, placement)),
        "warnings": [*placement.rail.profile.notes, *placement.wheel.profile.notes],
        "versions": versions(),
    }


def points_record(points: HertzPoints) -> Record:
    """Hertz at every touch point: with the whole load, and under its share of it."""
    return {
        "ellipses": [
            {
                "touch_point": p.touch_point,
                "side": p.side,
                **({"problem": p.problem} if p.whole is None else _ellipse_record(p.whole)),
            }
            for p in points.points
        ],
        "shared": {
            "approach_mm": points.shared_approach_mm,
            "overlapping": points.overlapping,
            "p_max_MPa": points.shared_p_max_MPa,
            "ellipses": [
                {"touch_point": p.touch_point, **_ellipse_record(p.shared)}
                for p in points.points
                if p.shared is not None
            ],
        },
    }


def _ellipse_record(hertz: HertzContact) -> Record:
    return {
        "normal_force_N": hertz.normal_force_N,
        **hertz_measures(hertz).as_dict(),
        "orientation_rad": hertz.orientation_rad,
        "A_per_mm": hertz.A_per_mm,
        "B_per_mm": hertz.B_per_mm,
        "stiffness_GN_per_m15": hertz.stiffness_GN_per_m15,
    }
