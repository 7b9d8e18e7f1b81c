"""The rungs between Hertz and the finite elements, on the same pressure nodes: what each step moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.comparison.measures import MEASURES, MISFITS, Measures, Misfit, hertz_measures, measures_of, misfit_of
from fecontact.comparison.patch import Patch
from fecontact.comparison.verdict import PatchGeometry
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement
from fecontact.theory.hertz import HertzContact


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Measures on each rung, and what of each is beside Hertz; all carry the same normal force.

    `hertz`: closed form. `half_space_quadratic`: Hertz's gap on a discrete half-space, which checks the discretisation.
    `half_space`: the true gap on it. `fe`: the true gap between the finite bodies. The last three have the same number
    of nodes a semi-axis, the last two the same nodes: what lies between them is no matter of discretisation.
    """

    hertz: Measures
    half_space_quadratic: Measures
    half_space: Measures
    fe: Measures
    misfits: Mapping[str, Misfit]

    @classmethod
    def of(cls, hertz: HertzContact, *, quadratic: Rung, half_space: Rung, fe: Rung) -> Ladder:
        """Read the rungs of a load."""
        solved = {"half_space_quadratic": quadratic, "half_space": half_space, "fe": fe}
        return cls(
            hertz=hertz_measures(hertz),
            **{name: measures_of(rung) for name, rung in solved.items()},
            misfits={name: misfit_of(rung, hertz) for name, rung in solved.items()},
        )

    @property
    def rungs(self) -> dict[str, Measures]:
        """The rungs by name, in their order."""
        return {name: getattr(self, name) for name in ("hertz", "half_space_quadratic", "half_space", "fe")}

    @property
    def steps(self) -> dict[str, dict[str, float]]:
        """Change of each measure from one rung to the next: relative, or as it is where Hertz has no value."""
        names = ("hertz_to_quadratic", "quadratic_to_true_gap", "half_space_to_bodies")
        rungs = [rung.as_dict() for rung in self.rungs.values()]
        beside = [dict.fromkeys(MISFITS, 0.0), *(misfit.as_dict() for misfit in self.misfits.values())]
        return {
            name: {m: rungs[k + 1][m] / rungs[k][m] - 1.0 for m in MEASURES}
            | {m: beside[k + 1][m] - beside[k][m] for m in MISFITS}
            for k, name in enumerate(names)
        }


def patch_geometry(placement: Placement, fe: Rung, hertz: HertzContact, patch: Patch) -> PatchGeometry:
    """What the two profiles do below the patch of the finite elements."""
    touch = placement.first
    below = np.flatnonzero(fe.pressure_MPa.max(axis=0) > 0.0)
    low, high = fe.grid.s_mm[below[0]], fe.grid.s_mm[below[-1]]
    places = [junction.s_mm for junction in placement.junctions]
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
        lobes=len(patch.lobes),
        pieces=patch.pieces,
    )
