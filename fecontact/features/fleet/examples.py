"""A fleet for trials: worn copies of profiles of the library with noise, like measurements of an instrument.

Wear grows with the mileage of a wheel, and with the curvature of a rail's track. Its depth, its centre across and its
noise are drawn with a seed: equal seeds give equal files.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fecontact.case import INPUTS
from fecontact.errors import InputError
from fecontact.features.fleet.model import FleetSettings, refuse_wrong_seed
from fecontact.files import refuse_different_files, remove_unfinished, write_text
from fecontact.inputs.slots import list_input_places
from fecontact.inputs.templates import fill_toml_template
from fecontact.profiles.examples import format_points, make_worn_points

_WHEELS, _RAILS = ("S1002", "EN13715_1in40"), ("60E1", "54E1", "60E2")
_RADII_M = (300.0, 500.0, 1000.0, 3000.0, 10_000.0)
_MOST_PROFILES = 10_000
# Half-width about the tape circle in which the height of a wheel is read.
_TREAD_MM = 5.0
_FLEET, _TABLES = "fleet.toml", {"wheels": "wheels.csv", "rails": "rails.csv"}
_FLEET_TEMPLATE = """theory = ${theory}

[wheels]
files = "wheels.csv"

[rails]
files = "rails.csv"

[shifts_mm]
normal = [0.0, 2.0]
count = 5

[loads_kN]
values = [60, 100]

[case]
inclination = ${inclination}
"""


def write_fleet(folder: Path, *, wheels: int = 10, rails: int = 10, seed: int = 1, force: bool = False) -> Path:
    """Write wheels/ and rails/ with their tables, and the file of a fleet.

    Parameters
    ----------
    folder
        Folder to write into.
    wheels, rails
        Numbers of profiles, 1 to 10000.
    seed
        Seed of wear and noise.
    force
        Whether existing files with these names and different content are overwritten.

    Returns
    -------
    Path
        The file of the fleet.

    Raises
    ------
    InputError
        If the numbers of wheels and rails or the seed are out of range, or a file with different content exists
        already; then nothing is written. So the same call resumes an interrupted one.
    """
    for body, count in (("wheels", wheels), ("rails", rails)):
        if not 1 <= count <= _MOST_PROFILES:
            raise InputError(f"{body} is {count}; allowed: 1 to {_MOST_PROFILES}; give a number in this range")
    refuse_wrong_seed(seed)
    if folder.is_dir():
        if not force:
            _refuse_different_files(folder, wheels, rails, seed)
        _remove_unfinished(folder, wheels, rails)
    for name, text in _make_files(wheels, rails, seed):
        write_text(folder / name, text)
    return folder / _FLEET


def _refuse_different_files(folder: Path, wheels: int, rails: int, seed: int) -> None:
    """Raise InputError if a file of the example exists already with different content."""
    contents = ((folder / name, text) for name, text in _make_files(wheels, rails, seed))
    refuse_different_files(contents, "the example", "give another folder, or --force")


def _remove_unfinished(folder: Path, wheels: int, rails: int) -> None:
    """Remove temporary files of an interrupted call; other files in the folder may be of other programs."""
    names = {*map(_name_wheel, range(wheels)), *map(_name_rail, range(rails)), *_TABLES.values(), _FLEET}
    for place in {Path(name).parent for name in names}:
        if (folder / place).is_dir():
            remove_unfinished(folder / place, {Path(name).name for name in names if Path(name).parent == place})


def _make_files(wheels: int, rails: int, seed: int) -> Iterator[tuple[str, str]]:
    """Names and texts of the files of an example, the file of the fleet last."""
    rows = {"wheels": "file,vehicle,mileage_km\n", "rails": "file,line,km,curve_radius_m\n"}
    for body, count, make in (("wheels", wheels, _make_wheel), ("rails", rails, _make_rail)):
        for number in range(count):
            name, text, row = make(number, seed)
            rows[body] += f"{name},{row}\n"
            yield name, text
    for body, table in _TABLES.items():
        yield table, rows[body]
    settings = fill_toml_template(_FLEET_TEMPLATE, [*list_input_places(FleetSettings()), *INPUTS])
    heading = f"# Example of a fleet: worn copies of library profiles with noise.\nseed = {seed}\n"
    yield _FLEET, heading + settings


def _name_wheel(number: int) -> str:
    return f"wheels/wheel{number:05d}.csv"


def _name_rail(number: int) -> str:
    return f"rails/rail{number:05d}.csv"


def _make_wheel(number: int, seed: int) -> tuple[str, str, str]:
    """Name and text of the file of a wheel, and its further columns."""
    random = np.random.default_rng((seed, 0, number))
    name, mileage = _WHEELS[number % len(_WHEELS)], float(random.uniform(0.0, 200.0))
    # 1 mm of wear per 200 Mm, about the tape circle
    text = _make_worn_points(name, (0.0, 5.0), mileage / 200.0, random, is_wheel=True)
    return _name_wheel(number), text, f"vehicle {number // 8},{1e3 * mileage:.0f}"


def _make_rail(number: int, seed: int) -> tuple[str, str, str]:
    """Name and text of the file of a rail, and its further columns."""
    random = np.random.default_rng((seed, 1, number))
    name, radius = _RAILS[number % len(_RAILS)], float(random.choice(_RADII_M))
    # worn to the gauge side in curves, by up to 1 mm
    place, depth = (-15.0, 3.0) if radius < 1000.0 else (0.0, 5.0), min(1.0, 300.0 / radius) * random.uniform(0.3, 1.0)
    text = _make_worn_points(name, place, depth, random, is_wheel=False)
    return _name_rail(number), text, f"line {number % 4},{random.uniform(0.0, 100.0):.3f},{radius:.0f}"


def _make_worn_points(
    name: str, place_mm: tuple[float, float], wear_mm: float, random: np.random.Generator, *, is_wheel: bool
) -> str:
    """Text of a file of worn points.

    The centre of the wear is drawn by `place_mm`, its mean and standard deviation.
    """
    centre_mm, noise = float(random.normal(*place_mm)), float(random.uniform(0.004, 0.012))
    description = f"{name}, worn by {wear_mm:.3f} mm about y = {centre_mm:.1f} mm, noise {1e3 * noise:.1f} um"
    points = make_worn_points(name, centre_mm, wear_mm, noise, random)
    if is_wheel:
        # An instrument measures a wheel from its tape circle, y = 0: readers refuse a wheel that is worn there by more
        # than 0.5 mm, if z = 0 is the surface of the new wheel.
        tread = points[np.abs(points[:, 0]) < _TREAD_MM]
        tread = tread[tread[:, 0].argsort()]
        points -= (0.0, float(np.interp(0.0, tread[:, 0], tread[:, 1])))
    return format_points(points, description)
