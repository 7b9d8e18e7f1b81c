"""Hertz's elliptic contact in closed form: patch, pressure, stiffness, and the stress below its centre.

Everything is written in Carlson's symmetric integrals R_F and R_D (Carlson 1979; DLMF chapter 19) instead of Legendre's
K and E. They treat the two axes alike, so no branch is needed for the longer axis, and nothing cancels in the circle
(K - E tends to 0 there) or in a very slender ellipse.

Range of validity of the theory: frictionless, linear elastic, each body a half-space, and an undeformed gap that is
quadratic over the whole patch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.special import elliprd, elliprf

from fecontact.errors import InputError, check_positive
from fecontact.material import check_poisson

FloatArray = NDArray[np.float64]

# A numerically differentiated gap is symmetric to about this part of its size; more asymmetry is a wrong matrix.
_HESSIAN_ASYMMETRY = 1e-6

# Coefficients of Whittemore and Petrenko (1921) as in Norton's table, to four decimals, over
# Phi = arccos(abs(B - A)/(A + B)).
_TABLE_PHI_DEG = (30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0)
_TABLE_M = (2.7306, 2.1357, 1.7541, 1.4858, 1.2851, 1.1278, 1.0)
_TABLE_N = (0.4931, 0.5673, 0.6407, 0.7171, 0.7999, 0.8927, 1.0)
_TABLE_LAMBDA = (1.4526, 1.6355, 1.7735, 1.8752, 1.9453, 1.9864, 2.0)


@dataclass(frozen=True, kw_only=True)
class HertzContact:
    """Result of Hertz's theory for one contact.

    Attributes:
        a_mm, b_mm: semi-axes along the first and the second principal axis, whichever of the two is longer. The
            principal axes are x (rolling) and y (lateral) turned by `orientation_rad`.
        p0_MPa: peak pressure.
        area_mm2: patch area.
        approach_mm: approach of distant points of the two bodies, positive when they move together.
        stiffness_N_per_mm15: K_H of the spring F = K_H approach^1.5; independent of the load, right at zero load too.
        normal_force_N: load.
        A_per_mm, B_per_mm: coefficients of the gap A x'^2 + B y'^2 in the principal axes.
        contact_modulus_MPa: E* of the pair.
        orientation_rad: angle from x to the first principal axis, counter-clockwise, in (-pi/4, pi/4].
    """

    a_mm: float
    b_mm: float
    p0_MPa: float
    area_mm2: float
    approach_mm: float
    stiffness_N_per_mm15: float
    normal_force_N: float
    A_per_mm: float
    B_per_mm: float
    contact_modulus_MPa: float
    orientation_rad: float = 0.0

    @property
    def stiffness_GN_per_m15(self) -> float:
        """K_H in GN/m^1.5; 1 N/mm^1.5 is 10^4.5 N/m^1.5, that is 10^-4.5 GN/m^1.5."""
        return self.stiffness_N_per_mm15 * math.sqrt(1e-9)

    @property
    def extent_x_mm(self) -> float:
        """Full length in x of the patch's bounding box, in mm."""
        c, s = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        return 2.0 * math.hypot(self.a_mm * c, self.b_mm * s)

    @property
    def extent_y_mm(self) -> float:
        """Full length in y of the patch's bounding box, in mm."""
        c, s = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        return 2.0 * math.hypot(self.a_mm * s, self.b_mm * c)

    def pressure_MPa(self, x_mm: ArrayLike, y_mm: ArrayLike) -> FloatArray:
        """Pressure p0 sqrt(1 - (x'/a)^2 - (y'/b)^2) in MPa, zero outside the patch.

        Args:
            x_mm, y_mm: points relative to the patch centre in mm; any shapes that broadcast together.

        Returns:
            Array of the broadcast shape (0-d for two numbers).

        Source: Johnson (1985), section 3.5.
        """
        x, y = np.broadcast_arrays(np.asarray(x_mm, dtype=np.float64), np.asarray(y_mm, dtype=np.float64))
        if self.normal_force_N == 0.0:
            return np.zeros(x.shape)
        c, s = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        inside = 1.0 - ((c * x + s * y) / self.a_mm) ** 2 - ((c * y - s * x) / self.b_mm) ** 2
        return np.asarray(self.p0_MPa * np.sqrt(np.maximum(inside, 0.0)))


def hertz_ellipse(
    A_per_mm: float, B_per_mm: float, *, normal_force_N: float, contact_modulus_MPa: float
) -> HertzContact:
    """Hertz contact of the gap h = A x^2 + B y^2 with x rolling and y lateral.

    Args:
        A_per_mm, B_per_mm: half the relative curvatures in x and in y, in 1/mm, both > 0, in either order.
        normal_force_N: load in N, >= 0; zero gives a patch of zero size.
        contact_modulus_MPa: E* of the pair in MPa.

    Raises:
        InputError: a value is not finite or outside its range.

    Source: Hertz (1881); Johnson (1985), sections 3.5 and 4.2: A = F R_D(0, b^2, a^2) / (2 pi E*), B with a and b
    exchanged, approach = 3 F R_F(0, a^2, b^2) / (2 pi E*).
    """
    flat = "Hertz's theory needs a gap that opens in both directions: check the signs of the radii (concave: negative)"
    check_positive("gap coefficient A", A_per_mm, "1/mm", flat)
    check_positive("gap coefficient B", B_per_mm, "1/mm", flat)
    check_positive("normal force", normal_force_N, "N", "give the compressive force", zero_allowed=True)
    check_positive("contact modulus", contact_modulus_MPa, "MPa", "take it from contact_modulus_MPa of two materials")
    root = math.exp(0.5 * _log_axis_ratio(math.log(B_per_mm / A_per_mm)))
    # Semi-axes are size * root and size / root; the integrals are homogeneous, so the size follows from the load.
    long2, short2 = root**2, root**-2
    curvature_integral = float(elliprd(0.0, short2, long2) + elliprd(0.0, long2, short2))
    approach_integral = float(elliprf(0.0, long2, short2))
    compliance = 1.0 / (2.0 * math.pi * contact_modulus_MPa)
    size_cubed_per_N = compliance * curvature_integral / (A_per_mm + B_per_mm)
    size = math.cbrt(size_cubed_per_N * normal_force_N)
    area = math.pi * size**2
    loaded = normal_force_N > 0.0
    return HertzContact(
        a_mm=size * root,
        b_mm=size / root,
        p0_MPa=1.5 * normal_force_N / area if loaded else 0.0,
        area_mm2=area,
        approach_mm=3.0 * compliance * normal_force_N * approach_integral / size if loaded else 0.0,
        stiffness_N_per_mm15=math.sqrt(size_cubed_per_N) / (3.0 * compliance * approach_integral) ** 1.5,
        normal_force_N=float(normal_force_N),
        A_per_mm=float(A_per_mm),
        B_per_mm=float(B_per_mm),
        contact_modulus_MPa=float(contact_modulus_MPa),
    )


def _log_axis_ratio(log_curvature_ratio: float) -> float:
    """ln(a/b) from ln(B/A): the root of R_D(0, a^2, b^2) / R_D(0, b^2, a^2) = B/A, odd in its argument."""

    def excess(t: float) -> float:
        stretch = math.exp(t)
        return math.log(float(elliprd(0.0, stretch, 1.0 / stretch) / elliprd(0.0, 1.0 / stretch, stretch))) - target

    target = abs(log_curvature_ratio)
    # The slope of ln(B/A) over ln(a/b) lies between 3/2 (circle) and 2 (line contact), which brackets the root; the
    # small addition keeps the bracket open against rounding when the ellipse is nearly a circle.
    ratio = float(brentq(excess, 0.0, target + 1e-3, xtol=1e-15, rtol=1e-14)) if target > 0.0 else 0.0
    return math.copysign(ratio, log_curvature_ratio)


def hertz_from_hessian(hessian_per_mm: ArrayLike, *, normal_force_N: float, contact_modulus_MPa: float) -> HertzContact:
    """Hertz contact of the gap h = q^T H q / 2, q = (x, y), whose principal axes may be yawed against x and y.

    Args:
        hessian_per_mm: H, shape (2, 2), in 1/mm, symmetric and positive definite.
        normal_force_N: load in N, >= 0.
        contact_modulus_MPa: E* of the pair in MPa.

    Returns:
        The contact in its principal axes; `orientation_rad` is the angle of the one closest to x, in (-pi/4, pi/4].

    Raises:
        InputError: H has another shape, is not finite, not symmetric or not positive definite; or as `hertz_ellipse`.
    """
    hessian = np.asarray(hessian_per_mm, dtype=np.float64)
    if hessian.shape != (2, 2) or not np.all(np.isfinite(hessian)):
        raise InputError(f"Hessian of the gap is {hessian.tolist()} 1/mm; allowed: finite, shape (2, 2); check the gap")
    (h_xx, h_xy), (h_yx, h_yy) = hessian.tolist()
    if abs(h_xy - h_yx) > _HESSIAN_ASYMMETRY * float(np.max(np.abs(hessian))):
        raise InputError(
            f"Hessian of the gap is {hessian.tolist()} 1/mm; allowed: symmetric to {_HESSIAN_ASYMMETRY:g} of its "
            "largest entry; symmetrise it or differentiate the gap with a smaller error"
        )
    shear = 0.5 * (h_xy + h_yx)
    # Folding the double angle into the right half-plane picks the axis closest to x instead of the stiffer one.
    sign = 1.0 if h_xx >= h_yy else -1.0
    angle = 0.5 * math.atan2(2.0 * sign * shear, abs(h_xx - h_yy))
    mean, radius = 0.5 * (h_xx + h_yy), math.hypot(0.5 * (h_xx - h_yy), shear)
    if angle <= -math.pi / 4.0:
        angle, sign = math.pi / 4.0, -sign
    if mean - radius <= 0.0:
        raise InputError(
            f"Hessian of the gap is {hessian.tolist()} 1/mm with smallest eigenvalue {mean - radius!r} 1/mm; allowed: "
            "> 0; the gap must open in every direction: check the signs of the radii (concave: negative)"
        )
    aligned = hertz_ellipse(
        0.5 * (mean + sign * radius),
        0.5 * (mean - sign * radius),
        normal_force_N=normal_force_N,
        contact_modulus_MPa=contact_modulus_MPa,
    )
    return replace(aligned, orientation_rad=angle)


@dataclass(frozen=True, kw_only=True, eq=False)
class AxisStress:
    """Stress on the line below the patch centre; every array has the shape of the depths.

    Attributes:
        depth_mm: depth below the surface.
        sx_MPa, sy_MPa, sz_MPa: principal stresses along the semi-axis a, the semi-axis b and the depth; tension
            positive.
        von_mises_MPa: von Mises equivalent stress.
        tau_max_MPa: largest shear stress on any plane.
    """

    depth_mm: FloatArray
    sx_MPa: FloatArray
    sy_MPa: FloatArray
    sz_MPa: FloatArray
    von_mises_MPa: FloatArray
    tau_max_MPa: FloatArray


def subsurface_stress_on_axis(
    depth_mm: ArrayLike, *, a_mm: float, b_mm: float, p0_MPa: float, poisson: float
) -> AxisStress:
    """Stress below the centre of a Hertz patch in the body whose Poisson's ratio is given.

    Args:
        depth_mm: depths below the surface in mm, >= 0, any shape.
        a_mm, b_mm: semi-axes in mm, in either order, both > 0.
        p0_MPa: peak pressure in MPa, >= 0.
        poisson: Poisson's ratio of the body.

    Raises:
        InputError: a value is outside its range; a patch of zero size has no stress to evaluate.

    Source: Johnson (1985), eq. 3.69, with F and E replaced by R_D (DLMF 19.25), which makes it symmetric in a and b
    and continuous in the circle, where it is Johnson's eq. 3.45.
    """
    z = np.asarray(depth_mm, dtype=np.float64)
    if not np.all((z >= 0.0) & np.isfinite(z)):
        raise InputError(f"depth is {z.tolist()} mm; allowed: finite and >= 0; count depths positive into the body")
    check_positive("semi-axis a", a_mm, "mm", "a stress needs a loaded patch")
    check_positive("semi-axis b", b_mm, "mm", "a stress needs a loaded patch")
    check_positive("peak pressure", p0_MPa, "MPa", "count pressure positive in compression", zero_allowed=True)
    check_poisson(poisson)
    q_a, q_b = np.hypot(a_mm, z), np.hypot(b_mm, z)
    integral_x = z / 3.0 * elliprd(z**2, q_b**2, q_a**2)
    integral_y = z / 3.0 * elliprd(z**2, q_a**2, q_b**2)
    edge_x, edge_y = 1.0 / (q_a * (q_a + q_b)), 1.0 / (q_b * (q_a + q_b))
    scale = p0_MPa * a_mm * b_mm
    sx = scale * (2.0 * integral_x - edge_x + 2.0 * poisson * (integral_y - edge_y))
    sy = scale * (2.0 * integral_y - edge_y + 2.0 * poisson * (integral_x - edge_x))
    sz = -scale / (q_a * q_b)
    principal = np.stack([sx, sy, sz])
    return AxisStress(
        depth_mm=z,
        sx_MPa=np.asarray(sx),
        sy_MPa=np.asarray(sy),
        sz_MPa=np.asarray(sz),
        von_mises_MPa=np.asarray(np.sqrt(0.5 * ((sx - sy) ** 2 + (sy - sz) ** 2 + (sz - sx) ** 2))),
        tau_max_MPa=np.asarray(0.5 * (principal.max(axis=0) - principal.min(axis=0))),
    )


@dataclass(frozen=True, kw_only=True)
class VonMisesPeak:
    """Largest von Mises stress below the patch centre, in MPa, and its depth in mm."""

    von_mises_MPa: float
    depth_mm: float


def von_mises_peak(*, a_mm: float, b_mm: float, p0_MPa: float, poisson: float) -> VonMisesPeak:
    """Largest von Mises stress on the line below the patch centre, the surface included.

    Arguments, errors and source as `subsurface_stress_on_axis`. Range of validity: for the Poisson's ratios of metals
    the peak over the whole body lies on this line; for nu near zero a slender patch has it at the surface.
    """

    def von_mises(depth_per_b: ArrayLike) -> FloatArray:
        depth = np.asarray(depth_per_b, dtype=np.float64) * shorter
        return subsurface_stress_on_axis(depth, a_mm=a_mm, b_mm=b_mm, p0_MPa=p0_MPa, poisson=poisson).von_mises_MPa

    shorter = min(a_mm, b_mm)
    # The peak lies within 0.8 of the shorter semi-axis for every ellipse; the scan guards against a second maximum.
    scan = np.linspace(0.0, 2.0, 201)
    values = von_mises(scan)
    best = int(np.argmax(values))
    if best == 0:
        return VonMisesPeak(von_mises_MPa=float(values[0]), depth_mm=0.0)
    refined = minimize_scalar(
        lambda depth: -float(von_mises(depth)), bounds=(scan[best - 1], scan[best + 1]), options={"xatol": 1e-9}
    )
    return VonMisesPeak(von_mises_MPa=-float(refined.fun), depth_mm=float(refined.x) * shorter)


def first_yield_p0_MPa(*, a_mm: float, b_mm: float, poisson: float, yield_MPa: float) -> float:
    """Peak pressure in MPa at which the body first yields (von Mises) below the patch centre.

    Only the ratio of the semi-axes matters. Range of validity as `von_mises_peak`: frictionless, no residual stress.

    Raises:
        InputError: a value is outside its range.
    """
    check_positive("yield stress", yield_MPa, "MPa", "give the uniaxial yield stress of the body")
    return yield_MPa / von_mises_peak(a_mm=a_mm, b_mm=b_mm, p0_MPa=1.0, poisson=poisson).von_mises_MPa


def hertz_spring_force_N(stiffness_N_per_mm15: float, approach_mm: ArrayLike) -> FloatArray:
    """Normal force in N of Hertz's spring: K_H d^1.5 for an approach d > 0, zero where the bodies are apart.

    Args:
        stiffness_N_per_mm15: K_H in N/mm^1.5, > 0.
        approach_mm: approach in mm, any shape; the result has the same shape.

    Raises:
        InputError: the stiffness is not positive.

    Source: Johnson (1985), eq. 4.23 for spheres; Otero Yugat, Part I, eq. 6.
    """
    check_positive("Hertz stiffness", stiffness_N_per_mm15, "N/mm^1.5", "take it from a HertzContact")
    return np.asarray(stiffness_N_per_mm15 * np.maximum(np.asarray(approach_mm, dtype=np.float64), 0.0) ** 1.5)


def shared_approach_mm(
    stiffness_N_per_mm15: ArrayLike, *, load_N: float, gap_mm: ArrayLike, closing: ArrayLike
) -> float:
    """Rigid approach at which several Hertz springs side by side carry a load together.

    Args:
        stiffness_N_per_mm15: K_H of each contact (n,).
        load_N: force along the approach.
        gap_mm: gap of each contact along its normal (n,) when the bodies first touch, >= 0.
        closing: cosine between each contact's normal and the approach (n,), > 0.

    Each contact carries K_H (closing approach - gap)^1.5 along its normal once its gap is closed.
    """
    check_positive("load", load_N, "N", "give the wheel load")
    stiffness, gap, c = (np.asarray(v, dtype=float) for v in (stiffness_N_per_mm15, gap_mm, closing))

    def excess(approach: float) -> float:
        return float(np.sum(c * hertz_spring_force_N(1.0, c * approach - gap) * stiffness)) - load_N

    # the stiffest spring alone bounds it from above
    alone = (load_N / (c * stiffness)) ** (2.0 / 3.0)
    return float(brentq(excess, 0.0, float(np.min((alone + gap) / c)) * (1.0 + 1e-12), xtol=1e-15, rtol=1e-14))


def curvature_sums_per_mm(
    *, R1_mm: float, R1_prime_mm: float, R2_mm: float, R2_prime_mm: float, plane_angle_rad: float = 0.0
) -> tuple[float, float]:
    """Sum k1 = A + B and difference k2 = abs(B - A) of the gap coefficients in 1/mm, from the principal radii.

    Args:
        R1_mm, R1_prime_mm: principal radii of body 1 in mm; concave negative, straight infinite.
        R2_mm, R2_prime_mm: the same of body 2.
        plane_angle_rad: angle theta between the planes of 1/R1 and 1/R2.

    Raises:
        InputError: a radius is zero or not a number.

    Source: Johnson (1985), section 4.1; Otero Yugat, Part I, eqs 1 and 2.
    """
    for name, radius in (("R1", R1_mm), ("R1'", R1_prime_mm), ("R2", R2_mm), ("R2'", R2_prime_mm)):
        if radius == 0.0 or math.isnan(radius):
            raise InputError(f"radius {name} is {radius!r} mm; allowed: not zero; concave is negative, straight is inf")
    if not math.isfinite(plane_angle_rad):
        raise InputError(f"plane angle is {plane_angle_rad!r} rad; allowed: finite; use 0 for aligned bodies")
    k1 = 0.5 * (1.0 / R1_mm + 1.0 / R1_prime_mm + 1.0 / R2_mm + 1.0 / R2_prime_mm)
    first, second = 1.0 / R1_mm - 1.0 / R1_prime_mm, 1.0 / R2_mm - 1.0 / R2_prime_mm
    # The two differences add like vectors at the double angle; this form of eq. 2 has no root of a rounded negative.
    double = 2.0 * plane_angle_rad
    return k1, 0.5 * math.hypot(first + second * math.cos(double), second * math.sin(double))


@dataclass(frozen=True, kw_only=True)
class TableForm:
    """Hertz contact in the symbols of the table form; here a is the longer semi-axis, wherever it points.

    Attributes:
        k1_per_mm, k2_per_mm: A + B and abs(B - A).
        k3_per_MPa: mean of (1 - nu^2)/E over the two bodies, 1/(2 E*).
        phi_rad: table angle arccos(k2/k1).
        m, n, lambda_: coefficients of a, of b and of the stiffness (lambda_ is the paper's I), interpolated.
        a_mm, b_mm, p0_MPa, stiffness_N_per_mm15: semi-axes, peak pressure and K_H.
    """

    k1_per_mm: float
    k2_per_mm: float
    k3_per_MPa: float
    phi_rad: float
    m: float
    n: float
    lambda_: float
    a_mm: float
    b_mm: float
    p0_MPa: float
    stiffness_N_per_mm15: float


def table_form(
    *,
    R1_mm: float,
    R1_prime_mm: float,
    R2_mm: float,
    R2_prime_mm: float,
    plane_angle_rad: float = 0.0,
    normal_force_N: float,
    contact_modulus_MPa: float,
) -> TableForm:
    """Hertz contact in the table form of multibody practice, for comparison with published values.

    The equations of the source and what was found on checking each against the exact theory:
        eq. 1, k1: right, A + B; concave radii count negative (a worn-type tread is concave).
        eq. 2, k2: right, abs(B - A).
        eq. 3, k3 = (1 - nu^2)/E: right for two identical bodies; in general the mean over the two, as used here.
        eq. 4, a = m (3 pi k3 F/(2 k1))^(1/3), b likewise with n: misprint, there is no pi with this k3; as printed
            a and b are pi^(1/3) = 1.4646 times too large and p0 is pi^(2/3) = 2.145 times too small. Corrected here.
        eq. 5, K_H = 4/(3 k3) sqrt(2/(k1 lambda^3)): right with the table's lambda.
        eq. 6, F = K_H d^1.5 for d > 0, else 0: right, see `hertz_spring_force_N`.

    Args:
        R1_mm, R1_prime_mm, R2_mm, R2_prime_mm, plane_angle_rad: as in `curvature_sums_per_mm`.
        normal_force_N: load in N, >= 0.
        contact_modulus_MPa: E* of the pair in MPa.

    Raises:
        InputError: a value is outside its range, or the table angle is outside 30 to 90 degrees.

    Source: Otero Yugat, Study of rail vehicle dynamics in curved tracks, Part I (UPC), eqs 1 to 5; table of Whittemore
    and Petrenko (1921) after Norton. Range of validity: table angle 30 to 90 degrees, that is b/a from 0.18 to 1;
    linear interpolation in the 10 degree steps puts up to 1.6 % on a, 0.3 % on b, 1.5 % on p0 and 0.7 % on K_H.
    `hertz_ellipse` has neither limit.
    """
    check_positive("normal force", normal_force_N, "N", "give the compressive force", zero_allowed=True)
    check_positive("contact modulus", contact_modulus_MPa, "MPa", "take it from contact_modulus_MPa of two materials")
    k1, k2 = curvature_sums_per_mm(
        R1_mm=R1_mm,
        R1_prime_mm=R1_prime_mm,
        R2_mm=R2_mm,
        R2_prime_mm=R2_prime_mm,
        plane_angle_rad=plane_angle_rad,
    )
    if k2 >= k1:
        raise InputError(
            f"curvature sums are k1 = {k1!r}, k2 = {k2!r} 1/mm; allowed: k1 > k2; the bodies do not touch in a point: "
            "check the signs of the radii (concave: negative)"
        )
    phi = math.acos(k2 / k1)
    phi_deg = math.degrees(phi)
    # Rounding of arccos must not push an entry at the table's end out of it.
    if phi_deg < _TABLE_PHI_DEG[0] - 1e-9:
        raise InputError(f"table angle is {phi_deg:.3f} degrees; allowed: 30 to 90 degrees; use hertz_ellipse instead")
    m, n, lambda_ = (float(np.interp(phi_deg, _TABLE_PHI_DEG, row)) for row in (_TABLE_M, _TABLE_N, _TABLE_LAMBDA))
    k3 = 1.0 / (2.0 * contact_modulus_MPa)
    radius = math.cbrt(3.0 * normal_force_N * k3 / (2.0 * k1))
    a, b = m * radius, n * radius
    return TableForm(
        k1_per_mm=k1,
        k2_per_mm=k2,
        k3_per_MPa=k3,
        phi_rad=phi,
        m=m,
        n=n,
        lambda_=lambda_,
        a_mm=a,
        b_mm=b,
        p0_MPa=1.5 * normal_force_N / (math.pi * a * b) if normal_force_N > 0.0 else 0.0,
        stiffness_N_per_mm15=4.0 / (3.0 * k3) * math.sqrt(2.0 / (k1 * lambda_**3)),
    )
