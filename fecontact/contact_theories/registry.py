"""The theories of the contact that are judged, from the cheapest to the most expensive.

A further one is one more entry here, and its words beside it in `theories.toml`. One of a gap line says what the
contact is at an approach: under a force it is found here, and vehicles have it by its name.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.analyn import analyn_at
from fecontact.contact_theories.approximation import Approximation, ellipse, of_rung, of_strips
from fecontact.contact_theories.equivalent_ellipse import equivalent_ellipse_at
from fecontact.contact_theories.gap_line import AtApproach, GapLine, StripContact, gap_line, under_load
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.kik_piotrowski import kik_piotrowski_at
from fecontact.contact_theories.kpec import kpec_at
from fecontact.contact_theories.stripes import stripes_at
from fecontact.contact_theories.strips import gap_line_under_load, strip
from fecontact.contact_theories.touch_hertz import ends_beneath, hertz_points
from fecontact.errors import InputError
from fecontact.placement.poses import RelativeCurvature, TouchPoint
from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True, eq=False)
class Loaded:
    """Input of the theories: a placed case under the normal force (N) that the finite elements carry.

    `half_space` is the contact of the true gap on a half-space; None if it is not available.
    """

    placement: Placement
    case: Case
    normal_force_N: float
    half_space: Rung | None = None


Approximate: TypeAlias = Callable[[Loaded], Approximation | str | None]


@dataclass(frozen=True, kw_only=True)
class Theory:
    """A theory of the contact.

    Attributes
    ----------
    words, spoken
        Name of the theory in tables, and within a sentence where it is another one there.
    letter
        One or two letters of the theory in the cells of a map; no picture has them for anything else.
    cost
        Class of cost for a vehicle code.
    source, range
        Source of the theory, and its range of validity.
    differs
        Differences from the source, and what was not found there; may be empty.
    approximate
        Function from a loaded placement to the contact, or to the reason for no contact; None if it would be Hertz.
    at_approach
        Contact on a gap line at an approach, which vehicles use too; None for a theory without a gap line.
    """

    words: str
    letter: str
    cost: str
    source: str
    range: str
    approximate: Approximate
    at_approach: AtApproach | None = None
    differs: str = ""
    spoken: str = ""

    @property
    def in_sentence(self) -> str:
        """Name of the theory within a sentence."""
        return self.spoken or self.words


def _hertz(loaded: Loaded, curvature: RelativeCurvature) -> Approximation:
    modulus = loaded.case.contact_modulus_MPa
    hertz = hertz_from_hessian(curvature.hessian, normal_force_N=loaded.normal_force_N, contact_modulus_MPa=modulus)
    notes = _outside_hertz(loaded.placement, hertz)
    return replace(Approximation.of(hertz), status="out of range" if notes else "solved", notes=notes)


def _outside_hertz(placement: Placement, hertz: HertzContact) -> tuple[str, ...]:
    """Why a single ellipse is out of its range: the end of a profile, a junction, or other touch points that close."""
    first = placement.first
    notes = [end] if (end := ends_beneath(placement, first, hertz)) else []
    if first.at_junction:
        notes.append("the touch point lies at a curvature junction: the ellipse has the curvature of one side")
    closed = len(_closed_touches(placement, hertz.approach_mm))
    if closed > 1:
        notes.append(f"at its approach {closed} touch points are closed, of which it has one")
    return tuple(notes)


def _closed_touches(placement: Placement, approach_mm: float) -> list[TouchPoint]:
    """The touch points that an approach along the normal at first touch closes."""
    return [
        touch
        for touch in placement.touch_points
        if approach_mm * float(touch.normal @ placement.first.normal) > touch.vertical_gap_mm * float(touch.normal[2])
    ]


def _beyond_line(placement: Placement, line: GapLine, approach_mm: float) -> tuple[str, ...]:
    """Why a theory of a gap line is out of its range: closed touch points that the line does not reach."""
    low, high = line.surface_mm[0], line.surface_mm[-1]
    beyond = [touch for touch in _closed_touches(placement, approach_mm) if not low <= placement.arc_mm(touch) <= high]
    return tuple(
        f"at its approach the touch point at y = {touch.rail_y_mm:+z.2f} mm on the rail is closed too, which its line"
        " does not reach"
        for touch in beyond
    )


def _at_first_touch(loaded: Loaded) -> Approximation:
    return _hertz(loaded, loaded.placement.first.curvatures[-1])


def _at_gauge_side(loaded: Loaded) -> Approximation | None:
    first = loaded.placement.first
    return _hertz(loaded, first.curvatures[0]) if first.at_junction else None


def _at_all_touches(loaded: Loaded) -> Approximation | str | None:
    """The ellipses that share the load; at a curvature junction with the curvature of the field side."""
    case, placement = loaded.case, loaded.placement
    direction = placement.load_direction(normal=case.load_kind == "normal")
    points = hertz_points(placement, case.load_N, direction=direction, contact_modulus_MPa=case.contact_modulus_MPa)
    if points.shared_approach_mm is None:
        return next(point.problem for point in points.points if point.problem)
    patches = []
    notes = (*["ellipses overlap: they are one patch"] * points.overlapping, *points.shared_notes)
    for point in points.points:
        if point.shared is None:
            continue
        touch = placement.touch_points[point.touch_point]
        centre = (touch.x_mm - placement.first.x_mm, placement.arc_mm(touch))
        patches.append(replace(ellipse(point.shared, centre), touch_point=point.touch_point, touch=touch))
    if len(patches) < 2:
        # a single ellipse is Hertz
        return None
    return Approximation(
        patches=tuple(sorted(patches, key=lambda one: -one.normal_force_N)),
        approach_mm=points.shared_approach_mm * float(placement.first.normal @ direction),
        overlapping=points.overlapping,
        status="out of range" if notes else "solved",
        notes=notes,
    )


def _in_strips(theory: Callable[[GapLine, float], StripContact], *, in_plane: bool = True) -> Approximate:
    """Approximation by a theory of strips, from the gap on the line across through the first touch point.

    If `in_plane`, the theory has its strips on the tangent plane, and they are projected to the surface.
    """

    def approximate(loaded: Loaded) -> Approximation | str:
        try:
            line = gap_line_of(loaded)
            found = theory(line, loaded.normal_force_N)
        except InputError as error:
            return str(error)
        if not (found.half_length_mm > 0.0).any():
            return "; ".join(found.notes) or "no strip is in contact"
        contact = of_strips(_on_surface(found, line) if in_plane else found)
        beyond = _beyond_line(loaded.placement, line, contact.approach_mm)
        if not beyond:
            return contact
        status = "out of range" if contact.status == "solved" else contact.status
        return replace(contact, status=status, notes=(*contact.notes, *beyond))

    return approximate


# cached: all theories of strips need it, one after the other, on a few lines that measured points allow
@lru_cache(maxsize=4)
def gap_line_of(loaded: Loaded) -> GapLine:
    """The gap on the line across; a vertical load lets the wheel slide down a steep flank."""
    placement, modulus = loaded.placement, loaded.case.contact_modulus_MPa
    if loaded.case.load_kind == "normal":
        return gap_line(placement, contact_modulus_MPa=modulus)
    return gap_line_under_load(placement, loaded.normal_force_N, contact_modulus_MPa=modulus)


def _on_surface(contact: StripContact, line: GapLine) -> StripContact:
    return replace(contact, t_mm=np.interp(contact.t_mm, line.t_mm, line.surface_mm))


def _on_half_space(loaded: Loaded) -> Approximation | None:
    return None if loaded.half_space is None else of_rung(loaded.half_space)


HERTZ, HERTZ_GAUGE, MULTI_HERTZ = "hertz", "hertz_gauge", "multi_hertz"
_OF_GAP_LINES: Mapping[str, AtApproach] = {
    "equivalent_ellipse": equivalent_ellipse_at,
    "kik_piotrowski": kik_piotrowski_at,
    "stripes": stripes_at,
    "analyn": analyn_at,
    "kpec": kpec_at,
}
_APPROXIMATE: Mapping[str, Approximate] = {
    HERTZ: _at_first_touch,
    HERTZ_GAUGE: _at_gauge_side,
    MULTI_HERTZ: _at_all_touches,
    **{name: _in_strips(partial(under_load, theory=theory)) for name, theory in _OF_GAP_LINES.items()},
    "strip": _in_strips(strip, in_plane=False),
    "half_space": _on_half_space,
}
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
THEORIES = {
    name: Theory(approximate=approximate, at_approach=_OF_GAP_LINES.get(name), **_WORDS[name])
    for name, approximate in _APPROXIMATE.items()
}
"""By name, from the cheapest."""
_COARSE_FACTOR = 1.15


def of_many(name: str) -> Approximate:
    """A theory for very many contacts: on a gap line approaches are tried in steps of 15 %, not 2 %.

    Of two solutions nearer to each other than that none is seen; the contact that is found is the same to 1e-9.
    """
    theory = _OF_GAP_LINES.get(name)
    if theory is None:
        return THEORIES[name].approximate
    return _in_strips(partial(under_load, theory=theory, factor=_COARSE_FACTOR))


EITHER_SIDE = (HERTZ_GAUGE, HERTZ)
"""Hertz's ellipse with the curvature of each side of the first touch point."""
OF_ELLIPSES = (MULTI_HERTZ, "equivalent_ellipse")
"""Theories that vehicle codes use as they use Hertz."""
