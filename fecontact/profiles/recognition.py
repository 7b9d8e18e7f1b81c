"""Which profile of the library measured points are, worn or not, and the line that is smoothed from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Kind, Profile
from fecontact.profiles.library import find, load, names
from fecontact.profiles.measured import Measured
from fecontact.profiles.noise import noise_of
from fecontact.profiles.points import SPLINE_NOISE, Points, checked, profile_of, spline_through
from fecontact.profiles.reading import Reading
from fecontact.profiles.registration import foot_points, register
from fecontact.profiles.segments import Floats, Registration
from fecontact.profiles.smoothed_lines import segments_of
from fecontact.profiles.smoothing import against, alone, choose, smoothed

# A spline through points with less noise in its curvature than this is as good as the points (1/mm): 1 % of R 300.
_CURVATURE_NOISE_PER_MM = 3e-5
# Points for the first look at a profile, and profiles that get a second one.
_FEW_POINTS, _MOST_CLOSE = 60, 3
# Steps of that: from 50 mrad and some mm off the true one of all rails is nearest after four.
_FIRST_STEPS = 6
# A profile that the points are usually farther off is another one.
_FARTHEST_MM = 2.0
# Cants of rails (1:n), and how near to one a turn (as a part of it) makes one ask for it.
_USUAL_CANT, _CANT_CLOSE = (20, 30, 40), 0.12
# Points closer than this part of the usual spacing tell nothing about the line between them.
_CLOSE_TO_SPACING = 0.2


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """A profile of the library beside measured points.

    Attributes
    ----------
    usual_mm, farthest_mm
        How far the points lie off it, usually (as a standard deviation) and at most.
    at_y_mm
        Where that is the most.
    """

    name: str
    registration: Registration
    usual_mm: float
    farthest_mm: float
    at_y_mm: float


def nearest(points: Floats, kind: Kind, among: tuple[str, ...] | None = None) -> list[Nearest]:
    """Profiles of the library that points (n, 2) may be, the nearest first."""
    few = points[:: max(1, len(points) // _FEW_POINTS)]
    known = names(kind) if among is None else among
    if len(known) > _MOST_CLOSE:
        known = tuple(sorted(known, key=lambda name: register(load(name), few, steps=_FIRST_STEPS)[1]))
    found = []
    for name in known[:_MOST_CLOSE]:
        registration, usual = register(load(name), points)
        if usual > _FARTHEST_MM:
            continue
        feet = foot_points(load(name), registration.to_reference(points))
        off = np.where(feet.inside, np.abs(feet.off_mm), 0.0)
        at = int(np.argmax(off))
        found.append(
            Nearest(
                name=name,
                registration=registration,
                usual_mm=usual,
                farthest_mm=float(off[at]),
                at_y_mm=float(points[at, 0]),
            )
        )
    return sorted(found, key=lambda one: one.usual_mm)


def line_through(given: Points, reading: Reading) -> Profile:
    """The line through points that are checked here: smoothed, or splines where they have no noise or are to be exact.

    Raises
    ------
    InputError
        The points do not look like a running surface; or the nominal profile that is asked for is not in the library,
        or they do not lie over it.
    """
    given = checked(given, repair=reading.repair)
    if reading.smoothing_mm == 0.0 or len(given.points) < 20:
        return spline_through(given)
    points = _spread(given.points)
    spacing = float(np.median(np.hypot(*np.diff(points, axis=0).T)))
    asked = reading.smoothing_mm is not None or reading.noise_mm is not None or reading.nominal not in ("auto", "none")
    if not asked and SPLINE_NOISE * noise_of(points) / spacing**2 < _CURVATURE_NOISE_PER_MM:
        return spline_through(given)
    measured = _smoothed(replace(given, points=points), reading)
    return profile_of(
        given, segments_of(measured), [_note(measured, reading), *_choices(measured, given.kind)], measured
    )


def _smoothed(given: Points, reading: Reading) -> Measured:
    """Points as a smoothed deviation from the nearest profiles of the library, or by themselves, whichever is best."""
    smooth = partial(smoothed, width_mm=reading.smoothing_mm, noise_mm=reading.noise_mm)
    if reading.nominal == "none":
        return smooth(alone(given.points))[0]
    among = None if reading.nominal == "auto" else (find(reading.nominal, given.kind),)
    close = nearest(given.points, given.kind, among)[:2]
    held = [against(load(one.name), one.registration, given.points) for one in close]
    candidates = [smooth(one) for one in held if one is not None]
    if among is None:
        return choose([*candidates, smooth(alone(given.points))])
    if not candidates:
        raise InputError(
            f"{given.name}: the points do not lie over {among[0]} within {_FARTHEST_MM:g} mm, or reach beyond its"
            " ends; give another nominal profile, or none"
        )
    return candidates[0][0]


def _spread(points: Floats) -> Floats:
    """Points without those that lie close to the one before."""
    chord = np.hypot(*np.diff(points, axis=0).T)
    closest = _CLOSE_TO_SPACING * float(np.median(chord))
    if chord.min() >= closest:
        return points
    kept = [0]
    for i in range(1, len(points)):
        if np.hypot(*(points[i] - points[kept[-1]])) >= closest:
            kept.append(i)
    return points[kept]


def _choices(made: Measured, kind: Kind) -> list[str]:
    """What is taken for granted of points that are held against a profile of the library, and how to take it back."""
    if not made.nominal:
        return []
    said = []
    if load(made.nominal).junctions:
        said.append(
            f"where the curvature of {made.nominal} jumps, that of the {kind} is taken to jump too:"
            f" --{kind}-nominal none takes the points alone"
        )
    turn_rad = made.held.registration.turn_rad
    near = [one for one in _USUAL_CANT if abs(abs(turn_rad) * one - 1.0) < _CANT_CLOSE]
    if kind == "rail" and near:
        said.append(
            f"{made.nominal} lies on the points turned by {1e3 * turn_rad:+.1f} mrad, near 1:{near[0]}:"
            " is the rail canted in the file already? Then give --inclination none"
        )
    return said


def _note(made: Measured, reading: Reading) -> str:
    largest = float(np.hypot(*made.held.values.T).max())
    of = f"its deviation from {made.nominal} (at most {largest:.2g} mm)" if made.nominal else "the line"
    how = "as given" if reading.smoothing_mm is not None else "from the noise of the points"
    middle = float(np.median(made.curvature_noise_per_mm))
    return (
        f"smoothed from {len(made.points)} points with {1e3 * made.noise_mm:.2g} um of noise: {of}, over waves of"
        f" {made.width_mm:.3g} mm ({how}); curvature uncertain by {middle:.1g} /mm from the noise"
    )
