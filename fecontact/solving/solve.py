"""From a case to its result: placement, meshes, contact, Hertz, comparison, verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import psutil
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.compare import Comparison
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.judging import judge_load
from fecontact.comparison.solved_load import Status
from fecontact.comparison.verdict import Verdict
from fecontact.comparison.warnings import position_notes
from fecontact.contact.grid import ContactGrid, Field
from fecontact.fe.linear_solver import SolverName
from fecontact.fe.stress_peak import StressPeak, stress_peak
from fecontact.geometry.placement import Placement
from fecontact.solving.meshes import Meshes, SolvedBodies
from fecontact.solving.position import Clock, Progress, position_of
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Effort:
    """What the finite elements of a case cost: solver path, wall seconds and resident memory after each step."""

    path: SolverName
    seconds: Mapping[str, float]
    memory_MB: Mapping[str, float]
    peak_memory_MB: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """Everything that a case gives; it can be pickled, with its meshes but without their factors.

    Attributes
    ----------
    load
        The load as it was solved, field by field and rung by rung, with all that is read from it.
    von_mises
        Largest von Mises stress of rail and wheel, and where it lies.
    bodies
        Both meshes with their displacements; None in a result that was read from a folder, which has them as
        `rail.vtu` and `wheel.vtu`.
    """

    load: JudgedLoad
    placement: Placement
    von_mises: Mapping[str, StressPeak]
    effort: Effort
    bodies: SolvedBodies | None

    def __repr__(self) -> str:
        return f"<CaseResult{repr(self.load).removeprefix('<JudgedLoad')}"

    @property
    def case(self) -> Case:
        """The inputs."""
        return self.load.case

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """All loads that gave numbers, as a position of a map has them."""
        return (self.load,)

    @property
    def short_of_memory(self) -> bool:
        """Whether the machine had too little memory for all that was asked for."""
        return self.load.solved.short_of_memory

    @property
    def status(self) -> Status:
        """`converged`, or why the result must not be used."""
        return self.load.status

    @property
    def verdict(self) -> Verdict:
        """Whether Hertz holds, by which measure, and why it does not."""
        return self.load.verdict

    @property
    def comparison(self) -> Comparison:
        """Hertz's ellipse against the finite elements."""
        return self.load.comparison

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse at the first touch point under `normal_force_N`."""
        return self.load.hertz

    @property
    def normal_force_N(self) -> float:
        """Force along the contact normal at first touch that the finite elements carry."""
        return self.load.normal_force_N

    @property
    def grid(self) -> ContactGrid:
        """Pressure nodes on the rail's surface, of the whole contact: x (nx,) on both sides of 0, s (ns,) across."""
        return self.load.fe.pressure.whole().grid

    @property
    def pressure_MPa(self) -> Floats:
        """Pressure (nx, ns) of the finite elements on `grid`; its sum times the nodes' area is the normal force."""
        return self.load.fe.pressure.whole().values

    @property
    def gap_mm(self) -> Floats:
        """Deformed gap (nx, ns) on `grid`."""
        return Field(grid=self.load.fe.grid, values=self.load.fe.gap_mm).whole().values

    @property
    def notes(self) -> tuple[str, ...]:
        """What is to be known of the profiles and of the contact as a whole."""
        return position_notes(self.placement, self.comparison)


def solve(case: Case, *, progress: Progress | None = None) -> CaseResult:
    """Solve one case on two meshes, find the rungs between Hertz and them, judge, and refine an open verdict.

    Parameters
    ----------
    progress
        Called with the name of each step as it begins.

    Raises
    ------
    InputError
        For inputs that cannot be solved, naming value, range and remedy; `NotEnoughMemory` where the machine has too
        little. A contact that does not converge is not an error but a result whose `status` says so.
    """
    case.creep.refuse_unheard()
    position = position_of(case, progress=progress)
    meshes = Meshes(position)
    solved = meshes.solve(position)
    bodies = meshes.bodies
    assert bodies is not None
    with position.clock.step("recover"):
        peaks: dict[str, StressPeak] = {
            body.mesh.name: stress_peak(body, bodies.displacement_mm[body.mesh.name])
            for body in (bodies.coupled.rail, bodies.coupled.wheel)
        }
    with position.clock.step("judge"):
        judged = judge_load(solved, position.placement)
    return CaseResult(
        load=judged,
        placement=position.placement,
        von_mises=peaks,
        effort=_effort(position.clock, bodies),
        bodies=bodies,
    )


def _effort(clock: Clock, bodies: SolvedBodies) -> Effort:
    return Effort(
        path=bodies.coupled.rail.solver,
        seconds=clock.seconds,
        memory_MB=clock.memory_MB,
        peak_memory_MB=peak_memory_MB(),
    )


def peak_memory_MB() -> float:
    """Largest resident memory of this process so far; what it has now, where the system does not keep the largest."""
    try:
        import resource
    except ImportError:
        # Windows
        info = psutil.Process().memory_info()
        return float(getattr(info, "peak_wset", info.rss)) / 1e6
    import sys

    # bytes on macOS, kilobytes elsewhere
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * unit / 1e6
