"""Files to begin with: a study as TOML, and the same as a script."""

from __future__ import annotations

from pathlib import Path

from fecontact.errors import InputError
from fecontact.files import write_text

_TOML = """\
# A study of fecontact: lists are combined with each other, each [[case]] is a case of its own.
#   fecontact check cases.toml                  inputs, number of cases, about what time and memory
#   fecontact run cases.toml --out out          solves them; the same command goes on where it was stopped
# All keys, with units, ranges and defaults: fecontact solve --help-all (--load-kn is load_kN here)

rail = "60E1"                 # library name (fecontact profiles), circle:R, or a file: CSV, text, TOML
wheel = "S1002"               # library name, cylinder:R, or a file
inclination = "1:40"          # of the rail; "none" if its profile is canted already
load_kN = [50.0, 100.0]       # wheel load; a list, or a range such as "20:100:20"
lateral_shift_mm = [-4.0, 4.0]  # of the wheelset, positive towards this rail
# roll = "touching"           # of the wheelset: both wheels touch their rails, also without this line; or "loaded"
# roll_mrad = 0.4             # a roll that is given instead; 0.0 is one wheel alone, not rolled
# yaw_mrad = 0.0
resolution = "quick"          # quick, standard, fine; or element sizes along x and across such as [0.5, 0.4] in mm
# refine_degrees_of_freedom = 400000  # finer meshes while a verdict is open and these are not exceeded; 0: never
# evidence = true             # also until the elements' own nodes know the verdict by themselves

[criteria]                    # Hertz holds within these
p_max_percent = 5.0           # peak pressure
area_percent = 10.0           # area of the patch
judged_by = "all"             # or strength (peak alone), patch (area, a, b, centre), or measures by name
# theories_in_range = true    # name no theory that is out of its own range as the cheapest that holds

# [track]
# gauge_mm = 1435.0

# [rail_material]
# young_MPa = 210000.0
# yield_MPa = 500.0           # the first loading of virgin steel beside the elastic contact: fecontact guide plastic
# tangent_MPa = 0.0           # slope beyond it

# Shift and roll that were measured together are given in tables of their own, which take over all that stands above;
# then remove lateral_shift_mm above:
# [[case]]
# lateral_shift_mm = -4.0
# roll_mrad = 0.4
"""

_SCRIPT = '''\
"""Does Hertz hold where this wheel runs?  python study.py, or: fecontact run study.py --out out [--quick]"""

from pathlib import Path

from fecontact import Case
from fecontact.cli import run_script


def cases(quick: bool = False) -> list[Case]:
    """All cases of the study; lengths in mm, forces in N, angles in rad."""
    shifts = (-4.0, 4.0) if quick else (-6.0, -4.0, -2.0, 0.0, 2.0, 4.0)
    return [Case(rail="60E1", wheel="S1002", lateral_shift_mm=shift, load_N=100e3) for shift in shifts]


def conclude(rows: list[dict], out: Path) -> str:
    """What the rows of the table say, when all cases are solved."""
    holds = [row["lateral_shift_mm"] for row in rows if row["verdict_answer"] == "HOLDS"]
    return f"Hertz holds at {', '.join(f'{shift:g}' for shift in holds) or 'no'} mm"


if __name__ == "__main__":
    run_script(__file__)
'''

_FILES = {"cases.toml": _TOML, "study.py": _SCRIPT}


def write_templates(folder: Path) -> tuple[Path, ...]:
    """Write the files and return their paths, the TOML first.

    Raises
    ------
    InputError
        If one of them is there already; then nothing is written.
    """
    there = [str(folder / name) for name in _FILES if (folder / name).exists()]
    if there:
        raise InputError(f"{', '.join(there)}: there already; give another folder")
    return tuple(write_text(folder / name, text) for name, text in _FILES.items())
