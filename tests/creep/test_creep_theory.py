"""Creep laws against closed forms, published values, limits and symmetries."""

import math
from dataclasses import replace

import numpy as np
import pytest
from no_slip import no_slip_coefficients
from scipy.integrate import quad

from fecontact.bodies import STEEL, Material, RollingPair
from fecontact.contact_theories.rolling.creepage import (
    Creepages,
    CreepForce,
    CurvedCreepages,
    RollingEllipse,
    calculate_adhesion_area_mm2,
    combine_materials,
)
from fecontact.contact_theories.rolling.fastsim import (
    CELLS_PER_DIRECTION,
    RollingStrips,
    calculate_flexibilities,
    divide_ellipse,
    divide_pressure,
    fastsim,
    fastsim_strips,
    fit_common_ellipse,
)
from fecontact.contact_theories.rolling.kalker import find_kalker_coefficients, kalker_coefficients, kalker_linear
from fecontact.contact_theories.rolling.polach import polach
from fecontact.contact_theories.rolling.saturation import (
    saturate,
    shen_hedrick_elkins,
    vermeulen_johnson,
    vermeulen_johnson_coefficients,
)
from fecontact.errors import InputError

# CONTACT 25, examples "tractcurv" and "fastsim"
WIDE = RollingEllipse(a_mm=6.304, b_mm=12.607, normal_force_N=106_700, friction=0.33, shear_MPa=82e3, poisson=0.28)
LONG = RollingEllipse(a_mm=8.0, b_mm=4.0, normal_force_N=82e3, friction=0.3, shear_MPa=82e3, poisson=0.28)
LAWS = (kalker_linear, shen_hedrick_elkins, polach, fastsim)
SATURATED = (shen_hedrick_elkins, polach, fastsim)
ROUNDING = 1e-12


def linear_force_creepages(contact: RollingEllipse, e: float) -> Creepages:
    """The longitudinal creepage whose linear force is e mu N."""
    linear = contact.shear_MPa * contact.a_mm * contact.b_mm * find_kalker_coefficients(contact).c11
    return Creepages(xi=e * contact.limit_N / linear)


# Kalker's table


@pytest.mark.parametrize(
    ("a_over_b", "poisson", "c11", "c22", "c23", "c33"),
    [
        (0.1, 0.0, 2.51, 2.51, 0.334, 6.42),
        (0.8, 0.25, 3.91, 3.41, 1.25, 1.37),
        (1.0, 0.25, 4.12, 3.67, 1.47, 1.19),
        (1.0 / 0.3, 0.25, 6.34, 6.40, 4.32, 0.674),
        (10.0, 0.5, 12.9, 16.0, 18.0, 0.228),
    ],
)
def test_the_rows_of_kalkers_table(a_over_b, poisson, c11, c22, c23, c33):
    c = kalker_coefficients(a_over_b, poisson)
    assert (c.c11, c.c22, c.c23, c.c33) == pytest.approx((c11, c22, c23, c33), rel=1e-9)


def test_coefficients_between_the_columns_are_those_that_contact_prints():
    assert kalker_coefficients(0.5, 0.28).c11 == pytest.approx(3.7335, abs=5e-5)
    c = kalker_coefficients(2.0, 0.28)
    assert (c.c11, c.c22, c.c23) == pytest.approx((5.2036, 4.9715, 2.6566), abs=1.1e-4)


@pytest.mark.parametrize(
    ("a_over_b", "poisson", "tolerance"),
    [
        # on rows and columns of the table: its own error
        (0.3, 0.25, 0.006),
        (1.0, 0.25, 0.006),
        (10.0, 0.25, 0.014),
        # between them
        (0.15, 0.3, 0.006),
        (0.45, 0.4, 0.006),
        (1.2, 0.1, 0.006),
        (3.0, 0.25, 0.006),
        (4.0, 0.3, 0.007),
        (1.0 / 0.15, 0.1, 0.009),
        (1.0 / 0.15, 0.4, 0.009),
    ],
)
def test_coefficients_are_those_of_a_solution_without_slip(a_over_b, poisson, tolerance):
    # straight from row to row c23 would be 5 % off at a/b 4, c33 12 % at 0.15
    exact, c = no_slip_coefficients(a_over_b, poisson), kalker_coefficients(a_over_b, poisson)
    assert exact["c32"] == pytest.approx(exact["c23"], rel=1e-3)
    for name in ("c11", "c22", "c23", "c33"):
        assert getattr(c, name) == pytest.approx(exact[name], rel=tolerance), name


def test_coefficients_are_continuous_at_the_circle():
    for poisson in (0.1, 0.3, 0.45):
        just_below, just_above = (kalker_coefficients(1.0 + sign * 1e-9, poisson) for sign in (-1, 1))
        assert just_above.c33 == pytest.approx(just_below.c33, rel=1e-3)


def test_coefficients_are_smooth_along_the_table():
    # a mistyped digit is a kink: third differences of the logarithms stay small along each column
    for poisson in (0.0, 0.25, 0.5):
        for name in ("c11", "c22", "c23", "c33"):
            values = [getattr(kalker_coefficients(r, poisson), name) for r in np.arange(1, 11) / 10.0]
            values += [getattr(kalker_coefficients(10.0 / k, poisson), name) for k in range(9, 0, -1)]
            assert np.abs(np.diff(np.log(values[2:-2]), n=3)).max() < 0.03, (poisson, name)


@pytest.mark.parametrize(("ratio", "poisson"), [(0.09, 0.25), (10.1, 0.25), (1.0, -0.1), (1.0, 0.51), (math.nan, 0.3)])
def test_the_table_ends_where_kalkers_does(ratio, poisson):
    with pytest.raises(InputError, match="allowed"):
        kalker_coefficients(ratio, poisson)


def test_signs_of_the_linear_forces():
    for direction, sign in (
        (Creepages(xi=1e-6), (-1, 0, 0)),
        (Creepages(eta=1e-6), (0, -1, 1)),
        (Creepages(spin_per_mm=1e-6), (0, -1, -1)),
    ):
        force = kalker_linear(WIDE, direction)
        assert np.sign([force.fx_N, force.fy_N, force.mz_Nmm]).tolist() == list(sign)


def test_the_sizes_of_the_linear_forces():
    """Kalker (1967): each coefficient times G and a power of the product of the semi-axes.

    The power is given by the unit of the coefficient.
    """
    c = kalker_coefficients(WIDE.a_mm / WIDE.b_mm, WIDE.poisson)
    G, ab = WIDE.shear_MPa, WIDE.a_mm * WIDE.b_mm
    longitudinal, two, three = (kalker_linear(WIDE, Creepages(**{name: 2e-6})) for name in ("xi", "eta", "spin_per_mm"))
    assert longitudinal.fx_N == pytest.approx(-G * ab * c.c11 * 2e-6, rel=ROUNDING)
    assert two.fy_N == pytest.approx(-G * ab * c.c22 * 2e-6, rel=ROUNDING)
    assert three.fy_N == pytest.approx(-G * ab**1.5 * c.c23 * 2e-6, rel=ROUNDING)
    assert three.mz_Nmm == pytest.approx(-G * ab**2 * c.c33 * 2e-6, rel=ROUNDING)
    # Betti: the moment of a creepage is the force of as large a spin
    assert two.mz_Nmm == pytest.approx(-three.fy_N, rel=ROUNDING)
    # lengths twice as large, the same angles: moments are eight times as large
    larger = replace(WIDE, a_mm=2.0 * WIDE.a_mm, b_mm=2.0 * WIDE.b_mm)
    assert kalker_linear(larger, Creepages(spin_per_mm=1e-6)).mz_Nmm == pytest.approx(8.0 * three.mz_Nmm, rel=ROUNDING)


# saturation


def test_saturation_of_vermeulen_and_johnson():
    for e, ratio in ((0.1, 0.09670), (0.5, 0.42130), (1.0, 0.70370), (2.0, 0.96296), (2.5, 0.99537)):
        assert saturate(e) == pytest.approx(ratio, abs=5e-6)
        assert saturate(e) == pytest.approx(e - e**2 / 3.0 + e**3 / 27.0, rel=ROUNDING)
    assert saturate(3.0) == saturate(7.0) == 1.0


def test_without_its_cubic_term_the_law_would_fall_to_zero_where_it_saturates():
    # as Otero Yugat prints it (eq. 12): 0.75 at e = 1.5, zero at e = 3
    e = np.linspace(0.0, 3.0, 3001)
    printed = e - e**2 / 3.0
    assert printed.max() == printed[1500] == pytest.approx(0.75, abs=1e-12)
    assert printed[-1] == pytest.approx(0.0, abs=1e-12)
    assert [saturate(argument) for argument in e] == pytest.approx(printed + e**3 / 27.0, abs=ROUNDING)


@pytest.mark.parametrize(
    ("ratio", "c11", "c22"),
    [
        (0.1, 4.5044, 3.1936),
        (0.2, 4.5431, 3.2892),
        (0.5, 4.7341, 3.6554),
        (1.0, 5.1613, 4.3243),
        (2.0, 6.1102, 5.6365),
        (5.0, 8.8725, 9.1841),
        (10.0, 13.0074, 14.3703),
    ],
)
def test_coefficients_of_vermeulen_and_johnson(ratio, c11, c22):
    assert vermeulen_johnson_coefficients(ratio, 0.3) == pytest.approx((c11, c22), abs=6e-5)


@pytest.mark.parametrize("ratio", [0.3, 0.9999, 0.9996, 0.9994, 0.999, 1.0001, 3.0])
def test_the_integrals_of_vermeulen_and_johnson_by_quadrature(ratio):
    g2, nu = min(ratio, 1.0 / ratio) ** 2, 0.28

    def integral(integrand):
        return quad(
            lambda t: integrand(math.sin(t) ** 2, math.cos(t) ** 2, math.sqrt(1 - (1 - g2) * math.sin(t) ** 2)),
            0,
            math.pi / 2,
        )[0]

    B, D = integral(lambda s, c, d: c / d), integral(lambda s, c, d: s / d)
    C = integral(lambda s, c, d: s * c / d**3)
    g = math.sqrt(g2)
    phi, psi = (B - nu * (D - C), B - nu * g2 * C) if ratio <= 1 else (g * (D - nu * (D - C)), g * (D - nu * C))
    # quad's own error, and near the circle what cancels
    assert vermeulen_johnson_coefficients(ratio, nu) == pytest.approx((math.pi / phi, math.pi / psi), rel=2e-9)


def test_small_creepages_along_and_across_are_those_of_vermeulen_and_johnson():
    c11, c22 = vermeulen_johnson_coefficients(WIDE.a_mm / WIDE.b_mm, WIDE.poisson)
    force = vermeulen_johnson(WIDE, Creepages(xi=2e-9, eta=-3e-9))
    stiffness = WIDE.shear_MPa * WIDE.a_mm * WIDE.b_mm
    # the saturated force is smaller by a third of its part of mu N, 4e-5
    assert (force.fx_N, force.fy_N) == pytest.approx((-2e-9 * stiffness * c11, 3e-9 * stiffness * c22), rel=1e-4)


def test_the_circle_of_johnson():
    assert vermeulen_johnson_coefficients(1.0, 0.3) == pytest.approx((4 / (1 - 0.225), 4 / (1 - 0.075)), rel=ROUNDING)


def test_the_area_of_adhesion_carries_the_rest_of_the_force():
    for e in (0.0, 0.7, 2.0, 3.0, 5.0):
        ratio = math.sqrt(calculate_adhesion_area_mm2(WIDE, e) / WIDE.area_mm2)
        # Hertz's pressure over it, lower by the ratio, carries the ratio cubed
        assert 1.0 - ratio**3 == pytest.approx(saturate(e), rel=ROUNDING)


def test_spin_is_refused_where_the_theory_has_none():
    with pytest.raises(InputError, match=r"spin is 0.0001 1/mm; allowed: 0, because .* has no spin; use she"):
        vermeulen_johnson(WIDE, Creepages(xi=1e-3, spin_per_mm=1e-4))


# Polach


@pytest.mark.parametrize(
    "small",
    [
        Creepages(xi=1e-11),
        Creepages(eta=-1e-11),
        Creepages(spin_per_mm=1e-11),
        Creepages(eta=1e-11, spin_per_mm=1e-11),
        Creepages(eta=-1e-11, spin_per_mm=-3e-11),
    ],
)
@pytest.mark.parametrize("contact", [WIDE, LONG])
def test_polachs_limit_of_small_creepage_is_kalkers(contact, small):
    # what is left goes with the square of the creepage over the one that saturates
    force, linear = polach(contact, small), kalker_linear(contact, small)
    assert (force.fx_N, force.fy_N) == pytest.approx((linear.fx_N, linear.fy_N), rel=ROUNDING, abs=1e-18)


def test_polachs_limit_of_combined_creepage_is_not_kalkers():
    contact = replace(LONG, a_mm=2.0, b_mm=8.0, poisson=0.3)
    small, c = Creepages(xi=1e-11, eta=2e-11), find_kalker_coefficients(contact)
    shared = math.sqrt(0.2 + 0.8 * (c.c22 / c.c11) ** 2)
    ratio = polach(contact, small).fx_N / kalker_linear(contact, small).fx_N
    assert ratio == pytest.approx(shared, rel=1e-9)
    assert ratio == pytest.approx(0.80, abs=0.005)


# FASTSIM


@pytest.mark.parametrize(
    "creepages",
    [
        Creepages(xi=1e-9),
        Creepages(eta=1e-9),
        Creepages(spin_per_mm=1e-9),
        Creepages(xi=1e-9, eta=-2e-9, spin_per_mm=3e-9),
    ],
)
def test_fastsim_without_slip_is_kalkers_linear_force(creepages):
    no_slip = replace(LONG, friction=1e6)
    force, linear = fastsim(no_slip, creepages, cells=(400, 400)), kalker_linear(no_slip, creepages)
    size = math.hypot(linear.fx_N, linear.fy_N)
    assert (force.fx_N, force.fy_N) == pytest.approx((linear.fx_N, linear.fy_N), abs=1e-4 * size)
    c, G, a, b = find_kalker_coefficients(no_slip), no_slip.shear_MPa, no_slip.a_mm, no_slip.b_mm
    L2, L3 = 8 * a / (3 * G * c.c22), math.pi * a * math.sqrt(a / b) / (4 * G * c.c23)
    moment = math.pi / 4 * a**3 * b * creepages.eta / L2 - 8 / 15 * a**2 * b**3 * creepages.spin_per_mm / L3
    assert force.mz_Nmm == pytest.approx(moment, rel=1e-4)
    assert force.slip_area_mm2 == 0.0


@pytest.mark.parametrize("contact", [WIDE, LONG])
@pytest.mark.parametrize("e", [0.1, 0.5, 1.0, 2.0, 4.0, 10.0])
def test_fastsim_under_an_elliptic_bound_is_polachs_law(contact, e):
    creepage = linear_force_creepages(contact, e)
    force = fastsim(contact, creepage, bound="elliptic", cells=(400, 400))
    assert force.fx_N == pytest.approx(polach(contact, creepage).fx_N, rel=1e-3)


def parabolic_fastsim(e: float) -> float:
    """FASTSIM's force over mu N of one creepage under the parabolic bound, in closed form."""
    d = 3 * math.pi * e / 32
    if d >= 1.0:
        return 1.0
    h = math.sqrt(1 - d * d)
    arc = math.asin(h)
    last = 3 * math.pi / 16 - h * d * (5 - 2 * h * h) / 8 - 3 / 8 * arc
    return 4 / math.pi * (4 * d * (h - h**3 / 3) - 2 * d * d * (h * d + arc) + 4 / 3 * d**3 * h + 4 / 3 * last)


@pytest.mark.parametrize("e", [0.1, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0])
def test_fastsim_under_a_parabolic_bound_in_closed_form(e):
    force = fastsim(WIDE, linear_force_creepages(WIDE, e), cells=(400, 400))
    assert -force.fx_N / WIDE.limit_N == pytest.approx(parabolic_fastsim(e), rel=1e-3)


# per thousand of creepage: Polach, SHE, FASTSIM with a parabolic bound, and CONTACT's own
TRACTION = [
    (0.01, 0.0069, 0.0069, 0.0069, 0.007015),
    (0.4, 0.2681, 0.2517, 0.2509, 0.2588),
    (1.2, 0.6586, 0.6211, 0.6155, 0.6482),
    (2.0, 0.8433, 0.8431, 0.8330, 0.8816),
    (3.2, 0.9427, 0.9818, 0.9735, 0.9976),
]


@pytest.mark.parametrize(("thousandths", "of_polach", "of_she", "of_fastsim", "of_contact"), TRACTION)
def test_the_traction_curve_of_contact(thousandths, of_polach, of_she, of_fastsim, of_contact):
    creepage = Creepages(xi=1e-3 * thousandths)
    laws = (polach, shen_hedrick_elkins, lambda c, x: fastsim(c, x, cells=(200, 200)))
    forces = [-law(WIDE, creepage).fx_N / WIDE.limit_N for law in laws]
    # the printed FASTSIM is the plain sum over its cells, 0.02 % above mu N at full slip
    assert forces == pytest.approx([of_polach, of_she, of_fastsim], abs=2.2e-4)
    # the simplified theories are this far from the exact one
    assert forces[2] == pytest.approx(of_contact, abs=0.055)


def test_lateral_creepage_with_large_spin():
    creepages = Creepages(eta=-6.25e-4, spin_per_mm=6.25e-4)
    # with a bound whose cells sum up to mu N there are 1e-4 between this and the plain midpoint sum of -0.6502
    force = fastsim(LONG, creepages, cells=(50, 50))
    assert force.fy_N / LONG.limit_N == pytest.approx(-0.6502, abs=2e-4)
    fine = fastsim(LONG, creepages, cells=(800, 800))
    assert fine.fy_N / LONG.limit_N == pytest.approx(-0.6474, abs=1e-4)
    assert fine.mz_Nmm == pytest.approx(-37_620, abs=10)
    elliptic = fastsim(LONG, creepages, bound="elliptic", cells=(800, 800))
    assert elliptic.fy_N / LONG.limit_N == pytest.approx(-0.5962, abs=1e-4)
    assert elliptic.mz_Nmm == pytest.approx(-44_600, abs=10)
    assert polach(LONG, creepages).fy_N / LONG.limit_N == pytest.approx(-0.6470, abs=5e-5)
    assert shen_hedrick_elkins(LONG, creepages).fy_N / LONG.limit_N == pytest.approx(-0.5318, abs=5e-5)
    # the exact theory, CONTACT 25
    assert fine.fy_N / LONG.limit_N == pytest.approx(-0.6074, abs=0.045)
    assert elliptic.mz_Nmm == pytest.approx(-48_210, rel=0.08)


@pytest.mark.parametrize(
    ("a", "b", "load", "motion", "percent"),
    [
        # the limits are those that the docstring of CELLS states, each a little above what is reached
        (3.0, 6.0, 80e3, Creepages(xi=1e-3), 0.020),
        (6.3, 12.6, 80e3, Creepages(xi=3e-3, eta=1e-3, spin_per_mm=1e-4), 0.25),
        (2.0, 8.0, 20e3, Creepages(eta=1e-3, spin_per_mm=4e-3), 1.0),
        (6.0, 6.0, 20e3, Creepages(spin_per_mm=4e-3), 1.9),
    ],
)
def test_fastsim_is_as_near_to_its_limit_of_fine_cells_as_it_says(a, b, load, motion, percent):
    contact = RollingEllipse(a_mm=a, b_mm=b, normal_force_N=load, friction=0.3, shear_MPa=82e3, poisson=0.28)
    usual, fine, finer = (fastsim(contact, motion, cells=(n, n)) for n in (CELLS_PER_DIRECTION, 250, 500))
    # of first order with spin: twice the finer less the fine is the limit
    limit = complex(2.0 * finer.fx_N - fine.fx_N, 2.0 * finer.fy_N - fine.fy_N)
    off = 1e2 * abs(complex(usual.fx_N, usual.fy_N) - limit) / contact.limit_N
    assert 0.8 * percent < off < percent


# all laws


def test_the_moment_about_the_origin_has_the_moment_of_the_force_at_its_place():
    """The moment r x F about the normal, on both sides of both axes.

    A force without a moment keeps a moment of zero.
    """
    for x, y in ((2.0, 11.0), (-2.0, 3.0), (5.0, -0.5)):
        moved_force = CreepForce(fx_N=3.0, fy_N=5.0, mz_Nmm=7.0).at(x, y)
        assert moved_force.mz_Nmm == pytest.approx(7.0 + np.linalg.det([[x, y], [3.0, 5.0]]), abs=1e-12)
        assert (moved_force.fx_N, moved_force.fy_N) == (3.0, 5.0)
    # a force along y that acts 2 mm ahead turns the wheel to the left
    assert CreepForce(fx_N=0.0, fy_N=5.0, mz_Nmm=0.0).at(2.0, 0.0).mz_Nmm == 10.0
    assert CreepForce(fx_N=3.0, fy_N=5.0).at(2.0, 11.0).mz_Nmm is None


def force_components(force: CreepForce) -> tuple[float, ...]:
    return (force.fx_N, force.fy_N, force.mz_Nmm or 0.0)


@pytest.mark.parametrize("law", LAWS)
def test_no_creepage_gives_no_force(law):
    assert force_components(law(WIDE, Creepages())) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("law", LAWS)
def test_laws_are_odd_and_mirror(law):
    creepages = Creepages(xi=8e-4, eta=-5e-4, spin_per_mm=2e-4)
    force = force_components(law(LONG, creepages))
    exchanged = force_components(law(LONG, Creepages(xi=-8e-4, eta=5e-4, spin_per_mm=-2e-4)))
    assert exchanged == pytest.approx([-f for f in force], rel=1e-11)
    # the mirror image at y = 0
    mirrored = force_components(law(LONG, Creepages(xi=8e-4, eta=5e-4, spin_per_mm=-2e-4)))
    assert mirrored == pytest.approx([force[0], -force[1], -force[2]], rel=1e-11)


@pytest.mark.parametrize("law", SATURATED)
def test_no_law_goes_beyond_coulomb_and_all_reach_him(law):
    force = law(WIDE, Creepages(xi=0.2, eta=-0.1))
    assert force.force_N <= WIDE.limit_N * (1 + ROUNDING)
    # Polach's law tends to mu N like 4/(3 pi eps^3), FASTSIM's paraboloid and SHE reach it
    assert force.force_N == pytest.approx(WIDE.limit_N, rel=1e-4)
    # Polach's has the direction of the creepage, as sliding has; the others keep that of the linear force
    c = find_kalker_coefficients(WIDE)
    assert force.fx_N / force.fy_N == pytest.approx(-2.0 * (1.0 if law is polach else c.c11 / c.c22), rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_friction_dissipates(law):
    for xi in (0.0, 1e-3, -4e-3):
        for eta in (0.0, 2e-3, -1e-3):
            power = law(WIDE, Creepages(xi=xi, eta=eta)).power_per_speed_N
            assert power > 0.0 if xi or eta else power == 0.0


def test_areas_and_power_of_fastsim():
    creepages, n = Creepages(xi=1e-3, eta=5e-4), 200
    force = fastsim(LONG, creepages, bound="elliptic", cells=(n, n))
    assert force.adhesion_area_mm2 + force.slip_area_mm2 == pytest.approx(LONG.area_mm2, rel=1e-3)
    assert 0.1 < force.slip_area_mm2 / LONG.area_mm2 < 0.9
    assert force.power_per_speed_N == pytest.approx(-(1e-3 * force.fx_N + 5e-4 * force.fy_N), rel=ROUNDING)
    assert force.power_per_speed_N <= force.force_N * math.hypot(1e-3, 5e-4) * (1 + ROUNDING)


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("a_mm", 0.0),
        ("b_mm", -1.0),
        ("normal_force_N", math.inf),
        ("friction", 0.0),
        ("shear_MPa", -1.0),
        ("poisson", 0.5),
    ],
)
def test_impossible_contacts_are_refused(name, bad):
    with pytest.raises(InputError, match="allowed"):
        replace(WIDE, **{name: bad})


@pytest.mark.parametrize("name", ["xi", "eta", "spin_per_mm"])
def test_creepages_are_numbers(name):
    with pytest.raises(InputError, match="allowed: a finite number"):
        Creepages(**{name: math.nan})


def test_a_pair_of_one_material_is_that_material():
    pair_of_both = combine_materials(0.3, STEEL, STEEL)
    assert (pair_of_both.shear_MPa, pair_of_both.poisson) == pytest.approx(
        (STEEL.shear_MPa, STEEL.poisson), rel=ROUNDING
    )
    rigid = Material(young_MPa=1e15, poisson=0.0)
    # half of the compliance
    assert combine_materials(0.3, STEEL, rigid).shear_MPa == pytest.approx(2.0 * STEEL.shear_MPa, rel=1e-6)


# strips over a pressure field


def hertz_field(contact: RollingEllipse, x: np.ndarray, y: np.ndarray, centre: float = 0.0) -> np.ndarray:
    p0 = 1.5 * contact.normal_force_N / contact.area_mm2
    inside = 1 - (x[:, None] / contact.a_mm) ** 2 - ((y[None, :] - centre) / contact.b_mm) ** 2
    return p0 * np.sqrt(np.maximum(inside, 0.0))


PAIR = RollingPair(friction=0.3, shear_MPa=82e3, poisson=0.28)


@pytest.mark.parametrize("bound", ["parabolic", "elliptic", "strips"])
def test_strips_over_hertzs_pressure_are_the_ellipse(bound):
    x, y = np.linspace(-8.3, 8.3, 97), np.linspace(-4.4, 4.4, 93)
    (lobe,) = divide_pressure(x, y, hertz_field(LONG, x, y), PAIR)
    # 32 nodes per semi-axis and more read a Hertz ellipse to some 1e-3
    assert (lobe.contact.a_mm, lobe.contact.b_mm) == pytest.approx((8.0, 4.0), rel=4e-3)
    assert lobe.contact.normal_force_N == pytest.approx(LONG.normal_force_N, rel=1e-3)
    for creepages in (Creepages(xi=1e-3), Creepages(eta=-6e-4, spin_per_mm=6e-4), Creepages(xi=5e-4, eta=5e-4)):
        force, of_ellipse = fastsim_strips((lobe,), creepages, bound=bound), fastsim(LONG, creepages, bound=bound)
        for name in ("fx_N", "fy_N"):
            assert getattr(force, name) == pytest.approx(getattr(of_ellipse, name), abs=4e-3 * LONG.limit_N), name


def test_a_lobe_beside_the_touch_point_has_the_creepages_of_its_place():
    strips = divide_ellipse(LONG, 50)
    moved_strips = replace(strips, y_mm=strips.y_mm + 5.0, centre_y_mm=5.0)
    creepages = Creepages(xi=2e-4, eta=1e-4, spin_per_mm=1e-4)
    force = fastsim_strips((moved_strips,), creepages, bound="parabolic")
    local_force = fastsim(LONG, creepages.at(0.0, 5.0))
    assert creepages.at(0.0, 5.0).xi == pytest.approx(-3e-4)
    assert (force.fx_N, force.fy_N) == pytest.approx((local_force.fx_N, local_force.fy_N), rel=1e-9)
    assert force.mz_Nmm == pytest.approx(local_force.at(0.0, 5.0).mz_Nmm, rel=1e-9)
    # power is what it is, wherever the creepages are told
    assert force.power_per_speed_N == pytest.approx(local_force.power_per_speed_N, rel=1e-9)


def test_separate_patches_have_an_ellipse_each_and_one_together():
    x, y = np.linspace(-9.0, 9.0, 121), np.linspace(-8.0, 22.0, 241)
    field = hertz_field(LONG, x, y) + hertz_field(LONG, x, y, centre=14.0)
    # each node a strip: fewer ones, partly in contact at both ends, would make the area 1 % larger
    pieces = divide_pressure(x, y, field, PAIR, strips=y.size)
    assert [piece.centre_y_mm for piece in pieces] == pytest.approx([0.0, 14.0], abs=1e-3)
    together, centre_x, centre_y = fit_common_ellipse(pieces)
    assert (centre_x, centre_y) == pytest.approx((0.0, 7.0), abs=1e-3)
    assert together.normal_force_N == pytest.approx(2 * LONG.normal_force_N, rel=1e-3)
    assert together.area_mm2 == pytest.approx(2 * LONG.area_mm2, rel=4e-3)
    force = fastsim_strips(pieces, Creepages(eta=1e-3), bound="parabolic")
    assert force.fy_N == pytest.approx(2 * fastsim(LONG, Creepages(eta=1e-3)).fy_N, rel=5e-3)
    (alone,) = divide_pressure(x, y, hertz_field(LONG, x, y), PAIR, strips=y.size)
    single, *_ = fit_common_ellipse([alone])
    assert (single.a_mm, single.b_mm) == pytest.approx((alone.contact.a_mm, alone.contact.b_mm), rel=1e-9)


@pytest.mark.parametrize("cuts", [[], [0.3], [0.1, 0.45, 0.8]])
def test_the_width_of_a_strip_is_part_of_the_second_moment(cuts):
    # the same load on each mm2 of a rectangle, however it is cut: width / sqrt(12) across, and the half length of an
    # ellipse's strip, sqrt(x^2) = half / 2, along
    wide, half = 6.0, 4.0
    ends = wide * np.array([0.0, *cuts, 1.0])
    all_strips = np.ones(ends.size - 1)
    strips = RollingStrips.of(
        PAIR,
        y_mm=0.5 * (ends[1:] + ends[:-1]),
        width_mm=np.diff(ends),
        middle_x_mm=0.0 * all_strips,
        half_length_mm=half * all_strips,
        force_N_per_mm=100.0 * all_strips,
    )
    assert strips.centre_y_mm == pytest.approx(0.5 * wide, rel=1e-12)
    assert strips.contact.b_mm / strips.contact.a_mm == pytest.approx(wide / math.sqrt(12.0) / (0.5 * half), rel=1e-12)


# creepages over curved surfaces


def curved(plane: Creepages, xi, spin) -> CurvedCreepages:
    y = np.linspace(-20.0, 20.0, 81)
    return CurvedCreepages(plane=plane, y_mm=y, xi_beside=xi(y), spin_beside_per_mm=spin(y))


@pytest.mark.parametrize("more_spin", [0.0, -2e-4])
def test_fastsim_over_a_cone_is_that_over_the_plane(more_spin):
    # two patches beside the contact point, also along
    x, y = np.linspace(-9.0, 11.0, 201), np.linspace(-7.0, 12.0, 191)
    cone, two = (1 - ((x[:, None] - at) / a) ** 2 - ((y - c) / b) ** 2 for at, a, c, b in ((2, 8, 2, 3), (0, 6, 9, 2)))
    pressure = 1000 * np.sqrt(np.maximum(cone, 0)) + 600 * np.sqrt(np.maximum(two, 0))
    pieces = divide_pressure(x, y, pressure, PAIR)
    plane = Creepages(xi=4e-4, eta=-3e-4, spin_per_mm=1e-4)
    over = curved(plane, lambda y: -more_spin * y, lambda y: np.full_like(y, more_spin))
    same = replace(plane, spin_per_mm=plane.spin_per_mm + more_spin)
    over_cone, over_plane = over.at(2.0, -3.0), same.at(2.0, -3.0)
    assert (over_cone.xi, over_cone.eta, over_cone.spin_per_mm) == pytest.approx(
        (over_plane.xi, over_plane.eta, over_plane.spin_per_mm), rel=1e-12
    )
    force, expected = fastsim_strips(pieces, over), fastsim_strips(pieces, same)
    for name in ("fx_N", "fy_N", "mz_Nmm", "power_per_speed_N", "slip_area_mm2"):
        assert getattr(force, name) == pytest.approx(getattr(expected, name), rel=1e-12), name
    # power is that of the forces
    power = -(same.xi * expected.fx_N + same.eta * expected.fy_N + same.spin_per_mm * expected.mz_Nmm)
    assert expected.power_per_speed_N == pytest.approx(power, rel=1e-12)


def test_each_line_of_fastsim_has_its_own_creepage():
    # an odd change of the creepage along moves no force at small creepage, and turns the wheel
    change = 3e-6
    over = curved(Creepages(), lambda y: change * y, np.zeros_like)
    force = fastsim_strips((divide_ellipse(LONG),), over)
    # no slip: traction is -(xi/L3) (x_lead - x), so the moment is the integral of y^2 (change / L3) (x_lead - x)
    exact = change / calculate_flexibilities(LONG).L3 * (8.0 / 15.0) * LONG.a_mm**2 * LONG.b_mm**3
    assert force.mz_Nmm == pytest.approx(exact, rel=0.02)
    assert abs(force.fx_N) < 1e-9 * LONG.limit_N
