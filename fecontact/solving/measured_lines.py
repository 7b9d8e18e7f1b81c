"""A case on the other lines that its measured points allow: what they leave open of Hertz and of the half-space."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, TypeVar

from fecontact.case import Case
from fecontact.comparison.point_noise import PointNoise, spread
from fecontact.contact.rung import Rung
from fecontact.errors import ConvergenceError, InputError
from fecontact.geometry.placement import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.smoothed_lines import Variant, variant
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space, hertz_of_case
from fecontact.theory.hertz import HertzContact

# Enough draws to know their scatter to a third.
_WIDTHS: tuple[Variant, ...] = ("narrow", "double")
_DRAWS: tuple[Variant, ...] = tuple(range(6))
Value = TypeVar("Value")


def point_noise(case: Case, placement: Placement, own: tuple[HertzContact, Rung]) -> PointNoise | None:
    """Half-spaces that show what profiles given by points leave open; None where both are exact lines.

    `own` is Hertz and the half-space of the profiles as they are.
    """

    def solved(placed: Placement) -> tuple[HertzContact, Rung]:
        hertz, expected = expect_on_half_space(case, placed)
        return hertz, expected.half_space

    if (found := _on_other_lines(case, placement, solved)) is None:
        return None
    thinned, widths, draws = found
    return PointNoise(own=own, thinned=thinned[0] if thinned else own, widths=tuple(widths), draws=tuple(draws))


def hertz_uncertainty(case: Case, placement: Placement) -> dict[str, float] | None:
    """What profiles given by points leave open of Hertz's peak pressure and semi-axes, relative, by closed forms alone.

    None where both are exact lines; NaN where another line does not come into contact.
    """

    def read(placed: Placement) -> dict[str, float]:
        hertz = hertz_of_case(case, placed)
        return {"p_max_MPa": hertz.p0_MPa, "a_mm": hertz.extent_x_mm / 2.0, "b_mm": hertz.extent_y_mm / 2.0}

    if (found := _on_other_lines(case, placement, read)) is None:
        return None
    thinned, widths, draws = found
    own = read(placement)
    return {name: value / own[name] for name, value in spread(own, thinned=thinned, widths=widths, draws=draws).items()}


def _on_other_lines(
    case: Case, placement: Placement, evaluate: Callable[[Placement], Value]
) -> tuple[list[Value | None], list[Value | None], list[Value | None]] | None:
    """Something of the case with thinned lines, with other widths, and with other noise; None for exact lines."""
    rail, wheel = placement.rail.profile, placement.wheel.profile
    smooth = rail.measured is not None or wheel.measured is not None
    interpolated = rail.thinned() is not None or wheel.thinned() is not None
    if not interpolated and not smooth:
        return None

    def with_lines(rail: Profile, wheel: Profile) -> Value | None:
        try:
            return evaluate(place_case(case, rail=rail, wheel=wheel))
        except (InputError, ConvergenceError):
            return None

    thinned = [with_lines(*_thinned(case, placement))] if interpolated else []
    widths = [with_lines(variant(rail, which), variant(wheel, which)) for which in _WIDTHS if smooth]
    draws = [with_lines(variant(rail, which), variant(wheel, which)) for which in _DRAWS if smooth]
    return thinned, widths, draws


def _thinned(case: Case, placement: Placement) -> tuple[Profile, Profile]:
    """Rail and wheel through one or the other half of their points, whichever moves Hertz's peak pressure more.

    A wrong point is in one of the halves only: the other one shows what it does.
    """
    rail, wheel = placement.rail.profile, placement.wheel.profile
    own = hertz_of_case(case, placement).p0_MPa

    def moves(lines: tuple[Profile, Profile]) -> float:
        try:
            return abs(hertz_of_case(case, place_case(case, rail=lines[0], wheel=lines[1])).p0_MPa - own)
        except (InputError, ConvergenceError):
            return math.inf

    firsts: tuple[Literal[0, 1], ...] = (0, 1)
    return max(((rail.thinned(first) or rail, wheel.thinned(first) or wheel) for first in firsts), key=moves)
