"""The two elastic bodies, coupled at their contact surfaces: the finite-element compliance of the pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from fecontact.arrays import Floats, Integers
from fecontact.contact.grid import ContactGrid
from fecontact.errors import CoverageError
from fecontact.fe.body import ElasticBody
from fecontact.fe.linear_solver import LINEAR_TOLERANCE


@dataclass(frozen=True, kw_only=True, eq=False)
class CoupledBodies:
    """Rail and wheel, coupled by a mortar matrix: the finite-element compliance of the pair.

    Attributes
    ----------
    rail, wheel
        The two elastic bodies.
    grid
        Pressure grid with n nodes on the rail's uniform zone.
    normals : ndarray of shape (n, 3)
        Outward unit normals of the true rail at the pressure nodes. The pressure acts along them on both bodies.
    rail_nodes : ndarray of shape (n,)
        Mesh nodes of the pressure grid.
    wheel_nodes : ndarray of shape (m,)
        The wheel's nodes on its contact surface.
    coupling : sparse matrix of shape (n, m)
        Mortar matrix M in mm^2.
    bands
        Columns of the grid with equal grid spacing: all columns, or one band for each of several distant patches.
    """

    rail: ElasticBody
    wheel: ElasticBody
    grid: ContactGrid
    normals: Floats
    rail_nodes: Integers
    wheel_nodes: Integers
    coupling: csr_matrix
    bands: tuple[slice, ...] = (slice(None),)
    # The last pressure, its tolerance and its displacements. Slides and stresses ask for the pressure with which the
    # contact has ended.
    _last_solution: list[tuple[Floats, float, tuple[Floats, Floats]]] = field(
        default_factory=list, init=False, repr=False
    )

    def displacements(
        self,
        pressure: Floats,
        further_forces: Sequence[Floats | None] = (None, None),
        *,
        tolerance: float = LINEAR_TOLERANCE,
    ) -> tuple[Floats, Floats]:
        """Displacements of rail and wheel under nodal pressures.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Nodal pressures in MPa.
        further_forces
            Further forces (nodes, 3) in N on rail and wheel; None for zero.
        tolerance
            Largest norm of the residual of a body, relative to the norm of the forces.

        Returns
        -------
        u_rail (nodes, 3), u_wheel (nodes, 3)
            Displacements of all nodes in mm.
        """
        pressure_only = further_forces[0] is None and further_forces[1] is None
        if pressure_only and self._last_solution:
            last_pressure, last_tolerance, u = self._last_solution[0]
            if last_tolerance <= tolerance and np.array_equal(last_pressure, pressure):
                return u
        rail_forces, wheel_forces = self.forces_N(pressure)
        u = (
            self.rail.displacements(self.rail_nodes, rail_forces, further_forces[0], tolerance=tolerance),
            self.wheel.displacements(self.wheel_nodes, wheel_forces, further_forces[1], tolerance=tolerance),
        )
        if pressure_only:
            self._last_solution[:] = [(pressure.copy(), tolerance, u)]
        return u

    def forces_N(self, pressure: Floats) -> tuple[Floats, Floats]:
        """Forces on the contact nodes of rail and wheel under nodal pressures.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Nodal pressures in MPa.

        Returns
        -------
        forces (n, 3), (m, 3)
            Forces in N on the contact nodes of the rail and of the wheel.
        """
        traction = pressure[:, None] * self.normals
        return -self.grid.nodal_area_mm2()[:, None] * traction, self.coupling.T @ traction

    def balance(self, pressure: Floats) -> tuple[float, float]:
        """Relative imbalance of force and moment between the two bodies.

        Forces act on the curved surfaces of the meshes. The moment is about the centre of the forces, divided by the
        sum of forces times their distances from that centre.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Nodal pressures in MPa.

        Returns
        -------
        force, moment
            Sums of forces and moments on both bodies, relative to the force and moment on the rail (-).
        """
        forces = self.forces_N(pressure)
        positions = self.rail.mesh.points[self.rail_nodes], self.wheel.mesh.points[self.wheel_nodes]
        sizes = np.linalg.norm(forces[0], axis=1)
        arms = [position - sizes @ positions[0] / sizes.sum() for position in positions]
        force = np.sum([body_forces.sum(axis=0) for body_forces in forces], axis=0)
        moment = np.sum(
            [np.cross(arm, body_forces).sum(axis=0) for arm, body_forces in zip(arms, forces, strict=True)], axis=0
        )
        if self.grid.half:
            # the forces and moments of the other half are opposite
            force, moment = force * (0.0, 1.0, 1.0), moment * (1.0, 0.0, 0.0)
        # A force on a single node has an arm of zero.
        lever = max(float(sizes @ np.linalg.norm(arms[0], axis=1)), float(sizes.sum()) * min(self.grid.steps_mm))
        load_N = float(np.linalg.norm(forces[0].sum(axis=0)))
        return float(np.linalg.norm(force)) / load_N, float(np.linalg.norm(moment)) / lever

    def forget(self) -> None:
        """Solve the next load as if it were the first load, to the last bit."""
        self.rail.forget()
        self.wheel.forget()

    def close(self) -> None:
        """Release the memory of both factors; displacements can no longer be computed."""
        self.rail.close()
        self.wheel.close()

    def compliance(self, pressure: Floats, tolerance: float = LINEAR_TOLERANCE) -> Floats:
        """Opening (n,) in mm along the normals under nodal pressures (n,) in MPa.

        It is weighted by the dual functions of the pressure nodes.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Pressure on the nodes in MPa.
        tolerance
            Relative tolerance of an iterative linear solver.

        Returns
        -------
        ndarray of shape (n,)
            Opening in mm.
        """
        return self.opening(*self.displacements(pressure, tolerance=tolerance))

    def opening(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        """Opening (n,) in mm by displacements of both bodies.

        The displacements are (nodes, 3) in mm. The opening is weighted as in `compliance`.

        Parameters
        ----------
        u_rail, u_wheel : ndarrays of shapes (rail nodes, 3), (wheel nodes, 3)
            Displacements in mm.

        Returns
        -------
        ndarray of shape (n,)
            Opening in mm.
        """
        return np.asarray(np.einsum("nd,nd->n", self.normals, self._parting(u_rail, u_wheel)))

    def parting(self, pressure: Floats, tolerance: float = LINEAR_TOLERANCE) -> Floats:
        """Displacement (n, 3) in mm of the wheel's surface relative to the rail's surface.

        It is averaged as in `compliance`.

        Parameters
        ----------
        pressure : ndarray of shape (n,)
            Pressure on the nodes in MPa.
        tolerance
            Relative tolerance of an iterative linear solver.

        Returns
        -------
        ndarray of shape (n, 3)
            Relative displacement in mm, in the track frame.
        """
        return self._parting(*self.displacements(pressure, tolerance=tolerance))

    def _parting(self, u_rail: Floats, u_wheel: Floats) -> Floats:
        """Displacement (n, 3) in mm of the wheel's surface relative to the rail's surface."""
        wheel = (self.coupling @ u_wheel[self.wheel_nodes]) / self.grid.nodal_area_mm2()[:, None]
        return np.asarray(wheel - u_rail[self.rail_nodes])


# --- Dual mortar coupling of two non-matching surfaces, and the compliance of the pair of elastic bodies.
#
# The pressure is defined on the nodes of the rail's uniform zone (the slave), which is a tensor grid in x and in the
# arc length s of the rail's profile. The wheel's surface (the master) is projected on this plane along the rail's
# normals. Integrals over both meshes are taken on their common refinement, so that every linear function is transferred
# exactly.
#
# Dual shape functions psi_i (Wohlmuth 2000), with int psi_i N_j = 0 for i != j: the pressure p_i of a node gives a
# force on this node alone, with the area D_i = int N_i.

# Quadrature of degree 5 on a triangle (Radon), in barycentric coordinates. The degree is the sum of 2 of the dual
# function, 2 of the master's function and 1 of the slope of the gap.
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
    """Coupling matrix M_ij = int psi_i N_j of slave nodes i and master nodes j.

    Parameters
    ----------
    grid
        Pressure grid with n slave nodes.
    master_xs : ndarray of shape (m, 2)
        Positions (x, s) in mm of the master's nodes, projected on the slave surface.
    master_quads : ndarray of shape (k, 4)
        Faces of the master, which must be convex in the projection.

    Returns
    -------
    csr_matrix
        M (n, m) in mm^2.

    Raises
    ------
    CoverageError
        If the master does not cover the slave grid: the pressure there would press on nothing.
    """
    nx, ns = grid.shape
    corners = master_xs[master_quads]
    quad, cell_x, cell_s = _overlaps(grid, corners)
    low = np.stack([grid.x_mm[cell_x], grid.s_mm[cell_s]], axis=1)
    high = np.stack([grid.x_mm[cell_x + 1], grid.s_mm[cell_s + 1]], axis=1)
    polygon, count = _clip_to_boxes(corners[quad], low, high)
    points, weights, pair = _triangle_rule(polygon, count)
    covered, area = float(weights.sum()), float(np.ptp(grid.x_mm) * np.ptp(grid.s_mm))
    if abs(covered - area) > 1e-9 * area:
        raise CoverageError(
            f"the wheel surface covers {covered:.3f} of the {area:.3f} mm^2 of the rail's contact zone; use smaller"
            " elements or a different lateral shift"
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
    """Pairs of master faces and slave cells with overlapping bounding boxes.

    Returns the index of the face and the indices of the cell along x and along s, each (pairs,).
    """
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


def _clip_to_boxes(polygons: Floats, low: Floats, high: Floats) -> tuple[Floats, Integers]:
    """Cut convex quadrilaterals (k, 4, 2) to boxes.

    `low` and `high` (k, 2) are the corners of the boxes. The method cuts at one half-plane after another (Sutherland
    and Hodgman 1974).

    Returns
    -------
    polygons, counts
        Polygons (k, 8, 2), padded with their last point, and the number of points of each polygon (k,).
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
    """Quadrature of polygons that are split into fans of triangles.

    Parameters
    ----------
    polygon
        Convex polygons (k, 8, 2), padded with their last point.
    count
        Number of points of each polygon (k,); polygons of fewer than 3 points are left out.

    Returns
    -------
    points, weights, indices
        Points (q, 2), weights (q,), which add up to the areas, and indices of the polygons (q,).
    """
    fan = np.stack([np.broadcast_to(polygon[:, :1], polygon[:, 1:-1].shape), polygon[:, 1:-1], polygon[:, 2:]], axis=2)
    d1, d2 = fan[:, :, 1] - fan[:, :, 0], fan[:, :, 2] - fan[:, :, 0]
    area = 0.5 * np.abs(d1[..., 0] * d2[..., 1] - d1[..., 1] * d2[..., 0])
    index, triangle = np.nonzero((area > 0.0) & (np.arange(6) < count[:, None] - 2))
    points = np.einsum("qb,tbd->tqd", _TRIANGLE_POINTS, fan[index, triangle])
    weights = area[index, triangle][:, None] * _TRIANGLE_WEIGHTS
    return points.reshape(-1, 2), weights.ravel(), np.repeat(index, len(_TRIANGLE_WEIGHTS))


def _inverse_bilinear_shapes(corners: Floats, points: Floats) -> Floats:
    """Bilinear shape functions of quadrilaterals at points, by Newton's method.

    The quadrilaterals are (q, 4, 2), the points (q, 2) and the functions (q, 4).
    """
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    r = np.zeros_like(points)
    shape = np.full((len(points), 4), 0.25)
    for _ in range(20):
        factors = 1.0 + signs[None] * r[:, None]
        shape = 0.25 * factors[:, :, 0] * factors[:, :, 1]
        residual = points - np.einsum("qc,qcd->qd", shape, corners)
        d_r, d_s = 0.25 * signs[:, 0] * factors[:, :, 1], 0.25 * signs[:, 1] * factors[:, :, 0]
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
    factors = 1.0 + signs[None] * r[:, None]
    return np.asarray(0.25 * factors[:, :, 0] * factors[:, :, 1])
