"""Profiles on the terminal: the library, and the segments and junctions of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fecontact.outputs.tables.table import Column, Table, TableRow, columns_of
from fecontact.outputs.terminal.console import print_notes, print_table, say, standard_console
from fecontact.profiles.curve import Profile, radius_mm, radius_text
from fecontact.profiles.segments import Arc, Line, Segment

if TYPE_CHECKING:
    from rich.console import Console


def print_library(*, folder: Path | None = None, console: Console | None = None) -> None:
    """Print the profiles of the library and files of a folder, and what else may be given in place of a name."""
    from fecontact.profiles.library import load, names

    console = console or standard_console()
    rows = []
    for name in names():
        profile = load(name)
        ends = (f"{end:.1f}" for end in profile.y_range_mm)
        cells = (name, profile.kind, *ends, str(len(profile.junctions)), profile.certainty, profile.source)
        rows.append(TableRow(cells=cells))
    for path in sorted(folder.iterdir()) if folder is not None and folder.is_dir() else ():
        if path.is_file():
            rows.append(TableRow(cells=(path.stem, "", "", "", "", "", f"file {path.name} of {folder}")))
    texts = ("name", "kind", "certainty")
    columns = columns_of("name", "kind", "y from\nmm", "y to\nmm", "junctions", "certainty", texts=texts)
    columns = [*columns, Column(heading="source", kind="text", wraps=True)]
    print_table(console, Table(title="Profile library", columns=columns, rows=rows))
    say(console, "Also: circle:R and arcs:R/R@D (rails), cylinder:R (wheel), all in mm, or the path of a profile file.")


def print_profile(profile: Profile, *, console: Console | None = None) -> None:
    """Print the segments and the junctions of a profile."""
    console = console or standard_console()
    low, high = profile.y_range_mm
    say(console, f"{profile.kind} {profile.name}: y from {low:.3f} to {high:.3f} mm, {profile.length_mm:.2f} mm long")
    if profile.source:
        say(console, f"source: {profile.source}")
    print_notes(profile.notes, console)
    print_table(console, segment_table(profile))
    print_table(console, junction_table(profile))


def junction_table(profile: Profile) -> Table:
    """Where the curvature jumps."""
    rows = []
    for junction in profile.junctions:
        radii = (radius_mm(one) for one in (junction.curvature_left_per_mm, junction.curvature_right_per_mm))
        cells = [f"{junction.y_mm:.4f}", f"{junction.z_mm:.4f}", *(radius_text(one, "{:.2f}") for one in radii)]
        rows.append(TableRow(cells=[*cells, f"{1e3 * junction.turn_rad:z.3f}"]))
    columns = columns_of("y mm", "z mm", "R before mm", "R after mm", "kink mrad")
    return Table(title="Junctions (radii positive where convex)", columns=columns, rows=rows)


def segment_table(profile: Profile) -> Table:
    """The segments of the running surface."""
    import numpy as np

    rows = []
    for number, segment in enumerate(profile.segments, start=1):
        ends = segment.evaluate(np.array([0.0, 1.0]))
        positions = (f"{float(value):.4f}" for value in (*ends.y, *ends.z))
        cells = (str(number), type(segment).__name__.lower(), *positions, _segment_radius(segment))
        rows.append(TableRow(cells=cells))
    columns = columns_of("segment", "kind", "y from mm", "y to mm", "z from mm", "z to mm", "R mm", texts=("kind",))
    return Table(title="Running surface, from the gauge side to the field side", columns=columns, rows=rows)


def _segment_radius(segment: Segment) -> str:
    if isinstance(segment, Line | Arc):
        return radius_text(segment.radius if isinstance(segment, Arc) else None, "{:.4g}")
    return "varies"
