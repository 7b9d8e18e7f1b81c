"""A case before it is solved, as a record."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from fecontact.outputs.records.results import shown_case_record
from fecontact.outputs.records.touch import touch_record
from fecontact.solving.preview import Preview


def preview_record(seen: Preview) -> dict[str, Any]:
    """Everything that a preview says, with units in the keys."""
    patch = seen.expected
    sizes = ("x_low_mm", "x_high_mm", "s_low_mm", "s_high_mm", "semi_axis_x_mm", "semi_axis_s_mm")
    expected = {name: getattr(patch, name) for name in sizes} | {"parts": [asdict(part) for part in patch.parts]}
    return {
        "schema": "fecontact/place/1",
        "case": shown_case_record(seen.case, seen.placement),
        "touch_points": [touch_record(touch) for touch in seen.placement.touch_points],
        "hertz": {"p_max_MPa": seen.hertz.p0_MPa, "a_mm": seen.hertz.a_mm, "b_mm": seen.hertz.b_mm},
        "uncertainty_of_profile": seen.hertz_uncertainty,
        "expected_patch": expected,
        "element_size_mm": list(seen.element_size_mm),
        "elements": list(seen.elements),
        "degrees_of_freedom": seen.degrees_of_freedom,
        "cpu_seconds": seen.cpu_seconds,
        "memory_GB": seen.memory_GB,
        "junctions": junctions_of(seen),
        "notes": [*seen.placement.rail.profile.notes, *seen.placement.wheel.profile.notes],
    }


def junctions_of(seen: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles by their distance from the first touch point along the line."""
    found = [
        {"profile": place.profile.kind, "y_mm": place.junction.y_mm, "distance_mm": place.s_mm}
        for place in seen.placement.junctions
    ]
    return sorted(found, key=lambda one: abs(one["distance_mm"]))
