"""A case before it is solved, as a record."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from fecontact.outputs.records.results import case_inputs, profile_notes, touch_record
from fecontact.outputs.records.told import picked
from fecontact.solving.preview import Preview


def preview_record(seen: Preview) -> dict[str, Any]:
    """Everything that a preview says, with units in the keys."""
    patch = seen.expected
    sizes = picked(patch, "x_low_mm x_high_mm s_low_mm s_high_mm semi_axis_x_mm semi_axis_s_mm")
    return {
        "schema": "fecontact/place/1",
        "case": case_inputs(seen.case, seen.placement),
        "touch_points": [touch_record(touch) for touch in seen.placement.touch_points],
        "hertz": {"p_max_MPa": seen.hertz.p0_MPa, **picked(seen.hertz, "a_mm b_mm")},
        "uncertainty_of_profile": seen.hertz_uncertainty,
        "expected_patch": sizes | {"parts": [asdict(part) for part in patch.parts]},
        **picked(seen, "element_size_mm elements degrees_of_freedom cpu_seconds memory_GB"),
        "junctions": junctions_of(seen),
        "notes": profile_notes(seen.placement),
    }


def junctions_of(seen: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles by their distance from the first touch point along the line."""
    found = [
        {"profile": place.profile.kind, "y_mm": place.junction.y_mm, "distance_mm": place.s_mm}
        for place in seen.placement.junctions
    ]
    return sorted(found, key=lambda one: abs(one["distance_mm"]))
