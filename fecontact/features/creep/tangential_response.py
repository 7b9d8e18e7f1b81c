"""Tangential displacements of two half-spaces under tractions on the cells of a grid (Cerruti 1882)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2

from fecontact.arrays import Floats


def integrate_cerruti(x: Floats, y: Floats, step_x: float, step_y: float, poisson: float) -> tuple[Floats, ...]:
    """Displacements under a unit traction on a rectangle around the origin, times pi G.

    The displacements are those of the first body relative to the second, of equal material, under a traction on the
    first body and the opposite traction on the second body.

    Parameters
    ----------
    x, y
        Coordinates of the points in mm, of any shapes that broadcast.
    step_x, step_y
        Side lengths of the rectangle in mm.
    poisson
        Poisson's ratio of both bodies.

    Returns
    -------
    tuple of arrays
        xx, yy and xy in mm, of the broadcast shape: integrals over the rectangle of (1 - nu)/r + nu x^2/r^3, of (1 -
        nu)/r + nu y^2/r^3, and of nu x y/r^3 (Johnson 1985, section 3.6). The displacement in mm is this value times
        the traction, divided by pi G.

    Examples
    --------
    Far from the rectangle, on the x axis, the integrals tend to 1/r and (1 - nu)/r times the area.

    >>> import numpy as np
    >>> from fecontact.features.creep.tangential_response import integrate_cerruti
    >>> xx, yy, xy = integrate_cerruti(np.array(50.0), np.array(0.0), 1.0, 1.0, 0.3)
    >>> round(float(xx) * 50.0, 3), round(float(yy) * 50.0, 3), abs(float(xy)) < 1e-12
    (1.0, 0.7, True)
    """
    displacements = [np.zeros(np.broadcast_shapes(x.shape, y.shape)) for _ in range(3)]
    for sign_x in (1.0, -1.0):
        for sign_y in (1.0, -1.0):
            u_mm, v_mm = x + 0.5 * sign_x * step_x, y + 0.5 * sign_y * step_y
            # on the straight line through an edge the limit is zero
            along = u_mm * np.arcsinh(v_mm / np.maximum(np.abs(u_mm), 1e-300))
            across = v_mm * np.arcsinh(u_mm / np.maximum(np.abs(v_mm), 1e-300))
            primitives = (
                (1.0 - poisson) * along + across,
                along + (1.0 - poisson) * across,
                -poisson * np.hypot(u_mm, v_mm),
            )
            for k, primitive in enumerate(primitives):
                displacements[k] += sign_x * sign_y * primitive
    return tuple(displacements)


@dataclass(frozen=True, kw_only=True, eq=False)
class TangentialResponse:
    """Response of a grid to tractions on its cells.

    The kernel is equal for all cells.

    Attributes
    ----------
    kernels : ndarray of shape (3, 2 nx - 1, 2 ny - 1)
        xx, yy and xy at offsets of 1 - nx to nx - 1 and 1 - ny to ny - 1 cells.
    spectra
        Fourier transforms of the kernels, padded by zeros.
    padded_shape
        Number of rows and columns of the padded kernels.
    """

    kernels: Floats
    spectra: NDArray[np.complex128]
    padded_shape: tuple[int, int]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells along and across."""
        return (self.kernels.shape[1] + 1) // 2, (self.kernels.shape[2] + 1) // 2

    def apply(self, traction: Floats) -> Floats:
        """Calculate the response to tractions.

        Parameters
        ----------
        traction : ndarray of shape (2, nx, ny)
            Tractions along and across in MPa.

        Returns
        -------
        array (2, nx, ny)
            Response along and across, in the unit of the kernels times MPa.
        """
        nx, ny = self.shape
        traction_spectra = rfft2(traction, self.padded_shape)
        xx, yy, xy = self.spectra
        response = irfft2(
            np.stack(
                [
                    xx * traction_spectra[0] + xy * traction_spectra[1],
                    xy * traction_spectra[0] + yy * traction_spectra[1],
                ]
            ),
            self.padded_shape,
        )
        return np.asarray(response[:, :nx, :ny])

    def strip_blocks(self) -> Floats:
        """Response within a strip y = const to tractions on this strip.

        Returns
        -------
        array (2, nx, nx)
            Response along and across of each cell to a unit traction on each cell, in the unit of the kernels.
        """
        nx, ny = self.shape
        offsets = np.arange(nx)[:, None] - np.arange(nx)[None, :] + nx - 1
        return np.asarray(self.kernels[:2, :, ny - 1][:, offsets])


def make_rolling_response(
    nx: int, ny: int, step_x: float, step_y: float, *, shear_MPa: float, poisson: float
) -> TangentialResponse:
    """Slip over the rolling speed that tractions cause in steady rolling.

    The slip is -du/dx, half a cell ahead of each cell. A particle comes to a cell from the cell ahead (Kalker 1990):
    the slip is the difference of the displacements of both cells, divided by the step.

    Parameters
    ----------
    nx, ny
        Number of cells along and across.
    step_x, step_y
        Side lengths of a cell in mm.
    shear_MPa, poisson
        Shear modulus and Poisson's ratio of both bodies.

    Returns
    -------
    TangentialResponse
        Slip divided by the rolling speed (no unit) per MPa.
    """
    x, y = _calculate_offsets(nx, ny, step_x, step_y)
    at_cell = integrate_cerruti(x, y, step_x, step_y, poisson)
    at_next_cell = integrate_cerruti(x + step_x, y, step_x, step_y, poisson)
    return _assemble_response([(u - v) / step_x for u, v in zip(at_cell, at_next_cell, strict=True)], shear_MPa)


def _calculate_offsets(nx: int, ny: int, step_x: float, step_y: float) -> tuple[Floats, Floats]:
    """Offsets between cells in mm.

    Their shapes are (2 nx - 1, 1) along and (1, 2 ny - 1) across.
    """
    return np.asarray(np.arange(1 - nx, nx)[:, None] * step_x), np.asarray(np.arange(1 - ny, ny)[None, :] * step_y)


def _assemble_response(kernels: tuple[Floats, ...] | list[Floats], shear_MPa: float) -> TangentialResponse:
    """Response of a grid from its kernels times pi G.

    Parameters
    ----------
    kernels
        xx, yy and xy, each (2 nx - 1, 2 ny - 1).
    shear_MPa
        Shear modulus of both bodies.

    Returns
    -------
    TangentialResponse
        The kernels divided by pi G, with their padded Fourier transforms.
    """
    scaled_kernels = np.stack(kernels) / (math.pi * shear_MPa)
    rows, columns = scaled_kernels.shape[1:]
    padded_shape = (next_fast_len(rows, real=True), next_fast_len(columns, real=True))
    wrapped = np.zeros((3, *padded_shape))
    wrapped[:, :rows, :columns] = scaled_kernels
    # offset zero to the first place
    wrapped = np.roll(wrapped, ((1 - rows) // 2, (1 - columns) // 2), axis=(1, 2))
    return TangentialResponse(kernels=scaled_kernels, spectra=rfft2(wrapped), padded_shape=padded_shape)
