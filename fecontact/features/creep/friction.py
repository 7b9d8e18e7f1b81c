"""Coulomb friction on a grid: tractions oppose the slip at their limit, and below it there is no slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, gmres

from fecontact.arrays import Floats
from fecontact.features.creep.tangential_response import TangentialResponse

#
# Kalker's variational theory as projections: p is the projection of p - r s(p) on the disc |p| <= limit, with the slip
# s(p) = rigid slip + response to p, and any r > 0. It is solved by Newton's method (Alart and Curnier 1991), each step
# by GMRES with a preconditioner of the response within each strip along the rolling direction.

FrictionStatus = Literal["converged", "not converged"]

FRICTION_TOLERANCE = 1e-6
"""Largest error of the traction, over the largest limit or over the traction of a cell alone if it is smaller."""
FRICTION_ITERATIONS = 60
_LINEAR_TOLERANCE = 1e-3
_SMALLEST_STEP = 1.0 / 64.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionSolution:
    """Tractions with friction.

    Attributes
    ----------
    traction_MPa, slip (2, nx, ny)
        Traction and slip along and across; the slip has the unit of the rigid slip.
    slips (nx, ny)
        Whether a cell slips.
    residual
        Largest error of the traction, relative as in `FRICTION_TOLERANCE`.
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
    rigid_slip (2, nx, ny)
        Slip of the rigid bodies.
    limit_MPa (nx, ny)
        Largest traction, mu times the pressure; zero outside the patch.
    """
    blocks = response.strip_blocks()
    scale = 1.0 / float(np.mean([blocks[0, 0, 0], blocks[1, 0, 0]]))
    # creepages that are far from saturation need as many digits
    size = min(float(limit_MPa.max()), scale * float(np.hypot(*rigid_slip).max())) or 1.0
    problem = _Problem(response=response, rigid_slip=rigid_slip, limit=limit_MPa, scale=scale)
    now = problem.at(np.zeros_like(rigid_slip))
    iteration = 0
    while now.error > FRICTION_TOLERANCE * size and iteration < iterations:
        iteration += 1
        step = problem.newton_step(now, blocks)
        part = 1.0
        while True:
            trial = problem.at(now.p + part * step)
            if trial.norm < (1.0 - 1e-4 * part) * now.norm or part < _SMALLEST_STEP:
                break
            part *= 0.5
        now = trial
    traction = _projected(now.p, limit_MPa)[0]
    return FrictionSolution(
        status="converged" if now.error <= FRICTION_TOLERANCE * size else "not converged",
        traction_MPa=traction,
        slip=now.slip * problem.inside,
        slips=problem.inside & now.beyond,
        residual=now.error / size,
        iterations=iteration,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _State:
    """Tractions, and their difference from the projection, which is zero for the solution."""

    p: Floats
    slip: Floats
    aim: Floats
    beyond: NDArray[np.bool_]
    open: Floats

    @property
    def error(self) -> float:
        return float(np.hypot(*self.open).max())

    @property
    def norm(self) -> float:
        return float(np.linalg.norm(self.open))


def _projected(aim: Floats, limit: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    size = np.hypot(*aim)
    beyond = size > limit
    return np.asarray(aim * np.where(beyond, limit / np.where(size > 0.0, size, 1.0), 1.0)), beyond


@dataclass(frozen=True, kw_only=True, eq=False)
class _Problem:
    """Response of the bodies, slip of the rigid bodies, largest traction, and the r of the projection."""

    response: TangentialResponse
    rigid_slip: Floats
    limit: Floats
    scale: float

    @property
    def inside(self) -> NDArray[np.bool_]:
        return self.limit > 0.0

    def at(self, p: Floats) -> _State:
        slip = self.rigid_slip + self.response.apply(p)
        aim = p - self.scale * slip
        projected, beyond = _projected(aim, self.limit)
        return _State(p=p, slip=slip, aim=aim, beyond=beyond, open=p - projected)

    def newton_step(self, now: _State, blocks: Floats) -> Floats:
        """Step (2, nx, ny) with (I - J (I - r C)) step = -open, J the derivative of the projection at the aim."""
        size, limit = np.hypot(*now.aim), self.limit
        free = np.where(now.beyond, limit / np.where(size > 0.0, size, 1.0), 1.0)
        unit = np.where(now.beyond, now.aim / np.where(size > 0.0, size, 1.0), 0.0)
        # (2, 2, nx, ny)
        J = free * (np.eye(2)[:, :, None, None] - unit[:, None] * unit[None, :])
        J = np.where(self.inside, J, 0.0)
        nx, ny = limit.shape
        # (ny, 2, nx, 2, nx): strip by strip
        matrix = np.einsum("abij,bik->jaibk", self.scale * J, blocks)
        rows = np.arange(nx)
        for a in (0, 1):
            for b in (0, 1):
                matrix[:, a, rows, b, rows] += (a == b) - J[a, b].T
        inverse = np.linalg.inv(matrix.reshape(ny, 2 * nx, 2 * nx))

        def apply(flat: Floats) -> Floats:
            d = flat.reshape(2, nx, ny)
            moved = d - self.scale * self.response.apply(d)
            return np.asarray(d - np.einsum("abij,bij->aij", J, moved)).ravel()

        def within_strips(flat: Floats) -> Floats:
            d = flat.reshape(2 * nx, ny)
            return np.asarray(np.einsum("jkl,lj->kj", inverse, d, optimize=True)).ravel()

        n = 2 * nx * ny
        step, _ = gmres(
            LinearOperator((n, n), matvec=apply, dtype=float),
            -now.open.ravel(),
            M=LinearOperator((n, n), matvec=within_strips, dtype=float),
            rtol=_LINEAR_TOLERANCE,
            restart=60,
            maxiter=2,
        )
        return np.asarray(step).reshape(2, nx, ny)
