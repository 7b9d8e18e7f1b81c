"""Coulomb friction on a grid: tractions oppose the slip at their limit, and below it there is no slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from fecontact.arrays import Floats
from fecontact.features.creep.tangential_response import TangentialResponse

# Kalker's variational theory as projections: the traction p is the projection of p - r s(p) on the disc |p| <= limit,
# with the slip s(p) = rigid slip + response to p, and any r > 0 (`_Problem.stiffness`). The equations are solved by
# Newton's method (Alart and Curnier 1991), each step by GMRES with a preconditioner of the response within each strip
# along the rolling direction.

FrictionStatus = Literal["converged", "not converged"]

FRICTION_TOLERANCE = 1e-6
"""Largest error of a traction, divided by a scale of the tractions.

The scale is the largest limit, or the traction that the rigid slip would cause on a cell alone if that is smaller.
"""
FRICTION_ITERATIONS = 60
"""Largest number of Newton steps."""
_LINEAR_TOLERANCE = 1e-3
_SMALLEST_STEP = 1.0 / 64.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionSolution:
    """Tractions with friction.

    Attributes
    ----------
    status
        Whether the error of the traction is at most `FRICTION_TOLERANCE`.
    traction_MPa, slip : ndarray of shape (2, nx, ny)
        Traction and slip along and across; the slip has the unit of the rigid slip.
    slips : ndarray of shape (nx, ny)
        Whether a cell slips.
    residual
        Largest error of the traction, relative as in `FRICTION_TOLERANCE`.
    iterations
        Number of Newton steps.
    """

    status: FrictionStatus
    traction_MPa: Floats
    slip: Floats
    slips: NDArray[np.bool_]
    residual: float
    iterations: int


def solve_friction(
    response: TangentialResponse, rigid_slip: Floats, limit_MPa: Floats, *, iterations: int = FRICTION_ITERATIONS
) -> FrictionSolution:
    """Solve the friction problem on a grid.

    Parameters
    ----------
    response
        Slip that tractions cause.
    rigid_slip : ndarray of shape (2, nx, ny)
        Slip of the rigid bodies, in the unit of the response.
    limit_MPa : ndarray of shape (nx, ny)
        Largest traction, mu times the pressure; zero outside the patch.
    iterations
        Largest number of Newton steps.

    Returns
    -------
    FrictionSolution
        Tractions and slip. The status is "not converged" if the last Newton step did not reach `FRICTION_TOLERANCE`.

    Notes
    -----
    Newton's method on projections (Alart and Curnier 1991), each step by GMRES with a preconditioner of the response
    within each strip along the rolling direction. Range of validity: Coulomb friction with a single coefficient for
    stick and slip.

    Examples
    --------
    A rigid slip far from saturation causes no slip of the surfaces.

    >>> import numpy as np
    >>> from fecontact.features.creep.friction import solve_friction
    >>> from fecontact.features.creep.tangential_response import make_rolling_response
    >>> response = make_rolling_response(8, 8, 1.0, 1.0, shear_MPa=80e3, poisson=0.3)
    >>> rigid_slip = np.stack([np.full((8, 8), 1e-6), np.zeros((8, 8))])
    >>> solution = solve_friction(response, rigid_slip, np.full((8, 8), 300.0))
    >>> solution.status, bool(solution.slips.any())
    ('converged', False)
    """
    strip_blocks = response.strip_blocks()
    scale_MPa = 1.0 / float(np.mean([strip_blocks[0, 0, 0], strip_blocks[1, 0, 0]]))
    # creepages far from saturation cause small tractions, which need the same relative accuracy
    traction_scale = min(float(limit_MPa.max()), scale_MPa * float(np.hypot(*rigid_slip).max())) or 1.0
    problem = _Problem(response=response, rigid_slip=rigid_slip, limit=limit_MPa, stiffness=scale_MPa)
    state = problem.evaluate(np.zeros_like(rigid_slip))
    iteration = 0
    while state.error > FRICTION_TOLERANCE * traction_scale and iteration < iterations:
        iteration += 1
        step = problem.find_newton_step(state, strip_blocks)
        step_fraction = 1.0
        while True:
            trial = problem.evaluate(state.traction + step_fraction * step)
            if trial.norm < (1.0 - 1e-4 * step_fraction) * state.norm or step_fraction < _SMALLEST_STEP:
                break
            step_fraction *= 0.5
        state = trial
    traction = _project_on_disc(state.traction, limit_MPa)[0]
    return FrictionSolution(
        status="converged" if state.error <= FRICTION_TOLERANCE * traction_scale else "not converged",
        traction_MPa=traction,
        slip=state.slip * problem.inside,
        slips=problem.inside & state.exceeds_limit,
        residual=state.error / traction_scale,
        iterations=iteration,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _State:
    """Tractions with their difference from the projection, which is zero for the solution.

    Attributes
    ----------
    traction, slip : ndarray of shape (2, nx, ny)
        Traction in MPa, and the slip that it leaves.
    aim : ndarray of shape (2, nx, ny)
        Traction minus the stiffness times the slip, which is projected.
    exceeds_limit : ndarray of shape (nx, ny)
        Whether the aim is outside the disc of radius `limit`.
    residual : ndarray of shape (2, nx, ny)
        Traction minus the projection of the aim, in MPa.
    """

    traction: Floats
    slip: Floats
    aim: Floats
    exceeds_limit: NDArray[np.bool_]
    residual: Floats

    @property
    def error(self) -> float:
        """Largest size of the residual in MPa."""
        return float(np.hypot(*self.residual).max())

    @property
    def norm(self) -> float:
        """Euclidean norm of the residual."""
        return float(np.linalg.norm(self.residual))


def _project_on_disc(aim: Floats, limit: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Projection of vectors (2, nx, ny) on discs of radius `limit`.

    Also returns the mask (nx, ny) of the vectors outside their disc.
    """
    size = np.hypot(*aim)
    exceeds_limit = size > limit
    return np.asarray(aim * np.where(exceeds_limit, limit / np.where(size > 0.0, size, 1.0), 1.0)), exceeds_limit


@dataclass(frozen=True, kw_only=True, eq=False)
class _Problem:
    """Friction problem in projections.

    Attributes
    ----------
    response
        Slip that tractions cause.
    rigid_slip : ndarray of shape (2, nx, ny)
        Slip of the rigid bodies.
    limit : ndarray of shape (nx, ny)
        Largest traction in MPa.
    stiffness
        Factor r of the projection: MPa per unit of slip.
    """

    response: TangentialResponse
    rigid_slip: Floats
    limit: Floats
    stiffness: float

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether a cell (nx, ny) is in the patch."""
        return self.limit > 0.0

    def evaluate(self, traction: Floats) -> _State:
        """Evaluate slip, aim and residual of tractions.

        Parameters
        ----------
        traction : ndarray of shape (2, nx, ny)
            Tractions in MPa.

        Returns
        -------
        _State
            Slip, aim and residual.
        """
        slip = self.rigid_slip + self.response.apply(traction)
        aim = traction - self.stiffness * slip
        projected, exceeds_limit = _project_on_disc(aim, self.limit)
        return _State(traction=traction, slip=slip, aim=aim, exceeds_limit=exceeds_limit, residual=traction - projected)

    def find_newton_step(self, state: _State, blocks: Floats) -> Floats:
        """Newton step of the tractions.

        It solves (I - J (I - r C)) step = -residual, with the derivative J of the projection at the aim and the
        response C.

        Parameters
        ----------
        state
            Tractions and residual.
        blocks : ndarray of shape (2, nx, nx)
            Response within a strip, for the preconditioner.

        Returns
        -------
        array (2, nx, ny)
            Step in MPa.
        """
        size, limit = np.hypot(*state.aim), self.limit
        scaling = np.where(state.exceeds_limit, limit / np.where(size > 0.0, size, 1.0), 1.0)
        unit_aim = np.where(state.exceeds_limit, state.aim / np.where(size > 0.0, size, 1.0), 0.0)
        # (2, 2, nx, ny)
        jacobian = scaling * (np.eye(2)[:, :, None, None] - unit_aim[:, None] * unit_aim[None, :])
        jacobian = np.where(self.inside, jacobian, 0.0)
        nx, ny = limit.shape
        # (ny, 2, nx, 2, nx): strip by strip
        matrix = np.einsum("abij,bik->jaibk", self.stiffness * jacobian, blocks)
        diagonal = np.arange(nx)
        for a in (0, 1):
            for b in (0, 1):
                matrix[:, a, diagonal, b, diagonal] += (a == b) - jacobian[a, b].T
        inverse = np.linalg.inv(matrix.reshape(ny, 2 * nx, 2 * nx))

        def apply(vector: Floats) -> Floats:
            """Left side of the linear system for a flat vector."""
            direction = vector.reshape(2, nx, ny)
            aim_change = direction - self.stiffness * self.response.apply(direction)
            return np.asarray(direction - np.einsum("abij,bij->aij", jacobian, aim_change)).ravel()

        def within_strips(vector: Floats) -> Floats:
            """Solve the system of each strip alone, which is the preconditioner."""
            direction = vector.reshape(2 * nx, ny)
            return np.asarray(np.einsum("jkl,lj->kj", inverse, direction, optimize=True)).ravel()

        unknowns = 2 * nx * ny
        step, _ = gmres(
            LinearOperator((unknowns, unknowns), matvec=apply, dtype=float),
            -state.residual.ravel(),
            M=LinearOperator((unknowns, unknowns), matvec=within_strips, dtype=float),
            rtol=_LINEAR_TOLERANCE,
            restart=60,
            maxiter=2,
        )
        return np.asarray(step).reshape(2, nx, ny)
