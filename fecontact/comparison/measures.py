"""Measures of one contact: how each is read from a pressure field and from a theory's patches.

Every measure is one field of `Measures`, or of `Misfit` if a theory has no value of it: its name with its unit, how it
is read, and how well. All that judges, tells or draws measures goes through these tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from fecontact.arrays import Floats
from fecontact.comparison.patch import Patch, measure_patch, valley_of
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.normal.gap_line import StripContact, TheoryStatus, regions
from fecontact.normal.hertz import HertzContact
from fecontact.wheel_rail.poses import TouchPoint

# --- What a cheap theory says of a contact: its patches and pressures, which are read like a contact's pressures.

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


# --- Measures of one contact: how each is read from a pressure field and from a theory's patches.


def _measure(
    of_contact: Callable[..., float], of_theory: Callable[[Approximation], float] | None = None, **known: float | None
) -> Any:
    """A measure: how it is read, and what is known of its uncertainty, as `FLOORS` and the tables below it have it."""
    read = {"of_contact": of_contact, "of_theory": of_theory, "meshes": 0.0, "of_skew": 0.0, "noise": 0.0}
    return field(metadata=read | known)


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, half-widths (a along x, b across), full extents and approach of one contact.

    `floor` in the metadata is the relative uncertainty of reading the measure off 32 nodes per semi-axis; None where it
    is not known. The approach is measured down to the bodies' cut planes: a deeper rail moves it, and no mesh says
    by how much. `cut_planes` is how much the other measures change at most when one cut plane is moved out by half
    (studies/02_independence.py), `meshes` what two meshes of 4 and 2.7 elements happen to have in common: with it 81 or
    more of the 84 real positions of studies/12_uncertainty.py on which it was chosen are inside what is stated.
    """

    # on the half-space, where nothing else errs, the peak is read within 0.00007 (225 exact ellipses, and 126 real
    # positions against 64 nodes). What is stated beyond that belongs to the meshes: of real positions 81 of 84 are
    # inside with the sum of floor and `meshes`
    p_max_MPa: float = _measure(
        lambda patch, rung: patch.p_max_MPa,
        lambda theory: max(one.p_max_MPa for one in theory.patches),
        floor=0.0006,
        cut_planes=0.0014,
        meshes=0.0006,
    )
    # where the line of zero pressure lies between nodes is a matter of chance; all other measures are sums. On the
    # half-space, where nothing else errs, areas of exact contacts (studies/12_uncertainty.py) are read within 0.0017 in
    # the half on which this was chosen, within 0.0016 in the other half
    area_mm2: float = _measure(
        lambda patch, rung: patch.area_mm2,
        lambda theory: sum(one.area_mm2 for one in theory.patches),
        floor=0.002,
        cut_planes=0.0019,
    )
    # two lobes far apart for their length are 0.1 % longer on both meshes: 81 of 100 were inside without what is common
    a_mm: float = _measure(
        lambda patch, rung: patch.a_mm,
        lambda theory: theory.half_widths_mm[0],
        floor=0.0004,
        cut_planes=0.0009,
        meshes=0.0005,
    )
    b_mm: float = _measure(
        lambda patch, rung: patch.b_mm,
        lambda theory: theory.half_widths_mm[1],
        floor=0.0005,
        cut_planes=0.0018,
        meshes=0.0008,
    )
    extent_x_mm: float = _measure(
        lambda patch, rung: patch.extent_x_mm, lambda theory: theory.extents_mm[0], floor=0.01, cut_planes=0.0009
    )
    extent_y_mm: float = _measure(
        lambda patch, rung: patch.extent_y_mm, lambda theory: theory.extents_mm[1], floor=0.01, cut_planes=0.0018
    )
    approach_mm: float = _measure(
        lambda patch, rung: rung.approach_mm, lambda theory: theory.approach_mm, floor=None, cut_planes=math.nan
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MEASURES}


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """What sizes do not see of a contact beside a theory; all are zero for the theory's own pressure.

    Attributes
    ----------
    centre_over_b
        Distance across from the theory's centre of pressure to the contact's, over the theory's half-width b.
    valley
        By how much the pressure falls between its two most prominent peaks, over the highest; of a theory that has a
        valley itself what the contact has more.
    separate_load
        Part of the force on all separate patches but the one that carries most; of several patches in the theory, on
        those that are none of them (`_unknown_load`).
    misplaced_load
        Part of the force that is elsewhere than the theory has it: half the integral of the difference over the force.

    A theory with a single patch is moved to the centre of pressure before the misplaced load is counted, so that a
    centre that is off counts once. Several patches stay where they are: their common centre follows from how they share
    the load, and would move each away from its own place (`studies/15_cheaper_than_finite_elements.py`).

    `floor`, `cut_planes` and `meshes` in the metadata are uncertainties that no mesh takes away, as in `Measures`;
    `noise` is what is read where there is nothing, and adds in quadrature to what there is; `of_skew` is what meshes
    have in common of a patch whose skewness is 1, and falls with it. Of exact contacts the centre is within 0.0005 b;
    0.0021 b, which patches beyond 0.15 b need, was stated for all.
    """

    centre_over_b: float = _measure(
        lambda patch, rung, theory: (patch.centre_y_mm - theory.centre_mm[1]) / theory.half_widths_mm[1],
        floor=0.0003,
        cut_planes=0.004,
        meshes=0.0005,
        of_skew=0.007,
    )
    valley: float = _measure(
        lambda patch, rung, theory: patch.valley - _own_valley(rung, theory),
        floor=0.0005,
        cut_planes=0.001,
        meshes=0.0006,
    )
    separate_load: float = _measure(
        lambda patch, rung, theory: patch.separate_load if theory.single else _unknown_load(rung, theory),
        floor=0.000025,
        cut_planes=0.0,
    )
    # cells at the edge of the patch are wholly in contact or not: so much is read for Hertz's own ellipse. On finer
    # elements the change from mesh to mesh does not show it: of 63 slender exact contacts on meshes of 6, 4 and 2.7
    # elements per semi-axis 86 % were inside the floor alone; with what is common all, and all of 59 others
    # (studies/12_uncertainty.py)
    misplaced_load: float = _measure(
        lambda patch, rung, theory: _misplaced_load(rung, theory),
        floor=0.0008,
        cut_planes=0.0008,
        meshes=0.0004,
        noise=0.0014,
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MISFITS}


_READ = {measure.name: measure.metadata for measure in fields(Measures)}
_READ_BESIDE = {measure.name: measure.metadata for measure in fields(Misfit)}
MEASURES = tuple(_READ)
"""Names of the measures that Hertz and a contact both have, each ending in its unit."""
MISFITS = tuple(_READ_BESIDE)
"""Names of the measures of a contact beside Hertz; they have no unit."""
FLOORS: dict[str, float | None] = {name: read["floor"] for name, read in (_READ | _READ_BESIDE).items()}
"""What reading leaves open of each: relative of `MEASURES`, absolute of `MISFITS`; None where it is not known."""
NOISE: dict[str, float] = {name: read["noise"] for name, read in _READ_BESIDE.items()}
"""What is read of each of `MISFITS` where there is none."""
CUT_PLANES: dict[str, float] = {name: read["cut_planes"] for name, read in (_READ | _READ_BESIDE).items()}
"""Uncertainty of each measure from the bodies' cut planes."""
IN_COMMON: dict[str, float] = {name: read["meshes"] for name, read in (_READ | _READ_BESIDE).items()}
"""Error of each measure that two coarse meshes have in common."""
OF_SKEW: dict[str, float] = {name: read["of_skew"] for name, read in (_READ | _READ_BESIDE).items()}
"""The same that is in proportion to the skewness of the pressure across."""


# a load is judged by its rungs several times while it is refined, and each is read once
@lru_cache(maxsize=64)
def patch_of(rung: Rung) -> Patch:
    """What the pressure of a solved contact says of its patch."""
    return measure_patch(rung.pressure)


def measures_of(rung: Rung) -> Measures:
    """Measures of a solved contact."""
    patch = patch_of(rung)
    return Measures(**{name: read["of_contact"](patch, rung) for name, read in _READ.items()})


def measures_of_theory(theory: Approximation) -> Measures:
    """Measures of a theory's patches, from the theory itself."""
    return Measures(**{name: float(read["of_theory"](theory)) for name, read in _READ.items()})


def hertz_measures(hertz: HertzContact) -> Measures:
    """The measures of a Hertz ellipse, a along x and b across also where its axes are turned."""
    return measures_of_theory(Approximation.of(hertz))


@lru_cache(maxsize=64)
def misfit_of_theory(rung: Rung, theory: Approximation) -> Misfit:
    """Measures of a solved contact beside a theory, both about the origin of its grid."""
    patch = patch_of(rung)
    return Misfit(**{name: read["of_contact"](patch, rung, theory) for name, read in _READ_BESIDE.items()})


def misfit_of(rung: Rung, hertz: HertzContact) -> Misfit:
    """Measures of a solved contact beside Hertz's ellipse at the origin of its grid."""
    return misfit_of_theory(rung, Approximation.of(hertz))


def values_of(rung: Rung, theory: Approximation) -> dict[str, float]:
    """All measures of a solved contact, and what of it is beside a theory."""
    return measures_of(rung).as_dict() | misfit_of_theory(rung, theory).as_dict()


def deviations_of(rung: Rung, theory: Approximation) -> dict[str, float]:
    """(Theory - contact) / contact of each of `MEASURES`, and the `MISFITS` as they are."""
    own, contact = measures_of_theory(theory).as_dict(), values_of(rung, theory)
    return {name: own[name] / contact[name] - 1.0 if name in MEASURES else contact[name] for name in contact}


def deviations(rung: Rung, hertz: HertzContact) -> dict[str, float]:
    """(Hertz - contact) / contact of each of `MEASURES`, and the `MISFITS` as they are."""
    return deviations_of(rung, Approximation.of(hertz))


# read for the valley and for the misplaced load
@lru_cache(maxsize=4)
def _beside(rung: Rung, theory: Approximation) -> tuple[Floats, Floats, Floats]:
    """Pressures as `Approximation.beside` has them; of a single patch at the contact's centre of pressure."""
    if theory.single is None:
        return theory.beside(rung)
    patch, (x, s) = patch_of(rung), theory.centre_mm
    return theory.beside(rung, (patch.centre_x_mm - x, patch.centre_y_mm - s))


def _misplaced_load(rung: Rung, theory: Approximation) -> float:
    pressure, of_theory, weights = _beside(rung, theory)
    return part_elsewhere(pressure * weights, of_theory * weights)


def _own_valley(rung: Rung, theory: Approximation) -> float:
    """The valley of a theory's own pressure, read on the nodes of a contact; an ellipse has none."""
    is_ellipse = theory.single is not None and theory.single.hertz is not None
    return 0.0 if is_ellipse else valley_of(_beside(rung, theory)[1])


def _unknown_load(rung: Rung, theory: Approximation) -> float:
    """Part of the force on separate patches of a contact that a theory does not know (`unknown_load`)."""
    return unknown_load(*_separate_loads(rung), theory)


# every theory is read against the same patches
@lru_cache(maxsize=4)
def _separate_loads(rung: Rung) -> tuple[list[tuple[float, float]], Floats]:
    """Where each separate patch of a contact begins and ends across (mm), and its load (n,)."""
    whole = rung.pressure.whole()
    s, cells = whole.grid.s_mm, whole.grid.cells_mm
    pieces, count = label(whole.values > 0.0, structure=np.ones((3, 3)))
    below = [np.flatnonzero((pieces == k).any(axis=0))[[0, -1]] for k in range(1, count + 1)]
    loads = np.array([(whole.values * (pieces == k)).sum(axis=0) @ cells for k in range(1, count + 1)])
    return [(float(s[first] - cells[first]), float(s[last] + cells[last])) for first, last in below], loads


def unknown_load(ends_mm: Sequence[tuple[float, float]], loads: Floats, theory: Approximation) -> float:
    """Part of the force on separate patches that are none of a theory's, and of its patches that the contact has not.

    A patch of a theory has one of the contact at most: of those below it the heaviest that a heavier one has not taken,
    or, where all are taken, the heaviest, which they then share. Several would fail for every second patch that they
    rightly have, if they were judged as a single one is: whether they give it the right load is the misplaced load's
    matter, and the peak's.

    Parameters
    ----------
    ends_mm, loads
        Where each patch of the contact begins and ends across, and its load in any unit.
    """
    taken: set[int] = set()
    missing = 0.0
    for one in sorted(theory.patches, key=lambda one: -one.normal_force_N):
        low, high = one.low_mm[1], one.high_mm[1]
        below = [k for k, (first, last) in enumerate(ends_mm) if first <= high and low <= last]
        if not below:
            missing += one.normal_force_N / theory.normal_force_N
            continue
        free = [k for k in below if k not in taken]
        taken.add(max(free or below, key=lambda k: loads[k]))
    unknown = sum(load for k, load in enumerate(loads) if k not in taken) / loads.sum()
    return float(unknown + missing)


def part_elsewhere(force: Floats, reference: Floats) -> float:
    """Part of the forces of cells that is elsewhere than a reference on the same cells has it."""
    # at equal force, whatever the cells leave of it
    return float(0.5 * np.abs(force / force.sum() - reference / reference.sum()).sum())
