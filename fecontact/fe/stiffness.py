"""Stiffness matrix of one body by scikit-fem."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import bsr_matrix, csr_matrix

from fecontact.fe.body_mesh import BodyMesh
from fecontact.fe.hooke import elasticity_MPa
from fecontact.material import Material

# scikit-fem's corner order of a hexahedron, as positions in the VTK order.
_TO_SKFEM = np.array([0, 4, 3, 1, 7, 5, 2, 6])


def stiffness(mesh: BodyMesh, material: Material) -> csr_matrix:
    """Stiffness matrix (3n, 3n) in N/mm, three displacement components per node in turn.

    Trilinear hexahedra, isotropic Hooke's law, small strains. The integrals of d_i u d_j v are taken from scikit-fem's
    shape functions and quadrature for all elements at once, and added up in one common pattern, which is faster than
    its vector form by an order of magnitude.
    """
    from skfem import Basis, ElementHex1

    basis = Basis(_skfem_mesh(mesh), ElementHex1(), intorder=3)
    # one array (elements, corners, quadrature points) a direction
    gradients = [np.stack([shape[0].grad[i] for shape in basis.basis], axis=1) for i in range(3)]
    weights = basis.dx[:, None, :]
    nodes, count = basis.element_dofs.T.astype(np.int64), len(mesh.points)
    pairs, place = np.unique(nodes[:, :, None] * count + nodes[:, None, :], return_inverse=True)
    place = place.ravel()
    # row and column of the matrix belong to v and u
    parts = np.empty((pairs.size, 3, 3))
    for i in range(3):
        for j in range(i, 3):
            integrals = (gradients[i] * weights) @ gradients[j].transpose(0, 2, 1)
            parts[:, i, j] = np.bincount(place, integrals.ravel())
            if i != j:
                parts[:, j, i] = np.bincount(place, integrals.transpose(0, 2, 1).ravel())
    # d_k v_i C_ikjl d_l u_j
    blocks = np.tensordot(parts, elasticity_MPa(material), axes=((1, 2), (1, 3)))
    rows, columns = np.divmod(pairs, count)
    starts = np.searchsorted(rows, np.arange(count + 1))
    return bsr_matrix((blocks, columns, starts), shape=(3 * count, 3 * count)).tocsr()


def _skfem_mesh(mesh: BodyMesh) -> Any:
    from skfem import MeshHex1

    return MeshHex1(mesh.points.T.copy(), mesh.hexes[:, _TO_SKFEM].T.copy(), sort_t=False)
