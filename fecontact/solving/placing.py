"""Placement of a case's wheel on its rail, alone or in a wheelset, also with loaded wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fecontact.bodies import Track
from fecontact.case import Case, Opposite
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.irregular_pair import with_irregularities
from fecontact.placement.wheel_on_rail import SIGN, Pair, Placement, pair_of, place
from fecontact.placement.wheelset import (
    PlacedWheelset,
    Wheelset,
    place_wheelset,
    positions_at,
)
from fecontact.profiles.curve import Profile
from fecontact.profiles.reading import CIRCLE, has_no_gauge_face, makes_a_wheelset
from fecontact.profiles.resolve import (
    radius_note,
    radius_of_file_mm,
    refuse_unused_reading,
    resolve_rail,
    resolve_wheel,
)
from fecontact.solving.loaded_wheelset import place_loaded_wheelset

# --- The wheel of a case on its rail, alone or in a wheelset; fast enough for tables.


def place_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Placement:
    """Put the wheel of a case on its rail; `rail` and `wheel` replace the case's profiles if given.

    Raises
    ------
    InputError
        For profiles that cannot be read, positions in which the wheel does not run on the rail, and edges of an
        irregularity under the wheel.
    """
    placement = _place_smooth(case, rail, wheel)
    return with_irregularities(placement, case.irregularities, case.distance_mm) if case.irregularities else placement


def placed_or_why(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Placement | str:
    """As `place_case`, or why the wheel cannot run there."""
    try:
        return place_case(case, rail=rail, wheel=wheel)
    except (InputError, ConvergenceError) as error:
        return str(error)


def place_at_shifts(
    case: Case, shifts_mm: Sequence[float], *, rail: Profile | None = None, wheel: Profile | None = None
) -> dict[float, Placement | str]:
    """As `placed_or_why` at many shifts, for which the shift of the case is left out; a free wheelset is made once."""
    if case.roll != "touching" or case.irregularities:
        return {
            shift: placed_or_why(replace(case, lateral_shift_mm=shift), rail=rail, wheel=wheel) for shift in shifts_mm
        }
    wheelset = replace(wheelset_of_case(case, rail=rail, wheel=wheel), asked=case.side)
    return {
        shift: f"lateral shift {shift:g} mm of the wheelset: {placed}"
        if isinstance(placed, str)
        else placed.side(case.side)
        for shift, placed in positions_at(wheelset, shifts_mm, case.yaw_rad).items()
    }


def _place_smooth(case: Case, rail: Profile | None, wheel: Profile | None) -> Placement:
    """The placement by the profiles alone, without irregularities."""
    if case.roll != "given":
        return place_wheelset_of_case(case, rail=rail, wheel=wheel).side(case.side)
    if not case.opposite.is_mirror_image:
        raise InputError("the opposite side is used only for the roll of a wheelset; give roll = 'touching'")
    _refuse_unused_readings(case, rail, wheel)
    case_wheel = resolve_wheel(case.wheel, case.wheel_file)
    return place(
        rail or resolve_rail(case.rail, case.rail_file),
        wheel or _with_radius_note(case_wheel.profile, case.wheel, case.rolling_radius_mm),
        inclination_rad=_inclination_rad(case, case.rail),
        lateral_shift_mm=case.lateral_shift_mm,
        roll_rad=case.roll_rad,
        yaw_rad=case.yaw_rad,
        rolling_radius_mm=float(case_wheel.rolling_radius_mm or case.rolling_radius_mm),
        track=_track(case, case.rail),
        side=case.side,
        flange_climb=case.flange_climb,
    )


def place_wheelset_of_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> PlacedWheelset:
    """Set the wheelset of a case on its rails for the wheel of its side; `rail` and `wheel` as in `place_case`.

    The other wheel may climb its rail, up to the top of its flange.

    Raises
    ------
    InputError, ConvergenceError
        As in `place_case`, and as in `place_loaded_wheelset` if the roll is the roll under load.
    """
    wheelset = replace(wheelset_of_case(case, rail=rail, wheel=wheel), asked=case.side)
    try:
        if case.roll == "loaded":
            return place_loaded_wheelset(wheelset, case)
        return place_wheelset(wheelset, case.lateral_shift_mm, case.yaw_rad)
    except InputError as error:
        if makes_a_wheelset(case.rail, case.wheel):
            raise
        # a case that was derived from another case has the other case's roll
        raise InputError(
            f"roll is {case.roll!r}, but {case.wheel} on {case.rail} has no place in the track where both wheels could"
            " touch: circles, cylinders and crane rails have no wheelset; give roll = 'given'"
        ) from error


def wheelset_of_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Wheelset:
    """Both wheels of a case over both rails; the opposite side is the mirror image if nothing else is given."""
    _refuse_unused_readings(case, rail, wheel)
    other = case.opposite
    own = _pair(case, Opposite(), rail, wheel)
    if other.is_mirror_image:
        return Wheelset.of(own, own)
    across = _pair(case, other, None if other.rail else rail, None if other.wheel else wheel)
    return Wheelset.of(own, across) if case.side == "left" else Wheelset.of(across, own)


def _refuse_unused_readings(case: Case, rail: Profile | None, wheel: Profile | None) -> None:
    """Refuse options of profile files that no profile of the case uses; profiles that are handed in are not read."""
    if rail is None:
        refuse_unused_reading("rail", filter(None, (case.rail, case.opposite.rail)), case.rail_file)
    if wheel is None:
        refuse_unused_reading("wheel", filter(None, (case.wheel, case.opposite.wheel)), case.wheel_file)


def _pair(case: Case, side: Opposite, rail_line: Profile | None, wheel_line: Profile | None) -> Pair:
    """The pair of a side; the case gives what the side leaves open, and a side's radius overrides its wheel's text."""
    rail, wheel = side.rail or case.rail, side.wheel or case.wheel
    resolved = resolve_wheel(wheel, case.wheel_file)
    of_text = resolved.rolling_radius_mm or (radius_of_file_mm(side.wheel) if side.wheel else None)
    radius_mm = side.rolling_radius_mm or of_text or case.rolling_radius_mm
    return pair_of(
        rail_line or resolve_rail(rail, case.rail_file),
        wheel_line or _with_radius_note(resolved.profile, wheel, radius_mm),
        inclination_rad=_inclination_rad(case, rail),
        rolling_radius_mm=float(radius_mm),
        track=_track(case, rail),
        flange_climb=case.flange_climb,
    )


def _with_radius_note(wheel: Profile, spec: str, radius_mm: float) -> Profile:
    """A wheel with a note if the header of its file contradicts the rolling radius."""
    note = radius_note(spec, radius_mm)
    return replace(wheel, notes=(*wheel.notes, note)) if note else wheel


def _inclination_rad(case: Case, rail: str) -> float:
    """Inclination of a rail: a circle has none, since its crown is wherever it is highest."""
    return 0.0 if rail.lower().startswith(CIRCLE) else case.inclination_rad


def _track(case: Case, rail: str) -> Track:
    track = case.track
    if has_no_gauge_face(rail) and track.rail_crown_y_mm is None:
        return replace(track, rail_crown_y_mm=track.tape_circle_y_mm)
    return track


def roll_of_case(case: Case, placement: Placement) -> float:
    """Roll (rad) of the wheelset, computed or given by the case; a positive roll lifts the left wheel."""
    if case.roll == "given":
        return case.roll_rad
    _, sine, cosine = placement.wheel.axes[2]
    return SIGN[case.side] * float(np.arctan2(sine, cosine))
