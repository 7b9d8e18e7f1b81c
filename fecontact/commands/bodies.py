"""Commands on what a case is made of: its profiles, and the meshes of its bodies."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

from fecontact.case import IRREGULAR, unusual
from fecontact.console import tell_notes
from fecontact.errors import InputError
from fecontact.material import OF_YIELDING
from fecontact.options import CaseOptions, options_of
from fecontact.outputs.terminal.console import show

_OF_FILE = options_of("profiles", without=("library",))
_OF_MESH = options_of(
    *("place", "profiles", "load", "material", "bodies", "solution"),
    without=(*OF_YIELDING, "name", "solver", "refine_degrees_of_freedom", *IRREGULAR),
)
if TYPE_CHECKING:
    from fecontact.profiles.curve import Profile

    FileOptions: TypeAlias = CaseOptions
    MeshOptions: TypeAlias = CaseOptions
else:
    FileOptions = type(_OF_FILE)
    MeshOptions = type(_OF_MESH)


def profiles(
    name: str | None = None,
    options: FileOptions = _OF_FILE,
    *,
    kind: Literal["rail", "wheel"] | None = None,
    out: Path | None = None,
    write: Path | None = None,
    library: Path | None = None,
) -> int:
    """List the profile library, or show one profile and plot its line and curvature.

    Parameters
    ----------
    name
        Library name or profile file.
    kind
        What the file is; if not given, a rail where it can be one.
    out
        File for the picture (.png or .svg; both are written); none is made if not given.
    write
        File of columns (.csv) to write the profile into.
    library
        Folder of profiles of your own.
    """
    from fecontact.files import write_text
    from fecontact.outputs.terminal.profile import library_lines, profile_lines
    from fecontact.profiles.library import in_folder
    from fecontact.profiles.resolve import resolve_rail, resolve_wheel
    from fecontact.profiles.writers import csv_text, refuse_other_endings

    if write is not None:
        refuse_other_endings(write)
    if name is None:
        show(library_lines(library))
        return 0
    case = options.case()
    found = name if library is None else in_folder(name, library)
    if kind is not None:
        profile = (
            resolve_rail(found, case.rail_file) if kind == "rail" else resolve_wheel(found, case.wheel_file).profile
        )
    else:
        try:
            profile = resolve_rail(found, case.rail_file)
        except InputError as as_rail:
            try:
                profile = resolve_wheel(found, case.wheel_file).profile
            except InputError:
                raise as_rail from None
    show(profile_lines(profile))
    _print_measured(profile)
    if out is None:
        print("--out FILE.png draws its line and curvature")
    else:
        print(f"picture: {_profile_picture(profile, out)}")
    if write is not None:
        print(f"written: {write_text(write, csv_text(profile))}")
    return 0


def _profile_picture(profile: Profile, path: Path) -> Path:
    """Line and curvature; with its points, where it was made from some."""
    from fecontact.outputs.figures.profile import profile_figure

    return profile_figure(profile, path)


def _print_measured(profile: Profile) -> None:
    """What the points behind a line say of it."""
    from fecontact.outputs.terminal.preview import nearest_text
    from fecontact.profiles.recognition import nearest

    if profile.points is not None:
        print(nearest_text(nearest(profile.points, profile.kind)))


def mesh(
    body: Literal["rail", "wheel", "both"],
    options: MeshOptions = _OF_MESH,
    *,
    out: Path,
    element: Literal["C3D8", "C3D8I"] = "C3D8",
) -> int:
    """Write the mesh of one body or both, refined about the contact of the given position.

    Parameters
    ----------
    body
        Which body; of both a .inp is a deck with materials, supports, contact and load, ready to run.
    out
        File to write: .msh (gmsh 4.1), .inp (CalculiX, Abaqus) or .vtu.
    element
        Type of the elements in .inp: C3D8 as `solve` has them, or C3D8I with incompatible modes.
    """
    from fecontact.outputs.meshes.files import write_mesh
    from fecontact.solving.meshed_case import MeshedPair, mesh_case, mesh_pair

    case = options.case()
    tell_notes(unusual([case]))
    meshed = mesh_pair(case) if body == "both" else mesh_case(case, body)
    write_mesh(meshed, out, element=element)
    for made in (meshed.rail, meshed.wheel) if isinstance(meshed, MeshedPair) else (meshed,):
        print(
            f"{out}: {made.name}, {len(made.points)} nodes, {len(made.hexes)} hexahedra, surfaces"
            f" {', '.join(made.surfaces)}" + ("; half of it, x >= 0" if made.half else "")
        )
    return 0
