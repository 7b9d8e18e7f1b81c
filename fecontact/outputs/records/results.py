"""Records and rows of results: plain dictionaries with units in their keys, for JSON and CSV files.

Each contact occurs once in a record: the finite elements as `fe`, each other rung and theory by its name, with its
measures. A theory also has its deviation, its uncertainty and its verdict by the criteria. All contacts carry the
`normal_force_N` of the record, except lobes and the patches of a theory, which each have a force along their own
normal. A number that is added here is in the record and in the row, and so in all tables and comparisons.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol, TypeAlias, runtime_checkable

from fecontact import __version__
from fecontact.case import Case, make_case_record
from fecontact.contact_theories.approximation import TheoryContact, TheoryPatch
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.files import read_json, write_json
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.ladder import BODIES_STEP, PLASTIC_STEP
from fecontact.judging.lobes import LobeJudgement
from fecontact.judging.measures import Measures, read_hertz_measures
from fecontact.judging.verdict import PLASTIC_VALIDITY, Judgement, PlasticVerdict, Verdict
from fecontact.outputs.flat_records import Record, flatten, select_attributes, to_plain
from fecontact.outputs.geometry import contact_point_records
from fecontact.outputs.pair_geometry import pair_geometry_record
from fecontact.outputs.records.cheapest import cheapest_columns, find_cheapest_of_load
from fecontact.outputs.records.result_schema import complete_record, list_columns, undeclared_features
from fecontact.outputs.theory_records import has_measures, judged_theories
from fecontact.placement.irregularity import format_irregularity
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.library import profile_identity
from fecontact.solving.hertz_alone import HertzEvaluation
from fecontact.solving.lobe_sizes import measure_element_semi_axes_mm, measure_narrowest_semi_axes_mm
from fecontact.solving.placing import compute_roll
from fecontact.solving.solve import CaseResult

# --- The record of a case, which is its `result.json`, and its row in tables. Each number is defined once.

Row: TypeAlias = Record

RESULT_SCHEMA = "fecontact/result/7"
ROW_SCHEMA = "fecontact/row/3"
DERIVED_INPUTS = ("roll_mrad",)
"""Entries of the record of a case that are not inputs: the actual roll, which is found or given."""
_PACKAGES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio", "pyvista", "vtk", "pypardiso", "pyamg", "matplotlib")


def case_inputs(case: Case, placement: Placement | None = None) -> Record:
    """Inputs of a case for results.

    A profile from a file has its name and a hash of its content, without a folder.

    Parameters
    ----------
    case
        Inputs of the case.
    placement
        Placement of the case. If it is given, the record also has the entries of `DERIVED_INPUTS`.

    Returns
    -------
    Record
        Inputs by name.
    """
    inputs = make_case_record(
        case.with_profiles({body: profile_identity(spec) for body, spec in case.profiles.items()})
    )
    return inputs if placement is None else inputs | {"roll_mrad": 1e3 * compute_roll(case, placement)}


def result_record(result: CaseResult) -> Record:
    """Record of a solved case, without its fields.

    Parameters
    ----------
    result
        Result of a case.

    Returns
    -------
    Record
        Content of `result.json`. Infinite radii are None.
    """
    load = load_record(result.load)
    return {
        "schema": RESULT_SCHEMA,
        "case": case_inputs(result.case, result.placement),
        **pair_geometry_record(result.case, result.placement),
        **contact_point_records(result.placement),
        **load,
        "von_mises": to_plain(result.von_mises),
        "solver": {**to_plain(result.effort), **load["solver"]},
        "warnings": list(result.notes),
        "versions": package_versions(),
    }


def load_record(load: JudgedLoad) -> Record:
    """Record of a judged load, for a case and for a cell of a map.

    Parameters
    ----------
    load
        Judged load.

    Returns
    -------
    Record
        Verdicts, contacts of all rungs, theories, ladder steps, lobes and solver.
    """
    comparison, patch = load.comparison, load.comparison.patch
    contacts: Record = {name: to_plain(measures) for name, measures in load.ladder.rungs.items()}
    # over the profile variants that fit the measured points, with the uncertainty of the meshes
    band = load.judgements[HERTZ].band(comparison.fe.p_max_MPa) or (None, None)
    contacts["fe"] |= select_attributes(patch, "centre_x_mm centre_y_mm patch_count lobes") | dict(
        zip(("p_max_low_MPa", "p_max_high_MPa"), band, strict=True)
    )
    contacts["elements"] |= {
        # relative to its own measures
        "uncertainty": load.elements_uncertainty,
        "misfit": load.level.misfit,
        # relative; None if there are too few elements to measure it
        "compliance_error": None if math.isnan(load.level.compliance_error) else load.level.compliance_error,
        HERTZ: select_attributes(load.by_elements, "deviation uncertainty verdict"),
    }
    contacts = {name: {**contact, **load.ladder.own_values.get(name, {})} for name, contact in contacts.items()}
    theories = {
        **{name: judgement_record(judgement) for name, judgement in load.judgements.items()},
        **{name: {"problem": problem} for name, problem in load.without.items()},
    }
    plastic = contacts.get(PLASTIC_STEP.end)
    return {
        "status": load.status,
        **_verdict_records(load),
        **cheapest_columns("cheapest_theory", find_cheapest_of_load(load)),
        "normal_force_N": load.normal_force_N,
        **{name: contacts[name] for name in ("half_space_quadratic", "elements", "fe")},
        # the theory reads separate patches of the half-space one at a time, the rung reads them together
        "half_space": None
        if has_measures(theories.get("half_space", {}), to_plain(load.ladder.rungs["half_space"]))
        else contacts["half_space"],
        "theories": {
            name: complete_record("theory", theories[name]) if name in theories else None for name in THEORIES
        },
        "steps": complete_record("steps", load.ladder.steps),
        "steps_uncertainty": {
            BODIES_STEP.name: load.bodies_step_uncertainty,
            PLASTIC_STEP.name: None if load.plastic is None else load.plastic.step_uncertainty,
        },
        # contribution of the measured profiles to the uncertainty, which no mesh removes; None for exact profiles
        "uncertainty_of_profile": None if load.solved.lines is None else _profile_uncertainty(load.deciding),
        # contributions to the uncertainties of the requested verdict
        "uncertainty_budget": {
            name: budget.contributions for name, budget in (load.plastic or load).deciding.budgets.items()
        },
        "own_criteria": own_criteria_records(load),
        **select_attributes(comparison, "pressure_l2 overlap"),
        "geometry": to_plain(load.geometry),
        "slide_mm": load.level.slide_mm,
        "lobes": lobe_records(load),
        "plastic": None if load.plastic is None or plastic is None else plastic | _plastic_record(load.plastic),
        **{
            name: telling.record(load.features[name]) if name in load.features else None
            for name, telling in load_offers("TELLINGS").items()
        },
        "solver": _solver_record(load),
    }


def own_criteria_records(load: JudgedLoad) -> list[Record]:
    """Records of the criteria of a user, with the numbers of the requested verdict.

    Parameters
    ----------
    load
        Judged load.

    Returns
    -------
    list of Record
        A record for each criterion; numbers are None if its function was not available.
    """
    deciding, rung = (load.plastic or load).deciding, "fe" if load.plastic is None else PLASTIC_STEP.end
    values = load.ladder.own_values.get(rung, {})
    return [
        {
            "measure": criterion.key,
            **criterion.record,
            "fe": values.get(criterion.key),
            HERTZ: deciding.own_values.get(criterion.key),
            "deviation": deciding.deviation.get(criterion.key),
            "uncertainty": deciding.uncertainty.get(criterion.key),
            "answer": deciding.verdict.each[criterion.key],
            "stored": criterion.key in load.stored_own,
        }
        for criterion in load.case.criteria.own or ()
    ]


def _verdict_records(load: JudgedLoad) -> Record:
    """Requested verdict and verdict against elastic bodies.

    The second is None without a yield stress.
    """
    common_entries = {"limits": dict(load.case.criteria.limits), "warnings": list(load.warnings)}

    def verdict_record(verdict: Verdict, decider: JudgedLoad | PlasticVerdict) -> Record:
        """A verdict; at a junction the side is the side of the deciding curvature."""
        deciding = {"limit_utilisation": decider.deciding.limit_utilisation, "side": decider.deciding_side}
        return {**to_plain(verdict), **_count_variants(verdict), **deciding, **common_entries}

    elastic = verdict_record(load.deciding.verdict, load)
    if load.plastic is None:
        return {"verdict": elastic, "elastic_verdict": None}
    return {"verdict": verdict_record(load.verdict, load.plastic), "elastic_verdict": elastic}


def _count_variants(verdict: Verdict) -> Record:
    """Numbers of profile variants on which Hertz holds and fails; None for exact profiles."""
    answers = [*verdict.variant_answers.values()]
    counts = {
        "variants_holding": answers.count("HOLDS"),
        "variants_failing": answers.count("FAILS"),
        "variant_count": len(answers),
    }
    return counts if answers else dict.fromkeys(counts)


def _profile_uncertainty(judgement: Judgement) -> Record:
    return {name: value - judgement.numerical[name] for name, value in judgement.uncertainty.items()}


def judgement_record(judgement: Judgement) -> Record:
    """Record of a judged theory: contact, deviations, uncertainties and verdict.

    Parameters
    ----------
    judgement
        Judgement of a theory with a contact.

    Returns
    -------
    Record
        Record of the contact, with the relative deviations and uncertainties, the verdict and the limit utilisation.
    """
    contact = judgement.approximation
    assert contact is not None
    return (
        contact_record(contact, judgement.measures)
        | select_attributes(judgement, "deviation uncertainty verdict limit_utilisation")
        | dict(judgement.own_values)
    )


def contact_record(contact: TheoryContact, measures: Measures) -> Record:
    """Record of the contact of a theory.

    Parameters
    ----------
    contact
        Contact by a theory of the pressure.
    measures
        Measures of the complete contact.

    Returns
    -------
    Record
        Measures, status and notes. If there are several patches, each has an entry in `patches`.
    """
    single = contact.single
    return {
        **to_plain(measures),
        **select_attributes(contact, "centre_mm overlapping status notes solutions"),
        **(_ellipse_shape(single.hertz) if single and single.hertz else {}),
        "patches": [] if single else [_patch_record(theory_patch) for theory_patch in contact.patches],
    }


def _patch_record(patch: TheoryPatch) -> Record:
    """Record of a patch of several.

    Its force is along the normal of the patch.
    """
    place_entries = select_attributes(patch, "centre_mm")
    if (touch := patch.touch) is not None:
        place_entries |= {
            "contact_point_number": patch.contact_point_number,
            **select_attributes(touch, "rail_y_mm contact_angle_rad"),
        }
    sizes = (
        ellipse_record(patch.hertz)
        if patch.hertz
        else select_attributes(patch, "normal_force_N p_max_MPa area_mm2 a_mm b_mm")
    )
    return complete_record("theory_patch", place_entries | sizes)


def ellipse_record(hertz: HertzContact) -> Record:
    """Record of an ellipse with its force."""
    return {"normal_force_N": hertz.normal_force_N, **to_plain(read_hertz_measures(hertz)), **_ellipse_shape(hertz)}


def _ellipse_shape(hertz: HertzContact) -> Record:
    return select_attributes(hertz, "orientation_rad A_per_mm B_per_mm stiffness_GN_per_m15")


def lobe_records(load: JudgedLoad) -> list[Record]:
    """Records of all lobes and separate patches of a load; empty for a single lobe, which is the complete contact."""
    return [lobe_record(lobe) for lobe in load.lobes] if len(load.lobes) > 1 else []


def lobe_record(lobe: LobeJudgement) -> Record:
    """Record of a separate patch, or of a lobe within a patch.

    Parameters
    ----------
    lobe
        Judgement of the lobe.

    Returns
    -------
    Record
        Force, place and measures of the lobe, and Hertz's ellipse under the force of the lobe at the nearest touch
        point.
    """
    return {
        **select_attributes(
            lobe, "normal_force_N contact_angle_rad rail_y_mm centre_mm separate contact_point_number fe fe_uncertainty"
        ),
        "half_space": to_plain(lobe.rungs.get("half_space")),
        "hertz": None if lobe.hertz is None else to_plain(read_hertz_measures(lobe.hertz)) | _ellipse_shape(lobe.hertz),
        **select_attributes(lobe, "deviation uncertainty verdict p_max_variants_MPa"),
    }


def _plastic_record(plastic_verdict: PlasticVerdict) -> Record:
    """Effects of yielding on a contact; lengths in mm, loads in N."""
    return {
        "status": plastic_verdict.status,
        "range": PLASTIC_VALIDITY,
        **select_attributes(plastic_verdict.yielded, "first_yield_N first_body imprint_mm"),
        **select_attributes(plastic_verdict, "first_yield_uncertainty plastic_load_N plastic_measure"),
        **{
            f"step_with_yield_stress_15_percent_{band_side}": {
                name: band[band_index] for name, band in plastic_verdict.band.items()
            }
            # the effect of the yield stress is solved on the coarser meshes, which may not yield
            or None
            for band_index, band_side in enumerate(("lower", "higher"))
        },
        "bodies": to_plain(plastic_verdict.yielded.bodies),
        "path": to_plain(plastic_verdict.yielded.path),
        HERTZ: select_attributes(plastic_verdict.deciding, "deviation uncertainty verdict limit_utilisation")
        | select_attributes(plastic_verdict, "cancelling"),
    }


def _elements_per_semi_axis(load: JudgedLoad, semi_axes_mm: tuple[float, float]) -> list[float]:
    """Elements per semi-axis for each mesh, the finest mesh first.

    The semi-axes are along x and across. The direction with fewer elements counts.
    """
    return [
        min(length / step for length, step in zip(semi_axes_mm, level.nodal.grid.steps_mm, strict=True))
        for level in load.solved.levels
    ]


def _solver_record(load: JudgedLoad) -> Record:
    """Record of the solver: iterations, residuals, balances, meshes and element sizes."""
    level, nodal, half_space = load.level, load.level.nodal, load.solved.half_space
    return {
        **select_attributes(nodal, "iterations compliance_calls contact_residual penetration_residual"),
        "load_balance": load.fe.load_balance,
        **select_attributes(level, "force_balance moment_balance degrees_of_freedom elements"),
        "element_size_mm": dict(zip("xy", nodal.grid.steps_mm, strict=True)),
        "node_spacing_mm": dict(zip("xy", load.fe.grid.steps_mm, strict=True)),
        "meshes": len(load.solved.levels),
        # for the lobe that the element size is made for, and for the narrowest lobe that is not small
        "elements_per_semi_axis": _elements_per_semi_axis(load, measure_element_semi_axes_mm(half_space)),
        "elements_per_semi_axis_of_narrowest_lobe": _elements_per_semi_axis(
            load, measure_narrowest_semi_axes_mm(half_space)
        ),
        # expected for the next finer mesh
        "zone_enlarged": level.enlarged,
    }


@cache
def package_versions() -> dict[str, str | None]:
    """Versions of this package, of Python and of the packages that affect the numbers.

    Returns
    -------
    dict
        Version by package; None for a package that is not installed.
    """
    versions_by_package: dict[str, str | None] = {
        "fecontact": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
    for package in _PACKAGES:
        try:
            versions_by_package[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            versions_by_package[package] = None
    return versions_by_package


def hertz_record(hertz_alone: HertzEvaluation) -> Record:
    """Record of Hertz's theory alone at the position of a case.

    Parameters
    ----------
    hertz_alone
        Ellipses at all contact points.

    Returns
    -------
    Record
        Content of the JSON output. Each entry of `ellipses` carries the complete load; `springs` has the ellipses that
        share the load.
    """
    return {
        "schema": "fecontact/hertz/2",
        "case": case_inputs(hertz_alone.case, hertz_alone.placement),
        **pair_geometry_record(hertz_alone.case, hertz_alone.placement),
        "normal_force_N": hertz_alone.hertz.normal_force_N,
        **contact_point_records(hertz_alone.placement),
        "ellipses": [
            select_attributes(point, "contact_point_number side")
            | ({"problem": point.problem} if point.whole is None else ellipse_record(point.whole))
            for point in hertz_alone.points.points
        ],
        "springs": {
            "approach_mm": hertz_alone.points.shared_approach_mm,
            "overlapping": hertz_alone.points.overlapping,
            "patches": [
                {"contact_point_number": point.contact_point_number, **ellipse_record(point.shared)}
                for point in hertz_alone.points.points
                if point.shared is not None
            ],
        },
        "uncertainty_of_profile": hertz_alone.uncertainty_of_profile,
        "notes": list(hertz_alone.points.notes),
        "warnings": list(hertz_alone.placement.notes),
        "versions": package_versions(),
    }


@runtime_checkable
class HasRows(Protocol):
    """Results with a method that gives their rows, such as a map."""

    def rows(self) -> list[Row]:
        """Flat dictionaries with units in their keys."""


def rows(results: CaseResult | HasRows | Iterable[CaseResult]) -> list[Row]:
    """Flat dictionaries of results, for `pandas.DataFrame`.

    Parameters
    ----------
    results
        One case, several cases, or results with a method `rows`.

    Returns
    -------
    list of Row
        One row per case or cell, with units in the keys.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> row = fecontact.rows(result)[0]
    >>> row["status"], row["load_kN"], row["verdict_answer"]
    ('converged', 100.0, 'HOLDS')
    """
    return results.rows() if isinstance(results, HasRows) else [case_row(result) for result in results]


def case_row(result: CaseResult) -> Row:
    """Row of a result: its load, the stresses of its bodies, and the effort.

    Parameters
    ----------
    result
        Result of a case.

    Returns
    -------
    Row
        Flat row.
    """
    return load_row(result.load, result.placement) | {
        **_select_columns("of_case", flatten({"von_mises": to_plain(result.von_mises)})),
        "seconds": sum(result.effort.seconds.values()),
        "cpu_seconds": result.effort.cpu_seconds,
        "peak_memory_MB": result.effort.peak_memory_MB,
        "warnings": "; ".join(result.notes),
    }


def load_row(load: JudgedLoad, placement: Placement) -> Row:
    """Row of a judged load: inputs, place and the columns of its record.

    Parameters
    ----------
    load
        Judged load.
    placement
        Placement of the load.

    Returns
    -------
    Row
        Flat row. The columns of each theory begin with the name of the theory.
    """
    first, record = placement.first, load_record(load)
    columns = flatten({**record, "theories": {}, **judged_theories(record)})
    return {
        "status": load.status,
        **input_columns(load.case, placement),
        "resolution": load.case.resolution if isinstance(load.case.resolution, str) else None,
        "contact_angle_mrad": 1e3 * first.contact_angle_rad,
        **select_attributes(first, "rail_y_mm wheel_y_mm", "contact_"),
        "at_junction": first.at_junction,
        "contact_points": len(placement.contact_points),
        **_select_columns("of_load", columns, tuple(load.case.criteria.own_measures)),
    }


def _select_columns(group: str, columns: Record, own_measures: tuple[str, ...] = ()) -> Row:
    """Declared columns of a flat record in the declared order, then columns of features without declarations."""
    prefixes = tuple(f"{feature}_" for feature in undeclared_features())
    return {name: columns[name] for name in list_columns(group, own_measures) if name in columns} | {
        name: value for name, value in columns.items() if name.startswith(prefixes)
    }


def input_columns(case: Case, placement: Placement | None = None) -> Row:
    """Inputs of a case for a row.

    Parameters
    ----------
    case
        Inputs of the case.
    placement
        Placement of the case. A roll that is found from both wheels is None without it.

    Returns
    -------
    Row
        Inputs by column. Only rows of wheelsets and of right wheels have the side.
    """
    roll = case.roll_rad if placement is None else compute_roll(case, placement)
    row: Row = {
        "rail": profile_identity(case.rail),
        "wheel": profile_identity(case.wheel),
        "lateral_shift_mm": case.lateral_shift_mm,
        "load_kN": case.load_N / 1e3,
        **select_attributes(case, "load_kind inclination_rad"),
        "roll_mrad": None if case.roll != "given" and placement is None else 1e3 * roll,
        "yaw_mrad": 1e3 * case.yaw_rad,
    }
    wheelset_columns: Row = {"side": case.side, "roll": case.roll}
    for name, load_N in (("roll_load_kN", case.roll_load_N), ("opposite_load_kN", case.opposite.wheel_load_N)):
        if load_N is not None:
            wheelset_columns[name] = load_N / 1e3
    if case.roll != "given" or case.side != "left":
        row |= wheelset_columns
    return row | _irregular_columns(case, placement) if case.irregularities else row


def _irregular_columns(case: Case, placement: Placement | None) -> Row:
    """Irregularities of rail and wheel, the distance along the track, and the lowering.

    The lowering is the distance (mm) by which the rigid wheel stands lower there.
    """
    along = None if placement is None else placement.along
    irregularities = {"rail_irregularity": case.rail_irregularity, "wheel_irregularity": case.wheel_irregularity}
    return {
        "distance_mm": case.distance_mm,
        **{
            name: None if irregularity is None else format_irregularity(irregularity)
            for name, irregularity in irregularities.items()
        },
        "lowered_mm": None if along is None else along.lowered_mm,
    }


def write_row(path: Path, row: Row, settings: Mapping[str, Any] | None = None) -> Path:
    """Write a row with the versions of the packages that made it.

    Numbers that JSON does not have are written as texts.

    Parameters
    ----------
    path
        File to write.
    row
        Flat row.
    settings
        Further entries of the file, for comparisons.

    Returns
    -------
    Path
        The written file.
    """
    json_row = {key: repr(value) if _is_not_finite(value) else value for key, value in row.items()}
    document = {"schema": ROW_SCHEMA, **(settings or {}), "row": json_row, "versions": package_versions()}
    return write_json(path, document)


def read_row(path: Path) -> Row:
    """Read a row exactly as it was before it was written.

    Parameters
    ----------
    path
        File that was written by `write_row`.

    Returns
    -------
    Row
        The row.

    Raises
    ------
    InputError
        If the file is not a row of this layout.
    """
    document = read_json(path)
    if not isinstance(document, Mapping) or document.get("schema") != ROW_SCHEMA:
        raise InputError(f"{path}: not a row of schema {ROW_SCHEMA}; solve the case again")
    row = document.get("row")
    plain_types = (str, int, float, bool, type(None))
    if not isinstance(row, Mapping) or not all(isinstance(value, plain_types) for value in row.values()):
        raise InputError(f"{path}: not a row; solve the case again")
    return {
        key: _NON_FINITE_NUMBERS.get(value, value) if isinstance(value, str) else value for key, value in row.items()
    }


_NON_FINITE_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def _is_not_finite(value: object) -> bool:
    return isinstance(value, float) and not math.isfinite(value)
