"""Line on the geometry of a user's profiles, above each verdict and ellipse.

The line shows the quantities that a wrong origin would change.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fecontact.bodies import ROLLING_RADIUS_MM
from fecontact.case import Case
from fecontact.outputs.flat_records import Record
from fecontact.outputs.pair_names import inclination_words
from fecontact.outputs.tables import TableRecord
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.library import is_library_name, profile_identity
from fecontact.profiles.reading import is_short_form
from fecontact.profiles.resolve import radius_of_file_mm
from fecontact.solving.placing import place_or_explain

_POINT_SPACING_MM = 0.05
# A lower region of a wheel is called a flange only if it is deeper than this below the tread.
_MIN_FLANGE_HEIGHT_MM = 12.0


def pair_geometry_record(case: Case, placement: Placement) -> Record:
    """Record with the line on the geometry.

    The line is None if both profiles are from the library or given by their radii.

    Parameters
    ----------
    case
        Case with both profiles.
    placement
        The wheel on the rail.

    Returns
    -------
    dict
        Record with the key `pair_geometry`.
    """
    if all(is_short_form(spec) or is_library_name(spec) for spec in case.profiles.values()):
        return {"pair_geometry": None}
    return {"pair_geometry": pair_geometry_text(case, placement)}


def pair_geometry_text(case: Case, placement: Placement) -> str:
    """Contact point, rolling radius, flange height and rail inclination of a pair.

    Parameters
    ----------
    case
        Case that names the profiles.
    placement
        Placement of the case.

    Returns
    -------
    str
        Text in one line; lengths in mm.
    """
    first, wheel = placement.first, placement.wheel
    return (
        f"geometry of {profile_identity(case.wheel)} on {profile_identity(case.rail)}: contact point at y ="
        f" {first.rail_y_mm:+.2f} mm of the rail and {first.wheel_y_mm:+.2f} mm of the wheel, rolling radius"
        f" {float(wheel.radius(first.wheel_u)):.2f} mm{_default_radius_words(case)}, {_flange_words(wheel.profile)},"
        f" {_rail_words(placement.rail.profile, placement.rail.inclination_rad)}"
    )


def pair_geometry_lines(record: TableRecord) -> list[str]:
    """Lines on the geometry from a record: a list with a line, or an empty list."""
    return [record["pair_geometry"]] if record.get("pair_geometry") is not None else []


def _default_radius_words(case: Case) -> str:
    """Words for the default rolling radius of a wheel file without a diameter."""
    if is_short_form(case.wheel) or is_library_name(case.wheel):
        return ""
    if case.rolling_radius_mm != ROLLING_RADIUS_MM or radius_of_file_mm(case.wheel) is not None:
        return ""
    return f" (default: {ROLLING_RADIUS_MM:g} mm at the tape circle; --rolling-radius-mm)"


def _flange_words(wheel: Profile) -> str:
    """Words for the height of the flange over the tread at y = 0, and for the place of its tip."""
    points = wheel.evaluate(wheel.spread(_POINT_SPACING_MM))
    height_mm = float(np.interp(0.0, np.maximum.accumulate(points.y), points.z)) - float(points.z.min())
    tip_y_mm = float(points.y[np.argmin(points.z)])
    return (
        f"flange height {height_mm:.2f} mm (tip at y = {tip_y_mm:.1f} mm)"
        if height_mm > _MIN_FLANGE_HEIGHT_MM and tip_y_mm < 0.0
        else "no flange"
    )


def _rail_words(rail: Profile, inclination_rad: float) -> str:
    words = f"rail inclined by{inclination_words(inclination_rad)}" if inclination_rad else "rail not inclined"
    if rail.measured is None or not rail.measured.nominal:
        return words
    turn_mrad = 1e3 * rail.measured.held.registration.turn_rad
    return f"{words}, its head in the file rotated by {turn_mrad:+.1f} mrad relative to {rail.measured.nominal}"


def geometry_of_cases(cases: Iterable[Case]) -> Iterator[str]:
    """Iterate over the geometry of each pair of a user's profiles.

    A pair is described at its first case that can be placed on the rail.

    Parameters
    ----------
    cases
        Cases in order.

    Returns
    -------
    Iterator of str
        One line per pair.
    """
    shown_pairs: set[tuple[object, ...]] = set()
    for case in cases:
        pair = (case.rail, case.wheel, case.rail_file, case.wheel_file, case.track, case.inclination_rad)
        if pair not in shown_pairs and not isinstance(placement := place_or_explain(case), str):
            shown_pairs.add(pair)
            place_text = f"at a shift of {case.lateral_shift_mm:g} mm"
            yield from (f"{place_text}: {text}" for text in pair_geometry_lines(pair_geometry_record(case, placement)))
