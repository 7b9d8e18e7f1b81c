"""The geometry of own profiles in a line, above each verdict and ellipse: what a wrong origin would change."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fecontact.case import Case
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import inclination_words
from fecontact.outputs.tables import Item
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import is_known, profile_identity
from fecontact.profiles.reading import is_short_form
from fecontact.solving.placing import placed_or_why

_STEP_MM = 0.05
# A part of a wheel that lies less deep below the tread is not called a flange.
_FLANGE_MM = 12.0


def own_profiles_record(case: Case, placement: Placement) -> Record:
    """The line as an entry of a record; nothing if both profiles are of the library or given by their radii."""
    if all(is_short_form(spec) or is_known(spec) for spec in case.profiles.values()):
        return {}
    return {"own_profiles": own_profiles_text(case, placement)}


def own_profiles_text(case: Case, placement: Placement) -> str:
    """Contact point, rolling radius, flange height and rail inclination of a pair, in a line."""
    first, wheel = placement.first, placement.wheel
    return (
        f"geometry of {profile_identity(case.wheel)} on {profile_identity(case.rail)}: contact point at y ="
        f" {first.rail_y_mm:+.2f} mm of the rail and {first.wheel_y_mm:+.2f} mm of the wheel, rolling radius"
        f" {float(wheel.radius(first.wheel_u)):.2f} mm, {_flange_words(wheel.profile)},"
        f" {_rail_words(placement.rail.profile, placement.rail.inclination_rad)}"
    )


def geometry_line(record: Item) -> list[str]:
    """The line of a record, if it has one."""
    return [record["own_profiles"]] if "own_profiles" in record else []


def _flange_words(wheel: Profile) -> str:
    points = wheel.evaluate(wheel.spread(_STEP_MM))
    height = float(np.interp(0.0, np.maximum.accumulate(points.y), points.z)) - float(points.z.min())
    at = float(points.y[np.argmin(points.z)])
    return (
        f"flange height {height:.2f} mm (tip at y = {at:.1f} mm)" if height > _FLANGE_MM and at < 0.0 else "no flange"
    )


def _rail_words(rail: Profile, inclination_rad: float) -> str:
    words = f"rail inclined by{inclination_words(inclination_rad)}" if inclination_rad else "rail not inclined"
    if rail.measured is None or not rail.measured.nominal:
        return words
    turn = 1e3 * rail.measured.held.registration.turn_rad
    return f"{words}, its head in the file turned by {turn:+.1f} mrad against {rail.measured.nominal}"


def geometry_of_cases(cases: Iterable[Case]) -> Iterator[str]:
    """Geometry of each pair of own profiles, at its first case that has a place on the rail."""
    shown: set[tuple[object, ...]] = set()
    for case in cases:
        pair = (case.rail, case.wheel, case.rail_file, case.wheel_file, case.track, case.inclination_rad)
        if pair not in shown and not isinstance(placement := placed_or_why(case), str):
            shown.add(pair)
            at = f"at a shift of {case.lateral_shift_mm:g} mm"
            yield from (f"{at}: {text}" for text in own_profiles_record(case, placement).values())
