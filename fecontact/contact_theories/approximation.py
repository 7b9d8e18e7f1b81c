"""Contact predicted by a theory: patches and pressures.

They are evaluated like the pressures of a solved contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats, find_runs
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.gap_line import StripContact, TheoryStatus
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.poses import ContactPoint

# Number of points per cell and direction for the mean of a pressure over a cell.
_POINTS_PER_CELL = 5


class PressureShape(Protocol):
    """Pressure over the positions of a patch by a theory."""

    def pressure_MPa(self, x_mm: Floats, y_mm: Floats, /) -> Floats:
        """Pressure at positions along and across, from the origin of the shape.

        Parameters
        ----------
        x_mm, y_mm
            Positions along and across in mm; shapes that broadcast together.

        Returns
        -------
        ndarray
            Pressure in MPa at each position, zero outside the patch.
        """


@dataclass(frozen=True, kw_only=True)
class TheoryPatch:
    """Patch predicted by a theory; positions (x, s) in mm from the first contact point.

    Attributes
    ----------
    shape, origin_mm
        Pressure of the patch, and position of the origin of the shape.
    normal_force_N
        Force on the patch.
    p_max_MPa, area_mm2, a_mm, b_mm
        Peak pressure, area and half-widths of the patch.
    centre_mm
        Centre of pressure.
    low_mm, high_mm
        Smallest and largest (x, s) of the patch.
    contact_point_number, touch
        Number of the contact point of the patch, and this contact point; None for theories without contact points.
    """

    shape: PressureShape
    normal_force_N: float
    p_max_MPa: float
    area_mm2: float
    a_mm: float
    b_mm: float
    origin_mm: tuple[float, float]
    centre_mm: tuple[float, float]
    low_mm: tuple[float, float]
    high_mm: tuple[float, float]
    contact_point_number: int | None = None
    touch: ContactPoint | None = None

    @property
    def hertz(self) -> HertzContact | None:
        """Ellipse of the patch; None for a patch of a different shape."""
        return self.shape if isinstance(self.shape, HertzContact) else None


def patch_from_ellipse(hertz: HertzContact, centre_mm: tuple[float, float] = (0.0, 0.0)) -> TheoryPatch:
    """Create a patch from Hertz's ellipse.

    Parameters
    ----------
    hertz
        The ellipse; its axes may be turned.
    centre_mm
        Position (x, s) of the centre.

    Returns
    -------
    TheoryPatch
        Patch with a along x and b across, also for turned axes.

    Examples
    --------
    >>> import math
    >>> from fecontact.contact_theories.approximation import patch_from_ellipse
    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> hertz = hertz_ellipse(0.005, 0.005, normal_force_N=1e3, contact_modulus_MPa=115e3)
    >>> math.isclose(patch_from_ellipse(hertz).area_mm2, math.pi * hertz.a_mm * hertz.b_mm)
    True
    """
    (x, s), a, b = centre_mm, 0.5 * hertz.extent_x_mm, 0.5 * hertz.extent_y_mm
    return TheoryPatch(
        shape=hertz,
        normal_force_N=hertz.normal_force_N,
        p_max_MPa=hertz.p0_MPa,
        area_mm2=hertz.area_mm2,
        a_mm=a,
        b_mm=b,
        origin_mm=centre_mm,
        centre_mm=centre_mm,
        low_mm=(x - a, s - b),
        high_mm=(x + a, s + b),
    )


@dataclass(frozen=True, kw_only=True)
class TheoryContact:
    """Contact predicted by a theory: its patches, in descending order of their forces.

    Attributes
    ----------
    patches
        Patches of the contact.
    approach_mm
        Approach along the contact normal at first touch.
    overlapping
        Whether two patches overlap, so that they are not separate patches.
    status, notes
        Status of the answer of the theory, and its explanation.
    solutions
        Number of approaches with this force.

    Examples
    --------
    >>> from fecontact.contact_theories.approximation import TheoryContact
    >>> from fecontact.contact_theories.hertz import hertz_ellipse
    >>> hertz = hertz_ellipse(0.005, 0.005, normal_force_N=1e3, contact_modulus_MPa=115e3)
    >>> contact = TheoryContact.of(hertz)
    >>> contact.half_widths_mm == (hertz.a_mm, hertz.b_mm)
    True
    """

    patches: tuple[TheoryPatch, ...]
    approach_mm: float
    overlapping: bool = False
    status: TheoryStatus = "solved"
    notes: tuple[str, ...] = ()
    solutions: int = 1

    @property
    def definite(self) -> bool:
        """Whether the contact is the answer of the theory.

        It is false for one of several solutions, and for iterations that did not converge.
        """
        return self.status in ("solved", "out of range")

    @classmethod
    def of(cls, hertz: HertzContact) -> TheoryContact:
        """Contact with Hertz's ellipse at the first contact point.

        Parameters
        ----------
        hertz
            Hertz's ellipse with its force.

        Returns
        -------
        TheoryContact
            A single patch at the origin, with the approach of the ellipse.
        """
        return cls(patches=(patch_from_ellipse(hertz),), approach_mm=hertz.approach_mm)

    @property
    def single(self) -> TheoryPatch | None:
        """The only patch; None for several patches."""
        return self.patches[0] if len(self.patches) == 1 else None

    @property
    def normal_force_N(self) -> float:
        """Sum of the forces on all patches."""
        return sum(patch.normal_force_N for patch in self.patches)

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Centre of pressure (x, s)."""
        total_force = self.normal_force_N
        x, s = (
            sum(patch.normal_force_N / total_force * patch.centre_mm[axis] for patch in self.patches) for axis in (0, 1)
        )
        return x, s

    @property
    def half_widths_mm(self) -> tuple[float, float]:
        """Half-widths (a, b) of the contact.

        For several patches they are calculated from the second moments of all pressures together.
        """
        if self.single is not None:
            return self.single.a_mm, self.single.b_mm
        total_force, centre = self.normal_force_N, self.centre_mm
        # <x^2> of an ellipse is its squared half-width divided by 5.
        a, b = (
            math.sqrt(
                5.0
                * sum(
                    patch.normal_force_N
                    / total_force
                    * ((patch.centre_mm[axis] - centre[axis]) ** 2 + half_width**2 / 5.0)
                    for patch, half_width in ((patch, (patch.a_mm, patch.b_mm)[axis]) for patch in self.patches)
                )
            )
            for axis in (0, 1)
        )
        return a, b

    @property
    def box_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Smallest and largest (x, s) of all patches."""
        low, high = (
            [[getattr(patch, attribute)[axis] for patch in self.patches] for axis in (0, 1)]
            for attribute in ("low_mm", "high_mm")
        )
        return (min(low[0]), min(low[1])), (max(high[0]), max(high[1]))

    @property
    def extents_mm(self) -> tuple[float, float]:
        """Full lengths along x and across, from end to end."""
        low, high = self.box_mm
        return high[0] - low[0], high[1] - low[1]

    def on(self, grid: ContactGrid, moved_mm: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Pressure of all patches on the nodes of a grid.

        Parameters
        ----------
        grid
            Grid of the nodes.
        moved_mm
            Shift (x, s) of all patches together.

        Returns
        -------
        array (nx, ns)
            Pressure in MPa, averaged over the cell of each node.
        """
        (dx, ds) = moved_mm
        pressure = np.zeros(grid.shape)
        for patch in self.patches:
            covered = _covered_nodes(grid, patch, moved_mm)
            covered_grid = replace(
                grid, x_mm=grid.x_mm[covered[0]], s_mm=grid.s_mm[covered[1]], widths_mm=grid.cells_mm[covered[1]]
            )
            pressure[covered] += average_pressure_over_cells(
                covered_grid, patch.shape, (patch.origin_mm[0] + dx, patch.origin_mm[1] + ds)
            )
        return pressure

    def beside(self, rung: Rung, moved_mm: tuple[float, float] = (0.0, 0.0)) -> tuple[Floats, Floats, Floats]:
        """Pressures of a solved contact and of these patches on common nodes.

        Parameters
        ----------
        rung
            Solved contact.
        moved_mm
            Shift (x, s) of the patches.

        Returns
        -------
        rung_pressure_MPa, theory_pressure_MPa (nx, ns), weights (ns,)
            Both pressures on nodes that cover both contacts, and the weights of the nodes.
        """
        covering_field = self.extend_pressure(rung, moved_mm)
        return covering_field.values, self.on(covering_field.grid, moved_mm), covering_field.grid.weights

    def extend_pressure(self, rung: Rung, moved_mm: tuple[float, float] = (0.0, 0.0)) -> Field:
        """Pressure of a solved contact on nodes that cover these patches too.

        Parameters
        ----------
        rung
            Solved contact.
        moved_mm
            Shift (x, s) of the patches.

        Returns
        -------
        Field
            Pressure in MPa of the whole contact, zero on the added nodes.
        """
        low, high = self.box_mm
        lengths = (2.0 * (max(abs(low[axis]), abs(high[axis])) + abs(moved_mm[axis])) for axis in (0, 1))
        return rung.pressure.covering(*lengths)


def _covered_nodes(grid: ContactGrid, patch: TheoryPatch, moved_mm: tuple[float, float]) -> tuple[slice, slice]:
    """Rows and columns of the nodes of a grid that a patch covers."""
    (low_x, low_s), (high_x, high_s), (dx, ds) = patch.low_mm, patch.high_mm, moved_mm
    step, cells = grid.steps_mm[0], grid.cells_mm
    rows = np.searchsorted(grid.x_mm, (low_x + dx - step, high_x + dx + step))
    columns = np.searchsorted(grid.s_mm + cells, low_s + ds), np.searchsorted(grid.s_mm - cells, high_s + ds)
    return slice(*rows.tolist()), slice(*(int(end) for end in columns))


def theory_contact_from_strips(contact: StripContact) -> TheoryContact:
    """Create a theory contact from a contact in strips.

    Parameters
    ----------
    contact
        Contact in strips. Its positions t are arc lengths from the first contact point.

    Returns
    -------
    TheoryContact
        Contact with a patch for each region.
    """
    patches = []
    for first, last in find_runs(contact.half_length_mm > 0.0):
        # with a neighbour to each side, which has no pressure
        begin = max(first - 1, 0)
        arrays = ("t_mm", "width_mm", "half_length_mm", "centre_pressure_MPa")
        region = replace(contact, **{name: getattr(contact, name)[begin : last + 2] for name in arrays})
        force = float(0.5 * np.pi * (region.width_mm * region.half_length_mm) @ region.centre_pressure_MPa)
        half_length, ends = float(region.half_length_mm.max()), (first - begin, last - begin)
        low, high = (
            float(region.t_mm[end] + side * 0.5 * region.width_mm[end])
            for end, side in zip(ends, (-1.0, 1.0), strict=True)
        )
        patches.append(
            TheoryPatch(
                shape=region,
                normal_force_N=force,
                p_max_MPa=region.p_max_MPa,
                area_mm2=region.area_mm2,
                a_mm=region.a_mm,
                b_mm=region.b_mm,
                origin_mm=(0.0, 0.0),
                centre_mm=(0.0, region.centre_t_mm),
                low_mm=(-half_length, low),
                high_mm=(half_length, high),
            )
        )
    return TheoryContact(
        patches=tuple(sorted(patches, key=lambda patch: -patch.normal_force_N)),
        approach_mm=contact.approach_mm,
        status=contact.status,
        notes=contact.notes,
        solutions=contact.solutions,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class CellPressure:
    """Pressure that is constant on the cells around the nodes of a grid.

    Attributes
    ----------
    field
        Pressure in MPa on the nodes.
    """

    field: Field

    def pressure_MPa(self, x_mm: Floats, y_mm: Floats, /) -> Floats:
        """Pressure of the nearest node, zero beyond the grid.

        Parameters
        ----------
        x_mm, y_mm
            Positions along and across in mm; shapes that broadcast together.

        Returns
        -------
        array
            Pressure in MPa at each position.
        """
        grid = self.field.grid
        (row, is_in_x), (column, is_in_s) = (
            _containing_cells(grid.x_mm, grid.steps_mm[0], x_mm),
            _containing_cells(grid.s_mm, grid.cells_mm, y_mm),
        )
        return np.where(is_in_x & is_in_s, self.field.values[row, column], 0.0)


def _containing_cells(
    nodes: Floats, widths: Floats | float, positions: Floats
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Index of the node with the cell around each position, and a mask.

    The mask is false for positions outside all cells. `nodes` (n,) ascend; `widths` are the widths of their cells in
    the unit of the nodes (mm).
    """
    widths = np.broadcast_to(widths, nodes.shape)
    index = np.clip(np.searchsorted(nodes - 0.5 * widths, positions, side="right") - 1, 0, nodes.size - 1)
    return index, np.abs(positions - nodes[index]) <= 0.5 * widths[index]


def theory_contact_from_rung(rung: Rung) -> TheoryContact:
    """Create a theory contact from a solved contact.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    TheoryContact
        Contact with a patch for each separate patch of the solved contact.
    """
    from scipy.ndimage import label

    whole_field = rung.pressure.whole()
    patch_numbers, count = label(whole_field.values > 0.0, structure=np.ones((3, 3)))
    fields = [
        Field(grid=whole_field.grid, values=np.where(patch_numbers == number, whole_field.values, 0.0))
        for number in range(1, count + 1)
    ]
    cell_areas = whole_field.grid.steps_mm[0] * whole_field.grid.cells_mm
    patches = [_patch_from_field(field, float((field.values.sum(axis=0)) @ cell_areas)) for field in fields]
    return TheoryContact(
        patches=tuple(sorted(patches, key=lambda patch: -patch.normal_force_N)), approach_mm=rung.approach_mm
    )


def _patch_from_field(field: Field, force_N: float) -> TheoryPatch:
    """Patch with the pressure of a field.

    Parameters
    ----------
    field
        Pressure in MPa on a grid in mm from the first contact point.
    force_N
        Normal force of the patch.

    Returns
    -------
    TheoryPatch
        Lengths in mm. The box has the extents of the patch, which end within the outermost loaded cells.
    """
    patch = measure_patch(field)
    x, s = (np.flatnonzero(field.values.any(axis=axis)) for axis in (1, 0))
    ends = ((field.grid.x_mm[x[end]], field.grid.s_mm[s[end]]) for end in (0, -1))
    (low_x, low_s), (high_x, high_s) = ((float(x), float(s)) for x, s in ends)
    margin = 0.5 * (patch.extent_x_mm - (high_x - low_x)), 0.5 * (patch.extent_y_mm - (high_s - low_s))
    return TheoryPatch(
        shape=CellPressure(field=field),
        normal_force_N=force_N,
        p_max_MPa=patch.p_max_MPa,
        area_mm2=patch.area_mm2,
        a_mm=patch.a_mm,
        b_mm=patch.b_mm,
        origin_mm=(0.0, 0.0),
        centre_mm=(patch.centre_x_mm, patch.centre_y_mm),
        low_mm=(low_x - margin[0], low_s - margin[1]),
        high_mm=(high_x + margin[0], high_s + margin[1]),
    )


def average_pressure_over_cells(
    grid: ContactGrid,
    shape: PressureShape,
    origin_mm: tuple[float, float] = (0.0, 0.0),
    points_per_cell: int = _POINTS_PER_CELL,
) -> Floats:
    """Pressure of a theory, averaged over the cell of each node.

    A contact on a half-space has its nodal pressures on such cells.

    Parameters
    ----------
    grid
        Grid of the nodes.
    shape
        Pressure of a theory.
    origin_mm
        Position (x, s) of the origin of the shape on the grid.
    points_per_cell
        Number of points per cell and direction.

    Returns
    -------
    array (nx, ns)
        Pressure in MPa.
    """
    cell_fractions = (np.arange(points_per_cell) + 0.5) / points_per_cell - 0.5
    x = (grid.x_mm[:, None] - origin_mm[0] + grid.steps_mm[0] * cell_fractions).ravel()
    s = (grid.s_mm[:, None] - origin_mm[1] + grid.cells_mm[:, None] * cell_fractions).ravel()
    pressure = shape.pressure_MPa(x[:, None], s[None, :])
    # Whole lines are summed first: operations on five numbers cost as much per operation as operations on a hundred
    # numbers.
    row_sums = pressure.reshape(grid.x_mm.size, points_per_cell, s.size).sum(axis=1)
    point_sums = row_sums.reshape(*grid.shape, points_per_cell)
    return np.asarray(point_sums @ np.full(points_per_cell, points_per_cell**-2.0))
