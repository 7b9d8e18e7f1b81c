"""Profile lines and the library: published values, closed forms and invariants."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from fecontact.case import Case
from fecontact.cli import call
from fecontact.errors import InputError
from fecontact.profiles.curve import JOINT_GAP_MM, Profile, make_circular_rail_head, make_cylinder_wheel
from fecontact.profiles.library import ALIASES, find_library_name, list_names, load_library_profile, toml_text
from fecontact.profiles.pieces import PiecewiseCurve
from fecontact.profiles.readers.formats import close_small_steps, read_toml
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.segments import Arc, Polynomial, Spline, StraightSegment
from fecontact.solving.placing import place_case

# S (mm), F (mm), dF/dS, radius of curvature (mm, positive where the wheel is concave); F is the depth below the tape
# circle. Evaluated from the sections of EN 13715 in extended precision; they agree with the S1002 of the Manchester
# Contact Benchmark within 6.3e-7 mm.
S1002_VALUES = [
    (-36.0, 7.892117, -1.1444317, 13.0),
    (-35.0, 6.867504, -0.9176112, 13.0),
    (-34.0, 6.037663, -0.7492805, 13.23),
    (-32.0, 4.792505, -0.5140293, 15.39),
    (-30.0, 3.921571, -0.3697925, 22.56),
    (-28.0, 3.270086, -0.2899369, 38.8),
    (-26.0, 2.741007, -0.2416899, 51.77),
    (-25.0, 2.50947, -0.2218381, 57.38),
    (-20.0, 1.596563, -0.1496864, 93.7),
    (-15.0, 0.96743, -0.1051068, 140.57),
    (-10.0, 0.522759, -0.0744081, 192.42),
    (-5.0, 0.210668, -0.0514289, 248.99),
    (-3.0, 0.115615, -0.043751, 274.6),
    (0.0, 0.0, -0.0335854, 319.89),
    (3.0, -0.087423, -0.0249501, 381.55),
    (5.0, -0.132311, -0.0200565, 441.54),
    (10.0, -0.208401, -0.011271, 838.69),
    (14.0, -0.246835, -0.008722, 36169.37),
    (15.0, -0.255599, -0.0088644, -3164.74),
    (20.0, -0.311765, -0.015271, -432.57),
    (25.0, -0.425937, -0.0321178, -230.06),
    (30.0, -0.64623, -0.0565868, -200.61),
    (32.1, -0.775683, -0.0664238, -239.24),
    (40.0, -1.302343, -0.0666667, None),
]
RAILS = list_names("rail")
# Steps between its published sections at -26 and at -35 mm: the sections beyond are lower by the first, then higher.
S1002_CLOSED_MM = 3.655e-5
S1002_FLANGE_MM = 1.1833e-4 - S1002_CLOSED_MM


@pytest.mark.parametrize(("s", "depth", "slope", "radius"), S1002_VALUES)
def test_s1002_reproduces_its_table(s, depth, slope, radius):
    wheel = load_library_profile("S1002")
    # two sections meet at -35 mm: the table has the value of the flange section
    u = wheel.snap(wheel.locate(s))
    z = wheel.evaluate(u, "left").z
    closed = 0.0 if s > -26.0 else S1002_CLOSED_MM if s > -35.0 else -S1002_FLANGE_MM
    assert -z == pytest.approx(depth + closed, abs=1e-5)
    assert -wheel.slope(s, "left") == pytest.approx(slope, abs=1e-6)
    curvature = wheel.curvature(s, "left")
    if radius is None:
        assert curvature == 0.0
    else:
        assert -1.0 / curvature == pytest.approx(radius, abs=0.0051)


def test_s1002_inflection_and_tightest_convex_radius():
    wheel = load_library_profile("S1002")
    s = np.linspace(10.0, 31.0, 210001)
    curvature = wheel.curvature(s)
    assert s[np.flatnonzero(curvature > 0.0)[0]] == pytest.approx(14.0828, abs=1e-3)
    # the published 195.8 mm at 28.83 mm is 1/F''; the slope of 0.05 there makes the radius 0.37 % larger
    second = curvature * (1.0 + wheel.slope(s) ** 2) ** 1.5
    assert 1.0 / second.max() == pytest.approx(195.8, abs=0.05)
    assert s[second.argmax()] == pytest.approx(28.83, abs=0.01)
    assert 1.0 / curvature.max() == pytest.approx(196.52, abs=0.01)


def steps_of(wheel):
    joints = np.arange(1, len(wheel.segments))
    left, right = wheel.evaluate(joints, "left"), wheel.evaluate(joints, "right")
    return {float(y): dz for y, dz in zip(np.round(right.y, 3), right.z - left.z, strict=True)}


@pytest.mark.parametrize("name", sorted({*list_names("wheel"), *list_names("rail")}))
def test_steps_of_rounded_digits_are_closed_from_the_tape_circle_outwards(name):
    """Published sections that miss each other by less than 0.2 um: a spike of pressure, the higher the finer nodes."""
    line = load_library_profile(name)
    assert not [step for step in steps_of(line).values() if 1e-9 < abs(step) < 2e-4]
    # the section at the origin stays as published
    assert line.height(0.0) == pytest.approx(0.0, abs=1e-5)


@given(st.lists(st.floats(-4e-4, 4e-4), min_size=3, max_size=3))
def test_what_is_joined_keeps_its_slopes_and_its_larger_steps(steps):
    surface = [
        StraightSegment(start=(-30.0, 1.0 + steps[0]), end=(-20.0, 1.0 + steps[0])),
        Arc(centre=(-20.0, 11.0 + steps[1]), radius=10.0, angle_from=-math.pi / 2, angle_to=-math.pi / 4),
        Polynomial(coefficients=(0.0, 0.1), y_from=-20.0 + 10.0 * math.sqrt(0.5), y_to=5.0),
        StraightSegment(start=(5.0, 0.5 + steps[2]), end=(9.0, 0.7 + steps[2])),
    ]
    joined_surface = close_small_steps(surface)
    ends = [[segment.evaluate(np.array([0.0, 1.0])) for segment in segments] for segments in (surface, joined_surface)]
    for before, after in zip(*ends, strict=True):
        assert after.y == pytest.approx(before.y, abs=1e-12)
        assert after.angle_rad == pytest.approx(before.angle_rad, abs=1e-9)
    gaps = [[b.z[0] - a.z[1] for a, b in pairwise(pieces)] for pieces in ends]
    for before, after in zip(*gaps, strict=True):
        closed = 1e-9 < abs(before) < 2e-4
        assert after == pytest.approx(0.0 if closed else before, abs=1e-12)
    assert joined_surface[2] is surface[2]


def test_s1002_flange_tip():
    wheel = load_library_profile("S1002")
    assert wheel.height(-55.0) == pytest.approx(-28.0 + S1002_FLANGE_MM, abs=1e-7)
    assert wheel.slope(-55.0) == pytest.approx(0.0, abs=1e-12)
    assert wheel.curvature(-55.0) == pytest.approx(1 / 12, rel=1e-12)
    assert wheel.y_range_mm == (-70.0, 65.0)
    assert abs(wheel.slope(-70.0)) > 1e6


def test_60e1_junctions():
    rail = load_library_profile("60E1")
    junctions = rail.junctions
    assert [j.y_mm for j in junctions] == pytest.approx(
        [-35.999811, -26.0265, -10.228, 10.228, 26.0265, 35.999811], abs=1e-6
    )
    radii = [math.inf, 13.0, 80.0, 300.0, 80.0, 13.0, math.inf]
    for junction, left, right in zip(junctions, radii, radii[1:], strict=False):
        assert junction.curvature_left_per_mm == pytest.approx(1 / left, rel=1e-12)
        assert junction.curvature_right_per_mm == pytest.approx(1 / right, rel=1e-12)
        assert not junction.is_corner
        assert rail.curvature(junction.y_mm, "left") == pytest.approx(1 / left, rel=1e-12)
        assert rail.curvature(junction.y_mm, "right") == pytest.approx(1 / right, rel=1e-12)


# Tangent points of the drawings, solved from their dimensions: end of the crown arc, then of the last arc (mm).
@pytest.mark.parametrize(
    ("name", "crown_end", "last_end"),
    [
        ("60E1", (10.228, -0.174404), (35.999811, -14.299958)),
        ("60E2", (11.889, -0.353684), (35.999923, -14.300172)),
        ("54E1", (10.012, -0.167113), (35.000058, -14.100052)),
        ("49E1", (7.6335, -0.097133), (33.499899, -13.999949)),
        ("46E1", (9.4405, -0.148575), (32.500162, -14.300021)),
        ("50E6", (15.471, -0.599277), (32.500099, -13.580018)),
        ("55E1", (13.973, -0.488709), (30.999985, -13.419988)),
        ("56E1", (5.8935, -0.056945), (34.925068, -14.530057)),
        ("54E4", (20.671, -1.873037), (33.500038, -14.27989)),
        ("MBench_UIC60", (10.49977, -0.183798), (35.999995, -14.25977)),
    ],
)
def test_tangent_heads_reach_the_tangent_points(name, crown_end, last_end):
    on_the_right = [(j.y_mm, j.z_mm) for j in load_library_profile(name).junctions if j.y_mm > 0.0]
    assert on_the_right[0] == pytest.approx(crown_end, abs=1e-6)
    assert on_the_right[-1] == pytest.approx(last_end, abs=1e-6)


@pytest.mark.parametrize(("name", "width", "corner", "crown"), [("A100", 100, 10, 500), ("A120", 120, 10, 600)])
def test_crane_rails_have_the_dimensions_of_the_standard(name, width, corner, crown):
    # DIN 536-1; the junctions of arcs and vertical sides follow from similar triangles
    inner, outer = (j for j in load_library_profile(name).junctions if j.y_mm > 0.0)
    assert inner.y_mm == pytest.approx(crown * (width / 2 - corner) / (crown - corner), abs=1e-9)
    assert outer.y_mm == pytest.approx(width / 2, abs=1e-9)
    radii = [1.0 / k for k in (inner.curvature_left_per_mm, inner.curvature_right_per_mm, outer.curvature_left_per_mm)]
    assert radii == pytest.approx([crown, corner, corner], rel=1e-12)
    assert outer.curvature_right_per_mm == 0.0
    assert load_library_profile(name).notes


def section_properties(outline):
    """Area (cm2) and centroidal second moments (cm4) of an outline, by Green's theorem.

    The moments are about the lateral and the vertical axis.
    """
    nodes, weights = np.polynomial.legendre.leggauss(20)
    area = sy = sz = syy = szz = 0.0
    for segment in outline:
        p = segment.evaluate(0.5 * (nodes + 1.0))
        w = 0.5 * weights
        area += w @ (p.y * p.dz)
        sy += w @ (p.y**2 * p.dz) / 2
        sz -= w @ (p.z**2 * p.dy) / 2
        syy += w @ (p.y**3 * p.dz) / 3
        szz -= w @ (p.z**3 * p.dy) / 3
    # the outline follows the running surface from left to right with the body on its right hand: clockwise
    assert area < 0.0
    return -area / 1e2, (-szz + sz**2 / area) / 1e4, (-syy + sy**2 / area) / 1e4


@pytest.mark.parametrize(
    ("name", "area_cm2", "lateral_cm4", "vertical_cm4"),
    [("60E1", 76.70, 3038.3, 512.3), ("60E2", 76.48, 3021.5, 510.5)],
)
def test_whole_outline_has_the_published_section_properties(name, area_cm2, lateral_cm4, vertical_cm4):
    # the published values have four or five digits
    assert section_properties(load_library_profile(name).outline) == pytest.approx(
        (area_cm2, lateral_cm4, vertical_cm4), rel=2e-4
    )


@pytest.mark.parametrize("name", RAILS)
def test_rails_are_continuous_and_tangent(name):
    rail = load_library_profile(name)
    joints = np.arange(1, len(rail.segments))
    left, right = rail.evaluate(joints, "left"), rail.evaluate(joints, "right")
    assert np.abs(left.y - right.y).max() < 1e-12
    assert np.abs(left.z - right.z).max() < 1e-12
    assert np.abs(left.angle_rad - right.angle_rad).max() < 1e-12
    # coordinates of about 50 mm have rounding errors of 1e-14
    assert rail.height(0.0) == pytest.approx(0.0, abs=1e-13)
    assert rail.slope(0.0) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("name", [name for name in RAILS if load_library_profile(name).outline])
def test_outlines_are_closed_and_tangent(name):
    outline = load_library_profile(name).outline
    ends = [s.evaluate(np.array([0.0, 1.0])) for s in outline]
    for end, start in zip(ends, ends[1:] + ends[:1], strict=True):
        # the drawing's tangent points are rounded to 1e-6 mm, which tilts a fillet of 2 mm by 1e-6
        assert math.hypot(start.y[0] - end.y[1], start.z[0] - end.z[1]) < 2e-6
        kink = math.remainder(start.angle_rad[0] - end.angle_rad[1], math.tau)
        # the web of the 46E4 is three straight parts with corners
        is_corner_of_web = name == "46E4" and round(start.z[0], 3) in (-67.5, -97.5)
        assert kink == pytest.approx(0.0, abs=2e-6) or is_corner_of_web


@pytest.mark.parametrize("name", RAILS)
def test_rails_are_mirror_symmetric(name):
    rail = load_library_profile(name)
    u = np.linspace(0.0, len(rail.segments), 1001)
    points, mirrored = rail.evaluate(u), rail.evaluate(len(rail.segments) - u, "left")
    assert np.abs(points.y + mirrored.y).max() < 1e-12
    assert np.abs(points.z - mirrored.z).max() < 1e-12
    assert np.abs(points.curvature_per_mm - mirrored.curvature_per_mm).max() < 1e-14


def test_arc_length_of_arcs_is_radius_times_angle():
    rail = load_library_profile("60E1")
    lengths = [
        s.radius * abs(s.angle_to - s.angle_from) if isinstance(s, Arc) else math.dist(s.start, s.end)
        for s in rail.segments
    ]
    assert rail.arc_length(np.arange(8)) == pytest.approx(np.cumsum([0.0, *lengths]), abs=1e-12)
    assert rail.length_mm == pytest.approx(math.fsum(lengths), abs=1e-12)
    assert rail.arc_length(3.3) == pytest.approx(math.fsum(lengths[:3]) + 0.3 * lengths[3], abs=1e-12)


def test_arc_length_of_s1002_by_quadrature_over_y():
    wheel = load_library_profile("S1002")
    reference, _ = quad(lambda y: math.hypot(1.0, wheel.slope(y)), -25.0, 32.0, epsabs=1e-12, epsrel=1e-12)
    first, last = wheel.arc_length(wheel.locate([-25.0, 32.0]))
    assert last - first == pytest.approx(reference, abs=1e-11)


@pytest.mark.parametrize("name", ["60E1", "S1002"])
def test_at_arc_length_inverts_arc_length(name):
    profile = load_library_profile(name)
    u = np.linspace(0.0, len(profile.segments), 997)
    assert profile.at_arc_length(profile.arc_length(u)) == pytest.approx(u, abs=1e-12)
    outside = profile.at_arc_length([-1.0, profile.length_mm + 1.0])
    assert np.isnan(outside).all()


@given(
    name=st.sampled_from(list_names()),
    fraction=st.floats(0.0, 1.0),
    angle=st.floats(-1.4, 1.4),
    origin=st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)),
)
def test_locate_finds_what_it_answers(name, fraction, angle, origin):
    profile = load_library_profile(name)
    u = np.array(fraction * len(profile.segments))

    def along(points):
        return (points.y - origin[0]) * math.cos(angle) + (points.z - origin[1]) * math.sin(angle)

    t = along(profile.evaluate(u))
    place = profile.locate(t, angle_rad=angle, origin=origin)
    # NaN is right only where the profile turns away from the observer, or on the narrower of two stretches
    if np.isnan(place):
        sample = profile.evaluate(np.linspace(0.0, len(profile.segments), 4001))
        assert (sample.dy * math.cos(angle) + sample.dz * math.sin(angle)).min() < 0.05
    else:
        at_joint = abs(u - np.round(u)) < 1e-2
        # at the steps between the published sections of wheels, a tiny part of the axis has no point
        # at other places, an end is returned up to 1e-9 mm beyond it
        slack = JOINT_GAP_MM if profile.kind == "wheel" and at_joint else 1.1e-9
        assert along(profile.evaluate(place)) == pytest.approx(t, abs=slack)


@given(name=st.sampled_from(RAILS), fraction=st.floats(0.0, 1.0), angle=st.floats(-0.04, 0.04))
def test_locate_inverts_evaluate_on_a_canted_rail(name, fraction, angle):
    # sides of 1:20 stay visible up to a tilt of 0.04 rad; vertical sides do not
    rail = load_library_profile(name)
    vertical = name in ("46E1", "52E1") or name.startswith("A")
    u = fraction * len(rail.segments) if not vertical else 1.1 + fraction * (len(rail.segments) - 2.2)
    p = rail.evaluate(u)
    t = (p.y - 3.0) * math.cos(angle) + (p.z - 0.5) * math.sin(angle)
    places = rail.locate(t, angle_rad=angle, origin=(3.0, 0.5))
    q = rail.evaluate(places)
    assert math.hypot(p.y - q.y, p.z - q.z) < 1e-9


def test_locate_is_nan_outside_and_on_folds():
    rail = load_library_profile("60E1")
    assert np.isnan(rail.locate([-37.1, 37.1, math.nan])).all()
    assert np.isnan(rail.height(40.0))
    # Seen along an axis tilted by 60 degrees, everything steeper than -30 degrees turns away: the crown's right end.
    tilt = math.radians(60.0)
    fold = 23.01603 + 13.0 * math.cos(tilt), -14.949147 + 13.0 * math.sin(tilt)
    reach = fold[0] * math.cos(tilt) + fold[1] * math.sin(tilt)
    u = rail.locate([reach - 1e-3, reach + 1e-3], angle_rad=tilt)
    assert rail.evaluate(u[0]).angle_rad == pytest.approx(-math.radians(30.0), abs=0.02)
    assert np.isnan(u[1])
    assert np.isnan(rail.locate(0.0, angle_rad=math.pi)).all()


def test_locate_near_the_vertical_tangent_of_the_flange_back():
    wheel = load_library_profile("S1002")
    offset = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3])
    z = wheel.height(-70.0 + offset)
    # circle of 20.5 mm; the published arc ends at its vertical tangent, where z moves by sqrt(2 * 20.5 * rounding)
    assert z == pytest.approx(-9.519259302 + S1002_FLANGE_MM - np.sqrt(20.5**2 - (20.5 - offset) ** 2), abs=2e-6)


def test_any_shape_goes_through():
    rail = load_library_profile("60E1")
    for shape in ((), (1,), (0,), (2, 3), (2, 1, 4)):
        y = np.full(shape, 12.0)
        for result in (rail.locate(y), rail.height(y), rail.slope(y), rail.curvature(y), rail.at_arc_length(y)):
            assert result.shape == shape
        assert rail.arc_length(np.full(shape, 1.5)).shape == shape


def test_polynomial_keeps_its_digits_far_from_its_origin():
    # in powers of S, section C of the S1002 loses six digits by cancellation; the reference is rational arithmetic
    from fractions import Fraction

    section = load_library_profile("S1002").segments[5]
    assert isinstance(section, Polynomial)
    for v in (0.0, 0.125, 0.5, 1.0):
        y = Fraction(-35) + 9 * Fraction(v)
        exact = sum(Fraction(c) * y**k for k, c in enumerate(section.coefficients))
        assert section.evaluate(np.array(v)).z == pytest.approx(float(exact), abs=5e-15)


def test_evaluate_is_nan_outside_the_line():
    rail = load_library_profile("60E1")
    assert np.isnan(rail.evaluate([-0.1, 7.1, math.nan]).y).all()


def test_profile_refuses_a_gap_and_the_wrong_direction():
    first, far = StraightSegment(start=(0.0, 0.0), end=(1.0, 0.0)), StraightSegment(start=(1.0, 0.1), end=(2.0, 0.1))
    with pytest.raises(InputError, match=r"gap is 0\.1 mm; allowed: at most 0\.001 mm"):
        Profile(name="broken", kind="rail", segments=(first, far))
    with pytest.raises(InputError, match="small to large y"):
        Profile(name="backwards", kind="rail", segments=(StraightSegment(start=(1.0, 0.0), end=(0.0, 0.0)),))
    with pytest.raises(InputError, match="outline"):
        Profile(name="open", kind="rail", segments=(first,), outline=(first,))


def test_spline_through_an_arc():
    angles = np.linspace(2.2, 0.9, 131)
    points = np.column_stack((80.0 * np.cos(angles), 80.0 * np.sin(angles) - 80.0))
    rail = Profile(name="arc", kind="rail", segments=(Spline(points=points),))
    # chord parameter and cubic interpolation at 0.8 mm: the error of the curvature is about h^2 / R^3 / 10
    assert rail.curvature(np.linspace(-40.0, 40.0, 201)) == pytest.approx(1 / 80, abs=2e-7)
    assert rail.height(0.0) == pytest.approx(0.0, abs=1e-8)
    assert rail.length_mm == pytest.approx(80.0 * 1.3, abs=1e-6)


def test_circle_and_cylinder():
    rail = make_circular_rail_head(300.0)
    assert rail.y_range_mm == pytest.approx((-36.0, 36.0), abs=1e-12)
    assert rail.height(20.0) == pytest.approx(math.sqrt(300.0**2 - 20.0**2) - 300.0, abs=1e-12)
    assert rail.curvature([-20.0, 0.0, 35.0]) == pytest.approx(1 / 300)
    assert make_circular_rail_head(13.0).y_range_mm == pytest.approx((-12.35, 12.35), abs=1e-12)
    wheel = make_cylinder_wheel()
    assert wheel.y_range_mm == (-70.0, 65.0)
    assert (wheel.curvature([-50.0, 0.0]) == 0.0).all()
    with pytest.raises(InputError, match="finite and > 0"):
        make_circular_rail_head(-1.0)


def test_names():
    assert "60E1" in list_names("rail")
    reference = ("EN15302_A", "EN15302_B", "EN15302_C", "EN15302_H")
    apta = ("APTA220", "APTA240", "APTA320", "APTA340")
    heights = [("EN13715_1in40", *(f"EN13715_1in40_h{height}" for height in (29, 30, 32)))]
    heights += [("S1002", *(f"S1002_h{height}" for height in (29, 30, 32)))]
    wheels = (*apta, "CONE20", "CONE40", *heights[0], *reference, "LMA", "LMB10", "MBench_S1002", *heights[1])
    assert list_names("wheel") == wheels
    assert len(list_names("rail")) == 34
    assert set(list_names()) == {*list_names("rail"), *list_names("wheel")}
    for name in list_names():
        assert load_library_profile(name).name == name
        assert load_library_profile(name).source
        assert load_library_profile(name).certainty in ("exact", "good", "fair", "doubtful")


def test_resolve_takes_names_in_any_case_and_short_forms():
    assert resolve_rail("60e1").name == "60E1"
    assert resolve_rail("circle:300").curvature(0.0) == pytest.approx(1 / 300)
    wheel = resolve_wheel("s1002")
    assert (wheel.profile.name, wheel.rolling_radius_mm) == ("S1002", None)
    assert resolve_wheel("cylinder:460").rolling_radius_mm == 460.0


@pytest.mark.parametrize(
    ("resolve", "spec", "message"),
    [
        (resolve_rail, "60E3", "did you mean 60E"),
        (
            resolve_rail,
            "S1002",
            r"is a wheel, but a rail is needed; give it as the wheel \(--wheel, or --kind wheel\), or",
        ),
        (resolve_wheel, "60E1", "is a rail, but a wheel is needed"),
        (resolve_wheel, "S1003", "did you mean S1002"),
        (resolve_wheel, "qqqq", "the library has APTA220, APTA240, APTA320, APTA340, CONE20, CONE40, EN1"),
        (resolve_rail, "cylinder:460", "is a wheel"),
        (resolve_wheel, "circle:300", "is a rail"),
        (resolve_rail, "circle:abc", "no number after the colon"),
        (resolve_rail, "circle:-3", "finite and > 0"),
        (resolve_wheel, "cylinder:nan", "finite and > 0"),
        (resolve_rail, "missing.toml", "No such file"),
        (resolve_rail, "missing.txt", "there is no file"),
        (resolve_rail, "x" * 5000, "there is no profile"),
        (resolve_rail, "", "there is no profile"),
        (resolve_rail, "nul\0.toml", "invisible characters"),
    ],
)
def test_resolve_explains_what_it_cannot_find(resolve, spec, message):
    with pytest.raises(InputError, match=message):
        resolve(spec)


def test_a_copied_file_is_the_same_profile_until_it_is_changed(tmp_path):
    path = tmp_path / "mine.toml"
    for name in list_names():
        path.write_text(toml_text(name), "utf-8")
        copy = read_toml(path)
        assert copy.name == "mine"
        original = load_library_profile(name)
        for attribute in ("kind", "segments", "outline", "source", "certainty", "notes"):
            # 300 and 300.0 must differ too
            assert repr(getattr(copy, attribute)) == repr(getattr(original, attribute))
    path.write_text(toml_text("54E1").replace("radii = [300.0,", "radii = [250.0,"), "utf-8")
    changed = resolve_rail(str(path))
    assert changed.curvature(0.0) == pytest.approx(1 / 250)
    assert not any(j.is_corner for j in changed.junctions)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("kind =", "kind", "not valid TOML"),
        ('kind = "rail"', 'kind = "tram"', "kind: .*'rail' or 'wheel'"),
        ('units = "mm"', 'units = "m"', "units"),
        ('units = "mm"', "", "units: Field required"),
        ("side_one_in", "side_slope", "head.side_slope: Extra inputs"),
        ("[300.0,", "[-300.0,", r"head.radii.0: .*greater than 0 \(given: -300.0\)"),
        ("[300.0,", "[nan,", "head.radii.0: .*finite"),
        ("[300.0, 80.0,", "[300.0,", "2 radii need 1 half_widths"),
        ("[10.012,", "[30.012,", "arc 2 with radius 80 mm cannot reach"),
        (
            "side_to_z = -32.0",
            "side_to_z = -2.0",
            "side_to_z is -2 mm; allowed: below the end of the last arc, -14.1001 mm",
        ),
        ("[300.0,", "[" * 5000, "not valid TOML: brackets are nested too deeply"),
        ("[300.0,", "[" + "1" * 5000 + ",", "not valid TOML: .*4300 digits"),
        ("[300.0,", "[" + "1" * 400 + ",", "head.radii.0"),
        ("side_to_z = -32.0", "side_to_z = -1e300", r"side_to_z: .*-1000000000 \(given: -1e\+300\)"),
        ('kind = "rail"', 'kind = "wheel"', r"\[head\] describes a rail"),
        ("[head]", "[[surface]]\ntype='line'\nfrom=[0, 0]\nto=[1, 0]\n[head]", "running surface once"),
        ("[head]", "[[body]]\ntype='line'\nfrom=[0, 0]\nto=[1, 0]\n[head]", "outline: segment 7 ends at"),
    ],
)
def test_profile_file_errors_name_the_key(tmp_path, old, new, message):
    text = toml_text("54E1")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new), "utf-8")
    with pytest.raises(InputError, match=message):
        read_toml(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("radius = 12.0", "radius = 12.1", "surface 2: the point .* is -0.1 mm off the circle"),
        ("y_to = 60.0", "y_to = 20.0", "y_from = 32.158 must be smaller than y_to = 20"),
        ('type = "line"', 'type = "curve"', "surface.8"),
        ("to = [65.0, 7.63567638]", "to = [65.0]", "surface.8.line.to"),
        ("to = [65.0, 7.63567638]", "to = [1e308, 7.63567638]", "surface.8.line.to.0: .*1000000000"),
        (
            "coefficients = [",
            "coefficients = [" + 60 * "1e300, ",
            r"surface \d: the polynomial .* up to 1e\+300 exceeds",
        ),
        ("to = [65.0, 7.63567638]", "to = [650.0, 7.63567638]", "the profile spans 720 mm"),
    ],
)
def test_segment_errors_name_the_segment(tmp_path, old, new, message):
    text = toml_text("S1002")
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new), "utf-8")
    with pytest.raises(InputError, match=message):
        resolve_wheel(str(path))


def test_a_byte_order_mark_is_no_part_of_a_toml_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(toml_text("60E1"), "utf-8-sig")
    assert read_toml(path).segments == load_library_profile("60E1").segments


def test_segments_without_a_crown_at_the_origin_are_said_to_be(tmp_path):
    """A file that was cut off after the gauge side: Hertz is three times as high."""
    path = tmp_path / "mine.toml"
    path.write_text(
        'kind = "rail"\nunits = "mm"\n\n[[surface]]\ntype = "line"\nfrom = [-35.89505571118438, -32.0]\n'
        "to = [-35.000058322078644, -14.100052217885262]\n\n"
        '[[surface]]\ntype = "arc"\nfrom = [-35.000058322078644, -14.100052217885258]\n'
        "to = [-24.8635, -2.0648679226081423]\ncentre = [-22.016277916666667, -14.74924123815586]\nradius = 13.0\n",
        "utf-8",
    )
    assert "the highest point is (-24.86, -2.065) mm, not the origin" in read_toml(path).notes[0]


def test_a_binary_toml_file_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xff\xfe\x00k")
    with pytest.raises(InputError, match="not a text file"):
        read_toml(path)


def test_profiles_are_found_by_their_other_names(capsys):
    for alias, name in ALIASES.items():
        assert find_library_name(alias.lower()) == name
        # the source of the file has the alias
        assert alias in load_library_profile(name).source
        resolved = resolve_rail(alias) if name in RAILS else resolve_wheel(alias).profile
        assert resolved is load_library_profile(name)
    # the rail of the benchmark is a different rail
    assert find_library_name("MBench_UIC60") == "MBench_UIC60"
    assert call(["hertz", "--rail", "UIC60", "--json"]) == 0


def test_a_rail_that_ends_above_the_gauge_names_the_options(tmp_path):
    y = np.arange(-20.0, 20.2, 0.2)
    np.savetxt(tmp_path / "head.csv", np.column_stack([y, load_library_profile("60E1").height(y)]), delimiter=",")
    with pytest.raises(InputError, match=r"--gauge-depth-mm.*--rail-crown-y-mm"):
        place_case(Case(rail=str(tmp_path / "head.csv")))


@pytest.mark.parametrize("name", list_names())
def test_pieces_are_the_segments(name):
    profile, v = load_library_profile(name), np.random.default_rng(3).random(400)
    for k, segment in enumerate(profile.segments):
        exact, on_profile = segment.evaluate(v), profile.evaluate(k + v)
        assert np.hypot(exact.y - on_profile.y, exact.z - on_profile.z).max() < 5e-13
        speed = np.hypot(exact.dy, exact.dz)
        # measured 1e-15; polynomials through the points, not the second derivatives, would lose nine digits
        assert (np.hypot(exact.dy - on_profile.dy, exact.dz - on_profile.dz) / speed).max() < 5e-15
        assert np.abs(exact.curvature_per_mm - on_profile.curvature_per_mm).max() < 3e-14
    nodes, weights = np.polynomial.legendre.leggauss(40)
    lengths = []
    for segment in profile.segments:
        points = segment.evaluate((np.arange(20.0)[:, None] + 0.5 * (1.0 + nodes)) / 20.0)
        lengths.append(float((np.hypot(points.dy, points.dz) @ weights).sum()) / 40.0)
    assert profile.length_mm == pytest.approx(sum(lengths), abs=1e-11)


@pytest.mark.parametrize("seed", range(20))
def test_places_along_a_noisy_line_are_found_exactly(seed):
    """Newton's method within short pieces, on splines that turn back with their noise."""
    random = np.random.default_rng(seed)
    number = int(random.integers(30, 400))
    y = np.sort(random.uniform(-35.0, 35.0, number)) + random.normal(0.0, 10.0 ** random.uniform(-4.0, -0.7), number)
    z = -(y**2) / 600.0 + random.normal(0.0, 10.0 ** random.uniform(-4.0, -0.3), number)
    pieces = PiecewiseCurve.of([Spline(points=np.column_stack((y, z)))])
    lines = [along for angle in (0.0, 0.05, -0.4, 1.2) if (along := pieces.along(angle)) is not None]
    assert lines
    for line in (pieces.arc, *lines):
        t = random.uniform(line.values[0], line.values[-1], 500)
        t = np.concatenate((t, line.values, line.values[1:] - 1e-12))
        # rounding of coordinates of 40 mm, and of arc lengths of some hundred mm
        assert np.abs(line.function(line.inverted(t))[..., 0] - t).max() < 2e-15 * np.abs(line.values).max() + 1e-13
