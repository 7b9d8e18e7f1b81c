"""Up to which load may Hertz be used at which lateral position: 60E1 1:40 with S1002, -6 to 6 mm, 10 to 150 kN.

The left wheel of a wheelset that rolls until both wheels touch; the right wheel is the left one at the opposite shift.
Reference: the finite elements of this package at every position and load, each on two meshes or more. Expected: Hertz
holds on the tread away from the junction R 300 / R 80 (-2 mm and less, 4 mm and more) up to a load at which the patch
grows across it, fails at all loads where two parts of the head carry the wheel at once (about 0 to 2 mm), and at the
gauge corner. Near -0.5 mm peak and area alone would let it hold again above a load at which it fails.

`python studies/09_applicability_map.py` makes the map: positions are solved in parallel, the factors of a position
serve all its loads, and the load limit of each position is found by bisection. `loads.csv` beside the map has every
solved load: `studies/figures/map.csv` is that of the README's map. `fecontact run` of this file solves the same
positions under one load.
"""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from fecontact.case import Case
from fecontact.regression.checks import Check, compare_discretisation

LOADS_KN = (10.0, 20.0, 50.0, 80.0, 100.0, 125.0, 150.0)
SHIFTS = "-6:6:0.5"
# Hertz's gap on the half-space, with 32 nodes per semi-axis: 0.01 % is reached.
DISCRETISATION_PERCENT = 0.05


def cases(quick: bool = False) -> list[Case]:
    """All positions under 100 kN, or three of them."""
    from fecontact.inputs.texts import parse_numbers

    shifts = (-4.0, 0.0, 4.0) if quick else parse_numbers(SHIFTS, "shifts")
    case_list = [Case(lateral_shift_mm=shift, roll="touching") for shift in shifts]
    return [replace(case, refine="never") for case in case_list] if quick else case_list


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Shifts by verdict, under the load of `cases`."""
    parts = []
    for verdict in ("HOLDS", "FAILS", "UNRESOLVED"):
        shifts = [f"{float(row['lateral_shift_mm']):g}" for row in rows if row["verdict_answer"] == verdict]
        if shifts:
            parts.append(f"{verdict} at {', '.join(shifts)} mm")
    return f"Hertz under 100 kN: {'; '.join(parts)}. For all loads: python {Path(__file__).name}"


def map_arguments(quick: bool = False) -> list[str]:
    """Options of `fecontact map` for the whole map, or for three positions and two loads."""
    if quick:
        return ["--shifts", "-4,0,4", "--loads-kn", "50,100"]
    return ["--shifts", SHIFTS, "--loads-kn", ",".join(f"{load:g}" for load in LOADS_KN)]


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the lowest rung of the ladder, which is exact.

    The finite elements that the verdicts compare with have no independent reference.
    """
    return compare_discretisation(rows, DISCRETISATION_PERCENT)


def solved_loads(folder: Path) -> list[dict[str, Any]]:
    """Verdicts and deviations of Hertz at every load of a finished map.

    Rows are sorted by shift and load. Loads of the search for a limit have the verdict alone.
    """
    from fecontact.files import read_json

    document = read_json(folder / "map.json")
    rows = [
        {
            "lateral_shift_mm": cell["lateral_shift_mm"],
            "load_kN": cell["load_N"] / 1e3,
            "status": cell["status"],
            "verdict": cell["verdict"]["answer"],
            "cause": cell["verdict"]["cause"],
            "p_max_percent": 1e2 * cell["theories"]["hertz"]["deviation"]["p_max_MPa"],
            "separate_load_percent": 1e2 * cell["theories"]["hertz"]["deviation"]["separate_load"],
        }
        for cell in document["cells"]
        if "verdict" in cell
    ]
    rows += [
        {
            "lateral_shift_mm": limit["lateral_shift_mm"],
            "load_kN": tried["load_N"] / 1e3,
            "status": "tried for the limit",
            "verdict": tried["verdict"],
        }
        for limit in document["limits"]
        for tried in limit["tried"]
    ]
    return sorted(rows, key=lambda row: (row["lateral_shift_mm"], row["load_kN"]))


def main() -> None:
    from fecontact.cli import main as fecontact
    from fecontact.outputs.tables import write_csv

    arguments = [argument for argument in sys.argv[1:] if argument != "--quick"]
    if "--out" not in arguments and "--help" not in arguments:
        arguments += ["--out", "out/09_applicability_map"]
    try:
        fecontact(["map", *map_arguments(quick="--quick" in sys.argv), *arguments])
    except SystemExit as end:
        # exit status 3: some cells have no usable result
        if end.code in (0, 3) and "--out" in arguments:
            folder = Path(arguments[arguments.index("--out") + 1])
            write_csv(solved_loads(folder), folder / "loads.csv")
        raise


if __name__ == "__main__":
    main()
