"""How finite elements answer a pressure, seen in one response: as a half-space does, but for two differences.

Over a few nodes they are softer or stiffer than a continuum. This is felt alike at every node, scales with the elements
and is an error. Over the whole patch they have the shape of the bodies. This varies slowly, is what the elements are
there for, and is known well on coarse meshes. The response to a unit pressure at one node shows both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from fecontact.arrays import Floats, Integers
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.halfspace import convolution, half_space_below, love_influence
from fecontact.contact.solver import Compliance

# A response beside a curved body's edge, carried to all nodes, need not be positive definite.
_LEAST_SPECTRUM = 1e-3
COMPLIANCE_LIMIT = 0.02
"""Error of the elements' compliance beyond which the elements do not have the stiffness of the bodies' material.

Measured on the finest meshes of 24 contacts at `quick` and `standard` (R 460 to R 10, S1002 on 60E1, 60E2 and
MBench_UIC60, one and two lobes, with and without yaw): -0.8 to 0.4 %, median 0.0 %; -1.3 % on a flange root (6.3 mm,
100 kN).
"""
# Near the node a response is the elements' part plus a quadratic function of the place; further away only the first
# term of the elements' part is left. The limit is this part of the nodes seen to each side, and at least so many nodes.
# This leaves an error of 0.05 to 0.2 % of Hertz's peak (R 80 and R 13 under loads so small that bodies are half-spaces,
# 4 to 14 elements per semi-axis); five nodes without the first term left 0.1 to 0.6 %, and more on finer meshes.
_REACH = 0.75
_LEAST_REACH_NODES = 5.0
# With fewer nodes to each side a half-space's 1/r cannot be told from a smooth function.
_LEAST_SEEN_NODES = 8
# Further nodes are left out: there the bodies' part below a slender patch is no quadratic function any more. With them
# the error of healthy elements reaches -1.3 % on patches four times as long as wide.
_FAR_NODES = 14.0
# If the body's side is nearer to the node than this, the bodies' part may be no quadratic function. A residual of the
# fit above this part of the half-space's response shows it. Healthy elements under 29 contacts leave 0.08 to 0.17 %,
# with errors within 1.5 %; a tongue of 20 mm on sixteen nodes or fewer leaves 0.23 % and more, with errors of 3 to
# 46 %, and on 16.4 nodes 0.19 %, with 1.4 to 2.2 % on meshes that differ by how gmsh fills the rest of the body alone.
# On the flange root, whose head is wide, 0.48 % are left and the error is 1.5 %.
_WIDE_NODES = 18.0
_MOST_LEFT = 0.0018
# If the normals turn by more than this (rad) within the fit, the bodies' part is no quadratic function, and the
# residual does not always show it: in four conforming grooves and on three gauge corners, where they turn by 0.33 to
# 1.11 rad, healthy elements read -14 to 3 %, all beyond the limit; where they turn by 0.24 or less, at most 1.1 %.
_MOST_TURN_RAD = 0.3
UNSEEN_COMPLIANCE = 0.06
"""Error of the elements' compliance that is taken for granted where it cannot be measured.

On a gauge corner healthy elements read -5.6, -2.3 and -1.2 % with 6, 9 and 13.5 of them a semi-axis: there elements
that are softer by 5 % are not told from them.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitResponse:
    """Opening (nx, ns) in mm of a compliance under 1 MPa at a node (row, column) of a uniform grid of nodes."""

    grid: ContactGrid
    contact_modulus_MPa: float
    node: tuple[int, int]
    opening_mm: Floats

    @classmethod
    def of(
        cls, compliance: Compliance, grid: ContactGrid, *, contact_modulus_MPa: float, beside: float = 0.0
    ) -> UnitResponse:
        """Apply the compliance once, at the middle node; `beside` moves the node by this part of length and width."""
        rows, columns = grid.shape
        node = ((0 if grid.half else rows // 2) + round(beside * rows), columns // 2 + round(beside * columns))
        unit = np.zeros(grid.shape)
        unit[node] = 1.0
        opening = Field.of_nodes(grid, compliance(unit.ravel())).values
        return cls(grid=grid, contact_modulus_MPa=contact_modulus_MPa, node=node, opening_mm=opening)

    def model(self) -> Compliance:
        """The compliance, taken to be the same at every node.

        Beyond the response's reach it is a half-space's compliance plus the difference at the end of the reach.
        """
        return self._convolution(self._half_space() + self._beyond_half_space(), least_spectrum=_LEAST_SPECTRUM)

    def half_space_of_elements(self, *, quartic: bool = False) -> Compliance:
        """A half-space that answers as the elements do: Love's half-space plus the elements' part of the response.

        The elements' part is the whole difference over a few nodes. Beyond them it is the first error of a regular
        mesh, which falls with the cube of the distance and has two planes of symmetry. The bodies' part is a quadratic
        function of the place, or a quartic function with `quartic`. The change between both shows how well the two
        parts can be told apart: not well on a head that is narrow for its patch.
        """
        beyond = self._beyond_half_space()
        x, s = np.meshgrid(*self._offsets(), indexing="ij")
        nodes = np.hypot(x, s)
        smooth, tail = self._shapes(x, s, quartic=quartic)
        seen, reach = self._seen(x, s)
        near = nodes < max(_LEAST_REACH_NODES, _REACH * reach)
        far = seen & ~near
        parts, *_ = np.linalg.lstsq(np.concatenate([smooth[far], tail[far]], axis=-1), beyond[far], rcond=None)
        of_bodies, of_elements = parts[: smooth.shape[-1]], parts[smooth.shape[-1] :]
        softness = np.where(near, beyond - smooth @ of_bodies, tail @ of_elements)
        return self._convolution(self._half_space() + softness)

    def compliance_error(self, angle_rad: Floats, side_mm: float = math.inf) -> float:
        """Excess compliance of the elements, relative to a half-space of their material; NaN if it cannot be measured.

        The response in the far field is the sum of the half-space's 1/r, the elements' first error, and a quadratic
        function of the place for the bodies' shape. The error is the excess of the first part, by least squares with
        weights that fall with the distance, as the elements' part does.

        Parameters
        ----------
        angle_rad (ns,)
            Angles of the normals along which nodes press and openings are measured. Along a normal at another angle a
            half-space answers by the cosine between both (`contact.halfspace.along_normals`): 0.94 on a flange root.
        side_mm
            Distance from the node to the nearest side of the body. On a body that is narrow for the fit, the residual
            of the fit decides whether the bodies' shape is a quadratic function.

        Range of validity: at least 8 nodes to each side; normals that turn by 0.3 rad at most.
        """
        x, s = np.meshgrid(*self._offsets(), indexing="ij")
        nodes, (seen, reach) = np.hypot(x, s), self._seen(x, s)
        far = seen & (nodes >= _LEAST_REACH_NODES) & (nodes <= _FAR_NODES)
        if reach < _LEAST_SEEN_NODES:
            return math.nan
        places = np.arange(angle_rad.size) - self.node[1]
        cosines = np.cos(angle_rad - angle_rad[self.node[1]])
        # the mean of both sides, as in the response
        cosine = 0.5 * (np.interp(s[far], places, cosines) + np.interp(-s[far], places, cosines))
        flat = self._half_space()[far]
        half_space, beyond = cosine * flat, self._beyond_half_space()[far] + (1.0 - cosine) * flat
        smooth, tail = self._shapes(x[far], s[far], quartic=False)
        columns = np.column_stack([half_space, smooth, tail]) / nodes[far, None] ** 2
        size = np.linalg.norm(columns, axis=0)
        seen_beyond = beyond / nodes[far] ** 2
        parts, *_ = np.linalg.lstsq(columns / size, seen_beyond, rcond=None)
        left = float(np.linalg.norm(seen_beyond - columns / size @ parts) / size[0])
        turn = float(np.abs(np.arccos(np.clip(cosine, -1.0, 1.0))).max())
        narrow = side_mm < _WIDE_NODES * max(self.grid.steps_mm)
        if turn > _MOST_TURN_RAD or (narrow and left > _MOST_LEFT):
            return math.nan
        return float(parts[0] / size[0])

    def _seen(self, x: Integers, s: Integers) -> tuple[NDArray[np.bool_], int]:
        """Which offsets lie inside the grid on both sides of the node, and up to how many nodes all offsets do."""
        (i, j), (nodes_x, nodes_s) = self.node, self.grid.shape
        seen_x = nodes_x - 1 if self.grid.half else min(i, nodes_x - 1 - i)
        seen_s = min(j, nodes_s - 1 - j)
        return (np.abs(x) <= seen_x) & (np.abs(s) <= seen_s), min(seen_x, seen_s)

    def _shapes(self, x: Integers, s: Integers, *, quartic: bool) -> tuple[Floats, Floats]:
        """Shapes of the bodies' part of a response (..., n), and of the elements' part far away (..., 3); all even."""
        step_x, step_s = self.grid.steps_mm
        powers = [(0, 0), (2, 0), (0, 2), (1, 1)]
        powers += [(4, 0), (2, 2), (0, 4), (3, 1), (1, 3)] if quartic else []
        smooth = np.stack([1.0 * x**along * s**across for along, across in powers], axis=-1)
        # not below one step: the tail is used far away only, and would be infinite at the node
        distance = np.maximum(np.hypot(x * step_x, s * step_s), min(step_x, step_s)) / np.sqrt(step_x * step_s)
        angle = np.arctan2(s * step_s, x * step_x)
        tail = np.stack([np.cos(turns * angle) for turns in (0, 2, 4)], axis=-1) / distance[..., None] ** 3
        return np.asarray(smooth), np.asarray(tail)

    def _offsets(self) -> tuple[Integers, Integers]:
        """Offsets between any two nodes of the contact, in nodes along x (2 rows - 1,) and across (2 ns - 1,)."""
        nodes_x, nodes_s = self.grid.shape
        rows = 2 * nodes_x - 1 if self.grid.half else nodes_x
        return np.arange(1 - rows, rows), np.arange(1 - nodes_s, nodes_s)

    def _half_space(self) -> Floats:
        """Opening of a half-space at the offsets (Love's rectangles)."""
        (x, s), (step_x, step_s) = self._offsets(), self.grid.steps_mm
        influence = love_influence(np.asarray(x[:, None] * step_x), np.asarray(s[None, :] * step_s), step_x, step_s)
        return influence / (np.pi * self.contact_modulus_MPa)

    def _beyond_half_space(self) -> Floats:
        """Response minus a half-space's response; beyond its reach the value at the end of the reach."""
        (x, s), (i, j), (nodes_x, nodes_s) = self._offsets(), self.node, self.grid.shape
        seen_x = np.clip((np.abs(x) if self.grid.half else x) + i, 0, nodes_x - 1)
        seen_s = np.clip(s + j, 0, nodes_s - 1)
        rows = x.size // 2
        nearest = np.ix_(seen_x - i + rows, seen_s - j + nodes_s - 1)
        difference = self.opening_mm[np.ix_(seen_x, seen_s)] - self._half_space()[nearest]
        # a symmetric compliance answers equally on opposite sides
        return np.asarray(0.5 * (difference + difference[::-1, ::-1]))

    def _convolution(self, kernel: Floats, least_spectrum: float = -np.inf) -> Compliance:
        half = self.grid.half
        return convolution(kernel[kernel.shape[0] // 2 :], self.grid.shape, half=half, least_spectrum=least_spectrum)


# --- Patches far apart on one grid: regular nodes at each of them, and a few unequal ones on the strips between.
#
# Within a band the compliance is taken to be the same at every node. Between bands, and from and to the strips, it is a
# half-space's compliance, as a matrix across for each wave along x. The corrections of `contact.solver` start from this
# model and end at the finite bodies' own compliance.


@dataclass(frozen=True, kw_only=True, eq=False)
class Bands:
    """A grid whose columns are regular in bands; pressures and openings are arrays (n,) over all nodes.

    Attributes
    ----------
    columns
        Columns of each band.
    """

    grid: ContactGrid
    columns: tuple[slice, ...]
    contact_modulus_MPa: float

    @property
    def grids(self) -> list[ContactGrid]:
        """The grid of each band."""
        whole = self.grid
        return [ContactGrid(x_mm=whole.x_mm, s_mm=whole.s_mm[columns], half=whole.half) for columns in self.columns]

    def half_space(self) -> Compliance:
        """Compliance of a pair of half-spaces."""
        return self.together([half_space_below(grid, self.contact_modulus_MPa) for grid in self.grids])

    def responses(self, compliance: Compliance, *, beside: float = 0.0) -> list[UnitResponse]:
        """Response of each band to a unit pressure in its middle, or beside it, under a compliance of all nodes."""
        modulus = self.contact_modulus_MPa
        return [
            UnitResponse.of(self._within(columns, compliance), grid, contact_modulus_MPa=modulus, beside=beside)
            for columns, grid in zip(self.columns, self.grids, strict=True)
        ]

    def together(self, within: Sequence[Compliance]) -> Compliance:
        """Compliance of all nodes from the compliance of each band within itself."""
        if len(within) == 1:
            return within[0]
        apart, shape = self._apart(), self.grid.shape

        def apply(pressure: Floats) -> Floats:
            opening = apart(pressure)
            for columns, compliance in zip(self.columns, within, strict=True):
                band = np.ascontiguousarray(pressure.reshape(shape)[:, columns])
                opening[:, columns] += compliance(band.ravel()).reshape(band.shape)
            return opening.ravel()

        return apply

    def _within(self, columns: slice, compliance: Compliance) -> Compliance:
        shape = self.grid.shape

        def apply(pressure: Floats) -> Floats:
            whole = np.zeros(shape)
            whole[:, columns] = pressure.reshape(shape[0], -1)
            return compliance(whole.ravel()).reshape(shape)[:, columns].ravel()

        return apply

    def _apart(self) -> Compliance:
        """Opening (nx, ns) of a half-space under the pressures of other bands and of the strips.

        A force is spread over the cell of the pressing node, and then over the cell of the answering node: the mean of
        both is a symmetric matrix, as a compliance must be, and Love's matrix if cells are equal.
        """
        (nodes_x, nodes_s), step_x = self.grid.shape, self.grid.steps_mm[0]
        rows = 2 * nodes_x - 1 if self.grid.half else nodes_x
        s = self.grid.s_mm
        width = np.gradient(s)
        x, away = np.asarray(np.arange(rows)[:, None, None] * step_x), (s[:, None] - s)[None]
        of_unit_force = love_influence(x, away, step_x, width) / (step_x * width)
        kernel = 0.5 * (of_unit_force + of_unit_force.transpose(0, 2, 1)) / (np.pi * self.contact_modulus_MPa)
        for columns in self.columns:
            kernel[:, columns, columns] = 0.0
        size = next_fast_len(2 * rows - 1, real=True)
        around = np.zeros((size, nodes_s, nodes_s))
        around[:rows] = kernel
        around[size - rows + 1 :] = kernel[:0:-1]
        # the spectrum is real, since opposite sides are equal
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
