"""The dual mortar coupling: exact reproductions, and the contact patch test."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse.linalg import splu
from scipy.spatial import ConvexHull, HalfspaceIntersection

from fecontact.bodies import STEEL, Material
from fecontact.case import BodySize, Case
from fecontact.contact.grid import ContactGrid
from fecontact.contact.solver import ContactProblem, solve_contact
from fecontact.errors import InputError
from fecontact.fe.body import ElasticBody, make_elastic_body
from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.coupling import CoupledBodies, _clip_to_boxes, _triangle_rule, mortar_matrix
from fecontact.fe.linear_solver import choose_solver
from fecontact.fe.meshing import FineZone, rail_mesh, wheel_mesh
from fecontact.fe.stiffness import assemble_stiffness
from fecontact.solving.placing import place_case

GRID = ContactGrid(x_mm=np.linspace(-3.0, 5.0, 9), s_mm=np.linspace(-2.0, 1.0, 6), half=False)


def distorted_master(rng: np.random.Generator, nx: int = 8, ns: int = 7) -> tuple[np.ndarray, np.ndarray]:
    """Convex, non-matching quadrilaterals that reach beyond GRID: turned, stretched and shaken."""
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, nx), np.linspace(-1.0, 1.0, ns), indexing="ij")
    turn = 0.2
    x = 1.0 + 6.5 * (u * np.cos(turn) - 0.6 * v * np.sin(turn))
    s = -0.5 + 4.5 * (u * np.sin(turn) * 0.3 + 0.9 * v * np.cos(turn))
    xs = np.stack([x, s], axis=-1) + rng.uniform(-0.15, 0.15, (nx, ns, 2))
    ids = np.arange(nx * ns).reshape(nx, ns)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    return xs.reshape(-1, 2), quads


# --- the contact grid ------------------------------------------------------------------------------------------


def test_nodal_areas_fill_the_grid():
    areas = GRID.nodal_area_mm2().reshape(GRID.shape)
    hx, hs = GRID.steps_mm
    assert areas.sum() == pytest.approx(8.0 * 3.0, rel=1e-14)
    np.testing.assert_allclose(areas[1:-1, 1:-1], hx * hs, rtol=1e-13)
    np.testing.assert_allclose(areas[[0, 0, -1, -1], [0, -1, 0, -1]], 0.25 * hx * hs, rtol=1e-13)


def test_weighted_mean_reproduces_bilinear_functions():
    x, s = GRID.x_mm[:, None], GRID.s_mm[None, :]

    def f(x, s):
        return 0.3 - 1.7 * x + 2.0 * s + 0.9 * x * s

    # the means with dual weights are nodal values for every function of the slave's own space
    np.testing.assert_allclose(GRID.weighted_mean(f), f(x, s).ravel(), atol=1e-12)


def test_weighted_mean_of_a_parabola():
    # int psi_i x^2 / D_i = x_i^2 - h^2/6 for the dual functions 2 - 3 xi of a line, also at its ends
    x, s = GRID.x_mm[:, None], GRID.s_mm[None, :]
    hx, hs = GRID.steps_mm
    mean = GRID.weighted_mean(lambda x, s: 0.002 * x**2 + 0.005 * s**2)
    np.testing.assert_allclose(
        mean.reshape(GRID.shape), 0.002 * (x**2 - hx**2 / 6.0) + 0.005 * (s**2 - hs**2 / 6.0), atol=1e-15
    )


# --- the coupling matrix ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_partition_of_unity_and_linear_reproduction(seed):
    xs, quads = distorted_master(np.random.default_rng(seed))
    m = mortar_matrix(GRID, xs, quads)
    d = GRID.nodal_area_mm2()
    np.testing.assert_allclose(np.asarray(m.sum(axis=1)).ravel(), d, rtol=1e-12)
    # the master interpolates linear functions exactly, so int psi_i f = D_i f(node i)
    for f in (lambda p: p[..., 0], lambda p: p[..., 1], lambda p: 2.0 - 3.0 * p[..., 0] + 0.5 * p[..., 1]):
        nodes = np.stack(np.meshgrid(GRID.x_mm, GRID.s_mm, indexing="ij"), axis=-1).reshape(-1, 2)
        np.testing.assert_allclose(m @ f(xs), d * f(nodes), atol=1e-12 * 10.0)


@pytest.mark.parametrize("seed", range(3))
def test_force_and_moment_are_the_same_on_both_sides(seed):
    rng = np.random.default_rng(seed)
    xs, quads = distorted_master(rng)
    pressure = rng.uniform(0.0, 1000.0, GRID.nodal_area_mm2().size)
    on_slave = GRID.nodal_area_mm2() * pressure
    on_master = mortar_matrix(GRID, xs, quads).T @ pressure
    nodes = np.stack(np.meshgrid(GRID.x_mm, GRID.s_mm, indexing="ij"), axis=-1).reshape(-1, 2)
    assert on_master.sum() == pytest.approx(on_slave.sum(), rel=1e-12)
    # moments of the normal force about both axes of the projected plane
    np.testing.assert_allclose(on_master @ xs, on_slave @ nodes, rtol=1e-11)


def test_matching_meshes_give_a_diagonal_matrix():
    nodes = np.stack(np.meshgrid(GRID.x_mm, GRID.s_mm, indexing="ij"), axis=-1).reshape(-1, 2)
    ids = np.arange(len(nodes)).reshape(GRID.shape)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1).reshape(-1, 4)
    m = mortar_matrix(GRID, nodes, quads).toarray()
    np.testing.assert_allclose(m, np.diag(GRID.nodal_area_mm2()), atol=1e-14)


@pytest.mark.parametrize("missing", [0, 7, 21])
def test_master_that_does_not_cover_the_grid_is_refused(missing):
    xs, quads = distorted_master(np.random.default_rng(1))
    centre = xs[quads].mean(axis=1)
    inside = np.flatnonzero((np.abs(centre[:, 0] - 1.0) < 3.0) & (np.abs(centre[:, 1] + 0.5) < 1.0))
    with pytest.raises(InputError, match=r"covers [\d.]+ of the 24\.000 mm\^2"):
        mortar_matrix(GRID, xs, np.delete(quads, inside[missing % inside.size], axis=0))


def exact_area(quad: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Area of a convex quadrilateral inside a box.

    It is computed by intersecting half-planes about the largest inscribed circle.
    """
    edges = np.roll(quad, -1, axis=0) - quad
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.linalg.norm(edges, axis=1)[:, None]
    planes = np.vstack([np.column_stack([normals, -np.sum(normals * quad, axis=1)]), np.zeros((4, 3))])
    planes[4:] = [[-1, 0, low[0]], [1, 0, -high[0]], [0, -1, low[1]], [0, 1, -high[1]]]
    result = linprog(
        [0.0, 0.0, -1.0],
        A_ub=np.column_stack([planes[:, :2], np.ones(8)]),
        b_ub=-planes[:, 2],
        bounds=[(None, None)] * 3,
    )
    if not result.success or result.x[2] < 1e-9:
        return 0.0
    return float(ConvexHull(HalfspaceIntersection(planes, result.x[:2]).intersections).volume)


def test_clipping_against_half_plane_intersection():
    rng = np.random.default_rng(11)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, (150, 4)), axis=1)
    # points on a circle are in convex position; random ones meet the box from every side, some miss it
    quads = rng.uniform(-1.0, 1.0, (150, 1, 2)) + 0.9 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    low = np.tile([-0.6, -0.4], (150, 1))
    high = np.tile([0.5, 0.7], (150, 1))
    polygons, count = _clip_to_boxes(quads, low, high)
    _, weights, index = _triangle_rule(polygons, count)
    areas = np.bincount(index, weights, minlength=150)
    exact = np.array([exact_area(q, a, b) for q, a, b in zip(quads, low, high, strict=True)])
    assert np.count_nonzero(exact == 0.0) > 5
    assert set(np.unique(count[exact > 0.0])) >= {3, 4, 5, 6}
    # the reference's inscribed circle drops slivers below 1e-9
    np.testing.assert_allclose(areas, exact, atol=1e-8)


def test_clipping_edges_that_lie_on_the_box():
    # a shared edge or corner is neither lost nor counted twice
    quads = np.array(
        [
            [[0, 0], [1, 0], [1, 1], [0, 1]],
            [[1, 0], [2, 0], [2, 1], [1, 1]],
            [[0, 0], [1, 0], [0.5, 0.5], [0, 1]],
            [[-1, 0.5], [0.5, -1], [2, 0.5], [0.5, 2]],
        ],
        dtype=float,
    )
    polygons, count = _clip_to_boxes(quads, np.zeros((4, 2)), np.ones((4, 2)))
    _, weights, index = _triangle_rule(polygons, count)
    np.testing.assert_allclose(np.bincount(index, weights, minlength=4), [1.0, 0.0, 0.5, 1.0], atol=1e-15)


def test_quadrature_is_exact_to_degree_five():
    polygon = np.array([[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]] + [[0.0, 1.0]] * 4])
    points, weights, _ = _triangle_rule(polygon, np.array([4]))
    for i in range(6):
        for j in range(6 - i):
            value = float(weights @ (points[:, 0] ** i * points[:, 1] ** j))
            assert value == pytest.approx(2.0 ** (i + 1) / (i + 1) / (j + 1), rel=1e-13)


# --- V1a: flat blocks, uniform pressure across non-matching meshes ----------------------------------------------

LENGTH, WIDTH, HEIGHT = 10.0, 8.0, 6.0


def block(name: str, nx: int, ny: int, nz: int, *, graded: float = 0.0, shake: float = 0.0) -> BodyMesh:
    """A box below (rail) or above (wheel) z = 0; its inner nodes are graded and shaken in the plane (mm)."""
    rng = np.random.default_rng(7)
    u, v = np.linspace(-0.5, 0.5, nx + 1), np.linspace(-0.5, 0.5, ny + 1)
    x, y, z = np.meshgrid(
        LENGTH * u + graded * np.cos(np.pi * u),
        WIDTH * v + graded * np.cos(np.pi * v),
        np.linspace(-HEIGHT, 0.0, nz + 1) if name == "rail" else np.linspace(0.0, HEIGHT, nz + 1),
        indexing="ij",
    )
    points = np.stack([x, y, z], axis=-1)
    points[1:-1, 1:-1, :, :2] += shake * rng.uniform(-1.0, 1.0, (nx - 1, ny - 1, nz + 1, 2))
    ids = np.arange(x.size).reshape(x.shape)
    low = [ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]]
    hexes = np.stack([c[..., :-1] for c in low] + [c[..., 1:] for c in low], axis=-1).reshape(-1, 8)
    top, bottom = (np.stack([c[..., k] for c in low], axis=-1).reshape(-1, 4) for k in (-1, 0))
    contact, held_faces = (top, bottom[:, ::-1]) if name == "rail" else (bottom[:, ::-1], top)
    return BodyMesh(
        name=name,
        points=points.reshape(-1, 3),
        hexes=hexes,
        # no cut planes: a rail's ends would be held across, and the stress no longer be uniaxial
        surfaces={
            "contact": contact,
            ("fixed" if name == "rail" else "driven"): held_faces,
            "end": np.zeros((0, 4), dtype=np.int64),
        },
        contact_nodes=ids[:, :, -1 if name == "rail" else 0],
        block_nodes=ids[:, :, ::-1] if name == "rail" else ids,
        half=False,
        volume_mm3=LENGTH * WIDTH * HEIGHT,
    )


def body_on_rollers(mesh: BodyMesh, material: Material) -> ElasticBody:
    """Let the held face slide in its plane.

    Uniaxial stress is then the exact solution for every nu.
    """
    is_fixed = np.zeros((len(mesh.points), 3), dtype=bool)
    base = np.unique(mesh.surfaces["fixed" if mesh.name == "rail" else "driven"])
    is_fixed[base, 2] = True
    corner = base[np.lexsort(mesh.points[base, :2].T)[0]]
    along = base[np.argmax(mesh.points[base, 0] - 0.1 * mesh.points[base, 1])]
    is_fixed[corner, :2] = True
    is_fixed[along, 1] = True
    free = np.flatnonzero(~is_fixed.ravel())
    factor = splu(assemble_stiffness(mesh, material).tocsr()[free][:, free].tocsc())

    def solve(forces, tolerance):
        u = np.zeros_like(forces)
        u[free] = factor.solve(forces[free])
        return u

    return ElasticBody(mesh=mesh, material=material, solve=solve, solver="pardiso")


def flat_pair(rail_body: ElasticBody, wheel_body: ElasticBody) -> CoupledBodies:
    """Coupled flat bodies with the rail's nodes as grid."""
    rail, wheel = rail_body.mesh, wheel_body.mesh
    grid = ContactGrid(
        x_mm=rail.points[rail.contact_nodes[:, 0], 0], s_mm=rail.points[rail.contact_nodes[0], 1], half=False
    )
    wheel_nodes = np.unique(wheel.surfaces["contact"])
    local = np.full(len(wheel.points), -1)
    local[wheel_nodes] = np.arange(wheel_nodes.size)
    return CoupledBodies(
        rail=rail_body,
        wheel=wheel_body,
        grid=grid,
        normals=np.tile([0.0, 0.0, 1.0], (rail.contact_nodes.size, 1)),
        rail_nodes=rail.contact_nodes.ravel(),
        wheel_nodes=wheel_nodes,
        coupling=mortar_matrix(grid, wheel.points[wheel_nodes, :2], local[wheel.surfaces["contact"]]),
    )


SOFT = Material(young_MPa=70_000.0, poisson=0.2)


@pytest.mark.parametrize(
    ("clamped", "distortion", "tolerance"),
    [
        (True, {"graded": 0.7}, 1e-8),
        (False, {"graded": 0.7}, 1e-8),
        (False, {"graded": 0.7, "shake": 0.02}, 1e-8),
        # on faces that are no parallelograms the shape functions are rational in x and s, and the quadrature of
        # degree 5 is no longer exact: 1.1e-6 for corners moved by a quarter of a millimetre
        (False, {"shake": 0.25}, 3e-6),
    ],
)
def test_contact_patch_test_on_flat_blocks(clamped, distortion, tolerance):
    meshes = block("rail", 7, 6, 3), block("wheel", 5, 8, 4, **distortion)
    if clamped:
        # clamped faces leave the stress uniaxial only without lateral strain: this path is the product's own
        materials = [Material(young_MPa=e, poisson=0.0) for e in (210_000.0, 70_000.0)]
        bodies = [make_elastic_body(m, e, choose_solver("auto")) for m, e in zip(meshes, materials, strict=True)]
    else:
        materials = [STEEL, SOFT]
        bodies = [body_on_rollers(m, e) for m, e in zip(meshes, materials, strict=True)]
    pair = flat_pair(*bodies)
    area = pair.grid.nodal_area_mm2()
    problem = ContactProblem(
        compliance=pair.compliance, gap_mm=np.zeros(area.size), closing=np.ones(area.size), area_mm2=area
    )
    load = 100.0 * LENGTH * WIDTH
    start = np.random.default_rng(2).uniform(0.0, 1.0, area.size)
    solution = solve_contact(problem, load, start_MPa=start, tolerance=1e-11)
    assert solution.status == "converged"
    np.testing.assert_allclose(solution.pressure_MPa, 100.0, rtol=tolerance)
    strain = sum(100.0 / m.young_MPa for m in materials)
    assert solution.approach_mm == pytest.approx(strain * HEIGHT, rel=1e-9)
    for body, u in zip(bodies, pair.displacements(solution.pressure_MPa), strict=True):
        # uniaxial stress: the displacement along z is linear over all inner nodes as well
        z = body.mesh.points[:, 2] + (HEIGHT if body.mesh.name == "rail" else -HEIGHT)
        np.testing.assert_allclose(u[:, 2], -100.0 / body.material.young_MPa * z, atol=tolerance * abs(u[:, 2]).max())


# --- V1b: the real curved wheel over the rail's flat coordinates -----------------------------------------------


def curved_pair(half: bool) -> tuple[CoupledBodies, np.ndarray, np.ndarray]:
    """Coupled curved bodies with different node spacings of rail and wheel."""
    case = Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0)
    placement = place_case(case)
    zone = FineZone(half_length_mm=9.0, s_low_mm=-7.0, s_high_mm=7.0, step_x_mm=1.5, step_s_mm=1.2, semi_axis_mm=5.0)
    size = BodySize(rail_depth_mm=30.0, rim_thickness_mm=30.0, half_length_mm=30.0)
    rail = rail_mesh(placement, zone, half=half, size=size)
    # another spacing than the rail's: meshes that match by accident would prove nothing
    other_zone = FineZone(
        half_length_mm=9.3, s_low_mm=-7.2, s_high_mm=7.2, step_x_mm=1.15, step_s_mm=0.95, semi_axis_mm=5.0
    )
    wheel = wheel_mesh(placement, other_zone, half=half, size=size)
    grid = ContactGrid(
        x_mm=np.linspace(0.0 if half else -9.0, 9.0, rail.contact_nodes.shape[0]),
        s_mm=np.linspace(-7.0, 7.0, rail.contact_nodes.shape[1]),
        half=half,
    )
    wheel_nodes = np.unique(wheel.surfaces["contact"])
    local = np.full(len(wheel.points), -1)
    local[wheel_nodes] = np.arange(wheel_nodes.size)
    xs, quads = placement.project(wheel.points[wheel_nodes]), local[wheel.surfaces["contact"]]
    _, normals = placement.surface(grid.x_mm[:, None], grid.s_mm[None, :])
    path = choose_solver("auto")
    bodies = CoupledBodies(
        rail=make_elastic_body(rail, STEEL, path),
        wheel=make_elastic_body(wheel, STEEL, path),
        grid=grid,
        normals=normals.reshape(-1, 3),
        rail_nodes=rail.contact_nodes.ravel(),
        wheel_nodes=wheel_nodes,
        coupling=mortar_matrix(grid, xs, quads),
    )
    return bodies, xs, quads


@pytest.fixture(scope="module")
def curved():
    pair = curved_pair(half=True)
    yield pair
    pair[0].close()


def test_uniform_pressure_on_the_curved_wheel_gives_consistent_loads(curved):
    bodies, xs, quads = curved
    grid, loads = bodies.grid, bodies.coupling.T @ np.full(bodies.normals.shape[0], 100.0)
    corners = xs[quads]
    assert np.diff(bodies.coupling.indptr).min() > 4
    inside = np.all(
        (corners >= [grid.x_mm[0] - 1e-12, grid.s_mm[0]]) & (corners <= [grid.x_mm[-1], grid.s_mm[-1]]), (1, 2)
    )
    consistent = np.zeros(len(xs))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    g = 1.0 / np.sqrt(3.0)
    for r in (-g, g):
        for s in (-g, g):
            shape = 0.25 * (1 + signs[:, 0] * r) * (1 + signs[:, 1] * s)
            d_r = np.einsum("c,qcd->qd", 0.25 * signs[:, 0] * (1 + signs[:, 1] * s), corners[inside])
            d_s = np.einsum("c,qcd->qd", 0.25 * signs[:, 1] * (1 + signs[:, 0] * r), corners[inside])
            area = np.abs(d_r[:, 0] * d_s[:, 1] - d_r[:, 1] * d_s[:, 0])
            np.add.at(consistent, quads[inside], 100.0 * area[:, None] * shape)
    # nodes of which no face is cut by the edge of the zone; 2 x 2 points integrate shape times Jacobian exactly
    inner_nodes = np.setdiff1d(np.unique(quads[inside]), np.unique(quads[~inside]))
    assert inner_nodes.size > 40
    np.testing.assert_allclose(loads[inner_nodes], consistent[inner_nodes], rtol=1e-8)
    assert loads.sum() == pytest.approx(100.0 * 9.0 * 14.0, rel=1e-12)
    assert loads.min() > -1e-9 * loads.max()


def test_compliance_is_symmetric_and_positive(curved):
    bodies, _, _ = curved
    rng = np.random.default_rng(9)
    area = bodies.grid.nodal_area_mm2()
    p, q = rng.uniform(-100.0, 100.0, (2, area.size))
    cp, cq = bodies.compliance(p), bodies.compliance(q)
    work = np.array([np.dot(area * q, cp), np.dot(area * p, cq), np.dot(area * p, cp)])
    # Maxwell and Betti, to the accuracy of the linear solver (multigrid: 1e-10 of the load)
    assert work[0] == pytest.approx(work[1], abs=1e-8 * work[2])
    assert work[2] > 0.0
    np.testing.assert_allclose(bodies.compliance(2.0 * p - q), 2.0 * cp - cq, atol=1e-8 * np.abs(cp).max())


def test_forces_on_both_bodies_are_opposite(curved):
    bodies, _, _ = curved
    p = np.random.default_rng(4).uniform(0.0, 100.0, bodies.normals.shape[0])
    push = p[:, None] * bodies.normals
    on_rail = -(bodies.grid.nodal_area_mm2()[:, None] * push).sum(axis=0)
    on_wheel = (bodies.coupling.T @ push).sum(axis=0)
    np.testing.assert_allclose(on_rail, -on_wheel, atol=1e-12 * np.abs(on_rail).max())
    u_rail, u_wheel = bodies.displacements(p)
    # pushed apart: the rail goes down, the wheel up, and what is held stays
    assert u_rail[bodies.rail_nodes, 2].mean() < 0.0 < u_wheel[bodies.wheel_nodes, 2].mean()
    for body, u in ((bodies.rail, u_rail), (bodies.wheel, u_wheel)):
        held_nodes = np.unique(body.mesh.surfaces["fixed" if body.mesh.name == "rail" else "driven"])
        assert np.all(u[held_nodes] == 0.0)
        assert np.all(u[np.unique(body.mesh.surfaces["symmetry"]), 0] == 0.0)


def test_force_and_moment_are_balanced_on_curved_surfaces():
    """Force and moment between meshes that do not match.

    The missing moment decreases with the gap between their facets.
    """
    bodies, _, _ = curved_pair(half=False)
    grid = bodies.grid
    p = (np.maximum(0.0, 1.0 - (grid.x_mm[:, None] / 6.0) ** 2 - ((grid.s_mm - 1.0) / 4.0) ** 2) ** 0.5).ravel()
    force, moment = bodies.balance(p)
    assert force < 1e-14
    assert moment < 1e-6
    # each is as large as the fault
    assert replace(bodies, coupling=1.02 * bodies.coupling).balance(p)[0] == pytest.approx(0.02, rel=1e-9)
    lever = np.average(np.hypot(grid.x_mm[:, None], grid.s_mm - 1.0).ravel(), weights=p)
    points = bodies.wheel.mesh.points + np.array([0.0, 0.1, 0.0])
    aside = replace(bodies, wheel=replace(bodies.wheel, mesh=replace(bodies.wheel.mesh, points=points)))
    assert aside.balance(p)[1] == pytest.approx(0.1 / lever, rel=0.02)
    bodies.close()


def test_manufactured_pressure_is_recovered(curved):
    bodies, _, _ = curved
    x, s = bodies.grid.x_mm[:, None], bodies.grid.s_mm[None, :]
    r2 = ((x / 6.5) ** 2 + ((s - 0.7) / 4.5) ** 2).ravel()
    exact = 1000.0 * np.sqrt(np.maximum(1.0 - r2, 0.0)) * (1.0 + 0.3 * np.sin(0.4 * x + 0.2 * s).ravel())
    closing = bodies.normals[:, 2]
    area = 2.0 * bodies.grid.nodal_area_mm2()
    approach = 0.08
    slack = 0.02 * np.maximum(r2 - 1.0, 0.0)
    problem = ContactProblem(
        compliance=bodies.compliance,
        gap_mm=approach * closing - bodies.compliance(exact) + slack,
        closing=closing,
        area_mm2=area,
    )
    solution = solve_contact(problem, problem.load_N(exact), tolerance=3e-10)
    assert solution.status == "converged"
    # the error of the pressure is about twice that of the gap
    np.testing.assert_allclose(solution.pressure_MPa, exact, atol=1e-8 * exact.max())
    assert solution.approach_mm == pytest.approx(approach, rel=1e-8)
    np.testing.assert_allclose(solution.gap_mm, slack, atol=1e-9 * approach * 10.0)


def quadratic_problem(bodies: CoupledBodies) -> ContactProblem:
    """Contact problem of coupled bodies with a quadratic gap."""
    gap = bodies.grid.weighted_mean(lambda x, s: x**2 / 920.0 + s**2 / 600.0)
    return ContactProblem(
        compliance=bodies.compliance,
        gap_mm=gap,
        closing=bodies.normals[:, 2],
        area_mm2=bodies.grid.nodal_area_mm2() * (2.0 if bodies.grid.half else 1.0),
    )


def test_full_model_gives_the_pressure_of_the_half(curved):
    half, full = curved[0], curved_pair(half=False)[0]
    half_contact, full_contact = (solve_contact(quadratic_problem(b), 60e3, tolerance=1e-9) for b in (half, full))
    p, q = half_contact.pressure_MPa.reshape(half.grid.shape), full_contact.pressure_MPa.reshape(full.grid.shape)
    # symmetric meshes of the same sections: the same discrete problem
    np.testing.assert_allclose(q[half.grid.shape[0] - 1 :], p, atol=1e-6 * p.max())
    np.testing.assert_allclose(q, q[::-1], atol=1e-6 * p.max())
    full.close()


def test_gap_and_load_scale_together(curved):
    problem = quadratic_problem(curved[0])
    contact = solve_contact(problem, 60e3, tolerance=1e-9)
    # linear compliance: twice the gap under twice the load is twice the pressure on the same patch
    two = solve_contact(replace(problem, gap_mm=2.0 * problem.gap_mm), 120e3, tolerance=1e-9)
    np.testing.assert_allclose(two.pressure_MPa, 2.0 * contact.pressure_MPa, atol=1e-6 * contact.pressure_MPa.max())
    # a constant gap moves the approach and nothing else
    three = solve_contact(replace(problem, gap_mm=problem.gap_mm + 0.2 * problem.closing), 60e3, tolerance=1e-9)
    np.testing.assert_allclose(three.pressure_MPa, contact.pressure_MPa, atol=1e-6 * contact.pressure_MPa.max())
    assert three.approach_mm - contact.approach_mm == pytest.approx(0.2, abs=1e-8)
