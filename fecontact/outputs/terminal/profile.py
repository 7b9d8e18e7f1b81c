"""Profiles on the terminal: the library, and the segments and junctions of one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fecontact.outputs.tables.table import number, radius, table_of, text
from fecontact.outputs.terminal.console import Lines, notes
from fecontact.profiles.curve import Profile, radius_mm, radius_text
from fecontact.profiles.segments import Arc, Line, Segment

_LIBRARY = (
    text("name", "name"),
    text("kind", "kind"),
    number("y from\nmm", "low", "{:.1f}", none=""),
    number("y to\nmm", "high", "{:.1f}", none=""),
    text("junctions", "junctions", "number"),
    text("certainty", "certainty"),
    text("source", "source", wraps=True),
)
_JUNCTIONS = (
    number("y mm", lambda one: one.y_mm, "{:.4f}"),
    number("z mm", lambda one: one.z_mm, "{:.4f}"),
    radius("R before mm", lambda one: radius_mm(one.curvature_left_per_mm), "{:.2f}"),
    radius("R after mm", lambda one: radius_mm(one.curvature_right_per_mm), "{:.2f}"),
    number("kink mrad", lambda one: one.turn_rad, "{:z.3f}", 1e3),
)
_SEGMENTS = (
    text("segment", "number", "number"),
    text("kind", lambda one: type(one["segment"]).__name__.lower()),
    *(number(f"{name} mm", name, "{:.4f}") for name in ("y from", "y to", "z from", "z to")),
    text("R mm", lambda one: _segment_radius(one["segment"]), "number"),
)


def library_lines(folder: Path | None = None) -> Lines:
    """The profiles of the library and files of a folder, and what else may be given in place of a name."""
    from fecontact.profiles.library import load, names

    items: list[dict[str, Any]] = []
    for profile in map(load, names()):
        low, high = profile.y_range_mm
        own = {name: getattr(profile, name) for name in ("name", "kind", "certainty", "source")}
        items.append({**own, "low": low, "high": high, "junctions": len(profile.junctions)})
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            items.append({"name": path.stem, "source": f"file {path.name} of {folder}"})
    yield table_of("Profile library", _LIBRARY, items)
    yield "Also: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), all in mm, or the path of a profile file."


def profile_lines(profile: Profile) -> Lines:
    """The segments of a profile, and the junctions where its curvature jumps."""
    import numpy as np

    low, high = profile.y_range_mm
    yield f"{profile.kind} {profile.name}: y from {low:.3f} to {high:.3f} mm, {profile.length_mm:.2f} mm long"
    if profile.source:
        yield f"source: {profile.source}"
    yield from notes(profile.notes)
    items = []
    for place, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        where = dict(zip(("y from", "y to", "z from", "z to"), (*ends.y, *ends.z), strict=True))
        items.append({"number": place, "segment": segment, **where})
    yield table_of("Running surface, from the gauge side to the field side", _SEGMENTS, items)
    yield table_of("Junctions (radii positive where convex)", _JUNCTIONS, profile.junctions)


def _segment_radius(segment: Segment) -> str:
    if isinstance(segment, Line | Arc):
        return radius_text(segment.radius if isinstance(segment, Arc) else None, "{:.4g}")
    return "varies"
