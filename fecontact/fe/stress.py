"""Stresses at the nodes of a body from its displacements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.fe.body import ElasticBody
from fecontact.fe.body_mesh import CORNER_SIGNS, BodyMesh, shape_gradients
from fecontact.fe.hooke import elasticity_MPa

Floats = NDArray[np.float64]


def nodal_stress(body: ElasticBody, displacements: Floats, relaxed: Floats | None = None) -> Floats:
    """Stress (n, 6) in MPa at the nodes: XX YY ZZ XY YZ XZ, the mean of the adjacent elements' corner values.

    Corner values are extrapolated from the 2 x 2 x 2 Gauss points, where trilinear elements are most accurate.

    Parameters
    ----------
    displacements (n, 3)
        In mm, of all nodes.
    relaxed (m, 8, 6)
        Stress at the Gauss points that plastic strain takes off, where there is any.
    """
    mesh = body.mesh
    gauss = 1.0 / np.sqrt(3.0)
    signs = CORNER_SIGNS
    p, u = mesh.points[mesh.hexes], displacements[mesh.hexes]
    at_gauss = np.empty((len(mesh.hexes), 8, 6))
    law = np.stack([elasticity_MPa(body.material)[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))])
    for k, (r, s, t) in enumerate(gauss * signs):
        dn = shape_gradients(r, s, t)
        jacobian = p.transpose(0, 2, 1) @ dn
        grad = np.linalg.solve(jacobian.transpose(0, 2, 1), dn.T[None].repeat(len(p), axis=0)) @ u
        # row l and column k of it: the derivative of u_k by x_l
        at_gauss[:, k] = np.tensordot(grad, law, axes=((2, 1), (1, 2)))
    if relaxed is not None:
        at_gauss -= relaxed
    # value at corner c = sum over Gauss points of their trilinear functions at the scaled corner position
    weights = np.prod(1.0 + signs[:, None, :] * signs[None, :, :] * np.sqrt(3.0), axis=2) / 8.0
    corners = np.einsum("cg,mgs->mcs", weights, at_gauss)
    return mean_at_nodes(mesh, corners)


def mean_at_nodes(mesh: BodyMesh, corners: Floats) -> Floats:
    """Mean (n, k) at the nodes of values (m, 8, k) at the corners of all adjacent elements."""
    total = np.zeros((len(mesh.points), corners.shape[-1]))
    count = np.zeros(len(mesh.points))
    np.add.at(total, mesh.hexes.ravel(), corners.reshape(-1, corners.shape[-1]))
    np.add.at(count, mesh.hexes.ravel(), 1.0)
    return total / count[:, None]


def von_mises(stress: Floats) -> Floats:
    """Von Mises stress (n,) of stresses (n, 6) in the order XX YY ZZ XY YZ XZ."""
    xx, yy, zz, xy, yz, xz = np.moveaxis(stress, -1, 0)
    return np.asarray(np.sqrt(0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + xz**2)))
