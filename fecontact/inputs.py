"""Inputs: described where their fields stand, with unit and range; their texts, and classes that check them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from difflib import get_close_matches
from functools import wraps
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar, dataclass_transform

from fecontact.errors import EXTREME, LARGEST, SMALLEST, InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_MOST_NUMBERS = 1000
INCLINATION_FORMS = "1:N such as 1:40, none, or an angle with its unit such as 25mrad or 1.43deg"


def parse_inclination(text: str) -> float:
    """Rail inclination in rad from `1:40`, `none`, or an angle with its unit such as `25mrad` or `1.43deg`."""
    text = text.strip().lower()
    if text in ("none", "0"):
        return 0.0
    if match := re.fullmatch(rf"1:({_NUMBER})", text):
        ratio = float(match[1])
        if ratio != 0.0:
            return math.atan(1.0 / ratio)
    if match := re.fullmatch(rf"({_NUMBER})\s*(mrad|rad|deg)", text):
        return float(match[1]) * {"mrad": 1e-3, "rad": 1.0, "deg": math.pi / 180.0}[match[2]]
    raise InputError(f"inclination {text!r}: allowed are {INCLINATION_FORMS}")


def inclination_text(inclination_rad: float) -> str:
    """The shortest text from which `parse_inclination` makes this angle."""
    if inclination_rad == 0.0:
        return "none"
    ratio = f"1:{1.0 / math.tan(inclination_rad):.12g}"
    return ratio if parse_inclination(ratio) == inclination_rad else f"{inclination_rad!r}rad"


def parse_numbers(text: str, name: str) -> tuple[float, ...]:
    """Numbers from a comma list whose items are numbers or ranges a:b:step (both ends included), such as -6:6:0.5,8."""
    found: list[float] = []
    for item in text.split(","):
        if re.fullmatch(rf"{_NUMBER}(:{_NUMBER}:{_NUMBER})?", item.strip()) is None:
            raise InputError(f"{name} {text!r}: {item!r} is neither a number nor a range FROM:TO:STEP such as -6:6:0.5")
        parts = [float(part) for part in item.split(":")]
        found += parts if len(parts) == 1 else _range(parts[0], parts[1], parts[2], f"{name} {text!r}")
    return tuple(dict.fromkeys(found))


def listed(values: Sequence[float], name: str) -> tuple[float, ...]:
    """Numbers of a list; a single number, which a caller in Python may give in its place, is refused."""
    if isinstance(values, Real):
        raise InputError(f"{name} is {values}; give a list, for example [{values}]")
    return tuple(map(float, values))


def _range(first: float, last: float, step: float, what: str) -> list[float]:
    if not step > 0.0 or last < first:
        raise InputError(f"{what}: a range goes up, with a step above zero, such as -6:6:0.5")
    # a millionth of a step for ends that are no sums of the step in binary
    steps = (last - first) / step + 1e-6
    if not steps < _MOST_NUMBERS:
        raise InputError(f"{what}: {steps + 1.0:.6g} values; allowed are {_MOST_NUMBERS}; take a larger step")
    return [round(first + step * k, 9) for k in range(math.floor(steps) + 1)]


def nearest(name: str, known: Mapping[str, str]) -> str:
    """What a misspelt name may have meant, as the end of a message: of the known spellings the nearest, or nothing.

    Parameters
    ----------
    known
        For each spelling the name to propose.
    """
    lower = {spelling.lower(): proposal for spelling, proposal in known.items()}
    found = get_close_matches(name.lower(), lower, n=1, cutoff=0.6)
    return f"; did you mean {lower[found[0]]}?" if found else ""


def renamed(name: str) -> str:
    """What stands for an input that was another one once, in words; nothing for any other name."""
    return f"{name}: there is no such input any more; {RENAMED[name]}" if name in RENAMED else ""


_OF_PROFILES = {
    "smoothing_mm": "the wave length of which smoothing leaves half is filter_mm, 0 for points as exact",
    "flip_z": "a minus sign turns a column: columns = '1,-2'",
    "decimal": "decimal commas are recognised; where they are not, write points",
    "offsets": "offsets of a MiniProf header are added, its alignment is not, and the notes say so",
}
_FINER = "finer elements are asked for by refine = 'verdict' (the default), 'never' or 'evidence'"
_OPPOSITE = "--opposite rail=...,wheel=...,rolling-radius-mm=...,load-kn=... has it, in files the table [opposite]"
_HALF_LENGTH = "rail and rim have one half_length_mm"
_NO_NAME = "a material has no name any more; leave it out"
RENAMED = {
    **dict.fromkeys(("html", "png"), "compare --out FOLDER writes comparison.json, comparison.html and comparison.png"),
    "wheelset": "the roll at which both wheels touch is roll = 'touching', a fixed one roll = 'given'",
    "roll_under_load": "the roll of the loaded wheelset is roll = 'loaded'",
    **dict.fromkeys(("refine_degrees_of_freedom", "evidence"), _FINER),
    **dict.fromkeys(("rail_half_length_mm", "rim_half_length_mm"), _HALF_LENGTH),
    **{
        f"opposite_{name}": _OPPOSITE for name in ("rail", "wheel", "rolling_radius_mm", "load_kN", "load_kn", "load_N")
    },
    **dict.fromkeys(("name", "material_name", "rail_material_name", "wheel_material_name"), _NO_NAME),
    **{f"{body}{name}": text for name, text in _OF_PROFILES.items() for body in ("", "rail_", "wheel_")},
}
"""Names of inputs from before the first release, with what to write instead; CHANGELOG.md lists them."""


# --- What an input may be: a number within a range, or a value that one function reads and another one knows.
#
# An input reads a value as a user writes it, checks a value as the program holds it, and says what it allows. The first
# message is for a value that cannot be understood, the second for one that is understood and lies outside the range.

_TRUTH = {"yes": True, "true": True, "no": False, "false": False}


# What users give a number in, times what it is inside the program.
_FACTORS = {"mrad": 1e3, "kN": 1e-3, "%": 100.0}
# how names of fields end, the longer ends first
_UNITS = {
    **{"Ns_per_m": "N s/m", "Nm_per_rad": "N m/rad", "N_per_m": "N/m", "per_mm": "1/mm", "kg_m2": "kg m2"},
    **{"m_s2": "m/s2", "km_h": "km/h", "kN": "kN", "kg": "kg", "MPa": "MPa", "mm": "mm", "rad": "rad"},
    **{"N": "N", "m": "m"},
}


def _same(value: Any) -> Any:
    return value


@dataclass(frozen=True, kw_only=True)
class Input:
    """What a field is; what is not given of label, unit and key says the name of the field.

    Attributes
    ----------
    label, help, remedy
        Name in messages; what it is; what to do about a value outside the range.
    group
        Where it belongs: commands take groups.
    key, options
        Key in files, if it is not the field's name; names on the command line (without hyphens), if they are not made
        from the key.
    domain, words
        What is allowed; as messages say it, if in other words.
    known
        Names of which one may have been meant.
    parse, holds, show
        The value from what a user wrote; whether a value is one; how a user would write it.
    each
        Whether the value is several of them, in texts with commas between.
    one_list
        Whether a list is one value, and not a list of values.
    alone
        Whether its option says yes by itself on the command line, without a word behind it.
    """

    label: str = ""
    help: str
    remedy: str = ""
    group: str = ""
    key: str = ""
    options: tuple[str, ...] = ()
    domain: str = ""
    words: str = ""
    known: Sequence[str] = ()
    parse: Callable[[Any], Any] = _same
    holds: Callable[[Any], bool] = bool
    show: Callable[[Any], str] = str
    each: bool = False
    one_list: Callable[[Any], bool] = lambda _: False
    alone: bool = False

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.words or self.domain

    def shown(self, value: Any) -> str:
        """A value as a user would write it."""
        return ",".join(map(self.show, value)) if self.each else self.show(value)

    def refusal(self, value: Any) -> InputError:
        """Of a value that is none; of known names it has the nearest one."""
        meant = nearest(value, {name: name for name in self.known}) if isinstance(value, str) else ""
        return InputError(f"{self.label} is {value!r}; allowed: {self.allowed}{meant}")

    def read(self, value: Any) -> Any:
        """The value as the program holds it, from what a user wrote.

        Raises
        ------
        InputError
            If it is none.
        """
        several = self.each and isinstance(value, str)
        found = tuple(part.strip() for part in value.split(",")) if several else self.parse(value)
        self.check(found)
        return found

    def read_word(self, word: str) -> Any:
        """The value of a word of the command line."""
        return self.read(word)

    def check(self, value: Any) -> None:
        """Refuse what is none.

        Raises
        ------
        InputError
            With the value, what is allowed, and the name that may have been meant.
        """
        if self.each and not (isinstance(value, list | tuple) and value):
            raise self.refusal(value)
        for one in value if self.each else (value,):
            if not self.holds(one):
                raise self.refusal(one)

    def of_field(self, name: str) -> Input:
        """With the label that the name of its field says, where none is given."""
        return replace(self, label=self.label or name.replace("_", " "))


@dataclass(frozen=True, kw_only=True)
class Number(Input):
    """A number with its unit and range.

    Attributes
    ----------
    unit, shown_unit
        Unit inside the program; unit in which users give it, if it is another.
    low, high, inclusive
        Bounds in the unit inside; without `high`, `low` is 0 and everything above it is allowed.
    symbol
        Sign for the number in an exclusive range.
    usual
        Between which bounds it is not worth a note, in the unit inside.
    forms
        Of a number that is written as a text, what is allowed: `parse` and `show` are of that text.
    """

    unit: str = ""
    shown_unit: str = ""
    low: float = 0.0
    high: float = math.inf
    inclusive: bool = True
    symbol: str = ""
    usual: tuple[float, float] = (-math.inf, math.inf)
    forms: str = ""

    def of_field(self, name: str) -> Number:
        """With label, unit and key that the name of its field says, where none are given."""
        suffix = next((one for one in _UNITS if name.endswith(f"_{one}")), "")
        stem = name.removesuffix(f"_{suffix}")
        return replace(
            self,
            label=self.label or stem.replace("_", " "),
            unit=self.unit or _UNITS.get(suffix, ""),
            key=self.key or (f"{stem}_{self.shown_unit}" if self.shown_unit else ""),
            domain=f"{self.forms}; " * bool(self.forms)
            + f"{self.shown_unit or self.unit or _UNITS.get(suffix, 'no unit')}, {self._range(self.factor)}",
        )

    @property
    def factor(self) -> float:
        """By how much the value that users give is larger."""
        return _FACTORS.get(self.shown_unit, 1.0)

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.domain if self.forms else f"a number ({self.domain})"

    def shown(self, value: float) -> str:
        """A value as a user would write it."""
        return self.show(value) if self.forms else f"{value * self.factor:.12g}"

    def note(self, value: float) -> str:
        """What is said of a value that is allowed and not usual, empty for all others."""
        low, high = self.usual
        if low <= value <= high:
            return ""
        given, bounds = self.shown(value), f"{low * self.factor:g} to {high * self.factor:g}"
        return f"{self.label} is {given} {self._outside_unit}; usual are {bounds}: {self.remedy}"

    def read(self, value: Any) -> float:
        """The number in the unit inside, from what a user wrote in the unit outside.

        Raises
        ------
        InputError
            If it is none.
        """
        if self.forms and isinstance(value, str):
            return float(self.parse(value))
        number = None if self.forms else as_number(value)
        if number is None:
            raise self.refusal(value)
        # with whole numbers, so that 9 mrad is 0.009 rad to the last bit
        return number * round(1.0 / self.factor) if self.factor < 1.0 else number / self.factor

    def read_word(self, word: str) -> float:
        """The number of a word of the command line."""
        return self.read(word if self.forms else number_or_text(word))

    def check(self, value: Any) -> None:
        """Refuse what is outside the range.

        Raises
        ------
        InputError
            With value, unit, allowed range and remedy.
        """
        number = as_number(value)
        if number is not None and self._within(number):
            return
        given = f"{float(value)!r}" if isinstance(value, float) else f"{value!r}"
        outside = self._outside_unit if self._outside_unit != self.unit else ""
        text = f"{self.label} is {' '.join(filter(None, (given, self.unit)))}"
        if number is not None and outside:
            text += f" ({number * self.factor:g} {outside})"
        if number is not None and math.isinf(self.high) and self.low < number < math.inf:
            raise InputError("; ".join(filter(None, (text, EXTREME, self.remedy))))
        allowed = self._range(1.0) + (f" {self.unit}" if math.isfinite(self.high) and self.unit else "")
        if outside and math.isfinite(self.high):
            allowed += f" ({self._range(self.factor)} {outside})"
        raise InputError("; ".join(filter(None, (text, f"allowed: {allowed}", self.remedy))))

    @property
    def _outside_unit(self) -> str:
        return self.shown_unit or self.unit

    def _within(self, number: float) -> bool:
        if not math.isfinite(number):
            return False
        if self.inclusive and math.isfinite(self.high):
            return self.low <= number <= self.high
        # without a largest one: what is not so large that nothing can be computed with it
        return self.low < number < self.high and (math.isfinite(self.high) or SMALLEST <= number <= LARGEST)

    def _range(self, factor: float) -> str:
        low, high = self.low * factor, self.high * factor
        if not math.isfinite(high):
            return f"finite and > {low:g}"
        if self.inclusive:
            return f"{low:.12g} to {high:.12g}"
        return f"{low:g} < {self.symbol} < {high:g}" if self.symbol else f"between {low:g} and {high:g}"


def as_number(value: Any) -> float | None:
    """A number as a float; None for everything else, and for whole numbers that are too large for one."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def number_or_text(text: str) -> float | str:
    """The number of a text, and any other text as it is."""
    try:
        return float(text)
    except ValueError:
        return text


# --- Fields of dataclasses, each with its default and what it is.


def given(default: Any, described: Input, **more: Any) -> Any:
    """A field with its default and what it is; `more` is metadata of its own."""
    return field(default=default, metadata={"input": described, **more})


def number(default: Any, help: str, **more: Any) -> Any:
    """A number; `more` is what `Number` has."""
    return given(default, Number(help=help, **more))


def custom(default: Any, help: str, **more: Any) -> Any:
    """A value that is read and known by functions; `more` is what `Input` has."""
    return given(default, Input(help=help, **more))


def text(default: str | None, help: str, domain: str, **more: Any) -> Any:
    """A text that is not empty."""
    return custom(default, help, domain=domain, words=f"a text ({domain})", holds=_is_text, **more)


def choice(default: Any, help: str, names: Sequence[str], **more: Any) -> Any:
    """One of several names."""
    return custom(default, help, known=names, holds=names.__contains__, **{"domain": ", ".join(names), **more})


def flag(help: str, *, default: bool | None = False, **more: Any) -> Any:
    """Yes or no, no by default; its option says yes by itself."""
    shown = {True: "yes", False: "no"}
    words = "yes or no, true or false"
    as_flag = {"alone": True, "parse": _truth, "holds": _is_truth, "show": shown.__getitem__}
    return custom(default, help, domain="yes or no", words=words, **{**as_flag, **more})


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_truth(value: Any) -> bool:
    return isinstance(value, bool)


def as_truth(value: Any) -> Any:
    """True or false of a text such as yes or no, or of 1 or 0 in a table; any other value as it is."""
    if isinstance(value, int | float) and value in (0, 1):
        return bool(value)
    return _truth(value)


def _truth(value: Any) -> Any:
    return _TRUTH.get(value.strip().lower(), value) if isinstance(value, str) else value


# --- Inputs at their places: `metadata={"input": ...}` of a field, and `metadata={"part": ...}` of one that has fields.

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A field with fields of its own, in files a table.

    Attributes
    ----------
    group
        Group of its inputs that have none of their own.
    body
        The body that it belongs to, if another part has the same inputs for the other body; on the command line it
        stands before their names.
    both
        Whether the names without the body give them for both at once.
    option
        Name of the one option that gives all of them; empty where each has its own.
    """

    group: str
    body: str = ""
    both: bool = False
    option: str = ""


def part(kind: Callable[[], T], group: str, **more: Any) -> T:
    """A field with fields of its own; `more` is what `Part` has."""
    made: T = field(default_factory=kind, metadata={"part": Part(group=group, **more)})
    return made


@dataclass(frozen=True, kw_only=True)
class Slot(Part):
    """An input at its place.

    Attributes
    ----------
    field, table
        Name of its field, and of the part that the field belongs to (empty at the top level).
    input, default
        What it is, and its value if none is given.
    """

    field: str
    table: str
    input: Input
    default: Any

    @property
    def place(self) -> tuple[str, str]:
        """Its part and its field."""
        return self.table, self.field

    def of(self, whole: Any) -> Any:
        """Its value in an instance of the whole."""
        return getattr(getattr(whole, self.table) if self.table else whole, self.field)

    @property
    def key(self) -> str:
        """Its key in files."""
        return self.input.key or self.field

    @property
    def names(self) -> tuple[str, ...]:
        """Its names on the command line."""
        if self.option:
            return (f"--{self.option}",)
        return tuple(f"--{self.body}-{name}" if self.body else f"--{name}" for name in self.stems)

    @property
    def common_names(self) -> tuple[str, ...]:
        """The names that give it for both bodies; none if nothing does."""
        return tuple(f"--{name}" for name in self.stems) if self.both else ()

    @property
    def stems(self) -> tuple[str, ...]:
        """Its names without the body's."""
        return self.input.options or (self.key.lower().replace("_", "-"),)

    @property
    def shown_default(self) -> str:
        """Its default as a user would write it."""
        return "none" if self.default is None else self.input.shown(self.default)


def described(kind: Any) -> dict[str, Input]:
    """What the fields of a dataclass are that are inputs, by name."""
    return {entry.name: entry.metadata["input"] for entry in fields(kind) if "input" in entry.metadata}


def slots(whole: DataclassInstance) -> tuple[Slot, ...]:
    """All inputs of a dataclass and of its parts, with the values of this instance as defaults."""
    found: list[Slot] = []
    for entry in fields(whole):
        own: Part | None = entry.metadata.get("part")
        value = getattr(whole, entry.name)
        for name, one in ({entry.name: entry.metadata["input"]} if own is None else described(value)).items():
            place = {**vars(own or Part(group="")), "table": entry.name if own else "", "field": name}
            default = getattr(value, name) if own else value
            found.append(Slot(**{**place, "group": one.group or place["group"]}, input=one, default=default))
    return tuple(found)


@dataclass_transform(kw_only_default=True, frozen_default=True)
def inputs(kind: type[T]) -> type[T]:
    """Make a frozen dataclass whose values are checked, before its own `__post_init__`.

    It refuses names that it does not have, with the nearest one, missing ones and unnamed values. Its descriptions get
    what the names of its fields say.
    """
    own: Callable[[T], None] | None = kind.__dict__.get("__post_init__")

    def check(self: T) -> None:
        _check(self)
        if own is not None:
            own(self)

    # mypy: a method is no plain function
    setattr(kind, "__post_init__", check)  # noqa: B010
    made: Any = dataclass(frozen=True, kw_only=True)(kind)
    make: Callable[..., None] = made.__init__
    for entry in fields(made):
        if one := entry.metadata.get("input"):
            entry.metadata = MappingProxyType({**entry.metadata, "input": one.of_field(entry.name)})

    @wraps(make)
    def checked(self: T, *unnamed: Any, **values: Any) -> None:
        if unnamed:
            named = ", ".join(f"{entry.name}=..." for entry in fields(made)[:2])
            raise InputError(f"{kind.__name__} takes inputs by their names: {kind.__name__}({named})")
        for name in values.keys() - {entry.name for entry in fields(made)}:
            raise InputError(renamed(name) or f"{name}: {kind.__name__} has no such input{_meant(made, name)}")
        for entry in fields(made):
            if entry.default is MISSING and entry.default_factory is MISSING and entry.name not in values:
                raise InputError(f"{entry.name} is missing; give it: {kind.__name__}({entry.name}=...)")
        make(self, **values)

    made.__init__ = checked
    return kind


def read_table(kind: type[T], name: str, table: Any) -> T:
    """The value that a table of a file describes, whose keys are the names of inputs.

    Raises
    ------
    InputError
        For no table, unknown and missing keys, and values that are none, with the table's name.
    """
    known = described(kind)
    if not isinstance(table, Mapping):
        raise InputError(f"[{name}] is missing; give it, with {', '.join(known)}")
    try:
        return kind(**{key: known[key].read(value) if key in known else value for key, value in table.items()})
    except InputError as error:
        raise InputError(f"[{name}]: {error}") from error


def _meant(kind: Any, name: str) -> str:
    """Where an input stands that is none of a dataclass's own, or which of its own may be meant."""
    own = described(kind)
    known = {entry.name: entry.name for entry in fields(kind)}
    for field_name, one in own.items():
        known |= dict.fromkeys((one.key or field_name, *one.options), field_name)
    for entry in fields(kind):
        if "part" in entry.metadata and name in described(inner := type(_default(entry))):
            return f"; it is one of {inner.__name__}: {entry.name}={inner.__name__}({name}=...)"
    return nearest(name, known)


def _default(entry: Field[Any]) -> Any:
    return entry.default if entry.default_factory is MISSING else entry.default_factory()


def _check(instance: Any) -> None:
    """Check each field that has a description, and that each part is one; None is allowed where it is the default.

    Raises
    ------
    InputError
        For the first value outside its range.
    """
    for entry in fields(instance):
        value = getattr(instance, entry.name)
        if "part" in entry.metadata and not isinstance(value, part := type(_default(entry))):
            raise InputError(
                f"{entry.name} is {value!r}; allowed: a {part.__name__}, such as {entry.name}={part.__name__}(...)"
            )
        if "input" in entry.metadata and not (value is None and entry.default is None):
            entry.metadata["input"].check(value)
