"""Plane quadrilateral meshes of a body's cross-section: a uniform block under the contact zone, graded outwards.

The outline is meshed here, node by node, so that its nodes lie exactly on the true profile. gmsh fills the inside with
triangles and quadrilaterals of twice the intended size, and one subdivision makes every cell a quadrilateral.
"""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, Integers
from fecontact.errors import CoverageError
from fecontact.profiles.curve import Profile

# Turning angle between two neighbouring points of the outline above which the outline has a corner. A corner keeps a
# node.
_CORNER_RAD = 0.3
_TRACE_STEP_MM = 0.1
# Element sizes on the outline grow away from the zone: size = grid spacing + growth * distance, up to the maximum.
# Inside, the size grows with the distance from the outline and from the uniform block. Finer elements change no
# contact: peak, area and half-widths are within 0.09 % of a mesh with growth 0.2, 6 mm, layers that grow by 1.12 and a
# sweep that grows by 1.4, with 0.4 of its unknowns (S1002 on 60E1, 60E2, cylinders on R 300, R 80 and A120, 100 kN).
_OUTLINE_GROWTH, _MAX_OUTLINE_SIZE_MM = 0.3, 9.0
_INSIDE_GROWTH, _MAX_INSIDE_SIZE_MM = 0.5, 12.0
# Decimals in mm of the coordinates for gmsh. Another processor moves points by 1e-13 mm, and gmsh would make another
# mesh of the moved points.
_GMSH_DECIMALS = 5
LAYER_RATIO = 1.3
"""Ratio of the thicknesses of neighbouring element layers, growing downwards."""


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Interval of a profile from `low_mm` to `high_mm` with an even number of equal steps.

    Attributes
    ----------
    low_mm, high_mm
        Arc lengths of both ends in mm.
    intervals
        Number of steps, always even.
    """

    low_mm: float
    high_mm: float
    intervals: int

    @property
    def step_mm(self) -> float:
        """Spacing of the nodes in mm."""
        return (self.high_mm - self.low_mm) / self.intervals

    @property
    def nodes_mm(self) -> Floats:
        """Arc lengths (intervals + 1,) of the nodes in mm."""
        return np.linspace(self.low_mm, self.high_mm, self.intervals + 1)


def place_nodes(stretches: Sequence[Stretch]) -> Floats:
    """Nodes of all stretches and of the strips between them.

    The steps of a strip grow away from both of its ends.

    Parameters
    ----------
    stretches
        Stretches by increasing arc length.

    Returns
    -------
    nodes (n,)
        Increasing arc lengths in mm.
    """
    nodes = [stretches[0].nodes_mm]
    for before, after in pairwise(stretches):
        strip = np.array([0.0, after.low_mm - before.high_mm])
        inner = _graded_places(strip, (before.step_mm, after.step_mm))[1:-1]
        nodes += [before.high_mm + inner, after.nodes_mm]
    return np.concatenate(nodes)


@dataclass(frozen=True, kw_only=True)
class Zone:
    """Interval of a profile with regular nodes: stretches with equal steps, and coarse strips between them.

    Attributes
    ----------
    stretches
        Stretches by increasing arc length.
    depth_step_mm
        Thickness of the first layer at the greatest depth.
    depth_mm : ndarray of shape (columns,)
        Depth of the layers below each column of nodes. The layers follow the profile, with thicknesses in proportion to
        the depth.
    """

    stretches: tuple[Stretch, ...]
    depth_step_mm: float
    depth_mm: Floats

    @property
    def low_mm(self) -> float:
        """Arc length at the start of the zone, in mm."""
        return self.stretches[0].low_mm

    @property
    def high_mm(self) -> float:
        """Arc length at the end of the zone, in mm."""
        return self.stretches[-1].high_mm


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A quadrilateral mesh of a cross-section in mm.

    Attributes
    ----------
    points : ndarray of shape (n, 2)
        Nodes in mm.
    quads : ndarray of shape (m, 4)
        Cells, counter-clockwise.
    block_nodes : ndarray of shape (layers, columns)
        Nodes of the uniform block. The first layer lies on the contact zone from the gauge to the field side. The
        columns follow the normals of the first layer.
    zone_arc_length_mm : ndarray of shape (columns,)
        Arc lengths of the first layer along the profile.
    edges
        Named boundary edges (k, 2): `contact`, `base`, `free`.
    outline_area_mm2
        Area inside the meshed outline.
    true_area_mm2
        Area inside the true outline.
    """

    points: Floats
    quads: Integers
    block_nodes: Integers
    zone_arc_length_mm: Floats
    edges: dict[str, Integers]
    outline_area_mm2: float
    true_area_mm2: float


def mesh_section(
    profile: Profile, closure: Floats, base: tuple[int, int], zone: Zone, layer_ratio: float = LAYER_RATIO
) -> Section:
    """Mesh the cross-section between a running surface and the polyline that closes it.

    Parameters
    ----------
    profile
        The running surface.
    closure : ndarray of shape (n, 2)
        Points from the field-side end of the running surface around the body to its gauge-side end, both excluded (mm).
    base
        Index of the first and last point of `closure` on the straight edge that is fixed.
    zone
        Regular nodes on the running surface.
    layer_ratio
        Ratio of the thicknesses of neighbouring layers of the block, growing downwards.

    Returns
    -------
    Section
        Mesh of the cross-section in the axes of the profile.

    Raises
    ------
    CoverageError
        If the outline crosses itself or the uniform block: gmsh would hang.
    """
    zone_s = place_nodes(zone.stretches)
    block = _uniform_block(profile, zone_s, zone, layer_ratio)
    columns = zone_s.size
    trace = np.vstack(
        [_trace_surface(profile, zone.high_mm, profile.length_mm), closure, _trace_surface(profile, 0.0, zone.low_mm)]
    )
    outer = _place_graded_nodes(trace, (zone.stretches[-1].step_mm, zone.stretches[0].step_mm))
    ring = np.vstack([outer, block[1:, 0], block[-1, 1:], block[-2:0:-1, -1]])
    if _has_crossing_sides(ring):
        zone_width, zone_depth = zone.high_mm - zone.low_mm, float(zone.depth_mm.max())
        raise CoverageError(
            f"{profile.kind} {profile.name}: the cut is too close to the running surface for a contact zone of"
            f" {zone_width:.2f} mm, which is meshed {zone_depth:.2f} mm deep; give a larger rail depth or rim thickness"
        )
    fill_points, fill_quads = _mesh_polygon(ring)

    ids = np.arange(block.shape[0] * columns).reshape(block.shape[:2])
    outer_ids = np.concatenate([[ids[0, -1]], ids.size + np.arange(len(outer) - 2), [ids[0, 0]]])
    inner_ids = ids.size + len(outer) - 2 + np.arange(len(fill_points) - len(ring))
    fill_ids = np.concatenate([outer_ids, ids[1:, 0], ids[-1, 1:], ids[-2:0:-1, -1], inner_ids])
    points = np.vstack([block.reshape(-1, 2), outer[1:-1], fill_points[len(ring) :]])
    block_quads = np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(-1, 4)
    quads = _orient_counter_clockwise(points, np.vstack([block_quads, fill_ids[fill_quads]]))

    edges = np.column_stack([outer_ids[:-1], outer_ids[1:]])
    on_base = _is_on_segment(points[edges], closure[base[0]], closure[base[1]])
    return Section(
        points=points,
        quads=quads,
        block_nodes=ids,
        zone_arc_length_mm=zone_s,
        edges={
            "contact": np.column_stack([ids[0, :-1], ids[0, 1:]]),
            "base": edges[on_base],
            "free": edges[~on_base],
        },
        outline_area_mm2=polygon_area(np.vstack([block[0], outer[1:-1]])),
        true_area_mm2=polygon_area(np.vstack([_trace_surface(profile, zone.low_mm, zone.high_mm), trace[1:-1]])),
    )


def polygon_area(points: Floats) -> float:
    """Area inside a closed polygon (n, 2).

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        Corners in their order; the last is joined to the first.

    Returns
    -------
    float
        Area in the squared unit of the points, never negative.
    """
    y, z = points.T
    return float(0.5 * abs(np.dot(y, np.roll(z, -1)) - np.dot(np.roll(y, -1), z)))


def _has_crossing_sides(ring: Floats) -> bool:
    """Whether two sides of a closed polygon (n, 2) cross each other."""
    start, end = ring, np.roll(ring, -1, axis=0)

    def side(points: Floats) -> Floats:
        """Sign that gives the side of each polygon side (rows) on which points (columns) lie."""
        direction, offset = end - start, points[None] - start[:, None]
        return np.asarray(direction[:, None, 0] * offset[..., 1] - direction[:, None, 1] * offset[..., 0])

    is_separated = side(start) * side(end) < 0.0
    return bool(np.any(is_separated & is_separated.T))


def layer_depths(first: float, total: float, ratio: float) -> Floats:
    """Depths of layers with thicknesses that grow by about a ratio.

    Parameters
    ----------
    first
        Approximate thickness of the first layer.
    total
        Depth of the last layer.
    ratio
        Approximate ratio of neighbouring thicknesses.

    Returns
    -------
    depths (layers + 1,)
        Depths from 0 to `total`, of an even number of layers.

    Examples
    --------
    >>> [round(float(depth), 3) for depth in layer_depths(1.0, 6.0, 1.5)]
    [0.0, 0.738, 1.846, 3.508, 6.0]
    """
    if first * 2 >= total:
        return np.linspace(0.0, total, 3)
    count = int(np.ceil(np.log1p((ratio - 1.0) * total / first) / np.log(ratio)))
    count += count % 2
    depths = np.concatenate(([0.0], np.cumsum(first * ratio ** np.arange(count))))
    return np.asarray(depths * (total / depths[-1]))


def _uniform_block(profile: Profile, zone_s: Floats, zone: Zone, layer_ratio: float) -> Floats:
    """Nodes (layers, columns, 2) of the uniform block, in mm on the section.

    The layers are copies of the profile in the zone, moved inwards along its normals. `zone_s` are the arc lengths of
    the columns in mm. Layers become thicker with depth by the factor `layer_ratio`.
    """
    line = profile.evaluate(profile.at_arc_length(zone_s))
    inward = profile.convex_sign * np.column_stack([-line.dz, line.dy]) / np.hypot(line.dy, line.dz)[:, None]
    relative_depths = layer_depths(zone.depth_step_mm, float(zone.depth_mm.max()), layer_ratio) / zone.depth_mm.max()
    depths = relative_depths[:, None] * zone.depth_mm
    return np.asarray(np.column_stack([line.y, line.z])[None] + depths[..., None] * inward[None])


def _trace_surface(profile: Profile, low: float, high: float) -> Floats:
    """Points of the running surface between two arc lengths, closely spaced."""
    count = max(2, int(np.ceil((high - low) / _TRACE_STEP_MM)) + 1)
    p = profile.evaluate(profile.at_arc_length(np.linspace(low, high, count)))
    return np.column_stack([p.y, p.z])


def _place_graded_nodes(trace: Floats, end_steps: tuple[float, float]) -> Floats:
    """Nodes (n, 2) along a polyline with given steps at its two ends, in mm.

    The number of steps between any two corners is even. `trace` (k, 2) are the points of the polyline.
    """
    chords = np.diff(trace, axis=0)
    lengths = np.hypot(*chords.T)
    arc = np.concatenate(([0.0], np.cumsum(lengths)))
    heading = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    corners = np.flatnonzero(np.abs(np.diff(heading)) > _CORNER_RAD) + 1
    arcs = _graded_places(np.concatenate(([0.0], arc[corners], [arc[-1]])), end_steps)
    return np.column_stack([np.interp(arcs, arc, trace[:, k]) for k in (0, 1)])


def _graded_places(breaks: Floats, end_steps: tuple[float, float]) -> Floats:
    """Positions from 0 to the last break, in steps that grow away from both ends.

    The number of steps between two breaks is even.

    Parameters
    ----------
    breaks
        Ascending arc lengths in mm that must be positions; the first is 0.
    end_steps
        Step in mm at the start and at the end. Steps grow by `_OUTLINE_GROWTH` mm per mm, up to `_MAX_OUTLINE_SIZE_MM`.

    Returns
    -------
    ndarray of shape (n,)
        Positions in mm, with both ends.
    """
    length = breaks[-1]
    fine = np.unique(np.concatenate([np.linspace(0.0, length, 4000), breaks]))
    middle = 0.5 * (fine[1:] + fine[:-1])
    size = np.minimum(end_steps[0] + _OUTLINE_GROWTH * middle, end_steps[1] + _OUTLINE_GROWTH * (length - middle))
    count = np.concatenate(([0.0], np.cumsum(np.diff(fine) / np.minimum(size, _MAX_OUTLINE_SIZE_MM))))
    nodes = [np.zeros(1)]
    for start, stop in pairwise(breaks):
        start_count, stop_count = np.interp([start, stop], fine, count)
        steps = 2 * max(1, round((stop_count - start_count) / 2))
        nodes.append(np.interp(np.linspace(start_count, stop_count, steps + 1)[1:], count, fine))
    return np.concatenate(nodes)


def _is_on_segment(edges: Floats, start: Floats, end: Floats) -> NDArray[np.bool_]:
    """Whether edges (k, 2, 2) lie on the straight segment between two points.

    The points (2,) are in mm; the result is (k,). Both ends of an edge must be within 1e-6 mm of the segment.
    """
    direction = (end - start) / np.hypot(*(end - start))
    offset = edges - start
    along = offset @ direction
    across = offset @ np.array([-direction[1], direction[0]])
    length = float(np.hypot(*(end - start)))
    return np.asarray(np.all((np.abs(across) < 1e-6) & (along > -1e-6) & (along < length + 1e-6), axis=1))


# Two gmsh sessions at a time end the process.
_SESSION_LOCK = threading.Lock()


@contextmanager
def _gmsh_session() -> Iterator[ModuleType]:
    """Start and end gmsh.

    Threads wait for each other, since the state of gmsh is global.
    """
    import gmsh

    with _SESSION_LOCK:
        gmsh.initialize(interruptible=False)
        _ignore_broken_pipes()
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setNumber("General.NumThreads", 1)
            gmsh.option.setNumber("Mesh.RandomSeed", 1)
            yield gmsh
        finally:
            gmsh.finalize()


def _ignore_broken_pipes() -> None:
    """Ignore SIGPIPE again, as Python does.

    gmsh restores the default, so that a broken pipe ends the process.
    """
    if hasattr(signal, "SIGPIPE"):
        # signal.signal is not used: it does not see the change by gmsh, and works in the main thread only
        handler = ctypes.pythonapi.PyOS_setsig
        handler.argtypes, handler.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p
        handler(signal.SIGPIPE, int(signal.SIG_IGN))


def _mesh_polygon(ring: Floats) -> tuple[Floats, Integers]:
    """Quadrilaterals inside a closed polygon with an even number of nodes.

    The nodes of the polygon are the first points, in order. Recombination of triangles to quadrilaterals moves nodes,
    and this now and then turns a remaining triangle inside out. Then nodes are not moved. If cells still fold, the mesh
    is made from triangles alone, which never fold.
    """
    corners = np.round(ring[::2], _GMSH_DECIMALS)
    for recombine, optimize in ((True, True), (True, False), (False, False)):
        points, quads = _subdivide(*_gmsh_cells(corners, recombine=recombine, optimize=optimize), ring)
        if _has_convex_quads(points[quads]):
            break
    return points, quads


def _has_convex_quads(p: Floats) -> bool:
    """Whether all quadrilaterals (m, 4, 2) are convex and have equal orientation."""
    ahead, back = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    turns = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    return bool(np.all(turns > 0.0) or np.all(turns < 0.0))


def _gmsh_cells(corners: Floats, *, recombine: bool, optimize: bool) -> tuple[Floats, Integers, Integers]:
    """Points, triangles and quadrilaterals inside a closed polygon.

    The nodes of the polygon come first, and its sides stay undivided. Inside, cells grow away from each side of the
    polygon. `recombine` joins triangles to quadrilaterals, and `optimize` lets gmsh improve the cells.

    Returns
    -------
    points, triangles, quads
        Points (n, 2) in mm, and the numbers of the points of each cell, (t, 3) and (q, 4).
    """
    n = len(corners)
    middles, sides = 0.5 * (corners + np.roll(corners, -1, axis=0)), np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)

    def size(dimension: int, tag: int, y: float, z: float, x: float, default_size: float) -> float:
        """Size of the cells at a place (y, z), as gmsh asks for it."""
        distances = np.hypot(middles[:, 0] - y, middles[:, 1] - z)
        return round(
            float(min(np.min(lengths + 2.0 * _INSIDE_GROWTH * distances), 2.0 * _MAX_INSIDE_SIZE_MM)), _GMSH_DECIMALS
        )

    with _gmsh_session() as gmsh:
        gmsh.option.setNumber("Mesh.Algorithm", 8)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1)
        # A poor quadrilateral would fold in the subdivision; its two triangles never do.
        gmsh.option.setNumber("Mesh.RecombineMinimumQuality", 0.3)
        if not optimize:
            gmsh.option.setNumber("Mesh.RecombineNodeRepositioning", 0)
            gmsh.option.setNumber("Mesh.RecombineOptimizeTopology", 0)
        geo = gmsh.model.geo
        for k, (y, z) in enumerate(corners):
            geo.addPoint(y, z, 0.0, 0.0, k + 1)
        for k in range(n):
            geo.addLine(k + 1, (k + 1) % n + 1, k + 1)
            geo.mesh.setTransfiniteCurve(k + 1, 2)
        geo.addCurveLoop(list(range(1, n + 1)), 1)
        geo.addPlaneSurface([1], 1)
        geo.synchronize()
        if recombine:
            gmsh.model.mesh.setRecombine(2, 1)
        gmsh.model.mesh.setSizeCallback(size)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.removeSizeCallback()
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(tags)
        assert np.array_equal(tags[order], np.arange(1, len(tags) + 1))
        points = coordinates.reshape(-1, 3)[order, :2]
        assert np.allclose(points[:n], corners, atol=1e-9)
        kinds, _, nodes = gmsh.model.mesh.getElements(2)
        cells = {
            int(k): np.asarray(c, dtype=np.int64).reshape(-1, {2: 3, 3: 4}[int(k)]) - 1
            for k, c in zip(kinds, nodes, strict=True)
        }
    return points, cells.get(2, np.zeros((0, 3), np.int64)), cells.get(3, np.zeros((0, 4), np.int64))


def _subdivide(points: Floats, triangles: Integers, quads: Integers, ring: Floats) -> tuple[Floats, Integers]:
    """Cut triangles into three and quadrilaterals into four quadrilaterals.

    New boundary nodes lie on the true ring: `ring` has the corners of the polygon and the middles of its sides in turn.
    The result has points in mm with the ring first, and quadrilaterals (q, 4).
    """
    n = len(ring) // 2
    sides = np.vstack([np.stack([c, np.roll(c, -1, axis=1)], axis=-1).reshape(-1, 2) for c in (triangles, quads)])
    unique, inverse = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    middles = points[unique].mean(axis=1)
    low, high = unique.T
    on_ring = (high < n) & ((high - low == 1) | ((low == 0) & (high == n - 1)))
    ring_index = np.where(high - low == 1, low, high)
    centres = np.vstack([points[triangles].mean(axis=1), points[quads].mean(axis=1)])

    # Numbering: ring (corner, middle, corner, ...), gmsh's inner nodes, middles of inner sides, centres of cells.
    corner_id = np.concatenate([2 * np.arange(n), 2 * n + np.arange(len(points) - n)])
    middle_id = np.where(on_ring, 2 * ring_index + 1, len(points) + n + np.cumsum(~on_ring) - 1)
    centre_id = len(points) + n + np.count_nonzero(~on_ring) + np.arange(len(centres))
    all_points = np.vstack([ring, points[n:], middles[~on_ring], centres])
    quad_blocks, first_side = [], 0
    for cells, first_cell in ((triangles, 0), (quads, len(triangles))):
        corners = cells.shape[1]
        cell_middles = middle_id[inverse.ravel()[first_side : first_side + cells.size]].reshape(cells.shape)
        first_side += cells.size
        for k in range(corners):
            quad_blocks.append(
                np.column_stack(
                    [
                        corner_id[cells[:, k]],
                        cell_middles[:, k],
                        centre_id[first_cell : first_cell + len(cells)],
                        cell_middles[:, k - 1],
                    ]
                )
            )
    return all_points, np.vstack(quad_blocks)


def _orient_counter_clockwise(points: Floats, quads: Integers) -> Integers:
    """Quadrilaterals (m, 4) with counter-clockwise corners."""
    p = points[quads]
    d1, d2 = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    is_clockwise = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0] < 0.0
    return np.where(is_clockwise[:, None], quads[:, ::-1], quads)
