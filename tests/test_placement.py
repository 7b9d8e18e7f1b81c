"""Placing a wheel on a rail: published positions, another code's contact points, and the gap against brute force."""

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from fecontact.case import Case, Track
from fecontact.errors import InputError
from fecontact.placement.carrying import is_beyond_flank
from fecontact.placement.poses import RailPose, WheelPose, place_rail
from fecontact.placement.wheel_on_rail import OPEN_GAP_MM, Placement, describe_possible_shifts, place
from fecontact.profiles.curve import Profile, make_circular_rail_head, make_cylinder_wheel
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.segments import Polynomial, StraightSegment
from fecontact.solving.placing import place_case

INCLINATION_40 = math.atan(1.0 / 40.0)
INCLINATION_20 = math.atan(1.0 / 20.0)
CENTRED = Track(rail_crown_y_mm=750.0)


def standard_pair(shift: float, **motion: float) -> Placement:
    """Placement of S1002 on 60E1 1:40 at a lateral shift (mm)."""
    return place(
        load_library_profile("60E1"),
        load_library_profile("S1002"),
        inclination_rad=INCLINATION_40,
        lateral_shift_mm=shift,
        **motion,
    )


def highest_point(rail: RailPose) -> tuple[float, float]:
    """Lateral position and height of the highest point, by golden-section search over the parameter."""
    u = np.linspace(0.0, len(rail.profile.segments), 20001)
    top = int(np.nanargmax(rail.section(u)[1]))
    low, high = u[top - 1], u[top + 1]
    for _ in range(80):
        a, b = high - 0.618034 * (high - low), low + 0.618034 * (high - low)
        if rail.section(a)[1] > rail.section(b)[1]:
            high = b
        else:
            low = a
    y, z, _ = rail.section(0.5 * (low + high))
    return float(y), float(z)


# --- rails in the track -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "inclination", "crown", "crown_beyond"),
    [
        # Crown and highest point from the track centre. The gauge is 1435 mm, measured 14 mm below the highest point.
        ("60E1", INCLINATION_40, 753.035, 7.497),
        ("60E1", INCLINATION_20, 752.512, 11.494),
        ("60E2", INCLINATION_40, 753.000, 4.997),
    ],
)
def test_rail_is_set_to_gauge(name, inclination, crown, crown_beyond):
    rail = place_rail(load_library_profile(name), inclination, Track())
    top_y, top_z = highest_point(rail)
    # published to 0.001 mm
    assert rail.crown_y_mm == pytest.approx(crown, abs=6e-4)
    # published along the tilted head and rounded: 60E2 has 200 sin cos = 4.9969 instead of the exact 200 sin = 4.9984
    assert top_y - rail.crown_y_mm == pytest.approx(crown_beyond, abs=2e-3)
    # the golden section finds the flat top to about 1e-6 mm in y, and so its height to rounding
    assert top_z == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize(("name", "radius"), [("60E1", 300.0), ("60E2", 200.0)])
def test_highest_point_lies_below_the_centre_of_the_crown_arc(name, radius):
    rail = place_rail(load_library_profile(name), INCLINATION_40, Track())
    # closed form on the crown arc; the search stops at the square root of rounding
    assert highest_point(rail)[0] - rail.crown_y_mm == pytest.approx(radius * math.sin(INCLINATION_40), abs=1e-4)


def test_gauge_plane_cuts_the_gauge_face():
    track = Track(gauge_mm=1432.0, gauge_depth_mm=16.0)
    rail = place_rail(load_library_profile("60E1"), INCLINATION_40, track)
    u = np.linspace(0.0, len(rail.profile.segments), 200001)
    y, z, _ = rail.section(u)
    gauge_side = y < rail.crown_y_mm
    # linear interpolation between points 0.5 um apart
    assert np.interp(-16.0, z[gauge_side], y[gauge_side]) == pytest.approx(716.0, abs=1e-6)


def test_head_without_gauge_face_is_refused_or_placed_by_its_crown():
    with pytest.raises(InputError, match=r"14 mm below it; .* position of the rail's crown"):
        place_rail(make_circular_rail_head(300.0), 0.0, Track())
    assert place_rail(make_circular_rail_head(300.0), 0.0, CENTRED).crown_y_mm == 750.0


# --- contact points -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shift", "rail_y"), [(-4.0, 4.60), (0.0, 0.20), (2.0, -11.72)])
def test_contact_points_of_the_standard_pair(shift, rail_y):
    # from an independent program, to 0.01 mm; at 0 mm the gap is flat, so the value here is uncertain by 0.01 mm too
    assert standard_pair(shift).first.rail_y_mm == pytest.approx(rail_y, abs=0.02)


@pytest.mark.parametrize("shift", [-4.0, 0.0, 2.0, 6.0, 7.0])
def test_tangents_are_equal_at_touch(shift):
    pair = standard_pair(shift)
    for touch in pair.contact_points:
        rail_angle = math.atan(float(load_library_profile("60E1").slope(touch.rail_y_mm))) + INCLINATION_40
        wheel_angle = math.atan(float(load_library_profile("S1002").slope(touch.wheel_y_mm)))
        # without roll and yaw, both tangents are tangents of the plane profiles; the root is exact to 1e-14 in u
        assert rail_angle == pytest.approx(touch.contact_angle_rad, abs=1e-9)
        assert wheel_angle == pytest.approx(touch.contact_angle_rad, abs=1e-9)
        assert touch.normal @ touch.tangent == pytest.approx(0.0, abs=1e-15)
        assert touch.normal[2] > 0.0


@pytest.mark.parametrize(
    ("shift", "first", "further", "height"),
    [(0.0, 0.192, -10.425, 0.00847), (0.25, -10.569, -0.861, 0.00066)],
)
def test_two_contact_points_around_the_jump(shift, first, further, height):
    # frozen values, in addition to the exact checks of this file: the contact point jumps by 10 mm between these shifts
    pair = standard_pair(shift)
    assert [t.rail_y_mm for t in pair.contact_points] == pytest.approx([first, further], abs=2e-3)
    assert [t.vertical_gap_mm for t in pair.contact_points] == pytest.approx([0.0, height], abs=2e-5)


@pytest.mark.parametrize(
    ("shift", "motion"),
    [
        (-4.0, {}),
        (0.0, {}),
        (0.25, {}),
        (6.0, {}),
        (6.0, {"yaw_rad": 0.02}),
        (1.0, {"roll_rad": 1e-3, "yaw_rad": -0.01}),
    ],
)
def test_rigid_bodies_touch_without_overlap(shift, motion):
    pair = standard_pair(shift, **motion)
    gap, x, y = vertical_gaps(pair)
    best = np.unravel_index(np.argmin(gap), gap.shape)
    # samples every 0.03 mm, curvatures of at most 1/13 + 1/13 per mm: the error of the minimum is less than 2e-5 mm,
    # and the chords of the interpolated rail are at most 2e-5 mm below the arc
    assert -2e-5 < gap[best] < 2e-5
    if len(pair.contact_points) == 1:
        # limit from a height of 2e-5 mm and the flattest gap here (1/2000 per mm)
        assert y[best] == pytest.approx(pair.first.y_mm, abs=0.3)
        assert x[best] == pytest.approx(pair.first.x_mm, abs=0.5)


def vertical_gaps(pair: Placement):
    """Vertical distance of a dense cloud of the revolved wheel from the rail; the pose is built from scratch."""
    wheel, rail = pair.wheel, pair.rail
    u = wheel.profile.at_arc_length(np.arange(0.0, wheel.profile.length_mm, 0.03))
    p = wheel.profile.evaluate(u[np.isfinite(u)])
    middle = (pair.first.x_mm - float(wheel.point(pair.first.wheel_y_mm, 0.0, 0.0)[0])) / 440.0
    theta = middle + np.linspace(-4.0, 4.0, 81) / 440.0
    r = wheel.rolling_radius_mm - p.z
    local = np.stack(
        [
            r[None] * np.sin(theta)[:, None],
            np.broadcast_to(wheel.tape_circle_y_mm + p.y, (theta.size, p.y.size)),
            -r[None] * np.cos(theta)[:, None],
        ],
        axis=-1,
    )
    world = wheel.centre_mm + local @ wheel.axes.T
    us = np.linspace(0.0, len(rail.profile.segments), 8001)
    y, z, _ = rail.section(us)
    rising = np.concatenate([[True], np.diff(y) > 0]) & (np.maximum.accumulate(y) == y)
    height = np.interp(world[..., 1], y[rising], z[rising], left=-1e3, right=-1e3)
    # the overhanging part of the gauge face is not visible from above
    return world[..., 2] - height, world[..., 0], world[..., 1]


@pytest.mark.parametrize(("roll", "yaw"), [(0.0, 0.0), (2e-3, 0.0), (0.0, 0.015), (-1e-3, -0.02)])
def test_wheelset_turns_about_its_centre_roll_first(roll, yaw):
    pair = standard_pair(-2.0, roll_rad=roll, yaw_rad=yaw)
    turn = Rotation.from_euler("xz", [roll, yaw]).as_matrix()  # extrinsic: about x of the track, then z
    np.testing.assert_allclose(pair.wheel.axes, turn, atol=1e-15)
    assert pair.wheel.centre_mm[:2] == pytest.approx([0.0, -2.0])
    # positive yaw moves this wheel backwards; its axle end is at -sin(yaw) times half the width of the wheelset
    tape = pair.wheel.point(0.0, 0.0, 0.0)
    assert tape[0] == pytest.approx(-750.0 * math.sin(yaw) * math.cos(roll), abs=1e-9)
    assert tape[2] - pair.wheel.centre_mm[2] == pytest.approx(750.0 * math.sin(roll), abs=1e-9)


def test_yawed_flange_touches_ahead_or_behind():
    # on a flange of angle g under a yaw a, the contact point is ahead by about R tan(g) a
    for yaw in (0.01, -0.01):
        pair = standard_pair(6.0, yaw_rad=yaw)
        touch = pair.first
        ahead = touch.x_mm - float(pair.wheel.point(touch.wheel_y_mm, 0.0, 0.0)[0])
        expected = float(pair.wheel.radius(touch.wheel_u)) * math.tan(touch.contact_angle_rad) * yaw
        # the remainder is of second order in the yaw: 1 % here
        assert ahead == pytest.approx(expected, rel=0.01)


# --- the wheelset of the Manchester Contact Benchmark -----------------------------------------------------------

# Manchester Contact Benchmark, case, solved by CONTACT 25: shift to the right (mm), yaw (mrad), contact position
# from the highest point of the rail (mm, here positive to the field side) and contact angle (rad) of a single wheel.
MANCHESTER_RIGHT = [
    (2.0, 4.8, -19.6178, 0.0806),
    (3.0, 7.2, -20.5627, 0.0923),
    (4.0, 9.6, -21.7944, 0.1078),
]
MANCHESTER_LEFT = [
    (1.0, 2.4, -5.2886, 0.0176),
    (2.0, 4.8, -4.0270, 0.0134),
    (3.0, 7.2, -3.2967, 0.0110),
    (4.0, 9.6, -2.8681, 0.0096),
]


def wheelset(shift_right: float, yaw: float) -> tuple[Placement, Placement]:
    """Left and right wheel of a wheelset as two pairs, rolled until both wheels touch."""

    def pairs(roll: float) -> tuple[Placement, Placement]:
        """Left and right placement of the wheelset at a roll (rad)."""
        # the right pair is a mirror image: shift, roll and yaw change their signs
        return tuple(
            place(
                load_library_profile("MBench_UIC60"),
                load_library_profile("S1002"),
                inclination_rad=INCLINATION_40,
                lateral_shift_mm=sign * shift_right,
                roll_rad=-sign * roll,
                yaw_rad=-sign * yaw,
            )
            for sign in (-1.0, 1.0)
        )

    def step(roll: float) -> float:
        left, right = pairs(roll)
        return float(left.wheel.centre_mm[2] - right.wheel.centre_mm[2])

    return pairs(brentq(step, -2e-3, 2e-3, xtol=1e-9))


@pytest.mark.parametrize(("shift", "yaw_mrad", "position", "angle"), MANCHESTER_RIGHT)
def test_manchester_right_wheel(shift, yaw_mrad, position, angle):
    _, right = wheelset(shift, 1e-3 * yaw_mrad)
    # the reference is the centre of a small patch, up to 0.05 mm from the rigid contact point (measured 0.048)
    assert right.first.y_mm - highest_point(right.rail)[0] == pytest.approx(position, abs=0.05)
    # limit: this distance times the change of slope there (1/60 per mm)
    assert right.first.contact_angle_rad == pytest.approx(angle, abs=8e-4)


@pytest.mark.parametrize(("shift", "yaw_mrad", "position", "angle"), MANCHESTER_LEFT)
def test_manchester_left_wheel(shift, yaw_mrad, position, angle):
    left, _ = wheelset(shift, 1e-3 * yaw_mrad)
    touch = left.first
    contact_y_mm = touch.y_mm - highest_point(left.rail)[0]
    # the reference is the centre of the patch. The decreasing curvature of the tread moves this centre by up to 0.28 mm
    # to the gauge side; the reference angle is the angle of the rail at this centre
    assert -0.01 < contact_y_mm - position < 0.30
    y_centre = position + highest_point(left.rail)[0]
    at_centre = float(left.rail.section(left.rail.parameter_at_y(y_centre))[2])
    # the file has four decimals
    assert at_centre == pytest.approx(angle, abs=1e-4)


# --- the gap ----------------------------------------------------------------------------------------------------


def gap_over_plane(pair: Placement):
    """Gap along the normal at the first contact point.

    The places (x, t) are in the tangent plane there. The wheel's section is at the first contact point.
    """

    def gap_at(x, t):
        section = pair.wheel_over_plane
        x, t = np.broadcast_arrays(x, t)
        heights = [
            replace(section, origin=section.origin + np.array([place, 0.0, 0.0])).heights(places)
            for place, places in zip(x[:, 0], t, strict=True)
        ]
        return np.array(heights) - pair.rail_over_plane(t)[1]

    return gap_at


def test_gap_of_a_circle_under_a_cylinder_in_closed_form():
    pair = place(make_circular_rail_head(300.0), make_cylinder_wheel(), inclination_rad=0.0, track=CENTRED)
    x, s = np.meshgrid(np.linspace(-20.0, 20.0, 21), np.linspace(-20.0, 20.0, 17), indexing="ij")
    phi = s / 300.0
    # distance along the normal of the rail, from the circle to the cylinder with its axis along y
    closed = (460.0 - np.sqrt(460.0**2 - x**2) + 300.0 * (1.0 - np.cos(phi))) / np.cos(phi)
    # Newton's method stops at 1e-12 mm
    np.testing.assert_allclose(pair.gap(x, s), closed, atol=1e-11)
    t = 300.0 * np.sin(phi)
    over_plane = 460.0 - np.sqrt(460.0**2 - x**2) + 300.0 - np.sqrt(300.0**2 - t**2)
    np.testing.assert_allclose(gap_over_plane(pair)(x, t), over_plane, atol=1e-11)


def brute_force_gap(pair: Placement, motion: dict[str, float], x, s):
    """March along the rail's normal until the wheel's material begins, then bisect; the wheel is a dense polyline."""
    turn = Rotation.from_euler("xz", [motion.get("roll_rad", 0.0), motion.get("yaw_rad", 0.0)])
    table = pair.wheel.profile.evaluate(pair.wheel.profile.at_arc_length(np.linspace(30.0, 150.0, 240001)))
    good = np.isfinite(table.y) & (np.concatenate([[1.0], np.diff(table.y)]) > 0)
    points, normals = pair.surface(x, s)

    def outside(point):
        local = turn.inv().apply(point - pair.wheel.centre_mm)
        radius = 460.0 - np.interp(local[1] - 750.0, table.y[good], table.z[good])
        return math.hypot(local[0], local[2]) - radius

    gaps = []
    for point, normal in zip(points, normals, strict=True):
        steps = np.arange(-0.05, 4.0, 0.1)
        values = np.array([outside(point + t * normal) for t in steps])
        first = int(np.flatnonzero(values < 0.0)[0])
        gaps.append(brentq(lambda t, p=point, n=normal: outside(p + t * n), steps[first - 1], steps[first]))
    return np.array(gaps)


@pytest.mark.parametrize(
    ("shift", "motion"),
    [
        (-4.0, {}),
        (2.0, {"yaw_rad": 0.01}),
        (6.0, {"yaw_rad": -0.02, "roll_rad": 1e-3}),
        (0.0, {"roll_rad": -2e-3}),
    ],
)
def test_gap_equals_a_ray_search(shift, motion):
    pair = standard_pair(shift, **motion)
    rng = np.random.default_rng(3)
    x, s = rng.uniform(-12.0, 12.0, 15), rng.uniform(-4.0, 4.0, 15)
    # chords of 0.5 um of the polyline cause an error of 1e-8 mm
    np.testing.assert_allclose(pair.gap(x, s), brute_force_gap(pair, motion, x, s), atol=1e-7)


@pytest.mark.parametrize(
    ("shift", "motion"),
    [
        (-4.0, {}),
        (-4.0, {"yaw_rad": 0.02}),
        (2.0, {}),
        (2.0, {"yaw_rad": -0.02, "roll_rad": 1e-3}),
        (6.0, {"yaw_rad": 0.01}),
    ],
)
def test_hessian_of_the_gap_is_the_relative_curvature(shift, motion):
    pair = standard_pair(shift, **motion)
    (curvature,) = pair.first.curvatures
    h = 0.05

    def differences(gap):
        """Hessian, slopes and value of a gap at the origin, by central differences."""
        d = np.array([-h, 0.0, h])
        g = gap(d[:, None], d[None, :])
        xx = (g[0, 1] - 2.0 * g[1, 1] + g[2, 1]) / h**2
        yy = (g[1, 0] - 2.0 * g[1, 1] + g[1, 2]) / h**2
        xy = (g[2, 2] - g[2, 0] - g[0, 2] + g[0, 0]) / (4.0 * h**2)
        slopes = [(g[2, 1] - g[0, 1]) / (2.0 * h), (g[1, 2] - g[1, 0]) / (2.0 * h)]
        return np.array([[xx, xy], [xy, yy]]), slopes, g[1, 1]

    for gap in (pair.gap, gap_over_plane(pair)):
        hessian, slopes, value = differences(gap)
        # central differences: h^2 / 12 times the fourth derivative, which the eighth-degree tread and the root of
        # R 13 keep below 1e-3 per mm^3, so 2e-7; rounding adds 1e-12 / h^2
        np.testing.assert_allclose(hessian, curvature.hessian, atol=3e-6)
        # at the contact point, gap and slope vanish; the third derivative adds h^2 / 6 times itself to the slope
        np.testing.assert_allclose(slopes, 0.0, atol=2e-5)
        assert value == pytest.approx(0.0, abs=1e-10)


def test_curvatures_of_the_parts():
    touch = standard_pair(-4.0).first
    (c,) = touch.curvatures
    assert c.rail_per_mm == pytest.approx(1.0 / 300.0, rel=1e-9)
    assert c.wheel_lateral_per_mm == pytest.approx(
        float(load_library_profile("S1002").curvature(touch.wheel_y_mm)), rel=1e-9
    )
    # Meusnier: the rolling curvature is the curvature of the circle of latitude times the cosine of the contact angle
    latitude = 460.0 - float(load_library_profile("S1002").height(touch.wheel_y_mm))
    assert c.xx_per_mm == pytest.approx(math.cos(touch.contact_angle_rad) / latitude, rel=1e-12)
    assert c.yy_per_mm == pytest.approx(c.rail_per_mm + c.wheel_lateral_per_mm, rel=1e-12)
    assert c.xy_per_mm == 0.0


def test_touch_at_a_junction_has_a_curvature_for_each_side():
    rail = load_library_profile("60E1")
    junction = next(j for j in rail.junctions if j.y_mm > 0.0)
    # the head is turned until the junction of R 300 and R 80 is its highest point, below a straight tread
    pair = place(rail, make_cylinder_wheel(), inclination_rad=-junction.angle_left_rad)
    touch = pair.first
    assert touch.rail_y_mm == pytest.approx(junction.y_mm, abs=1e-3)
    assert touch.at_junction
    gauge, field = touch.curvatures
    assert gauge.yy_per_mm == pytest.approx(1.0 / 300.0, rel=1e-9)
    assert field.yy_per_mm == pytest.approx(1.0 / 80.0, rel=1e-9)
    # one-sided differences of the true gap on either side
    for curvature, side in ((gauge, -1.0), (field, 1.0)):
        s = side * np.array([1.0, 2.0])
        second = 2.0 * pair.gap(0.0, s) / s**2
        # the contact point is within 1e-3 mm of the junction: at 1 mm, this is the share of the curvature across it
        np.testing.assert_allclose(second, curvature.yy_per_mm, rtol=5e-3)
    assert not standard_pair(-4.0).first.at_junction


# --- invariances ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("shift", "roll"), [(-4.0, 0.0), (6.0, 1e-3)])
def test_opposite_yaw_mirrors_the_gap(shift, roll):
    x, s = np.linspace(-15.0, 15.0, 13)[:, None], np.linspace(-4.0, 4.0, 9)[None, :]
    placement = standard_pair(shift, roll_rad=roll, yaw_rad=0.01)
    opposite = standard_pair(shift, roll_rad=roll, yaw_rad=-0.01)
    np.testing.assert_allclose(placement.gap(x, s), opposite.gap(-x, s), atol=1e-10)
    assert placement.first.x_mm == pytest.approx(-opposite.first.x_mm, abs=1e-9)
    assert placement.first.curvatures[0].xy_per_mm == pytest.approx(-opposite.first.curvatures[0].xy_per_mm, rel=1e-6)
    # yaw changes the gap by at least x s R k tan(g)
    assert np.abs(placement.gap(x, s) - opposite.gap(x, s)).max() > 1e-3


def test_the_gap_without_yaw_is_even_in_x():
    x, s = np.linspace(0.0, 15.0, 7)[:, None], np.linspace(-4.0, 4.0, 9)[None, :]
    pair = standard_pair(2.0, roll_rad=1e-3)
    np.testing.assert_allclose(pair.gap(x, s), pair.gap(-x, s), atol=1e-12)


def test_moving_wheelset_and_rail_together_changes_nothing():
    x, s = np.linspace(-15.0, 15.0, 7)[:, None], np.linspace(-4.0, 4.0, 9)[None, :]
    near = standard_pair(2.0)
    far = place(
        load_library_profile("60E1"),
        load_library_profile("S1002"),
        inclination_rad=INCLINATION_40,
        lateral_shift_mm=2.0 - 10.0,
        track=Track(gauge_mm=1435.0 + 14.0, back_to_back_mm=1360.0 + 34.0),
    )
    assert far.first.y_mm - near.first.y_mm == pytest.approx(7.0, abs=1e-9)
    np.testing.assert_allclose(far.gap(x, s), near.gap(x, s), atol=1e-10)


def test_shift_of_a_cylinder_over_a_circle_changes_nothing():
    gaps = [
        place(
            make_circular_rail_head(300.0),
            make_cylinder_wheel(),
            inclination_rad=0.0,
            lateral_shift_mm=shift,
            track=CENTRED,
        ).gap(np.linspace(-9.0, 9.0, 7)[:, None], np.linspace(-9.0, 9.0, 7)[None, :])
        for shift in (0.0, 11.0)
    ]
    np.testing.assert_allclose(gaps[0], gaps[1], atol=1e-12)


# --- the rail's surface coordinates -----------------------------------------------------------------------------


@pytest.mark.parametrize("shift", [-4.0, 2.0, 6.0])
def test_project_inverts_surface(shift):
    pair = standard_pair(shift, yaw_rad=0.01)
    rng = np.random.default_rng(5)
    x, s, lift = rng.uniform(-15.0, 15.0, 400), rng.uniform(-8.0, 8.0, 400), rng.uniform(0.0, 0.5, 400)
    points, normals = pair.surface(x, s)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-14)
    np.testing.assert_allclose(pair.project(points + lift[:, None] * normals), np.column_stack([x, s]), atol=1e-9)


def test_surface_runs_by_arc_length_from_first_touch():
    pair = standard_pair(-2.0)
    origin, _ = pair.surface(0.0, 0.0)
    touch = pair.first
    np.testing.assert_allclose(origin, [touch.x_mm, touch.y_mm, touch.z_mm], atol=1e-10)
    s = np.linspace(-6.0, 6.0, 12001)
    points, _ = pair.surface(0.0, s)
    # chords of 1 um on R 80 and R 300 are too short by less than 1e-9 in total
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(12.0, abs=1e-7)


def test_points_off_the_running_surface_do_not_project():
    pair = standard_pair(0.0)
    with pytest.raises(InputError, match="beyond the running surface of the rail"):
        # points below the end of the side of the head; a point beside the head projects on the corner or on the side
        pair.project(np.array([[0.0, pair.first.y_mm + 60.0, -60.0]]))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_points_beside_a_head_project_on_its_corner_and_side(side):
    # a wheel is wider than a thin head: A100 ends 50 mm from its middle, and the centre of its corner is at 40 mm
    pair = place(
        load_library_profile("A100"),
        make_cylinder_wheel(),
        inclination_rad=0.0,
        rolling_radius_mm=400.0,
        track=Track(rail_crown_y_mm=750.0),
    )
    z_centre = math.sqrt(490.0**2 - 40.0**2) - 500.0
    points = np.array([[0.0, 750.0 + side * 52.0, 0.0]])
    (_, s), *_ = pair.project(points)
    ((_, y, z),), _ = pair.surface(np.zeros(1), np.array([s]))
    away = math.hypot(12.0, z_centre)
    assert (y - 750.0, z) == pytest.approx((side * (40.0 + 120.0 / away), z_centre - 10.0 * z_centre / away), abs=1e-6)


def test_gap_is_open_where_the_wheel_is_missing():
    narrow = make_cylinder_wheel(-10.0, 10.0)
    pair = place(make_circular_rail_head(300.0), narrow, inclination_rad=0.0, track=CENTRED)
    assert pair.gap(0.0, 15.0) == OPEN_GAP_MM
    assert pair.gap(0.0, 9.0) < 1.0


def test_the_side_of_a_line_that_does_not_turn_is_its_end():
    arc = np.linspace(0.0, 40.0, 401)
    profile = SimpleNamespace(
        spread=lambda _: arc, arc_length=lambda u: u, evaluate=lambda u: SimpleNamespace(angle_rad=np.zeros_like(u))
    )
    placement = SimpleNamespace(rail=SimpleNamespace(profile=profile), first_arc_length_mm=20.0)
    assert Placement.side_mm(placement, -13.0) == pytest.approx(7.0, abs=1e-9)
    assert Placement.side_mm(placement, 13.0) == pytest.approx(7.0, abs=1e-9)


# --- positions that cannot be ------------------------------------------------------------------------------------


def test_derailing_wheel_is_refused_with_the_possible_range():
    with pytest.raises(InputError, match=r"shift 15 mm: the wheel derails.*between -?[\d.]+ and 7\.5 mm"):
        standard_pair(15.0)
    assert standard_pair(7.5).first.contact_angle_rad > 1.2


@pytest.mark.parametrize("shift", [-75.0])
def test_wheel_that_leaves_the_rail_is_refused_with_the_possible_range(shift):
    with pytest.raises(InputError, match=r"(leaves the rail|is not above the rail).*shifts between .* and 7\.5 mm"):
        standard_pair(shift)


def test_no_position_at_all():
    with pytest.raises(InputError, match="no shift between -40 and 40 mm is possible"):
        place(
            load_library_profile("60E1"),
            load_library_profile("S1002"),
            inclination_rad=0.0,
            track=Track(rail_crown_y_mm=1500.0),
            lateral_shift_mm=0.0,
        )


def test_radius_and_silhouette_without_motion():
    pose = standard_pair(0.0).wheel
    u = pose.profile.locate(np.array([-20.0, 0.0, 20.0]))
    theta, x, y, z = pose.silhouette(u)
    # without yaw the outline is the lowest line of the wheel
    np.testing.assert_allclose(theta, 0.0, atol=1e-15)
    np.testing.assert_allclose(x, 0.0, atol=1e-12)
    np.testing.assert_allclose(y - 750.0, [-20.0, 0.0, 20.0], atol=1e-9)
    np.testing.assert_allclose(pose.centre_mm[2] - z, pose.radius(u), atol=1e-9)
    assert isinstance(pose, WheelPose)


def test_an_upright_flange_is_a_flange():
    wheel = Profile(
        name="upright",
        kind="wheel",
        segments=(
            StraightSegment(start=(-35.0, -28.0), end=(-35.0, 0.0)),
            StraightSegment(start=(-35.0, 0.0), end=(60.0, 0.0)),
        ),
    )
    track = Track()
    rail = make_circular_rail_head(300.0, half_width_mm=30.0)
    options = {"inclination_rad": 0.0, "rolling_radius_mm": 460.0}
    placement = place(rail, wheel, track=replace(track, rail_crown_y_mm=track.tape_circle_y_mm), **options)
    assert placement.first.wheel_y_mm == pytest.approx(0.0, abs=1e-6)


def flat_wheel_on(*segments) -> Placement:
    rail = Profile(name="bumps", kind="rail", segments=segments)
    return place(rail, make_cylinder_wheel(), inclination_rad=0.0, track=CENTRED)


def test_three_points_touch_at_once():
    # -c y^2 (y^2 - 100)^2: three equal tops at -10, 0 and 10 mm
    c = 1e-9
    bumps = Polynomial(y_from=-20.0, y_to=20.0, coefficients=(0.0, 0.0, -1e4 * c, 0.0, 2e2 * c, 0.0, -c))
    touches = flat_wheel_on(bumps).contact_points
    assert sorted(touch.rail_y_mm for touch in touches) == pytest.approx([-10.0, 0.0, 10.0], abs=1e-6)
    assert [touch.vertical_gap_mm for touch in touches] == pytest.approx([0.0] * 3, abs=1e-12)
    # half the second derivative is 1e4 c at the middle top and 4e4 c at the outer tops
    curvatures = {round(touch.rail_y_mm): touch.curvature.rail_per_mm for touch in touches}
    assert curvatures == pytest.approx({0: 2e4 * c, -10: 8e4 * c, 10: 8e4 * c}, rel=1e-6)


@pytest.mark.parametrize(("degrees", "has_flange"), [(43.0, False), (47.0, True)])
def test_a_line_that_is_nowhere_steeper_than_45_degrees_has_no_flange(degrees, has_flange):
    top = -20.0 * math.tan(math.radians(degrees))
    points = ((-60.0, top), (-50.0, top), (-30.0, 0.0), (60.0, 0.0))
    wheel = Profile(
        name="p", kind="wheel", segments=tuple(StraightSegment(start=a, end=b) for a, b in pairwise(points))
    )
    # the top of the flange is beyond the straight flank; the tread is not
    assert is_beyond_flank(wheel, -55.0) is has_flange
    assert not is_beyond_flank(wheel, -20.0)


# above R 1440, a circular head of 72 mm width is not horizontal anywhere at 1:40
@pytest.mark.parametrize("radius_mm", [300.0, 1500.0, 5000.0])
def test_a_circle_has_no_inclination(radius_mm):
    case = Case(rail=f"circle:{radius_mm:g}", wheel="cylinder:460")
    assert case.inclination_rad == pytest.approx(1.0 / 40.0, rel=1e-3)
    for of_case in (case, replace(case, roll="given"), replace(case, inclination_rad=0.0)):
        placement = place_case(of_case)
        assert placement.rail.inclination_rad == 0.0
        assert placement.first.rail_y_mm == pytest.approx(0.0, abs=1e-6)
        assert placement.first.contact_angle_rad == pytest.approx(0.0, abs=1e-9)


def test_possible_shifts_leave_out_those_between_that_are_not():
    # a wheel can stand on a crane rail beyond the corner of its tread or on its tread, but not between
    case = Case(rail="A120", wheel="EN15302_A", inclination_rad=1 / 30, lateral_shift_mm=-3.64)
    with pytest.raises(InputError, match="the corner of its tread") as refused:
        place_case(case)
    possible = "shifts between -40 and -23 mm and between 3 and 7.5 mm (in steps of 0.5 mm) are possible"
    assert possible in str(refused.value)
    for shift in (-23.0, 3.0, 7.5):
        assert place_case(replace(case, lateral_shift_mm=shift)).contact_points
    for shift in (-22.5, 2.5):
        with pytest.raises(InputError, match="lateral shift"):
            place_case(replace(case, lateral_shift_mm=shift))
    only = describe_possible_shifts(lambda shift: "no" if shift not in (-1.0, 4.0, 4.5) else None)
    assert only == "shifts of -1 mm and between 4 and 4.5 mm (in steps of 0.5 mm) are possible"
    assert describe_possible_shifts(lambda shift: "no").startswith("no shift between -40 and 40 mm")
