"""An example pair as an instrument measures it: lines of the library with wear and noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.arrays import Floats
from fecontact.files import write_text
from fecontact.profiles.library import load

WEAR_MM, NOISE_MM, STEP_MM = 0.4, 0.008, 0.25
"""Largest wear along the normal, scatter along the normal (standard deviation), and distance of the points."""
_HALF_WIDTH_MM = 25.0
# Middle of the wear across, in the coordinates of the profile.
_WORN = {"60E1": -12.0, "S1002": 0.0}


def measured_points(name: str, *, seed: int = 1) -> Floats:
    """Points (n, 2) in mm of a worn 60E1 or S1002, every 0.25 mm along the line, with noise along its normals.

    The wear is 0.4 mm deep at its middle: 12 mm from the crown to the gauge side of the rail, the tape circle of the
    wheel.
    """
    return worn_points(name, _WORN[name], WEAR_MM, NOISE_MM, np.random.default_rng(seed))


def worn_points(name: str, middle_mm: float, wear_mm: float, noise_mm: float, random: np.random.Generator) -> Floats:
    """Points (n, 2) in mm of a worn profile of the library, every 0.25 mm along the line, with noise along its normals.

    The wear is `wear_mm` cos²(pi d / 50) at a distance d across of up to 25 mm from its middle.
    """
    profile = load(name)
    s = np.arange(0.0, profile.length_mm, STEP_MM)
    at = profile.evaluate(profile.at_arc_length(s))
    across = np.clip((at.y - middle_mm) / _HALF_WIDTH_MM, -1.0, 1.0)
    wear = wear_mm * np.cos(0.5 * np.pi * across) ** 2
    # a rail lies below its line, a wheel above
    moved = profile.convex_sign * wear + noise_mm * random.normal(size=s.size)
    return np.column_stack((at.y - moved * np.sin(at.angle_rad), at.z + moved * np.cos(at.angle_rad)))


def points_text(points: Floats, said: str) -> str:
    """Points (n, 2) in mm as the text of a file that an instrument writes."""
    return f"# {said}\ny [mm],z [mm]\n" + "".join(f"{y:.4f},{z:.4f}\n" for y, z in points)


def write_examples(folder: Path) -> list[Path]:
    """Write the example pair, `rail.csv` and `wheel.csv`, into a folder; the same files in every call."""
    return [
        write_text(
            folder / f"{body}.csv",
            points_text(
                measured_points(name), f"{name} with wear and noise, made by fecontact profiles --examples"
            ),
        )
        for body, name in (("rail", "60E1"), ("wheel", "S1002"))
    ]
