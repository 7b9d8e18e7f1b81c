"""Do the finite elements agree with another code on a published benchmark?

Reference (other code): Manchester Contact Benchmark, case A-2.2, as solved by CONTACT 25 (Vollebregt; half-space
boundary elements): one wheelset with S1002 wheels on UIC60 benchmark rails, 10 kN a wheel, G 82 GPa, nu 0.28, shifts of
0 to 6 mm by finite elements. Expected: peak pressure within 0.5 %. Area is a count of 0.2 mm cells there, which is half
a row of them too large all around. Up to 4 mm the yaw (up to 9.6 mrad) is taken as zero here, and the wheelset rolls
until both wheels touch.

From 5 mm on, where the right wheel runs in the root of its flange, roll and yaw are those of the benchmark, and place
and angle of the contact are compared as well. At 5 mm it stands on two patches: CONTACT has them in one plane, with all
pressures along its normal, though one is 11 degrees steeper than the other.

From 0 to 10 mm both wheels are compared on the half-space, with the roll of the benchmark. From 6.5 mm on the right one
climbs its rail: it touches it beyond the steepest place of its flange (70 degrees), at 66 degrees at 6.5 mm and 46 at
10 mm, 3 to 8 mm above where it runs. That is refused unless it is asked for, as it is here (`flange_climb`).

The right wheel of the benchmark runs towards its flange. Here both wheels are the same pair, with the shift towards the
rail or away from it.

Found: by finite elements at 8 mm, `quick`, the peak is 0.7 % lower. On the climbing flange the cells of the reference
are half as long as the half-width; on such cells the same pressure has a deviation of +2.2 to -2.8 %. The roll of the
loaded wheelset agrees to 0.0006 mrad from 1 to 5 mm, to 0.004 at 0.5, 5.5 and 6 mm, to 0.0035 at 6.5 mm and to 0.0016
beyond.
"""

from functools import cache
from math import atan, cos
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fecontact.bodies import Material, TrackSide
from fecontact.case import Case
from fecontact.judging.measures import read_measures, read_patch
from fecontact.placement.wheel_on_rail import Placement
from fecontact.regression.checks import Check
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

# The reference has four digits, its yaw is left out here, and bodies are not half-spaces; 0.25 % is reached.
LIMIT_PERCENT = 0.5
# Half a row of 0.2 mm cells all around a patch of 20 to 50 mm2.
AREA_PERCENT = 6.0
CELLS_REASON = "the area of CONTACT is a count of cells of 0.2 mm, which extend beyond the edge of the patch"
# Shift towards this rail (mm), normal force (N), peak pressure (MPa), approach (micrometre), area (mm^2).
REFERENCE = (
    (-4.0, 10030.0, 527.2, 21.85, 29.08),
    (-3.0, 10030.0, 498.8, 21.28, 30.64),
    (-2.0, 10040.0, 465.9, 20.54, 33.20),
    (-1.0, 10050.0, 423.9, 19.46, 36.64),
    (0.0, 9997.0, 338.3, 15.96, 51.64),
    (1.0, 9827.0, 741.3, 24.48, 24.24),
    (2.0, 9799.0, 744.8, 24.80, 20.20),
    (3.0, 9774.0, 713.2, 24.39, 21.20),
    (4.0, 9745.0, 664.4, 23.70, 22.44),
)
# Shift towards this rail (mm), roll and yaw (mrad, of the right wheel positive), normal force (N), peak pressure (MPa),
# place across from the rail's highest point (mm, to the field side) and contact angle (rad) of the contact's reference.
ROLLED = (
    (-6.0, -0.6272, -14.4, 10020.0, 578.5, -2.5116, 0.0084),
    (-5.5, -0.4777, -13.2, 10020.0, 565.8, -2.5580, 0.0085),
    (-5.0, -0.3554, -12.0, 10030.0, 552.8, -2.6368, 0.0088),
    (5.0, 0.3554, 12.0, 9619.0, 1556.0, -33.4470, 0.2905),
    (5.5, 0.4777, 13.2, 9629.0, 1486.0, -34.4157, 0.3363),
    (6.0, 0.6272, 14.4, 9709.0, 1149.0, -35.3954, 0.4176),
)
TWO_PATCHES_MM = 5.0
# The reference has a conforming flange root in a single plane (0.5 % on the half-space). With two patches that plane is
# the plane of neither patch (3.6 %).
ROLLED_PERCENT, TWO_PATCHES_PERCENT = 1.0, 5.0
PLANE_REASON = "the single plane of CONTACT is the plane of neither patch"
# Its reference point is not the centre of pressure, which is used here: 0.025 mm of 2.5 mm, and an equal share of the
# angle.
PLACE_PERCENT, ANGLE_PERCENT = 1.5, 2.0
# Both wheels on the half-space: shift to the right and roll (mm, mrad, as there); of the right wheel, then of the left
# one, place and angle as above, normal force (N), peak pressure (MPa) and approach (micrometre; None: not known here).
BOTH_WHEELS = (
    (0.0, 0.0, (-8.66, 0.029, 9997.0, 338.3, 15.96), (-8.66, 0.029, 9997.0, 338.3, 15.96)),
    (0.5, 0.02304, (-16.03, 0.0568, 9870.0, 632.5, 19.48), (-6.3233, 0.0211, 10050.0, 395.3, 18.59)),
    (1.0, 0.05049, (-18.5418, 0.0696, 9827.0, 741.3, 24.48), (-5.2886, 0.0176, 10050.0, 423.9, 19.46)),
    (2.0, 0.1128, (-19.6178, 0.0806, 9799.0, 744.8, 24.80), (-4.027, 0.0134, 10040.0, 465.9, 20.54)),
    (3.0, 0.1803, (-20.5627, 0.0923, 9774.0, 713.2, 24.39), (-3.2967, 0.011, 10030.0, 498.8, 21.28)),
    (4.0, 0.2557, (-21.7944, 0.1078, 9745.0, 664.4, 23.70), (-2.8681, 0.0096, 10030.0, 527.2, 21.85)),
    (4.5, 0.2977, (-22.6421, 0.1185, 9726.0, 625.5, 23.10), None),
    (5.0, 0.3554, (-33.447, 0.2905, 9619.0, 1556.0, 27.19), (-2.6368, 0.0088, 10030.0, 552.8, None)),
    (5.5, 0.4777, (-34.4157, 0.3363, 9629.0, 1486.0, 29.26), (-2.558, 0.0085, 10030.0, 565.8, None)),
    (6.0, 0.6272, (-35.3954, 0.4176, 9709.0, 1149.0, 27.28), (-2.5116, 0.0084, 10020.0, 578.5, 22.78)),
    (6.5, 4.376, (-42.0394, 1.1591, 15440.0, 2603.0, 36.23), (-1.9083, 0.0064, 10010.0, 637.0, 23.69)),
    (7.0, 6.393, (-41.4881, 1.0634, 14030.0, 2622.0, 35.63), (-1.9234, 0.0064, 10010.0, 666.7, 24.12)),
    (7.5, 7.642, (-41.0693, 1.0006, 13260.0, 2630.0, 35.24), (-2.0885, 0.007, 10010.0, 685.9, 24.38)),
    (8.0, 8.606, (-40.701, 0.9501, 12720.0, 2634.0, 34.94), (-2.3103, 0.0077, 10020.0, 701.1, 24.58)),
    (8.5, 9.408, (-40.3617, 0.9065, 12310.0, 2638.0, 34.69), (-2.5645, 0.0086, 10020.0, 714.0, 24.74)),
    (9.0, 10.10113, (-40.0422, 0.8676, 11970.0, 2640.0, 34.47), (-2.8403, 0.0095, 10020.0, 725.3, 24.89)),
    (9.5, 10.71386, (-39.7376, 0.8321, 11680.0, 2641.0, 34.28), (-3.1318, 0.0105, 10020.0, 735.2, 25.01)),
    (10.0, 11.26431, (-39.4446, 0.7992, 11440.0, 2643.0, 34.11), (-3.4351, 0.0115, 10020.0, 744.0, 25.11)),
)
YAW_A_MM = 2.4e-3
# Over two lobes its reference point is not a centre of pressure: the distance is 0.4 mm on patches of 17 mm.
TWO_LOBES_MM = {"right": (0.0, 0.5, TWO_PATCHES_MM), "left": (0.0,)}
# The half-width of a patch on the flange is 0.37 mm, and cells there are 0.2 mm: the same pressure on such cells here
# is 2.2 % too high with a cell upon its peak, 2.8 % too low with the peak between two; 1.8 % is found. Others: 0.55 %.
CLIMBING_PERCENT = 2.5
HALF_SPACE_PERCENT, APPROACH_PERCENT = 0.6, 1.0
# Distance between the middles of its cells, rows 6 to 11 and 54 to 66. Half a row at both ends, and its single plane,
# which is a chord, account for 2.3 %.
DISTANCE_MM, DISTANCE_PERCENT = 10.3, 4.0
# Arcs on arcs: place and angle are within 0.02 %.
ARCS_PERCENT = 0.05
STEEL = Material.from_shear(shear_MPa=82_000.0, poisson=0.28)


def _case(shift_mm: float, roll_rad: float, **options: Any) -> Case:
    return Case(
        rail="MBench_UIC60",
        inclination_rad=atan(1 / 40),
        lateral_shift_mm=shift_mm,
        roll_rad=roll_rad,
        load_kind="normal",
        rail_material=STEEL,
        wheel_material=STEEL,
        **options,
    )


@cache
def wheelset_roll_rad(shift_mm: float) -> float:
    """Roll at which both wheels of the wheelset touch their rails.

    At this roll both wheel centres give an equal height of the axle.
    """

    def height_difference(roll: float) -> float:
        height_mm, opposite_height_mm = (
            place_case(_case(sign * shift_mm, sign * roll)).wheel.centre_mm[2] for sign in (1.0, -1.0)
        )
        return float(height_mm - opposite_height_mm)

    if shift_mm == 0.0:
        return 0.0
    # to the nanoradian (below a nanometre in height): the digits beyond differ between machines, and ids hash inputs
    return round(float(brentq(height_difference, -5e-3, 5e-3)), 9)


def cases(quick: bool = False) -> list[Case]:
    """All positions, or two of them."""
    chosen = [entry for entry in REFERENCE if not quick or entry[0] in (-2.0, 2.0)]
    case_list = [_case(s, wheelset_roll_rad(s), load_N=force, refine="never") for s, force, *_ in chosen]
    return case_list if quick else case_list + rolled_cases()


def rolled_cases() -> list[Case]:
    """Positions with roll and yaw of the benchmark.

    The benchmark yaws before it rolls. In the order of this package, its roll is smaller.
    """
    return [
        _case(s, 1e-3 * roll * cos(1e-3 * yaw), yaw_rad=1e-3 * yaw, load_N=force, refine="never")
        for s, roll, yaw, force, *_ in ROLLED
    ]


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Peak pressure and area against the reference, by position.

    Positions with the roll of the benchmark have places and angles too.
    """
    reference = {entry[0]: entry for entry in REFERENCE}
    rolled = [row for row in rows if float(row["lateral_shift_mm"]) not in reference]
    rows = [row for row in rows if row not in rolled]
    lines = ["shift mm   p_max MPa  CONTACT   deviation   area mm2  CONTACT   deviation"]
    worst = 0.0
    for row in rows:
        _, _, p_ref, _, area_ref = reference[float(row["lateral_shift_mm"])]
        p, area = float(row["fe_p_max_MPa"]), float(row["fe_area_mm2"])
        worst = max(worst, abs(p / p_ref - 1.0))
        lines.append(
            f"{row['lateral_shift_mm']:8.1f} {p:11.1f} {p_ref:8.1f} {100 * (p / p_ref - 1):+10.2f} %"
            f" {area:10.2f} {area_ref:8.2f} {100 * (area / area_ref - 1):+10.2f} %"
        )
    lines.append(f"Largest deviation of the peak pressure: {100 * worst:.2f} % (limit {LIMIT_PERCENT:g} %).")
    return "\n".join(lines + (_rolled_lines(rolled) if rolled else []))


def _rolled_lines(rows: list[dict[str, Any]]) -> list[str]:
    reference = {entry[0]: entry[4:] for entry in ROLLED}
    lines = ["shift mm   p_max MPa  CONTACT   deviation   patches   y mm  CONTACT   angle rad  CONTACT"]
    for row in rows:
        shift = float(row["lateral_shift_mm"])
        (p_ref, y_ref, angle_ref), (y, angle), p = reference[shift], place_of(row), float(row["fe_p_max_MPa"])
        lines.append(
            f"{shift:8.1f} {p:11.1f} {p_ref:8.1f} {100 * (p / p_ref - 1):+10.2f} % {row['fe_patch_count']:>9}"
            f" {y:8.3f} {y_ref:8.3f} {angle:10.4f} {angle_ref:8.4f}"
        )
    return lines


def place_of(row: dict[str, Any]) -> tuple[float, float]:
    """Lateral centre of pressure and angle of the rail there.

    The centre (mm) is relative to the highest point of the rail; the angle is in rad.
    """
    case = next(case for case in rolled_cases() if case.lateral_shift_mm == float(row["lateral_shift_mm"]))
    return _place_and_angle(place_case(case), float(row["fe_centre_y_mm"]))


def _place_and_angle(placement: Placement, centre_y_mm: float) -> tuple[float, float]:
    profile = placement.rail.profile
    arc = placement.first_arc_length_mm + centre_y_mm
    y, _, angle = placement.rail.section(profile.at_arc_length(arc))
    profile_y, z, _ = placement.rail.section(profile.at_arc_length(np.arange(0.0, profile.length_mm, 0.01)))
    return float(y - profile_y[np.argmax(z)]), float(angle)


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of peak pressures, areas, places and angles.

    The limit of the area allows for a count of cells of 0.2 mm. Places and angles are compared where there is a single
    patch. With the rows of the whole study, both wheels are compared on the half-space too, which needs no rows.
    """
    reference = {entry[0]: entry for entry in REFERENCE}
    check_list = []
    for row in rows:
        if float(row["lateral_shift_mm"]) not in reference:
            check_list += _rolled_checks(row)
            continue
        _, _, peak, _, area = reference[float(row["lateral_shift_mm"])]
        for name, unit, expected, limit in (("p_max", "MPa", peak, LIMIT_PERCENT), ("area", "mm2", area, AREA_PERCENT)):
            check_list.append(
                Check(
                    quantity=f"{name}, {unit}",
                    case=f"shift {row['lateral_shift_mm']:+g} mm",
                    reference="CONTACT 25, Manchester benchmark A-2.2",
                    kind="other code",
                    value=float(row[f"fe_{name}_{unit}"]),
                    expected=expected,
                    limit_percent=limit,
                    uncertainty_percent=float(row[f"hertz_uncertainty_{name}_percent"]),
                    explanation=CELLS_REASON if name == "area" else "",
                )
            )
    if {float(row["lateral_shift_mm"]) in reference for row in rows} == {True, False}:
        check_list += [check for shift, *_ in BOTH_WHEELS for check in half_space_checks(shift)]
    return check_list


def both_cases(shift_right_mm: float) -> dict[TrackSide, Case]:
    """Both wheels of the benchmark, each under its normal force.

    The frame is the frame of the left side.
    """
    shift, roll, *wheel_references = next(entry for entry in BOTH_WHEELS if entry[0] == shift_right_mm)
    yaw = YAW_A_MM * shift
    sides: tuple[TrackSide, TrackSide] = ("right", "left")
    return {
        side: _case(-shift, -1e-3 * roll * cos(yaw), yaw_rad=yaw, side=side, load_N=reference[2], flange_climb=True)
        for side, reference in zip(sides, wheel_references, strict=True)
        if reference is not None
    }


def half_space_checks(shift_right_mm: float) -> list[Check]:
    """Checks of the true gap of both wheels on a half-space.

    Compared are places, angles, peak pressures and approaches.
    """
    references = dict(zip(("right", "left"), next(e[2:] for e in BOTH_WHEELS if e[0] == shift_right_mm), strict=True))
    check_list = []
    for side, case in both_cases(shift_right_mm).items():
        y_ref, angle_ref, _, peak, approach = references[side]
        placement = place_case(case)
        half_space = expect_on_half_space(case, placement)[1].half_space
        y, angle = _place_and_angle(placement, read_patch(half_space).centre_y_mm)
        flange, two_patches = placement.climbs, side == "right" and shift_right_mm == TWO_PATCHES_MM
        at_peak = CLIMBING_PERCENT if flange else TWO_PATCHES_PERCENT if two_patches else HALF_SPACE_PERCENT
        comparisons = [("p_max, MPa", read_measures(half_space).p_max_MPa, peak, at_peak)]
        if approach is not None and not two_patches:
            comparisons.append(("approach, um", 1e3 * half_space.approach_mm, approach, APPROACH_PERCENT))
        if two_patches:
            lobes = [lobe.y_mm for lobe in read_patch(half_space).lobes]
            comparisons.append(("patches", float(read_patch(half_space).patch_count), 2.0, 0.0))
            comparisons.append(("distance of both patches, mm", max(lobes) - min(lobes), DISTANCE_MM, DISTANCE_PERCENT))
        if shift_right_mm not in TWO_LOBES_MM[side]:
            comparisons.append(("place across, mm", y, y_ref, ARCS_PERCENT if flange else PLACE_PERCENT))
            comparisons.append(("angle, rad", angle, angle_ref, ARCS_PERCENT if flange else ANGLE_PERCENT))
        check_list += [
            Check(
                quantity=f"{quantity} (half-space)",
                case=f"shift {shift_right_mm:g} mm to the right, {side} wheel{', which climbs' if flange else ''}",
                reference="CONTACT 25, Manchester benchmark A-2.2",
                kind="other code",
                value=value,
                expected=expected,
                limit_percent=limit,
            )
            for quantity, value, expected, limit in comparisons
        ]
    return check_list


def _rolled_checks(row: dict[str, Any]) -> list[Check]:
    shift = float(row["lateral_shift_mm"])
    peak, y_ref, angle_ref = next(entry[4:] for entry in ROLLED if entry[0] == shift)
    two_patches = shift == TWO_PATCHES_MM
    comparisons = [
        ("p_max, MPa", float(row["fe_p_max_MPa"]), peak, TWO_PATCHES_PERCENT if two_patches else ROLLED_PERCENT)
    ]
    if two_patches:
        comparisons.append(("patches", float(row["fe_patch_count"]), 2.0, 0.0))
    else:
        y, angle = place_of(row)
        comparisons += [("place across, mm", y, y_ref, PLACE_PERCENT), ("angle, rad", angle, angle_ref, ANGLE_PERCENT)]
    return [
        Check(
            quantity=quantity,
            case=f"shift {shift:+g} mm, rolled and yawed",
            reference="CONTACT 25, Manchester benchmark A-2.2",
            kind="other code",
            value=value,
            expected=expected,
            limit_percent=limit,
            uncertainty_percent=float(row["hertz_uncertainty_p_max_percent"]) if quantity.startswith("p_max") else None,
            explanation=PLANE_REASON if two_patches else "",
        )
        for quantity, value, expected, limit in comparisons
    ]


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
