"""Steady rolling with friction on the half-space: the exact theory, for any pressure.

Kalker's variational theory (Kalker 1990, in the discretisation of CONTACT) for two bodies of one material, whose normal
problem does not depend on the tractions. Range of validity: flat half-spaces of one material, one friction coefficient.

The leading edge has a Kutta condition, as thin aerofoils: the traction is zero there, and without slip it would be
singular at the trailing edge. So the loads stand for points a quarter of a cell behind the middles of their cells, and
the slip condition is met a quarter of a cell ahead of the middles. In two dimensions this removes the error of first
order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.sparse.linalg import LinearOperator, gmres

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.laws import CreepForce, Motion
from fecontact.errors import InputError

# --- Tangential displacements of a pair of half-spaces under tractions on the cells of a grid (Cerruti 1882).


def cerruti_influence(x: Floats, y: Floats, step_x: float, step_y: float, poisson: float) -> tuple[Floats, ...]:
    """Displacements xx, yy and xy at (x, y) mm over a unit traction on a rectangle around the origin, times pi G.

    Displacements of the first body relative to the second, of equal material, under a traction on the first body and
    the opposite traction on the second body. They are integrals over the rectangle of (1 - nu)/r + nu x^2/r^3, of
    (1 - nu)/r + nu y^2/r^3, and of nu x y/r^3 (Johnson 1985, section 3.6).
    """
    total = [np.zeros(np.broadcast_shapes(x.shape, y.shape)) for _ in range(3)]
    for sign_x in (1.0, -1.0):
        for sign_y in (1.0, -1.0):
            u, v = x + 0.5 * sign_x * step_x, y + 0.5 * sign_y * step_y
            # on the line of an edge the limit is zero
            along = u * np.arcsinh(v / np.maximum(np.abs(u), 1e-300))
            across = v * np.arcsinh(u / np.maximum(np.abs(v), 1e-300))
            parts = ((1.0 - poisson) * along + across, along + (1.0 - poisson) * across, -poisson * np.hypot(u, v))
            for k, part in enumerate(parts):
                total[k] += sign_x * sign_y * part
    return tuple(total)


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentialResponse:
    """Response of a grid to tractions on its cells, by a kernel that is the same at every cell.

    Attributes
    ----------
    kernels (3, 2 nx - 1, 2 ny - 1)
        xx, yy and xy at offsets of 1 - nx to nx - 1 and 1 - ny to ny - 1 cells.
    spectra
        Fourier transforms of the kernels, padded by zeros.
    """

    kernels: Floats
    spectra: NDArray[np.complex128]
    padded: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells along and across."""
        return (self.kernels.shape[1] + 1) // 2, (self.kernels.shape[2] + 1) // 2

    def apply(self, traction: Floats) -> Floats:
        """Response (2, nx, ny) to tractions (2, nx, ny) in MPa."""
        nx, ny = self.shape
        p = rfft2(traction, self.padded)
        xx, yy, xy = self.spectra
        out = irfft2(np.stack([xx * p[0] + xy * p[1], xy * p[0] + yy * p[1]]), self.padded)
        return np.asarray(out[:, :nx, :ny])

    def strip_blocks(self) -> Floats:
        """Response (2, nx, nx) along and across of the cells of a strip y = const to tractions on this strip."""
        nx, ny = self.shape
        offsets = np.arange(nx)[:, None] - np.arange(nx)[None, :] + nx - 1
        return np.asarray(self.kernels[:2, :, ny - 1][:, offsets])


def rolling_response(
    nx: int, ny: int, step_x: float, step_y: float, *, shear_MPa: float, poisson: float
) -> TangentialResponse:
    """Slip over the rolling speed that tractions cause in steady rolling: -du/dx, half a cell ahead of each cell.

    A particle comes to a cell from the cell ahead (Kalker 1990): the slip is the difference of their displacements over
    the step.
    """
    x, y = _offsets(nx, ny, step_x, step_y)
    here = cerruti_influence(x, y, step_x, step_y, poisson)
    ahead = cerruti_influence(x + step_x, y, step_x, step_y, poisson)
    return _response([(u - v) / step_x for u, v in zip(here, ahead, strict=True)], shear_MPa)


def _offsets(nx: int, ny: int, step_x: float, step_y: float) -> tuple[Floats, Floats]:
    return np.asarray(np.arange(1 - nx, nx)[:, None] * step_x), np.asarray(np.arange(1 - ny, ny)[None, :] * step_y)


def _response(kernels: tuple[Floats, ...] | list[Floats], shear_MPa: float) -> TangentialResponse:
    every = np.stack(kernels) / (math.pi * shear_MPa)
    rows, columns = every.shape[1:]
    padded = (next_fast_len(rows, real=True), next_fast_len(columns, real=True))
    wrapped = np.zeros((3, *padded))
    wrapped[:, :rows, :columns] = every
    # offset zero to the first place
    wrapped = np.roll(wrapped, ((1 - rows) // 2, (1 - columns) // 2), axis=(1, 2))
    return TangentialResponse(kernels=every, spectra=rfft2(wrapped), padded=padded)


# --- Coulomb friction on a grid: tractions oppose the slip where they reach their limit; elsewhere there is no slip.
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


# --- Steady rolling of any pressure on the half-space: forces, areas of adhesion and slip, tractions.

CELLS = 48
"""Cells along a patch: forces differ by up to 0.4 % of mu N from very fine cells, with large spin by 0.7 %."""
_POINTS_A_CELL = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureCells:
    """A pressure on the cells of a patch.

    Attributes
    ----------
    x_mm (nx,), y_mm (ny,)
        Middles of the cells.
    pressure_MPa (nx, ny)
        Mean pressure over each cell; zero outside the patch.
    """

    x_mm: Floats
    y_mm: Floats
    pressure_MPa: Floats

    @property
    def steps_mm(self) -> tuple[float, float]:
        """Size of a cell."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.y_mm[1] - self.y_mm[0])

    @property
    def cell_mm2(self) -> float:
        """Area of a cell."""
        return self.steps_mm[0] * self.steps_mm[1]

    @property
    def area_mm2(self) -> float:
        """Area of the patch."""
        return float(np.count_nonzero(self.pressure_MPa)) * self.cell_mm2

    @property
    def normal_force_N(self) -> float:
        """Force of the pressure."""
        return float(self.pressure_MPa.sum()) * self.cell_mm2


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingSolution:
    """Steady rolling.

    Attributes
    ----------
    force
        Force on the first body (the wheel).
    friction
        Tractions and slip on the cells; the slip is divided by the rolling speed.
    """

    cells: PressureCells
    force: CreepForce
    friction: FrictionSolution

    @property
    def status(self) -> FrictionStatus:
        """Whether the solution converged."""
        return self.friction.status


def ellipse_cells(a_mm: float, b_mm: float, normal_force_N: float, cells: int = CELLS) -> PressureCells:
    """Hertz's pressure over an ellipse."""
    # points finer than the cells, a little beyond the edge
    x, y = (1.02 * half * _middles(_POINTS_A_CELL * cells) for half in (a_mm, b_mm))
    shape = np.sqrt(np.maximum(1.0 - (x[:, None] / a_mm) ** 2 - (y / b_mm) ** 2, 0.0))
    cell = float((x[1] - x[0]) * (y[1] - y[0]))
    return pressure_cells(
        x, y, shape * normal_force_N / (cell * float(shape.sum())), area_mm2=np.pi * a_mm * b_mm, cells=cells
    )


def pressure_cells(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, *, area_mm2: float, cells: int = CELLS, lobes: int = 1
) -> PressureCells:
    """Mean pressure over coarser cells, whose total area is the area of the patch.

    Parameters
    ----------
    x_mm (nx,), y_mm (ny,)
        Nodes of a uniform grid along and across.
    pressure_MPa (nx, ny)
        Mean pressure over the cell of each node.
    area_mm2
        Area of the patch. Cells at its edge are partly in contact; the cells with most pressure are taken.
    cells, lobes
        Number of cells along the patch, and across each lobe.

    Raises
    ------
    InputError
        If fewer than 8 cells are asked for, which resolve nothing.
    """
    if cells < 8:
        raise InputError(f"cells along the patch are {cells!r}; allowed: 8 and more; 40 are usual")
    ends = [(line, np.flatnonzero(pressure_MPa.any(axis=axis))) for axis, line in ((1, x_mm), (0, y_mm))]
    (x_low, x_high), (y_low, y_high) = (
        (line[own[0]] - 0.5 * (line[1] - line[0]), line[own[-1]] + 0.5 * (line[1] - line[0])) for line, own in ends
    )
    new_x = np.linspace(x_low, x_high, min(cells, ends[0][1].size) + 1)
    new_y = np.linspace(y_low, y_high, min(cells * lobes, ends[1][1].size) + 1)
    mean = _overlaps(x_mm, new_x) @ pressure_MPa @ _overlaps(y_mm, new_y).T
    cell = float((new_x[1] - new_x[0]) * (new_y[1] - new_y[0]))
    load = float(mean.sum())
    mean = np.where(_most_loaded(mean, area_mm2 / cell), mean, 0.0)
    return PressureCells(
        x_mm=0.5 * (new_x[1:] + new_x[:-1]),
        y_mm=0.5 * (new_y[1:] + new_y[:-1]),
        pressure_MPa=mean * (load / float(mean.sum())),
    )


def _most_loaded(pressure: Floats, number: float) -> NDArray[np.bool_]:
    """About `number` cells (nx, ny) with the most pressure; equal cells, as in a symmetric patch, stay together."""
    kept = min(max(round(number), 1), int(np.count_nonzero(pressure)))
    least = float(np.partition(pressure.ravel(), -kept)[-kept])
    choices = [pressure >= least * (1.0 - 1e-9), pressure > least * (1.0 + 1e-9)]
    return min(choices, key=lambda own: abs(np.count_nonzero(own) - number))


def _middles(n: int) -> Floats:
    """Middles of n cells between -1 and 1."""
    return np.asarray((np.arange(n) + 0.5) * (2.0 / n) - 1.0)


def _overlaps(nodes: Floats, edges: Floats) -> Floats:
    """Part (n, m) of each new cell that is covered by each of the m cells around the nodes."""
    half = 0.5 * (nodes[1] - nodes[0])
    low, high = np.maximum(edges[:-1, None], nodes - half), np.minimum(edges[1:, None], nodes + half)
    return np.asarray(np.maximum(high - low, 0.0) / (edges[1] - edges[0]))


def steady_rolling(
    cells: PressureCells, motion: Motion, pair: RollingPair, *, iterations: int = FRICTION_ITERATIONS
) -> RollingSolution:
    """Solve steady rolling under a pressure.

    Parameters
    ----------
    motion
        Motion of the first body against the second; the rigid slip at (x, y) is (xi(y), eta + spin(y) x).
    iterations
        Largest number of iterations of `solve_friction`.
    """
    step_x, step_y = cells.steps_mm
    nx, ny = cells.pressure_MPa.shape
    response = rolling_response(nx, ny, step_x, step_y, shear_MPa=pair.shear_MPa, poisson=pair.poisson)
    met, loaded = cells.x_mm + 0.25 * step_x, cells.x_mm - 0.25 * step_x
    (along, spin), eta = motion.across(cells.y_mm), motion.eta
    rigid = np.stack([np.broadcast_to(along, (nx, ny)), eta + spin * met[:, None]])
    solved = solve_friction(response, rigid, pair.friction * cells.pressure_MPa, iterations=iterations)
    traction = solved.traction_MPa * cells.cell_mm2
    fx, fy = (float(part.sum()) for part in traction)
    mz = float((loaded[:, None] * traction[1] - cells.y_mm * traction[0]).sum())
    power = -float((along * traction[0] + (eta + spin * loaded[:, None]) * traction[1]).sum())
    slipping = float(np.count_nonzero(solved.slips)) * cells.cell_mm2
    force = CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=cells.area_mm2 - slipping,
        slip_area_mm2=slipping,
        # 0.0 + turns -0.0 into 0.0
        power_per_speed_N=0.0 + power,
    )
    return RollingSolution(cells=cells, force=force, friction=solved)
