"""Registration of points on exact profiles: rigid displacements, nearest points and distances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import CurvePoints, Registration

if TYPE_CHECKING:
    from scipy.interpolate import PPoly


# Largest number of Gauss-Newton steps. From errors of 5 mm and 50 mrad they converge after eight.
_MOST_STEPS = 20
# Points with a distance of more than this multiple of the usual distance are worn and have less weight (Huber 1964).
_HUBER_FACTOR = 2.0
# Reach of the weight for unworn points: the distance at first, the last distance divided by the noise, and the factor
# per step. Nearly all unworn points are within the fourth number, as a multiple of the noise.
_FIRST_REACH_MM, _LAST_REACH_OVER_NOISE, _REACH_FACTOR, _UNWORN_OVER_NOISE = 0.3, 1.5, 0.8, 3.0
# Least noise: profiles of the library are drawings, and no surface is made more accurately.
LEAST_NOISE_MM = 0.001
# Largest Gauss-Newton step: across, upwards (mm) and turn (rad).
_LARGEST_STEP = np.array([3.0, 3.0, 0.05])
# Largest inclination of a rail.
_LARGEST_TURN_RAD = 0.2
_FOOT_STEPS = 8
# Steps while the profile moves. Each search begins at the foot points of the search before, so fewer are enough.
_FIRST_FOOT_STEPS = 3
# Number of points whose nearest samples are searched together, and stride of the sampled ends of pieces.
_POINTS_PER_BLOCK, _SAMPLE_STRIDE = 500, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ProfileChain:
    """Exact profiles (k,) as a single curve, in a row.

    The nearest points on all of them are found in one calculation.

    Attributes
    ----------
    lines
        Profiles.
    curve
        y, z in mm, and their first and second derivatives, over the parameter.
    u, s_mm
        Table of the parameter and the arc length, both increasing from profile to profile.
    first_mm, last_mm : ndarray of shape (k, 1)
        Arc length at both ends of each profile.
    """

    lines: tuple[Profile, ...]
    curve: PPoly
    u: Floats
    s_mm: Floats
    first_mm: Floats
    last_mm: Floats

    @classmethod
    def of(cls, *lines: Profile) -> ProfileChain:
        """Join profiles, with room between each and the next.

        Parameters
        ----------
        *lines
            Profiles.

        Returns
        -------
        ProfileChain
            Joined profiles.
        """
        profile_pieces = [line.pieces for line in lines]
        lengths = np.array([line.length_mm for line in lines])
        first = np.concatenate(([0.0], np.cumsum(lengths + 1.0)[:-1]))
        first_parameter = np.concatenate(([0.0], np.cumsum([piece.u[-1] + 1.0 for piece in profile_pieces])[:-1]))
        u = np.concatenate([piece.u + offset for piece, offset in zip(profile_pieces, first_parameter, strict=True)])
        curve = profile_pieces[0].curve
        if len(profile_pieces) > 1:
            powers = [np.concatenate((piece.curve.c, _extend_end(piece.curve)), axis=1) for piece in profile_pieces]
            curve = type(curve)(np.concatenate(powers, axis=1)[:, :-1], u)
        return cls(
            lines=lines,
            curve=curve,
            u=u,
            s_mm=np.concatenate(
                [piece.arc.values + offset for piece, offset in zip(profile_pieces, first, strict=True)]
            ),
            first_mm=first[:, None],
            last_mm=(first + lengths)[:, None],
        )

    def find_nearest_samples(self, points: Floats) -> Floats:
        """Find the nearest samples of each profile.

        Parameters
        ----------
        points
            Points (k, n, 2) in mm.

        Returns
        -------
        ndarray
            Arc lengths (k, n) of the samples (mm).
        """
        arc_lengths = []
        for profile, line_points, first in zip(self.lines, points, self.first_mm, strict=True):
            ends, lengths = profile.pieces.ends, profile.pieces.arc.values
            y, z, sample_arc_lengths = (
                ends.y[::_SAMPLE_STRIDE],
                ends.z[::_SAMPLE_STRIDE],
                first + lengths[::_SAMPLE_STRIDE],
            )
            blocks = np.array_split(line_points, max(1, len(line_points) // _POINTS_PER_BLOCK))
            indices = [((block[:, :1] - y) ** 2 + (block[:, 1:] - z) ** 2).argmin(axis=1) for block in blocks]
            arc_lengths.append(sample_arc_lengths[np.concatenate(indices)])
        return np.stack(arc_lengths)


def _extend_end(curve: PPoly) -> Floats:
    """Coefficients of a piece that stays at the end of a curve."""
    coefficients = np.zeros_like(curve.c[:, :1])
    coefficients[-1] = curve(curve.x[-1])
    return np.asarray(coefficients)


@dataclass(frozen=True, kw_only=True, eq=False)
class FootPoints:
    """Nearest points on a profile, or on each of k profiles, for n points.

    Attributes
    ----------
    s_mm, points, normals
        Arc length and position of the foot point, and the normal of the profile, to its left.
    off_mm
        Distance of the point along the normal.
    inside
        Whether the point is over the profile and not beyond its ends.
    """

    s_mm: Floats
    points: Floats
    normals: Floats
    off_mm: Floats
    inside: NDArray[np.bool_]

    def of(self, number: int) -> FootPoints:
        """Foot points on the profile with a given number."""
        return FootPoints(**{name: values[number] for name, values in vars(self).items()})

    @property
    def usual_mm(self) -> list[float]:
        """Usual distance of the points from each profile (mm)."""
        return [estimate_distance_mm(off[inside]) for off, inside in zip(self.off_mm, self.inside, strict=True)]


def find_foot_points(profile: Profile, points: Floats) -> FootPoints:
    """Nearest points of a profile for points within a few mm.

    Parameters
    ----------
    profile
        Exact profile.
    points
        Points (n, 2) in mm.

    Returns
    -------
    FootPoints
        Foot points (n,).
    """
    return _find_foot_points(ProfileChain.of(profile), points[None]).of(0)


def _find_foot_points(
    lines: ProfileChain, points: Floats, *, near: FootPoints | None = None, steps: int = _FOOT_STEPS
) -> FootPoints:
    """Nearest points of k profiles.

    Parameters
    ----------
    lines
        Profiles.
    points
        Points (k, n, 2) in mm.
    near
        Foot points at which the search begins; None for the nearest samples.
    steps
        Largest number of Newton steps.

    Returns
    -------
    FootPoints
        Foot points (k, n).
    """
    s = lines.find_nearest_samples(points) if near is None else near.s_mm + lines.first_mm
    for _ in range(steps):
        # the table gives an approximate arc length, but the point is exactly on the profile
        values = lines.curve(np.interp(s, lines.s_mm, lines.u))
        curve_points = CurvePoints(*(values[..., k] for k in range(6)))
        speed = np.hypot(curve_points.dy, curve_points.dz)
        t_y, t_z, off_y, off_z = (
            curve_points.dy / speed,
            curve_points.dz / speed,
            points[..., 0] - curve_points.y,
            points[..., 1] - curve_points.z,
        )
        along, across = off_y * t_y + off_z * t_z, off_z * t_y - off_y * t_z
        # beyond the centre of a tight arc no foot point exists; np.clip takes five times as long as np.maximum
        step = along / np.maximum(1.0 - curve_points.curvature_per_mm * across, 0.2)
        # points beyond an end would never converge
        next_s = s + np.minimum(np.maximum(step, -1.0), 1.0)
        next_s = np.minimum(np.maximum(next_s, lines.first_mm), lines.last_mm)
        if not (np.abs(next_s - s) > 1e-10).any():
            break
        s = next_s
    return FootPoints(
        s_mm=s - lines.first_mm,
        points=np.stack((curve_points.y, curve_points.z), axis=-1),
        normals=np.stack((-t_z, t_y), axis=-1),
        off_mm=across,
        inside=(np.abs(along) < 1e-6) & (s >= lines.first_mm) & (s <= lines.last_mm),
    )


def register(profile: Profile, points: Floats) -> tuple[Registration, float]:
    """Register a profile on points; worn points have less weight.

    Parameters
    ----------
    profile
        Exact profile.
    points
        Points (n, 2) in mm.

    Returns
    -------
    registration, usual_mm
        Rigid displacement of the profile, and the usual distance that remains (mm); infinite if the profile covers at
        most 80 % of the points.
    """
    registrations, usual, _ = register_all(
        ProfileChain.of(profile), points, [Registration(shift=estimate_shift(profile, points))]
    )
    return registrations[0], usual[0]


def register_all(
    lines: ProfileChain, points: Floats, begin: Sequence[Registration], *, steps: int = _MOST_STEPS
) -> tuple[list[Registration], list[float], FootPoints]:
    """Register several profiles on points, from given registrations.

    Parameters
    ----------
    lines
        Profiles (k,).
    points
        Points (n, 2) in mm.
    begin
        Registrations (k,) at which the search begins.
    steps
        Largest number of Gauss-Newton steps.

    Returns
    -------
    registrations, usual_mm, feet
        Rigid displacements (k,), the usual distances that remain (k,) (mm), and the foot points (k, n). A distance is
        infinite if the profile covers at most 80 % of the points.
    """
    registrations, feet, is_active = list(begin), None, np.ones(len(begin), dtype=bool)
    for _ in range(steps):
        moved_points = _move_to_references(registrations, points)
        feet = _find_foot_points(lines, moved_points, near=feet, steps=_FIRST_FOOT_STEPS)
        reach = _HUBER_FACTOR * np.array(feet.usual_mm)[:, None]
        weight = np.where(feet.inside, np.minimum(1.0, reach / np.maximum(np.abs(feet.off_mm), 1e-12)), 0.0)
        improved, size = _improve_registrations(registrations, moved_points, feet, weight)
        registrations = [
            improved_registration if is_continued else registration
            for registration, improved_registration, is_continued in zip(
                registrations, improved, is_active, strict=True
            )
        ]
        # a converged registration is kept: along a straight profile, rounding alone would move it away
        is_active &= size >= 1e-7
        if not is_active.any():
            break
    feet = _find_foot_points(lines, _move_to_references(registrations, points))
    is_covering = np.count_nonzero(feet.inside, axis=1) > 0.8 * len(points)
    usual_mm = [
        distance_mm if is_covered else math.inf
        for distance_mm, is_covered in zip(feet.usual_mm, is_covering, strict=True)
    ]
    return registrations, usual_mm, feet


def _move_to_references(registrations: Sequence[Registration], points: Floats) -> Floats:
    """Points (k, n, 2) relative to each registered reference, from points (n, 2)."""
    return np.stack([registration.to_reference(points) for registration in registrations])


def _improve_registrations(
    registrations: Sequence[Registration], moved_points: Floats, feet: FootPoints, weight: Floats
) -> tuple[list[Registration], Floats]:
    """Improve registrations by a Gauss-Newton step.

    Parameters
    ----------
    registrations
        Registrations (k,).
    moved_points
        Points (k, n, 2) in the axes of the references (mm).
    feet
        Foot points (k, n).
    weight
        Weights (k, n) of the points.

    Returns
    -------
    registrations, size
        Improved registrations (k,), and the size of the steps (k,) (mm or rad).
    """
    # the points are moved by -shift and turned by -turn, to first order about their positions
    lever = moved_points[..., 0] * feet.normals[..., 1] - moved_points[..., 1] * feet.normals[..., 0]
    matrix = np.sqrt(weight)[..., None] * np.concatenate((feet.normals, lever[..., None]), axis=-1)
    steps = (np.linalg.pinv(matrix, rcond=1e-6) @ (np.sqrt(weight) * feet.off_mm)[..., None])[..., 0]
    steps = np.minimum(np.maximum(steps, -_LARGEST_STEP), _LARGEST_STEP)
    improved = []
    for registration, step in zip(registrations, steps, strict=True):
        turn = min(max(registration.turn_rad + float(step[2]), -_LARGEST_TURN_RAD), _LARGEST_TURN_RAD)
        displacement = registration.rotate(step[None, :2])[0]
        improved.append(
            Registration(
                turn_rad=turn, shift=(registration.shift[0] + displacement[0], registration.shift[1] + displacement[1])
            )
        )
    return improved, np.abs(steps).max(axis=1)


def select_unworn(
    lines: ProfileChain, points: Floats, begin: Sequence[Registration], noise_mm: float
) -> tuple[FootPoints, list[float]]:
    """Foot points of unworn points, with the share of points that each profile fits.

    Deep and wide wear moves a profile off the other points, even with a small weight. Here the weight of points that
    are off by more than the noise decreases to zero (Geman and McClure 1987), from some tenths of a millimetre
    downwards.

    Parameters
    ----------
    lines
        Profiles (k,).
    points
        Points (n, 2) in mm.
    begin
        Registrations (k,) at which the search begins.
    noise_mm
        Standard deviation of the noise of the points (mm).

    Returns
    -------
    feet, unworn
        Foot points (k, n), and the fraction of unworn points (k,).
    """
    registrations, feet, reach = list(begin), None, _FIRST_REACH_MM
    while reach > _LAST_REACH_OVER_NOISE * noise_mm:
        moved_points = _move_to_references(registrations, points)
        feet = _find_foot_points(lines, moved_points, near=feet, steps=_FIRST_FOOT_STEPS)
        weight = np.where(feet.inside, 1.0 / (1.0 + (feet.off_mm / reach) ** 2) ** 2, 0.0)
        registrations, _ = _improve_registrations(registrations, moved_points, feet, weight)
        reach *= _REACH_FACTOR
    feet = _find_foot_points(lines, _move_to_references(registrations, points))
    unworn = (feet.inside & (np.abs(feet.off_mm) < _UNWORN_OVER_NOISE * noise_mm)).mean(axis=1)
    return feet, [float(share) for share in unworn]


def estimate_distance_mm(distances_mm: Floats) -> float:
    """Estimate the standard deviation of distances by their median.

    So worn points have little influence.

    Parameters
    ----------
    distances_mm
        Distances (n,) in mm.

    Returns
    -------
    float
        Standard deviation (mm); infinite without distances.
    """
    return float(np.median(np.abs(distances_mm))) / 0.6745 + 1e-9 if distances_mm.size else math.inf


def estimate_shift(profile: Profile, points: Floats) -> tuple[float, float]:
    """Displacement that aligns the crowns of two rails or the flange tips of two wheels.

    Parameters
    ----------
    profile
        Exact profile.
    points
        Points (n, 2) in mm.

    Returns
    -------
    tuple of float
        Displacement (y, z) in mm; (0, 0) for a wheel without a flange.
    """
    ends = profile.pieces.ends
    if profile.kind == "rail":
        i, j = int(np.argmax(ends.z)), int(np.argmax(points[:, 1]))
        # a crown is flat, so the middles of the heads give the lateral position more accurately
        middle = 0.5 * float(np.ptp(points[:, 0]) - np.ptp(ends.y)) + float(points[:, 0].min() - ends.y.min())
        return middle, float(points[j, 1] - ends.z[i])
    i, j = int(np.argmin(ends.z)), int(np.argmin(points[:, 1]))
    if min(np.ptp(ends.z), np.ptp(points[:, 1])) < 15.0:
        return 0.0, 0.0
    return float(points[j, 0] - ends.y[i]), float(points[j, 1] - ends.z[i])
