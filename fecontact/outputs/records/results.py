"""Results as plain dictionaries with units in their keys: what the JSON and CSV files hold."""

from __future__ import annotations

import math
import platform
from dataclasses import asdict
from functools import cache
from importlib import metadata
from typing import Any

from fecontact import __version__
from fecontact.case import Case, case_record
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.lobes import LobeJudgement
from fecontact.geometry.placement import Placement
from fecontact.outputs.records.creep import creep_record
from fecontact.outputs.records.plastic import plastic_record
from fecontact.outputs.records.theories import ellipse_record, theories_record, verdict_record
from fecontact.outputs.records.touch import touch_record
from fecontact.profiles.identity import profile_identity
from fecontact.solving.hertz_alone import HertzAlone
from fecontact.solving.lobe_sizes import narrowest_semi_axes_mm, semi_axes_of_elements_mm
from fecontact.solving.meshes import finer_degrees_of_freedom
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult
from fecontact.theory.touch_hertz import HertzPoints, Side

Record = dict[str, Any]

_PACKAGES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio", "pyvista", "vtk", "pypardiso", "pyamg", "matplotlib")
RESULT_SCHEMA = "fecontact/result/4"
FOUND_INPUTS = ("roll_mrad",)
"""What a record of a case has beside its inputs: the roll as it stands, found or given."""
STEP_MEASURES = ("p_max_MPa", "area_mm2", "approach_mm")


def shown_case_record(case: Case, placement: Placement | None = None) -> Record:
    """The inputs as results show them: of a profile that is a file its name and a hash of its content, no folder.

    Where a placement is given also what was found for it (`FOUND_INPUTS`).
    """
    shown = case_record(case.with_profiles({body: profile_identity(spec) for body, spec in case.profiles.items()}))
    return shown if placement is None else shown | {"roll_mrad": 1e3 * roll_of_case(case, placement)}


def result_record(result: CaseResult) -> Record:
    """Everything that a case gives, without its fields; lengths of infinite radii are None."""
    load = load_record(result.load)
    return {
        "schema": RESULT_SCHEMA,
        "status": result.status,
        "case": shown_case_record(result.case, result.placement),
        "contact_angle_rad": result.placement.first.contact_angle_rad,
        "touch_points": [touch_record(touch) for touch in result.placement.touch_points],
        **load,
        "patches": [patch_record(one) for one in result.load.lobes],
        "hertz_points": points_record(result.hertz_points),
        "von_mises": {body: asdict(peak) for body, peak in result.von_mises.items()},
        "creep": creep_record(result.load),
        "solver": {**asdict(result.effort), **load["solver"]},
        "warnings": list(result.notes),
        "versions": versions(),
    }


def load_record(load: JudgedLoad) -> Record:
    """What a judged load says, of a case and of a cell of a map alike."""
    comparison = load.comparison
    return {
        "normal_force_N": load.normal_force_N,
        "fe": comparison.fe.as_dict(),
        "hertz": comparison.hertz.as_dict(),
        "deviation": {name: float(value) for name, value in load.deviation.items()},
        "uncertainty": {name: float(value) for name, value in load.uncertainty.items()},
        # the part of it that is the measured profile's, and no mesh takes away; None where both are exact lines
        "uncertainty_of_profile": None if load.solved.point_noise is None else load.solved.point_noise.uncertainty(),
        "pressure_l2": comparison.pressure_l2,
        "overlap": comparison.overlap,
        "centre_of_pressure_mm": [comparison.patch.centre_x_mm, comparison.patch.centre_y_mm],
        "lobes": [asdict(lobe) for lobe in comparison.patch.lobes],
        "pieces": comparison.patch.pieces,
        "hertz_stiffness_GN_per_m15": load.hertz.stiffness_GN_per_m15,
        "rungs": {name: rung.as_dict() for name, rung in load.ladder.rungs.items()},
        # relative, of the elements' own contact
        "elements_uncertainty": {name: float(value) for name, value in load.elements_uncertainty.items()},
        "steps": load.ladder.steps,
        "bodies_step_uncertainty": {name: float(value) for name, value in load.bodies_step_uncertainty.items()},
        "geometry": asdict(load.geometry),
        "slide_mm": load.level.slide_mm,
        "verdict": {
            "verdict": load.verdict.answer,
            "measure": load.verdict.measure,
            "each": dict(load.verdict.each),
            "limits": load.case.criteria.limits,
            "cause": load.verdict.cause,
            "unknown": list(load.verdict.unknown),
            "sides": [_side_record(side, judged) for side, judged in load.sides.items()],
            "warnings": list(load.warnings),
        },
        # of the elements' own nodes alone
        "verdict_elements": _elements_record(load.by_elements),
        **plastic_record(load),
        "theories": theories_record(load),
        "solver": _solver_record(load),
    }


def patch_record(one: LobeJudgement) -> Record:
    """A separate patch, or a lobe of one, with Hertz's ellipse at the nearest touch point under its own force."""
    return {
        "normal_force_N": one.normal_force_N,
        "contact_angle_rad": one.contact_angle_rad,
        "rail_y_mm": one.rail_y_mm,
        "centre_mm": list(one.centre_mm),
        "separate": one.separate,
        "touch_point": one.touch_point,
        "touch_rail_y_mm": None if one.touch is None else one.touch.rail_y_mm,
        "fe": one.fe,
        "rungs": dict(one.rungs),
        "hertz": None if one.hertz is None else ellipse_record(one.hertz),
        "deviation": dict(one.deviation),
        "uncertainty": dict(one.uncertainty),
        "verdict": None if one.verdict is None else verdict_record(one.verdict),
    }


def _side_record(side: Side, judged: Judgement) -> Record:
    return {
        "side": side,
        "verdict": judged.verdict.answer,
        "measure": judged.verdict.measure,
        "each": dict(judged.verdict.each),
        "hertz": judged.measures.as_dict(),
        "deviation": {name: float(value) for name, value in judged.deviation.items()},
        "uncertainty": {name: float(value) for name, value in judged.uncertainty.items()},
    }


def _elements_record(judged: Judgement) -> Record:
    return {
        "verdict": judged.verdict.answer,
        "measure": judged.verdict.measure,
        "each": dict(judged.verdict.each),
        "deviation": {name: float(value) for name, value in judged.deviation.items()},
        "uncertainty": {name: float(value) for name, value in judged.uncertainty.items()},
    }


def _elements(load: JudgedLoad, semi_axes_mm: tuple[float, float]) -> list[float]:
    """Elements on semi-axes along x and across, of each mesh, the finest first, in the direction that has fewer."""
    return [
        min(length / step for length, step in zip(semi_axes_mm, one.nodal.grid.steps_mm, strict=True))
        for one in load.solved.levels
    ]


def _solver_record(load: JudgedLoad) -> Record:
    level, nodal, half_space = load.level, load.level.nodal, load.solved.half_space
    return {
        "iterations": nodal.iterations,
        "compliance_calls": nodal.compliance_calls,
        "contact_residual": nodal.contact_residual,
        "penetration_residual": nodal.penetration_residual,
        "load_balance": load.fe.load_balance,
        "misfit": level.misfit,
        # relative; None where there are too few elements to see it
        "elements_compliance_error": None if math.isnan(level.compliance_error) else level.compliance_error,
        "degrees_of_freedom": dict(level.degrees_of_freedom),
        "elements": dict(level.elements),
        "element_size_mm": list(nodal.grid.steps_mm),
        "node_spacing_mm": list(load.fe.grid.steps_mm),
        "meshes": len(load.solved.levels),
        # of the lobe that elements are made for, and of the narrowest one that is not small
        "elements_a_semi_axis": _elements(load, semi_axes_of_elements_mm(half_space)),
        "elements_a_semi_axis_of_narrowest_lobe": _elements(load, narrowest_semi_axes_mm(half_space)),
        # to expect of the next finer mesh
        "finer_degrees_of_freedom": finer_degrees_of_freedom(load.solved.levels),
        "zone_enlarged": level.enlarged,
    }


@cache
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


def hertz_record(found: HertzAlone) -> Record:
    """Hertz's theory alone at a case's position, as `runs.analytic.hertz` tells it."""
    placement = found.placement
    return {
        "schema": "fecontact/hertz/1",
        "case": shown_case_record(found.case, placement),
        "normal_force_N": found.hertz.normal_force_N,
        "contact_angle_rad": placement.first.contact_angle_rad,
        "touch_points": [touch_record(touch) for touch in placement.touch_points],
        "hertz": ellipse_record(found.hertz),
        **points_record(found.points),
        "uncertainty_of_profile": found.uncertainty_of_profile,
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
                **({"problem": p.problem} if p.whole is None else ellipse_record(p.whole)),
            }
            for p in points.points
        ],
        "shared": {
            "approach_mm": points.shared_approach_mm,
            "overlapping": points.overlapping,
            "p_max_MPa": points.shared_p_max_MPa,
            "ellipses": [
                {"touch_point": p.touch_point, **ellipse_record(p.shared)}
                for p in points.points
                if p.shared is not None
            ],
        },
    }
