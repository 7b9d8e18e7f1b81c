"""Hertz's theory without finite elements, at the position of a case in milliseconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fecontact.case import Case
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.touch_hertz import HertzAtContactPoints
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.hertz import compute_hertz, compute_hertz_points
from fecontact.solving.placing import place_case
from fecontact.solving.profile_variants import estimate_hertz_uncertainty


@dataclass(frozen=True, kw_only=True, eq=False)
class HertzEvaluation:
    """Hertz at the position of a case.

    Attributes
    ----------
    case, placement
        Case, and its wheel on its rail.
    hertz
        Ellipse at the first contact point under the load of the case; at a junction with the curvature of its field
        side.
    points
        Hertz at every contact point, each with the whole load and all sharing the load.
    uncertainty_of_profile
        Relative uncertainty of peak pressure and semi-axes from measured profiles (-); None for exact profiles.
    """

    case: Case
    placement: Placement
    hertz: HertzContact
    points: HertzAtContactPoints
    uncertainty_of_profile: Mapping[str, float] | None


def evaluate_hertz(case: Case) -> HertzEvaluation:
    """Place a case and evaluate Hertz.

    Range of validity: a single patch of constant curvature on half-spaces; `solve` gives the deviation from finite
    elements.

    Parameters
    ----------
    case
        Case with profiles, position and load.

    Returns
    -------
    HertzEvaluation
        Ellipse, contact points and uncertainty from the profiles.

    Raises
    ------
    InputError
        As in `place_case` and `compute_hertz`.

    Examples
    --------
    >>> import fecontact
    >>> from fecontact.solving.hertz_alone import evaluate_hertz
    >>> round(evaluate_hertz(fecontact.Case()).hertz.p0_MPa)
    773
    """
    placement = place_case(case)
    return HertzEvaluation(
        case=case,
        placement=placement,
        hertz=compute_hertz(case, placement),
        points=compute_hertz_points(case, placement),
        uncertainty_of_profile=estimate_hertz_uncertainty(case, placement),
    )
