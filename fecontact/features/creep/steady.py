"""Steady rolling with friction on the half-space: the exact theory, for any pressure.

Kalker's variational theory (Kalker 1990, in the discretisation of CONTACT) for two bodies of one material, whose normal
problem does not depend on the tractions. Range of validity: flat half-spaces of one material, one friction coefficient.

The leading edge has a Kutta condition, as thin aerofoils have: the traction is zero there, and without slip it would be
singular at the trailing edge. So the loads represent points a quarter of a cell behind the middles of their cells, and
the slip condition holds a quarter of a cell ahead of the middles. In two dimensions this removes the error of first
order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.creepage import CreepageField, CreepForce
from fecontact.errors import InputError
from fecontact.features.creep.friction import FRICTION_ITERATIONS, FrictionSolution, FrictionStatus, solve_friction
from fecontact.features.creep.tangential_response import make_rolling_response

CELLS_ALONG_PATCH = 48
"""Number of cells along a patch.

Forces differ by up to 0.4 % of mu N from very fine cells, with large spin by 0.7 %.
"""
_POINTS_PER_CELL = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureCells:
    """Pressure on the cells of a patch.

    Attributes
    ----------
    x_mm, y_mm : ndarrays of shapes (nx,), (ny,)
        Middles of the cells.
    pressure_MPa : ndarray of shape (nx, ny)
        Mean pressure over each cell; zero outside the patch.
    """

    x_mm: Floats
    y_mm: Floats
    pressure_MPa: Floats

    @property
    def steps_mm(self) -> tuple[float, float]:
        """Side lengths of a cell along and across."""
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
        """Resultant of the pressure."""
        return float(self.pressure_MPa.sum()) * self.cell_mm2


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingSolution:
    """Solution of steady rolling.

    Attributes
    ----------
    cells
        Pressure under which the bodies roll.
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
        """Status of the friction problem."""
        return self.friction.status


def discretise_ellipse(
    a_mm: float, b_mm: float, normal_force_N: float, cells: int = CELLS_ALONG_PATCH
) -> PressureCells:
    """Hertz's pressure over an ellipse, on cells.

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N
        Resultant of the pressure.
    cells
        Number of cells along and across.

    Returns
    -------
    PressureCells
        Mean pressure over each cell.

    Raises
    ------
    InputError
        If `cells` is less than 8.

    Examples
    --------
    >>> from fecontact.features.creep.steady import discretise_ellipse
    >>> cells = discretise_ellipse(8.0, 4.0, 80e3, cells=24)
    >>> round(cells.normal_force_N), round(cells.area_mm2, 0), cells.pressure_MPa.shape
    (80000, 100.0, (24, 24))
    """
    # the points are finer than the cells and reach a little beyond the edge
    x, y = (1.02 * half * _calculate_cell_middles(_POINTS_PER_CELL * cells) for half in (a_mm, b_mm))
    shape = np.sqrt(np.maximum(1.0 - (x[:, None] / a_mm) ** 2 - (y / b_mm) ** 2, 0.0))
    cell_mm2 = float((x[1] - x[0]) * (y[1] - y[0]))
    return coarsen_pressure(
        x, y, shape * normal_force_N / (cell_mm2 * float(shape.sum())), area_mm2=np.pi * a_mm * b_mm, cells=cells
    )


def coarsen_pressure(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, *, area_mm2: float, cells: int = CELLS_ALONG_PATCH, lobes: int = 1
) -> PressureCells:
    """Mean pressure over coarser cells with the total area of the patch.

    Parameters
    ----------
    x_mm, y_mm : ndarrays of shapes (nx,), (ny,)
        Nodes of a uniform grid along and across.
    pressure_MPa : ndarray of shape (nx, ny)
        Mean pressure over the cell of each node.
    area_mm2
        Area of the patch. Cells at its edge are partly in contact; the cells with the most pressure are selected.
    cells, lobes
        Number of cells along the patch, and across each lobe.

    Returns
    -------
    PressureCells
        The pressure with its force, on at most `cells` cells along the patch.

    Raises
    ------
    InputError
        If `cells` is less than 8, which resolves nothing.
    """
    if cells < 8:
        raise InputError(f"cells along the patch are {cells!r}; allowed: at least 8; 40 are usual")
    ends = [(coordinates, np.flatnonzero(pressure_MPa.any(axis=axis))) for axis, coordinates in ((1, x_mm), (0, y_mm))]
    (x_low, x_high), (y_low, y_high) = (
        (
            coordinates[loaded[0]] - 0.5 * (coordinates[1] - coordinates[0]),
            coordinates[loaded[-1]] + 0.5 * (coordinates[1] - coordinates[0]),
        )
        for coordinates, loaded in ends
    )
    new_x = np.linspace(x_low, x_high, min(cells, ends[0][1].size) + 1)
    new_y = np.linspace(y_low, y_high, min(cells * lobes, ends[1][1].size) + 1)
    mean_MPa = _calculate_covered_fractions(x_mm, new_x) @ pressure_MPa @ _calculate_covered_fractions(y_mm, new_y).T
    cell_mm2 = float((new_x[1] - new_x[0]) * (new_y[1] - new_y[0]))
    pressure_sum = float(mean_MPa.sum())
    mean_MPa = np.where(_select_loaded(mean_MPa, area_mm2 / cell_mm2), mean_MPa, 0.0)
    return PressureCells(
        x_mm=0.5 * (new_x[1:] + new_x[:-1]),
        y_mm=0.5 * (new_y[1:] + new_y[:-1]),
        pressure_MPa=mean_MPa * (pressure_sum / float(mean_MPa.sum())),
    )


def _select_loaded(pressure: Floats, number: float) -> NDArray[np.bool_]:
    """Mask (nx, ny) of about `number` cells with the most pressure.

    Equal cells, as in a symmetric patch, stay together.
    """
    count = min(max(round(number), 1), int(np.count_nonzero(pressure)))
    threshold = float(np.partition(pressure.ravel(), -count)[-count])
    choices = [pressure >= threshold * (1.0 - 1e-9), pressure > threshold * (1.0 + 1e-9)]
    return min(choices, key=lambda choice: abs(np.count_nonzero(choice) - number))


def _calculate_cell_middles(n: int) -> Floats:
    """Middles of n cells between -1 and 1."""
    return np.asarray((np.arange(n) + 0.5) * (2.0 / n) - 1.0)


def _calculate_covered_fractions(nodes: Floats, edges: Floats) -> Floats:
    """Fraction (n, m) of each new cell that each old cell covers.

    The n new cells are between `edges` (n + 1,), the m old cells are around `nodes` (m,).
    """
    half = 0.5 * (nodes[1] - nodes[0])
    low, high = np.maximum(edges[:-1, None], nodes - half), np.minimum(edges[1:, None], nodes + half)
    return np.asarray(np.maximum(high - low, 0.0) / (edges[1] - edges[0]))


def solve_steady_rolling(
    cells: PressureCells, motion: CreepageField, pair: RollingPair, *, iterations: int = FRICTION_ITERATIONS
) -> RollingSolution:
    """Solve steady rolling under a pressure.

    Parameters
    ----------
    cells
        Pressure on the cells of a patch.
    motion
        Motion of the first body against the second; the rigid slip at (x, y) is (xi(y), eta + spin(y) x).
    pair
        Friction coefficient and elastic constants.
    iterations
        Largest number of iterations of `solve_friction`.

    Returns
    -------
    RollingSolution
        Force on the first body, tractions and slip. Read `status` before you use the force.

    Notes
    -----
    Kalker 1990. Range of validity: flat half-spaces of one material, one friction coefficient.

    Examples
    --------
    The force opposes the creepage and is at most mu N.

    >>> from fecontact.bodies import RollingPair
    >>> from fecontact.contact_theories.rolling.creepage import Creepages
    >>> from fecontact.features.creep.steady import discretise_ellipse, solve_steady_rolling
    >>> cells = discretise_ellipse(8.0, 4.0, 80e3, cells=16)
    >>> pair = RollingPair(friction=0.3, shear_MPa=80e3, poisson=0.3)
    >>> solution = solve_steady_rolling(cells, Creepages(xi=1e-3), pair)
    >>> solution.status, -0.3 * 80e3 < solution.force.fx_N < 0.0
    ('converged', True)
    """
    step_x, step_y = cells.steps_mm
    nx, ny = cells.pressure_MPa.shape
    response = make_rolling_response(nx, ny, step_x, step_y, shear_MPa=pair.shear_MPa, poisson=pair.poisson)
    slip_x_mm, load_x_mm = cells.x_mm + 0.25 * step_x, cells.x_mm - 0.25 * step_x
    (along, spin), eta = motion.across(cells.y_mm), motion.eta
    rigid_slip = np.stack([np.broadcast_to(along, (nx, ny)), eta + spin * slip_x_mm[:, None]])
    friction = solve_friction(response, rigid_slip, pair.friction * cells.pressure_MPa, iterations=iterations)
    traction = friction.traction_MPa * cells.cell_mm2
    fx, fy = (float(component.sum()) for component in traction)
    mz = float((load_x_mm[:, None] * traction[1] - cells.y_mm * traction[0]).sum())
    power = -float((along * traction[0] + (eta + spin * load_x_mm[:, None]) * traction[1]).sum())
    slipping = float(np.count_nonzero(friction.slips)) * cells.cell_mm2
    force = CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=cells.area_mm2 - slipping,
        slip_area_mm2=slipping,
        # 0.0 + turns -0.0 into 0.0
        power_per_speed_N=0.0 + power,
    )
    return RollingSolution(cells=cells, force=force, friction=friction)
