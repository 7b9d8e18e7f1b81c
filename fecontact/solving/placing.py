"""The wheel of a case on its rail, alone or as one of both wheels of a wheelset; light enough for a table of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fecontact.case import Case, Opposite
from fecontact.dimensions import Track
from fecontact.errors import InputError
from fecontact.geometry.irregular import with_irregularities
from fecontact.geometry.placement import SIGN, Pair, Placement, pair_of, place
from fecontact.geometry.wheelset import PlacedWheelset, Wheelset, place_wheelset
from fecontact.profiles.curve import Profile
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.profiles.short_forms import has_no_gauge_face, makes_a_wheelset
from fecontact.solving.loaded_wheelset import place_loaded_wheelset


def place_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Placement:
    """Put the wheel of a case on its rail; `rail` and `wheel` stand for the case's own lines where given.

    Raises
    ------
    InputError
        For profiles that cannot be read, positions in which the wheel does not run on the rail, and edges of an
        irregularity under the wheel.
    """
    placement = _place_smooth(case, rail, wheel)
    return with_irregularities(placement, case.irregularities, case.distance_mm) if case.irregularities else placement


def _place_smooth(case: Case, rail: Profile | None, wheel: Profile | None) -> Placement:
    """The placement by the profiles alone."""
    if case.roll != "given":
        return place_wheelset_of_case(case, rail=rail, wheel=wheel).side(case.side)
    if not case.opposite.is_mirror_image:
        raise InputError("what is on the opposite side counts only for the roll of a wheelset; give roll = 'touching'")
    case_wheel = resolve_wheel(case.wheel, case.wheel_file)
    return place(
        rail or resolve_rail(case.rail, case.rail_file),
        wheel or case_wheel.profile,
        inclination_rad=case.inclination_rad,
        lateral_shift_mm=case.lateral_shift_mm,
        roll_rad=case.roll_rad,
        yaw_rad=case.yaw_rad,
        rolling_radius_mm=case_wheel.rolling_radius_mm or case.rolling_radius_mm,
        track=_track(case, case.rail),
        side=case.side,
        flange_climb=case.flange_climb,
    )


def place_wheelset_of_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> PlacedWheelset:
    """Set the whole wheelset of a case on its rails; `rail` and `wheel` as in `place_case`.

    Raises
    ------
    InputError, ConvergenceError
        As `place_case`, for both sides, and as `place_loaded_wheelset` where the roll is that under the load.
    """
    wheelset = wheelset_of_case(case, rail=rail, wheel=wheel)
    try:
        if case.roll == "loaded":
            return place_loaded_wheelset(wheelset, case)
        return place_wheelset(wheelset, case.lateral_shift_mm, case.yaw_rad)
    except InputError as error:
        if makes_a_wheelset(case.rail, case.wheel):
            raise
        # a case that was made from another one has that one's roll
        raise InputError(
            f"roll is {case.roll!r}, but {case.wheel} on {case.rail} has no place in the track where both wheels could"
            " touch: circles, cylinders and crane rails make no wheelset; give roll = 'given'"
        ) from error


def wheelset_of_case(case: Case, *, rail: Profile | None = None, wheel: Profile | None = None) -> Wheelset:
    """Both wheels of a case over both rails; the opposite side is the mirror image where nothing else is given."""
    other = case.opposite
    own = _pair(case, Opposite(), rail, wheel)
    if other.is_mirror_image:
        return Wheelset.of(own, own)
    across = _pair(case, other, None if other.rail else rail, None if other.wheel else wheel)
    return Wheelset.of(own, across) if case.side == "left" else Wheelset.of(across, own)


def _pair(case: Case, side: Opposite, rail_line: Profile | None, wheel_line: Profile | None) -> Pair:
    """A side that has what is not its own from the case; a radius of its own is before that of a wheel's text."""
    rail, resolved = side.rail or case.rail, resolve_wheel(side.wheel or case.wheel, case.wheel_file)
    return pair_of(
        rail_line or resolve_rail(rail, case.rail_file),
        wheel_line or resolved.profile,
        inclination_rad=case.inclination_rad,
        rolling_radius_mm=side.rolling_radius_mm or resolved.rolling_radius_mm or case.rolling_radius_mm,
        track=_track(case, rail),
        flange_climb=case.flange_climb,
    )


def _track(case: Case, rail: str) -> Track:
    track = case.track
    if has_no_gauge_face(rail) and track.rail_crown_y_mm is None:
        return replace(track, rail_crown_y_mm=track.tape_circle_y_mm)
    return track


def roll_of_case(case: Case, placement: Placement) -> float:
    """Roll (rad) of the wheelset as it stands, positive where it lifts the left wheel: found, or that of the case."""
    if case.roll == "given":
        return case.roll_rad
    _, sine, cosine = placement.wheel.axes[2]
    return SIGN[case.side] * float(np.arctan2(sine, cosine))
