"""Records and table rows of a vehicle in curves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Literal

from fecontact.features.curves.curve import CurveRun, WheelRun
from fecontact.features.curves.sentences import describe_paths
from fecontact.features.curves.visits import NO_CELL, CurveResults
from fecontact.outputs.flat_records import Record, flatten, select_attributes, to_plain
from fecontact.outputs.pair_names import pair_words

SHARE_ANSWERS: Mapping[str, Literal["verdict", "cheapest_theory"]] = {
    "visited_percent": "verdict",
    "cheapest_theory_percent": "cheapest_theory",
}
_PATCH_COLUMNS = "normal_force_N angle_rad fx_N fy_N spin_moment_Nmm t_gamma_N"
MAP_NOTE = "the wheels of the map have no yaw"
STABILITY_NOTE = "the critical speed is for straight track; the stability of the motion in a curve is not computed"


def make_curves_record(results: CurveResults) -> Record:
    """Make the record of all curves, with units in the keys.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Returns
    -------
    Record
        Plain values for JSON. Each wheelset is described in the track frame at its position on the curve. With a map,
        the record also has the visits, and the shares of the way by verdict and by cheapest theory in percent.
    """
    record: Record = {
        "schema": "fecontact/curve/1",
        "pair": pair_words(results.case),
        **select_attributes(results, "vehicle conditions differences"),
        "straight_track": to_plain(results.straight),
        "stability_notes": [STABILITY_NOTE],
        "path_notes": describe_paths(results),
        "curves": [to_plain(run) for runs in results.runs.values() for run in runs],
    }
    if results.columns:
        record["visits"] = [
            to_plain(visit) | {"verdict": getattr(visit.cell, "verdict", NO_CELL)} for visit in results.visits
        ]
        for key, answer_kind in SHARE_ANSWERS.items():
            record[key] = {
                theory: {answer: 1e2 * share for answer, share in results.shares(theory, answer_kind).items()}
                for theory in results.runs
            }
        record["map_notes"] = [MAP_NOTE]
    return record


def make_curve_rows(results: CurveResults) -> list[Record]:
    """Make a row for each theory, radius, wheelset and wheel.

    A curve without any numbers has a single row.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Returns
    -------
    list of Record
        Rows of curve.csv.
    """
    return [
        {
            **select_attributes(run, "theory radius_m status speed_km_h unbalanced_m_s2"),
            **wheel,
            **flatten(select_attributes(run, "resistance_N_per_kN left_over_N path_ends_m notes")),
        }
        for runs in results.runs.values()
        for run in runs
        for wheel in _make_wheel_rows(run) or [{}]
    ]


def _make_wheel_rows(run: CurveRun) -> list[Record]:
    """Make a row for each wheel of a curve; no rows if there are no wheelsets."""
    return [
        {
            "wheelset": number,
            **select_attributes(wheelset, "lateral_shift_mm yaw_mrad roll_mrad"),
            **flatten(to_plain(wheel)),
            "patch_forces_N": " ".join(f"{patch.normal_force_N:.0f}" for patch in wheel.patches),
            **_make_patch_columns(wheel),
        }
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]


def _make_patch_columns(wheel: WheelRun) -> Record:
    """Make the columns of the patches, numbered from 1 by decreasing normal force."""
    return flatten(
        {
            f"patch{number}": {**select_attributes(patch, _PATCH_COLUMNS), **to_plain(patch.creepages)}
            for number, patch in enumerate(wheel.sorted_patches, start=1)
        }
    )


def make_position_rows(results: CurveResults) -> list[Record]:
    """Make rows with shift, load and weight of each wheel, by the last theory.

    Shifts are those on a map of the left wheel. The weight of a wheel is its share of the way of its radius. Radii
    without an equilibrium have no rows.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Returns
    -------
    list of Record
        Rows of positions.csv.
    """
    radius_shares = dict(zip(results.radii_m, results.share, strict=True))
    visits = [visit for visit in results.visits if visit.theory == list(results.runs)[-1]]
    visit_counts = Counter(visit.radius_m for visit in visits)
    return [
        {
            "shift_mm": visit.lateral_shift_mm,
            "load_kN": 1e-3 * visit.vertical_force_N,
            "weight": radius_shares[visit.radius_m] / visit_counts[visit.radius_m],
            **select_attributes(visit, "radius_m wheelset side yaw_mrad"),
        }
        for visit in visits
    ]
