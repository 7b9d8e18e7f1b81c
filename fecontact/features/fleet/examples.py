"""A fleet to try: worn copies of profiles of the library with noise, as an instrument measures them.

Wear grows with the mileage of a wheel, and with the curvature of a rail's track. Its depth, its middle across and its
noise are drawn with a seed: the same seed makes the same files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.errors import InputError
from fecontact.files import write_text
from fecontact.profiles.examples import points_text, worn_points

_WHEELS, _RAILS = ("S1002", "EN13715_1in40"), ("60E1", "54E1", "60E2")
_RADII_M = (300.0, 500.0, 1000.0, 3000.0, 10_000.0)
_MOST = 10_000
_FLEET = """# A fleet of worn and noisy copies of profiles of the library.
seed = {seed}
theory = "strip"
filters_mm = [4, 8]

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
inclination = "1:40"
"""


def write_fleet(folder: Path, *, wheels: int = 10, rails: int = 10, seed: int = 1) -> Path:
    """Write wheels/ and rails/ with their tables, and the file of a fleet, whose path is returned.

    Raises
    ------
    InputError
        If the numbers of wheels and rails are out of range.
    """
    for what, count in (("wheels", wheels), ("rails", rails)):
        if not 1 <= count <= _MOST:
            raise InputError(f"{what} is {count}; allowed: 1 to {_MOST}")
    tables = {
        "wheels": "file,vehicle,mileage_km\n" + "".join(_wheel(folder, k, seed) for k in range(wheels)),
        "rails": "file,line,km,curve_radius_m\n" + "".join(_rail(folder, k, seed) for k in range(rails)),
    }
    for name, text in tables.items():
        write_text(folder / f"{name}.csv", text)
    return write_text(folder / "fleet.toml", _FLEET.format(seed=seed))


def _wheel(folder: Path, number: int, seed: int) -> str:
    """Write a wheel; its row of the table."""
    random = np.random.default_rng((seed, 0, number))
    name, mileage = _WHEELS[number % len(_WHEELS)], float(random.uniform(0.0, 200.0))
    # 1 mm in 200 Mm, about the tape circle
    made = _written(folder, f"wheels/wheel{number:05d}.csv", name, (0.0, 5.0), mileage / 200.0, random)
    return f"{made},vehicle {number // 8},{1e3 * mileage:.0f}\n"


def _rail(folder: Path, number: int, seed: int) -> str:
    """Write a rail; its row of the table."""
    random = np.random.default_rng((seed, 1, number))
    name, radius = _RAILS[number % len(_RAILS)], float(random.choice(_RADII_M))
    # worn to the gauge side in curves, by up to 1 mm
    place, depth = (-15.0, 3.0) if radius < 1000.0 else (0.0, 5.0), min(1.0, 300.0 / radius) * random.uniform(0.3, 1.0)
    made = _written(folder, f"rails/rail{number:05d}.csv", name, place, depth, random)
    return f"{made},line {number % 4},{random.uniform(0.0, 100.0):.3f},{radius:.0f}\n"


def _written(
    folder: Path, file: str, name: str, place_mm: tuple[float, float], wear_mm: float, random: np.random.Generator
) -> str:
    """Write worn points with their wear about a place (mean and standard deviation); the name of the file."""
    middle, noise = float(random.normal(*place_mm)), float(random.uniform(0.004, 0.012))
    said = f"{name}, worn by {wear_mm:.3f} mm about y = {middle:.1f} mm, noise {1e3 * noise:.1f} um"
    write_text(folder / file, points_text(worn_points(name, middle, wear_mm, noise, random), said))
    return file
