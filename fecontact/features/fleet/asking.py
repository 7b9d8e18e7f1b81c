"""The commands `fecontact fleet sample` and `fecontact fleet report`."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path

from fecontact.console.log import log_command
from fecontact.console.messages import announce, print_result
from fecontact.console.progress import show_job_progress
from fecontact.console.run_messages import report_reused_jobs, report_unusable_rows
from fecontact.console.run_options import DEFAULT_RUN_OPTIONS, RunOptions
from fecontact.errors import InputError
from fecontact.inputs.texts import count_text, quote_path
from fecontact.outputs.terminal import print_answer as tell
from fecontact.packages import require_finite_elements


def sample(
    folder: Path, /, *, finite_elements: int = 300, seed: int | None = None, how: RunOptions = DEFAULT_RUN_OPTIONS
) -> int:
    """Solve a random sample of a fleet by finite elements, to check the screen.

    The positions are drawn from strata by the verdict of the screen and its margin. If you give a larger number later,
    all earlier draws are kept. The same command resumes an interrupted run.

    Parameters
    ----------
    folder
        Folder of a screened fleet. Its subfolder sample/ gets the solved cases as a study.
    finite_elements
        Number of positions in the sample, earlier draws included (at least 2).
    seed
        Seed of the draw; by default the seed of earlier draws, or 1.
    """
    from fecontact.features.fleet.checking import open_fleet
    from fecontact.features.fleet.sampling import draw_sample, make_cases, solve_sample
    from fecontact.features.fleet.sealed_folder import lock_fleet
    from fecontact.jobs.workers import count_default_workers
    from fecontact.runs.cost import STUDY_FILES_S, estimate_cost

    require_finite_elements()
    settings = how.settings()
    if settings.part is not None:
        raise InputError(
            f"--part is {how.part}; a sample cannot be solved in parts; leave out --part, or use --scheduler"
        )
    with lock_fleet(folder):
        case_of = open_fleet(folder).case
        drawn_positions = draw_sample(folder, finite_elements, seed)
    surplus = len(drawn_positions.rows) - finite_elements
    with log_command(folder / "sample" / "run.log"):
        changed = f"; {drawn_positions.dropped} earlier draws are not in this population" * (
            drawn_positions.dropped > 0
        )
        announce(
            f"{count_text(len(drawn_positions.rows), 'position')}, {drawn_positions.new} of them new{changed}",
            quiet=how.quiet,
        )
        if surplus > 0:
            announce(
                f"more than --finite-elements {finite_elements}: each stratum of the screen has at least two positions,"
                " and earlier draws are kept",
                quiet=how.quiet,
            )
        cases, workers = (
            make_cases(drawn_positions, case_of),
            how.workers or min(count_default_workers(), len(drawn_positions.rows)),
        )
        if cost := estimate_cost(cases, workers, files=STUDY_FILES_S):
            announce(*cost.words, quiet=how.quiet)
        with show_job_progress("positions", quiet=how.quiet) as progress:
            outcome = solve_sample(folder, drawn_positions, case_of, settings, progress)
        report_reused_jobs(outcome.reused, outcome.recomputed, "position", how)
        report_unusable_rows(outcome.rows, "position", "not solved")
        print_result(
            f"The sample is in {quote_path(folder / 'sample.parquet')}; next: fecontact fleet report"
            f" {quote_path(folder)}",
            quiet=how.quiet,
        )
    return 0 if outcome.all_converged else 3


def report(folder: Path, /, *, json: bool = False) -> int:
    """Report the share of positions in which Hertz holds, its uncertainty and the causes.

    Parameters
    ----------
    folder
        Folder of a screened fleet. The command writes report.html, answer.csv, and pictures and tables in report/ into
        it.
    json
        Print only the answer for the fleet and for each group, as JSON.
    """
    from fecontact.features.fleet.answer import evaluate_fleet
    from fecontact.features.fleet.checking import open_fleet
    from fecontact.features.fleet.report import make_answer_rows, make_report_parts, write_report
    from fecontact.features.fleet.sealed_folder import lock_fleet, mark_report, refuse_foreign_report
    from fecontact.features.fleet.suspicious_files import make_suspicious_parts

    with lock_fleet(folder):
        refuse_foreign_report(folder)
        # opened after the tables have been checked
        open_once = cache(partial(open_fleet, folder))
        fleet_answer = evaluate_fleet(folder, lambda *position: open_once().case(*position))
        screened = open_once()
        mark_report(folder)
        page = write_report(fleet_answer, folder, screened.case, make_suspicious_parts(screened))
    tell(
        make_answer_rows(fleet_answer) if json else fleet_answer,
        lambda answer: make_report_parts(answer, folder / "report"),
        json=json,
        report=page,
    )
    return 0
