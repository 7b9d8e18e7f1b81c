"""Geometry of a case's wheelset on its rails over the lateral shift; it needs no finite elements."""

from __future__ import annotations

from collections.abc import Sequence

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.placement.wheelset import (
    ContactFunctions,
    contact_functions,
    possible_wheelset_shifts,
)
from fecontact.solving.placing import wheelset_of_case


def geometry(case: Case, shifts_mm: Sequence[float]) -> ContactFunctions:
    """The wheelset of a case at many shifts; shift, roll and side of the case are ignored.

    >>> import fecontact
    >>> found = fecontact.geometry(fecontact.Case(), [0.0, 5.0])
    >>> round(1e3 * found.positions[5.0].roll_rad, 2)
    0.34

    Raises
    ------
    InputError
        If the wheelset can stand at none of the shifts; the message gives the possible shifts.
    """
    wheelset = wheelset_of_case(case)
    found = contact_functions(wheelset, shifts_mm, case.yaw_rad)
    if all(isinstance(placed, str) for placed in found.positions.values()):
        why = next(iter(found.positions.values()))
        raise InputError(
            f"the wheelset can stand at none of the shifts: {why}; {possible_wheelset_shifts(wheelset, case.yaw_rad)}"
        )
    return found
