"""A case on the other lines that its measured points allow: what they leave open of Hertz and of the half-space."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.judging.lines import FILTER, NOISE, Lines, OnLine, is_drawn
from fecontact.judging.lobes import judge_line
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.variants import other_lines
from fecontact.solving.hertz import hertz_of_case
from fecontact.solving.placing import place_case
from fecontact.solving.position import expect_on_half_space

# Deviations move from line to line by what lines are, and 16 nodes per semi-axis read that as well as 32. Where a
# narrow lobe would ask for more nodes than these in all it has fewer. The tolerance leaves 1e-4 of the pressure.
_NODES_A_LINE, _MOST_A_LINE, _TOLERANCE_OF_A_LINE = 16, 40_000, 1e-5
OWN_LINE = "own line"
# Of the scatter of four draws about the own line, for 95 %.
_STUDENT = 2.78
Value = TypeVar("Value")


def lines_of_case(case: Case, placement: Placement) -> Lines | None:
    """Every theory against the half-space, on the own line and on all others that points allow; None of exact lines."""

    def on_line(label: str, placed: Placement) -> OnLine:
        _, expected = expect_on_half_space(
            case, placed, nodes=_NODES_A_LINE, most=_MOST_A_LINE, tolerance=_TOLERANCE_OF_A_LINE
        )
        return judge_line(label, case, placed, expected.half_space)

    found = _on_lines(case, placement, on_line)
    if not found:
        return None
    own, *others = (OnLine(label=label) if one is None else one for label, one in found.items())
    return Lines(own=own, others=tuple(others))


def hertz_uncertainty(case: Case, placement: Placement) -> dict[str, float] | None:
    """What profiles given by points leave open of Hertz's peak pressure and semi-axes, relative, by closed forms alone.

    The largest change by another filter or nominal, and the scatter by other noise for 95 %, as independent errors.
    None where both are exact lines; NaN where another line does not come into contact.
    """

    def read(_: str, placed: Placement) -> dict[str, float]:
        hertz = hertz_of_case(case, placed)
        return {"p_max_MPa": hertz.p0_MPa, "a_mm": hertz.extent_x_mm / 2.0, "b_mm": hertz.extent_y_mm / 2.0}

    found = _on_lines(case, placement, read)
    if not found:
        return None
    own = read(OWN_LINE, placement)

    def left_open(name: str, value: float) -> float:
        by = {label: math.nan if one is None else one[name] / value - 1.0 for label, one in found.items()}
        drawn = np.array([change for label, change in by.items() if is_drawn(label)])
        smoothed = np.abs([change for label, change in by.items() if not is_drawn(label)]).max()
        scatter = math.sqrt(float(np.mean(drawn**2))) if drawn.size else 0.0
        return math.hypot(float(smoothed), _STUDENT * scatter)

    return {name: left_open(name, value) for name, value in own.items()}


def _on_lines(case: Case, placement: Placement, evaluate: Callable[[str, Placement], Value]) -> dict[str, Value | None]:
    """Something of the case on its own line and on every other one by its label; empty of exact lines.

    The same filter is taken for rail and wheel, and None stands for lines that do not come into contact.
    """
    rail, wheel = placement.rail.profile, placement.wheel.profile
    rails, wheels = lines_by_label(rail), lines_by_label(wheel)
    labels = dict.fromkeys([*rails, *wheels])
    own = _own_label(rail, wheel)

    def with_lines(label: str) -> Value | None:
        try:
            return evaluate(label, place_case(case, rail=rails.get(label, rail), wheel=wheels.get(label, wheel)))
        except (InputError, ConvergenceError):
            return None

    return {own: evaluate(own, placement), **{label: with_lines(label) for label in labels}} if labels else {}


def _own_label(rail: Profile, wheel: Profile) -> str:
    """What the own line is, where rail and wheel were smoothed alike."""
    made = {_filter(p.measured.filter_mm, p.measured.nominal) for p in (rail, wheel) if p.measured is not None}
    return made.pop() if len(made) == 1 else OWN_LINE


def _filter(filter_mm: float, nominal: str) -> str:
    return f"{FILTER} {filter_mm:.3g} mm" + (f" from {nominal}" if nominal else "")


def lines_by_label(profile: Profile) -> dict[str, Profile]:
    """Lines that the points of a profile allow beside its own by their labels, as they are through either half."""
    if profile.measured is None:
        halves = {f"half {k + 1} of the points": profile.thinned(k) for k in (0, 1)}
        return {label: line for label, line in halves.items() if line is not None}
    return {
        f"{NOISE} {one.draw + 1}" if one.draw >= 0 else _filter(one.filter_mm, one.nominal): one.profile
        for one in other_lines(profile)
    }
