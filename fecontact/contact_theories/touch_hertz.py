"""Hertz at every touch point of the rigid bodies: each with the whole load, or sharing it (`multi_hertz`)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian, multi_hertz_approach_mm
from fecontact.errors import InputError
from fecontact.placement.poses import RelativeCurvature, TouchPoint
from fecontact.placement.wheel_on_rail import Placement

Side = Literal["both", "gauge", "field"]


@dataclass(frozen=True, kw_only=True)
class TouchHertz:
    """Hertz at a touch point, at a junction with the curvature of one side.

    Attributes
    ----------
    touch_point
        Number of the touch point; 0 is first touch.
    whole
        Ellipse if this point carried the whole load; None if the surfaces conform, see `problem`.
    shared
        Ellipse under the point's share of the load; None if the share is zero, and on a junction's gauge side.
    whole_note, shared_note
        Why the ellipse does not fit on the profiles; empty if it fits, and without an ellipse.
    """

    touch_point: int
    side: Side
    whole: HertzContact | None
    shared: HertzContact | None
    problem: str | None = None
    whole_note: str = ""
    shared_note: str = ""


@dataclass(frozen=True, kw_only=True)
class HertzPoints:
    """Hertz at all touch points of a placement.

    Attributes
    ----------
    shared_approach_mm
        Rigid approach at which Hertz's springs together carry the load; None if any point has no ellipse.
    overlapping
        Whether two of the ellipses that share the load overlap: then they are one patch, and not a sum of ellipses.
    """

    points: tuple[TouchHertz, ...]
    shared_approach_mm: float | None
    overlapping: bool

    @property
    def shared_notes(self) -> tuple[str, ...]:
        """Why ellipses that share the load do not fit on the profiles."""
        return tuple(filter(None, (point.shared_note for point in self.points)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Why ellipses do not fit on the profiles, each reason once."""
        whole = filter(None, (point.whole_note for point in self.points))
        return tuple(dict.fromkeys([*whole, *self.shared_notes]))

    @property
    def shared_p_max_MPa(self) -> float | None:
        """Largest peak pressure of the ellipses that share the load."""
        return max((point.shared.p0_MPa for point in self.points if point.shared is not None), default=None)


def sides(touch: TouchPoint) -> tuple[Side, ...]:
    """Sides of a touch point, in the order of its curvatures."""
    return ("gauge", "field") if touch.at_junction else ("both",)


def ends_beneath(placement: Placement, touch: TouchPoint, ellipse: HertzContact) -> str:
    """Why an ellipse at a touch point does not fit on the profiles; empty if it fits.

    The ellipse must end before the running surface of the rail, and before the running surface of the wheel. Otherwise
    a part of its pressure acts on nothing.
    """
    reach = 0.5 * ellipse.extent_y_mm
    for profile, u in ((placement.rail.profile, touch.rail_u), (placement.wheel.profile, touch.wheel_u)):
        place = float(profile.arc_length(u))
        room = min(place, profile.length_mm - place)
        if reach > room:
            return (
                f"Hertz's ellipse reaches {reach:.1f} mm across, but {profile.kind} {profile.name} ends {room:.1f} mm"
                " beside the touch point: the ellipse does not exist there; reduce the load, change the lateral shift,"
                " or give a longer profile line"
            )
    return ""


def hertz_points(placement: Placement, load_N: float, *, direction: Floats, contact_modulus_MPa: float) -> HertzPoints:
    """Hertz at all touch points under a load along a unit vector (3,).

    Range of validity: the points act independently, as springs side by side; this holds if their patches are small
    against the distance between them.
    """
    touches = placement.touch_points
    closing = np.array([float(touch.normal @ direction) for touch in touches])
    whole = [
        [_ellipse(curvature, load_N / c, contact_modulus_MPa) for curvature in touch.curvatures]
        for touch, c in zip(touches, closing, strict=True)
    ]
    shared: list[HertzContact | None] = [None] * len(touches)
    approach: float | None = None
    last = [ellipses[-1] for ellipses in whole]
    springs = [ellipse for ellipse in last if isinstance(ellipse, HertzContact)]
    if len(springs) == len(touches):
        gap = np.array([touch.vertical_gap_mm * touch.normal[2] for touch in touches])
        stiffness = np.array([spring.stiffness_N_per_mm15 for spring in springs])
        approach = multi_hertz_approach_mm(stiffness, load_N=load_N, gap_mm=gap, closing=closing)
        force = stiffness * np.maximum(approach * closing - gap, 0.0) ** 1.5
        shared = [
            hertz_from_hessian(
                touch.curvature.hessian, normal_force_N=float(f), contact_modulus_MPa=contact_modulus_MPa
            )
            if f > 0.0
            else None
            for touch, f in zip(touches, force, strict=True)
        ]
    return HertzPoints(
        points=tuple(
            TouchHertz(
                touch_point=number,
                side=side,
                whole=ellipse if isinstance(ellipse, HertzContact) else None,
                shared=own if side != "gauge" else None,
                problem=None if isinstance(ellipse, HertzContact) else ellipse,
                whole_note=ends_beneath(placement, touch, ellipse) if isinstance(ellipse, HertzContact) else "",
                shared_note=ends_beneath(placement, touch, own) if side != "gauge" and own is not None else "",
            )
            for number, (touch, ellipses, own) in enumerate(zip(touches, whole, shared, strict=True))
            for side, ellipse in zip(sides(touch), ellipses, strict=True)
        ),
        shared_approach_mm=approach,
        overlapping=_overlap(placement, shared),
    )


def _ellipse(curvature: RelativeCurvature, normal_force_N: float, modulus: float) -> HertzContact | str:
    """The ellipse, or why there is no ellipse."""
    try:
        return hertz_from_hessian(curvature.hessian, normal_force_N=normal_force_N, contact_modulus_MPa=modulus)
    except InputError as error:
        return str(error)


def _overlap(placement: Placement, shared: list[HertzContact | None]) -> bool:
    arcs = (float(placement.rail.profile.arc_length(touch.rail_u)) for touch in placement.touch_points)
    reach = sorted((s, 0.5 * e.extent_y_mm) for s, e in zip(arcs, shared, strict=True) if e is not None)
    return any(s + a > t - b for (s, a), (t, b) in pairwise(reach))
