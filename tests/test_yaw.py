"""Yawed wheels against Hertz's theory of turned cylinders, and against their mirror images."""

import math

import numpy as np
import pytest

from fecontact.case import Case
from fecontact.contact_theories.hertz import hertz_ellipse
from fecontact.solving.hertz import compute_hertz
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space


def turned_cylinders(wheel_mm: float, rail_mm: float, angle_rad: float) -> tuple[float, float]:
    """A and B of the gap A x^2 + B y^2 of two cylinders at an angle.

    Johnson 1985, section 4.1: the axes of the cylinders are at an angle.
    """
    k, q = 1.0 / wheel_mm, 1.0 / rail_mm
    total = 0.5 * (k + q)
    difference = 0.5 * math.sqrt(k**2 + q**2 + 2.0 * k * q * math.cos(2.0 * angle_rad))
    return 0.5 * (total - difference), 0.5 * (total + difference)


def crossed(rail_mm: float, yaw_rad: float, wheel_mm: float = 460.0) -> Case:
    """Case of a yawed (rad) wheel cylinder on a circular rail head."""
    return Case(
        rail=f"circle:{rail_mm:g}",
        wheel=f"cylinder:{wheel_mm:g}",
        inclination_rad=0.0,
        yaw_rad=yaw_rad,
        load_kind="normal",
        load_N=50e3,
    )


@pytest.mark.parametrize("yaw", [0.0, 0.01, 0.05, 0.1, -0.1])
@pytest.mark.parametrize("rail_mm", [80.0, 300.0, 455.0, 600.0])
def test_hertz_of_a_yawed_cylinder_is_that_of_turned_cylinders(rail_mm, yaw):
    case = crossed(rail_mm, yaw)
    hertz = compute_hertz(case, place_case(case))
    # without yaw the wheel's axis is at right angles to the rail's
    small, large = turned_cylinders(460.0, rail_mm, 0.5 * math.pi - yaw)
    exact = hertz_ellipse(small, large, normal_force_N=50e3, contact_modulus_MPa=case.contact_modulus_MPa)
    assert sorted((hertz.A_per_mm, hertz.B_per_mm)) == pytest.approx([small, large], rel=1e-9)
    assert sorted((hertz.a_mm, hertz.b_mm)) == pytest.approx(sorted((exact.a_mm, exact.b_mm)), rel=1e-9)
    assert hertz.p0_MPa == pytest.approx(exact.p0_MPa, rel=1e-9)
    assert hertz.approach_mm == pytest.approx(exact.approach_mm, rel=1e-9)
    # tan 2 phi of the gap's principal axes, from its second derivatives
    k, q = 1.0 / 460.0, 1.0 / rail_mm
    turn = math.atan2(-k * math.sin(2.0 * yaw), q - k * math.cos(2.0 * yaw)) / 2.0
    # the axis that is closest to x
    turn = (turn + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi
    assert abs(hertz.orientation_rad) == pytest.approx(abs(turn), abs=1e-9)


@pytest.mark.parametrize(("rail_mm", "yaw"), [(80.0, 0.05), (300.0, 0.1)])
def test_the_true_gap_of_a_yawed_wheel_on_a_half_space_is_hertz(rail_mm, yaw):
    case = crossed(rail_mm, yaw)
    hertz, expected = expect_on_half_space(case)
    rung = expected.half_space
    # circles are no parabolas: a patch of 8 mm on R 80 turns the normals by 0.05, of which the square counts
    assert rung.pressure_MPa.max() == pytest.approx(hertz.p0_MPa, rel=3e-3)
    p, (x, s) = rung.pressure_MPa, (rung.grid.x_mm, rung.grid.s_mm)
    total = p.sum()
    x, s = x[:, None] - (p.sum(axis=1) @ x) / total, s[None, :] - (p.sum(axis=0) @ s) / total
    xx, xs, ss = ((p * weights).sum() / total for weights in (x * x, x * s, s * s))
    # the long axis of the pressure
    turn = 0.5 * math.atan2(2.0 * xs, xx - ss)
    turn = (turn + 0.25 * math.pi) % (0.5 * math.pi) - 0.25 * math.pi
    assert turn == pytest.approx(hertz.orientation_rad, abs=3e-3)
    assert abs(turn) > 0.01


@pytest.mark.parametrize("roll", ["given", "touching"])
@pytest.mark.parametrize("shift", [-3.0, 2.0, 5.5])
def test_opposite_yaw_mirrors_hertz_and_the_patch_along_the_rail(shift, roll):
    positive, negative = (Case(lateral_shift_mm=shift, yaw_rad=yaw, roll=roll, load_N=20e3) for yaw in (8e-3, -8e-3))
    a, b = place_case(positive), place_case(negative)
    assert a.first.x_mm == pytest.approx(-b.first.x_mm, abs=1e-9)
    for name in ("y_mm", "z_mm", "rail_y_mm", "wheel_y_mm", "contact_angle_rad"):
        assert getattr(a.first, name) == pytest.approx(getattr(b.first, name), abs=1e-9), name
    hertz, hertz_mirrored = compute_hertz(positive, a), compute_hertz(negative, b)
    assert hertz.orientation_rad == pytest.approx(-hertz_mirrored.orientation_rad, abs=1e-9)
    assert abs(hertz.orientation_rad) > 1e-6
    for name in ("a_mm", "b_mm", "p0_MPa", "approach_mm"):
        assert getattr(hertz, name) == pytest.approx(getattr(hertz_mirrored, name), rel=1e-9), name


def test_a_yawed_flange_root_touches_ahead_of_the_axle():
    # the contact point runs ahead by R tan(contact angle) yaw, to first order, and further on a steeper flank
    ahead = []
    for shift in (2.0, 5.5):
        case = Case(lateral_shift_mm=shift, roll="given", yaw_rad=4e-3)
        placement = place_case(case)
        touch, wheel = placement.first, placement.wheel
        wheel_x_mm = float(wheel.point(touch.wheel_y_mm, 0.0, 0.0)[0])
        expected = float(wheel.radius(touch.wheel_u)) * math.tan(touch.contact_angle_rad) * case.yaw_rad
        assert touch.x_mm - wheel_x_mm == pytest.approx(expected, rel=5e-3)
        ahead.append(touch.x_mm - wheel_x_mm)
    assert ahead[1] > ahead[0] > 0.0
    assert np.all(np.isfinite(ahead))
