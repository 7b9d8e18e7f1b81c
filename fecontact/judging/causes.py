"""Causes of Hertz's deviations: the largest step of the ladder, and the profiles below the patch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.ladder import GAP, PLASTIC, STEPS
from fecontact.placement.wheel_on_rail import Placement

# If the normals below the patch turn by more than this, the surfaces are called conforming: a flat half-space has an
# error of about the square of half the turn, 2 % here.
_CONFORMING_RAD = 0.3


@dataclass(frozen=True, kw_only=True)
class PatchGeometry:
    """Geometry of the profiles below the finite-element patch.

    Attributes
    ----------
    junction_distance_mm
        Distance from the touch point to the next curvature junction of either profile; inf without a junction.
    junction_distance_over_b
        This distance over Hertz's semi-axis on this side.
    junction_in_patch
        Whether the patch covers a junction.
    curvature_variation
        Largest minus smallest relative lateral curvature below the patch, over its value at the touch point.
    normal_turn_rad
        Angle by which the rail's normal turns below the patch: the measure of conformity.
    lobes, pieces
        Lobes of the pressure, and separate patches.
    """

    TELLS = (
        *("junction_distance_mm", "junction_distance_over_b", "junction_in_patch"),
        *("curvature_variation", "normal_turn_rad"),
    )

    junction_distance_mm: float
    junction_distance_over_b: float
    junction_in_patch: bool
    curvature_variation: float
    normal_turn_rad: float
    lobes: int
    pieces: int


def cause_of(
    steps: Mapping[str, Mapping[str, float]], measure: str, geometry: PatchGeometry, *, plastic: bool = False
) -> str:
    """Why Hertz is off in a measure, from the step of the ladder that changed the measure most and from the geometry.

    With `plastic` Hertz is compared with bodies that yield, else with elastic bodies.
    """
    # the load on a second patch jumps to zero when the two patches join, on one rung or another; the valley between the
    # peaks shows whether there are two
    told_by = "valley" if measure == "separate_load" else measure
    counted = (step for step in STEPS if step.cause and step.name in steps and (plastic or step is not PLASTIC))
    moved_most = max(counted, key=lambda step: abs(steps[step.name][told_by]))
    return cause_in_gap(geometry) if moved_most is GAP else moved_most.cause


def cause_in_gap(geometry: PatchGeometry) -> str:
    """Why Hertz is off where the shape of the gap moved most."""
    if geometry.pieces > 1:
        return "second patch"
    if geometry.lobes > 1:
        return "second lobe"
    if geometry.junction_in_patch:
        return "curvature change within the patch"
    if geometry.normal_turn_rad > _CONFORMING_RAD:
        return "conformity"
    return "curvature varies over the patch"


def patch_geometry(placement: Placement, fe: Rung, hertz: HertzContact, patch: Patch) -> PatchGeometry:
    """Geometry of both profiles below the finite-element patch."""
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
