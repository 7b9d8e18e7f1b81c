"""The frictionless unilateral contact problem: find p >= 0 with gap >= 0, p * gap = 0 and a given total load.

The solver knows neither bodies nor meshes: it is given a compliance (pressure -> displacement of the surfaces towards
each other), the undeformed gap and the load, so that every kind of compliance is solved in exactly the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats

Compliance = Callable[[Floats], Floats]
ContactStatus = Literal["converged", "not converged"]

# Largest error of the gap relative to the approach: 1e-7 leaves some 1e-7 in the pressure, far below any mesh error.
CONTACT_TOLERANCE = 1e-7
CONTACT_ITERATIONS = 300
# Part of the nodes that press at first, and part of a guessed peak that is rounding.
_NEAREST, _ROUNDING = 0.2, 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactProblem:
    """A contact problem on pressure nodes.

    Attributes
    ----------
    compliance
        Maps nodal pressures (n,) in MPa to the opening (n,) in mm that they cause between the surfaces; symmetric and
        positive definite in the inner product weighted by `area_mm2`.
    gap_mm (n,)
        Undeformed gap along the nodes' normals.
    closing (n,)
        How much the gap closes when the bodies approach by 1: cosine between the node's normal and the approach.
    area_mm2 (n,)
        Area that each node stands for; in a half model doubled, so that sums give the whole contact.
    stiffness
        Maps gaps (n,) to about the pressures that would close them, to some factor: the inverse of a compliance like
        this one, symmetric and positive definite as it is. The closer it is, the fewer iterations are needed; None
        where nothing is known of it.
    within
        The compliance to about this relative error, where less takes less time; None where it is all the same.
    """

    compliance: Compliance
    gap_mm: Floats
    closing: Floats
    area_mm2: Floats
    stiffness: Compliance | None = None
    within: Callable[[Floats, float], Floats] | None = None

    def load_N(self, pressure: Floats) -> float:
        """Force along the approach that pressures (n,) in MPa carry."""
        return inner(self.area_mm2 * self.closing, pressure)

    def opening_mm(self, solution: ContactSolution) -> Floats:
        """Opening (n,) that a solution's pressures cause, from its gap: the compliance is not applied again."""
        return solution.gap_mm + solution.approach_mm * self.closing - self.gap_mm


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactSolution:
    """Pressure of a contact problem, with its residuals relative to the approach.

    Attributes
    ----------
    pressure_MPa, gap_mm (n,)
        Pressure and deformed gap at the nodes.
    contact_residual
        Largest gap at a node with pressure.
    penetration_residual
        Deepest overlap at a node without pressure.
    load_balance
        Error of the total load relative to the load.
    compliance_calls
        How many times the compliance was applied.
    """

    status: ContactStatus
    pressure_MPa: Floats
    gap_mm: Floats
    approach_mm: float
    iterations: int
    compliance_calls: int
    contact_residual: float
    penetration_residual: float
    load_balance: float

    @property
    def in_contact(self) -> NDArray[np.bool_]:
        """Nodes that carry pressure (n,)."""
        return self.pressure_MPa > 0.0

    @property
    def residual(self) -> float:
        """Sum of contact and penetration residual, relative to the approach."""
        return self.contact_residual + self.penetration_residual


def solve_contact(
    problem: ContactProblem,
    load_N: float | None,
    *,
    approach_mm: float | None = None,
    start_MPa: Floats | None = None,
    tolerance: float = CONTACT_TOLERANCE,
    iterations: int = CONTACT_ITERATIONS,
) -> ContactSolution:
    """Solve a contact problem under a load, or at an approach, by conjugate gradients on the pressures.

    Parameters
    ----------
    load_N
        Force along the approach, > 0; None if an approach is given.
    approach_mm
        Prescribed approach instead of a load; not 0.
    start_MPa (n,)
        First guess of the pressure. Without it the pressure under a load is larger the smaller the gap is, on the nodes
        with the smallest gaps, and zero at an approach.
    tolerance
        Bound of both residuals relative to the approach.

    Notes
    -----
    Polonsky and Keer (1999), with nodal areas as weights and normals that need not be parallel, and with a
    preconditioner (Vollebregt 2014). Every iteration holds the load, or the approach, exactly. Nodes that press or
    overlap take part in a step, and pressures that it would make negative are cut off. Where the contact has changed,
    Polak and Ribiere's factor begins anew by itself.
    """
    w = problem.area_mm2
    p = _start(problem, load_N) if start_MPa is None or not np.any(start_MPa > 0.0) else _cleared(start_MPa)
    p = p * _scale(problem, load_N, p)
    direction, gap_before, norm_before = np.zeros_like(p), np.zeros_like(p), np.inf
    moving = np.zeros(p.size, dtype=bool)
    calls, iteration = 1, 0
    opening = problem.compliance(p)
    while True:
        iteration += 1
        state = solution_at(problem, load_N, p, opening, tolerance, approach_mm)
        if state.status == "converged" or iteration == iterations:
            return replace(state, iterations=iteration, compliance_calls=calls)
        before, moving = moving, state.in_contact | (state.gap_mm < 0.0)
        total = problem.gap_mm + opening
        gap = total - (_mean(problem, total, moving) if approach_mm is None else approach_mm) * problem.closing
        downhill = _pressures(problem, gap, moving)
        if approach_mm is None:
            # a direction that carries none of the load
            if not np.array_equal(before, moving):
                upright = _pressures(problem, problem.closing, moving)
            downhill = downhill - problem.load_N(downhill) / problem.load_N(upright) * upright
        norm = inner(w * downhill, gap)
        factor = max(0.0, inner(w * downhill, gap - gap_before) / norm_before)
        direction = np.where(moving, downhill + factor * direction, 0.0)
        gap_before, norm_before = gap, norm
        moved = problem.compliance(direction)
        calls += 1
        moved_mean = _mean(problem, moved, moving) if approach_mm is None else 0.0
        curvature = inner(w * direction, moved - moved_mean * problem.closing)
        step = inner(w * gap, direction) / curvature
        trial = p - step * direction
        new = np.maximum(trial, 0.0)
        scale = _scale(problem, load_N, new)
        if np.any(trial < 0.0):
            opening = problem.compliance(scale * new)
            calls += 1
        else:
            # the opening is linear in the pressure: no new application of the compliance
            opening = scale * (opening - step * moved)
        p = scale * new


def _pressures(problem: ContactProblem, gap: Floats, nodes: NDArray[np.bool_]) -> Floats:
    """About the pressures (n,) on some nodes that would close gaps (n,) there; zero on all others."""
    there = np.where(nodes, gap, 0.0)
    return there if problem.stiffness is None else np.where(nodes, problem.stiffness(there), 0.0)


def solution_at(
    problem: ContactProblem,
    load_N: float | None,
    pressure: Floats,
    opening: Floats,
    tolerance: float,
    approach_mm: float | None = None,
) -> ContactSolution:
    """Solution of pressures (n,) and the opening (n,) they cause: gap, residuals, and the approach if none is given.

    It counts as one iteration and one application of the compliance.
    """
    total = problem.gap_mm + opening
    active = pressure > 0.0
    approach = _mean(problem, total, active) if approach_mm is None else approach_mm
    gap = total - approach * problem.closing
    contact = float(np.abs(gap[active]).max(initial=0.0) / abs(approach))
    penetration = float(max(0.0, -gap[~active].min(initial=0.0)) / abs(approach))
    return ContactSolution(
        status="converged" if max(contact, penetration) <= tolerance else "not converged",
        pressure_MPa=pressure,
        gap_mm=gap,
        approach_mm=approach,
        iterations=1,
        compliance_calls=1,
        contact_residual=contact,
        penetration_residual=penetration,
        load_balance=0.0 if load_N is None else abs(problem.load_N(pressure) / load_N - 1.0),
    )


def _mean(problem: ContactProblem, values: Floats, nodes: NDArray[np.bool_]) -> float:
    """Approach that best fits displacements (n,) on some nodes: their mean if all normals are parallel to it."""
    c, w = problem.closing[nodes], problem.area_mm2[nodes]
    return inner(w * c, values[nodes]) / inner(w * c, c)


def inner(a: Floats, b: Floats) -> float:
    """Inner product of (n,) and (n,).

    Not by BLAS: starting and ending its threads takes a hundred times as long as a sum of ten thousand terms, and their
    number changes the last bits of the sum.
    """
    return float(np.einsum("i,i->", a, b))


def _scale(problem: ContactProblem, load_N: float | None, pressure: Floats) -> float:
    """Factor by which pressures (n,) carry the load; 1 if no load is given."""
    return 1.0 if load_N is None else load_N / problem.load_N(pressure)


def _cleared(start: Floats) -> Floats:
    """A first guess (n,) without what is negative, and without what interpolation leaves beside its contact."""
    return np.where(start > _ROUNDING * start.max(), start, 0.0)


def _start(problem: ContactProblem, load_N: float | None) -> Floats:
    if load_N is None:
        return np.zeros_like(problem.gap_mm)
    return np.maximum(np.quantile(problem.gap_mm, _NEAREST) - problem.gap_mm, 0.0)


# --- Mixing of the last solutions of a fixed-point iteration (Anderson 1965; Walker and Ni 2011).


def mixture(solved: Sequence[Floats], changes: Sequence[Floats]) -> Floats:
    """Combination (n,) of solutions whose changes cancel best; a single solution is returned unchanged.

    Parameters
    ----------
    solved, changes
        Output (n,) of each step of the iteration, and its weighted difference from the step's input (n,), the last step
        at the end.
    """
    if len(solved) == 1:
        return solved[0]
    columns = np.stack([changes[-1] - change for change in changes[:-1]], axis=1)
    part, *_ = np.linalg.lstsq(columns, changes[-1], rcond=1e-10)
    return np.asarray(solved[-1] - sum(t * (solved[-1] - q) for t, q in zip(part, solved[:-1], strict=True)))


# --- The contact problem of an expensive compliance, solved through a cheap model of it.
#
# Finite elements answer a pressure nearly as a half-space does, with two differences: the softness of the elements acts
# over a few nodes and alike at every node; the shape of the bodies acts everywhere and varies slowly. A model that is
# the same at every node, and agrees with one response of the real compliance, contains the softness exactly. A few
# corrections for the shape are then enough.

_MOST_CORRECTIONS = 15
# Error of an application of the compliance as a part of the residual before it, which a correction makes four to a
# hundred times smaller, and the residual that is expected at first; the error as a part of the tolerance at the end.
_UNSEEN, _AT_FIRST, _AT_LAST = 2e-3, 0.15, 0.1
SLIDES = 4
"""Corrections after which bodies on a steep surface slide along each other: the residual is some 1e-4 after them."""
_DEPTH = 4


def solve_by_correction(
    problem: ContactProblem,
    load_N: float,
    model: Compliance,
    *,
    start_MPa: Floats | None = None,
    slid: Callable[[ContactSolution], Floats] | None = None,
    tolerance: float = CONTACT_TOLERANCE,
) -> ContactSolution:
    """Solve a contact problem by repeated solutions with a model of its compliance.

    Each correction solves the model with the gap enlarged by the model's error under the last pressure. The last
    solutions are combined by Anderson mixing (Anderson 1965; Walker and Ni 2011). If this stalls, conjugate gradients
    continue from the best pressure.

    Parameters
    ----------
    model
        Positive definite approximation of the compliance, much cheaper to apply.
    start_MPa (n,)
        Start of the first solution of the model.
    slid
        The gap (n,) in mm after the bodies have slid along each other as under a solution, for bodies that do; it is
        asked after each of the first `SLIDES` corrections, and the last gap is the one that is solved.
    tolerance
        Bound of both residuals, relative to the approach, as in `solve_contact`.
    """
    weight = np.sqrt(problem.area_mm2)
    cheap = replace(problem, compliance=model, within=None)
    p = solve_contact(cheap, load_N, start_MPa=start_MPa, tolerance=1e-6).pressure_MPa
    solved: list[Floats] = []
    changes: list[Floats] = []
    best, best_p = np.inf, p
    residual = _AT_FIRST
    for calls in range(1, _MOST_CORRECTIONS + 1):
        error = max(_UNSEEN * residual, _AT_LAST * tolerance)
        opening = problem.compliance(p) if problem.within is None else problem.within(p, error)
        state = solution_at(problem, load_N, p, opening, tolerance)
        residual = max(state.contact_residual, state.penetration_residual)
        if slid is not None and calls <= SLIDES:
            # what was solved before was another contact
            problem, solved, changes = replace(problem, gap_mm=slid(state)), [], []
        elif state.status == "converged" and error <= _AT_LAST * tolerance:
            return replace(state, iterations=calls, compliance_calls=calls)
        elif residual < best:
            best, best_p = residual, p
        # the inner solution must be so exact that its error does not appear in the next residual
        inner = replace(cheap, gap_mm=problem.gap_mm + opening - model(p))
        q = solve_contact(inner, load_N, start_MPa=p, tolerance=max(1e-3 * residual, 0.1 * tolerance)).pressure_MPa
        solved, changes = [*solved, q][-_DEPTH - 1 :], [*changes, (q - p) * weight][-_DEPTH - 1 :]
        # what the mixture leaves outside of the last contact would be a gap under pressure
        mixed = np.where(q > 0.0, np.maximum(mixture(solved, changes), 0.0), 0.0)
        p = mixed if len(solved) == 1 else mixed * (load_N / problem.load_N(mixed))
    rest = solve_contact(problem, load_N, start_MPa=best_p, tolerance=tolerance)
    return replace(rest, compliance_calls=rest.compliance_calls + _MOST_CORRECTIONS)
