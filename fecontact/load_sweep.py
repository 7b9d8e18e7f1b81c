"""Several loads at one position with the factors reused, and the stiffness of the contact over the load.

Assembly and factors do not depend on the load: after the first load of a mesh each further one costs only its contact
iterations, started from the half-space pressure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.applicability import Judgement
from fecontact.case import Case
from fecontact.comparison import Measures
from fecontact.errors import InputError, check_positive
from fecontact.judged_load import JudgedLoad, Meshes
from fecontact.position import Position, Progress, position_of

Floats = NDArray[np.float64]

# A load whose patch has fewer than this part of the elements that the resolution asks for gets meshes of its own.
# Patches grow with the cube root of the load: one set of meshes serves loads down to about a fifth of its largest.
_LEAST_ELEMENTS = 0.6


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadPoint:
    """One load at a position.

    Attributes
    ----------
    status
        `converged`, or why the point must not be used.
    deviation, uncertainty
        (Hertz - FE) / FE of each measure, and how sure it is.
    verdict
        Whether Hertz holds; open where the status is not `converged`.
    normal_force_N
        Force along the contact normal at first touch.
    half_space_p_max_MPa
        Peak pressure of the true gap on a half-space.
    hertz_stiffness_N_per_mm15
        K_H of Hertz's spring F = K_H approach^1.5.
    meshes
        On how many meshes it was solved.
    warnings
        What stopped a refinement.
    """

    load_N: float
    status: str
    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    verdict: Judgement
    cause: str | None
    normal_force_N: float
    half_space_p_max_MPa: float
    hertz_stiffness_N_per_mm15: float
    pieces: int
    meshes: int
    warnings: tuple[str, ...] = field(default=())


class LoadSweep:
    """A position that is solved for one load after the other.

    Loads are best given from the largest down: each goes to the smallest meshes made for a load at least as large on
    which its patch has enough elements. Only one set of meshes is in memory at a time.
    """

    def __init__(self, case: Case, *, progress: Progress | None = None) -> None:
        """Place the case; its own load does not matter."""
        self._position = position_of(case, progress=progress)
        self._groups: list[Meshes] = []
        self._open: Meshes | None = None

    def solve(self, load_N: float) -> LoadPoint:
        """Solve one load.

        Raises
        ------
        InputError
            As `fecontact.solve` does.
        """
        wanted = self._position.for_load(check_positive("load", load_N, "N", "give the wheel load"))
        meshes = self._meshes_for(wanted)
        if self._open is not meshes:
            self.close()
            self._open = meshes
        return _point(load_N, meshes.solve(load_N), wanted)

    def close(self) -> None:
        """Release the factors; the sweep may go on, with new ones."""
        if self._open is not None:
            self._open.close()
            self._open = None

    @property
    def groups_N(self) -> tuple[float, ...]:
        """The loads that meshes were made for."""
        return tuple(group.position.case.load_N for group in self._groups)

    def _meshes_for(self, wanted: Position) -> Meshes:
        fitting = [group for group in self._groups if _serves(group.position, wanted)]
        if fitting:
            return min(fitting, key=lambda group: group.position.case.load_N)
        made = Meshes(wanted, keep=True)
        self._groups.append(made)
        return made


def _serves(meshed: Position, wanted: Position) -> bool:
    """Whether meshes made for one load hold the patch of another with enough elements."""
    fine_enough = all(
        _LEAST_ELEMENTS * size <= needed
        for size, needed in zip(meshed.element_size_mm, wanted.element_size_mm, strict=True)
    )
    # the margin around the expected patch, and the zone's growth, take what a smaller load reaches beyond
    return fine_enough and meshed.case.load_N >= wanted.case.load_N


def _point(load_N: float, judged: JudgedLoad, position: Position) -> LoadPoint:
    level = judged.levels[0]
    ladder, _, cause = judged.climb(position)
    return LoadPoint(
        load_N=load_N,
        status=level.status,
        fe=level.comparison.fe,
        hertz=level.comparison.hertz,
        deviation=level.comparison.deviation,
        uncertainty=judged.uncertainty,
        verdict=replace(judged.judgement, verdict=judged.verdict),
        cause=cause,
        normal_force_N=level.normal_force_N,
        half_space_p_max_MPa=ladder.half_space.p_max_MPa,
        hertz_stiffness_N_per_mm15=level.hertz.stiffness_N_per_mm15,
        pieces=level.comparison.pieces,
        meshes=len(judged.levels),
        warnings=judged.limits,
    )


def solve_loads(case: Case, loads_N: Sequence[float], progress: Progress | None = None) -> tuple[LoadPoint, ...]:
    """Solve several loads at the position of a case with the factors reused.

    Returns
    -------
    tuple of LoadPoint
        In the order of the loads.

    Raises
    ------
    InputError
        As `fecontact.solve` does, for the first load that cannot be solved.
    """
    sweep = LoadSweep(case, progress=progress)
    try:
        solved = {load: sweep.solve(load) for load in sorted(set(loads_N), reverse=True)}
    finally:
        sweep.close()
    return tuple(solved[load] for load in loads_N)


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentStiffness:
    """Stiffness dF/dapproach (N/mm) under a normal force: of the fit with and without its bulk term, and Hertz's.

    Attributes
    ----------
    error_N_per_mm, contact_error_N_per_mm
        Standard errors of the fit, NaN for two points, which it goes through.
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
        Contact, which Hertz knows, and bulk compliance of the bodies down to their cut planes, which he does not. It is
        negative where the cut planes hold more than the bodies' shape gives away: Hertz's half-spaces reach further.
    covariance (2, 2)
        Of c1 and c2; NaN for two points.
    hertz_c1_mm_per_N23
        K_H^(-2/3).
    c1_deviation
        (Hertz - fit) / fit of c1.
    residual
        Root mean square of the relative error of the approach.
    """

    c1_mm_per_N23: float
    c2_mm_per_N: float
    covariance: Floats
    hertz_c1_mm_per_N23: float
    c1_deviation: float
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


def fit_stiffness(points: Sequence[LoadPoint]) -> Stiffness:
    """Fit the approach of the converged points by least squares of its relative error.

    Raises
    ------
    InputError
        For fewer than two loads.
    """
    usable = [point for point in points if point.status == "converged"]
    force = np.array([point.normal_force_N for point in usable])
    if np.unique(force).size < 2:
        raise InputError(f"stiffness: {np.unique(force).size} converged loads; give at least two, better four")
    approach = np.array([point.fe.approach_mm for point in usable])
    # meshes err by a part of the approach, not by a length: every load counts alike
    terms = np.column_stack([force ** (2.0 / 3.0), force]) / approach[:, None]
    scale = np.linalg.norm(terms, axis=0)
    scaled, *_ = np.linalg.lstsq(terms / scale, np.ones(force.size), rcond=None)
    error = (terms / scale) @ scaled - 1.0
    free = force.size - 2
    variance = float(error @ error) / free if free else math.nan
    covariance = variance * np.linalg.inv((terms / scale).T @ (terms / scale)) / np.outer(scale, scale)
    c1, c2 = scaled / scale
    hertz = usable[-1].hertz_stiffness_N_per_mm15 ** (-2.0 / 3.0)
    return Stiffness(
        c1_mm_per_N23=float(c1),
        c2_mm_per_N=float(c2),
        covariance=np.asarray(covariance),
        hertz_c1_mm_per_N23=hertz,
        c1_deviation=hertz / float(c1) - 1.0,
        residual=math.sqrt(float(np.mean(error**2))),
    )
