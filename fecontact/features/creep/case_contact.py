"""Pressure of a solved contact as creep theories take it, and the creepages of its case."""

from __future__ import annotations

from dataclasses import replace

from fecontact.bodies import RollingPair
from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch
from fecontact.contact_theories.rolling.creepage import (
    Creepages,
)
from fecontact.contact_theories.rolling.fastsim import one_ellipse, pressure_strips
from fecontact.features.creep.forces import (
    CreepPatch,
    wheelset_creepages,
)
from fecontact.features.creep.steady import pressure_cells
from fecontact.placement.wheel_on_rail import Placement


def real_patch(rung: Rung, patch: Patch, pair: RollingPair) -> CreepPatch:
    """The pressure of a solved contact, whose force is that along the contact normal."""
    field = rung.even().pressure.whole()
    cell = field.grid.steps_mm[0] * field.grid.steps_mm[1]
    pressure = field.values * (rung.normal_force_N / (cell * float(field.values.sum())))
    x, s = field.grid.x_mm, field.grid.s_mm
    pieces = pressure_strips(x, s, pressure, pair)
    ellipse, centre_x, centre_s = one_ellipse(pieces)
    return CreepPatch(
        ellipse=replace(ellipse, normal_force_N=rung.normal_force_N),
        centre_mm=(centre_x, centre_s),
        pieces=pieces,
        cells=pressure_cells(x, s, pressure, area_mm2=patch.area_mm2, lobes=max(1, len(patch.lobes))),
    )


def creepages_of(case: Case, placement: Placement) -> Creepages:
    """Creepages of the wheel against the rail at the first touch point, in the contact frame."""
    given, motion = case.creep, wheelset_creepages(placement, case.creep.speed_ratio)
    return Creepages(
        xi=motion.xi if given.xi is None else given.xi,
        eta=motion.eta if given.eta is None else given.eta,
        spin_per_mm=motion.spin_per_mm if given.spin_per_mm is None else given.spin_per_mm,
    )
