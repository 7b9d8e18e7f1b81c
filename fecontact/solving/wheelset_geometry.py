"""Geometry of a case's wheelset on its rails over the lateral shift, without finite elements."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.placement.wheelset import (
    ContactFunctions,
    compute_contact_functions,
    describe_possible_wheelset_shifts,
)
from fecontact.solving.placing import make_wheelset


def geometry(case: Case, shifts_mm: Sequence[float]) -> ContactFunctions:
    """Contact functions of the wheelset of a case at several shifts.

    Shift, roll and side of the case are ignored.

    Parameters
    ----------
    case
        Case with profiles, track and yaw.
    shifts_mm
        Lateral shifts in mm.

    Returns
    -------
    ContactFunctions
        Positions and functions of the shift.

    Raises
    ------
    InputError
        If the wheelset cannot stand at any of the shifts; the message gives the possible shifts.

    Examples
    --------
    >>> import fecontact
    >>> functions = fecontact.geometry(fecontact.Case(), [0.0, 5.0])
    >>> round(1e3 * functions.positions[5.0].roll_rad, 2)
    0.34
    """
    wheelset = make_wheelset(case)
    functions = compute_contact_functions(wheelset, shifts_mm, case.yaw_rad)
    if all(isinstance(position, str) for position in functions.positions.values()):
        problem = next(iter(functions.positions.values()))
        raise InputError(
            f"the wheelset fits on the track at none of the shifts: {problem};"
            f" {describe_possible_wheelset_shifts(wheelset, case.yaw_rad)}"
        )
    return functions
