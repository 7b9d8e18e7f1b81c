"""The commands `fecontact fleet ...`: many measured wheels on many measured rails."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cyclopts import App

from fecontact.console.log import log_command
from fecontact.console.messages import announce, print_reasons, print_result, write_to_log
from fecontact.console.progress import show_progress_by_kind
from fecontact.console.run_messages import report_files
from fecontact.console.run_options import DEFAULT_RUN_OPTIONS, RunOptions
from fecontact.features.fleet.asking import report, sample

fleet = App(
    name="fleet", help="In how many contacts of many measured wheels and rails Hertz holds, and how sure that is."
)


@fleet.command
def run(file: Path, *, out: Path, how: RunOptions = DEFAULT_RUN_OPTIONS) -> int:
    """Screen every position of a fleet by a cheap theory; the same command goes on after an interruption.

    Parameters
    ----------
    file
        Wheels, rails, pairs, shifts and loads (TOML); `fecontact guide fleet` has one.
    out
        Folder for profiles.parquet (a row for each file, also for those that were refused), screen/part-*.parquet (a
        row for each position) and fleet.json; a file that is added later costs that file.
    """
    from fecontact.features.fleet.running import run_fleet

    with log_command(out / "run.log"):
        announce_cost(file, how)
        with show_progress_by_kind("files", "pairs", quiet=how.quiet) as progress:
            screening = run_fleet(file, out, settings=how.settings(), progress=progress)
        print_result(screening.headline, quiet=how.quiet)
        if screening.reused:
            print_result(f"{screening.reused} of {screening.pairs} pairs were finished before", quiet=how.quiet)
        print_reasons(f"{len(screening.refused)} of {screening.profiles} files could not be read", screening.refused)
        for name, notes in screening.notes.items():
            for note in notes:
                write_to_log(f"{name}: {note}")
        if screening.notes:
            print_result(
                f"readers assumed something of {len(screening.notes)} of {screening.profiles} files, such as the side"
                f" or the origin: see the notes in {out / 'run.log'}, profiles.parquet and the report",
                quiet=how.quiet,
            )
        failed = {f"{wheel} on {rail}": why for (wheel, rail), why in screening.failed.items()}
        print_reasons(f"{len(failed)} of {screening.pairs} pairs failed", failed)
        report_files(out, ("profiles.parquet", "screen", "fleet.json"), "", replace(how, part=None))
    return 3 if screening.failed else 0


@fleet.command
def check(file: Path) -> int:
    """Say how many positions a fleet has, and about what time and memory they take; no profile is read.

    Parameters
    ----------
    file
        As for `fecontact fleet run`.
    """
    announce_cost(file, DEFAULT_RUN_OPTIONS, say=print_result)
    return 0


def announce_cost(file: Path, how: RunOptions, *, say=announce) -> None:  # type: ignore[no-untyped-def]
    """Print the size, memory and time of a fleet.

    Parameters
    ----------
    file
        File of the fleet.
    how
        Options of the run, with the number of workers.
    say
        Function that prints.
    """
    from fecontact.features.fleet.checking import check_fleet
    from fecontact.jobs.remaining import format_duration
    from fecontact.jobs.workers import count_default_workers

    cost = check_fleet(file)
    workers = how.workers or count_default_workers()
    say(f"{cost.words}; about {format_duration(cost.cpu_seconds / workers)} with {workers} workers", quiet=how.quiet)


@fleet.command
def examples(folder: Path, *, wheels: int = 10, rails: int = 10, seed: int = 1) -> int:
    """Write a fleet to try: worn and noisy copies of profiles of the library, as an instrument measures them.

    Parameters
    ----------
    folder
        Folder for wheels/, rails/, their tables wheels.csv and rails.csv, and fleet.toml.
    wheels, rails
        How many of each.
    seed
        Of wear and noise; the same one makes the same files.
    """
    from fecontact.features.fleet.examples import write_fleet

    print_result(f"{write_fleet(folder, wheels=wheels, rails=rails, seed=seed)}: fecontact fleet run it")
    return 0


fleet.command(sample)
fleet.command(report)
