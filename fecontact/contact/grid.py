"""Grids of pressure nodes, fields on their nodes, and solved contacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.contact.solver import ContactSolution, ContactStatus

# Largest rounding error of a node position, as a fraction of a step or of the length of the grid.
_POSITION_ROUNDING = 1e-6
# Least distance between two bands, as a multiple of the sum of their steps.
_MIN_BAND_DISTANCE = 4.0
# Growth factor of successive cells between two bands.
_CELL_GROWTH_FACTOR = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactGrid:
    """Tensor grid of pressure nodes on the surface of the rail.

    In a half model x starts at 0, the plane of symmetry. The steps are equal, with two exceptions across the rail: on
    the nodes of the elements below distant patches (`contact.elements`), and on grids with `widths_mm`. Adjacent cells
    of equal width are a band. The cells do not cover the strip between two bands.

    Attributes
    ----------
    x_mm : ndarray of shape (nx,)
        Positions along the rail, from the first contact point.
    s_mm : ndarray of shape (ns,)
        Arc lengths across the rail, from the first contact point.
    half
        Whether the grid is a half model.
    widths_mm : ndarray of shape (ns,) or None
        Width of the cell of each node across the rail; None for equal steps.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.grid import ContactGrid
    >>> grid = ContactGrid(x_mm=np.arange(3.0), s_mm=0.5 * np.arange(4), half=False)
    >>> grid.shape, grid.steps_mm
    ((3, 4), (1.0, 0.5))
    >>> float(grid.nodal_area_mm2().sum())
    3.0
    """

    x_mm: Floats
    s_mm: Floats
    half: bool
    widths_mm: Floats | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Number of nodes along x and across."""
        return self.x_mm.size, self.s_mm.size

    @property
    def steps_mm(self) -> tuple[float, float]:
        """Spacing along x and across; the smallest spacing if it is not uniform."""
        return float(self.x_mm[1] - self.x_mm[0]), float(_equalise_steps(np.diff(self.s_mm)).min())

    @property
    def cells_mm(self) -> Floats:
        """Width across (ns,) of the cell of each node."""
        return np.full(self.s_mm.size, self.steps_mm[1]) if self.widths_mm is None else self.widths_mm

    @property
    def weights(self) -> Floats:
        """Relative widths (ns,) of the cells of the nodes across.

        The smallest width is the unit: all weights are 1 on equal steps.
        """
        return self.cells_mm / self.steps_mm[1]

    @property
    def bands(self) -> tuple[ContactGrid, ...]:
        """Bands of the grid, each with equal steps.

        A grid without `widths_mm` is a single band, and is returned unchanged.
        """
        if self.widths_mm is None:
            return (self,)
        spacing_between_cells = np.diff(self.s_mm) - 0.5 * (self.widths_mm[1:] + self.widths_mm[:-1])
        ends = np.flatnonzero(spacing_between_cells > 0.5 * self.steps_mm[1]) + 1
        return tuple(replace(self, s_mm=band_s_mm, widths_mm=None) for band_s_mm in np.split(self.s_mm, ends))

    def nodal_area_mm2(self) -> Floats:
        """Area (n,) of each node in the model, the integral of its shape function.

        It is not doubled by symmetry. With `widths_mm`, it is the area of the cell of the node.

        Returns
        -------
        ndarray of shape (n,)
            Areas in mm^2, in the order of the nodes.
        """
        widths = _cell_lengths(self.s_mm) if self.widths_mm is None else self.widths_mm
        return np.outer(_cell_lengths(self.x_mm), widths).ravel()

    def whole_area_mm2(self) -> Floats:
        """Area (n,) of each node in the whole contact: doubled in a half model.

        Returns
        -------
        ndarray of shape (n,)
            Areas in mm^2, in the order of the nodes.
        """
        return self.nodal_area_mm2() * (2.0 if self.half else 1.0)

    def weighted_mean(self, values_at: Callable[[Floats, Floats], Floats]) -> Floats:
        """Nodal means of a function, weighted by the dual shape functions.

        The mean of node i is the integral of psi_i f, divided by D_i, with three Gauss points in each cell and
        direction.

        Parameters
        ----------
        values_at
            Function from x (m, 1) and s (1, k) in mm to values (m, k).

        Returns
        -------
        array (n,)
            Mean at each node, in the unit of the function.
        """
        legendre_points, gauss_weights = np.polynomial.legendre.leggauss(3)
        gauss_points = 0.5 + 0.5 * legendre_points
        dual_weights = 0.5 * gauss_weights * np.array([2.0 - 3.0 * gauss_points, 3.0 * gauss_points - 1.0])
        gauss_x = (self.x_mm[:-1, None] + np.diff(self.x_mm)[:, None] * gauss_points).ravel()
        gauss_s = (self.s_mm[:-1, None] + np.diff(self.s_mm)[:, None] * gauss_points).ravel()
        cell_values = np.asarray(values_at(gauss_x[:, None], gauss_s[None, :])).reshape(
            self.x_mm.size - 1, 3, self.s_mm.size - 1, 3
        )
        corner_integrals = np.einsum("aq,iqjr,br->iajb", dual_weights, cell_values, dual_weights)
        corner_integrals *= np.outer(np.diff(self.x_mm), np.diff(self.s_mm))[:, None, :, None]
        node_integrals = np.zeros(self.shape)
        for corner_x in (0, 1):
            for corner_s in (0, 1):
                node_integrals[
                    corner_x : node_integrals.shape[0] - 1 + corner_x, corner_s : node_integrals.shape[1] - 1 + corner_s
                ] += corner_integrals[:, corner_x, :, corner_s]
        return node_integrals.ravel() / self.nodal_area_mm2()


def build_banded_grid(x_mm: Floats, band_positions_mm: Sequence[Floats], *, half: bool) -> ContactGrid:
    """Build a grid from bands of nodes with equal steps.

    Parameters
    ----------
    x_mm : ndarray of shape (nx,)
        Positions of the nodes along x.
    band_positions_mm
        Positions across of the nodes of each band, in ascending order of the bands.
    half
        Whether the grid is a half model.

    Returns
    -------
    ContactGrid
        Grid with the bands. If two bands are close together, the grid is uniform instead, with the smallest of their
        steps.
    """
    steps = [float(positions[1] - positions[0]) for positions in band_positions_mm]
    widths = np.repeat(steps, [positions.size for positions in band_positions_mm])
    banded_grid = ContactGrid(x_mm=x_mm, s_mm=np.concatenate(band_positions_mm), half=half, widths_mm=widths)
    pairs = zip(pairwise(band_positions_mm), pairwise(steps), strict=True)
    if all(
        high_band[0] - low_band[-1] > _MIN_BAND_DISTANCE * sum(neighbour_steps)
        for (low_band, high_band), neighbour_steps in pairs
    ):
        return banded_grid
    low, high, step = (
        min(positions[0] for positions in band_positions_mm),
        max(positions[-1] for positions in band_positions_mm),
        min(steps),
    )
    return ContactGrid(x_mm=x_mm, s_mm=np.asarray(low + step * np.arange(round((high - low) / step) + 1)), half=half)


def _equalise_steps(steps: Floats) -> Floats:
    """Set all steps to the first step if they differ by rounding only."""
    return np.where(np.abs(steps - steps[0]) <= 1e-9 * steps[0], steps[0], steps)


def evaluate_hat_functions(nodes: Floats, positions: Floats) -> Floats:
    """Linear shape functions of nodes at given positions.

    Parameters
    ----------
    nodes : ndarray of shape (n,)
        Positions of the nodes, increasing.
    positions : ndarray of shape (m,)
        Positions at which the shape functions are evaluated.

    Returns
    -------
    array (n, m)
        Value of the shape function of each node at each position, from 0 to 1.
    """
    steps, offsets = _equalise_steps(np.diff(nodes)), positions - nodes[:, None]
    steps_before, steps_after = np.insert(steps, 0, steps[0])[:, None], np.append(steps, steps[-1])[:, None]
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(offsets) / np.where(offsets < 0.0, steps_before, steps_after)))


def integrate_hat_functions(nodes: Floats, ends: Floats) -> Floats:
    """Integrals of linear shape functions between successive positions.

    Parameters
    ----------
    nodes : ndarray of shape (n,)
        Positions of the nodes, increasing, in mm.
    ends : ndarray of shape (m,)
        Ends of the intervals, increasing, in mm.

    Returns
    -------
    array (n, m - 1)
        Integral of the shape function of each node over each interval, in mm.
    """
    steps, offsets = _equalise_steps(np.diff(nodes)), ends - nodes[:, None]
    steps_before, steps_after = np.insert(steps, 0, steps[0])[:, None], np.append(steps, steps[-1])[:, None]
    rising, falling = np.clip(offsets + steps_before, 0.0, steps_before), np.clip(offsets, 0.0, steps_after)
    return np.diff(rising**2 / (2.0 * steps_before) + falling - falling**2 / (2.0 * steps_after), axis=1)


def _cell_lengths(x: Floats) -> Floats:
    """Half the sum of the steps on both sides of each node."""
    step = np.diff(x)
    return 0.5 * (np.append(step, 0.0) + np.insert(step, 0, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Field:
    """Values (nx, ns, ...) on the nodes of a grid.

    Attributes
    ----------
    grid
        Grid with the nodes.
    values : ndarray of shape (nx, ns, ...)
        Values on the nodes, in any unit.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.grid import ContactGrid, Field
    >>> grid = ContactGrid(x_mm=np.arange(3.0), s_mm=np.arange(2.0), half=True)
    >>> Field.of_nodes(grid, np.arange(6)).whole().values[:, 0]
    array([4, 2, 0, 2, 4])
    """

    grid: ContactGrid
    values: NDArray[Any]

    @classmethod
    def of_nodes(cls, grid: ContactGrid, values: NDArray[Any]) -> Field:
        """Field from values (n, ...) in the order of the nodes.

        Parameters
        ----------
        grid
            Grid with n nodes.
        values : ndarray of shape (n, ...)
            Values on the nodes.

        Returns
        -------
        Field
            The values in the shape of the grid.
        """
        return cls(grid=grid, values=values.reshape(*grid.shape, *values.shape[1:]))

    def whole(self) -> Field:
        """Field on both halves of a half model.

        The field is even: the second half is the mirror image of the first half at x = 0. The field of a whole model is
        unchanged.

        Returns
        -------
        Field
            Field on the whole grid.
        """
        grid = self.grid
        if not grid.half:
            return self
        x = np.concatenate([-grid.x_mm[:0:-1], grid.x_mm])
        whole_grid = replace(grid, x_mm=x, half=False)
        return Field(grid=whole_grid, values=np.concatenate([self.values[:0:-1], self.values]))

    def even(self) -> Field:
        """Field on equal steps across, linear between its nodes.

        Returns
        -------
        Field
            Field with the smallest step of the grid; unchanged if the steps are equal.
        """
        grid = self.grid
        if np.ptp(_equalise_steps(np.diff(grid.s_mm))) == 0.0:
            return self
        step = grid.steps_mm[1]
        s = grid.s_mm[0] + step * np.arange(np.floor(np.ptp(grid.s_mm) / step + _POSITION_ROUNDING) + 1)
        even_grid = ContactGrid(x_mm=grid.x_mm, s_mm=np.asarray(s), half=grid.half)
        return Field(grid=even_grid, values=self.values @ evaluate_hat_functions(grid.s_mm, s))

    def covering(self, length_x_mm: float, length_s_mm: float) -> Field:
        """Extend the whole field by zeros over a box around the origin.

        The extension has the steps of the grid at its ends. The strips between bands have zeros, too, on cells that
        grow from both sides.

        Parameters
        ----------
        length_x_mm, length_s_mm
            Full lengths of the box.

        Returns
        -------
        Field
            Both halves of the field, on a grid that covers the box.
        """
        field = self.whole()._fill_between_bands()
        x, added_x = _extend_nodes(field.grid.x_mm, 0.5 * length_x_mm)
        s, added_s = _extend_nodes(field.grid.s_mm, 0.5 * length_s_mm)
        no_padding = ((0, 0),) * (field.values.ndim - 2)
        widths = None if field.grid.widths_mm is None else np.pad(field.grid.widths_mm, added_s, mode="edge")
        grid = ContactGrid(x_mm=x, s_mm=s, half=False, widths_mm=widths)
        return Field(grid=grid, values=np.pad(field.values, (added_x, added_s, *no_padding)))

    def at(self, grid: ContactGrid) -> Field:
        """Interpolate the field linearly to the nodes of a different grid.

        Parameters
        ----------
        grid
            Grid with the new nodes.

        Returns
        -------
        Field
            Values (nx, ns); zero outside the nodes of this field.
        """
        node_grid = self.grid
        if np.array_equal(node_grid.x_mm, grid.x_mm) and np.array_equal(node_grid.s_mm, grid.s_mm):
            return Field(grid=grid, values=self.values)
        shapes_x, shapes_s = (
            evaluate_hat_functions(node_grid.x_mm, grid.x_mm),
            evaluate_hat_functions(node_grid.s_mm, grid.s_mm),
        )
        is_inside = np.outer(_is_within(node_grid.x_mm, grid.x_mm), _is_within(node_grid.s_mm, grid.s_mm))
        return Field(grid=grid, values=np.where(is_inside, shapes_x.T @ self.values @ shapes_s, 0.0))

    def _fill_between_bands(self) -> Field:
        """Field with zeros on cells between its bands.

        The widths of the new cells grow from one band and shrink to the next band. A field on a single band is returned
        unchanged.
        """
        bands = self.grid.bands
        if len(bands) == 1:
            return self
        positions, widths, value_columns = [bands[0].s_mm], [bands[0].cells_mm], [self.values[:, : bands[0].s_mm.size]]
        for previous, band in pairwise(bands):
            ends = _grow_cells(
                _cell_ends(previous.s_mm)[-1], _cell_ends(band.s_mm)[0], previous.steps_mm[1], band.steps_mm[1]
            )
            first = sum(values.shape[1] for values in value_columns[::2])
            positions += [0.5 * (ends[1:] + ends[:-1]), band.s_mm]
            widths += [np.diff(ends), band.cells_mm]
            zeros = np.zeros((self.values.shape[0], ends.size - 1, *self.values.shape[2:]))
            value_columns += [zeros, self.values[:, first : first + band.s_mm.size]]
        grid = replace(self.grid, s_mm=np.concatenate(positions), widths_mm=np.concatenate(widths))
        return Field(grid=grid, values=np.concatenate(value_columns, axis=1))


def _is_within(nodes: Floats, positions: Floats) -> NDArray[np.bool_]:
    """Mask (m,) of the positions between the first and the last node, up to rounding."""
    slack = _POSITION_ROUNDING * (nodes[-1] - nodes[0])
    return np.asarray((positions >= nodes[0] - slack) & (positions <= nodes[-1] + slack))


def _grow_cells(low: float, high: float, first_width: float, last_width: float) -> Floats:
    """Ends (n,) in mm of growing cells between two bands.

    Parameters
    ----------
    low, high
        Ends of the gap between the bands in mm; both are in the result.
    first_width, last_width
        Widths in mm of the last cell of the first band and of the first cell of the second band. Cells grow from both.
    """
    low_ends, high_ends, sizes = [low], [high], [_CELL_GROWTH_FACTOR * first_width, _CELL_GROWTH_FACTOR * last_width]
    while high_ends[-1] - low_ends[-1] > sum(sizes):
        if sizes[0] <= sizes[1]:
            low_ends.append(low_ends[-1] + sizes[0])
            sizes[0] *= _CELL_GROWTH_FACTOR
        else:
            high_ends.append(high_ends[-1] - sizes[1])
            sizes[1] *= _CELL_GROWTH_FACTOR
    return np.array(low_ends + high_ends[::-1])


def _extend_nodes(nodes: Floats, reach: float) -> tuple[Floats, tuple[int, int]]:
    """Extend nodes beyond -reach and reach with the steps at their ends.

    The numbers of added nodes at both ends are returned too.
    """
    step, last_step = float(nodes[1] - nodes[0]), float(nodes[-1] - nodes[-2])
    count_before = max(0, int(np.ceil((reach + nodes[0]) / step)) + 1)
    count_after = max(0, int(np.ceil((reach - nodes[-1]) / last_step)) + 1)
    low_nodes, high_nodes = (
        nodes[0] - step * np.arange(count_before, 0, -1),
        nodes[-1] + last_step * np.arange(1, count_after + 1),
    )
    return np.concatenate([low_nodes, nodes, high_nodes]), (count_before, count_after)


# --- Solved contact on a grid of pressure nodes: a rung of the ladder from Hertz to the finite elements.


@dataclass(frozen=True, kw_only=True, eq=False)
class Rung:
    """Pressure and gap of a solved contact, and its residuals.

    Attributes
    ----------
    grid
        Grid of the pressure nodes.
    pressure_MPa, gap_mm : ndarray of shape (nx, ns)
        Pressure and deformed gap on the grid; in a half model for x >= 0 only.
    approach_mm
        Approach of the bodies along the contact normal at first touch.
    normal_force_N
        Force of the pressure of the whole contact along the contact normal.
    status, iterations, compliance_calls, contact_residual, penetration_residual, load_balance
        As in `ContactSolution`.
    """

    grid: ContactGrid
    pressure_MPa: Floats
    gap_mm: Floats
    approach_mm: float
    normal_force_N: float
    status: ContactStatus
    iterations: int
    compliance_calls: int
    contact_residual: float
    penetration_residual: float
    load_balance: float

    @classmethod
    def of(
        cls, grid: ContactGrid, solution: ContactSolution, *, approach_mm: float, upright: Floats | None = None
    ) -> Rung:
        """Create a rung from a solution on the nodes of a grid.

        Parameters
        ----------
        grid
            Grid of the pressure nodes.
        solution
            Pressure and gap (n,) at the nodes of the grid.
        approach_mm
            Approach of the bodies along the contact normal at first touch.
        upright : ndarray of shape (n,) or None
            Cosine between the normal of each node and the contact normal; 1 everywhere by default.

        Returns
        -------
        Rung
            The solved contact, with the force along the contact normal.
        """
        area = grid.whole_area_mm2()
        return cls(
            grid=grid,
            pressure_MPa=Field.of_nodes(grid, solution.pressure_MPa).values,
            gap_mm=Field.of_nodes(grid, solution.gap_mm).values,
            approach_mm=approach_mm,
            normal_force_N=float(np.dot(area if upright is None else area * upright, solution.pressure_MPa)),
            status=solution.status,
            iterations=solution.iterations,
            compliance_calls=solution.compliance_calls,
            contact_residual=solution.contact_residual,
            penetration_residual=solution.penetration_residual,
            load_balance=solution.load_balance,
        )

    @property
    def pressure(self) -> Field:
        """Pressure as a field."""
        return Field(grid=self.grid, values=self.pressure_MPa)

    def even(self) -> Rung:
        """Contact on equal steps across, for evaluations that need them.

        Returns
        -------
        Rung
            Interpolated contact; unchanged if the steps are equal.
        """
        pressure = self.pressure.even()
        gap = Field(grid=self.grid, values=self.gap_mm).even()
        return (
            self
            if pressure.grid is self.grid
            else replace(self, grid=pressure.grid, pressure_MPa=pressure.values, gap_mm=gap.values)
        )

    @property
    def residual(self) -> float:
        """Sum of contact and penetration residual, relative to the approach."""
        return self.contact_residual + self.penetration_residual


def calculate_misplaced_load(nodal: Rung, fine: Rung) -> float:
    """Misplaced load of a contact on the nodes of the elements.

    It is the fraction of the load at different positions than in the contact on finer nodes. A nodal pressure is the
    mean over the shape function of the node. It is compared with such means of the finer pressure, which is constant
    over the cells of its nodes. The elements may also be smaller than these cells.

    Parameters
    ----------
    nodal
        Contact on the nodes of the elements.
    fine
        Contact on finer nodes.

    Returns
    -------
    float
        Fraction of the load, from 0 to 1.
    """
    grid, pressure = nodal.pressure.whole().grid, nodal.pressure.whole().values
    fine_field = fine.pressure.whole()
    integrals_x = integrate_hat_functions(grid.x_mm, _cell_ends(fine_field.grid.x_mm))
    integrals_s = np.hstack(
        [integrate_hat_functions(grid.s_mm, _cell_ends(band.s_mm)) for band in fine_field.grid.bands]
    )
    area = grid.nodal_area_mm2().reshape(grid.shape)
    force = integrals_x @ fine_field.values @ integrals_s.T
    return float(0.5 * np.abs(area * pressure - force).sum() / force.sum())


def _cell_ends(nodes: Floats) -> Floats:
    """Ends (n + 1,) of the cells around n nodes with equal steps."""
    step = float(nodes[1] - nodes[0])
    return np.append(nodes - 0.5 * step, nodes[-1] + 0.5 * step)
