"""Solver of the frictionless unilateral contact problem.

The solver finds pressures p >= 0 with gap >= 0, p * gap = 0 and a given total load. It uses neither bodies nor meshes.
Its input is a compliance (pressure -> displacement of the surfaces towards each other), the undeformed gap and the
load. Every kind of compliance is therefore solved in exactly the same way.
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

# Largest error of the gap relative to the approach. With 1e-7 the error of the pressure is some 1e-7, far below any
# mesh error.
CONTACT_TOLERANCE = 1e-7
MAX_CONTACT_ITERATIONS = 300
# Fraction of the nodes with pressure at the start, and largest rounding error of a starting pressure relative to its
# peak.
_INITIAL_CONTACT_FRACTION, _ROUNDING = 0.2, 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactProblem:
    """Contact problem on pressure nodes.

    Attributes
    ----------
    compliance
        Function from nodal pressures (n,) in MPa to the opening (n,) in mm between the surfaces under these pressures.
        It is symmetric and positive definite in the inner product weighted by `area_mm2`.
    gap_mm : ndarray of shape (n,)
        Undeformed gap along the normals of the nodes.
    closing : ndarray of shape (n,)
        Closing of the gap per approach of the bodies: the cosine between the normal of the node and the approach.
    area_mm2 : ndarray of shape (n,)
        Contact area of each node. In a half model it is doubled, so that sums give the whole contact.
    stiffness
        Function from gaps (n,) to approximate pressures that close these gaps, up to a factor. It is the inverse of a
        compliance similar to this compliance, and is symmetric and positive definite too. The closer it is to the exact
        inverse, the fewer iterations are needed. None without such an inverse.
    within
        Compliance with about the given relative error, if a larger error takes less time. None if the time does not
        depend on the error.

    Examples
    --------
    Two independent springs with gaps of 0 and 1 mm share a load of 3 N:

    >>> import numpy as np
    >>> from fecontact.contact.solver import ContactProblem, solve_contact
    >>> ones = np.ones(2)
    >>> problem = ContactProblem(compliance=lambda p: p, gap_mm=np.array([0.0, 1.0]), closing=ones, area_mm2=ones)
    >>> solve_contact(problem, 3.0).pressure_MPa.round(6)
    array([2., 1.])
    """

    compliance: Compliance
    gap_mm: Floats
    closing: Floats
    area_mm2: Floats
    stiffness: Compliance | None = None
    within: Callable[[Floats, float], Floats] | None = None

    def load_N(self, pressure: Floats) -> float:
        """Total force of nodal pressures along the approach.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Pressures in MPa.

        Returns
        -------
        float
            Force in N.
        """
        return inner_product(self.area_mm2 * self.closing, pressure)

    def opening_mm(self, solution: ContactSolution) -> Floats:
        """Opening of the surfaces under the pressures of a solution.

        The opening is calculated from the gap of the solution. The compliance is not applied again.

        Parameters
        ----------
        solution
            Solution of this problem.

        Returns
        -------
        array (n,)
            Opening in mm.
        """
        return solution.gap_mm + solution.approach_mm * self.closing - self.gap_mm


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactSolution:
    """Pressure of a contact problem, with its residuals relative to the approach.

    Attributes
    ----------
    status
        `converged` if both residuals are at most the tolerance.
    pressure_MPa, gap_mm : ndarray of shape (n,)
        Pressure and deformed gap at the nodes.
    approach_mm
        Approach of the bodies.
    iterations
        Number of iterations.
    compliance_calls
        Number of applications of the compliance.
    contact_residual
        Largest absolute gap at a node with pressure.
    penetration_residual
        Deepest overlap at a node without pressure.
    load_balance
        Error of the total load relative to the load.
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
        """Mask (n,) of the nodes with pressure."""
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
    iterations: int = MAX_CONTACT_ITERATIONS,
) -> ContactSolution:
    """Solve a contact problem by conjugate gradients on the pressures.

    Either the load or the approach is prescribed.

    Parameters
    ----------
    problem
        Compliance, gap, and nodes.
    load_N
        Force along the approach in N, > 0. None for a prescribed approach.
    approach_mm
        Prescribed approach in mm instead of a load; not 0.
    start_MPa : ndarray of shape (n,) or None
        Initial pressure. Without it, the initial pressure at a prescribed approach is zero. Under a load, it is then
        positive at the nodes with the smallest gaps, and larger for smaller gaps.
    tolerance
        Bound of both residuals relative to the approach.
    iterations
        Largest number of iterations.

    Returns
    -------
    ContactSolution
        The solution; its status is `not converged` after the largest number of iterations.

    Notes
    -----
    Polonsky and Keer (1999), with nodal areas as weights, with normals in different directions, and with a
    preconditioner (Vollebregt 2014). Every iteration satisfies the load, or the approach, exactly. Nodes with pressure
    or with an overlap take part in an iteration. Pressures that become negative in an iteration are set to zero. After
    a change of the contact, the factor of Polak and Ribiere restarts the conjugate gradients without further tests.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.solver import ContactProblem, solve_contact
    >>> ones = np.ones(2)
    >>> problem = ContactProblem(compliance=lambda p: p, gap_mm=np.array([0.0, 1.0]), closing=ones, area_mm2=ones)
    >>> solution = solve_contact(problem, 0.5)
    >>> solution.status, solution.pressure_MPa.round(6)
    ('converged', array([0.5, 0. ]))
    """
    weights = problem.area_mm2
    pressure = (
        _initial_pressure(problem, load_N)
        if start_MPa is None or not np.any(start_MPa > 0.0)
        else _clean_start(start_MPa)
    )
    pressure = pressure * _load_scale(problem, load_N, pressure)
    search_direction, gap_before, descent_norm_before = np.zeros_like(pressure), np.zeros_like(pressure), np.inf
    is_active = np.zeros(pressure.size, dtype=bool)
    compliance_calls, iteration = 1, 0
    opening = problem.compliance(pressure)
    while True:
        iteration += 1
        solution = evaluate_solution(problem, load_N, pressure, opening, tolerance, approach_mm)
        if solution.status == "converged" or iteration == iterations:
            return replace(solution, iterations=iteration, compliance_calls=compliance_calls)
        was_active, is_active = is_active, solution.in_contact | (solution.gap_mm < 0.0)
        separation = problem.gap_mm + opening
        gap = (
            separation
            - (_fit_approach(problem, separation, is_active) if approach_mm is None else approach_mm) * problem.closing
        )
        descent = _pressures_closing_gap(problem, gap, is_active)
        if approach_mm is None:
            # The search direction must not change the load.
            if not np.array_equal(was_active, is_active):
                unit_approach_pressure = _pressures_closing_gap(problem, problem.closing, is_active)
            descent = (
                descent - problem.load_N(descent) / problem.load_N(unit_approach_pressure) * unit_approach_pressure
            )
        descent_norm = inner_product(weights * descent, gap)
        conjugate_factor = max(0.0, inner_product(weights * descent, gap - gap_before) / descent_norm_before)
        search_direction = np.where(is_active, descent + conjugate_factor * search_direction, 0.0)
        gap_before, descent_norm_before = gap, descent_norm
        direction_opening = problem.compliance(search_direction)
        compliance_calls += 1
        direction_approach = _fit_approach(problem, direction_opening, is_active) if approach_mm is None else 0.0
        curvature = inner_product(weights * search_direction, direction_opening - direction_approach * problem.closing)
        step_length = inner_product(weights * gap, search_direction) / curvature
        trial_pressure = pressure - step_length * search_direction
        nonnegative_pressure = np.maximum(trial_pressure, 0.0)
        scale = _load_scale(problem, load_N, nonnegative_pressure)
        if np.any(trial_pressure < 0.0):
            opening = problem.compliance(scale * nonnegative_pressure)
            compliance_calls += 1
        else:
            # The opening is linear in the pressure, so the compliance is not applied again.
            opening = scale * (opening - step_length * direction_opening)
        pressure = scale * nonnegative_pressure


def _pressures_closing_gap(problem: ContactProblem, gap: Floats, nodes: NDArray[np.bool_]) -> Floats:
    """Approximate pressures that close gaps (n,) at some nodes.

    The pressures (n,) are zero at all other nodes.
    """
    node_gap = np.where(nodes, gap, 0.0)
    return node_gap if problem.stiffness is None else np.where(nodes, problem.stiffness(node_gap), 0.0)


def evaluate_solution(
    problem: ContactProblem,
    load_N: float | None,
    pressure: Floats,
    opening: Floats,
    tolerance: float,
    approach_mm: float | None = None,
) -> ContactSolution:
    """Evaluate pressures and the opening under them as a solution.

    The solution counts one iteration and one application of the compliance.

    Parameters
    ----------
    problem
        Compliance, gap, and nodes.
    load_N
        Force along the approach in N; None for a prescribed approach.
    pressure : ndarray of shape (n,)
        Pressures in MPa.
    opening : ndarray of shape (n,)
        Opening under these pressures in mm.
    tolerance
        Bound of both residuals relative to the approach.
    approach_mm
        Prescribed approach in mm. Without it, the approach is fitted to the nodes with pressure.

    Returns
    -------
    ContactSolution
        Gap, approach and residuals of these pressures.
    """
    separation = problem.gap_mm + opening
    is_active = pressure > 0.0
    fitted_approach = _fit_approach(problem, separation, is_active) if approach_mm is None else approach_mm
    gap = separation - fitted_approach * problem.closing
    contact_residual = float(np.abs(gap[is_active]).max(initial=0.0) / abs(fitted_approach))
    penetration_residual = float(max(0.0, -gap[~is_active].min(initial=0.0)) / abs(fitted_approach))
    return ContactSolution(
        status="converged" if max(contact_residual, penetration_residual) <= tolerance else "not converged",
        pressure_MPa=pressure,
        gap_mm=gap,
        approach_mm=fitted_approach,
        iterations=1,
        compliance_calls=1,
        contact_residual=contact_residual,
        penetration_residual=penetration_residual,
        load_balance=0.0 if load_N is None else abs(problem.load_N(pressure) / load_N - 1.0),
    )


def _fit_approach(problem: ContactProblem, values: Floats, nodes: NDArray[np.bool_]) -> float:
    """Fit an approach to displacements (n,) at some nodes.

    If all normals are parallel to the approach, then the approach is the mean of the displacements.
    """
    closing, weights = problem.closing[nodes], problem.area_mm2[nodes]
    return inner_product(weights * closing, values[nodes]) / inner_product(weights * closing, closing)


def inner_product(a: Floats, b: Floats) -> float:
    """Inner product of two arrays (n,).

    It does not use BLAS: starting and ending the threads of BLAS takes a hundred times as long as a sum of ten thousand
    terms, and the number of threads changes the last bits of the sum.

    Parameters
    ----------
    a, b : ndarray of shape (n,)
        The two arrays.

    Returns
    -------
    float
        Sum of the products.
    """
    return float(np.einsum("i,i->", a, b))


def _load_scale(problem: ContactProblem, load_N: float | None, pressure: Floats) -> float:
    """Factor that scales pressures (n,) to the load; 1 without a load."""
    return 1.0 if load_N is None else load_N / problem.load_N(pressure)


def _clean_start(start: Floats) -> Floats:
    """Clean an initial pressure (n,) of negative values and of rounding errors.

    Interpolation leaves rounding errors next to the contact.
    """
    return np.where(start > _ROUNDING * start.max(), start, 0.0)


def _initial_pressure(problem: ContactProblem, load_N: float | None) -> Floats:
    """Initial pressure (n,) without a given start."""
    if load_N is None:
        return np.zeros_like(problem.gap_mm)
    return np.maximum(np.quantile(problem.gap_mm, _INITIAL_CONTACT_FRACTION) - problem.gap_mm, 0.0)


# --- Mixing of the last solutions of a fixed-point iteration (Anderson 1965; Walker and Ni 2011).


def mix_solutions(outputs: Sequence[Floats], changes: Sequence[Floats]) -> Floats:
    """Combine solutions such that their changes cancel best.

    Parameters
    ----------
    outputs
        Output (n,) of each step of the iteration; the last step at the end.
    changes
        Weighted difference (n,) between output and input of each step, in the same order.

    Returns
    -------
    array (n,)
        Combination of the outputs. A single output is returned unchanged.
    """
    if len(outputs) == 1:
        return outputs[0]
    columns = np.stack([changes[-1] - change for change in changes[:-1]], axis=1)
    coefficients, *_ = np.linalg.lstsq(columns, changes[-1], rcond=1e-10)
    return np.asarray(
        outputs[-1]
        - sum(
            coefficient * (outputs[-1] - output) for coefficient, output in zip(coefficients, outputs[:-1], strict=True)
        )
    )


# --- Solution of a contact problem with an expensive compliance through a cheap model of the compliance.
#
# The response of finite elements to a pressure is nearly the response of a half-space, with two differences. The
# softness of the elements acts over a few nodes and equally at every node. The shape of the bodies acts everywhere and
# varies slowly. A model that is equal at every node, and agrees with a response of the real compliance, contains the
# softness exactly. A few corrections for the shape are then enough.

_MAX_CORRECTIONS = 15
# Relative compliance error, as a fraction of the residual before the application; a correction decreases the residual
# by a factor of four to a hundred. Expected residual of the first correction. Compliance error of the last correction,
# as a fraction of the tolerance.
_RELATIVE_COMPLIANCE_ERROR, _INITIAL_RESIDUAL, _FINAL_ERROR_FRACTION = 2e-3, 0.15, 0.1
SLIDING_CORRECTIONS = 4
"""Number of corrections with a slide of the bodies along a steep surface: the residual is then some 1e-4."""
_MIXED_SOLUTIONS = 4


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

    Each correction solves the model with the gap enlarged by the error of the model under the last pressure. The last
    solutions are combined by Anderson mixing (Anderson 1965; Walker and Ni 2011). If the corrections stall, conjugate
    gradients continue from the best pressure.

    Parameters
    ----------
    problem
        Contact problem with an expensive compliance.
    load_N
        Force along the approach in N, > 0.
    model
        Positive definite approximation of the compliance that takes much less time to apply.
    start_MPa : ndarray of shape (n,) or None
        Start of the first solution of the model.
    slid
        Function from a solution to the gap (n,) in mm after the slide of the bodies under this solution, for bodies
        that slide along each other. It is called after each of the first `SLIDING_CORRECTIONS` corrections. The
        solution is for the last of these gaps.
    tolerance
        Bound of both residuals, relative to the approach, as in `solve_contact`.

    Returns
    -------
    ContactSolution
        The solution, with the number of applications of the expensive compliance.
    """
    root_area = np.sqrt(problem.area_mm2)
    model_problem = replace(problem, compliance=model, within=None)
    pressure = solve_contact(model_problem, load_N, start_MPa=start_MPa, tolerance=1e-6).pressure_MPa
    outputs: list[Floats] = []
    changes: list[Floats] = []
    best_residual, best_pressure = np.inf, pressure
    residual = _INITIAL_RESIDUAL
    for correction in range(1, _MAX_CORRECTIONS + 1):
        compliance_error = max(_RELATIVE_COMPLIANCE_ERROR * residual, _FINAL_ERROR_FRACTION * tolerance)
        opening = problem.compliance(pressure) if problem.within is None else problem.within(pressure, compliance_error)
        solution = evaluate_solution(problem, load_N, pressure, opening, tolerance)
        residual = max(solution.contact_residual, solution.penetration_residual)
        if slid is not None and correction <= SLIDING_CORRECTIONS:
            # Earlier solutions belong to a different gap.
            problem, outputs, changes = replace(problem, gap_mm=slid(solution)), [], []
        elif solution.status == "converged" and compliance_error <= _FINAL_ERROR_FRACTION * tolerance:
            return replace(solution, iterations=correction, compliance_calls=correction)
        elif residual < best_residual:
            best_residual, best_pressure = residual, pressure
        # The solution of the model must be so accurate that its error does not appear in the next residual.
        corrected_problem = replace(model_problem, gap_mm=problem.gap_mm + opening - model(pressure))
        model_pressure = solve_contact(
            corrected_problem, load_N, start_MPa=pressure, tolerance=max(1e-3 * residual, 0.1 * tolerance)
        ).pressure_MPa
        outputs, changes = (
            [*outputs, model_pressure][-_MIXED_SOLUTIONS - 1 :],
            [*changes, (model_pressure - pressure) * root_area][-_MIXED_SOLUTIONS - 1 :],
        )
        # A pressure outside the contact of the last solution would be a gap under pressure.
        mixed_pressure = np.where(model_pressure > 0.0, np.maximum(mix_solutions(outputs, changes), 0.0), 0.0)
        pressure = mixed_pressure if len(outputs) == 1 else mixed_pressure * (load_N / problem.load_N(mixed_pressure))
    final_solution = solve_contact(problem, load_N, start_MPa=best_pressure, tolerance=tolerance)
    return replace(final_solution, compliance_calls=final_solution.compliance_calls + _MAX_CORRECTIONS)
