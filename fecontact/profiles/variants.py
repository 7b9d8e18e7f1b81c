"""Profile variants: smoothed profiles that are consistent with the measured points."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fecontact.arrays import Floats
from fecontact.errors import InputError
from fecontact.profiles.curve import Profile
from fecontact.profiles.segments import (
    Arc,
    Held,
    Line,
    Measured,
    Polynomial,
    Segment,
    SmoothedSegment,
    integrate_polynomial_length,
)
from fecontact.profiles.smoothing import (
    PRACTICE_MM,
    SEED,
    draw_noise,
    fit_deviation,
    frame_on_chords,
    select_running_part,
    slide_along_nominal,
    smooth_frame,
)
from fecontact.profiles.smoothing_splines import smoothed_by


def make_segments(measured: Measured) -> tuple[Segment, ...]:
    """The pieces of a smoothed line."""
    return pieces_of(measured.held, measured.filter_mm)


def pieces_of(held: Held, filter_mm: float) -> tuple[Segment, ...]:
    """The pieces of a line through held points: one for each segment of the nominal profile, or a single one."""
    field = smoothed_by(held.s_mm, held.values, filter_mm, held.relative_filter)
    first, last = float(held.s_mm[0]), float(held.s_mm[-1])
    if not held.reference:
        return (SmoothedSegment(field=field, s_from=first, s_to=last),)
    made: list[Segment] = []
    start = 0.0
    for base in held.reference:
        assert isinstance(base, Line | Arc | Polynomial)
        whole = SmoothedSegment(
            field=field, s_from=start, s_to=start + _length(base), base=base, registration=held.registration
        )
        low, high = max(first, whole.s_from), min(last, whole.s_to)
        start = whole.s_to
        if high - low > 1e-6:
            v_from, v_to = (float(v) for v in whole.local_parameters(np.array([low, high])))
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
        assert isinstance(segment, SmoothedSegment)
        field = segment.field
        segments.append(replace(segment, field=type(field)(part * field.c, field.x)))
    return replace(profile, segments=tuple(segments), name=f"{profile.name} times {part:g}", measured=None)


@dataclass(frozen=True, kw_only=True)
class ProfileVariant:
    """Another line that the points of a smoothed profile allow.

    Attributes
    ----------
    profile
        The line itself, as good a profile as any.
    filter_mm, nominal
        Over which wave length it was smoothed, and as the deviation from which profile of the library, if any.
    draw
        Number of the draw of other noise, -1 where it goes through the measured points.
    """

    profile: Profile
    filter_mm: float
    nominal: str
    draw: int = -1


# Draws of other noise among the lines that the points allow.
_VARIANT_DRAWS = 4
# How much worse than the own line, by Akaike's criterion, a line may be that points allow (Burnham and Anderson 2002,
# section 2.6: beyond 10 it has essentially no support).
_NO_SUPPORT = 10.0


def other_lines(profile: Profile) -> tuple[ProfileVariant, ...]:
    """Lines that the points of a smoothed profile allow beside its own; none for exact lines.

    Smoothed over 4, 5.7 and 8 mm, or where the deviation from a profile of the library is smoothed over longer waves,
    over 0.71 and 1.41 times its own length, and without that profile unless the points speak against it; and from
    points with other draws of equally large noise. The draws are reproducible.
    """
    return _make_variants(_ByContent(profile=profile)) if profile.measured is not None else ()


@dataclass(frozen=True, eq=False)
class _ByContent:
    """A smoothed profile, equal to another one with equal points, filter and nominal."""

    profile: Profile

    def _content(self) -> tuple[object, ...]:
        measured = self.profile.measured
        assert measured is not None
        made = (self.profile.kind, self.profile.name, measured.filter_mm, measured.nominal, measured.noise_mm)
        return (*made, measured.points.tobytes(), measured.s_mm.tobytes())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByContent) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())


@lru_cache(maxsize=16)
def _make_variants(one: _ByContent) -> tuple[ProfileVariant, ...]:
    profile, measured = one.profile, one.profile.measured
    assert measured is not None
    own, (low, high) = measured.filter_mm, PRACTICE_MM
    usual = low <= own <= high and measured.held.relative_filter is None
    lengths = (low, math.sqrt(low * high), high) if usual else (math.sqrt(0.5) * own, math.sqrt(2.0) * own)
    changed = [(replace(measured, filter_mm=length), -1) for length in lengths if abs(length - own) > 0.05 * own]
    if measured.nominal:
        by_itself, score = smooth_frame(frame_on_chords(measured.points), filter_mm=None, noise_mm=None)
        if _is_supported(score, measured):
            changed.append((by_itself, -1))
    changed += [(_redraw_noise(profile, measured, k), k) for k in range(_VARIANT_DRAWS)]
    found = ((_build_variant(profile, line), line, draw) for line, draw in changed)
    return tuple(
        ProfileVariant(profile=made, filter_mm=line.filter_mm, nominal=line.nominal, draw=draw)
        for made, line, draw in found
        if made is not None
    )


def _is_supported(score: float, measured: Measured) -> bool:
    """Whether another line with this score is nearly as good as the own one: without a nominal its corners are blunt.

    Waves that neighbouring points have together count as the fewer points that they are.
    """
    *_, own = fit_deviation(measured.held, measured.filter_mm, None)
    by_itself = min(1.0, (measured.independent_noise_mm / measured.noise_mm) ** 2) * np.count_nonzero(
        select_running_part(measured.held)
    )
    return bool(by_itself * math.log(score / own) <= _NO_SUPPORT)


def _build_variant(profile: Profile, changed: Measured) -> Profile | None:
    """The line of differently smoothed points; None if they no longer lie over their nominal profile."""
    try:
        made = replace(changed, held=slide_along_nominal(changed.held, changed.filter_mm))
    except np.linalg.LinAlgError:
        return None
    return replace(profile, segments=make_segments(made), measured=made)


def _redraw_noise(profile: Profile, measured: Measured, number: int) -> Measured:
    """Points of a smoothed line with another draw of equally large noise."""
    points, normals = _evaluate_normals(profile, measured.s_mm)
    seed = [SEED, number, 0 if profile.kind == "rail" else 1]
    noise = draw_noise(measured, seed, 1)
    return replace(measured, held=_replace_points(points + noise * normals, measured.held))


def _replace_points(points: Floats, held: Held) -> Held:
    """Other points (n, 2) at the same places, held against the same line."""
    return replace(held, points=points, values=held.values + (points - held.points))


def _evaluate_normals(profile: Profile, s: Floats) -> tuple[Floats, Floats]:
    """Points and normals (n, 2) of a smoothed line at places s of what it was smoothed over."""
    points, normals = np.empty((s.size, 2)), np.empty((s.size, 2))
    for segment in profile.segments:
        assert isinstance(segment, SmoothedSegment)
        here = (s >= segment.s_from - 1e-9) & (s <= segment.s_to + 1e-9)
        v = np.clip(_invert_arc_length(segment, s[here]), 0.0, 1.0)
        p = segment.evaluate(v)
        points[here] = np.column_stack((p.y, p.z))
        normals[here] = np.column_stack((-p.dz, p.dy)) / np.hypot(p.dy, p.dz)[:, None]
    return points, normals


def _invert_arc_length(segment: SmoothedSegment, s: Floats) -> Floats:
    grid = np.linspace(0.0, 1.0, 257)
    return np.interp(s, segment._arc_length(grid), grid)


def _length(base: Line | Arc | Polynomial) -> float:
    if isinstance(base, Line):
        return math.hypot(base.end[0] - base.start[0], base.end[1] - base.start[1])
    if isinstance(base, Arc):
        return base.radius * abs(base.angle_to - base.angle_from)
    return float(integrate_polynomial_length(base, 0.0, 1.0)(1.0))
