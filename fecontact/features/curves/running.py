"""Vehicle in curves by several theories of the contact, with its wheels on a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.features.curves.conditions import DEFAULT_RADII_M, DEFAULT_THEORY, Conditions
from fecontact.features.curves.curve import CurveRun, Ride, make_straight_track, solve_curves
from fecontact.features.curves.model import BOGIES, DEFAULT_VEHICLE, Vehicle, choose_bogie, load_vehicle
from fecontact.features.curves.normal import normal_theory
from fecontact.features.curves.stability import StraightTrack, analyse_straight_track
from fecontact.features.curves.visits import CurveResults, MapColumn, VisitedCell, compare_theories, locate_wheels
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.jobs.workers import open_evaluators
from fecontact.runs.map_lookup import read_map_bands, read_map_rows
from fecontact.solving.placing import make_wheelset

# Inputs in which a map may differ from the vehicle: its wheels have no yaw, and their radius is seldom equal.
_UNCOMPARED_INPUTS = ("roll", "roll_rad", "roll_load_N", "yaw_rad", "flange_climb", "rolling_radius_mm")


def curve(
    vehicle: str | Vehicle = DEFAULT_VEHICLE,
    radii_m: Sequence[float] | Mapping[float, float] = DEFAULT_RADII_M,
    *,
    case: Case | None = None,
    conditions: Conditions | None = None,
    theories: Sequence[str] = (DEFAULT_THEORY,),
    bogie: str = BOGIES[0],
    map_folder: str | Path | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> CurveResults:
    """Solve the steady running of a wheelset or a bogie in curves.

    The result includes the stability on straight track. No finite elements are used.

    >>> import fecontact
    >>> results = fecontact.curve("wheelset", [1000.0])
    >>> (run,) = results.runs["overlap"]
    >>> run.status, round(run.wheelsets[0].lateral_shift_mm, 1)
    ('equilibrium', 1.8)

    Parameters
    ----------
    vehicle
        Name of a built-in vehicle, path of a TOML file, or a vehicle.
    radii_m
        Radii, positive to the right, negative to the left. A mapping has the share of the way for each radius; without
        a mapping all shares are equal.
    case
        Case with the profiles, the track and the materials. The wheels have the vehicle's rolling radius.
    conditions
        Friction, cant and speed.
    theories
        Names of theories of the normal force from `features.curves.normal`. Each theory is compared with the last
        theory.
    bogie
        `leading` or `trailing`.
    map_folder
        Folder of a map of the same pair by `fecontact map`, on which the wheels are located.
    workers
        Number of processes; each process solves a theory at a time.
    progress
        As for `run`, with curves by each theory instead of cases, or with theories if there are several processes.

    Returns
    -------
    CurveResults
        Positions and forces of all wheels, differences between theories, stability on straight track, and positions on
        the map.

    Raises
    ------
    InputError
        For unknown vehicles and theories, radii that do not fit into the gauge, speeds at which the vehicle overturns,
        and maps of another contact.
    WorkersLost
        If a process ends early.

    Notes
    -----
    Source: Otero Yugat, Part I, eq. 15 and 16, see `features.curves.steady`. Range of validity: steady motion and, on
    straight track, small motions. Must not be used for transitions or track irregularities.
    """
    chosen_vehicle = choose_bogie(load_vehicle(vehicle) if isinstance(vehicle, str) else vehicle, bogie)
    radii, share = _check_radii(radii_m)
    if len(set(theories)) != len(theories) or not theories:
        raise InputError(
            f"theories are {', '.join(theories) or 'none'}; give at least one theory, and each theory once"
        )
    for theory in theories:
        normal_theory(theory)
    case, conditions = case or Case(), conditions or Conditions()
    columns = () if map_folder is None else _read_columns(Path(map_folder), case)
    case = replace(case, rolling_radius_mm=chosen_vehicle.wheelset.rolling_radius_mm)
    wheelset, materials = make_wheelset(case), (case.wheel_material, case.rail_material)
    rides = [Ride(wheelset=wheelset, conditions=conditions, theory=theory, materials=materials) for theory in theories]
    is_in_process = 1 in (workers, len(theories))
    with open_evaluators(len(theories), here=is_in_process, workers=workers) as map_over:
        if is_in_process:
            curve_runs = chain.from_iterable([solve_curves(chosen_vehicle, ride, radii) for ride in rides])
            solved_runs = list(report_progress(curve_runs, len(theories) * len(radii), progress, "curves"))
        else:
            runs_by_ride = map_over(partial(_solve_ride, chosen_vehicle, radii), rides)
            solved_runs = list(chain.from_iterable(report_progress(runs_by_ride, len(theories), progress, "theories")))
        straight = tuple(map_over(partial(_analyse_ride, chosen_vehicle), rides))
    run_by_key = {(run.theory, run.radius_m): run for run in solved_runs}
    runs = {theory: tuple(run_by_key[theory, radius] for radius in radii) for theory in theories}
    return CurveResults(
        vehicle=chosen_vehicle,
        case=case,
        conditions=conditions,
        radii_m=radii,
        share=share,
        runs=runs,
        straight=straight,
        differences=compare_theories(runs, straight),
        columns=columns,
        visits=locate_wheels(runs, columns),
    )


def _check_radii(radii_m: Sequence[float] | Mapping[float, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Check radii, and normalise their shares of the way.

    Raises
    ------
    InputError
        If there are no radii, if a radius is there twice, or if shares are negative or all zero.
    """
    radii = tuple(float(radius) for radius in radii_m)
    if not radii:
        raise InputError("there are no radii; give at least one radius, for example 300,500,1000")
    if len(set(radii)) != len(radii):
        raise InputError(f"radii are {', '.join(f'{radius:g}' for radius in radii)} m; give each radius once")
    shares = tuple(map(float, radii_m.values())) if isinstance(radii_m, Mapping) else (1.0,) * len(radii)
    if not (min(shares) >= 0.0 and 0.0 < sum(shares) < float("inf")):
        raise InputError(
            f"shares of the distance are {', '.join(f'{share:g}' for share in shares)}; allowed: >= 0, at least one > 0"
        )
    return radii, tuple(share / sum(shares) for share in shares)


def _solve_ride(vehicle: Vehicle, radii_m: Sequence[float], ride: Ride) -> list[CurveRun]:
    """Solve all curves by the theory of a ride, in a worker process."""
    return list(solve_curves(vehicle, ride, radii_m))


def _analyse_ride(vehicle: Vehicle, ride: Ride) -> StraightTrack:
    """Analyse straight track by the theory of a ride, in a worker process."""
    return analyse_straight_track(ride.theory, vehicle, make_straight_track(ride))


def _read_columns(folder: Path, case: Case) -> tuple[MapColumn, ...]:
    """Read a map for the contact of a case, a column for each shift.

    Raises
    ------
    InputError
        If the map has no cells, or is a map of another contact.
    """
    rows = read_map_rows(folder, case, but_for=_UNCOMPARED_INPUTS)
    if not rows:
        raise InputError(f"map {folder} has no cells; give another map")
    cells = [
        VisitedCell(
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
        for shift, reach, bands in read_map_bands(folder, case.yaw_rad)
    )
