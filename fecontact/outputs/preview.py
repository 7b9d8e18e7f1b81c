"""Record and text of a case before it is solved."""

from __future__ import annotations

from typing import Any

import numpy as np

from fecontact.outputs.flat_records import select_attributes
from fecontact.outputs.geometry import contact_point_record
from fecontact.outputs.pair_geometry import pair_geometry_lines, pair_geometry_record
from fecontact.outputs.records.results import case_inputs
from fecontact.outputs.tables import TableRecord
from fecontact.outputs.terminal import OutputLines, note_lines
from fecontact.solving.preview import Preview

_EXPECTED_PATCH_ATTRIBUTES = "x_low_mm x_high_mm s_low_mm s_high_mm semi_axis_x_mm semi_axis_s_mm parts"


def preview_record(preview: Preview) -> dict[str, Any]:
    """Record of a preview.

    Parameters
    ----------
    preview
        Preview of a case.

    Returns
    -------
    dict
        Content of the JSON output, with units in the keys.
    """
    return {
        "schema": "fecontact/place/1",
        "case": case_inputs(preview.case, preview.placement),
        **pair_geometry_record(preview.case, preview.placement),
        "contact_points": [contact_point_record(touch) for touch in preview.placement.contact_points],
        "hertz": {"p_max_MPa": preview.hertz.p0_MPa, **select_attributes(preview.hertz, "a_mm b_mm")},
        "uncertainty_of_profile": preview.hertz_uncertainty,
        "expected_patch": select_attributes(preview.expected, _EXPECTED_PATCH_ATTRIBUTES),
        **select_attributes(preview, "element_size_mm elements degrees_of_freedom cpu_seconds memory_GB"),
        **select_attributes(preview.case, "most_unknowns"),
        "junctions": junction_records(preview),
        "notes": list(preview.placement.notes),
    }


def junction_records(preview: Preview) -> list[dict[str, Any]]:
    """Curvature junctions of both profiles, the nearest to the first contact point first.

    Parameters
    ----------
    preview
        Preview of a case.

    Returns
    -------
    list of dict
        Profile, y (mm), and distance (mm) from the first contact point along the profile.
    """
    junctions = [
        {
            "profile": placed_junction.profile.kind,
            "y_mm": placed_junction.junction.y_mm,
            "distance_mm": placed_junction.s_mm,
        }
        for placed_junction in preview.placement.junctions
    ]
    return sorted(junctions, key=lambda junction: abs(junction["distance_mm"]))


def preview_lines(record: TableRecord) -> OutputLines:
    """Iterate over the lines of a preview.

    Parameters
    ----------
    record
        Record of the preview.

    Returns
    -------
    iterator of Table and str
        Contact points, ellipse, expected patch, junctions, elements and effort.
    """
    yield from pair_geometry_lines(record)
    (dx, ds), elements = record["element_size_mm"], record["elements"]
    for place, touch in enumerate(record["contact_points"], start=1):
        yield (
            f"contact point {place}: rail y {touch['rail_y_mm']:+.2f} mm, wheel y {touch['wheel_y_mm']:+.2f} mm,"
            f" contact angle {1e3 * touch['contact_angle_rad']:+.1f} mrad, gap {1e3 * touch['vertical_gap_mm']:.1f} um"
        )
    hertz, uncertainty = record["hertz"], record["uncertainty_of_profile"]
    uncertainty_part = "" if uncertainty is None else f"; {uncertainty_text(uncertainty)}"
    yield (
        f"Hertz: p0 {hertz['p_max_MPa']:.1f} MPa, a {hertz['a_mm']:.3f} mm, b {hertz['b_mm']:.3f} mm{uncertainty_part}"
    )
    x_low, x_high, s_low, s_high = (
        record["expected_patch"][f"{axis}_{end}_mm"] for axis in "xs" for end in ("low", "high")
    )
    yield (
        f"expected patch: {x_high - x_low:.2f} mm along x, {s_high - s_low:.2f} mm"
        f" across, between {s_low:+.2f} and {s_high:+.2f} mm from the contact point"
    )
    junctions_below = [junction for junction in record["junctions"] if s_low <= junction["distance_mm"] <= s_high]
    junctions_text = ", ".join(
        f"{junction['profile']} at {junction['distance_mm']:+.2f} mm" for junction in junctions_below
    )
    yield f"curvature junctions in the patch: {junctions_text or 'none'}"
    yield (
        f"elements {dx:.3g} by {ds:.3g} mm, {elements[0]} by {elements[1]} in the fine zone: about"
        f" {round(record['degrees_of_freedom'], -3)} unknowns, {record['cpu_seconds']:.0f} CPU s and"
        f" {record['memory_GB']:.1f} GB; more if the verdict is unresolved, up to {record['most_unknowns']} unknowns"
    )
    yield from note_lines(record["notes"])


def uncertainty_text(uncertainty: dict[str, float]) -> str:
    """Text on the uncertainty of Hertz that is due to measured profiles.

    Parameters
    ----------
    uncertainty
        Relative uncertainties of `p_max_MPa`, `a_mm` and `b_mm`; NaN if another profile variant does not come into
        contact.

    Returns
    -------
    str
        The text, in percent.
    """
    if any(np.isnan(value) for value in uncertainty.values()):
        return "the uncertainty is unknown, because at least one profile variant has no contact here"
    p, a, b = (100.0 * uncertainty[name] for name in ("p_max_MPa", "a_mm", "b_mm"))
    return f"uncertainty of the measured profiles: p0 ±{p:.2g} %, a ±{a:.2g} %, b ±{b:.2g} %"
