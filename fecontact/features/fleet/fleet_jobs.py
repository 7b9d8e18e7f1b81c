"""Jobs of a fleet: done where they are not finished, stopped by an error of the program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fecontact.features.fleet.reading import origin
from fecontact.jobs.engine import OpenRun, finish
from fecontact.jobs.workers import Done, Job, Work


def do_jobs(
    works: Mapping[str, Work], labels: Mapping[str, str], folder: Path, read: Any, by: OpenRun
) -> dict[str, Done]:
    """Do all jobs that are not finished, by their ids, which are the names of their folders.

    Raises
    ------
    ProgramError
        If jobs ended with an error of the program, which is neither a result nor a refusal.
    """
    found: dict[str, Done] = {}
    here = folder.absolute()
    jobs = [
        Job(
            name=name,
            folder=here / name,
            origin=origin(),
            origin_here=origin,
            work=work,
            read=read,
            label=labels[name],
        )
        for name, work in works.items()
    ]
    finish(jobs, by, on_done=lambda done: found.update({done.name: done}))
    return found
