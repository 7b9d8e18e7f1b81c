"""Records and table rows of a map, from values: nothing is evaluated here."""

from __future__ import annotations

from collections.abc import Mapping

from fecontact.contact_theories.approximation import TheoryPatch
from fecontact.contact_theories.registry import ELLIPSE_THEORIES, HERTZ, MULTI_HERTZ, THEORIES
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import read_theory_measures
from fecontact.judging.readings import LawReadingView
from fecontact.judging.verdict import Judgement, TheoryAnswer, find_cheapest_theory, list_theory_answers
from fecontact.maps.measure_views import list_verdict_measures
from fecontact.maps.model import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.alone import SIZE_MEASURES, contact_point_columns, ellipse_columns
from fecontact.outputs.case_words import roll_words
from fecontact.outputs.flat_records import Record, flatten, select_attributes
from fecontact.outputs.records.cheapest import (
    cheapest_columns,
    find_cheapest_of_load,
    judgements_by_theory,
    judgements_of_other_theories,
)
from fecontact.outputs.records.results import case_inputs, load_record, package_versions
from fecontact.outputs.verdict_words import theory_words
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.placing import compute_roll

MAP_SCHEMA = "fecontact/map/6"


def build_stiffness_rows(position: MapPosition) -> list[Record]:
    """Rows of contact stiffness at each load of a position.

    The stiffness is from the fit over all loads.

    Parameters
    ----------
    position
        Position of a map.

    Returns
    -------
    list of Record
        A row for each usable load; empty without a fit.
    """
    fit = position.stiffness
    if fit is None:
        return []
    rows = []
    for point in (cell.usable for cell in position.cells if cell.usable):
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


def build_map_record(applicability_map: ApplicabilityMap, provenance: Record | None = None) -> Record:
    """Record of a whole map with its base case, criteria, versions and provenance.

    Parameters
    ----------
    applicability_map
        Map.
    provenance
        Origin of the results.

    Returns
    -------
    Record
        Content of the JSON file of the map.
    """
    feature_limits = {
        f"{name}_limits": [
            build_limit_record(position.lateral_shift_mm, position.limits_of.get(name, position.limit))
            for position in applicability_map.positions
        ]
        for name, verdicts in list_verdict_measures(applicability_map.case).items()
        if verdicts.criterion(applicability_map.case) is not None
    }
    # Loads of first yield, and loads at which yielding reaches a limit.
    yield_records = [
        {"lateral_shift_mm": position.lateral_shift_mm, **position.yield_loads_N}
        for position in applicability_map.positions
    ]
    return {
        "schema": MAP_SCHEMA,
        # Shift and load belong to the map, not to its base case.
        "case": {
            key: value
            for key, value in case_inputs(applicability_map.case).items()
            if key not in ("lateral_shift_mm", "load_N")
        },
        "roll": roll_words(applicability_map.case),
        "criteria": applicability_map.case.criteria.record,
        **select_attributes(applicability_map, "lateral_shifts_mm loads_N"),
        "cells": [build_cell_record(cell) for cell in applicability_map.cells],
        "limits": [
            build_limit_record(position.lateral_shift_mm, position.limit) for position in applicability_map.positions
        ],
        **feature_limits,
        **(
            {"yield_loads_N": yield_records}
            if any(position.yield_loads_N for position in applicability_map.positions)
            else {}
        ),
        "theory_shares": count_theory_shares(applicability_map),
        "stiffness": [row for position in applicability_map.positions for row in build_stiffness_rows(position)],
        "versions": package_versions(),
        "provenance": provenance or {},
    }


def build_cell_record(cell: MapCell) -> Record:
    """Record of a cell, with all results of its load.

    Parameters
    ----------
    cell
        Cell of a map.

    Returns
    -------
    Record
        Shift, load, status and the results of a solved load.
    """
    return {
        **select_attributes(cell, "lateral_shift_mm load_N status"),
        **({} if cell.judged is None else load_record(cell.judged)),
    }


def build_limit_record(shift_mm: float, limit: LoadLimit) -> Record:
    """Record of a load limit at a position.

    Parameters
    ----------
    shift_mm
        Lateral shift in mm.
    limit
        Load limit.

    Returns
    -------
    Record
        Shift, largest load, intervals, reason, note and the loads of the search.
    """
    return {
        "lateral_shift_mm": shift_mm,
        **select_attributes(limit, "F_max_N intervals reason note"),
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


def build_law_row(cell: MapCell, laws: LawReadingView) -> Record:
    """Row of a cell with the cheapest law that holds, and all deviations.

    Parameters
    ----------
    cell
        Cell of a map.
    laws
        Laws of a feature.

    Returns
    -------
    Record
        Shift, load and status; for a judged cell also the cheapest law and the columns of each law.
    """
    row, judgements = select_attributes(cell, "lateral_shift_mm load_kN status"), read_laws(cell, laws)
    if judgements:
        row["cheapest_theory"] = find_cheapest_theory(list_theory_answers(judgements)).label
    for name, judgement in judgements.items():
        row |= laws.columns(name, judgement)
    return row


def read_laws(cell: MapCell, laws: LawReadingView) -> Mapping[str, Judgement]:
    """Judgements of the laws of a feature in a cell; empty for an unusable cell."""
    return laws.read(cell.usable) if cell.usable else {}


# --- The judged theories of a cell or a map.


def select_judgement(load: JudgedLoad | None, theory: str) -> JudgedLoad | Judgement | None:
    """Judgement of a load by a theory.

    Parameters
    ----------
    load
        Judged load; None for an unsolved cell.
    theory
        Name of a theory of the pressure.

    Returns
    -------
    JudgedLoad, Judgement or None
        For Hertz the load itself, or its judgement against yielding bodies. For a theory that does not differ from
        Hertz, such as springs at a single contact point, the judgement of Hertz. None if the theory has no contact.
    """
    if load is None or theory in load.without:
        return None
    if theory == HERTZ and load.plastic is not None:
        return load.plastic.deciding
    return load if theory == HERTZ else load.judgements.get(theory, load)


def find_ellipse_theory(load: JudgedLoad | None) -> TheoryAnswer | None:
    """Cheapest theory of several ellipses that holds although Hertz does not hold.

    Parameters
    ----------
    load
        Judged load; None for an unsolved cell.

    Returns
    -------
    TheoryAnswer or None
        The theory; None if Hertz holds, if no theory of ellipses holds, or if the load is unusable or judged against
        yielding bodies.
    """
    if load is None or not load.usable or load.plastic is not None or load.verdict.answer == "HOLDS":
        return None
    holding_theories = (
        standing
        for standing in list_theory_answers(judgements_of_other_theories(load))
        if standing.name in ELLIPSE_THEORIES and standing.answer == "HOLDS"
    )
    theory = find_cheapest_theory(holding_theories, in_range=not load.case.criteria.theories_out_of_range)
    return theory if theory.name else None


def describe_ellipse_theories(applicability_map: ApplicabilityMap) -> str:
    """Theories of ellipses that hold in cells where Hertz does not hold, in words.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    str
        Theories joined by "or"; empty without such cells.
    """
    theories = (find_ellipse_theory(cell.judged) for cell in applicability_map.cells)
    return " or ".join(
        dict.fromkeys(theory_words(theory.name, "out of range" * theory.out_of_range) for theory in theories if theory)
    )


def count_theory_shares(applicability_map: ApplicabilityMap) -> list[Record]:
    """Numbers of cells in which each theory holds or is the cheapest.

    The theories are those of the pressure.

    The last records are the cells in which the cheapest theory is unresolved, in which no theory holds, and without a
    usable result.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    list of Record
        Counts and percentages of each theory, from the cheapest theory on.
    """
    loads = [cell.usable for cell in applicability_map.cells if cell.usable]
    judgements_by_cell, cheapest_theories = (
        [judgements_by_theory(load) for load in loads],
        [find_cheapest_of_load(load) for load in loads],
    )
    answers = [theory.label for theory in cheapest_theories] + ["failed"] * (len(applicability_map.cells) - len(loads))

    def build_count_columns(prefix: str, count: int) -> Record:
        return {f"{prefix}_cells": count, f"{prefix}_percent": 100.0 * count / len(answers) if answers else 0.0}

    records: list[Record] = []
    for name in (name for name in THEORIES if any(name in judgements for judgements in judgements_by_cell)):
        utilisations = [
            judgements[name].limit_utilisation
            for judgements, answer in zip(judgements_by_cell, answers, strict=False)
            if answer == name
        ]
        records.append(
            {
                "theory": name,
                **select_attributes(THEORIES[name], "words cost"),
                **build_count_columns("cheapest", len(utilisations)),
                "out_of_range_cells": sum(theory.label == name and theory.out_of_range for theory in cheapest_theories),
                "largest_limit_utilisation": max(utilisations, default=None),
                **build_count_columns(
                    "holds",
                    sum(
                        name in judgements and judgements[name].verdict.answer == "HOLDS"
                        for judgements in judgements_by_cell
                    ),
                ),
            }
        )
    answers_without_theory = ("UNRESOLVED", "none", "failed")
    return records + [
        {"theory": name, **build_count_columns("cheapest", answers.count(name))} for name in answers_without_theory
    ]


# --- Cells as rows of a contact table.


def build_contact_row(cell: MapCell, placement: Placement | None) -> Record:
    """Row of a contact table for a cell of a map.

    The row has the verdict, the cheapest theory that holds with its patches, ellipses, and finite elements. Positions
    `*_centre_mm` are along the rail's surface from the first contact point. The row has no patches for an unusable
    cell, or if no theory certainly holds.

    Parameters
    ----------
    cell
        Cell of a map.
    placement
        Placement of the cell's position; None if the wheel could not be placed.

    Returns
    -------
    Record
        Values by column.
    """
    row = select_attributes(cell, "lateral_shift_mm load_kN status verdict")
    load = cell.usable
    if load is None or placement is None:
        return row
    cheapest = find_cheapest_of_load(load)
    row |= {
        "roll_mrad": 1e3 * compute_roll(load.case, placement),
        "normal_force_N": load.normal_force_N,
        **cheapest_columns("cheapest_theory", cheapest),
        **select_attributes(load.comparison.fe, SIZE_MEASURES, "fe_"),
        **_build_centre_columns(
            "fe", placement, (load.comparison.patch.centre_x_mm, load.comparison.patch.centre_y_mm)
        ),
        "contact_points": len(placement.contact_points),
    }
    theory_contact = cheapest.made if cheapest.answer == "HOLDS" else None
    if theory_contact is not None:
        row |= {
            **select_attributes(read_theory_measures(theory_contact), SIZE_MEASURES, "theory_"),
            **_build_centre_columns("theory", placement, theory_contact.centre_mm),
            "theory_patches": len(theory_contact.patches),
        }
        for number, patch in enumerate(theory_contact.patches, start=1):
            row |= flatten({f"patch{number}": _build_patch_columns(patch, placement, theory_contact.normal_force_N)})
    return row | contact_point_columns(placement, _build_spring_columns(load, placement))


def _build_centre_columns(prefix: str, placement: Placement, centre_mm: tuple[float, float]) -> Record:
    """Columns of a centre of pressure: along the rail's surface, on the rail and on the wheel, in mm."""
    rail_y, wheel_y, _ = placement.on_profiles(*centre_mm)
    return {
        f"{prefix}_centre_mm": centre_mm[1],
        f"{prefix}_centre_rail_y_mm": rail_y,
        f"{prefix}_centre_wheel_y_mm": wheel_y,
    }


def _build_patch_columns(patch: TheoryPatch, placement: Placement, total_N: float) -> Record:
    """Columns of a patch at its contact point.

    For a theory without contact points the position is the centre of pressure."""
    names = "rail_y_mm wheel_y_mm contact_angle_rad"
    at_centre = zip(names.split(), placement.on_profiles(*patch.centre_mm), strict=True)
    position = dict(at_centre) if patch.touch is None else select_attributes(patch.touch, names)
    return {**position, "load_share": patch.normal_force_N / total_N, **select_attributes(patch, "a_mm b_mm p_max_MPa")}


def _build_spring_columns(load: JudgedLoad, placement: Placement) -> dict[int, Record]:
    """Ellipses that share the load, by number of the contact point.

    Hertz's ellipse if it carries the whole load; no ellipse at a contact point without load.
    """
    if MULTI_HERTZ in load.without:
        return {}
    judgement = load.judgements.get(MULTI_HERTZ, load.judgements[HERTZ])
    patches = () if judgement.approximation is None else judgement.approximation.patches
    ellipses = {patch.contact_point_number or 0: patch.hertz for patch in patches}
    return {number: ellipse_columns(ellipses.get(number)) for number in range(len(placement.contact_points))}
