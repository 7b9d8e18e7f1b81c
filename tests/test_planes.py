"""Patches at different contact angles, each on a separate half-space.

Each patch also presses on the half-spaces of the other patches, along its normal.
"""

from dataclasses import replace
from functools import cache
from math import atan

import numpy as np
import pytest
from rungs import on_half_space

from fecontact.bodies import Material, combine_moduli_MPa
from fecontact.case import Case
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import build_half_space_compliance, love_influence, project_on_normals
from fecontact.contact.solver import ContactProblem, solve_contact
from fecontact.judging.judge import judge_load
from fecontact.judging.lobes import split_lobes
from fecontact.judging.measures import read_measures
from fecontact.solving.meshes import _solve_with_turned_normals
from fecontact.solving.plane_angles import compute_normal_angles, compute_plane_angles
from fecontact.solving.position import expect_position

STEEL = Material(young_MPa=210e3, poisson=0.28)
ALUMINIUM = Material(young_MPa=70e3, poisson=0.33)
# The gauge corner (17 degrees) and the top of the head (8 degrees) touch; the corner is the first contact.
UIC60 = Case(
    rail="MBench_UIC60",
    inclination_rad=atan(1 / 40),
    lateral_shift_mm=5.0,
    roll_rad=0.362e-3,
    load_N=50e3,
    resolution="quick",
    refine="never",
)
RAILS = [UIC60.rail, pytest.param("60E1", marks=pytest.mark.slow)]


@cache
def place_on(rail):
    """Two patches on a rail, before any finite element."""
    return expect_position(replace(UIC60, rail=rail, roll_rad=UIC60.roll_rad if rail == UIC60.rail else 0.0))


@cache
def solve_in_one_plane(rail):
    """Solve the contact with all normals parallel."""
    rung = place_on(rail).expected.half_space
    return place_on(rail).true_gap.solve(rung.grid, UIC60.load_N, start=rung.pressure)


# --- the compliance ---------------------------------------------------------------------------------------------


def relative_displacement(offset_mm, materials):
    """Relative displacement (3,) of the upper and the lower surface under 1 N between them.

    The force acts along z, at the distance (x, y).

    Boussinesq's displacements of a surface for each body: (1 - nu^2) / (pi E r) along the force, and towards it
    (1 + nu) (1 - 2 nu) / (2 pi E r) (Johnson 1985, eq. 3.18).
    """
    x, y = offset_mm
    r = np.hypot(x, y)
    displacements = []
    for material, along in zip(materials, (-1.0, 1.0), strict=True):
        young, nu = material.young_MPa, material.poisson
        towards = (1 + nu) * (1 - 2 * nu) / (2 * np.pi * young * r)
        displacements.append(np.array([-towards * x / r, -towards * y / r, along * (1 - nu**2) / (np.pi * young * r)]))
    return displacements[1] - displacements[0]


@pytest.mark.parametrize("offset_x", [0.0, 7.0])
@pytest.mark.parametrize("angle", [0.0, 0.16, 1.0])
def test_a_far_force_opens_as_boussinesq_says(angle, offset_x):
    """Opening along the normal of a patch 12 mm away.

    The plane of the patch is at an angle. The patch may also be displaced along x. Both bodies contribute.
    """
    step = 0.1
    grid = ContactGrid(x_mm=step * np.arange(-75, 76), s_mm=step * np.arange(-62, 63), half=False)
    pressed, far_node = (75, 1), (75 + round(offset_x / step), 121)
    angles = np.tile(np.where(grid.s_mm < 0.0, 0.3, 0.3 + angle), grid.shape[0])
    pressure = np.zeros(grid.shape)
    pressure[pressed] = 1.0 / step**2

    def opening(materials):
        compliance = project_on_normals(build_half_space_compliance(grid, combine_moduli_MPa(*materials)), angles)
        return compliance(pressure.ravel()).reshape(grid.shape)[far_node]

    normal = np.array([0.0, -np.sin(angle), np.cos(angle)])
    # the cell is 0.1 mm wide and 12 mm away: relative error (h / r)^2 / 12
    steel = relative_displacement((offset_x, 12.0), (STEEL, STEEL))
    assert opening((STEEL, STEEL)) == pytest.approx(steel @ normal, rel=1e-5)
    # different materials: Dundurs' second constant times the sine of the direction between the patches is left out
    terms = [((1 - 2 * m.poisson) / m.shear_MPa, (1 - m.poisson) / m.shear_MPa) for m in (STEEL, ALUMINIUM)]
    beta = (terms[0][0] - terms[1][0]) / (2.0 * (terms[0][1] + terms[1][1]))
    assert abs(beta) > 0.1
    unlike = relative_displacement((offset_x, 12.0), (STEEL, ALUMINIUM))
    left_out = beta * np.sin(angle) * 12.0 / np.hypot(offset_x, 12.0) * unlike[2]
    assert opening((STEEL, ALUMINIUM)) == pytest.approx(unlike @ normal + left_out, rel=1e-5)


def test_a_circle_in_a_circle_opens_as_michell_says():
    """Disc in a hole under a pressure cos(n t), in plane strain.

    Both have the same radius and material. The logarithm of the chord, along the normals of each place, agrees with the
    exact solutions of disc and hole, except for the rigid motion (n = 1) and the uniform motion (n = 0). Stresses and
    displacements of Michell's functions: Barber (2010), tables 8.1 and 9.1.
    """
    count, nu, shear = 4096, 0.28, 82e3
    kappa = 3.0 - 4.0 * nu
    turn = 2.0 * np.pi * np.arange(count) / count
    # -ln(2 sin(t / 2)) is the sum of cos(k t) / k
    waves = np.fft.rfftfreq(count, 1.0 / count)
    of_log = np.divide(np.pi, waves, out=np.zeros_like(waves), where=waves > 0.0)

    def chords(pressure):
        # displacement by a line load, with 1 / E* of both bodies: 2 / (pi E*) times the logarithm
        return 2.0 * (1.0 - nu) / (np.pi * shear) * np.fft.irfft(np.fft.rfft(pressure) * of_log, count)

    for n in (2, 3, 7, 40):
        disc = np.linalg.solve(
            [[-n * (n - 1), -(n + 1) * (n - 2)], [n * (n - 1), n * (n + 1)]], [-1.0, 0.0]
        ) @ [-n, kappa - n - 1]  # fmt: skip
        hole = np.linalg.solve(
            [[-n * (n + 1), -(n + 2) * (n - 1)], [-n * (n + 1), -n * (n - 1)]], [-1.0, 0.0]
        ) @ [n, kappa + n - 1]  # fmt: skip
        exact = (hole - disc) / (2.0 * shear) * np.cos(n * turn)
        np.testing.assert_allclose(project_on_normals(chords, turn)(np.cos(n * turn)), exact, atol=1e-12 * exact[0])


def test_equal_planes_are_one_plane():
    grid = ContactGrid(x_mm=0.2 * np.arange(12), s_mm=0.3 * np.arange(-20, 21), half=True)
    compliance, pressure = build_half_space_compliance(grid, 115e3), np.random.default_rng(4).uniform(size=12 * 41)
    for angle in (0.0, 0.3, 1.2):
        compliance_along_normals = project_on_normals(compliance, np.full(pressure.size, angle))
        np.testing.assert_allclose(compliance_along_normals(pressure), compliance(pressure), rtol=1e-12)


def test_it_is_symmetric_and_positive():
    """Whatever the angles: contacts are found by conjugate gradients."""
    grid = ContactGrid(x_mm=0.2 * np.arange(-6, 7), s_mm=0.3 * np.arange(-9, 10), half=False)
    rng = np.random.default_rng(5)
    compliance = project_on_normals(build_half_space_compliance(grid, 115e3), rng.uniform(-1.5, 1.5, 13 * 19))
    matrix = np.stack([compliance(unit) for unit in np.eye(13 * 19)])
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * matrix.max())
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > 0.0


# --- the rung ---------------------------------------------------------------------------------------------------


def test_each_patch_has_the_plane_of_its_force():
    position = place_on(UIC60.rail)
    rung, placement = position.expected.half_space, position.placement
    angle = compute_plane_angles(placement, rung)
    corner, head = position.expected.parts
    for patch, degrees in ((corner, 17.1), (head, 7.7)):
        is_in_patch = (rung.grid.s_mm >= patch.s_low_mm) & (rung.grid.s_mm <= patch.s_high_mm)
        assert np.ptp(angle[is_in_patch]) == 0.0
        assert np.degrees(angle[is_in_patch][0]) == pytest.approx(degrees, abs=0.1)
        normals = compute_normal_angles(placement, rung.grid.s_mm[is_in_patch])
        assert normals.min() < angle[is_in_patch][0] < normals.max()
    middle = 0.5 * (corner.s_high_mm + head.s_low_mm)
    assert np.array_equal(angle == angle[0], rung.grid.s_mm < middle)


def test_one_patch_has_one_plane():
    """The plane of a single patch is constant to the last bit.

    A single lobe has no normals to turn.
    """
    position = expect_position(Case(lateral_shift_mm=-4.0, roll="given", resolution="quick"))
    rung = position.expected.half_space
    assert np.ptp(compute_plane_angles(position.placement, rung)) == 0.0
    assert _solve_with_turned_normals(position) is None
    again = position.true_gap.solve(rung.grid, position.case.load_N, start=rung.pressure)
    np.testing.assert_allclose(again.pressure_MPa, rung.pressure_MPa, atol=1e-5 * rung.pressure_MPa.max())


def test_planes_from_coarser_nodes_are_those_of_the_contact_that_is_found():
    """The contact stays as it is in its planes, and changes in a common plane."""
    true_gap, rung = place_on(UIC60.rail).true_gap, place_on(UIC60.rail).expected.half_space
    angle = compute_plane_angles(true_gap.placement, rung)
    again = true_gap.solve(rung.grid, UIC60.load_N, angle_rad=angle)
    peak = rung.pressure_MPa.max()
    assert np.abs(again.pressure_MPa - rung.pressure_MPa).max() < 3e-5 * peak
    assert np.abs(solve_in_one_plane(UIC60.rail).pressure_MPa - rung.pressure_MPa).max() > 0.005 * peak
    # the pressure is not cut off at the edge of the grid
    assert not rung.pressure_MPa[:, [0, -1]].any()
    assert not rung.pressure_MPa[-1].any()


COARSER = 6


def loads_by_matrix(position, angle_of, *, chords):
    """Force and peak of both patches by a matrix between all nodes.

    Mean over coarse grids that are displaced by a node. On a single coarse grid, the peak of the small patch differs
    from this mean by up to 6e-4.
    """
    return np.mean([_loads_on_coarse_grid(position, angle_of, k, chords=chords) for k in range(COARSER)], axis=0)


def _loads_on_coarse_grid(position, angle_of, first, *, chords):
    """Force and peak on a coarse grid, from distances and angles of node pairs.

    The grid begins at the node `first`.
    """
    rung, gap, placement = position.expected.half_space.even(), position.true_gap, position.placement
    grid = ContactGrid(x_mm=rung.grid.x_mm[::4], s_mm=rung.grid.s_mm[first::COARSER], half=True)
    (step_x, step_s), rows = grid.steps_mm, grid.x_mm.size
    points, normals = placement.surface(0.0, grid.s_mm)
    away = np.abs(grid.s_mm[:, None] - grid.s_mm)
    if chords:
        away = np.linalg.norm(points[:, None] - points, axis=-1)
    angle = angle_of(grid.s_mm)
    x = step_x * np.arange(2 * rows - 1)[:, None, None]
    kernel = love_influence(x, away, step_x, step_s) / (np.pi * gap.contact_modulus_MPa)
    kernel *= np.cos(angle[:, None] - angle)
    i = np.arange(rows)
    # the mirrored pressure acts too, except for the row on the plane of symmetry
    matrix = kernel[np.abs(i[:, None] - i)] + np.where((i > 0)[:, None, None], kernel[i[:, None] + i], 0.0)
    matrix = matrix.transpose(0, 2, 1, 3).reshape(grid.nodal_area_mm2().size, -1)
    area = grid.whole_area_mm2()
    problem = ContactProblem(
        compliance=lambda pressure: matrix @ pressure,
        gap_mm=gap.on(grid).ravel(),
        closing=np.tile(normals @ gap.direction, rows),
        area_mm2=area,
    )
    pressure = solve_contact(problem, position.case.load_N, tolerance=1e-6).pressure_MPa.reshape(grid.shape)
    corner, head = position.expected.parts
    first = grid.s_mm < 0.5 * (corner.s_high_mm + head.s_low_mm)
    force = area.reshape(grid.shape) * pressure
    return np.array([[force[:, is_in_patch].sum(), pressure[:, is_in_patch].max()] for is_in_patch in (first, ~first)])


def read_patches(rung):
    return np.array([[patch.normal_force_N, patch.rung.pressure_MPa.max()] for patch in split_lobes(rung)])


@pytest.mark.parametrize("rail", RAILS)
def test_planes_and_normals_move_what_a_matrix_between_all_nodes_says(rail):
    """Changes from a single plane to a plane per patch, and to normals per node.

    The effect of chords is checked too.
    """
    position, rung = place_on(rail), place_on(rail).expected.half_space
    corner, head = position.expected.parts
    middle = 0.5 * (corner.s_high_mm + head.s_low_mm)
    planes = np.unique(compute_plane_angles(position.placement, rung))[::-1]

    def patch_angles(s):
        return np.where(s < middle, *planes)

    def node_angles(s):
        return compute_normal_angles(position.placement, s)

    in_one_plane = loads_by_matrix(position, np.zeros_like, chords=False)
    on_planes, along_nodes = (loads_by_matrix(position, angle, chords=False) for angle in (patch_angles, node_angles))
    np.testing.assert_allclose(
        read_patches(rung) / read_patches(solve_in_one_plane(rail)), on_planes / in_one_plane, atol=1e-4
    )
    np.testing.assert_allclose(
        read_patches(_solve_with_turned_normals(position)) / read_patches(rung), along_nodes / on_planes, atol=1e-4
    )
    # measured 0.04 % of the small patch's force and 0.01 % of its peak
    on_chords = loads_by_matrix(position, node_angles, chords=True)
    np.testing.assert_allclose(on_chords, along_nodes, rtol=6e-4)


@pytest.mark.parametrize(
    ("rail", "forces", "peaks"),
    [
        (UIC60.rail, (-0.0006, 0.0009), (-0.0002, 0.0000)),
        pytest.param("60E1", (0.0081, -0.0010), (0.0028, -0.0004), marks=pytest.mark.slow),
    ],
)
def test_what_planes_move(rail, forces, peaks):
    """Forces and peaks at the gauge corner and on the head: 9 and 10 degrees between both planes."""
    changes = read_patches(place_on(rail).expected.half_space) / read_patches(solve_in_one_plane(rail)) - 1.0
    np.testing.assert_allclose(changes.T, [forces, peaks], atol=1e-4)


def test_what_turned_normals_move_is_uncertain():
    """A part of the step from the half-space to the bodies, and of nothing else."""
    position = place_on(UIC60.rail)
    rung, turned_rung = position.expected.half_space, _solve_with_turned_normals(position)
    plain = on_half_space(UIC60, position.placement, rung)
    alone, with_turned = (
        judge_load(solved_load, position.placement) for solved_load in (plain, replace(plain, turned=turned_rung))
    )
    assert with_turned.uncertainty == alone.uncertainty
    assert with_turned.ladder == alone.ladder
    changes = {k: v / read_measures(rung).as_dict()[k] - 1.0 for k, v in read_measures(turned_rung).as_dict().items()}
    # the peak is on the corner, where the normals turn by 7 degrees
    assert changes["p_max_MPa"] == pytest.approx(-0.0017, abs=2e-4)
    for name in ("p_max_MPa", "area_mm2", "b_mm"):
        increase = with_turned.bodies_step_uncertainty[name] - alone.bodies_step_uncertainty[name]
        assert increase == pytest.approx(abs(changes[name]), rel=1e-9)
    assert replace(plain, turned=replace(turned_rung, status="not converged")).status == "not converged"
