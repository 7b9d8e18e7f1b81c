"""Stiffness matrix of a body by scikit-fem, and Hooke's law for stiffness and stresses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix

from fecontact.arrays import Floats, Integers
from fecontact.bodies import Material
from fecontact.fe.body_mesh import BodyMesh, ConstrainedNodes


def elasticity_MPa(material: Material) -> Floats:
    """Elasticity tensor of an isotropic material, in MPa.

    C_ijkl = lambda d_ij d_kl + G (d_ik d_jl + d_il d_jk) with Lame's constants lambda and G.

    Parameters
    ----------
    material
        Elastic constants.

    Returns
    -------
    C (3, 3, 3, 3)
        Tensor of Hooke's law for small strains: stress_ij = C_ijkl du_k/dx_l.

    Examples
    --------
    >>> from fecontact.bodies import STEEL
    >>> C = elasticity_MPa(STEEL)
    >>> bool(C[0, 1, 0, 1] == STEEL.shear_MPa)
    True
    """
    delta = np.eye(3)
    dilation = np.einsum("ij,kl->ijkl", delta, delta)
    shear = np.einsum("ik,jl->ijkl", delta, delta) + np.einsum("il,jk->ijkl", delta, delta)
    return np.asarray(material.lame_MPa * dilation + material.shear_MPa * shear)


# Corner order of a hexahedron in scikit-fem, as positions in the VTK order.
_TO_SKFEM = np.array([0, 4, 3, 1, 7, 5, 2, 6])


def assemble_stiffness(mesh: BodyMesh, material: Material) -> bsr_matrix:
    """Stiffness matrix of a body, in blocks of the three displacement components of each node.

    Trilinear hexahedra, isotropic Hooke's law, small strains. The integrals of d_i u d_j v use scikit-fem's shape
    functions and quadrature. They are computed for all elements at once and added up in one sparsity pattern, which is
    ten times as fast as scikit-fem's vector form.

    Parameters
    ----------
    mesh
        Mesh of the body, with n nodes in mm.
    material
        Elastic constants.

    Returns
    -------
    bsr_matrix
        Stiffness matrix (3n, 3n) in N/mm.
    """
    from skfem import Basis, ElementHex1

    basis = Basis(_skfem_mesh(mesh), ElementHex1(), intorder=3)
    # arrays (elements, corners, quadrature points), one for each direction
    gradients = [np.stack([shape[0].grad[i] for shape in basis.basis], axis=1) for i in range(3)]
    weights = basis.dx[:, None, :]
    nodes, count = basis.element_dofs.T.astype(np.int64), len(mesh.points)
    pairs, values = _pairs_and_values(nodes, count, mesh.spacing)
    # Rows of the matrix belong to the test function v, columns to the displacement u.
    pattern = coo_matrix((np.ones(len(pairs[0])), pairs), shape=(count, count)).tocsr()
    pair_integrals = np.empty((pattern.nnz, 3, 3))
    # Place where the integrals of a pair of nodes are added up (numpy.unique takes twice as long), and place of the
    # reversed pair.
    pattern.data = np.arange(pattern.nnz)
    place, reversed_ = np.asarray(pattern[pairs]).ravel(), pattern.T.tocsr().data
    for i in range(3):
        for j in range(i, 3):
            integrals = (gradients[i] * weights) @ gradients[j].transpose(0, 2, 1)
            pair_integrals[:, i, j] = np.bincount(place, values(integrals))
            if i != j:
                pair_integrals[:, j, i] = pair_integrals[reversed_, i, j]
    # d_k v_i C_ikjl d_l u_j
    blocks = np.tensordot(pair_integrals, elasticity_MPa(material), axes=((1, 2), (1, 3)))
    return bsr_matrix((blocks, pattern.indices, pattern.indptr), shape=(3 * count, 3 * count))


def _skfem_mesh(mesh: BodyMesh) -> Any:
    """The mesh of the unknowns in the format of scikit-fem."""
    from skfem import MeshHex1

    hexes = mesh.hexes if mesh.spacing is None else mesh.spacing.hexes
    return MeshHex1(mesh.points.T.copy(), hexes[:, _TO_SKFEM].T.copy(), sort_t=False)


def _pairs_and_values(
    nodes: Integers, count: int, spacing: ConstrainedNodes | None
) -> tuple[tuple[Integers, Integers], Callable[[Floats], Floats]]:
    """Pairs of nodes that share an element, and a function that adds integrals to them.

    The pairs are rows (p,) and columns (p,). The function takes integrals (k, 8, 8) of the elements and returns values
    (p,).
    """
    if spacing is None:
        return _pairs(nodes), np.ravel
    ends, weights = np.repeat(np.arange(count)[:, None], 2, axis=1), np.repeat([[1.0, 0.0]], count, axis=0)
    ends[spacing.between], weights[spacing.between] = spacing.ends, spacing.parts
    # An element with a corner between two nodes acts on both of these nodes: it has sixteen nodes.
    has_between = (weights[nodes, 0] < 1.0).any(axis=1)
    regular_nodes, end_nodes = nodes[~has_between], ends[nodes[has_between]].transpose(0, 2, 1).reshape(-1, 16)
    node_shares = (weights[nodes[has_between]].transpose(0, 2, 1)[:, None] * np.eye(8)[:, None, :]).reshape(-1, 8, 16)
    # A node without unknowns keeps its place on the diagonal.
    pairs = _pairs(regular_nodes), _pairs(end_nodes), (spacing.between, spacing.between)

    def values(integrals: Floats) -> Floats:
        """Values (p,) at the pairs of nodes from integrals (k, 8, 8) of the elements."""
        shared_integrals = node_shares.transpose(0, 2, 1) @ integrals[has_between] @ node_shares
        return np.concatenate(
            [integrals[~has_between].ravel(), shared_integrals.ravel(), np.zeros(spacing.between.size)]
        )

    rows, columns = (np.concatenate(end_nodes) for end_nodes in zip(*pairs, strict=True))
    return (rows, columns), values


def _pairs(nodes: Integers) -> tuple[Integers, Integers]:
    """All pairs of the nodes (m, k) of each element.

    They are rows and columns (m k^2,).
    """
    return np.repeat(nodes, nodes.shape[1], axis=1).ravel(), np.tile(nodes, (1, nodes.shape[1])).ravel()
