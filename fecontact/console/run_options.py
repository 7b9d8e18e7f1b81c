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
    """How the cases of a study, or the shifts of a map, are worked through.

    Attributes
    ----------
    workers
        Cases, or shifts of a map, at a time; as many as there are cores and 2 GB of memory for each, if not given.
    threads
        Threads that each of them computes on.
    force
        Solve what is finished again instead of using it, and write into a folder that holds other results.
    part
        Solve only part i of N, given as i/N; the same command without it then puts all parts together.
    scheduler
        Address of a Dask scheduler whose workers share the folder of the results.
    quiet
        Say only what went wrong; run.log in the folder of the results has all of it in any case.
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
