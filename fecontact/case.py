"""A case: everything that decides about one result, as plain values, and the one description of each of them.

What a field of `Case` and of its parts is (range, help, group) stands beside it; label and unit are in its name.
Checks, study files and the options of the command line are made from that. The parts `Criteria`, `Track` and `BodySize`
are found here as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields, replace
from html import escape
from typing import Any, Literal, get_args

from fecontact.bodies import STEEL, Material, TrackSide, contact_modulus_MPa
from fecontact.bodies import BodySize as BodySize
from fecontact.bodies import Track as Track
from fecontact.criteria import Creep
from fecontact.criteria import Criteria as Criteria
from fecontact.errors import InputError
from fecontact.inputs.kinds import Number, as_number, choice, custom, flag, number, number_or_text, text
from fecontact.inputs.slots import Slot, inputs, part, slots
from fecontact.inputs.texts import INCLINATION_FORMS, inclination_text, parse_inclination, renamed
from fecontact.placement.irregularity import FORMS, Irregularity, irregularity_of, irregularity_text
from fecontact.profiles.reading import Reading, makes_a_wheelset

# fmt: off
Group = Literal[
    "pair", "position", "load", "wheelset", "standing", "irregular", "profiles", "material", "yield", "mesh",
    "solution", "verdict", "creep",
]
# fmt: on
LoadKind = Literal["vertical", "normal"]
Roll = Literal["touching", "given", "loaded"]
SolverChoice = Literal["auto", "pardiso", "amg"]
Refine = Literal["verdict", "never", "evidence"]

RESOLUTIONS = {"quick": 4.0, "standard": 9.0, "fine": 13.5}
"""Named resolutions: elements per semi-axis of the expected patch, in each direction."""
# With 16 the area of a patch with a thin tail is read to 0.7 % only.
NODES_A_SEMI_AXIS = 32
"""Nodes of the pressure on the narrowest semi-axis of the patch, of lobes too."""
# What these leave open must not hide what more elements bring.
_NODES_OF_MORE_ELEMENTS = 48

REFINED_UNKNOWNS = 400_000
"""Unknowns of the largest meshes of a refinement, some 40 CPU seconds and 3.4 GB: equal on every machine."""

INCLINATION_1_40 = math.atan(1.0 / 40.0)
# of a number that stands in every case in the end
_NOT_SAID: Any = None
_RAIL = "library name, profile file, circle:R, or arcs:R/R@D for two arcs whose junction is D from the crown; mm"
_WHEEL = "library name, profile file, or cylinder:R (flat); mm"
_OTHER = "of the other side of the wheelset, if it is another one"
_RADII = "railway wheels have 300 to 625 mm"
# Of a wheel whose radius nobody says.
_RADIUS_MM = 460.0


def _load(
    default: float | None,
    help: str,
    remedy: str = "give the wheel load, usually about 100 kN (100000 N)",
    **more: Any,
) -> Any:
    return number(default, help, shown_unit="kN", low=1.0, high=1e9, usual=(1e3, 1e6), remedy=remedy, **more)


def _angle(default: Any, help: str, remedy: str, **more: Any) -> Any:
    return number(default, help, shown_unit="mrad", low=-0.1, high=0.1, remedy=remedy, **more)


def _irregularity(help: str) -> Any:
    return custom(
        None,
        help,
        group="irregular",
        domain=FORMS,
        words=f"Irregularity(...); in files a text: {FORMS}",
        parse=irregularity_of,
        holds=lambda one: isinstance(one, Irregularity),
        show=irregularity_text,
    )


@inputs
class Opposite:
    """Rail, wheel, rolling radius and load of the other side of a wheelset; None where they are as on the case's side.

    The load counts for the roll of the loaded wheelset alone.
    """

    rail: str | None = text(None, f"Rail {_OTHER}", _RAIL, label="opposite rail")
    wheel: str | None = text(None, f"Wheel {_OTHER}", _WHEEL, label="opposite wheel")
    rolling_radius_mm: float | None = number(
        None, f"Rolling radius {_OTHER}", label="opposite rolling radius", usual=(100.0, 1000.0), remedy=_RADII
    )
    wheel_load_N: float | None = _load(
        None, f"Wheel load {_OTHER}", label="opposite load", key="load_kN", group="standing"
    )

    @property
    def is_mirror_image(self) -> bool:
        """Whether nothing is given but a load."""
        return replace(self, wheel_load_N=None) == Opposite()


_SIZE = Number(help="", label="element size", unit="mm", remedy="a tenth of the patch's semi-axis is a good size")


def _is_sizes(value: Any) -> bool:
    """Whether a value is two element sizes, or an attempt at them, and not a list of values."""
    return isinstance(value, list | tuple) and None not in map(as_number, value)


def _resolution_of(value: Any) -> Any:
    if isinstance(value, str) and "," in value:
        value = [number_or_text(one) for one in value.split(",")]
    return tuple(map(float, value)) if _is_sizes(value) else value


def _is_resolution(value: Any) -> bool:
    if not (_is_sizes(value) and len(value) == 2):
        return isinstance(value, str) and value in RESOLUTIONS
    for size in value:
        _SIZE.check(size)
    return True


@inputs
class Case:
    """One wheel-rail position under one load.

    What each field is, its unit and its range stand in its description; `fecontact solve --help-all` prints them all.
    `resolution` is what the solution begins with, and may be the element sizes (along x, across). `refine` says whether
    finer meshes follow, up to `REFINED_UNKNOWNS`.

    Shift, roll and yaw describe the wheelset in the frame of its left side, whichever `side` is solved: with equal
    profiles the right wheel is the left one with the opposite signs of all three.

    `roll` is one of three: "touching" (both unloaded wheels touch their rails), "given" (by `roll_rad`), "loaded" (both
    wheels are pressed into their rails, by the load of the case or `roll_load_N`, and by the load of `opposite` on the
    other side). If it is None, the given numbers decide; without numbers it is "touching", or "given" as 0 for lines
    that have no wheelset.
    """

    rail: str = text("60E1", "Rail", _RAIL, group="pair")
    wheel: str = text("S1002", "Wheel", _WHEEL, group="pair")
    inclination_rad: float = number(
        INCLINATION_1_40,
        "Inclination of the rail towards the track centre, none if the profile is canted already; circle:R has none",
        group="pair",
        key="inclination",
        shown_unit="mrad",
        low=-0.35,
        high=0.35,
        remedy="1:40 is 0.025 rad",
        parse=parse_inclination,
        show=inclination_text,
        forms=INCLINATION_FORMS,
    )
    lateral_shift_mm: float = number(
        0.0,
        "Lateral shift of the wheelset, positive towards the left rail",
        group="position",
        options=("shift", "lateral-shift-mm"),
        low=-60.0,
        high=60.0,
    )
    roll: Roll | None = choice(
        None,
        "Roll of the wheelset: that at which both wheels touch their rails, that with both pressed into them by the"
        " wheel loads, or a given one (0 for circles, cylinders and crane rails, which have no wheelset)",
        get_args(Roll),
        group="standing",
    )
    roll_rad: float = _angle(
        _NOT_SAID,
        "Roll of the wheelset about x where it is given, positive lifts the left wheel",
        "wheelsets roll by some mrad",
        label="roll angle",
        group="standing",
    )
    yaw_rad: float = _angle(0.0, "Yaw of the wheelset about z", "wheelsets yaw by some mrad, or tens", group="wheelset")
    roll_load_N: float | None = _load(
        None,
        "Wheel load under which the roll of the loaded wheelset is found, if it is another one than the load",
        "give the wheel load under which the wheelset rolls, for example 80000 N (80 kN)",
        group="standing",
    )
    flange_climb: bool = flag(
        "Let the flange climb: take contacts beyond its steepest place too, up to its top", group="wheelset"
    )
    side: TrackSide = choice(
        "left", "Wheel and rail of the wheelset that are solved", ("left", "right"), group="standing"
    )
    opposite: Opposite = part(Opposite, group="pair", option="opposite")
    load_N: float = _load(100e3, "Wheel load", group="load")
    load_kind: LoadKind = choice(
        "vertical",
        "Whether the load is vertical or acts along the contact normal at first touch",
        get_args(LoadKind),
        group="standing",
    )
    rail_material: Material = part(lambda: STEEL, group="material", body="rail", both=True)
    wheel_material: Material = part(lambda: STEEL, group="material", body="wheel", both=True)
    rolling_radius_mm: float = number(
        _NOT_SAID,
        "Rolling radius at the tape circle; if it is not given, the header of a MiniProf wheel file counts, if it has a"
        " diameter",
        usual=(100.0, 1000.0),
        group="wheelset",
        remedy=_RADII,
    )
    track: Track = part(Track, group="pair")
    size: BodySize = part(BodySize, group="mesh")
    resolution: str | tuple[float, float] = custom(
        "quick",
        f"Elements per semi-axis of the patch ({', '.join(f'{n:g}' for n in RESOLUTIONS.values())}), or their sizes"
        " along x and across: what the solution begins with",
        known=tuple(RESOLUTIONS),
        group="mesh",
        domain=f"{', '.join(RESOLUTIONS)}, or two element sizes in mm such as 0.5,0.4 (mm, finite and > 0)",
        parse=_resolution_of,
        holds=_is_resolution,
        show=lambda one: one if isinstance(one, str) else ",".join(f"{size:.12g}" for size in one),
        one_list=_is_sizes,
    )
    refine: Refine = choice(
        "verdict",
        "Finer meshes: until the verdict is known, never, or until the elements' own nodes know it by themselves;"
        f" up to {REFINED_UNKNOWNS} unknowns",
        get_args(Refine),
        group="solution",
    )
    solver: SolverChoice = choice("auto", "Linear solver", get_args(SolverChoice), group="solution")
    criteria: Criteria = part(Criteria, group="verdict")
    rail_file: Reading = part(Reading, group="profiles", body="rail")
    wheel_file: Reading = part(Reading, group="profiles", body="wheel")
    creep: Creep = part(Creep, group="creep")
    rail_irregularity: Irregularity | None = _irregularity(
        "Material that the rail misses along the track, opening the gap"
    )
    wheel_irregularity: Irregularity | None = _irregularity("Material that the wheel misses along its circumference")
    distance_mm: float = number(
        0.0,
        "Distance run along the irregularities to where smooth bodies touch",
        group="irregular",
        low=-1e7,
        high=1e7,
        remedy="give the place along the wave, the flat (its middle is 0) or the table",
    )
    library: str | None = text(
        None,
        "Library of your own, before the built-in one",
        "folder whose profile files rail and wheel may name",
        group="pair",
    )

    def __post_init__(self) -> None:
        if self.library is not None:
            from fecontact.profiles.library import in_folder

            # from here on they are files as any others, wherever the case goes
            object.__setattr__(self, "rail", in_folder(self.rail, self.library))
            object.__setattr__(self, "wheel", in_folder(self.wheel, self.library))
            rail, wheel = (one and in_folder(one, self.library) for one in (self.opposite.rail, self.opposite.wheel))
            object.__setattr__(self, "opposite", replace(self.opposite, rail=rail, wheel=wheel))
            object.__setattr__(self, "library", None)
        # the library takes time to import, and the usual profiles are in it
        for spec in (spec for spec in self.profiles.values() if spec not in (type(self).rail, type(self).wheel)):
            from fecontact.profiles.library import refuse_unknown

            refuse_unknown(spec)
        self._choose_radius()
        self._choose_roll()
        if self.roll == "loaded" and self.load_kind != "vertical" and self.roll_load_N is None:
            raise InputError(
                f"load kind is {self.load_kind!r}, but the roll of the loaded wheelset comes from vertical wheel loads;"
                " give load_kind = 'vertical', the wheel load as roll_load_kN, or another roll"
            )

    @property
    def is_radius_given(self) -> bool:
        """Whether the rolling radius is given, and does not follow from the wheel."""
        return not isinstance(self.rolling_radius_mm, _OfWheel)

    def _choose_radius(self) -> None:
        """Take the rolling radius from the wheel's file, or the usual one, where none is given."""
        radius: Any = self.rolling_radius_mm
        if radius is None or (isinstance(radius, _OfWheel) and radius.wheel != self.wheel):
            of_file = None
            if self.wheel != type(self).wheel:
                # the readers take time to import, and the usual wheel has no file
                from fecontact.profiles.resolve import radius_of_file_mm

                of_file = radius_of_file_mm(self.wheel)
            object.__setattr__(self, "rolling_radius_mm", _OfWheel(of_file or _RADIUS_MM, self.wheel))

    def _choose_roll(self) -> None:
        """Take the roll to which the numbers belong where none is said, and refuse numbers of another one."""
        if isinstance(self.roll, _OfPair):
            # of the case that this one was derived from, which may have another pair
            object.__setattr__(self, "roll", None)
            if self.roll_rad == 0.0:
                object.__setattr__(self, "roll_rad", None)
        loads = {"roll load": self.roll_load_N, "opposite load": self.opposite.wheel_load_N}
        numbers: dict[str, tuple[Roll, str]] = {
            name: ("loaded", f"{load_N / 1e3:g} kN") for name, load_N in loads.items() if load_N is not None
        }
        # a roll angle of 0 that stands there already is no contradiction: every case with another roll has it
        angle: Any = self.roll_rad
        if angle is not None and (angle != 0.0 or self.roll is None):
            numbers["roll angle"] = ("given", _angle_text(angle))
        if self.roll is None:
            without = _OfPair("touching" if makes_a_wheelset(self.rail, self.wheel) else "given")
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

    def __repr__(self) -> str:
        usual = type(self)()
        own = (entry.name for entry in fields(self) if getattr(self, entry.name) != getattr(usual, entry.name))
        given = dict.fromkeys(("rail", "wheel", "lateral_shift_mm", "load_N", *own))
        return f"Case({', '.join(f'{name}={getattr(self, name)!r}' for name in given)})"

    def _repr_html_(self) -> str:
        given = (slot for slot in INPUTS if slot.of(self) != slot.default or slot.place in _SHOWN)
        rows = {f"{slot.body} {slot.key}".strip(): {"": slot.input.shown(slot.of(self))} for slot in given}
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    @property
    def profiles(self) -> dict[str, str]:
        """Names or files of all profiles, by what they are."""
        other = {f"opposite_{name}": spec for name in ("rail", "wheel") if (spec := getattr(self.opposite, name))}
        return {"rail": self.rail, "wheel": self.wheel, **other}

    def with_profiles(self, specs: Mapping[str, str]) -> Case:
        """The case with other names or files of the same profiles; its rolling radius stays."""
        own: dict[str, Any] = {key: specs[key] for key in ("rail", "wheel") if key in specs}
        if not self.is_radius_given:
            own["rolling_radius_mm"] = _OfWheel(self.rolling_radius_mm, own.get("wheel", self.wheel))
        other: dict[str, Any] = {
            key: specs[f"opposite_{key}"] for key in ("rail", "wheel") if f"opposite_{key}" in specs
        }
        return replace(self, **own, opposite=replace(self.opposite, **other))

    @property
    def most_unknowns(self) -> int:
        """Unknowns up to which its meshes are refined."""
        return 0 if self.refine == "never" else REFINED_UNKNOWNS

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


class _OfPair(str):
    """A roll that nobody asked for: it follows from the pair, and in a case that is derived from another pair anew."""


class _OfWheel(float):
    """A rolling radius that nobody gave: it follows from the wheel, and from another wheel in a derived case."""

    wheel: str

    def __new__(cls, radius_mm: float, wheel: str = "") -> _OfWheel:
        made = super().__new__(cls, radius_mm)
        made.wheel = wheel
        return made


def _angle_text(roll_rad: float) -> str:
    return f"{1e3 * roll_rad:g} mrad"


def _refuse_other_roll(name: str, value: str, kind: Roll, roll: Roll | None) -> None:
    if kind != roll:
        raise InputError(f"{name} is {value}, but the roll is {roll!r}; leave it out, or give roll = {kind!r}")


_FILES = ("rail_file", "wheel_file")
_IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
INPUTS = slots(Case())
_SHOWN = tuple(("", name) for name in ("rail", "wheel", "lateral_shift_mm", "load_N"))
"""Every input of a case and of its parts."""
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
        if name in _IRREGULAR and not value:
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
    every = [*record, *(inner for name in PARTS for inner in record.get(name) or ())]
    if old := next(filter(None, map(renamed, every)), ""):
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
        for name in _IRREGULAR[:2]:
            if inputs.get(name) is not None:
                inputs[name] = Irregularity(**inputs[name])
        return Case(**inputs)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"case record: {error}; keys that exist: {', '.join(case_record(Case()))}") from error
