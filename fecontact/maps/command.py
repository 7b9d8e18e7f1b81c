"""The command `fecontact map`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

from fecontact.case import Group, unusual
from fecontact.commands.console import logged, many, print_reasons, say, tell_geometry, tell_notes, width
from fecontact.commands.options import CaseOptions, GridOptions, takes
from fecontact.commands.solving import AS_USUAL, RunOptions, tell_cost, tell_files, tell_reused
from fecontact.outputs.terminal import count, show


# a map has lists of shifts and loads
@takes(*(group for group in get_args(Group) if group not in ("position", "load")))
def map_(
    *,
    options: CaseOptions,
    grid: GridOptions,
    out: Path,
    measure: str = "pressure",
    theory: str = "hertz",
    json: bool = False,
    how: RunOptions = AS_USUAL,
) -> int:
    """Map where Hertz holds over lateral shift and load, with the load up to which it holds at each shift.

    The wheelset rolls until both wheels touch, unless a roll is given: one map is both wheels, left at +y, right at -y.

    Parameters
    ----------
    out
        Folder for map.csv, contacts.csv (the theory to use, with its patches), stiffness.csv, map.json, map.png and
        map_theory.png (the cheapest theory of the pressure that holds; with friction also map_force.png, where Hertz
        holds for creep forces), written while it is made, and for each shift a folder in positions/ from which a later
        map with the same inputs and loads takes it. A folder of another map is refused; more shifts may be added.
    measure
        What the printed map is about: where the pressure holds; with --friction Hertz's creep force; or the cheapest
        theory that holds, with friction also the cheapest law of creep forces (map_law.csv, map_law.png).
    theory
        Theory of the pressure whose map is printed, and drawn as map_NAME.png; `fecontact theories` lists them.
    json
        Print what map.json has, and nothing else.
    """
    from fecontact.files import json_text
    from fecontact.maps.model import LOADS_FOR_LIMITS, MOST_TRIED
    from fecontact.maps.report import map_lines
    from fecontact.maps.running import prepare_for_map, run_map
    from fecontact.maps.telling import map_record
    from fecontact.maps.views import refuse_measure
    from fecontact.runs.cost import MAP_FILES_S

    settings, positions, case = how.settings(), grid.shifts_mm, options.case()
    refuse_measure(case, measure, theory)
    loads_N = grid.loads_N
    prepare_for_map(out, case, positions, loads_N, force=how.force)
    with logged(out / f"run{settings.part_suffix}.log"):
        cells = [replace(case, lateral_shift_mm=shift, load_N=load_N) for shift in positions for load_N in loads_N]
        tell_notes(unusual(cells))
        tell_geometry(cells)
        # the limits of one load are that load
        searched = len(positions) if len(loads_N) > 1 else 0
        further = (searched * LOADS_FOR_LIMITS, float(searched * MOST_TRIED))
        laws = measure == "theory"
        kept = out / "positions"
        tell_cost(cells, "cell", len(positions), kept, how, files=MAP_FILES_S, further=further, laws=laws)
        with many("positions", quiet=how.quiet) as progress:
            outcome = run_map(
                *(case, positions, loads_N, out), measure=measure, theory=theory, settings=settings, progress=progress
            )
        if json:
            print(json_text(map_record(outcome.made)), flush=True)
        how = replace(how, quiet=how.quiet or json)
        if not how.quiet:
            show(map_lines(outcome.made, measure, theory, width=width()))
        tell_reused(outcome.reused, outcome.recomputed, "position", how)
        lost = {
            f"{cell.lateral_shift_mm:+g} mm, {cell.load_N / 1e3:g} kN": str(cell.status)
            for cell in outcome.made.cells
            if not cell.usable
        }
        print_reasons(f"{len(lost)} of {count(len(outcome.made.cells), 'cell')} without a usable result", lost)
        pictures = sorted(path.name for path in out.glob("map*.png"))
        tell_files(out, ("report.html", "map.csv", "contacts.csv", "stiffness.csv", "map.json", *pictures), "", how)
        if how.part is None and not (out / "stiffness.csv").is_file():
            say("No stiffness.csv: a fit over the load needs three loads or more at a shift", quiet=how.quiet)
    return 0 if outcome.made.all_solved else 3
