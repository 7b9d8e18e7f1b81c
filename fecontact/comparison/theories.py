"""The theories of the contact that are judged, from the cheapest to the dearest.

A further one is one more entry here, and its words beside it in `theories.toml`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np

from fecontact.case import Case
from fecontact.comparison.measures import Approximation, ellipse, of_rung, of_strips
from fecontact.contact.grid import Rung
from fecontact.errors import InputError
from fecontact.normal.gap_line import GapLine, StripContact, gap_line
from fecontact.normal.hertz import HertzContact, hertz_from_hessian
from fecontact.normal.strips import (
    analyn,
    equivalent_ellipse,
    gap_line_under_load,
    kik_piotrowski,
    kpec,
    strip,
    stripes,
)
from fecontact.normal.touch_hertz import hertz_points
from fecontact.wheel_rail.placement import Placement
from fecontact.wheel_rail.poses import RelativeCurvature


@dataclass(frozen=True, kw_only=True, eq=False)
class Loaded:
    """A placed case under the normal force (N) that the finite elements carry, as theories take it.

    `half_space` is the contact of the true gap on a half-space, None where it is not at hand.
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
    words
        Its name for readers.
    cost
        Its class of cost for a vehicle code.
    source, range
        Where it is from, and what it takes for granted.
    differs
        What is other than in its source, or was not found there; empty where nothing is.
    approximate
        From a loaded placement to the contact; why the theory has none; or None where it says nothing of its own.
    """

    words: str
    cost: str
    source: str
    range: str
    approximate: Approximate
    differs: str = ""


def _hertz(loaded: Loaded, curvature: RelativeCurvature) -> Approximation:
    modulus = loaded.case.contact_modulus_MPa
    hertz = hertz_from_hessian(curvature.hessian, normal_force_N=loaded.normal_force_N, contact_modulus_MPa=modulus)
    notes = _outside_hertz(loaded.placement, hertz)
    return replace(Approximation.of(hertz), status="out of range" if notes else "solved", notes=notes)


def _outside_hertz(placement: Placement, hertz: HertzContact) -> tuple[str, ...]:
    """Why a single ellipse is out of its range: a junction, and touch points whose gap it closes too."""
    first, notes = placement.first, []
    if first.at_junction:
        notes.append("the touch point lies at a curvature junction: the ellipse is that of one side")
    closed = sum(
        hertz.approach_mm * float(touch.normal @ first.normal) > touch.vertical_gap_mm * float(touch.normal[2])
        for touch in placement.touch_points
    )
    if closed > 1:
        notes.append(f"at its approach {closed} touch points are closed, of which it has one")
    return tuple(notes)


def _at_first_touch(loaded: Loaded) -> Approximation:
    return _hertz(loaded, loaded.placement.first.curvatures[-1])


def _at_gauge_side(loaded: Loaded) -> Approximation | None:
    first = loaded.placement.first
    return _hertz(loaded, first.curvatures[0]) if first.at_junction else None


def _at_all_touches(loaded: Loaded) -> Approximation | str | None:
    """The ellipses that share the load; at a curvature junction the curvature is that of the field side."""
    case, placement = loaded.case, loaded.placement
    direction = placement.load_direction(normal=case.load_kind == "normal")
    points = hertz_points(placement, case.load_N, direction=direction, contact_modulus_MPa=case.contact_modulus_MPa)
    if points.shared_approach_mm is None:
        return next(point.problem for point in points.points if point.problem)
    patches = []
    for point in points.points:
        if point.shared is None:
            continue
        touch = placement.touch_points[point.touch_point]
        centre = (touch.x_mm - placement.first.x_mm, placement.arc_mm(touch))
        patches.append(replace(ellipse(point.shared, centre), touch_point=point.touch_point, touch=touch))
    if len(patches) < 2:
        # it is Hertz
        return None
    return Approximation(
        patches=tuple(sorted(patches, key=lambda one: -one.normal_force_N)),
        approach_mm=points.shared_approach_mm * float(placement.first.normal @ direction),
        overlapping=points.overlapping,
        status="out of range" if points.overlapping else "solved",
        notes=("ellipses overlap: they are one patch",) if points.overlapping else (),
    )


def _in_strips(theory: Callable[[GapLine, float], StripContact], *, in_plane: bool = True) -> Approximate:
    """A theory of strips across, from the gap on the line through the first touch point.

    What is `in_plane` has its strips on the tangent plane; they are laid on the surface above them.
    """

    def approximate(loaded: Loaded) -> Approximation | str:
        try:
            line = gap_line_of(loaded)
            found = theory(line, loaded.normal_force_N)
        except InputError as error:
            return str(error)
        if not (found.half_length_mm > 0.0).any():
            return "; ".join(found.notes) or "no strip is in contact"
        return of_strips(_on_surface(found, line) if in_plane else found)

    return approximate


# all theories of strips ask for it, one after the other
@lru_cache(maxsize=1)
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
_APPROXIMATE: Mapping[str, Approximate] = {
    HERTZ: _at_first_touch,
    HERTZ_GAUGE: _at_gauge_side,
    MULTI_HERTZ: _at_all_touches,
    "equivalent_ellipse": _in_strips(equivalent_ellipse),
    "kik_piotrowski": _in_strips(kik_piotrowski),
    "stripes": _in_strips(stripes),
    "analyn": _in_strips(analyn),
    "kpec": _in_strips(kpec),
    "strip": _in_strips(strip, in_plane=False),
    "half_space": _on_half_space,
}
_WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
THEORIES = {name: Theory(approximate=approximate, **_WORDS[name]) for name, approximate in _APPROXIMATE.items()}
"""By name, from the cheapest."""
EITHER_SIDE = (HERTZ_GAUGE, HERTZ)
"""Hertz's ellipse with the curvature of each side of the first touch point."""
OF_ELLIPSES = (MULTI_HERTZ, "equivalent_ellipse")
"""Theories that vehicle codes have where they have Hertz."""
