"""The commands `fecontact fleet ...`: many measured wheels on many measured rails."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from fecontact.console.log import log_command
from fecontact.console.messages import announce, print_reasons, print_result, write_to_log
from fecontact.console.progress import show_progress_by_kind
from fecontact.console.run_messages import report_files
from fecontact.console.run_options import DEFAULT_RUN_OPTIONS, RunOptions
from fecontact.features.fleet.asking import report, sample
from fecontact.inputs.texts import count_text, quote_path

if TYPE_CHECKING:
    from fecontact.features.fleet.checking import FleetCost

fleet = App(
    name="fleet",
    help="Share of the contacts of many measured wheels and rails in which Hertz holds, with its uncertainty.",
)


@fleet.command
def run(file: Path, *, out: Path, how: RunOptions = DEFAULT_RUN_OPTIONS) -> int:
    """Screen all positions of a fleet with a cheap theory.

    The same command resumes an interrupted run.

    Parameters
    ----------
    file
        File of the fleet (TOML): wheels, rails, pairs, shifts and loads. `fecontact guide fleet` shows an example.
    out
        Folder for profiles.parquet (a row for each file, refused files included), screen/part-*.parquet (a row for each
        position) and fleet.json. A file that you add later costs only the time of this file and its pairs.
    """
    from fecontact.features.fleet.profile_files import group_reasons
    from fecontact.features.fleet.running import describe_suspicious, refuse_part, run_fleet
    from fecontact.features.fleet.sealed_folder import prepare_for_fleet

    settings = how.settings()
    refuse_part(settings)
    prepare_for_fleet(file, out, force=how.force)
    with log_command(out / "run.log"):
        announce_cost(file, how)
        with show_progress_by_kind("files", "pairs", quiet=how.quiet) as progress:
            screening = run_fleet(file, out, settings=settings, progress=progress)
        print_result(screening.headline, quiet=how.quiet)
        if screening.reused:
            print_result(
                f"{screening.reused} of {count_text(screening.pairs, 'pair')} finished by an earlier run",
                quiet=how.quiet,
            )
        print_reasons(
            f"{len(screening.refused)} of {count_text(screening.profiles, 'file')} could not be read",
            group_reasons(screening.refused),
        )
        print_reasons(
            f"{describe_suspicious(len(screening.suspicious), screening.profiles)}, and"
            f" {1e2 * screening.suspicious_share:.1f} % of the pairs, by weight, are left out for them; settle each"
            " in its row of the table, and run the same command again (pictures: fecontact fleet report)",
            group_reasons(screening.suspicious),
        )
        print_reasons(
            f"not read: {len(screening.unread)} of {count_text(screening.profiles, 'file')}, for want of"
            " memory, disk space or"
            " workers; run the same command again",
            group_reasons(screening.unread),
        )
        if screening.removed_report:
            print_result(
                "the report of the earlier tables was removed; write it again: fecontact fleet report"
                f" {quote_path(out)}",
                quiet=how.quiet,
            )
        for name, notes in screening.notes.items():
            for note in notes:
                write_to_log(f"{name}: {note}")
        if screening.notes:
            print_result(
                f"the readers made assumptions about {len(screening.notes)} of"
                f" {count_text(screening.profiles, 'file')}, such as the side or the origin; see the notes in"
                f" {quote_path(out / 'run.log')}, profiles.parquet and the report",
                quiet=how.quiet,
            )
        failed = {f"{wheel} on {rail}": why for (wheel, rail), why in screening.failed.items()}
        print_reasons(f"{len(failed)} of {count_text(screening.pairs, 'pair')} failed", failed)
        report_files(out, ("profiles.parquet", "screen", "fleet.json"), "", replace(how, part=None))
    return 3 if screening.failed or screening.unread else 0


@fleet.command
def check(file: Path) -> int:
    """Print columns, unusable files, size, time and memory of a fleet without smoothing a profile.

    Parameters
    ----------
    file
        File of the fleet (TOML), as for `fecontact fleet run`.
    """
    from fecontact.features.fleet.checking import describe_sample_size
    from fecontact.features.fleet.profile_files import group_reasons

    cost = announce_cost(file, DEFAULT_RUN_OPTIONS, say=print_result)
    print_reasons(f"{count_text(len(cost.unusable), 'file')} cannot be used", group_reasons(cost.unusable))
    print_result(describe_sample_size())
    return 0


def announce_cost(file: Path, how: RunOptions, *, say=announce) -> FleetCost:  # type: ignore[no-untyped-def]
    """Print the columns of the tables of a fleet, and its size, memory and time.

    Parameters
    ----------
    file
        File of the fleet.
    how
        Options of the run, with the number of workers.
    say
        Function that prints.

    Returns
    -------
    FleetCost
        Size and cost of the fleet.
    """
    from fecontact.features.fleet.checking import check_fleet
    from fecontact.jobs.remaining import format_duration
    from fecontact.jobs.workers import count_default_workers

    cost = check_fleet(file)
    for sentence in (*cost.tables, *cost.copies, *cost.notes):
        say(sentence, quiet=how.quiet)
    workers = how.workers or count_default_workers()
    say(
        f"{cost.words}; about {format_duration(cost.estimate_seconds(workers))} with {count_text(workers, 'worker')}",
        quiet=how.quiet,
    )
    return cost


@fleet.command
def examples(folder: Path, *, wheels: int = 10, rails: int = 10, seed: int = 1, force: bool = False) -> int:
    """Write an example of a fleet: worn copies of library profiles with noise.

    The same command resumes an interrupted one.

    Parameters
    ----------
    folder
        Folder for wheels/, rails/, their tables wheels.csv and rails.csv, and fleet.toml.
    wheels, rails
        Number of wheels, and number of rails (1 to 10000 each).
    seed
        Seed of wear and noise; equal seeds give equal files.
    force
        Overwrite existing files that have different content.
    """
    from fecontact.features.fleet.examples import write_fleet

    path = write_fleet(folder, wheels=wheels, rails=rails, seed=seed, force=force)
    print_result(f"Fleet: {quote_path(path)}; next: `fecontact fleet run` with this file and --out FOLDER")
    return 0


fleet.command(sample)
fleet.command(report)
