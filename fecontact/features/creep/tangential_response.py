"""Tangential displacements of two half-spaces under tractions on the cells of a grid (Cerruti 1882)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2

from fecontact.arrays import Floats


def cerruti_influence(x: Floats, y: Floats, step_x: float, step_y: float, poisson: float) -> tuple[Floats, ...]:
    """Displacements xx, yy and xy at (x, y) mm over a unit traction on a rectangle around the origin, times pi G.

    Displacements of the first body relative to the second, of equal material, under a traction on the first body and
    the opposite traction on the second body. They are integrals over the rectangle of (1 - nu)/r + nu x^2/r^3, of
    (1 - nu)/r + nu y^2/r^3, and of nu x y/r^3 (Johnson 1985, section 3.6).
    """
    total = [np.zeros(np.broadcast_shapes(x.shape, y.shape)) for _ in range(3)]
    for sign_x in (1.0, -1.0):
        for sign_y in (1.0, -1.0):
            u, v = x + 0.5 * sign_x * step_x, y + 0.5 * sign_y * step_y
            # on the line of an edge the limit is zero
            along = u * np.arcsinh(v / np.maximum(np.abs(u), 1e-300))
            across = v * np.arcsinh(u / np.maximum(np.abs(v), 1e-300))
            parts = ((1.0 - poisson) * along + across, along + (1.0 - poisson) * across, -poisson * np.hypot(u, v))
            for k, part in enumerate(parts):
                total[k] += sign_x * sign_y * part
    return tuple(total)


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentialResponse:
    """Response of a grid to tractions on its cells, by a kernel that is the same at every cell.

    Attributes
    ----------
    kernels (3, 2 nx - 1, 2 ny - 1)
        xx, yy and xy at offsets of 1 - nx to nx - 1 and 1 - ny to ny - 1 cells.
    spectra
        Fourier transforms of the kernels, padded by zeros.
    """

    kernels: Floats
    spectra: NDArray[np.complex128]
    padded: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells along and across."""
        return (self.kernels.shape[1] + 1) // 2, (self.kernels.shape[2] + 1) // 2

    def apply(self, traction: Floats) -> Floats:
        """Response (2, nx, ny) to tractions (2, nx, ny) in MPa."""
        nx, ny = self.shape
        p = rfft2(traction, self.padded)
        xx, yy, xy = self.spectra
        out = irfft2(np.stack([xx * p[0] + xy * p[1], xy * p[0] + yy * p[1]]), self.padded)
        return np.asarray(out[:, :nx, :ny])

    def strip_blocks(self) -> Floats:
        """Response (2, nx, nx) along and across of the cells of a strip y = const to tractions on this strip."""
        nx, ny = self.shape
        offsets = np.arange(nx)[:, None] - np.arange(nx)[None, :] + nx - 1
        return np.asarray(self.kernels[:2, :, ny - 1][:, offsets])


def rolling_response(
    nx: int, ny: int, step_x: float, step_y: float, *, shear_MPa: float, poisson: float
) -> TangentialResponse:
    """Slip over the rolling speed that tractions cause in steady rolling: -du/dx, half a cell ahead of each cell.

    A particle comes to a cell from the cell ahead (Kalker 1990): the slip is the difference of their displacements over
    the step.
    """
    x, y = _offsets(nx, ny, step_x, step_y)
    here = cerruti_influence(x, y, step_x, step_y, poisson)
    ahead = cerruti_influence(x + step_x, y, step_x, step_y, poisson)
    return _response([(u - v) / step_x for u, v in zip(here, ahead, strict=True)], shear_MPa)


def _offsets(nx: int, ny: int, step_x: float, step_y: float) -> tuple[Floats, Floats]:
    return np.asarray(np.arange(1 - nx, nx)[:, None] * step_x), np.asarray(np.arange(1 - ny, ny)[None, :] * step_y)


def _response(kernels: tuple[Floats, ...] | list[Floats], shear_MPa: float) -> TangentialResponse:
    every = np.stack(kernels) / (math.pi * shear_MPa)
    rows, columns = every.shape[1:]
    padded = (next_fast_len(rows, real=True), next_fast_len(columns, real=True))
    wrapped = np.zeros((3, *padded))
    wrapped[:, :rows, :columns] = every
    # offset zero to the first place
    wrapped = np.roll(wrapped, ((1 - rows) // 2, (1 - columns) // 2), axis=(1, 2))
    return TangentialResponse(kernels=every, spectra=rfft2(wrapped), padded=padded)
