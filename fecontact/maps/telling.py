"""A map told: its record, and the lines of its tables; nothing is evaluated here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from fecontact.contact_theories.approximation import TheoryPatch
from fecontact.contact_theories.registry import HERTZ, MULTI_HERTZ, OF_ELLIPSES, THEORIES
from fecontact.feature_registry import offered
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.measures import measures_of_theory
from fecontact.judging.readings import MappedLaws
from fecontact.judging.verdict import Judgement, Standing, cheapest, standings
from fecontact.maps.model import ApplicabilityMap, LoadLimit, MapCell, MapPosition
from fecontact.outputs.alone import SIZES, ellipse_columns, touches
from fecontact.outputs.case_words import roll_words
from fecontact.outputs.flat_records import Record, flat, picked
from fecontact.outputs.records.cheapest import cheapest_columns, cheapest_of, other_theories, theories_of
from fecontact.outputs.records.results import case_inputs, load_record, versions
from fecontact.outputs.verdict_words import theory_words
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.placing import roll_of_case

MAP_SCHEMA = "fecontact/map/6"


def stiffness_rows(position: MapPosition) -> list[Record]:
    """Contact stiffness of a position at each of its loads, from the fit over all of them; none without it."""
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


def map_record(made: ApplicabilityMap, provenance: Record | None = None) -> Record:
    """The whole map with the base case, its criteria, and what made it."""
    of_features = {
        f"{name}_limits": [
            limit_record(one.lateral_shift_mm, one.limits_of.get(name, one.limit)) for one in made.positions
        ]
        for name, of in offered("MAPS").items()
        if of.criterion(made.case) is not None
    }
    # first yield, and where yielding takes up a limit
    yields = [{"lateral_shift_mm": one.lateral_shift_mm, **one.yield_loads_N} for one in made.positions]
    return {
        "schema": MAP_SCHEMA,
        # shift and load are the map's own
        "case": {k: v for k, v in case_inputs(made.case).items() if k not in ("lateral_shift_mm", "load_N")},
        "roll": roll_words(made.case),
        "criteria": asdict(made.case.criteria),
        **picked(made, "lateral_shifts_mm loads_N"),
        "cells": [cell_record(cell) for cell in made.cells],
        "limits": [limit_record(position.lateral_shift_mm, position.limit) for position in made.positions],
        **of_features,
        **({"yield_loads_N": yields} if any(one.yield_loads_N for one in made.positions) else {}),
        "theory_shares": share_records(made),
        "stiffness": [row for position in made.positions for row in stiffness_rows(position)],
        "versions": versions(),
        "provenance": provenance or {},
    }


def cell_record(cell: MapCell) -> Record:
    """A cell with all that is known of it."""
    return {
        **picked(cell, "lateral_shift_mm load_N status"),
        **({} if cell.judged is None else load_record(cell.judged)),
    }


def limit_record(shift_mm: float, limit: LoadLimit) -> Record:
    """A load limit of a position."""
    return {
        "lateral_shift_mm": shift_mm,
        **picked(limit, "F_max_N intervals reason note"),
        "tried": [{"load_N": load, "verdict": verdict} for load, verdict in limit.tried],
    }


def law_row(cell: MapCell, laws: MappedLaws) -> Record:
    """A cell with the cheapest of some laws that holds, and how far each is off."""
    row, judged = picked(cell, "lateral_shift_mm load_kN status"), laws_of(cell, laws)
    if judged:
        row["cheapest_theory"] = cheapest(standings(judged)).label
    for name, one in judged.items():
        row |= laws.columns(name, one)
    return row


def laws_of(cell: MapCell, laws: MappedLaws) -> Mapping[str, Judgement]:
    """Laws that were judged in a cell."""
    return laws.read(cell.usable) if cell.usable else {}


# --- The judged theories of a cell or a map.


def judged_by(load: JudgedLoad | None, theory: str) -> JudgedLoad | Judgement | None:
    """A load by a theory, of Hertz the load itself, or bodies that yield; None where the theory has no contact.

    A theory that says nothing of its own, such as springs at a single touch point, is Hertz.
    """
    if load is None or theory in load.without:
        return None
    if theory == HERTZ and load.plastic is not None:
        return load.plastic.deciding
    return load if theory == HERTZ else load.judgements.get(theory, load)


def ellipses_instead(load: JudgedLoad | None) -> Standing | None:
    """The theory of ellipses that holds where the single one of Hertz does not; None where it does, or none holds."""
    if load is None or not load.usable or load.plastic is not None or load.verdict.answer == "HOLDS":
        return None
    holding = (one for one in standings(other_theories(load)) if one.name in OF_ELLIPSES and one.answer == "HOLDS")
    found = cheapest(holding, in_range=load.case.criteria.theories_in_range)
    return found if found.name else None


def all_ellipses_instead(made: ApplicabilityMap) -> str:
    """The theories of ellipses that hold in cells of a map where Hertz does not, in words; empty without one."""
    found = (ellipses_instead(cell.judged) for cell in made.cells)
    return " or ".join(dict.fromkeys(theory_words(one.name, "out of range" * one.out_of_range) for one in found if one))


def share_records(made: ApplicabilityMap) -> list[Record]:
    """In how many cells of a map each theory of the pressure is the cheapest that holds, and in how many it holds.

    The last lines are the cells where it is open which, where none holds, and those that may not be used.
    """
    loads = [cell.usable for cell in made.cells if cell.usable]
    cells, cheapest_ones = [theories_of(load) for load in loads], [cheapest_of(load) for load in loads]
    answers = [one.label for one in cheapest_ones] + ["failed"] * (len(made.cells) - len(loads))

    def counted(of: str, count: int) -> Record:
        return {f"{of}_cells": count, f"{of}_percent": 100.0 * count / len(answers) if answers else 0.0}

    found: list[Record] = []
    for name in (name for name in THEORIES if any(name in one for one in cells)):
        used = [one[name].limit_used for one, answer in zip(cells, answers, strict=False) if answer == name]
        found.append(
            {
                "theory": name,
                **picked(THEORIES[name], "words cost"),
                **counted("cheapest", len(used)),
                "out_of_range_cells": sum(one.label == name and one.out_of_range for one in cheapest_ones),
                "largest_limit_used": max(used, default=None),
                **counted("holds", sum(name in one and one[name].verdict.answer == "HOLDS" for one in cells)),
            }
        )
    others = ("UNRESOLVED", "none", "failed")
    return found + [{"theory": name, **counted("cheapest", answers.count(name))} for name in others]


# --- Cells as lines of a contact table.


def judged_row(cell: MapCell, placement: Placement | None) -> Record:
    """A cell of a map as a line: verdict, cheapest theory that holds with its patches, ellipses, finite elements.

    Places `*_centre_mm` are along the rail's surface from the first touch point. Where no theory is known to hold, and
    in a cell that may not be used, there are no patches.
    """
    row = picked(cell, "lateral_shift_mm load_kN status verdict")
    load = cell.usable
    if load is None or placement is None:
        return row
    cheapest = cheapest_of(load)
    row |= {
        "roll_mrad": 1e3 * roll_of_case(load.case, placement),
        "normal_force_N": load.normal_force_N,
        **cheapest_columns("cheapest_theory", cheapest),
        **picked(load.comparison.fe, SIZES, "fe_"),
        **_centre("fe", placement, (load.comparison.patch.centre_x_mm, load.comparison.patch.centre_y_mm)),
        "touch_points": len(placement.touch_points),
    }
    found = cheapest.made if cheapest.answer == "HOLDS" else None
    if found is not None:
        row |= {
            **picked(measures_of_theory(found), SIZES, "theory_"),
            **_centre("theory", placement, found.centre_mm),
            "theory_patches": len(found.patches),
        }
        for number, patch in enumerate(found.patches, start=1):
            row |= flat({f"patch{number}": _patch_columns(patch, placement, found.normal_force_N)})
    return row | touches(placement, _judged_springs(load, placement))


def _centre(of: str, placement: Placement, centre_mm: tuple[float, float]) -> Record:
    rail_y, wheel_y, _ = placement.on_profiles(*centre_mm)
    return {f"{of}_centre_mm": centre_mm[1], f"{of}_centre_rail_y_mm": rail_y, f"{of}_centre_wheel_y_mm": wheel_y}


def _patch_columns(patch: TheoryPatch, placement: Placement, whole_N: float) -> Record:
    """A patch at its touch point, or at its centre of pressure where the theory knows of none."""
    names = "rail_y_mm wheel_y_mm contact_angle_rad"
    of_centre = zip(names.split(), placement.on_profiles(*patch.centre_mm), strict=True)
    where = dict(of_centre) if patch.touch is None else picked(patch.touch, names)
    return {**where, "load_share": patch.normal_force_N / whole_N, **picked(patch, "a_mm b_mm p_max_MPa")}


def _judged_springs(load: JudgedLoad, placement: Placement) -> dict[int, Record]:
    """Ellipses that share the load by touch point; Hertz's where it takes all of it, none where a point has none."""
    if MULTI_HERTZ in load.without:
        return {}
    judged = load.judgements.get(MULTI_HERTZ, load.judgements[HERTZ])
    patches = () if judged.approximation is None else judged.approximation.patches
    ellipses = {patch.touch_point or 0: patch.hertz for patch in patches}
    return {number: ellipse_columns(ellipses.get(number)) for number in range(len(placement.touch_points))}
