"""Creep forces by every theory on any contact, and creepages of wheelsets.

On any patch, theories of an ellipse use the ellipse with the second moments of the patch
(`contact_theories.rolling.fastsim`) and the creepages at its centre. FASTSIM marches over the patch in strips; the
rolling half-space uses the unchanged pressure. A wheelset runs along the track.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.rolling.creepage import (
    CreepageField,
    Creepages,
    CreepForce,
    CurvedCreepages,
    RollingEllipse,
)
from fecontact.contact_theories.rolling.fastsim import (
    PRESSURE_STRIPS,
    RollingStrips,
    average_creepages,
    divide_ellipse,
    fastsim_strips,
)
from fecontact.contact_theories.rolling.kalker import kalker_linear
from fecontact.contact_theories.rolling.polach import polach
from fecontact.contact_theories.rolling.saturation import shen_hedrick_elkins, vermeulen_johnson
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.creep.steady import PressureCells, discretise_ellipse, solve_steady_rolling
from fecontact.placement.wheel_on_rail import Placement

_LAWS: dict[str, Callable[[RollingEllipse, Creepages], CreepForce]] = {
    "kalker": kalker_linear,
    "vermeulen_johnson": vermeulen_johnson,
    "she": shen_hedrick_elkins,
    "polach": polach,
}
CREEP_THEORIES = (*_LAWS, "fastsim", "rolling_half_space")
"""Names of the theories, from the simplest to the exact theory."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CreepPatch:
    """A contact in the forms that creep theories need.

    Attributes
    ----------
    ellipse, centre_mm
        Ellipse of the contact, and position of its centre from the first contact point, along x and across.
    pieces
        Separate patches in strips.
    cells
        Pressure on cells.
    """

    ellipse: RollingEllipse
    centre_mm: tuple[float, float]
    pieces: tuple[RollingStrips, ...]
    cells: PressureCells


def make_ellipse_patch(contact: RollingEllipse) -> CreepPatch:
    """Hertz's pressure on an ellipse at the first contact point.

    Parameters
    ----------
    contact
        Semi-axes, normal force, friction coefficient and elastic constants.

    Returns
    -------
    CreepPatch
        The ellipse, its strips and its pressure on cells.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import RollingEllipse
    >>> from fecontact.features.creep.forces import make_ellipse_patch
    >>> contact = RollingEllipse(a_mm=8.0, b_mm=4.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.3)
    >>> patch = make_ellipse_patch(contact)
    >>> patch.centre_mm, round(patch.cells.normal_force_N)
    ((0.0, 0.0), 80000)
    """
    return CreepPatch(
        ellipse=contact,
        centre_mm=(0.0, 0.0),
        pieces=(divide_ellipse(contact, PRESSURE_STRIPS),),
        cells=discretise_ellipse(contact.a_mm, contact.b_mm, contact.normal_force_N),
    )


def make_hertz_patch(hertz: HertzContact, pair: RollingPair) -> CreepPatch:
    """Hertz's contact as a patch that rolls.

    If the axes of the ellipse are turned, the patch has half-widths from its second moments along x and across.

    Parameters
    ----------
    hertz
        Hertz's contact.
    pair
        Friction coefficient and elastic constants.

    Returns
    -------
    CreepPatch
        An ellipse along x and across, with the area and the normal force of Hertz's contact.
    """
    a, b = hertz.rolling_semi_axes_mm
    return make_ellipse_patch(RollingEllipse.of(pair, a_mm=a, b_mm=b, normal_force_N=hertz.normal_force_N))


def calculate_creep_force(theory: str, patch: CreepPatch, creepages: CreepageField) -> CreepForce:
    """Force of a theory at creepages of the first contact point, or over curved surfaces.

    The moment is about the first contact point. The laws of an ellipse use the creepages at its centre, or over curved
    surfaces the mean weighted by the load.

    Parameters
    ----------
    theory
        Name, from `CREEP_THEORIES`.
    patch
        Contact that rolls.
    creepages
        Creepages at the first contact point, or over curved surfaces.

    Returns
    -------
    CreepForce
        Forces in N, moment in N mm and areas in mm2; None for each quantity that a law does not give.

    Raises
    ------
    InputError
        If the theory is not in `CREEP_THEORIES`, or does not cover the ellipse or the creepages.
    ConvergenceError
        If the rolling half-space did not converge.

    Examples
    --------
    A longitudinal creepage causes a braking force of at most mu N.

    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.features.creep.forces import calculate_creep_force, make_ellipse_patch
    >>> contact = RollingEllipse(a_mm=8.0, b_mm=4.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.3)
    >>> force = calculate_creep_force("polach", make_ellipse_patch(contact), Creepages(xi=1e-3))
    >>> -contact.limit_N < force.fx_N < 0.0
    True
    """
    if theory == "fastsim":
        return fastsim_strips(patch.pieces, creepages)
    if theory == "rolling_half_space":
        return _solve_rolling_half_space(patch, creepages)
    if theory not in _LAWS:
        raise InputError(f"theory is {theory!r}; allowed: {', '.join(CREEP_THEORIES)}")
    return _LAWS[theory](patch.ellipse, average_creepages(patch.pieces, creepages)).at(*patch.centre_mm)


def _solve_rolling_half_space(patch: CreepPatch, creepages: CreepageField) -> CreepForce:
    """Force by the exact theory; raises ConvergenceError if it did not converge."""
    solution = solve_steady_rolling(patch.cells, creepages, patch.ellipse)
    if solution.status != "converged":
        plane = creepages.at(0.0, 0.0)
        raise ConvergenceError(
            f"the rolling half-space did not converge at xi {plane.xi:g}, eta {plane.eta:g}, spin"
            f" {plane.spin_per_mm:g} 1/mm (residual {solution.friction.residual:.1e}); use fastsim there"
        )
    return solution.force


def calculate_creep_forces(patch: CreepPatch, creepages: CreepageField) -> Mapping[str, CreepForce | str]:
    """Forces of all theories on a patch.

    Parameters
    ----------
    patch
        Contact that rolls.
    creepages
        Creepages at the first contact point, or over curved surfaces.

    Returns
    -------
    dict
        By theory the force, or the reason why the theory does not cover the contact or did not converge.
    """
    forces: dict[str, CreepForce | str] = {}
    for theory in CREEP_THEORIES:
        try:
            forces[theory] = calculate_creep_force(theory, patch, creepages)
        except (InputError, ConvergenceError) as error:
            forces[theory] = str(error)
    return forces


def calculate_force_difference(first: CreepForce, second: CreepForce, limit_N: float) -> float:
    """Length of the difference of two tangential force vectors, over mu N.

    Parameters
    ----------
    first, second
        Creep forces in N.
    limit_N
        Friction limit mu N, in N.

    Returns
    -------
    float
        Length of the difference divided by the limit (-).

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import CreepForce
    >>> from fecontact.features.creep.forces import calculate_force_difference
    >>> calculate_force_difference(CreepForce(fx_N=-3e3, fy_N=4e3), CreepForce(fx_N=0.0, fy_N=0.0), 20e3)
    0.25
    """
    return float(np.hypot(first.fx_N - second.fx_N, first.fy_N - second.fy_N)) / limit_N


def calculate_y_over_q(placement: Placement, normal_force_N: float, fy_N: float) -> float | None:
    """Ratio of the lateral to the vertical force of the wheel on the rail.

    Parameters
    ----------
    placement
        Wheel on rail.
    normal_force_N
        Normal force in N, along the normal at the first contact point.
    fy_N
        Lateral creep force on the wheel in N, along the tangent there.

    Returns
    -------
    float or None
        Y/Q without unit, positive if the wheel pushes the rail outwards; None without a downward force on the rail.

    Notes
    -----
    With the contact angle delta, Y = N sin(delta) - Fy cos(delta) and Q = N cos(delta) + Fy sin(delta). Must not be
    used for separate patches, whose normals differ.

    Examples
    --------
    Without a creep force Y/Q is the tangent of the contact angle.

    >>> import math
    >>> from fecontact.case import Case
    >>> from fecontact.features.creep.forces import calculate_y_over_q
    >>> from fecontact.solving.placing import place_case
    >>> placement = place_case(Case())
    >>> ratio = calculate_y_over_q(placement, 100e3, 0.0)
    >>> abs(ratio - math.tan(placement.first.contact_angle_rad)) < 1e-12
    True
    """
    touch = placement.first
    on_wheel_N = normal_force_N * touch.normal + fy_N * touch.tangent
    vertical_N = float(on_wheel_N[2])
    return -float(on_wheel_N[1]) / vertical_N if vertical_N > 0.0 else None


_ROUNDING = 1e-12


def calculate_wheelset_creepages(placement: Placement, speed_ratio: float = 1.0) -> Creepages:
    """Creepages at the first contact point of a wheelset that runs along the track.

    The wheelset turns about its axle.

    Parameters
    ----------
    placement
        Wheel on rail.
    speed_ratio
        Speed of rotation over the speed at which the tape circle rolls without slip.

    Returns
    -------
    Creepages
        Longitudinal and lateral creepage without unit, spin in 1/mm. Values below 1e-12 are set to zero.

    Notes
    -----
    The velocity of the rigid wheel at the contact point, over the running speed, has three terms: 1 along x, the
    rotation, and the velocity along z that keeps the wheel on the rail. For a wheelset without yaw and roll xi = 1 -
    speed_ratio r / r0 and spin = -speed_ratio sin(contact angle) / r0, with the rolling radius r, and r0 at the tape
    circle.

    Examples
    --------
    >>> from fecontact.case import Case
    >>> from fecontact.features.creep.forces import calculate_wheelset_creepages
    >>> from fecontact.solving.placing import place_case
    >>> placement = place_case(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, load_N=100e3))
    >>> round(calculate_wheelset_creepages(placement, speed_ratio=1.002).xi, 9)
    -0.002
    """
    wheel, touch = placement.wheel, placement.first
    angular_velocity = _calculate_angular_velocity(placement, speed_ratio)
    arm = np.array([touch.x_mm, touch.y_mm, touch.z_mm]) - wheel.centre_mm
    velocity = np.array([1.0, 0.0, 0.0]) + np.cross(angular_velocity, arm)
    velocity[2] -= float(velocity @ touch.normal) / touch.normal[2]
    xi, eta, spin = float(velocity[0]), float(velocity @ touch.tangent), float(angular_velocity @ touch.normal)
    # rounding errors are set to zero, since some theories refuse any spin
    xi, eta = (0.0 if abs(creepage) < _ROUNDING else creepage for creepage in (xi, eta))
    return Creepages(xi=xi, eta=eta, spin_per_mm=0.0 if abs(spin) * wheel.rolling_radius_mm < _ROUNDING else spin)


def calculate_curved_creepages(
    placement: Placement, plane: Creepages, s_mm: Floats, speed_ratio: float = 1.0
) -> CurvedCreepages:
    """Creepages over the curved surfaces of a wheelset that runs along the track.

    The contact angle, and with it the rolling radius, changes across the patch.

    Parameters
    ----------
    placement
        Wheel on rail.
    plane
        Creepages at the first contact point.
    s_mm : ndarray of shape (n,)
        Places across, uniform, on the rail's surface from the first contact point.
    speed_ratio
        Speed of rotation over the speed at which the tape circle rolls without slip.

    Returns
    -------
    CurvedCreepages
        Differences of longitudinal creepage and spin (1/mm) from the tangent plane, each (n,).

    Notes
    -----
    Under pressure, bodies of one material meet midway between their undeformed surfaces. The velocity of the rigid
    wheel is evaluated on this surface, at x = 0. Range of validity: theories of the half-space leave out the change of
    the rolling radius by the approach, so that the longitudinal creepage has an error of half the undeformed gap over
    the radius, some 1e-4 at the edges of a patch. If surfaces are not conforming, creepages change by no more than
    this.
    """
    points, normals = placement.surface(0.0, s_mm)
    midway = points + 0.5 * placement.gap(0.0, s_mm)[:, None] * normals
    touch, angular_velocity = placement.first, _calculate_angular_velocity(placement, speed_ratio)
    arms = midway - np.array([touch.x_mm, touch.y_mm, touch.z_mm])
    xi = calculate_slip_off_plane(arms, s_mm, angular_velocity, touch.normal)
    return CurvedCreepages(
        plane=plane, y_mm=s_mm, xi_beside=xi, spin_beside_per_mm=-np.gradient(xi, s_mm, edge_order=2)
    )


def calculate_slip_off_plane(arms_mm: Floats, s_mm: Floats, turning_per_mm: Floats, normal: Floats) -> Floats:
    """Longitudinal creepage (n,) on a curve across minus the creepage of the tangent plane.

    The difference is zero on a straight line, as of a cone.

    Parameters
    ----------
    arms_mm, s_mm : ndarrays of shapes (n, 3), (n,)
        Points of the curve from the contact point, and their arc length.
    turning_per_mm : ndarray of shape (3,)
        Angular velocity of the wheel over the running speed.
    normal : ndarray of shape (3,)
        Normal at the contact point.

    Returns
    -------
    array (n,)
        Difference of the longitudinal creepage, without unit.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.creep.forces import calculate_slip_off_plane
    >>> s_mm, angular_velocity = np.array([-5.0, 0.0, 5.0]), np.array([0.0, 1.0 / 460.0, 0.0])
    >>> straight = np.stack([0.0 * s_mm, s_mm, 0.0 * s_mm], axis=1)
    >>> calculate_slip_off_plane(straight, s_mm, angular_velocity, np.array([0.0, 0.0, 1.0])).tolist()
    [0.0, 0.0, 0.0]
    """
    return np.asarray(np.cross(turning_per_mm, arms_mm)[:, 0] + float(turning_per_mm @ normal) * s_mm)


def _calculate_angular_velocity(placement: Placement, speed_ratio: float) -> Floats:
    """Angular velocity (3,) of the wheel over the running speed, 1/mm."""
    return np.asarray(speed_ratio / placement.wheel.rolling_radius_mm * placement.wheel.axes[:, 1])
