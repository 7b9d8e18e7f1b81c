"""Hooke's law of an isotropic body: the one law of its stiffness and of its stresses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fecontact.material import Material

Floats = NDArray[np.float64]


def elasticity_MPa(material: Material) -> Floats:
    """Elasticity tensor C (3, 3, 3, 3) in MPa: stress_ij = C_ijkl du_k/dx_l, small strains.

    C_ijkl = lambda d_ij d_kl + G (d_ik d_jl + d_il d_jk) with Lame's constants.
    """
    one = np.eye(3)
    dilation = np.einsum("ij,kl->ijkl", one, one)
    shear = np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)
    return np.asarray(material.lame_MPa * dilation + material.shear_MPa * shear)
