"""A vehicle in curves by several theories: what they change for it, and where its wheels are on a map."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from fecontact.bodies import TrackSide
from fecontact.case import Case
from fecontact.features.curves.curve import Conditions, CurveRun, WheelRun, WheelsetRun
from fecontact.features.curves.model import Vehicle
from fecontact.features.curves.stability import StraightTrack

# --- What the theory of the contact changes for a vehicle: where it runs, how it guides, how fast it may run.


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A theory against a reference, over all curves in which both have an equilibrium.

    Attributes
    ----------
    without_m
        Radii at which the theory has no equilibrium and the reference has one.
    shift_mm, shift_at_m
        Largest difference of a wheelset's lateral shift, and at which radius; NaN where there is nothing to compare.
    y_over_q, y_over_q_at_m
        The same of Y/Q, over all wheels.
    critical_speed
        Critical speed over the reference's critical speed, less 1; None if either has no critical speed.
    without_speed
        Why there is none to compare.
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


def differences(
    runs: Mapping[str, Sequence[CurveRun]], straight: Sequence[StraightTrack] = ()
) -> tuple[Difference, ...]:
    """Each theory against the last one, curve by curve in their order."""
    *others, reference = runs
    of_straight = {one.theory: one for one in straight}
    return tuple(_difference(runs, of_straight, theory, reference) for theory in others)


def _difference(
    runs: Mapping[str, Sequence[CurveRun]], straight: Mapping[str, StraightTrack], theory: str, reference: str
) -> Difference:
    pairs = list(zip(runs[theory], runs[reference], strict=True))
    shifts = [(abs(a.lateral_shift_mm - b.lateral_shift_mm), radius) for radius, a, b in _wheelsets(pairs)]
    guiding = [
        (abs(a.wheels[k].y_over_q - b.wheels[k].y_over_q), radius) for radius, a, b in _wheelsets(pairs) for k in (0, 1)
    ]
    nothing = (math.nan, math.nan)
    (shift, shift_at), (y_over_q, y_over_q_at) = max(shifts, default=nothing), max(guiding, default=nothing)
    both = [straight[name] for name in (theory, reference) if name in straight]
    speeds = [one.critical_speed_km_h for one in both if one.critical_speed_km_h]
    return Difference(
        theory=theory,
        reference=reference,
        without_m=tuple(one.radius_m for one, other in pairs if not one.is_balanced and other.is_balanced),
        shift_mm=shift,
        shift_at_m=shift_at,
        y_over_q=y_over_q,
        y_over_q_at_m=y_over_q_at,
        critical_speed=speeds[0] / speeds[1] - 1.0 if len(speeds) == 2 else None,
        without_speed="; ".join(f"{one.theory}: {one.problem}" for one in both if one.problem),
    )


def _wheelsets(pairs: Sequence[tuple[CurveRun, CurveRun]]) -> Iterator[tuple[float, WheelsetRun, WheelsetRun]]:
    """Radius, and the wheelset by each theory, if both theories find an equilibrium."""
    for one, other in pairs:
        if one.is_balanced and other.is_balanced:
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True):
                yield one.radius_m, a, b


# --- A vehicle in curves by several theories, and where its wheels are on a map of the left wheel.

NO_EQUILIBRIUM, NO_CELL = "no equilibrium", "not on the map"
"""What stands for a verdict where there is none."""


@dataclass(frozen=True, kw_only=True)
class MapCell:
    """What a map of the left wheel says at a shift and a load: the verdict of Hertz, and the cheapest theory.

    That theory is told with the words that it is out of its range, where it is.
    """

    lateral_shift_mm: float
    load_kN: float
    verdict: str
    cheapest_theory: str


@dataclass(frozen=True, kw_only=True)
class MapColumn:
    """A solved shift of a map of the left wheel.

    Attributes
    ----------
    reach_mm
        How far on both sides of its shift it counts.
    bands
        Smallest and largest load (kN) and verdict of each stretch of loads, by increasing load.
    cells
        One a load, by increasing load.
    """

    lateral_shift_mm: float
    reach_mm: float
    bands: tuple[tuple[float, float, str], ...]
    cells: tuple[MapCell, ...]


@dataclass(frozen=True, kw_only=True)
class Visit:
    """Where a wheel is on a map of the left wheel: its shift there, its load, its yaw, and what the map says there.

    The map's load limits at the load of the wheel give the verdict, the cell with the nearest load gives the cheapest
    theory; `cell` is None beside the shifts and loads that were solved.
    """

    theory: str
    radius_m: float
    wheelset: int
    side: TrackSide
    lateral_shift_mm: float
    vertical_force_N: float
    yaw_mrad: float
    cell: MapCell | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """A vehicle in curves.

    Attributes
    ----------
    case
        Rail and wheel of all wheelsets.
    runs
        By theory, in the order of the radii.
    share
        What part of the way each radius has.
    straight
        What each theory says of straight track.
    differences
        Each theory against the last.
    columns
        Of a map; none without one.
    visits
        Where all wheels are on a map of the left wheel, whether there is one or not.
    """

    vehicle: Vehicle
    case: Case
    conditions: Conditions
    radii_m: tuple[float, ...]
    share: tuple[float, ...]
    runs: Mapping[str, tuple[CurveRun, ...]]
    straight: tuple[StraightTrack, ...] = ()
    differences: tuple[Difference, ...] = ()
    columns: tuple[MapColumn, ...] = ()
    visits: tuple[Visit, ...] = ()

    def shares(self, theory: str, of: Literal["verdict", "cheapest_theory"]) -> Mapping[str, float]:
        """Share of the way, over all wheels, by what a map says where they are; without an equilibrium, that."""
        found: dict[str, float] = {}
        for radius, part in zip(self.radii_m, self.share, strict=True):
            here = [
                getattr(one.cell, of, NO_CELL) for one in self.visits if (one.theory, one.radius_m) == (theory, radius)
            ]
            for name in here or [NO_EQUILIBRIUM]:
                found[name] = found.get(name, 0.0) + part / max(len(here), 1)
        return found


def visits_on(runs: Mapping[str, Sequence[CurveRun]], columns: Sequence[MapColumn]) -> tuple[Visit, ...]:
    """All wheels of all equilibria on a map."""
    return tuple(
        _visit(theory, run, number, wheel, columns)
        for theory, own in runs.items()
        for run in own
        if run.is_balanced
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    )


def _visit(theory: str, run: CurveRun, number: int, wheel: WheelRun, columns: Sequence[MapColumn]) -> Visit:
    """A wheel on the map; the right one is the left one of the mirror image."""
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
        cell=_cell_at(columns, shift, 1e-3 * wheel.vertical_force_N),
    )


def _cell_at(columns: Sequence[MapColumn], shift_mm: float, load_kN: float) -> MapCell | None:
    """What a map says at a shift and a load; None beside what was solved, and without a map."""
    if not columns:
        return None
    column = min(columns, key=lambda one: abs(one.lateral_shift_mm - shift_mm))
    if abs(column.lateral_shift_mm - shift_mm) > column.reach_mm:
        return None
    answers = [answer for low, high, answer in column.bands if low <= load_kN <= high]
    cell = min(column.cells, key=lambda one: abs(one.load_kN - load_kN))
    return replace(cell, verdict=answers[0]) if answers else None
