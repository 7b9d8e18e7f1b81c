"""Lines made of smoothed points: the one of the points, others that they allow, and a part of a deviation."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np

from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.measured import Held, Measured
from fecontact.profiles.segments import Arc, Floats, Line, Polynomial, Segment, Smoothed, polynomial_arc
from fecontact.profiles.smoothing import SEED, slid
from fecontact.profiles.smoothing_spline import smoothed_by

Variant = Literal["narrow", "double"] | int
"""Another line that the points allow: of 0.71 or double the width, or from points with other noise of the same size."""


def segments_of(measured: Measured) -> tuple[Segment, ...]:
    """The pieces of a smoothed line: one for each segment of the nominal profile, or a single one."""
    held = measured.held
    field = smoothed_by(held.s_mm, held.values, measured.width_mm, held.relative_width)
    first, last = float(held.s_mm[0]), float(held.s_mm[-1])
    if not held.reference:
        return (Smoothed(field=field, s_from=first, s_to=last),)
    made: list[Segment] = []
    start = 0.0
    for base in held.reference:
        assert isinstance(base, Line | Arc | Polynomial)
        whole = Smoothed(
            field=field, s_from=start, s_to=start + _length(base), base=base, registration=held.registration
        )
        low, high = max(first, whole.s_from), min(last, whole.s_to)
        start = whole.s_to
        if high - low > 1e-6:
            v_from, v_to = (float(v) for v in _exact_local(whole, np.array([low, high])))
            made.append(replace(whole, s_from=low, s_to=high, v_from=v_from, v_to=v_to))
    return tuple(made)


def scaled(profile: Profile, part: float) -> Profile:
    """A smoothed line with a part of its deviation from its nominal profile: 0 is the nominal, 1 the line itself.

    Raises
    ------
    InputError
        The line was not smoothed as a deviation from a nominal profile.
    """
    if profile.measured is None or not profile.measured.nominal:
        raise InputError(
            f"{profile.name} is not known by its deviation from a nominal profile; give a file of measured points, and"
            " the name of the nominal where it is not recognised"
        )
    segments = []
    for segment in profile.segments:
        assert isinstance(segment, Smoothed)
        field = segment.field
        segments.append(replace(segment, field=type(field)(part * field.c, field.x)))
    return replace(profile, segments=tuple(segments), name=f"{profile.name} times {part:g}", measured=None)


@lru_cache(maxsize=64)
def variant(profile: Profile, which: Variant) -> Profile:
    """Another line that the points of a smoothed profile allow; the profile itself where it has none."""
    measured = profile.measured
    if measured is None:
        return profile
    if which == "narrow":
        changed = _with_width(measured, math.sqrt(0.5) * measured.width_mm)
    elif which == "double":
        changed = _with_width(measured, 2.0 * measured.width_mm)
    else:
        rng = np.random.default_rng([SEED, int(which), 0 if profile.kind == "rail" else 1])
        points, normals = _at(profile, measured.s_mm)
        drawn = points + (measured.noise_mm * rng.normal(size=measured.s_mm.size))[:, None] * normals
        changed = _with_width(replace(measured, held=_moved_to(drawn, measured.held)), measured.width_mm)
    return replace(profile, segments=segments_of(changed), measured=changed)


def _with_width(measured: Measured, width_mm: float) -> Measured:
    return replace(measured, width_mm=width_mm, held=slid(measured.held, width_mm))


def _moved_to(points: Floats, held: Held) -> Held:
    """Other points (n, 2) at the same places, held against the same line."""
    return replace(held, points=points, values=held.values + (points - held.points))


def _at(profile: Profile, s: Floats) -> tuple[Floats, Floats]:
    """Points and normals (n, 2) of a smoothed line at places s of what it was smoothed over."""
    points, normals = np.empty((s.size, 2)), np.empty((s.size, 2))
    for segment in profile.segments:
        assert isinstance(segment, Smoothed)
        here = (s >= segment.s_from - 1e-9) & (s <= segment.s_to + 1e-9)
        v = np.clip(_local(segment, s[here]), 0.0, 1.0)
        p = segment.evaluate(v)
        points[here] = np.column_stack((p.y, p.z))
        normals[here] = np.column_stack((-p.dz, p.dy)) / np.hypot(p.dy, p.dz)[:, None]
    return points, normals


def _local(segment: Smoothed, s: Floats) -> Floats:
    grid = np.linspace(0.0, 1.0, 257)
    return np.interp(s, segment._arc(grid), grid)


def _exact_local(segment: Smoothed, s: Floats) -> Floats:
    v = np.interp(s, (segment.s_from, segment.s_to), (0.0, 1.0))
    for _ in range(20):
        before, v = v, np.clip(v - (segment._arc(v) - s) / segment._arc(v, 1), 0.0, 1.0)
        if np.array_equal(before, v):
            break
    return v


def _length(base: Line | Arc | Polynomial) -> float:
    if isinstance(base, Line):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(polynomial_arc(base, 0.0, 1.0)(1.0))
