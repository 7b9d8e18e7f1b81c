"""Options of commands with many cases or positions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from fecontact.console.options import PANELS

if TYPE_CHECKING:
    from fecontact.jobs.engine import RunSettings


@Parameter(name="*", group=PANELS["run"])
@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options of a run over the cases of a study, or over the shifts of a map.

    Attributes
    ----------
    workers
        Worker processes, each with one case or one shift of a map at a time; by default one per core, if each has at
        least 2 GB of memory.
    threads
        Threads per worker.
    force
        Solve finished cases again, and write into a folder that has different results.
    part
        Solve only part i of N, given as i/N. When all parts are finished, run the command without this option to join
        them.
    scheduler
        Address of a Dask scheduler whose workers share the folder of the results.
    quiet
        Print errors only; run.log in the folder of the results always has all messages.
    """

    workers: int | None = None
    threads: int = 1
    force: bool = False
    part: str | None = None
    scheduler: str | None = None
    quiet: Annotated[bool, Parameter(alias="-q")] = False

    def settings(self) -> RunSettings:
        """Settings of the run itself.

        Returns
        -------
        RunSettings
            Workers, threads, part and scheduler.

        Raises
        ------
        InputError
            If a number or the part is invalid.
        """
        from fecontact.jobs.engine import RunSettings, parse_part

        return RunSettings(
            workers=self.workers,
            threads=self.threads,
            force=self.force,
            part=parse_part(self.part) if self.part else None,
            scheduler=self.scheduler,
        )


DEFAULT_RUN_OPTIONS = RunOptions()
