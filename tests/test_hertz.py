"""Hertz's theory tested alone (V0).

Printed values, independent quadratures, limits, invariants, refusals.
"""

from __future__ import annotations

import ast
import inspect
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipe, ellipkm1
from table_form import curvature_sums_per_mm, table_form

import fecontact.contact_theories.hertz
from fecontact.bodies import STEEL, Material, combine_moduli_MPa
from fecontact.contact_theories.hertz import (
    HertzContact,
    calculate_ellipse_shape,
    hertz_ellipse,
    hertz_from_hessian,
    hertz_spring_force_N,
)
from fecontact.errors import InputError

E_STAR = combine_moduli_MPa(STEEL, STEEL)
# Algebraically equal expressions of well conditioned quantities agree to rounding times a few hundred operations.
ROUNDING = 1e-12

# The same examples in every run.
steady = settings(derandomize=True)

forces = st.floats(1.0, 1e6)
gap_coefficients = st.floats(1e-5, 1.0)
log_ratios = st.floats(-11.0, 11.0)  # of the curvatures; 11 makes an axis ratio of about 1e-2


def steel_ellipse(A: float, B: float, force: float = 1e5) -> HertzContact:
    return hertz_ellipse(A, B, normal_force_N=force, contact_modulus_MPa=E_STAR)


def rotated_hessian(A: float, B: float, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    return turn @ np.diag([2.0 * A, 2.0 * B]) @ turn.T


# ---- printed values -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rail_radius", "a", "b", "p0", "approach", "stiffness"),
    [
        (300.0, 7.16168, 5.38717, 1237.559, 0.10412, 94.13),
        (80.0, 8.5419, 2.7008, 2069.63, 0.12490, 71.64),
        (13.0, 10.0771, 1.0274, 4611.94, 0.15097, 53.91),
    ],
)
def test_wheel_cylinder_on_rail_arc(
    rail_radius: float, a: float, b: float, p0: float, approach: float, stiffness: float
) -> None:
    contact = steel_ellipse(1.0 / 920.0, 0.5 / rail_radius)
    # Half a unit of the last printed digit, plus a tenth of it for digits that were rounded from a 5.
    assert contact.a_mm == pytest.approx(a, abs=0.55 * (1e-5 if rail_radius == 300.0 else 1e-4))
    assert contact.b_mm == pytest.approx(b, abs=0.55 * (1e-5 if rail_radius == 300.0 else 1e-4))
    assert contact.p0_MPa == pytest.approx(p0, abs=0.55 * (1e-3 if rail_radius == 300.0 else 1e-2))
    assert contact.approach_mm == pytest.approx(approach, abs=0.55e-5)
    assert contact.stiffness_GN_per_m15 == pytest.approx(stiffness, abs=0.55e-2)


def test_conformal_pair_of_the_CONTACT_user_guide() -> None:
    # CONTACT 25 user guide, section 5.10: wheel 460 at 45 degrees, rail 10 in a hollow of 10.2, approach 0.09089 mm.
    steel = Material.from_shear(shear_MPa=82_000.0, poisson=0.28)
    contact = hertz_ellipse(
        math.cos(math.pi / 4.0) / 920.0,
        0.5 * (1.0 / 10.0 - 1.0 / 10.2),
        normal_force_N=1e5,
        contact_modulus_MPa=combine_moduli_MPa(steel, steel),
    )
    # Half a unit of the last printed digit.
    assert contact.p0_MPa == pytest.approx(912.68, abs=0.5e-2)
    assert contact.area_mm2 == pytest.approx(164.35, abs=0.5e-2)
    # The approach is an input of the guide that gave 100.0 kN on the half-space grid; its discretisation error of a few
    # 1e-4 shows here, beside half a unit of the fourth digit.
    assert contact.approach_mm == pytest.approx(0.09089, abs=2e-5)


# ---- independent routes to the same contact -------------------------------------------------------------------------


def half_space_deflection(contact: HertzContact, x: float, y: float) -> float:
    """Sum of the deflections of both bodies at a point of the patch.

    It is computed by quadrature of Boussinesq's 1/r along chords. Along a chord through the point the squared pressure
    is a parabola, whose root integrates in closed form; what is left is a periodic smooth integral over the angle, for
    which the midpoint rule converges exponentially.
    """
    # The integrand is analytic in a strip of width about b/a: 40 points per a/b leave less than rounding.
    count = int(200 + 40 * max(contact.a_mm / contact.b_mm, contact.b_mm / contact.a_mm))
    angle = math.pi * (np.arange(count) + 0.5) / count
    u, v = np.cos(angle) / contact.a_mm, np.sin(angle) / contact.b_mm
    p, q = x / contact.a_mm, y / contact.b_mm
    peak = 1.0 - p * p - q * q + (p * u + q * v) ** 2 / (u**2 + v**2)
    mean = float(np.mean(peak / np.sqrt(u**2 + v**2)))
    return contact.p0_MPa / (2.0 * contact.contact_modulus_MPa) * math.pi * mean


@steady
@given(A=gap_coefficients, log_ratio=log_ratios, force=forces, radius=st.floats(0.0, 0.999), turn=st.floats(0.0, 6.3))
def test_contact_condition_holds_all_over_the_patch(
    A: float, log_ratio: float, force: float, radius: float, turn: float
) -> None:
    contact = steel_ellipse(A, A * math.exp(log_ratio), force)
    x, y = contact.a_mm * radius * math.cos(turn), contact.b_mm * radius * math.sin(turn)
    closed = half_space_deflection(contact, x, y) + contact.A_per_mm * x**2 + contact.B_per_mm * y**2
    # Quadrature and closed form both carry rounding only; the sum over up to 1e4 angles costs three digits.
    assert closed == pytest.approx(contact.approach_mm, rel=1e-11)


@steady
@given(log_ratio=st.floats(0.1, 13.0), A=gap_coefficients, force=forces)
def test_legendre_form_of_the_theory(log_ratio: float, A: float, force: float) -> None:
    contact = steel_ellipse(A, A * math.exp(log_ratio), force)
    k = contact.b_mm / contact.a_mm
    big_k, big_e = float(ellipkm1(k * k)), float(ellipe(1.0 - k * k))
    total = contact.A_per_mm + contact.B_per_mm
    # K - E loses the factor 1/m <= 20 at the lower end of this range, and 1 - k^2 in E rounds at 1e-16: 1e-11 holds.
    assert (big_e / k**2 - big_k) / (big_k - big_e) == pytest.approx(math.exp(log_ratio), rel=1e-11)
    assert contact.a_mm**3 == pytest.approx(1.5 * force * big_e / (math.pi * k * k * E_STAR * total), rel=1e-11)
    assert contact.approach_mm == pytest.approx(1.5 * force * big_k / (math.pi * contact.a_mm * E_STAR), rel=1e-11)
    stiffness = 2.0 * math.pi * E_STAR / (3.0 * k) * math.sqrt(big_e / (big_k**3 * total))
    assert contact.stiffness_N_per_mm15 == pytest.approx(stiffness, rel=1e-11)


@pytest.mark.parametrize(("A", "B", "angle"), [(1 / 920, 1 / 600, 0.0), (1 / 920, 1 / 26, 0.0), (1 / 920, 1 / 26, 0.6)])
def test_pressure_integrates_to_the_load(A: float, B: float, angle: float) -> None:
    contact = hertz_from_hessian(rotated_hessian(A, B, angle), normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    count = 1500
    x = contact.extent_x_mm * ((np.arange(count) + 0.5) / count - 0.5)
    y = contact.extent_y_mm * ((np.arange(count) + 0.5) / count - 0.5)
    cell = contact.extent_x_mm * contact.extent_y_mm / count**2
    force = cell * float(contact.pressure_MPa(x[:, None], y[None, :]).sum())
    # The root edge of the pressure limits the midpoint rule to order 1.5: count^-1.5 = 1.7e-5.
    assert force == pytest.approx(1e5, rel=1.7e-5)


# ---- limits ---------------------------------------------------------------------------------------------------------


def test_equal_spheres_printed_values_and_closed_form() -> None:
    contact = steel_ellipse(1e-3, 1e-3)
    # Half a unit of the last printed digit.
    assert contact.a_mm == pytest.approx(6.8753, abs=0.5e-4)
    assert contact.p0_MPa == pytest.approx(1010.07, abs=0.5e-2)
    assert contact.approach_mm == pytest.approx(0.09454, abs=0.5e-5)
    # Hertz's sphere of radius R = 1/(2A) = 500 mm: a^3 = 3FR/(4E*), approach a^2/R, K_H = 4/3 E* sqrt(R).
    radius = 500.0
    a = math.cbrt(3.0 * 1e5 * radius / (4.0 * E_STAR))
    assert contact.a_mm == pytest.approx(a, rel=ROUNDING)
    assert contact.b_mm == pytest.approx(a, rel=ROUNDING)
    assert contact.p0_MPa == pytest.approx(2.0 * a * E_STAR / (math.pi * radius), rel=ROUNDING)
    assert contact.approach_mm == pytest.approx(a**2 / radius, rel=ROUNDING)
    assert contact.stiffness_N_per_mm15 == pytest.approx(4.0 / 3.0 * E_STAR * math.sqrt(radius), rel=ROUNDING)
    assert contact.area_mm2 == pytest.approx(math.pi * a**2, rel=ROUNDING)


@pytest.mark.parametrize("excess", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15])
def test_the_circle_is_approached_smoothly(excess: float) -> None:
    contact = steel_ellipse(1e-3, 1e-3 * (1.0 + excess))
    # First order theory: a/b = (B/A)^(2/3); the next term is of order excess^3 (odd in the logarithms), 1 is ample.
    expected = 2.0 / 3.0 * math.log(contact.B_per_mm / contact.A_per_mm)
    assert math.log(contact.a_mm / contact.b_mm) == pytest.approx(expected, abs=excess**3 + 1e-15)


@pytest.mark.parametrize("ratio", [1e3, 1e5, 1.4e5, 1e9])
def test_slender_patch_is_a_line_contact_across(ratio: float) -> None:
    contact = steel_ellipse(0.02 / ratio, 0.02)
    k = contact.b_mm / contact.a_mm
    # Johnson (1985), section 4.2(c), at the middle: load per length P' = pi/2 p0 b and b^2 = 4 P' R/(pi E*) give
    # b = 2 p0 R/E*. The neglected part is of order k^2 ln(4/k); the constant 1 is above the true one.
    line = 2.0 * contact.p0_MPa / (2.0 * 0.02) / E_STAR
    assert contact.b_mm == pytest.approx(line, rel=k**2 * math.log(4.0 / k))
    # Leading terms of K and E for k -> 0 in B/A = (E/k^2 - K)/(K - E), again to order k^2 ln(1/k).
    long_side = 1.0 / (k**2 * (math.log(4.0 / k) - 1.0))
    assert ratio == pytest.approx(long_side, rel=2.0 * k**2 * math.log(4.0 / k) ** 2)


def test_axis_ratio_of_one_thousandth_is_reached() -> None:
    contact = steel_ellipse(0.02 / 1.4e5, 0.02)
    assert 0.9e-3 < contact.b_mm / contact.a_mm < 1.1e-3
    # Between these the ratio follows the asymptote tested above; here the contact condition by quadrature, at the end.
    end = half_space_deflection(contact, contact.a_mm, 0.0) + contact.A_per_mm * contact.a_mm**2
    assert end == pytest.approx(contact.approach_mm, rel=1e-10)  # rounding, 4e4 angles


# ---- invariants -----------------------------------------------------------------------------------------------------


@steady
@given(A=gap_coefficients, log_ratio=log_ratios, force=forces)
def test_swapping_the_curvatures_swaps_the_axes(A: float, log_ratio: float, force: float) -> None:
    B = A * math.exp(log_ratio)
    ellipse, swapped = steel_ellipse(A, B, force), steel_ellipse(B, A, force)
    # The longer axis belongs to the smaller coefficient; a difference in the last bit may round to a circle.
    assert (ellipse.a_mm - ellipse.b_mm) * (B - A) >= 0.0
    for name, mirrored in (("a_mm", "b_mm"), ("b_mm", "a_mm"), ("p0_MPa",) * 2, ("approach_mm",) * 2):
        assert getattr(ellipse, name) == pytest.approx(getattr(swapped, mirrored), rel=ROUNDING)
    assert ellipse.stiffness_N_per_mm15 == pytest.approx(swapped.stiffness_N_per_mm15, rel=ROUNDING)


@steady
@given(A=gap_coefficients, log_ratio=log_ratios, force=forces, scale=st.floats(0.01, 100.0))
def test_scaling_laws(A: float, log_ratio: float, force: float, scale: float) -> None:
    B = A * math.exp(log_ratio)
    base = steel_ellipse(A, B, force)
    # Lengths times s and load times s^2 leave every pressure alone.
    similar = steel_ellipse(A / scale, B / scale, force * scale**2)
    assert similar.p0_MPa == pytest.approx(base.p0_MPa, rel=ROUNDING)
    assert similar.a_mm == pytest.approx(base.a_mm * scale, rel=ROUNDING)
    assert similar.approach_mm == pytest.approx(base.approach_mm * scale, rel=ROUNDING)
    heavier = steel_ellipse(A, B, force * scale)
    assert heavier.p0_MPa == pytest.approx(base.p0_MPa * math.cbrt(scale), rel=ROUNDING)
    assert heavier.approach_mm == pytest.approx(base.approach_mm * scale ** (2.0 / 3.0), rel=ROUNDING)


@steady
@given(A=gap_coefficients, log_ratio=log_ratios, force=forces)
def test_spring_law_returns_the_load(A: float, log_ratio: float, force: float) -> None:
    contact = steel_ellipse(A, A * math.exp(log_ratio), force)
    spring = hertz_spring_force_N(contact.stiffness_N_per_mm15, contact.approach_mm)
    assert float(spring) == pytest.approx(force, rel=ROUNDING)


def test_spring_law_of_arrays_is_zero_for_open_gaps() -> None:
    force = hertz_spring_force_N(8.0, [[-1.0, 0.0], [4.0, math.nan]])
    assert force.shape == (2, 2)
    np.testing.assert_array_equal(force, [[0.0, 0.0], [64.0, math.nan]])


def test_zero_load_gives_a_zero_patch_with_the_stiffness_of_any_load() -> None:
    empty, loaded = steel_ellipse(1 / 920, 1 / 600, 0.0), steel_ellipse(1 / 920, 1 / 600)
    assert (empty.a_mm, empty.b_mm, empty.p0_MPa, empty.area_mm2, empty.approach_mm) == (0.0,) * 5
    assert empty.stiffness_N_per_mm15 == loaded.stiffness_N_per_mm15
    assert (empty.extent_x_mm, empty.extent_y_mm) == (0.0, 0.0)
    np.testing.assert_array_equal(empty.pressure_MPa([0.0, 1.0], 0.0), [0.0, 0.0])


def test_pressure_at_known_points() -> None:
    contact = steel_ellipse(1 / 920, 1 / 600)
    a, b, p0 = contact.a_mm, contact.b_mm, contact.p0_MPa
    points = contact.pressure_MPa([0.0, 0.6 * a, 0.0, 1.001 * a, 0.8 * a], [0.0, 0.0, 0.8 * b, 0.0, 0.8 * b])
    np.testing.assert_allclose(points, [p0, 0.8 * p0, 0.6 * p0, 0.0, 0.0], rtol=ROUNDING)


# ---- yawed principal axes -------------------------------------------------------------------------------------------


@steady
@given(A=gap_coefficients, log_ratio=log_ratios.filter(lambda r: abs(r) > 1e-6), angle=st.floats(-0.785, 0.785))
def test_yawed_contact_is_the_aligned_one_turned(A: float, log_ratio: float, angle: float) -> None:
    B = A * math.exp(log_ratio)
    aligned = steel_ellipse(A, B)
    yawed = hertz_from_hessian(rotated_hessian(A, B, angle), normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    # The entries of H carry rounding relative to its larger eigenvalue, so the smaller loses the ratio exp(11) = 6e4.
    assert yawed.a_mm == pytest.approx(aligned.a_mm, rel=1e-10)
    assert yawed.b_mm == pytest.approx(aligned.b_mm, rel=1e-10)
    # The axes are determined to rounding over the relative difference of the eigenvalues (the circle has none).
    assert yawed.orientation_rad == pytest.approx(angle, abs=1e-14 / abs(math.expm1(-abs(log_ratio))))
    x, y = np.array([0.5, -0.3, 0.1]) * aligned.a_mm, np.array([0.2, 0.6, -0.9]) * aligned.b_mm
    c, s = math.cos(angle), math.sin(angle)
    # Near the circle a wrong angle moves no pressure, so only the error of the axes stays, amplified by a/b = 1e2.
    np.testing.assert_allclose(yawed.pressure_MPa(c * x - s * y, s * x + c * y), aligned.pressure_MPa(x, y), rtol=1e-8)


@pytest.mark.parametrize("angle", [-0.7, -0.2, 0.0, 0.3, math.pi / 4])
@pytest.mark.parametrize(("A", "B"), [(1 / 920, 1 / 26), (1 / 26, 1 / 920)])
def test_bounding_box_of_a_yawed_patch(A: float, B: float, angle: float) -> None:
    contact = hertz_from_hessian(rotated_hessian(A, B, angle), normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    turn = np.linspace(0.0, 2.0 * math.pi, 20_001)
    edge_x, edge_y = contact.a_mm * np.cos(turn), contact.b_mm * np.sin(turn)
    # The sampled maximum misses at most (step/2)^2/2 = 1.2e-8 of it.
    extent = np.ptp(edge_x * math.cos(angle) - edge_y * math.sin(angle))
    assert contact.extent_x_mm == pytest.approx(extent, rel=5e-8)
    extent = np.ptp(edge_x * math.sin(angle) + edge_y * math.cos(angle))
    assert contact.extent_y_mm == pytest.approx(extent, rel=5e-8)


def test_round_patch_keeps_the_track_axes() -> None:
    contact = hertz_from_hessian(np.eye(2) * 1e-3, normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    assert contact == steel_ellipse(0.5e-3, 0.5e-3)


@pytest.mark.parametrize("h_xy", [0.004, -0.004])
def test_orientation_at_45_degrees_is_the_positive_one(h_xy: float) -> None:
    contact = hertz_from_hessian([[0.01, h_xy], [h_xy, 0.01]], normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    assert contact.orientation_rad == math.pi / 4.0
    # Along (1, 1) the curvature is h_xx + h_xy, so the gap coefficient is half of it.
    assert contact.A_per_mm == pytest.approx(0.5 * (0.01 + h_xy), rel=ROUNDING)
    assert contact.B_per_mm == pytest.approx(0.5 * (0.01 - h_xy), rel=ROUNDING)


@steady
@given(
    curvatures=st.tuples(*[st.floats(-0.02, 0.1).filter(lambda c: abs(c) > 1e-5)] * 4),
    angle=st.floats(-math.pi, math.pi),
)
def test_curvature_sums_are_those_of_the_turned_hessians(
    curvatures: tuple[float, float, float, float], angle: float
) -> None:
    first = np.diag(curvatures[:2])
    second = rotated_hessian(0.5 * curvatures[2], 0.5 * curvatures[3], angle)
    eigenvalues = np.linalg.eigvalsh(first + second)
    k1, k2 = curvature_sums_per_mm(
        R1_mm=1.0 / curvatures[0],
        R1_prime_mm=1.0 / curvatures[1],
        R2_mm=1.0 / curvatures[2],
        R2_prime_mm=1.0 / curvatures[3],
        plane_angle_rad=angle,
    )
    # Gap coefficients are half the eigenvalues; rounding relative to the largest curvature, 0.1.
    assert k1 == pytest.approx(0.5 * eigenvalues.sum(), abs=1e-15)
    assert k2 == pytest.approx(0.5 * (eigenvalues[1] - eigenvalues[0]), abs=1e-15)
    # Eq. 2 as the paper prints it; its root turns rounding of 1e-17 into at most 5e-9 where k2 vanishes.
    d1, d2 = curvatures[0] - curvatures[1], curvatures[2] - curvatures[3]
    printed = 0.5 * math.sqrt(max(d1**2 + d2**2 + 2.0 * d1 * d2 * math.cos(2.0 * angle), 0.0))
    assert k2 == pytest.approx(printed, abs=5e-9)


def test_the_ellipse_of_equal_curvatures_is_a_circle_and_turns_with_them():
    """Hertz: F(0, 1, 1) = pi / 2, and half the approach at each end."""
    circle = calculate_ellipse_shape(2e-3, 2e-3)
    assert (float(circle.axis_ratio), float(circle.part_x)) == pytest.approx((1.0, 0.5), rel=1e-12)
    assert float(circle.integral) == pytest.approx(0.5 * math.pi, rel=1e-12)
    shape, swapped = calculate_ellipse_shape(1e-3, 7e-3), calculate_ellipse_shape(7e-3, 1e-3)
    assert float(shape.axis_ratio * swapped.axis_ratio) == pytest.approx(1.0, rel=1e-12)
    assert float(shape.part_x) == pytest.approx(float(swapped.part_t), rel=1e-12)


# ---- table form -----------------------------------------------------------------------------------------------------

TABLE = {
    30: (2.7306, 0.4931, 1.4526),
    40: (2.1357, 0.5673, 1.6355),
    50: (1.7541, 0.6407, 1.7735),
    60: (1.4858, 0.7171, 1.8752),
    70: (1.2851, 0.7999, 1.9453),
    80: (1.1278, 0.8927, 1.9864),
    90: (1.0, 1.0, 2.0),
}


def coefficients_at(phi: float) -> tuple[float, float]:
    """A and B for a table angle in rad, with A + B = 0.01 per mm."""
    return 0.005 * (1.0 - math.cos(phi)), 0.005 * (1.0 + math.cos(phi))


@pytest.mark.parametrize("phi_deg", TABLE)
def test_table_entries_from_the_exact_theory(phi_deg: int) -> None:
    A, B = coefficients_at(math.radians(phi_deg))
    contact = steel_ellipse(A, B)
    k3 = 1.0 / (2.0 * E_STAR)
    size = math.cbrt(3.0 * 1e5 * k3 / (2.0 * 0.01))
    m, n, lambda_ = TABLE[phi_deg]
    # Half a unit of the fourth decimal, which is all the table has (plus rounding at the 5).
    assert contact.a_mm / size == pytest.approx(m, abs=0.51e-4)
    assert contact.b_mm / size == pytest.approx(n, abs=0.51e-4)
    from_stiffness = math.cbrt(2.0 / 0.01 * (4.0 / (3.0 * k3 * contact.stiffness_N_per_mm15)) ** 2)
    assert from_stiffness == pytest.approx(lambda_, abs=0.51e-4)


@pytest.mark.parametrize("phi_deg", [*TABLE, *range(35, 90, 10), 30.5, 33.0, 88.0])
def test_table_form_against_the_exact_form(phi_deg: float) -> None:
    A, B = coefficients_at(math.radians(phi_deg))
    exact = steel_ellipse(A, B)
    table = table_form(
        R1_mm=0.5 / A,
        R1_prime_mm=math.inf,
        R2_mm=math.inf,
        R2_prime_mm=0.5 / B,
        normal_force_N=1e5,
        contact_modulus_MPa=E_STAR,
    )
    assert math.degrees(table.phi_rad) == pytest.approx(phi_deg, abs=1e-9)
    assert (table.k1_per_mm, table.k2_per_mm) == pytest.approx((A + B, B - A), rel=1e-9, abs=1e-16)
    # Between nodes linear interpolation errs by up to h^2 f''/8 (h = 10 degrees), largest at 30 to 40 degrees: measured
    # 1.55 % for m, 0.23 % for n, 0.42 % for lambda. At nodes only the table's rounding counts, 0.5e-4 of the smallest
    # entry 0.49 gives 1e-4; p0 and K_H collect two of those (the power 3/2 for lambda).
    at_node = phi_deg in TABLE
    a_error, b_error, p0_error, stiffness_error = (
        (1.1e-4, 1.1e-4, 2e-4, 2e-4) if at_node else (0.016, 0.0025, 0.015, 0.0065)
    )
    assert table.a_mm == pytest.approx(exact.a_mm, rel=a_error)
    assert table.b_mm == pytest.approx(exact.b_mm, rel=b_error)
    assert table.p0_MPa == pytest.approx(exact.p0_MPa, rel=p0_error)
    assert table.stiffness_N_per_mm15 == pytest.approx(exact.stiffness_N_per_mm15, rel=stiffness_error)


def test_table_form_of_a_sphere_and_the_misprint() -> None:
    steel_sphere = dict.fromkeys(("R1_mm", "R1_prime_mm", "R2_mm", "R2_prime_mm"), 1000.0)
    table = table_form(**steel_sphere, normal_force_N=1e5, contact_modulus_MPa=E_STAR)
    a = math.cbrt(3.0 * 1e5 * 500.0 / (4.0 * E_STAR))
    # The table is exact at 90 degrees, so only rounding is left.
    assert table.a_mm == pytest.approx(a, rel=ROUNDING)
    assert table.stiffness_N_per_mm15 == pytest.approx(4.0 / 3.0 * E_STAR * math.sqrt(500.0), rel=ROUNDING)
    printed = table.m * math.cbrt(3.0 * math.pi * table.k3_per_MPa * 1e5 / (2.0 * table.k1_per_mm))
    # Digits of the stated factor.
    assert printed / a == pytest.approx(1.4646, abs=0.5e-4)
    assert (printed / a) ** 2 == pytest.approx(2.145, abs=0.5e-3)


def test_table_form_carries_the_angle_between_the_planes() -> None:
    radii = {"R1_mm": 460.0, "R1_prime_mm": math.inf, "R2_mm": 300.0, "R2_prime_mm": math.inf}
    loads = {"normal_force_N": 1e5, "contact_modulus_MPa": E_STAR}
    table = table_form(**radii, plane_angle_rad=math.pi / 2.0, **loads)
    # Crossed cylinders are the first printed case; its table angle, 77.9 degrees, interpolates m, n to 0.25 %.
    assert table.a_mm == pytest.approx(7.16168, rel=2.5e-3)
    assert table.b_mm == pytest.approx(5.38717, rel=2.5e-3)
    with pytest.raises(InputError, match="k1 > k2"):
        table_form(**radii, plane_angle_rad=0.0, **loads)
    with pytest.raises(InputError, match=r"table angle is .* degrees; allowed: 30 to 90 degrees; use hertz_ellipse"):
        table_form(**radii, plane_angle_rad=0.3, **loads)


def test_table_form_at_zero_load() -> None:
    steel_sphere = dict.fromkeys(("R1_mm", "R1_prime_mm", "R2_mm", "R2_prime_mm"), 1000.0)
    table = table_form(**steel_sphere, normal_force_N=0.0, contact_modulus_MPa=E_STAR)
    assert (table.a_mm, table.b_mm, table.p0_MPa) == (0.0, 0.0, 0.0)


# ---- refusals and independence --------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [0.0, -1e-3, math.inf, math.nan])
def test_gap_that_does_not_open_is_refused(bad: float) -> None:
    for A, B in ((bad, 1e-3), (1e-3, bad)):
        with pytest.raises(InputError, match=r"gap coefficient [AB] is .* 1/mm; allowed: finite and > 0; .*concave"):
            steel_ellipse(A, B)


@pytest.mark.parametrize("bad", [-1.0, math.inf, math.nan])
def test_bad_force_is_refused(bad: float) -> None:
    with pytest.raises(InputError, match=r"normal force is .* N; allowed: finite and >= 0"):
        steel_ellipse(1e-3, 1e-3, bad)


def test_bad_modulus_and_stiffness_are_refused() -> None:
    with pytest.raises(InputError, match=r"contact modulus is 0\.0 MPa"):
        hertz_ellipse(1e-3, 1e-3, normal_force_N=1.0, contact_modulus_MPa=0.0)
    with pytest.raises(InputError, match=r"Hertz stiffness is -1\.0 N/mm\^1\.5"):
        hertz_spring_force_N(-1.0, 0.1)


@pytest.mark.parametrize(
    ("hessian", "message"),
    [
        ([[1e-3, 0.0]], r"shape \(2, 2\)"),
        ([[1e-3, math.nan], [math.nan, 1e-3]], "finite"),
        ([[1e-3, 1e-4], [0.0, 1e-3]], "symmetric"),
        ([[1e-3, 2e-3], [2e-3, 1e-3]], "smallest eigenvalue"),
        ([[-1e-3, 0.0], [0.0, -1e-3]], "smallest eigenvalue"),
    ],
)
def test_bad_hessian_is_refused(hessian: list[list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        hertz_from_hessian(hessian, normal_force_N=1.0, contact_modulus_MPa=E_STAR)


@pytest.mark.parametrize("radius", [0.0, math.nan])
def test_bad_radius_and_angle_are_refused(radius: float) -> None:
    with pytest.raises(InputError, match=r"radius R2' is .* mm; allowed: not zero"):
        curvature_sums_per_mm(R1_mm=1.0, R1_prime_mm=1.0, R2_mm=1.0, R2_prime_mm=radius)
    with pytest.raises(InputError, match="plane angle"):
        curvature_sums_per_mm(R1_mm=1.0, R1_prime_mm=1.0, R2_mm=1.0, R2_prime_mm=1.0, plane_angle_rad=math.nan)


def test_the_reference_imports_no_finite_elements() -> None:
    allowed_modules = {
        "__future__",
        "math",
        "functools",
        "itertools",
        "typing",
        "collections.abc",
        "dataclasses",
        "numpy",
        "scipy",
        "fecontact.arrays",
        "fecontact.errors",
        "fecontact.bodies",
    }
    for node in ast.walk(ast.parse(inspect.getsource(fecontact.contact_theories.hertz))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        else:
            continue
        for name in names:
            assert name in allowed_modules or name.split(".")[0] in allowed_modules, name
