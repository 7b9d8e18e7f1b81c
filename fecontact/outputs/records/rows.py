"""Flat rows of results, one a case or a cell of a map: the columns of the tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TypeAlias

from fecontact.case import Case
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.ladder import STEPS
from fecontact.comparison.measures import MEASURES
from fecontact.errors import InputError
from fecontact.files import read_json, write_json
from fecontact.geometry.placement import Placement
from fecontact.irregularity.texts import irregularity_text
from fecontact.map.cells import ApplicabilityMap, MapCell
from fecontact.outputs.records.creep import creep_columns
from fecontact.outputs.records.plain import Record, picked
from fecontact.outputs.records.plastic import plastic_columns
from fecontact.outputs.records.results import STEP_MEASURES, versions
from fecontact.outputs.records.theories import theory_columns
from fecontact.outputs.words.measures import deviation_column
from fecontact.profiles.identity import profile_identity
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult

Row: TypeAlias = Record

ROW_SCHEMA = "fecontact/row/1"
MEASURED_COLUMNS = ("seconds", "peak_memory_MB")
"""Columns of a row that differ from run to run; all others are the same to the last bit."""


def rows(results: CaseResult | ApplicabilityMap | Iterable[CaseResult]) -> list[Row]:
    """Results as flat dictionaries with units in their keys, one a case or a cell, as `pandas.DataFrame` takes them."""
    if isinstance(results, ApplicabilityMap):
        return [cell_row(cell, position.placement) for position in results.positions for cell in position.cells]
    return [case_row(result) for result in ([results] if isinstance(results, CaseResult) else results)]


def load_row(load: JudgedLoad, placement: Placement) -> Row:
    """A judged load as a flat row; deviations, uncertainties, steps and L2 in percent, degrees of freedom summed up."""
    case, comparison, first = load.case, load.comparison, placement.first
    row: Row = {
        "status": load.status,
        **input_columns(case, placement),
        "normal_force_kN": load.normal_force_N / 1e3,
        "contact_angle_mrad": 1e3 * first.contact_angle_rad,
        **picked(first, "rail_y_mm wheel_y_mm", "touch_"),
        "at_junction": first.at_junction,
        "touch_points": len(placement.touch_points),
    }
    for measure in MEASURES:
        name, unit = measure.rsplit("_", 1)
        row[f"{name}_fe_{unit}"] = getattr(comparison.fe, measure)
        row[f"{name}_hertz_{unit}"] = getattr(comparison.hertz, measure)
    row |= deviation_columns(load.deviation, load.uncertainty)
    steps = load.ladder.steps
    for measure in STEP_MEASURES:
        name = measure.rsplit("_", 1)[0]
        for step in (step for step in STEPS if step.column and step.name in steps):
            row[f"{name}_step_{step.column}_percent"] = 1e2 * steps[step.name][measure]
        if measure in load.bodies_step_uncertainty:
            row[f"{name}_step_bodies_uncertainty_percent"] = 1e2 * load.bodies_step_uncertainty[measure]
    return row | {
        **picked(load.geometry, "junction_distance_mm junction_distance_over_b curvature_variation normal_turn_rad"),
        "junction_in_patch": load.geometry.junction_in_patch,
        "verdict": load.verdict.answer,
        "verdict_measure": load.verdict.measure,
        "limit_used": load.limit_used,
        "verdict_failing": " ".join(load.verdict.failing),
        "verdict_cause": load.verdict.cause,
        "verdict_warnings": "; ".join(load.warnings),
        "p_max_half_space_MPa": load.ladder.rungs["half_space"].p_max_MPa,
        "pressure_l2_percent": 1e2 * comparison.pressure_l2,
        "overlap": comparison.overlap,
        **picked(comparison.patch, "centre_x_mm centre_y_mm"),
        "lobes": len(comparison.patch.lobes),
        "pieces": comparison.patch.pieces,
        "hertz_stiffness_GN_per_m15": load.hertz.stiffness_GN_per_m15,
        "resolution": case.resolution if isinstance(case.resolution, str) else None,
        "element_size_x_mm": load.level.nodal.grid.steps_mm[0],
        "element_size_y_mm": load.level.nodal.grid.steps_mm[1],
        "elements_misfit_percent": 1e2 * load.level.misfit,
        "of_elements_compliance_error_percent": 1e2 * load.level.compliance_error,
        **_elements_columns(load),
        "meshes": len(load.solved.levels),
        "degrees_of_freedom": sum(load.level.degrees_of_freedom.values()),
        "iterations": load.level.nodal.iterations,
        "load_balance": load.fe.load_balance,
        **plastic_columns(load),
        **creep_columns(load),
        **theory_columns(load),
    }


def _elements_columns(load: JudgedLoad) -> Row:
    """The elements' own contact: its verdict, its measures, and their uncertainties in percent."""
    verdict = load.by_elements.verdict
    row: Row = {"of_elements_verdict": verdict.answer, "of_elements_verdict_measure": verdict.measure}
    measures = load.ladder.rungs["elements"].as_dict()
    for measure, unsure in load.elements_uncertainty.items():
        row[f"of_elements_{measure}"] = measures[measure]
        row[f"of_elements_{measure.rsplit('_', 1)[0]}_uncertainty_percent"] = 1e2 * unsure
    return row


def deviation_columns(deviation: Mapping[str, float], uncertainty: Mapping[str, float]) -> Row:
    """Deviations of Hertz that are known, and their uncertainties; the centre of pressure in half-widths b."""
    row: Row = {}
    for measure, value in deviation.items():
        column, unsure, factor = deviation_column(measure)
        row[column] = factor * value
        if measure in uncertainty:
            row[unsure] = factor * uncertainty[measure]
    return row


def input_columns(case: Case, placement: Placement | None = None) -> Row:
    """The inputs that a row shows; a roll that is found from both wheels is known with the placement alone.

    The side stands in rows of wheelsets, and of right wheels.
    """
    roll = case.roll_rad if placement is None else roll_of_case(case, placement)
    row: Row = {
        "rail": profile_identity(case.rail),
        "wheel": profile_identity(case.wheel),
        "lateral_shift_mm": case.lateral_shift_mm,
        "load_kN": case.load_N / 1e3,
        **picked(case, "load_kind inclination_rad"),
        "roll_mrad": None if case.roll != "given" and placement is None else 1e3 * roll,
        "yaw_mrad": 1e3 * case.yaw_rad,
    }
    of_wheelset: Row = {"side": case.side, "roll": case.roll}
    for name, load_N in (("roll_load_kN", case.roll_load_N), ("opposite_load_kN", case.opposite.wheel_load_N)):
        if load_N is not None:
            of_wheelset[name] = load_N / 1e3
    if case.roll != "given" or case.side != "left":
        row |= of_wheelset
    return row | _irregular_columns(case, placement) if case.irregularities else row


def _irregular_columns(case: Case, placement: Placement | None) -> Row:
    """What rail and wheel have along the track, where on it, and how much lower the rigid wheel stands there."""
    along = None if placement is None else placement.along
    lines = picked(case, "rail_irregularity wheel_irregularity")
    return {
        "distance_mm": case.distance_mm,
        **{name: None if line is None else irregularity_text(line) for name, line in lines.items()},
        "lowered_mm": None if along is None else along.lowered_mm,
    }


def case_row(result: CaseResult) -> Row:
    """A result as a flat row: its load, and what is known of its bodies and of the work."""
    row = load_row(result.load, result.placement) | {"p_max_shared_hertz_MPa": result.hertz_points.shared_p_max_MPa}
    for body, peak in result.von_mises.items():
        row[f"von_mises_max_{body}_MPa"] = peak.von_mises_MPa
        row[f"von_mises_depth_{body}_mm"] = peak.depth_mm
    return row | {
        "seconds": sum(result.effort.seconds.values()),
        "peak_memory_MB": result.effort.peak_memory_MB,
        "warnings": "; ".join(result.notes),
    }


def cell_row(cell: MapCell, placement: Placement | None) -> Row:
    """A cell of a map as a flat row, with the columns of a case as far as it has them."""
    head = picked(cell, "lateral_shift_mm load_kN status verdict")
    return head if cell.judged is None or placement is None else head | load_row(cell.judged, placement)


def write_row(path: Path, row: Row) -> Path:
    """Write a row with what made it; numbers that JSON does not have are kept as texts."""
    kept = {key: repr(value) if _is_not_finite(value) else value for key, value in row.items()}
    return write_json(path, {"schema": ROW_SCHEMA, "row": kept, "versions": versions()})


def read_row(path: Path) -> Row:
    """Read a row as it was before it was written.

    Raises
    ------
    InputError
        If the file is no row of this layout.
    """
    document = read_json(path)
    if not isinstance(document, Mapping) or document.get("schema") != ROW_SCHEMA:
        raise InputError(f"{path}: no row of the layout {ROW_SCHEMA}; solve the case again")
    row = document.get("row")
    plain = (str, int, float, bool, type(None))
    if not isinstance(row, Mapping) or not all(isinstance(value, plain) for value in row.values()):
        raise InputError(f"{path}: it is no row; solve the case again")
    return {key: _NOT_FINITE.get(value, value) if isinstance(value, str) else value for key, value in row.items()}


_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def _is_not_finite(value: object) -> bool:
    return isinstance(value, float) and not math.isfinite(value)
