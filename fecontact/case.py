"""A case: everything that decides about one result, as plain values, and the one description of each of them.

What a field of `Case` and of its parts is (unit, range, help, key, group) stands beside it as metadata. Checks, study
files and the options of the command line are made from that. The parts `Criteria`, `Track` and `BodySize` are found
here as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, Literal, get_args

from fecontact.bodies import STEEL, Material, TrackSide, contact_modulus_MPa
from fecontact.bodies import BodySize as BodySize
from fecontact.bodies import Track as Track
from fecontact.criteria import Creep
from fecontact.criteria import Criteria as Criteria
from fecontact.errors import InputError
from fecontact.inputs import (
    INCLINATION_FORMS,
    Choice,
    Flag,
    Number,
    Part,
    Slot,
    Text,
    Written,
    by_name,
    check_inputs,
    given,
    inclination_text,
    parse_inclination,
    renamed,
    slots,
)
from fecontact.irregularity.shapes import FORMS, Irregularity, irregularity_of, irregularity_text
from fecontact.profiles.reading import Reading, makes_a_wheelset

Group = Literal["place", "profiles", "load", "material", "bodies", "solution", "verdict", "creep"]
LoadKind = Literal["vertical", "normal"]
Roll = Literal["touching", "given", "loaded"]
SolverChoice = Literal["auto", "pardiso", "amg"]

RESOLUTIONS = {"quick": 4.0, "standard": 9.0, "fine": 13.5}
"""Named resolutions: elements a semi-axis of the expected patch, in each direction."""
# With 16 the area of a patch with a thin tail is read to 0.7 % only.
NODES_A_SEMI_AXIS = 32
"""Nodes of the pressure on the narrowest semi-axis of the patch, of lobes too."""
# What these leave open must not hide what more elements bring.
_NODES_OF_MORE_ELEMENTS = 48

INCLINATION_1_40 = math.atan(1.0 / 40.0)


_RAIL = Text(
    help="Rail",
    domain="library name, profile file, circle:R, or arcs:R/R@D for two arcs whose junction is D from the crown; mm",
)
_WHEEL = replace(_RAIL, help="Wheel", domain="library name, profile file, or cylinder:R (flat); mm")
_LIBRARY = Text(
    help="Library of your own, before the built-in one", domain="folder whose profile files rail and wheel may name"
)
_INCLINATION = Number(
    help="Inclination of the rail towards the track centre, none if the profile is canted already",
    key="inclination",
    shown_unit="mrad",
    low=-0.35,
    high=0.35,
    remedy="1:40 is 0.025 rad",
    parse=parse_inclination,
    show=inclination_text,
    forms=INCLINATION_FORMS,
)
_SHIFT = Number(
    help="Lateral shift of the wheelset, positive towards the left rail",
    options=("shift", "lateral-shift-mm"),
    low=-60.0,
    high=60.0,
)
_ROLL = Choice(
    help="Roll of the wheelset: that at which both wheels touch their rails, that with both pressed into them by the"
    " wheel loads, or a given one (0 for circles, cylinders and crane rails, which make no wheelset)",
    names=get_args(Roll),
)
_YAW = Number(
    help="Yaw of the wheelset about z",
    shown_unit="mrad",
    low=-0.1,
    high=0.1,
    remedy="wheelsets yaw by some mrad, or tens",
)
_ROLL_ANGLE = replace(
    _YAW,
    label="roll angle",
    help="Roll of the wheelset about x where it is given, positive lifts the left wheel",
    remedy="wheelsets roll by some mrad",
)
_CLIMB = Flag(help="Let the flange climb: take contacts beyond its steepest place too, up to its top", alone=True)
_SIDE = Choice(help="Wheel and rail of the wheelset that are solved", names=("left", "right"))
_LOAD = Number(
    help="Wheel load",
    shown_unit="kN",
    low=1.0,
    high=1e9,
    usual=(1e3, 1e6),
    remedy="give the wheel load, for example 100000 N (100 kN)",
)
_LOAD_KIND = Choice(
    help="Whether the load is vertical or acts along the contact normal at first touch", names=get_args(LoadKind)
)
_ROLL_LOAD = replace(
    _LOAD,
    help="Wheel load under which the roll of the loaded wheelset is found, if it is another one than the load",
    remedy="give the wheel load under which the wheelset rolls, for example 80000 N (80 kN)",
)
_ROLLING_RADIUS = Number(help="Rolling radius at the tape circle", remedy="railway wheels have 300 to 625 mm")


# of a number that stands in every case in the end
_NOT_SAID: Any = None
_RAIL_IRREGULARITY = Written(
    help="Material that the rail misses along the track, opening the gap",
    domain=FORMS,
    kind=Irregularity,
    parse=irregularity_of,
    show=irregularity_text,
)
_WHEEL_IRREGULARITY = replace(_RAIL_IRREGULARITY, help="Material that the wheel misses along its circumference")
_DISTANCE = Number(
    help="Distance run along the irregularities to where smooth bodies touch",
    low=-1e7,
    high=1e7,
    remedy="give the place along the wave, the flat (its middle is 0) or the table",
)


def _opposite(described: Text | Number, label: str, option: str = "") -> Text | Number:
    return replace(
        described,
        label=f"opposite {label}",
        help=f"{described.help} of the other side of the wheelset, if it is another one",
        options=(f"opposite-{option or label}",),
    )


@by_name
@dataclass(frozen=True, kw_only=True)
class Opposite:
    """Rail, wheel, rolling radius and load of the other side of a wheelset; None where they are as on the case's side.

    The load counts for the roll of the loaded wheelset alone.
    """

    rail: str | None = given(None, _opposite(_RAIL, "rail"))
    wheel: str | None = given(None, _opposite(_WHEEL, "wheel"))
    rolling_radius_mm: float | None = given(None, _opposite(_ROLLING_RADIUS, "rolling radius", "rolling-radius-mm"))
    wheel_load_N: float | None = given(None, _opposite(replace(_LOAD, key="load_kN"), "load", "load-kn"))

    def __post_init__(self) -> None:
        check_inputs(self)

    @property
    def is_mirror_image(self) -> bool:
        """Whether nothing is given but a load."""
        return replace(self, wheel_load_N=None) == Opposite()


_RESOLUTION = Choice(
    help=f"Elements a semi-axis of the patch ({', '.join(f'{n:g}' for n in RESOLUTIONS.values())}), or their sizes"
    " along x and across",
    names=tuple(RESOLUTIONS),
    pair=Number(label="element size", help="", unit="mm", remedy="a tenth of the patch's semi-axis is a good size"),
)
_SOLVER = Choice(help="Linear solver", names=get_args(SolverChoice))
_REFINE = Number(
    label="refinement limit",
    help="Refine an unresolved verdict while fewer unknowns than this are expected; 0 never refines",
    unit="degrees of freedom",
    high=1e9,
    whole=True,
    remedy="0 never refines",
)

_EVIDENCE = Flag(
    help="Refine also until the elements' own nodes know the verdict by themselves, within the refinement limit",
    alone=True,
)


@by_name
@dataclass(frozen=True, kw_only=True)
class Case:
    """One wheel-rail position under one load.

    What each field is, its unit and its range stand in its description; `fecontact solve --help-all` prints them all.
    `resolution` may be the element sizes (along x, across). The bound on the degrees of freedom of a refinement bounds
    time and memory alike, on every machine in the same way.

    Shift, roll and yaw are those of the wheelset in the frame of its left side, whichever `side` is solved: with equal
    profiles the right wheel is the left one with the opposite signs of all three.

    `roll` is one of three: "touching" for that at which both wheels touch their rails, "given" as `roll_rad`, "loaded"
    for that with both pressed into them, by the load of the case or `roll_load_N`, and on the other side that of
    `opposite`. Where it is not said (None), it is that to which the numbers belong; without any it is "touching", or
    "given" as 0 for lines that make no wheelset.
    """

    rail: str = given("60E1", _RAIL, "place")
    wheel: str = given("S1002", _WHEEL, "place")
    inclination_rad: float = given(INCLINATION_1_40, _INCLINATION, "place")
    lateral_shift_mm: float = given(0.0, _SHIFT, "place")
    roll: Roll | None = given(None, _ROLL, "place")
    roll_rad: float = given(_NOT_SAID, _ROLL_ANGLE, "place")
    yaw_rad: float = given(0.0, _YAW, "place")
    roll_load_N: float | None = given(None, _ROLL_LOAD, "place")
    flange_climb: bool = given(False, _CLIMB, "place")
    side: TrackSide = given("left", _SIDE, "place")
    opposite: Opposite = field(default_factory=Opposite, metadata={"part": Part(group="place")})
    load_N: float = given(100e3, _LOAD, "load")
    load_kind: LoadKind = given("vertical", _LOAD_KIND, "load")
    rail_material: Material = field(default=STEEL, metadata={"part": Part(group="material", body="rail", both=True)})
    wheel_material: Material = field(default=STEEL, metadata={"part": Part(group="material", body="wheel", both=True)})
    rolling_radius_mm: float = given(460.0, _ROLLING_RADIUS, "place")
    track: Track = field(default_factory=Track, metadata={"part": Part(group="place")})
    size: BodySize = field(default_factory=BodySize, metadata={"part": Part(group="bodies")})
    resolution: str | tuple[float, float] = given("quick", _RESOLUTION, "solution")
    solver: SolverChoice = given("auto", _SOLVER, "solution")
    criteria: Criteria = field(default_factory=Criteria, metadata={"part": Part(group="verdict")})
    rail_file: Reading = field(default_factory=Reading, metadata={"part": Part(group="profiles", body="rail")})
    wheel_file: Reading = field(default_factory=Reading, metadata={"part": Part(group="profiles", body="wheel")})
    creep: Creep = field(default_factory=Creep, metadata={"part": Part(group="creep")})
    refine_degrees_of_freedom: int = given(400_000, _REFINE, "solution")
    evidence: bool = given(False, _EVIDENCE, "solution")

    rail_irregularity: Irregularity | None = given(None, _RAIL_IRREGULARITY, "place")
    wheel_irregularity: Irregularity | None = given(None, _WHEEL_IRREGULARITY, "place")
    distance_mm: float = given(0.0, _DISTANCE, "place")
    library: str | None = given(None, _LIBRARY, "profiles")

    def __post_init__(self) -> None:
        check_inputs(self)
        if self.library is not None:
            from fecontact.profiles.library import in_folder

            # from here on they are files as any others, wherever the case goes
            object.__setattr__(self, "rail", in_folder(self.rail, self.library))
            object.__setattr__(self, "wheel", in_folder(self.wheel, self.library))
            rail, wheel = (one and in_folder(one, self.library) for one in (self.opposite.rail, self.opposite.wheel))
            object.__setattr__(self, "opposite", replace(self.opposite, rail=rail, wheel=wheel))
            object.__setattr__(self, "library", None)
        self._choose_roll()
        if self.roll == "loaded" and self.load_kind != "vertical" and self.roll_load_N is None:
            raise InputError(
                f"load kind is {self.load_kind!r}, but the roll of the loaded wheelset is that of vertical wheel loads;"
                " give load_kind = 'vertical', the wheel load as roll_load_kN, or another roll"
            )

    def _choose_roll(self) -> None:
        """Take the roll to which the numbers belong where none is said, and refuse numbers of another one."""
        loads = {"roll load": self.roll_load_N, "opposite load": self.opposite.wheel_load_N}
        numbers: dict[str, tuple[Roll, str]] = {
            name: ("loaded", f"{load_N / 1e3:g} kN") for name, load_N in loads.items() if load_N is not None
        }
        # a roll angle of 0 that stands there already is no contradiction: every case with another roll has it
        angle: Any = self.roll_rad
        if angle is not None and (angle != 0.0 or self.roll is None):
            numbers["roll angle"] = ("given", _angle_text(angle))
        if self.roll is None:
            without: Roll = "touching" if makes_a_wheelset(self.rail, self.wheel) else "given"
            object.__setattr__(self, "roll", next((kind for kind, _ in numbers.values()), without))
        if angle is None:
            object.__setattr__(self, "roll_rad", 0.0)
        for name, (kind, value) in numbers.items():
            _refuse_other_roll(name, value, kind, self.roll)

    def roll_loads_N(self) -> dict[TrackSide, float]:
        """Vertical loads of both wheels under which the roll of a loaded wheelset is found."""
        own = self.load_N if self.roll_load_N is None else self.roll_load_N
        other = own if self.opposite.wheel_load_N is None else self.opposite.wheel_load_N
        return {"left": own, "right": other} if self.side == "left" else {"left": other, "right": own}

    @property
    def profiles(self) -> dict[str, str]:
        """Names or files of all profiles, by what they are."""
        other = {f"opposite_{name}": spec for name in ("rail", "wheel") if (spec := getattr(self.opposite, name))}
        return {"rail": self.rail, "wheel": self.wheel, **other}

    def with_profiles(self, specs: Mapping[str, str]) -> Case:
        """The same with other names or files of some profiles."""
        own: dict[str, Any] = {key: specs[key] for key in ("rail", "wheel") if key in specs}
        other: dict[str, Any] = {
            key: specs[f"opposite_{key}"] for key in ("rail", "wheel") if f"opposite_{key}" in specs
        }
        return replace(self, **own, opposite=replace(self.opposite, **other))

    @property
    def contact_modulus_MPa(self) -> float:
        """Contact modulus E* of wheel and rail."""
        return contact_modulus_MPa(self.rail_material, self.wheel_material)

    @property
    def nodes_a_semi_axis(self) -> int:
        """Nodes of the pressure on the narrowest semi-axis of the patch, whatever the elements are."""
        return _NODES_OF_MORE_ELEMENTS if self.resolution in ("standard", "fine") else NODES_A_SEMI_AXIS

    @property
    def may_yield(self) -> bool:
        """Whether a yield stress is given, of rail or wheel."""
        return any(body.yield_MPa is not None for body in (self.rail_material, self.wheel_material))

    @property
    def half(self) -> bool:
        """Whether x = 0 is a plane of symmetry."""
        return self.yaw_rad == 0.0 and not self.irregularities

    @property
    def irregularities(self) -> tuple[Irregularity, ...]:
        """What rail and wheel have along the track beside their profiles."""
        return tuple(line for line in (self.rail_irregularity, self.wheel_irregularity) if line is not None)


def _angle_text(roll_rad: float) -> str:
    return f"{1e3 * roll_rad:g} mrad"


def _refuse_other_roll(name: str, value: str, kind: Roll, roll: Roll | None) -> None:
    if kind != roll:
        raise InputError(f"{name} is {value}, but the roll is {roll!r}; leave it out, or give roll = {kind!r}")


_FILES = ("rail_file", "wheel_file")
INPUTS = slots(Case())
"""Every input of a case and of its parts."""
IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
"""The inputs of irregular bodies, for commands on smooth ones."""
PARTS = {part.name: type(getattr(Case(), part.name)) for part in fields(Case) if "part" in part.metadata}
"""The fields of a case that have fields of their own."""


def case_with(values: Mapping[Slot, Any]) -> Case:
    """The case with these values, in the units inside, and defaults for all other inputs.

    A roll angle among them, also of zero, is one that is given.

    Raises
    ------
    InputError
        If a value is outside its range.
    """
    given: dict[str, dict[str, Any]] = {}
    for slot, value in values.items():
        given.setdefault(slot.table, {})[slot.field] = value
    top = given.pop("", {})
    if "roll_rad" in top:
        _refuse_other_roll("roll angle", _angle_text(top["roll_rad"]), "given", top.setdefault("roll", "given"))
    return Case(**top, **{table: replace(getattr(Case(), table), **changes) for table, changes in given.items()})


def unusual(cases: Iterable[Case]) -> tuple[str, ...]:
    """What is allowed and not usual in some cases, most often a wrong unit, each once."""
    found = (
        slot.input.note(value)
        for case in cases
        for slot in INPUTS
        if isinstance(slot.input, Number) and (value := slot.of(case)) is not None
    )
    return tuple(dict.fromkeys(filter(None, found)))


def case_record(case: Case) -> dict[str, Any]:
    """All inputs of a case; of `resolution` and `element_size_mm` (along x, across) one is None.

    How the files are read is among them where something is said about it, and what is irregular where anything is.
    """
    record: dict[str, Any] = {}
    for name, value in asdict(case).items():
        if name == "library" or (name in _FILES and getattr(case, name) == Reading()):
            continue
        # smooth bodies, as they were before there were others
        if name in IRREGULAR and not value:
            continue
        record[name] = value
        if name == "resolution":
            named = isinstance(value, str)
            record[name], record["element_size_mm"] = (value, None) if named else (None, list(value))
    return record


def case_from_record(record: Mapping[str, Any]) -> Case:
    """The case of a record; a key that is missing takes the case's default.

    Raises
    ------
    InputError
        If there is a key or a value that a case cannot have.
    """
    if old := next(filter(None, map(renamed, record)), ""):
        raise InputError(f"case record: {old}; solve the case again")
    inputs = dict(record)
    sizes = inputs.pop("element_size_mm", None)
    if inputs.get("resolution") is None:
        inputs.pop("resolution", None)
    try:
        if sizes is not None:
            along_x, across = sizes
            inputs["resolution"] = (float(along_x), float(across))
        for name in PARTS.keys() & inputs:
            inputs[name] = PARTS[name](**inputs[name])
        for name in IRREGULAR[:2]:
            if inputs.get(name) is not None:
                inputs[name] = Irregularity(**inputs[name])
        return Case(**inputs)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"case record: {error}; keys that exist: {', '.join(case_record(Case()))}") from error
