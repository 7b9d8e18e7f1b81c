"""Contact of the true gap on a half-space, also with the compliance of finite bodies."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline

from fecontact.arrays import Floats
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.halfspace import build_half_space_problem
from fecontact.contact.solver import solve_contact
from fecontact.placement.wheel_on_rail import Placement

# Above this contact angle a vertical load moves the bodies along each other by more than half of the distance by which
# it closes them. If the points of the gap only came nearer, the patch would be moved by tenths of its width, and some
# of the load would be lost.
_STEEP_RAD = math.radians(30.0)
# The tolerance causes an error of about 1e-5 of the pressure, a tenth of the uncertainty from the nodes. The rough
# tolerance is sufficient for the next grid and the next slide.
TOLERANCE, ROUGH_TOLERANCE = 1e-6, 1e-5
# Lateral spacing of the points at which surfaces outside the contact are checked for overlaps.
_STEP_MM = 0.25
# Fields are smooth: a spline of this degree has continuous curvatures.
_SPLINE_DEGREE = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueGap:
    """Gap between the true surfaces of rail and wheel, on a half-space.

    Attributes
    ----------
    placement
        Wheel on rail.
    contact_modulus_MPa
        Contact modulus in MPa.
    direction : ndarray of shape (3,)
        Unit vector along which the load acts and the bodies approach.
    slide_mm
        Distance that the wheel moves along the tangent at first contact under the load. If it is not 0, the gap is the
        gap of the wheel after the slide, without the part that points approaching along the rail's normals already
        include.
    """

    placement: Placement
    contact_modulus_MPa: float
    direction: Floats
    slide_mm: float = 0.0
    # Gaps on the last two grids: a contact is solved several times on a grid, with other planes or another opening.
    _last: list[tuple[ContactGrid, Floats]] = field(default_factory=list, init=False, repr=False)

    @property
    def closing(self) -> float:
        """Closing of the gap at the first contact point per unit of approach (-)."""
        return float(self.direction @ self.placement.first.normal)

    @property
    def is_steep(self) -> bool:
        """Whether the surface is so steep that the gap must include the slide."""
        return abs(float(self.direction @ self.placement.first.tangent)) > math.sin(_STEEP_RAD)

    def after(self, approach_mm: float) -> TrueGap:
        """Gap after the slide that belongs to an approach along the contact normal.

        Parameters
        ----------
        approach_mm
            Approach in mm.

        Returns
        -------
        TrueGap
            Gap with the bodies slid along the tangent.
        """
        tangential_share = float(self.direction @ self.placement.first.tangent)
        return replace(self, slide_mm=approach_mm / self.closing * tangential_share)

    def gap(self, x: ArrayLike, s: ArrayLike) -> Floats:
        """Undeformed gap along the rail's normals.

        Parameters
        ----------
        x, s
            Longitudinal and lateral positions in mm from the first contact point.

        Returns
        -------
        ndarray
            Gap in mm, with the broadcast shape of x and s.
        """
        placement, slide = self.placement, self.slide_mm
        if slide == 0.0:
            return placement.gap(x, s)
        tangent = placement.first.tangent
        wheel = replace(placement.wheel, centre_mm=placement.wheel.centre_mm - slide * tangent)
        _, normals = placement.surface(x, s)
        return replace(placement, wheel=wheel).gap(x, s) + slide * (normals @ tangent)

    def on(self, grid: ContactGrid) -> Floats:
        """Undeformed gap on a grid of nodes.

        Parameters
        ----------
        grid
            Grid of nodes (nx, ns).

        Returns
        -------
        ndarray of shape (nx, ns)
            Gap in mm.
        """
        gap_mm = next((gap for known_grid, gap in self._last if known_grid is grid), None)
        if gap_mm is None:
            gap_mm = np.asarray(self.gap(grid.x_mm[:, None], grid.s_mm[None, :]))
            self._last[:] = [*self._last[-1:], (grid, gap_mm)]
        return gap_mm

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
        """Solve the contact on a grid of nodes.

        Parameters
        ----------
        grid
            Grid of nodes (nx, ns).
        load_N
            Load in N along `direction`.
        added
            Opening of finite bodies minus opening of a half-space, on a grid of its nodes. It is smooth: a cubic spline
            interpolates it at the nodes of `grid`. Outside its grid it has the values at its edge. None for a
            half-space.
        start
            Pressure of nearly this contact on any grid, from which the iterations start.
        angle_rad
            Angles (ns,) of the normals along which pressures open the half-space; None for a single plane.
        tolerance
            Bound of the residuals relative to the approach (-).

        Returns
        -------
        Rung
            Solved contact.
        """
        _, normals = self.placement.surface(0.0, grid.s_mm)
        gap = self.on(grid)
        if added is not None:
            gap = gap + interpolate_field(added, grid.x_mm, grid.s_mm)
        problem = build_half_space_problem(
            grid,
            gap.ravel(),
            closing=np.tile(normals @ self.direction, grid.shape[0]),
            contact_modulus_MPa=self.contact_modulus_MPa,
            angle_rad=angle_rad,
        )
        start_MPa = None if start is None else interpolate_field(start, grid.x_mm, grid.s_mm, degree=1).ravel()
        solution = solve_contact(problem, load_N, start_MPa=start_MPa, tolerance=tolerance)
        upright = np.tile(normals @ self.placement.first.normal, grid.shape[0])
        return Rung.of(grid, solution, approach_mm=solution.approach_mm * self.closing, upright=upright)

    def find_overlap_beyond(self, rung: Rung, added: Field) -> tuple[float, float] | None:
        """Lateral range in which the bodies of a solved contact overlap outside its nodes.

        Outside the contact, the opening of the half-space is the opening by point forces.

        Parameters
        ----------
        rung
            Solved contact.
        added
            Opening of finite bodies minus opening of a half-space; outside its grid it has the values at its edge.

        Returns
        -------
        tuple of float or None
            Range of s in mm from the first contact point; None without an overlap.
        """
        surface_s_mm, grid_s_mm = self._surface_mm(), rung.grid.s_mm
        overlaps_mm = self._find_overlaps(
            rung, surface_s_mm[(surface_s_mm < grid_s_mm[0]) | (surface_s_mm > grid_s_mm[-1])], added
        )
        return (float(overlaps_mm.min()), float(overlaps_mm.max())) if overlaps_mm.size else None

    def overlaps_between(self, rung: Rung, added: Field | None = None) -> bool:
        """Whether the bodies overlap between two bands of nodes, where the contact continues.

        Parameters
        ----------
        rung
            Contact that was solved in bands.
        added
            As in `find_overlap_beyond`; None for a half-space.

        Returns
        -------
        bool
            False for a single band.
        """
        surface_s_mm, bands = self._surface_mm(), rung.grid.bands
        strips_mm = [
            surface_s_mm[(surface_s_mm > left_band.s_mm[-1]) & (surface_s_mm < right_band.s_mm[0])]
            for left_band, right_band in pairwise(bands)
        ]
        return any(self._find_overlaps(rung, strip_mm, added).size > 0 for strip_mm in strips_mm)

    def _surface_mm(self) -> Floats:
        """Lateral positions all over the rail's surface, in mm from the first contact point."""
        placement = self.placement
        return np.arange(_STEP_MM, placement.rail.profile.length_mm, _STEP_MM) - placement.first_arc_length_mm

    def _find_overlaps(self, rung: Rung, s_mm: Floats, added: Field | None) -> Floats:
        """Find the lateral positions without nodes at which the bodies of a solved contact overlap.

        The positions are in mm from the first contact point.
        """
        placement, grid, field = self.placement, rung.grid, rung.pressure.whole()
        x_mm = np.linspace(grid.x_mm[0], grid.x_mm[-1], 9)
        _, normals = placement.surface(0.0, s_mm)
        gap = self.gap(x_mm[:, None], s_mm[None, :]) - rung.approach_mm / self.closing * (normals @ self.direction)
        # An opening only increases the gap: most positions are excluded without it.
        candidates = np.argwhere(gap < 0.0)
        if candidates.size == 0:
            return s_mm[:0]
        force = field.values * field.grid.nodal_area_mm2().reshape(field.grid.shape)
        i, j = np.nonzero(force)
        candidate_x_mm, candidate_s_mm = x_mm[candidates[:, 0]], s_mm[candidates[:, 1]]
        distance = np.hypot(candidate_x_mm[:, None] - field.grid.x_mm[i], candidate_s_mm[:, None] - field.grid.s_mm[j])
        opening = (force[i, j] / distance).sum(axis=1) / (np.pi * self.contact_modulus_MPa)
        if added is not None:
            axes = (candidate_x_mm, added.grid.x_mm), (candidate_s_mm, added.grid.s_mm)
            opening += _fit_spline(added).ev(
                *(np.clip(position_mm, axis_mm[0], axis_mm[-1]) for position_mm, axis_mm in axes)
            )
        return np.asarray(candidate_s_mm[gap[candidates[:, 0], candidates[:, 1]] + opening < 0.0])


def interpolate_field(field: Field, x_mm: Floats, s_mm: Floats, *, degree: int = _SPLINE_DEGREE) -> Floats:
    """Interpolate a smooth field at other positions by a spline.

    Parameters
    ----------
    field
        Field on a grid.
    x_mm, s_mm
        Positions (nx,) and (ns,) in mm. Outside the grid, the field has the values at its edge.
    degree
        Degree of the spline: 3 for cubic, 1 for linear.

    Returns
    -------
    ndarray of shape (nx, ns)
        Values in the unit of the field.
    """
    x, s = field.grid.x_mm, field.grid.s_mm
    return np.asarray(_fit_spline(field, degree)(np.clip(x_mm, x[0], x[-1]), np.clip(s_mm, s[0], s[-1])))


def _fit_spline(field: Field, degree: int = _SPLINE_DEGREE) -> RectBivariateSpline:
    return RectBivariateSpline(field.grid.x_mm, field.grid.s_mm, field.values, kx=degree, ky=degree)
