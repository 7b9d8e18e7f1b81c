"""A fleet for trials: worn copies of profiles of the library with noise, like measurements of an instrument.

Wear grows with the mileage of a wheel, and with the curvature of a rail's track. Its depth, its centre across and its
noise are drawn with a seed: equal seeds give equal files.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from fecontact.case import INPUTS
from fecontact.errors import InputError
from fecontact.features.fleet.model import FleetSettings
from fecontact.files import write_text
from fecontact.inputs.slots import list_input_places
from fecontact.inputs.templates import fill_toml_template
from fecontact.inputs.texts import count_text
from fecontact.profiles.examples import format_points, make_worn_points

_WHEELS, _RAILS = ("S1002", "EN13715_1in40"), ("60E1", "54E1", "60E2")
_RADII_M = (300.0, 500.0, 1000.0, 3000.0, 10_000.0)
_MOST_PROFILES = 10_000
# Half-width about the tape circle in which the height of a wheel is read.
_TREAD_MM = 5.0
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
        Whether existing files with these names are overwritten.

    Returns
    -------
    Path
        The file of the fleet.

    Raises
    ------
    InputError
        If the numbers of wheels and rails are out of range, or a file exists already; then nothing is written.
    """
    for body, count in (("wheels", wheels), ("rails", rails)):
        if not 1 <= count <= _MOST_PROFILES:
            raise InputError(f"{body} is {count}; allowed: 1 to {_MOST_PROFILES}; give a number in this range")
    if not force:
        _refuse_existing_files(folder, wheels, rails)
    tables = {
        "wheels": "file,vehicle,mileage_km\n" + "".join(_write_wheel(folder, k, seed) for k in range(wheels)),
        "rails": "file,line,km,curve_radius_m\n" + "".join(_write_rail(folder, k, seed) for k in range(rails)),
    }
    for name, text in tables.items():
        write_text(folder / f"{name}.csv", text)
    settings = fill_toml_template(_FLEET_TEMPLATE, [*list_input_places(FleetSettings()), *INPUTS])
    heading = f"# Example of a fleet: worn copies of library profiles with noise.\nseed = {seed}\n"
    return write_text(folder / "fleet.toml", heading + settings)


def _refuse_existing_files(folder: Path, wheels: int, rails: int) -> None:
    """Raise InputError if a file of the example exists already."""
    names = (
        "wheels.csv",
        "rails.csv",
        "fleet.toml",
        *map(_name_wheel, range(wheels)),
        *map(_name_rail, range(rails)),
    )
    existing_files = [str(folder / name) for name in names if os.path.lexists(folder / name)]
    if existing_files:
        further = f" and {count_text(len(existing_files) - 3, 'further file')}" * (len(existing_files) > 3)
        raise InputError(
            f"the example would overwrite {', '.join(existing_files[:3])}{further}; give another folder, or --force"
        )


def _name_wheel(number: int) -> str:
    return f"wheels/wheel{number:05d}.csv"


def _name_rail(number: int) -> str:
    return f"rails/rail{number:05d}.csv"


def _write_wheel(folder: Path, number: int, seed: int) -> str:
    """Write a wheel, and return its row of the table."""
    random = np.random.default_rng((seed, 0, number))
    name, mileage = _WHEELS[number % len(_WHEELS)], float(random.uniform(0.0, 200.0))
    # 1 mm of wear per 200 Mm, about the tape circle
    file = _write_worn_points(folder, _name_wheel(number), name, (0.0, 5.0), mileage / 200.0, random)
    return f"{file},vehicle {number // 8},{1e3 * mileage:.0f}\n"


def _write_rail(folder: Path, number: int, seed: int) -> str:
    """Write a rail, and return its row of the table."""
    random = np.random.default_rng((seed, 1, number))
    name, radius = _RAILS[number % len(_RAILS)], float(random.choice(_RADII_M))
    # worn to the gauge side in curves, by up to 1 mm
    place, depth = (-15.0, 3.0) if radius < 1000.0 else (0.0, 5.0), min(1.0, 300.0 / radius) * random.uniform(0.3, 1.0)
    file = _write_worn_points(folder, _name_rail(number), name, place, depth, random)
    return f"{file},line {number % 4},{random.uniform(0.0, 100.0):.3f},{radius:.0f}\n"


def _write_worn_points(
    folder: Path, file: str, name: str, place_mm: tuple[float, float], wear_mm: float, random: np.random.Generator
) -> str:
    """Write worn points and return the name of the file.

    The centre of the wear is drawn by `place_mm`, its mean and standard deviation.
    """
    centre_mm, noise = float(random.normal(*place_mm)), float(random.uniform(0.004, 0.012))
    description = f"{name}, worn by {wear_mm:.3f} mm about y = {centre_mm:.1f} mm, noise {1e3 * noise:.1f} um"
    points = make_worn_points(name, centre_mm, wear_mm, noise, random)
    if file.startswith("wheels/"):
        # An instrument measures a wheel from its tape circle, y = 0: readers refuse a wheel that is worn there by more
        # than 0.5 mm, if z = 0 is the surface of the new wheel.
        tread = points[np.abs(points[:, 0]) < _TREAD_MM]
        tread = tread[tread[:, 0].argsort()]
        points -= (0.0, float(np.interp(0.0, tread[:, 0], tread[:, 1])))
    write_text(folder / file, format_points(points, description))
    return file
