"""What needs no finite elements: theories alone, contact tables, irregularities, vehicles in curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.bodies import STEEL, Material
from fecontact.case import Case
from fecontact.criteria import Creep
from fecontact.errors import ConvergenceError, InputError
from fecontact.irregularity.shapes import Irregularity, parse_irregularity
from fecontact.jobs.workers import evaluators
from fecontact.normal.irregular import Pair
from fecontact.outputs.alone import alone_record, check_theory, map_columns, ordered, table_row, theories_listed
from fecontact.outputs.irregular import along_record, map_record
from fecontact.outputs.records.results import ellipse_creep, hertz_record
from fecontact.rolling.forces import forces_on_ellipse
from fecontact.rolling.laws import Creepages, RollingEllipse
from fecontact.runs.load import map_rows
from fecontact.solving.alone import table_lines, theory_alone
from fecontact.solving.irregular import LIMIT, JudgedPlace, SmoothPair, judge_cell, judge_place, place_on, smooth_pair
from fecontact.solving.placing import wheelset_of_case
from fecontact.solving.position import hertz_alone
from fecontact.vehicle.curve import Conditions, CurveRun, Ride, curves, straight_line
from fecontact.vehicle.loaded import conicity_shifts, loaded_conicity, loaded_contacts
from fecontact.vehicle.model import BOGIES, Vehicle, load_vehicle, with_bogie
from fecontact.vehicle.normal import DEFAULT_THEORY, normal_theory
from fecontact.vehicle.stability import StraightTrack, straight_track
from fecontact.vehicle.visits import Curves, MapCell, differences, visits_on

Record = dict[str, Any]


def hertz(case: Case) -> Record:
    """Hertz's theory alone at a case's position: `hertz` is what a result is compared with.

    >>> import fecontact
    >>> record = fecontact.hertz(fecontact.Case(lateral_shift_mm=4.0))
    >>> round(record["ellipses"][0]["p_max_MPa"], -1)
    1480.0

    `ellipses` has every touch point, and both sides of a junction, as if each carried the whole load; where the
    surfaces conform there is no ellipse, and `problem` says so.

    Raises
    ------
    InputError
        As `place_case` and `hertz_of_case` do.
    """
    return hertz_record(hertz_alone(case))


def theory(case: Case, name: str) -> Record:
    """One theory of the pressure alone at a case's position, such as `strip` or `multi_hertz`; `theories` lists them.

    >>> import fecontact
    >>> found = fecontact.theory(fecontact.Case(lateral_shift_mm=4.0), "strip")
    >>> found["status"], round(found["p_max_MPa"], -1)
    ('solved', 1480.0)

    `status` is `solved` where the theory is in its range; `notes` say why it is not. `solutions` is the number of
    approaches that were found to carry the force, and `problem` why there is no contact.

    Raises
    ------
    InputError
        For a name that there is not; as `place_case` does, and where there is no ellipse for Hertz.
    """
    check_theory(name)
    return alone_record(theory_alone(case, name))


def theories() -> Record:
    """The theories of the pressure and the laws of creep forces that are judged, from the cheapest.

    >>> import fecontact
    >>> list(fecontact.theories()["pressure"])[0], list(fecontact.theories()["forces"])[-1]
    ('hertz', 'real')
    """
    return theories_listed()


def creep(
    *,
    a_mm: float,
    b_mm: float,
    normal_force_N: float,
    friction: float,
    creepages: tuple[float, float, float] = (0.0, 0.0, 0.0),
    young_MPa: float = STEEL.young_MPa,
    poisson: float = STEEL.poisson,
    theories: Sequence[str] = ("all",),
) -> Record:
    """Creep forces on an ellipse by some theories, or by `all` that cover it; analytic, no mesh.

    >>> import fecontact
    >>> found = fecontact.creep(
    ...     a_mm=5.8, b_mm=8.5, normal_force_N=100e3, friction=0.3, creepages=(0.001, 0.0, 0.0), theories=["polach"]
    ... )
    >>> -found["limit_N"] < found["theories"]["polach"]["fx_N"] < 0.0
    True

    Parameters
    ----------
    a_mm, b_mm
        Semi-axes along the rolling direction and across.
    normal_force_N, friction
        Normal force, and coefficient of friction.
    creepages
        Longitudinal and lateral creepage of the wheel over the rolling speed, and spin in 1/mm.
    young_MPa, poisson
        Of both bodies.
    theories
        Names of theories, or `all`.

    Raises
    ------
    InputError
        For values out of range, and if a theory that was named does not cover the ellipse or the creepages.
    """
    xi, eta, spin = creepages
    # in the ranges of a case
    Creep(friction=friction, xi=xi, eta=eta, spin_per_mm=spin)
    both = Material(name="both", young_MPa=young_MPa, poisson=poisson)
    contact = RollingEllipse(
        a_mm=a_mm,
        b_mm=b_mm,
        normal_force_N=normal_force_N,
        friction=friction,
        shear_MPa=both.shear_MPa,
        poisson=poisson,
    )
    return ellipse_creep(forces_on_ellipse(contact, Creepages(xi=xi, eta=eta, spin_per_mm=spin), theories))


# --- Contact tables for vehicle codes: lines over shift and load, with the verdicts of a stored map where it has them.

# Decimals to which shifts (mm) and loads (kN) are the same.
_SAME = 6


def table(
    case: Case, lateral_shifts_mm: Sequence[float], loads_N: Sequence[float], *, map_folder: str | Path | None = None
) -> list[Record]:
    """A contact table over lateral shift and load, as flat dictionaries with units in their keys; nothing is solved.

    >>> import fecontact
    >>> rows = fecontact.table(fecontact.Case(roll="touching"), [0.0, 4.0], [50e3, 100e3])
    >>> [(row["lateral_shift_mm"], row["load_kN"], row["cheapest_theory"]) for row in rows]
    [(0.0, 50.0, 'strip'), (0.0, 100.0, 'strip'), (4.0, 50.0, 'hertz'), (4.0, 100.0, 'hertz')]

    Parameters
    ----------
    case
        Everything but lateral shift and load; its criteria say how near a cheap theory must be to the strips.
    lateral_shifts_mm, loads_N
        Of the wheelset, and wheel loads.
    map_folder
        A map that `fecontact map` wrote of the same pair: columns `map_*` have its verdicts at its shifts and loads.

    Raises
    ------
    InputError
        Without shifts and loads, or for a map of another pair. A position that has no contact is a row with its
        `problem`.
    """
    shifts, loads = tuple(map(float, lateral_shifts_mm)), tuple(map(float, loads_N))
    if not shifts or not loads:
        raise InputError("table: give at least one lateral shift and one load")
    cells = None if map_folder is None else {_key(row): row for row in map_rows(Path(map_folder), case)}
    rows = []
    for line in table_lines(case, shifts, loads):
        row = table_row(line)
        if cells is not None:
            row |= map_columns(cells.get(_key(row)))
        rows.append(row)
    return ordered(rows)


def _key(row: Mapping[str, Any]) -> tuple[float, float]:
    return round(float(row["lateral_shift_mm"]), _SAME), round(float(row["load_kN"]), _SAME)


# --- Hertz's spring over an irregularity: the map over wavelength and amplitude, and the forces along a given one.

Progress = Callable[[int, int, str], None]
_MOST_PLACES = 2000
# Places of a table, where none are given: so many a half length of the patch.
_A_HALF_LENGTH = 2.0


def irregular(
    case: Case,
    *,
    wavelengths_mm: Sequence[float] = (),
    amplitudes_mm: Sequence[float] = (),
    irregularity: Irregularity | str | None = None,
    positions_mm: Sequence[float] = (),
    limit: float = LIMIT,
    workers: int = 1,
    progress: Progress | None = None,
) -> Record:
    """Hertz's spring over an irregular wheel or rail (eq. 6) and four models like it, judged by the half-space.

    >>> import fecontact
    >>> found = fecontact.irregular(fecontact.Case(lateral_shift_mm=3.0), wavelengths_mm=[30.0], amplitudes_mm=[0.025])
    >>> found["cells"][0]["models"]["eq6"]["holds"]
    False

    Parameters
    ----------
    case
        Its profiles at their position, load and materials; of the profiles the curvatures at first touch count.
    wavelengths_mm, amplitudes_mm
        Of waves: a map, `cells` and `limits`. An amplitude is half of peak to valley.
    irregularity, positions_mm
        Of one irregularity or its text instead: what the models say along it, `places` and `worst`; without positions
        two of them a half length of the patch.
    limit
        Error of force and peak up to which a model holds.
    workers
        Processes; any number gives the same to the last bit.

    Raises
    ------
    InputError
        For inputs out of range, with what is allowed; as `smooth_pair` and `place_on` do.
    WorkersLost
        If a process ends before its time.
    """
    if (irregularity is None) == (not len(wavelengths_mm) and not len(amplitudes_mm)):
        raise InputError("irregular: give wavelengths and amplitudes for a map, or an irregularity, one of both")
    if not 0.0 < limit < 1.0:
        raise InputError(f"limit is {limit!r}; allowed: between 0 and 1, such as 0.05")
    smooth = smooth_pair(case)
    by = partial(_all, workers=workers, progress=progress)
    if irregularity is None:
        waves = _waves(smooth, wavelengths_mm, amplitudes_mm)
        return map_record(smooth, by(partial(_cell, smooth.pair, smooth.hertz.normal_force_N), waves), limit=limit)
    given = parse_irregularity(irregularity) if isinstance(irregularity, str) else irregularity
    line = given.on_wheel(0.5 / smooth.pair.A_per_mm)
    places = _positions(smooth, line, positions_mm)
    found = by(partial(_place, smooth.pair, smooth.hertz.normal_force_N, line), places)
    return along_record(smooth, line, dict(zip(places, found, strict=True)), limit=limit)


def _waves(smooth: SmoothPair, wavelengths: Sequence[float], amplitudes: Sequence[float]) -> list[tuple[float, float]]:
    """All pairs of both, from short to long and from low to high, after the shortest was seen to be possible."""
    if not len(wavelengths) or not len(amplitudes):
        raise InputError("irregular: a map needs both wavelengths and amplitudes; give at least one of each")
    ordered = [sorted({float(one) for one in values}) for values in (wavelengths, amplitudes)]
    # what no wave can be is refused before anything is computed
    shortest = Irregularity(kind="sine", wavelength_mm=ordered[0][0], amplitude_mm=ordered[1][0])
    place_on(smooth.pair, smooth.hertz.normal_force_N, shortest, 0.0)
    return [(wavelength, amplitude) for wavelength in ordered[0] for amplitude in ordered[1]]


def _positions(smooth: SmoothPair, line: Irregularity, positions_mm: Sequence[float]) -> list[float]:
    """Positions as given, or over the whole of a table or a wave and to both sides of a flat."""
    if len(positions_mm):
        places = sorted({float(one) for one in positions_mm})
    else:
        a = smooth.hertz.a_mm
        if line.kind == "table":
            low, high = line.points_mm[0][0] + a, line.points_mm[-1][0] - a
        elif line.kind == "sine":
            low, high = 0.0, 0.5 * (line.wavelength_mm or 0.0)
        else:
            low, high = 0.0, 0.5 * (line.length_mm or 0.0) + 2.0 * a
        count = max(9, int(np.ceil((high - low) / a * _A_HALF_LENGTH)) + 1)
        places = [round(float(one), 3) for one in np.linspace(low, high, count)]
    if len(places) > _MOST_PLACES:
        raise InputError(
            f"irregular: {len(places)} positions; allowed: up to {_MOST_PLACES}; give a part of the line, or steps"
        )
    return places


def _cell(pair: Pair, force_N: float, wave: tuple[float, float]) -> Any:
    return judge_cell(pair, force_N, *wave)


def _place(pair: Pair, force_N: float, line: Irregularity, s_mm: float) -> JudgedPlace | str:
    """A place, or why it could not be solved; what is wrong with an input is no such reason."""
    try:
        return judge_place(pair, force_N, line, s_mm)
    except ConvergenceError as error:
        return str(error)


def _all(work: Callable[[Any], Any], items: Sequence[Any], *, workers: int, progress: Progress | None) -> list[Any]:
    """Work on all items, in their order, in as many processes."""
    found = []
    with evaluators(len(items), here=1 in (workers, len(items)), workers=workers) as map_over:
        for one in map_over(work, items):
            found.append(one)
            if progress is not None and (len(found) % 10 == 0 or len(found) == len(items)):
                progress(len(found), len(items), "models beside the half-space")
    return found


# --- What a vehicle does in curves, by one theory of the contact or several, and where that is on a map.

_AMPLITUDES_MM = (1.0, 2.0, 3.0)
_LOADED = ("overlap", "half_space")
# What a map may have other than the vehicle: its wheels stand without yaw, and their radius is seldom the same.
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
        Of the normal force, by names of `vehicle.normal`; each is held against the last.
    bogie
        `leading` or `trailing`.
    map_folder
        A map of the same pair that `fecontact map` wrote, to see where the wheels are on it.
    workers
        Processes, one a theory.

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
    cells, notes = ((), ()) if map_folder is None else _cells(Path(map_folder), case, made)
    case = replace(case, rolling_radius_mm=made.wheelset.rolling_radius_mm)
    with evaluators(len(theories), here=1 in (workers, len(theories)), workers=workers) as map_over:
        found = list(map_over(partial(_of_theory, made, case, radii, conditions), theories))
    runs = {theory: one[0] for theory, one in zip(theories, found, strict=True)}
    straight = tuple(one[1] for one in found)
    return Curves(
        vehicle=made,
        conditions=conditions,
        radii_m=radii,
        share=share,
        runs=runs,
        straight=straight,
        differences=differences(runs, straight),
        cells=cells,
        visits=visits_on(runs, cells) if cells else (),
        notes=notes,
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


def _of_theory(
    vehicle: Vehicle, case: Case, radii_m: Sequence[float], conditions: Conditions, theory: str
) -> tuple[tuple[CurveRun, ...], StraightTrack]:
    materials = (case.wheel_material, case.rail_material)
    ride = Ride(wheelset=wheelset_of_case(case), conditions=conditions, theory=theory, materials=materials)
    return tuple(curves(vehicle, ride, radii_m)), straight_track(theory, vehicle, straight_line(ride))


def _cells(folder: Path, case: Case, vehicle: Vehicle) -> tuple[tuple[MapCell, ...], tuple[str, ...]]:
    """Cells of a map of the same contact, and what is other there."""
    rows = map_rows(folder, case, but_for=_OTHER)
    if not rows:
        raise InputError(f"map {folder}: it has no cells; give another one")
    cells = tuple(
        MapCell(
            lateral_shift_mm=float(row["lateral_shift_mm"]),
            load_kN=float(row["load_kN"]),
            verdict=row["verdict_answer"] or "failed",
            cheapest_theory=(row.get("cheapest_theory") or "none")
            + " (out of range)" * (row.get("cheapest_theory_status") == "out of range"),
        )
        for row in rows
    )
    return cells, ("the map's wheels have no yaw",)
