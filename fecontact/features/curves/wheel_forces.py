"""Force and moment of a rail on its wheel.

The wheelset may have any position on a curved track.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.creepage import Creepages, CurvedCreepages
from fecontact.contact_theories.rolling.fastsim import RollingStrips, calculate_strip_forces
from fecontact.features.curves.normal import (
    NormalTheory,
    Overlap,
    PatchStrips,
    Surfaces,
    errors_as_out_of_reach,
    solve_normal_contact,
)

_FASTSIM_CELLS = 30
# Largest ratio of the semi-axes: Kalker's table ends there; flange contact has 17 to 23.
_MAX_AXIS_RATIO = 10.0


@dataclass(frozen=True, kw_only=True)
class ContactSettings:
    """Theories and constants of a contact.

    Attributes
    ----------
    normal
        Theory of the normal force.
    contact_modulus_MPa
        Contact modulus E*.
    pair
        Friction and elastic constants of wheel and rail.
    """

    normal: NormalTheory
    contact_modulus_MPa: float
    pair: RollingPair


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Motion of a wheelset's centre in the moving track frame of the left side.

    All rates are divided by the running speed.

    Attributes
    ----------
    place : ndarray of shape (4,)
        Lateral shift and height (mm), roll and yaw (rad).
    slip
        Speed of rotation divided by the speed of rotation that rolls on the tape circle, minus 1.
    curvature_per_mm
        Curvature of the track, positive to the left.
    rates : ndarray of shape (4,)
        Rates of `place` per mm of way; zero in steady motion.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.features.curves.wheel_forces import Motion
    >>> Motion(place=np.array([3.0, 460.0, 0.0, 0.0]), slip=0.0, curvature_per_mm=0.0).axle.tolist() == [0.0, 1.0, 0.0]
    True
    """

    place: Floats
    slip: float
    curvature_per_mm: float
    rates: Floats = field(default_factory=lambda: np.zeros(4))

    def mirror_image(self) -> Motion:
        """Motion of the right wheel as the motion of a left wheel.

        Returns
        -------
        Motion
            The motion, mirrored at the vertical plane along the track.
        """
        mirror = np.array([-1.0, 1.0, -1.0, -1.0])
        curvature = -self.curvature_per_mm
        return replace(self, place=self.place * mirror, curvature_per_mm=curvature, rates=self.rates * mirror)

    @property
    def axle(self) -> Floats:
        """Direction (3,) of the axle to the left."""
        (cos_roll, cos_yaw), (sin_roll, sin_yaw) = np.cos(self.place[2:]), np.sin(self.place[2:])
        return np.array([-sin_yaw * cos_roll, cos_yaw * cos_roll, sin_roll])


@dataclass(frozen=True, kw_only=True)
class PatchForce:
    """Forces of a wheel's contact patch, in the frame of the left side.

    Attributes
    ----------
    normal_force_N, fx_N, fy_N
        Forces on the wheel: size of the normal force, and creep forces along and across.
    angle_rad, place_mm
        Contact angle and position (3,) at the centre of pressure, the position in the track frame of the wheelset.
    radius_mm
        Rolling radius at the centre of pressure.
    a_mm, b_mm
        Semi-axes of the equivalent ellipse.
    spin_moment_Nmm
        Moment of the creep forces on the wheel about the contact normal at the centre of pressure.
    t_gamma_N
        Power of slip divided by the running speed: T-gamma, the wear number.
    creepages
        Creepages at the centre of pressure.
    problem
        Reason why the normal force is not reliable; empty if it is reliable.
    """

    normal_force_N: float
    fx_N: float
    fy_N: float
    spin_moment_Nmm: float
    t_gamma_N: float
    angle_rad: float
    place_mm: tuple[float, float, float]
    radius_mm: float
    a_mm: float
    b_mm: float
    creepages: Creepages
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class WheelForce:
    """Force and moment of a rail on a wheel.

    Attributes
    ----------
    force_N : ndarray of shape (3,)
        Force on the wheel.
    moment_Nmm : ndarray of shape (3,)
        Moment about the centre of the wheelset.
    power_per_speed_N
        Power of slip, divided by the running speed.
    turned_N
        Force along the rails from contacts ahead of the axle, where the rails are turned.
    patches
        Forces of the patches.
    """

    force_N: Floats
    moment_Nmm: Floats
    power_per_speed_N: float
    turned_N: float
    patches: tuple[PatchForce, ...]

    @property
    def problem(self) -> str:
        """Reason why the normal force of a patch is not reliable; empty if all are reliable."""
        return next((patch.problem for patch in self.patches if patch.problem), "")

    def mirror_image(self) -> WheelForce:
        """Force on the right wheel in the frame of the left side.

        A force that was computed on the mirror image of the right side is mirrored back.

        Returns
        -------
        WheelForce
            The mirrored force and moment. The patches stay in the frame of the left side.
        """
        return replace(
            self,
            force_N=self.force_N * np.array([1.0, -1.0, 1.0]),
            moment_Nmm=self.moment_Nmm * np.array([-1.0, 1.0, -1.0]),
        )


def compute_wheel_force(surfaces: Surfaces, motion: Motion, law: ContactSettings) -> WheelForce:
    """Compute the force of a rail on a left wheel.

    Parameters
    ----------
    surfaces
        Wheel and rail.
    motion
        Motion of the wheelset.
    law
        Theories and constants of the contact.

    Returns
    -------
    WheelForce
        Force and moment; zero if the wheel does not touch the rail.

    Raises
    ------
    OutOfReachError
        If the wheel lies so in the rail that no theory has a force.

    Notes
    -----
    Creep forces are by FASTSIM on strips (`contact_theories.rolling.fastsim`), with 30 cells per strip. Range of
    validity: steady rolling; for ratios of the semi-axes beyond 10, where Kalker's table ends, the coefficients are
    those for 10.
    """
    overlap = surfaces.overlap(*map(float, motion.place))
    patches = solve_normal_contact(overlap, law.normal, law.contact_modulus_MPa)
    with errors_as_out_of_reach():
        patch_forces = [
            _compute_patch_force(patch, overlap, motion, law, surfaces.pair.rolling_radius_mm)
            for patch in patches
            if overlap
        ]
    return WheelForce(
        force_N=sum((patch_force.force_N for patch_force in patch_forces), start=np.zeros(3)),
        moment_Nmm=sum((patch_force.moment_Nmm for patch_force in patch_forces), start=np.zeros(3)),
        power_per_speed_N=sum(patch_force.power_per_speed_N for patch_force in patch_forces),
        turned_N=sum(patch_force.turned_N for patch_force in patch_forces),
        patches=tuple(patch for patch_force in patch_forces for patch in patch_force.patches),
    )


def _compute_patch_force(
    patch_strips: PatchStrips, overlap: Overlap, motion: Motion, law: ContactSettings, radius_mm: float
) -> WheelForce:
    """Compute the contribution of a patch to the force on its wheel.

    Parameters
    ----------
    patch_strips
        Strips of the patch with their normal forces.
    overlap
        Positions and angles of the rail's surface over s.
    motion
        Position and rates of the wheelset.
    law
        Law of creep forces, with friction and materials.
    radius_mm
        Nominal rolling radius.

    Returns
    -------
    WheelForce
        Force in N, and moment in N mm about the centre of the wheelset.
    """
    strip_forces_N = patch_strips.force_N_per_mm * patch_strips.width_mm
    load = float(strip_forces_N.sum())
    centre_s = float(patch_strips.s_mm @ strip_forces_N) / load
    # points of the strips, and last the centre of pressure
    points = overlap.interpolate(np.append(patch_strips.s_mm, centre_s))
    positions, angle = points.place_mm, points.angle_rad
    normal = np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=1)
    arm = positions - np.array([0.0, *motion.place[:2]])
    velocity, turning = compute_rigid_slip(arm, motion, radius_mm)
    spin = normal @ turning
    tangent = np.array([0.0, math.cos(angle[-1]), math.sin(angle[-1])])
    plane = Creepages(xi=float(velocity[-1, 0]), eta=float(velocity[-1] @ tangent), spin_per_mm=float(spin[-1]))
    across = patch_strips.s_mm - centre_s
    creepages = CurvedCreepages(
        plane=plane,
        y_mm=across,
        xi_beside=velocity[:-1, 0] - plane.across(across)[0],
        spin_beside_per_mm=spin[:-1] - plane.spin_per_mm,
    )
    fastsim_strips = _make_fastsim_strips(patch_strips, across, law)
    fx, fy, turning_moment = calculate_strip_forces(fastsim_strips, creepages, cells=_FASTSIM_CELLS)
    strips = slice(0, -1)
    across_direction = np.stack([np.zeros_like(fy), np.cos(angle[strips]), np.sin(angle[strips])], axis=1)
    tangential = np.array([1.0, 0.0, 0.0]) * fx[:, None] + across_direction * fy[:, None]
    force = normal[strips] * strip_forces_N[:, None] + tangential
    t_gamma = -float((velocity[strips] * tangential).sum() + spin[strips] @ turning_moment)
    creep_moment = np.cross(positions[strips] - positions[-1], tangential).sum(axis=0) + turning_moment @ normal[strips]
    patch = PatchForce(
        normal_force_N=load,
        fx_N=float(fx.sum()),
        fy_N=float(fy.sum()),
        spin_moment_Nmm=float(creep_moment @ normal[-1]),
        t_gamma_N=t_gamma,
        angle_rad=float(angle[-1]),
        place_mm=(float(positions[-1, 0]), float(positions[-1, 1]), float(positions[-1, 2])),
        radius_mm=float(points.radius_mm[-1]),
        a_mm=fastsim_strips.contact.a_mm,
        b_mm=fastsim_strips.contact.b_mm,
        creepages=plane,
        problem=patch_strips.problem,
    )
    return WheelForce(
        force_N=force.sum(axis=0),
        moment_Nmm=np.cross(arm[strips], force).sum(axis=0) + turning_moment @ normal[strips],
        power_per_speed_N=t_gamma,
        turned_N=motion.curvature_per_mm * float(force[:, 1] @ arm[strips, 0]),
        patches=(patch,),
    )


def compute_rigid_slip(arm_mm: Floats, motion: Motion, radius_mm: float) -> tuple[Floats, Floats]:
    """Velocity of the rigid wheel relative to the rail, and its angular velocity.

    Both are divided by the running speed V. The rail bends as well: ahead of the axle it is turned by the curvature
    times the distance.

    Parameters
    ----------
    arm_mm : ndarray of shape (n, 3)
        Arms from the centre of the wheelset.
    motion
        Motion of the wheelset.
    radius_mm
        Nominal rolling radius.

    Returns
    -------
    velocity (n, 3)
        Velocity at each arm, divided by V.
    turning (3,)
        Angular velocity per mm of way.

    Examples
    --------
    A wheelset that rolls on its nominal radius has no slip:

    >>> import numpy as np
    >>> from fecontact.features.curves.wheel_forces import Motion, compute_rigid_slip
    >>> motion = Motion(place=np.array([0.0, 460.0, 0.0, 0.0]), slip=0.0, curvature_per_mm=0.0)
    >>> velocity, _ = compute_rigid_slip(np.array([[0.0, 750.0, -460.0]]), motion, 460.0)
    >>> bool(np.abs(velocity).max() < 1e-12)
    True
    """
    y_rate, z_rate, roll_rate, yaw_rate = motion.rates
    kappa = motion.curvature_per_mm
    turning = (1.0 + motion.slip) / radius_mm * motion.axle + np.array([roll_rate, 0.0, kappa + yaw_rate])
    forward = np.array([1.0 - kappa * motion.place[0], y_rate, z_rate])
    velocity = forward + np.cross(turning, arm_mm)
    velocity[:, 1] -= kappa * arm_mm[:, 0]
    return velocity, turning


def _make_fastsim_strips(patch_strips: PatchStrips, across: Floats, law: ContactSettings) -> RollingStrips:
    """Make the strips of a patch for FASTSIM, with the ellipse of its second moments.

    `across` (n,) are the positions of the strips in mm from the centre of pressure. The ratio of the semi-axes is
    limited to `_MAX_AXIS_RATIO` and its inverse at equal area.
    """
    fastsim_strips = RollingStrips.of(
        law.pair,
        y_mm=across,
        width_mm=patch_strips.width_mm,
        middle_x_mm=np.zeros_like(across),
        half_length_mm=patch_strips.half_length_mm,
        force_N_per_mm=patch_strips.force_N_per_mm,
    )
    ellipse = fastsim_strips.contact
    root_axis_ratio = math.sqrt(min(max(ellipse.a_mm / ellipse.b_mm, 1.0 / _MAX_AXIS_RATIO), _MAX_AXIS_RATIO))
    mean_axis = math.sqrt(ellipse.a_mm * ellipse.b_mm)
    return replace(
        fastsim_strips, contact=replace(ellipse, a_mm=mean_axis * root_axis_ratio, b_mm=mean_axis / root_axis_ratio)
    )
