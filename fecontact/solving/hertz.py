"""Hertz's ellipses of a case at its position, under its load."""

from __future__ import annotations

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.touch_hertz import HertzPoints, hertz_points
from fecontact.errors import InputError
from fecontact.placement.wheel_on_rail import Placement


def hertz_of_case(case: Case, placement: Placement) -> HertzContact:
    """Hertz's ellipse at the first touch point under the case's load; at a junction the ellipse of its field side.

    Raises
    ------
    InputError
        If the surfaces conform at the touch point, so that there is no ellipse.
    """
    touch = placement.first
    try:
        return hertz_from_hessian(
            touch.curvature.hessian,
            normal_force_N=case.load_N / float(touch.normal @ direction_of_case(case, placement)),
            contact_modulus_MPa=case.contact_modulus_MPa,
        )
    except InputError as error:
        of_points = [p.name for p in (placement.rail.profile, placement.wheel.profile) if p.thinned() is not None]
        if not of_points:
            raise
        raise InputError(
            f"{error}; the line of {' and '.join(of_points)} goes through its points as they are: give"
            " --rail-filter-mm or --wheel-filter-mm a width, or look for a wrong point with `fecontact profiles`"
        ) from None


def hertz_points_of_case(case: Case, placement: Placement) -> HertzPoints:
    """Hertz at all touch points of a case, each with the whole load and all sharing it."""
    return hertz_points(
        placement,
        case.load_N,
        direction=direction_of_case(case, placement),
        contact_modulus_MPa=case.contact_modulus_MPa,
    )


def direction_of_case(case: Case, placement: Placement) -> Floats:
    """Unit vector (3,) along which the load of a case acts."""
    return placement.load_direction(normal=case.load_kind == "normal")
