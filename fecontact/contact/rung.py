"""One contact that was solved on a grid of pressure nodes: a rung of the ladder from Hertz to the finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid, Field, hat_integrals
from fecontact.contact.solver import ContactSolution, ContactStatus

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rung:
    """Pressure and gap of a solved contact, and how well it was solved.

    Attributes
    ----------
    pressure_MPa, gap_mm (nx, ns)
        Pressure and deformed gap on the grid; in a half model those of x >= 0 alone.
    approach_mm
        Approach of the bodies along the contact normal at first touch.
    normal_force_N
        Force along that normal that the pressure of the whole contact carries.
    contact_residual, penetration_residual, load_balance, iterations, compliance_calls
        As in `ContactSolution`.
    """

    grid: ContactGrid
    pressure_MPa: Floats
    gap_mm: Floats
    approach_mm: float
    normal_force_N: float
    status: ContactStatus
    iterations: int
    compliance_calls: int
    contact_residual: float
    penetration_residual: float
    load_balance: float

    @classmethod
    def of(
        cls, grid: ContactGrid, solution: ContactSolution, *, approach_mm: float, upright: Floats | None = None
    ) -> Rung:
        """Rung of a solution on the nodes of a grid.

        Parameters
        ----------
        upright (n,)
            Cosine between each node's normal and the contact normal; 1 everywhere if not given.
        """
        area = grid.whole_area_mm2()
        return cls(
            grid=grid,
            pressure_MPa=Field.of_nodes(grid, solution.pressure_MPa).values,
            gap_mm=Field.of_nodes(grid, solution.gap_mm).values,
            approach_mm=approach_mm,
            normal_force_N=float(np.dot(area if upright is None else area * upright, solution.pressure_MPa)),
            status=solution.status,
            iterations=solution.iterations,
            compliance_calls=solution.compliance_calls,
            contact_residual=solution.contact_residual,
            penetration_residual=solution.penetration_residual,
            load_balance=solution.load_balance,
        )

    @property
    def pressure(self) -> Field:
        """The pressure as a field."""
        return Field(grid=self.grid, values=self.pressure_MPa)

    def even(self) -> Rung:
        """The contact on equal steps across, as what reads pressures takes it; itself where they are equal."""
        pressure = self.pressure.even()
        gap = Field(grid=self.grid, values=self.gap_mm).even()
        return (
            self
            if pressure.grid is self.grid
            else replace(self, grid=pressure.grid, pressure_MPa=pressure.values, gap_mm=gap.values)
        )

    @property
    def residual(self) -> float:
        """Both residuals together: what the solution leaves open, relative to the approach."""
        return self.contact_residual + self.penetration_residual


def misfit(nodal: Rung, fine: Rung) -> float:
    """Part of the load that a contact on the nodes of elements has elsewhere than the same contact on finer nodes.

    A nodal pressure is the mean over the node's shape function, so that means of the finer pressure are compared, which
    is even over the cells of its nodes. Elements may be finer than those.
    """
    grid, pressure = nodal.pressure.whole().grid, nodal.pressure.whole().values
    finer = fine.pressure.whole()
    lines = ((grid.x_mm, finer.grid.x_mm), (grid.s_mm, finer.grid.s_mm))
    over_x, over_s = (hat_integrals(line, _cell_ends(places)) for line, places in lines)
    area = grid.nodal_area_mm2().reshape(grid.shape)
    force = over_x @ finer.values @ over_s.T
    return float(0.5 * np.abs(area * pressure - force).sum() / force.sum())


def _cell_ends(line: Floats) -> Floats:
    """Ends of the cells around the nodes of a uniform line."""
    step = float(line[1] - line[0])
    return np.append(line - 0.5 * step, line[-1] + 0.5 * step)
