"""Equivalent conicity of rolling-radius differences against closed forms, and against the motion step by step."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fecontact.case import Case, Opposite
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.wheelset import compute_radius_difference
from fecontact.solving.placing import make_wheelset

FINE = np.linspace(-8.0, 8.0, 16001)


def radius_difference_of(function, shifts=FINE) -> RadiusDifference:
    return RadiusDifference(shifts_mm=np.asarray(shifts), difference_mm=np.vectorize(function)(shifts))


@pytest.mark.parametrize("conicity", [0.025, 0.05, 0.4])
@pytest.mark.parametrize("middle", [0.0, -2.3, 1.7])
def test_cones_have_their_own_conicity_about_any_shift_of_equal_radii(conicity, middle):
    cones = radius_difference_of(lambda y: 2.0 * conicity * (y - middle), [-8.0, -1.0, 0.3, 8.0])
    assert cones.equal_radii_mm == pytest.approx(middle, abs=1e-12)
    for amplitude in (0.1, 1.0, 3.0, 5.5):
        assert cones.conicity(amplitude) == pytest.approx(conicity, rel=1e-9)
        assert cones.harmonic_conicity(amplitude) == pytest.approx(conicity, rel=1e-9)
        motion = cones.motion(amplitude)
        assert (motion.low_mm, motion.high_mm) == pytest.approx((middle - amplitude, middle + amplitude), abs=1e-9)


@pytest.mark.parametrize("amplitude", [0.7, 3.0])
def test_a_step_and_a_cubic_have_their_closed_forms(amplitude):
    """Half waves of a step and of a cubic.

    A step c sign(y) takes 4 sqrt(A / c); k y^3 takes 5.2441 / (A sqrt(k)), from the lemniscate.
    """
    step = radius_difference_of(lambda y: math.copysign(0.3, y), [-8.0, -1e-7, 1e-7, 8.0])
    assert step.conicity(amplitude) == pytest.approx(math.pi**2 * 0.3 / (16.0 * amplitude), rel=2e-6)
    # the mean of |cos| is 2 / pi
    assert step.harmonic_conicity(amplitude) == pytest.approx(0.3 * 2.0 / math.pi / amplitude, rel=1e-6)
    cubic = radius_difference_of(lambda y: 0.01 * y**3)
    assert cubic.conicity(amplitude) == pytest.approx(0.01 * (math.pi * amplitude / 5.244115) ** 2, rel=1e-5)
    # the mean of cos^4 is 3/8
    assert cubic.harmonic_conicity(amplitude) == pytest.approx(0.01 * 3 / 8 * amplitude**2, rel=1e-5)


def test_a_gap_between_flanges_is_crossed_at_a_constant_speed():
    """Difference 0 within 1 mm, 0.4 (|y| - 1) mm beyond: straight crossing, then half a wave of cones of 0.2."""
    free = radius_difference_of(lambda y: 0.4 * math.copysign(max(abs(y) - 1.0, 0.0), y))
    for amplitude in (1.5, 3.0):
        speed = math.sqrt(0.2) * (amplitude - 1.0)
        half_wave = 2.0 / speed + math.pi / math.sqrt(0.2)
        assert free.conicity(amplitude) == pytest.approx((math.pi / half_wave) ** 2, rel=1e-5)
    # it does not return
    assert free.conicity(0.8) == pytest.approx(0.0, abs=1e-12)


def test_a_difference_that_steers_away_has_no_motion_and_a_negative_linearisation():
    away = radius_difference_of(lambda y: -0.05 * y)
    assert away.motion(2.0) is None
    assert math.isnan(away.conicity(2.0))
    assert away.harmonic_conicity(2.0) == pytest.approx(-0.025, rel=1e-9)
    # beyond 2 mm it steers back: a motion that is large enough returns, 2 mm are too small to leave the middle
    hollow = radius_difference_of(lambda y: 0.02 * y * (y * y - 4.0))
    assert math.isnan(hollow.conicity(2.5))
    assert hollow.conicity(3.0) > 0.0


def test_no_equal_radii_no_conicity():
    never = radius_difference_of(lambda y: 3.0 + 0.05 * y)
    assert math.isnan(never.equal_radii_mm)
    assert math.isnan(never.conicity(1.0))
    assert math.isnan(never.harmonic_conicity(1.0))
    # beyond the range of the shifts
    assert math.isnan(radius_difference_of(lambda y: 0.05 * y).conicity(8.1))


def test_values_beside_a_place_without_support_are_left_out():
    shifts = np.arange(-5.0, 6.0)
    difference = np.where(np.abs(shifts) == 4.0, np.nan, 0.1 * shifts)
    radius_difference = RadiusDifference.of(shifts, difference)
    assert radius_difference.shifts_mm.tolist() == [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]
    assert RadiusDifference.of(shifts, np.full(11, np.nan)) is None


def wave_length(difference: RadiusDifference, start_mm: float, distance_mm: float, mean_radius_mm: float):
    """Wave length (mm) and both ends of the motion from a start at rest.

    The motion is integrated step by step.
    """

    def rates(_, state):
        return state[1], -float(difference.at(state[0])) / (distance_mm * mean_radius_mm)

    def turns(_, state):
        return state[1]

    motion = solve_ivp(rates, (0.0, 5e4), (start_mm, 0.0), events=turns, rtol=1e-8, atol=1e-10, max_step=100.0)
    at, states = motion.t_events[0], motion.y_events[0]
    # the start itself may be an event
    moving = at > 1.0
    return 2.0 * at[moving][0], states[moving][0][0]


@pytest.mark.parametrize(
    "opposite", [Opposite(), Opposite(rolling_radius_mm=459.0), Opposite(rail="49E1", wheel="CONE20")]
)
@pytest.mark.parametrize("rolls", [False, True])
def test_the_kinematic_equation_integrated_step_by_step_has_the_same_wave_length(opposite, rolls):
    difference = compute_radius_difference(make_wheelset(Case(opposite=opposite)), -10.0, 10.0, rolls=rolls)
    for amplitude in (1.0, 4.0):
        motion = difference.motion(amplitude)
        length, other_end = wave_length(difference, motion.low_mm, 1500.0, 460.0)
        assert other_end == pytest.approx(motion.high_mm, abs=2e-4)
        # cones: 2 pi sqrt(e r0 / (2 conicity))
        expected = 1500.0 * 460.0 / 2.0 * (2.0 * math.pi / length) ** 2
        # jumps of the difference within 1e-4 mm
        assert motion.conicity == pytest.approx(expected, rel=2e-4)
