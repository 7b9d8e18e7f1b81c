"""Solving a case, or several loads at one position: placement, meshes, contact, Hertz, verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape

import numpy as np
import psutil

from fecontact.arrays import Floats
from fecontact.case import NODES_A_SEMI_AXIS, Case
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.fe.linear_solver import SolverName
from fecontact.fe.stress import StressPeak, stress_peak
from fecontact.judging.comparison import Comparison
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.notes import position_notes
from fecontact.judging.solved_load import Status
from fecontact.judging.verdict import Verdict
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.meshes import Meshes, SolvedBodies
from fecontact.solving.position import Position, Progress, position_of


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Cost of the finite elements of a case: solver path, wall seconds, and resident memory after each step."""

    path: SolverName
    seconds: Mapping[str, float]
    memory_MB: Mapping[str, float]
    peak_memory_MB: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """Result of a case; it can be pickled with its meshes, but without their factors.

    Attributes
    ----------
    load
        The solved load with all its fields and rungs, and all measures and verdicts.
    von_mises
        Largest von Mises stress of rail and wheel, and its place.
    bodies
        Both meshes with their displacements; None in a result that was read from a folder, which has them in
        `rail.vtu` and `wheel.vtu`.
    """

    load: JudgedLoad
    placement: Placement
    von_mises: Mapping[str, StressPeak]
    effort: Effort
    bodies: SolvedBodies | None

    def __repr__(self) -> str:
        return f"<CaseResult{repr(self.load).removeprefix('<JudgedLoad')}"

    def _repr_html_(self) -> str:
        rows = {
            measure: {"Hertz is off by": f"{off:+.3g}", "±": f"{self.load.uncertainty[measure]:.2g}"}
            for measure, off in self.load.deviation.items()
            if measure in self.load.uncertainty
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    def __len__(self) -> int:
        return 1

    def __iter__(self) -> Iterator[CaseResult]:
        """The case alone: results of one case and of many are gone through alike."""
        yield self

    def __getitem__(self, number: int) -> CaseResult:
        return (self,)[number]

    @property
    def case(self) -> Case:
        """The inputs."""
        return self.load.case

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """The load as a tuple, as a position of a map has its solved loads."""
        return (self.load,)

    @property
    def short_of_memory(self) -> bool:
        """Whether the machine had too little memory for some of what was asked for."""
        return self.load.solved.short_of_memory

    @property
    def status(self) -> Status:
        """`converged`, or why the result must not be used."""
        return self.load.status

    @property
    def verdict(self) -> Verdict:
        """Whether Hertz holds, by which measure, and why it does not; with a yield stress against bodies that yield."""
        return self.load.verdict

    @property
    def elastic_verdict(self) -> Verdict | None:
        """The verdict against elastic bodies; None without a yield stress, where `verdict` is against them."""
        return self.load.elastic_verdict

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
        """Pressure nodes of the whole contact on the rail's surface: x (nx,) on both sides of 0, s (ns,) across."""
        return self.load.fe.even().pressure.whole().grid

    @property
    def pressure_MPa(self) -> Floats:
        """Pressure (nx, ns) of the finite elements on `grid`; its sum times the nodes' area is the normal force."""
        return self.load.fe.even().pressure.whole().values

    @property
    def gap_mm(self) -> Floats:
        """Deformed gap (nx, ns) on `grid`."""
        even = self.load.fe.even()
        return Field(grid=even.grid, values=even.gap_mm).whole().values

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the profiles and about the contact as a whole."""
        return tuple(position_notes(self.placement, self.comparison))


def solve(case: Case, *, progress: Progress | None = None) -> CaseResult:
    """Solve a case on two meshes, compute the rungs between Hertz and finite elements, judge, refine an open verdict.

    Parameters
    ----------
    progress
        Called with the name of each step as it begins.

    Raises
    ------
    InputError
        For inputs that cannot be solved, with value, range and remedy; `NotEnoughMemory` if the machine has too little
        memory. A contact that does not converge is no error, but a result with this `status`.
    """
    case.creep.refuse_unheard()
    position = position_of(case, progress=progress)
    return _solved(position, Meshes(position))


def _solved(position: Position, meshes: Meshes) -> CaseResult:
    """Solve a position's load on its meshes and judge it; its effort is all that was done since the last one's."""
    solved = meshes.solve(position)
    bodies = meshes.bodies_of(solved)
    with position.clock.step("recover"):
        peaks: dict[str, StressPeak] = {
            body.mesh.name: stress_peak(body.mesh, bodies.stress_MPa[body.mesh.name])
            for body in (bodies.coupled.rail, bodies.coupled.wheel)
        }
    with position.clock.step("judge"):
        judged = judge_load(solved, position.placement)
    return CaseResult(
        load=judged,
        placement=position.placement,
        von_mises=peaks,
        effort=Effort(
            path=bodies.coupled.rail.solver,
            seconds=position.clock.taken(),
            memory_MB=position.clock.memory_MB,
            peak_memory_MB=peak_memory_MB(),
        ),
        bodies=bodies,
    )


def peak_memory_MB() -> float:
    """Largest resident memory of this process so far, or the present memory if the system does not record it."""
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


# --- Several loads at one position with the factors reused, and the stiffness of the contact over the load.
#
# Assembly and factors do not depend on the load: after the first load of a mesh each further one costs only its contact
# iterations, started from the half-space pressure.

# Loads share meshes if the elements are at most so many times finer than the largest load needs: a mesh for all loads
# would have too few elements for the smallest load, or too many for the largest.
_MOST_FINER = 1.5
# An expected semi-axis is a whole number of nodes, so that a load between two others may need so many times finer
# elements than both: shared meshes are finer by this factor.
_SPARE = 1.0 + 1.0 / NODES_A_SEMI_AXIS
# Allowance for rounding in the comparison of element sizes.
_SAME = 1.0 + 1e-9


class LoadSweep:
    """A position that is solved for several loads, one after the other.

    Loads are best given from the largest down. Each is solved on the smallest meshes that were made for a load at least
    as large and have fine enough elements for its patch. Only one set of meshes is in memory at a time.

    Parameters
    ----------
    planned_N
        Loads to come; meshes are made so that several loads can share them.
    """

    def __init__(self, case: Case, planned_N: Sequence[float] = ()) -> None:
        """Place the case; its own load does not matter."""
        self._position = _placed(case, planned_N)
        self.placement = self._position.placement
        self._planned: dict[float, Position] = {}
        for load_N in sorted(set(planned_N), reverse=True):
            # a load that cannot be solved is reported when it is solved
            with suppress(InputError, ConvergenceError):
                self._planned[load_N] = self._position.for_load(load_N)
        self._groups: list[Meshes] = []
        self._open: Meshes | None = None

    def result(self, load_N: float) -> CaseResult:
        """Solve a planned load as `fecontact.solve` does, with the meshes that all planned loads lead to.

        It does not depend on which of these loads are solved before. The first effort has what all loads share.
        """
        for planned in self._planned.values():
            self._meshes_for(planned)
        wanted = self._planned.get(load_N) or self._position.for_load(load_N)
        meshes = self._opened_for(wanted)
        try:
            return _solved(wanted, meshes)
        finally:
            meshes.drop_enlarged()

    def solve(self, load_N: float, *, refine: bool = True) -> JudgedLoad:
        """Solve a load; with `refine` also on finer meshes while its verdict is open, as far as the case allows.

        A load without `refine` is one that a search tries: it is judged by Hertz alone, which decides about the next.

        Raises
        ------
        InputError
            As in `fecontact.solve`.
        """
        check_positive("load", load_N, "N", "give the wheel load")
        wanted = self._planned.get(load_N) or self._position.for_load(load_N)
        if not refine:
            # bodies that yield do so here too: the limits of a load lie between verdicts of one kind
            wanted = replace(wanted, case=unrefined(wanted.case))
        solved = self._opened_for(wanted).solve(wanted)
        with wanted.clock.step("judge"):
            return judge_load(solved, self.placement, THEORIES if refine else (HERTZ,))

    def is_ready_for(self, load_N: float) -> bool:
        """Whether a planned load can be solved on the meshes whose factors are in memory."""
        wanted = self._planned.get(load_N)
        return wanted is not None and self._open is not None and self._open is self._group_of(wanted)

    def close(self) -> None:
        """Release the factors; the sweep may continue, with new factors."""
        if self._open is not None:
            self._open.close()
            self._open = None

    def _opened_for(self, wanted: Position) -> Meshes:
        meshes = self._meshes_for(wanted)
        if self._open is not meshes:
            self.close()
            self._open = meshes
        return meshes

    def _group_of(self, wanted: Position) -> Meshes | None:
        fitting = [group for group in self._groups if _serves(group.position, wanted)]
        return min(fitting, key=lambda group: group.position.case.load_N) if fitting else None

    def _meshes_for(self, wanted: Position) -> Meshes:
        if (group := self._group_of(wanted)) is not None:
            return group
        # meshes for a load between planned loads are made for the next planned load above, so that both can share them
        above = min((load for load in self._planned if load >= wanted.case.load_N), default=None)
        largest = wanted if above is None else self._planned[above]
        sharing = [wanted]
        for load_N, planned in self._planned.items():
            if load_N < wanted.case.load_N and _finer(planned, largest) <= _MOST_FINER:
                sharing.append(planned)
        spare = 1.0 if above in (None, wanted.case.load_N) else _SPARE
        meshes = Meshes(_made_for(largest, sharing, spare), keep=True)
        self._groups.append(meshes)
        return meshes


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedLoads:
    """Loads of a position for those who solve one each, in one process: who comes first makes the sweep for all."""

    case: Case
    loads_N: tuple[float, ...]

    @cached_property
    def sweep(self) -> LoadSweep:
        """The sweep of all of them."""
        return LoadSweep(self.case, self.loads_N)


def _made_for(largest: Position, sharing: Sequence[Position], spare: float) -> Position:
    """The position under its largest load, with elements as fine as needed by any load that shares the meshes."""
    along_x, across = (min(one.element_size_mm[k] for one in sharing) / spare for k in (0, 1))
    parts = []
    for part in largest.expected.parts:
        asked = min(one.widest_element_mm(part.s_low_mm, part.s_high_mm) for one in sharing)
        parts.append(replace(part, larger=max(1.0, min(part.larger, asked / spare / across))))
    expected = replace(largest.expected, parts=tuple(parts))
    return replace(largest, element_size_mm=(along_x, across), expected=expected, several_loads=True)


def unrefined(case: Case) -> Case:
    """The case without refinement, solved on its first two meshes only."""
    return replace(case, refine="never")


def _placed(case: Case, planned_N: Sequence[float]) -> Position:
    """The position under its largest planned load for which it can be set up, or else under its own load."""
    for load_N in sorted(set(planned_N), reverse=True):
        with suppress(InputError, ConvergenceError):
            return position_of(replace(case, load_N=load_N))
    return position_of(case)


def _finer(planned: Position, meshed: Position) -> float:
    """Ratio of the element size of meshes made for a load to the element size that another load needs."""
    pairs = zip(meshed.element_size_mm, planned.element_size_mm, strict=True)
    return max(here / there for here, there in pairs)


def _serves(meshed: Position, wanted: Position) -> bool:
    """Whether meshes made for a load are wide and fine enough for another load."""
    # the margin around the expected patch, and the zone's growth, are enough where a smaller load reaches further
    if _finer(wanted, meshed) > _SAME or meshed.case.load_N < wanted.case.load_N:
        return False
    # patches far apart have elements of different widths, and need not shrink by one factor
    return len(meshed.expected.parts) == 1 or all(
        meshed.widest_element_mm(part.s_low_mm, part.s_high_mm)
        <= _SAME * wanted.widest_element_mm(part.s_low_mm, part.s_high_mm)
        for part in wanted.expected.parts
    )


# --- The stiffness of a contact over its load: a law fitted to the approaches of a load sweep.


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentStiffness:
    """Stiffness dF/dapproach (N/mm) under a normal force: from the fit with and without its bulk term, and from Hertz.

    Attributes
    ----------
    error_N_per_mm, contact_error_N_per_mm
        Standard errors of the fit; NaN for two points, which a fit meets exactly.
    deviation
        (Hertz - contact) / contact: against the stiffness without the bulk term.
    """

    normal_force_N: float
    with_bulk_N_per_mm: float
    error_N_per_mm: float
    contact_N_per_mm: float
    contact_error_N_per_mm: float
    hertz_N_per_mm: float
    deviation: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Stiffness:
    """The approach of a position over its normal force F: c1 F^(2/3) + c2 F.

    Attributes
    ----------
    c1_mm_per_N23, c2_mm_per_N
        Contact compliance, which Hertz covers, and bulk compliance of the bodies down to their cut planes, which Hertz
        leaves out. The bulk compliance is negative if the cut planes stiffen the bodies by more than the shape of the
        bodies softens them, compared with half-spaces.
    covariance (2, 2)
        Covariance of c1 and c2; NaN for two points.
    hertz_c1_mm_per_N23
        K_H^(-2/3).
    residual
        Root mean square of the relative error of the approach.
    """

    c1_mm_per_N23: float
    c2_mm_per_N: float
    covariance: Floats
    hertz_c1_mm_per_N23: float
    residual: float

    @property
    def c1_error(self) -> float:
        """Standard error of c1."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def c2_error(self) -> float:
        """Standard error of c2."""
        return math.sqrt(self.covariance[1, 1])

    def tangent(self, normal_force_N: float) -> TangentStiffness:
        """Tangent stiffness under a normal force."""
        root = normal_force_N ** (-1.0 / 3.0)
        slope = np.array([2.0 / 3.0 * root, 1.0])
        contact = 1.5 / (root * self.c1_mm_per_N23)
        with_bulk = 1.0 / float(slope @ (self.c1_mm_per_N23, self.c2_mm_per_N))
        hertz = 1.5 / (root * self.hertz_c1_mm_per_N23)
        return TangentStiffness(
            normal_force_N=normal_force_N,
            with_bulk_N_per_mm=with_bulk,
            error_N_per_mm=with_bulk**2 * math.sqrt(slope @ self.covariance @ slope),
            contact_N_per_mm=contact,
            contact_error_N_per_mm=contact * self.c1_error / self.c1_mm_per_N23,
            hertz_N_per_mm=hertz,
            deviation=hertz / contact - 1.0,
        )


def fit_stiffness(points: Sequence[JudgedLoad]) -> Stiffness:
    """Fit the approach of the converged points by least squares of its relative error.

    Raises
    ------
    InputError
        For fewer than two loads.
    """
    usable = [point for point in points if point.usable]
    force = np.array([point.normal_force_N for point in usable])
    if np.unique(force).size < 2:
        raise InputError(f"stiffness: {np.unique(force).size} converged loads; give at least two, better four")
    approach = np.array([point.comparison.fe.approach_mm for point in usable])
    # errors of meshes are in proportion to the approach: every load has equal weight
    terms = np.column_stack([force ** (2.0 / 3.0), force]) / approach[:, None]
    scale = np.linalg.norm(terms, axis=0)
    scaled, *_ = np.linalg.lstsq(terms / scale, np.ones(force.size), rcond=None)
    error = (terms / scale) @ scaled - 1.0
    free = force.size - 2
    variance = float(error @ error) / free if free else math.nan
    covariance = variance * np.linalg.inv((terms / scale).T @ (terms / scale)) / np.outer(scale, scale)
    c1, c2 = scaled / scale
    hertz = usable[-1].hertz.stiffness_N_per_mm15 ** (-2.0 / 3.0)
    return Stiffness(
        c1_mm_per_N23=float(c1),
        c2_mm_per_N=float(c2),
        covariance=np.asarray(covariance),
        hertz_c1_mm_per_N23=hertz,
        residual=math.sqrt(float(np.mean(error**2))),
    )
