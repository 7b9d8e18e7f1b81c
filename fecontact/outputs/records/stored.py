"""Solved loads and placements as plain values and arrays, and back: what a stored result is judged again from.

Numbers go through JSON and NumPy's own format without loss, so that what is read back is what was solved, to the last
bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints
from zipfile import ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.files import open_regular, write_atomically
from fecontact.judging.solved_load import SolvedLoad
from fecontact.outputs.flat_records import Record, picked
from fecontact.placement.along_track import AlongTrack
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.resolve import resolve_rail, resolve_wheel

Arrays = dict[str, NDArray[np.float64]]

# Solved fields unpack to two to three times what they have on disk; small ones of round numbers to more.
_MOST_UNPACKED = 20
_ALWAYS_BYTES = 100_000_000
_FEWEST_NODES = 2
_kinds = cache(get_type_hints)
_RUNG_FIELDS = ("pressure_MPa", "gap_mm")
_RUNG_NUMBERS = tuple(f.name for f in fields(Rung) if f.name not in ("grid", *_RUNG_FIELDS))
# Fields with another name among the arrays.
_NAMES = {"levels": "level"}
# Fields of a solved load that earlier versions did not store.
_ADDED_LATER = ("gap_curvature_error",)


def solved_record(solved: SolvedLoad, arrays: Arrays, prefix: str = "") -> Record:
    """A solved load without its case; puts its fields into `arrays` under names that begin with `prefix`."""
    own = {one.name: getattr(solved, one.name) for one in fields(solved) if one.name != "case"}
    record = _fields(own, arrays, prefix.rstrip("_"))
    for level in record["levels"]:
        if level["yielded"] is None:
            del level["yielded"]
    return {"load_N": solved.case.load_N, **record}


def solved_from_record(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]], case: Case) -> SolvedLoad:
    """A solved load from its record and arrays; `case` has its load.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    own = {
        one.name: record[one.name]
        for one in fields(SolvedLoad)
        if one.name != "case" and (one.name in record or one.name not in _ADDED_LATER)
    }
    found: SolvedLoad = _value(SolvedLoad, {**own, "case": case}, arrays)
    return found


def _plain(value: Any, arrays: Arrays, name: str) -> Any:
    """A value as JSON has it, dataclasses by their fields; what is on a grid goes into `arrays` under a name."""
    if isinstance(value, Rung):
        arrays[f"{name}_x_mm"], arrays[f"{name}_s_mm"] = value.grid.x_mm, value.grid.s_mm
        if value.grid.widths_mm is not None:
            arrays[f"{name}_widths_mm"] = value.grid.widths_mm
        arrays |= {f"{name}_{field}": getattr(value, field) for field in _RUNG_FIELDS}
        return {"arrays": name, "half": value.grid.half, **{key: getattr(value, key) for key in _RUNG_NUMBERS}}
    if is_dataclass(value):
        own = {one.name: getattr(value, one.name) for one in fields(value) if one.name != "profile"}
        return _fields(own, arrays, name)
    if isinstance(value, Mapping):
        return {key: _plain(one, arrays, name) for key, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one, arrays, f"{name}{place}") for place, one in enumerate(value)]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _fields(own: Mapping[str, Any], arrays: Arrays, name: str) -> Record:
    """Fields of a value, each with a name of its own among the arrays."""
    parts = {key: (name, _NAMES.get(key, key)) for key in own}
    return {key: _plain(one, arrays, "_".join(filter(None, parts[key]))) for key, one in own.items()}


def _without_alias(kind: Any) -> Any:
    """Annotation that a type alias names; other annotations are returned unchanged.

    NumPy 2.5 declares `NDArray` by a `type` statement on Python 3.12 and newer. There `get_origin` of `NDArray[float]`
    is the alias and not `numpy.ndarray`.
    """
    alias, arguments = get_origin(kind) or kind, get_args(kind)
    if not hasattr(alias, "__value__"):
        return kind
    return _without_alias(alias.__value__[arguments] if arguments else alias.__value__)


def _value(kind: Any, plain: Any, arrays: Mapping[str, NDArray[np.float64]]) -> Any:
    """A value of a kind from what `_plain` made of it."""
    if isinstance(kind, type) and isinstance(plain, kind):
        return plain
    if kind is Rung:
        return _rung(plain, arrays)
    if isinstance(kind, type) and is_dataclass(kind):
        kinds = _kinds(kind)
        return kind(**{key: _value(kinds[key], one, arrays) for key, one in plain.items()})
    kind = _without_alias(kind)
    origin, of = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return None if plain is None else _value(of[0], plain, arrays)
    if origin is tuple:
        return tuple(_value(of[0], one, arrays) for one in plain)
    if origin is Mapping:
        return {key: _value(of[1], one, arrays) for key, one in plain.items()}
    if origin is np.ndarray:
        return np.array(plain)
    # A list or an object that no branch above has read would stay as it is, and fail far from here.
    if isinstance(plain, list | dict):
        raise TypeError(f"a stored {type(plain).__name__} cannot be read back as {kind}")
    # JSON has null for a number that is not finite
    return math.nan if kind is float and plain is None else plain


def _rung(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> Rung:
    name = record["arrays"]
    grid = ContactGrid(
        x_mm=arrays[f"{name}_x_mm"],
        s_mm=arrays[f"{name}_s_mm"],
        half=record["half"],
        # only of several bands
        widths_mm=arrays.get(f"{name}_widths_mm"),
    )
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
    """Where both bodies stand and touch, without their profiles and irregularities."""
    names = ("rail", "wheel", "touch_points", "climbs", "other_climbs")
    found = {name: _plain(getattr(placement, name), {}, name) for name in names}
    return found if placement.along is None else found | {"along": picked(placement.along, "middle_x_mm lowered_mm")}


def placement_from_record(record: Mapping[str, Any], rail: Profile, wheel: Profile) -> Placement:
    """A placement from its record and the profiles, without any search for touch points.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    poses = {"rail": {**record["rail"], "profile": rail}, "wheel": {**record["wheel"], "profile": wheel}}
    found: Placement = _value(Placement, {**record, **poses}, {})
    return found


def stored_placement(case: Case, record: Mapping[str, Any]) -> Placement:
    """The placement of a stored case, with the profiles and irregularities that the case names."""
    rail, wheel = resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file)
    bodies = {name: value for name, value in record.items() if name != "along"}
    placement = placement_from_record(bodies, rail, wheel.profile)
    if "along" not in record:
        return placement
    lines = tuple(line.on_wheel(placement.wheel.rolling_radius_mm) for line in case.irregularities)
    return replace(placement, along=AlongTrack(lines=lines, distance_mm=case.distance_mm, **record["along"]))
