"""Placement of a case's wheel on its rail, alone or in a wheelset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from fecontact.bodies import Track
from fecontact.case import Case, Opposite
from fecontact.errors import ConvergenceError, InputError
from fecontact.placement.irregular_pair import lower_on_irregularities
from fecontact.placement.problems import PositionProblem
from fecontact.placement.wheel_on_rail import SIDE_SIGN, Pair, Placement, place, set_up_pair
from fecontact.placement.wheelset import (
    PlacedWheelset,
    Wheelset,
    place_wheelset,
    place_wheelset_at_shifts,
)
from fecontact.profiles.curve import Profile, ProfileKind
from fecontact.profiles.reading import CIRCLE_PREFIX, Reading, can_form_wheelset, has_no_gauge_face
from fecontact.profiles.resolve import (
    gauge_note,
    radius_note,
    radius_of_file_mm,
    refuse_unused_reading,
    resolve_rail,
    resolve_wheel,
)
from fecontact.solving.loaded_wheelset import place_loaded_wheelset

# --- Placement of the wheel of a case on its rail, alone or in a wheelset; fast enough for tables.

OppositeProfiles = Mapping[ProfileKind, Profile]
"""Profiles of the opposite side by body, `rail` or `wheel`."""
_NO_PROFILES: OppositeProfiles = MappingProxyType({})


def place_case(
    case: Case,
    *,
    rail: Profile | None = None,
    wheel: Profile | None = None,
    opposite_profiles: OppositeProfiles = _NO_PROFILES,
) -> Placement:
    """Put the wheel of a case on its rail.

    Parameters
    ----------
    case
        Case with profiles and position.
    rail, wheel
        Profiles in place of the profiles of the case; None for the profiles of the case.
    opposite_profiles
        As in `make_wheelset`.

    Returns
    -------
    Placement
        Wheel on rail, with irregularities if the case has any.

    Raises
    ------
    InputError
        For profiles that cannot be read, positions in which the wheel does not run on the rail, and edges of an
        irregularity under the wheel.

    Examples
    --------
    >>> import fecontact
    >>> from fecontact.solving.placing import place_case
    >>> round(place_case(fecontact.Case(lateral_shift_mm=4.0)).first.rail_y_mm, 1)
    -13.8
    """
    placement = _place_smooth(case, rail, wheel, opposite_profiles)
    return (
        lower_on_irregularities(placement, case.irregularities, case.distance_mm) if case.irregularities else placement
    )


def place_or_explain(
    case: Case,
    *,
    rail: Profile | None = None,
    wheel: Profile | None = None,
    opposite_profiles: OppositeProfiles = _NO_PROFILES,
) -> Placement | PositionProblem:
    """Placement of a case, or the reason why the wheel cannot run there.

    Parameters
    ----------
    case, rail, wheel, opposite_profiles
        As in `place_case`.

    Returns
    -------
    Placement or PositionProblem
        Placement, or the problem with its kind.
    """
    try:
        return place_case(case, rail=rail, wheel=wheel, opposite_profiles=opposite_profiles)
    except (InputError, ConvergenceError) as error:
        return PositionProblem.explain(error)


def place_at_shifts(
    case: Case,
    shifts_mm: Sequence[float],
    *,
    rail: Profile | None = None,
    wheel: Profile | None = None,
    opposite_profiles: OppositeProfiles = _NO_PROFILES,
) -> dict[float, Placement | PositionProblem]:
    """Place a case at several shifts; the wheelset is set up once if it is free.

    Parameters
    ----------
    case
        Case with profiles; its lateral shift is ignored.
    shifts_mm
        Lateral shifts in mm.
    rail, wheel, opposite_profiles
        As in `make_wheelset`.

    Returns
    -------
    dict of float to Placement or PositionProblem
        Placement or problem by the shift.
    """
    if case.roll != "touching" or case.irregularities:
        return {
            shift_mm: place_or_explain(
                replace(case, lateral_shift_mm=shift_mm), rail=rail, wheel=wheel, opposite_profiles=opposite_profiles
            )
            for shift_mm in shifts_mm
        }
    wheelset = replace(
        make_wheelset(case, rail=rail, wheel=wheel, opposite_profiles=opposite_profiles), asked=case.side
    )
    return {
        shift_mm: position.extend(before=f"lateral shift {shift_mm:g} mm of the wheelset: ")
        if isinstance(position, PositionProblem)
        else position.side(case.side)
        for shift_mm, position in place_wheelset_at_shifts(wheelset, shifts_mm, case.yaw_rad).items()
    }


def _place_smooth(
    case: Case, rail: Profile | None, wheel: Profile | None, opposite_profiles: OppositeProfiles
) -> Placement:
    """Placement by the profiles alone, without irregularities.

    Parameters
    ----------
    case
        Case; unless its roll is given, the whole wheelset is placed and the side of the case is returned.
    rail, wheel
        Profiles to place; None for the profiles of the case.
    opposite_profiles
        As in `make_wheelset`.

    Raises
    ------
    InputError
        If the case has inputs of the opposite side that have no effect on a given roll.
    """
    if case.roll != "given":
        return place_wheelset_of_case(case, rail=rail, wheel=wheel, opposite_profiles=opposite_profiles).side(case.side)
    if not case.opposite.is_mirror_image:
        raise InputError(
            "the opposite side has an effect only on a roll that follows from both wheels; give roll = 'touching'"
        )
    _refuse_unused_readings(case, rail, wheel)
    case_wheel = resolve_wheel(case.wheel, case.wheel_file)
    return place(
        rail or _add_gauge_note(resolve_rail(case.rail, case.rail_file), case.rail, case),
        wheel or _add_radius_note(case_wheel.profile, case.wheel, case.rolling_radius_mm),
        inclination_rad=_inclination_rad(case, case.rail),
        lateral_shift_mm=case.lateral_shift_mm,
        roll_rad=case.roll_rad,
        yaw_rad=case.yaw_rad,
        rolling_radius_mm=float(case_wheel.rolling_radius_mm or case.rolling_radius_mm),
        track=_adapt_track(case, case.rail),
        side=case.side,
        flange_climb=case.flange_climb,
    )


def place_wheelset_of_case(
    case: Case,
    *,
    rail: Profile | None = None,
    wheel: Profile | None = None,
    opposite_profiles: OppositeProfiles = _NO_PROFILES,
) -> PlacedWheelset:
    """Set the wheelset of a case on its rails for the wheel of its side.

    The other wheel may climb its rail, up to the top of its flange.

    Parameters
    ----------
    case, rail, wheel, opposite_profiles
        As in `make_wheelset`.

    Returns
    -------
    PlacedWheelset
        Both wheels on their rails.

    Raises
    ------
    InputError, ConvergenceError
        As in `place_case`, and as in `place_loaded_wheelset` if the roll is the roll under load.
    """
    wheelset = replace(
        make_wheelset(case, rail=rail, wheel=wheel, opposite_profiles=opposite_profiles), asked=case.side
    )
    try:
        if case.roll == "loaded":
            return place_loaded_wheelset(wheelset, case)
        return place_wheelset(wheelset, case.lateral_shift_mm, case.yaw_rad)
    except InputError as error:
        if can_form_wheelset(case.rail, case.wheel):
            raise
        # A case that was derived from another case has the other case's roll.
        raise InputError(
            f"roll is {case.roll!r}, but {case.wheel} on {case.rail} has no position at which both wheels touch:"
            " circles, cylinders and crane rails have no wheelset; give roll = 'given'"
        ) from error


def make_wheelset(
    case: Case,
    *,
    rail: Profile | None = None,
    wheel: Profile | None = None,
    opposite_profiles: OppositeProfiles = _NO_PROFILES,
) -> Wheelset:
    """Both wheels of a case over both rails.

    The opposite side is the mirror image if nothing else is given.

    Parameters
    ----------
    case, rail, wheel
        As in `place_case`.
    opposite_profiles
        Profiles in place of the files that the case names for the opposite side, by body; a missing profile is read.

    Returns
    -------
    Wheelset
        Left and right pair of wheel and rail.
    """
    _refuse_unused_readings(case, rail, wheel)
    opposite = case.opposite
    pair = _make_pair(case, Opposite(), rail, wheel)
    if opposite.is_mirror_image:
        return Wheelset.of(pair, pair)
    opposite_pair = _make_pair(
        case,
        opposite,
        opposite_profiles.get("rail") if opposite.rail else rail,
        opposite_profiles.get("wheel") if opposite.wheel else wheel,
    )
    return Wheelset.of(pair, opposite_pair) if case.side == "left" else Wheelset.of(opposite_pair, pair)


def _refuse_unused_readings(case: Case, rail: Profile | None, wheel: Profile | None) -> None:
    """Refuse options of profile files that the profiles of the case do not use.

    Given profiles are not read.
    """
    opposite = case.opposite
    if rail is None:
        _refuse_unused_options("rail", (case.rail, case.rail_file), (opposite.rail, opposite.rail_file))
    if wheel is None:
        _refuse_unused_options("wheel", (case.wheel, case.wheel_file), (opposite.wheel, opposite.wheel_file))


def _refuse_unused_options(
    kind: ProfileKind, this_side: tuple[str, Reading], opposite_side: tuple[str | None, Reading | None]
) -> None:
    """Refuse options that no file of their side uses.

    The other side has the options of this side unless it has options too.
    """
    (spec, reading), (opposite_spec, opposite_reading) = this_side, opposite_side
    if opposite_spec is None or opposite_reading is None:
        refuse_unused_reading(kind, filter(None, (spec, opposite_spec)), reading)
        return
    refuse_unused_reading(kind, (spec,), reading)
    refuse_unused_reading(kind, (opposite_spec,), opposite_reading)


def _make_pair(case: Case, side: Opposite, rail_profile: Profile | None, wheel_profile: Profile | None) -> Pair:
    """Pair of wheel and rail on a side.

    The case supplies the missing inputs of the side. A radius of the side overrides the radius in the text of its
    wheel.
    """
    rail_spec, wheel_spec = side.rail or case.rail, side.wheel or case.wheel
    rail_reading, wheel_reading = side.rail_file or case.rail_file, side.wheel_file or case.wheel_file
    resolved_wheel = resolve_wheel(wheel_spec, wheel_reading)
    text_radius_mm = resolved_wheel.rolling_radius_mm or (radius_of_file_mm(side.wheel) if side.wheel else None)
    radius_mm = side.rolling_radius_mm or text_radius_mm or case.rolling_radius_mm
    return set_up_pair(
        rail_profile or _add_gauge_note(resolve_rail(rail_spec, rail_reading), rail_spec, case),
        wheel_profile or _add_radius_note(resolved_wheel.profile, wheel_spec, radius_mm),
        inclination_rad=_inclination_rad(case, rail_spec),
        rolling_radius_mm=float(radius_mm),
        track=_adapt_track(case, rail_spec),
        flange_climb=case.flange_climb,
    )


def _add_radius_note(wheel: Profile, spec: str, radius_mm: float) -> Profile:
    """Add a note to a wheel if the header of its file contradicts the rolling radius."""
    note = radius_note(spec, radius_mm)
    return replace(wheel, notes=(*wheel.notes, note)) if note else wheel


def _add_gauge_note(rail: Profile, spec: str, case: Case) -> Profile:
    """Add a note to a rail if its header contradicts the gauge of the track."""
    note = "" if case.track.rail_crown_y_mm is not None else gauge_note(spec, case.track.gauge_mm)
    return replace(rail, notes=(*rail.notes, note)) if note else rail


def _inclination_rad(case: Case, rail: str) -> float:
    """Inclination of a rail; 0 for a circle, which has its crown at its highest point."""
    return 0.0 if rail.lower().startswith(CIRCLE_PREFIX) else case.inclination_rad


def _adapt_track(case: Case, rail: str) -> Track:
    """Track of a case, adapted to a rail without a gauge face."""
    track = case.track
    if has_no_gauge_face(rail) and track.rail_crown_y_mm is None:
        return replace(track, rail_crown_y_mm=track.tape_circle_y_mm)
    return track


def compute_roll(case: Case, placement: Placement) -> float:
    """Roll of the wheelset, computed or given by the case.

    Parameters
    ----------
    case
        Case with roll and side.
    placement
        Wheel on rail.

    Returns
    -------
    float
        Roll in rad; a positive roll lifts the left wheel.
    """
    if case.roll == "given":
        return case.roll_rad
    _, sine, cosine = placement.wheel.axes[2]
    return SIDE_SIGN[case.side] * float(np.arctan2(sine, cosine))
