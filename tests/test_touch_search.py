"""The search for contact points against the gap of dense lines.

Tested: worn wheels, conforming roots, any nodes, refusals.
"""

import math
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import find_peaks

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.placement import wheel_on_rail as placement_module
from fecontact.placement.poses import sample_profile
from fecontact.placement.wheel_on_rail import TOUCH_REACH_MM, Pair, Placement, set_up_pair
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.segments import Arc, CurvePoints, Spline, StraightSegment
from fecontact.solving.placing import make_wheelset, place_case

INCLINATION_40 = math.atan(1.0 / 40.0)
STEP_MM = 4e-3


def hollow(depth_mm: float, middle_mm: float, half_width_mm: float) -> Profile:
    """An S1002 through points every 0.5 mm, with a hollow worn into its tread."""
    new = load_library_profile("S1002")
    p = new.evaluate(new.at_arc_length(np.arange(20.0, new.length_mm - 1.0, 0.5)))
    worn = depth_mm * np.cos(0.5 * np.pi * np.clip((p.y - middle_mm) / half_width_mm, -1.0, 1.0)) ** 2
    return Profile(name="hollow", kind="wheel", segments=(Spline(points=np.column_stack([p.y, p.z + worn])),))


STEEP, FLAT = math.radians(70.0), math.radians(25.0)


def root_wheel(radius_mm: float) -> Profile:
    """A flank of 70 degrees, a root, a slope of 25 degrees and a high tread.

    The slope lies against no crown, and the tread is high above it.
    """
    slope = np.array([-26.0, -1.3])
    centre = slope - radius_mm * np.array([-math.sin(FLAT), math.cos(FLAT)])
    flank = centre + radius_mm * np.array([-math.sin(STEEP), math.cos(STEEP)])
    back = flank - 12.0 * np.array([math.cos(STEEP), math.sin(STEEP)])
    tread = slope + 14.0 * np.array([1.0, math.tan(FLAT)])
    upright = 0.5 * math.pi
    return Profile(
        name=f"root {radius_mm:g}",
        kind="wheel",
        segments=(
            StraightSegment(start=tuple(back), end=tuple(flank)),
            Arc(centre=tuple(centre), radius=radius_mm, angle_from=upright + STEEP, angle_to=upright + FLAT),
            StraightSegment(start=tuple(slope), end=tuple(tread)),
            StraightSegment(start=tuple(tread), end=(60.0, float(tread[1]))),
        ),
    )


def pair_with(wheel: Profile) -> Pair:
    return set_up_pair(load_library_profile("60E1"), wheel, inclination_rad=INCLINATION_40)


@cache
def rail_seen_from_above() -> tuple[np.ndarray, np.ndarray]:
    """The rail profile as chords of 4 micrometres.

    They lie 1.5e-7 mm below its arcs of R 13.
    """
    rail = pair_with(load_library_profile("S1002")).rail
    q = rail.profile.evaluate(rail.profile.at_arc_length(np.arange(0.0, rail.profile.length_mm, STEP_MM)))
    c, s = math.cos(rail.inclination_rad), math.sin(rail.inclination_rad)
    y, z = rail.crown_y_mm + q.y * c - q.z * s, rail.crown_z_mm + q.y * s + q.z * c
    visible = np.isfinite(y) & (y > np.concatenate([[-np.inf], np.maximum.accumulate(y)[:-1]]))
    return y[visible], z[visible]


def all_minima(
    pair: Pair, shift_mm: float, roll_rad: float, prominence_mm: float
) -> tuple[float, list[tuple[float, float]]]:
    """Height of the axle at first touch, and all minima of the gap.

    Each minimum has its height above the first touch and its place (mm).
    """
    wheel = pair.wheel
    p = wheel.evaluate(wheel.at_arc_length(np.arange(STEP_MM, wheel.length_mm, STEP_MM)))
    along, depth = pair.tape_circle_y_mm + p.y, pair.rolling_radius_mm - p.z
    y = shift_mm + along * math.cos(roll_rad) + depth * math.sin(roll_rad)
    z = along * math.sin(roll_rad) - depth * math.cos(roll_rad)
    gap = z - np.interp(y, *rail_seen_from_above(), left=-np.inf, right=-np.inf)
    gap = np.where(np.isfinite(gap), gap, 1e3)
    low = float(gap.min())
    places, _ = find_peaks(-gap, prominence=prominence_mm)
    return -low, sorted((float(gap[k]) - low, float(p.y[k])) for k in places if gap[k] <= low + TOUCH_REACH_MM)


def assert_right(pair: Pair, shift_mm: float, roll_rad: float = 0.0, *, prominence_mm: float = 5e-7) -> int:
    """Check that the contact points are all minima of the gap, with no gap below zero.

    Returns the number of contact points. Chords leave ripples of 1.5e-7 mm, which do not count as minima.
    """
    placement = pair.placed(shift_mm, roll_rad, 0.0)
    assert isinstance(placement, Placement), placement
    axle, expected = all_minima(pair, shift_mm, roll_rad, prominence_mm)
    assert placement.wheel.centre_mm[2] == pytest.approx(axle, abs=1e-6)
    minima = [(touch.vertical_gap_mm, touch.wheel_y_mm) for touch in placement.contact_points]
    assert len(minima) == len(expected), (minima, expected)
    for (gap, y), (expected_gap, expected_y) in zip(minima, expected, strict=True):
        assert gap == pytest.approx(expected_gap, abs=1e-6)
        # where the gap is flat the ripples move its lowest place: 2 * 1.5e-7 mm on 1/2000 per mm
        assert y == pytest.approx(expected_y, abs=0.04)
    return len(minima)


# Depth, middle and half-width of the hollow, shift and roll (mm, mrad), found at random.
THREE_POINTS = [
    (0.374, -10.98, 11.05, 4.753, 0.082),
    (0.423, -11.52, 14.35, 4.990, -0.875),
    (0.234, -14.79, 14.69, 3.754, -0.155),
    (0.580, -6.71, 7.01, -0.426, 0.593),
    (0.112, -4.19, 6.40, 4.669, -0.687),
]


@pytest.mark.parametrize(("depth", "middle", "width", "shift", "roll_mrad"), THREE_POINTS)
def test_worn_wheels_touch_at_three_points(depth, middle, width, shift, roll_mrad):
    assert assert_right(pair_with(hollow(depth, middle, width)), shift, 1e-3 * roll_mrad) == 3


@pytest.mark.parametrize("seed", range(3))
def test_worn_wheels_at_random(seed):
    rng = np.random.default_rng(seed)
    pair = pair_with(hollow(rng.uniform(0.05, 0.8), rng.uniform(-15.0, 15.0), rng.uniform(5.0, 20.0)))
    for shift, roll in zip(rng.uniform(-5.0, 6.5, 4), rng.uniform(-1e-3, 1e-3, 4), strict=True):
        assert assert_right(pair, shift, roll) >= 1


def shift_of_the_roots(pair: Pair) -> float:
    """Shift at which the centres of the root and of the gauge corner (R 13) lie above each other."""
    rail = pair.rail
    corner = next(arc for arc in rail.profile.segments if isinstance(arc, Arc) and arc.radius == 13.0)
    root = pair.wheel.segments[1]
    assert isinstance(root, Arc)
    return float(rail.point(*map(np.asarray, corner.centre))[0]) - 750.0 - root.centre[0]


@pytest.mark.parametrize("radius", [12.74, 12.9, 12.99, 13.01, 13.1, 13.26])
def test_a_root_that_conforms_to_the_gauge_corner(radius):
    """Radii within 2 % of each other.

    The root leans against the corner, or one of its ends does.
    """
    pair = pair_with(root_wheel(radius))
    middle, wide = shift_of_the_roots(pair), radius - 13.0
    for share in (0.1, 0.5, 0.7, 0.9, 1.3):
        shift = middle + wide * share
        assert_right(pair, shift)
        angle = pair.placed(shift, 0.0, 0.0).first.contact_angle_rad
        if wide > 0.0:
            # one circle in the other: the line through both centres is normal to both
            closed = min(max(math.asin(min(share, 1.0)), FLAT), STEEP)
            # a gap of 1 % of a circle's curvature and less: the root of its slope to rounding
            assert angle == pytest.approx(closed, abs=1e-8)
        else:
            assert min(abs(angle - FLAT), abs(angle - STEEP)) < 1e-8


def test_a_root_of_the_corners_own_radius_touches_it_somewhere_or_is_refused():
    pair = pair_with(root_wheel(13.0))
    middle = shift_of_the_roots(pair)
    for off in (-1e-3, -1e-9, 0.0, 1e-9, 1e-3):
        placement = pair.placed(middle + off, 0.0, 0.0)
        if isinstance(placement, Placement):
            axle, _ = all_minima(pair, middle + off, 0.0, 5e-7)
            assert placement.wheel.centre_mm[2] == pytest.approx(axle, abs=1e-6)
        else:
            assert "\n" not in placement


@pytest.mark.parametrize("shift", [6.6, 6.62, 6.65, 6.68, 6.7])
def test_the_standard_pair_without_roll_where_it_passes_to_the_flank(shift):
    assert assert_right(pair_with(load_library_profile("S1002")), shift) >= 1


@pytest.mark.parametrize("name", ["S1002", "hollow"])
@pytest.mark.parametrize("seed", [1, 2])
def test_contact_points_do_not_depend_on_the_nodes_of_the_search(name, seed, monkeypatch):
    pair = pair_with(load_library_profile(name) if name == "S1002" else hollow(*THREE_POINTS[0][:3]))
    shifts = (-3.0, 0.1, 4.753, 6.65)
    placements = [pair.placed(shift, 1e-4, 0.0) for shift in shifts]
    move = np.random.default_rng(seed).uniform(0.1, 0.9)

    def search_between_nodes(profile: Profile) -> tuple[np.ndarray, CurvePoints]:
        u, _ = sample_profile(profile)
        u = np.concatenate([u[:1], u[:-1] + move * np.diff(u), u[-1:]])
        return u, profile.evaluate(u)

    monkeypatch.setattr(placement_module, "sample_profile", search_between_nodes)
    for placement, shift in zip(placements, shifts, strict=True):
        moved_placement = pair.placed(shift, 1e-4, 0.0)
        assert len(placement.contact_points) == len(moved_placement.contact_points)
        for a, b in zip(placement.contact_points, moved_placement.contact_points, strict=True):
            # roots of the slope to rounding, over the flattest gap here (1/2000 per mm)
            assert a.rail_y_mm == pytest.approx(b.rail_y_mm, abs=1e-8)
            assert a.vertical_gap_mm == pytest.approx(b.vertical_gap_mm, abs=1e-11)


# --- refusals -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        Case(lateral_shift_mm=15.0, roll="given"),
        Case(lateral_shift_mm=6.5, roll="touching"),
        Case(lateral_shift_mm=-60.0, roll="touching", yaw_rad=5e-3),
        pytest.param(Case(lateral_shift_mm=-60.0, roll="touching", flange_climb=True), marks=pytest.mark.slow),
    ],
    ids=["alone", "wheelset", "yawed", "climbing"],
)
def test_a_refused_shift_names_the_range_that_works(case):
    with pytest.raises(InputError) as refused:
        place_case(case)
    assert "\n" not in str(refused.value)
    low, high = re.search(r"shifts between (\S+) and (\S+) mm \(in steps", str(refused.value)).groups()
    # on the steps of that search; without a wheelset each refusal is a search
    for share in (0.0, 0.3, 0.7, 1.0):
        shift = float(low) + share * (float(high) - float(low))
        place_case(replace(case, lateral_shift_mm=round(2.0 * shift) / 2.0))
    if case.roll != "given":
        wheelset = make_wheelset(case)
        for shift_mm in (float(low) - 0.5, float(high) + 0.5):
            assert isinstance(wheelset.at(shift_mm, case.yaw_rad), str)


def test_a_climbing_flange_is_taken_if_it_is_asked_for():
    derailing = pair_with(load_library_profile("S1002")).placed(8.5, 0.0, 0.0)
    assert "derails" in derailing
    assert derailing.endswith("beyond the steepest place of its flange (--flange-climb allows this)")
    climbing = [place_case(Case(lateral_shift_mm=shift, roll="given", flange_climb=True)) for shift in (7.0, 8.5, 12.0)]
    assert [placement.climbs for placement in climbing] == [False, True, True]
    angles = [placement.first.contact_angle_rad for placement in climbing]
    assert angles == sorted(angles, reverse=True)
    # the top of the flange on the far side of the head
    pair = set_up_pair(
        load_library_profile("60E1"), load_library_profile("S1002"), inclination_rad=-0.1, flange_climb=True
    )
    assert pair.placed(60.0, 0.0, 0.0).endswith("beyond the top of its flange")


def test_a_flank_through_points_is_a_flank():
    # a spline through points of a straight flank is steepest somewhere on it by 1e-6 and less
    pair = pair_with(hollow(0.3, 0.0, 15.0))
    angles = [pair.placed(shift, 0.0, 0.0).first.contact_angle_rad for shift in (6.9, 7.0, 7.2)]
    assert [math.degrees(angle) for angle in angles] == pytest.approx([70.0] * 3, abs=0.2)
