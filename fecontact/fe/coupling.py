"""The two elastic bodies, coupled at their contact surfaces: the finite-element compliance of the pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from fecontact.arrays import Floats, Integers
from fecontact.contact.grid import ContactGrid
from fecontact.errors import NotCovered
from fecontact.fe.body import ElasticBody
from fecontact.fe.linear_solver import LINEAR_TOLERANCE


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
        Columns of the grid with equal steps: all columns, or a band at each of several patches far apart.
    """

    rail: ElasticBody
    wheel: ElasticBody
    grid: ContactGrid
    normals: Floats
    rail_nodes: Integers
    wheel_nodes: Integers
    coupling: csr_matrix
    bands: tuple[slice, ...] = (slice(None),)
    # of the last pressure, with the tolerance: slides and stresses ask for what the contact has ended with
    _last: list[tuple[Floats, float, tuple[Floats, Floats]]] = field(default_factory=list, init=False, repr=False)

    def displacements(
        self,
        pressure: Floats,
        more: Sequence[Floats | None] = (None, None),
        *,
        tolerance: float = LINEAR_TOLERANCE,
    ) -> tuple[Floats, Floats]:
        """Displacements (nodes, 3) in mm of rail and wheel under nodal pressures (n,) in MPa.

        `more` are further forces (nodes, 3) in N on rail and wheel. Norms of the residuals are at most `tolerance`
        times those of the forces.
        """
        alone = more[0] is None and more[1] is None
        if alone and self._last:
            last, reached, found = self._last[0]
            if reached <= tolerance and np.array_equal(last, pressure):
                return found
        on_rail, on_wheel = self.forces_N(pressure)
        found = (
            self.rail.displacements(self.rail_nodes, on_rail, more[0], tolerance=tolerance),
            self.wheel.displacements(self.wheel_nodes, on_wheel, more[1], tolerance=tolerance),
        )
        if alone:
            self._last[:] = [(pressure.copy(), tolerance, found)]
        return found

    def forces_N(self, pressure: Floats) -> tuple[Floats, Floats]:
        """Forces (n, 3) on the rail's and (m, 3) on the wheel's contact nodes under nodal pressures (n,) in MPa."""
        push = pressure[:, None] * self.normals
        return -self.grid.nodal_area_mm2()[:, None] * push, self.coupling.T @ push

    def balance(self, pressure: Floats) -> tuple[float, float]:
        """What the pressure does to one body and not back to the other: of the force, and of the moment; relative.

        Forces act on the curved surfaces of the meshes. The moment is about the centre of the forces, over the sum of
        forces times their distances from there.
        """
        forces = self.forces_N(pressure)
        places = self.rail.mesh.points[self.rail_nodes], self.wheel.mesh.points[self.wheel_nodes]
        sizes = np.linalg.norm(forces[0], axis=1)
        arms = [one - sizes @ places[0] / sizes.sum() for one in places]
        force = np.sum([one.sum(axis=0) for one in forces], axis=0)
        moment = np.sum([np.cross(arm, one).sum(axis=0) for arm, one in zip(arms, forces, strict=True)], axis=0)
        if self.grid.half:
            # the other half has the opposite of these
            force, moment = force * (0.0, 1.0, 1.0), moment * (1.0, 0.0, 0.0)
        # a force on a single node has no arm of its own
        lever = max(float(sizes @ np.linalg.norm(arms[0], axis=1)), float(sizes.sum()) * min(self.grid.steps_mm))
        carried = float(np.linalg.norm(forces[0].sum(axis=0)))
        return float(np.linalg.norm(force)) / carried, float(np.linalg.norm(moment)) / lever

    def forget(self) -> None:
        """Solve the next load as if it were the first one, to the last bit."""
        self.rail.forget()
        self.wheel.forget()

    def close(self) -> None:
        """Release the memory of both factors; displacements can no longer be computed."""
        self.rail.close()
        self.wheel.close()

    def compliance(self, pressure: Floats, tolerance: float = LINEAR_TOLERANCE) -> Floats:
        """Opening (n,) in mm along the normals, weighted by the dual functions, under pressures (n,) in MPa."""
        return self.opening(*self.displacements(pressure, tolerance=tolerance))

    def opening(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        """Opening (n,) in mm, weighted as in `compliance`, by displacements (nodes, 3) in mm of both bodies."""
        return np.asarray(np.einsum("nd,nd->n", self.normals, self._parting(u_rail, u_wheel)))

    def parting(self, pressure: Floats, tolerance: float = LINEAR_TOLERANCE) -> Floats:
        """Displacement (n, 3) in mm of the wheel's surface relative to the rail's, averaged as in `compliance`."""
        return self._parting(*self.displacements(pressure, tolerance=tolerance))

    def _parting(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        wheel = (self.coupling @ u_wheel[self.wheel_nodes]) / self.grid.nodal_area_mm2()[:, None]
        return np.asarray(wheel - u_rail[self.rail_nodes])


# --- Dual mortar coupling of two non-matching surfaces, and the compliance of the pair of elastic bodies.
#
# The pressure lives on the nodes of the rail's uniform zone (the slave), which is a tensor grid in x and in the arc
# length s of the rail's profile. The wheel's surface (the master) is projected on this plane along the rail's normals;
# integrals over both meshes are taken on their common refinement, so that every linear function is transferred exactly.
#
# Dual shape functions psi_i (Wohlmuth 2000), with int psi_i N_j = 0 for i != j: the pressure p_i of a node gives a
# force on this node alone, with the area D_i = int N_i.

# Quadrature of degree 5 on a triangle (Radon), in barycentric coordinates: the degree is 2 of the dual function, 2 of
# the master's function and 1 of the gap's slope.
_R, _S = (6.0 - np.sqrt(15.0)) / 21.0, (6.0 + np.sqrt(15.0)) / 21.0
_TRIANGLE_POINTS = np.array(
    [
        [1 / 3, 1 / 3, 1 / 3],
        [1 - 2 * _R, _R, _R],
        [_R, 1 - 2 * _R, _R],
        [_R, _R, 1 - 2 * _R],
        [1 - 2 * _S, _S, _S],
        [_S, 1 - 2 * _S, _S],
        [_S, _S, 1 - 2 * _S],
    ]
)
_TRIANGLE_WEIGHTS = np.array([9 / 40, *[(155 - np.sqrt(15)) / 1200] * 3, *[(155 + np.sqrt(15)) / 1200] * 3])


def mortar_matrix(grid: ContactGrid, master_xs: Floats, master_quads: Integers) -> csr_matrix:
    """Coupling matrix M_ij = int psi_i N_j (slave nodes, master nodes) in mm^2.

    Parameters
    ----------
    master_xs (n, 2)
        Positions (x, s) of the master's nodes, projected on the slave surface.
    master_quads (m, 4)
        Faces of the master; convex in the projection.

    Raises
    ------
    InputError
        If the master does not cover the slave grid: the pressure there would press on nothing.
    """
    nx, ns = grid.shape
    corners = master_xs[master_quads]
    quad, cell_x, cell_s = _overlaps(grid, corners)
    low = np.stack([grid.x_mm[cell_x], grid.s_mm[cell_s]], axis=1)
    high = np.stack([grid.x_mm[cell_x + 1], grid.s_mm[cell_s + 1]], axis=1)
    polygon, count = _clip(corners[quad], low, high)
    points, weights, pair = _triangle_rule(polygon, count)
    covered, wanted = float(weights.sum()), float(np.ptp(grid.x_mm) * np.ptp(grid.s_mm))
    if abs(covered - wanted) > 1e-9 * wanted:
        raise NotCovered(
            f"the wheel's surface covers {covered:.3f} of the {wanted:.3f} mm^2 of the rail's contact zone; use smaller"
            " elements or another lateral position"
        )

    xi = (points - low[pair]) / (high - low)[pair]
    dual_x, dual_s = (np.stack([2.0 - 3.0 * t, 3.0 * t - 1.0], axis=1) for t in xi.T)
    dual = (dual_x[:, :, None] * dual_s[:, None, :]).reshape(-1, 4)
    shape = _inverse_bilinear_shapes(corners[quad[pair]], points)
    local = np.zeros((len(quad), 4, 4))
    np.add.at(local, pair, weights[:, None, None] * dual[:, :, None] * shape[:, None, :])
    slave = np.stack([(cell_x + a) * ns + cell_s + b for a in (0, 1) for b in (0, 1)], axis=1)
    rows = np.broadcast_to(slave[:, :, None], local.shape)
    columns = np.broadcast_to(master_quads[quad][:, None, :], local.shape)
    return coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(nx * ns, len(master_xs))).tocsr()


def _overlaps(grid: ContactGrid, corners: Floats) -> tuple[Integers, Integers, Integers]:
    """Pairs of master faces and slave cells whose bounding boxes overlap."""
    spans = []
    for axis, line in enumerate((grid.x_mm, grid.s_mm)):
        first = np.searchsorted(line, corners[:, :, axis].min(axis=1), side="right") - 1
        last = np.searchsorted(line, corners[:, :, axis].max(axis=1), side="left")
        spans.append((np.clip(first, 0, line.size - 1), np.clip(last, 0, line.size - 1)))
    (x0, x1), (s0, s1) = spans
    number = np.maximum(x1 - x0, 0) * np.maximum(s1 - s0, 0)
    quad = np.repeat(np.arange(len(corners)), number)
    local = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number)
    width = np.repeat(np.maximum(s1 - s0, 1), number)
    return quad, x0[quad] + local // width, s0[quad] + local % width


def _clip(polygons: Floats, low: Floats, high: Floats) -> tuple[Floats, Integers]:
    """Cut convex quadrilaterals (k, 4, 2) to boxes: polygons (k, 8, 2), padded with their last point, and point counts.

    Sutherland and Hodgman (1974), one half-plane after the other.
    """
    k = len(polygons)
    points = np.zeros((k, 8, 2))
    points[:, :4] = polygons
    count = np.full(k, 4)
    slots = np.arange(8)
    rows = np.arange(k)[:, None]
    for axis, sign, bound in ((0, 1.0, low), (0, -1.0, high), (1, 1.0, low), (1, -1.0, high)):
        distance = sign * (points[:, :, axis] - bound[:, axis, None])
        after = np.where(slots < count[:, None] - 1, slots + 1, 0)
        d_next = distance[rows, after]
        valid = slots < count[:, None]
        crossing = valid & ((distance > 0) & (d_next < 0) | (distance < 0) & (d_next > 0))
        inside = valid & (distance >= 0)
        t = np.where(crossing, distance / np.where(crossing, distance - d_next, 1.0), 0.0)
        cut = points + t[:, :, None] * (points[rows, after] - points)
        emitted = np.stack([inside, crossing], axis=2).reshape(k, 16)
        candidates = np.stack([points, cut], axis=2).reshape(k, 16, 2)
        order = np.argsort(~emitted, axis=1, kind="stable")[:, :8]
        count = emitted.sum(axis=1)
        points = candidates[rows, order]
    last = np.maximum(count - 1, 0)
    points = np.where((slots < count[:, None])[:, :, None], points, points[np.arange(k), last][:, None])
    return points, np.where(count >= 3, count, 0)


def _triangle_rule(polygon: Floats, count: Integers) -> tuple[Floats, Floats, Integers]:
    """Quadrature points (q, 2), weights (q,) and polygon indices (q,) of polygons split into fans of triangles."""
    fan = np.stack([np.broadcast_to(polygon[:, :1], polygon[:, 1:-1].shape), polygon[:, 1:-1], polygon[:, 2:]], axis=2)
    d1, d2 = fan[:, :, 1] - fan[:, :, 0], fan[:, :, 2] - fan[:, :, 0]
    area = 0.5 * np.abs(d1[..., 0] * d2[..., 1] - d1[..., 1] * d2[..., 0])
    index, triangle = np.nonzero((area > 0.0) & (np.arange(6) < count[:, None] - 2))
    points = np.einsum("qb,tbd->tqd", _TRIANGLE_POINTS, fan[index, triangle])
    weights = area[index, triangle][:, None] * _TRIANGLE_WEIGHTS
    return points.reshape(-1, 2), weights.ravel(), np.repeat(index, len(_TRIANGLE_WEIGHTS))


def _inverse_bilinear_shapes(corners: Floats, points: Floats) -> Floats:
    """Bilinear shape functions (q, 4) of quadrilaterals (q, 4, 2) at points (q, 2), by Newton's method."""
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    r = np.zeros_like(points)
    shape = np.full((len(points), 4), 0.25)
    for _ in range(20):
        f = 1.0 + signs[None] * r[:, None]
        shape = 0.25 * f[:, :, 0] * f[:, :, 1]
        residual = points - np.einsum("qc,qcd->qd", shape, corners)
        d_r, d_s = 0.25 * signs[:, 0] * f[:, :, 1], 0.25 * signs[:, 1] * f[:, :, 0]
        j_r, j_s = np.einsum("qc,qcd->qd", d_r, corners), np.einsum("qc,qcd->qd", d_s, corners)
        det = j_r[:, 0] * j_s[:, 1] - j_r[:, 1] * j_s[:, 0]
        step = np.stack(
            [
                (residual[:, 0] * j_s[:, 1] - residual[:, 1] * j_s[:, 0]) / det,
                (residual[:, 1] * j_r[:, 0] - residual[:, 0] * j_r[:, 1]) / det,
            ],
            axis=1,
        )
        r = r + step
        if float(np.abs(step).max(initial=0.0)) < 1e-13:
            break
    f = 1.0 + signs[None] * r[:, None]
    return np.asarray(0.25 * f[:, :, 0] * f[:, :, 1])
