"""The nodes on which a contact pressure lives: a tensor grid on the rail's surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactGrid:
    """Tensor grid of pressure nodes on the rail's surface: x (nx,) and arc length s (ns,) from first touch (mm).

    In a half model x starts at 0, the plane of symmetry.
    """

    x_mm: Floats
    s_mm: Floats
    half: bool

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes along x and across."""
        return self.x_mm.size, self.s_mm.size

    @property
    def steps_mm(self) -> tuple[float, float]:
        """Uniform spacing along x and across."""
        return float(self.x_mm[1] - self.x_mm[0]), float(self.s_mm[1] - self.s_mm[0])

    def nodal_area_mm2(self) -> Floats:
        """Area int N_i (n,) of each node in the model, not doubled by symmetry."""
        return np.outer(_line_areas(self.x_mm), _line_areas(self.s_mm)).ravel()

    def whole_area_mm2(self) -> Floats:
        """Area (n,) that each node stands for in the whole contact: doubled in a half model."""
        return self.nodal_area_mm2() * (2.0 if self.half else 1.0)

    def weighted_mean(self, values_at: Callable[[Floats, Floats], Floats]) -> Floats:
        """Mean (n,) of a function of (x, s) weighted by the dual shape functions: int psi_i f / D_i.

        Three Gauss points a cell and direction.
        """
        nodes, weights = np.polynomial.legendre.leggauss(3)
        xi = 0.5 + 0.5 * nodes
        dual = 0.5 * weights * np.array([2.0 - 3.0 * xi, 3.0 * xi - 1.0])
        qx = (self.x_mm[:-1, None] + np.diff(self.x_mm)[:, None] * xi).ravel()
        qs = (self.s_mm[:-1, None] + np.diff(self.s_mm)[:, None] * xi).ravel()
        cells = np.asarray(values_at(qx[:, None], qs[None, :])).reshape(self.x_mm.size - 1, 3, self.s_mm.size - 1, 3)
        local = np.einsum("aq,iqjr,br->iajb", dual, cells, dual)
        local *= np.outer(np.diff(self.x_mm), np.diff(self.s_mm))[:, None, :, None]
        total = np.zeros(self.shape)
        for a in (0, 1):
            for b in (0, 1):
                total[a : total.shape[0] - 1 + a, b : total.shape[1] - 1 + b] += local[:, a, :, b]
        return total.ravel() / self.nodal_area_mm2()


def _line_areas(x: Floats) -> Floats:
    step = np.diff(x)
    return 0.5 * (np.append(step, 0.0) + np.insert(step, 0, 0.0))
