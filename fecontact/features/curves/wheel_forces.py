"""Force and moment of a rail on its wheel at any position of the wheelset on a curved track."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.creepage import Creepages, CurvedCreepages
from fecontact.contact_theories.rolling.fastsim import Strips, strip_forces
from fecontact.features.curves.normal import NormalTheory, Overlap, Pressed, Surfaces, press, within_reach

_FASTSIM_CELLS = 30
# Kalker's table ends there; flange contact has 17 to 23.
_MOST_SLENDER = 10.0


@dataclass(frozen=True, kw_only=True)
class ContactLaw:
    """What a contact is evaluated with: theory of the normal force, contact modulus, friction and elastic constants."""

    normal: NormalTheory
    contact_modulus_MPa: float
    pair: RollingPair


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """Motion of a wheelset's centre in the track frame that runs along, of the left side; all over the running speed.

    Attributes
    ----------
    place (4,)
        Lateral shift and height (mm), roll and yaw (rad).
    slip
        Speed of rotation over that which rolls the tape circle, less 1.
    curvature_per_mm
        Of the track, positive to the left.
    rates (4,)
        Of the place; zero in steady motion.
    """

    place: Floats
    slip: float
    curvature_per_mm: float
    rates: Floats = field(default_factory=lambda: np.zeros(4))

    def mirrored(self) -> Motion:
        """The motion of the right wheel, mirrored to a left wheel."""
        mirror = np.array([-1.0, 1.0, -1.0, -1.0])
        curvature = -self.curvature_per_mm
        return replace(self, place=self.place * mirror, curvature_per_mm=curvature, rates=self.rates * mirror)

    @property
    def axle(self) -> Floats:
        """Direction (3,) of the axle to the left."""
        (cr, cy), (sr, sy) = np.cos(self.place[2:]), np.sin(self.place[2:])
        return np.array([-sy * cr, cy * cr, sr])


@dataclass(frozen=True, kw_only=True)
class PatchForce:
    """What one patch of a wheel carries, in the frame of the left side.

    Attributes
    ----------
    normal_force_N, fx_N, fy_N
        On the wheel: size of the normal force, and creep forces along and across.
    angle_rad, place_mm
        Contact angle and place (3,) at its centre of pressure, the latter from the wheelset's track frame.
    radius_mm
        Rolling radius there.
    a_mm, b_mm
        Semi-axes of the ellipse that stands for it.
    creepages
        There.
    problem
        Why the normal force is not to be trusted; empty where it is.
    """

    normal_force_N: float
    fx_N: float
    fy_N: float
    angle_rad: float
    place_mm: tuple[float, float, float]
    radius_mm: float
    a_mm: float
    b_mm: float
    creepages: Creepages
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class WheelForce:
    """Force (3,) and moment (3,) about the wheelset's centre on a wheel, and the power of slip over the speed.

    `turned_N` is what contacts ahead of the axle add along the rails, which are turned there.
    """

    force_N: Floats
    moment_Nmm: Floats
    power_per_speed_N: float
    turned_N: float
    patches: tuple[PatchForce, ...]

    @property
    def problem(self) -> str:
        """Why the normal force of a patch is not to be trusted; empty where all are."""
        return next((patch.problem for patch in self.patches if patch.problem), "")

    def mirrored(self) -> WheelForce:
        """That of the right wheel in the frame of the left side, which it is the mirror image of."""
        return replace(
            self,
            force_N=self.force_N * np.array([1.0, -1.0, 1.0]),
            moment_Nmm=self.moment_Nmm * np.array([-1.0, 1.0, -1.0]),
        )


def wheel_force(surfaces: Surfaces, motion: Motion, law: ContactLaw) -> WheelForce:
    """Force on a left wheel; zero where it does not touch.

    Raises
    ------
    OutOfReach
        If the wheel lies in the rail where no theory has a force.
    """
    overlap = surfaces.overlap(*map(float, motion.place))
    pressed = press(overlap, law.normal, law.contact_modulus_MPa)
    with within_reach():
        parts = [
            _patch_force(patch, overlap, motion, law, surfaces.pair.rolling_radius_mm) for patch in pressed if overlap
        ]
    return WheelForce(
        force_N=sum((part.force_N for part in parts), start=np.zeros(3)),
        moment_Nmm=sum((part.moment_Nmm for part in parts), start=np.zeros(3)),
        power_per_speed_N=sum(part.power_per_speed_N for part in parts),
        turned_N=sum(part.turned_N for part in parts),
        patches=tuple(patch for part in parts for patch in part.patches),
    )


def _patch_force(pressed: Pressed, overlap: Overlap, motion: Motion, law: ContactLaw, radius_mm: float) -> WheelForce:
    """What one patch adds to the force on its wheel."""
    line = pressed.force_N_per_mm * pressed.width_mm
    load = float(line.sum())
    centre_s = float(pressed.s_mm @ line) / load
    # the strips, and the centre of pressure
    here = overlap.at(np.append(pressed.s_mm, centre_s))
    place, angle = here.place_mm, here.angle_rad
    normal = np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=1)
    arm = place - np.array([0.0, *motion.place[:2]])
    velocity, turning = rigid_slip(arm, motion, radius_mm)
    spin = normal @ turning
    tangent = np.array([0.0, math.cos(angle[-1]), math.sin(angle[-1])])
    plane = Creepages(xi=float(velocity[-1, 0]), eta=float(velocity[-1] @ tangent), spin_per_mm=float(spin[-1]))
    across = pressed.s_mm - centre_s
    creepages = CurvedCreepages(
        plane=plane,
        y_mm=across,
        xi_beside=velocity[:-1, 0] - plane.across(across)[0],
        spin_beside_per_mm=spin[:-1] - plane.spin_per_mm,
    )
    piece = _piece(pressed, across, law)
    fx, fy, turning_moment = strip_forces(piece, creepages, cells=_FASTSIM_CELLS)
    lines = slice(0, -1)
    along = np.stack([np.zeros_like(fy), np.cos(angle[lines]), np.sin(angle[lines])], axis=1)
    tangential = np.array([1.0, 0.0, 0.0]) * fx[:, None] + along * fy[:, None]
    of_strips = normal[lines] * line[:, None] + tangential
    patch = PatchForce(
        normal_force_N=load,
        fx_N=float(fx.sum()),
        fy_N=float(fy.sum()),
        angle_rad=float(angle[-1]),
        place_mm=(float(place[-1, 0]), float(place[-1, 1]), float(place[-1, 2])),
        radius_mm=float(here.radius_mm[-1]),
        a_mm=piece.contact.a_mm,
        b_mm=piece.contact.b_mm,
        creepages=plane,
        problem=pressed.problem,
    )
    return WheelForce(
        force_N=of_strips.sum(axis=0),
        moment_Nmm=np.cross(arm[lines], of_strips).sum(axis=0) + turning_moment @ normal[lines],
        power_per_speed_N=-float((velocity[lines] * tangential).sum() + spin[lines] @ turning_moment),
        turned_N=motion.curvature_per_mm * float(of_strips[:, 1] @ arm[lines, 0]),
        patches=(patch,),
    )


def rigid_slip(arm_mm: Floats, motion: Motion, radius_mm: float) -> tuple[Floats, Floats]:
    """Velocity (n, 3) of the rigid wheel against the rail at arms (n, 3) from its centre, and its turning (3,); over V.

    The rail bends as well: ahead of the axle it is turned by the curvature times the distance.
    """
    y_rate, z_rate, roll_rate, yaw_rate = motion.rates
    kappa = motion.curvature_per_mm
    turning = (1.0 + motion.slip) / radius_mm * motion.axle + np.array([roll_rate, 0.0, kappa + yaw_rate])
    forward = np.array([1.0 - kappa * motion.place[0], y_rate, z_rate])
    velocity = forward + np.cross(turning, arm_mm)
    velocity[:, 1] -= kappa * arm_mm[:, 0]
    return velocity, turning


def _piece(pressed: Pressed, across: Floats, law: ContactLaw) -> Strips:
    """The patch for FASTSIM, with the ellipse of its second moments."""
    piece = Strips.of(
        law.pair,
        y_mm=across,
        width_mm=pressed.width_mm,
        middle_x_mm=np.zeros_like(across),
        half_length_mm=pressed.half_length_mm,
        force_N_per_mm=pressed.force_N_per_mm,
    )
    ellipse = piece.contact
    slender = math.sqrt(min(max(ellipse.a_mm / ellipse.b_mm, 1.0 / _MOST_SLENDER), _MOST_SLENDER))
    size = math.sqrt(ellipse.a_mm * ellipse.b_mm)
    return replace(piece, contact=replace(ellipse, a_mm=size * slender, b_mm=size / slender))
