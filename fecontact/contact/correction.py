"""The contact problem of an expensive compliance, solved through a cheap model of it.

Finite elements answer a pressure nearly as a half-space does. What differs is the softness of the elements, felt over a
few nodes and alike at every node, and the shape of the bodies, felt everywhere and slowly varying. A model that is the
same at every node and agrees with one response of the real compliance has the first of both exactly, so that a few
corrections by what it misses are enough.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.mixing import mixture
from fecontact.contact.solver import (
    CONTACT_TOLERANCE,
    Compliance,
    ContactProblem,
    ContactSolution,
    solution_at,
    solve_contact,
)

Floats = NDArray[np.float64]

_MOST_CORRECTIONS = 15
_DEPTH = 4


def solve_by_correction(
    problem: ContactProblem,
    load_N: float,
    model: Compliance,
    *,
    start_MPa: Floats | None = None,
    tolerance: float = CONTACT_TOLERANCE,
) -> ContactSolution:
    """Solve a contact problem by corrections of the solution of a model of its compliance.

    Each correction solves the model with the gap enlarged by what the model misses under the last pressure; Anderson
    mixing (Anderson 1965; Walker and Ni 2011) of the last ones. Where this stalls, conjugate gradients go on from the
    best pressure.

    Parameters
    ----------
    model
        Positive definite approximation of the compliance, much cheaper than it.
    start_MPa (n,)
        Where the first solution of the model starts.
    tolerance
        Bound of both residuals of the problem itself, relative to the approach, as in `solve_contact`.
    """
    weight = np.sqrt(problem.area_mm2)
    cheap = replace(problem, compliance=model)
    p = solve_contact(cheap, load_N, start_MPa=start_MPa, tolerance=1e-6).pressure_MPa
    solved: list[Floats] = []
    changes: list[Floats] = []
    best, best_p = np.inf, p
    for calls in range(1, _MOST_CORRECTIONS + 1):
        opening = problem.compliance(p)
        state = solution_at(problem, load_N, p, opening, tolerance)
        if state.status == "converged":
            return replace(state, iterations=calls, compliance_calls=calls)
        residual = max(state.contact_residual, state.penetration_residual)
        if residual < best:
            best, best_p = residual, p
        # the error of the inner solution must not be seen in the next residual
        inner = replace(cheap, gap_mm=problem.gap_mm + opening - model(p))
        q = solve_contact(inner, load_N, start_MPa=p, tolerance=max(1e-3 * residual, 0.1 * tolerance)).pressure_MPa
        solved, changes = [*solved, q][-_DEPTH - 1 :], [*changes, (q - p) * weight][-_DEPTH - 1 :]
        mixed = np.maximum(mixture(solved, changes), 0.0)
        p = mixed if len(solved) == 1 else mixed * (load_N / problem.load_N(mixed))
    rest = solve_contact(problem, load_N, start_MPa=best_p, tolerance=tolerance)
    return replace(rest, compliance_calls=rest.compliance_calls + _MOST_CORRECTIONS)
