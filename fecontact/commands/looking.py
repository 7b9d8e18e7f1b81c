"""Commands that solve nothing: profiles, meshes, Hertz, theories, creep forces, irregularities, curves."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from fecontact.bodies import OF_YIELDING
from fecontact.case import IRREGULAR, unusual
from fecontact.commands.console import many, tell_notes
from fecontact.commands.options import CaseOptions, GridOptions, takes
from fecontact.errors import InputError
from fecontact.inputs import parse_numbers
from fecontact.outputs.terminal import answer, show


# no stress is looked at, and nothing is solved
@takes("place", "profiles", "load", "material", without=OF_YIELDING)
def hertz(*, options: CaseOptions, json: bool = False) -> int:
    """Hertz's ellipse at the touch points, analytic only (no mesh, no gmsh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.cases import hertz_lines
    from fecontact.runs.alone import hertz as hertz_of

    case = options.case()
    tell_notes(unusual([case]))
    answer(hertz_of(case), hertz_lines, json=json)
    return 0


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class EllipseOptions:
    """An ellipse that rolls.

    Attributes
    ----------
    a_mm
        Semi-axis along the rolling direction in mm.
    b_mm
        Semi-axis across in mm.
    normal_force_kn
        Normal force in kN.
    friction
        Coefficient of friction, > 0.
    xi
        Longitudinal creepage, over the rolling speed.
    eta
        Lateral creepage.
    spin_per_mm
        Spin in 1/mm.
    young_mpa
        Young's modulus of both bodies in MPa.
    poisson
        Poisson's ratio of both bodies.
    """

    a_mm: float
    b_mm: float
    normal_force_kn: float
    friction: float
    xi: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    eta: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    spin_per_mm: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    young_mpa: float = 210_000.0
    poisson: float = 0.3


def creep(ellipse: EllipseOptions, *, theory: str = "all", json: bool = False) -> int:
    """Creep forces on an elliptic contact by every theory; analytic, no mesh, no gmsh.

    Forces are those on the wheel: x in the running direction, y to the field side, z up for the left wheel. Creepages
    are those of the wheel against the rail: positive xi gives negative Fx.

    Parameters
    ----------
    theory
        kalker, vermeulen_johnson, she, polach, fastsim, rolling_half_space, several with commas between, or all.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.cases import ellipse_lines
    from fecontact.runs.alone import creep as ellipse_forces

    record = ellipse_forces(
        a_mm=ellipse.a_mm,
        b_mm=ellipse.b_mm,
        normal_force_N=1e3 * ellipse.normal_force_kn,
        friction=ellipse.friction,
        creepages=(ellipse.xi, ellipse.eta, ellipse.spin_per_mm),
        young_MPa=ellipse.young_mpa,
        poisson=ellipse.poisson,
        theories=theory.split(","),
    )
    answer(record, ellipse_lines, json=json)
    return 0


@takes("place", "profiles", "load", "material", "solution")
def place(*, options: CaseOptions, out: Path | None = None, json: bool = False) -> int:
    """See a case before it is solved: touch points, curvatures, expected patch and mesh, time and memory. Without gmsh.

    Parameters
    ----------
    out
        File of a picture (.png or .svg; both are written) of the pair in position and the curvatures about its contact.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.alone import preview_lines, preview_record
    from fecontact.outputs.figures.position import preview_figure
    from fecontact.solving.position import preview

    case = options.case()
    tell_notes(unusual([case]))
    seen = preview(case)
    answer(preview_record(seen), lambda _: preview_lines(seen), json=json)
    if out is not None:
        preview_figure(seen, out)
        print(f"picture: {out}", file=sys.stderr if json else sys.stdout)
    return 0


# a table has a list of shifts, finds the roll, and shows both sides
@takes(
    *("place", "profiles"),
    without=("lateral_shift_mm", "roll", "roll_rad", "roll_load_N", "wheel_load_N", "side", *IRREGULAR),
)
def geometry(
    *,
    options: CaseOptions,
    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)] = "-8:8:0.5",
    loaded_kn: float | None = None,
    json: bool = False,
    out: Path | None = None,
) -> int:
    """Touch points of a rigid wheelset over its lateral shift, rolling radii and equivalent conicity (no mesh).

    Parameters
    ----------
    shifts
        Lateral shifts in mm, positive towards the left rail: numbers and ranges FROM:TO:STEP, separated by commas.
    loaded_kn
        Vertical load of a wheel in kN: the conicity of the loaded wheelset too, by the centres of pressure of
        overlapping strips and of the half-space.
    json
        Print the table as JSON and nothing else.
    out
        File of the picture (.png or .svg; both are written), or of the table (.csv): a line a shift, with the touch
        points of both wheels.
    """
    from fecontact.outputs.geometry import functions_lines, functions_record, functions_rows
    from fecontact.outputs.tables import write_csv
    from fecontact.solving.placing import geometry as wheelset_geometry

    case = options.case()
    found = wheelset_geometry(case, parse_numbers(shifts, "shifts"))
    record = functions_record(case, found)
    as_table = out is not None and out.suffix.lower() == ".csv"
    if out is not None and as_table:
        write_csv(functions_rows(record), out)
    elif out is not None:
        from fecontact.outputs.geometry import functions_figure

        functions_figure(case, found, out)
    if loaded_kn is not None:
        from fecontact.runs.alone import loaded_conicities

        record["loaded_conicity"] = loaded_conicities(case, 1e3 * loaded_kn)
    answer(record, functions_lines, json=json, **{"table" if as_table else "picture": out})
    return 0


# --- Commands on theories without any mesh: which there are, one of them at a position, and tables for vehicle codes.


def theories(*, json: bool = False) -> int:
    """List the theories of the pressure and the laws of creep forces: cost, source, range, what differs from it.

    Parameters
    ----------
    json
        Print the list as JSON and nothing else.
    """
    from fecontact.outputs.alone import theories_lines
    from fecontact.runs.alone import theories as listed

    answer(listed(), theories_lines, json=json)
    return 0


# no stress is looked at, and nothing is meshed
@takes("place", "profiles", "load", "material", without=OF_YIELDING)
def theory(name: str, /, *, options: CaseOptions, json: bool = False) -> int:
    """One theory of the pressure at a position: peak, area, half-widths, approach (no mesh, no gmsh).

    Parameters
    ----------
    name
        As `fecontact theories` lists them: hertz, multi_hertz, kik_piotrowski, analyn, strip, half_space, ...
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.alone import alone_lines
    from fecontact.runs.alone import theory as alone

    case = options.case()
    tell_notes(unusual([case]))
    record = alone(case, name)
    answer(record, alone_lines, json=json)
    return 0 if record["status"] == "solved" else 3


# a table has lists of these two
@takes(
    *("place", "profiles", "load", "material", "verdict"),
    without=("lateral_shift_mm", "load_N", *OF_YIELDING, *IRREGULAR),
)
def table(
    *,
    options: CaseOptions,
    grid: GridOptions,
    out: Path | None = None,
    map_: Annotated[Path | None, Parameter(name="--map")] = None,
    json: bool = False,
) -> int:
    """Contact table for a vehicle code, over shift and load: touch points, ellipses, strips, stiffness (no mesh).

    The wheelset rolls until both wheels touch, unless a roll is given.

    Parameters
    ----------
    out
        File for the table as CSV, with units in the names of its columns.
    map_
        Folder of a map of the same contact, whose verdicts are added at the same shifts and loads.
    json
        Print the table as JSON and nothing else.
    """
    from fecontact.outputs.alone import contact_table_lines
    from fecontact.outputs.tables import write_csv
    from fecontact.runs.alone import table as made_table

    case, positions, loads_N = options.case(), grid.shifts_mm, grid.loads_N
    tell_notes(unusual([replace(case, load_N=load_N) for load_N in loads_N]))
    rows = made_table(case, positions, loads_N, map_folder=map_)
    if out is not None:
        write_csv(rows, out)
    answer(rows, contact_table_lines, json=json, table=out)
    return 3 if any(row["problem"] for row in rows) else 0


# --- Commands on what a case is made of: its profiles, and the meshes of its bodies.


@takes("profiles", without=("library",))
def profiles(
    name: str | None = None,
    *,
    options: CaseOptions,
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
    from fecontact.outputs.profiles import library_lines, profile_figure, profile_lines
    from fecontact.profiles.library import in_folder
    from fecontact.profiles.resolve import resolve_rail, resolve_wheel
    from fecontact.profiles.smoothing import nearest
    from fecontact.profiles.writers import csv_text, refuse_other_endings

    if write is not None:
        refuse_other_endings(write)
    if name is None:
        show(library_lines(library))
        return 0
    case = options.case()
    found = name if library is None else in_folder(name, library)
    as_wheel = partial(resolve_wheel, found, case.wheel_file)
    try:
        profile = as_wheel().profile if kind == "wheel" else resolve_rail(found, case.rail_file)
    except InputError as as_rail:
        if kind is not None:
            raise
        try:
            profile = as_wheel().profile
        except InputError:
            raise as_rail from None
    show(profile_lines(profile))
    if profile.points is not None:
        from fecontact.outputs.alone import nearest_text

        print(nearest_text(nearest(profile.points, profile.kind)))
    if out is None:
        print("--out FILE.png draws its line and curvature")
    else:
        print(f"picture: {profile_figure(profile, out)}")
    if write is not None:
        print(f"written: {write_text(write, csv_text(profile))}")
    return 0


@takes(
    *("place", "profiles", "load", "material", "bodies", "solution"),
    without=(*OF_YIELDING, "name", "solver", "refine_degrees_of_freedom", *IRREGULAR),
)
def mesh(
    body: Literal["rail", "wheel", "both"],
    *,
    options: CaseOptions,
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
    from fecontact.outputs.meshes import write_mesh
    from fecontact.solving.position import MeshedPair, mesh_case, mesh_pair

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


# --- Hertz's spring over an irregular wheel or rail: where models of it hold; no finite elements.


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class IrregularOptions:
    """What is irregular, and how models of it are judged.

    Attributes
    ----------
    wavelengths_mm
        Wavelengths of a map in mm: numbers and ranges FROM:TO:STEP, separated by commas, such as 10:200:10.
    amplitudes_um
        Amplitudes in micrometres, half of peak to valley, likewise.
    irregularity
        One irregularity instead: sine:wavelength_mm=30,amplitude_um=25, chord:length_mm=40,
        haversine:length_mm=52,depth_mm=0.4, or table:FILE,distance=mm,opening=um; missing material is positive.
    table
        A measured one: FILE,distance=mm,opening=um, or FILE alone if its heading has the units.
    positions_mm
        Positions along it in mm, likewise; without any all of it.
    limit_percent
        Error of force and peak up to which a model holds.
    workers
        Processes; without it one a core.
    """

    wavelengths_mm: str = ""
    amplitudes_um: str = ""
    irregularity: str = ""
    table: str = ""
    positions_mm: Annotated[str, Parameter(allow_leading_hyphen=True)] = ""
    limit_percent: float = 5.0
    workers: int | None = None


_NOTHING = IrregularOptions()


@takes("place", "profiles", "load", "material", without=("yaw_rad", *OF_YIELDING, *IRREGULAR))
def irregular(
    *,
    options: CaseOptions,
    asked: IrregularOptions = _NOTHING,
    json: bool = False,
    out: Path | None = None,
) -> int:
    """Hertz's spring over corrugation, flats and welds (eq. 6) and models like it beside the half-space (no mesh).

    Over wavelengths and amplitudes it is a map of which model holds; over one irregularity the force of each model.

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for irregular.json and irregular.png.
    """
    from fecontact.files import write_json
    from fecontact.jobs.workers import default_workers
    from fecontact.outputs.irregular import irregular_figure, irregular_lines
    from fecontact.runs.alone import irregular as judged

    if asked.irregularity and asked.table:
        raise InputError("irregular: give --irregularity or --table, not both")

    def numbers(text: str, name: str) -> tuple[float, ...]:
        return parse_numbers(text, name) if text else ()

    case, text = options.case(), f"table:{asked.table}" if asked.table else asked.irregularity
    tell_notes(unusual([case]))
    with many("cells" if not text else "places") as progress:
        record = judged(
            case,
            wavelengths_mm=numbers(asked.wavelengths_mm, "wavelengths"),
            amplitudes_mm=[1e-3 * one for one in numbers(asked.amplitudes_um, "amplitudes")],
            irregularity=text or None,
            positions_mm=numbers(asked.positions_mm, "positions"),
            limit=0.01 * asked.limit_percent,
            workers=default_workers() if asked.workers is None else asked.workers,
            progress=progress,
        )
    if out is not None:
        write_json(out / "irregular.json", record)
        irregular_figure(record, out / "irregular.png")
    answer(record, irregular_lines, json=json, written=out)
    solved = record["cells"] if "cells" in record else record["places"]
    return 3 if any(one["problem"] for one in solved) else 0


# --- A vehicle in curves: positions, angles of attack, guiding forces of all wheels; no finite elements.


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class CurveOptions:
    """A vehicle, and the curves that it runs through.

    Attributes
    ----------
    vehicle
        wheelset (free, 60 kN a wheel), manchester, metro, or a TOML file like those.
    bogie
        The leading or the trailing one of the vehicle.
    radii
        Radii in m: numbers and ranges FROM:TO:STEP, separated by commas; positive to the right, where the left wheels
        are the outer ones, negative to the left.
    theory
        Of the normal force: overlap (strips that carry their own overlap), or of those of `fecontact theories` hertz,
        multi_hertz, equivalent_ellipse, kik_piotrowski, stripes, analyn, kpec, strip, half_space; several with commas
        between, each of which is held against the last.
    friction
        Coefficient of friction, > 0.
    cant_mm
        Cant in mm over 1500 mm.
    unbalanced_m_s2
        Lateral acceleration in the plane of the track that cant leaves over, outwards, in m/s2; makes the speed.
    speed_km_h
        Speed in km/h, instead of that.
    shares
        Share of the way that each radius has, separated by commas, for what is told of the map; else equal ones.
    map
        Folder of a map of the same pair: where all wheels are on it, and which cheap theory holds there.
    workers
        Processes, one a theory.
    """

    vehicle: str = "manchester"
    bogie: str = "leading"
    radii: Annotated[str, Parameter(allow_leading_hyphen=True)] = "300,500,1000,3000"
    theory: str = "overlap"
    friction: float = 0.3
    cant_mm: float = 100.0
    unbalanced_m_s2: Annotated[float, Parameter(name="--unbalanced-m-s2", allow_leading_hyphen=True)] = 0.0
    speed_km_h: Annotated[float | None, Parameter(name="--speed-km-h")] = None
    shares: str = ""
    map: Path | None = None
    workers: int = 1

    def shared_radii(self) -> dict[float, float] | tuple[float, ...]:
        """Radii in m with the share of the way that each has; radii alone where one is there twice.

        Raises
        ------
        InputError
            If there are not as many shares as radii.
        """
        every = parse_numbers(self.radii, "radii")
        parts = parse_numbers(self.shares, "shares") if self.shares else [1.0] * len(every)
        if len(parts) != len(every):
            raise InputError(f"there are {len(parts)} shares for {len(every)} radii; give one number >= 0 for each")
        return dict(zip(every, parts, strict=True)) if len(set(every)) == len(every) else every


_AS_USUAL = CurveOptions()


@takes(
    *("place", "profiles", "material"),
    without=(
        *("lateral_shift_mm", "roll_rad", "yaw_rad", "roll", "roll_load_N", "wheel_load_N"),
        *("side", "flange_climb", *OF_YIELDING, "rolling_radius_mm"),
        *IRREGULAR,
    ),
)
def curve(*, options: CaseOptions, asked: CurveOptions = _AS_USUAL, json: bool = False, out: Path | None = None) -> int:
    """Steady running of a wheelset or a bogie in curves: shift, yaw, forces of all wheels, critical speed (no mesh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    out
        Folder for curve.csv, curve.json and pictures.
    """
    from fecontact.files import write_json
    from fecontact.outputs.curve import curve_rows, curves_figure, curves_lines, curves_record, visits_figure
    from fecontact.outputs.tables import write_csv
    from fecontact.runs.alone import curve as run_curves
    from fecontact.vehicle.curve import Conditions

    found = run_curves(
        asked.vehicle,
        asked.shared_radii(),
        case=options.case(),
        conditions=Conditions(
            friction=asked.friction,
            cant_mm=asked.cant_mm,
            unbalanced_m_s2=asked.unbalanced_m_s2,
            speed_km_h=asked.speed_km_h,
        ),
        theories=asked.theory.split(","),
        bogie=asked.bogie,
        map_folder=asked.map,
        workers=asked.workers,
    )
    record = curves_record(found)
    if out is not None:
        write_csv(curve_rows(found), out / "curve.csv")
        write_json(out / "curve.json", record)
        curves_figure(found, out / "curve.png")
        if found.cells:
            visits_figure(found, out / "curve_map.png")
    answer(record, lambda _: curves_lines(found), json=json, written=out)
    return 0 if all(run.status == "equilibrium" for runs in found.runs.values() for run in runs) else 3
