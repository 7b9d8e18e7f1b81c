"""Stiffness error of finite elements, from their response to unit pressure.

The response of finite elements differs from the response of a half-space in two ways. Over a few nodes, finite elements
are softer or stiffer than a continuum. This difference is equal at every node, scales with the element size, and is an
error. Over the whole patch, the response has the shape of the bodies. This difference varies slowly, is accurate on
coarse meshes, and is the purpose of the finite elements. A response to a unit pressure at a single node shows both.
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
from fecontact.contact.halfspace import build_convolution, build_half_space_compliance, love_influence
from fecontact.contact.solver import Compliance

# Lower bound of the spectrum of a compliance, relative to its largest value. A response near the edge of a curved body,
# applied at every node, is not always positive definite.
_MIN_RELATIVE_SPECTRUM = 1e-3
COMPLIANCE_ERROR_LIMIT = 0.02
"""Largest relative compliance error of finite elements with the stiffness of their material.

Measured on the finest meshes of 24 contacts at `quick` and `standard` (R 460 to R 10, S1002 on 60E1, 60E2 and
MBench_UIC60, one and two lobes, with and without yaw): -0.8 to 0.4 %, median 0.0 %; -1.3 % on a flange root (6.3 mm,
100 kN).
"""
# Near the pressed node, a response is the contribution of the elements plus a quadratic function of the offset. Farther
# away, only the first term of the contribution of the elements remains. The boundary between both is this fraction of
# the visible nodes to each side, and at least this number of nodes. The remaining error is 0.05 to 0.2 % of Hertz's
# peak (R 80 and R 13 under loads so small that the bodies are half-spaces, 4 to 14 elements per semi-axis). With a
# boundary at five nodes and without the first term, the error was 0.1 to 0.6 %, and larger on finer meshes.
_NEAR_FIELD_FRACTION = 0.75
_MIN_NEAR_FIELD_NODES = 5.0
# With fewer visible nodes to each side, a least-squares fit cannot separate the 1/r of a half-space from a smooth
# function.
_MIN_VISIBLE_NODES = 8
# Nodes at a larger distance are left out of the fit: below a slender patch the contribution of the bodies is not a
# quadratic function there. With these nodes, the error of healthy elements is up to -1.3 % on patches that are four
# times as long as wide.
_MAX_FIT_NODES = 14.0
# If the side of the body is nearer to the node than this distance, the contribution of the bodies is not always a
# quadratic function. If it is not, then the residual of the fit, as a fraction of the half-space response, exceeds this
# limit. Measured: 0.08 to 0.17 % for healthy elements in 29 contacts (errors within 1.5 %); at least 0.23 % on a tongue
# of 20 mm with at most 16 nodes (errors of 3 to 46 %); 0.19 % with 16.4 nodes (errors of 1.4 to 2.2 % on meshes that
# differ only in how gmsh fills the rest of the body). On a flange root with a wide head the residual is 0.48 % and the
# error 1.5 %: there the limit does not apply.
_MIN_SIDE_DISTANCE_NODES = 18.0
_MAX_FIT_RESIDUAL = 0.0018
# If the normals turn by more than this angle within the fit, the contribution of the bodies is not a quadratic
# function, and the residual does not always show it. In four conforming grooves and on three gauge corners the normals
# turn by 0.33 to 1.11 rad: the measured error of healthy elements is -14 to 3 %, and always beyond the limit. Where the
# normals turn by at most 0.24 rad, the measured error is at most 1.1 %.
_MAX_NORMAL_TURN_RAD = 0.3
UNCHECKED_COMPLIANCE_ERROR = 0.06
"""Relative compliance error to assume for finite elements without a measured compliance error.

On a gauge corner, the measured error of healthy elements is -5.6, -2.3 and -1.2 % with 6, 9 and 13.5 elements per
semi-axis. There, elements that are softer by 5 % cannot be distinguished from healthy elements.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitResponse:
    """Response of a compliance to 1 MPa at a single node.

    Attributes
    ----------
    grid
        Uniform grid of the pressure nodes.
    contact_modulus_MPa
        Contact modulus of the material of both bodies.
    node
        Row and column of the pressed node.
    opening_mm : ndarray of shape (nx, ns)
        Opening between the surfaces at each node.

    Examples
    --------
    The compliance error of an exact half-space is zero:

    >>> import numpy as np
    >>> from fecontact.contact.elements import UnitResponse
    >>> from fecontact.contact.grid import ContactGrid
    >>> from fecontact.contact.halfspace import build_half_space_compliance
    >>> grid = ContactGrid(x_mm=0.2 * np.arange(25), s_mm=0.2 * np.arange(25), half=False)
    >>> response = UnitResponse.of(build_half_space_compliance(grid, 115e3), grid, contact_modulus_MPa=115e3)
    >>> abs(response.compliance_error(np.zeros(25))) < 1e-9
    True
    """

    grid: ContactGrid
    contact_modulus_MPa: float
    node: tuple[int, int]
    opening_mm: Floats

    @classmethod
    def of(
        cls, compliance: Compliance, grid: ContactGrid, *, contact_modulus_MPa: float, beside: float = 0.0
    ) -> UnitResponse:
        """Apply a compliance to a unit pressure at the middle node.

        Parameters
        ----------
        compliance
            Opening (n,) in mm from pressures (n,) in MPa at the nodes of the grid. It is called once.
        grid
            Uniform grid of the pressure nodes.
        contact_modulus_MPa
            Contact modulus of the material of both bodies.
        beside
            Offset of the pressed node from the middle node, as a fraction of the length and of the width of the grid.

        Returns
        -------
        UnitResponse
            The opening at every node.
        """
        rows, columns = grid.shape
        node = ((0 if grid.half else rows // 2) + round(beside * rows), columns // 2 + round(beside * columns))
        pressure = np.zeros(grid.shape)
        pressure[node] = 1.0
        opening = Field.of_nodes(grid, compliance(pressure.ravel())).values
        return cls(grid=grid, contact_modulus_MPa=contact_modulus_MPa, node=node, opening_mm=opening)

    def model(self) -> Compliance:
        """Compliance with this response at every node.

        Returns
        -------
        Compliance
            Opening (n,) in mm from pressures (n,) in MPa, positive definite. Beyond the visible offsets, the difference
            from a half-space has its value at the last visible offset.
        """
        return self._convolution(
            self._half_space_response() + self._deviation_from_half_space(), least_spectrum=_MIN_RELATIVE_SPECTRUM
        )

    def half_space_of_elements(self, *, quartic: bool = False) -> Compliance:
        """Compliance of a half-space with the stiffness error of the elements.

        It is Love's half-space plus the contribution of the elements to the response. Over a few nodes, the
        contribution of the elements is the whole difference from a half-space minus the contribution of the bodies.
        Farther away, it is the first error term of a regular mesh, which decreases with the cube of the distance and
        has two planes of symmetry. The contribution of the bodies is a polynomial of the offset.

        Parameters
        ----------
        quartic
            Whether the polynomial is quartic instead of quadratic. The change between both shows how well the two
            contributions are separated. They are separated badly on a head that is narrow for its patch.

        Returns
        -------
        Compliance
            Opening (n,) in mm from pressures (n,) in MPa.
        """
        deviation = self._deviation_from_half_space()
        x, s = np.meshgrid(*self._node_offsets(), indexing="ij")
        distance_nodes = np.hypot(x, s)
        body_shapes, element_shapes = self._shapes(x, s, quartic=quartic)
        is_visible, visible_nodes = self._visible_offsets(x, s)
        is_near = distance_nodes < max(_MIN_NEAR_FIELD_NODES, _NEAR_FIELD_FRACTION * visible_nodes)
        is_fitted = is_visible & ~is_near
        coefficients, *_ = np.linalg.lstsq(
            np.concatenate([body_shapes[is_fitted], element_shapes[is_fitted]], axis=-1),
            deviation[is_fitted],
            rcond=None,
        )
        body_coefficients, element_coefficients = (
            coefficients[: body_shapes.shape[-1]],
            coefficients[body_shapes.shape[-1] :],
        )
        element_response = np.where(
            is_near, deviation - body_shapes @ body_coefficients, element_shapes @ element_coefficients
        )
        return self._convolution(self._half_space_response() + element_response)

    def compliance_error(self, angle_rad: Floats, side_mm: float = math.inf) -> float:
        """Excess compliance of the elements, relative to a half-space of their material.

        Far from the pressed node, the response is the sum of three terms: the 1/r of a half-space, the first error term
        of the elements, and a quadratic function of the offset for the shape of the bodies. The compliance error is the
        excess of the first term. It is fitted by least squares. The weights decrease with the distance, as the
        contribution of the elements does.

        Parameters
        ----------
        angle_rad : ndarray of shape (ns,)
            Angle of the normal at each column of nodes. Pressures act and openings are measured along the normals.
            Along a normal at a different angle, the response of a half-space is multiplied by the cosine between both
            normals (`contact.halfspace.project_on_normals`): 0.94 on a flange root.
        side_mm
            Distance from the pressed node to the nearest side of the body. If a body is narrow for the fit, the
            residual of the fit decides whether the shape of the bodies is a quadratic function.

        Returns
        -------
        float
            Relative error (-), positive for elements that are too soft. NaN outside the range of validity: at least 8
            visible nodes to each side, normals that turn by at most 0.3 rad, and a small residual on a body that is
            narrow for the fit. Use `UNCHECKED_COMPLIANCE_ERROR` as the uncertainty instead.
        """
        x, s = np.meshgrid(*self._node_offsets(), indexing="ij")
        distance_nodes, (is_visible, visible_nodes) = np.hypot(x, s), self._visible_offsets(x, s)
        is_fitted = is_visible & (distance_nodes >= _MIN_NEAR_FIELD_NODES) & (distance_nodes <= _MAX_FIT_NODES)
        if visible_nodes < _MIN_VISIBLE_NODES:
            return math.nan
        column_offsets = np.arange(angle_rad.size) - self.node[1]
        cosines = np.cos(angle_rad - angle_rad[self.node[1]])
        # The response is the mean of opposite offsets, and so is the cosine.
        cosine = 0.5 * (
            np.interp(s[is_fitted], column_offsets, cosines) + np.interp(-s[is_fitted], column_offsets, cosines)
        )
        parallel_half_space = self._half_space_response()[is_fitted]
        half_space, deviation = (
            cosine * parallel_half_space,
            self._deviation_from_half_space()[is_fitted] + (1.0 - cosine) * parallel_half_space,
        )
        body_shapes, element_shapes = self._shapes(x[is_fitted], s[is_fitted], quartic=False)
        terms = np.column_stack([half_space, body_shapes, element_shapes]) / distance_nodes[is_fitted, None] ** 2
        term_norms = np.linalg.norm(terms, axis=0)
        weighted_deviation = deviation / distance_nodes[is_fitted] ** 2
        coefficients, *_ = np.linalg.lstsq(terms / term_norms, weighted_deviation, rcond=None)
        residual = float(np.linalg.norm(weighted_deviation - terms / term_norms @ coefficients) / term_norms[0])
        normal_turn_rad = float(np.abs(np.arccos(np.clip(cosine, -1.0, 1.0))).max())
        is_narrow = side_mm < _MIN_SIDE_DISTANCE_NODES * max(self.grid.steps_mm)
        if normal_turn_rad > _MAX_NORMAL_TURN_RAD or (is_narrow and residual > _MAX_FIT_RESIDUAL):
            return math.nan
        return float(coefficients[0] / term_norms[0])

    def _visible_offsets(self, x: Integers, s: Integers) -> tuple[NDArray[np.bool_], int]:
        """Mask of the visible offsets, and their number to each side.

        An offset is visible if it is inside the grid on both sides of the pressed node.
        """
        (row, column), (nodes_x, nodes_s) = self.node, self.grid.shape
        visible_x = nodes_x - 1 if self.grid.half else min(row, nodes_x - 1 - row)
        visible_s = min(column, nodes_s - 1 - column)
        return (np.abs(x) <= visible_x) & (np.abs(s) <= visible_s), min(visible_x, visible_s)

    def _shapes(self, x: Integers, s: Integers, *, quartic: bool) -> tuple[Floats, Floats]:
        """Shape functions of the bodies and of the elements at offsets from the pressed node.

        All shape functions are even. The shape functions of the elements are valid only far from the pressed node.

        Parameters
        ----------
        x, s
            Offsets along and across in steps of the grid, of equal shape.
        quartic
            Whether the shapes of the bodies include terms of the fourth order.

        Returns
        -------
        tuple of ndarray
            Polynomials of the offsets (..., 4 or 9) for the bodies. cos(n angle) / distance^3 for n = 0, 2, 4 (..., 3)
            for the elements; the distance is relative to the geometric mean of both steps.
        """
        step_x, step_s = self.grid.steps_mm
        powers = [(0, 0), (2, 0), (0, 2), (1, 1)]
        powers += [(4, 0), (2, 2), (0, 4), (3, 1), (1, 3)] if quartic else []
        body_shapes = np.stack([1.0 * x**power_x * s**power_s for power_x, power_s in powers], axis=-1)
        # The distance is at least one step: the element shapes are infinite at the pressed node, and are used only far
        # away from it.
        distance = np.maximum(np.hypot(x * step_x, s * step_s), min(step_x, step_s)) / np.sqrt(step_x * step_s)
        angle = np.arctan2(s * step_s, x * step_x)
        element_shapes = np.stack([np.cos(order * angle) for order in (0, 2, 4)], axis=-1) / distance[..., None] ** 3
        return np.asarray(body_shapes), np.asarray(element_shapes)

    def _node_offsets(self) -> tuple[Integers, Integers]:
        """Offsets between any two nodes of the contact, in nodes.

        The shapes are (2 rows - 1,) along x and (2 ns - 1,) across.
        """
        nodes_x, nodes_s = self.grid.shape
        rows = 2 * nodes_x - 1 if self.grid.half else nodes_x
        return np.arange(1 - rows, rows), np.arange(1 - nodes_s, nodes_s)

    def _half_space_response(self) -> Floats:
        """Response of a half-space at the node offsets, in mm per MPa.

        Each node carries its pressure on a rectangle (Love 1929; Johnson 1985, eq. 3.25).
        """
        (x, s), (step_x, step_s) = self._node_offsets(), self.grid.steps_mm
        influence = love_influence(np.asarray(x[:, None] * step_x), np.asarray(s[None, :] * step_s), step_x, step_s)
        return influence / (np.pi * self.contact_modulus_MPa)

    def _deviation_from_half_space(self) -> Floats:
        """Response minus half-space response in mm per MPa at the node offsets.

        Beyond the visible offsets, the deviation has its value at the nearest visible offset.
        """
        (x, s), (row, column), (nodes_x, nodes_s) = self._node_offsets(), self.node, self.grid.shape
        nearest_row = np.clip((np.abs(x) if self.grid.half else x) + row, 0, nodes_x - 1)
        nearest_column = np.clip(s + column, 0, nodes_s - 1)
        middle_row = x.size // 2
        nearest_offsets = np.ix_(nearest_row - row + middle_row, nearest_column - column + nodes_s - 1)
        deviation = self.opening_mm[np.ix_(nearest_row, nearest_column)] - self._half_space_response()[nearest_offsets]
        # A symmetric compliance has equal responses at opposite offsets.
        return np.asarray(0.5 * (deviation + deviation[::-1, ::-1]))

    def _convolution(self, response: Floats, least_spectrum: float = -np.inf) -> Compliance:
        """Compliance with an equal response at every node."""
        half = self.grid.half
        return build_convolution(
            response[response.shape[0] // 2 :], self.grid.shape, half=half, least_spectrum=least_spectrum
        )


# --- Grids with several bands: regular nodes at each of several distant patches, and a few irregular nodes in the
# strips between them.
#
# Within a band, the compliance is equal at every node. Between two bands, and from and to a strip, it is the compliance
# of a half-space: a matrix across for each wave along x. The corrections of `contact.solver` start from this model and
# end at the compliance of the finite bodies.


@dataclass(frozen=True, kw_only=True, eq=False)
class Bands:
    """Compliances on a grid with several bands of regular columns.

    Pressures in MPa and openings in mm are arrays (n,) over all nodes of the grid.

    Attributes
    ----------
    grid
        Grid of all pressure nodes, with equal steps along x.
    columns
        Columns of each band.
    contact_modulus_MPa
        Contact modulus of the material of both bodies.

    Examples
    --------
    A single band is the whole grid:

    >>> import numpy as np
    >>> from fecontact.contact.elements import Bands
    >>> from fecontact.contact.grid import ContactGrid
    >>> from fecontact.contact.halfspace import build_half_space_compliance
    >>> grid = ContactGrid(x_mm=0.2 * np.arange(9), s_mm=0.2 * np.arange(9), half=False)
    >>> bands = Bands(grid=grid, columns=(slice(0, 9),), contact_modulus_MPa=115e3)
    >>> bool((bands.half_space()(np.ones(81)) == build_half_space_compliance(grid, 115e3)(np.ones(81))).all())
    True
    """

    grid: ContactGrid
    columns: tuple[slice, ...]
    contact_modulus_MPa: float

    @property
    def band_grids(self) -> list[ContactGrid]:
        """Uniform grid of each band."""
        grid = self.grid
        return [ContactGrid(x_mm=grid.x_mm, s_mm=grid.s_mm[columns], half=grid.half) for columns in self.columns]

    def half_space(self) -> Compliance:
        """Compliance of a pair of half-spaces on all nodes.

        Returns
        -------
        function
            Opening (n,) in mm under pressures (n,) in MPa.
        """
        return self.combine([build_half_space_compliance(grid, self.contact_modulus_MPa) for grid in self.band_grids])

    def responses(self, compliance: Compliance, *, beside: float = 0.0) -> list[UnitResponse]:
        """Response of each band to a unit pressure at its middle.

        Parameters
        ----------
        compliance
            Compliance on all nodes of the grid. It is called once for each band.
        beside
            Offset of the pressed node from the middle node, as a fraction of the length and of the width of the band.

        Returns
        -------
        list of UnitResponse
            In the order of the bands.
        """
        modulus = self.contact_modulus_MPa
        return [
            UnitResponse.of(
                self._restrict_to_columns(columns, compliance), grid, contact_modulus_MPa=modulus, beside=beside
            )
            for columns, grid in zip(self.columns, self.band_grids, strict=True)
        ]

    def combine(self, band_compliances: Sequence[Compliance]) -> Compliance:
        """Compliance on all nodes from the compliance of each band.

        Parameters
        ----------
        band_compliances
            Compliance on the nodes of each band, in the order of the bands.

        Returns
        -------
        Compliance
            Between two bands, and from and to a strip, it is the compliance of a half-space.
        """
        if len(band_compliances) == 1:
            return band_compliances[0]
        distant_opening, shape = self._half_space_between_bands(), self.grid.shape

        def apply(pressure: Floats) -> Floats:
            opening = distant_opening(pressure)
            for columns, compliance in zip(self.columns, band_compliances, strict=True):
                band_pressure = np.ascontiguousarray(pressure.reshape(shape)[:, columns])
                opening[:, columns] += compliance(band_pressure.ravel()).reshape(band_pressure.shape)
            return opening.ravel()

        return apply

    def _restrict_to_columns(self, columns: slice, compliance: Compliance) -> Compliance:
        """Compliance on the nodes of a band.

        The result maps pressures (n,) in MPa at the nodes of the band to openings (n,) in mm; there is no pressure
        outside the band. `columns` are its columns of the grid, and `compliance` belongs to the whole grid.
        """
        shape = self.grid.shape

        def apply(band_pressure: Floats) -> Floats:
            pressure = np.zeros(shape)
            pressure[:, columns] = band_pressure.reshape(shape[0], -1)
            return compliance(pressure.ravel()).reshape(shape)[:, columns].ravel()

        return apply

    def _half_space_between_bands(self) -> Compliance:
        """Opening of a half-space under pressures outside the band.

        The pressures outside a band are the pressures of the other bands and of the strips. The compliance returns an
        opening (nx, ns) in mm. The force is spread over the cell of the pressing node, and then over the cell of the
        responding node. The mean of both is a symmetric matrix, as is every compliance, and equals Love's matrix for
        equal cells.
        """
        (nodes_x, nodes_s), step_x = self.grid.shape, self.grid.steps_mm[0]
        rows = 2 * nodes_x - 1 if self.grid.half else nodes_x
        s = self.grid.s_mm
        cell_width = np.gradient(s)
        x_distance, s_distance = np.asarray(np.arange(rows)[:, None, None] * step_x), (s[:, None] - s)[None]
        unit_force_influence = love_influence(x_distance, s_distance, step_x, cell_width) / (step_x * cell_width)
        kernel = (
            0.5 * (unit_force_influence + unit_force_influence.transpose(0, 2, 1)) / (np.pi * self.contact_modulus_MPa)
        )
        for columns in self.columns:
            kernel[:, columns, columns] = 0.0
        length = next_fast_len(2 * rows - 1, real=True)
        periodic_kernel = np.zeros((length, nodes_s, nodes_s))
        periodic_kernel[:rows] = kernel
        periodic_kernel[length - rows + 1 :] = kernel[:0:-1]
        # The spectrum is real, because opposite offsets have equal influence.
        spectrum = rfft(periodic_kernel, axis=0).real

        def apply(pressure: Floats) -> Floats:
            """Opening (n,) in mm by pressures (n,) in MPa on the other bands."""
            force = pressure.reshape(nodes_x, nodes_s) * (step_x * cell_width)
            if self.grid.half:
                force = np.concatenate([force[:0:-1], force])
            force_waves = rfft(force, length, axis=0)
            opening_waves = np.matmul(spectrum, np.stack([force_waves.real, force_waves.imag], axis=-1))
            opening = irfft(opening_waves[..., 0] + 1j * opening_waves[..., 1], length, axis=0)[:rows]
            return np.ascontiguousarray(opening[rows - nodes_x :])

        return apply
