"""Patches far apart on one grid: regular nodes at each of them, and a few unequal ones on the strips between.

Within a band the compliance is that of a regular grid. Between bands, and from and to the strips, it is that of a
half-space, as a matrix across for each wave along x. What finite bodies answer otherwise there is for the corrections
of `contact.correction`: they start from this model, and end at the bodies' own compliance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from fecontact.contact.elements import UnitResponse
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import half_space_below, love_influence
from fecontact.contact.solver import Compliance

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Bands:
    """A grid whose columns are regular in bands; pressures and openings are those of all of its nodes (n,).

    Attributes
    ----------
    columns
        Of each band.
    """

    grid: ContactGrid
    columns: tuple[slice, ...]
    contact_modulus_MPa: float

    @property
    def grids(self) -> list[ContactGrid]:
        """The grid of each band."""
        whole = self.grid
        return [ContactGrid(x_mm=whole.x_mm, s_mm=whole.s_mm[own], half=whole.half) for own in self.columns]

    def half_space(self) -> Compliance:
        """Compliance of a pair of half-spaces."""
        return self.together([half_space_below(grid, self.contact_modulus_MPa) for grid in self.grids])

    def responses(self, compliance: Compliance, *, beside: float = 0.0) -> list[UnitResponse]:
        """What a compliance of all nodes answers in each band to a unit pressure in its middle, or beside it."""
        modulus = self.contact_modulus_MPa
        return [
            UnitResponse.of(self._within(own, compliance), grid, contact_modulus_MPa=modulus, beside=beside)
            for own, grid in zip(self.columns, self.grids, strict=True)
        ]

    def together(self, within: Sequence[Compliance]) -> Compliance:
        """Compliance of all nodes from that of each band within itself."""
        if len(within) == 1:
            return within[0]
        apart, shape = self._apart(), self.grid.shape

        def apply(pressure: Floats) -> Floats:
            opening = apart(pressure)
            for own, compliance in zip(self.columns, within, strict=True):
                band = np.ascontiguousarray(pressure.reshape(shape)[:, own])
                opening[:, own] += compliance(band.ravel()).reshape(band.shape)
            return opening.ravel()

        return apply

    def _within(self, own: slice, compliance: Compliance) -> Compliance:
        shape = self.grid.shape

        def apply(pressure: Floats) -> Floats:
            whole = np.zeros(shape)
            whole[:, own] = pressure.reshape(shape[0], -1)
            return compliance(whole.ravel()).reshape(shape)[:, own].ravel()

        return apply

    def _apart(self) -> Compliance:
        """Opening (nx, ns) of a half-space under the pressures of other bands and of the strips.

        Each node's force is spread over the cells of both nodes in turn: the mean is a symmetric matrix, as a
        compliance must be, and Love's where cells are equal.
        """
        (nodes_x, nodes_s), step_x = self.grid.shape, self.grid.steps_mm[0]
        rows = 2 * nodes_x - 1 if self.grid.half else nodes_x
        s = self.grid.s_mm
        width = np.gradient(s)
        x, away = np.asarray(np.arange(rows)[:, None, None] * step_x), (s[:, None] - s)[None]
        of_unit_force = love_influence(x, away, step_x, width) / (step_x * width)
        kernel = 0.5 * (of_unit_force + of_unit_force.transpose(0, 2, 1)) / (np.pi * self.contact_modulus_MPa)
        for own in self.columns:
            kernel[:, own, own] = 0.0
        size = next_fast_len(2 * rows - 1, real=True)
        around = np.zeros((size, nodes_s, nodes_s))
        around[:rows] = kernel
        around[size - rows + 1 :] = kernel[:0:-1]
        # real, since opposite sides are equal
        spectrum = rfft(around, axis=0).real

        def apply(pressure: Floats) -> Floats:
            force = pressure.reshape(nodes_x, nodes_s) * (step_x * width)
            if self.grid.half:
                force = np.concatenate([force[:0:-1], force])
            wave = rfft(force, size, axis=0)
            answer = np.matmul(spectrum, np.stack([wave.real, wave.imag], axis=-1))
            opening = irfft(answer[..., 0] + 1j * answer[..., 1], size, axis=0)[:rows]
            return np.ascontiguousarray(opening[rows - nodes_x :])

        return apply
