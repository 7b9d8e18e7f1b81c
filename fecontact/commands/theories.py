"""Commands on theories without any mesh: which there are, one of them at a position, and tables for vehicle codes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from cyclopts import Parameter

from fecontact.case import IRREGULAR, unusual
from fecontact.commands.grid import GridOptions
from fecontact.console import tell_notes
from fecontact.material import OF_YIELDING
from fecontact.options import CaseOptions, options_of
from fecontact.outputs.terminal.console import answer

# no stress is looked at, and nothing is meshed
_OF_THEORY = options_of("place", "profiles", "load", "material", without=OF_YIELDING)
# a table has lists of these two
_OF_TABLE = options_of(
    *("place", "profiles", "load", "material", "verdict"),
    without=("lateral_shift_mm", "load_N", *OF_YIELDING, *IRREGULAR),
)
if TYPE_CHECKING:
    TheoryOptions: TypeAlias = CaseOptions
    TableOptions: TypeAlias = CaseOptions
else:
    TheoryOptions = type(_OF_THEORY)
    TableOptions = type(_OF_TABLE)


def theories(*, json: Annotated[bool, Parameter(negative="")] = False) -> int:
    """List the theories of the pressure and the laws of creep forces: cost, source, range, what differs from it.

    Parameters
    ----------
    json
        Print the list as JSON and nothing else.
    """
    from fecontact.outputs.terminal.theories import theories_lines
    from fecontact.runs.analytic import theories as listed

    answer(listed(), theories_lines, json=json)
    return 0


def theory(
    name: str, /, options: TheoryOptions = _OF_THEORY, *, json: Annotated[bool, Parameter(negative="")] = False
) -> int:
    """One theory of the pressure at a position: peak, area, half-widths, approach (no mesh, no gmsh).

    Parameters
    ----------
    name
        As `fecontact theories` lists them: hertz, multi_hertz, kik_piotrowski, analyn, strip, half_space, ...
    json
        Print the result as JSON and nothing else.
    """
    from fecontact.outputs.terminal.theories import alone_lines
    from fecontact.runs.analytic import theory as alone

    case = options.case()
    tell_notes(unusual([case]))
    record = alone(case, name)
    answer(record, alone_lines, json=json)
    return 0 if record["status"] == "solved" else 3


def table(
    options: TableOptions = _OF_TABLE,
    *,
    grid: GridOptions,
    out: Path | None = None,
    map_: Annotated[Path | None, Parameter(name="--map")] = None,
    json: Annotated[bool, Parameter(negative="")] = False,
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
    from fecontact.outputs.tables.csv_file import write_csv
    from fecontact.outputs.terminal.contact_table import contact_table_lines
    from fecontact.runs.contact_table import table as made_table

    case, positions, loads_N = options.case(), grid.shifts_mm, grid.loads_N
    tell_notes(unusual([replace(case, load_N=load_N) for load_N in loads_N]))
    rows = made_table(case, positions, loads_N, map_folder=map_)
    if out is not None:
        write_csv(rows, out)
    answer(rows, contact_table_lines, json=json, table=out)
    return 3 if any(row["problem"] for row in rows) else 0
