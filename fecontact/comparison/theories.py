"""The theories of the contact that are judged, from the cheapest to the dearest: a further one is one more entry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from fecontact.case import Case
from fecontact.comparison.approximation import Approximation, ellipse
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import RelativeCurvature
from fecontact.theory.hertz import hertz_from_hessian
from fecontact.theory.touch_hertz import hertz_points

Approximate: TypeAlias = Callable[[Placement, Case, float], Approximation | str | None]


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
    approximate
        From a placement, its case and the normal force (N) to the contact; why the theory has none; or None where it
        says nothing of its own.
    """

    words: str
    cost: str
    source: str
    range: str
    approximate: Approximate


def _hertz(curvature: RelativeCurvature, case: Case, normal_force_N: float) -> Approximation:
    return Approximation.of(
        hertz_from_hessian(
            curvature.hessian, normal_force_N=normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa
        )
    )


def _at_first_touch(placement: Placement, case: Case, normal_force_N: float) -> Approximation:
    return _hertz(placement.first.curvatures[-1], case, normal_force_N)


def _at_gauge_side(placement: Placement, case: Case, normal_force_N: float) -> Approximation | None:
    first = placement.first
    return _hertz(first.curvatures[0], case, normal_force_N) if first.at_junction else None


def _at_all_touches(placement: Placement, case: Case, _: float) -> Approximation | str | None:
    """The ellipses that share the load; at a curvature junction the curvature is that of the field side."""
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
    )


HERTZ, HERTZ_GAUGE, MULTI_HERTZ = "hertz", "hertz_gauge", "multi_hertz"

THEORIES: Mapping[str, Theory] = {
    HERTZ: Theory(
        words="Hertz",
        cost="closed form",
        source="Hertz (1882); Johnson (1985), chapter 4",
        range="one touch point, constant curvature in the patch, half-spaces; at a junction its field side",
        approximate=_at_first_touch,
    ),
    HERTZ_GAUGE: Theory(
        words="Hertz, with the curvature of the gauge side",
        cost="closed form",
        source="Hertz (1882); Johnson (1985), chapter 4",
        range="where the touch point lies at a curvature junction",
        approximate=_at_gauge_side,
    ),
    MULTI_HERTZ: Theory(
        words="Hertz at all touch points, as springs",
        cost="closed form a touch point",
        source="springs of Otero Yugat, Part I, eq. 6, under one approach",
        range="patches small against the distance between them; they know nothing of each other",
        approximate=_at_all_touches,
    ),
}
"""By name, from the cheapest."""
EITHER_SIDE = (HERTZ_GAUGE, HERTZ)
"""Hertz's ellipse with the curvature of each side of the first touch point."""
