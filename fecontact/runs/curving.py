"""What a vehicle does in curves, by one theory of the contact or several, and where that is on a map."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from csv import DictReader
from dataclasses import replace
from pathlib import Path

from fecontact.case import Case
from fecontact.errors import InputError
from fecontact.solving.placing import wheelset_of_case
from fecontact.vehicle.conditions import Conditions
from fecontact.vehicle.curve import CurveRun, curves
from fecontact.vehicle.loaded import conicity_shifts, loaded_conicity, loaded_contacts
from fecontact.vehicle.model import Vehicle, load_vehicle
from fecontact.vehicle.normal import normal_theory
from fecontact.vehicle.visits import Curves, visits_on

_AMPLITUDES_MM = (1.0, 2.0, 3.0)
_LOADED = ("overlap", "half_space")


def curves_of(
    vehicle: str,
    case: Case,
    radii_m: Sequence[float],
    *,
    conditions: Conditions,
    theories: Sequence[str],
    shares: Sequence[float] = (),
    map_folder: Path | None = None,
    own_radius: bool = True,
    workers: int = 1,
) -> Curves:
    """Run a vehicle through curves.

    Parameters
    ----------
    case
        Its profiles, track and materials count.
    shares
        What part of the way each radius has; equal parts if there are none.
    map_folder
        Folder of a map, to see where the wheels are on it.
    own_radius
        Whether the wheels have the vehicle's rolling radius instead of the case's.
    workers
        Processes, one a theory.

    Raises
    ------
    InputError
        As `vehicle.curve.curves`, for unknown vehicles and theories, and for maps that cannot be read.
    """
    made = load_vehicle(vehicle)
    if not radii_m:
        raise InputError("there are no radii; give one or more, for example 300,500,1000")
    if len(set(radii_m)) != len(radii_m):
        raise InputError(f"radii are {', '.join(f'{radius:g}' for radius in radii_m)} m; give each of them once")
    if shares and (len(shares) != len(radii_m) or min(shares) < 0.0 or sum(shares) <= 0.0):
        raise InputError(f"there are {len(shares)} shares for {len(radii_m)} radii; give one number >= 0 for each")
    for theory in theories:
        normal_theory(theory)
    cells = None if map_folder is None else _cells(map_folder)
    if own_radius:
        case = replace(case, rolling_radius_mm=made.wheelset.rolling_radius_mm)
    tasks = [(made, case, tuple(radii_m), conditions, theory) for theory in theories]
    if workers > 1 and len(tasks) > 1:
        with ProcessPoolExecutor(min(workers, len(tasks))) as pool:
            found = list(pool.map(_of_theory, tasks))
    else:
        found = [_of_theory(task) for task in tasks]
    whole = sum(shares) if shares else float(len(radii_m))
    runs = dict(zip(theories, found, strict=True))
    return Curves(
        vehicle=made,
        conditions=conditions,
        radii_m=tuple(radii_m),
        share=tuple(one / whole for one in (shares or [1.0] * len(radii_m))),
        runs=runs,
        visits=() if cells is None else tuple(visits_on(runs, cells)),
    )


def loaded_conicities(case: Case, wheel_load_N: float) -> list[dict[str, float]]:
    """Equivalent conicity of the wheelset of a case under load at whole amplitudes up to 3 mm, by two theories.

    Raises
    ------
    InputError
        If the load is not positive, or the wheelset cannot be at 3 mm.
    """
    materials = (case.wheel_material, case.rail_material)
    found = {
        theory: loaded_contacts(
            wheelset_of_case(case),
            conicity_shifts(_AMPLITUDES_MM[-1]),
            wheel_load_N,
            theory=theory,
            materials=materials,
        )
        for theory in _LOADED
    }
    return [
        {"amplitude_mm": amplitude, "wheel_load_N": wheel_load_N}
        | {theory: loaded_conicity(contacts, amplitude) for theory, contacts in found.items()}
        for amplitude in _AMPLITUDES_MM
    ]


def _of_theory(task: tuple[Vehicle, Case, tuple[float, ...], Conditions, str]) -> tuple[CurveRun, ...]:
    vehicle, case, radii, conditions, theory = task
    found = curves(
        vehicle,
        wheelset_of_case(case),
        radii,
        conditions=conditions,
        theory=theory,
        materials=(case.wheel_material, case.rail_material),
    )
    return tuple(found)


def _cells(folder: Path) -> list[dict[str, str]]:
    """Rows of a map, with the cheapest theory of forces where that was asked for."""
    path = folder / "map.csv"
    if not path.is_file():
        raise InputError(f"map {folder}: there is no map.csv; give a folder that `fecontact map` wrote")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(DictReader(file))
    if not rows or not {"lateral_shift_mm", "load_kN", "verdict"} <= set(rows[0]):
        raise InputError(f"map {path}: it has no shifts, loads and verdicts; give a folder that `fecontact map` wrote")
    theory = folder / "map_theory.csv"
    if theory.is_file():
        with theory.open(encoding="utf-8", newline="") as file:
            cheapest = {
                (row["lateral_shift_mm"], row["load_kN"]): row.get("cheapest_theory", "") for row in DictReader(file)
            }
        rows = [row | {"cheapest": cheapest.get((row["lateral_shift_mm"], row["load_kN"]), "")} for row in rows]
    return rows
