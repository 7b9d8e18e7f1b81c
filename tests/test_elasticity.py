"""The two solver paths: their choice, and the memory of a factor."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from numpy.testing import assert_array_equal
from scipy.sparse import csr_matrix, kron
from skfem import Basis, ElementHex1, ElementVector
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fecontact.bodies import STEEL
from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.fe import linear_solver
from fecontact.fe.body import make_elastic_body, mesh_to_assemble
from fecontact.fe.body_mesh import check_mesh
from fecontact.fe.linear_solver import choose_solver, is_pardiso_available, rigid_body_modes
from fecontact.fe.memory import factor_bytes
from fecontact.fe.stiffness import _skfem_mesh, assemble_stiffness
from fecontact.solving.case_meshes import mesh_case

needs_pardiso = pytest.mark.skipif(not is_pardiso_available(), reason="MKL PARDISO is not installed on this platform")


@pytest.fixture
def available(monkeypatch):
    """Sets the memory that seems to be available (bytes)."""
    return lambda size: monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(available=size))


@needs_pardiso
def test_multigrid_is_taken_where_the_factors_do_not_fit(available):
    bodies = [200_000, 300_000]
    factors_bytes = sum(factor_bytes(count) for count in bodies)
    available(1.3 * factors_bytes)
    assert choose_solver("auto", bodies) == "pardiso"
    # one factor alone would fit
    available(0.9 * factors_bytes)
    assert choose_solver("auto", bodies) == "amg"
    assert choose_solver("auto", bodies[:1]) == "pardiso"
    # who asks for it gets it, and is refused where it is known how much it needs
    assert choose_solver("pardiso", bodies) == "pardiso"


@needs_pardiso
def test_a_fifth_of_the_memory_is_left_for_the_matrix_and_its_assembly(available):
    required = factor_bytes(300_000)
    for fraction, path in ((0.79, "pardiso"), (0.81, "amg")):
        available(required / fraction)
        assert choose_solver("auto", [300_000]) == path


def test_a_factor_is_expected_as_large_as_the_largest_one_that_pardiso_counts():
    # bodies of 11 to 158 thousand unknowns: 71 to 85 n^(4/3) bytes and 206 to 242 bytes an unknown
    for unknowns in (11_000, 158_000):
        smallest = 85.4 * unknowns ** (4.0 / 3.0) + 241.0 * unknowns
        assert smallest < factor_bytes(unknowns) < 1.02 * smallest


@needs_pardiso
def test_multigrid_is_taken_for_one_load_on_many_unknowns(available):
    available(1e12)
    # measured: 242 thousand unknowns take 14 s by factors and 25 s without, 476 thousand 46 and 47 s
    for unknowns, path in (([120_000, 120_000], "pardiso"), ([240_000, 240_000], "amg")):
        assert choose_solver("auto", unknowns, several_loads=False) == path
        # a further load costs a sixteenth of the first one with factors
        assert choose_solver("auto", unknowns, several_loads=True) == "pardiso"
        assert choose_solver("pardiso", unknowns, several_loads=False) == "pardiso"


def test_without_mkl_multigrid_is_taken(monkeypatch):
    monkeypatch.setattr(linear_solver, "is_pardiso_available", lambda: False)
    assert choose_solver("auto", [1000]) == "amg"
    with pytest.raises(InputError, match="MKL cannot be loaded; run pip install pypardiso"):
        choose_solver("pardiso")


@needs_pardiso
@pytest.mark.parametrize("body", ["rail", "wheel"])
def test_estimated_factor_against_the_one_that_is_made(body):
    mesh = mesh_case(Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, resolution="quick"), body)
    factored = make_elastic_body(mesh, STEEL, "pardiso")
    permanent, factor = (factored.solve._nearly._pardiso.get_iparm(k) for k in (16, 17))
    factored.close()
    # nested dissection depends on the body's shape: 71 to 85 n^(4/3) measured for the factor
    assert factor_bytes(mesh.unknowns) == pytest.approx(1024.0 * (permanent + factor), rel=0.2)


@pytest.fixture(scope="module")
def small():
    return mesh_case(Case(resolution=(1.6, 1.4)), "rail")


@pytest.fixture(scope="module")
def all_layers(small):
    """A body with unknowns on all layers of a mesh."""
    return replace(small, spacing=None)


def test_stiffness_is_that_of_the_vector_form(all_layers):
    basis = Basis(_skfem_mesh(all_layers), ElementVector(ElementHex1()), intorder=3)
    plain = linear_elasticity(*lame_parameters(STEEL.young_MPa, STEEL.poisson)).assemble(basis)
    # scikit-fem numbers the vertices' components one after the other, as we do
    assert_array_equal(basis.nodal_dofs[:, 7], [21, 22, 23])
    # the same sums in another order: rounding of a few hundred terms
    assert abs(assemble_stiffness(all_layers, STEEL) - plain).max() < 1e-13 * abs(plain).max()


def test_stiffness_of_layers_further_apart_is_that_of_all_layers_that_move_on_straight_lines(small, all_layers):
    spacing, count = small.spacing, len(small.points)
    assert 0.05 * count < spacing.between.size < 0.5 * count
    # the zone and what is near to it has all of its unknowns
    assert not np.isin(small.block_nodes[..., :6], spacing.between).any()
    # straight along the rail: a node between two has its place between theirs
    between = np.einsum("he,hed->hd", spacing.parts, small.points[spacing.ends])
    assert np.abs(between - small.points[spacing.between]).max() < 1e-9
    kept_nodes = np.setdiff1d(np.arange(count), spacing.between)
    rows, columns = np.concatenate([kept_nodes, *[spacing.between] * 2]), np.concatenate([kept_nodes, *spacing.ends.T])
    parts = np.concatenate([np.ones(kept_nodes.size), *spacing.parts.T])
    moves = kron(csr_matrix((parts, (rows, columns)), shape=(count, count)), np.eye(3)).tocsr()
    expected = moves.T @ assemble_stiffness(all_layers, STEEL).tocsr() @ moves
    assert abs(assemble_stiffness(small, STEEL) - expected).max() < 1e-12 * abs(expected).max()


@needs_pardiso
@pytest.mark.parametrize("body", ["rail", "wheel"])
def test_layers_further_apart_do_not_change_how_the_contact_gives_way(body):
    mesh = mesh_case(Case(lateral_shift_mm=3.0), body)
    nodes = mesh.contact_nodes.ravel()
    # a pressure over the middle of the zone
    across, along = (np.linspace(-2.0, 2.0, n) for n in mesh.contact_nodes.shape[::-1])
    pressure = np.sqrt(np.maximum(0.0, 1.0 - (along[:, None] + 2.0) ** 2 - across**2))
    forces = pressure.ravel()[:, None] * [0.0, 0.0, 1.0]
    displacements, exact = (
        make_elastic_body(variant, STEEL, "pardiso").displacements(nodes, forces)[nodes]
        for variant in (mesh, replace(mesh, spacing=None))
    )
    # the far field is stiffer, alike for all nodes; what is left bends the surface
    apart = displacements - exact
    assert np.abs(apart).max() < 2e-4 * np.abs(exact).max()
    assert np.abs(apart - apart.mean(axis=0)).max() < 1e-4 * np.abs(exact).max()


@pytest.fixture
def iterations(monkeypatch):
    """Numbers of iterations of all solutions."""
    counts: list[int] = []
    solve = linear_solver.cg

    def counted(*arguments, **options):
        counts.append(0)

        def count(_):
            counts[-1] += 1

        return solve(*arguments, callback=count, **options)

    monkeypatch.setattr(linear_solver, "cg", counted)
    return counts


def loads_on(mesh, number):
    nodes = mesh.contact_nodes.ravel()
    return nodes, np.random.default_rng(3).random((number, nodes.size, 3))


@needs_pardiso
def test_both_solver_paths_give_the_same_displacements(small, iterations):
    direct, multigrid = (make_elastic_body(small, STEEL, name) for name in ("pardiso", "amg"))
    nodes, (first, second, third) = loads_on(small, 3)
    # the last but one is made of those before, and is known to about the tolerance before the first iteration
    for forces in (first, second, 2.0 * first - 0.5 * second, third):
        exact, displacements = direct.displacements(nodes, forces), multigrid.displacements(nodes, forces)
        # residuals of 1e-9, conditioning of the softest displacement modes on top
        assert np.abs(displacements - exact).max() < 1e-8 * np.abs(exact).max()
    for counts, minimum, maximum in ((iterations[::2], 2, 2), (iterations[1::2], 10, 30)):
        assert counts[2] <= 2
        assert all(minimum <= counts[k] <= maximum for k in (0, 1, 3))
    direct.close()


@pytest.mark.parametrize("solver", [pytest.param("pardiso", marks=needs_pardiso), "amg"])
@pytest.mark.parametrize("body", ["rail", "wheel"])
def test_both_halves_of_a_whole_body_are_the_body(body, solver):
    full_mesh = mesh_case(Case(lateral_shift_mm=3.0, yaw_rad=0.02, resolution=(2.5, 2.5)), body)
    nodes, (forces,) = loads_on(full_mesh, 1)
    # on the middle plane, within and on the far planes, too
    everywhere = np.random.default_rng(4).normal(size=full_mesh.points.shape)
    of_halves, as_one = (
        make_elastic_body(mesh, STEEL, solver) for mesh in (full_mesh, replace(full_mesh, opposite=None))
    )
    # down to rounding, so that nothing else can hide behind the tolerance
    displacements, exact = (
        body_model.displacements(nodes, forces, everywhere, tolerance=1e-14) for body_model in (of_halves, as_one)
    )
    assert np.abs(displacements - exact).max() < 1e-12 * np.abs(exact).max()
    assert len(mesh_to_assemble(full_mesh).hexes) == len(full_mesh.hexes) / 2
    for body_model in (of_halves, as_one):
        body_model.close()


@needs_pardiso
def test_a_stiffness_without_a_factor_is_told(small):
    matrix = assemble_stiffness(mesh_to_assemble(small), STEEL)
    matrix.data *= -1.0
    with pytest.raises(ConvergenceError, match=r"matrix of \d+ degrees of freedom has no factor .* use the amg solver"):
        make_elastic_body(small, STEEL, "pardiso", matrix)


def test_a_whole_mesh_that_is_no_mirror_image_is_refused():
    full_mesh = mesh_case(Case(lateral_shift_mm=3.0, yaw_rad=0.02, resolution=(2.5, 2.5)), "wheel")
    points = full_mesh.points.copy()
    points[full_mesh.contact_nodes[0, 0]] += 1e-5
    with pytest.raises(AssertionError, match="differs from its mirror image"):
        check_mesh(replace(full_mesh, points=points))


@pytest.mark.slow
def test_stretched_elements_do_not_slow_multigrid(iterations):
    # swept to the cut plane the elements are up to a hundred times as long as thin; 21 and 25 iterations measured, 31
    # and 42 with strengths that are read off the matrix
    for size in ((1.6, 1.4), (0.8, 0.7)):
        mesh = mesh_case(Case(resolution=size), "rail")
        nodes, (forces,) = loads_on(mesh, 1)
        make_elastic_body(mesh, STEEL, "amg").displacements(nodes, forces)
    assert max(iterations) < 35


def test_rigid_body_modes_have_no_unit_of_length():
    points = np.random.default_rng(1).uniform(size=(20, 3)) * [4.0, 2.0, 1.0]
    modes = rigid_body_modes(points)
    np.testing.assert_allclose(rigid_body_modes(1e3 * points + 50.0), modes, atol=1e-9)
    assert np.abs(modes).max() <= 1.0
