"""A case before it is solved, and the library profile that points are nearest to, in words."""

from __future__ import annotations

import numpy as np

from fecontact.outputs.records.preview import junctions_of
from fecontact.outputs.records.results import profile_notes
from fecontact.outputs.terminal.console import Lines, notes
from fecontact.profiles.recognition import Nearest
from fecontact.solving.preview import Preview


def preview_lines(seen: Preview) -> Lines:
    """A preview in lines."""
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
        f" more where the verdict is open, up to {seen.case.refine_degrees_of_freedom} unknowns"
    )
    yield from notes(profile_notes(seen.placement))


def uncertainty_text(part: dict[str, float]) -> str:
    """What measured profiles leave open of Hertz, in words."""
    if any(np.isnan(value) for value in part.values()):
        return "another line that the measured points allow does not come into contact here: Hertz is not known"
    p, a, b = (100.0 * part[name] for name in ("p_max_MPa", "a_mm", "b_mm"))
    return f"the measured profiles leave ±{p:.2g} % of p0, ±{a:.2g} % of a and ±{b:.2g} % of b open"


def nearest_text(found: list[Nearest]) -> str:
    """Which profile of the library measured points are, in words."""
    if not found:
        return "nearest library profile: none within 2 mm"
    best, turn = found[0], 1e3 * found[0].registration.turn_rad
    dy, dz = found[0].registration.shift
    rest = "".join(f"; then {one.name} ({one.usual_mm:.2g} mm)" for one in found[1:2])
    return (
        f"nearest library profile: {best.name}, turned by {turn:+.2f} mrad and moved by ({dy:+.3f}, {dz:+.3f}) mm; the"
        f" points are usually {best.usual_mm:.2g} mm off it, at most {best.farthest_mm:.2g} mm at y ="
        f" {best.at_y_mm:.1f} mm{rest}"
    )
