"""Steady rolling with friction on the half-space: the exact theory, for any pressure.

Kalker's variational theory (Kalker 1990, in the discretisation of CONTACT) for two bodies of one material, whose normal
problem does not depend on the tractions. Range of validity: flat half-spaces of one material, one friction coefficient.

The leading edge has a Kutta condition, as thin aerofoils: the traction is zero there, and without slip it would be
singular at the trailing edge. So the loads stand for points a quarter of a cell behind the middles of their cells, and
the slip condition is met a quarter of a cell ahead of the middles. In two dimensions this removes the error of first
order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.creepage import CreepForce, Motion
from fecontact.errors import InputError
from fecontact.features.creep.friction import FRICTION_ITERATIONS, FrictionSolution, FrictionStatus, solve_friction
from fecontact.features.creep.tangential_response import rolling_response

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
