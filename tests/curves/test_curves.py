"""Wheelset and bogie in curves.

References are closed forms on cones, a proven solution on S1002 and 60E1, and invariants.
"""

import csv
import json
import math
import re
from dataclasses import FrozenInstanceError, dataclass, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from marks import slow_but
from scipy.optimize import brentq, fsolve

import fecontact
from fecontact.bodies import STEEL, RollingPair, Track, combine_moduli_MPa
from fecontact.case import Case
from fecontact.cli import call
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.contact_theories.registry import THEORIES
from fecontact.contact_theories.rolling.kalker import kalker_coefficients
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.curves import model
from fecontact.features.curves.balance import (
    TrackConditions,
    _compute_pull,
    compute_balance,
    compute_vehicle_residual,
    make_motion,
    split_wheelset_states,
)
from fecontact.features.curves.curve import (
    Conditions,
    Ride,
    compute_nadal_limit,
    find_flange_angle_rad,
    make_straight_track,
    make_track_conditions,
    solve_curves,
)
from fecontact.features.curves.loaded import compute_loaded_conicities, compute_radius_differences_mm
from fecontact.features.curves.model import GRAVITY_M_S2, Vehicle, built_in_vehicles, choose_bogie, load_vehicle
from fecontact.features.curves.newton import solve_newton
from fecontact.features.curves.normal import (
    NORMAL_THEORIES,
    OutOfReachError,
    Overlap,
    Surfaces,
    solve_half_space,
    solve_normal_contact,
)
from fecontact.features.curves.pictures import draw_curves, draw_visits
from fecontact.features.curves.records import make_curve_rows, make_curves_record, make_position_rows
from fecontact.features.curves.sentences import describe_difference, describe_paths, describe_straight_track
from fecontact.features.curves.stability import (
    StraightTrack,
    analyse_straight_track,
    compute_eigenvalues,
    find_critical_speed_m_s,
    find_hunting,
    linearise_vehicle,
)
from fecontact.features.curves.steady import follow_path, make_straight_start, solve_equilibrium
from fecontact.features.curves.terminal import format_curves
from fecontact.features.curves.visits import CurveResults, MapColumn, Visit, VisitedCell, compare_theories
from fecontact.features.curves.wheel_forces import ContactSettings, Motion, compute_rigid_slip, compute_wheel_force
from fecontact.placement.wheel_on_rail import set_up_pair
from fecontact.placement.wheelset import Wheelset
from fecontact.profiles.curve import Profile, make_circular_rail_head
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.segments import StraightSegment as Segment
from fecontact.solving.placing import make_wheelset

MODULUS = combine_moduli_MPa(STEEL, STEEL)
INCLINED = math.atan(1.0 / 40.0)

# A cone of 1:20 on rails of radius 300 with crowns at 750 mm; 60 kN a wheel.
SLOPE, RAIL_MM, CROWN_MM, RADIUS_MM, LOAD_N = math.atan(1.0 / 20.0), 300.0, 750.0, 460.0, 120e3


@cache
def cone_surfaces() -> Surfaces:
    ends = [(y, y * math.tan(SLOPE)) for y in (-60.0, 60.0)]
    cone = Profile(name="cone", kind="wheel", segments=(Segment(start=ends[0], end=ends[1]),))
    track = Track(rail_crown_y_mm=CROWN_MM)
    return Surfaces(pair=set_up_pair(make_circular_rail_head(RAIL_MM), cone, inclination_rad=0.0, track=track))


def cone_line(curvature: float = 0.0, *, stiffer: float = 1.0, friction: float = 0.3) -> TrackConditions:
    law = ContactSettings(
        normal=NORMAL_THEORIES["multi_hertz"],
        contact_modulus_MPa=stiffer * MODULUS,
        pair=RollingPair(friction=friction, shear_MPa=STEEL.shear_MPa, poisson=STEEL.poisson),
    )
    return TrackConditions(left=cone_surfaces(), right=cone_surfaces(), law=law, curvature_per_mm=curvature)


class Cone:
    """Closed forms of a cone on circles.

    The contact moves by `arm` times the shift of the axle.
    """

    def __init__(self, axle_mm: float) -> None:
        self.height = axle_mm + RAIL_MM
        self.c = math.sin(SLOPE) / (CROWN_MM * math.cos(SLOPE) - self.height * math.sin(SLOPE))
        self.conicity = CROWN_MM * self.c
        self.e = CROWN_MM - RAIL_MM * math.sin(SLOPE)
        self.r = RADIUS_MM + RAIL_MM * math.sin(SLOPE) * math.tan(SLOPE)
        self.arm = 1.0 + self.c * self.r
        self.gravity = LOAD_N * (2.0 * self.c + self.c**2 * (self.height + CROWN_MM * math.tan(SLOPE)))


FREE = load_vehicle("wheelset")


def straight_equilibrium(line: TrackConditions, vehicle: Vehicle = FREE):
    start = make_straight_start(vehicle, line)
    # stiff contacts are pressed less
    start[1] += 0.1 * (1.0 - (MODULUS / line.law.contact_modulus_MPa) ** (2.0 / 3.0))
    equilibrium = solve_equilibrium(start, vehicle, line)
    assert equilibrium.status == "equilibrium"
    return equilibrium


@pytest.mark.parametrize(("stiffer", "limit"), [(1.0, 1e-3), (10.0, 2e-4)])
def test_a_free_wheelset_runs_where_its_rolling_radii_fit_the_curve(stiffer, limit):
    # Redtenbacher: y = r e / (R conicity); what is left is the roll of the springs
    straight = straight_equilibrium(cone_line(stiffer=stiffer))
    cone, curvature = Cone(straight.state[1]), -1e-3 / 3000.0
    equilibrium = solve_equilibrium(straight.state, FREE, cone_line(curvature, stiffer=stiffer))
    assert equilibrium.status == "equilibrium"
    assert equilibrium.state[0] == pytest.approx(-curvature * cone.r * cone.e / cone.conicity, rel=limit)
    assert -curvature * cone.r * cone.e / cone.conicity == pytest.approx(2.1433, rel=1e-4)


def test_a_slow_wheelset_hunts_with_klingels_wavelength():
    line = cone_line()
    cone = Cone(straight_equilibrium(line).state[1])
    klingel = 2.0 * math.pi * math.sqrt(cone.r * cone.e * cone.arm / cone.conicity)
    motion = find_hunting(linearise_vehicle(FREE, line), 0.5)
    assert 1e3 * motion.wavelength_m == pytest.approx(klingel, rel=1e-3)
    # with the axle's shift in place of the contact's it would be 1.6 % short
    assert cone.arm**0.5 == pytest.approx(1.016, abs=1e-3)


def test_gravity_brings_a_wheelset_back_without_friction():
    line, straight = cone_line(friction=1e-9), straight_equilibrium(cone_line())
    cone, shift = Cone(straight.state[1]), 2.0

    def left_over(place):
        state = straight.state.copy()
        state[:3] = (shift, *place)
        return compute_balance(state, FREE, line).residual_N

    place = fsolve(lambda unknowns: left_over(unknowns)[1:3], [straight.state[1], 1e3 * cone.c * shift], xtol=1e-13)
    assert -left_over(place)[0] == pytest.approx(cone.gravity * shift, rel=1e-3)


@pytest.mark.parametrize(("lateral", "yaw", "speed"), [(500.0, 1e9, 68.3), (2000.0, 4e9, 141.7)])
def test_critical_speed_of_a_wheelset_on_springs(lateral, yaw, speed):
    # without spin and gyroscopic moments, which the closed form leaves out; all of the patch adheres
    line = cone_line(friction=30.0)
    straight = straight_equilibrium(line)
    cone, patch = Cone(straight.state[1]), straight.balance.wheels[0][0].patches[0]
    kalker = kalker_coefficients(patch.a_mm / patch.b_mm, STEEL.poisson)
    f11, f22 = (STEEL.shear_MPa * patch.a_mm * patch.b_mm * c for c in (kalker.c11, kalker.c22))
    k = (lateral + cone.gravity) / cone.arm**2
    m = (1500.0 + 1000e6 * cone.c**2) / 1e3 / cone.arm**2
    inertia, e2, slope = 1000e3, cone.e**2, cone.conicity / cone.arm
    w2 = (f22 * yaw + f11 * e2 * k) / (f11 * e2 * m + f22 * inertia)
    bottom = 4.0 * f11 * f22 * slope * cone.e / cone.r + (k - m * w2) * (yaw - inertia * w2)
    closed = 1e-3 * math.sqrt(4.0 * f11 * f22 * e2 * w2 / bottom)
    assert closed == pytest.approx(speed, rel=1e-3)
    assert FREE.guide is not None
    body = replace(
        FREE.wheelset, mass_kg=1500.0, roll_inertia_kg_m2=1000.0, yaw_inertia_kg_m2=1000.0, axle_inertia_kg_m2=1e-3
    )
    guide = replace(FREE.guide, lateral_N_per_m=1e3 * lateral, yaw_Nm_per_rad=1e-3 * yaw)
    linear = linearise_vehicle(replace(FREE, wheelset=body, guide=guide), line)
    critical_m_s = find_critical_speed_m_s(linear)
    assert critical_m_s == pytest.approx(closed, rel=0.01)
    assert (
        find_hunting(linear, 0.99 * critical_m_s).growth_per_s
        < 0.0
        < find_hunting(linear, 1.01 * critical_m_s).growth_per_s
    )


def rigid_bogie() -> Vehicle:
    """A rigid bogie: wheelsets and frame are a single body.

    It has 120 kN per axle and no secondary suspension across.
    """
    vehicle = load_vehicle("manchester")
    assert vehicle.bogie is not None
    primary = replace(vehicle.bogie.primary, longitudinal_N_per_m=1e11, lateral_N_per_m=1e11, vertical_N_per_m=1e3)
    mass = 4.0 * (LOAD_N / 9.81 - 0.5 * vehicle.bogie.frame.mass_kg - vehicle.wheelset.mass_kg)
    body = replace(vehicle.bogie.body, mass_kg=mass)
    secondary = replace(vehicle.bogie.secondary, longitudinal_N_per_m=0.0, lateral_N_per_m=0.0)
    return replace(vehicle, bogie=replace(vehicle.bogie, primary=primary, body=body, secondary=secondary))


def test_a_rigid_bogie_in_a_wide_curve():
    vehicle, curvature, half = rigid_bogie(), -1e-3 / 20_000.0, 1280.0
    # all of the patch adheres
    line = cone_line(friction=30.0)
    straight = solve_equilibrium(make_straight_start(vehicle, line), vehicle, line)
    equilibrium = solve_equilibrium(straight.state, vehicle, replace(line, curvature_per_mm=curvature))
    assert equilibrium.status == "equilibrium"
    cone, patch = Cone(straight.state[1]), straight.balance.wheels[0][0].patches[0]
    kalker = kalker_coefficients(patch.a_mm / patch.b_mm, STEEL.poisson)
    of_spin = patch.fy_N / patch.normal_force_N
    turned_share = 1.0 + cone.r / cone.e * (math.tan(SLOPE) - of_spin)
    expected_mm = (
        -curvature * cone.r / cone.conicity * (cone.e + kalker.c22 * turned_share * half**2 / (kalker.c11 * cone.e))
    )
    assert expected_mm == pytest.approx(1.208, rel=3e-3)
    assert 0.5 * (equilibrium.state[0] + equilibrium.state[5]) == pytest.approx(expected_mm, rel=5e-3)
    assert 1e-3 * (equilibrium.state[3] - equilibrium.state[8]) == pytest.approx(-2.0 * half * curvature, rel=1e-4)


@pytest.mark.parametrize(
    ("theory", "approach", "factor", "limit"),
    # strips reach Hertz's lengths at half of his approach, with C pi / 4 of his load
    [
        *(("hertz", 1.0, 1.0, 1e-6), ("multi_hertz", 1.0, 1.0, 1e-6), ("half_space", 1.0, 1.0, 0.01)),
        *(("overlap", 0.5, 0.3 * math.pi, 1e-3), ("stripes", 1.0, 1.0, 2e-3), ("kik_piotrowski", 1.0, 1.0, 0.06)),
        *(("analyn", 1.0, 1.0, 2e-3), ("kpec", 1.0, 1.0, 2e-3), ("strip", 1.0, 1.0, 5e-3)),
    ],
)
def test_normal_theories_on_a_circle_are_hertz(theory, approach, factor, limit):
    radius, deep = 460.0, 0.1
    s = np.arange(-12.0, 12.05, 0.1)
    overlap = Overlap(
        s_mm=s,
        depth_mm=approach * deep - s**2 / (2.0 * radius),
        place_mm=np.stack([0.0 * s, s, 0.0 * s], axis=1),
        angle_rad=0.0 * s,
        radius_mm=np.full(s.size, radius),
    )
    (pressed,) = NORMAL_THEORIES[theory](overlap, MODULUS)
    of_hertz = 4.0 / 3.0 * MODULUS * math.sqrt(radius) * deep**1.5
    force = pressed.force_N_per_mm * pressed.width_mm
    assert force.sum() == pytest.approx(factor * of_hertz, rel=limit)
    # in the middle of what is symmetric
    assert force @ pressed.s_mm / force.sum() == pytest.approx(0.0, abs=1e-6)
    if theory != "kik_piotrowski":
        # his area is too large
        assert pressed.half_length_mm.max() == pytest.approx(math.sqrt(radius * deep), rel=0.02)


def test_a_contact_ten_times_as_large_has_strips_ten_times_as_long():
    """The contact has nodes of a 24th of its size, if it is narrower than 7 mm."""

    def longest(size: float) -> float:
        """Half length (mm) of the longest strip of an enlarged contact."""
        s = size * np.arange(-1.0, 1.005, 0.01)
        overlap = Overlap(
            s_mm=s,
            depth_mm=size * 2e-4 - s**2 / (2.0 * 50.0 * size),
            place_mm=np.stack([0.0 * s, s, 0.0 * s], axis=1),
            angle_rad=0.0 * s,
            radius_mm=np.full(s.size, 50.0 * size),
        )
        (pressed,) = NORMAL_THEORIES["half_space"](overlap, MODULUS)
        return float(pressed.half_length_mm.max())

    assert longest(10.0) == pytest.approx(10.0 * longest(1.0), rel=1e-6)


def test_the_half_space_finds_nothing_where_its_nodes_miss_all_that_overlaps():
    s = np.arange(-12.0, 12.05, 0.1)
    # two stretches of 0.1 mm, far apart and between nodes of 0.3 mm
    near = np.minimum(np.abs(s + 8.25), np.abs(s - 8.25))
    overlap = Overlap(
        s_mm=s,
        depth_mm=1e-3 * (0.1 - near) + 1e-9,
        place_mm=np.zeros((s.size, 3)),
        angle_rad=0.0 * s,
        radius_mm=np.full(s.size, 460.0),
    )
    assert np.count_nonzero(overlap.depth_mm > 0.0) == 4
    assert NORMAL_THEORIES["half_space"](overlap, MODULUS) == ()


def test_theories_of_vehicles_are_those_that_are_judged():
    # overlapping strips are no theory of the pressure; half a junction's ellipse is none of a vehicle
    assert set(NORMAL_THEORIES) - {"overlap"} == set(THEORIES) - {"hertz_gauge"}


# S1002 on 60E1


@cache
def wheelset(radius_mm: float = 460.0) -> Wheelset:
    wheelset_pair = set_up_pair(
        resolve_rail("60E1"), resolve_wheel("S1002").profile, inclination_rad=INCLINED, rolling_radius_mm=radius_mm
    )
    return Wheelset.of(wheelset_pair, wheelset_pair)


@cache
def run(vehicle: str, radii: tuple[float, ...], theory: str = "overlap", unbalanced: float = 0.0):
    """Steady motion of a vehicle in curves, in the order of the radii (m)."""
    loaded_vehicle = load_vehicle(vehicle)
    ride = Ride(
        wheelset=wheelset(loaded_vehicle.wheelset.rolling_radius_mm),
        theory=theory,
        conditions=Conditions(unbalanced_m_s2=unbalanced),
    )
    runs = {curve.radius_m: curve for curve in solve_curves(loaded_vehicle, ride, radii)}
    return [runs[radius] for radius in radii]


def test_creepages_on_straight_track_are_those_of_the_wheelset():
    placement = wheelset().placed("left", 3.0, 0.0, 2e-3)
    place = np.array([3.0, float(placement.wheel.centre_mm[2]) - 0.01, 0.0, 2e-3])
    motion = Motion(place=place, slip=0.0, curvature_per_mm=0.0)
    law = ContactSettings(
        normal=NORMAL_THEORIES["hertz"],
        contact_modulus_MPa=MODULUS,
        pair=RollingPair(friction=0.3, shear_MPa=81e3, poisson=0.3),
    )
    creepages = compute_wheel_force(Surfaces(pair=wheelset().left.pair), motion, law).patches[0].creepages
    forces = pytest.importorskip("fecontact.features.creep.forces")
    rigid = forces.calculate_wheelset_creepages(placement)
    assert creepages.eta == pytest.approx(rigid.eta, rel=2e-3)
    # 0.01 mm of approach over the radius
    assert creepages.xi == pytest.approx(rigid.xi, abs=3e-5)
    assert creepages.spin_per_mm == pytest.approx(rigid.spin_per_mm, rel=5e-3)


# Rolling radius of the left wheel less that of the right one, mm, 60 kN a wheel; half-space of another program, and its
# own strips. Below 0.5 mm this half-space is 5 % above it, with 4 times as many nodes as well.
STEERING = {
    0.5: (0.222, 0.254),
    1.0: (0.435, 0.457),
    2.0: (0.744, 0.741),
    3.0: (0.958, 0.962),
    4.0: (1.197, 1.210),
    4.5: (1.356, 1.372),
    4.8: (1.69, 1.54),
    5.0: (2.31, 2.09),
    5.2: (3.13, 2.94),
}


def test_the_half_space_knows_how_a_loaded_wheelset_steers():
    differences_mm = compute_radius_differences_mm(wheelset(), list(STEERING), 60e3, theory="half_space")
    for shift, difference_mm in zip(STEERING, differences_mm, strict=True):
        assert difference_mm == pytest.approx(STEERING[shift][0], rel=0.02), shift


@pytest.mark.parametrize(("shift", "exact"), [(0.1, 0.0444), (0.25, 0.1110)])
def test_the_half_space_of_vehicles_is_that_of_the_ladder(shift, exact):
    # another program has 0.042 and 0.107; the ladder's half-space on grids of 0.04 mm what is here, 2 um either wheel
    (difference_mm,) = compute_radius_differences_mm(wheelset(), [shift], 60e3, theory="half_space")
    assert difference_mm == pytest.approx(exact, abs=1e-3)


def test_a_half_space_that_does_not_converge_is_no_result(monkeypatch):
    loaded_vehicle, ride = load_vehicle("wheelset"), Ride(wheelset=wheelset(), theory="half_space")
    line = make_track_conditions(ride, widest_per_mm=1.0)(0.0)
    good = straight_equilibrium(line, loaded_vehicle)
    assert (good.status, good.notes) == ("equilibrium", ())
    monkeypatch.setattr("fecontact.features.curves.normal._ITERATIONS", 5)
    said = r"the half-space did not converge in 5 iterations \(residual \d\.\de-\d\d of the overlap\)"
    failed = solve_equilibrium(good.state, loaded_vehicle, line)
    assert failed.status == "no equilibrium"
    assert re.match(said, failed.notes[0])
    assert {bool(patch.problem) for patch in failed.balance.wheels[0][0].patches} == {True}
    with pytest.raises(ConvergenceError, match=said):
        compute_radius_differences_mm(wheelset(), [0.5], 60e3, theory="half_space")
    assert re.search(said, analyse_straight_track("half_space", loaded_vehicle, line).problem)


def test_strips_with_influence_on_each_other_steer_like_the_half_space():
    differences_mm = compute_radius_differences_mm(wheelset(), list(STEERING), 60e3, theory="strip")
    for shift, difference_mm in zip(STEERING, differences_mm, strict=True):
        # within 0.2 mm where two patches carry, on the flange root
        limit = 0.06 if shift > 4.6 else 0.02
        assert difference_mm == pytest.approx(STEERING[shift][0], rel=limit), shift


def test_overlapping_strips_are_near_to_it():
    differences_mm = compute_radius_differences_mm(wheelset(), list(STEERING), 60e3)
    for shift, difference_mm in zip(STEERING, differences_mm, strict=True):
        exact, strips = STEERING[shift]
        assert difference_mm == pytest.approx(strips, rel=0.02), shift
        assert difference_mm == pytest.approx(exact, rel=0.15), shift


def test_a_loaded_wheelset_has_half_of_the_rigid_conicity_at_a_millimetre(monkeypatch):
    monkeypatch.setattr("fecontact.features.curves.loaded._CONICITY_THEORIES", ("overlap",))
    conicities = compute_loaded_conicities(Case(), 60e3)
    # the half-space has 0.22, 0.195, 0.171; the rigid wheelset 0.36, 0.22, 0.18
    assert [conicity["overlap"] for conicity in conicities] == pytest.approx([0.22, 0.195, 0.171], rel=0.07)


def test_a_loaded_wheelset_steers_to_both_sides_alike():
    differences_mm = compute_radius_differences_mm(wheelset(), [-3.0, -0.7, 0.7, 3.0], 60e3)
    assert differences_mm == pytest.approx([-difference_mm for difference_mm in differences_mm[::-1]], abs=1e-7)


# Shifts of a free wheelset by another program with overlapping strips, 60 kN a wheel.
FREE_SHIFTS = {10_000: 0.13, 3000: 0.45, 1500: 1.02, 1200: 1.38, 1000: 1.82, 800: 2.59, 600: 3.81, 500: 4.54, 400: 4.94}


def test_a_free_wheelset_in_curves():
    runs = run("wheelset", (*map(float, FREE_SHIFTS), 300.0))
    for curve, shift in zip(runs[:-1], FREE_SHIFTS.values(), strict=True):
        assert curve.status == "equilibrium"
        assert not curve.notes
        assert curve.wheelsets[0].lateral_shift_mm == pytest.approx(shift, abs=0.006), curve.radius_m
        assert abs(curve.wheelsets[0].yaw_mrad) < 0.5
    # on tread and flange at once
    assert runs[-1].wheelsets[0].lateral_shift_mm == pytest.approx(5.12, abs=0.006)
    loads = [patch.normal_force_N for patch in runs[-1].wheelsets[0].wheels[0].patches]
    assert loads == pytest.approx([27e3, 34e3], rel=0.03)


# Leading shift (mm) and yaw (mrad), trailing shift (mm), by that program; cant balanced, and lacking 0.65 m/s2.
RADII = (3000.0, 1000.0, 500.0, 300.0)
BOGIES = {
    ("manchester", 0.0): ((3.40, 0.43, 1.41), (5.31, 2.01, 1.50), (6.12, 4.84, 0.41), (6.22, 8.85, -3.72)),
    ("manchester", 0.65): ((2.96, -0.05, 2.17), (5.35, 1.47, 2.48), (6.12, 4.33, 1.29), (6.23, 7.92, -1.40)),
    ("metro", 0.0): ((1.36, 0.16, 0.38), (5.04, 0.92, 1.84), (5.61, 2.41, 1.82), (6.21, 5.57, 0.89)),
    ("metro", 0.65): ((1.59, -0.19, 0.95), (5.05, 0.44, 2.59), (5.72, 2.00, 2.51), (6.21, 5.06, 1.90)),
}


@pytest.mark.parametrize(("vehicle", "unbalanced"), slow_but(BOGIES, 1))
def test_bogies_in_curves(vehicle, unbalanced):
    runs = run(vehicle, RADII, unbalanced=unbalanced)
    for curve, numbers in zip(runs, BOGIES[vehicle, unbalanced], strict=True):
        first, second = curve.wheelsets
        positions = (first.lateral_shift_mm, first.yaw_mrad, second.lateral_shift_mm)
        # its speeds are not known, which move weight and gyroscopic moments a little
        assert positions == pytest.approx(numbers, abs=0.05, rel=0.05)
        assert curve.status == "equilibrium"
        assert curve.left_over_N < 1e-4
        assert curve.unbalanced_m_s2 == pytest.approx(unbalanced, abs=1e-9)
        for wheelset_run in curve.wheelsets:
            for wheel in wheelset_run.wheels:
                for patch in wheel.patches:
                    assert math.hypot(patch.fx_N, patch.fy_N) <= 0.3 * patch.normal_force_N * (1.0 + 1e-9)
        # strips carry where surfaces overlap, and not only where they are tangent: on a yawed flange 0.13 %
        assert curve.pull_N == pytest.approx(curve.power_per_speed_N, rel=2e-3)


@pytest.mark.slow
def test_guiding_forces_and_resistance_of_the_manchester_bogie():
    runs = {curve.radius_m: curve for curve in run("manchester", RADII)}
    for radius, lateral, vertical in ((3000.0, -3, 54), (1000.0, 6, 55), (500.0, 15, 58), (300.0, 23, 61)):
        outer = runs[radius].wheelsets[0].wheels[0]
        assert 1e-3 * outer.lateral_force_N == pytest.approx(lateral, abs=1.1)
        assert 1e-3 * outer.vertical_force_N == pytest.approx(vertical, abs=1.1)
    assert [patch.normal_force_N for patch in runs[1000.0].wheelsets[0].wheels[0].patches] == pytest.approx(
        [46e3, 9e3], rel=0.04
    )
    # Roeckl's formula, 650 / (R - 55), is that of two-axle wagons
    assert runs[300.0].resistance_N_per_kN == pytest.approx(2.3, abs=0.1)
    assert runs[500.0].resistance_N_per_kN == pytest.approx(1.2, abs=0.1)


@pytest.mark.slow
def test_a_curve_to_the_other_side_is_the_mirror_image():
    right, left = run("manchester", (500.0, -500.0))
    for right_wheelset, left_wheelset in zip(right.wheelsets, left.wheelsets, strict=True):
        assert right_wheelset.lateral_shift_mm == pytest.approx(-left_wheelset.lateral_shift_mm, abs=1e-10)
        assert right_wheelset.yaw_mrad == pytest.approx(-left_wheelset.yaw_mrad, abs=1e-10)
        assert right_wheelset.wheels[0].lateral_force_N == pytest.approx(
            left_wheelset.wheels[1].lateral_force_N, abs=1e-6
        )


def test_the_theory_moves_the_critical_speed():
    loaded_vehicle = load_vehicle("manchester")
    speeds = []
    for theory in ("multi_hertz", "overlap"):
        surfaces = Surfaces(pair=wheelset().left.pair)
        law = ContactSettings(
            normal=NORMAL_THEORIES[theory],
            contact_modulus_MPa=MODULUS,
            pair=RollingPair(friction=0.3, shear_MPa=STEEL.shear_MPa, poisson=STEEL.poisson),
        )
        speeds.append(
            find_critical_speed_m_s(
                linearise_vehicle(loaded_vehicle, TrackConditions(left=surfaces, right=surfaces, law=law))
            )
        )
    # 86 and 67 m/s by another program, whose body has a roll of its own
    assert speeds[0] > 1.1 * speeds[1]
    assert speeds == pytest.approx([86.0, 67.0], rel=0.12)


@pytest.mark.slow
def test_the_half_space_and_the_strip_method_hunt_at_the_same_speed():
    loaded_vehicle = load_vehicle("metro")
    speeds = [
        analyse_straight_track(
            theory, loaded_vehicle, make_straight_track(Ride(wheelset=wheelset(420.0), theory=theory))
        ).critical_speed_km_h
        for theory in ("half_space", "strip")
    ]
    # two programs; the half-space's slopes are known to some percent
    assert speeds[0] == pytest.approx(speeds[1], rel=0.05)
    assert speeds == pytest.approx([222.0, 217.0], rel=0.02)


def test_an_axle_that_turns_with_the_track_leans_outwards():
    # the moment that its angular momentum needs, backwards, in a curve to the right
    vehicle, speed, curvature = load_vehicle("wheelset"), 20.0, -1e-6
    line = replace(cone_line(curvature), speed_m_s=speed)
    momentum = np.array([0.0, vehicle.wheelset.axle_inertia_kg_m2 * speed / 0.46, 0.0])
    needed_moment = np.cross([0.0, 0.0, speed * 1e3 * curvature], momentum)
    assert compute_vehicle_residual(np.zeros(5), vehicle, line)[2] == pytest.approx(-needed_moment[0], rel=1e-12)
    assert needed_moment[0] > 0.0


@pytest.mark.parametrize("unbalanced", [0.0, 0.65])
def test_the_rails_carry_the_bogie_and_its_half_of_the_body(unbalanced):
    loaded_vehicle = load_vehicle("manchester")
    assert loaded_vehicle.bogie is not None
    mass = (
        loaded_vehicle.bogie.body.mass_kg / 2.0
        + loaded_vehicle.bogie.frame.mass_kg
        + 2.0 * loaded_vehicle.wheelset.mass_kg
    )
    curve = run("manchester", RADII, unbalanced=unbalanced)[2]
    tilt, centripetal = math.asin(100.0 / 1500.0), (curve.speed_km_h / 3.6) ** 2 / curve.radius_m
    down = mass * (9.81 * math.cos(tilt) + centripetal * math.sin(tilt))
    wheels = [wheel for axle in curve.wheelsets for wheel in axle.wheels]
    assert sum(wheel.vertical_force_N for wheel in wheels) == pytest.approx(down, rel=1e-9)
    # the track frames of the wheelsets are turned against the bogie's, and the secondary yaw is held by the pivots
    outwards = sum(wheel.lateral_force_N * (1.0 if wheel.side == "left" else -1.0) for wheel in wheels)
    assert outwards == pytest.approx(mass * unbalanced, abs=1e-3)


def test_a_body_that_sways_carries_its_weight_aside():
    """A body on stiff lateral springs as the reference.

    Its weight times the sway is the moment that both wheelsets lack.
    """
    loaded_vehicle = load_vehicle("manchester")
    assert loaded_vehicle.bogie is not None
    stiff = replace(
        loaded_vehicle,
        bogie=replace(loaded_vehicle.bogie, secondary=replace(loaded_vehicle.bogie.secondary, lateral_N_per_m=1e12)),
    )
    ride = Ride(wheelset=wheelset(), conditions=Conditions(unbalanced_m_s2=0.65, cant_mm=0.0))

    def moment_Nm(vehicle):
        (curve,) = solve_curves(vehicle, ride, [1000.0])
        return sum(
            wheel.vertical_force_N * (0.75 if wheel.side == "left" else -0.75)
            for axle in curve.wheelsets
            for wheel in axle.wheels
        )

    weight_N, lever_m, sway_m = 16000.0 * 9.81, 1.8 - 0.8275, 16000.0 * 0.65 / (2.0 * 160e3)
    # the frame leans on the primary springs, and the body with it, a little more for its own weight
    secondary, primary = 2.0 * 430e3 + 940e3, 4.0 * 1.22e6
    leans = secondary / (secondary - weight_N * lever_m) * weight_N * lever_m / primary
    # the wheels stand nearly 1.5 m apart
    assert moment_Nm(loaded_vehicle) - moment_Nm(stiff) == pytest.approx(weight_N * sway_m / (1.0 - leans), rel=0.006)


def test_a_body_that_its_springs_do_not_hold_upright_is_refused(tmp_path):
    vehicle_file = tmp_path / "own.toml"
    text = (Path(model.__file__).parent / "data" / "manchester.toml").read_text("utf-8")
    # half the weight tilts with 16 t times 9.81 m/s2 times 0.9725 m
    soft = text.replace("vertical_N_per_m = 430e3", "vertical_N_per_m = 76e3")
    vehicle_file.write_text(re.sub("roll_bar_Nm_per_rad = .*", "roll_bar_Nm_per_rad = 0", soft), encoding="utf-8")
    with pytest.raises(InputError, match=r"is 1\.52e\+05 N m/rad; allowed: more than 1\.526e\+05 N m/rad"):
        load_vehicle(str(vehicle_file))


def test_a_tread_without_a_flange_does_not_climb_it():
    """Nadal's limit by the angle of the tread would be negative.

    With it, the wheelset derailed at 3 mm.
    """
    curves_found = fecontact.curve("wheelset", (2000.0,), case=Case(wheel="CONE20"))
    ((curve,),) = curves_found.runs.values()
    assert (curve.status, curve.notes) == ("equilibrium", ())
    assert curve.wheelsets[0].lateral_shift_mm == pytest.approx(3.2, abs=0.3)


def test_bodies_turn_their_bogies_against_each_other():
    # the secondary suspension turns the leading bogie outwards, the trailing one inwards
    loaded_vehicle, line = load_vehicle("manchester"), replace(cone_line(-1e-3 / 300.0), speed_m_s=0.0)
    yaw = [
        compute_vehicle_residual(np.zeros(13), choose_bogie(loaded_vehicle, which), line)[-1]
        for which in ("leading", "trailing")
    ]
    expected_Nm = 2.0 * 160e3 * 1.0**2 * 9.5 / 300.0
    assert 0.5 * (yaw[0] - yaw[1]) == pytest.approx(expected_Nm, rel=1e-12)
    assert expected_Nm == pytest.approx(10.1e3, rel=0.01)


def test_a_path_of_slopes_from_before_ends_where_newtons_does():
    loaded_vehicle = load_vehicle("manchester")
    curve = run("manchester", RADII)[2]
    lines = make_track_conditions(Ride(wheelset=wheelset()), widest_per_mm=1e-3 / 3000.0)
    state = [number for axle in curve.wheelsets for number in (axle.lateral_shift_mm, axle.yaw_mrad)]
    (alone,) = follow_path(loaded_vehicle, lines, [-1e-3 / 500.0])
    anew = solve_equilibrium(alone.state + 1e-2, loaded_vehicle, lines(-1e-3 / 500.0))
    assert anew.status == "equilibrium"
    assert [anew.state[k] for k in (0, 3, 5, 8)] == pytest.approx(state, abs=1e-8)


def test_creepages_are_those_of_the_rigid_wheel_at_the_centre_of_pressure_of_each_patch():
    """A contact near the flange root, yawed in a curve.

    The tangent turns by a degree and more within a patch.
    """
    curvature = -1e-3 / 500.0
    line = make_track_conditions(Ride(wheelset=wheelset()), widest_per_mm=-curvature)(curvature)
    state = make_straight_start(FREE, line, (5.3,)) + np.array([0.0, 0.04, 0.0, 4.0, 0.5])
    motion = make_motion(state, curvature)
    patches = compute_wheel_force(line.left, motion, line.law).patches
    assert patches
    for patch in patches:
        (velocity,), turning = compute_rigid_slip(
            np.array([patch.place_mm]) - np.array([0.0, *motion.place[:2]]), motion, FREE.wheelset.rolling_radius_mm
        )
        c, s = math.cos(patch.angle_rad), math.sin(patch.angle_rad)
        creepages = (patch.creepages.xi, patch.creepages.eta, patch.creepages.spin_per_mm)
        assert creepages == pytest.approx((velocity[0], velocity @ (0.0, c, s), turning @ (0.0, -s, c)), rel=1e-12)


def test_of_steps_that_all_make_things_worse_the_best_is_taken():
    """Steps of 0.5, 0.25, 0.125 and 0.0625.

    The step of 0.5 leaves the smallest residual.
    """

    def value_at(state):
        return Parabola(residual_N=np.interp(state, [0.0, 0.0625, 0.125, 0.25, 0.5], [1.0, 1.2, 0.99, 0.95, 0.9]))

    state, residual, _ = solve_newton(value_at, lambda _: np.array([[-2.0]]), np.array([0.0]), wanted_N=1e-9, most=1)
    assert (state[0], residual.residual_N[0]) == (0.5, 0.9)


@dataclass
class Parabola:
    """A residual such as x^2 + 1, which has no root.

    Newton's method oscillates on it.
    """

    residual_N: np.ndarray


def test_a_search_that_stalls_ends_after_as_many_stalls_as_it_may():
    calls = []

    def value_at(state):
        calls.append(float(state[0]))
        return Parabola(residual_N=state**2 + 1.0)

    evaluated = []
    for stalls in (1, 3, 5):
        calls.clear()
        _, residual, _ = solve_newton(
            value_at, lambda state: 2.0 * np.diag(state), np.array([0.5]), wanted_N=1e-9, most=50, stalls=stalls
        )
        # the least of it is 1
        assert residual.residual_N[0] >= 1.0
        evaluated.append(len(calls))
    # the bottom is near at the start: what follows are stalls of five evaluations at most, the halved ones
    assert evaluated[0] < evaluated[1] < evaluated[2] <= evaluated[0] + 4 * 5


def test_a_state_that_cannot_be_evaluated_is_a_failed_step():
    tried = []

    def value_at(state):
        tried.append(float(state[0]))
        if abs(state[0]) > 1.0:
            raise OutOfReachError("beyond 1")
        return Parabola(residual_N=np.arctan(8.0 * (state - 0.9)))

    def slopes_at(state):
        return np.diag(8.0 / (1.0 + (8.0 * (state - 0.9)) ** 2))

    # a slope from before leads beyond, and a whole step of its own does so too; the root is found all the same
    for slopes in (None, np.array([[0.5]])):
        tried.clear()
        state, residual, _ = solve_newton(value_at, slopes_at, np.array([0.65]), wanted_N=1e-9, most=60, slopes=slopes)
        assert state[0] == pytest.approx(0.9, abs=1e-9)
        assert abs(residual.residual_N[0]) < 1e-9
        assert max(tried) > 1.0
    # where no part of a step can be evaluated the search ends at its start, which is not a root
    state, residual, slopes = solve_newton(
        value_at, lambda state: np.array([[-1e-3]]), np.array([-1.0]), wanted_N=1e-9, most=60
    )
    assert (state[0], slopes) == (-1.0, None)
    assert abs(residual.residual_N[0]) > 1.0


def test_a_wheel_in_the_side_of_a_rail_is_out_of_reach():
    s = np.arange(-12.0, 12.05, 0.1)
    overlap = Overlap(
        s_mm=s,
        depth_mm=0.1 - s**2 / 920.0,
        place_mm=np.zeros((s.size, 3)),
        angle_rad=np.full(s.size, math.radians(91.0)),
        radius_mm=np.full(s.size, 460.0),
    )
    for theory in NORMAL_THEORIES.values():
        with pytest.raises(OutOfReachError, match="side of the rail, at an angle of 91 degrees"):
            solve_normal_contact(overlap, theory, MODULUS)
    # so deep that no force is one of a contact
    deep = replace(overlap, angle_rad=0.0 * s, depth_mm=1e16 + 0.0 * s)
    surfaces = SimpleNamespace(overlap=lambda *place: deep, pair=SimpleNamespace(rolling_radius_mm=460.0))
    motion = Motion(place=np.zeros(4), slip=0.0, curvature_per_mm=0.0)
    law = replace(cone_line().law, normal=NORMAL_THEORIES["overlap"])
    with pytest.raises(OutOfReachError, match=r"cannot be computed: normal force is .*allowed: 1e-30 to 1e[+]20"):
        compute_wheel_force(surfaces, motion, law)


@pytest.mark.parametrize(
    ("vehicle", "rail", "wheel", "inclination"),
    slow_but(
        [
            *(("manchester", "60E1", "S1002", curve) for curve in (20.0, 25.0, 30.0, 35.0, 40.0, math.inf)),
            ("metro", "54E1", "EN13715_1in40", 20.0),
            ("metro", "60E2", "MBench_S1002", 25.0),
            ("wheelset", "46E1", "EN15302_H", math.inf),
            ("wheelset", "A55", "EN15302_C", 20.0),
            ("manchester", "MBench_UIC60", "EN15302_A", 30.0),
            ("manchester", "50E6", "EN15302_B", 35.0),
        ],
        *(0, 8),
    ),
)
def test_curves_at_all_inclinations_are_balanced_and_mirror_images(vehicle, rail, wheel, inclination):
    loaded_vehicle = load_vehicle(vehicle)
    case = Case(
        rail=rail,
        wheel=wheel,
        inclination_rad=math.atan(1.0 / inclination),
        rolling_radius_mm=loaded_vehicle.wheelset.rolling_radius_mm,
    )
    ride = Ride(wheelset=make_wheelset(case))
    # straight track, centred: both wheels are the same
    straight = solve_equilibrium(
        make_straight_start(loaded_vehicle, make_straight_track(ride)), loaded_vehicle, make_straight_track(ride)
    )
    assert straight.status == "equilibrium"
    for state in split_wheelset_states(straight.state, loaded_vehicle):
        assert state[[0, 2, 3]] == pytest.approx(0.0, abs=1e-6)
    right, left = sorted(solve_curves(loaded_vehicle, ride, (500.0, -500.0)), key=lambda curve: -curve.radius_m)
    assert (right.status, left.status) == ("equilibrium", "equilibrium")
    assert max(right.left_over_N, left.left_over_N) < 1e-4
    for curve, mirrored in zip(right.wheelsets, left.wheelsets, strict=True):
        assert curve.lateral_shift_mm == pytest.approx(-mirrored.lateral_shift_mm, abs=1e-5)
        assert curve.yaw_mrad == pytest.approx(-mirrored.yaw_mrad, abs=1e-5)
        for wheel_of_one, across in zip(curve.wheels, reversed(mirrored.wheels), strict=True):
            assert wheel_of_one.lateral_force_N == pytest.approx(across.lateral_force_N, abs=1.0)
    # at the balanced speed the rails carry the weight, made heavier by the track's tilt, and nothing across
    across, down = make_track_conditions(ride, widest_per_mm=1e-3 / 500.0)(-1e-3 / 500.0).acceleration_m_s2
    assert across == pytest.approx(0.0, abs=1e-9)
    load = sum(curve.vertical_force_N for run in right.wheelsets for curve in run.wheels)
    if loaded_vehicle.bogie is None:
        assert load == pytest.approx(-down * 1e3 * loaded_vehicle.guide.axle_load_kN / GRAVITY_M_S2, rel=1e-6)
    else:
        mass = (
            0.5 * loaded_vehicle.bogie.body.mass_kg
            + loaded_vehicle.bogie.frame.mass_kg
            + 2.0 * loaded_vehicle.wheelset.mass_kg
        )
        assert load == pytest.approx(-down * mass, rel=1e-6)


def test_curves_without_any_evaluated_state_are_lines_and_not_an_error(monkeypatch, tmp_path):
    def out_of_reach(*_):
        raise OutOfReachError("the contact force cannot be computed: here")

    finished = run("wheelset", (1000.0,))[0]
    monkeypatch.setattr("fecontact.features.curves.wheel_forces.solve_normal_contact", out_of_reach)
    curves_found = fecontact.curve("wheelset", (1000.0, -300.0))
    (wide, tight) = curves_found.runs["overlap"]
    assert (wide.status, tight.status, wide.wheelsets) == ("no equilibrium", "no equilibrium", ())
    assert wide.notes == (
        "no equilibrium found from 4 starting positions",
        "the contact force cannot be computed: here",
    )
    assert math.isnan(wide.pull_N)
    assert math.isnan(wide.left_over_N)
    # beside a curve that is finished
    curves_found = replace(curves_found, runs={"overlap": (finished, tight)}, radii_m=(1000.0, -300.0), visits=())
    said = "\n".join(map(str, format_curves(curves_found)))
    assert "R -300 m: no equilibrium: no equilibrium found from 4 starting positions" in said
    rows = make_curve_rows(curves_found)
    assert [row["radius_m"] for row in rows] == [1000.0, 1000.0, -300.0]
    assert rows[-1]["status"] == "no equilibrium"
    assert json.loads(json.dumps(make_curves_record(curves_found)))["curves"][1]["wheelsets"] == []
    assert draw_curves(curves_found, tmp_path / "curve.png").stat().st_size > 1000


def test_a_wheel_out_of_reach_carries_nothing():
    motion = Motion(place=np.array([0.0, 470.0, 0.0, 0.0]), slip=0.0, curvature_per_mm=0.0)
    law = cone_line().law
    force = compute_wheel_force(Surfaces(pair=wheelset().left.pair), motion, law)
    assert not np.any(force.force_N)
    assert force.patches == ()


# bad input


@pytest.mark.parametrize(
    ("radii", "conditions", "theory", "message"),
    [
        ((40.0,), {}, "overlap", "radius is 40 m; allowed: "),
        ((math.nan,), {}, "overlap", "radius is nan m; allowed: "),
        ((300.0,), {"speed_km_h": 250.0}, "overlap", "speed is 250 km/h at R 300 m; allowed: below .* overturns"),
        # 28.2 m/s: of 2.654 m/s2, on a circle of 300 m
        (
            (300.0,),
            {"speed_km_h": 120.0},
            "overlap",
            "120 km/h at R 300 m; allowed: below 102 km/h, .* unbalanced acceleration is 2 m/s2",
        ),
        ((300.0,), {}, "hertz_gauge", "theory is 'hertz_gauge'; allowed: hertz, multi_hertz, overlap, .* approach"),
    ],
)
def test_curves_that_cannot_be_run_are_refused(radii, conditions, theory, message):
    ride = Ride(wheelset=wheelset(), theory=theory, conditions=Conditions(**conditions))
    with pytest.raises(InputError, match=message):
        solve_curves(load_vehicle("manchester"), ride, radii)


def test_a_wheelbase_that_does_not_fit_into_the_gauge_is_refused():
    loaded_vehicle = load_vehicle("manchester")
    assert loaded_vehicle.bogie is not None
    long = replace(
        loaded_vehicle,
        bogie=replace(loaded_vehicle.bogie, frame=replace(loaded_vehicle.bogie.frame, half_wheelbase_m=5.0)),
    )
    # the arrow of 10 m in the clearance: a wheel climbs from 6.5 mm on, and its flange is steepest some mm further
    with pytest.raises(
        InputError, match=r"radius is 500 m; allowed: at least \d+ m.* does not fit into the clearance"
    ) as raised:
        solve_curves(long, Ride(wheelset=wheelset()), [500.0])
    least_m = float(re.search(r"allowed: at least (\d+) m", str(raised.value)).group(1))
    assert 5.0**2 / 2.0 / 18e-3 < least_m < 5.0**2 / 2.0 / 13e-3


@pytest.mark.slow
def test_an_equilibrium_that_derails_is_said_to():
    loaded_vehicle = load_vehicle("manchester")
    conditions = Conditions(friction=1.0, unbalanced_m_s2=1.0)
    (curve,) = solve_curves(loaded_vehicle, Ride(wheelset=wheelset(), conditions=conditions), [250.0])
    assert curve.status == "derails"
    # the inner wheel has more Y/Q, but no flange at its rail
    (note,) = curve.notes
    limit = compute_nadal_limit(find_flange_angle_rad(wheelset(), "left"), 1.0)
    assert (
        note == f"wheelset 1, left: Y/Q {curve.wheelsets[0].wheels[0].y_over_q:.2f} exceeds Nadal's limit {limit:.2f}"
    )
    assert curve.wheelsets[0].wheels[1].y_over_q > curve.wheelsets[0].wheels[0].y_over_q > limit


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"vehicle": "wheelset", "bogie": "trailing"}, "free wheelset has no bogies"),
        ({"bogie": "middle"}, "allowed: leading, trailing"),
        ({"radii_m": []}, "there are no radii"),
        ({"radii_m": [300.0, 300.0]}, "give each radius once"),
        ({"radii_m": {300.0: -1.0}}, "shares of the distance are -1"),
        ({"theories": ["overlap", "overlap"]}, "theories are overlap, overlap"),
    ],
)
def test_what_cannot_be_meant_is_refused(inputs, message):
    with pytest.raises(InputError, match=message):
        fecontact.curve(**inputs)


@pytest.mark.parametrize(
    "inputs",
    [
        {"friction": 0.0},
        {"cant_mm": -1.0},
        {"speed_km_h": math.inf},
        {"speed_km_h": 60.0, "unbalanced_m_s2": 0.65},
        {"unbalanced_m_s2": 2.1},
        {"unbalanced_m_s2": -2.1},
    ],
)
def test_conditions_out_of_range_are_refused(inputs):
    with pytest.raises(InputError, match="allowed"):
        Conditions(**inputs)


def test_vehicle_files_are_checked(tmp_path):
    assert built_in_vehicles() == ("manchester", "metro", "wheelset")
    vehicle_file = tmp_path / "own.toml"
    good = (Path(model.__file__).parent / "data" / "manchester.toml").read_text("utf-8")
    for old, new, message in (
        ("lateral_N_per_m = 3.884e6", "lateral_N_per_m = -1.0", "own.toml: \\[primary\\]: lateral is -1.0 N/m"),
        ("[frame]", "[frames]", "frames: unknown key"),
        ("rolling_radius_mm = 460.0", "rolling_radius_mm = 0.46", "radius is 0.46 mm; allowed: 100 to 1000 mm"),
        ("height_m = 0.6", "hight_m = 0.6", r"\[frame\]: hight_m is not an input of Frame; did you mean height_m"),
        ("half_pivots_m = 9.5", "", r"\[body\]: half_pivots_m is missing"),
        ("[wheelset]", "[guide]\naxle_load_kN = 100.0\n[wheelset]", "either"),
        ("mass_kg = 32000.0", "mass_kg =", "is not valid TOML"),
    ):
        vehicle_file.write_text(good.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=message):
            load_vehicle(str(vehicle_file))
    vehicle_file.write_text(good, encoding="utf-8")
    assert load_vehicle(str(vehicle_file)) == load_vehicle("manchester")
    with pytest.raises(InputError, match="vehicle is 'tram': no such file; allowed: manchester, metro, wheelset"):
        load_vehicle("tram")


def test_nadals_limit():
    # 70 degrees and friction 0.3: 1.34
    assert compute_nadal_limit(math.radians(70.0), 0.3) == pytest.approx(1.342, abs=1e-3)
    assert compute_nadal_limit(math.radians(45.0), 0.0) == pytest.approx(1.0)
    assert brentq(lambda angle: compute_nadal_limit(angle, 0.5), 0.1, 1.5) == pytest.approx(math.atan(0.5))


# the command


@pytest.mark.slow
def test_springs_at_contact_points_have_no_equilibrium_at_some_radii_which_stands_first(tmp_path, capsys):
    arguments = ["curve", "--vehicle", "wheelset", "--radii", "10000,5000,1000,500", "--theory", "multi_hertz,overlap"]
    assert call([*arguments, "--out", str(tmp_path)]) == 3
    first, *lines = capsys.readouterr().out.splitlines()
    assert first.startswith("multi_hertz against overlap: no equilibrium at R 5000 m, shift differs by up to 0.2")
    assert "the critical speed by +" in first
    assert any(line.startswith("straight track, overlap: critical speed ") for line in lines)
    curves_of = json.loads((tmp_path / "curve.json").read_text("utf-8"))["curves"]
    assert {curve["status"] for curve in curves_of if curve["theory"] == "overlap"} == {"equilibrium"}
    curves_by_radius = {curve["radius_m"]: curve for curve in curves_of if curve["theory"] == "multi_hertz"}
    assert [radius for radius, curve in curves_by_radius.items() if curve["status"] == "no equilibrium"] == [5000.0]
    # where the contact point on the arc of R 300 vanishes under load
    assert "smallest residual" in curves_by_radius[5000.0]["notes"][0]
    assert curves_by_radius[5000.0]["left_over_N"] > 1e3
    assert curves_by_radius[10_000.0]["path_ends_m"] == []
    assert all(5000.0 <= curves_by_radius[radius]["path_ends_m"][0] < 6000.0 for radius in (5000.0, 1000.0, 500.0))
    (said,) = json.loads((tmp_path / "curve.json").read_text("utf-8"))["path_notes"]
    assert said.startswith("multi_hertz: the path from straight track ends at R 5")
    assert said.endswith("no equilibrium found at R 5000 m, another equilibrium at R 1000, 500 m")
    shifts = [curves_by_radius[radius]["wheelsets"][0]["lateral_shift_mm"] for radius in (10_000.0, 1000.0, 500.0)]
    assert shifts == pytest.approx([0.20, 1.58, 4.61], abs=0.04)


@pytest.mark.slow
def test_a_bogie_at_much_acceleration_loses_its_path_and_all_that_lies_beyond_says_so(tmp_path, capsys):
    """A leading wheelset that would jump by 0.3 mm.

    A single step from R 1200 to R 1000 does not show this jump.
    """
    arguments = ["curve", "--radii", "3000,1200,1000,500", "--unbalanced-m-s2", "1.5", "--out", str(tmp_path)]
    assert call(arguments) == 0
    said = "overlap: the path from straight track ends at R 1097 m; beyond: another equilibrium at R 1000, 500 m"
    assert f"note: {said}" in capsys.readouterr().out
    record = json.loads((tmp_path / "curve.json").read_text("utf-8"))
    assert record["path_notes"] == [said]
    ends = [curve["path_ends_m"] for curve in record["curves"]]
    assert ends[:2] == [[], []]
    assert ends[2] == ends[3] == [pytest.approx(1097.5, abs=1.5)]
    with (tmp_path / "curve.csv").open(newline="", encoding="utf-8") as file:
        path_ends_by_radius = {row["radius_m"]: row["path_ends_m"] for row in csv.DictReader(file)}
    assert [bool(path_ends_by_radius[radius]) for radius in ("3000.0", "1200.0", "1000.0", "500.0")] == [
        False,
        False,
        True,
        True,
    ]


@pytest.mark.parametrize(
    ("ends", "status", "said"),
    [
        ((1098.2,), "equilibrium", "ends at R 1098 m; beyond: another equilibrium at R 400 m"),
        ((1098.2, 512.3), "derails", "ends at R 1098 m, the next at R 512.3 m; beyond: another equilibrium at R"),
        ((math.inf,), "no equilibrium", "ends at its start; beyond: no equilibrium found at R 400 m"),
    ],
)
def test_where_a_path_ends_is_told_of_each_side_and_drawn_as_a_gap(ends, status, said, monkeypatch):
    on, off = run("manchester", RADII)[:2]
    runs = (replace(on, radius_m=900.0), replace(off, radius_m=400.0, path_ends_m=ends, status=status))
    mirrored = tuple(replace(curve, radius_m=-curve.radius_m, path_ends_m=(), status="equilibrium") for curve in runs)
    curves_found = CurveResults(
        vehicle=FREE,
        case=Case(),
        conditions=Conditions(),
        radii_m=(900.0, 400.0, -900.0, -400.0),
        share=(0.25,) * 4,
        runs={"overlap": (*runs, *mirrored)},
    )
    (words,) = describe_paths(curves_found)
    assert words.startswith(f"overlap: the path from straight track {said}")
    figures = []
    monkeypatch.setattr("fecontact.features.curves.pictures.save_figure", lambda figure, path: figures.append(figure))
    draw_curves(curves_found, "a.png")
    assert words in figures[0].get_suptitle()
    # two wheelsets
    counts = [len(line.get_xdata()) for line in figures[0].axes[0].lines]
    assert counts == ([3, 3] if status == "no equilibrium" else [3, 3, 1, 1])
    assert len(figures[0].axes[0].get_legend_handles_labels()[1]) == 2


def test_wheels_in_curves_are_positions_of_a_fleet():
    curves_found = curves_to_both_sides()
    rows = make_position_rows(curves_found)
    assert sum(row["weight"] for row in rows) == pytest.approx(1.0)
    # a left wheel in a curve to the right is the right wheel in its mirror image
    of_left, of_right = (
        [(row["shift_mm"], row["load_kN"]) for row in rows if (row["radius_m"], row["side"]) == radius_and_side]
        for radius_and_side in ((500.0, "left"), (-500.0, "right"))
    )
    assert np.array(of_left) == pytest.approx(np.array(of_right), rel=1e-8)
    (right, _) = curves_found.runs["overlap"]
    loads = [1e-3 * wheel.vertical_force_N for axle in right.wheelsets for wheel in axle.wheels]
    shifts = [sign * axle.lateral_shift_mm for axle in right.wheelsets for sign in (1.0, -1.0)]
    assert [(row["shift_mm"], row["load_kN"], row["weight"]) for row in rows[:4]] == [
        (shift, load, 0.25 / 4) for shift, load in zip(shifts, loads, strict=True)
    ]


def test_progress_counts_the_curves_to_both_sides_by_all_theories(monkeypatch):
    right_and_left, heard = run("manchester", (500.0, -500.0)), []
    monkeypatch.setattr(
        "fecontact.features.curves.curve._make_curve_run",
        lambda radius, vehicle, ride, event: replace(right_and_left[radius < 0.0], theory=ride.theory),
    )
    monkeypatch.setattr(
        "fecontact.features.curves.curve.follow_path", lambda vehicle, lines, curvatures: iter(curvatures)
    )
    # straight track has no progress
    monkeypatch.setattr(
        "fecontact.features.curves.running._analyse_ride", lambda vehicle, ride: StraightTrack(theory=ride.theory)
    )
    curves_found = fecontact.curve(
        "manchester",
        (500.0, -500.0),
        theories=("kik_piotrowski", "overlap"),
        progress=lambda *event: heard.append(event),
    )
    assert [(number, total) for number, total, _ in heard] == [(0, 4), (1, 4), (2, 4), (3, 4)]
    assert [[event.radius_m for event in runs] for runs in curves_found.runs.values()] == [[500.0, -500.0]] * 2


def test_forces_of_each_wheel_are_printed_and_stored(tmp_path, capsys):
    """T-gamma of all wheels is the work of the pull.

    For a patch it is force times creepage, with the spin.
    """
    command = ["curve", "--vehicle=wheelset", "--radii=-400", "--inclination=1:20", f"--out={tmp_path}"]
    assert call(command) == 0
    printed = capsys.readouterr().out
    record = json.loads((tmp_path / "curve.json").read_text("utf-8"))
    (curve,) = record["curves"]
    wheels = curve["wheelsets"][0]["wheels"]
    assert sum(wheel["t_gamma_N"] for wheel in wheels) == pytest.approx(curve["power_per_speed_N"], rel=1e-12)
    # strips carry where surfaces overlap, and not only where they are tangent
    assert curve["power_per_speed_N"] == pytest.approx(curve["pull_N"], rel=2e-3)
    largest = max((patch for wheel in wheels for patch in wheel["patches"]), key=lambda patch: patch["t_gamma_N"])
    creepages = largest["creepages"]
    moment_power = -largest["spin_moment_Nmm"] * creepages["spin_per_mm"]
    force_power = -largest["fx_N"] * creepages["xi"] - largest["fy_N"] * creepages["eta"]
    # a tenth by the moment; creepages on the curved surface are not those of the plane at the centre: 0.8 %
    assert moment_power > 0.1 * force_power
    assert force_power + moment_power == pytest.approx(largest["t_gamma_N"], rel=0.012)
    with (tmp_path / "curve.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row, wheel in zip(rows, wheels, strict=True):
        assert float(row["t_gamma_N"]) == wheel["t_gamma_N"]
        forces = [float(row[f"patch{number}_normal_force_N"]) for number in range(1, len(wheel["patches"]) + 1)]
        assert forces == sorted((patch["normal_force_N"] for patch in wheel["patches"]), reverse=True)
        assert {f"patch1_{name}" for name in ("fx_N", "fy_N", "spin_moment_Nmm", "t_gamma_N", "xi", "eta")} <= set(row)
        first = max(wheel["patches"], key=lambda patch: patch["normal_force_N"])
        cells = [f"{1e-3 * first[name]:+.3f}" for name in ("fx_N", "fy_N")]
        (line,) = [line for line in printed.splitlines() if all(cell in line.split() for cell in cells)]
        assert f"{wheel['t_gamma_N']:.2f}" in line.split()
        assert f"{1e-3 * first['spin_moment_Nmm']:+.2f}" in line.split()
    assert f"{curve['power_per_speed_N']:.1f}" in next(line for line in printed.splitlines() if "-400 " in line).split()


def test_creep_forces_of_a_curve_to_the_other_side_are_mirrored():
    """In the frame of the left side the wheels have equal forces."""
    (right,), (left,) = (fecontact.curve("wheelset", [radius]).runs["overlap"] for radius in (900.0, -900.0))
    for wheel, mirrored in zip(right.wheelsets[0].wheels, left.wheelsets[0].wheels[::-1], strict=True):
        assert wheel.t_gamma_N == pytest.approx(mirrored.t_gamma_N, rel=1e-5)
        for patch, mirrored_patch in zip(wheel.patches, mirrored.patches, strict=True):
            for name in ("fx_N", "fy_N", "spin_moment_Nmm"):
                assert getattr(patch, name) == pytest.approx(getattr(mirrored_patch, name), rel=1e-4, abs=0.1), name


@cache
def curves_to_both_sides() -> CurveResults:
    """Results of `manchester` in curves to both sides."""
    return fecontact.curve(
        load_vehicle("manchester"), {500.0: 1.0, -500.0: 3.0}, conditions=fecontact.Conditions(friction=0.3)
    )


def test_python_has_what_the_command_prints():
    loaded_vehicle, curves_found = load_vehicle("manchester"), curves_to_both_sides()
    assert loaded_vehicle.bogie is not None
    assert curves_found.share == (0.25, 0.75)
    right, left = curves_found.runs["overlap"]
    assert right.wheelsets == run("manchester", (500.0, -500.0))[0].wheelsets
    assert left.wheelsets[0].lateral_shift_mm == pytest.approx(-right.wheelsets[0].lateral_shift_mm, abs=1e-10)
    (straight,) = curves_found.straight
    line = make_straight_track(Ride(wheelset=wheelset()))
    model = linearise_vehicle(loaded_vehicle, line)
    assert straight.critical_speed_km_h == pytest.approx(3.6 * find_critical_speed_m_s(model))
    # of what is there, not of what the program says: at this speed nothing grows and nothing fades
    rates = compute_eigenvalues(model, straight.critical_speed_km_h / 3.6)
    worst = rates[np.argmax(rates.real)]
    assert abs(worst.real) < 1e-2 * abs(worst.imag)
    assert straight.wavelength_m == pytest.approx(
        straight.critical_speed_km_h / 3.6 * 2.0 * math.pi / abs(worst.imag), rel=1e-6
    )
    # which the motion in a curve is not
    (said,) = make_curves_record(curves_found)["stability_notes"]
    assert "the critical speed is for straight track" in said
    assert "the stability of the motion in a curve is not computed" in said
    assert f"note: {said}" in list(format_curves(curves_found))
    with pytest.raises(FrozenInstanceError):
        curves_found.share = ()


def test_shares_of_the_way_add_up_where_a_curve_has_no_equilibrium():
    def visit(shift: float, cell: VisitedCell | None) -> Visit:
        place = {"wheelset": 1, "side": "left", "lateral_shift_mm": shift, "vertical_force_N": 6e4, "yaw_mrad": 0.0}
        return Visit(theory="hertz", radius_m=500.0, cell=cell, **place)

    cell = VisitedCell(lateral_shift_mm=1.0, load_kN=60.0, verdict="FAILS", cheapest_theory="strip")
    curves_found = CurveResults(
        vehicle=FREE,
        case=Case(),
        conditions=Conditions(),
        radii_m=(500.0, 300.0),
        share=(0.6, 0.4),
        runs={"hertz": ()},
        visits=(visit(1.0, cell), visit(9.0, None)),
    )
    nowhere = {"not on the map": 0.3, "no equilibrium": 0.4}
    assert curves_found.shares("hertz", "verdict") == pytest.approx({"FAILS": 0.3, **nowhere})
    assert curves_found.shares("hertz", "cheapest_theory") == pytest.approx({"strip": 0.3, **nowhere})


def test_differences_are_the_largest_ones_and_name_their_radius():
    runs = list(run("manchester", RADII))
    moved_wheelsets = [
        replace(curve.wheelsets[1], lateral_shift_mm=curve.wheelsets[1].lateral_shift_mm - 0.25) for curve in runs
    ]
    other_runs = [*runs[:2], replace(runs[2], wheelsets=(runs[2].wheelsets[0], moved_wheelsets[2])), runs[3]]
    other_runs[3] = replace(runs[3], status="no equilibrium")
    straight = [StraightTrack(theory=name, critical_speed_km_h=speed) for name, speed in (("a", 150.0), ("b", 120.0))]
    (difference,) = compare_theories({"a": other_runs, "b": runs}, straight)
    assert (difference.shift_mm, difference.shift_at_m) == (pytest.approx(0.25), 500.0)
    assert difference.y_over_q == 0.0
    assert difference.without_m == (300.0,)
    assert difference.critical_speed == pytest.approx(0.25)
    assert "the critical speed by +25 %" in describe_difference(difference)


@pytest.mark.parametrize(
    "values",
    [
        [-1.0, -2.0],
        # a wheelset of cylinders: its bodies oscillate on the contacts and on the suspension, at any speed alike
        [6.5e-8 + 1550j, 6.5e-8 - 1550j, -14.2 + 76.7j, -14.2 - 76.7j, -0.009],
    ],
)
def test_straight_track_without_hunting_says_so(monkeypatch, values):
    monkeypatch.setattr(
        "fecontact.features.curves.stability.compute_eigenvalues", lambda *_: np.array(values, dtype=complex)
    )
    straight = analyse_straight_track("multi_hertz", FREE, cone_line())
    problem = "no motion oscillates at 7.2 km/h with a wavelength of at least 1 m: the vehicle does not hunt"
    assert straight.problem == problem
    assert (straight.critical_speed_km_h, straight.slow_wavelength_m) == (None, None)
    assert describe_straight_track(straight) == f"straight track, multi_hertz: {problem}"


def test_rounding_errors_of_an_undamped_oscillation_are_no_growth(monkeypatch):
    model, values = linearise_vehicle(FREE, cone_line()), {"real": 6.5e-8}
    monkeypatch.setattr(
        "fecontact.features.curves.stability.compute_eigenvalues",
        lambda *_: np.array([values["real"] + 1550j, -1.0 + 0.5j], dtype=complex),
    )
    assert find_critical_speed_m_s(model) is None
    values["real"] = 1e-5
    assert find_critical_speed_m_s(model) == 2.0


def test_a_critical_speed_below_the_lowest_one_searched_is_no_number():
    line = make_straight_track(Ride(wheelset=wheelset()))
    # a free wheelset hunts from 31 km/h on, and at a tenth of it with a hundred times its mass
    light, body = load_vehicle("wheelset"), load_vehicle("wheelset").wheelset
    heavy = {name: 100.0 * getattr(body, name) for name in ("mass_kg", "roll_inertia_kg_m2", "yaw_inertia_kg_m2")}
    heavy_vehicle = replace(light, wheelset=replace(body, **heavy))
    assert compute_eigenvalues(linearise_vehicle(heavy_vehicle, line), 1.5).real.max() > 0.0
    free = analyse_straight_track("overlap", heavy_vehicle, line)
    assert free.critical_speed_km_h is None
    assert free.problem == "the critical speed is below 7.2 km/h, the lowest speed searched"
    assert free.problem in describe_straight_track(free)
    runs = {name: run("manchester", RADII) for name in ("overlap", "b")}
    (difference,) = compare_theories(runs, [free, StraightTrack(theory="b", critical_speed_km_h=120.0)])
    assert difference.critical_speed is None
    assert f"critical speeds are not compared (overlap: {free.problem})" in describe_difference(difference)


def test_the_picture_of_one_radius_has_the_values_of_each_wheelset(monkeypatch):
    figures = []
    monkeypatch.setattr("fecontact.features.curves.pictures.save_figure", lambda figure, path: figures.append(figure))
    runs = run("manchester", (500.0,))
    curves_found = CurveResults(
        vehicle=FREE, case=Case(), conditions=Conditions(), radii_m=(500.0,), share=(1.0,), runs={"overlap": runs}
    )
    draw_curves(curves_found, "a.png")
    assert "rail 60E1 1:40, wheel S1002" in figures[0].get_suptitle()
    draw_visits(
        replace(
            curves_found,
            columns=(MapColumn(lateral_shift_mm=0.0, reach_mm=0.5, bands=((20.0, 80.0, "HOLDS"),), cells=()),),
        ),
        "b.png",
    )
    assert "rail 60E1 1:40, wheel S1002" in figures[1].axes[0].get_title()
    assert "R 500 m" in figures[0].get_suptitle()
    shift, _, y_over_q, _ = figures[0].axes
    assert [label.get_text() for label in shift.get_xticklabels()] == ["leading", "trailing"]
    shifts = [axle.lateral_shift_mm for axle in runs[0].wheelsets]
    assert [bar.get_height() for bar in shift.patches] == shifts
    assert [text.get_text() for text in shift.texts] == [f"{axle:.3g}" for axle in shifts]
    # to the right: the left wheel is the outer one
    assert [bar.get_height() for bar in y_over_q.patches] == [runs[0].wheelsets[0].wheels[0].y_over_q]
    draw_curves(replace(curves_found, runs={"overlap": run("manchester", RADII)}), "c.png")
    shift = figures[2].axes[0]
    assert shift.get_xlabel().startswith("curvature 1/R in 1/km")
    leading, trailing = (line.get_markerfacecolor() for line in shift.lines)
    assert leading != trailing


def test_the_half_space_of_a_small_overlap_on_a_long_line_is_hertz():
    """Nodes as fine as the overlap is wide, for a gap line of any length."""
    s, radius, across, depth = np.linspace(-20.0, 20.0, 4001), 460.0, 20.0, 0.005
    overlap = Overlap(
        s_mm=s,
        depth_mm=depth - s**2 / (2.0 * across),
        place_mm=np.column_stack((np.zeros_like(s), s, np.zeros_like(s))),
        angle_rad=np.zeros_like(s),
        radius_mm=np.full_like(s, radius),
    )
    (overlap_contact,) = solve_half_space(overlap, MODULUS)
    hertz = hertz_ellipse(0.5 / radius, 0.5 / across, normal_force_N=1.0, contact_modulus_MPa=MODULUS)
    # 0.2 % too much is reached; on the widest steps of 0.3 mm it is 2.7 % too little
    force = float(overlap_contact.force_N_per_mm @ overlap_contact.width_mm)
    assert force == pytest.approx((depth / hertz.approach_mm) ** 1.5, rel=4e-3)


def test_a_wheelset_that_follows_the_rails_does_not_slip_across_them_ahead_of_its_axle():
    """A wheelset that turns as the rails do.

    At any place ahead both are turned alike.
    """
    curvature = 1e-3 / 300.0
    motion = Motion(place=np.zeros(4), slip=0.0, curvature_per_mm=curvature)
    arms = np.array([[ahead, 750.0, -460.0] for ahead in (-20.0, 0.0, 5.0)])
    velocity, turning = compute_rigid_slip(arms, motion, 460.0)
    # what is ahead of the axle goes down
    np.testing.assert_allclose(velocity[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(velocity[:, 2], -arms[:, 0] / 460.0, atol=1e-12)
    assert turning[2] == pytest.approx(curvature, rel=1e-12)


def test_what_pulls_a_wheelset_back_is_the_power_of_its_motion_along_the_curve():
    """A wheelset with the velocity 1 - kappa y of its centre.

    It turns by kappa.
    """
    force, moment = np.array([200.0, 3e3, 9e4]), np.array([1e5, 2e5, 4e5])
    wheel = SimpleNamespace(force_N=force, moment_Nmm=moment, turned_N=7.0)
    state, line = np.array([5.0, 470.0, 0.1, 2.0]), SimpleNamespace(curvature_per_mm=1e-3)
    assert _compute_pull((wheel, wheel), state, line) == pytest.approx(14.0 - 400.0 * 0.995 - 800.0, rel=1e-12)


def test_a_short_step_of_newtons_method_is_taken_whole():
    """A linear residual vanishes after one step.

    The longest step is 0.6 mm.
    """
    for root, iterations in ((0.5, 1), (-1.1, 2)):
        state, *_ = solve_newton(
            lambda at, root=root: SimpleNamespace(residual_N=3.0 * (at - root)),
            lambda _: np.array([[3.0]]),
            np.array([0.0]),
            wanted_N=1e-9,
            most=iterations,
        )
        assert state[0] == pytest.approx(root, abs=1e-12)


@pytest.mark.parametrize(
    ("back_to_back_mm", "says"),
    [("60", "back-to-back distance"), ("1375.95", "does not fit into the clearance of 0.0 mm")],
)
def test_a_wheelset_that_does_not_fit_into_the_track_is_one_line_and_exit_code_2(
    back_to_back_mm, says, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert call(["curve", "--radii", "1000", "--back-to-back-mm", back_to_back_mm]) == 2
    (said,) = capsys.readouterr().err.strip().splitlines()
    assert said.startswith("error: ")
    assert says in said
    assert list(tmp_path.iterdir()) == []
