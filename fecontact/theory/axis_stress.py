"""Stress below the centre of Hertz's patch in closed form, and where a body first yields."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize_scalar
from scipy.special import elliprd

from fecontact.errors import InputError, check_positive
from fecontact.material import check_poisson

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class AxisStress:
    """Stress on the line below the patch centre; every array has the shape of the depths.

    Attributes
    ----------
    depth_mm
        Depth below the surface.
    sx_MPa, sy_MPa, sz_MPa
        Principal stresses along the semi-axis a, the semi-axis b and the depth; tension positive.
    von_mises_MPa
        Von Mises equivalent stress.
    tau_max_MPa
        Largest shear stress on any plane.
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

    Parameters
    ----------
    depth_mm
        Depths below the surface in mm, >= 0, any shape.
    a_mm, b_mm
        Semi-axes in mm, in either order, both > 0.
    p0_MPa
        Peak pressure in MPa, >= 0.
    poisson
        Poisson's ratio of the body.

    Raises
    ------
    InputError
        A value is outside its range; a patch of zero size has no stress to evaluate.

    Notes
    -----
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

    Raises
    ------
    InputError
        A value is outside its range.
    """
    check_positive("yield stress", yield_MPa, "MPa", "give the uniaxial yield stress of the body")
    return yield_MPa / von_mises_peak(a_mm=a_mm, b_mm=b_mm, p0_MPa=1.0, poisson=poisson).von_mises_MPa
