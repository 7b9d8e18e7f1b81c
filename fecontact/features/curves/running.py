"""What a vehicle does in curves, by one theory of the contact or several, and where that is on a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.curves.curve import Conditions, CurveRun, Ride, curves, straight_line
from fecontact.features.curves.model import BOGIES, Vehicle, load_vehicle, with_bogie
from fecontact.features.curves.normal import DEFAULT_THEORY, normal_theory
from fecontact.features.curves.stability import StraightTrack, straight_track
from fecontact.features.curves.visits import Curves, MapCell, MapColumn, differences, visits_on
from fecontact.jobs.remaining import Progress, watched
from fecontact.jobs.workers import evaluators
from fecontact.runs.map_lookup import map_bands, map_rows
from fecontact.solving.placing import wheelset_of_case

# Inputs in which a map may differ from the vehicle: its wheels stand without yaw, and their radius is seldom equal.
_OTHER = ("roll", "roll_rad", "roll_load_N", "yaw_rad", "flange_climb", "rolling_radius_mm")


def curve(
    vehicle: str | Vehicle = "manchester",
    radii_m: Sequence[float] | Mapping[float, float] = (300.0, 500.0, 1000.0, 3000.0),
    *,
    case: Case | None = None,
    conditions: Conditions | None = None,
    theories: Sequence[str] = (DEFAULT_THEORY,),
    bogie: str = BOGIES[0],
    map_folder: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> Curves:
    """Steady running of a wheelset or a bogie in curves, and its stability on straight track; nothing is meshed.

    >>> import fecontact
    >>> found = fecontact.curve("wheelset", [1000.0])
    >>> (run,) = found.runs["overlap"]
    >>> run.status, round(run.wheelsets[0].lateral_shift_mm, 1)
    ('equilibrium', 1.8)

    Parameters
    ----------
    vehicle
        Name of a built-in one, path of a TOML file, or a vehicle.
    radii_m
        Positive to the right, negative to the left; as a mapping with the share of the way that each has, else equal.
    case
        Its profiles, track and materials count; wheels have the vehicle's rolling radius.
    conditions
        Friction, cant and speed.
    theories
        Of the normal force, by names of `features.curves.normal`; each is held against the last.
    bogie
        `leading` or `trailing`.
    map_folder
        A map of the same pair that `fecontact map` wrote, to see where the wheels are on it.
    workers
        Processes, one a theory.
    progress
        As for `run`, with curves by each theory in place of cases, or theories where there are several processes.

    Raises
    ------
    InputError
        For unknown vehicles and theories, radii that the gauge does not let through, speeds at which the vehicle
        overturns, and maps of another contact.
    WorkersLost
        If a process ends before its time.
    """
    made = with_bogie(load_vehicle(vehicle) if isinstance(vehicle, str) else vehicle, bogie)
    radii, share = _radii(radii_m)
    if len(set(theories)) != len(theories) or not theories:
        raise InputError(f"theories are {', '.join(theories) or 'none'}; give each of them once")
    for theory in theories:
        normal_theory(theory)
    case, conditions = case or Case(), conditions or Conditions()
    columns = () if map_folder is None else _columns(Path(map_folder), case)
    case = replace(case, rolling_radius_mm=made.wheelset.rolling_radius_mm)
    wheelset, materials = wheelset_of_case(case), (case.wheel_material, case.rail_material)
    rides = [Ride(wheelset=wheelset, conditions=conditions, theory=theory, materials=materials) for theory in theories]
    here = 1 in (workers, len(theories))
    with evaluators(len(theories), here=here, workers=workers) as map_over:
        if here:
            each = chain.from_iterable([curves(made, ride, radii) for ride in rides])
            found = list(watched(each, len(theories) * len(radii), progress, "curves"))
        else:
            walks = map_over(partial(_walked, made, radii), rides)
            found = list(chain.from_iterable(watched(walks, len(theories), progress, "theories")))
        straight = tuple(map_over(partial(_straight, made), rides))
    by_theory = {(run.theory, run.radius_m): run for run in found}
    runs = {theory: tuple(by_theory[theory, radius] for radius in radii) for theory in theories}
    return Curves(
        vehicle=made,
        case=case,
        conditions=conditions,
        radii_m=radii,
        share=share,
        runs=runs,
        straight=straight,
        differences=differences(runs, straight),
        columns=columns,
        visits=visits_on(runs, columns),
    )


def _radii(radii_m: Sequence[float] | Mapping[float, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Radii, and the part of the way that each has."""
    radii = tuple(float(radius) for radius in radii_m)
    if not radii:
        raise InputError("there are no radii; give one or more, for example 300,500,1000")
    if len(set(radii)) != len(radii):
        raise InputError(f"radii are {', '.join(f'{radius:g}' for radius in radii)} m; give each of them once")
    shares = tuple(map(float, radii_m.values())) if isinstance(radii_m, Mapping) else (1.0,) * len(radii)
    if not (min(shares) >= 0.0 and 0.0 < sum(shares) < float("inf")):
        raise InputError(f"shares of the way are {', '.join(f'{one:g}' for one in shares)}; allowed: >= 0, and one > 0")
    return radii, tuple(one / sum(shares) for one in shares)


def _walked(vehicle: Vehicle, radii_m: Sequence[float], ride: Ride) -> list[CurveRun]:
    return list(curves(vehicle, ride, radii_m))


def _straight(vehicle: Vehicle, ride: Ride) -> StraightTrack:
    return straight_track(ride.theory, vehicle, straight_line(ride))


def _columns(folder: Path, case: Case) -> tuple[MapColumn, ...]:
    """A map of the same contact, shift by shift."""
    rows = map_rows(folder, case, but_for=_OTHER)
    if not rows:
        raise InputError(f"map {folder}: it has no cells; give another one")
    cells = [
        MapCell(
            lateral_shift_mm=float(row["lateral_shift_mm"]),
            load_kN=float(row["load_kN"]),
            verdict=row["verdict_answer"] or "failed",
            cheapest_theory=(row.get("cheapest_theory") or "none")
            + " (out of range)" * (row.get("cheapest_theory_status") == "out of range"),
        )
        for row in rows
    ]
    return tuple(
        MapColumn(
            lateral_shift_mm=shift,
            reach_mm=reach,
            bands=tuple(bands),
            cells=tuple(cell for cell in cells if cell.lateral_shift_mm == shift),
        )
        for shift, reach, bands in map_bands(folder)
    )
