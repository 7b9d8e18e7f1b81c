"""Normal forces of an overlap by the theories of `theory/` that have a force at an approach, under their names there.

A theory takes an `Overlap` and the contact modulus, and gives the patches that carry, each in strips along the rail:
the force of a strip over its width, and its half length. Nothing else is asked of it, so that creep forces, equilibrium
and stability are the same for all. What is here says only how each of them sees an overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.theory.analyn import analyn_at
from fecontact.theory.equivalent_ellipse import equivalent_ellipse_at
from fecontact.theory.gap_line import GapLine
from fecontact.theory.hertz import HertzContact, hertz_ellipse
from fecontact.theory.kik_piotrowski import kik_piotrowski_at
from fecontact.theory.kpec import kpec_at
from fecontact.theory.overlap import overlap_strips
from fecontact.theory.strip_contact import StripContact
from fecontact.theory.strip_method import Line, Load, Search, Strips, factor_of_ellipse, solve_strips
from fecontact.theory.stripes import stripes_at
from fecontact.vehicle.half_space import pressed_strips
from fecontact.vehicle.surfaces import Overlap

Floats = NDArray[np.float64]

# Half the chord over which the curvature of a touch point is taken: at the point itself it jumps from arc to arc.
_CHORD_MM = 1.5
_LEAST_CURVATURE_PER_MM = 1e-4
_ELLIPSE_STRIPS = 20
# Points beside a stretch that overlaps, where a gap line goes on; its step, and the fewest places that make one.
_BESIDE, _LATTICE_MM, _FEWEST_POINTS = 3, 0.05, 9
# Of the strip method: within 0.03 mm and 0.2 % of the half-space on one patch, 0.2 mm and 1.2 % where two carry.
_STRIPS, _SWEEPS = 60, 14
_STARTING, _LEAST_SQUARE_MM2 = 20, 1e-4


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
    problem
        Why its force is not to be trusted; empty where it is.
    """

    s_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats
    problem: str = ""


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


def overlap(found: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """Strips that carry their own overlap, with the end ones as wide as it reaches; see `theory.overlap`."""
    patches = []
    for first, last in _regions(found.depth_mm):
        inside = slice(first, last + 1)
        half_length, force = overlap_strips(
            found.depth_mm[inside], found.curvature_along_per_mm[inside], contact_modulus_MPa
        )
        patches.append(
            Pressed(
                s_mm=found.s_mm[inside],
                width_mm=_widths(found, first, last),
                half_length_mm=half_length,
                force_N_per_mm=force,
            )
        )
    return tuple(patches)


def strip(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
    """The strip method for all that overlaps at once, approached straight down, each strip along its own normal.

    Always the same number of sweeps from a start that follows the overlap: forces have no steps.
    """
    closing = np.cos(overlap.angle_rad)
    down = overlap.depth_mm / closing
    runs = _regions(down)
    if not runs:
        return ()
    deepest = int(np.argmax(down))
    # a circle drops by x^2 / (2 r) straight down, whatever the plane
    along = 0.5 / float(overlap.radius_mm[deepest])
    contact = solve_strips(
        Line(t=overlap.s_mm, f=down[deepest] - down, A=along, E=contact_modulus_MPa, closing=closing),
        Load(approach=float(down[deepest])),
        Search(strips=_STRIPS, tolerance=0.0, most_sweeps=_SWEEPS),
        start=_start_of_strips(overlap.s_mm, down, runs, along, contact_modulus_MPa),
    )
    force = 0.5 * np.pi * contact.c * contact.q
    return tuple(
        Pressed(
            s_mm=contact.t[first : last + 1],
            width_mm=contact.h[first : last + 1],
            half_length_mm=np.sqrt(contact.q[first : last + 1]),
            force_N_per_mm=force[first : last + 1],
        )
        for first, last in _regions(force)
    )


def _start_of_strips(
    s_mm: Floats, down_mm: Floats, runs: list[tuple[int, int]], along_per_mm: float, modulus_MPa: float
) -> Strips:
    """Springs over exactly what overlaps, with the pressure of Hertz's ellipse of as long and wide an overlap."""
    t, h, q, c = (np.empty((len(runs), _STARTING)) for _ in range(4))
    for k, (first, last) in enumerate(runs):
        low, high = (_edge(s_mm, down_mm, *two) for two in ((first, first - 1), (last, last + 1)))
        t[k] = low + (high - low) / _STARTING * (np.arange(_STARTING) + 0.5)
        h[k] = (high - low) / _STARTING
        q[k] = np.maximum(0.5 * np.interp(t[k], s_mm, down_mm) / along_per_mm, _LEAST_SQUARE_MM2)
        c[k] = modulus_MPa * along_per_mm * factor_of_ellipse(2.0 * np.sqrt(q[k].max()) / (high - low))
    return Strips(
        t=t.ravel(),
        h=h.ravel(),
        q=q.ravel(),
        c=c.ravel(),
        approach=float(down_mm.max()),
        force=0.0,
        sweeps=0,
        change=np.inf,
        converged=False,
    )


def half_space(overlap: Overlap, contact_modulus_MPa: float, *, fine: bool = False) -> tuple[Pressed, ...]:
    """The half-space; separate patches feel each other."""
    found = pressed_strips(overlap, contact_modulus_MPa, fine=fine)
    if found is None:
        return ()
    s, half_length, force, problem = found
    width = np.full(s.size, s[1] - s[0])
    return tuple(
        Pressed(
            s_mm=s[first : last + 1],
            width_mm=width[first : last + 1],
            half_length_mm=half_length[first : last + 1],
            force_N_per_mm=force[first : last + 1],
            problem=problem,
        )
        for first, last in _regions(force)
    )


def on_gap_lines(at_approach: Callable[[GapLine, float], StripContact]) -> NormalTheory:
    """A theory of a gap line at an approach, taken on each stretch that overlaps by itself."""

    def normal(overlap: Overlap, contact_modulus_MPa: float) -> tuple[Pressed, ...]:
        found = []
        for first, last in _regions(overlap.depth_mm):
            low, high = max(0, first - _BESIDE), min(overlap.s_mm.size - 1, last + _BESIDE)
            # on a lattice of the rail, where a place enters without pressure
            t = _LATTICE_MM * np.arange(
                np.ceil(overlap.s_mm[low] / _LATTICE_MM), np.floor(overlap.s_mm[high] / _LATTICE_MM) + 1.0
            )
            depth = np.interp(t, overlap.s_mm, overlap.depth_mm)
            deepest = int(np.argmax(depth))
            if t.size < _FEWEST_POINTS or depth[deepest] <= 0.0:
                continue
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
    "overlap": overlap,
    "equivalent_ellipse": on_gap_lines(equivalent_ellipse_at),
    "kik_piotrowski": on_gap_lines(kik_piotrowski_at),
    "stripes": on_gap_lines(stripes_at),
    "analyn": on_gap_lines(analyn_at),
    "kpec": on_gap_lines(kpec_at),
    "strip": strip,
    "half_space": half_space,
}
"""Theories by the names of `fecontact theories`, and overlapping strips, from the simplest on."""
DEFAULT_THEORY = "overlap"


def normal_theory(name: str, *, fine: bool = False) -> NormalTheory:
    """A theory by its name; `fine` where slopes over small motions are asked for, which only the half-space minds.

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
    return partial(half_space, fine=True) if fine and name == "half_space" else NORMAL_THEORIES[name]


def _regions(depth: Floats) -> list[tuple[int, int]]:
    """First and last index of each unbroken run of points that overlap."""
    inside = np.concatenate(([False], depth > 0.0, [False]))
    edges = np.flatnonzero(np.diff(inside.astype(int)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]


def _edge(s_mm: Floats, depth_mm: Floats, inner: int, outer: int) -> float:
    """Where an overlap ends between a point inside and its neighbour outside; the former at the end of all."""
    if not 0 <= outer < s_mm.size:
        return float(s_mm[inner])
    part = depth_mm[inner] / (depth_mm[inner] - depth_mm[outer])
    return float(s_mm[inner] + part * (s_mm[outer] - s_mm[inner]))


def _widths(overlap: Overlap, first: int, last: int) -> Floats:
    """Width of each point of a run, the outer ones as far as the overlap reaches: the force has no kink there."""
    s, depth = overlap.s_mm, overlap.depth_mm
    half = 0.5 * np.diff(s[first : last + 1])
    before = 0.5 * (s[first] - _edge(s, depth, first, first - 1))
    after = 0.5 * (_edge(s, depth, last, last + 1) - s[last])
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
