"""Records and table rows of a vehicle in curves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Literal

from fecontact.features.curves.curve import CurveRun
from fecontact.features.curves.sentences import path_words
from fecontact.features.curves.visits import NO_CELL, Curves
from fecontact.outputs.flat_records import Record, flat, picked, told
from fecontact.outputs.pair_names import pair_words

SHARES: Mapping[str, Literal["verdict", "cheapest_theory"]] = {
    "visited_percent": "verdict",
    "cheapest_theory_percent": "cheapest_theory",
}
OF_MAPS = "the map's wheels have no yaw"
OF_STABILITY = "the critical speed is that of straight track; whether the motion in a curve is stable is not looked at"


def curves_record(found: Curves) -> Record:
    """All runs, with units in the keys; each wheelset is told in the frame of its place on the track."""
    record: Record = {
        "schema": "fecontact/curve/1",
        "pair": pair_words(found.case),
        **picked(found, "vehicle conditions differences"),
        "straight_track": told(found.straight),
        "stability_notes": [OF_STABILITY],
        "path_notes": path_words(found),
        "curves": [told(run) for runs in found.runs.values() for run in runs],
    }
    if found.columns:
        record["visits"] = [
            told(visit) | {"verdict": getattr(visit.cell, "verdict", NO_CELL)} for visit in found.visits
        ]
        for name, of in SHARES.items():
            record[name] = {
                theory: {one: 1e2 * part for one, part in found.shares(theory, of).items()} for theory in found.runs
            }
        record["map_notes"] = [OF_MAPS]
    return record


def curve_rows(found: Curves) -> list[Record]:
    """One row per theory, radius, wheelset and wheel; one row for a curve without any numbers."""
    return [
        {
            **picked(run, "theory radius_m status speed_km_h unbalanced_m_s2"),
            **wheel,
            **flat(picked(run, "resistance_N_per_kN left_over_N path_ends_m notes")),
        }
        for runs in found.runs.values()
        for run in runs
        for wheel in _wheel_rows(run) or [{}]
    ]


def _wheel_rows(run: CurveRun) -> list[Record]:
    return [
        {
            "wheelset": number,
            **picked(wheelset, "lateral_shift_mm yaw_mrad roll_mrad"),
            **flat(told(wheel)),
            "patch_forces_N": " ".join(f"{patch.normal_force_N:.0f}" for patch in wheel.patches),
        }
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]


def position_rows(found: Curves) -> list[Record]:
    """Shift and load of each wheel on a map of the left wheel, by the last theory, with its weight.

    A wheel has its part of the way of its radius; those of radii without an equilibrium are left out.
    """
    way = dict(zip(found.radii_m, found.share, strict=True))
    wheels = [one for one in found.visits if one.theory == list(found.runs)[-1]]
    of_radius = Counter(one.radius_m for one in wheels)
    return [
        {
            "shift_mm": one.lateral_shift_mm,
            "load_kN": 1e-3 * one.vertical_force_N,
            "weight": way[one.radius_m] / of_radius[one.radius_m],
            **picked(one, "radius_m wheelset side yaw_mrad"),
        }
        for one in wheels
    ]
