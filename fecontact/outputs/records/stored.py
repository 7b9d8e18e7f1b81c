"""Conversion of solved loads and placements to plain values and arrays, and back.

A stored result is judged again from these values. Numbers pass through JSON and NumPy's own format without loss, so
that a solved load that is read back is equal to the original to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.files import open_regular_file, write_atomically
from fecontact.judging.solved_load import SolvedLoad
from fecontact.outputs.flat_records import Record, select_attributes
from fecontact.placement.along_track import PlacedIrregularities
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile
from fecontact.profiles.resolve import resolve_rail, resolve_wheel

Arrays = dict[str, NDArray[np.float64]]

# Solved fields unpack to two to three times their size on disk; small fields of round numbers unpack to more.
_MAX_UNPACKING_RATIO = 20
_ALWAYS_ALLOWED_BYTES = 100_000_000
_MIN_NODES = 2
_type_hints = cache(get_type_hints)
_RUNG_FIELDS = ("pressure_MPa", "gap_mm")
_RUNG_NUMBERS = tuple(f.name for f in fields(Rung) if f.name not in ("grid", *_RUNG_FIELDS))
# Fields that have a different name among the arrays.
_ARRAY_NAMES = {"levels": "level"}
# Fields of a solved load that earlier versions did not store.
_FIELDS_ADDED_LATER = ("gap_curvature_error", "load_error")


def solved_record(solved_load: SolvedLoad, arrays: Arrays, prefix: str = "") -> Record:
    """Convert a solved load, without its case, to a record and arrays.

    Parameters
    ----------
    solved_load
        Solved load.
    arrays
        The fields of the load are added to these arrays.
    prefix
        Beginning of the names of the added arrays.

    Returns
    -------
    Record
        Plain values of the load, with the load in N.
    """
    values = {field.name: getattr(solved_load, field.name) for field in fields(solved_load) if field.name != "case"}
    record = _plain_fields(values, arrays, prefix.rstrip("_"))
    for level in record["levels"]:
        if level["yielded"] is None:
            del level["yielded"]
    return {"load_N": solved_load.case.load_N, **record}


def solved_from_record(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]], case: Case) -> SolvedLoad:
    """Restore a solved load from its record and arrays.

    Parameters
    ----------
    record
        Record that `solved_record` made.
    arrays
        Arrays by name.
    case
        Case with the load of the record.

    Returns
    -------
    SolvedLoad
        The solved load.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    values = {
        field.name: record[field.name]
        for field in fields(SolvedLoad)
        if field.name != "case" and (field.name in record or field.name not in _FIELDS_ADDED_LATER)
    }
    solved_load: SolvedLoad = _restore_value(SolvedLoad, {**values, "case": case}, arrays)
    return solved_load


def _to_plain(value: Any, arrays: Arrays, name: str) -> Any:
    """Convert a value to JSON types, dataclasses by their fields.

    Fields on a grid are added to `arrays` under names that begin with `name`.
    """
    if isinstance(value, Rung):
        arrays[f"{name}_x_mm"], arrays[f"{name}_s_mm"] = value.grid.x_mm, value.grid.s_mm
        if value.grid.widths_mm is not None:
            arrays[f"{name}_widths_mm"] = value.grid.widths_mm
        arrays |= {f"{name}_{field}": getattr(value, field) for field in _RUNG_FIELDS}
        return {"arrays": name, "half": value.grid.half, **{key: getattr(value, key) for key in _RUNG_NUMBERS}}
    if is_dataclass(value):
        attributes = {field.name: getattr(value, field.name) for field in fields(value) if field.name != "profile"}
        return _plain_fields(attributes, arrays, name)
    if isinstance(value, Mapping):
        return {key: _to_plain(member, arrays, name) for key, member in value.items()}
    if isinstance(value, tuple):
        return [_to_plain(member, arrays, f"{name}{place}") for place, member in enumerate(value)]
    return value.tolist() if isinstance(value, np.ndarray) else value


def _plain_fields(values: Mapping[str, Any], arrays: Arrays, name: str) -> Record:
    """Convert the fields of a value; each field has a unique name among the arrays."""
    name_parts = {key: (name, _ARRAY_NAMES.get(key, key)) for key in values}
    return {key: _to_plain(value, arrays, "_".join(filter(None, name_parts[key]))) for key, value in values.items()}


def _resolve_alias(kind: Any) -> Any:
    """Annotation behind a type alias; other annotations are returned unchanged.

    NumPy 2.5 declares `NDArray` by a `type` statement on Python 3.12 and newer. There `get_origin` of `NDArray[float]`
    is the alias and not `numpy.ndarray`.
    """
    alias, arguments = get_origin(kind) or kind, get_args(kind)
    if not hasattr(alias, "__value__"):
        return kind
    return _resolve_alias(alias.__value__[arguments] if arguments else alias.__value__)


def _restore_value(kind: Any, plain: Any, arrays: Mapping[str, NDArray[np.float64]]) -> Any:
    """Restore a value of a kind from the result of `_to_plain`.

    Parameters
    ----------
    kind
        Type of the value, with type parameters.
    plain
        Value from JSON.
    arrays
        Arrays of the rungs by name.

    Raises
    ------
    TypeError
        If a list or a dict cannot be converted to the kind.
    """
    if isinstance(kind, type) and isinstance(plain, kind):
        return plain
    if kind is Rung:
        return _read_rung(plain, arrays)
    if isinstance(kind, type) and is_dataclass(kind):
        kinds = _type_hints(kind)
        return kind(**{key: _restore_value(kinds[key], member, arrays) for key, member in plain.items()})
    kind = _resolve_alias(kind)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is UnionType:
        return None if plain is None else _restore_value(arguments[0], plain, arrays)
    if origin is tuple:
        return tuple(_restore_value(arguments[0], member, arrays) for member in plain)
    if origin is Mapping:
        return {key: _restore_value(arguments[1], member, arrays) for key, member in plain.items()}
    if origin is np.ndarray:
        return np.array(plain)
    # A list or an object that no branch above converts would stay unchanged, and fail far from here.
    if isinstance(plain, list | dict):
        raise TypeError(f"a stored {type(plain).__name__} cannot be converted to {kind}")
    # JSON has null for a number that is not finite
    return math.nan if kind is float and plain is None else plain


def _read_rung(record: Mapping[str, Any], arrays: Mapping[str, NDArray[np.float64]]) -> Rung:
    """Restore a rung from its record and arrays.

    Raises
    ------
    ValueError
        If the fields are not on the grid.
    """
    name = record["arrays"]
    grid = ContactGrid(
        x_mm=arrays[f"{name}_x_mm"],
        s_mm=arrays[f"{name}_s_mm"],
        half=record["half"],
        # only for several bands
        widths_mm=arrays.get(f"{name}_widths_mm"),
    )
    values: Record = {key: record[key] for key in _RUNG_NUMBERS}
    values |= {field: arrays[f"{name}_{field}"] for field in _RUNG_FIELDS}
    if any(values[field].shape != grid.shape for field in _RUNG_FIELDS) or min(grid.shape) < _MIN_NODES:
        raise ValueError(f"{name}: the fields do not match the grid of {grid.shape} nodes")
    return Rung(grid=grid, **values)


def write_arrays(path: Path, arrays: Arrays) -> Path:
    """Write arrays as a compressed NumPy archive; equal arrays give equal bytes.

    Parameters
    ----------
    path
        File to write.
    arrays
        Arrays by name.

    Returns
    -------
    Path
        The given path.
    """

    def write(temporary: Path) -> None:
        # NumPy's own function compresses at level 6, which takes twice as long and saves 1 %
        with ZipFile(temporary, "w", ZIP_DEFLATED, compresslevel=1) as archive:
            for name, values in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, values, allow_pickle=False)

    return write_atomically(path, write)


def read_arrays(path: Path) -> Arrays:
    """Read all arrays of an archive.

    The sizes that the archive claims are checked before anything is unpacked.

    Parameters
    ----------
    path
        File that was written by `write_arrays`.

    Returns
    -------
    Arrays
        Arrays by name.

    Raises
    ------
    ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error
        If the file is not such an archive.
    """
    with open_regular_file(path) as file, ZipFile(file) as archive:
        members = archive.infolist()
        claimed_bytes = sum(member.file_size for member in members)
        allowed_bytes = max(_ALWAYS_ALLOWED_BYTES, _MAX_UNPACKING_RATIO * path.stat().st_size)
        if claimed_bytes > allowed_bytes:
            raise ValueError(
                f"{path.name} unpacks to {claimed_bytes / 1e6:.0f} MB; at most {allowed_bytes / 1e6:.0f} MB are allowed"
            )
        return {member.filename.removesuffix(".npy"): _read_array(archive, member) for member in members}


def _read_array(archive: ZipFile, member: ZipInfo) -> NDArray[np.float64]:
    """Read an array, and check that the number of values agrees with the header."""
    with archive.open(member) as file:
        np.lib.format.read_magic(file)
        shape, is_by_column, kind = np.lib.format.read_array_header_1_0(file)
        content = file.read()
    if kind != np.dtype("<f8") or len(content) != 8 * math.prod(shape):
        raise ValueError(f"{member.filename} does not contain the numbers of its header ({shape} of {kind})")
    return np.frombuffer(content, "<f8").reshape(shape, order="F" if is_by_column else "C").astype(float)


def placement_record(placement: Placement) -> Record:
    """Record of a placement, without profiles and irregularities.

    Parameters
    ----------
    placement
        Placement of wheel and rail.

    Returns
    -------
    Record
        Poses of both bodies, contact points, and limits of flange climbing.
    """
    names = ("rail", "wheel", "contact_points", "climbs", "other_climbs")
    record = {name: _to_plain(getattr(placement, name), {}, name) for name in names}
    return (
        record
        if placement.along is None
        else record | {"along": select_attributes(placement.along, "middle_x_mm lowered_mm")}
    )


def placement_from_record(record: Mapping[str, Any], rail: Profile, wheel: Profile) -> Placement:
    """Restore a placement from its record and the profiles.

    Contact points are read from the record; nothing is searched.

    Parameters
    ----------
    record
        Record without the entry `along`.
    rail, wheel
        Profiles of both bodies.

    Returns
    -------
    Placement
        The placement.

    Raises
    ------
    KeyError, TypeError
        If the record has another layout.
    """
    poses = {"rail": {**record["rail"], "profile": rail}, "wheel": {**record["wheel"], "profile": wheel}}
    placement: Placement = _restore_value(Placement, {**record, **poses}, {})
    return placement


def restore_placement(case: Case, record: Mapping[str, Any]) -> Placement:
    """Restore the placement of a stored case.

    Parameters
    ----------
    case
        Case that names the profiles and irregularities.
    record
        Record of the placement.

    Returns
    -------
    Placement
        The placement, with the irregularities along the track.
    """
    rail, wheel = resolve_rail(case.rail, case.rail_file), resolve_wheel(case.wheel, case.wheel_file)
    entries = {name: value for name, value in record.items() if name != "along"}
    placement = placement_from_record(entries, rail, wheel.profile)
    if "along" not in record:
        return placement
    irregularities = tuple(
        irregularity.on_wheel(placement.wheel.rolling_radius_mm) for irregularity in case.irregularities
    )
    return replace(
        placement, along=PlacedIrregularities(lines=irregularities, distance_mm=case.distance_mm, **record["along"])
    )
