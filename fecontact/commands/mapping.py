"""Commands `fecontact map` and `fecontact demo`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Annotated, get_args

from cyclopts import Parameter

from fecontact.case import Group, describe_unusual_inputs
from fecontact.commands.solving import tell_cost
from fecontact.console.log import log_command
from fecontact.console.messages import (
    announce,
    find_terminal_width,
    print_geometry,
    print_notes,
    print_reasons,
    print_result,
)
from fecontact.console.options import CaseOptions, GridOptions, add_case_options
from fecontact.console.progress import show_job_progress, show_progress_by_kind
from fecontact.console.run_messages import report_files, report_reused_jobs
from fecontact.console.run_options import DEFAULT_RUN_OPTIONS, RunOptions
from fecontact.inputs.texts import count_text, parse_numbers
from fecontact.outputs.terminal import print_parts
from fecontact.packages import require_finite_elements


# a map has lists of shifts and loads
@add_case_options(*(group for group in get_args(Group) if group not in ("position", "load")))
def map_(
    *,
    options: CaseOptions,
    grid: GridOptions,
    out: Path,
    yaws_mrad: Annotated[str | None, Parameter(name="--yaws-mrad", allow_leading_hyphen=True)] = None,
    measure: str = "pressure",
    theory: str = "hertz",
    json: bool = False,
    how: RunOptions = DEFAULT_RUN_OPTIONS,
) -> int:
    """Map where Hertz holds over lateral shift and load, and find the load limit at each shift.

    The wheelset rolls until both wheels touch, unless a roll is given. For a symmetric wheelset, the cell at shift -y
    is the right wheel at shift y.

    Parameters
    ----------
    out
        Folder for report.html, map.csv, contacts.csv, stiffness.csv, map.json and pictures. The same command resumes an
        interrupted map, and you can add shifts and yaws. A folder of a different map is refused.
    yaws_mrad
        Yaws of the wheelset in mrad, such as 0,5,10: a map for each yaw, and where the verdict changes; if not given,
        the yaw of --yaw-mrad.
    measure
        Content of the printed map: pressure (where Hertz holds), theory (cheapest theory that holds), with --friction
        force (where Hertz's creep force holds) or t_gamma (error of Hertz's T-gamma).
    theory
        Theory of the pressure for the printed map, also drawn as map_NAME.png; `fecontact theories` lists all names.
    json
        Print the content of map.json and nothing else.
    """
    from fecontact.files import format_json
    from fecontact.maps.load_limits import LOADS_FOR_LIMITS, MOST_FURTHER_LOADS
    from fecontact.maps.report import format_map_lines
    from fecontact.maps.views import refuse_measure
    from fecontact.maps.yaw_map import name_cells, require_yaws_rad
    from fecontact.maps.yaw_records import build_result_record
    from fecontact.runs.cost import MAP_FILES_S
    from fecontact.runs.map_run import prepare_for_map, run_map

    require_finite_elements()
    settings, positions, case = how.settings(), grid.shifts_mm, options.case()
    refuse_measure(case, measure, theory)
    loads_N = grid.loads_N
    yaws = None if yaws_mrad is None else parse_numbers(yaws_mrad, "yaws", keep_repeated=True)
    yaws_rad = [case.yaw_rad] if yaws is None else require_yaws_rad(case, yaws)
    prepare_for_map(out, case, positions, loads_N, yaws_mrad=yaws, force=how.force)
    with log_command(out / f"run{settings.part_suffix}.log"):
        cells = [
            replace(case, yaw_rad=yaw_rad, lateral_shift_mm=shift, load_N=load_N)
            for yaw_rad in yaws_rad
            for shift in positions
            for load_N in loads_N
        ]
        places = len(positions) * len(yaws_rad)
        print_notes(describe_unusual_inputs(cells))
        print_geometry(cells)
        # the limits of a single load equal this load: no other loads are tried
        searched = places if len(loads_N) > 1 else 0
        further = (searched * LOADS_FOR_LIMITS, float(searched * MOST_FURTHER_LOADS))
        laws = measure == "theory"
        finished_positions = out / "positions"
        tell_cost(cells, "cell", places, finished_positions, how, files=MAP_FILES_S, further=further, laws=laws)
        with show_job_progress("positions", quiet=how.quiet) as progress:
            outcome = run_map(
                *(case, positions, loads_N, out),
                yaws_mrad=yaws,
                measure=measure,
                theory=theory,
                settings=settings,
                progress=progress,
            )
        if json:
            print(format_json(build_result_record(outcome.made)), flush=True)
        how = replace(how, quiet=how.quiet or json)
        if not how.quiet:
            print_parts(format_map_lines(outcome.made, measure, theory, width=find_terminal_width()))
        report_reused_jobs(outcome.reused, outcome.recomputed, "position", how)
        lost_cells = {name: cell.status for name, cell in name_cells(outcome.made).items() if not cell.usable}
        print_reasons(
            f"{len(lost_cells)} of {count_text(len(outcome.made.cells), 'cell')} without a usable result", lost_cells
        )
        pictures = sorted(path.name for path in out.glob("map*.png"))
        report_files(out, ("report.html", "map.csv", "contacts.csv", "stiffness.csv", "map.json", *pictures), "", how)
        if how.part is None and not (out / "stiffness.csv").is_file():
            print_result("No stiffness.csv: a fit over the load needs at least three loads at a shift", quiet=how.quiet)
    return 0 if outcome.made.all_solved else 3


def demo(*, out: Path = Path("out/demo"), force: bool = False) -> int:
    """Map where Hertz holds for S1002 on 60E1, and solve a sphere, for which Hertz is exact (less than a minute).

    Parameters
    ----------
    out
        Folder for the results: the files of a map, and in cases/ the files of two cases. The same command resumes an
        interrupted demo. A folder of a different map is refused.
    force
        Solve finished positions and cases again, and write into a folder with different results.
    """
    from fecontact.maps.report import DEFAULT_TEXT_WIDTH
    from fecontact.maps.views import format_map
    from fecontact.runs.demo import BASE_CASE, LOADS_N, SHIFTS_MM, run_demo
    from fecontact.runs.demo_answer import (
        list_files,
        write_answer_sentences,
        write_remedy_sentences,
        write_sphere_sentence,
    )
    from fecontact.runs.map_run import prepare_for_map

    require_finite_elements()
    how = RunOptions(force=force)
    prepare_for_map(out, BASE_CASE, SHIFTS_MM, LOADS_N, force=force)
    with log_command(out / "run.log"):
        announce(
            f"{BASE_CASE.wheel} on {BASE_CASE.rail}, {len(SHIFTS_MM)} shifts and {len(LOADS_N)} loads, and a sphere:"
            " less than a minute on two idle cores"
        )
        with show_progress_by_kind("positions", "cases") as progress:
            outcome = run_demo(
                out, settings=how.settings(), map_progress=progress["positions"], case_progress=progress["cases"]
            )
        print_parts([format_map(outcome.map, "pressure", width=find_terminal_width()), " "])
        report_reused_jobs(outcome.reused, outcome.recomputed, "job", how)
        print_reasons(f"{len(outcome.lost)} without a usable result", outcome.lost)
        sentences = (
            *write_answer_sentences(outcome.map),
            *write_remedy_sentences(outcome.map),
            write_sphere_sentence(outcome.sphere),
        )
        for line in (
            *(fill(sentence, find_terminal_width() or DEFAULT_TEXT_WIDTH) for sentence in sentences),
            "",
            *list_files(out, outcome),
        ):
            print_result(line)
    return 0 if outcome.all_converged else 3
