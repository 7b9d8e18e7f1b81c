"""A vehicle in curves as a record, and as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from fecontact.outputs.records.told import Record, picked
from fecontact.vehicle.curve import CurveRun, WheelRun
from fecontact.vehicle.visits import Curves

CURVE_SCHEMA = "fecontact/curve/1"
_OF_WHEELSET = "lateral_shift_mm yaw_mrad roll_mrad"
_OF_WHEEL = "side normal_force_N lateral_force_N vertical_force_N y_over_q"


def curves_record(found: Curves) -> Record:
    """All runs, with units in the keys; the frame of each wheelset is that of its place on the track."""
    record: Record = {
        "schema": CURVE_SCHEMA,
        "vehicle": asdict(found.vehicle),
        "conditions": asdict(found.conditions),
        "differences": [asdict(one) for one in found.differences],
        "straight_track": [asdict(one) for one in found.straight],
        "curves": [_run_record(run) for runs in found.runs.values() for run in runs],
    }
    if found.cells:
        record["visits"] = [asdict(visit) | {"verdict": visit.verdict} for visit in found.visits]
        record["visited_percent"] = {theory: _percent(found.visited(theory)) for theory in found.runs}
        record["cheapest_theory_percent"] = {theory: _percent(found.sufficient(theory)) for theory in found.runs}
        record["map_notes"] = list(found.notes)
    return record


def _percent(parts: Mapping[str, float]) -> Record:
    return {name: 1e2 * part for name, part in parts.items()}


def _run_record(run: CurveRun) -> Record:
    return {
        **picked(run, "theory radius_m status notes speed_km_h unbalanced_m_s2 pull_N power_per_speed_N"),
        **picked(run, "resistance_N_per_kN left_over_N"),
        "wheelsets": [
            picked(wheelset, _OF_WHEELSET) | {"wheels": [_wheel_record(wheel) for wheel in wheelset.wheels]}
            for wheelset in run.wheelsets
        ],
    }


def _wheel_record(wheel: WheelRun) -> Record:
    return picked(wheel, _OF_WHEEL) | {"patches": [asdict(patch) for patch in wheel.patches]}


def curve_rows(found: Curves) -> list[Record]:
    """One row a theory, radius, wheelset and wheel."""
    return [
        {
            **picked(run, "theory radius_m status speed_km_h unbalanced_m_s2"),
            "wheelset": number,
            **picked(wheelset, _OF_WHEELSET),
            **picked(wheel, _OF_WHEEL),
            "patches": len(wheel.patches),
            "patch_forces_N": " ".join(f"{patch.normal_force_N:.0f}" for patch in wheel.patches),
            **picked(run, "resistance_N_per_kN left_over_N"),
            "notes": "; ".join(run.notes),
        }
        for runs in found.runs.values()
        for run in runs
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]
