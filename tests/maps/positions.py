"""Stand-ins for solving the positions of a map, which worker processes can import."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from inline import stand_ins

from fecontact.case import Case
from fecontact.jobs.workers import Crew, WorkResult
from fecontact.maps.positions import build_failed_position
from fecontact.runs.map_positions import keep_position
from fecontact.runs.map_run import MapOutcome, run_map


@dataclass(frozen=True, kw_only=True)
class FakePosition:
    """Stand-in for the work of a position without a solvable load.

    The failed position is stored.
    """

    case: Case
    loads_N: tuple[float, ...]
    name: str
    dear: bool = False
    pictured: bool = False
    seconds: float = 0.0

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        with (folder.parent.parent / "solves.txt").open("a") as file:
            file.write(f"{self.case.lateral_shift_mm:g}\n")
        time.sleep(self.seconds)
        lost = build_failed_position(self.case.lateral_shift_mm, self.loads_N, f"planned in process {os.getpid()}")
        keep_position(lost, self.case, folder)
        return WorkResult()


def map_by(
    *arguments: Any, crew: Crew | None = None, work: Callable[..., Any] | None = None, **keywords: Any
) -> MapOutcome:
    """`run_map` with another crew or work."""
    with stand_ins(crew, work, "fecontact.runs.map_run.PositionWork"):
        return run_map(*arguments, **keywords)
