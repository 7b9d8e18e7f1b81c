"""Hertz at all touch points, which share the load as springs, beside Hertz at the first one: in records and in rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any
from weakref import WeakKeyDictionary

from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.measures import hertz_measures
from fecontact.comparison.multi_hertz import MultiHertz, MultiHertzJudgement, judge_multi_hertz, multi_hertz
from fecontact.comparison.verdict import Verdict
from fecontact.geometry.placement import Placement
from fecontact.map.cells import MapCell
from fecontact.outputs.measure_words import WORDS
from fecontact.solving.position import direction_of_case, hertz_points_of_case
from fecontact.theory.hertz import HertzContact

Record = dict[str, Any]

# Tables, maps and reports ask several times, and judging takes a quarter of a second.
_judged: WeakKeyDictionary[JudgedLoad, MultiHertzJudgement] = WeakKeyDictionary()


def ellipses_of(load: JudgedLoad, placement: Placement) -> MultiHertz | None:
    """The ellipses that share a load; None where the surfaces conform at a touch point."""
    case = load.case
    return multi_hertz(placement, hertz_points_of_case(case, placement), direction_of_case(case, placement))


def several_ellipses(load: JudgedLoad, placement: Placement) -> MultiHertzJudgement | None:
    """The ellipses that share a load at its placement, judged; None where a single one carries it, or there is none."""
    if len(placement.touch_points) < 2:
        return None
    contact = ellipses_of(load, placement)
    return None if contact is None or len(contact.ellipses) < 2 else judged_ellipses(load, contact)


def judged_ellipses(load: JudgedLoad, contact: MultiHertz) -> MultiHertzJudgement:
    """The ellipses that share a load at its placement, judged once."""
    if load not in _judged:
        _judged[load] = judge_multi_hertz(load, contact)
    return _judged[load]


def know_ellipses(judged: Mapping[JudgedLoad, MultiHertzJudgement]) -> None:
    """Take what another process has judged."""
    _judged.update(judged)


def springs_of_cell(cell: MapCell, placement: Placement | None) -> MultiHertzJudgement | None:
    """The same of a cell of a map, none where it was not solved."""
    return None if cell.judged is None or placement is None else several_ellipses(cell.judged, placement)


def springs_help(cell: MapCell, placement: Placement | None) -> bool:
    """Whether Hertz at the first touch point does not hold in a cell, and Hertz at all of them does."""
    if cell.status != "converged" or cell.verdict == "HOLDS":
        return False
    springs = springs_of_cell(cell, placement)
    return springs is not None and springs.verdict.answer == "HOLDS"


def limit_used(load: JudgedLoad, judged: MultiHertzJudgement) -> float:
    """By how much the measure that uses most of its limit does so; the ellipses are off from 1 on."""
    used = [abs(judged.deviation[name]) / limit for name, limit in load.case.criteria.limits.items()]
    return math.nan if any(math.isnan(part) for part in used) else max(used)


def multi_hertz_columns(load: JudgedLoad, placement: Placement) -> Record:
    """Columns of a row, none where a single ellipse carries the load: there it is Hertz's own."""
    judged = several_ellipses(load, placement)
    if judged is None:
        return {}
    columns: Record = {
        "multi_hertz_ellipses": len(judged.contact.ellipses),
        "multi_hertz_overlapping": judged.contact.overlapping,
        "multi_hertz_verdict": judged.verdict.answer,
        "multi_hertz_measure": judged.verdict.measure,
        "multi_hertz_limit_used": limit_used(load, judged),
    }
    for measure, name in (("p_max_MPa", "p_max"), ("area_mm2", "area")):
        columns[f"multi_hertz_{name}_deviation_percent"] = 1e2 * judged.deviation[measure]
        columns[f"multi_hertz_{name}_uncertainty_percent"] = 1e2 * judged.uncertainty[measure]
    return columns


def springs_text(row: Mapping[str, Any]) -> str:
    """What a row says of the ellipses that share its load, empty where it says nothing."""
    if not row.get("multi_hertz_verdict"):
        return ""
    off = (float(row[f"multi_hertz_{name}_deviation_percent"]) for name in ("p_max", "area"))
    measure = WORDS[str(row["multi_hertz_measure"])].name
    overlap = "; they overlap" if str(row.get("multi_hertz_overlapping")) == "True" else ""
    return (
        f"Hertz at {row['multi_hertz_ellipses']} touch points, as springs: {row['multi_hertz_verdict']} by {measure}"
        f" (p_max {next(off):+z.1f} %, area {next(off):+z.1f} %, part of a limit"
        f" {float(row['multi_hertz_limit_used']):.2f}){overlap}"
    )


def judged_record(judged: MultiHertzJudgement) -> Record:
    """The ellipses that share a load as one theory of the contact, and its verdict."""
    contact = judged.contact
    return {
        **judged.measures.as_dict(),
        "centre_mm": list(contact.centre_mm),
        "overlapping": contact.overlapping,
        "patches": [
            {
                "touch_point": one.touch_point,
                "touch_rail_y_mm": one.touch.rail_y_mm,
                "contact_angle_rad": one.touch.contact_angle_rad,
                "centre_mm": [one.x_mm, one.s_mm],
                **ellipse_record(one.hertz),
            }
            for one in contact.ellipses
        ],
        "deviation": dict(judged.deviation),
        "uncertainty": dict(judged.uncertainty),
        "verdict": verdict_record(judged.verdict),
    }


def verdict_record(verdict: Verdict) -> Record:
    """A verdict without its limits and its cause."""
    return {
        "verdict": verdict.answer,
        "measure": verdict.measure,
        "each": dict(verdict.each),
        "unknown": list(verdict.unknown),
    }


def ellipse_record(hertz: HertzContact) -> Record:
    """An ellipse with its force."""
    return {
        "normal_force_N": hertz.normal_force_N,
        **hertz_measures(hertz).as_dict(),
        "orientation_rad": hertz.orientation_rad,
        "A_per_mm": hertz.A_per_mm,
        "B_per_mm": hertz.B_per_mm,
        "stiffness_GN_per_m15": hertz.stiffness_GN_per_m15,
    }
