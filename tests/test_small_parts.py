"""Small parts of the physics by themselves, each against a closed form, an invariant or what must not matter."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.comparison import verdict
from fecontact.comparison.patch import measure_patch
from fecontact.contact.elements import UnitResponse
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import _box, half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.curves.normal import Overlap, half_space
from fecontact.curves.steady import Motion, _pull, newton, rigid_slip
from fecontact.errors import InputError
from fecontact.fe.body import rigid_body_modes
from fecontact.fe.section import _on_segment
from fecontact.fe.stress import _below_the_block
from fecontact.normal.gap_line import GapLine, under_load
from fecontact.normal.hertz import ellipse_shape, hertz_ellipse
from fecontact.normal.strip_method import _runs
from fecontact.normal.strips import kik_piotrowski_at
from fecontact.profiles.curve import check_shape
from fecontact.profiles.segments import Polynomial, least_bending, out_of_order
from fecontact.profiles.smoothing import FootPoints, _ByContent, _choices, _length, _lost_on_field_side_mm
from fecontact.wheel_rail.placement import Placement
from fecontact.wheel_rail.wheelset import _lowest

MODULUS_MPA = 115e3


# --- Profiles ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spacing_mm", [0.5, 2.0])
def test_three_points_are_bent_as_their_one_second_difference_says(spacing_mm):
    """min |u - v|^2 + (w / 2 pi)^4 (D u)^2 with D = (1, -2, 1) / h^2: one number is left of the smoothing."""
    width, v = 3.0, np.array([0.0, 0.4, 0.1])
    values = np.column_stack((np.zeros(3), v))
    found = least_bending(spacing_mm * np.arange(3.0), values, np.tile([0.0, 1.0], (3, 1)), width)
    bent = np.array([1.0, -2.0, 1.0]) / spacing_mm**2
    much = (width / (2.0 * math.pi)) ** 4
    np.testing.assert_allclose(found[:, 1], v - bent * (much * bent @ v / (1.0 + much * bent @ bent)), atol=1e-9)


@pytest.mark.parametrize("moved", [(0.0, 0.0), (-50.0, 30.0), (50.0, -30.0)])
@pytest.mark.parametrize(("back_mm", "problems"), [(0.3, 0), (0.8, 1)])
def test_whether_a_line_turns_back_does_not_hang_on_where_it_lies(moved, back_mm, problems):
    """A dent of 0.5 mm may be there; the line turns to either side of the fold by 1.5 rad at most."""
    steps = [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-back_mm, 0.9 * back_mm), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    points = np.cumsum([moved, *steps], axis=0)
    found = out_of_order(points, np.full(len(points), 0.01))
    assert len(found) == problems


def test_a_rail_upside_down_is_seen_wherever_its_file_has_the_origin():
    y = np.linspace(-36.0, 36.0, 73)
    for origin in (0.0, 60.0, 750.0, -750.0):
        check_shape(y + origin, -(y**2) / 100.0, kind="rail", what="file")
        with pytest.raises(InputError, match=r"below the chord between its ends"):
            check_shape(y + origin, y**2 / 100.0, kind="rail", what="file")


def test_a_wheel_upside_down_whose_last_point_is_the_highest_is_told_with_that_point():
    y = np.linspace(0.0, 100.0, 101)
    with pytest.raises(InputError, match=r"above the tread at y = 100\.0 mm"):
        check_shape(y, 40.0 * (y / 100.0) ** 4, kind="wheel", what="file")


def test_a_parabola_is_as_long_as_its_closed_form():
    """z = y^2 / 2 from 0 to 2: (y sqrt(1 + y^2) + asinh y) / 2."""
    wanted = 0.5 * (2.0 * math.sqrt(5.0) + math.asinh(2.0))
    assert _length(Polynomial(coefficients=(0.0, 0.0, 0.5), y_from=0.0, y_to=2.0)) == pytest.approx(wanted, rel=1e-12)


def test_smoothed_profiles_are_equal_by_their_points():
    def profile(points):
        made = SimpleNamespace(filter_mm=4.0, nominal="", noise_mm=0.01, points=np.array(points), s_mm=np.arange(2.0))
        return _ByContent(SimpleNamespace(kind="rail", name="one", measured=made))

    one = profile([1.0, 2.0])
    assert one == profile([1.0, 2.0])
    assert one != profile([1.0, 2.5])
    assert one != "one"


@pytest.mark.parametrize("cant", [20, 30, 40])
def test_a_rail_that_lies_canted_in_its_file_is_asked_for(cant):
    held = SimpleNamespace(registration=SimpleNamespace(turn_rad=-1.0 / cant))
    (*_, said) = _choices(SimpleNamespace(nominal="60E1", held=held), "rail")
    assert f"near 1:{cant}: is the rail canted" in said


@pytest.mark.parametrize(("gauge_mm", "field_mm"), [(0.7, 0.7), (0.2, 0.9), (0.9, 0.2)])
def test_what_a_head_has_lost_of_its_field_side_counts_beside_its_gauge_side(gauge_mm, field_mm):
    y = np.linspace(-30.0, 30.0, 121)
    feet = FootPoints(
        s_mm=y,
        points=np.column_stack((y, -(y**2) / 100.0)),
        normals=np.tile([0.0, 1.0], (y.size, 1)),
        off_mm=np.where(y < 0.0, -gauge_mm, -field_mm),
        inside=np.ones(y.size, dtype=bool),
    )
    assert _lost_on_field_side_mm(feet) == pytest.approx(field_mm - gauge_mm, abs=1e-12)


# --- Wheel on rail ----------------------------------------------------------------------------------------------------


def test_the_side_of_a_line_that_does_not_turn_is_its_end():
    arc = np.linspace(0.0, 40.0, 401)
    profile = SimpleNamespace(
        spread=lambda _: arc, arc_length=lambda u: u, evaluate=lambda u: SimpleNamespace(angle_rad=np.zeros_like(u))
    )
    placement = SimpleNamespace(rail=SimpleNamespace(profile=profile), first_arc_length_mm=20.0)
    assert Placement.side_mm(placement, -13.0) == pytest.approx(7.0, abs=1e-9)
    assert Placement.side_mm(placement, 13.0) == pytest.approx(7.0, abs=1e-9)


@pytest.mark.parametrize("at", [0.7, 1.2, 1.8, 7.8])
def test_the_smallest_gap_is_that_of_the_parabola_next_to_an_end_too(at):
    """Of ten samples: from the second to the last but one."""
    k = np.arange(10)
    found = _lowest(0.0, k, 5.0 + 0.3 * (k - at) ** 2, 0.02 * k, np.zeros(10), 460.0 - 0.1 * k)
    assert found.axle_mm == pytest.approx(-5.0, abs=1e-12)
    assert (found.y_mm, found.radius_mm) == pytest.approx((0.02 * at, 460.0 - 0.1 * at), abs=1e-12)


# --- Theories of the normal contact -----------------------------------------------------------------------------------


def test_the_ellipse_of_equal_curvatures_is_a_circle_and_turns_with_them():
    """Hertz: F(0, 1, 1) = pi / 2, and half the approach at each end."""
    circle = ellipse_shape(2e-3, 2e-3)
    assert (float(circle.axis_ratio), float(circle.part_x)) == pytest.approx((1.0, 0.5), rel=1e-12)
    assert float(circle.integral) == pytest.approx(0.5 * math.pi, rel=1e-12)
    one, turned = ellipse_shape(1e-3, 7e-3), ellipse_shape(7e-3, 1e-3)
    assert float(one.axis_ratio * turned.axis_ratio) == pytest.approx(1.0, rel=1e-12)
    assert float(one.part_x) == pytest.approx(float(turned.part_t), rel=1e-12)


@pytest.mark.parametrize("touch", [0, 1, 2, 37, 78, 79, 80])
def test_kik_and_piotrowskis_contact_of_a_mirrored_line_is_mirrored(touch):
    """Also where the bodies are deepest at the end of what is known of the gap."""
    t = 0.1 * np.arange(81.0)
    f = 0.004 * (t - t[touch]) ** 2
    one, other = (
        kik_piotrowski_at(GapLine(t_mm=t, f_mm=gap, A_per_mm=1e-3, contact_modulus_MPa=MODULUS_MPA), 0.02)
        for gap in (f, f[::-1])
    )
    np.testing.assert_allclose(one.centre_pressure_MPa, other.centre_pressure_MPa[::-1], rtol=1e-9)


def test_a_load_far_beyond_that_of_hertz_is_found_or_told_to_be_carried_by_none():
    """Of a spring a thousand times as soft as Hertz's, at a hundred times his approach."""
    t = 0.1 * (np.arange(201.0) - 100.0)
    line = GapLine(t_mm=t, f_mm=0.004 * t**2, A_per_mm=1e-3, contact_modulus_MPa=MODULUS_MPA)
    contact = kik_piotrowski_at(line, 0.02)

    def soft(_, approach_mm):
        return replace(contact, approach_mm=approach_mm, normal_force_N=1e4 * approach_mm**1.5)

    found = under_load(line, 8e4, soft)
    assert (found.status, found.solutions) == ("solved", 1)
    assert found.approach_mm == pytest.approx(4.0, rel=1e-6)
    # no approach carries it where the force stays below
    never = under_load(line, 8e4, lambda _, approach_mm: replace(contact, approach_mm=approach_mm, normal_force_N=4e4))
    assert (never.status, never.solutions) == ("not converged", 0)


def test_runs_of_a_line_reach_half_a_step_beyond_their_places():
    line = SimpleNamespace(t=0.5 * np.arange(6.0))
    (low, high), (last, end) = _runs(line, np.array([False, True, True, False, False, True]))
    # not beyond the end of the line
    assert (low, high, last, end) == pytest.approx((0.25, 1.25, 2.25, 2.5), abs=1e-12)


def test_the_half_space_of_a_small_overlap_on_a_long_line_is_hertz():
    """As fine as the overlap is wide, however long the line beside it."""
    s, radius, across, depth = np.linspace(-20.0, 20.0, 4001), 460.0, 20.0, 0.005
    overlap = Overlap(
        s_mm=s,
        depth_mm=depth - s**2 / (2.0 * across),
        place_mm=np.column_stack((np.zeros_like(s), s, np.zeros_like(s))),
        angle_rad=np.zeros_like(s),
        radius_mm=np.full_like(s, radius),
    )
    (found,) = half_space(overlap, MODULUS_MPA)
    hertz = hertz_ellipse(0.5 / radius, 0.5 / across, normal_force_N=1.0, contact_modulus_MPa=MODULUS_MPA)
    # 0.2 % too much is reached; on the widest steps of 0.3 mm it is 2.7 % too little
    force = float(found.force_N_per_mm @ found.width_mm)
    assert force == pytest.approx((depth / hertz.approach_mm) ** 1.5, rel=4e-3)


# --- Contact ----------------------------------------------------------------------------------------------------------


def test_a_patch_that_reaches_the_end_of_its_grid_is_measured_alike_wherever_that_lies():
    x = 0.1 * np.arange(30.0)
    # both ends lie half a step beyond the last node
    s = 0.1 * np.arange(40.0)
    p = np.sqrt(np.maximum(1.0 - (x[:, None] / 2.0) ** 2 - ((s - 1.95) / 2.0) ** 2, 0.0))
    one, moved = (
        measure_patch(Field(grid=ContactGrid(x_mm=x, s_mm=s + by, half=True), values=p)) for by in (0.0, 40.0)
    )
    assert (moved.area_mm2, moved.extent_y_mm) == pytest.approx((one.area_mm2, one.extent_y_mm), rel=1e-9)


def test_coarse_nodes_lie_evenly_over_what_is_near():
    """One place of the search beyond it on each side; in the middle of it."""
    x, y = np.linspace(-20.0, 20.0, 81), np.linspace(0.0, 10.0, 21)
    near = np.zeros((x.size, y.size), dtype=bool)
    near[21:34, :5] = True
    grid = _box(x, y, near)
    assert float(grid.s_mm.mean()) == pytest.approx(0.5 * (x[21] + x[33]), abs=1e-9)
    assert np.ptp(grid.s_mm) >= x[34] - x[20]
    assert grid.x_mm[-1] >= y[5]


def test_bodies_answer_alike_on_opposite_sides():
    """A symmetric compliance: all shapes of a response are even."""
    grid = ContactGrid(x_mm=0.1 * np.arange(9.0), s_mm=0.15 * np.arange(9.0), half=False)
    response = UnitResponse(grid=grid, contact_modulus_MPa=MODULUS_MPA, node=(4, 4), opening_mm=np.zeros((9, 9)))
    x, s = (each.ravel() for each in np.meshgrid(np.arange(-3, 4), np.arange(-3, 4), indexing="ij"))
    for one, other in zip(response._shapes(x, s, quartic=True), response._shapes(-x, -s, quartic=True), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_directions_stay_conjugate_at_a_prescribed_approach():
    """30 iterations beside 34 under the load of the same contact; steepest descent takes 218."""
    grid = ContactGrid(x_mm=0.1 * np.arange(30.0), s_mm=0.1 * (np.arange(59.0) - 29.0), half=True)
    gap = (grid.x_mm[:, None] ** 2 + grid.s_mm**2).ravel() / 600.0
    problem = half_space_problem(grid, gap, contact_modulus_MPa=MODULUS_MPA)
    loaded = solve_contact(problem, 3e3, tolerance=1e-8)
    given = solve_contact(problem, None, approach_mm=loaded.approach_mm, tolerance=1e-8)
    assert (loaded.status, given.status) == ("converged", "converged")
    assert given.iterations <= 1.5 * loaded.iterations


# --- Finite elements --------------------------------------------------------------------------------------------------


def test_only_edges_within_a_segment_lie_on_it():
    start, end = np.array([30.0, 40.0]), np.array([33.0, 44.0])
    along = (end - start) / 5.0

    def edge(first, last, aside=0.0):
        return np.array([start + first * along, start + last * along + aside * np.array([-along[1], along[0]])])

    edges = np.array([edge(0.0, 1.0), edge(5.0, 4.0), edge(4.0, 5.1), edge(-0.1, 1.0), edge(1.0, 2.0, 0.01)])
    assert list(_on_segment(edges, start, end)) == [True, True, False, False, False]


@pytest.mark.parametrize("j", [0, 1, 5, 9, 10])
def test_below_each_column_of_a_block_a_linear_stress_goes_on(j):
    """Also below the first and the last one; cubics among the nodes are exact for it."""
    y, z = np.meshgrid(np.linspace(-2.0, 2.0, 21), np.linspace(0.0, -4.0, 21), indexing="ij")
    points = np.tile(np.stack([0.0 * y, y, z], axis=-1).reshape(-1, 3), (2, 1))
    points[y.size :, 0] = 1.0
    numbers = np.arange(2 * y.size).reshape(2, 21, 21)
    mesh = SimpleNamespace(points=points, block_nodes=numbers[:, 5:16, :3])
    depth, stress = _below_the_block(mesh, 1, j, 100.0 - 7.0 * points[:, 2] + 3.0 * points[:, 1])
    np.testing.assert_allclose(depth[:2], (0.6, 0.8), rtol=1e-12)
    np.testing.assert_allclose(stress, 100.0 + 7.0 * depth + 3.0 * y[5 + j, 0], rtol=1e-9)


def test_rigid_body_modes_have_no_unit_of_length():
    points = np.random.default_rng(1).uniform(size=(20, 3)) * [4.0, 2.0, 1.0]
    modes = rigid_body_modes(points)
    np.testing.assert_allclose(rigid_body_modes(1e3 * points + 50.0), modes, atol=1e-9)
    assert np.abs(modes).max() <= 1.0


# --- Bodies that yield ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Elastic:
    """What is taken of a judgement on elastic bodies."""

    approximation: str
    deviation: dict
    numerical: dict
    moves: str = ""
    uncertainty: str = ""
    verdict: str = ""


def test_a_step_that_is_unsure_counts_by_what_hertz_has_of_the_contact_that_yields(monkeypatch):
    """Hertz has 1 + d of it: d (1 +- u) is unsure by (1 + d) u, and the elastic part by the ratio of both."""
    after = {"p_max_MPa": 0.25, "misplaced_load": 0.1}
    monkeypatch.setattr(verdict, "deviations_of", lambda *_: after)
    monkeypatch.setattr(verdict, "judge_on_lines", lambda _, numerical, *__: (numerical, numerical))
    elastic = Elastic("Hertz", {"p_max_MPa": 0.0, "misplaced_load": 0.02}, {"p_max_MPa": 0.01, "misplaced_load": 0.003})
    unsure = {"p_max_MPa": 0.02, "misplaced_load": 0.004}
    solved = SimpleNamespace(case=SimpleNamespace(criteria=None))
    found = verdict._against(elastic, SimpleNamespace(fe=None), unsure, solved)
    assert found.numerical == pytest.approx({"p_max_MPa": 1.25 * 0.01 + 1.25 * 0.02, "misplaced_load": 0.007})


# --- Curves -----------------------------------------------------------------------------------------------------------


def test_a_wheelset_that_follows_the_rails_does_not_slip_across_them_ahead_of_its_axle():
    """It turns as the rails do: at any place ahead both are turned alike."""
    curvature = 1e-3 / 300.0
    motion = Motion(place=np.zeros(4), slip=0.0, curvature_per_mm=curvature)
    arms = np.array([[ahead, 750.0, -460.0] for ahead in (-20.0, 0.0, 5.0)])
    velocity, turning = rigid_slip(arms, motion, 460.0)
    # what is ahead of the axle goes down
    np.testing.assert_allclose(velocity[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(velocity[:, 2], -arms[:, 0] / 460.0, atol=1e-12)
    assert turning[2] == pytest.approx(curvature, rel=1e-12)


def test_what_pulls_a_wheelset_back_is_the_power_of_its_motion_along_the_curve():
    """Its centre goes by 1 - kappa y, and it turns by kappa."""
    force, moment = np.array([200.0, 3e3, 9e4]), np.array([1e5, 2e5, 4e5])
    wheel = SimpleNamespace(force_N=force, moment_Nmm=moment, turned_N=7.0)
    state, line = np.array([5.0, 470.0, 0.1, 2.0]), SimpleNamespace(curvature_per_mm=1e-3)
    assert _pull((wheel, wheel), state, line) == pytest.approx(14.0 - 400.0 * 0.995 - 800.0, rel=1e-12)


def test_a_short_step_of_newtons_method_is_taken_whole():
    """What is linear vanishes after one; a step of 0.6 mm is the longest."""
    for root, iterations in ((0.5, 1), (-1.1, 2)):
        state, *_ = newton(
            lambda at, root=root: SimpleNamespace(residual_N=3.0 * (at - root)),
            lambda _: np.array([[3.0]]),
            np.array([0.0]),
            wanted_N=1e-9,
            most=iterations,
        )
        assert state[0] == pytest.approx(root, abs=1e-12)
