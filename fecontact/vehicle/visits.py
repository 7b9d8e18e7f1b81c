"""A vehicle in curves by several theories, and where its wheels are on a map of the left wheel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.dimensions import TrackSide
from fecontact.vehicle.conditions import Conditions
from fecontact.vehicle.curve import CurveRun, WheelRun, WheelsetRun
from fecontact.vehicle.model import Vehicle

_NO_CELL = "not on the map"
# Of the smallest steps of the map's shifts, and of its smallest ratio of loads, so far beyond its ends.
_BEYOND_MM, _BEYOND_LOAD = 0.5, 1.25


@dataclass(frozen=True, kw_only=True)
class Visit:
    """Where a wheel is on a map of the left wheel: its shift there, its load, and what the nearest cell says."""

    theory: str
    radius_m: float
    wheelset: int
    side: TrackSide
    lateral_shift_mm: float
    vertical_force_N: float
    yaw_mrad: float
    cell_shift_mm: float | None
    cell_load_kN: float | None
    verdict: str
    cheapest_theory: str | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """A vehicle in curves.

    Attributes
    ----------
    runs
        By theory, in the order of the radii.
    share
        What part of the way each radius has.
    visits
        All wheels on a map; none without one.
    """

    vehicle: Vehicle
    conditions: Conditions
    radii_m: tuple[float, ...]
    share: tuple[float, ...]
    runs: Mapping[str, tuple[CurveRun, ...]]
    visits: tuple[Visit, ...] = ()

    def visited(self, theory: str) -> Mapping[str, float]:
        """Share of the way, over all wheels, by what the map says where they are."""
        own = [visit for visit in self.visits if visit.theory == theory]
        parts = dict(zip(self.radii_m, self.share, strict=True))
        found: dict[str, float] = {}
        for radius, part in parts.items():
            here = [visit for visit in own if visit.radius_m == radius]
            for visit in here:
                found[visit.verdict] = found.get(visit.verdict, 0.0) + part / len(here)
        return found


def visits_on(runs: Mapping[str, Sequence[CurveRun]], cells: Sequence[Mapping[str, str]]) -> list[Visit]:
    """All wheels of all equilibria on the cells of a map: rows with shift, load, verdict and cheapest theory."""
    return [
        _visit(theory, run, number, wheelset, wheel, cells)
        for theory, own in runs.items()
        for run in own
        if run.status == "equilibrium"
        for number, wheelset in enumerate(run.wheelsets, start=1)
        for wheel in wheelset.wheels
    ]


def _visit(
    theory: str, run: CurveRun, number: int, wheelset: WheelsetRun, wheel: WheelRun, cells: Sequence[Mapping[str, str]]
) -> Visit:
    """A wheel on the map; the right one is the left one of the mirror image."""
    sign = 1.0 if wheel.side == "left" else -1.0
    shift, load = sign * wheelset.lateral_shift_mm, 1e-3 * wheel.vertical_force_N
    shifts, loads = ([float(cell[key]) for cell in cells] for key in ("lateral_shift_mm", "load_kN"))
    on_map = (
        min(shifts) - _BEYOND_MM <= shift <= max(shifts) + _BEYOND_MM
        and min(loads) / _BEYOND_LOAD <= load <= max(loads) * _BEYOND_LOAD
    )
    # the nearest shift first: what a load changes is less
    cell = min(cells, key=lambda one: (abs(float(one["lateral_shift_mm"]) - shift), abs(float(one["load_kN"]) - load)))
    return Visit(
        theory=theory,
        radius_m=run.radius_m,
        wheelset=number,
        side=wheel.side,
        lateral_shift_mm=shift,
        vertical_force_N=wheel.vertical_force_N,
        yaw_mrad=sign * wheelset.yaw_mrad,
        cell_shift_mm=float(cell["lateral_shift_mm"]) if on_map else None,
        cell_load_kN=float(cell["load_kN"]) if on_map else None,
        verdict=(cell["verdict"] or "failed") if on_map else _NO_CELL,
        cheapest_theory=cell.get("cheapest") or None if on_map else None,
    )
