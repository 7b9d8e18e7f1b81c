"""Screening of a pair: all shifts and loads by a cheap theory, on all profile variants.

A position is placed once for each shift and variant. The verdict is the common answer of all variants; if the answers
differ, the position is open.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.errors import ConvergenceError, FecontactError, InputError
from fecontact.features.fleet.model import Position, ScreeningTheory
from fecontact.features.fleet.reading import StoredProfile
from fecontact.features.fleet.screened_position import ScreenedVariant, make_position_row, screen_variants
from fecontact.features.fleet.screening_rows import NO_CONTACT, REFUSED, ROWS_FILE, Row, write_rows
from fecontact.jobs.workers import WorkResult
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.problems import PositionProblem
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import Wheelset
from fecontact.solving.placing import make_wheelset, place_at_shifts
from fecontact.solving.profile_variants import join_reference_labels

AMPLITUDE_MM, BAND_MM = 3.0, 2.0
"""Amplitude of the lateral motion, and width of the band on the rail."""
# Step and range of the shifts at which both wheels are placed. Wheels of unequal diameters have equal radii away from
# the middle of the track.
_STEP_MM, _FARTHEST_MM = 0.1, 10.0
# Number of loads times profile variants that are screened together. Ten share the time of a call of numpy; each of them
# has 0.2 MB.
_POSITIONS_AT_ONCE = 32


def calculate_conicity_and_concentration(wheelset: Wheelset, side: TrackSide = "left") -> tuple[float, float]:
    """Equivalent conicity, and concentration of the contact, of a lateral motion of `AMPLITUDE_MM` without roll.

    Parameters
    ----------
    wheelset
        Both wheels on their rails.
    side
        Side of the contacts whose concentration is calculated.

    Returns
    -------
    tuple of float
        Conicity and concentration, without unit. NaN if a wheel has no contact with its rail, or there is no motion of
        this amplitude.

    Notes
    -----
    The conicity is by the kinematic motion about the shift of equal radii (EN 15302). The concentration is the largest
    fraction of equally likely shifts, about the middle of the track, at which the first touch is within a band of
    `BAND_MM` on the rail: 1 if it does not move, small if wear is spread. It is a definition of this program: the
    formula of Polach and Nicklisch's (2016) index was not found.
    """
    count = round(_FARTHEST_MM / _STEP_MM)
    shifts = [round(_STEP_MM * k, 9) for k in range(-count, count + 1)]
    left = wheelset.left.standings(shifts, 0.0, 0.0)
    right = left if wheelset.symmetric else wheelset.right.standings(shifts, 0.0, 0.0)
    radii = [
        np.array([math.nan if standing is None else standing.radius_mm for standing in side]) for side in (left, right)
    ]
    # a shift towards the left rail is a shift away from the right rail
    difference = RadiusDifference.of(shifts, radii[0] - radii[1][::-1])
    conicity = math.nan if difference is None else difference.conicity(AMPLITUDE_MM)
    side_standings = left if side == "left" else right
    standings = [standing for shift, standing in zip(shifts, side_standings, strict=True) if abs(shift) <= AMPLITUDE_MM]
    # places are on the rail, which does not move
    places_mm = np.sort([standing.y_mm for standing in standings if standing is not None])
    inside = np.searchsorted(places_mm, places_mm + BAND_MM, side="right") - np.arange(places_mm.size)
    return conicity, float(inside.max() / len(standings)) if places_mm.size == len(standings) else math.nan


@dataclass(frozen=True, kw_only=True)
class ScreeningPair:
    """Job of a worker: screen all positions of a pair, as rows of a table.

    Attributes
    ----------
    wheel, rail
        Stored profiles.
    case
        Everything but profiles, shift and load.
    positions
        Shift (mm) and load (kN), by shift, then load.
    theory
        Theory of the screening.
    opposite
        Profiles of the other side of the track, unless they are the mirror images.
    """

    wheel: StoredProfile
    rail: StoredProfile
    case: Case
    positions: tuple[Position, ...]
    theory: ScreeningTheory
    opposite: tuple[StoredProfile, ...] = ()

    def __call__(self, folder: Path, finished: Path | None) -> WorkResult:
        """Write the rows of the pair into the folder of the job."""
        write_rows(self.rows(), folder / ROWS_FILE)
        return WorkResult()

    def rows(self) -> list[Row]:
        """Rows of all positions of the pair.

        Returns
        -------
        list of dict
            Rows by shift, then load.
        """
        reference_label = join_reference_labels(self.rail.reference_label, self.wheel.reference_label)
        labels = dict.fromkeys([reference_label, *self.rail.other_labels, *self.wheel.other_labels])
        variants = [{"rail": self.rail.variant(label), "wheel": self.wheel.variant(label)} for label in labels]
        # the other side has its reference variants, as in a case
        opposite = {profile.body: profile.variant(profile.reference_label) for profile in self.opposite}
        conicity, concentration = calculate_conicity_and_concentration(
            make_wheelset(self.case, **variants[0], opposite_profiles=opposite), self.case.side
        )
        wheelset_columns = {"conicity": conicity, "contact_concentration": concentration}
        loads: dict[float, list[float]] = {}
        for shift, load in self.positions:
            loads.setdefault(shift, []).append(load)
        outcomes = [
            place_at_shifts(self.case, tuple(loads), **variant, opposite_profiles=opposite) for variant in variants
        ]
        return [
            row | wheelset_columns
            for shift, shift_loads in loads.items()
            for row in self._screen_shift(
                shift,
                shift_loads,
                {label: by_shift[shift] for label, by_shift in zip(labels, outcomes, strict=True)},
            )
        ]

    def _screen_shift(
        self, shift: float, loads_kN: Sequence[float], outcomes: Mapping[str, Placement | PositionProblem]
    ) -> list[Row]:
        """Rows of all loads at a shift.

        `outcomes` has the placement on each variant, the reference variant first, or the reason why there is none.
        """
        keys = [{"shift_mm": shift, "load_kN": load} for load in loads_kN]
        reference, *_ = outcomes.values()
        if isinstance(reference, PositionProblem):
            # a variant on which the wheel can stand leaves it unknown whether there is a contact
            problems = [outcome for outcome in outcomes.values() if isinstance(outcome, PositionProblem)]
            is_derailed = len(problems) == len(outcomes) and all(problem.is_derailed for problem in problems)
            return [key | make_refusal_columns(reference, is_derailed=is_derailed) for key in keys]
        touch = reference.first
        place = {"place_y_mm": float(touch.rail_y_mm), "contact_angle_mrad": 1e3 * float(touch.contact_angle_rad)}
        cases = [replace(self.case, lateral_shift_mm=shift, load_N=1e3 * load_kN) for load_kN in loads_kN]
        placements = {label: outcome for label, outcome in outcomes.items() if isinstance(outcome, Placement)}
        rows: list[Row] = []
        step = max(1, _POSITIONS_AT_ONCE // len(placements))
        for first in range(0, len(cases), step):
            some_cases = cases[first : first + step]
            positions = [(case, placement) for case in some_cases for placement in placements.values()]
            screened = iter(screen_variants(positions, self.theory))
            rows += [
                _make_row(dict.fromkeys(outcomes) | {label: next(screened) for label in placements}) for _ in some_cases
            ]
        return [key | place | row for key, row in zip(keys, rows, strict=True)]


def _make_row(variants: Mapping[str, ScreenedVariant | FecontactError | None]) -> Row:
    """Row of a position, or the reason of its refusal.

    `variants` has the contact on each variant, the reference variant first, its error, or None where there is no
    placement.
    """
    reference, *_ = variants.values()
    try:
        if isinstance(reference, FecontactError):
            raise reference
        return make_position_row(
            {label: variant if isinstance(variant, ScreenedVariant) else None for label, variant in variants.items()}
        )
    except (InputError, ConvergenceError) as error:
        return make_refusal_columns(error)


def make_refusal_columns(cause: FecontactError | str, *, is_derailed: bool = False) -> Row:
    """Columns of a position without an answer.

    Parameters
    ----------
    cause
        The error, the problem of the placement, or a message.
    is_derailed
        Whether the wheel cannot stand there on any profile variant, so that the position is not a contact.

    Returns
    -------
    dict
        Verdict `NO CONTACT` or `REFUSED`, the reason, its kind and its remedy.
    """
    problem = PositionProblem.explain(cause)
    return {
        "verdict": NO_CONTACT if is_derailed else REFUSED,
        "reason": str(problem),
        "reason_kind": problem.kind,
        "remedy": problem.remedy,
    }
