"""Lines of a contact table as flat rows with units in their keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.alone.contact_table import TableLine
from fecontact.comparison.measures import hertz_measures
from fecontact.comparison.theories import THEORIES
from fecontact.outputs.records.touch import touch_columns
from fecontact.solving.placing import roll_of_case
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import HertzPoints

Record = dict[str, Any]

# as Hertz and the strips both have them
_SIZES = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "approach_mm")


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
        "cheapest_theory": line.cheapest,
        "cheapest_theory_status": line.cheapest_status,
        **(_hertz_columns(line.hertz) if line.hertz is not None else {}),
        **_strip_columns(line),
    }
    springs = line.points
    if springs is not None:
        row |= {"springs_approach_mm": springs.shared_approach_mm, "springs_p_max_MPa": springs.shared_p_max_MPa}
    for number, touch in enumerate(line.placement.touch_points):
        columns = touch_columns(line.placement, touch) | _spring_columns(springs, number)
        row |= {f"touch{number + 1}_{name}": value for name, value in columns.items()}
    return row


def _hertz_columns(hertz: HertzContact) -> Record:
    """The ellipse at the first touch point with the whole load; N grows with the approach as its power of 1.5."""
    sizes = hertz_measures(hertz).as_dict()
    return {
        "hertz_normal_force_N": hertz.normal_force_N,
        **{f"hertz_{name}": sizes[name] for name in _SIZES},
        "hertz_stiffness_N_per_mm": 1.5 * hertz.normal_force_N / hertz.approach_mm,
    }


def _strip_columns(line: TableLine) -> Record:
    strips = line.strips
    if strips is None:
        return {"strip_status": "no contact"}
    sizes = strips.measures.as_dict()
    return {
        "strip_status": strips.contact.status,
        "strip_patches": len(strips.contact.patches),
        "strip_normal_force_N": strips.contact.normal_force_N,
        **{f"strip_{name}": sizes[name] for name in _SIZES},
        "strip_centre_mm": strips.contact.centre_mm[1],
        "strip_stiffness_N_per_mm": strips.stiffness_N_per_mm,
    }


def _spring_columns(points: HertzPoints | None, number: int) -> Record:
    """The spring of a touch point, and its ellipse under the force that it takes as one of them."""
    found = [one for one in points.points if one.touch_point == number and one.side != "gauge"] if points else []
    if not found or found[0].whole is None:
        return {}
    spring = {"spring_N_per_mm15": found[0].whole.stiffness_N_per_mm15}
    shared = found[0].shared
    if shared is None:
        return spring | {"spring_force_N": 0.0}
    return spring | {
        "spring_force_N": shared.normal_force_N,
        "ellipse_a_mm": shared.a_mm,
        "ellipse_b_mm": shared.b_mm,
        "ellipse_p_max_MPa": shared.p0_MPa,
    }


def ordered(rows: list[Record]) -> list[Record]:
    """Rows with all columns that any has, touch points last."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns.sort(key=lambda name: name.partition("_")[0] if name.startswith("touch") and name != "touch_points" else "")
    return [{name: row.get(name) for name in columns} for row in rows]


def map_columns(row: Mapping[str, str] | None) -> Record:
    """What a row of a stored map says of theories at a line; `map_status` alone where the map has no such cell."""
    if row is None:
        return {"map_status": "not in the map"}
    verdicts = {name: row.get(f"theory_{name}_verdict") or "" for name in THEORIES}
    verdicts["hertz"] = row.get("verdict") or ""
    return {
        "map_status": row["status"],
        "map_cheapest_theory": row.get("theory_cheapest") or "",
        **{f"map_{name}_verdict": verdict for name, verdict in verdicts.items() if verdict},
    }
