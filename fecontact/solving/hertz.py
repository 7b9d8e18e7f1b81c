"""Hertz's ellipses at the position of a case, under its load."""

from __future__ import annotations

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.touch_hertz import HertzAtContactPoints, solve_hertz_points
from fecontact.errors import InputError
from fecontact.placement.wheel_on_rail import Placement


def compute_hertz(case: Case, placement: Placement) -> HertzContact:
    """Hertz's ellipse at the first contact point under the load of the case.

    At a junction, the ellipse has the curvature of the field side.

    Parameters
    ----------
    case
        Case with load and material.
    placement
        Wheel on rail.

    Returns
    -------
    HertzContact
        Ellipse under the normal force of the case.

    Raises
    ------
    InputError
        If the surfaces conform at the contact point, so that there is no ellipse.
    """
    contact_point = placement.first
    try:
        return hertz_from_hessian(
            contact_point.curvature.hessian,
            normal_force_N=case.load_N / float(contact_point.normal @ compute_load_direction(case, placement)),
            contact_modulus_MPa=case.contact_modulus_MPa,
        )
    except InputError as error:
        measured_names = [
            profile.name
            for profile in (placement.rail.profile, placement.wheel.profile)
            if profile.thinned() is not None
        ]
        if not measured_names:
            raise
        raise InputError(
            f"{error}; {' and '.join(measured_names)}: the points are not smoothed; give --rail-filter-mm or"
            " --wheel-filter-mm, or look for a wrong point with `fecontact profiles`"
        ) from None


def compute_hertz_points(case: Case, placement: Placement) -> HertzAtContactPoints:
    """Hertz at all contact points of a case.

    Parameters
    ----------
    case
        Case with load and material.
    placement
        Wheel on rail.

    Returns
    -------
    HertzAtContactPoints
        Each contact point with the whole load, and all contact points sharing the load.
    """
    return solve_hertz_points(
        placement,
        case.load_N,
        direction=compute_load_direction(case, placement),
        contact_modulus_MPa=case.contact_modulus_MPa,
    )


def compute_load_direction(case: Case, placement: Placement) -> Floats:
    """Unit vector (3,) along which the load of a case acts.

    Parameters
    ----------
    case
        Case with the kind of its load.
    placement
        The wheel on the rail.

    Returns
    -------
    ndarray of shape (3,)
        Unit vector in the track frame, upwards.
    """
    return placement.load_direction(normal=case.load_kind == "normal")
