"""Hertz's elliptic contact in closed form.

The results are the patch, pressure, stiffness, and spring. All formulas use Carlson's symmetric integrals R_F and R_D
(Carlson 1979; DLMF chapter 19) instead of Legendre's K and E. These integrals treat both axes equally, so that no
branch is needed for the longer axis. There is no cancellation in the circle (K - E tends to 0 there) or in a very
slender ellipse.

Range of validity of the theory: frictionless, linear elastic, each body a half-space, and an undeformed gap that is
quadratic over the whole patch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import elliprd, elliprf

from fecontact.arrays import Floats
from fecontact.errors import InputError, check_positive

# Largest asymmetry of a Hessian, as a fraction of its largest entry. The Hessian of a numerically differentiated gap is
# symmetric to about this fraction. A larger asymmetry indicates a wrong matrix.
_MAX_HESSIAN_ASYMMETRY = 1e-6


@dataclass(frozen=True, kw_only=True)
class HertzContact:
    """Elliptic contact by Hertz's theory.

    Attributes
    ----------
    a_mm, b_mm
        Semi-axes along the first and the second principal axis; either may be longer. The principal axes are x
        (rolling) and y (lateral) turned by `orientation_rad`.
    p0_MPa
        Peak pressure.
    area_mm2
        Patch area.
    approach_mm
        Approach of distant points of the two bodies, positive when they move together.
    stiffness_N_per_mm15
        K_H of the spring F = K_H approach^1.5. It does not depend on the load, and is valid also at zero load.
    normal_force_N
        Load.
    A_per_mm, B_per_mm
        Coefficients of the gap A x'^2 + B y'^2 in the principal axes.
    contact_modulus_MPa
        E* of the pair.
    orientation_rad
        Angle from x to the first principal axis, counter-clockwise, in (-pi/4, pi/4].

    Examples
    --------
    The pressure has its peak at the centre, and is zero at the ends of the semi-axes:

    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> contact = hertz_ellipse(0.005, 0.005, normal_force_N=1e3, contact_modulus_MPa=115e3)
    >>> contact.pressure_MPa([0.0, contact.a_mm], 0.0).round()
    array([635.,   0.])
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
        """Stiffness K_H in GN/m^1.5.

        1 N/mm^1.5 is 10^4.5 N/m^1.5, or 10^-4.5 GN/m^1.5.
        """
        return self.stiffness_N_per_mm15 * math.sqrt(1e-9)

    @property
    def extent_x_mm(self) -> float:
        """Full length of the bounding box of the patch along x, in mm."""
        cosine, sine = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        return 2.0 * math.hypot(self.a_mm * cosine, self.b_mm * sine)

    @property
    def extent_y_mm(self) -> float:
        """Full length of the bounding box of the patch along y, in mm."""
        cosine, sine = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        return 2.0 * math.hypot(self.a_mm * sine, self.b_mm * cosine)

    @property
    def rolling_semi_axes_mm(self) -> tuple[float, float]:
        """Semi-axes in mm along x and across of an ellipse of equal area.

        Their ratio is the ratio of the extents, so they are `a_mm` and `b_mm` if the axes are not turned.
        """
        a, b = 0.5 * self.extent_x_mm, 0.5 * self.extent_y_mm
        scale = math.sqrt(self.a_mm * self.b_mm / (a * b))
        return scale * a, scale * b

    def pressure_MPa(self, x_mm: ArrayLike, y_mm: ArrayLike) -> Floats:
        """Pressure at given points, in MPa.

        It is p0 sqrt(1 - (x'/a)^2 - (y'/b)^2) in the patch, and zero outside.

        Parameters
        ----------
        x_mm, y_mm
            Points relative to the patch centre in mm; any shapes that broadcast together.

        Returns
        -------
        array
            Pressures, of the broadcast shape (0-d for two numbers).

        Notes
        -----
        Source: Johnson (1985), section 3.5.
        """
        x, y = np.asarray(x_mm, dtype=np.float64), np.asarray(y_mm, dtype=np.float64)
        if self.normal_force_N == 0.0:
            return np.zeros(np.broadcast_shapes(x.shape, y.shape))
        cosine, sine = math.cos(self.orientation_rad), math.sin(self.orientation_rad)
        inverse_a_square, inverse_b_square = self.a_mm**-2, self.b_mm**-2
        # Squares are calculated before broadcasting. For a line of x and a line of y this costs two operations per
        # point.
        pressure = np.asarray(
            (1.0 - (inverse_a_square * cosine**2 + inverse_b_square * sine**2) * x**2)
            - (inverse_a_square * sine**2 + inverse_b_square * cosine**2) * y**2
        )
        if sine != 0.0:
            pressure -= 2.0 * (inverse_a_square - inverse_b_square) * cosine * sine * (x * y)
        np.sqrt(np.maximum(pressure, 0.0, out=pressure), out=pressure)
        pressure *= self.p0_MPa
        return pressure


def hertz_ellipse(
    A_per_mm: float, B_per_mm: float, *, normal_force_N: float, contact_modulus_MPa: float
) -> HertzContact:
    """Hertz contact of the gap h = A x^2 + B y^2.

    The axis x is the rolling direction, and y is the lateral direction.

    Parameters
    ----------
    A_per_mm, B_per_mm
        Half the relative curvatures along x and along y, in 1/mm, both > 0, in either order.
    normal_force_N
        Load in N, >= 0. Zero results in a patch of zero size.
    contact_modulus_MPa
        E* of the pair in MPa.

    Returns
    -------
    HertzContact
        The contact, with `orientation_rad` 0.

    Raises
    ------
    InputError
        A value is not finite or outside its range.

    Notes
    -----
    Source: Hertz (1881); Johnson (1985), sections 3.5 and 4.2: A = F R_D(0, b^2, a^2) / (2 pi E*), B with a and b
    exchanged, approach = 3 F R_F(0, a^2, b^2) / (2 pi E*). The table form of Otero Yugat, Part I, eq. 4, a = m (3 pi k3
    F / (2 k1))^(1/3), has a misprint: with its k3 there is no pi, which makes a and b 1.4646 times too large.

    Range of validity: bodies that are half-spaces on the scale of the patch, and a gap that is quadratic over the whole
    patch.

    Examples
    --------
    A sphere of radius 100 mm on a plane, a^3 = 3 F R / (4 E*) (Johnson 1985, eq. 4.22):

    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> contact = hertz_ellipse(0.005, 0.005, normal_force_N=1e3, contact_modulus_MPa=115e3)
    >>> round(contact.a_mm, 6) == round((0.75 * 1e3 * 100.0 / 115e3) ** (1 / 3), 6)
    True
    """
    curvature_remedy = (
        "Hertz's theory needs a gap that opens in both directions: check the signs of the radii (concave: negative)"
    )
    check_positive("gap coefficient A", A_per_mm, "1/mm", curvature_remedy)
    check_positive("gap coefficient B", B_per_mm, "1/mm", curvature_remedy)
    check_positive("normal force", normal_force_N, "N", "give the compressive force", zero_allowed=True)
    check_positive(
        "contact modulus", contact_modulus_MPa, "MPa", "compute it with combine_moduli_MPa from two materials"
    )
    root_axis_ratio = math.exp(0.5 * _solve_log_axis_ratio(math.log(B_per_mm / A_per_mm)))
    # Semi-axes are size * root_axis_ratio and size / root_axis_ratio. The integrals are homogeneous, so the size
    # follows from the load.
    square_a, square_b = root_axis_ratio**2, root_axis_ratio**-2
    curvature_integral = float(elliprd(0.0, square_b, square_a) + elliprd(0.0, square_a, square_b))
    approach_integral = float(elliprf(0.0, square_a, square_b))
    compliance = 1.0 / (2.0 * math.pi * contact_modulus_MPa)
    size_cubed_per_N = compliance * curvature_integral / (A_per_mm + B_per_mm)
    size = math.cbrt(size_cubed_per_N * normal_force_N)
    area = math.pi * size**2
    is_loaded = normal_force_N > 0.0
    return HertzContact(
        a_mm=size * root_axis_ratio,
        b_mm=size / root_axis_ratio,
        p0_MPa=1.5 * normal_force_N / area if is_loaded else 0.0,
        area_mm2=area,
        approach_mm=3.0 * compliance * normal_force_N * approach_integral / size if is_loaded else 0.0,
        stiffness_N_per_mm15=math.sqrt(size_cubed_per_N) / (3.0 * compliance * approach_integral) ** 1.5,
        normal_force_N=float(normal_force_N),
        A_per_mm=float(A_per_mm),
        B_per_mm=float(B_per_mm),
        contact_modulus_MPa=float(contact_modulus_MPa),
    )


def _solve_log_axis_ratio(log_curvature_ratio: float) -> float:
    """Solve ln(a/b) from ln(B/A).

    It is the root of R_D(0, a^2, b^2) / R_D(0, b^2, a^2) = B/A, and odd in its argument.
    """

    def excess(log_axis_ratio: float) -> float:
        stretch = math.exp(log_axis_ratio)
        return math.log(float(elliprd(0.0, stretch, 1.0 / stretch) / elliprd(0.0, 1.0 / stretch, stretch))) - target

    target = abs(log_curvature_ratio)
    # The slope of ln(B/A) over ln(a/b) lies between 3/2 (circle) and 2 (line contact), which brackets the root. The
    # small addition keeps the bracket open if rounding occurs when the ellipse is nearly a circle.
    root = float(brentq(excess, 0.0, target + 1e-3, xtol=1e-15, rtol=1e-14)) if target > 0.0 else 0.0
    return math.copysign(root, log_curvature_ratio)


def hertz_from_hessian(hessian_per_mm: ArrayLike, *, normal_force_N: float, contact_modulus_MPa: float) -> HertzContact:
    """Hertz contact of a quadratic gap with a given Hessian.

    The gap is h = q^T H q / 2 with q = (x, y). The principal axes may be turned relative to x and y.

    Parameters
    ----------
    hessian_per_mm
        H, shape (2, 2), in 1/mm, symmetric and positive definite.
    normal_force_N
        Load in N, >= 0.
    contact_modulus_MPa
        E* of the pair in MPa.

    Returns
    -------
    HertzContact
        The contact in its principal axes; `orientation_rad` is the angle of the axis closest to x, in (-pi/4, pi/4].

    Raises
    ------
    InputError
        H has a wrong shape, is not finite, not symmetric or not positive definite; or as in `hertz_ellipse`.

    Examples
    --------
    >>> from fecontact.contact_theories.hertz import hertz_from_hessian
    >>> contact = hertz_from_hessian([[0.02, 0.0], [0.0, 0.01]], normal_force_N=1e3, contact_modulus_MPa=115e3)
    >>> contact.a_mm < contact.b_mm, contact.orientation_rad
    (True, 0.0)
    """
    hessian = np.asarray(hessian_per_mm, dtype=np.float64)
    if hessian.shape != (2, 2) or not np.all(np.isfinite(hessian)):
        raise InputError(f"Hessian of the gap is {hessian.tolist()} 1/mm; allowed: finite, shape (2, 2); check the gap")
    (h_xx, h_xy), (h_yx, h_yy) = hessian.tolist()
    if abs(h_xy - h_yx) > _MAX_HESSIAN_ASYMMETRY * float(np.max(np.abs(hessian))):
        raise InputError(
            f"Hessian of the gap is {hessian.tolist()} 1/mm; allowed: symmetric to {_MAX_HESSIAN_ASYMMETRY:g} of its "
            "largest entry; symmetrise it, or differentiate the gap more accurately"
        )
    shear = 0.5 * (h_xy + h_yx)
    # Folding the double angle into the right half-plane selects the axis closest to x instead of the stiffer axis.
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
    aligned_contact = hertz_ellipse(
        0.5 * (mean + sign * radius),
        0.5 * (mean - sign * radius),
        normal_force_N=normal_force_N,
        contact_modulus_MPa=contact_modulus_MPa,
    )
    return replace(aligned_contact, orientation_rad=angle)


# --- Shape of Hertz's ellipse as a function of the ratio of curvatures, for many strips in a single call.

# Axis ratios from e^-8 to e^8 are tabulated by their logarithm. The error of linear interpolation is 1e-7.
_MAX_LOG_AXIS_RATIO = 8.0
_TABLE_SIZE = 8001


@dataclass(frozen=True, kw_only=True, eq=False)
class EllipseShape:
    """Shape of Hertz's ellipse on the gap A x^2 + B t^2.

    The fields are arrays of equal shape. The semi-axes are a along x and b across, and the approach is d: a^2 = part_x
    d / A, b^2 = part_t d / B, peak pressure E* d / (a integral). part_x + part_t = 1.

    Attributes
    ----------
    axis_ratio
        a / b.
    integral
        R_F(0, (a/b)^2, 1).
    part_x, part_t
        Gap at the end of each axis, as a fraction of the approach.
    """

    axis_ratio: Floats
    integral: Floats
    part_x: Floats
    part_t: Floats


def calculate_ellipse_shape(A_per_mm: float, B_per_mm: ArrayLike) -> EllipseShape:
    """Shape of Hertz's ellipse from half the curvatures.

    Parameters
    ----------
    A_per_mm
        Half the relative curvature along x, > 0.
    B_per_mm
        Half the relative curvatures across, > 0, of any shape. The ratio B / A is limited to e^-16 to e^16.

    Returns
    -------
    EllipseShape
        Arrays of the shape of B.

    Raises
    ------
    InputError
        If a coefficient is not positive.

    Notes
    -----
    Source: Hertz (1881); Johnson (1985), section 4.2, in Carlson's integrals (DLMF 19).

    Examples
    --------
    >>> from fecontact.contact_theories.hertz import calculate_ellipse_shape
    >>> shape = calculate_ellipse_shape(0.005, [0.005, 0.02])
    >>> shape.part_x.round(3)
    array([0.5 , 0.61])
    """
    check_positive("gap coefficient A", A_per_mm, "1/mm", "give cos(contact angle) / (2 rolling radius)")
    curvatures = np.asarray(B_per_mm, dtype=np.float64)
    check_positive(
        "smallest gap coefficient B",
        float(curvatures.min()),
        "1/mm",
        "Hertz's theory needs a gap that opens across; check the curvatures",
    )
    log_curvatures, log_axes = _axis_ratio_table()
    axis_ratio = np.exp(np.interp(np.log(A_per_mm / curvatures), log_curvatures, log_axes))
    integral = elliprf(0.0, axis_ratio**2, 1.0)
    part_t = elliprd(0.0, axis_ratio**2, 1.0) / (3.0 * integral)
    return EllipseShape(
        axis_ratio=np.asarray(axis_ratio),
        integral=np.asarray(integral),
        part_x=np.asarray(1.0 - part_t),
        part_t=np.asarray(part_t),
    )


@cache
def _axis_ratio_table() -> tuple[Floats, Floats]:
    """Tabulated logarithms of A / B, increasing, and of a / b."""
    log_axes = np.linspace(_MAX_LOG_AXIS_RATIO, -_MAX_LOG_AXIS_RATIO, _TABLE_SIZE)
    squared_ratios = np.exp(2.0 * log_axes)
    return np.log(elliprd(0.0, 1.0, squared_ratios) / elliprd(0.0, squared_ratios, 1.0)), log_axes


# --- Hertz's contact as a spring, and several springs in parallel (`multi_hertz`).


def hertz_spring_force_N(stiffness_N_per_mm15: float, approach_mm: ArrayLike) -> Floats:
    """Normal force of Hertz's spring, in N.

    The force is K_H d^1.5 for an approach d > 0, and zero where the bodies are apart.

    Parameters
    ----------
    stiffness_N_per_mm15
        K_H in N/mm^1.5, > 0.
    approach_mm
        Approach in mm, any shape.

    Returns
    -------
    array
        Force in N, in the shape of the approach.

    Raises
    ------
    InputError
        The stiffness is not positive.

    Notes
    -----
    Source: Johnson (1985), eq. 4.23 for spheres; Otero Yugat, Part I, eq. 6.

    Examples
    --------
    >>> from fecontact.contact_theories.hertz import hertz_spring_force_N
    >>> hertz_spring_force_N(2.0, [-1.0, 1.0, 4.0])
    array([ 0.,  2., 16.])
    """
    check_positive("Hertz stiffness", stiffness_N_per_mm15, "N/mm^1.5", "use stiffness_N_per_mm15 of a HertzContact")
    return np.asarray(stiffness_N_per_mm15 * np.maximum(np.asarray(approach_mm, dtype=np.float64), 0.0) ** 1.5)


def multi_hertz_approach_mm(
    stiffness_N_per_mm15: ArrayLike, *, load_N: float, gap_mm: ArrayLike, closing: ArrayLike
) -> float:
    """Rigid approach at which Hertz's springs at several contact points share a load.

    Parameters
    ----------
    stiffness_N_per_mm15
        K_H of each contact (n,).
    load_N
        Force along the approach.
    gap_mm
        Gap of each contact along its normal (n,) when the bodies first touch, >= 0.
    closing
        Cosine between the normal of each contact and the approach (n,), > 0.

    Returns
    -------
    float
        Approach in mm.

    Raises
    ------
    InputError
        The load is not positive.

    Notes
    -----
    After its gap is closed, each contact has the force K_H (closing approach - gap)^1.5 along its normal.

    Examples
    --------
    Two equal springs without a gap share the load equally:

    >>> from fecontact.contact_theories.hertz import multi_hertz_approach_mm
    >>> round(multi_hertz_approach_mm([1.0, 1.0], load_N=16.0, gap_mm=[0.0, 0.0], closing=[1.0, 1.0]), 9)
    4.0
    """
    check_positive("load", load_N, "N", "give the wheel load")
    stiffness, gap, cosine = (np.asarray(values, dtype=float) for values in (stiffness_N_per_mm15, gap_mm, closing))

    def excess(approach: float) -> float:
        return float(np.sum(cosine * hertz_spring_force_N(1.0, cosine * approach - gap) * stiffness)) - load_N

    # The approach of any single spring is an upper bound of the approach.
    single_approaches = (load_N / (cosine * stiffness)) ** (2.0 / 3.0)
    return float(
        brentq(excess, 0.0, float(np.min((single_approaches + gap) / cosine)) * (1.0 + 1e-12), xtol=1e-15, rtol=1e-14)
    )
