"""Results as plain dictionaries with units in their keys: what the JSON and CSV files hold."""

from __future__ import annotations

import math
import platform
from dataclasses import asdict
from functools import cache
from importlib import metadata

from fecontact import __version__
from fecontact.case import Case, case_record
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.lobes import LobeJudgement
from fecontact.geometry.placement import Placement
from fecontact.outputs.records.creep import creep_record
from fecontact.outputs.records.plain import Record, picked
from fecontact.outputs.records.plastic import plastic_record
from fecontact.outputs.records.theories import answer_record, ellipse_record, theories_record, verdict_record
from fecontact.outputs.records.touch import profile_notes, touch_record
from fecontact.profiles.identity import profile_identity
from fecontact.solving.hertz_alone import HertzAlone
from fecontact.solving.lobe_sizes import narrowest_semi_axes_mm, semi_axes_of_elements_mm
from fecontact.solving.meshes import finer_degrees_of_freedom
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult
from fecontact.theory.touch_hertz import HertzPoints

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
        **picked(load, "deviation uncertainty"),
        # the part of it that is the measured profile's, and no mesh takes away; None where both are exact lines
        "uncertainty_of_profile": None if load.solved.point_noise is None else load.solved.point_noise.uncertainty(),
        **picked(comparison, "pressure_l2 overlap"),
        "centre_of_pressure_mm": [comparison.patch.centre_x_mm, comparison.patch.centre_y_mm],
        "lobes": [asdict(lobe) for lobe in comparison.patch.lobes],
        "pieces": comparison.patch.pieces,
        "hertz_stiffness_GN_per_m15": load.hertz.stiffness_GN_per_m15,
        "rungs": {name: rung.as_dict() for name, rung in load.ladder.rungs.items()},
        # relative, of the elements' own contact
        "elements_uncertainty": load.elements_uncertainty,
        "steps": load.ladder.steps,
        "bodies_step_uncertainty": load.bodies_step_uncertainty,
        "geometry": asdict(load.geometry),
        "slide_mm": load.level.slide_mm,
        "verdict": {
            **answer_record(load.verdict),
            "limits": load.case.criteria.limits,
            **picked(load.verdict, "cause unknown"),
            "sides": [
                {
                    "side": side,
                    **answer_record(judged.verdict),
                    "hertz": judged.measures.as_dict(),
                    **picked(judged, "deviation uncertainty"),
                }
                for side, judged in load.sides.items()
            ],
            "warnings": list(load.warnings),
        },
        # of the elements' own nodes alone
        "verdict_elements": answer_record(load.by_elements.verdict) | picked(load.by_elements, "deviation uncertainty"),
        **plastic_record(load),
        "theories": theories_record(load),
        "solver": _solver_record(load),
    }


def patch_record(one: LobeJudgement) -> Record:
    """A separate patch, or a lobe of one, with Hertz's ellipse at the nearest touch point under its own force."""
    return {
        **picked(one, "normal_force_N contact_angle_rad rail_y_mm centre_mm separate touch_point"),
        "touch_rail_y_mm": None if one.touch is None else one.touch.rail_y_mm,
        **picked(one, "fe rungs"),
        "hertz": None if one.hertz is None else ellipse_record(one.hertz),
        **picked(one, "deviation uncertainty"),
        "verdict": None if one.verdict is None else verdict_record(one.verdict),
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
        **picked(nodal, "iterations compliance_calls contact_residual penetration_residual"),
        "load_balance": load.fe.load_balance,
        "misfit": level.misfit,
        # relative; None where there are too few elements to see it
        "elements_compliance_error": None if math.isnan(level.compliance_error) else level.compliance_error,
        **picked(level, "degrees_of_freedom elements"),
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
        "warnings": profile_notes(placement),
        "versions": versions(),
    }


def points_record(points: HertzPoints) -> Record:
    """Hertz at every touch point: with the whole load, and under its share of it."""
    return {
        "ellipses": [
            picked(p, "touch_point side") | ({"problem": p.problem} if p.whole is None else ellipse_record(p.whole))
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
