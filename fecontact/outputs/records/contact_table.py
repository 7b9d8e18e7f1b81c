"""Lines of a contact table, and cells of a map as lines of one, as flat rows with units in their keys."""

from __future__ import annotations

import re
from collections.abc import Mapping

from fecontact.alone.contact_table import TableLine
from fecontact.comparison.approximation import TheoryPatch
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.measures import hertz_measures, measures_of_theory
from fecontact.comparison.theories import HERTZ, MULTI_HERTZ, THEORIES
from fecontact.geometry.placement import Placement
from fecontact.map.cells import MapCell
from fecontact.outputs.records.results import touch_columns
from fecontact.outputs.records.theories import cheapest_columns, cheapest_of
from fecontact.outputs.records.told import Record, picked
from fecontact.solving.placing import roll_of_case
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import HertzPoints

# as each contact has them
_SIZES = "p_max_MPa area_mm2 a_mm b_mm approach_mm"
_NUMBERED = re.compile(r"(patch|touch)(\d+)_")


def table_row(line: TableLine) -> Record:
    """A line with all that is known of it; touch points come last, numbered from 1, the first touch first."""
    row: Record = {
        "lateral_shift_mm": line.case.lateral_shift_mm,
        "load_kN": line.case.load_N / 1e3,
        "problem": line.problem,
    }
    if line.placement is None:
        return row
    row |= {
        "roll_mrad": 1e3 * roll_of_case(line.case, line.placement),
        "touch_points": len(line.placement.touch_points),
        **cheapest_columns("cheapest_theory", line.cheapest),
        **_hertz_columns(line.hertz),
        **_strip_columns(line),
    }
    springs = line.points
    if springs is not None:
        row |= {"springs_approach_mm": springs.shared_approach_mm, "springs_p_max_MPa": springs.shared_p_max_MPa}
    return row | _touches(line.placement, {n: _spring_columns(springs, n) for n in range(row["touch_points"])})


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
        **picked(load.comparison.fe, _SIZES, "fe_"),
        **_centre("fe", placement, (load.comparison.patch.centre_x_mm, load.comparison.patch.centre_y_mm)),
        "touch_points": len(placement.touch_points),
    }
    found = cheapest.made if cheapest.answer == "HOLDS" else None
    if found is not None:
        row |= {
            **picked(measures_of_theory(found), _SIZES, "theory_"),
            **_centre("theory", placement, found.centre_mm),
            "theory_patches": len(found.patches),
        }
        for number, patch in enumerate(found.patches, start=1):
            columns = _patch_columns(patch, placement, found.normal_force_N)
            row |= {f"patch{number}_{key}": value for key, value in columns.items()}
    return row | _touches(placement, _judged_springs(load, placement))


def _touches(placement: Placement, springs: Mapping[int, Record]) -> Record:
    """Columns of all touch points, numbered from 1, each with those of its spring."""
    return {
        f"touch{number + 1}_{name}": value
        for number, touch in enumerate(placement.touch_points)
        for name, value in (touch_columns(placement, touch) | springs.get(number, {})).items()
    }


def _centre(of: str, placement: Placement, centre_mm: tuple[float, float]) -> Record:
    rail_y, wheel_y, _ = placement.on_profiles(*centre_mm)
    return {f"{of}_centre_mm": centre_mm[1], f"{of}_centre_rail_y_mm": rail_y, f"{of}_centre_wheel_y_mm": wheel_y}


def _patch_columns(patch: TheoryPatch, placement: Placement, whole_N: float) -> Record:
    """A patch at its touch point, or at its centre of pressure where the theory knows of none."""
    names = "rail_y_mm wheel_y_mm contact_angle_rad"
    if patch.touch is None:
        where = dict(zip(names.split(), placement.on_profiles(*patch.centre_mm), strict=True))
    else:
        where = picked(patch.touch, names)
    return {**where, "load_share": patch.normal_force_N / whole_N, **picked(patch, "a_mm b_mm p_max_MPa")}


def _judged_springs(load: JudgedLoad, placement: Placement) -> dict[int, Record]:
    """Ellipses that share the load by touch point; Hertz's where it takes all of it, none where a point has none."""
    if MULTI_HERTZ in load.without:
        return {}
    judged = load.judgements.get(MULTI_HERTZ, load.judgements[HERTZ])
    patches = () if judged.approximation is None else judged.approximation.patches
    ellipses = {patch.touch_point or 0: patch.hertz for patch in patches}
    return {number: _ellipse_columns(ellipses.get(number)) for number in range(len(placement.touch_points))}


def _hertz_columns(hertz: HertzContact | None) -> Record:
    """The ellipse at the first touch point with the whole load; N grows with the approach as its power of 1.5."""
    if hertz is None:
        return {}
    return {
        "hertz_normal_force_N": hertz.normal_force_N,
        **picked(hertz_measures(hertz), _SIZES, "hertz_"),
        "hertz_stiffness_N_per_mm": 1.5 * hertz.normal_force_N / hertz.approach_mm,
    }


def _strip_columns(line: TableLine) -> Record:
    strips = line.strips
    if strips is None:
        return {"strip_status": "no contact"}
    contact = strips.contact
    return {
        "strip_status": contact.status,
        "strip_patches": len(contact.patches),
        "strip_normal_force_N": contact.normal_force_N,
        **picked(strips.measures, _SIZES, "strip_"),
        "strip_centre_mm": contact.centre_mm[1],
        "strip_stiffness_N_per_mm": strips.stiffness_N_per_mm,
    }


def _spring_columns(points: HertzPoints | None, number: int) -> Record:
    """The spring of a touch point, and its ellipse under the force that it takes as one of them."""
    found = [one for one in points.points if one.touch_point == number and one.side != "gauge"] if points else []
    if not found or found[0].whole is None:
        return {}
    return {"spring_N_per_mm15": found[0].whole.stiffness_N_per_mm15} | _ellipse_columns(found[0].shared)


def _ellipse_columns(shared: HertzContact | None) -> Record:
    """The force that a touch point takes, and its ellipse; None where it takes none."""
    if shared is None:
        return {"spring_force_N": 0.0}
    sizes = picked(shared, "a_mm b_mm", "ellipse_")
    return {"spring_force_N": shared.normal_force_N, **sizes, "ellipse_p_max_MPa": shared.p0_MPa}


def ordered(rows: list[Record]) -> list[Record]:
    """Rows with all columns that any has, patches and touch points last, by their numbers."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: (found[1], int(found[2])) if (found := _NUMBERED.match(name)) else ("", 0))
    return [{name: row.get(name) for name in columns} for row in rows]


def map_columns(row: Mapping[str, str] | None) -> Record:
    """What a row of a stored map says of theories at a line; `map_status` alone where the map has no such cell."""
    if row is None:
        return {"map_status": "not in the map"}
    verdicts = {name: row.get(f"{name}_verdict_answer") or "" for name in THEORIES}
    verdicts["hertz"] = row.get("verdict_answer") or ""
    return {
        "map_status": row["status"],
        **{f"map_cheapest_theory{of}": row.get(f"cheapest_theory{of}") or "" for of in ("", "_status")},
        **{f"map_{name}_verdict": verdict for name, verdict in verdicts.items() if verdict},
    }
