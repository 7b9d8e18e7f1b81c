"""Messages of commands with many jobs: reused results, unusable results, and files."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from fecontact.console.messages import print_reasons, print_result
from fecontact.console.run_options import RunOptions
from fecontact.errors import describe_status, is_usable_status
from fecontact.inputs.texts import count_text, quote_path


def report_reused_jobs(reused: Collection[str], recomputed: Mapping[str, str], kind: str, how: RunOptions) -> None:
    """Print the number of reused results, and why others were solved or judged again.

    Parameters
    ----------
    reused
        Names of the reused jobs.
    recomputed
        Reason for each job that was solved or judged again, by the name of the job.
    kind
        Name of a job in the singular, such as `case`.
    how
        Options of the run.
    """
    print_reasons("solved or judged again", recomputed)
    if reused:
        reused_jobs = f"{count_text(len(reused), f'finished {kind}')} {'was' if len(reused) == 1 else 'were'}"
        print_result(f"{reused_jobs} reused; use --force to solve again", quiet=how.quiet)


def report_unusable_rows(rows: Sequence[Mapping[str, Any]], kind: str, how_lost: str) -> int:
    """Print the rows of cases without a usable result, with their reasons.

    Parameters
    ----------
    rows
        Rows of all cases.
    kind
        Name of a row in the singular, such as `case`.
    how_lost
        Verb of the title, such as "could not be solved".

    Returns
    -------
    int
        Number of rows without a usable result.
    """
    lost = {str(row["id"]): describe_status(row) for row in rows if not is_usable_status(row)}
    print_reasons(f"{len(lost)} of {count_text(len(rows), kind)} {how_lost}", lost)
    return len(lost)


def report_files(out: Path, files: Sequence[str], addition: str, how: RunOptions) -> None:
    """Print the files of the results, or how to join the parts of a run.

    Parameters
    ----------
    out
        Folder of the results.
    files
        Names of files and folders. Missing files are left out.
    addition
        Text at the end of the line.
    how
        Options of the run.
    """
    if how.part is None:
        present = ", ".join(f"{name}/" if (out / name).is_dir() else name for name in files if (out / name).exists())
        print_result(f"Results in {quote_path(out)}: {present}{addition}", quiet=how.quiet)
    else:
        print_result(
            f"Part {how.part} is in {quote_path(out)}; when all parts are there, run the command without --part to join"
            " them",
            quiet=how.quiet,
        )
