"""Hertz's theory alone at a case's position: what a solution is compared with, in milliseconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.touch_hertz import HertzPoints
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.hertz import hertz_of_case, hertz_points_of_case
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import hertz_uncertainty


@dataclass(frozen=True, kw_only=True, eq=False)
class HertzAlone:
    """Hertz at a case's position.

    Attributes
    ----------
    hertz
        At the first touch point under the case's load, at a junction with the curvature of its field side.
    points
        At every touch point, with the whole load and all sharing it.
    uncertainty_of_profile
        What profiles given by points leave open of its peak pressure and semi-axes (relative); None for exact lines.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    points: HertzPoints
    uncertainty_of_profile: Mapping[str, float] | None


def hertz_alone(case: Case) -> HertzAlone:
    """Place a case and evaluate Hertz.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    placement = place_case(case)
    return HertzAlone(
        case=case,
        placement=placement,
        hertz=hertz_of_case(case, placement),
        points=hertz_points_of_case(case, placement),
        uncertainty_of_profile=hertz_uncertainty(case, placement),
    )
