"""Results as plain dictionaries with units in their keys: what the JSON and CSV files hold.

A contact stands once in a record: finite elements as `fe`, each other rung and theory by its name, with its
own measures; beside them how far it is off, how sure that is, and what the criteria say of it. All of them carry the
`normal_force_N` of the record, but for lobes and the patches of a theory, which have a force each along their own
normal. A number that is added here is in the record, in the row, and so in all tables and comparisons.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Protocol, TypeAlias, runtime_checkable

from fecontact import __version__
from fecontact.case import Case, case_record
from fecontact.contact_theories.approximation import Approximation, TheoryPatch
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import offered
from fecontact.files import read_json, write_json
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import BODIES, PLASTIC
from fecontact.judging.lobes import LobeJudgement
from fecontact.judging.measures import MEASURES, Measures, hertz_measures
from fecontact.judging.verdict import NOT_IN_IT, Judgement, PlasticVerdict, Verdict
from fecontact.outputs.flat_records import Record, flat, picked, told
from fecontact.outputs.geometry import touch_records
from fecontact.outputs.own_profiles import own_profiles_record
from fecontact.outputs.records.cheapest import cheapest_columns, cheapest_of
from fecontact.outputs.tables import Item
from fecontact.placement.irregularity import irregularity_text
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.library import profile_identity
from fecontact.solving.hertz_alone import HertzAlone
from fecontact.solving.lobe_sizes import narrowest_semi_axes_mm, semi_axes_of_elements_mm
from fecontact.solving.placing import roll_of_case
from fecontact.solving.solve import CaseResult

# --- What a result says, told once: the record of a case, which is its `result.json`, and the row of it in tables.

Row: TypeAlias = Record

RESULT_SCHEMA = "fecontact/result/6"
ROW_SCHEMA = "fecontact/row/3"
FOUND_INPUTS = ("roll_mrad",)
"""What a record of a case has beside its inputs: the roll as it stands, found or given."""
_PACKAGES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio", "pyvista", "vtk", "pypardiso", "pyamg", "matplotlib")
# Columns that a row leaves out: what stands there for each measure or mesh, what says how something was found, and of
# most rungs and steps all but the measures that a table shows.
_LEFT_OUT = (
    *("*_each_*", "*_unknown", "*_limits_*", "*_notes", "*_overlapping", "*_solutions", "*_centre_mm", "*_patches"),
    *("*_A_per_mm", "*_B_per_mm", "*_orientation_rad", "uncertainty_of_profile*", "hertz*_verdict_cause", "lobes"),
    *("elements_hertz_deviation_*", "elements_hertz_uncertainty_*", "elements_hertz_verdict_[!am]*"),
    *("half_space_quadratic_[!p]*", "steps_hertz_to_*", "steps_elements_to_*", "status", "slide_mm"),
    *(f"steps_*_{name}*" for name in ("a_", "b_", "extent", "centre", "valley", "sep", "misp")),
    *("solver_elements_*", "solver_node*", "solver_zone*", "solver_[cp]*", "von_mises_*_[xy]_mm"),
    *("solver_force_balance", "solver_moment_balance"),
    *("plastic_range", "plastic_path", "plastic_bodies_*_[xy]_mm", "*verdict_lines_*"),
    *("elastic_verdict", "elastic_verdict_warnings"),
)
_OF_CHEAP_THEORIES = (
    *("status", "verdict_answer", "verdict_measure", "limit_used"),
    *("p_max_MPa", "deviation_p_max_percent", "deviation_area_percent"),
)


def case_inputs(case: Case, placement: Placement | None = None) -> Record:
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
        "case": case_inputs(result.case, result.placement),
        **own_profiles_record(result.case, result.placement),
        **touch_records(result.placement),
        **load,
        "von_mises": told(result.von_mises),
        "solver": {**told(result.effort), **load["solver"]},
        "warnings": list(result.notes),
        "versions": versions(),
    }


def load_record(load: JudgedLoad) -> Record:
    """What a judged load says, of a case and of a cell of a map alike."""
    comparison, patch = load.comparison, load.comparison.patch
    contacts: Record = {name: told(measures) for name, measures in load.ladder.rungs.items()}
    contacts["fe"] |= picked(patch, "centre_x_mm centre_y_mm pieces lobes")
    if (band := load.judgements[HERTZ].band(comparison.fe.p_max_MPa)) is not None:
        # over the lines that measured points allow, with what meshes leave open
        contacts["fe"] |= dict(zip(("p_max_low_MPa", "p_max_high_MPa"), band, strict=True))
    contacts["elements"] |= {
        # relative, of its own measures
        "uncertainty": load.elements_uncertainty,
        "misfit": load.level.misfit,
        # relative; None where there are too few elements to see it
        "compliance_error": None if math.isnan(load.level.compliance_error) else load.level.compliance_error,
        HERTZ: picked(load.by_elements, "deviation uncertainty verdict"),
    }
    theories = {name: judgement_record(one) for name, one in load.judgements.items()}
    theories |= {name: {"problem": problem} for name, problem in load.without.items()}
    plastic = contacts.pop(PLASTIC.end, None)
    return {
        "status": load.status,
        **_verdict_records(load),
        **cheapest_columns("cheapest_theory", cheapest_of(load)),
        "normal_force_N": load.normal_force_N,
        # separate patches of the half-space are read one by one as a theory, and together as a rung
        **{name: one for name, one in contacts.items() if not _has(theories.get(name, {}), one)},
        "theories": {name: theories[name] for name in THEORIES if name in theories},
        "steps": load.ladder.steps,
        "steps_uncertainty": {BODIES.name: load.bodies_step_uncertainty}
        | ({} if load.plastic is None else {PLASTIC.name: load.plastic.step_uncertainty}),
        # the part of the uncertainty that is the measured profile's, and no mesh takes away; None of exact lines
        "uncertainty_of_profile": None if load.solved.lines is None else _of_profile(load.deciding),
        **picked(comparison, "pressure_l2 overlap"),
        "geometry": told(load.geometry),
        "slide_mm": load.level.slide_mm,
        # a single lobe is the whole contact
        "lobes": [lobe_record(one) for one in load.lobes] if len(load.lobes) > 1 else [],
        **({} if load.plastic is None or plastic is None else {"plastic": plastic | _plastic_record(load.plastic)}),
        **{
            name: telling.record(load.features[name])
            for name, telling in offered("TELLINGS").items()
            if name in load.features
        },
        "solver": _solver_record(load),
    }


def _verdict_records(load: JudgedLoad) -> Record:
    """The verdict that was asked for, and beside it the verdict against elastic bodies; None without a yield stress."""
    more = {"limits": dict(load.case.criteria.limits), "warnings": list(load.warnings)}
    of_elastic = load.elastic_verdict or load.verdict
    # with whose curvature, where the touch point lies at a junction
    used = {"limit_used": load.limit_used, "side": load.deciding_side}
    elastic = {**told(of_elastic), **_share(of_elastic), **used, **more}
    if load.plastic is None:
        return {"verdict": elastic, "elastic_verdict": None}
    used = {"limit_used": load.plastic.deciding.limit_used, "side": load.plastic.deciding_side}
    return {
        "verdict": {**told(load.verdict), **_share(load.verdict), **used, **more},
        "elastic_verdict": elastic,
    }


def _share(verdict: Verdict) -> Record:
    """On how many lines that measured points allow Hertz holds and fails; empty for exact lines."""
    answers = [*verdict.lines.values()]
    counted = {"holds_on": answers.count("HOLDS"), "fails_on": answers.count("FAILS"), "of_lines": len(answers)}
    return counted if answers else {}


def _of_profile(judged: Judgement) -> Record:
    return {name: value - judged.numerical[name] for name, value in judged.uncertainty.items()}


def measures_in(theory: Item) -> Record:
    """Measures of a theory in its record."""
    return {name: theory[name] for name in MEASURES if name in theory}


def _has(theory: Item, contact: Record) -> bool:
    """Whether a theory tells the measures of a contact, up to rounding."""
    told_there = measures_in(theory)
    return contact.keys() == told_there.keys() and all(
        math.isclose(value, told_there[name], rel_tol=1e-9) for name, value in contact.items()
    )


def judgement_record(judged: Judgement) -> Record:
    """A theory of the pressure, how far it is off, and its verdict."""
    contact = judged.approximation
    assert contact is not None
    return contact_record(contact, judged.measures) | picked(judged, "deviation uncertainty verdict limit_used")


def contact_record(contact: Approximation, measures: Measures) -> Record:
    """What a theory of the pressure says of a contact; of several patches each by itself."""
    single = contact.single
    return {
        **told(measures),
        **picked(contact, "centre_mm overlapping status notes solutions"),
        **(_axes(single.hertz) if single and single.hertz else {}),
        "patches": [] if single else [_patch_record(one) for one in contact.patches],
    }


def _patch_record(patch: TheoryPatch) -> Record:
    """A patch of several, under its own force along its own normal."""
    where = picked(patch, "centre_mm")
    if (touch := patch.touch) is not None:
        where |= {"touch_point": patch.touch_point, **picked(touch, "rail_y_mm contact_angle_rad")}
    own = ellipse_record(patch.hertz) if patch.hertz else picked(patch, "normal_force_N p_max_MPa area_mm2 a_mm b_mm")
    return where | own


def ellipse_record(hertz: HertzContact) -> Record:
    """An ellipse with its force."""
    return {"normal_force_N": hertz.normal_force_N, **told(hertz_measures(hertz)), **_axes(hertz)}


def _axes(hertz: HertzContact) -> Record:
    return picked(hertz, "orientation_rad A_per_mm B_per_mm stiffness_GN_per_m15")


def lobe_record(one: LobeJudgement) -> Record:
    """A separate patch, or a lobe of one, with Hertz's ellipse under its own force at the nearest touch point."""
    return {
        **picked(one, "normal_force_N contact_angle_rad rail_y_mm centre_mm separate touch_point fe fe_uncertainty"),
        "half_space": told(one.rungs.get("half_space")),
        "hertz": None if one.hertz is None else told(hertz_measures(one.hertz)) | _axes(one.hertz),
        **picked(one, "deviation uncertainty verdict p_max_lines_MPa"),
    }


def _plastic_record(found: PlasticVerdict) -> Record:
    """What yielding does to a contact; lengths in mm, loads in N."""
    return {
        "status": found.status,
        "range": NOT_IN_IT,
        **picked(found.yielded, "first_yield_N first_body imprint_mm"),
        **picked(found, "first_yield_uncertainty plastic_load_N plastic_measure"),
        **{
            f"step_with_yield_stress_15_percent_{which}": {name: band[at] for name, band in found.band.items()}
            for at, which in enumerate(("lower", "higher"))
        },
        "bodies": told(found.yielded.bodies),
        "path": told(found.yielded.path),
        HERTZ: picked(found.deciding, "deviation uncertainty verdict limit_used")
        | picked(found, "cancelling")
        # with whose curvature, where the touch point lies at a junction
        | ({"side": found.deciding_side} if len(found.judgements) > 1 else {}),
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
        **picked(level, "force_balance moment_balance degrees_of_freedom elements"),
        "element_size_mm": dict(zip("xy", nodal.grid.steps_mm, strict=True)),
        "node_spacing_mm": dict(zip("xy", load.fe.grid.steps_mm, strict=True)),
        "meshes": len(load.solved.levels),
        # of the lobe that elements are made for, and of the narrowest one that is not small
        "elements_a_semi_axis": _elements(load, semi_axes_of_elements_mm(half_space)),
        "elements_a_semi_axis_of_narrowest_lobe": _elements(load, narrowest_semi_axes_mm(half_space)),
        # to expect of the next finer mesh
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
    """Hertz's theory alone at a case's position, each ellipse with the whole load."""
    return {
        "schema": "fecontact/hertz/2",
        "case": case_inputs(found.case, found.placement),
        **own_profiles_record(found.case, found.placement),
        "normal_force_N": found.hertz.normal_force_N,
        **touch_records(found.placement),
        "ellipses": [
            picked(p, "touch_point side") | ({"problem": p.problem} if p.whole is None else ellipse_record(p.whole))
            for p in found.points.points
        ],
        "springs": {
            "approach_mm": found.points.shared_approach_mm,
            "overlapping": found.points.overlapping,
            "patches": [
                {"touch_point": p.touch_point, **ellipse_record(p.shared)}
                for p in found.points.points
                if p.shared is not None
            ],
        },
        "uncertainty_of_profile": found.uncertainty_of_profile,
        "notes": list(found.points.notes),
        "warnings": list(found.placement.notes),
        "versions": versions(),
    }


@runtime_checkable
class Rowed(Protocol):
    """Results that tell themselves in rows, such as a map."""

    def rows(self) -> list[Row]:
        """Flat dictionaries with units in their keys."""


def rows(results: CaseResult | Rowed | Iterable[CaseResult]) -> list[Row]:
    """Results as flat dictionaries with units in their keys, one a case or a cell, as `pandas.DataFrame` takes them."""
    return results.rows() if isinstance(results, Rowed) else [case_row(result) for result in results]


def case_row(result: CaseResult) -> Row:
    """A result as a flat row: its load, and what is known of its bodies and of the work."""
    return load_row(result.load, result.placement) | {
        **_of_row(flat({"von_mises": told(result.von_mises)})),
        "seconds": sum(result.effort.seconds.values()),
        "peak_memory_MB": result.effort.peak_memory_MB,
        "warnings": "; ".join(result.notes),
    }


def load_row(load: JudgedLoad, placement: Placement) -> Row:
    """A judged load as a flat row: its inputs and place, and the columns of its record; theories by their own names."""
    first, record = placement.first, load_record(load)
    columns = flat({**record, "theories": {}, **record["theories"]})
    return {
        "status": load.status,
        **input_columns(load.case, placement),
        "resolution": load.case.resolution if isinstance(load.case.resolution, str) else None,
        "contact_angle_mrad": 1e3 * first.contact_angle_rad,
        **picked(first, "rail_y_mm wheel_y_mm", "touch_"),
        "at_junction": first.at_junction,
        "touch_points": len(placement.touch_points),
        **_of_row(columns),
    }


def _of_row(columns: Record) -> Row:
    return {name: value for name, value in columns.items() if _in_row(name)}


@cache
def _in_row(column: str) -> bool:
    of_hertz = column.startswith((f"{HERTZ}_", "half_space_quadratic_"))
    theory = next((name for name in THEORIES if column.startswith(f"{name}_")), None)
    if theory is not None and not of_hertz:
        return column.removeprefix(f"{theory}_") in _OF_CHEAP_THEORIES
    of_features = (pattern for telling in offered("TELLINGS").values() for pattern in telling.left_out)
    return not any(fnmatchcase(column, pattern) for pattern in (*_LEFT_OUT, *of_features))


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
    lines = {"rail_irregularity": case.rail_irregularity, "wheel_irregularity": case.wheel_irregularity}
    return {
        "distance_mm": case.distance_mm,
        **{name: None if line is None else irregularity_text(line) for name, line in lines.items()},
        "lowered_mm": None if along is None else along.lowered_mm,
    }


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
