"""Pressure nodes in bands of different widths, for patches far apart.

Tests of the half-space, of the readings and of the places between bands.
"""

from dataclasses import replace

import numpy as np
import pytest
from rungs import rung_with

from fecontact.case import Case
from fecontact.contact import halfspace
from fecontact.contact.grid import ContactGrid, Field, _grow_cells, build_banded_grid, calculate_misplaced_load
from fecontact.contact.halfspace import build_half_space_compliance, build_half_space_problem
from fecontact.contact.patch import measure_patch
from fecontact.contact.solver import inner_product, solve_contact
from fecontact.contact_theories.approximation import (
    CellPressure,
    average_pressure_over_cells,
    patch_from_ellipse,
    theory_contact_from_rung,
)
from fecontact.contact_theories.hertz import hertz_from_hessian
from fecontact.judging.measures import read_measures
from fecontact.solving import expected_patch
from fecontact.solving.meshes import make_covering_grid
from fecontact.solving.position import expect_on_half_space

MODULUS_MPa = 115e3
STEP_MM = 0.05


def x_nodes(half):
    return 0.1 * np.arange(40) if half else 0.1 * (np.arange(79) - 39)


def test_cells_between_bands_grow_by_two_fifths_from_both_and_none_is_left_out():
    # computed by hand: the smaller of the two next cells is added first
    expected = np.cumsum([0.0, 1.4, 1.4**2, 1.4**3, 1.4**4])
    assert _grow_cells(0.0, 20.0, 1.0, 2.0) == pytest.approx([*expected, 20.0 - 2.8, 20.0])
    for length, first, last in ((300.0, 1.0, 1.1), (57.0, 0.3, 4.0), (3.0, 1.0, 2.0)):
        ends, mirrored = _grow_cells(5.0, 5.0 + length, first, last), _grow_cells(0.0, length, last, first)
        assert ends - 5.0 == pytest.approx(length - mirrored[::-1])
        widths = np.array([first, *np.diff(ends), last])
        steps = widths[1:] / widths[:-1]
        # all cells except the middle cell, which fills the remaining width
        middle = int(np.argmax(widths))
        assert steps[: middle - 1] == pytest.approx(1.4)
        assert steps[middle + 1 :] == pytest.approx(1.0 / 1.4)
        assert widths[middle] <= 1.4 * (widths[middle - 1] + widths[middle + 1]) + 1e-9


def columns(between):
    """Columns of three bands (narrow, wide, narrow) on a line of equal steps."""
    first, second = 30, 120
    return np.concatenate(
        [
            np.arange(first),
            first + between + np.arange(second),
            first + second + 2 * between + np.arange(first),
        ]
    )


def grid_and_bands(half, between=40, width=STEP_MM):
    """A grid of equal steps, and its columns in three bands."""
    columns_of_bands = columns(between)
    s = STEP_MM * np.arange(columns_of_bands[-1] + 1) - 3.0
    grid = ContactGrid(x_mm=x_nodes(half), s_mm=s, half=half)
    return (
        grid,
        replace(grid, s_mm=s[columns_of_bands], widths_mm=np.full(columns_of_bands.size, width)),
        columns_of_bands,
    )


@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize("between", [15, 40, 400])
@pytest.mark.parametrize("has_turned_normals", [False, True])
def test_bands_open_as_one_grid_does(half, between, has_turned_normals):
    """As far as the polynomials between them go; the bands lie an eighth of their width apart, and more."""
    grid, bands, columns_of_bands = grid_and_bands(half, between)
    assert [band.s_mm.size for band in bands.bands] == [30, 120, 30]
    angle = 0.02 * grid.s_mm if has_turned_normals else None
    pressure = np.zeros(grid.shape)
    pressure[:, columns_of_bands] = np.random.default_rng(3).uniform(size=bands.shape)
    gap_on_grid = build_half_space_compliance(grid, MODULUS_MPa, angle)(pressure.ravel()).reshape(grid.shape)[
        :, columns_of_bands
    ]
    gap_on_bands = build_half_space_compliance(bands, MODULUS_MPa, angle if angle is None else angle[columns_of_bands])(
        pressure[:, columns_of_bands].ravel()
    )
    assert np.abs(gap_on_bands.reshape(bands.shape) - gap_on_grid).max() <= 1e-10 * gap_on_grid.max()


def test_too_few_places_between_bands_are_seen(monkeypatch):
    monkeypatch.setattr(halfspace, "_INVERSE_INTERPOLATION_ERROR", 10.0)
    with pytest.raises(AssertionError):
        test_bands_open_as_one_grid_does(False, 15, False)


def three_bands(half=False):
    """Three bands with steps of 1, 3 and 2 times the smallest step."""
    x = x_nodes(half)
    lines = [STEP_MM * k * np.arange(n) + s for k, n, s in ((1, 30, -3.0), (3, 60, 0.0), (2, 30, 12.0))]
    return build_banded_grid(x, lines, half=half)


@pytest.mark.parametrize("has_turned_normals", [False, True])
def test_bands_of_unequal_steps_are_symmetric_and_positive(has_turned_normals):
    grid, rng = three_bands(), np.random.default_rng(5)
    compliance = build_half_space_compliance(grid, MODULUS_MPa, 0.02 * grid.s_mm if has_turned_normals else None)
    area = grid.whole_area_mm2()
    for _ in range(3):
        p, q = rng.normal(size=(2, *grid.shape))
        # only where nodes have complete cells
        p[[0, -1]] = q[[0, -1]] = 0.0
        p, q = p.ravel(), q.ravel()
        assert inner_product(area * p, compliance(q)) == pytest.approx(
            inner_product(area * q, compliance(p)), rel=1e-9, abs=1e-9
        )
        assert inner_product(area * p, compliance(p)) > 0.0


def test_a_force_on_a_wide_cell_opens_another_band_as_point_forces_do():
    """Of each force in the middle of its cell: 6 mm away a cell of 0.1 mm by 0.15 mm is a point but for 1e-4."""
    grid = three_bands()
    pressure = np.zeros(grid.shape)
    i, j = 39, 60
    pressure[i, j] = 100.0
    opening = build_half_space_compliance(grid, MODULUS_MPa)(pressure.ravel()).reshape(grid.shape)
    force = 100.0 * grid.nodal_area_mm2().reshape(grid.shape)[i, j]
    is_far = grid.s_mm > 11.0
    away = np.hypot(grid.x_mm[:, None] - grid.x_mm[i], grid.s_mm[is_far] - grid.s_mm[j])
    np.testing.assert_allclose(opening[:, is_far], force / (np.pi * MODULUS_MPa * away), rtol=1e-4)


def test_bands_that_come_together_are_one_grid():
    x = x_nodes(True)
    near = build_banded_grid(x, [0.1 * np.arange(20), 2.0 + 0.2 * np.arange(20)], half=True)
    assert near.widths_mm is None
    np.testing.assert_allclose(np.diff(near.s_mm), 0.1)
    assert near.s_mm[-1] == pytest.approx(5.8)


@pytest.mark.parametrize(("apart", "bands"), [(3.9, 1), (4.1, 2)])
def test_bands_lie_four_of_both_their_steps_apart(apart, bands):
    # closer bands leave no room for cells that grow on both sides, by a factor of 1.4 per cell
    first = 0.1 * np.arange(20)
    grid = build_banded_grid(x_nodes(True), [first, first[-1] + 0.3 * apart + 0.2 * np.arange(20)], half=True)
    assert (1 if grid.widths_mm is None else 2) == bands


def ellipsoids(grid, patches):
    """Pressure (nx, ns) of ellipsoidal patches, averaged over the cells of the nodes.

    Each patch is (middle, a, b, peak).
    """
    x, pressure = grid.x_mm[:, None], np.zeros(grid.shape)
    for middle, a, b, peak in patches:
        places = (np.arange(9) - 4.0) / 9.0
        for place in places:
            s = grid.s_mm + place * grid.cells_mm
            pressure += peak / 9.0 * np.sqrt(np.maximum(1.0 - (x / a) ** 2 - ((s - middle) / b) ** 2, 0.0))
    return pressure


PATCHES = ((-2.25, 1.4, 0.4, 900.0), (4.4, 3.0, 3.6, 700.0), (13.4, 2.0, 0.9, 300.0))


@pytest.mark.parametrize("half", [True, False])
def test_patches_on_bands_are_measured_as_they_are(half):
    grid = three_bands(half)
    assert [band.steps_mm[1] for band in grid.bands] == pytest.approx([0.05, 0.15, 0.1])
    measured = measure_patch(Field(grid=grid, values=ellipsoids(grid, PATCHES)))
    force = np.array([2.0 / 3.0 * np.pi * a * b * peak for _, a, b, peak in PATCHES])
    middle, b = np.array([patch[0] for patch in PATCHES]), np.array([patch[2] for patch in PATCHES])
    centre = force @ middle / force.sum()
    assert measured.centre_y_mm == pytest.approx(centre, abs=2e-3)
    spread = force @ ((middle - centre) ** 2 + b**2 / 5.0) / force.sum()
    assert measured.b_mm == pytest.approx(np.sqrt(5.0 * spread), rel=1e-3)
    assert measured.area_mm2 == pytest.approx(sum(np.pi * a * b for _, a, b, _ in PATCHES), rel=5e-3)
    assert measured.p_max_MPa == pytest.approx(900.0, rel=3e-3)
    assert measured.extent_y_mm == pytest.approx(13.4 + 0.9 + 2.25 + 0.4, rel=2e-3)
    assert (measured.patch_count, len(measured.lobes)) == (3, 3)
    assert measured.separate_load == pytest.approx(1.0 - force.max() / force.sum(), rel=3e-3)
    shares = [lobe.force_share for lobe in sorted(measured.lobes, key=lambda lobe: lobe.y_mm)]
    np.testing.assert_allclose(shares, force / force.sum(), rtol=4e-3)


def test_a_contact_on_bands_is_a_theory_of_itself():
    """Pressures of cells, forces, and a theory with a patch between the nodes."""
    grid = three_bands()
    rung = rung_with(grid, ellipsoids(grid, PATCHES))
    theory = theory_contact_from_rung(rung)
    assert theory.normal_force_N == pytest.approx(rung.normal_force_N, rel=1e-12)
    pressure, again, weights = theory.beside(rung)
    np.testing.assert_allclose(again, pressure, atol=1e-9)
    assert (pressure * weights).sum() * np.diff(grid.x_mm)[0] * STEP_MM == pytest.approx(rung.normal_force_N, rel=1e-9)
    # this patch is in the strip from 8.925 to 11.95 mm, which has no nodes
    hertz = hertz_from_hessian(np.diag([0.01, 0.05]), normal_force_N=3e3, contact_modulus_MPa=MODULUS_MPa)
    elsewhere = replace(theory, patches=(patch_from_ellipse(hertz, (0.0, 10.4)),))
    _, between, weights = elsewhere.beside(rung)
    assert (between * weights).sum() * np.diff(grid.x_mm)[0] * STEP_MM == pytest.approx(3e3, rel=0.02)


def test_theories_are_read_where_their_patches_are_to_the_last_bit():
    """Not all over the grid, where they have no pressure."""
    grid = three_bands()
    hertz = hertz_from_hessian(np.diag([0.01, 0.02]), normal_force_N=2e3, contact_modulus_MPa=MODULUS_MPa)
    theory = theory_contact_from_rung(rung_with(grid, ellipsoids(grid, PATCHES)))
    for patch in (patch_from_ellipse(hertz, (0.0, 4.0)), *theory.patches):
        offset = (0.123, -0.077)
        origin = tuple(at + step for at, step in zip(patch.origin_mm, offset, strict=True))
        np.testing.assert_array_equal(
            replace(theory, patches=(patch,)).on(grid, offset), average_pressure_over_cells(grid, patch.shape, origin)
        )


def test_a_node_has_its_own_cell_and_strips_have_none():
    grid = three_bands()
    cells = CellPressure(field=Field(grid=grid, values=np.ones(grid.shape)))
    s = np.array([-3.024, -3.026, -1.5, 0.07, 8.92, 8.93, 11.94, 11.96])
    np.testing.assert_array_equal(cells.pressure_MPa(np.array([0.0]), s), [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0])


def test_outputs_have_equal_steps_with_the_same_force():
    grid = three_bands()
    rung = rung_with(grid, ellipsoids(grid, PATCHES))
    even = rung.even()
    assert even.grid.widths_mm is None
    assert float(even.grid.whole_area_mm2() @ even.pressure_MPa.ravel()) == pytest.approx(rung.normal_force_N, rel=1e-9)
    nodes = np.rint((grid.s_mm - grid.s_mm[0]) / STEP_MM).astype(int)
    np.testing.assert_allclose(even.pressure_MPa[:, nodes], rung.pressure_MPa, rtol=1e-9, atol=1e-7)
    # strips between bands carry no pressure
    # (measured 0.005, compared with 0.002 on equal steps; at least 0.1 if the cell of a strip belongs to a band)
    assert calculate_misplaced_load(even, rung) < 8e-3


def two_bodies(grid, narrower=1.0):
    """Contact of two bumps far apart; the second bump is narrow."""
    x, s = grid.x_mm[:, None], grid.s_mm[None, :]
    wide, narrow = s**2 / 600.0, 0.004 + narrower**2 * (s - 12.0) ** 2 / 40.0
    gap_mm = (x**2 / 900.0 + np.minimum(wide, narrow)).ravel()
    return build_half_space_problem(grid, gap_mm, contact_modulus_MPa=MODULUS_MPa)


def solve_two_bodies(problem):
    solution = solve_contact(problem, 6e3, tolerance=1e-9)
    assert solution.status == "converged"
    return solution


def test_the_contact_on_bands_is_the_one_on_a_grid():
    """Equal nodes give equal pressures, to the solver's tolerance."""
    full_grid = ContactGrid(x_mm=0.12 * np.arange(45), s_mm=0.08 * np.arange(-60, 176), half=True)
    columns_of_bands = np.r_[0:121, 195:226]
    bands = replace(full_grid, s_mm=full_grid.s_mm[columns_of_bands], widths_mm=np.full(columns_of_bands.size, 0.08))
    pressure_on_grid, pressure_on_bands = (
        solve_two_bodies(two_bodies(grid)).pressure_MPa.reshape(grid.shape) for grid in (full_grid, bands)
    )
    np.testing.assert_allclose(
        pressure_on_bands, pressure_on_grid[:, columns_of_bands], atol=1e-7 * pressure_on_grid.max()
    )
    assert pressure_on_grid.sum() == pytest.approx(pressure_on_grid[:, columns_of_bands].sum(), rel=1e-12)


def test_a_narrow_patch_on_nodes_of_its_own_costs_no_iterations():
    """Iterations: 22 as on equal nodes, and 117 without the stiffness of the nodes.

    The pressure is the same.
    """
    lines = [0.08 * np.arange(-60, 61), 12.0 + 0.01 * np.arange(-16, 17)]
    problem = two_bodies(build_banded_grid(0.12 * np.arange(45), lines, half=True), narrower=8.0)
    solution, plain = solve_two_bodies(problem), solve_two_bodies(replace(problem, stiffness=None))
    assert solution.iterations < 25 < 110 < plain.iterations
    np.testing.assert_allclose(solution.pressure_MPa, plain.pressure_MPa, atol=1e-6 * plain.pressure_MPa.max())
    at_approach = solve_contact(problem, None, approach_mm=plain.approach_mm, tolerance=1e-9)
    np.testing.assert_allclose(at_approach.pressure_MPa, plain.pressure_MPa, atol=1e-6 * plain.pressure_MPa.max())


FAR_APART = Case(lateral_shift_mm=5.0, load_N=50e3)


def test_patches_far_apart_are_solved_in_bands_as_on_one_grid(monkeypatch):
    """Gauge corner and head of S1002 on 60E1: a third of the nodes suffices.

    All measures agree within the error of reading.
    """
    _, bands = expect_on_half_space(FAR_APART)
    monkeypatch.setattr(expected_patch, "_SINGLE_BAND_FRACTION", np.inf)
    _, single_grid = expect_on_half_space(FAR_APART)
    assert (len(bands.half_space.grid.bands), len(single_grid.half_space.grid.bands)) == (2, 1)
    assert bands.half_space.grid.s_mm.size < 0.4 * single_grid.half_space.grid.s_mm.size
    measures, measures_on_grid = (read_measures(expected.half_space).as_dict() for expected in (bands, single_grid))
    # other nodes change the area by 5.6e-4; the error of reading the area is 2.5e-3
    for name, limit in {"p_max_MPa": 6e-5, "area_mm2": 1e-3, "a_mm": 1e-4, "b_mm": 1e-5, "extent_x_mm": 3e-3}.items():
        assert measures[name] == pytest.approx(measures_on_grid[name], rel=limit)


def test_a_narrow_patch_far_away_has_all_of_its_nodes(monkeypatch):
    """A single grid over both patches would be too large, and its nodes too few."""
    step = expect_on_half_space(FAR_APART)[1].half_space.grid.steps_mm[1]
    monkeypatch.setattr(expected_patch, "MOST_NODES", 10_000)
    assert expect_on_half_space(FAR_APART)[1].half_space.grid.steps_mm[1] == pytest.approx(step)
    monkeypatch.setattr(expected_patch, "_SINGLE_BAND_FRACTION", np.inf)
    assert expect_on_half_space(FAR_APART)[1].half_space.grid.steps_mm[1] > 1.2 * step


def test_a_contact_between_bands_is_seen():
    """With the patch in the middle taken out, the bodies overlap where it was."""
    _, expected = expect_on_half_space(FAR_APART)
    gap, rung = expected.true_gap, expected.half_space
    assert not gap.overlaps_between(rung)
    # with this approach, the bodies overlap between the bands, where no pressure acts
    assert gap.overlaps_between(replace(rung, approach_mm=3.0 * rung.approach_mm))


def test_bands_follow_what_elements_carry_beside_them():
    grid = three_bands()
    coarse = ContactGrid(x_mm=0.5 * np.arange(-8, 9), s_mm=np.asarray(0.5 * np.arange(-8, 36)), half=False)
    pressure = np.zeros(coarse.shape)
    pressure[6:11, (coarse.s_mm > -2.6) & (coarse.s_mm < -1.9)] = 1.0
    pressure[6:11, (coarse.s_mm > 12.4) & (coarse.s_mm < 16.1)] = 1.0
    over = make_covering_grid(grid, rung_with(coarse, pressure))
    ends = [(band.s_mm[0], band.s_mm[-1]) for band in over.bands]
    # a band extends by at most its width, ends two elements beyond the contact, and continues the places of its nodes
    np.testing.assert_allclose(ends, [(-3.5, -1.05), (0.0, 8.85), (11.5, 17.0)], atol=0.11)
    for band, before in zip(over.bands, grid.bands, strict=True):
        assert band.steps_mm[1] == pytest.approx(before.steps_mm[1])
        steps = (band.s_mm - before.s_mm[0]) / before.steps_mm[1]
        np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
