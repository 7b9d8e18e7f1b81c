"""Contact of the true gap on a half-space, alone or with the compliance that finite bodies add."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.halfspace import half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.placement.wheel_on_rail import Placement

# Above this contact angle a vertical load drives the bodies along each other by more than half of what it closes them:
# a gap whose points only come nearer then moves the patch by tenths of its width, and loses some of the load.
_STEEP_RAD = math.radians(30.0)
# Some 1e-5 of the pressure: a tenth of what the nodes leave open. For the next grid and the next slide less is enough.
TOLERANCE, ROUGH_TOLERANCE = 1e-6, 1e-5
# Steps across at which surfaces beside the contact are looked at.
_STEP_MM = 0.25


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueGap:
    """The gap between rail and wheel as they are, on a half-space of a contact modulus.

    Attributes
    ----------
    direction (3,)
        Unit vector along which the load acts and the bodies approach.
    slide_mm
        How far the wheel goes along the tangent at first touch under the load. Where it is not 0 it is the gap of the
        wheel after it, less what points that come nearer along the rail's normals see of it themselves.
    """

    placement: Placement
    contact_modulus_MPa: float
    direction: Floats
    slide_mm: float = 0.0
    # of the last two grids: a contact is solved on one more than once, with other planes or another opening
    _last: list[tuple[ContactGrid, Floats]] = field(default_factory=list, init=False, repr=False)

    @property
    def closing(self) -> float:
        """How much the gap at the first touch point closes when the bodies approach by 1."""
        return float(self.direction @ self.placement.first.normal)

    @property
    def is_steep(self) -> bool:
        """Whether the load drives the bodies along each other so far that it must be in the gap."""
        return abs(float(self.direction @ self.placement.first.tangent)) > math.sin(_STEEP_RAD)

    def after(self, approach_mm: float) -> TrueGap:
        """The gap after the slide that belongs to an approach along the contact normal."""
        along = float(self.direction @ self.placement.first.tangent)
        return replace(self, slide_mm=approach_mm / self.closing * along)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """The gap (mm) along the rail's normals at x and s (mm from first touch), undeformed."""
        placement, slide = self.placement, self.slide_mm
        if slide == 0.0:
            return placement.gap(x, s)
        tangent = placement.first.tangent
        wheel = replace(placement.wheel, centre_mm=placement.wheel.centre_mm - slide * tangent)
        _, normals = placement.surface(x, s)
        return replace(placement, wheel=wheel).gap(x, s) + slide * (normals @ tangent)

    def on(self, grid: ContactGrid) -> Floats:
        """The gap (nx, ns) in mm on a grid of nodes, undeformed."""
        known = next((gap for own, gap in self._last if own is grid), None)
        if known is None:
            known = np.asarray(self.gap(grid.x_mm[:, None], grid.s_mm[None, :]))
            self._last[:] = [*self._last[-1:], (grid, known)]
        return known

    def solve(
        self,
        grid: ContactGrid,
        load_N: float,
        *,
        added: Field | None = None,
        start: Field | None = None,
        angle_rad: Floats | None = None,
        tolerance: float = TOLERANCE,
    ) -> Rung:
        """Contact on a grid of nodes.

        Pressures open a half-space in one plane, or along normals of these angles (ns,). `added` is what finite bodies
        open more than a half-space, on nodes of its own. It is smooth: a cubic spline carries it to the nodes, and
        beyond its own nodes it stays as it is at their edge. The iterations begin at `start`, a pressure of nearly
        this contact on nodes of its own.
        """
        _, normals = self.placement.surface(0.0, grid.s_mm)
        gap = self.on(grid)
        if added is not None:
            gap = gap + carried(added, grid.x_mm, grid.s_mm)
        problem = half_space_problem(
            grid,
            gap.ravel(),
            closing=np.tile(normals @ self.direction, grid.shape[0]),
            contact_modulus_MPa=self.contact_modulus_MPa,
            angle_rad=angle_rad,
        )
        first = None if start is None else carried(start, grid.x_mm, grid.s_mm, degree=1).ravel()
        solution = solve_contact(problem, load_N, start_MPa=first, tolerance=tolerance)
        upright = np.tile(normals @ self.placement.first.normal, grid.shape[0])
        return Rung.of(grid, solution, approach_mm=solution.approach_mm * self.closing, upright=upright)

    def overlaps_beyond(self, rung: Rung, added: Field) -> tuple[float, float] | None:
        """Where the bodies of a solved contact overlap beside its nodes: range of s (mm), None if they do nowhere.

        Beside the contact a half-space opens as under point forces; `added` stays as it is at the edge of its nodes.
        """
        s, line = self._surface_mm(), rung.grid.s_mm
        overlapping = self._overlapping(rung, s[(s < line[0]) | (s > line[-1])], added)
        return (float(overlapping.min()), float(overlapping.max())) if overlapping.size else None

    def overlaps_between(self, rung: Rung, added: Field | None = None) -> bool:
        """Whether the bodies of a contact that is solved in bands overlap between two of them, so that it goes on."""
        s, bands = self._surface_mm(), rung.grid.bands
        between = [s[(s > before.s_mm[-1]) & (s < after.s_mm[0])] for before, after in pairwise(bands)]
        return any(self._overlapping(rung, places, added).size > 0 for places in between)

    def _surface_mm(self) -> Floats:
        """Places all over the rail's surface (mm from first touch)."""
        placement = self.placement
        return np.arange(_STEP_MM, placement.rail.profile.length_mm, _STEP_MM) - placement.first_arc_length_mm

    def _overlapping(self, rung: Rung, s: Floats, added: Field | None) -> Floats:
        """Of places across without nodes those where the bodies of a solved contact overlap."""
        placement, grid, whole = self.placement, rung.grid, rung.pressure.whole()
        x = np.linspace(grid.x_mm[0], grid.x_mm[-1], 9)
        _, normals = placement.surface(0.0, s)
        gap = self.gap(x[:, None], s[None, :]) - rung.approach_mm / self.closing * (normals @ self.direction)
        # an opening only adds to it: most are ruled out without
        near = np.argwhere(gap < 0.0)
        if near.size == 0:
            return s[:0]
        force = whole.values * whole.grid.nodal_area_mm2().reshape(whole.grid.shape)
        i, j = np.nonzero(force)
        at_x, at_s = x[near[:, 0]], s[near[:, 1]]
        distance = np.hypot(at_x[:, None] - whole.grid.x_mm[i], at_s[:, None] - whole.grid.s_mm[j])
        opening = (force[i, j] / distance).sum(axis=1) / (np.pi * self.contact_modulus_MPa)
        if added is not None:
            lines = (at_x, added.grid.x_mm), (at_s, added.grid.s_mm)
            opening += _spline(added).ev(*(np.clip(at, line[0], line[-1]) for at, line in lines))
        return np.asarray(at_s[gap[near[:, 0], near[:, 1]] + opening < 0.0])


def carried(field: Field, x_mm: Floats, s_mm: Floats, *, degree: int = 3) -> Floats:
    """A smooth field at other places (nx, ns): a spline, cubic or linear, beyond its nodes the value at their edge."""
    x, s = field.grid.x_mm, field.grid.s_mm
    return np.asarray(_spline(field, degree)(np.clip(x_mm, x[0], x[-1]), np.clip(s_mm, s[0], s[-1])))


def _spline(field: Field, degree: int = 3) -> RectBivariateSpline:
    return RectBivariateSpline(field.grid.x_mm, field.grid.s_mm, field.values, kx=degree, ky=degree)
