"""Profiles on the terminal: the library, and the segments and junctions of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.terminal import print_notes, say, standard_console, titled_table
from fecontact.profiles.curve import Profile, radius_mm, radius_text
from fecontact.profiles.segments import Arc, Line, Segment

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


def print_library(*, folder: Path | None = None, console: Console | None = None) -> None:
    """Print the profiles of the library and files of a folder, and what else may be given in place of a name."""
    from rich.text import Text

    from fecontact.profiles.library import load, names

    console = console or standard_console()
    table = titled_table(console, title="Profile library")
    for heading in ("name", "kind", "y from\nmm", "y to\nmm", "junctions", "certainty", "source"):
        table.add_column(heading, justify="left" if heading in ("name", "kind", "certainty", "source") else "right")
    for name in names():
        profile = load(name)
        low, high = profile.y_range_mm
        source = Text(profile.source)  # not as markup: sources may have brackets
        table.add_row(
            name, profile.kind, f"{low:.1f}", f"{high:.1f}", str(len(profile.junctions)), profile.certainty, source
        )
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            table.add_row(path.stem, "", "", "", "", "", Text(f"file {path.name} of {folder}"))
    console.print(table)
    say(console, "Also: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), all in mm, or the path of a profile file.")


def print_profile(profile: Profile, *, console: Console | None = None) -> None:
    """Print the segments and the junctions of a profile."""
    console = console or standard_console()
    low, high = profile.y_range_mm
    say(console, f"{profile.kind} {profile.name}: y from {low:.3f} to {high:.3f} mm, {profile.length_mm:.2f} mm long")
    if profile.source:
        say(console, f"source: {profile.source}")
    print_notes(profile.notes, console)
    console.print(_segment_table(profile, console))
    table = titled_table(console, title="Junctions (radii positive where convex)")
    for heading in ("y mm", "z mm", "R before mm", "R after mm", "kink mrad"):
        table.add_column(heading, justify="right")
    for junction in profile.junctions:
        curvatures = (junction.curvature_left_per_mm, junction.curvature_right_per_mm)
        radii = (radius_text(radius_mm(curvature), "{:.2f}") for curvature in curvatures)
        table.add_row(f"{junction.y_mm:.4f}", f"{junction.z_mm:.4f}", *radii, f"{1e3 * junction.turn_rad:z.3f}")
    console.print(table)


def _segment_table(profile: Profile, console: Console) -> Table:
    import numpy as np

    table = titled_table(console, title="Running surface, from the gauge side to the field side")
    for heading in ("segment", "kind", "y from mm", "y to mm", "z from mm", "z to mm", "R mm"):
        table.add_column(heading, justify="left" if heading == "kind" else "right")
    for number, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        positions = (f"{float(value):.4f}" for value in (*ends.y, *ends.z))
        table.add_row(str(number), type(segment).__name__.lower(), *positions, _segment_radius(segment))
    return table


def _segment_radius(segment: Segment) -> str:
    if isinstance(segment, Line | Arc):
        return radius_text(segment.radius if isinstance(segment, Arc) else None, "{:.4g}")
    return "varies"
