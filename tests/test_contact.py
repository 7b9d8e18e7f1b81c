"""The contact solver on half-spaces: against Hertz, a dense reference, and the invariants of the problem."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rungs import rung_with
from scipy.integrate import dblquad
from scipy.optimize import nnls

from fecontact.bodies import STEEL, combine_moduli_MPa
from fecontact.contact.grid import ContactGrid, Field, calculate_misplaced_load
from fecontact.contact.halfspace import (
    _build_coarse_grid,
    build_half_space_compliance,
    build_half_space_problem,
    build_half_space_stiffness,
    love_influence,
)
from fecontact.contact.solver import ContactProblem, ContactSolution, _clean_start, mix_solutions, solve_contact
from fecontact.contact_theories.hertz import HertzContact, hertz_ellipse

MODULUS = combine_moduli_MPa(STEEL, STEEL)
WHEEL, LOAD = 460.0, 100e3


def hertz(rail: float, load: float = LOAD) -> HertzContact:
    return hertz_ellipse(0.5 / WHEEL, 0.5 / rail, normal_force_N=load, contact_modulus_MPa=MODULUS)


def grid(rail: float, count: int, *, half: bool = True, room: float = 1.3) -> tuple[np.ndarray, np.ndarray]:
    """Nodes with `count` steps per semi-axis and a node in the centre."""
    h, k = hertz(rail), int(room * count) + 1
    x = h.a_mm / count * np.arange(0 if half else -k, k + 1)
    return x, h.b_mm / count * np.arange(-k, k + 1)


def uniform_problem(x: np.ndarray, s: np.ndarray, gap: np.ndarray, *, half: bool) -> ContactProblem:
    """A gap on half-spaces with whole cells at the ends too."""
    dx, ds = x[1] - x[0], s[1] - s[0]
    area = np.full((x.size, s.size), dx * ds)
    if half:
        area[1:] *= 2.0
    return ContactProblem(
        compliance=build_half_space_compliance(ContactGrid(x_mm=x, s_mm=s, half=half), MODULUS),
        gap_mm=gap.ravel(),
        closing=np.ones(gap.size),
        area_mm2=area.ravel(),
    )


def rung_q(rail: float, count: int, *, half: bool = True, load: float = LOAD) -> tuple[np.ndarray, ContactSolution]:
    """Pressure (nx, ns) and solution of the quadratic gap on half-spaces."""
    x, s = grid(rail, count, half=half)
    gap = 0.5 / WHEEL * x[:, None] ** 2 + 0.5 / rail * s[None, :] ** 2
    solution = solve_contact(uniform_problem(x, s, gap, half=half), load)
    assert solution.status == "converged"
    return solution.pressure_MPa.reshape(x.size, s.size), solution


def rough_problem(seed: int = 3) -> ContactProblem:
    """An irregular contact of several pieces, on a full grid."""
    x, s = np.linspace(-6.0, 6.0, 25), np.linspace(-4.0, 4.0, 21)
    rng = np.random.default_rng(seed)
    waves = sum(
        0.004 * rng.uniform(-1, 1) * np.cos(k * x[:, None] * 0.5 + l * s[None, :] * 0.7 + rng.uniform(0, 6))
        for k in range(4)
        for l in range(4)
    )
    return uniform_problem(x, s, x[:, None] ** 2 / 900.0 + s[None, :] ** 2 / 500.0 + waves, half=False)


# --- the half-space ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.7, 0.0), (0.0, -0.4), (1.4, 0.4), (0.35, 0.2), (-2.1, 3.3)])
def test_love_influence_against_quadrature(x, y):
    dx, dy = 0.7, 0.4
    # one direction in closed form, the other by quadrature
    edges_x, edges_y = (-0.5 * dx - x, 0.5 * dx - x), (-0.5 * dy - y, 0.5 * dy - y)

    def strip(v: np.ndarray) -> np.ndarray:
        return np.arcsinh(edges_x[1] / np.abs(v)) - np.arcsinh(edges_x[0] / np.abs(v))

    n, w = np.polynomial.legendre.leggauss(100)
    total = 0.0
    # split at the observer's own height, where the strips have a logarithm; the substitution v = t^3 removes it
    for low, high in ((edges_y[0], min(0.0, edges_y[1])), (max(0.0, edges_y[0]), edges_y[1])):
        if high <= low:
            continue
        a, b = np.cbrt(low), np.cbrt(high)
        t = 0.5 * (a + b) + 0.5 * (b - a) * n
        total += 0.5 * (b - a) * float(w @ (3.0 * t**2 * strip(t**3)))
    value = love_influence(np.array(x), np.array(y), dx, dy)
    # 100 Gauss points on an integrand that is smooth but for t^2 log t
    assert float(value) == pytest.approx(total, rel=1e-7)
    if abs(x) > dx:
        plain = dblquad(lambda v, u: 1 / math.hypot(u, v), *edges_x, *edges_y)[0]
        assert float(value) == pytest.approx(plain, rel=1e-9)


def test_love_influence_far_away_is_a_point_force():
    # the next term of the expansion is (d/r)^2 / 24 of it
    assert float(love_influence(np.array(30.0), np.array(40.0), 1.0, 1.0)) == pytest.approx(1.0 / 50.0, rel=1e-4)


def test_compliance_is_the_dense_influence_matrix():
    nx, ns, dx, ds = 6, 5, 0.5, 0.3
    i, j = (k.ravel() for k in np.meshgrid(np.arange(nx), np.arange(ns), indexing="ij"))
    dense = love_influence((i[:, None] - i) * dx, (j[:, None] - j) * ds, dx, ds) / (np.pi * MODULUS)
    p = np.random.default_rng(1).uniform(-1.0, 1.0, nx * ns)
    apply = build_half_space_compliance(
        ContactGrid(x_mm=dx * np.arange(nx), s_mm=ds * np.arange(ns), half=False), MODULUS
    )
    # FFT rounding
    np.testing.assert_allclose(apply(p), dense @ p, atol=1e-13 * np.abs(dense @ p).max())


def test_half_model_mirrors_the_pressure():
    nx, ns, dx, ds = 7, 6, 0.5, 0.3
    x, s = dx * np.arange(1.0 - nx, nx), ds * np.arange(ns)
    p = np.random.default_rng(1).uniform(0.0, 1.0, (nx, ns))
    mirrored = np.concatenate([p[:0:-1], p])
    full = build_half_space_compliance(ContactGrid(x_mm=x, s_mm=s, half=False), MODULUS)(mirrored.ravel()).reshape(
        -1, ns
    )
    half = build_half_space_compliance(ContactGrid(x_mm=x[nx - 1 :], s_mm=s, half=True), MODULUS)(p.ravel()).reshape(
        nx, ns
    )
    np.testing.assert_allclose(half, full[nx - 1 :], rtol=1e-12)


@pytest.mark.parametrize("half", [True, False])
def test_half_space_problem_of_a_grid(half):
    x, s = grid(80.0, 6, half=half)
    nodes = ContactGrid(x_mm=x, s_mm=s, half=half)
    gap = (0.5 / WHEEL * x[:, None] ** 2 + 0.5 / 80.0 * s[None, :] ** 2).ravel()
    closing = np.random.default_rng(4).uniform(0.8, 1.0, gap.size)
    grid_problem = build_half_space_problem(nodes, gap, contact_modulus_MPa=MODULUS)
    by_hand = uniform_problem(x, s, gap, half=half)
    # cells at the ends are half of those inside, and nothing touches there
    assert grid_problem.area_mm2.sum() == pytest.approx((2.0 if half else 1.0) * np.ptp(x) * np.ptp(s), rel=1e-12)
    inside = grid_problem.area_mm2.reshape(nodes.shape)[0 if half else 1 : -1, 1:-1]
    np.testing.assert_allclose(inside, by_hand.area_mm2.reshape(nodes.shape)[0 if half else 1 : -1, 1:-1], rtol=1e-12)
    p = np.random.default_rng(1).uniform(size=gap.size)
    np.testing.assert_allclose(grid_problem.compliance(p), by_hand.compliance(p), rtol=1e-12)
    np.testing.assert_array_equal(grid_problem.gap_mm, gap)
    np.testing.assert_array_equal(grid_problem.closing, 1.0)
    first_solution, second_solution = (
        solve_contact(problem, LOAD, tolerance=1e-9) for problem in (grid_problem, by_hand)
    )
    np.testing.assert_allclose(
        first_solution.pressure_MPa, second_solution.pressure_MPa, atol=1e-7 * second_solution.pressure_MPa.max()
    )
    tilted = build_half_space_problem(nodes, gap, closing=closing, contact_modulus_MPa=MODULUS)
    np.testing.assert_array_equal(tilted.closing, closing)


# --- fields on a grid -------------------------------------------------------------------------------------------

HALF_GRID = ContactGrid(x_mm=0.5 * np.arange(5), s_mm=0.3 * (np.arange(7) - 2.2), half=True)
FULL_GRID = ContactGrid(x_mm=0.5 * (np.arange(6) - 1.3), s_mm=0.3 * (np.arange(7) - 2.2), half=False)


def values_on(nodes: ContactGrid) -> np.ndarray:
    return np.random.default_rng(6).uniform(1.0, 2.0, nodes.shape)


def moments(field: Field) -> list[float]:
    """Sum over the full contact, and its first and second moments.

    Each node has the weight of its area.
    """
    x, s, p = field.grid.x_mm[:, None], field.grid.s_mm[None, :], field.values
    area = field.grid.whole_area_mm2().reshape(field.grid.shape)
    return [float(np.sum(area * p * w)) for w in (1.0, s, x**2, s**2, x**2 * s)]


def test_the_whole_of_a_half_field_keeps_sums_and_mirrors_positions():
    half = Field(grid=HALF_GRID, values=values_on(HALF_GRID))
    full_field = half.whole()
    assert not full_field.grid.half
    assert full_field.grid.shape == full_field.values.shape == (9, 7)
    np.testing.assert_array_equal(full_field.grid.x_mm, -full_field.grid.x_mm[::-1])
    np.testing.assert_array_equal(full_field.grid.x_mm[4:], HALF_GRID.x_mm)
    np.testing.assert_array_equal(full_field.grid.s_mm, HALF_GRID.s_mm)
    np.testing.assert_array_equal(full_field.values, full_field.values[::-1])
    # the plane of symmetry is there once
    np.testing.assert_array_equal(full_field.values[4:], half.values)
    assert moments(full_field) == pytest.approx(moments(half), rel=1e-12)
    assert full_field.whole() is full_field


def test_a_full_field_is_whole():
    full = Field(grid=FULL_GRID, values=values_on(FULL_GRID))
    assert full.whole() is full


@pytest.mark.parametrize("nodes", [HALF_GRID, FULL_GRID], ids=["half", "full"])
@pytest.mark.parametrize("box", [(12.0, 9.0), (12.0, 0.5), (0.5, 9.0), (0.5, 0.5)])
def test_a_covering_field_adds_zeros_in_the_same_steps(nodes, box):
    values = values_on(nodes)
    # where nothing touches at the ends, so that their half cells do not count
    values[-1] = values[:, [0, -1]] = 0.0
    if not nodes.half:
        values[0] = 0.0
    field = Field(grid=nodes, values=values)
    covering = field.covering(*box)
    assert not covering.grid.half
    assert covering.values.shape == covering.grid.shape
    for line, old, length in (
        (covering.grid.x_mm, field.whole().grid.x_mm, box[0]),
        (covering.grid.s_mm, nodes.s_mm, box[1]),
    ):
        np.testing.assert_allclose(np.diff(line), old[1] - old[0], rtol=1e-12)
        assert line[0] < -0.5 * length
        assert line[-1] > 0.5 * length
        # what was there lies where it was, to the last bit
        first = int(np.flatnonzero(line == old[0])[0])
        np.testing.assert_array_equal(line[first : first + old.size], old)
        # no more than two steps beyond the box, or nothing at all
        assert first == 0 or line[0] >= -0.5 * length - 2.0 * (old[1] - old[0])
        assert line[-1] == old[-1] or line[-1] <= 0.5 * length + 2.0 * (old[1] - old[0])
    if nodes.half:
        np.testing.assert_allclose(covering.grid.x_mm, -covering.grid.x_mm[::-1], atol=1e-12)
        np.testing.assert_array_equal(covering.values, covering.values[::-1])
    assert covering.values.sum() == pytest.approx(field.whole().values.sum(), rel=1e-12)
    assert moments(covering) == pytest.approx(moments(field), rel=1e-12)


def test_fields_of_nodes_may_have_components():
    vectors = np.random.default_rng(7).uniform(size=(35, 3))
    field = Field.of_nodes(HALF_GRID, vectors)
    assert field.values.shape == (5, 7, 3)
    np.testing.assert_array_equal(field.values[2, 3], vectors[2 * 7 + 3])
    covering = field.covering(12.0, 9.0)
    assert covering.values.shape == (*covering.grid.shape, 3)
    np.testing.assert_allclose(covering.values.sum(axis=(0, 1)), field.whole().values.sum(axis=(0, 1)), rtol=1e-12)


# --- a contact on the nodes of elements beside the same one on finer nodes -------------------------------------------


def node_lines(nodes: int, step: float, offset: float) -> np.ndarray:
    return step * (np.arange(-nodes, nodes + 1) + offset)


@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_means_over_shape_functions_are_no_misfit(half, seed):
    """An ellipsoid on coarse and on fine nodes is a single contact.

    Nodal pressures are integrated by Gauss's rule, finer pressures are means over their cells.
    """
    rng = np.random.default_rng(seed)
    exact = hertz(300.0)
    (off_x, off_s), (fine_x, fine_s) = rng.uniform(-0.5, 0.5, 2), rng.uniform(-0.5, 0.5, 2)
    x, fx = (
        node_lines(9, exact.a_mm / 6.0, 0.0 if half else off_x),
        node_lines(40, exact.a_mm / 32.3, 0.0 if half else fine_x),
    )
    s, fs = node_lines(9, exact.b_mm / 6.0, off_s), node_lines(40, exact.b_mm / 31.7, fine_s)
    # hat functions by 24 intervals of two Gauss points on either side
    t = (np.arange(-24, 24)[:, None] + 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)).ravel() / 24.0
    weight = (1.0 - np.abs(t)) / (1.0 - np.abs(t)).sum()
    points = exact.pressure_MPa(
        (x[:, None] + (x[1] - x[0]) * t).ravel()[:, None], (s[:, None] + (s[1] - s[0]) * t).ravel()[None, :]
    ).reshape(x.size, t.size, s.size, t.size)
    nodal = np.einsum("iajb,a,b->ij", points, weight, weight)
    fine = exact.pressure_MPa(fx[:, None], fs[None, :])
    rows = slice(9, None) if half else slice(None)
    fine_rows = slice(40, None) if half else slice(None)
    coarse_rung = rung_with(ContactGrid(x_mm=x[rows], s_mm=s, half=half), nodal[rows])
    fine_rung = rung_with(ContactGrid(x_mm=fx[fine_rows], s_mm=fs, half=half), fine[fine_rows])
    # the finer pressure is taken at its nodes: measured 0.16 % at most
    assert calculate_misplaced_load(coarse_rung, fine_rung) < 2.5e-3
    # 2 % more on one side and less on the other: half of the integral of 2 % of the pressure
    tilted = rung_with(coarse_rung.grid, coarse_rung.pressure_MPa * (1.0 + 0.02 * np.sign(s)[None, :]))
    assert calculate_misplaced_load(tilted, fine_rung) == pytest.approx(0.01, abs=2.5e-3)


def test_misfit_by_hand():
    nodes = ContactGrid(x_mm=np.arange(-3.0, 4.0), s_mm=np.arange(-3.0, 4.0), half=False)
    # 16 steps between two nodes, a force at one fine node
    fine = ContactGrid(x_mm=np.arange(-48, 49) / 16.0, s_mm=np.arange(-48, 49) / 16.0, half=False)

    def point_pressure(grid: ContactGrid, x: float, s: float, force: float = 160.0) -> np.ndarray:
        p = np.zeros(grid.shape)
        p[np.argmin(np.abs(grid.x_mm - x)), np.argmin(np.abs(grid.s_mm - s))] = force / np.prod(grid.steps_mm)
        return p

    def nodal_misfit(nodal: np.ndarray, finer: np.ndarray) -> float:
        return calculate_misplaced_load(rung_with(nodes, nodal), rung_with(fine, finer))

    # the mean of a hat over the fine cell at its top, and over that of its neighbour
    top, neighbour = 1.0 - 1.0 / 64.0, 1.0 / 128.0
    assert nodal_misfit(point_pressure(nodes, 1.0, 0.0), point_pressure(fine, 1.0, 0.0)) == pytest.approx(
        1.0 - top**2, rel=1e-12
    )
    # all of the load one node on
    assert nodal_misfit(point_pressure(nodes, 2.0, 0.0), point_pressure(fine, 1.0, 0.0)) == pytest.approx(
        1.0 - neighbour * top, rel=1e-12
    )
    # a quarter of the way to the next node: three quarters belong to the first
    assert nodal_misfit(point_pressure(nodes, 1.0, 0.0), point_pressure(fine, 1.25, 0.0)) == pytest.approx(
        1.0 - 0.75 * top, rel=1e-12
    )
    two_nodes = 0.75 * point_pressure(nodes, 1.0, 0.0) + 0.25 * point_pressure(nodes, 2.0, 0.0)
    assert nodal_misfit(two_nodes, point_pressure(fine, 1.25, 0.0)) == pytest.approx(1.0 - top, rel=1e-12)
    # in both directions: 0.75 * 0.5 of it at the node
    assert nodal_misfit(point_pressure(nodes, 1.0, 0.0), point_pressure(fine, 1.25, -0.5)) == pytest.approx(
        1.0 - 0.375, rel=1e-12
    )
    # too much load altogether is half as much misplaced
    assert nodal_misfit(1.1 * point_pressure(nodes, 1.0, 0.0), point_pressure(fine, 1.0, 0.0)) == pytest.approx(
        0.05 + 1.0 - top**2, rel=1e-12
    )


@pytest.mark.parametrize("steps", [0.5, 1.0])
def test_misfit_of_a_shifted_line_load(steps):
    """A parabola across, moved by parts of a step: half of the integral of the difference, by quadrature."""
    nodes = ContactGrid(x_mm=np.arange(0.0, 4.0), s_mm=0.5 * np.arange(-10, 11), half=True)
    fine = ContactGrid(x_mm=np.arange(0.0, 40.0) / 10.0, s_mm=np.arange(-100, 101) / 20.0, half=True)
    along, fine_along = np.array([1.0, 1.0, 0.0, 0.0]), np.where(fine.x_mm < 1.45, 1.0, 0.0)

    def parabola(s: np.ndarray) -> np.ndarray:
        return np.maximum(0.0, 9.0 - s**2)

    # mean over the hat function: exact inside by the second derivative, h^2 / 12 * -2 there
    t = np.linspace(-1.0, 1.0, 4001)
    hat = (1.0 - np.abs(t)) / (1.0 - np.abs(t)).sum()
    mean = np.array([hat @ parabola(s + 0.5 * t - 0.5 * steps) for s in nodes.s_mm])
    centred = np.array([hat @ parabola(s + 0.5 * t) for s in nodes.s_mm])
    assert centred[10] == pytest.approx(9.0 - 0.25 / 6.0, rel=1e-6)
    # along x both have a force of 3 in the same nodes: 2 of the coarse ones, by hat means of the fine ones
    weights = np.maximum(0.0, 1.0 - np.abs(fine.x_mm - nodes.x_mm[:, None]))
    full_line = np.concatenate([fine_along[:0:-1], fine_along])
    places = np.concatenate([-fine.x_mm[:0:-1], fine.x_mm])
    exact_along = np.array([0.1 * np.maximum(0.0, 1.0 - np.abs(places - x)) @ full_line for x in nodes.x_mm])
    assert weights.shape == (4, 40)
    pressure = exact_along[:, None] * mean
    expected = 0.5 * np.abs(mean - centred).sum() / centred.sum()
    assert along.size == nodes.x_mm.size
    line_misfit = calculate_misplaced_load(
        rung_with(nodes, pressure), rung_with(fine, fine_along[:, None] * parabola(fine.s_mm))
    )
    # sums over the finer nodes are trapezoids: measured 1e-4 of it
    assert line_misfit == pytest.approx(expected, rel=2e-3)


# --- rung Q against Hertz ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("rail", [300.0, 80.0, 13.0])
def test_half_space_peak_against_hertz(rail):
    pressure, solution = rung_q(rail, 8)
    exact = hertz(rail)
    # piecewise constant pressures with a node on the peak: measured 0.11, 0.13 and 0.15 % at 8 nodes per semi-axis
    assert pressure.max() == pytest.approx(exact.p0_MPa, rel=2e-3)
    # the approach is a mean over the whole patch: measured 0.03 %
    assert solution.approach_mm == pytest.approx(exact.approach_mm, rel=1e-3)


@pytest.mark.parametrize("rail", [300.0, 80.0, 13.0])
def test_half_space_error_falls_with_second_order(rail):
    counts = np.array([6, 8, 12, 16, 24])
    peak = np.array([abs(rung_q(rail, n)[0].max() / hertz(rail).p0_MPa - 1.0) for n in counts])
    order = -np.polyfit(np.log(counts), np.log(peak), 1)[0]
    # measured 1.95 to 2.2: the patch's edge moves in whole cells and makes the single errors scatter
    assert 1.7 < order < 2.5
    assert np.all(np.diff(peak) < 0.0)


def test_half_space_field_converges_with_first_order():
    # the square-root edge holds the field's norm to first order
    errors = []
    for n in (6, 12, 24):
        x, s = grid(300.0, n)
        exact = hertz(300.0).pressure_MPa(x[:, None], s[None, :])
        errors.append(np.linalg.norm(rung_q(300.0, n)[0] - exact) / np.linalg.norm(exact))
    assert errors[0] < 0.045
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(1.1, abs=0.3)


def test_half_and_full_model_are_the_same():
    half, half_contact = rung_q(300.0, 6)
    full, full_contact = rung_q(300.0, 6, half=False)
    # both to the solver's tolerance of 1e-7
    np.testing.assert_allclose(full[full.shape[0] // 2 :], half, atol=1e-6 * half.max())
    np.testing.assert_allclose(full, full[::-1], atol=1e-6 * half.max())
    np.testing.assert_allclose(full, full[:, ::-1], atol=1e-6 * half.max())
    assert half_contact.approach_mm == pytest.approx(full_contact.approach_mm, rel=1e-7)


# --- what is known of the inverse of a compliance ----------------------------------------------------------------


@pytest.mark.parametrize("half", [True, False])
def test_the_stiffness_of_a_half_space_is_about_the_inverse_of_its_compliance(half):
    x, s = 0.2 * np.arange(0 if half else -40, 41), 0.15 * np.arange(-50, 51)
    nodes = ContactGrid(x_mm=x, s_mm=s, half=half)
    # of no net force, and nothing at the ends: what goes on beyond the grid does not count
    bump = np.exp(-((x[:, None] / 1.5) ** 2) - ((s - 0.4) / 1.1) ** 2)
    pressure = (bump * (1.0 - (x[:, None] / 1.5) ** 2 - ((s - 0.4) / 1.1) ** 2)).ravel()
    recovered = build_half_space_stiffness(nodes, MODULUS)(build_half_space_compliance(nodes, MODULUS)(pressure))
    np.testing.assert_allclose(recovered, pressure, atol=0.01 * pressure.max())


@pytest.mark.parametrize(("half", "rail", "count"), [(True, 300.0, 32), (False, 80.0, 16), (True, 13.0, 32)])
def test_a_preconditioned_contact_takes_less_than_half_of_the_applications(half, rail, count):
    x, s = grid(rail, count, half=half)
    gap = (0.5 / WHEEL * x[:, None] ** 2 + 0.5 / rail * s[None, :] ** 2).ravel()
    problem = build_half_space_problem(ContactGrid(x_mm=x, s_mm=s, half=half), gap, contact_modulus_MPa=MODULUS)
    guess = hertz(rail).pressure_MPa(1.05 * x[:, None], 0.97 * s[None, :]).ravel()
    exact = solve_contact(problem, LOAD, tolerance=1e-11).pressure_MPa
    preconditioned, plain = (
        solve_contact(variant, LOAD, start_MPa=guess, tolerance=1e-6)
        for variant in (problem, replace(problem, stiffness=None))
    )
    # 11, 12 and 19 for 33, 28 and 49
    assert preconditioned.compliance_calls < 0.45 * plain.compliance_calls
    # 1e-6 of the approach were up to 3e-4 of the peak before, on 36 nodes per semi-axis
    assert np.abs(preconditioned.pressure_MPa - exact).max() < 6e-5 * exact.max()


# --- the solution fulfils the problem ---------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_conditions_of_contact(seed):
    problem = rough_problem(seed)
    solution = solve_contact(problem, 20e3)
    p, gap = solution.pressure_MPa, solution.gap_mm
    assert solution.status == "converged"
    assert problem.load_N(p) == pytest.approx(20e3, rel=1e-8)
    assert solution.load_balance < 1e-8
    assert p.min() >= 0.0
    np.testing.assert_array_equal(solution.in_contact, p > 0.0)
    # recomputed from the answer: gap, no overlap, and no pressure across a gap, relative to the approach
    opened = problem.gap_mm + problem.compliance(p) - solution.approach_mm * problem.closing
    np.testing.assert_allclose(gap, opened, atol=1e-10 * solution.approach_mm)
    scale = solution.approach_mm
    assert np.abs(opened[p > 0]).max() < 1.1e-7 * scale
    assert opened.min() > -1.1e-7 * scale
    assert np.abs(p * opened).max() < 1.1e-7 * scale * p.max()
    assert solution.contact_residual == pytest.approx(np.abs(opened[p > 0]).max() / scale, rel=1e-3, abs=1e-10)
    # some nodes in contact, some not
    assert 10 < np.count_nonzero(p) < p.size - 10


@pytest.mark.parametrize("seed", range(4))
def test_a_held_approach_carries_the_load_that_leads_to_it(seed):
    problem = rough_problem(seed)
    loaded = solve_contact(problem, 20e3, tolerance=1e-10)
    prescribed = solve_contact(problem, None, approach_mm=loaded.approach_mm, tolerance=1e-10)
    assert (prescribed.status, prescribed.approach_mm) == ("converged", loaded.approach_mm)
    assert prescribed.residual < 2e-10
    np.testing.assert_allclose(prescribed.pressure_MPa, loaded.pressure_MPa, atol=1e-7 * loaded.pressure_MPa.max())
    cut_short = solve_contact(problem, None, approach_mm=loaded.approach_mm, tolerance=1e-10, iterations=9)
    assert (cut_short.status, cut_short.iterations) == ("not converged", 9)
    assert cut_short.residual > 1e-6
    # bodies that do not reach each other
    apart = solve_contact(problem, None, approach_mm=problem.gap_mm.min() - 0.1)
    assert (apart.status, apart.pressure_MPa.max(), apart.iterations) == ("converged", 0.0, 1)


@pytest.mark.parametrize("seed", range(3))
def test_dense_quadratic_programme_agrees(seed):
    x, s = np.linspace(-3.0, 3.0, 9), np.linspace(-2.0, 2.0, 7)
    rng = np.random.default_rng(seed)
    gap = x[:, None] ** 2 / 900.0 + s[None, :] ** 2 / 500.0 + rng.uniform(0.0, 0.01, (x.size, s.size))
    problem = uniform_problem(x, s, gap, half=False)
    problem = replace(problem, closing=rng.uniform(0.8, 1.0, gap.size))
    n = gap.size
    solution = solve_contact(problem, 8e3, tolerance=1e-10)
    # complementarity at the given approach is the quadratic programme min 1/2 p C p + (g - approach c) p over p >= 0;
    # with C = L L^T it is the least-squares problem |L^T p + L^-1 (g - approach c)|, solved by active sets
    matrix = np.array([problem.compliance(e) for e in np.eye(n)])
    matrix = 0.5 * (matrix + matrix.T)
    factor = np.linalg.cholesky(matrix)
    target = -np.linalg.solve(factor, problem.gap_mm - solution.approach_mm * problem.closing)
    reference, _ = nnls(factor.T, target, maxiter=10 * n)
    np.testing.assert_allclose(solution.pressure_MPa, reference, atol=1e-7 * reference.max())
    assert problem.load_N(reference) == pytest.approx(8e3, rel=1e-7)


def test_three_nodes_by_enumeration():
    matrix = np.array([[2.0, 0.5, 0.2], [0.5, 2.0, 0.5], [0.2, 0.5, 2.0]]) * 1e-5
    gap, area, load = np.array([0.0, 0.001, 0.004]), np.array([1.0, 1.0, 1.0]), 150.0
    solutions = []
    for mask in range(1, 8):
        active = np.array([bool(mask >> k & 1) for k in range(3)])
        # C p - approach = -gap on the active nodes, sum p = load
        system = np.block([[matrix[np.ix_(active, active)], -np.ones((active.sum(), 1))], [area[active], np.zeros(1)]])
        answer = np.linalg.solve(system, np.append(-gap[active], load))
        p = np.zeros(3)
        p[active] = answer[:-1]
        if np.all(p >= 0) and np.all((gap + matrix @ p - answer[-1])[~active] >= 0):
            solutions.append(p)
    assert len(solutions) == 1
    problem = ContactProblem(compliance=lambda p: matrix @ p, gap_mm=gap, closing=np.ones(3), area_mm2=area)
    solution = solve_contact(problem, load, tolerance=1e-13)
    np.testing.assert_allclose(solution.pressure_MPa, solutions[0], atol=1e-10 * load)
    assert np.count_nonzero(solutions[0]) == 2


# --- invariants -------------------------------------------------------------------------------------------------


def test_constant_gap_only_adds_to_the_approach():
    problem = rough_problem()
    base = solve_contact(problem, 20e3, tolerance=1e-9)
    # residuals are relative to the approach, so a far larger approach needs a smaller tolerance
    lifted = solve_contact(replace(problem, gap_mm=problem.gap_mm + 0.3), 20e3, tolerance=1e-10)
    np.testing.assert_allclose(lifted.pressure_MPa, base.pressure_MPa, atol=1e-7 * base.pressure_MPa.max())
    assert lifted.approach_mm - base.approach_mm == pytest.approx(0.3, abs=1e-9)


def test_start_does_not_matter():
    problem = rough_problem()
    base = solve_contact(problem, 20e3, tolerance=1e-9).pressure_MPa
    rng = np.random.default_rng(8)
    nowhere = np.zeros(base.size)
    starts = [np.ones(base.size), rng.uniform(0.0, 5.0, base.size), np.eye(base.size)[7], nowhere, base[::-1] - 10.0]
    for start in starts:
        restarted = solve_contact(problem, 20e3, start_MPa=start, tolerance=1e-9)
        assert restarted.status == "converged"
        np.testing.assert_allclose(restarted.pressure_MPa, base, atol=1e-7 * base.max())
    again = solve_contact(problem, 20e3, start_MPa=base, tolerance=1e-7)
    assert again.iterations == 1
    assert again.compliance_calls == 1


def test_scaling_lengths_and_load():
    x, s = grid(80.0, 6)
    gap = 0.5 / WHEEL * x[:, None] ** 2 + 0.5 / 80.0 * s[None, :] ** 2
    base = solve_contact(uniform_problem(x, s, gap, half=True), LOAD, tolerance=1e-9)
    scale = 2.5
    # all lengths (gap too) times 2.5, the load times 2.5^2: the same pressures
    scaled = solve_contact(
        uniform_problem(scale * x, scale * s, scale * gap, half=True), scale**2 * LOAD, tolerance=1e-9
    )
    np.testing.assert_allclose(scaled.pressure_MPa, base.pressure_MPa, atol=1e-7 * base.pressure_MPa.max())
    assert scaled.approach_mm == pytest.approx(scale * base.approach_mm, rel=1e-8)


def test_peak_grows_with_the_cube_root_of_the_load():
    loads = np.array([0.4, 0.7, 1.0]) * LOAD
    x, s = grid(300.0, 16)
    gap = 0.5 / WHEEL * x[:, None] ** 2 + 0.5 / 300.0 * s[None, :] ** 2
    problem = uniform_problem(x, s, gap, half=True)
    solutions = [solve_contact(problem, load) for load in loads]
    peak = np.polyfit(np.log(loads), np.log([q.pressure_MPa.max() for q in solutions]), 1)[0]
    approach = np.polyfit(np.log(loads), np.log([q.approach_mm for q in solutions]), 1)[0]
    # on one grid the patch has 12 to 16 nodes per semi-axis, where the peak is 0.05 % off
    assert peak == pytest.approx(1.0 / 3.0, abs=1e-3)
    assert approach == pytest.approx(2.0 / 3.0, abs=1e-3)


def test_mirrored_gap_mirrors_the_pressure():
    problem = rough_problem()
    shape = (25, 21)
    base = solve_contact(problem, 20e3, tolerance=1e-9).pressure_MPa.reshape(shape)
    mirrored = problem.gap_mm.reshape(shape)[::-1, ::-1].ravel()
    mirror_pressure = solve_contact(replace(problem, gap_mm=mirrored), 20e3, tolerance=1e-9).pressure_MPa.reshape(shape)
    np.testing.assert_allclose(mirror_pressure[::-1, ::-1], base, atol=1e-7 * base.max())


def test_tilted_normals_carry_the_load_along_the_approach():
    x, s = grid(300.0, 6)
    gap = 0.5 / WHEEL * x[:, None] ** 2 + 0.5 / 300.0 * s[None, :] ** 2
    upright = uniform_problem(x, s, gap, half=True)
    straight = solve_contact(upright, LOAD * math.cos(0.3), tolerance=1e-9)
    # all normals tilted by the same angle: the vertical load is the normal one times cos, the approach its inverse
    tilted = solve_contact(
        replace(upright, closing=np.full(gap.size, math.cos(0.3))), LOAD * math.cos(0.3) ** 2, tolerance=1e-9
    )
    np.testing.assert_allclose(tilted.pressure_MPa, straight.pressure_MPa, atol=1e-7 * straight.pressure_MPa.max())
    assert tilted.approach_mm == pytest.approx(straight.approach_mm / math.cos(0.3), rel=1e-8)


@pytest.mark.parametrize("iterations", [1, 2, 5])
def test_too_few_iterations_are_reported(iterations):
    solution = solve_contact(rough_problem(), 20e3, iterations=iterations)
    assert solution.status == "not converged"
    assert solution.iterations == iterations
    assert max(solution.contact_residual, solution.penetration_residual) > 1e-7
    # even then the load is held and no pressure is negative
    assert solution.load_balance < 1e-12
    assert solution.pressure_MPa.min() >= 0.0


def test_residuals_belong_to_the_returned_pressure():
    problem = rough_problem()
    for iterations in (1, 4, 9):
        q = solve_contact(problem, 20e3, iterations=iterations)
        gap = problem.gap_mm + problem.compliance(q.pressure_MPa) - q.approach_mm
        np.testing.assert_allclose(q.gap_mm, gap, atol=1e-12)
        active = q.in_contact
        assert q.contact_residual == pytest.approx(np.abs(gap[active]).max() / abs(q.approach_mm), rel=1e-6)


@pytest.mark.parametrize("unknowns", [1, 2, 4])
def test_mixed_solutions_of_a_linear_iteration_are_its_fixed_point(unknowns):
    """Mixing is exact with more steps than unknowns (Walker and Ni 2011).

    It needs a single step more than the number of unknowns, also for an iteration that grows.
    """
    rng = np.random.default_rng(unknowns)
    matrix, constant = 3.0 * rng.normal(size=(unknowns, unknowns)), rng.normal(size=unknowns)
    inputs = rng.normal(size=(unknowns + 1, unknowns))
    outputs = [matrix @ vector + constant for vector in inputs]
    fixed = np.linalg.solve(np.eye(unknowns) - matrix, constant)
    mixed = mix_solutions(outputs, [after - before for after, before in zip(outputs, inputs, strict=True)])
    np.testing.assert_allclose(mixed, fixed, rtol=1e-8, atol=1e-8)
    assert mix_solutions(outputs[:1], [outputs[0] - inputs[0]]) is outputs[0]


def test_coarse_nodes_lie_evenly_over_what_is_near():
    """Coarse nodes cover the near places evenly.

    A single place of the search lies beyond them on each side, in the middle of its interval.
    """
    x, y = np.linspace(-20.0, 20.0, 81), np.linspace(0.0, 10.0, 21)
    near = np.zeros((x.size, y.size), dtype=bool)
    near[21:34, :5] = True
    grid = _build_coarse_grid(x, y, near)
    assert float(grid.s_mm.mean()) == pytest.approx(0.5 * (x[21] + x[33]), abs=1e-9)
    assert np.ptp(grid.s_mm) >= x[34] - x[20]
    assert grid.x_mm[-1] >= y[5]


def test_directions_stay_conjugate_at_a_prescribed_approach():
    """30 iterations, compared with 34 under the load of this contact; steepest descent takes 218."""
    grid = ContactGrid(x_mm=0.1 * np.arange(30.0), s_mm=0.1 * (np.arange(59.0) - 29.0), half=True)
    gap = (grid.x_mm[:, None] ** 2 + grid.s_mm**2).ravel() / 600.0
    problem = build_half_space_problem(grid, gap, contact_modulus_MPa=MODULUS)
    loaded = solve_contact(problem, 3e3, tolerance=1e-8)
    prescribed = solve_contact(problem, None, approach_mm=loaded.approach_mm, tolerance=1e-8)
    assert (loaded.status, prescribed.status) == ("converged", "converged")
    assert prescribed.iterations <= 1.5 * loaded.iterations


def test_a_guess_keeps_pressure_and_loses_what_interpolation_rounds():
    # a billionth of the peak is more than rounding leaves beside a contact, and less than any pressure in it
    np.testing.assert_array_equal(_clean_start(np.array([-3.0, 0.9e-6, 1.1e-6, 1e3])), [0.0, 0.0, 1.1e-6, 1e3])


def test_what_solvers_leave_is_far_below_any_error_of_a_mesh():
    contact, exact = solve_contact(rough_problem(), LOAD), solve_contact(rough_problem(), LOAD, tolerance=1e-12)
    assert max(contact.contact_residual, contact.penetration_residual) <= 1e-7
    assert np.abs(contact.pressure_MPa - exact.pressure_MPa).max() < 1e-5 * exact.pressure_MPa.max()
