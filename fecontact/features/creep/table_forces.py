"""Columns of creep forces and T-gamma in contact tables, by FASTSIM."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.case import Case
from fecontact.contact_theories.approximation import TheoryContact, TheoryPatch
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.rolling.creepage import (
    CreepageField,
    Creepages,
    CreepForce,
    RollingEllipse,
    combine_materials,
)
from fecontact.contact_theories.rolling.fastsim import (
    PRESSURE_STRIPS,
    RollingStrips,
    divide_ellipse,
    divide_pressure,
    fastsim_strips,
)
from fecontact.errors import InputError
from fecontact.features.creep.case_contact import calculate_case_creepages
from fecontact.features.creep.forces import calculate_curved_creepages
from fecontact.outputs.flat_records import Record, select_attributes
from fecontact.placement.wheel_on_rail import Placement


class TableContact(Protocol):
    """Row of a contact table (`solving.alone.ContactTableRow`)."""

    @property
    def case(self) -> Case:
        """Case with shift, yaw and load of the row."""

    @property
    def placement(self) -> Placement | None:
        """Wheel on rail; None if the wheel cannot stand."""

    @property
    def hertz(self) -> HertzContact | None:
        """Hertz's ellipse at the first contact point."""

    @property
    def strips(self) -> TheoryContact | None:
        """Contact by the strip method."""


# Positions along a patch, and positions at which the curved surfaces are evaluated across.
_POSITIONS_ALONG, _SURFACE_POSITIONS = 101, 401


def make_force_columns(row: TableContact) -> Record:
    """Make the columns of creep forces of a row of a contact table.

    Parameters
    ----------
    row
        Row of a contact table.

    Returns
    -------
    dict
        Creepages at the first contact point, and by FASTSIM the creep forces and T-gamma on Hertz's ellipse and on the
        patches of the strip method. Empty without friction, and without a placement.

    Notes
    -----
    Range of validity: as FASTSIM (`contact_theories.rolling.fastsim`). The forces and the moment are about the first
    contact point and in its tangent plane; with `curved` the creepages follow the surfaces across the strips.
    """
    case, placement = row.case, row.placement
    if case.creep.friction is None or placement is None:
        return {}
    pair = combine_materials(case.creep.friction, case.wheel_material, case.rail_material)
    creepages = calculate_case_creepages(case, placement)
    columns: Record = select_attributes(creepages, "xi eta spin_per_mm", "creep_")
    notes = []
    if row.hertz is not None:
        a, b = row.hertz.rolling_semi_axes_mm
        ellipse = RollingEllipse.of(pair, a_mm=a, b_mm=b, normal_force_N=row.hertz.normal_force_N)
        try:
            columns |= _select_forces(fastsim_strips([divide_ellipse(ellipse, PRESSURE_STRIPS)], creepages), "hertz_")
        except InputError as error:
            notes.append(f"without creep forces on Hertz's ellipse: {error}")
    if row.strips is not None:
        pieces = [piece for patch in row.strips.patches for piece in _divide_patch(patch, pair)]
        motion = _find_motion(case, placement, creepages, row.strips)
        try:
            columns |= _select_forces(fastsim_strips(pieces, motion), "strip_")
        except InputError as error:
            notes.append(f"without creep forces on the strip method's patches: {error}")
    return columns | {"creep_notes": "; ".join(notes)}


def _find_motion(case: Case, placement: Placement, creepages: Creepages, strips: TheoryContact) -> CreepageField:
    """Creepages over the patches: of the tangent plane, or of the curved surfaces if the case asks for it."""
    if not case.creep.curved:
        return creepages
    edges_mm = [edge[1] for patch in strips.patches for edge in (patch.low_mm, patch.high_mm)]
    s_mm = np.linspace(min(0.0, *edges_mm), max(0.0, *edges_mm), _SURFACE_POSITIONS)
    return calculate_curved_creepages(placement, creepages, s_mm, case.creep.speed_ratio)


def _divide_patch(patch: TheoryPatch, pair: RollingPair) -> tuple[RollingStrips, ...]:
    """Divide the pressure of a patch into strips with the force of the patch."""
    (low_x, low_s), (high_x, high_s) = patch.low_mm, patch.high_mm
    x = _make_middles(low_x, high_x, _POSITIONS_ALONG)
    s = _make_middles(low_s, high_s, PRESSURE_STRIPS)
    pressure = patch.shape.pressure_MPa(x[:, None] - patch.origin_mm[0], s[None, :] - patch.origin_mm[1])
    cell_mm2 = float((x[1] - x[0]) * (s[1] - s[0]))
    return divide_pressure(x, s, pressure * (patch.normal_force_N / (cell_mm2 * float(pressure.sum()))), pair)


def _make_middles(low: float, high: float, count: int) -> Floats:
    """Middles of equal cells between two positions."""
    return np.asarray(low + (np.arange(count) + 0.5) * ((high - low) / count))


def _select_forces(force: CreepForce, prefix: str) -> Record:
    """Columns of creep forces and T-gamma."""
    return {
        **select_attributes(force, "fx_N fy_N mz_Nmm", f"{prefix}creep_"),
        f"{prefix}t_gamma_N": force.power_per_speed_N,
    }
