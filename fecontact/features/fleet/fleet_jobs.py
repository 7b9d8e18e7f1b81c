"""Jobs of a fleet: finished jobs are reused, and an error of the program stops the run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.features.fleet.reading import find_origin
from fecontact.jobs.engine import OpenRun, finish_jobs
from fecontact.jobs.workers import Job, JobOutcome, Work


def run_fleet_jobs(
    works: Mapping[str, Work], labels: Mapping[str, str], folder: Path, read: Any, by: OpenRun
) -> dict[str, JobOutcome]:
    """Run all jobs that are not finished.

    Parameters
    ----------
    works
        Work of each job by its id, which is the name of its folder.
    labels
        Words for each job in messages.
    folder
        Folder of the folders of the jobs.
    read
        Reader of the result in the folder of a job; None without a result.
    by
        The run that executes the jobs.

    Returns
    -------
    dict
        Outcome of each job by its id.

    Raises
    ------
    ProgramError
        If jobs ended with an error of the program, which is neither a result nor a refusal.
    """
    found: dict[str, JobOutcome] = {}
    here = folder.absolute()
    jobs = [
        Job(
            name=name,
            folder=here / name,
            origin=find_origin(),
            origin_here=find_origin,
            work=work,
            read=read,
            label=labels[name],
        )
        for name, work in works.items()
    ]
    finish_jobs(jobs, by, on_done=lambda done: found.update({done.name: done}))
    return found
