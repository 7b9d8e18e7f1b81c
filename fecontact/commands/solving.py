"""Commands that solve with finite elements: a case, a study, and the studies with references."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from fecontact.case import Case, Group, describe_unusual_inputs
from fecontact.console.log import log_command
from fecontact.console.messages import (
    announce,
    print_geometry,
    print_notes,
    print_reasons,
    print_result,
    write_to_log,
)
from fecontact.console.options import CaseOptions, add_case_options
from fecontact.console.progress import show_job_progress, show_solution_progress
from fecontact.console.run_messages import report_files, report_reused_jobs, report_unusable_rows
from fecontact.console.run_options import DEFAULT_RUN_OPTIONS, RunOptions
from fecontact.inputs.texts import count_text, quote_path
from fecontact.jobs.remaining import format_duration
from fecontact.outputs.codes import find_code_to_set
from fecontact.outputs.terminal import print_parts
from fecontact.packages import require_finite_elements
from fecontact.process import use_factor_threads

if TYPE_CHECKING:
    from fecontact.outputs.codes import VehicleCode
    from fecontact.solving.solve import CaseResult

# CPU seconds of the creep forces of a case or a cell, with the loads of its limits, and CPU seconds of their laws.
# At -4, 0, 3 and 5.5 mm a cell of S1002 on 60E1 took 0.9, 1.3, 2.0 and 2.3 s for the forces, and 1.5, 2.3, 2.9 and
# 2.7 s for the laws.
FORCES_S, LAWS_S = 2.0, 2.5
# The time of the files is printed if it is more than this fraction of the time of the solution.
_LARGE_FILE_TIME = 0.1


@add_case_options(*get_args(Group))
def solve(
    *,
    options: CaseOptions,
    json: bool = False,
    out: Path | None = None,
    force: bool = False,
    long: bool = False,
    set_in: str | None = None,
    threads: int | None = None,
    wheelset: bool = False,
) -> int:
    """Solve a case with finite elements and compare it with Hertz.

    Parameters
    ----------
    wheelset
        Solve both wheels of the wheelset: verdicts, creep forces and numbers to set of both, in one answer.
    long
        Print all results of the case instead of the answer alone.
    json
        Print the result as JSON and nothing else.
    out
        Folder for report.html, JSON, ParaView files and the figure of the case.
    force
        Write into a folder with different results.
    set_in
        Vehicle-dynamics code, such as CONTACT, SIMPACK or UM: print the setting of the cheapest theory that holds and
        the numbers to set there, too.
    threads
        Threads of the factors of both bodies, at most the number of cores; by default one per 25 thousand unknowns of a
        body, or the number in OMP_NUM_THREADS.
    """
    require_finite_elements()
    code, case = find_code_to_set(set_in, json=json), options.case()
    with use_factor_threads(threads):
        solve_asked = _solve_wheelset if wheelset else _solve_case
        return solve_asked(case, code, json=json, out=out, force=force, long=long)


def _solve_case(case: Case, code: VehicleCode | None, *, json: bool, out: Path | None, force: bool, long: bool) -> int:
    """Solve a case, and print and store its result; exit code 3 unless it is usable."""
    from fecontact.files import format_json
    from fecontact.runs.cost import CASE_FILES_S, estimate_cost
    from fecontact.runs.folder import prepare_for_case
    from fecontact.runs.report import keep_with_report
    from fecontact.runs.store import CaseRecords
    from fecontact.solving.solve import solve as solve_case

    print_notes(describe_unusual_inputs([case]))
    if out is not None:
        prepare_for_case(out, case, force=force)
    cost = estimate_cost([case], 1) if out is None else estimate_cost([case], 1, files=CASE_FILES_S)
    # a case that does not fit into the memory is refused with the memory that it needs
    if cost and cost.memory_GB < cost.available_GB:
        announce(*cost.words)
    with show_solution_progress() as progress:
        result = solve_case(case, progress=progress)
        # the solution is written to files before it is printed: the output may be full, or closed
        start, case_records = time.perf_counter(), CaseRecords.of(result)
        write_error = None
        try:
            if out is not None:
                keep_with_report(result, case_records, out)
        except OSError as error:
            # the error is raised afterwards, since the numbers exist
            write_error = error
        files_s = time.perf_counter() - start
    solved_s = sum(result.effort.seconds.values())
    if files_s > _LARGE_FILE_TIME * solved_s:
        announce(f"files, pictures and report took {files_s:.1f} s, the solution {solved_s:.1f} s")
    if json:
        print(format_json(case_records.record), flush=True)
    else:
        _print_result(result, case_records.record, code, long=long)
        _print_where_all_is(out, [case_records.record], long=long)
    if write_error is not None:
        raise write_error
    return 0 if result.load.usable else 3


def _print_result(result: CaseResult, record: Mapping[str, Any], code: VehicleCode | None, *, long: bool) -> None:
    """Print the result of a case, and the numbers to set in a vehicle-dynamics code."""
    from fecontact.outputs.case_parts import case_parts
    from fecontact.outputs.case_words import case_words
    from fecontact.outputs.code_settings import settings_lines, settings_of_result

    print_parts(case_parts(record, case_words(record["case"]), elements=result.case.refine == "evidence"), long=long)
    if code is not None:
        print_parts(settings_lines(code, settings_of_result(result.case, record)))


def _print_where_all_is(out: Path | None, records: Sequence[Mapping[str, Any]], *, long: bool) -> None:
    """Print where all results are shown, unless they are printed."""
    from fecontact.outputs.case_parts import profile_notes

    if not long:
        notes = [note for record in records for note in profile_notes(record)]
        note_part = f" and {count_text(len(notes), 'note')} on the profiles" if notes else ""
        file_part = "" if out is None else f"; {quote_path(out / 'report.html')} shows them"
        print_result(f"--long prints all results{note_part}{file_part}")


def _solve_wheelset(
    case: Case, code: VehicleCode | None, *, json: bool, out: Path | None, force: bool, long: bool
) -> int:
    """Solve both wheels of the wheelset of a case; exit code 3 unless both have a usable result."""
    from fecontact.files import format_json
    from fecontact.runs.cost import CASE_FILES_S, estimate_cost
    from fecontact.runs.store import CaseRecords
    from fecontact.runs.wheelset import (
        keep_wheelset,
        list_wheelset_errors,
        make_wheelset_record,
        prepare_for_wheelset,
    )
    from fecontact.solving.solve import CaseResult
    from fecontact.solving.wheelset_solution import list_wheelset_cases, solve_wheelset

    cases = list_wheelset_cases(case)
    print_notes(describe_unusual_inputs(list(cases.values())))
    if out is not None:
        prepare_for_wheelset(out, cases, force=force)
    wheel_cases = list(cases.values())
    if cost := estimate_cost(wheel_cases, 1) if out is None else estimate_cost(wheel_cases, 1, files=CASE_FILES_S):
        announce(*cost.words)
    with show_solution_progress() as progress:
        results = solve_wheelset(case, progress=progress)
        case_records = {
            side: CaseRecords.of(result) for side, result in results.items() if isinstance(result, CaseResult)
        }
        record = make_wheelset_record(results, case_records)
        if out is not None:
            keep_wheelset(results, case_records, record, out)
    if json:
        print(format_json(record), flush=True)
    else:
        for side, result in results.items():
            print_result(f"{side} wheel")
            if isinstance(result, CaseResult):
                _print_result(result, case_records[side].record, code, long=long)
        print_parts(record["answer"])
        _print_where_all_is(out, [records_of_wheel.record for records_of_wheel in case_records.values()], long=long)
    errors = {f"{side} wheel": str(error) for side, error in list_wheelset_errors(results).items()}
    print_reasons(f"{len(errors)} of {count_text(len(results), 'wheel')} not solved", errors)
    is_usable = all(isinstance(result, CaseResult) and result.load.usable for result in results.values())
    return 0 if is_usable else 3


def run(
    study: Path, *, out: Path, quick: bool = False, json: bool = False, how: RunOptions = DEFAULT_RUN_OPTIONS
) -> int:
    """Solve a study and write its tables, figures and ParaView files; finished cases are reused.

    Parameters
    ----------
    study
        Script with `cases(quick=False)`, or TOML file of cases.
    out
        Folder for the results.
    quick
        Solve the small version of the study.
    json
        Print the rows of the table as JSON and nothing else.
    """
    from fecontact.files import format_json
    from fecontact.outputs.study_report import parts_of_rows
    from fecontact.runs.casefile import load_study
    from fecontact.runs.cost import STUDY_FILES_S
    from fecontact.runs.folder import prepare_for_study
    from fecontact.runs.study import run_study

    require_finite_elements()
    settings, loaded = how.settings(), load_study(study, quick=quick)
    prepare_for_study(out, loaded.name, force=how.force)
    with log_command(out / f"run{settings.part_suffix}.log"):
        print_notes(describe_unusual_inputs(loaded.cases))
        print_geometry(loaded.cases)
        tell_cost(loaded.cases, "case", len(loaded.cases), out / "cases", how, files=STUDY_FILES_S)
        with show_job_progress("cases", quiet=how.quiet) as progress:
            outcome = run_study(loaded, out, settings=settings, progress=progress)
        if json:
            print(format_json(outcome.rows), flush=True)
        how = replace(how, quiet=how.quiet or json)
        if not how.quiet:
            print_parts(parts_of_rows(outcome.rows))
        _log_rows(outcome.rows)
        report_reused_jobs(outcome.reused, outcome.recomputed, "case", how)
        if outcome.conclusion:
            print_result(outcome.conclusion, quiet=how.quiet)
        lost_count = report_unusable_rows(outcome.rows, "case", "without a usable result")
        shown_collections = outcome.collections[:3] + (("...",) if len(outcome.collections) > 3 else ())
        shown_files = ", ".join((*shown_collections, "cases/*/case.vtm"))
        # without a series over the shift, `view` takes the folder of a case
        solved_ids = [row["id"] for row in outcome.rows if row.get("fe_p_max_MPa") is not None]
        viewed = out if outcome.collections or not solved_ids else out / "cases" / str(solved_ids[0])
        paraview = f"; for ParaView: {shown_files}, or fecontact view {quote_path(viewed)}"
        files = ("report.html", "study.csv", "study.png", "cases")
        report_files(out, files, paraview if lost_count < len(outcome.rows) else "", how)
    return 0 if outcome.all_converged else 3


def _log_rows(rows: Sequence[Mapping[str, Any]]) -> None:
    """Write verdict and warnings of each case to the log, as in the table."""
    for row in rows:
        write_to_log(f"{row['id']}: {row.get('verdict_answer') or row['status']}")
        for name in ("verdict_warnings", "warnings"):
            if row.get(name):
                write_to_log(f"{row['id']}: {row[name]}", warning=True)


def tell_cost(
    cases: Sequence[Case],
    noun: str,
    places: int,
    finished: Path,
    how: RunOptions,
    *,
    files: tuple[float, float],
    further: tuple[float, float] = (0.0, 0.0),
    laws: bool = False,
) -> None:
    """Announce the approximate cost of cases before they are solved.

    Parameters
    ----------
    cases
        Cases.
    noun
        Noun for a case, such as "cell".
    places
        Largest number of workers with work.
    finished
        Folder of the cases that were finished before.
    how
        Options of the run.
    files, further
        As for `estimate_cost`.
    laws
        Whether laws of creep forces are judged if there is friction.
    """
    from fecontact.jobs.workers import count_default_workers
    from fecontact.runs.cost import estimate_cost

    if how.part is not None or how.scheduler is not None:
        # the number of other workers and their machines are unknown
        return
    workers = how.workers or min(count_default_workers(), places)
    cost = estimate_cost(cases, workers, further=further, files=files)
    if cost is None:
        # no case can be solved; the results report this
        return
    seconds = sum((FORCES_S + LAWS_S * laws) / workers for case in cases if case.creep.asked)
    forces = f"; creep forces take about {format_duration(seconds)} more" * bool(seconds)
    reuse_note = f"; finished {finished.name} are reused" * finished.is_dir()
    expected, *memory_notes = cost.words
    announce(f"{count_text(len(cases), noun)}: {expected}{forces}{reuse_note}", *memory_notes, quiet=how.quiet)


def validate(
    *studies: Path,
    out: Path,
    report: Path | None = None,
    quick: bool = False,
    workers: int | None = None,
) -> int:
    """Solve studies and check their numbers against references; exit code 1 if a check fails.

    Parameters
    ----------
    studies
        Scripts with a function `checks(rows)`; if not given, all such scripts in studies/.
    out
        Folder for the results, with a folder per study; finished cases are reused.
    report
        Markdown file (.md) with a line per study; by default VALIDATION.md in the folder of the results. Lines of other
        studies in this file are kept. Its links lead to pages in the folder validation next to it.
    quick
        Solve the small version of each study.
    workers
        Number of cases at a time, as for `run`.
    """
    from fecontact.files import require_ending
    from fecontact.runs.validation import load_checked_studies
    from fecontact.runs.validation import validate as run_and_check

    @contextmanager
    def open_progress(name: str) -> Iterator[Callable[[int, int, str], None]]:
        print(name, file=sys.stderr)
        with show_job_progress("cases") as progress:
            yield progress

    if report is not None:
        require_ending(report, (".md",), "report")
    require_finite_elements()
    selected_studies = load_checked_studies(studies or sorted(Path("studies").glob("[0-9]*.py")), quick=quick)
    result = run_and_check(selected_studies, out, table=report, workers=workers, watched=open_progress)
    for check in result.failed:
        print(
            f"FAIL {check.quantity}, {check.case}: {check.deviation_percent:+.2f} % (limit {check.limit_percent:g} %)"
        )
    print(
        f"{count_text(len(result.checks), 'check')}, {len(result.failed)} failed,"
        f" {count_text(len(result.unsolved), 'study', 'studies')} with cases that were not solved:"
        f" {quote_path(result.path)}"
    )
    return 3 if result.unsolved else int(bool(result.failed))
