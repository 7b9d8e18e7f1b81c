"""Commands on stored results, which solve nothing: judge, show, compare, and make a baseline."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fecontact.commands.solving import FORCES_S, LAWS_S
from fecontact.console.messages import find_terminal_width, reporting_replaced_files
from fecontact.console.options import CaseOptions, add_case_options
from fecontact.console.progress import show_job_progress
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text, quote_path
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.codes import find_code_to_set
from fecontact.outputs.terminal import print_answer, print_parts

if TYPE_CHECKING:
    from fecontact.runs.judging_again import Judged


# CPU seconds of a case or a cell without friction: 0.03 for a sphere, 0.1 for S1002 on 60E1, 0.5 with two lobes.
_JUDGED_S = 0.1


@add_case_options("verdict", "creep", of_stored_results=True)
def judge(
    folder: Path,
    *,
    options: CaseOptions,
    measure: str = "pressure",
    theory: str = "hertz",
    out: Path | None = None,
    json: bool = False,
    set_in: str | None = None,
    default_criteria: bool = False,
) -> int:
    """Judge stored results by different criteria, or with friction and creepages (no gmsh, no finite elements).

    An option changes only the value that it names; all other limits and criteria stay as they are stored. For stored
    own criteria alone, use --judged-by own.

    Parameters
    ----------
    folder
        Folder of a study, a map or a case; it is not changed.
    measure
        For a map, content of the printed map: pressure (where Hertz's pressure holds), theory (the cheapest theory that
        holds, with friction also the cheapest law of creep forces), with --friction force (where Hertz's creep force
        holds) or t_gamma (error of Hertz's T-gamma).
    theory
        For a map, theory of the pressure for the printed map, also drawn as map_NAME.png.
    out
        Folder for report.html, tables and pictures of the new verdicts: study.csv and study.json, or map.csv,
        contacts.csv, map.json, map.png and map_theory.png; with friction also map_force.png and map_t_gamma.png, and
        with --measure theory map_law.csv and map_law.png.
    json
        Print the new verdicts as JSON and nothing else.
    set_in
        Vehicle-dynamics code, such as CONTACT, SIMPACK or UM: for each case of a study, print the setting of the
        cheapest theory that holds and the numbers to set there, too.
    default_criteria
        Replace the stored criteria by the defaults, without own criteria, before the other options apply; with
        --friction also the stored creepages.
    """
    from fecontact.files import format_json
    from fecontact.outputs.code_settings import settings_lines
    from fecontact.regression.tables import load_table
    from fecontact.runs.judged_study import count_judging_processes
    from fecontact.runs.judging_again import judge as judge_stored
    from fecontact.runs.stored_settings import read_settings, refuse_map

    code = find_code_to_set(set_in, json=json)
    criteria: Any = options.list_values("criteria")
    creep: Any = options.list_values("creep")
    has_forces = "friction" in creep
    if default_criteria:
        case = options.case()
        criteria, creep = case.criteria.apply_change({"own": ()}), case.creep
    if code is not None:
        refuse_map(folder)

    def before(place_count: int) -> str:
        loads = len(load_table(folder).rows)
        seconds_per_load = (FORCES_S + LAWS_S * (measure == "theory")) if has_forces else _JUDGED_S
        seconds = seconds_per_load * loads / count_judging_processes(place_count, has_forces=has_forces)
        unit = "cell" if (folder / "map.json").is_file() else "case"
        return f"{count_text(loads, unit)}: about {format_duration(max(1.0, seconds))}"

    with reporting_replaced_files(out), show_job_progress("positions or cases", before=before) as progress:
        judged_results: Judged = judge_stored(
            folder, criteria, creep=creep, measure=measure, theory=theory, out=out, progress=progress
        )
    if json:
        print(format_json(judged_results.record))
    else:
        print_parts(judged_results.terminal_parts(find_terminal_width()))
    for problem in judged_results.problems:
        print(f"not judged: {problem}", file=sys.stderr)
    for note in judged_results.notes:
        print(f"note: {note}", file=sys.stderr)
    if not json:
        print(judged_results.words)
    if code is not None:
        for title, settings in read_settings(folder, criteria, creep):
            print_parts((f"{title}:", *settings_lines(code, settings)))
    return 0 if judged_results.all_judged else 3


def view(folder: Path) -> int:
    """Write view.py, which shows the contact in ParaView, into a folder of results.

    Parameters
    ----------
    folder
        Folder of results of `run` or `solve --out`.
    """
    from fecontact.outputs.paraview.view import write_view

    path = write_view(folder)
    print(f"{quote_path(path)}: open it with (cd {quote_path(path.parent)}; paraview --script={path.name})")
    return 0


def compare(
    baseline: Path,
    new: Path,
    *,
    match: str | None = None,
    tolerance: Path | None = None,
    out: Path | None = None,
    json: bool = False,
) -> int:
    """Compare two sets of results, case by case; exit code 1 if they differ by more than the tolerances.

    For two maps or two studies, it lists the verdicts of Hertz that differ, with their places and their number.

    Parameters
    ----------
    baseline
        Folder of results of `run`, `map` or `solve --out`, a study.json, study.csv, map.csv or row.json, or a CSV of
        studies/baselines.
    new
        New results, in any of the forms of BASELINE.
    match
        Columns by which cases are matched if their ids differ, such as shift,load: shift, load, roll, yaw, or the full
        name of any column.
    tolerance
        TOML file of relative and absolute tolerances, in tables [kinds.NAME] and [columns.NAME].
    out
        Folder for comparison.json, comparison.html, and comparison.png with both verdicts over shift and load.
    json
        Print the comparison as JSON and nothing else.
    """
    from fecontact.outputs.comparison.files import write_comparison
    from fecontact.outputs.comparison.record import comparison_record
    from fecontact.outputs.comparison.terminal import comparison_lines
    from fecontact.regression.compare import compare_tables
    from fecontact.regression.tables import load_table, read_tolerances

    tolerances = read_tolerances(tolerance) if tolerance is not None else None
    comparison = compare_tables(
        load_table(baseline), load_table(new), tolerances, match=() if match is None else match.split(",")
    )
    with reporting_replaced_files(out):
        folder = None if out is None else write_comparison(comparison, out)
    print_answer(comparison_record(comparison), lambda _: comparison_lines(comparison), json=json, comparison=folder)
    return 0 if comparison.same else 1


def baseline_update(
    study_result: Path,
    *,
    reason: str,
    baselines: Path | None = None,
    allow_failed: bool = False,
) -> int:
    """Make the results of a study its baseline, and print the changes.

    Parameters
    ----------
    study_result
        Folder of results of `run`.
    reason
        Reason why the new results are right; stored with the baseline.
    baselines
        Folder of the baselines; in a clone, the default is studies/baselines.
    allow_failed
        Accept cases that failed or did not converge.
    """
    from fecontact.outputs.comparison.terminal import comparison_lines
    from fecontact.regression.baselines import update_baseline

    folder = baselines or Path("studies/baselines")
    if baselines is None and not folder.is_dir():
        raise InputError(f"{folder} does not exist here; give the folder of your baselines: --baselines FOLDER")
    update = update_baseline(study_result, folder, reason=reason, allow_failed=allow_failed)
    if update.comparison is not None:
        print_parts(comparison_lines(update.comparison))
    print(f"{quote_path(update.path)}: {update.text}")
    return 0
