"""Commands that need no mesh: Hertz, creep forces, a case before it is solved, the geometry of a wheelset."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from cyclopts import Parameter

from fecontact.case import IRREGULAR, unusual
from fecontact.console import tell_notes
from fecontact.material import OF_YIELDING
from fecontact.options import CaseOptions, options_of
from fecontact.outputs.terminal.console import answer

# no stress is looked at, and nothing is solved
_OF_HERTZ = options_of("place", "profiles", "load", "material", without=OF_YIELDING)
_OF_PLACE = options_of("place", "profiles", "load", "material", "solution")
# a table has a list of shifts, finds the roll, and shows both sides
_OF_TRACK = options_of(
    *("place", "profiles"),
    without=("lateral_shift_mm", "roll", "roll_rad", "roll_load_N", "wheel_load_N", "side", *IRREGULAR),
)
if TYPE_CHECKING:
    HertzOptions: TypeAlias = CaseOptions
    PlaceOptions: TypeAlias = CaseOptions
    TrackOptions: TypeAlias = CaseOptions
else:
    HertzOptions = type(_OF_HERTZ)
    PlaceOptions = type(_OF_PLACE)
    TrackOptions = type(_OF_TRACK)


def hertz(options: HertzOptions = _OF_HERTZ, *, json: Annotated[bool, Parameter(negative="")] = False) -> int:
    """Hertz's ellipse at the touch points, analytic only (no mesh, no gmsh).

    Parameters
    ----------
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.terminal.hertz import hertz_lines
    from fecontact.runs.analytic import hertz as hertz_of

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
    normal_force_kn: Annotated[float, Parameter(name="--normal-force-kn")]
    friction: float
    xi: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    eta: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    spin_per_mm: Annotated[float, Parameter(allow_leading_hyphen=True)] = 0.0
    young_mpa: float = 210_000.0
    poisson: float = 0.3


def creep(
    ellipse: EllipseOptions, *, theory: str = "all", json: Annotated[bool, Parameter(negative="")] = False
) -> int:
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
    from fecontact.outputs.terminal.creep import ellipse_lines
    from fecontact.runs.analytic import creep as ellipse_forces

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


def place(
    options: PlaceOptions = _OF_PLACE,
    *,
    out: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """See a case before it is solved: touch points, curvatures, expected patch and mesh, time and memory. Without gmsh.

    Parameters
    ----------
    out
        File of a picture (.png or .svg; both are written) of the pair in position and the curvatures about its contact.
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.figures.preview import preview_figure
    from fecontact.outputs.records.preview import preview_record
    from fecontact.outputs.terminal.preview import preview_lines
    from fecontact.solving.preview import preview

    case = options.case()
    tell_notes(unusual([case]))
    seen = preview(case)
    answer(preview_record(seen), lambda _: preview_lines(seen), json=json)
    if out is not None:
        preview_figure(seen, out)
        print(f"picture: {out}", file=sys.stderr if json else sys.stdout)
    return 0


def geometry(
    options: TrackOptions = _OF_TRACK,
    *,
    shifts: Annotated[str, Parameter(allow_leading_hyphen=True)] = "-8:8:0.5",
    loaded_kn: Annotated[float | None, Parameter(name="--loaded-kn")] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
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
    from fecontact.inputs.texts import parse_numbers
    from fecontact.outputs.records.contact_functions import functions_record, functions_rows
    from fecontact.outputs.tables.csv_file import write_csv
    from fecontact.outputs.terminal.contact_functions import functions_lines
    from fecontact.runs.wheelset import geometry as wheelset_geometry

    case = options.case()
    found = wheelset_geometry(case, parse_numbers(shifts, "shifts"))
    record = functions_record(case, found)
    as_table = out is not None and out.suffix.lower() == ".csv"
    if out is not None and as_table:
        write_csv(functions_rows(record), out)
    elif out is not None:
        from fecontact.outputs.figures.contact_functions import functions_figure

        functions_figure(case, found, out)
    if loaded_kn is not None:
        from fecontact.runs.curving import loaded_conicities

        record["loaded_conicity"] = loaded_conicities(case, 1e3 * loaded_kn)
    answer(record, functions_lines, json=json, **{"table" if as_table else "picture": out})
    return 0
