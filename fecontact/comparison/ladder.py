"""The rungs between Hertz and the finite elements, on the same pressure nodes: what each step moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.measures import MEASURES, Measures, measure
from fecontact.comparison.verdict import PatchGeometry
from fecontact.contact.grid import ContactGrid
from fecontact.contact.halfspace import half_space_compliance
from fecontact.contact.solver import ContactProblem, solve_contact
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]

# How far the grid of the quadratic rung reaches beyond Hertz's ellipse.
_REACH = 1.2


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Measures on each rung; all carry the same normal force.

    `hertz`: closed form. `half_space_quadratic`: Hertz's gap on a discrete half-space, which checks the discretisation.
    `half_space`: the true gap on it. `fe`: the true gap between the finite bodies.
    """

    hertz: Measures
    half_space_quadratic: Measures
    half_space: Measures
    fe: Measures

    @property
    def rungs(self) -> dict[str, Measures]:
        """The rungs by name, in their order."""
        return dict(vars(self))

    @property
    def steps(self) -> dict[str, dict[str, float]]:
        """Relative change of each measure from one rung to the next."""
        names = ("hertz_to_quadratic", "quadratic_to_true_gap", "half_space_to_bodies")
        rungs = [rung.as_dict() for rung in self.rungs.values()]
        return {
            name: {m: after[m] / before[m] - 1.0 for m in MEASURES}
            for name, before, after in zip(names, rungs[:-1], rungs[1:], strict=True)
        }


def quadratic_rung(grid: ContactGrid, touch: TouchPoint, hertz: HertzContact) -> Measures:
    """Solve the quadratic gap at a touch point on a half-space, with the grid's spacing, under Hertz's normal force."""
    hx, hs = grid.steps_mm
    count_x = int(np.ceil(_REACH * 0.5 * hertz.extent_x_mm / hx))
    count_s = int(np.ceil(_REACH * 0.5 * hertz.extent_y_mm / hs))
    x = np.asarray(hx * np.arange(0 if grid.half else -count_x, count_x + 1))
    # the same position of the nodes between the patch's edges as on the grid itself
    s = np.asarray(hs * np.arange(-count_s, count_s + 1) + float(grid.s_mm[np.argmin(np.abs(grid.s_mm))]))
    own = ContactGrid(x_mm=x, s_mm=s, half=grid.half)
    h = touch.curvatures[-1]
    gap = 0.5 * h.xx_per_mm * x[:, None] ** 2 + h.xy_per_mm * x[:, None] * s + 0.5 * h.yy_per_mm * s**2
    problem = ContactProblem(
        compliance=half_space_compliance(
            nodes_x=x.size,
            nodes_s=s.size,
            step_x_mm=hx,
            step_s_mm=hs,
            contact_modulus_MPa=hertz.contact_modulus_MPa,
            half=grid.half,
        ),
        gap_mm=gap.ravel(),
        closing=np.ones(gap.size),
        area_mm2=own.whole_area_mm2(),
    )
    solution = solve_contact(problem, hertz.normal_force_N)
    return measure(own, solution.pressure_MPa.reshape(own.shape), solution.approach_mm)


def patch_geometry(
    placement: Placement, grid: ContactGrid, pressure: Floats, hertz: HertzContact, pieces: int
) -> PatchGeometry:
    """What the two profiles do below the patch of a pressure (nx, ns)."""
    touch = placement.first
    below = np.flatnonzero(pressure.max(axis=0) > 0.0)
    low, high = grid.s_mm[below[0]], grid.s_mm[below[-1]]
    places = _junction_places(placement)
    nearest = min(places, key=abs, default=float("inf"))
    s = np.linspace(low, high, 201)
    u = placement.rail.profile.at_arc_length(s + placement.first_arc_length_mm)
    wheel = placement.wheel.profile
    w = wheel.at_arc_length(np.clip(s + float(wheel.arc_length(touch.wheel_u)), 0.0, wheel.length_mm))
    rail_curve = placement.rail.profile.convex_sign * placement.rail.profile.evaluate(u).curvature_per_mm
    relative = rail_curve + wheel.convex_sign * wheel.evaluate(w).curvature_per_mm
    angles = placement.rail.section(u)[2]
    return PatchGeometry(
        junction_distance_mm=abs(nearest),
        junction_distance_over_b=abs(nearest) / (0.5 * hertz.extent_y_mm),
        junction_in_patch=any(low <= place <= high for place in places),
        curvature_variation=float(np.ptp(relative) / abs(touch.curvatures[-1].yy_per_mm)),
        normal_turn_rad=float(np.ptp(angles)),
        pieces=pieces,
    )


def _junction_places(placement: Placement) -> list[float]:
    """Arc lengths (mm) from the touch point to the junctions of both profiles."""
    places = []
    for profile, u in (
        (placement.rail.profile, placement.first.rail_u),
        (placement.wheel.profile, placement.first.wheel_u),
    ):
        origin = float(profile.arc_length(u))
        places += [float(profile.arc_length(profile.locate(j.y_mm))) - origin for j in profile.junctions]
    return [place for place in places if np.isfinite(place)]
