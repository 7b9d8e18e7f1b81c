"""Vehicles as values, read from TOML files: masses, dimensions, suspensions, all with units in their keys."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.inputs.kinds import number
from fecontact.inputs.slots import inputs, read_table

GRAVITY_M_S2 = 9.81
BOGIES = ("leading", "trailing")
"""The bogies of a vehicle."""
_DATA = Path(__file__).parent / "data"


def _value(help: str, default: Any = MISSING, **more: Any) -> Any:
    """A field of a table, > 0."""
    return number(default, help, remedy="compare with the vehicles that come with the program", **more)


def _from_zero(help: str, default: Any = 0.0) -> Any:
    """Likewise, or 0."""
    return _value(help, default, high=1e12)


@inputs
class WheelsetBody:
    """A wheelset: mass, inertias about its own axes, nominal radius."""

    mass_kg: float = _value("Mass of the wheelset")
    roll_inertia_kg_m2: float = _value("Roll inertia of the wheelset")
    axle_inertia_kg_m2: float = _value("Inertia of the wheelset about its axle")
    yaw_inertia_kg_m2: float = _value("Yaw inertia of the wheelset")
    rolling_radius_mm: float = _value("Rolling radius", low=100.0, high=1000.0)


@inputs
class Guide:
    """What a wheelset without a bogie carries, and springs to a frame that follows the track."""

    axle_load_kN: float = _value("Axle load")
    lateral_N_per_m: float = _from_zero("Lateral stiffness of the guide")
    yaw_Nm_per_rad: float = _from_zero("Yaw stiffness of the guide")


@inputs
class Frame:
    """A bogie frame."""

    mass_kg: float = _value("Mass of the frame")
    roll_inertia_kg_m2: float = _value("Roll inertia of the frame")
    yaw_inertia_kg_m2: float = _value("Yaw inertia of the frame")
    height_m: float = _value("Height of the frame's centre", high=5.0, inclusive=False)
    half_wheelbase_m: float = _value("Half of the wheelbase", high=10.0, inclusive=False)


@inputs
class Body:
    """A car body on two bogies, reduced to its weight, roll, and the yaw of the secondary suspension."""

    mass_kg: float = _value("Mass of the body")
    height_m: float = _value("Height of the body's centre", high=10.0, inclusive=False)
    half_pivots_m: float = _value("Half of the distance of the pivots", high=30.0, inclusive=False)


@inputs
class Primary:
    """Suspension of one axle box, at half a distance from the middle."""

    longitudinal_N_per_m: float = _value("Longitudinal primary stiffness")
    lateral_N_per_m: float = _value("Lateral primary stiffness")
    vertical_N_per_m: float = _value("Vertical primary stiffness")
    half_distance_m: float = _value("Half of the distance of the primary springs", high=3.0, inclusive=False)
    longitudinal_Ns_per_m: float = _from_zero("Longitudinal primary damping")
    lateral_Ns_per_m: float = _from_zero("Lateral primary damping")
    vertical_Ns_per_m: float = _from_zero("Vertical primary damping")


@inputs
class Secondary:
    """Suspension of the body on one side of a bogie."""

    longitudinal_N_per_m: float = _from_zero("Longitudinal secondary stiffness", MISSING)
    lateral_N_per_m: float = _from_zero("Lateral secondary stiffness", MISSING)
    vertical_N_per_m: float = _value("Vertical secondary stiffness")
    half_distance_m: float = _value("Half of the distance of the secondary springs", high=3.0, inclusive=False)
    height_m: float = _value("Height of the secondary springs", high=5.0, inclusive=False)
    roll_bar_Nm_per_rad: float = _from_zero("Stiffness of the anti-roll bar")
    longitudinal_Ns_per_m: float = _from_zero("Longitudinal secondary damping")
    lateral_Ns_per_m: float = _from_zero("Lateral secondary damping")
    vertical_Ns_per_m: float = _from_zero("Vertical secondary damping")


@dataclass(frozen=True, kw_only=True)
class Bogie:
    """A bogie of two wheelsets below half a body: the leading one of its vehicle, or the trailing one."""

    frame: Frame
    body: Body
    primary: Primary
    secondary: Secondary
    leads: bool = True

    def __post_init__(self) -> None:
        """Refuse a body that its springs do not hold upright.

        Raises
        ------
        InputError
            With both stiffnesses.
        """
        tilting = 0.5 * self.body.mass_kg * GRAVITY_M_S2 * (self.body.height_m - self.secondary.height_m)
        if self.roll_stiffness_Nm_per_rad <= tilting:
            raise InputError(
                f"secondary springs and anti-roll bar have {self.roll_stiffness_Nm_per_rad:.4g} N m/rad; allowed: more"
                f" than {tilting:.4g}, with which half the body's weight tilts it over; give stiffer ones"
            )

    @property
    def roll_stiffness_Nm_per_rad(self) -> float:
        """Stiffness of the body's roll on one bogie."""
        above = self.secondary
        return 2.0 * above.vertical_N_per_m * above.half_distance_m**2 + above.roll_bar_Nm_per_rad

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
    parts: dict[str, Any] = {name: read_table(_TABLES[name], name, given.get(name)) for name in wanted}
    bogie = Bogie(**{name: parts[name] for name in _OF_BOGIE}) if has_bogie else None
    name, source = str(given.get("name", "vehicle")), str(given.get("source", ""))
    return Vehicle(name=name, source=source, wheelset=parts["wheelset"], guide=parts.get("guide"), bogie=bogie)
