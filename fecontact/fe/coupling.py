"""The two elastic bodies, coupled at their contact surfaces: the finite-element compliance of the pair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from fecontact.contact.grid import ContactGrid
from fecontact.fe.body import ElasticBody

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledBodies:
    """Rail and wheel, coupled by a mortar matrix: the finite-element compliance of the pair.

    Attributes
    ----------
    normals (n, 3)
        Outward unit normals of the true rail at the pressure nodes; the pressure acts along them on both bodies.
    rail_nodes (n,), wheel_nodes (m,)
        Mesh nodes of the pressure grid, and the wheel's nodes on its contact surface.
    coupling (n, m)
        Mortar matrix M in mm^2.
    bands
        Columns of the grid that are regular: all of them, or those at each of several patches far apart.
    """

    rail: ElasticBody
    wheel: ElasticBody
    grid: ContactGrid
    normals: Floats
    rail_nodes: Integers
    wheel_nodes: Integers
    coupling: csr_matrix
    bands: tuple[slice, ...] = (slice(None),)

    def displacements(
        self, pressure: Floats, more: tuple[Floats | None, Floats | None] = (None, None)
    ) -> tuple[Floats, Floats]:
        """Displacements (nodes, 3) in mm of rail and wheel under nodal pressures (n,) in MPa, base and driver held.

        `more` are further forces (nodes, 3) in N on rail and wheel.
        """
        push = pressure[:, None] * self.normals
        on_rail = -self.grid.nodal_area_mm2()[:, None] * push
        return (
            self.rail.displacements(self.rail_nodes, on_rail, more[0]),
            self.wheel.displacements(self.wheel_nodes, self.coupling.T @ push, more[1]),
        )

    def close(self) -> None:
        """Release the memory of both factors; displacements can no longer be computed."""
        self.rail.close()
        self.wheel.close()

    def compliance(self, pressure: Floats) -> Floats:
        """Opening (n,) in mm along the normals, in the mean of the dual functions, under pressures (n,) in MPa."""
        return self.opening(*self.displacements(pressure))

    def opening(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        """Opening (n,) in mm, as in `compliance`, of displacements (nodes, 3) in mm of both bodies."""
        return np.asarray(np.einsum("nd,nd->n", self.normals, self._parting(u_rail, u_wheel)))

    def parting(self, pressure: Floats) -> Floats:
        """What the wheel's surface moves more than the rail's (n, 3) in mm, as in `compliance`, in all directions."""
        return self._parting(*self.displacements(pressure))

    def _parting(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        wheel = (self.coupling @ u_wheel[self.wheel_nodes]) / self.grid.nodal_area_mm2()[:, None]
        return np.asarray(wheel - u_rail[self.rail_nodes])
