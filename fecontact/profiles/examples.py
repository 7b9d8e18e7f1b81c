"""Example pair of measured profiles: profiles of the library with wear and noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fecontact.arrays import Floats
from fecontact.files import refuse_different_files, write_text
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.readers.instrument_header import measure_flange

WEAR_MM, NOISE_MM, STEP_MM = 0.4, 0.008, 0.25
"""Largest wear along the normal, standard deviation of the noise along the normal, and spacing of the points."""
_WEAR_HALF_WIDTH_MM = 25.0
# Lateral position of the middle of the wear, in the coordinates of the profile.
_WEAR_MIDDLE_MM = {"60E1": -12.0, "S1002": 0.0}
# Distance of the tape circle of S1002 from the back of the flange.
_TAPE_CIRCLE_MM = 70.0
_DIAMETER_MM = 920.0


def make_measured_points(name: str, *, seed: int = 1) -> Floats:
    """Make points of a worn 60E1 or S1002, with noise along its normals.

    The wear is 0.4 mm deep at its middle: 12 mm from the crown to the gauge side of the rail, and at the tape circle of
    the wheel.

    Parameters
    ----------
    name
        `60E1` or `S1002`.
    seed
        Seed of the noise.

    Returns
    -------
    ndarray
        Points (n, 2) in mm, every 0.25 mm along the profile.
    """
    return make_worn_points(name, _WEAR_MIDDLE_MM[name], WEAR_MM, NOISE_MM, np.random.default_rng(seed))


def make_worn_points(
    name: str, middle_mm: float, wear_mm: float, noise_mm: float, random: np.random.Generator
) -> Floats:
    """Points of a worn profile of the library, with noise along its normals.

    The wear is `wear_mm` cos²(pi d / 50) at a lateral distance d of up to 25 mm from its middle.

    Parameters
    ----------
    name
        Name of the profile.
    middle_mm
        Lateral position of the middle of the wear (mm).
    wear_mm
        Largest wear along the normal (mm).
    noise_mm
        Standard deviation of the noise along the normal (mm).
    random
        Generator of the noise.

    Returns
    -------
    ndarray
        Points (n, 2) in mm, every 0.25 mm along the profile.
    """
    profile = load_library_profile(name)
    s = np.arange(0.0, profile.length_mm, STEP_MM)
    surface = profile.evaluate(profile.at_arc_length(s))
    relative_distance = np.clip((surface.y - middle_mm) / _WEAR_HALF_WIDTH_MM, -1.0, 1.0)
    wear = wear_mm * np.cos(0.5 * np.pi * relative_distance) ** 2
    # the material of a rail is below its profile, the material of a wheel above
    displacement = profile.convex_sign * wear + noise_mm * random.normal(size=s.size)
    return np.column_stack(
        (surface.y - displacement * np.sin(surface.angle_rad), surface.z + displacement * np.cos(surface.angle_rad))
    )


def format_points(points: Floats, remark: str) -> str:
    """Text of a file of points (n, 2) in mm, as an instrument writes it."""
    return f"# {remark}\ny [mm],z [mm]\n" + "".join(f"{y:.4f},{z:.4f}\n" for y, z in points)


def format_wheel_file(points: Floats, diameter_mm: float) -> str:
    """Text of a MiniProf file (.whl) of a wheel.

    X counts from the back of the flange, Y points into the wheel and is 0 at the tape circle.

    Parameters
    ----------
    points
        Points (n, 2) in mm, with y = 0 at the tape circle and z up, from small to large y.
    diameter_mm
        Diameter of the wheel at its tape circle (mm).

    Returns
    -------
    str
        Header with Sd, Sh and qR of the points, and columns X and Y.
    """
    flange = measure_flange(points)
    keys = {
        "WheelID": "example",
        "Sd": f"{flange['sd'] + _TAPE_CIRCLE_MM:.4f}",
        "Sh": f"{flange['sh']:.4f}",
        "qR": f"{flange['qr']:.4f}",
        "DiameterTaperline": f"{diameter_mm:.4f}",
        "WheelDiameterTaperline": f"{_TAPE_CIRCLE_MM:.4f}",
        "Xoffset": "0.0000",
        "Yoffset": "0.0000",
        "ColumnDef": "X,Y",
        "XYPoints": f"{len(points)}",
    }
    depth_mm = float(np.interp(0.0, points[:, 0], points[:, 1])) - points[:, 1]
    rows = "".join(f"{x:.4f} {depth:.4f}\n" for x, depth in zip(points[:, 0] + _TAPE_CIRCLE_MM, depth_mm, strict=True))
    return "".join(f"{key}={value}\n" for key, value in keys.items()) + "\n" + rows


def write_examples(folder: Path, *, force: bool = False, with_miniprof: bool = False) -> list[Path]:
    """Write the example pair, `rail.csv` and `wheel.csv`, into a folder.

    Every call writes equal files.

    Parameters
    ----------
    folder
        Folder.
    force
        Whether existing files with these names and different content are overwritten.
    with_miniprof
        Whether the wheel is written as a MiniProf file, `wheel.whl`, too.

    Returns
    -------
    list of Path
        Paths of the files.

    Raises
    ------
    InputError
        If a file with different content exists already; then nothing is written.
    """
    contents = {
        folder / f"{body}.csv": format_points(
            make_measured_points(name), f"{name} with wear and noise, made by fecontact profiles --examples"
        )
        for body, name in (("rail", "60E1"), ("wheel", "S1002"))
    }
    if with_miniprof:
        wheel_text = format_wheel_file(make_measured_points("S1002"), _DIAMETER_MM)
        contents[folder / "wheel.whl"] = wheel_text
    if not force:
        refuse_different_files(contents.items(), "profiles --examples", "give another folder, or --force")
    return [write_text(path, text) for path, text in contents.items()]
