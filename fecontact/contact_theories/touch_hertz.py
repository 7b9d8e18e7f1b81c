"""Hertz at every contact point of the rigid bodies, alone or with a shared load.

The load is shared by Hertz's springs at all contact points (`multi_hertz`).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian, multi_hertz_approach_mm
from fecontact.errors import InputError
from fecontact.placement.poses import ContactPoint, RelativeCurvature
from fecontact.placement.wheel_on_rail import Placement

Side = Literal["both", "gauge", "field"]


@dataclass(frozen=True, kw_only=True)
class ContactPointHertz:
    """Hertz at a contact point, at a junction with the curvature of a single side.

    Attributes
    ----------
    contact_point_number
        Number of the contact point; 0 is first touch.
    side
        Side of the junction: `both` without a junction.
    whole
        Ellipse under the whole load; None if the surfaces conform, see `problem`.
    shared
        Ellipse under the load share of the point; None if the share is zero, and on the gauge side of a junction.
    problem
        Reason why there is no ellipse.
    whole_note, shared_note
        Reason why the ellipse does not fit on the profiles; empty if it fits, and without an ellipse.
    """

    contact_point_number: int
    side: Side
    whole: HertzContact | None
    shared: HertzContact | None
    problem: str | None = None
    whole_note: str = ""
    shared_note: str = ""


@dataclass(frozen=True, kw_only=True)
class HertzAtContactPoints:
    """Hertz at all contact points of a placement.

    Attributes
    ----------
    points
        Hertz at each contact point, on each side of a junction.
    shared_approach_mm
        Rigid approach at which Hertz's springs together have the load; None if any point has no ellipse.
    overlapping
        Whether two of the ellipses that share the load overlap. They are then a single patch, and not a sum of
        ellipses.
    """

    points: tuple[ContactPointHertz, ...]
    shared_approach_mm: float | None
    overlapping: bool

    @property
    def shared_notes(self) -> tuple[str, ...]:
        """Reasons why ellipses with a shared load do not fit on the profiles."""
        return tuple(filter(None, (point.shared_note for point in self.points)))

    @property
    def notes(self) -> tuple[str, ...]:
        """Reasons why ellipses do not fit on the profiles, without repetition."""
        whole_load_notes = filter(None, (point.whole_note for point in self.points))
        return tuple(dict.fromkeys([*whole_load_notes, *self.shared_notes]))

    @property
    def shared_p_max_MPa(self) -> float | None:
        """Largest peak pressure of the ellipses that share the load."""
        return max((point.shared.p0_MPa for point in self.points if point.shared is not None), default=None)


def sides(touch: ContactPoint) -> tuple[Side, ...]:
    """Sides of a contact point, in the order of its curvatures.

    Parameters
    ----------
    touch
        A contact point of the rigid bodies.

    Returns
    -------
    tuple of str
        `gauge` and `field` at a junction of segments, `both` elsewhere.
    """
    return ("gauge", "field") if touch.at_junction else ("both",)


def describe_profile_end(placement: Placement, touch: ContactPoint, ellipse: HertzContact) -> str:
    """Note on an ellipse at a contact point that does not fit on the profiles.

    The ellipse must end before the running surface of the rail, and before the running surface of the wheel. If it does
    not, then a part of its pressure acts on nothing.

    Parameters
    ----------
    placement
        Placed wheel and rail.
    touch
        Contact point.
    ellipse
        Hertz's ellipse at the contact point.

    Returns
    -------
    str
        Reason why the ellipse does not fit; empty if it fits.
    """
    reach = 0.5 * ellipse.extent_y_mm
    for profile, u in ((placement.rail.profile, touch.rail_u), (placement.wheel.profile, touch.wheel_u)):
        position = float(profile.arc_length(u))
        margin = min(position, profile.length_mm - position)
        if reach > margin:
            return (
                f"Hertz's ellipse reaches {reach:.1f} mm across, but {profile.kind} {profile.name} ends {margin:.1f} mm"
                " from the contact point, so a part of the ellipse is beyond the profile; reduce the load, change the"
                " lateral shift, or give a longer profile"
            )
    return ""


def solve_hertz_points(
    placement: Placement, load_N: float, *, direction: Floats, contact_modulus_MPa: float
) -> HertzAtContactPoints:
    """Hertz at all contact points under a load.

    Parameters
    ----------
    placement
        Placed wheel and rail.
    load_N
        Load along the direction, > 0.
    direction : ndarray of shape (3,)
        Unit vector of the load.
    contact_modulus_MPa
        E* of the pair.

    Returns
    -------
    HertzAtContactPoints
        Ellipses under the whole load at each contact point, and ellipses that share the load.

    Notes
    -----
    Range of validity: the points act independently, as springs in parallel. This is valid if their patches are small
    relative to the distance between them.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.case import Case
    >>> from fecontact.contact_theories.touch_hertz import solve_hertz_points
    >>> from fecontact.solving.placing import place_case
    >>> placement = place_case(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0))
    >>> vertical = np.array([0.0, 0.0, 1.0])
    >>> hertz = solve_hertz_points(placement, 100e3, direction=vertical, contact_modulus_MPa=115e3)
    >>> len(hertz.points)
    1
    """
    touches = placement.contact_points
    closing = np.array([float(touch.normal @ direction) for touch in touches])
    whole_load_ellipses = [
        [_ellipse_or_problem(curvature, load_N / cosine, contact_modulus_MPa) for curvature in touch.curvatures]
        for touch, cosine in zip(touches, closing, strict=True)
    ]
    shared_ellipses: list[HertzContact | None] = [None] * len(touches)
    approach: float | None = None
    field_side_ellipses = [ellipses[-1] for ellipses in whole_load_ellipses]
    springs = [ellipse for ellipse in field_side_ellipses if isinstance(ellipse, HertzContact)]
    if len(springs) == len(touches):
        gap = np.array([touch.vertical_gap_mm * touch.normal[2] for touch in touches])
        stiffness = np.array([spring.stiffness_N_per_mm15 for spring in springs])
        approach = multi_hertz_approach_mm(stiffness, load_N=load_N, gap_mm=gap, closing=closing)
        forces = stiffness * np.maximum(approach * closing - gap, 0.0) ** 1.5
        shared_ellipses = [
            hertz_from_hessian(
                touch.curvature.hessian, normal_force_N=float(point_force), contact_modulus_MPa=contact_modulus_MPa
            )
            if point_force > 0.0
            else None
            for touch, point_force in zip(touches, forces, strict=True)
        ]
    return HertzAtContactPoints(
        points=tuple(
            ContactPointHertz(
                contact_point_number=number,
                side=side,
                whole=ellipse if isinstance(ellipse, HertzContact) else None,
                shared=shared_ellipse if side != "gauge" else None,
                problem=None if isinstance(ellipse, HertzContact) else ellipse,
                whole_note=describe_profile_end(placement, touch, ellipse) if isinstance(ellipse, HertzContact) else "",
                shared_note=describe_profile_end(placement, touch, shared_ellipse)
                if side != "gauge" and shared_ellipse is not None
                else "",
            )
            for number, (touch, ellipses, shared_ellipse) in enumerate(
                zip(touches, whole_load_ellipses, shared_ellipses, strict=True)
            )
            for side, ellipse in zip(sides(touch), ellipses, strict=True)
        ),
        shared_approach_mm=approach,
        overlapping=_ellipses_overlap(placement, shared_ellipses),
    )


def _ellipse_or_problem(curvature: RelativeCurvature, normal_force_N: float, modulus: float) -> HertzContact | str:
    """Hertz's ellipse, or the reason why there is no ellipse."""
    try:
        return hertz_from_hessian(curvature.hessian, normal_force_N=normal_force_N, contact_modulus_MPa=modulus)
    except InputError as error:
        return str(error)


def _ellipses_overlap(placement: Placement, shared: list[HertzContact | None]) -> bool:
    """Whether two of the ellipses overlap across the rail.

    Neighbours overlap if the sum of their half widths is larger than their distance along the rail's profile in mm.

    Parameters
    ----------
    placement
        Placement with its contact points.
    shared
        Ellipse of each contact point under its share of the load; None for a contact point without load or ellipse.
    """
    positions = (float(placement.rail.profile.arc_length(touch.rail_u)) for touch in placement.contact_points)
    half_widths = sorted(
        (position, 0.5 * ellipse.extent_y_mm)
        for position, ellipse in zip(positions, shared, strict=True)
        if ellipse is not None
    )
    return any(
        position + half_width > next_position - next_half_width
        for (position, half_width), (next_position, next_half_width) in pairwise(half_widths)
    )
