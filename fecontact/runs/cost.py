"""About what time and memory many cases take, before any of them is placed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from fecontact.case import RESOLUTIONS, Case
from fecontact.jobs.remaining import duration
from fecontact.solving.cost import WHOLE, cpu_seconds, memory_GB

# Unknowns of the first meshes of a half model at `quick`, 60E1 and S1002 where the patch has one lobe (32 to 41
# thousand in six positions and pairs), and how they grow with the elements a semi-axis (74 thousand at `standard` and
# 114 thousand at `fine`, at 3 mm). With several lobes they are up to four times as many.
_UNKNOWNS = 34e3
_GROWTH, _GROWTH_BEYOND = 1.02, 2.0
_SEVERAL_LOBES = 3.7
_START_S = 5.0
# Semi-axes (mm) of a patch under 100 kN: only for element sizes that are given in mm.
_SEMI_AXES_MM = (6.5, 4.5)


@dataclass(frozen=True, kw_only=True)
class Cost:
    """About what a study or a map takes, on an idle machine.

    Attributes
    ----------
    seconds, memory_GB
        Of the whole and of its largest case, if every patch has one lobe and every verdict is clear.
    most_seconds, most_memory_GB
        The same with several lobes, or with finer meshes where verdicts stay open.
    available_GB
        Memory that is free now.
    """

    workers: int
    seconds: float
    memory_GB: float
    most_seconds: float
    most_memory_GB: float
    available_GB: float

    @property
    def words(self) -> tuple[str, ...]:
        """Time and memory in words, and whether there is too little memory."""
        workers = f"{self.workers} worker{'s' * (self.workers != 1)}"
        expected = (
            f"about {duration(self.seconds)} with {workers} and {self.memory_GB:.1f} GB a worker,"
            f" patches of a single lobe; up to {duration(self.most_seconds)} and {self.most_memory_GB:.1f} GB where"
            " they have several or verdicts stay open"
        )
        if self.most_memory_GB * self.workers <= self.available_GB:
            return (expected,)
        return (expected, f"{self.available_GB:.1f} GB are available: fewer --workers may be needed")


def cost_of(cases: Sequence[Case], workers: int) -> Cost:
    """What all cases take together, so many at a time.

    The loads of a map are counted as cases: what they save by sharing their meshes its load limits take about again.
    """
    import psutil

    usual = [_unknowns(case) for case in cases]
    most = [
        max(_SEVERAL_LOBES * n, min(3.0 * n, case.refine_degrees_of_freedom))
        for n, case in zip(usual, cases, strict=True)
    ]
    return Cost(
        workers=workers,
        seconds=_START_S + sum(map(cpu_seconds, usual)) / workers,
        memory_GB=max(map(memory_GB, usual)),
        most_seconds=_START_S + sum(map(cpu_seconds, most)) / workers,
        most_memory_GB=max(map(memory_GB, most)),
        available_GB=psutil.virtual_memory().available / 1e9,
    )


def _unknowns(case: Case) -> float:
    if isinstance(case.resolution, str):
        count = RESOLUTIONS[case.resolution]
    else:
        axes = [axis * (case.load_N / 100e3) ** (1.0 / 3.0) for axis in _SEMI_AXES_MM]
        count = math.sqrt(math.prod(axis / step for axis, step in zip(axes, case.resolution, strict=True)))
    relative, finest = count / RESOLUTIONS["quick"], RESOLUTIONS["fine"] / RESOLUTIONS["quick"]
    grown = min(relative, finest) ** _GROWTH * max(1.0, relative / finest) ** _GROWTH_BEYOND
    return float(_UNKNOWNS * grown * (1.0 if case.half else WHOLE))
