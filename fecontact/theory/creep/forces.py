"""Creep forces by every theory on any contact: Hertz's ellipse, or a pressure that is known otherwise.

Theories that need an ellipse take on another patch that of its second moments (`theory.creep.strips`) with the
creepages of its centre; FASTSIM marches in strips over it; the rolling half-space takes the pressure as it is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fecontact.errors import ConvergenceError, InputError
from fecontact.material import RollingPair
from fecontact.rolling.steady import PressureCells, ellipse_cells, steady_rolling
from fecontact.theory.creep.contact import Creepages, CreepForce, Motion, RollingEllipse
from fecontact.theory.creep.fastsim import Strips, ellipse_strips, fastsim_strips
from fecontact.theory.creep.kalker import kalker_linear
from fecontact.theory.creep.polach import polach
from fecontact.theory.creep.saturation import shen_hedrick_elkins, vermeulen_johnson
from fecontact.theory.creep.strips import STRIPS, mean_creepages
from fecontact.theory.hertz import HertzContact

_LAWS: dict[str, Callable[[RollingEllipse, Creepages], CreepForce]] = {
    "kalker": kalker_linear,
    "vermeulen_johnson": vermeulen_johnson,
    "she": shen_hedrick_elkins,
    "polach": polach,
}
THEORIES = (*_LAWS, "fastsim", "rolling_half_space")
"""Names of the theories, from the simplest to the exact one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CreepPatch:
    """A contact as creep theories take it.

    Attributes
    ----------
    ellipse, centre_mm
        Its ellipse, and where its centre lies from the first touch point, along x and across.
    pieces
        Its separate patches in strips.
    cells
        Its pressure on cells.
    """

    ellipse: RollingEllipse
    centre_mm: tuple[float, float]
    pieces: tuple[Strips, ...]
    cells: PressureCells


def ellipse_patch(contact: RollingEllipse) -> CreepPatch:
    """Hertz's pressure on an ellipse at the first touch point."""
    return CreepPatch(
        ellipse=contact,
        centre_mm=(0.0, 0.0),
        pieces=(ellipse_strips(contact, STRIPS),),
        cells=ellipse_cells(contact.a_mm, contact.b_mm, contact.normal_force_N),
    )


def hertz_patch(hertz: HertzContact, pair: RollingPair) -> CreepPatch:
    """Hertz's contact; one whose axes are turned has the half-widths of its moments along x and across."""
    a, b = 0.5 * hertz.extent_x_mm, 0.5 * hertz.extent_y_mm
    scale = math.sqrt(hertz.a_mm * hertz.b_mm / (a * b))
    return ellipse_patch(RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=hertz.normal_force_N))


def creep_force(theory: str, patch: CreepPatch, creepages: Motion) -> CreepForce:
    """Force of a theory at creepages of the first touch point, or over the curved surfaces; the moment about the point.

    The laws of an ellipse take the creepages of its centre, over curved surfaces their mean over the load.

    Raises
    ------
    InputError
        If the theory does not cover the ellipse or the creepages.
    ConvergenceError
        If the rolling half-space did not converge.
    """
    if theory == "fastsim":
        return fastsim_strips(patch.pieces, creepages)
    if theory == "rolling_half_space":
        return _on_half_space(patch, creepages)
    if theory not in _LAWS:
        raise InputError(f"theory is {theory!r}; allowed: {', '.join(THEORIES)}")
    return _LAWS[theory](patch.ellipse, mean_creepages(patch.pieces, creepages)).at(*patch.centre_mm)


def _on_half_space(patch: CreepPatch, creepages: Motion) -> CreepForce:
    solution = steady_rolling(patch.cells, creepages, patch.ellipse.pair)
    if solution.status != "converged":
        plane = creepages.at(0.0, 0.0)
        raise ConvergenceError(
            f"the rolling half-space did not converge at xi {plane.xi:g}, eta {plane.eta:g}, spin"
            f" {plane.spin_per_mm:g} 1/mm (residual {solution.friction.residual:.1e}); take FASTSIM there"
        )
    return CreepForce(
        fx_N=solution.fx_N,
        fy_N=solution.fy_N,
        mz_Nmm=solution.mz_Nmm,
        adhesion_area_mm2=solution.adhesion_area_mm2,
        slip_area_mm2=solution.slip_area_mm2,
        power_per_speed_N=solution.power_per_speed_N,
    )


def creep_forces(patch: CreepPatch, creepages: Motion) -> Mapping[str, CreepForce | str]:
    """Forces of all theories; in place of one that does not cover the contact, or did not converge, why."""
    found: dict[str, CreepForce | str] = {}
    for theory in THEORIES:
        try:
            found[theory] = creep_force(theory, patch, creepages)
        except (InputError, ConvergenceError) as error:
            found[theory] = str(error)
    return found


def force_difference(one: CreepForce, other: CreepForce, limit_N: float) -> float:
    """Size of the difference of two tangential forces, as vectors, over mu N."""
    return float(np.hypot(one.fx_N - other.fx_N, one.fy_N - other.fy_N)) / limit_N
