"""Steady rolling of any pressure on the half-space: forces, areas of adhesion and slip, tractions.

Kalker's variational theory (Kalker 1990, in the discretisation of CONTACT) for two bodies of one material, whose normal
problem knows nothing of the tractions. Range of validity: flat half-spaces of one material, one friction coefficient.

Kutta's condition of thin aerofoils is that of the leading edge here: the traction begins with zero there and would be
singular at the trailing edge without friction. So the loads stand for points a quarter of a cell behind the middles of
their cells, and the slip is met a quarter ahead of them, which in two dimensions takes away the error of first order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.material import RollingPair
from fecontact.rolling.friction import FrictionSolution, FrictionStatus, solve_friction
from fecontact.rolling.influence import rolling_response

Floats = NDArray[np.float64]

CELLS = 48
"""Cells along a patch: forces within 0.4 % of mu N of those of very fine cells, 0.7 % with large spin."""
_POINTS_A_CELL = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class PressureCells:
    """A pressure on the cells of a patch.

    Attributes
    ----------
    x_mm (nx,), y_mm (ny,)
        Middles of the cells.
    pressure_MPa (nx, ny)
        Mean over each cell; zero on those that are not of the patch.
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
    fx_N, fy_N, mz_Nmm
        Forces on the first body (the wheel), moment about the normal through the origin.
    power_per_speed_N
        Dissipated power over the rolling speed.
    friction
        Tractions and slip on the cells, the slip over the rolling speed.
    """

    cells: PressureCells
    fx_N: float
    fy_N: float
    mz_Nmm: float
    adhesion_area_mm2: float
    slip_area_mm2: float
    power_per_speed_N: float
    friction: FrictionSolution

    @property
    def status(self) -> FrictionStatus:
        """Whether it may be used."""
        return self.friction.status


class RigidMotion(Protocol):
    """Creepages of a body over the lines of a patch."""

    @property
    def eta(self) -> float:
        """Lateral creepage at x = 0, the same on all lines."""

    def across(self, y_mm: Floats, /) -> tuple[Floats, Floats]:
        """Longitudinal creepage and spin (1/mm) on the lines y = const (n,)."""


def ellipse_cells(a_mm: float, b_mm: float, normal_force_N: float, cells: int = CELLS) -> PressureCells:
    """Hertz's pressure over an ellipse."""
    # finer than the cells, and a little beyond the edge
    x, y = (1.02 * half * _middles(_POINTS_A_CELL * cells) for half in (a_mm, b_mm))
    shape = np.sqrt(np.maximum(1.0 - (x[:, None] / a_mm) ** 2 - (y / b_mm) ** 2, 0.0))
    cell = float((x[1] - x[0]) * (y[1] - y[0]))
    return pressure_cells(
        x, y, shape * normal_force_N / (cell * float(shape.sum())), area_mm2=np.pi * a_mm * b_mm, cells=cells
    )


def pressure_cells(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, *, area_mm2: float, cells: int = CELLS, lobes: int = 1
) -> PressureCells:
    """A pressure in the mean over coarser cells, as many as its patch has area.

    Parameters
    ----------
    x_mm (nx,), y_mm (ny,)
        Nodes of a uniform grid along and across.
    pressure_MPa (nx, ny)
        Pressure in the mean over a cell of each node.
    area_mm2
        Area of the patch; cells at its edge are partly in contact, and those with most pressure are taken for it.
    cells, lobes
        Along the patch; across as many for each lobe.

    Raises
    ------
    InputError
        If fewer than 8 cells are asked for: nothing is resolved by them.
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
    """Cells (nx, ny) with the most pressure, about so many; equal ones, of a symmetric patch, stay together."""
    kept = min(max(round(number), 1), int(np.count_nonzero(pressure)))
    least = float(np.partition(pressure.ravel(), -kept)[-kept])
    choices = [pressure >= least * (1.0 - 1e-9), pressure > least * (1.0 + 1e-9)]
    return min(choices, key=lambda own: abs(np.count_nonzero(own) - number))


def _middles(n: int) -> Floats:
    """Middles of n cells between -1 and 1."""
    return np.asarray((np.arange(n) + 0.5) * (2.0 / n) - 1.0)


def _overlaps(nodes: Floats, edges: Floats) -> Floats:
    """Part (n, m) of each of n new cells that each of m cells around the nodes covers."""
    half = 0.5 * (nodes[1] - nodes[0])
    low, high = np.maximum(edges[:-1, None], nodes - half), np.minimum(edges[1:, None], nodes + half)
    return np.asarray(np.maximum(high - low, 0.0) / (edges[1] - edges[0]))


def steady_rolling(
    cells: PressureCells,
    motion: RigidMotion,
    pair: RollingPair,
    **settings: Any,
) -> RollingSolution:
    """Solve steady rolling under a pressure.

    Parameters
    ----------
    motion
        Of the first body against the second; the slip of the rigid bodies at (x, y) is (xi(y), eta + spin(y) x).
    **settings
        Tolerance and iterations of `solve_friction`.
    """
    step_x, step_y = cells.steps_mm
    nx, ny = cells.pressure_MPa.shape
    response = rolling_response(nx, ny, step_x, step_y, shear_MPa=pair.shear_MPa, poisson=pair.poisson)
    met, loaded = cells.x_mm + 0.25 * step_x, cells.x_mm - 0.25 * step_x
    (along, spin), eta = motion.across(cells.y_mm), motion.eta
    rigid = np.stack([np.broadcast_to(along, (nx, ny)), eta + spin * met[:, None]])
    solved = solve_friction(response, rigid, pair.friction * cells.pressure_MPa, **settings)
    traction = solved.traction_MPa * cells.cell_mm2
    fx, fy = (float(part.sum()) for part in traction)
    mz = float((loaded[:, None] * traction[1] - cells.y_mm * traction[0]).sum())
    power = -float((along * traction[0] + (eta + spin * loaded[:, None]) * traction[1]).sum())
    slipping = float(np.count_nonzero(solved.slips)) * cells.cell_mm2
    return RollingSolution(
        cells=cells,
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=cells.area_mm2 - slipping,
        slip_area_mm2=slipping,
        # zero is told without a sign
        power_per_speed_N=0.0 + power,
        friction=solved,
    )
