"""A case: all inputs of a result as plain values, each with its description.

The description of a field (range, help, group) stands beside the field; label and unit are in its name. Checks, study
files and the options of the command line are made from these descriptions. `Criteria`, `Track` and `BodySize` can be
imported from here too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields, replace
from html import escape
from typing import Any, Literal, get_args

from fecontact.bodies import ROLLING_RADIUS_MM, STEEL, Material, TrackSide, combine_moduli_MPa
from fecontact.bodies import BodySize as BodySize
from fecontact.bodies import Track as Track
from fecontact.criteria import Creep
from fecontact.criteria import Criteria as Criteria
from fecontact.errors import InputError
from fecontact.inputs.kinds import (
    Number,
    choice_field,
    custom_field,
    flag_field,
    number_field,
    parse_number_or_text,
    text_field,
    to_float,
)
from fecontact.inputs.slots import InputPlace, input_dataclass, list_input_places, nested_inputs
from fecontact.inputs.texts import INCLINATION_FORMS, explain_former_name, format_inclination, parse_inclination
from fecontact.own_criterion import restore_criterion
from fecontact.placement.irregularity import IRREGULARITY_FORMS, Irregularity, format_irregularity, read_irregularity
from fecontact.profiles.reading import Reading, can_form_wheelset

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
# With 16 nodes the area of a patch with a thin tail has an error of 0.7 %.
NODES_PER_SEMI_AXIS = 32
"""Nodes of the pressure on the narrowest semi-axis of the patch; lobes have at least this number too."""
# The error of the nodes must not hide the improvement by more elements.
_NODES_OF_MORE_ELEMENTS = 48

REFINED_UNKNOWNS = 400_000
"""Unknowns of the largest meshes of a refinement, about 40 CPU seconds and 3.4 GB; equal on every machine."""

_FILES = ("rail_file", "wheel_file")
INCLINATION_1_40 = math.atan(1.0 / 40.0)
# default of a number that `Case.__post_init__` fills in, so that every case has it
_FILLED_IN: Any = None
_RAIL = "library name, profile file, circle:R, or arcs:R/R@D (two arcs that meet D from the crown); R and D in mm"
_WHEEL = "library name, profile file, or cylinder:R (flat profile); R in mm"
_OTHER = "of the other side of the wheelset, if different"
_RADII = "railway wheels have 300 to 625 mm"
# Load of a case without a given load, and the usual load in remedies.
_LOAD_N = 100e3


def _load(
    default: float | None,
    help: str,
    remedy: str = f"give the wheel load, usually about {_LOAD_N / 1e3:g} kN ({_LOAD_N:.0f} N)",
    **options: Any,
) -> Any:
    return number_field(default, help, shown_unit="kN", low=1.0, high=1e9, usual=(1e3, 1e6), remedy=remedy, **options)


def _angle(default: Any, help: str, remedy: str, **options: Any) -> Any:
    return number_field(default, help, shown_unit="mrad", low=-0.1, high=0.1, remedy=remedy, **options)


def _irregularity(help: str) -> Any:
    """Describe an irregularity as an input, which files give as a text."""
    return custom_field(
        None,
        help,
        group="irregular",
        domain=IRREGULARITY_FORMS,
        words=f"Irregularity(...); in files a text: {IRREGULARITY_FORMS}",
        parse=read_irregularity,
        holds=lambda value: isinstance(value, Irregularity),
        show=format_irregularity,
    )


@input_dataclass
class Opposite:
    """Inputs of the other side of a wheelset; None for inputs that are equal to the side of the case.

    The load is used only for the roll of the loaded wheelset.

    Attributes
    ----------
    rail, wheel
        Profiles of the other side, by name or file.
    rolling_radius_mm
        Rolling radius of the other wheel, in mm.
    wheel_load_N
        Vertical load of the other wheel, in N.
    rail_file, wheel_file
        Options for the files `rail` and `wheel` of the other side; None for the options of the case. Only Python and
        fleets have them.

    Examples
    --------
    >>> import fecontact
    >>> fecontact.Opposite(wheel_load_N=90e3).is_mirror_image
    True
    >>> fecontact.Opposite(rolling_radius_mm=459.0).is_mirror_image
    False
    """

    rail: str | None = text_field(None, f"Rail {_OTHER}", _RAIL, label="opposite rail")
    wheel: str | None = text_field(None, f"Wheel {_OTHER}", _WHEEL, label="opposite wheel")
    rolling_radius_mm: float | None = number_field(
        None, f"Rolling radius {_OTHER}", label="opposite rolling radius", usual=(100.0, 1000.0), remedy=_RADII
    )
    wheel_load_N: float | None = _load(
        None, f"Wheel load {_OTHER}", label="opposite load", key="load_kN", group="standing"
    )
    rail_file: Reading | None = None
    wheel_file: Reading | None = None

    def __post_init__(self) -> None:
        """Refuse options of a file that is not given."""
        for name, body in zip(_FILES, ("rail", "wheel"), strict=True):
            reading = getattr(self, name)
            if reading is not None and not isinstance(reading, Reading):
                raise InputError(f"{name} of the other side is {reading!r}; allowed: None, or a Reading(...)")
            if reading is not None and getattr(self, body) is None:
                raise InputError(
                    f"{name} of the other side is given without its {body}; give the file as {body}, or leave out"
                    f" {name}"
                )

    @property
    def is_mirror_image(self) -> bool:
        """Whether the other side has no input except a load."""
        return replace(self, wheel_load_N=None) == Opposite()


_SIZE = Number(help="", label="element size", unit="mm", remedy="a tenth of the patch's semi-axis is a good size")


def _is_sizes(value: Any) -> bool:
    """Whether a value is meant as a pair of element sizes, not as a list of values."""
    return isinstance(value, list | tuple) and None not in map(to_float, value)


def _parse_resolution(value: Any) -> Any:
    if isinstance(value, str) and "," in value:
        value = [parse_number_or_text(size) for size in value.split(",")]
    return tuple(map(float, value)) if _is_sizes(value) else value


def _is_resolution(value: Any) -> bool:
    if not (_is_sizes(value) and len(value) == 2):
        return isinstance(value, str) and value in RESOLUTIONS
    for size in value:
        _SIZE.check(size)
    return True


@input_dataclass
class Case:
    """Position of a wheel on a rail under a load.

    The description of each field has its unit and its range; `fecontact solve --help-all` prints all of them.

    Attributes
    ----------
    resolution
        Resolution of the first meshes, by name or as the element sizes (along x, across) in mm.
    refine
        Whether finer meshes follow, up to `REFINED_UNKNOWNS`.
    lateral_shift_mm, roll, yaw_rad
        Position of the wheelset in the frame of its left side, for either `side`: with equal profiles the right wheel
        is the left wheel with the opposite signs of shift, roll and yaw.
    roll
        "touching" (both unloaded wheels touch their rails), "given" (by `roll_rad`), or "loaded" (both wheels are
        pressed into their rails, by the load of the case or `roll_load_N`, and by the load of `opposite` on the other
        side). If `roll` is None, the given numbers decide; without numbers it is "touching", or "given" as 0 for
        profiles that have no wheelset.

    Examples
    --------
    >>> from fecontact.case import Case
    >>> Case(lateral_shift_mm=4.0).roll_loads_N()
    {'left': 100000.0, 'right': 100000.0}
    """

    rail: str = text_field("60E1", "Rail", _RAIL, group="pair")
    wheel: str = text_field("S1002", "Wheel", _WHEEL, group="pair")
    inclination_rad: float = number_field(
        INCLINATION_1_40,
        "Rail inclination towards the track centre; none if the profile is already inclined; not used for circle:R",
        group="pair",
        key="inclination",
        shown_unit="mrad",
        low=-0.35,
        high=0.35,
        remedy="1:40 is 0.025 rad",
        parse=parse_inclination,
        show=format_inclination,
        forms=INCLINATION_FORMS,
    )
    lateral_shift_mm: float = number_field(
        0.0,
        "Lateral shift of the wheelset, positive towards the left rail",
        group="position",
        options=("shift", "lateral-shift-mm"),
        low=-60.0,
        high=60.0,
    )
    roll: Roll | None = choice_field(
        None,
        "Roll of the wheelset: touching (both unloaded wheels touch their rails), loaded (the wheel loads press both"
        " wheels into their rails), or given (0 for circles, cylinders and crane rails, which have no wheelset)",
        get_args(Roll),
        group="standing",
    )
    roll_rad: float = _angle(
        _FILLED_IN,
        "Roll angle of the wheelset about x, if the roll is given; a positive angle lifts the left wheel",
        "wheelsets roll by a few mrad",
        label="roll angle",
        group="standing",
    )
    yaw_rad: float = _angle(
        0.0, "Yaw of the wheelset about z", "wheelsets yaw by a few mrad to some 10 mrad", group="wheelset"
    )
    roll_load_N: float | None = _load(
        None,
        "Wheel load for the roll of the loaded wheelset, if different from the load of the case",
        "give the wheel load that sets the roll, for example 80000 N (80 kN)",
        group="standing",
    )
    flange_climb: bool = flag_field(
        "Allow contact on the flange beyond its steepest point, up to its tip (flange climbing)", group="wheelset"
    )
    side: TrackSide = choice_field("left", "Side of the wheelset to solve", ("left", "right"), group="standing")
    opposite: Opposite = nested_inputs(Opposite, group="pair", option="opposite")
    load_N: float = _load(_LOAD_N, "Wheel load", group="load")
    load_kind: LoadKind = choice_field(
        "vertical",
        "Direction of the load: vertical, or along the normal at the first contact point",
        get_args(LoadKind),
        group="standing",
    )
    rail_material: Material = nested_inputs(lambda: STEEL, group="material", body="rail", both=True)
    wheel_material: Material = nested_inputs(lambda: STEEL, group="material", body="wheel", both=True)
    rolling_radius_mm: float = number_field(
        _FILLED_IN,
        "Rolling radius at the tape circle; if not given, half of the diameter in the header of a MiniProf wheel file,"
        " if there is one",
        usual=(100.0, 1000.0),
        group="wheelset",
        remedy=_RADII,
    )
    track: Track = nested_inputs(Track, group="pair")
    size: BodySize = nested_inputs(BodySize, group="mesh")
    resolution: str | tuple[float, float] = custom_field(
        "quick",
        f"First meshes: elements per semi-axis of the patch ({', '.join(f'{n:g}' for n in RESOLUTIONS.values())}), or"
        " element sizes along x and across",
        known=tuple(RESOLUTIONS),
        group="mesh",
        domain=f"{', '.join(RESOLUTIONS)}, or two element sizes in mm such as 0.5,0.4 (mm, finite and > 0)",
        parse=_parse_resolution,
        holds=_is_resolution,
        show=lambda resolution: (
            resolution if isinstance(resolution, str) else ",".join(f"{size:.12g}" for size in resolution)
        ),
        one_list=_is_sizes,
    )
    refine: Refine = choice_field(
        "verdict",
        "Finer meshes: until the verdict is resolved (verdict), never, or until the verdict on the nodes of the"
        f" elements is resolved too (evidence); at most {REFINED_UNKNOWNS} unknowns",
        get_args(Refine),
        group="solution",
    )
    solver: SolverChoice = choice_field("auto", "Linear solver", get_args(SolverChoice), group="solution")
    criteria: Criteria = nested_inputs(Criteria, group="verdict")
    rail_file: Reading = nested_inputs(Reading, group="profiles", body="rail")
    wheel_file: Reading = nested_inputs(Reading, group="profiles", body="wheel")
    creep: Creep = nested_inputs(Creep, group="creep")
    rail_irregularity: Irregularity | None = _irregularity(
        "Missing material of the rail along the track; positive values open the gap"
    )
    wheel_irregularity: Irregularity | None = _irregularity(
        "Missing material of the wheel along its circumference; positive values open the gap"
    )
    distance_mm: float = number_field(
        0.0,
        "Position of the contact point of the smooth bodies along the irregularities",
        group="irregular",
        low=-1e7,
        high=1e7,
        remedy="give the position along the wave, the flat (0 is its middle) or the table",
    )
    library: str | None = text_field(
        None,
        "Your library of profiles; it is searched before the built-in library",
        "folder of profile files; rail and wheel are names of its files",
        group="pair",
    )

    def __post_init__(self) -> None:
        """Fill in the radius, the roll and the paths of profiles, and refuse contradictions."""
        if self.library is not None:
            from fecontact.profiles.library import find_in_folder

            # after this, profiles of the library are files like all others, also if the case moves to another process
            object.__setattr__(self, "rail", find_in_folder(self.rail, self.library))
            object.__setattr__(self, "wheel", find_in_folder(self.wheel, self.library))
            rail, wheel = (
                file_or_name and find_in_folder(file_or_name, self.library)
                for file_or_name in (self.opposite.rail, self.opposite.wheel)
            )
            object.__setattr__(self, "opposite", replace(self.opposite, rail=rail, wheel=wheel))
            object.__setattr__(self, "library", None)
        # the import of the library takes time, and the default profiles need no check
        for body, spec in self.profiles.items():
            if spec not in (type(self).rail, type(self).wheel):
                from fecontact.profiles.library import refuse_unknown_profile

                refuse_unknown_profile(spec, "rail" if body.endswith("rail") else "wheel")
        self._choose_radius()
        self._choose_roll()
        if self.roll == "loaded" and self.load_kind != "vertical" and self.roll_load_N is None:
            raise InputError(
                f"load kind is {self.load_kind!r}, but the roll of the loaded wheelset needs vertical wheel loads;"
                " give load_kind = 'vertical', the wheel load as roll_load_kN, or a different roll"
            )

    @property
    def is_radius_given(self) -> bool:
        """Whether the rolling radius is given, and does not follow from the wheel."""
        return not isinstance(self.rolling_radius_mm, _WheelRadius)

    def _choose_radius(self) -> None:
        """Take a missing rolling radius from the wheel's file, or else the default."""
        radius: Any = self.rolling_radius_mm
        if radius is None or (isinstance(radius, _WheelRadius) and radius.wheel != self.wheel):
            file_radius_mm = None
            if self.wheel != type(self).wheel:
                # the import of the readers takes time, and the default wheel has no file
                from fecontact.profiles.resolve import radius_of_file_mm

                file_radius_mm = radius_of_file_mm(self.wheel)
            object.__setattr__(self, "rolling_radius_mm", _WheelRadius(file_radius_mm or ROLLING_RADIUS_MM, self.wheel))

    def _choose_roll(self) -> None:
        """Choose the kind of roll from the given numbers, and refuse numbers of another kind."""
        if isinstance(self.roll, _DefaultRoll):
            # the roll is a default of the case from which this case was derived, and that case may have another pair
            object.__setattr__(self, "roll", None)
            if self.roll_rad == 0.0:
                object.__setattr__(self, "roll_rad", None)
        loads = {"roll load": self.roll_load_N, "opposite load": self.opposite.wheel_load_N}
        numbers: dict[str, tuple[Roll, str]] = {
            name: ("loaded", f"{load_N / 1e3:g} kN") for name, load_N in loads.items() if load_N is not None
        }
        # a roll angle of 0 is no contradiction: every case with another kind of roll has it
        angle: Any = self.roll_rad
        if angle is not None and (angle != 0.0 or self.roll is None):
            numbers["roll angle"] = ("given", _format_angle(angle))
        if self.roll is None:
            default_roll = _DefaultRoll("touching" if can_form_wheelset(self.rail, self.wheel) else "given")
            object.__setattr__(self, "roll", next((kind for kind, _ in numbers.values()), default_roll))
        if angle is None:
            object.__setattr__(self, "roll_rad", 0.0)
        for name, (kind, value) in numbers.items():
            _refuse_conflicting_roll(name, value, kind, self.roll)

    def roll_loads_N(self) -> dict[TrackSide, float]:
        """Vertical loads in N of both wheels, for the roll of a loaded wheelset.

        Returns
        -------
        dict
            Load in N of the left wheel and of the right wheel.
        """
        load_N = self.load_N if self.roll_load_N is None else self.roll_load_N
        opposite_load_N = load_N if self.opposite.wheel_load_N is None else self.opposite.wheel_load_N
        return (
            {"left": load_N, "right": opposite_load_N}
            if self.side == "left"
            else {"left": opposite_load_N, "right": load_N}
        )

    def __repr__(self) -> str:
        """Text with the pair, the shift, the load and all inputs that differ from their defaults."""
        usual = type(self)()
        changed_names = (
            case_field.name
            for case_field in fields(self)
            if getattr(self, case_field.name) != getattr(usual, case_field.name)
        )
        shown_names = dict.fromkeys(("rail", "wheel", "lateral_shift_mm", "load_N", *changed_names))
        return f"Case({', '.join(f'{name}={getattr(self, name)!r}' for name in shown_names)})"

    def _repr_html_(self) -> str:
        shown_slots = (slot for slot in INPUTS if slot.of(self) != slot.default or slot.place in _SHOWN)
        rows = {f"{slot.body} {slot.key}".strip(): {"": slot.input.shown(slot.of(self))} for slot in shown_slots}
        import pandas

        return f"<p>{escape(repr(self))}</p>{pandas.DataFrame.from_dict(rows, orient='index').to_html()}"

    @property
    def profiles(self) -> dict[str, str]:
        """Names or files of all profiles, by their keys (`rail`, `wheel`, `opposite_rail`, `opposite_wheel`)."""
        opposite_profiles = {
            f"opposite_{name}": spec for name in ("rail", "wheel") if (spec := getattr(self.opposite, name))
        }
        return {"rail": self.rail, "wheel": self.wheel, **opposite_profiles}

    def with_profiles(self, specs: Mapping[str, str]) -> Case:
        """Replace the names or files of the profiles; the rolling radius stays.

        Parameters
        ----------
        specs
            Names or files by the keys of `profiles`; a missing key keeps its profile.

        Returns
        -------
        Case
            The case with these names or files; they must have the same content as before.
        """
        changes: dict[str, Any] = {key: specs[key] for key in ("rail", "wheel") if key in specs}
        if not self.is_radius_given:
            changes["rolling_radius_mm"] = _WheelRadius(self.rolling_radius_mm, changes.get("wheel", self.wheel))
        opposite_changes: dict[str, Any] = {
            key: specs[f"opposite_{key}"] for key in ("rail", "wheel") if f"opposite_{key}" in specs
        }
        return replace(self, **changes, opposite=replace(self.opposite, **opposite_changes))

    @property
    def most_unknowns(self) -> int:
        """Largest number of unknowns in a refinement; 0 without refinement."""
        return 0 if self.refine == "never" else REFINED_UNKNOWNS

    @property
    def contact_modulus_MPa(self) -> float:
        """Contact modulus E* of wheel and rail, in MPa."""
        return combine_moduli_MPa(self.rail_material, self.wheel_material)

    @property
    def nodes_per_semi_axis(self) -> int:
        """Nodes of the pressure on the narrowest semi-axis, for any shape of the elements."""
        return _NODES_OF_MORE_ELEMENTS if self.resolution in ("standard", "fine") else NODES_PER_SEMI_AXIS

    @property
    def may_yield(self) -> bool:
        """Whether rail or wheel has a yield stress."""
        return any(body.yield_MPa is not None for body in (self.rail_material, self.wheel_material))

    @property
    def half(self) -> bool:
        """Whether x = 0 is a plane of symmetry."""
        return self.yaw_rad == 0.0 and not self.irregularities

    @property
    def irregularities(self) -> tuple[Irregularity, ...]:
        """Irregularities of rail and wheel along the track."""
        return tuple(
            irregularity
            for irregularity in (self.rail_irregularity, self.wheel_irregularity)
            if irregularity is not None
        )


class _DefaultRoll(str):
    """Default kind of roll; it follows from the pair, and is chosen again for another pair."""


class _WheelRadius(float):
    """Default rolling radius in mm; it follows from the wheel, and is chosen again for another wheel.

    Attributes
    ----------
    wheel
        Name or file of the wheel to which the radius belongs.
    """

    wheel: str

    def __new__(cls, radius_mm: float, wheel: str = "") -> _WheelRadius:
        radius = super().__new__(cls, radius_mm)
        radius.wheel = wheel
        return radius


def _format_angle(roll_rad: float) -> str:
    return f"{1e3 * roll_rad:g} mrad"


def _refuse_conflicting_roll(name: str, value: str, kind: Roll, roll: Roll | None) -> None:
    if kind != roll:
        raise InputError(f"{name} is {value}, but the roll is {roll!r}; leave out the {name}, or give roll = {kind!r}")


_IRREGULAR = ("rail_irregularity", "wheel_irregularity", "distance_mm")
INPUTS = list_input_places(Case())
_SHOWN = tuple(("", name) for name in ("rail", "wheel", "lateral_shift_mm", "load_N"))
"""Inputs that the representation of a case always shows; `INPUTS` has every input of a case and of its parts."""
PARTS = {
    case_field.name: type(getattr(Case(), case_field.name))
    for case_field in fields(Case)
    if "part" in case_field.metadata
}
"""Fields of a case that have fields themselves, with their classes."""


def make_case(values: Mapping[InputPlace, Any]) -> Case:
    """Make a case from values in internal units; all other inputs have their defaults.

    Parameters
    ----------
    values
        Values by their inputs. A roll angle in it counts as given, also if it is zero.

    Returns
    -------
    Case
        The case.

    Raises
    ------
    InputError
        If a value is outside its range.
    """
    changes_by_table: dict[str, dict[str, Any]] = {}
    for slot, value in values.items():
        changes_by_table.setdefault(slot.table, {})[slot.field] = value
    case_fields = changes_by_table.pop("", {})
    if "roll_rad" in case_fields:
        _refuse_conflicting_roll(
            "roll angle", _format_angle(case_fields["roll_rad"]), "given", case_fields.setdefault("roll", "given")
        )
    return Case(
        **case_fields,
        **{table: replace(getattr(Case(), table), **changes) for table, changes in changes_by_table.items()},
    )


def describe_unusual_inputs(cases: Iterable[Case]) -> tuple[str, ...]:
    """Describe unusual inputs of some cases, which are allowed but are often a wrong unit.

    Parameters
    ----------
    cases
        Cases to look at.

    Returns
    -------
    tuple of str
        Sentences, each once.
    """
    notes = (
        slot.input.note(value)
        for case in cases
        for slot in INPUTS
        if isinstance(slot.input, Number) and (value := slot.of(case)) is not None
    )
    return tuple(dict.fromkeys(filter(None, notes)))


def make_case_record(case: Case) -> dict[str, Any]:
    """Record of all inputs of a case, for a file.

    Either `resolution` or `element_size_mm` (along x, across) is None. Settings for reading the profile files are
    included if they differ from the defaults, and irregularities and criteria of a user if there are any.

    Parameters
    ----------
    case
        The case.

    Returns
    -------
    dict
        Inputs by the names of the fields.
    """
    record: dict[str, Any] = {}
    for name, value in asdict(case).items():
        if name == "library" or (name in _FILES and getattr(case, name) == Reading()):
            continue
        # records of smooth bodies have the layout of the time before irregularities
        if name in _IRREGULAR and not value:
            continue
        record[name] = value
        if name == "criteria":
            record[name] = case.criteria.record
        if name == "opposite":
            record[name] = {key: inner for key, inner in value.items() if key not in _FILES or inner is not None}
        if name == "resolution":
            is_named = isinstance(value, str)
            record[name], record["element_size_mm"] = (value, None) if is_named else (None, list(value))
    return record


def read_case_record(record: Mapping[str, Any]) -> Case:
    """Make a case from its record; a missing key has the default of the case.

    Parameters
    ----------
    record
        Inputs by key, as from `make_case_record`.

    Returns
    -------
    Case
        The case.

    Raises
    ------
    InputError
        If a key or a value is not allowed in a case.
    """
    record_keys = [*record, *(key for name in PARTS for key in record.get(name) or ())]
    if advice := next(filter(None, map(explain_former_name, record_keys)), ""):
        raise InputError(f"case record: {advice}; solve the case again")
    inputs = dict(record)
    sizes = inputs.pop("element_size_mm", None)
    if inputs.get("resolution") is None:
        inputs.pop("resolution", None)
    try:
        if sizes is not None:
            along_x, across = sizes
            inputs["resolution"] = (float(along_x), float(across))
        if isinstance(opposite := inputs.get("opposite"), Mapping):
            readings = {name: Reading(**opposite[name]) for name in _FILES if opposite.get(name) is not None}
            inputs["opposite"] = {**opposite, **readings}
        if isinstance(criteria := inputs.get("criteria"), Mapping) and criteria.get("own"):
            own_criteria = tuple(restore_criterion(own_record) for own_record in criteria["own"])
            inputs["criteria"] = {**criteria, "own": own_criteria}
        for name in PARTS.keys() & inputs:
            inputs[name] = PARTS[name](**inputs[name])
        for name in _IRREGULAR[:2]:
            if inputs.get(name) is not None:
                inputs[name] = Irregularity(**inputs[name])
        return Case(**inputs)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"case record: {error}; allowed keys: {', '.join(make_case_record(Case()))}") from error
