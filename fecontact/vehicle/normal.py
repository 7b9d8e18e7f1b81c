"""Normal forces of an overlap by any theory that has a force over an approach: one plain function each.

A theory takes an `Overlap` and the contact modulus, and gives the patches that carry, each in strips along the rail:
the force of a strip over its width, and its half length. Nothing else is asked of it, so that creep forces, equilibrium
and stability are the same for all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.theory.gap_line import GapLine
from fecontact.theory.hertz import HertzContact, hertz_ellipse
from fecontact.theory.kik_piotrowski import kik_piotrowski_at
from fecontact.theory.strip_contact import StripContact
from fecontact.theory.stripes import stripes_at
from fecontact.vehicle.half_space import pressed_strips
from fecontact.vehicle.surfaces import Overlap

Floats = NDArray[np.float64]

# C of strips that know nothing of each other.
_STRIPS_FACTOR = 1.2
# Half the chord over which the curvature of a touch point is taken: at the point itself it jumps from arc to arc.
_CHORD_MM = 1.5
_LEAST_CURVATURE_PER_MM = 1e-4
_ELLIPSE_STRIPS = 20
# Points beside a stretch that overlaps, where a gap line goes on, and the fewest that make one.
_BESIDE, _FEWEST_POINTS = 3, 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Pressed:
    """A patch in strips along the rail.

    Attributes
    ----------
    s_mm, width_mm (n,)
        Place and width across.
    half_length_mm (n,)
        Along the rail.
    force_N_per_mm (n,)
        Along the rail's normal, over the width.
    """

    s_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats


NormalTheory: TypeAlias = Callable[[Overlap, float], tuple[Pressed, ...]]


def hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Hertz's spring at the deepest point alone, with the curvature of its surroundings."""
    found = _minima(overlap)
    deepest = max(found, key=lambda place: float(overlap.depth_mm[place]), default=None)
    return () if deepest is None else (_ellipse(overlap, deepest, contact_modulus_MPa),)


def multi_hertz(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Hertz's springs side by side, one at each place where the overlap is deepest (Otero Yugat, Part I, eq. 6).

    Range of validity: the springs know nothing of each other. Where such a place comes to be or ends while it is under
    load, the force jumps.
    """
    return tuple(_ellipse(overlap, place, contact_modulus_MPa) for place in _minima(overlap))


def overlap_strips(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Each strip carries its own overlap: force over width (pi/2) C E* depth, half length sqrt(2 depth / curvature).

    With C = 4/pi load and lengths are Hertz's of a circle, at half of his approach; C = 1.2 is the usual fit over the
    patches of wheels on rails. Continuous in all positions, whatever touches.

    Notes
    -----
    Source: the idea of a virtual penetration (Kik and Piotrowski 1996) with no reduction of it and no influence of one
    strip on another. Range of validity: approaches are half of the true ones, areas up to twice on slender patches; the
    centre of pressure is within 0.5 mm of the half-space's on S1002 and 60E1, 1.2 mm on the flange root.
    """
    found = []
    for first, last in _regions(overlap.depth_mm):
        inside = slice(first, last + 1)
        depth = overlap.depth_mm[inside]
        found.append(
            Pressed(
                s_mm=overlap.s_mm[inside],
                width_mm=_widths(overlap, first, last),
                half_length_mm=np.sqrt(2.0 * depth / overlap.curvature_along_per_mm[inside]),
                force_N_per_mm=0.5 * np.pi * _STRIPS_FACTOR * contact_modulus_MPa * depth,
            )
        )
    return tuple(found)


def half_space(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """The half-space; separate patches feel each other."""
    found = pressed_strips(overlap, contact_modulus_MPa)
    if found is None:
        return ()
    s, half_length, force = found
    width = np.full(s.size, s[1] - s[0])
    return tuple(
        Pressed(
            s_mm=s[first : last + 1],
            width_mm=width[first : last + 1],
            half_length_mm=half_length[first : last + 1],
            force_N_per_mm=force[first : last + 1],
        )
        for first, last in _regions(force)
    )


def on_gap_lines(at_approach: Callable[[GapLine, float], StripContact]) -> NormalTheory:
    """A theory of a gap line at an approach, taken on each stretch that overlaps by itself."""

    def normal(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
        found = []
        for first, last in _regions(overlap.depth_mm):
            low, high = max(0, first - _BESIDE), min(overlap.s_mm.size - 1, last + _BESIDE)
            if last - first < _FEWEST_POINTS:
                continue
            t = np.linspace(overlap.s_mm[low], overlap.s_mm[high], high - low + 1)
            depth = np.interp(t, overlap.s_mm, overlap.depth_mm)
            deepest = int(np.argmax(depth))
            along = float(np.interp(t[deepest], overlap.s_mm, overlap.curvature_along_per_mm))
            line = GapLine(
                t_mm=t, f_mm=depth[deepest] - depth, A_per_mm=0.5 * along, contact_modulus_MPa=contact_modulus_MPa
            )
            contact = at_approach(line, float(depth[deepest]))
            force = 0.5 * np.pi * contact.half_length_mm * contact.centre_pressure_MPa
            found += [
                Pressed(
                    s_mm=contact.t_mm[k : n + 1],
                    width_mm=contact.width_mm[k : n + 1],
                    half_length_mm=contact.half_length_mm[k : n + 1],
                    force_N_per_mm=force[k : n + 1],
                )
                for k, n in _regions(force)
            ]
        return tuple(found)

    return normal


NORMAL_THEORIES: Mapping[str, NormalTheory] = {
    "hertz": hertz,
    "multi_hertz": multi_hertz,
    "overlap": overlap_strips,
    "kik_piotrowski": on_gap_lines(kik_piotrowski_at),
    "stripes": on_gap_lines(stripes_at),
    "half_space": half_space,
}
"""Theories by name, from the simplest on."""
DEFAULT_THEORY = "overlap"


def normal_theory(name: str) -> NormalTheory:
    """A theory by its name.

    Raises
    ------
    InputError
        If there is none of that name, or it has no force over an approach.
    """
    if name not in NORMAL_THEORIES:
        raise InputError(
            f"theory is {name!r}; allowed: {', '.join(NORMAL_THEORIES)}; a vehicle needs a force over the approach,"
            " which other theories do not have"
        )
    return NORMAL_THEORIES[name]


def _regions(depth: Floats) -> list[tuple[int, int]]:
    """First and last index of each unbroken run of points that overlap."""
    inside = np.concatenate(([False], depth > 0.0, [False]))
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]


def _widths(overlap: Overlap, first: int, last: int) -> Floats:
    """Width of each point of a run, the outer ones as far as the overlap reaches: the force has no kink there."""
    s, depth = overlap.s_mm, overlap.depth_mm
    half = 0.5 * np.diff(s[first : last + 1])
    before, after = 0.0, 0.0
    if first > 0:
        before = 0.5 * float((s[first] - s[first - 1]) * depth[first] / (depth[first] - depth[first - 1]))
    if last < s.size - 1:
        after = 0.5 * float((s[last + 1] - s[last]) * depth[last] / (depth[last] - depth[last + 1]))
    return np.asarray(np.append(half, after) + np.insert(half, 0, before))


def _minima(overlap: Overlap) -> list[int]:
    """Points that lie deeper than both their neighbours, and in the rail."""
    depth = overlap.depth_mm
    inner = depth[1:-1]
    return [int(k) for k in np.flatnonzero((inner > depth[:-2]) & (inner >= depth[2:]) & (inner > 0.0)) + 1]


def _ellipse(overlap: Overlap, place: int, contact_modulus_MPa: float) -> Pressed:
    """Hertz's spring and ellipse about a point that lies deepest."""
    s, depth = overlap.s_mm, overlap.depth_mm
    near = slice(place - 1, place + 2)
    # the parabola through the point and its neighbours
    bend, slope, _ = np.polyfit(s[near] - s[place], depth[near], 2)
    off = -0.5 * slope / bend
    centre, top = float(s[place] + off), float(depth[place] - 0.25 * slope**2 / bend)
    # between the points as far as the depth is not the parabola, which straight lines would not follow
    beside = np.interp([centre - _CHORD_MM, centre + _CHORD_MM], s, depth - top - bend * (s - centre) ** 2)
    across = max(float(-2.0 * bend - beside.sum() / _CHORD_MM**2), _LEAST_CURVATURE_PER_MM)
    along = float(np.interp(centre, s, overlap.curvature_along_per_mm))
    unit = _unit_ellipse(round(np.log(across / along), 12))
    # lengths go with the curvature, the spring with its inverse root
    stiffness = contact_modulus_MPa * unit.stiffness_N_per_mm15 / np.sqrt(along)
    force = stiffness * top**1.5
    size = (force * along**2 / contact_modulus_MPa) ** (1.0 / 3.0) / along
    a, b = unit.a_mm * size, unit.b_mm * size
    places = (np.arange(_ELLIPSE_STRIPS) + 0.5) * (2.0 / _ELLIPSE_STRIPS) - 1.0
    inside = 1.0 - places**2
    share = inside / inside.sum()
    width = 2.0 * b / _ELLIPSE_STRIPS
    return Pressed(
        s_mm=centre + b * places,
        width_mm=np.full(_ELLIPSE_STRIPS, width),
        half_length_mm=a * np.sqrt(inside),
        force_N_per_mm=force * share / width,
    )


@lru_cache(maxsize=4096)
def _unit_ellipse(log_ratio: float) -> HertzContact:
    """Hertz's ellipse of curvatures 1 along and exp(log_ratio) across, modulus 1 and force 1."""
    return hertz_ellipse(0.5, 0.5 * float(np.exp(log_ratio)), normal_force_N=1.0, contact_modulus_MPa=1.0)
