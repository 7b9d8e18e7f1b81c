"""The rungs between Hertz and the finite elements, on the same pressure nodes: what each step moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fecontact.comparison.measures import MEASURES, Measures
from fecontact.comparison.verdict import PatchGeometry
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement
from fecontact.theory.hertz import HertzContact


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


def patch_geometry(placement: Placement, fe: Rung, hertz: HertzContact, pieces: int) -> PatchGeometry:
    """What the two profiles do below the patch of the finite elements."""
    touch = placement.first
    below = np.flatnonzero(fe.pressure_MPa.max(axis=0) > 0.0)
    low, high = fe.grid.s_mm[below[0]], fe.grid.s_mm[below[-1]]
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
        curvature_variation=float(np.ptp(relative) / abs(touch.curvature.yy_per_mm)),
        normal_turn_rad=float(np.ptp(angles)),
        pieces=pieces,
    )


def _junction_places(placement: Placement) -> list[float]:
    """Arc lengths (mm) from the touch point to the junctions of both profiles."""
    places: list[float] = []
    for profile, u in (
        (placement.rail.profile, placement.first.rail_u),
        (placement.wheel.profile, placement.first.wheel_u),
    ):
        at = profile.locate(np.array([junction.y_mm for junction in profile.junctions]))
        places += (profile.arc_length(at) - float(profile.arc_length(u))).tolist()
    return [place for place in places if np.isfinite(place)]
