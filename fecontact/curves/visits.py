"""A vehicle in curves by several theories: what they change for it, and where its wheels are on a map."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from fecontact.bodies import TrackSide
from fecontact.curves.curve import Conditions, CurveRun, WheelRun, WheelsetRun
from fecontact.curves.model import Vehicle
from fecontact.curves.stability import StraightTrack

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
    """

    theory: str
    reference: str
    without_m: tuple[float, ...]
    shift_mm: float
    shift_at_m: float
    y_over_q: float
    y_over_q_at_m: float
    critical_speed: float | None


def differences(
    runs: Mapping[str, Sequence[CurveRun]], straight: Sequence[StraightTrack] = ()
) -> tuple[Difference, ...]:
    """Each theory against the last one, curve by curve in their order."""
    *others, reference = runs
    speeds = {one.theory: one.critical_speed_km_h for one in straight}
    return tuple(_difference(runs, speeds, theory, reference) for theory in others)


def _difference(
    runs: Mapping[str, Sequence[CurveRun]], speeds: Mapping[str, float | None], theory: str, reference: str
) -> Difference:
    pairs = list(zip(runs[theory], runs[reference], strict=True))
    shifts = [(abs(a.lateral_shift_mm - b.lateral_shift_mm), radius) for radius, a, b in _wheelsets(pairs)]
    guiding = [
        (abs(a.wheels[k].y_over_q - b.wheels[k].y_over_q), radius) for radius, a, b in _wheelsets(pairs) for k in (0, 1)
    ]
    nothing = (math.nan, math.nan)
    (shift, shift_at), (y_over_q, y_over_q_at) = max(shifts, default=nothing), max(guiding, default=nothing)
    own, other = speeds.get(theory), speeds.get(reference)
    return Difference(
        theory=theory,
        reference=reference,
        without_m=tuple(one.radius_m for one, other in pairs if not one.is_balanced and other.is_balanced),
        shift_mm=shift,
        shift_at_m=shift_at,
        y_over_q=y_over_q,
        y_over_q_at_m=y_over_q_at,
        critical_speed=own / other - 1.0 if own and other else None,
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
# So far beyond the ends of a map's shifts, and of its loads as a ratio, the cell at the end still counts.
_BEYOND_MM, _BEYOND_LOAD = 0.5, 1.25


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
class Visit:
    """Where a wheel is on a map of the left wheel: its shift there, its load, its yaw, and the nearest cell."""

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
    runs
        By theory, in the order of the radii.
    share
        What part of the way each radius has.
    straight
        What each theory says of straight track.
    differences
        Each theory against the last.
    cells, visits
        Of a map, and all wheels on it; none without one.
    """

    vehicle: Vehicle
    conditions: Conditions
    radii_m: tuple[float, ...]
    share: tuple[float, ...]
    runs: Mapping[str, tuple[CurveRun, ...]]
    straight: tuple[StraightTrack, ...] = ()
    differences: tuple[Difference, ...] = ()
    cells: tuple[MapCell, ...] = ()
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


def visits_on(runs: Mapping[str, Sequence[CurveRun]], cells: Sequence[MapCell]) -> tuple[Visit, ...]:
    """All wheels of all equilibria on the cells of a map."""
    return tuple(
        _visit(theory, run, number, wheel, cells)
        for theory, own in runs.items()
        for run in own
        if run.is_balanced
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    )


def _visit(theory: str, run: CurveRun, number: int, wheel: WheelRun, cells: Sequence[MapCell]) -> Visit:
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
        cell=_nearest(cells, shift, 1e-3 * wheel.vertical_force_N),
    )


def _nearest(cells: Sequence[MapCell], shift_mm: float, load_kN: float) -> MapCell | None:
    """The cell of the nearest shift, and there of the nearest load: what a load changes is less."""
    shifts, loads = ([getattr(cell, name) for cell in cells] for name in ("lateral_shift_mm", "load_kN"))
    on_map = (
        min(shifts) - _BEYOND_MM <= shift_mm <= max(shifts) + _BEYOND_MM
        and min(loads) / _BEYOND_LOAD <= load_kN <= max(loads) * _BEYOND_LOAD
    )
    if not on_map:
        return None
    return min(cells, key=lambda cell: (abs(cell.lateral_shift_mm - shift_mm), abs(cell.load_kN - load_kN)))
