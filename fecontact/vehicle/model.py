"""Vehicles as values, read from TOML files: masses, dimensions, suspensions, all with units in their keys."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from fecontact.errors import InputError
from fecontact.inputs import Number, check_inputs

BOGIES = ("leading", "trailing")
"""The bogies of a vehicle."""
_DATA = Path(__file__).parent / "data"
_ANY = TypeVar("_ANY")


def _value(label: str, unit: str, *, zero: bool = False, high: float = math.inf, **default: float) -> Any:
    """A field of a table, > 0; `zero` allows 0, and then numbers up to 1e12."""
    remedy = "compare with the vehicles that come with the program"
    number = Number(label=label, help=label, unit=unit, high=1e12 if zero else high, inclusive=zero, remedy=remedy)
    return field(metadata={"input": number}, **default)  # type: ignore[call-overload]


@dataclass(frozen=True, kw_only=True)
class _Part:
    """A table of a vehicle's file."""

    def __post_init__(self) -> None:
        check_inputs(self)


@dataclass(frozen=True, kw_only=True)
class WheelsetBody(_Part):
    """A wheelset: mass, inertias about its own axes, nominal radius."""

    mass_kg: float = _value("mass of the wheelset", "kg")
    roll_inertia_kg_m2: float = _value("roll inertia of the wheelset", "kg m2")
    axle_inertia_kg_m2: float = _value("inertia of the wheelset about its axle", "kg m2")
    yaw_inertia_kg_m2: float = _value("yaw inertia of the wheelset", "kg m2")
    rolling_radius_mm: float = _value("rolling radius", "mm", high=1000.0)


@dataclass(frozen=True, kw_only=True)
class Guide(_Part):
    """What a wheelset without a bogie carries, and springs to a frame that follows the track."""

    axle_load_kN: float = _value("axle load", "kN")
    lateral_N_per_m: float = _value("lateral stiffness of the guide", "N/m", zero=True, default=0.0)
    yaw_Nm_per_rad: float = _value("yaw stiffness of the guide", "N m/rad", zero=True, default=0.0)


@dataclass(frozen=True, kw_only=True)
class Frame(_Part):
    """A bogie frame."""

    mass_kg: float = _value("mass of the frame", "kg")
    roll_inertia_kg_m2: float = _value("roll inertia of the frame", "kg m2")
    yaw_inertia_kg_m2: float = _value("yaw inertia of the frame", "kg m2")
    height_m: float = _value("height of the frame's centre", "m", high=5.0)
    half_wheelbase_m: float = _value("half of the wheelbase", "m", high=10.0)


@dataclass(frozen=True, kw_only=True)
class Body(_Part):
    """A car body on two bogies, reduced to its weight, roll, and the yaw of the secondary suspension."""

    mass_kg: float = _value("mass of the body", "kg")
    height_m: float = _value("height of the body's centre", "m", high=10.0)
    half_pivots_m: float = _value("half of the distance of the pivots", "m", high=30.0)


@dataclass(frozen=True, kw_only=True)
class Primary(_Part):
    """Suspension of one axle box, at half a distance from the middle."""

    longitudinal_N_per_m: float = _value("longitudinal primary stiffness", "N/m")
    lateral_N_per_m: float = _value("lateral primary stiffness", "N/m")
    vertical_N_per_m: float = _value("vertical primary stiffness", "N/m")
    half_distance_m: float = _value("half of the distance of the primary springs", "m", high=3.0)
    longitudinal_Ns_per_m: float = _value("longitudinal primary damping", "N s/m", zero=True, default=0.0)
    lateral_Ns_per_m: float = _value("lateral primary damping", "N s/m", zero=True, default=0.0)
    vertical_Ns_per_m: float = _value("vertical primary damping", "N s/m", zero=True, default=0.0)


@dataclass(frozen=True, kw_only=True)
class Secondary(_Part):
    """Suspension of the body on one side of a bogie."""

    longitudinal_N_per_m: float = _value("longitudinal secondary stiffness", "N/m", zero=True)
    lateral_N_per_m: float = _value("lateral secondary stiffness", "N/m", zero=True)
    vertical_N_per_m: float = _value("vertical secondary stiffness", "N/m")
    half_distance_m: float = _value("half of the distance of the secondary springs", "m", high=3.0)
    height_m: float = _value("height of the secondary springs", "m", high=5.0)
    roll_bar_Nm_per_rad: float = _value("stiffness of the anti-roll bar", "N m/rad", zero=True, default=0.0)
    longitudinal_Ns_per_m: float = _value("longitudinal secondary damping", "N s/m", zero=True, default=0.0)
    lateral_Ns_per_m: float = _value("lateral secondary damping", "N s/m", zero=True, default=0.0)
    vertical_Ns_per_m: float = _value("vertical secondary damping", "N s/m", zero=True, default=0.0)


@dataclass(frozen=True, kw_only=True)
class Bogie:
    """A bogie of two wheelsets below half a body: the leading one of its vehicle, or the trailing one."""

    frame: Frame
    body: Body
    primary: Primary
    secondary: Secondary
    leads: bool = True

    @property
    def ahead_m(self) -> float:
        """How far its pivot is ahead of the middle of the body."""
        return self.body.half_pivots_m if self.leads else -self.body.half_pivots_m


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """A vehicle: one wheelset with its load (`guide`), or bogies of two wheelsets (`bogie`)."""

    name: str
    source: str
    wheelset: WheelsetBody
    guide: Guide | None = None
    bogie: Bogie | None = None

    @property
    def wheelsets(self) -> int:
        """Number of wheelsets that are in equilibrium together."""
        return 1 if self.bogie is None else 2


def with_bogie(vehicle: Vehicle, which: str) -> Vehicle:
    """A vehicle with its `leading` or `trailing` bogie.

    Raises
    ------
    InputError
        For another word, and for the trailing bogie of a vehicle without any.
    """
    if which not in BOGIES:
        raise InputError(f"bogie is {which!r}; allowed: {', '.join(BOGIES)}")
    leads = which == BOGIES[0]
    if vehicle.bogie is None:
        if not leads:
            raise InputError(f"bogie is {which!r}, but {vehicle.name} has none; leave it out")
        return vehicle
    return replace(vehicle, bogie=replace(vehicle.bogie, leads=leads))


_OF_BOGIE: Mapping[str, type] = {"frame": Frame, "body": Body, "primary": Primary, "secondary": Secondary}
_TABLES: Mapping[str, type] = {"wheelset": WheelsetBody, "guide": Guide, **_OF_BOGIE}


def built_in_vehicles() -> tuple[str, ...]:
    """Names of the vehicles that come with the program."""
    return tuple(sorted(path.stem for path in _DATA.glob("*.toml")))


def load_vehicle(spec: str) -> Vehicle:
    """A vehicle by the name of a built-in one, or from a TOML file.

    Raises
    ------
    InputError
        If there is no such vehicle or file, a key is missing or unknown, or a value is out of its range.
    """
    path = _DATA / f"{spec}.toml" if spec in built_in_vehicles() else Path(spec)
    if not path.is_file():
        raise InputError(
            f"vehicle is {spec!r}: no such file; allowed: {', '.join(built_in_vehicles())}, or a TOML file"
        )
    try:
        given = tomllib.loads(path.read_text("utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"vehicle {path.name}: it is not TOML ({error}); correct it") from error
    try:
        return _vehicle(given)
    except InputError as error:
        raise InputError(f"vehicle {path.name}: {error}") from error


def _vehicle(given: Mapping[str, Any]) -> Vehicle:
    known = {"name", "source", *_TABLES}
    if unknown := [key for key in given if key not in known]:
        raise InputError(f"{unknown[0]}: there is no such key; keys: {', '.join(sorted(known))}")
    has_bogie = any(table in given for table in _OF_BOGIE)
    if has_bogie == ("guide" in given):
        raise InputError(
            f"it needs either [guide] (one wheelset with its load) or all of [{'], ['.join(_OF_BOGIE)}], not both"
        )
    wanted = ("wheelset", *(_OF_BOGIE if has_bogie else ("guide",)))
    parts: dict[str, Any] = {name: _table(name, given.get(name), _TABLES[name]) for name in wanted}
    bogie = Bogie(**{name: parts[name] for name in _OF_BOGIE}) if has_bogie else None
    name, source = str(given.get("name", "vehicle")), str(given.get("source", ""))
    return Vehicle(name=name, source=source, wheelset=parts["wheelset"], guide=parts.get("guide"), bogie=bogie)


def _table(name: str, given: Any, kind: type[_ANY]) -> _ANY:
    """A table of the file as the value that it describes."""
    if not isinstance(given, Mapping):
        raise InputError(f"[{name}] is missing; give it, as in the built-in files")
    entries: tuple[Any, ...] = fields(kind)  # type: ignore[arg-type]
    keys = [entry.name for entry in entries]
    if unknown := [key for key in given if key not in keys]:
        raise InputError(f"[{name}]: {unknown[0]}: there is no such key; keys: {', '.join(keys)}")
    missing = [entry.name for entry in entries if entry.default is MISSING and entry.name not in given]
    if missing:
        raise InputError(f"[{name}]: {missing[0]} is missing; give it, as in the built-in files")
    return kind(
        **{entry.name: entry.metadata["input"].read(given[entry.name]) for entry in entries if entry.name in given}
    )
