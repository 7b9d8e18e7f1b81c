"""Causes of Hertz's deviations, from the ladder and from the profiles below the patch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.ladder import GAP_STEP, LADDER_STEPS, PLASTIC_STEP
from fecontact.placement.wheel_on_rail import Placement

# Angle of the normals below the patch above which the surfaces are called conforming. A flat half-space has an error of
# about the square of half this angle, 2 % here.
_CONFORMING_RAD = 0.3


@dataclass(frozen=True, kw_only=True)
class PatchGeometry:
    """Geometry of the profiles below the finite-element patch.

    Attributes
    ----------
    junction_distance_mm
        Distance from the contact point to the nearest curvature junction of either profile in mm; inf without a
        junction.
    junction_distance_over_b
        This distance divided by the half-width of Hertz's ellipse (-).
    junction_in_patch
        Whether the patch covers a junction.
    curvature_variation
        Largest minus smallest relative lateral curvature below the patch, divided by its value at the contact point
        (-).
    normal_turn_rad
        Angle by which the rail's normal turns below the patch: the measure of conformity.
    lobes, patch_count
        Number of lobes of the pressure, and number of separate patches.
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
    patch_count: int


def find_cause(
    steps: Mapping[str, Mapping[str, float]], measure: str, geometry: PatchGeometry, *, plastic: bool = False
) -> str:
    """Cause of Hertz's deviation in a measure.

    The cause belongs to the ladder step with the largest change of the measure. For the step of the gap, the geometry
    decides.

    Parameters
    ----------
    steps
        Change of each measure (-), by the name of the ladder step and the name of the measure.
    measure
        Name of the measure.
    geometry
        Geometry of the profiles below the patch.
    plastic
        Whether Hertz is compared with bodies that yield; if not, the plastic step is left out.

    Returns
    -------
    str
        Cause in words.
    """
    # The load on a second patch drops to zero on the rung on which the two patches join. The valley between the peaks
    # shows reliably whether there are two patches.
    indicator = "valley" if measure == "separate_load" else measure
    candidates = (
        step for step in LADDER_STEPS if step.cause and step.name in steps and (plastic or step is not PLASTIC_STEP)
    )
    largest_step = max(candidates, key=lambda step: abs(steps[step.name][indicator]))
    return find_gap_cause(geometry) if largest_step is GAP_STEP else largest_step.cause


def find_gap_cause(geometry: PatchGeometry) -> str:
    """Cause of Hertz's deviation if the shape of the gap has the largest effect.

    Parameters
    ----------
    geometry
        Geometry of the profiles below the patch.

    Returns
    -------
    str
        Cause in words.
    """
    if geometry.patch_count > 1:
        return "second patch"
    if geometry.lobes > 1:
        return "second lobe"
    if geometry.junction_in_patch:
        return "curvature change within the patch"
    if geometry.normal_turn_rad > _CONFORMING_RAD:
        return "conformity"
    return "curvature varies over the patch"


def measure_patch_geometry(placement: Placement, fe: Rung, hertz: HertzContact, patch: Patch) -> PatchGeometry:
    """Geometry of both profiles below the finite-element patch.

    Parameters
    ----------
    placement
        Wheel on rail, with the profiles and the first contact point.
    fe
        Contact of the finite elements; its pressure limits the range of s.
    hertz
        Hertz's ellipse at the first contact point.
    patch
        Patch of the contact of the finite elements.

    Returns
    -------
    PatchGeometry
        Distances in mm, angle in rad, ratios without a unit.
    """
    contact_point = placement.first
    loaded_columns = np.flatnonzero(fe.pressure_MPa.max(axis=0) > 0.0)
    low_s_mm, high_s_mm = fe.grid.s_mm[loaded_columns[0]], fe.grid.s_mm[loaded_columns[-1]]
    junctions_mm = [junction.s_mm for junction in placement.junctions]
    nearest_mm = min(junctions_mm, key=abs, default=float("inf"))
    s_mm = np.linspace(low_s_mm, high_s_mm, 201)
    rail_u = placement.rail.profile.at_arc_length(s_mm + placement.first_arc_length_mm)
    wheel_profile = placement.wheel.profile
    wheel_u = wheel_profile.at_arc_length(
        np.clip(s_mm + float(wheel_profile.arc_length(contact_point.wheel_u)), 0.0, wheel_profile.length_mm)
    )
    rail_curvature = placement.rail.profile.convex_sign * placement.rail.profile.evaluate(rail_u).curvature_per_mm
    relative_curvature = rail_curvature + wheel_profile.convex_sign * wheel_profile.evaluate(wheel_u).curvature_per_mm
    angles = placement.rail.section(rail_u)[2]
    return PatchGeometry(
        junction_distance_mm=abs(nearest_mm),
        junction_distance_over_b=abs(nearest_mm) / (0.5 * hertz.extent_y_mm),
        junction_in_patch=any(low_s_mm <= junction_mm <= high_s_mm for junction_mm in junctions_mm),
        curvature_variation=float(np.ptp(relative_curvature) / abs(contact_point.curvature.yy_per_mm)),
        normal_turn_rad=float(np.ptp(angles)),
        lobes=len(patch.lobes),
        patch_count=patch.patch_count,
    )
