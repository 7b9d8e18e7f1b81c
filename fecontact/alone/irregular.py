"""The smooth pair of a case, on which models of an irregularity are judged: Hertz's bodies at its first touch point."""

from __future__ import annotations

from dataclasses import dataclass

from fecontact.alone.position import normal_force_of
from fecontact.case import Case
from fecontact.comparison.irregular import truth_on
from fecontact.errors import InputError
from fecontact.geometry.placement import Placement
from fecontact.irregularity.shapes import Irregularity
from fecontact.solving.placing import place_case
from fecontact.theory.hertz import HertzContact
from fecontact.theory.irregular import Pair

# A wave of no height: the half-space beside Hertz's closed form.
_NONE = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothPair:
    """Hertz's bodies at the first touch point of a case.

    Attributes
    ----------
    pair, hertz
        Their gap, and Hertz under the force along the normal.
    approach_error, peak_error
        Of the half-space on its nodes, from Hertz on these bodies without an irregularity.
    notes
        What is left out.
    """

    case: Case
    placement: Placement
    pair: Pair
    hertz: HertzContact
    approach_error: float
    peak_error: float
    notes: tuple[str, ...] = ()


def smooth_pair(case: Case) -> SmoothPair:
    """The smooth pair of a case; of its profiles the curvatures at first touch count, and nothing else.

    Raises
    ------
    InputError
        As `place_case` does, for a yaw, for a case that is irregular itself, and where the surfaces conform, so that
        there is no Hertz.
    """
    if case.yaw_rad != 0.0:
        raise InputError(
            f"yaw is {1e3 * case.yaw_rad:g} mrad; allowed: 0, for the models lie along the track; leave the yaw out"
        )
    if case.irregularities:
        raise InputError("rail or wheel of the case is irregular; leave that out, and give it as the irregularity")
    placement = place_case(case)
    touch, force = placement.first, normal_force_of(case, placement)
    curvature = touch.curvature
    pair = Pair(
        A_per_mm=0.5 * curvature.xx_per_mm,
        B_per_mm=0.5 * curvature.yy_per_mm,
        contact_modulus_MPa=case.contact_modulus_MPa,
    )
    hertz = pair.hertz(force)
    flat = truth_on(pair, force, Irregularity(kind="sine", wavelength_mm=8.0 * hertz.a_mm, amplitude_mm=_NONE), 0.0)
    assert flat.p_max_MPa is not None
    return SmoothPair(
        case=case,
        placement=placement,
        pair=pair,
        hertz=hertz,
        approach_error=flat.approach_mm / hertz.approach_mm - 1.0,
        peak_error=flat.p_max_MPa / hertz.p0_MPa - 1.0,
        notes=("the touch point lies at a curvature junction: field side",) if touch.at_junction else (),
    )
