"""A case before it is solved, as a record and in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from fecontact.outputs.flat_records import picked
from fecontact.outputs.geometry import touch_record
from fecontact.outputs.own_profiles import geometry_line, own_profiles_record
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.terminal import Lines, notes
from fecontact.solving.preview import Preview

_EXPECTED = "x_low_mm x_high_mm s_low_mm s_high_mm semi_axis_x_mm semi_axis_s_mm parts"


def preview_record(seen: Preview) -> dict[str, Any]:
    """Everything that a preview says, with units in the keys."""
    return {
        "schema": "fecontact/place/1",
        "case": case_inputs(seen.case, seen.placement),
        "touch_points": [touch_record(touch) for touch in seen.placement.touch_points],
        "hertz": {"p_max_MPa": seen.hertz.p0_MPa, **picked(seen.hertz, "a_mm b_mm")},
        "uncertainty_of_profile": seen.hertz_uncertainty,
        "expected_patch": picked(seen.expected, _EXPECTED),
        **picked(seen, "element_size_mm elements degrees_of_freedom cpu_seconds memory_GB"),
        "junctions": junctions_of(seen),
        "notes": list(seen.placement.notes),
    }


def junctions_of(seen: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles by their distance from the first touch point along the line."""
    found = [
        {"profile": place.profile.kind, "y_mm": place.junction.y_mm, "distance_mm": place.s_mm}
        for place in seen.placement.junctions
    ]
    return sorted(found, key=lambda one: abs(one["distance_mm"]))


def preview_lines(seen: Preview) -> Lines:
    """A preview in lines."""
    yield from geometry_line(own_profiles_record(seen.case, seen.placement))
    patch, (dx, ds) = seen.expected, seen.element_size_mm
    for place, touch in enumerate(seen.placement.touch_points, start=1):
        yield (
            f"touch point {place}: rail y {touch.rail_y_mm:+.2f} mm, wheel y {touch.wheel_y_mm:+.2f} mm, contact angle"
            f" {1e3 * touch.contact_angle_rad:+.1f} mrad, gap {1e3 * touch.vertical_gap_mm:.1f} um"
        )
    unsure = "" if seen.hertz_uncertainty is None else f"; {uncertainty_text(seen.hertz_uncertainty)}"
    yield f"Hertz: p0 {seen.hertz.p0_MPa:.1f} MPa, a {seen.hertz.a_mm:.3f} mm, b {seen.hertz.b_mm:.3f} mm{unsure}"
    yield (
        f"expected patch: {patch.x_high_mm - patch.x_low_mm:.2f} mm along x, {patch.s_high_mm - patch.s_low_mm:.2f} mm"
        f" across, from {patch.s_low_mm:+.2f} to {patch.s_high_mm:+.2f} mm of the touch point"
    )
    reached = [one for one in junctions_of(seen) if patch.s_low_mm <= one["distance_mm"] <= patch.s_high_mm]
    told = ", ".join(f"{one['profile']} at {one['distance_mm']:+.2f} mm" for one in reached)
    yield f"curvature junctions below it: {told or 'none'}"
    yield (
        f"elements {dx:.3g} by {ds:.3g} mm, {seen.elements[0]} by {seen.elements[1]} in the fine zone: about"
        f" {round(seen.degrees_of_freedom, -3)} unknowns, {seen.cpu_seconds:.0f} CPU s and {seen.memory_GB:.1f} GB;"
        f" more where the verdict is open, up to {seen.case.most_unknowns} unknowns"
    )
    yield from notes(seen.placement.notes)


def uncertainty_text(part: dict[str, float]) -> str:
    """What measured profiles leave open of Hertz, in words."""
    if any(np.isnan(value) for value in part.values()):
        return "another line that the measured points allow does not come into contact here: Hertz is not known"
    p, a, b = (100.0 * part[name] for name in ("p_max_MPa", "a_mm", "b_mm"))
    return f"the measured profiles leave ±{p:.2g} % of p0, ±{a:.2g} % of a and ±{b:.2g} % of b open"
