"""Screening of a pair: every shift and load by a cheap theory, on each line that the points of its profiles allow.

A position is placed once for each shift and line. What all lines say is the verdict, anything else is open.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.fleet.model import Position, Screen
from fecontact.features.fleet.reading import Kept
from fecontact.features.fleet.screened_position import position_on_line, position_row
from fecontact.features.fleet.screening_rows import PART, Row, write_rows
from fecontact.jobs.workers import Made
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import Wheelset
from fecontact.solving.placing import place_at_shifts, wheelset_of_case

# --- A pair on its lines, placed once for each shift, and what its wheelset tells.

AMPLITUDE_MM, BAND_MM = 3.0, 2.0
"""Amplitude of the lateral motion, and width of the band on the rail."""
# Shifts at which both wheels stand. Wheels of unequal diameters have equal radii beside the middle of the track.
_STEP_MM, _FARTHEST_MM = 0.1, 10.0


def conicity_and_concentration(wheelset: Wheelset) -> tuple[float, float]:
    """Equivalent conicity, and concentration of the contact, of a lateral motion of `AMPLITUDE_MM` without roll.

    The conicity is by the kinematic motion about the shift of equal radii (EN 15302). The concentration is the largest
    part of equally likely shifts, about the middle of the track, at which first touch lies within a band of `BAND_MM`
    on the rail: 1 where it does not move, small where wear is spread. It is a definition of this program: the formula
    of Polach and Nicklisch's (2016) index was not found. NaN where a wheel does not stand over its rail, or there is no
    motion of this amplitude.
    """
    count = round(_FARTHEST_MM / _STEP_MM)
    shifts = [round(_STEP_MM * k, 9) for k in range(-count, count + 1)]
    left = wheelset.left.standings(shifts, 0.0, 0.0)
    right = left if wheelset.symmetric else wheelset.right.standings(shifts, 0.0, 0.0)
    radii = [np.array([math.nan if one is None else one.radius_mm for one in side]) for side in (left, right)]
    # what is nearer to the one rail is farther from the other
    difference = RadiusDifference.of(shifts, radii[0] - radii[1][::-1])
    conicity = math.nan if difference is None else difference.conicity(AMPLITUDE_MM)
    run = [one for shift, one in zip(shifts, left, strict=True) if abs(shift) <= AMPLITUDE_MM]
    # the place on the rail, which does not move
    places = np.sort([one.y_mm for one in run if one is not None])
    inside = np.searchsorted(places, places + BAND_MM, side="right") - np.arange(places.size)
    return conicity, float(inside.max() / len(run)) if places.size == len(run) else math.nan


@dataclass(frozen=True, kw_only=True)
class ScreeningPair:
    """What a worker does with a pair: all its positions, as rows of a table.

    Attributes
    ----------
    case
        Everything but profiles, shift and load.
    positions
        By shift, then load.
    """

    wheel: Kept
    rail: Kept
    case: Case
    positions: tuple[Position, ...]
    theory: Screen

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Write the part of the table."""
        write_rows(self.rows(), folder / PART)
        return Made()

    def rows(self) -> list[Row]:
        """A row a position."""
        filters = sorted({*self.wheel.filters_mm, *self.rail.filters_mm}) or [0.0]
        lines = [{"rail": self.rail.line(one), "wheel": self.wheel.line(one)} for one in filters]
        conicity, concentration = conicity_and_concentration(wheelset_of_case(self.case, **lines[0]))
        pair = {"conicity": conicity, "contact_concentration": concentration}
        loads: dict[float, list[float]] = {}
        for shift, load in self.positions:
            loads.setdefault(shift, []).append(load)
        placed = [place_at_shifts(self.case, tuple(loads), **line) for line in lines]
        return [
            row | pair for shift, own in loads.items() for row in self._at(shift, own, [one[shift] for one in placed])
        ]

    def _at(self, shift: float, loads_kN: Sequence[float], placed: Sequence[Placement | str]) -> list[Row]:
        keys = [{"shift_mm": shift, "load_kN": load} for load in loads_kN]
        placements = [one for one in placed if not isinstance(one, str)]
        if reasons := [one for one in placed if isinstance(one, str)]:
            return [key | refused(reasons[0]) for key in keys]
        first = placements[0].first
        place = {"place_y_mm": float(first.rail_y_mm), "touch_angle_mrad": 1e3 * float(first.contact_angle_rad)}
        return [key | place | self._under(shift, key["load_kN"], placements) for key in keys]

    def _under(self, shift: float, load_kN: float, placed: Sequence[Placement]) -> Row:
        case = replace(self.case, lateral_shift_mm=shift, load_N=1e3 * load_kN)
        try:
            return position_row([position_on_line(case, placement, self.theory) for placement in placed])
        except (InputError, ConvergenceError) as error:
            return refused(str(error))


def refused(reason: str) -> Row:
    """What is said of a position that has no answer."""
    return {"verdict": "REFUSED", "reason": reason}
