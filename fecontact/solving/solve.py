"""Solution of a case, or of several loads at a position: placement, meshes, contact, verdict."""

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
from fecontact.case import NODES_PER_SEMI_AXIS, Case
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.fe.linear_solver import SolverName
from fecontact.fe.stress import StressPeak, find_stress_peak
from fecontact.judging.comparison import Comparison
from fecontact.judging.judge import judge_load
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.notes import iterate_notes
from fecontact.judging.solved_load import Status
from fecontact.judging.verdict import Verdict
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.meshes import Meshes, SolvedBodies
from fecontact.solving.position import Position, Progress, expect_position


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Cost of the finite elements of a case.

    Attributes
    ----------
    path
        Linear solver.
    seconds, memory_MB
        Wall seconds, and resident memory after each step, by the name of the step.
    cpu_seconds
        CPU seconds of all steps, without files and pictures; None in a result that an earlier version wrote.
    peak_memory_MB
        Largest resident memory of the process.
    """

    path: SolverName
    seconds: Mapping[str, float]
    cpu_seconds: float | None
    memory_MB: Mapping[str, float]
    peak_memory_MB: float


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseResult:
    """Result of a case.

    It can be pickled with its meshes, but without their factors.

    Attributes
    ----------
    load
        Solved load with all its fields and rungs, and all measures and verdicts.
    placement
        Wheel on rail.
    von_mises
        Largest von Mises stress of rail and wheel, and its place.
    effort
        Cost of the finite elements.
    bodies
        Both meshes with their displacements; None in a result that was read from a folder, which has them in `rail.vtu`
        and `wheel.vtu`.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> result.pressure_MPa.shape == result.grid.shape
    True
    >>> round(result.normal_force_N, -1)
    100000.0
    """

    load: JudgedLoad
    placement: Placement
    von_mises: Mapping[str, StressPeak]
    effort: Effort
    bodies: SolvedBodies | None

    def __repr__(self) -> str:
        return f"<CaseResult{repr(self.load).removeprefix('<JudgedLoad')}"

    def _repr_html_(self) -> str:
        """HTML for a notebook: summary, and a table of Hertz's deviations with their uncertainties.

        Deviations and uncertainties are without a unit.
        """
        rows = {
            measure: {"deviation of Hertz": f"{deviation:+.3g}", "±": f"{self.load.uncertainty[measure]:.2g}"}
            for measure, deviation in self.load.deviation.items()
            if measure in self.load.uncertainty
        }
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    def __len__(self) -> int:
        return 1

    def __iter__(self) -> Iterator[CaseResult]:
        """Iterate over this result alone, as over the results of several cases."""
        yield self

    def __getitem__(self, number: int) -> CaseResult:
        return (self,)[number]

    @property
    def case(self) -> Case:
        """Inputs of the case."""
        return self.load.case

    @property
    def solved(self) -> tuple[JudgedLoad, ...]:
        """Load as a tuple, as for the solved loads of a position in a map."""
        return (self.load,)

    @property
    def short_of_memory(self) -> bool:
        """Whether the machine had too little memory for some of the requested results."""
        return self.load.solved.short_of_memory

    @property
    def status(self) -> Status:
        """`converged`, or the reason why the result must not be used."""
        return self.load.status

    @property
    def verdict(self) -> Verdict:
        """Verdict on Hertz, with deciding measure and cause; with a yield stress against bodies that yield."""
        return self.load.verdict

    @property
    def elastic_verdict(self) -> Verdict | None:
        """Verdict against elastic bodies; None without a yield stress, where `verdict` has it."""
        return self.load.elastic_verdict

    @property
    def comparison(self) -> Comparison:
        """Hertz's ellipse compared with the finite elements."""
        return self.load.comparison

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse at the first contact point under `normal_force_N`."""
        return self.load.hertz

    @property
    def normal_force_N(self) -> float:
        """Normal force of the finite elements along the contact normal at first contact."""
        return self.load.normal_force_N

    @property
    def grid(self) -> ContactGrid:
        """Pressure nodes of the whole contact on the rail's surface.

        x (nx,) is on both sides of 0, s (ns,) is across.
        """
        return self.load.fe.even().pressure.whole().grid

    @property
    def pressure_MPa(self) -> Floats:
        """Pressure (nx, ns) of the finite elements on `grid`.

        Its sum multiplied by the nodes' area is the normal force.
        """
        return self.load.fe.even().pressure.whole().values

    @property
    def gap_mm(self) -> Floats:
        """Deformed gap (nx, ns) on `grid`."""
        rung = self.load.fe.even()
        return Field(grid=rung.grid, values=rung.gap_mm).whole().values

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes about the profiles and about the contact as a whole."""
        return tuple(iterate_notes(self.placement, self.comparison))


def solve(case: Case, *, progress: Progress | None = None) -> CaseResult:
    """Solve a case on two meshes, judge Hertz, and refine an UNRESOLVED verdict.

    The rungs between Hertz and the finite elements are computed too.

    Parameters
    ----------
    case
        Case with profiles, position, load and criteria.
    progress
        Called with the name of each step as it begins.

    Returns
    -------
    CaseResult
        Result; a contact that does not converge is not an error, but a result with this `status`.

    Raises
    ------
    InputError
        For inputs that cannot be solved, with value, range and remedy; `MemoryShortageError` if the machine has too
        little memory.

    Examples
    --------
    >>> import fecontact
    >>> pair = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    >>> result = fecontact.solve(fecontact.Case(**pair, resolution="quick", refine="never"))
    >>> result.status, result.verdict.answer
    ('converged', 'HOLDS')
    >>> abs(result.load.deviation["p_max_MPa"]) < 0.05
    True
    """
    case.creep.refuse_unheard()
    position = expect_position(case, progress=progress)
    return _solved(position, Meshes(position))


def _solved(position: Position, meshes: Meshes) -> CaseResult:
    """Solve a position's load on its meshes and judge it.

    The effort covers all steps since the last load.
    """
    solved_load = meshes.solve(position)
    bodies = meshes.recover_bodies(solved_load)
    with position.clock.step("recover"):
        peaks: dict[str, StressPeak] = {
            body.mesh.name: find_stress_peak(body.mesh, bodies.stress_MPa[body.mesh.name])
            for body in (bodies.coupled.rail, bodies.coupled.wheel)
        }
    with position.clock.step("judge"):
        load = judge_load(solved_load, position.placement)
    return CaseResult(
        load=load,
        placement=position.placement,
        von_mises=peaks,
        effort=Effort(
            path=bodies.coupled.rail.solver,
            seconds=position.clock.take_seconds(),
            cpu_seconds=position.clock.take_cpu_seconds(),
            memory_MB=position.clock.memory_MB,
            peak_memory_MB=measure_peak_memory_MB(),
        ),
        bodies=bodies,
    )


def measure_peak_memory_MB() -> float:
    """Largest resident memory of this process.

    It is the present memory if the system does not record the largest.

    Returns
    -------
    float
        Memory in MB.
    """
    try:
        import resource
    except ImportError:
        # On Windows there is no such module.
        info = psutil.Process().memory_info()
        return float(getattr(info, "peak_wset", info.rss)) / 1e6
    import sys

    # The unit is bytes on macOS, and kilobytes elsewhere.
    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * unit / 1e6


# --- Several loads at a position with the factors reused, and the stiffness of the contact over the load.
#
# Assembly and factors do not depend on the load: after the first load of a mesh, each further load costs only its
# contact iterations, which start from the half-space pressure.

# Loads share meshes if the elements are at most this factor finer than needed for the largest load: a mesh for all
# loads would have too few elements for the smallest load, or too many for the largest.
_SHARED_SIZE_RATIO = 1.5
# An expected semi-axis is a whole number of nodes, so that a load between two other loads may need elements that are
# finer by this factor than for both: shared meshes are finer by this factor.
_SIZE_RESERVE = 1.0 + 1.0 / NODES_PER_SEMI_AXIS
# Allowance for rounding in the comparison of element sizes.
_ROUNDING_FACTOR = 1.0 + 1e-9


class LoadSweep:
    """Position that is solved for several loads, in turn.

    Loads are best given in descending order. Each load is solved on the smallest meshes that were made for a load at
    least as large and have fine enough elements for its patch. A single set of meshes is in memory at a time.

    Parameters
    ----------
    case
        Case with profiles and position; its load is ignored.
    planned_N
        Planned loads in N; meshes are made so that several loads can share them.
    """

    def __init__(self, case: Case, planned_N: Sequence[float] = ()) -> None:
        """Place the case.

        Parameters
        ----------
        case
            Case; its load is replaced by the loads that are solved.
        planned_N
            Loads in N that will be solved, for the choice of common meshes.
        """
        self._position = _placed(case, planned_N)
        self.placement = self._position.placement
        self._planned: dict[float, Position] = {}
        for load_N in sorted(set(planned_N), reverse=True):
            # A load that cannot be solved is reported when it is solved.
            with suppress(InputError, ConvergenceError):
                self._planned[load_N] = self._position.for_load(load_N)
        self._groups: list[Meshes] = []
        self._open: Meshes | None = None

    def result(self, load_N: float) -> CaseResult:
        """Solve a planned load as `fecontact.solve` does, on the meshes for all planned loads.

        The result does not depend on which of these loads were solved before. The first effort contains the common
        steps of all loads.

        Parameters
        ----------
        load_N
            Load in N.

        Returns
        -------
        CaseResult
            Result of the load.
        """
        for planned_position in self._planned.values():
            self._find_or_make_meshes(planned_position)
        position = self._planned.get(load_N) or self._position.for_load(load_N)
        meshes = self._open_meshes(position)
        try:
            return _solved(position, meshes)
        finally:
            meshes.drop_enlarged()

    def solve(self, load_N: float, *, refine: bool = True) -> JudgedLoad:
        """Solve a load and judge it.

        Parameters
        ----------
        load_N
            Load in N.
        refine
            Whether the load is also solved on finer meshes while its verdict is UNRESOLVED, within the limits of the
            case. False for a trial load of a search: it is judged by Hertz alone, which decides on the next load.

        Returns
        -------
        JudgedLoad
            Load with its verdicts.

        Raises
        ------
        InputError
            As in `fecontact.solve`.
        """
        check_positive("load", load_N, "N", "give the wheel load")
        position = self._planned.get(load_N) or self._position.for_load(load_N)
        if not refine:
            # Bodies that yield do so here too: the limits of a load lie between verdicts of equal kind.
            position = replace(position, case=disable_refinement(position.case))
        solved_load = self._open_meshes(position).solve(position)
        with position.clock.step("judge"):
            return judge_load(solved_load, self.placement, THEORIES if refine else (HERTZ,))

    def is_ready_for(self, load_N: float) -> bool:
        """Whether a planned load can be solved on the meshes with factors in memory.

        Parameters
        ----------
        load_N
            Load in N.

        Returns
        -------
        bool
            Whether no new mesh is needed.
        """
        position = self._planned.get(load_N)
        return position is not None and self._open is not None and self._open is self._find_group(position)

    def close(self) -> None:
        """Release the factors; the sweep may continue, with new factors."""
        if self._open is not None:
            self._open.close()
            self._open = None

    def _open_meshes(self, position: Position) -> Meshes:
        """Meshes for a position, with the factors of all other meshes released."""
        meshes = self._find_or_make_meshes(position)
        if self._open is not meshes:
            self.close()
            self._open = meshes
        return meshes

    def _find_group(self, position: Position) -> Meshes | None:
        """Smallest existing meshes that serve a position; None without such meshes."""
        usable_groups = [group for group in self._groups if _can_serve(group.position, position)]
        return min(usable_groups, key=lambda group: group.position.case.load_N) if usable_groups else None

    def _find_or_make_meshes(self, position: Position) -> Meshes:
        """Existing meshes that serve a position, or new meshes.

        New meshes are made for the next larger planned load, and also serve smaller planned loads with a similar size
        of patch. They are kept for later loads.
        """
        if (group := self._find_group(position)) is not None:
            return group
        # Meshes for a load between planned loads are made for the next larger planned load, so that both can share
        # them.
        next_load_N = min((load for load in self._planned if load >= position.case.load_N), default=None)
        largest = position if next_load_N is None else self._planned[next_load_N]
        sharing_positions = [position]
        for load_N, planned_position in self._planned.items():
            if load_N < position.case.load_N and _size_ratio(planned_position, largest) <= _SHARED_SIZE_RATIO:
                sharing_positions.append(planned_position)
        reserve = 1.0 if next_load_N in (None, position.case.load_N) else _SIZE_RESERVE
        meshes = Meshes(_make_shared_position(largest, sharing_positions, reserve), keep=True)
        self._groups.append(meshes)
        return meshes


@dataclass(frozen=True, kw_only=True, eq=False)
class SharedLoads:
    """Loads of a position that are solved separately, with a common sweep.

    The first user makes the sweep for all.

    Attributes
    ----------
    case
        Case with profiles and position.
    loads_N
        All loads in N.
    """

    case: Case
    loads_N: tuple[float, ...]

    @cached_property
    def sweep(self) -> LoadSweep:
        """Sweep of all loads."""
        return LoadSweep(self.case, self.loads_N)


def _make_shared_position(largest: Position, positions: Sequence[Position], reserve: float) -> Position:
    """Position under its largest load, with the finest elements that any sharing load needs.

    `reserve` (1 or more) divides the sizes of the elements, for loads that are not yet solved.
    """
    length_mm, width_mm = (
        min(position.element_size_mm[direction] for position in positions) / reserve for direction in (0, 1)
    )
    patches = []
    for patch in largest.expected.parts:
        widest_mm = min(position.widest_element_mm(patch.s_low_mm, patch.s_high_mm) for position in positions)
        patches.append(replace(patch, larger=max(1.0, min(patch.larger, widest_mm / reserve / width_mm))))
    expected = replace(largest.expected, parts=tuple(patches))
    return replace(largest, element_size_mm=(length_mm, width_mm), expected=expected, several_loads=True)


def disable_refinement(case: Case) -> Case:
    """Case without refinement, which is solved on its first two meshes only."""
    return replace(case, refine="never")


def _placed(case: Case, planned_N: Sequence[float]) -> Position:
    """Position under its largest planned load that can be set up.

    If there is no such load, the position is under the load of the case.
    """
    for load_N in sorted(set(planned_N), reverse=True):
        with suppress(InputError, ConvergenceError):
            return expect_position(replace(case, load_N=load_N))
    return expect_position(case)


def _size_ratio(position: Position, meshed_position: Position) -> float:
    """Ratio of the element size of existing meshes to the element size for another load."""
    pairs = zip(meshed_position.element_size_mm, position.element_size_mm, strict=True)
    return max(meshed_size_mm / needed_size_mm for meshed_size_mm, needed_size_mm in pairs)


def _can_serve(meshed_position: Position, position: Position) -> bool:
    """Whether existing meshes are wide and fine enough for another load.

    Meshes for a smaller load are never wide enough. The sizes of elements may exceed the required sizes by rounding
    only.
    """
    # The margin around the expected patch and the growth of the zone are sufficient if a smaller load reaches further.
    if _size_ratio(position, meshed_position) > _ROUNDING_FACTOR or meshed_position.case.load_N < position.case.load_N:
        return False
    # Patches at a large distance have elements of different widths, which need not shrink by an equal factor.
    return len(meshed_position.expected.parts) == 1 or all(
        meshed_position.widest_element_mm(patch.s_low_mm, patch.s_high_mm)
        <= _ROUNDING_FACTOR * position.widest_element_mm(patch.s_low_mm, patch.s_high_mm)
        for patch in position.expected.parts
    )


# --- Stiffness of a contact over its load: a law fitted to the approaches of a load sweep.


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentStiffness:
    """Stiffness dF/dapproach (N/mm) under a normal force, from a fit and from Hertz.

    Attributes
    ----------
    normal_force_N
        Normal force in N.
    with_bulk_N_per_mm, contact_N_per_mm
        Stiffness of the fit with and without its bulk term.
    error_N_per_mm, contact_error_N_per_mm
        Standard errors of the fit; NaN for two points, which a fit meets exactly.
    hertz_N_per_mm
        Stiffness by Hertz.
    deviation
        (Hertz - contact) / contact, relative to the stiffness without the bulk term (-).
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
    """Approach of a position over its normal force F: c1 F^(2/3) + c2 F.

    Attributes
    ----------
    c1_mm_per_N23, c2_mm_per_N
        Contact compliance, which Hertz includes, and bulk compliance of the bodies down to their cut planes, which
        Hertz leaves out. The bulk compliance is negative if the cut planes stiffen the bodies by more than the shape of
        the bodies softens them, compared with half-spaces.
    covariance : ndarray of shape (2, 2)
        Covariance of c1 and c2; NaN for two points.
    hertz_c1_mm_per_N23
        K_H^(-2/3).
    residual
        Root mean square of the relative error of the approach (-).
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
        """Tangent stiffness under a normal force.

        Parameters
        ----------
        normal_force_N
            Normal force in N.

        Returns
        -------
        TangentStiffness
            Stiffness in N/mm with standard errors, and Hertz's stiffness.
        """
        root = normal_force_N ** (-1.0 / 3.0)
        slope = np.array([2.0 / 3.0 * root, 1.0])
        contact_stiffness = 1.5 / (root * self.c1_mm_per_N23)
        stiffness_with_bulk = 1.0 / float(slope @ (self.c1_mm_per_N23, self.c2_mm_per_N))
        hertz_stiffness = 1.5 / (root * self.hertz_c1_mm_per_N23)
        return TangentStiffness(
            normal_force_N=normal_force_N,
            with_bulk_N_per_mm=stiffness_with_bulk,
            error_N_per_mm=stiffness_with_bulk**2 * math.sqrt(slope @ self.covariance @ slope),
            contact_N_per_mm=contact_stiffness,
            contact_error_N_per_mm=contact_stiffness * self.c1_error / self.c1_mm_per_N23,
            hertz_N_per_mm=hertz_stiffness,
            deviation=hertz_stiffness / contact_stiffness - 1.0,
        )


def fit_stiffness(loads: Sequence[JudgedLoad]) -> Stiffness:
    """Fit the approach of the converged loads by least squares of its relative error.

    Parameters
    ----------
    loads
        Judged loads of a position.

    Returns
    -------
    Stiffness
        Fitted compliances with their covariance.

    Raises
    ------
    InputError
        For fewer than two different loads.
    """
    usable_loads = [load for load in loads if load.usable]
    force_N = np.array([load.normal_force_N for load in usable_loads])
    if np.unique(force_N).size < 2:
        raise InputError(
            f"stiffness: {np.unique(force_N).size} converged loads; give at least two loads, preferably four"
        )
    approach_mm = np.array([load.comparison.fe.approach_mm for load in usable_loads])
    # Errors of meshes are proportional to the approach: every load has equal weight.
    terms = np.column_stack([force_N ** (2.0 / 3.0), force_N]) / approach_mm[:, None]
    scale = np.linalg.norm(terms, axis=0)
    scaled, *_ = np.linalg.lstsq(terms / scale, np.ones(force_N.size), rcond=None)
    error = (terms / scale) @ scaled - 1.0
    degrees_of_freedom = force_N.size - 2
    variance = float(error @ error) / degrees_of_freedom if degrees_of_freedom else math.nan
    covariance = variance * np.linalg.inv((terms / scale).T @ (terms / scale)) / np.outer(scale, scale)
    c1, c2 = scaled / scale
    hertz_c1 = usable_loads[-1].hertz.stiffness_N_per_mm15 ** (-2.0 / 3.0)
    return Stiffness(
        c1_mm_per_N23=float(c1),
        c2_mm_per_N=float(c2),
        covariance=np.asarray(covariance),
        hertz_c1_mm_per_N23=hertz_c1,
        residual=math.sqrt(float(np.mean(error**2))),
    )
