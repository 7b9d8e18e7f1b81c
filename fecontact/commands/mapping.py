"""Commands `fecontact map` and `fecontact demo`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import get_args

from fecontact.case import Group, unusual
from fecontact.commands.solving import tell_cost
from fecontact.console.log import logged
from fecontact.console.messages import announce, print_reasons, say, tell_geometry, tell_notes, width
from fecontact.console.options import CaseOptions, GridOptions, takes
from fecontact.console.progress import many, several
from fecontact.console.run_messages import tell_files, tell_reused
from fecontact.console.run_options import AS_USUAL, RunOptions
from fecontact.outputs.terminal import count, show
from fecontact.packages import require_finite_elements


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
    from fecontact.maps.load_limits import LOADS_FOR_LIMITS, MOST_TRIED
    from fecontact.maps.report import map_lines
    from fecontact.maps.telling import map_record
    from fecontact.maps.views import refuse_measure
    from fecontact.runs.cost import MAP_FILES_S
    from fecontact.runs.map_run import prepare_for_map, run_map

    require_finite_elements()
    settings, positions, case = how.settings(), grid.shifts_mm, options.case()
    refuse_measure(case, measure, theory)
    loads_N = grid.loads_N
    prepare_for_map(out, case, positions, loads_N, force=how.force)
    with logged(out / f"run{settings.part_suffix}.log"):
        cells = [replace(case, lateral_shift_mm=shift, load_N=load_N) for shift in positions for load_N in loads_N]
        tell_notes(unusual(cells))
        tell_geometry(cells)
        # the limits of a single load equal this load: no other loads are tried
        searched = len(positions) if len(loads_N) > 1 else 0
        further = (searched * LOADS_FOR_LIMITS, float(searched * MOST_TRIED))
        laws = measure == "theory"
        finished_positions = out / "positions"
        tell_cost(cells, "cell", len(positions), finished_positions, how, files=MAP_FILES_S, further=further, laws=laws)
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
        lost_cells = {
            f"{cell.lateral_shift_mm:+g} mm, {cell.load_N / 1e3:g} kN": str(cell.status)
            for cell in outcome.made.cells
            if not cell.usable
        }
        print_reasons(
            f"{len(lost_cells)} of {count(len(outcome.made.cells), 'cell')} without a usable result", lost_cells
        )
        pictures = sorted(path.name for path in out.glob("map*.png"))
        tell_files(out, ("report.html", "map.csv", "contacts.csv", "stiffness.csv", "map.json", *pictures), "", how)
        if how.part is None and not (out / "stiffness.csv").is_file():
            say("No stiffness.csv: a fit over the load needs three loads or more at a shift", quiet=how.quiet)
    return 0 if outcome.made.all_solved else 3


def demo(*, out: Path = Path("out/demo"), force: bool = False) -> int:
    """Map where Hertz holds for S1002 on 60E1, and solve a sphere, for which Hertz is exact; less than a minute.

    Parameters
    ----------
    out
        Folder for the results: those of a map, and in cases/ the files of two cases. A folder of another map is
        refused; the same command resumes an interrupted demo.
    force
        Solve what is finished again, and write into a folder that holds other results.
    """
    from fecontact.maps.report import WIDE
    from fecontact.maps.views import map_text
    from fecontact.runs.demo import BASE, LOADS_N, SHIFTS_MM, run_demo
    from fecontact.runs.demo_answer import answer_sentences, file_lines, remedy_sentences, sphere_sentence
    from fecontact.runs.map_run import prepare_for_map

    require_finite_elements()
    how = RunOptions(force=force)
    prepare_for_map(out, BASE, SHIFTS_MM, LOADS_N, force=force)
    with logged(out / "run.log"):
        announce(
            f"{BASE.wheel} on {BASE.rail}, {len(SHIFTS_MM)} shifts and {len(LOADS_N)} loads, and a sphere:"
            " less than a minute on two idle cores"
        )
        with several("positions", "cases") as progress:
            outcome = run_demo(
                out, settings=how.settings(), map_progress=progress["positions"], case_progress=progress["cases"]
            )
        show([map_text(outcome.map, "pressure", width=width()), " "])
        tell_reused(outcome.reused, outcome.recomputed, "job", how)
        print_reasons(f"{len(outcome.lost)} without a usable result", outcome.lost)
        sentences = (*answer_sentences(outcome.map), *remedy_sentences(outcome.map), sphere_sentence(outcome.sphere))
        for line in (*(fill(sentence, width() or WIDE) for sentence in sentences), "", *file_lines(out, outcome)):
            say(line)
    return 0 if outcome.all_converged else 3
