"""Results of a vehicle in curves by several theories.

The module compares the theories, and locates the wheels on a map.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.features.curves.conditions import Conditions
from fecontact.features.curves.curve import CurveRun, WheelRun, WheelsetRun
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.stability import StraightTrack

# --- Effect of the theory of the contact on a vehicle: position, guidance, critical speed.


@dataclass(frozen=True, kw_only=True)
class TheoryDifference:
    """Differences between a theory and a reference theory.

    Curves count in which both theories have an equilibrium.

    Attributes
    ----------
    theory, reference
        Names of both theories.
    without_m
        Radii (m) at which the theory has no equilibrium and the reference has an equilibrium.
    shift_mm, shift_at_m
        Largest difference of a wheelset's lateral shift, and its radius; NaN if no curves can be compared.
    y_over_q, y_over_q_at_m
        Largest difference of a wheel's Y/Q, and its radius; NaN if no curves can be compared.
    critical_speed
        Ratio of the critical speed and the critical speed of the reference, minus 1; None if either has no critical
        speed.
    without_speed
        Reason why the critical speeds cannot be compared.
    """

    theory: str
    reference: str
    without_m: tuple[float, ...]
    shift_mm: float
    shift_at_m: float
    y_over_q: float
    y_over_q_at_m: float
    critical_speed: float | None
    without_speed: str = ""


def compare_theories(
    runs: Mapping[str, Sequence[CurveRun]], straight: Sequence[StraightTrack] = ()
) -> tuple[TheoryDifference, ...]:
    """Compare each theory with the last theory.

    Parameters
    ----------
    runs
        Results by theory, all with the same radii in the same order.
    straight
        Stability on straight track by theory.

    Returns
    -------
    tuple of TheoryDifference
        A difference for each theory except the last.
    """
    *theories, reference = runs
    straight_by_theory = {track.theory: track for track in straight}
    return tuple(_compare_theory(runs, straight_by_theory, theory, reference) for theory in theories)


def _compare_theory(
    runs: Mapping[str, Sequence[CurveRun]], straight: Mapping[str, StraightTrack], theory: str, reference: str
) -> TheoryDifference:
    """Compare a theory with the reference, curve by curve.

    Parameters
    ----------
    runs
        Runs of each theory, in an equal order of radii.
    straight
        Critical speeds on straight track, for theories that have them.
    theory, reference
        Names of the theories.

    Returns
    -------
    TheoryDifference
        Largest differences of lateral shift (mm) and of Y/Q (-), each with its radius in m. NaN without a curve that is
        balanced by both theories.
    """
    pairs = list(zip(runs[theory], runs[reference], strict=True))
    shifts = [
        (abs(wheelset.lateral_shift_mm - reference_wheelset.lateral_shift_mm), radius)
        for radius, wheelset, reference_wheelset in _balanced_wheelsets(pairs)
    ]
    guiding = [
        (abs(wheelset.wheels[index].y_over_q - reference_wheelset.wheels[index].y_over_q), radius)
        for radius, wheelset, reference_wheelset in _balanced_wheelsets(pairs)
        for index in (0, 1)
    ]
    no_value = (math.nan, math.nan)
    (shift, shift_at), (y_over_q, y_over_q_at) = max(shifts, default=no_value), max(guiding, default=no_value)
    tracks = [straight[name] for name in (theory, reference) if name in straight]
    speeds = [track.critical_speed_km_h for track in tracks if track.critical_speed_km_h]
    return TheoryDifference(
        theory=theory,
        reference=reference,
        without_m=tuple(
            run.radius_m for run, reference_run in pairs if not run.is_balanced and reference_run.is_balanced
        ),
        shift_mm=shift,
        shift_at_m=shift_at,
        y_over_q=y_over_q,
        y_over_q_at_m=y_over_q_at,
        critical_speed=speeds[0] / speeds[1] - 1.0 if len(speeds) == 2 else None,
        without_speed="; ".join(f"{track.theory}: {track.problem}" for track in tracks if track.problem),
    )


def _balanced_wheelsets(pairs: Sequence[tuple[CurveRun, CurveRun]]) -> Iterator[tuple[float, WheelsetRun, WheelsetRun]]:
    """Yield radius and wheelset by each theory, if both theories have an equilibrium."""
    for run, reference_run in pairs:
        if run.is_balanced and reference_run.is_balanced:
            for wheelset, reference_wheelset in zip(run.wheelsets, reference_run.wheelsets, strict=True):
                yield run.radius_m, wheelset, reference_wheelset


# --- Vehicle in curves by several theories, and positions of its wheels on a map of the left wheel.

NO_EQUILIBRIUM, NO_CELL = "no equilibrium", "not on the map"
"""Words in place of a verdict: for a curve without an equilibrium, and for a wheel outside of the map."""


@dataclass(frozen=True, kw_only=True)
class VisitedCell:
    """Result of a map of the left wheel at a shift and a load.

    Attributes
    ----------
    lateral_shift_mm, load_kN
        Shift and load of the cell.
    verdict
        Verdict of Hertz.
    cheapest_theory
        Name of the cheapest theory that holds, with the words `(out of range)` if it is out of its range.
    """

    lateral_shift_mm: float
    load_kN: float
    verdict: str
    cheapest_theory: str


@dataclass(frozen=True, kw_only=True)
class MapColumn:
    """Solved shift of a map of the left wheel.

    Attributes
    ----------
    lateral_shift_mm
        Lateral shift.
    reach_mm
        Distance from the shift, on both sides, in which the column is valid.
    bands
        Smallest load (kN), largest load (kN) and verdict of each range of loads, by increasing load.
    cells
        A cell for each load, by increasing load.
    """

    lateral_shift_mm: float
    reach_mm: float
    bands: tuple[tuple[float, float, str], ...]
    cells: tuple[VisitedCell, ...]


@dataclass(frozen=True, kw_only=True)
class Visit:
    """Position of a wheel on a map of the left wheel.

    The load limits of the map at the load of the wheel give the verdict. The cell with the nearest load gives the
    cheapest theory.

    Attributes
    ----------
    theory, radius_m, wheelset, side
        Theory and radius of the curve; number of the wheelset from 1; `left` or `right`.
    lateral_shift_mm, yaw_mrad
        Shift and yaw of the wheel as a left wheel.
    vertical_force_N
        Vertical force of the wheel.
    cell
        Result of the map; None outside of the solved shifts and loads.
    """

    theory: str
    radius_m: float
    wheelset: int
    side: TrackSide
    lateral_shift_mm: float
    vertical_force_N: float
    yaw_mrad: float
    cell: VisitedCell | None


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveResults:
    """Results of a vehicle in curves.

    Attributes
    ----------
    vehicle, conditions
        Vehicle, and running conditions.
    case
        Rail and wheel of all wheels.
    radii_m
        Radii, positive to the right.
    share
        Share of the way of each radius; the sum is 1.
    runs
        Results by theory, in the order of the radii.
    straight
        Stability on straight track by each theory.
    differences
        Differences between each theory and the last theory.
    columns
        Columns of a map; empty without a map.
    visits
        Positions of all wheels on a map of the left wheel, with or without a map.
    """

    vehicle: Vehicle
    case: Case
    conditions: Conditions
    radii_m: tuple[float, ...]
    share: tuple[float, ...]
    runs: Mapping[str, tuple[CurveRun, ...]]
    straight: tuple[StraightTrack, ...] = ()
    differences: tuple[TheoryDifference, ...] = ()
    columns: tuple[MapColumn, ...] = ()
    visits: tuple[Visit, ...] = ()

    def shares(self, theory: str, answer_kind: Literal["verdict", "cheapest_theory"]) -> Mapping[str, float]:
        """Shares of the way, over all wheels, by the results of a map.

        Parameters
        ----------
        theory
            Name of the theory of the normal force.
        answer_kind
            Attribute of the cells: `verdict` or `cheapest_theory`.

        Returns
        -------
        mapping
            Share of the way for each answer; for wheels outside of the map `NO_CELL`, and for curves without an
            equilibrium `NO_EQUILIBRIUM`.
        """
        share_by_answer: dict[str, float] = {}
        for radius, radius_share in zip(self.radii_m, self.share, strict=True):
            answers = [
                getattr(visit.cell, answer_kind, NO_CELL)
                for visit in self.visits
                if (visit.theory, visit.radius_m) == (theory, radius)
            ]
            for name in answers or [NO_EQUILIBRIUM]:
                share_by_answer[name] = share_by_answer.get(name, 0.0) + radius_share / max(len(answers), 1)
        return share_by_answer


def locate_wheels(runs: Mapping[str, Sequence[CurveRun]], columns: Sequence[MapColumn]) -> tuple[Visit, ...]:
    """Locate all wheels of all equilibria on a map.

    Parameters
    ----------
    runs
        Results by theory.
    columns
        Columns of a map; may be empty.

    Returns
    -------
    tuple of Visit
        A position for each wheel.
    """
    return tuple(
        _locate_wheel(theory, run, number, wheel, columns)
        for theory, theory_runs in runs.items()
        for run in theory_runs
        if run.is_balanced
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    )


def _locate_wheel(theory: str, run: CurveRun, number: int, wheel: WheelRun, columns: Sequence[MapColumn]) -> Visit:
    """Locate a wheel on the map; a right wheel is mirrored to the left side."""
    wheelset, sign = run.wheelsets[number - 1], 1.0 if wheel.side == "left" else -1.0
    shift = sign * wheelset.lateral_shift_mm
    return Visit(
        theory=theory,
        radius_m=run.radius_m,
        wheelset=number,
        side=wheel.side,
        lateral_shift_mm=shift,
        vertical_force_N=wheel.vertical_force_N,
        yaw_mrad=sign * wheelset.yaw_mrad,
        cell=_find_cell(columns, shift, 1e-3 * wheel.vertical_force_N),
    )


def _find_cell(columns: Sequence[MapColumn], shift_mm: float, load_kN: float) -> VisitedCell | None:
    """Find the result of a map at a shift and a load.

    The result is None outside of the solved shifts and loads, and without a map.
    """
    if not columns:
        return None
    column = min(columns, key=lambda candidate: abs(candidate.lateral_shift_mm - shift_mm))
    if abs(column.lateral_shift_mm - shift_mm) > column.reach_mm:
        return None
    answers = [answer for low, high, answer in column.bands if low <= load_kN <= high]
    cell = min(column.cells, key=lambda candidate: abs(candidate.load_kN - load_kN))
    return replace(cell, verdict=answers[0]) if answers else None
