"""Pressure of a solved contact in the form for creep theories.

Also the creepages of its case.
"""

from __future__ import annotations

from dataclasses import replace

from fecontact.bodies import RollingPair
from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch
from fecontact.contact_theories.rolling.creepage import (
    Creepages,
)
from fecontact.contact_theories.rolling.fastsim import divide_pressure, fit_common_ellipse
from fecontact.features.creep.forces import (
    CreepPatch,
    calculate_wheelset_creepages,
)
from fecontact.features.creep.steady import coarsen_pressure
from fecontact.placement.wheel_on_rail import Placement


def make_real_patch(rung: Rung, patch: Patch, pair: RollingPair) -> CreepPatch:
    """Pressure of a solved contact as a patch that rolls.

    Parameters
    ----------
    rung
        Solved pressure.
    patch
        Area in mm2 and lobes of the solved contact.
    pair
        Friction coefficient and elastic constants.

    Returns
    -------
    CreepPatch
        Strips, cells and the ellipse with the second moments of the patch, all with the force along the contact normal.
    """
    field = rung.even().pressure.whole()
    cell_mm2 = field.grid.steps_mm[0] * field.grid.steps_mm[1]
    pressure = field.values * (rung.normal_force_N / (cell_mm2 * float(field.values.sum())))
    x, s = field.grid.x_mm, field.grid.s_mm
    pieces = divide_pressure(x, s, pressure, pair)
    ellipse, centre_x, centre_s = fit_common_ellipse(pieces)
    return CreepPatch(
        ellipse=replace(ellipse, normal_force_N=rung.normal_force_N),
        centre_mm=(centre_x, centre_s),
        pieces=pieces,
        cells=coarsen_pressure(x, s, pressure, area_mm2=patch.area_mm2, lobes=max(1, len(patch.lobes))),
    )


def calculate_case_creepages(case: Case, placement: Placement) -> Creepages:
    """Creepages of the wheel against the rail at the first contact point.

    They are in the contact frame.

    Parameters
    ----------
    case
        Case; each creepage that it gives replaces the creepage of the wheelset.
    placement
        Wheel on rail.

    Returns
    -------
    Creepages
        Longitudinal and lateral creepage without unit, spin in 1/mm.
    """
    case_creep, wheelset = case.creep, calculate_wheelset_creepages(placement, case.creep.speed_ratio)
    return Creepages(
        xi=wheelset.xi if case_creep.xi is None else case_creep.xi,
        eta=wheelset.eta if case_creep.eta is None else case_creep.eta,
        spin_per_mm=wheelset.spin_per_mm if case_creep.spin_per_mm is None else case_creep.spin_per_mm,
    )
