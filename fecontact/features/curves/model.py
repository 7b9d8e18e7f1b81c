"""Vehicles as values, read from TOML files.

A vehicle has masses, dimensions and suspensions. The unit of each value is in the name of its key.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Any

from fecontact.errors import InputError
from fecontact.inputs.kinds import number_field
from fecontact.inputs.slots import input_dataclass, read_table

GRAVITY_M_S2 = 9.81
"""Acceleration of gravity, m/s2."""
BOGIES = ("leading", "trailing")
"""Names of the two bogies of a vehicle, the default first."""
DEFAULT_VEHICLE = "manchester"
"""Vehicle if no vehicle is given."""
_DATA_FOLDER = Path(__file__).parent / "data"


def _positive_field(help: str, default: Any = MISSING, **options: Any) -> Any:
    """Field of a table with an allowed range above 0.

    `options` are further keywords of `number`, such as `low` and `high`.
    """
    return number_field(default, help, remedy="compare with the built-in vehicles", **options)


def _field_from_zero(help: str, default: Any = 0.0) -> Any:
    """Field of a table with an allowed range from 0 to 1e12, 0 included."""
    return _positive_field(help, default, high=1e12)


@input_dataclass
class WheelsetBody:
    """Mass, inertias and nominal radius of a wheelset.

    The inertias are about the axes of the wheelset.
    """

    mass_kg: float = _positive_field("Mass of the wheelset")
    roll_inertia_kg_m2: float = _positive_field("Roll inertia of the wheelset")
    axle_inertia_kg_m2: float = _positive_field("Inertia of the wheelset about its axle")
    yaw_inertia_kg_m2: float = _positive_field("Yaw inertia of the wheelset")
    rolling_radius_mm: float = _positive_field("Rolling radius", low=100.0, high=1000.0)


@input_dataclass
class Guide:
    """Load and springs of a wheelset without a bogie.

    The springs connect the wheelset to a frame that follows the track.
    """

    axle_load_kN: float = _positive_field("Axle load")
    lateral_N_per_m: float = _field_from_zero("Lateral stiffness of the guide")
    yaw_Nm_per_rad: float = _field_from_zero("Yaw stiffness of the guide")


@input_dataclass
class Frame:
    """Frame of a bogie."""

    mass_kg: float = _positive_field("Mass of the frame")
    roll_inertia_kg_m2: float = _positive_field("Roll inertia of the frame")
    yaw_inertia_kg_m2: float = _positive_field("Yaw inertia of the frame")
    height_m: float = _positive_field("Height of the centre of mass of the frame", high=5.0, inclusive=False)
    half_wheelbase_m: float = _positive_field("Half of the wheelbase", high=10.0, inclusive=False)


@input_dataclass
class Body:
    """Car body on two bogies.

    The body is reduced to its weight, its roll, and the yaw of the secondary suspension.
    """

    mass_kg: float = _positive_field("Mass of the body")
    height_m: float = _positive_field("Height of the centre of mass of the body", high=10.0, inclusive=False)
    half_pivots_m: float = _positive_field("Half of the distance between the pivots", high=30.0, inclusive=False)


@input_dataclass
class Primary:
    """Suspension of an axle box.

    The axle box is at `half_distance_m` from the middle of the wheelset.
    """

    longitudinal_N_per_m: float = _positive_field("Longitudinal primary stiffness")
    lateral_N_per_m: float = _positive_field("Lateral primary stiffness")
    vertical_N_per_m: float = _positive_field("Vertical primary stiffness")
    half_distance_m: float = _positive_field(
        "Half of the distance between the primary springs", high=3.0, inclusive=False
    )
    longitudinal_Ns_per_m: float = _field_from_zero("Longitudinal primary damping")
    lateral_Ns_per_m: float = _field_from_zero("Lateral primary damping")
    vertical_Ns_per_m: float = _field_from_zero("Vertical primary damping")


@input_dataclass
class Secondary:
    """Suspension of the body on each side of a bogie."""

    longitudinal_N_per_m: float = _field_from_zero("Longitudinal secondary stiffness", MISSING)
    lateral_N_per_m: float = _field_from_zero("Lateral secondary stiffness", MISSING)
    vertical_N_per_m: float = _positive_field("Vertical secondary stiffness")
    half_distance_m: float = _positive_field(
        "Half of the distance between the secondary springs", high=3.0, inclusive=False
    )
    height_m: float = _positive_field("Height of the secondary springs", high=5.0, inclusive=False)
    roll_bar_Nm_per_rad: float = _field_from_zero("Stiffness of the anti-roll bar")
    longitudinal_Ns_per_m: float = _field_from_zero("Longitudinal secondary damping")
    lateral_Ns_per_m: float = _field_from_zero("Lateral secondary damping")
    vertical_Ns_per_m: float = _field_from_zero("Vertical secondary damping")


@dataclass(frozen=True, kw_only=True)
class Bogie:
    """Bogie of two wheelsets below half a body.

    Attributes
    ----------
    frame, body
        Frame of the bogie, and the body of which the bogie carries one half.
    primary, secondary
        Suspension of each axle box, and of the body on each side.
    leads
        Whether the bogie is the leading bogie of its vehicle, not the trailing bogie.
    """

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
            If the roll stiffness is at most the moment per radian with which half of the body's weight tilts the body.
            The message gives both stiffnesses.
        """
        tilting = 0.5 * self.body.mass_kg * GRAVITY_M_S2 * (self.body.height_m - self.secondary.height_m)
        if self.roll_stiffness_Nm_per_rad <= tilting:
            raise InputError(
                f"roll stiffness of secondary springs and anti-roll bar is {self.roll_stiffness_Nm_per_rad:.4g} N"
                f" m/rad; allowed: more than {tilting:.4g} N m/rad, so that half the weight of the body does not tilt"
                " it over; give stiffer springs"
            )

    @property
    def roll_stiffness_Nm_per_rad(self) -> float:
        """Roll stiffness of the body on its bogie, N m/rad."""
        springs = self.secondary
        return 2.0 * springs.vertical_N_per_m * springs.half_distance_m**2 + springs.roll_bar_Nm_per_rad

    @property
    def ahead_m(self) -> float:
        """Distance from the middle of the body forward to the pivot of the bogie, m."""
        return self.body.half_pivots_m if self.leads else -self.body.half_pivots_m


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Vehicle of a single loaded wheelset, or of bogies with two wheelsets each.

    Attributes
    ----------
    name, source
        Name of the vehicle, and the source of its values.
    wheelset
        Mass, inertias and radius of each wheelset.
    guide
        Load and springs of a single wheelset; None for a vehicle with bogies.
    bogie
        Bogie of two wheelsets; None for a single wheelset.

    Examples
    --------
    >>> from fecontact.features.curves.model import load_vehicle
    >>> load_vehicle("manchester").wheelsets, load_vehicle("wheelset").wheelsets
    (2, 1)
    """

    name: str
    source: str
    wheelset: WheelsetBody
    guide: Guide | None = None
    bogie: Bogie | None = None

    @property
    def wheelsets(self) -> int:
        """Number of wheelsets that are in equilibrium together."""
        return 1 if self.bogie is None else 2


def choose_bogie(vehicle: Vehicle, bogie_name: str) -> Vehicle:
    """Choose the leading or the trailing bogie of a vehicle.

    Parameters
    ----------
    vehicle
        Vehicle with or without bogies.
    bogie_name
        `leading` or `trailing`.

    Returns
    -------
    Vehicle
        The vehicle with this bogie; the vehicle itself if it has no bogie and the name is `leading`.

    Raises
    ------
    InputError
        For another name, and for the trailing bogie of a vehicle without bogies.

    Examples
    --------
    >>> from fecontact.features.curves.model import choose_bogie, load_vehicle
    >>> choose_bogie(load_vehicle("manchester"), "trailing").bogie.leads
    False
    """
    if bogie_name not in BOGIES:
        raise InputError(f"bogie is {bogie_name!r}; allowed: {', '.join(BOGIES)}")
    leads = bogie_name == BOGIES[0]
    if vehicle.bogie is None:
        if not leads:
            raise InputError(f"bogie is {bogie_name!r}, but {vehicle.name} has no bogies; omit the bogie")
        return vehicle
    return replace(vehicle, bogie=replace(vehicle.bogie, leads=leads))


_BOGIE_TABLES: Mapping[str, type] = {"frame": Frame, "body": Body, "primary": Primary, "secondary": Secondary}
_TABLES: Mapping[str, type] = {"wheelset": WheelsetBody, "guide": Guide, **_BOGIE_TABLES}


def built_in_vehicles() -> tuple[str, ...]:
    """Names of the vehicles that come with the program.

    Examples
    --------
    >>> from fecontact.features.curves.model import built_in_vehicles
    >>> {"manchester", "wheelset"} <= set(built_in_vehicles())
    True
    """
    return tuple(sorted(path.stem for path in _DATA_FOLDER.glob("*.toml")))


def load_vehicle(spec: str) -> Vehicle:
    """Load a built-in vehicle by its name, or a vehicle from a TOML file.

    Parameters
    ----------
    spec
        Name of a built-in vehicle, or path of a TOML file.

    Returns
    -------
    Vehicle
        The vehicle with its leading bogie, if it has bogies.

    Raises
    ------
    InputError
        If there is no such vehicle or file, if a key is missing or unknown, or if a value is out of its range.

    Examples
    --------
    >>> from fecontact.features.curves.model import load_vehicle
    >>> load_vehicle("manchester").wheelset.rolling_radius_mm
    460.0
    """
    # the command line imports this module at its start, without arrays
    from fecontact.files import path_exists, read_toml

    path = _DATA_FOLDER / f"{spec}.toml" if spec in built_in_vehicles() else Path(spec)
    if not path_exists(path):
        raise InputError(
            f"vehicle is {spec!r}: no such file; allowed: {', '.join(built_in_vehicles())}, or a TOML file"
        )
    tables = read_toml(path, f"vehicle {path.name}")
    try:
        return _build_vehicle(tables)
    except InputError as error:
        raise InputError(f"vehicle {path.name}: {error}") from error


def _build_vehicle(tables: Mapping[str, Any]) -> Vehicle:
    """Build a vehicle from the tables of a TOML file.

    Raises
    ------
    InputError
        If a key is unknown, if a table is wrong, or if the tables are neither `guide` alone nor those of a bogie alone.
    """
    known_keys = {"name", "source", *_TABLES}
    if unknown := [key for key in tables if key not in known_keys]:
        raise InputError(f"{unknown[0]}: unknown key; allowed: {', '.join(sorted(known_keys))}")
    has_bogie = any(table in tables for table in _BOGIE_TABLES)
    if has_bogie == ("guide" in tables):
        raise InputError(
            f"give either [guide] (a wheelset with its load) or all of [{'], ['.join(_BOGIE_TABLES)}], not both"
        )
    required_tables = ("wheelset", *(_BOGIE_TABLES if has_bogie else ("guide",)))
    table_values: dict[str, Any] = {name: read_table(_TABLES[name], name, tables.get(name)) for name in required_tables}
    bogie = Bogie(**{name: table_values[name] for name in _BOGIE_TABLES}) if has_bogie else None
    name, source = tables.get("name", "vehicle"), tables.get("source", "")
    for key, text in (("name", name), ("source", source)):
        if not isinstance(text, str):
            raise InputError(f"{key} is {text!r:.80}; allowed: a text in quotes")
    return Vehicle(
        name=name, source=source, wheelset=table_values["wheelset"], guide=table_values.get("guide"), bogie=bogie
    )
