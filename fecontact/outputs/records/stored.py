"""Solved loads and placements as plain values and arrays, and back: what a stored result is judged again from.

Numbers go through JSON and NumPy's own format without loss, so that what is read back is what was solved, to the last
bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any
from zipfile import ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.comparison.point_noise import PointNoise
from fecontact.comparison.solved_load import LEVEL_RUNGS, Level, SolvedLoad
from fecontact.comparison.yielded import PathPoint, Yielded, YieldedBody
from fecontact.contact.grid import ContactGrid
from fecontact.contact.rung import Rung
from fecontact.files import open_regular, write_atomically
from fecontact.geometry.placement import Placement
from fecontact.geometry.poses import RailPose, WheelPose
from fecontact.geometry.touch_points import RelativeCurvature, TouchPoint
from fecontact.profiles.curve import Profile
from fecontact.profiles.resolve import resolve_rail, resolve_wheel
from fecontact.theory.hertz import HertzContact

Record = dict[str, Any]
Arrays = dict[str, NDArray[np.float64]]

# Solved fields unpack to two to three times what they have on disk; small ones of round numbers to more.
_MOST_UNPACKED = 20
_ALWAYS_BYTES = 100_000_000
_FEWEST_NODES = 2
_RUNG_FIELDS = ("pressure_MPa", "gap_mm")
_RUNG_NUMBERS = tuple(f.name for f in fields(Rung) if f.name not in ("grid", *_RUNG_FIELDS))


def solved_record(solved: SolvedLoad, arrays: Arrays, prefix: str = "") -> Record:
    """A solved load without its case; puts its fields into `arrays` under names that begin with `prefix`."""
    noise = solved.point_noise
    return {
        "load_N": solved.case.load_N,
        "levels": [
            {
                **{name: _rung_record(rung, arrays, f"{prefix}level{k}_{name}") for name, rung in level.rungs.items()},
                "compliance_error": level.compliance_error,
                "degrees_of_freedom": dict(level.degrees_of_freedom),
                "elements": dict(level.elements),
                "enlarged": level.enlarged,
                "slide_mm": level.slide_mm,
                "at_edge": level.at_edge,
                **({} if level.yielded is None else _yielded_record(level.yielded, arrays, f"{prefix}level{k}_")),
            }
            for k, level in enumerate(solved.levels)
        ],
        "half_space": _rung_record(solved.half_space, arrays, f"{prefix}half_space"),
        "turned": solved.turned and _rung_record(solved.turned, arrays, f"{prefix}turned"),
        "quadratic": _rung_record(solved.quadratic, arrays, f"{prefix}quadratic"),
        "point_noise": noise
        and {
            "own": _noise_record(noise.own, arrays, f"{prefix}points"),
            "thinned": noise.thinned and _noise_record(noise.thinned, arrays, f"{prefix}thinned"),
            **{
                name: [one and _noise_record(one, arrays, f"{prefix}{name}{k}") for k, one in enumerate(every)]
                for name, every in (("widths", noise.widths), ("draws", noise.draws))
            },
        },
        "limits": list(solved.limits),
        "short_of_memory": solved.short_of_memory,
    }


def solved_from_record(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]], case: Case) -> SolvedLoad:
    """A solved load from its record and arrays; `case` has its load.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """

    def rung(of: Mapping[str, Any]) -> Rung:
        return _rung(of, arrays)

    def noise(of: Mapping[str, Any] | None) -> tuple[HertzContact, Rung] | None:
        return None if of is None else (HertzContact(**of["hertz"]), rung(of["half_space"]))

    points = record["point_noise"]
    return SolvedLoad(
        case=case,
        levels=tuple(
            Level(
                **{
                    **level,
                    **{name: rung(level[name]) for name in LEVEL_RUNGS},
                    "yielded": _yielded(level["yielded"], rung) if "yielded" in level else None,
                    # what is no number is none in JSON
                    "compliance_error": math.nan if level["compliance_error"] is None else level["compliance_error"],
                }
            )
            for level in record["levels"]
        ),
        half_space=rung(record["half_space"]),
        turned=record["turned"] and rung(record["turned"]),
        quadratic=rung(record["quadratic"]),
        point_noise=points and _point_noise(points, noise),
        limits=tuple(record["limits"]),
        short_of_memory=record["short_of_memory"],
    )


def _yielded_record(yielded: Yielded, arrays: Arrays, prefix: str) -> Record:
    rungs = {"fe": yielded.fe, "nodal": yielded.nodal, "fewer_steps": yielded.fewer_steps}
    return {
        "yielded": {
            **{key: value and _rung_record(value, arrays, f"{prefix}yielded_{key}") for key, value in rungs.items()},
            "bodies": {name: asdict(body) for name, body in yielded.bodies.items()},
            "path": [asdict(point) for point in yielded.path],
            "by_band": {name: dict(steps) for name, steps in yielded.by_band.items()},
            "imprint_mm": yielded.imprint_mm,
        }
    }


def _yielded(record: Mapping[str, Any], rung: Callable[[Mapping[str, Any]], Rung]) -> Yielded:
    return Yielded(
        fe=rung(record["fe"]),
        nodal=rung(record["nodal"]),
        fewer_steps=record["fewer_steps"] and rung(record["fewer_steps"]),
        bodies={name: YieldedBody(**body) for name, body in record["bodies"].items()},
        path=tuple(PathPoint(**point) for point in record["path"]),
        by_band=record["by_band"],
        imprint_mm=record["imprint_mm"],
    )


def _point_noise(
    record: Mapping[str, Any], read: Callable[[Mapping[str, Any] | None], tuple[HertzContact, Rung] | None]
) -> PointNoise:
    own = read(record["own"])
    assert own is not None
    return PointNoise(
        own=own,
        thinned=read(record["thinned"]),
        widths=tuple(read(one) for one in record["widths"]),
        draws=tuple(read(one) for one in record["draws"]),
    )


def _noise_record(solved: tuple[HertzContact, Rung], arrays: Arrays, name: str) -> Record:
    hertz, rung = solved
    return {"hertz": asdict(hertz), "half_space": _rung_record(rung, arrays, name)}


def _rung_record(rung: Rung, arrays: Arrays, name: str) -> Record:
    arrays[f"{name}_x_mm"], arrays[f"{name}_s_mm"] = rung.grid.x_mm, rung.grid.s_mm
    for field in _RUNG_FIELDS:
        arrays[f"{name}_{field}"] = getattr(rung, field)
    return {"arrays": name, "half": rung.grid.half, **{key: getattr(rung, key) for key in _RUNG_NUMBERS}}


def _rung(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> Rung:
    name = record["arrays"]
    grid = ContactGrid(x_mm=arrays[f"{name}_x_mm"], s_mm=arrays[f"{name}_s_mm"], half=record["half"])
    values: Record = {key: record[key] for key in _RUNG_NUMBERS}
    values |= {field: arrays[f"{name}_{field}"] for field in _RUNG_FIELDS}
    if any(values[field].shape != grid.shape for field in _RUNG_FIELDS) or min(grid.shape) < _FEWEST_NODES:
        raise ValueError(f"{name}: its fields are not on its grid of {grid.shape} nodes")
    return Rung(grid=grid, **values)


def write_arrays(path: Path, arrays: Arrays) -> Path:
    """Write arrays as one compressed NumPy archive, the same bytes every time."""
    return write_atomically(path, lambda temporary: np.savez_compressed(temporary, allow_pickle=False, **arrays))


def read_arrays(path: Path) -> Arrays:
    """Read all arrays of an archive.

    Raises
    ------
    ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error
        If it is none that was written here; what it claims is looked at before anything is unpacked.
    """
    with open_regular(path) as file, ZipFile(file) as archive:
        members = archive.infolist()
        claimed = sum(member.file_size for member in members)
        allowed = max(_ALWAYS_BYTES, _MOST_UNPACKED * path.stat().st_size)
        if claimed > allowed:
            raise ValueError(f"{path.name} unpacks to {claimed / 1e6:.0f} MB, allowed are {allowed / 1e6:.0f}")
        return {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}


def _array(archive: ZipFile, member: ZipInfo) -> NDArray[np.float64]:
    """One array, of whose numbers the archive has as many as its header claims."""
    with archive.open(member) as file:
        np.lib.format.read_magic(file)
        shape, by_column, kind = np.lib.format.read_array_header_1_0(file)
        content = file.read()
    if kind != np.dtype("<f8") or len(content) != 8 * math.prod(shape):
        raise ValueError(f"{member.filename} has not the numbers that it claims ({shape} of {kind})")
    return np.frombuffer(content, "<f8").reshape(shape, order="F" if by_column else "C").astype(float)


def placement_record(placement: Placement) -> Record:
    """Where both bodies stand and touch, without their profiles."""
    rail, wheel = placement.rail, placement.wheel
    return {
        "rail": {
            "inclination_rad": rail.inclination_rad,
            "crown_y_mm": rail.crown_y_mm,
            "crown_z_mm": rail.crown_z_mm,
        },
        "wheel": {
            "rolling_radius_mm": wheel.rolling_radius_mm,
            "tape_circle_y_mm": wheel.tape_circle_y_mm,
            "axes": wheel.axes.tolist(),
            "centre_mm": wheel.centre_mm.tolist(),
        },
        "touch_points": [asdict(touch) for touch in placement.touch_points],
        "climbs": placement.climbs,
    }


def placement_from_record(record: Mapping[str, Any], rail: Profile, wheel: Profile) -> Placement:
    """A placement from its record and the profiles, without any search for touch points.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    array: Callable[[Any], NDArray[np.float64]] = np.array
    on_axle = record["wheel"]
    return Placement(
        rail=RailPose(profile=rail, **record["rail"]),
        wheel=WheelPose(
            profile=wheel,
            **{**on_axle, "axes": array(on_axle["axes"]), "centre_mm": array(on_axle["centre_mm"])},
        ),
        touch_points=tuple(
            TouchPoint(
                **{**touch, "curvatures": tuple(RelativeCurvature(**curvature) for curvature in touch["curvatures"])}
            )
            for touch in record["touch_points"]
        ),
        climbs=record["climbs"],
    )


def stored_placement(case: Case, record: Mapping[str, Any]) -> Placement:
    """The placement of a stored case, with the profiles that the case names."""
    rail, wheel = resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file)
    return placement_from_record(record, rail, wheel.profile)
