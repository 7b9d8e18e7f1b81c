"""Creep forces and T-gamma on Hertz's ellipse against numbers that another code, CONTACT 25, publishes.

Two examples are distributed with it: a traction curve (`tractcurv`, longitudinal creepage alone) and lateral creepage
with large spin (`fastsim`). Each has the ellipse of Hertz, and forces by the exact theory of the half-space on cells.
"""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
from fecontact.features.creep.forces import calculate_creep_force, calculate_wheelset_creepages, make_ellipse_patch
from fecontact.features.creep.steady import discretise_ellipse, solve_steady_rolling

STEEL = {"shear_MPa": 82_000.0, "poisson": 0.28}
WIDE = RollingEllipse(a_mm=6.304, b_mm=12.607, normal_force_N=106_700.0, friction=0.33, **STEEL)
LONG = RollingEllipse(a_mm=8.0, b_mm=4.0, normal_force_N=82_000.0, friction=0.3, **STEEL)
# Longitudinal creepage in thousandths, and -Fx / (mu N).
TRACTION_CURVE = {
    **{0.01: 0.007015, 0.4: 0.2588, 0.8: 0.4742, 1.2: 0.6482, 1.6: 0.7831, 2.0: 0.8816, 2.4: 0.9467, 2.8: 0.9832},
    **{3.2: 0.9976, 3.6: 0.9991, 4.0: 0.9993, 8.0: 0.9998, 20.0: 1.0000},
}
# Largest difference from the published force, over the published force, with its reason:
# - the half-space: the published grid of 48 by 44 cells makes forces 1.5 % high at small creepage, and 0.5 % at half of
#   mu N (the linear theory is exact there: 0.00691 instead of 0.007015). Measured: -1.03 %.
# - FASTSIM is a simplified theory, below the exact theory where the patch begins to slide. Measured: -4.4 %.
LIMITS = {"rolling_half_space": 0.011, "fastsim": 0.047}
# Lateral creepage with large spin. Published with 40 by 40 cells of the first order: Fy / (mu N), Mz in N mm, the cells
# that stick over all cells, and the power of friction of the cells at 30 m/s in W.
SPIN = Creepages(eta=-6.25e-4, spin_per_mm=6.25e-4)
SPIN_FORCE, SPIN_MOMENT_NMM, SPIN_ADHESION, SPIN_POWER_W, SPEED_M_S = -0.6074, -48_210.0, 356 / 1276, 540.4, 30.0
# T-gamma from the published power, and from the published force and moment. Both are equal on fine cells: the power of
# coarse cells lacks a part. The difference of 13 % is the uncertainty of the published T-gamma.
T_GAMMA_OF_POWER_N = SPIN_POWER_W / SPEED_M_S
T_GAMMA_OF_FORCES_N = -(SPIN.eta * SPIN_FORCE * LONG.limit_N + SPIN.spin_per_mm * SPIN_MOMENT_NMM)


@pytest.mark.parametrize("theory", LIMITS)
@pytest.mark.parametrize("thousandths", TRACTION_CURVE)
def test_the_traction_curve(theory, thousandths):
    xi, published = 1e-3 * thousandths, TRACTION_CURVE[thousandths]
    force = calculate_creep_force(theory, make_ellipse_patch(WIDE), Creepages(xi=xi))
    assert -force.fx_N / WIDE.limit_N == pytest.approx(published, rel=LIMITS[theory])
    assert force.fy_N == pytest.approx(0.0, abs=1e-6 * WIDE.limit_N)
    assert force.mz_Nmm == pytest.approx(0.0, abs=1e-6 * WIDE.limit_N * WIDE.b_mm)
    # T-gamma of pure longitudinal creepage is the force times the creepage
    assert force.power_per_speed_N == pytest.approx(published * WIDE.limit_N * xi, rel=LIMITS[theory])


def test_the_half_space_with_large_spin():
    """From 24 to 96 cells the force goes from -0.610 to -0.622 mu N; the published cells are coarse too."""
    force = calculate_creep_force("rolling_half_space", make_ellipse_patch(LONG), SPIN)
    assert force.fx_N == pytest.approx(0.0, abs=1e-6 * LONG.limit_N)
    # measured: +1.3 % and -3.7 %
    assert force.fy_N / LONG.limit_N == pytest.approx(SPIN_FORCE, rel=0.015)
    assert force.mz_Nmm == pytest.approx(SPIN_MOMENT_NMM, rel=0.04)
    # cells at the border of adhesion: a row of 48 is 2 %
    area = force.adhesion_area_mm2 + force.slip_area_mm2
    assert force.adhesion_area_mm2 / area == pytest.approx(SPIN_ADHESION, abs=0.02)


@pytest.mark.parametrize("cells", [48, 96])
def test_t_gamma_of_the_half_space_with_large_spin(cells):
    """T-gamma lies between both published values.

    The moment makes 1.5 times T-gamma, and the force takes half of it. So 1.3 and 3.7 % of these make 6 % of T-gamma.
    """
    assert pytest.approx((18.01, 20.79), abs=0.005) == (T_GAMMA_OF_POWER_N, T_GAMMA_OF_FORCES_N)
    force = solve_steady_rolling(discretise_ellipse(LONG.a_mm, LONG.b_mm, 82e3, cells), SPIN, LONG).force
    assert T_GAMMA_OF_POWER_N < force.power_per_speed_N < T_GAMMA_OF_FORCES_N
    assert force.power_per_speed_N == pytest.approx(T_GAMMA_OF_FORCES_N, rel=0.065)
    moment_part = -force.mz_Nmm * SPIN.spin_per_mm
    assert moment_part > 1.4 * force.power_per_speed_N
    assert -force.fy_N * SPIN.eta + moment_part == pytest.approx(force.power_per_speed_N, rel=1e-9)


def test_fastsim_with_large_spin():
    """A simplified theory: 10 % of the force, 17 % of the moment and 29 % of T-gamma, with far more adhesion."""
    force = calculate_creep_force("fastsim", make_ellipse_patch(LONG), SPIN)
    assert force.fy_N / LONG.limit_N == pytest.approx(1.102 * SPIN_FORCE, rel=0.01)
    assert force.mz_Nmm == pytest.approx(0.832 * SPIN_MOMENT_NMM, rel=0.01)
    assert force.power_per_speed_N == pytest.approx(0.71 * T_GAMMA_OF_FORCES_N, rel=0.01)
    assert force.adhesion_area_mm2 / LONG.area_mm2 > 2.0 * SPIN_ADHESION


def test_creepages_of_a_wheelset_have_the_published_signs():
    """Contact angle -0.0568 rad and spin 1.233e-4/mm of a published right wheel."""
    placement = SimpleNamespace(
        wheel=SimpleNamespace(rolling_radius_mm=460.0, axes=np.eye(3), centre_mm=np.array([0.0, 0.0, 460.0])),
        first=SimpleNamespace(
            x_mm=0.0,
            y_mm=0.0,
            z_mm=0.0,
            normal=np.array([0.0, -math.sin(0.0568), math.cos(0.0568)]),
            tangent=np.array([0.0, math.cos(0.0568), math.sin(0.0568)]),
        ),
    )
    creepages = calculate_wheelset_creepages(placement)
    # the wheel against the rail, as a left wheel: the opposite sign; four digits are published
    assert creepages.spin_per_mm == pytest.approx(-1.233e-4, rel=2e-3)
    assert creepages.xi == pytest.approx(0.0, abs=1e-12)
