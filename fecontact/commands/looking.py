"""Commands that solve nothing: profiles, meshes, Hertz, theories."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from fecontact import feature_registry
from fecontact.case import describe_unusual_inputs
from fecontact.console.messages import announce, print_geometry, print_notes, reporting_replaced_files
from fecontact.console.options import CONTACT_GROUPS, POSITION_GROUPS, CaseOptions, GridOptions, add_case_options
from fecontact.console.progress import show_job_progress
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text, parse_numbers, quote_path
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.codes import find_code_to_set
from fecontact.outputs.terminal import print_answer, print_page, print_parts


@add_case_options(*POSITION_GROUPS, "irregular")
def hertz(*, options: CaseOptions, json: bool = False, set_in: str | None = None) -> int:
    """Compute Hertz's ellipse at the contact points; analytic (no mesh, no gmsh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    set_in
        Vehicle-dynamics code, such as CONTACT, SIMPACK or UM: print the numbers to set there, too.
    """
    from fecontact.outputs.code_settings import settings_lines, settings_of_hertz
    from fecontact.outputs.hertz_terminal import hertz_lines
    from fecontact.runs.alone import hertz as hertz_of

    code, case = find_code_to_set(set_in, json=json), options.case()
    print_notes(describe_unusual_inputs([case]))
    record = hertz_of(case)
    print_answer(record, hertz_lines, json=json)
    if code is not None:
        print_parts(settings_lines(code, settings_of_hertz(case, record)))
    return 0


@add_case_options(*POSITION_GROUPS, "irregular", "yield", "mesh", "solution")
def place(*, options: CaseOptions, out: Path | None = None, json: bool = False) -> int:
    """Preview a case: contact points, curvatures, expected patch and mesh, time and memory (no gmsh).

    Parameters
    ----------
    out
        File for a picture of the placed pair and the curvatures near its contact (.png or .svg; both are written).
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.files import require_ending
    from fecontact.outputs.figures.position import draw_preview
    from fecontact.outputs.preview import preview_lines, preview_record
    from fecontact.outputs.style import PICTURE_ENDINGS
    from fecontact.solving.preview import preview_case

    if out is not None:
        require_ending(out, PICTURE_ENDINGS, "picture")
    case = options.case()
    print_notes(describe_unusual_inputs([case]))
    case_preview = preview_case(case)
    print_answer(preview_record(case_preview), preview_lines, json=json)
    if out is not None:
        with reporting_replaced_files(out):
            draw_preview(case_preview, out)
        print(f"picture: {quote_path(out)}", file=sys.stderr if json else sys.stdout)
    return 0


# the table has a list of shifts, determines the roll, and shows both sides
@add_case_options("pair", "wheelset", "profiles")
def geometry(
    *,
    options: CaseOptions,
    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)] = "-8:8:0.5",
    loaded_kn: float | None = None,
    json: bool = False,
    out: Path | None = None,
) -> int:
    """List contact points, rolling radii and equivalent conicity of a rigid wheelset by lateral shift (no mesh).

    Parameters
    ----------
    shifts
        Lateral shifts in mm, positive towards the left rail: numbers and ranges FROM:TO:STEP, separated by commas.
    loaded_kn
        Vertical wheel load in kN; with it, the conicity of the loaded wheelset is added, computed from the centres of
        pressure of overlapping strips and of the half-space.
    json
        Print the table as JSON and nothing else.
    out
        File for the picture (.png or .svg; both are written) or for the table (.csv), which has a row per shift with
        the contact points of both wheels.
    """
    from fecontact.files import require_ending
    from fecontact.outputs.geometry import contact_functions_lines, contact_functions_record, contact_functions_rows
    from fecontact.outputs.style import PICTURE_ENDINGS
    from fecontact.outputs.tables import TABLE_ENDINGS, write_csv
    from fecontact.solving.wheelset_geometry import geometry as wheelset_geometry

    if out is not None:
        require_ending(out, (*PICTURE_ENDINGS, *TABLE_ENDINGS), "picture or table")
    case = options.case()
    contact_functions = wheelset_geometry(case, parse_numbers(shifts, "shifts"))
    record = contact_functions_record(case, contact_functions)
    as_table = out is not None and out.suffix.lower() in TABLE_ENDINGS
    with reporting_replaced_files(out):
        if out is not None and as_table:
            write_csv(contact_functions_rows(record), out)
        elif out is not None:
            from fecontact.outputs.geometry import draw_contact_functions

            draw_contact_functions(case, contact_functions, out)
    if loaded_kn is not None:
        conicities = feature_registry.load_single_offer("LOADED_CONICITIES", "--loaded-kn")
        announce("the loaded wheelset takes about 15 s")
        with show_job_progress("shifts") as progress:
            record["loaded_conicity"] = conicities(case, 1e3 * loaded_kn, progress=progress)
    print_answer(record, contact_functions_lines, json=json, **{"table" if as_table else "picture": out})
    return 0


# CPU seconds of a contact table: for its start, for each position, and for each row. Measured: 13 rows 4.9 s and 52
# rows 8.5 s at 13 positions of S1002 on 60E1; 14 rows 4.7 s at 7 positions with a yaw, and 5.4 s on a measured pair.
_TABLE_START_S, _TABLE_POSITION_S, _TABLE_ROW_S = 2.0, 0.13, 0.09

# --- Commands on theories without a mesh: their list, a theory at a position, and tables for vehicle codes.


def theories(*, in_: Annotated[str | None, Parameter(name="--in")] = None, json: bool = False) -> int:
    """List theories of the pressure and laws of creep forces: cost, source, range, differences from the source.

    Parameters
    ----------
    in_
        Vehicle-dynamics code, such as CONTACT, SIMPACK or UM: list how this code calls and sets each theory of the
        pressure instead; all for the page of all codes.
    json
        Print the list as JSON and nothing else.
    """
    from fecontact.outputs.code_pages import code_lines, code_record, codes_page
    from fecontact.outputs.codes import find_code, read_codes
    from fecontact.outputs.theory_alone import theories_lines
    from fecontact.runs.alone import theories as listed

    if in_ is None:
        print_answer(listed(), theories_lines, json=json)
    elif in_.lower() == "all":
        records = {name: code_record(code) for name, code in read_codes().items()}
        if json:
            print_answer(records, lambda _: [], json=True)
        else:
            from fecontact.guide.pages import remove_links

            print_page(codes_page(), remove_links)
    else:
        code = find_code(in_, "--in")
        print_answer(code_record(code), lambda _: code_lines(code), json=json)
    return 0


def keys(*, json: bool = False) -> int:
    """List the keys of result.json and the columns of study.csv: the data dictionary.

    Parameters
    ----------
    json
        Print the JSON schema of result.json instead.
    """
    from fecontact.files import format_json
    from fecontact.guide.pages import remove_links
    from fecontact.outputs.records.data_dictionary import dictionary_page
    from fecontact.outputs.records.result_schema import result_schema

    if json:
        print(format_json(result_schema()))
    else:
        print_page(dictionary_page(), remove_links)
    return 0


@add_case_options(*POSITION_GROUPS, "irregular")
def theory(name: str, /, *, options: CaseOptions, json: bool = False, set_in: str | None = None) -> int:
    """Evaluate a theory of the pressure at a position: peak, area, half-widths, approach (no mesh, no gmsh).

    Parameters
    ----------
    name
        Name, from `fecontact theories`: hertz, multi_hertz, kik_piotrowski, analyn, strip, half_space, ...
    json
        Print the result as JSON and nothing else.
    set_in
        Vehicle-dynamics code, such as CONTACT, SIMPACK or UM: print the setting of this theory and the numbers to set
        there, too.
    """
    from fecontact.outputs.code_settings import settings_lines, settings_of_theory
    from fecontact.outputs.theory_alone import theory_lines
    from fecontact.runs.alone import theory as alone

    code, case = find_code_to_set(set_in, json=json), options.case()
    print_notes(describe_unusual_inputs([case]))
    record = alone(case, name)
    print_answer(record, theory_lines, json=json)
    if code is not None:
        print_parts(settings_lines(code, settings_of_theory(case, record)))
    return 0 if record["status"] == "solved" else 3


@add_case_options(*CONTACT_GROUPS, "verdict", "creep")
def table(
    *,
    options: CaseOptions,
    grid: GridOptions,
    yaws_mrad: Annotated[str | None, Parameter(name="--yaws-mrad", allow_leading_hyphen=True)] = None,
    accuracy_percent: Annotated[float | None, Parameter(name="--accuracy-percent")] = None,
    out: Path | None = None,
    map_: Annotated[Path | None, Parameter(name="--map")] = None,
    json: bool = False,
) -> int:
    """Compute a contact table for a vehicle code: contact points, patches, stiffness by shift, yaw, load (no mesh).

    The wheelset rolls until both wheels touch, unless a roll is given.

    Parameters
    ----------
    yaws_mrad
        Yaws of the wheelset in mrad, in the form of the shifts, such as -10,0,10; if not given, the yaw of --yaw-mrad.
    accuracy_percent
        Accuracy of linear interpolation between shifts in %, such as 2: steps of the shift, which are checked at least
        every 0.125 mm, are halved where it is not reached, down to 0.01 mm; intervals with remaining jumps are listed.
    out
        File for the table, CSV (.csv) or NetCDF (.nc). Units are in the names of the columns.
    map_
        Folder of a map of the same contact; its verdicts are added to rows with equal shift, yaw and load.
    json
        Print the table as JSON and nothing else.
    """
    from fecontact.files import require_ending
    from fecontact.outputs.alone import contact_table_lines
    from fecontact.outputs.table_grid import NETCDF_ENDING, arrange_table, write_netcdf
    from fecontact.outputs.tables import TABLE_ENDINGS, write_csv
    from fecontact.runs.alone import table as made_table

    if out is not None:
        require_ending(out, (*TABLE_ENDINGS, NETCDF_ENDING), "table")
    case, positions, loads_N = options.case(), grid.shifts_mm, grid.loads_N
    yaws = None if yaws_mrad is None else parse_numbers(yaws_mrad, "yaws")
    yaws_rad = [case.yaw_rad] if yaws is None else [yaw_mrad / 1e3 for yaw_mrad in yaws]
    print_notes(
        describe_unusual_inputs(
            [replace(case, load_N=load_N, yaw_rad=yaw_rad) for yaw_rad in yaws_rad for load_N in loads_N]
        )
    )
    print_geometry([replace(case, lateral_shift_mm=shift) for shift in positions])
    places = len(positions) * len(yaws_rad)
    lines = places * len(loads_N)
    seconds = _TABLE_START_S + _TABLE_POSITION_S * places + _TABLE_ROW_S * lines
    further_rows = "" if accuracy_percent is None else "; more rows for the accuracy"
    announce(f"{count_text(lines, 'row')}: about {format_duration(seconds)}{further_rows}")
    with show_job_progress("rows") as progress:
        rows = made_table(
            case,
            positions,
            loads_N,
            yaws_mrad=yaws,
            accuracy_percent=accuracy_percent,
            map_folder=map_,
            progress=progress,
        )
    if out is not None:
        with reporting_replaced_files(out):
            if out.suffix.lower() == NETCDF_ENDING:
                write_netcdf(arrange_table(rows, case), out)
            else:
                write_csv(rows, out)
    stored = "the table (--out FILE)" if out is None else quote_path(out)
    print_answer(rows, partial(contact_table_lines, stored=stored), json=json, table=out)
    return 3 if any(row["problem"] for row in rows) else 0


# --- Commands on the parts of a case: its profiles, and the meshes of its bodies.


@add_case_options("profiles")
def profiles(
    name: str | None = None,
    *,
    options: CaseOptions,
    kind: Literal["rail", "wheel"] | None = None,
    out: Path | None = None,
    write: Path | None = None,
    library: Path | None = None,
    examples: Path | None = None,
    force: bool = False,
    json: bool = False,
) -> int:
    """List the profile library, or show a profile and plot it with its curvature.

    Parameters
    ----------
    name
        Library name or profile file.
    kind
        Kind of the profile; if not given, a rail if the file can be read as a rail.
    out
        File for a picture (.png or .svg; both are written).
    write
        File into which the profile is written: columns of points (.csv), or for a name of the library its radii and
        segments with comments (.toml).
    library
        Folder of your profiles.
    examples
        Folder for example files, a worn rail and a worn wheel with measurement noise: rail.csv, wheel.csv, and the
        wheel as a MiniProf file, wheel.whl.
    force
        Let --examples overwrite existing files that have different content.
    json
        Print the list, or the profile, as JSON and nothing else.
    """
    from fecontact.files import require_ending, write_text
    from fecontact.outputs.profiles import draw_profile, library_lines, library_record, profile_lines, profile_record
    from fecontact.outputs.style import PICTURE_ENDINGS
    from fecontact.profiles.library import find_in_folder, refuse_unknown_profile
    from fecontact.profiles.recognition import find_nearest_profiles
    from fecontact.profiles.resolve import (
        WrongKindError,
        header_of_file,
        looks_like_wheel,
        refuse_unused_reading,
        resolve_rail,
        resolve_wheel,
    )
    from fecontact.profiles.writers import WRITTEN_ENDINGS, write_profile_text

    if write is not None:
        require_ending(write, WRITTEN_ENDINGS, "profile")
    if out is not None:
        require_ending(out, PICTURE_ENDINGS, "picture")
    if examples is not None:
        from fecontact.profiles.examples import write_examples

        written_files = write_examples(examples, force=force, with_miniprof=True)
        print("\n".join(f"written: {quote_path(path)}" for path in written_files))
        return 0
    if force:
        raise InputError("--force is given without --examples, where it has no effect; give --examples FOLDER")
    if name is None:
        print_answer(library_record(library), library_lines, json=json)
        return 0
    case = options.case()
    profile_file = name if library is None else find_in_folder(name, library)
    refuse_unknown_profile(profile_file, kind)
    read_wheel = partial(resolve_wheel, profile_file, case.wheel_file)
    try:
        profile = read_wheel().profile if kind == "wheel" else resolve_rail(profile_file, case.rail_file)
    except InputError as rail_error:
        if kind is not None:
            raise
        try:
            profile = read_wheel().profile
        except InputError as wheel_error:
            # if the file is a wheel with an error, only the error of the wheel helps, not that the file is no rail
            is_wheel = isinstance(rail_error, WrongKindError) or looks_like_wheel(profile_file, case.wheel_file)
            raise (wheel_error if is_wheel else rail_error) from None
    refuse_unused_reading(profile.kind, (profile_file,), case.wheel_file if profile.kind == "wheel" else case.rail_file)
    close = [] if profile.points is None else find_nearest_profiles(profile.points, profile.kind)
    header = header_of_file(profile_file)
    with reporting_replaced_files(write):
        written_file = (
            None if write is None else write_text(write, write_profile_text(profile, profile_file, write.suffix))
        )
    with reporting_replaced_files(out):
        picture = None if out is None else draw_profile(profile, out)
    print_answer(
        profile_record(profile, close, header),
        lambda _: profile_lines(profile, close, header),
        json=json,
        picture=picture,
        written=written_file,
    )
    if out is None and not json:
        print("--out FILE.png draws the profile and its curvature")
    return 0


@add_case_options(*POSITION_GROUPS, "mesh")
def mesh(
    body: Literal["rail", "wheel", "both"],
    *,
    options: CaseOptions,
    out: Path,
    element: Literal["C3D8", "C3D8I"] = "C3D8",
) -> int:
    """Write the mesh of a body or of both bodies, refined near the contact of a position.

    Parameters
    ----------
    body
        Body; for both bodies, .inp is a deck that is ready to run, with materials, supports, contact and load.
    out
        File to write: .msh (gmsh 4.1), .inp (CalculiX, Abaqus) or .vtu.
    element
        Element type in .inp: C3D8, as in `solve`, or C3D8I with incompatible modes.
    """
    from fecontact.files import require_ending
    from fecontact.outputs.mesh_files import MESH_ENDINGS, write_mesh
    from fecontact.solving.case_meshes import MeshedPair, mesh_case, mesh_pair

    require_ending(out, MESH_ENDINGS, "mesh")
    case = options.case()
    print_notes(describe_unusual_inputs([case]))
    meshed = mesh_pair(case) if body == "both" else mesh_case(case, body)
    with reporting_replaced_files(out):
        write_mesh(meshed, out, element=element)
    for body_mesh in (meshed.rail, meshed.wheel) if isinstance(meshed, MeshedPair) else (meshed,):
        print(
            f"{quote_path(out)}: {body_mesh.name}, {len(body_mesh.points)} nodes, {len(body_mesh.hexes)} hexahedra,"
            f" surfaces {', '.join(body_mesh.surfaces)}" + ("; half of the body, x >= 0" if body_mesh.half else "")
        )
    return 0
