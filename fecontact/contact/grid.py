"""The grid of pressure nodes, fields on it, and a contact solved on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.contact.solver import ContactSolution, ContactStatus

# A last node that lies on a step but for rounding is there.
_ROUNDING = 1e-6
# Bands lie so many of both their steps apart.
_LEAST_BETWEEN = 4.0
# How cells grow from a band into what lies between two.
_GROWTH = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactGrid:
    """Tensor grid of pressure nodes on the rail's surface: x (nx,) and arc length s (ns,) from first touch (mm).

    In a half model x starts at 0, the plane of symmetry. Steps are equal, except across on the elements' nodes below
    patches far apart (`contact.elements`), and where `widths_mm` (ns,) are given: they are the widths across of the
    nodes' cells. Cells of equal width side by side are a band, and nothing is covered between two bands.
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
        return float(self.x_mm[1] - self.x_mm[0]), float(_even(np.diff(self.s_mm)).min())

    @property
    def cells_mm(self) -> Floats:
        """Width across (ns,) of each node's cell."""
        return np.full(self.s_mm.size, self.steps_mm[1]) if self.widths_mm is None else self.widths_mm

    @property
    def weights(self) -> Floats:
        """Widths of the nodes' cells across (ns,) over the least of them: 1 in equal steps."""
        return self.cells_mm / self.steps_mm[1]

    @property
    def bands(self) -> tuple[ContactGrid, ...]:
        """The bands of a grid whose cells have widths of their own, each in equal steps; itself if it is one."""
        if self.widths_mm is None:
            return (self,)
        free = np.diff(self.s_mm) - 0.5 * (self.widths_mm[1:] + self.widths_mm[:-1])
        ends = np.flatnonzero(free > 0.5 * self.steps_mm[1]) + 1
        return tuple(replace(self, s_mm=s, widths_mm=None) for s in np.split(self.s_mm, ends))

    def nodal_area_mm2(self) -> Floats:
        """Area int N_i (n,) of each node in the model, not doubled by symmetry; of a cell if cells have widths."""
        across = _line_areas(self.s_mm) if self.widths_mm is None else self.widths_mm
        return np.outer(_line_areas(self.x_mm), across).ravel()

    def whole_area_mm2(self) -> Floats:
        """Area (n,) that each node stands for in the whole contact: doubled in a half model."""
        return self.nodal_area_mm2() * (2.0 if self.half else 1.0)

    def weighted_mean(self, values_at: Callable[[Floats, Floats], Floats]) -> Floats:
        """Mean (n,) of a function of (x, s) weighted by the dual shape functions: int psi_i f / D_i.

        Three Gauss points in each cell and direction.
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


def in_bands(x_mm: Floats, lines_mm: Sequence[Floats], *, half: bool) -> ContactGrid:
    """A grid of bands in the order of their places; of one in the least of their steps where two come together."""
    steps = [float(line[1] - line[0]) for line in lines_mm]
    widths = np.repeat(steps, [line.size for line in lines_mm])
    grid = ContactGrid(x_mm=x_mm, s_mm=np.concatenate(lines_mm), half=half, widths_mm=widths)
    pairs = zip(pairwise(lines_mm), pairwise(steps), strict=True)
    if all(after[0] - before[-1] > _LEAST_BETWEEN * sum(both) for (before, after), both in pairs):
        return grid
    low, high, step = min(line[0] for line in lines_mm), max(line[-1] for line in lines_mm), min(steps)
    return ContactGrid(x_mm=x_mm, s_mm=np.asarray(low + step * np.arange(round((high - low) / step) + 1)), half=half)


def _even(steps: Floats) -> Floats:
    """Steps without rounding: all equal to the first step if they differ by rounding only."""
    return np.where(np.abs(steps - steps[0]) <= 1e-9 * steps[0], steps[0], steps)


def hat_functions(line: Floats, places: Floats) -> Floats:
    """Linear shape functions (n, m) of the n nodes of a line at m places."""
    steps, away = _even(np.diff(line)), places - line[:, None]
    before, after = np.insert(steps, 0, steps[0])[:, None], np.append(steps, steps[-1])[:, None]
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(away) / np.where(away < 0.0, before, after)))


def hat_integrals(line: Floats, ends: Floats) -> Floats:
    """Integrals (n, m - 1) of the linear shape functions of a line of n nodes, from each of m places to the next."""
    steps, beyond = _even(np.diff(line)), ends - line[:, None]
    before, after = np.insert(steps, 0, steps[0])[:, None], np.append(steps, steps[-1])[:, None]
    rising, falling = np.clip(beyond + before, 0.0, before), np.clip(beyond, 0.0, after)
    return np.diff(rising**2 / (2.0 * before) + falling - falling**2 / (2.0 * after), axis=1)


def _line_areas(x: Floats) -> Floats:
    step = np.diff(x)
    return 0.5 * (np.append(step, 0.0) + np.insert(step, 0, 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Field:
    """Values (nx, ns, ...) on the nodes of a grid."""

    grid: ContactGrid
    values: NDArray[Any]

    @classmethod
    def of_nodes(cls, grid: ContactGrid, values: NDArray[Any]) -> Field:
        """Field of values (n, ...) in the order of the nodes."""
        return cls(grid=grid, values=values.reshape(*grid.shape, *values.shape[1:]))

    def whole(self) -> Field:
        """Both halves of a half model: the field is even, so that the other half is its mirror image at x = 0."""
        grid = self.grid
        if not grid.half:
            return self
        x = np.concatenate([-grid.x_mm[:0:-1], grid.x_mm])
        whole = replace(grid, x_mm=x, half=False)
        return Field(grid=whole, values=np.concatenate([self.values[:0:-1], self.values]))

    def even(self) -> Field:
        """The field on equal steps across, as small as the grid's smallest step, linear between its nodes."""
        grid = self.grid
        if np.ptp(_even(np.diff(grid.s_mm))) == 0.0:
            return self
        step = grid.steps_mm[1]
        s = grid.s_mm[0] + step * np.arange(np.floor(np.ptp(grid.s_mm) / step + _ROUNDING) + 1)
        even = ContactGrid(x_mm=grid.x_mm, s_mm=np.asarray(s), half=grid.half)
        return Field(grid=even, values=self.values @ hat_functions(grid.s_mm, s))

    def covering(self, length_x_mm: float, length_s_mm: float) -> Field:
        """Both halves, continued by zeros in the grid's steps past a box of these lengths around the origin.

        Between bands there are zeros, too, on cells that grow from either side.
        """
        field = self.whole()._filled()
        x, more_x = _continued(field.grid.x_mm, 0.5 * length_x_mm)
        s, more_s = _continued(field.grid.s_mm, 0.5 * length_s_mm)
        rest = ((0, 0),) * (field.values.ndim - 2)
        widths = None if field.grid.widths_mm is None else np.pad(field.grid.widths_mm, more_s, mode="edge")
        grid = ContactGrid(x_mm=x, s_mm=s, half=False, widths_mm=widths)
        return Field(grid=grid, values=np.pad(field.values, (more_x, more_s, *rest)))

    def at(self, grid: ContactGrid) -> Field:
        """The field (nx, ns) at the nodes of another grid: linear between its own nodes, zero outside."""
        own = self.grid
        if np.array_equal(own.x_mm, grid.x_mm) and np.array_equal(own.s_mm, grid.s_mm):
            return Field(grid=grid, values=self.values)
        along, across = hat_functions(own.x_mm, grid.x_mm), hat_functions(own.s_mm, grid.s_mm)
        inside = np.outer(_is_within(own.x_mm, grid.x_mm), _is_within(own.s_mm, grid.s_mm))
        return Field(grid=grid, values=np.where(inside, along.T @ self.values @ across, 0.0))

    def _filled(self) -> Field:
        """The field with zeros on cells between its bands."""
        bands = self.grid.bands
        if len(bands) == 1:
            return self
        s, widths, columns = [bands[0].s_mm], [bands[0].cells_mm], [self.values[:, : bands[0].s_mm.size]]
        for before, band in pairwise(bands):
            ends = _growing(_cell_ends(before.s_mm)[-1], _cell_ends(band.s_mm)[0], before.steps_mm[1], band.steps_mm[1])
            first = sum(part.shape[1] for part in columns[::2])
            s += [0.5 * (ends[1:] + ends[:-1]), band.s_mm]
            widths += [np.diff(ends), band.cells_mm]
            between = np.zeros((self.values.shape[0], ends.size - 1, *self.values.shape[2:]))
            columns += [between, self.values[:, first : first + band.s_mm.size]]
        grid = replace(self.grid, s_mm=np.concatenate(s), widths_mm=np.concatenate(widths))
        return Field(grid=grid, values=np.concatenate(columns, axis=1))


def _is_within(line: Floats, places: Floats) -> NDArray[np.bool_]:
    """Whether places lie on a line of nodes, up to rounding."""
    slack = _ROUNDING * (line[-1] - line[0])
    return np.asarray((places >= line[0] - slack) & (places <= line[-1] + slack))


def _growing(low: float, high: float, first: float, last: float) -> Floats:
    """Ends of cells from one place to another, which grow from the widths of the cells beside them."""
    rising, falling, sizes = [low], [high], [_GROWTH * first, _GROWTH * last]
    while falling[-1] - rising[-1] > sum(sizes):
        if sizes[0] <= sizes[1]:
            rising.append(rising[-1] + sizes[0])
            sizes[0] *= _GROWTH
        else:
            falling.append(falling[-1] - sizes[1])
            sizes[1] *= _GROWTH
    return np.array(rising + falling[::-1])


def _continued(line: Floats, reach: float) -> tuple[Floats, tuple[int, int]]:
    """A line, continued past -reach and reach in the steps of its ends, and the number of steps added at each end."""
    step, at_end = float(line[1] - line[0]), float(line[-1] - line[-2])
    before = max(0, int(np.ceil((reach + line[0]) / step)) + 1)
    after = max(0, int(np.ceil((reach - line[-1]) / at_end)) + 1)
    low, high = line[0] - step * np.arange(before, 0, -1), line[-1] + at_end * np.arange(1, after + 1)
    return np.concatenate([low, line, high]), (before, after)


# --- A solved contact on a grid of pressure nodes: a rung of the ladder from Hertz to the finite elements.


@dataclass(frozen=True, kw_only=True, eq=False)
class Rung:
    """Pressure and gap of a solved contact, and its residuals.

    Attributes
    ----------
    pressure_MPa, gap_mm (nx, ns)
        Pressure and deformed gap on the grid; in a half model for x >= 0 only.
    approach_mm
        Approach of the bodies along the contact normal at first touch.
    normal_force_N
        Force along the contact normal that the pressure of the whole contact carries.
    contact_residual, penetration_residual, load_balance, iterations, compliance_calls
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
        """Rung from a solution on the nodes of a grid.

        Parameters
        ----------
        upright (n,)
            Cosine between each node's normal and the contact normal; 1 everywhere if not given.
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
        """The pressure as a field."""
        return Field(grid=self.grid, values=self.pressure_MPa)

    def even(self) -> Rung:
        """The contact on equal steps across, as evaluations need it; unchanged if the steps are equal."""
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


def misfit(nodal: Rung, fine: Rung) -> float:
    """Part of the load that lies elsewhere on the elements' nodes than on finer nodes, for one contact.

    A nodal pressure is the mean over the node's shape function, and is compared with such means of the finer pressure,
    which is constant over the cells of its nodes. The elements may also be finer than these cells.
    """
    grid, pressure = nodal.pressure.whole().grid, nodal.pressure.whole().values
    finer = fine.pressure.whole()
    over_x = hat_integrals(grid.x_mm, _cell_ends(finer.grid.x_mm))
    over_s = np.hstack([hat_integrals(grid.s_mm, _cell_ends(band.s_mm)) for band in finer.grid.bands])
    area = grid.nodal_area_mm2().reshape(grid.shape)
    force = over_x @ finer.values @ over_s.T
    return float(0.5 * np.abs(area * pressure - force).sum() / force.sum())


def _cell_ends(line: Floats) -> Floats:
    """Ends of the cells around the nodes of a uniform line, one more than nodes."""
    step = float(line[1] - line[0])
    return np.append(line - 0.5 * step, line[-1] + 0.5 * step)
