"""What a theory says of a contact: its patches and pressures, which are read like a contact's pressures."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.patch import measure_patch
from fecontact.contact_theories.gap_line import StripContact, TheoryStatus, regions
from fecontact.contact_theories.hertz import HertzContact
from fecontact.placement.poses import TouchPoint

# Points a cell and direction at which a pressure is taken for its mean over the cell.
_POINTS_A_CELL = 5


class Shape(Protocol):
    """A pressure over the places of a patch, as a theory has it."""

    def pressure_MPa(self, x_mm: Floats, y_mm: Floats, /) -> Floats:
        """Pressure at places along and across from its own origin."""


@dataclass(frozen=True, kw_only=True)
class TheoryPatch:
    """A patch of a theory; places (x, s) in mm from the first touch point.

    Attributes
    ----------
    shape, origin_mm
        Its pressure, and where the origin of that lies.
    p_max_MPa, area_mm2, a_mm, b_mm
        Its own peak, area and half-widths.
    low_mm, high_mm
        Its ends.
    touch_point, touch
        Number of the touch point that it belongs to, and that point; None where the theory knows of none.
    """

    shape: Shape
    normal_force_N: float
    p_max_MPa: float
    area_mm2: float
    a_mm: float
    b_mm: float
    origin_mm: tuple[float, float]
    centre_mm: tuple[float, float]
    low_mm: tuple[float, float]
    high_mm: tuple[float, float]
    touch_point: int | None = None
    touch: TouchPoint | None = None

    @property
    def hertz(self) -> HertzContact | None:
        """Its ellipse, None where it is none."""
        return self.shape if isinstance(self.shape, HertzContact) else None


def ellipse(hertz: HertzContact, centre_mm: tuple[float, float] = (0.0, 0.0)) -> TheoryPatch:
    """Hertz's ellipse as a patch, a along x and b across also where its axes are turned."""
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
class Approximation:
    """A contact as a theory has it: its patches, in the order of their forces.

    Attributes
    ----------
    approach_mm
        Along the contact normal at first touch.
    overlapping
        Whether two patches overlap, so that they are none of their own.
    status, notes
        What the theory says of its own answer, in a word and in words.
    solutions
        Number of approaches that were found to carry the force.
    """

    patches: tuple[TheoryPatch, ...]
    approach_mm: float
    overlapping: bool = False
    status: TheoryStatus = "solved"
    notes: tuple[str, ...] = ()
    solutions: int = 1

    @property
    def definite(self) -> bool:
        """Whether it is the theory's answer: not one of several, nor of iterations that did not end."""
        return self.status in ("solved", "out of range")

    @classmethod
    def of(cls, hertz: HertzContact) -> Approximation:
        """Hertz's ellipse at the first touch point."""
        return cls(patches=(ellipse(hertz),), approach_mm=hertz.approach_mm)

    @property
    def single(self) -> TheoryPatch | None:
        """The only patch, None of several."""
        return self.patches[0] if len(self.patches) == 1 else None

    @property
    def normal_force_N(self) -> float:
        """Sum of the forces."""
        return sum(one.normal_force_N for one in self.patches)

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Centre of pressure (x, s)."""
        total = self.normal_force_N
        x, s = (sum(one.normal_force_N / total * one.centre_mm[k] for one in self.patches) for k in (0, 1))
        return x, s

    @property
    def half_widths_mm(self) -> tuple[float, float]:
        """Half-widths (a, b) of one patch, of several from the second moments of all pressures together."""
        if self.single is not None:
            return self.single.a_mm, self.single.b_mm
        total, centre = self.normal_force_N, self.centre_mm
        # <x^2> of an ellipse is its half-width squared over 5
        a, b = (
            math.sqrt(
                5.0
                * sum(
                    one.normal_force_N / total * ((one.centre_mm[k] - centre[k]) ** 2 + half**2 / 5.0)
                    for one, half in ((one, (one.a_mm, one.b_mm)[k]) for one in self.patches)
                )
            )
            for k in (0, 1)
        )
        return a, b

    @property
    def box_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Smallest and largest (x, s) of all patches."""
        low, high = ([[getattr(one, end)[k] for one in self.patches] for k in (0, 1)] for end in ("low_mm", "high_mm"))
        return (min(low[0]), min(low[1])), (max(high[0]), max(high[1]))

    @property
    def extents_mm(self) -> tuple[float, float]:
        """Full lengths along x and across, from end to end."""
        low, high = self.box_mm
        return high[0] - low[0], high[1] - low[1]

    def on(self, grid: ContactGrid, moved_mm: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Pressure (nx, ns) in MPa of all patches, moved together, in the mean over a cell of each node."""
        (dx, ds) = moved_mm
        pressure = np.zeros(grid.shape)
        for one in self.patches:
            own = _below(grid, one, moved_mm)
            part = replace(grid, x_mm=grid.x_mm[own[0]], s_mm=grid.s_mm[own[1]], widths_mm=grid.cells_mm[own[1]])
            pressure[own] += mean_pressure(part, one.shape, (one.origin_mm[0] + dx, one.origin_mm[1] + ds))
        return pressure

    def beside(self, rung: Rung, moved_mm: tuple[float, float] = (0.0, 0.0)) -> tuple[Floats, Floats, Floats]:
        """Pressures of a contact and of these patches on the same nodes, as far as both go, and the nodes' weights."""
        low, high = self.box_mm
        lengths = (2.0 * (max(abs(low[k]), abs(high[k])) + abs(moved_mm[k])) for k in (0, 1))
        covering = rung.pressure.covering(*lengths)
        return covering.values, self.on(covering.grid, moved_mm), covering.grid.weights


def _below(grid: ContactGrid, patch: TheoryPatch, moved_mm: tuple[float, float]) -> tuple[slice, slice]:
    """Rows and columns of a grid on which a patch can have a pressure."""
    (low_x, low_s), (high_x, high_s), (dx, ds) = patch.low_mm, patch.high_mm, moved_mm
    step, cells = grid.steps_mm[0], grid.cells_mm
    rows = np.searchsorted(grid.x_mm, (low_x + dx - step, high_x + dx + step))
    columns = np.searchsorted(grid.s_mm + cells, low_s + ds), np.searchsorted(grid.s_mm - cells, high_s + ds)
    return slice(*rows.tolist()), slice(*(int(end) for end in columns))


def of_strips(contact: StripContact) -> Approximation:
    """A contact in strips, t its arc length from the first touch point; a patch for each of its regions."""
    parts = []
    for first, last in regions(contact.half_length_mm > 0.0):
        inside = np.zeros(contact.t_mm.size, bool)
        inside[first : last + 1] = True
        own = replace(
            contact,
            half_length_mm=np.where(inside, contact.half_length_mm, 0.0),
            centre_pressure_MPa=np.where(inside, contact.centre_pressure_MPa, 0.0),
        )
        force = float(0.5 * np.pi * (own.width_mm * own.half_length_mm) @ own.centre_pressure_MPa)
        a, ends = float(own.half_length_mm.max()), (first, last)
        low, high = (
            float(own.t_mm[end] + side * 0.5 * own.width_mm[end]) for end, side in zip(ends, (-1.0, 1.0), strict=True)
        )
        parts.append(
            TheoryPatch(
                shape=own,
                normal_force_N=force,
                p_max_MPa=own.p_max_MPa,
                area_mm2=own.area_mm2,
                a_mm=own.a_mm,
                b_mm=own.b_mm,
                origin_mm=(0.0, 0.0),
                centre_mm=(0.0, own.centre_t_mm),
                low_mm=(-a, low),
                high_mm=(a, high),
            )
        )
    return Approximation(
        patches=tuple(sorted(parts, key=lambda one: -one.normal_force_N)),
        approach_mm=contact.approach_mm,
        status=contact.status,
        notes=contact.notes,
        solutions=contact.solutions,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class CellPressure:
    """A pressure that is constant on the cells around the nodes of a grid."""

    field: Field

    def pressure_MPa(self, x_mm: Floats, y_mm: Floats, /) -> Floats:
        """Pressure of the nearest node, zero beyond the grid."""
        grid = self.field.grid
        (i, in_x), (j, in_s) = _nearest(grid.x_mm, grid.steps_mm[0], x_mm), _nearest(grid.s_mm, grid.cells_mm, y_mm)
        return np.where(in_x & in_s, self.field.values[i, j], 0.0)


def _nearest(line: Floats, widths: Floats | float, places: Floats) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of the node in whose cell each place lies, and whether there is one."""
    widths = np.broadcast_to(widths, line.shape)
    number = np.clip(np.searchsorted(line - 0.5 * widths, places, side="right") - 1, 0, line.size - 1)
    return number, np.abs(places - line[number]) <= 0.5 * widths[number]


def of_rung(rung: Rung) -> Approximation:
    """A solved contact as a theory has it; a patch for each separate one."""
    whole = rung.pressure.whole()
    pieces, count = label(whole.values > 0.0, structure=np.ones((3, 3)))
    fields = [Field(grid=whole.grid, values=np.where(pieces == k, whole.values, 0.0)) for k in range(1, count + 1)]
    cells = whole.grid.steps_mm[0] * whole.grid.cells_mm
    parts = [_of_field(field, float((field.values.sum(axis=0)) @ cells)) for field in fields]
    return Approximation(
        patches=tuple(sorted(parts, key=lambda one: -one.normal_force_N)), approach_mm=rung.approach_mm
    )


def _of_field(field: Field, force_N: float) -> TheoryPatch:
    patch = measure_patch(field)
    x, s = (np.flatnonzero(field.values.any(axis=axis)) for axis in (1, 0))
    ends = ((field.grid.x_mm[x[end]], field.grid.s_mm[s[end]]) for end in (0, -1))
    (low_x, low_s), (high_x, high_s) = ((float(x), float(s)) for x, s in ends)
    more = 0.5 * (patch.extent_x_mm - (high_x - low_x)), 0.5 * (patch.extent_y_mm - (high_s - low_s))
    return TheoryPatch(
        shape=CellPressure(field=field),
        normal_force_N=force_N,
        p_max_MPa=patch.p_max_MPa,
        area_mm2=patch.area_mm2,
        a_mm=patch.a_mm,
        b_mm=patch.b_mm,
        origin_mm=(0.0, 0.0),
        centre_mm=(patch.centre_x_mm, patch.centre_y_mm),
        low_mm=(low_x - more[0], low_s - more[1]),
        high_mm=(high_x + more[0], high_s + more[1]),
    )


def mean_pressure(grid: ContactGrid, shape: Shape, origin_mm: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """A theory's pressure (nx, ns) in MPa, in the mean over a cell of each node, its origin at a place of the grid.

    A contact on a half-space has its nodal pressures on such cells.
    """
    places = (np.arange(_POINTS_A_CELL) + 0.5) / _POINTS_A_CELL - 0.5
    x = (grid.x_mm[:, None] - origin_mm[0] + grid.steps_mm[0] * places).ravel()
    s = (grid.s_mm[:, None] - origin_mm[1] + grid.cells_mm[:, None] * places).ravel()
    pressure = shape.pressure_MPa(x[:, None], s[None, :])
    # whole lines first: five numbers at a time cost as much each as a hundred
    lines = pressure.reshape(grid.x_mm.size, _POINTS_A_CELL, s.size).sum(axis=1)
    cells = lines.reshape(*grid.shape, _POINTS_A_CELL)
    return np.asarray(cells @ np.full(_POINTS_A_CELL, _POINTS_A_CELL**-2.0))
