"""Inputs: kinds of values with unit and range, the fields of dataclasses that hold them, and their texts."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from difflib import get_close_matches
from functools import wraps
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

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
    return f"{name}: there is no such input any more; {_RENAMED[name]}" if name in _RENAMED else ""


_RENAMED = {
    "wheelset": "the roll at which both wheels touch is roll = 'touching', a fixed one roll = 'given'",
    "roll_under_load": "the roll of the loaded wheelset is roll = 'loaded'",
}


# --- What an input may be: a number within a range, a text, a name, some names, yes and no, or a value of its own
# class.
#
# Each kind reads a value as a user writes it, checks a value as the program holds it, and says what it allows. The
# first message is for a value that cannot be understood, the second for one that is understood and lies outside the
# range.

_TRUTH = {"yes": True, "true": True, "no": False, "false": False}


# What users give a number in, times what it is inside the program.
_FACTORS = {"mrad": 1e3, "kN": 1e-3, "%": 100.0}
_UNITS = ("mm", "N", "MPa", "rad")


@dataclass(frozen=True, kw_only=True)
class Described:
    """What all kinds have; what is not given of label, unit and key says the name of the field.

    Attributes
    ----------
    label, help
        Name in messages; what it is.
    key, options
        Key in files, if it is not the field's name; names on the command line (without hyphens), if they are not made
        from the key.
    """

    label: str = ""
    help: str
    key: str = ""
    options: tuple[str, ...] = ()

    if TYPE_CHECKING:

        @property
        def domain(self) -> str:
            """Range of the values."""

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.domain

    def shown(self, value: Any) -> str:
        """A value as a user would write it."""
        return str(value)

    def refusal(self, value: Any, known: Iterable[str] = ()) -> InputError:
        """Of a value that is none; of the known names it has the nearest one."""
        meant = nearest(value, {name: name for name in known}) if isinstance(value, str) else ""
        return InputError(f"{self.label} is {value!r}; allowed: {self.allowed}{meant}")


@dataclass(frozen=True, kw_only=True)
class Number(Described):
    """A number with its unit and range.

    Attributes
    ----------
    remedy
        What to do about a value outside the range.
    unit, shown_unit
        Unit inside the program; unit in which users give it, if it is another.
    low, high, inclusive
        Bounds in the unit inside; without `high`, `low` is 0 and everything above it is allowed.
    symbol
        Sign for the number in an exclusive range.
    usual
        Between which bounds it is not worth a note, in the unit inside.
    whole
        Whether it is a whole number.
    parse, show, forms
        For a number that is written as a text: the text's value in the unit inside, its inverse, and what is allowed.
    """

    remedy: str = ""
    unit: str = ""
    shown_unit: str = ""
    low: float = 0.0
    high: float = math.inf
    inclusive: bool = True
    symbol: str = ""
    usual: tuple[float, float] = (-math.inf, math.inf)
    whole: bool = False
    parse: Callable[[str], float] | None = None
    show: Callable[[float], str] | None = None
    forms: str = ""

    @property
    def factor(self) -> float:
        """By how much the value that users give is larger."""
        return _FACTORS.get(self.shown_unit, 1.0)

    @property
    def domain(self) -> str:
        """Unit and range as users give the number."""
        domain = f"{self._outside_unit or 'no unit'}, {self._range(self.factor)}"
        return f"{self.forms}; {domain}" if self.forms else domain

    @property
    def allowed(self) -> str:
        """What a user may write."""
        if self.forms:
            return self.domain
        return f"a {'whole ' * self.whole}number ({self.domain})"

    def shown(self, value: float) -> str:
        """A value as a user would write it."""
        return self.show(value) if self.show else f"{value * self.factor:.12g}"

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
        if self.parse and isinstance(value, str):
            return self.parse(value)
        number = None if self.parse else as_number(value)
        if number is None or (self.whole and not number.is_integer()):
            raise self.refusal(value)
        # with whole numbers, so that 9 mrad is 0.009 rad to the last bit
        inside = number * round(1.0 / self.factor) if self.factor < 1.0 else number / self.factor
        return int(inside) if self.whole else inside

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
        if not math.isfinite(number) or (self.whole and not number.is_integer()):
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


@dataclass(frozen=True, kw_only=True)
class Text(Described):
    """A text that is not empty."""

    domain: str = "not empty"

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return f"a text ({self.domain})"

    def read(self, value: Any) -> str:
        """The text itself.

        Raises
        ------
        InputError
            If it is none.
        """
        self.check(value)
        return str(value)

    def check(self, value: Any) -> None:
        """Refuse what is no text, or an empty one.

        Raises
        ------
        InputError
            With the value and what is allowed.
        """
        if not isinstance(value, str) or not value.strip():
            raise self.refusal(value)


@dataclass(frozen=True, kw_only=True)
class Choice(Described):
    """One of several names or, with `pair`, two numbers instead."""

    names: tuple[str, ...]
    pair: Number | None = None

    @property
    def domain(self) -> str:
        """What is allowed."""
        names = ", ".join(self.names)
        if self.pair is None:
            return names
        return f"{names}, or two {self.pair.label}s in {self.pair.unit} such as 0.5,0.4 ({self.pair.domain})"

    def shown(self, value: str | Sequence[float]) -> str:
        """A value as a user would write it."""
        return value if isinstance(value, str) else ",".join(f"{number:.12g}" for number in value)

    def read(self, value: Any) -> str | tuple[float, ...]:
        """The name, or the two numbers from a list of them or from a text such as `0.5,0.4`.

        Raises
        ------
        InputError
            If it is neither.
        """
        if self.pair and isinstance(value, str) and "," in value:
            value = [_number_or_text(part) for part in value.split(",")]
        if self.is_pair(value):
            return tuple(float(number) for number in value)
        self.check(value)
        return str(value)

    def is_pair(self, value: Any) -> bool:
        """Whether a value is the two numbers, or an attempt at them, and not a list of values."""
        return self.pair is not None and isinstance(value, list | tuple) and None not in map(as_number, value)

    def check(self, value: Any) -> None:
        """Refuse another name, and numbers outside their range.

        Raises
        ------
        InputError
            With the value, what is allowed, and the name that may have been meant.
        """
        if self.pair and self.is_pair(value) and len(value) == 2:
            for number in value:
                self.pair.check(number)
        elif not (isinstance(value, str) and value in self.names):
            raise self.refusal(value, self.names)


@dataclass(frozen=True, kw_only=True)
class Names(Described):
    """One or more of several names, or of sets of them.

    Attributes
    ----------
    sets
        Names in each set; every name is in at least one.
    """

    sets: Mapping[str, tuple[str, ...]] = field(hash=False)

    @property
    def domain(self) -> str:
        """What is allowed."""
        return f"sets {', '.join(self.sets)}; measures {', '.join(self._single)}; joined by commas"

    @property
    def _single(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for names in self.sets.values() for name in names))

    def shown(self, value: Sequence[str]) -> str:
        """A value as a user would write it."""
        return ",".join(value)

    def read(self, value: Any) -> tuple[str, ...]:
        """The names, from a list of them or from a text with commas between.

        Raises
        ------
        InputError
            If one of them is not known.
        """
        names = tuple(part.strip() for part in value.split(",")) if isinstance(value, str) else value
        self.check(names)
        return tuple(names)

    def check(self, value: Any) -> None:
        """Refuse what is no name, and no names at all.

        Raises
        ------
        InputError
            With the value, what is allowed, and the name that may have been meant.
        """
        known = (*self.sets, *self._single)
        if not isinstance(value, list | tuple) or not value:
            raise self.refusal(value)
        for name in value:
            if name not in known:
                raise self.refusal(name, known)


@dataclass(frozen=True, kw_only=True)
class Flag(Described):
    """Yes or no.

    Attributes
    ----------
    alone
        Whether its option says yes by itself on the command line, without a word behind it.
    """

    alone: bool = False

    @property
    def domain(self) -> str:
        """What is allowed."""
        return "yes or no"

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return "yes or no, true or false"

    def shown(self, value: bool) -> str:
        """A value as a user would write it."""
        return "yes" if value else "no"

    def read(self, value: Any) -> bool:
        """The truth, from itself or from a word for it.

        Raises
        ------
        InputError
            If it is neither.
        """
        word = _TRUTH.get(value.strip().lower()) if isinstance(value, str) else value
        self.check(value if word is None else word)
        return bool(word)

    def check(self, value: Any) -> None:
        """Refuse what is neither true nor false.

        Raises
        ------
        InputError
            With the value and what is allowed.
        """
        if not isinstance(value, bool):
            raise self.refusal(value)


@dataclass(frozen=True, kw_only=True)
class Written(Described):
    """A value of a class of its own that is written as a text or a table.

    Attributes
    ----------
    kind, parse, show
        Its class; the value from what a user wrote; the text that is shown of it.
    """

    domain: str
    kind: type
    parse: Callable[[Any], Any] = field(hash=False)
    show: Callable[[Any], str] = field(hash=False)

    def shown(self, value: Any) -> str:
        """A value as a user would write it."""
        return self.show(value)

    def read(self, value: Any) -> Any:
        """The value of a text or a table.

        Raises
        ------
        InputError
            If it is none.
        """
        return self.parse(value)

    def check(self, value: Any) -> None:
        """Refuse a value of another class.

        Raises
        ------
        InputError
            With the value and what is allowed.
        """
        if not isinstance(value, self.kind):
            raise InputError(
                f"{self.label} is {value!r}; allowed: {self.kind.__name__}(...); in files a text: {self.domain}"
            )


Input = Number | Text | Choice | Names | Flag | Written


def as_number(value: Any) -> float | None:
    """A number as a float; None for everything else, and for whole numbers that are too large for one."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _number_or_text(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


# --- Inputs at their places: `metadata={"input": ...}` of a field, and `metadata={"part": ...}` of one that has fields.

T = TypeVar("T", bound="DataclassInstance")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A field with fields of its own, in files a table.

    Attributes
    ----------
    group
        Group of its inputs.
    body
        The body that it belongs to, if another part has the same inputs for the other body; on the command line it
        stands before their names.
    both
        Whether the names without the body give them for both at once.
    """

    group: str
    body: str = ""
    both: bool = False


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
        return tuple(f"--{self.body}-{name}" if self.body else f"--{name}" for name in self._stems)

    @property
    def common_names(self) -> tuple[str, ...]:
        """The names that give it for both bodies; none if nothing does."""
        return tuple(f"--{name}" for name in self._stems) if self.both else ()

    @property
    def _stems(self) -> tuple[str, ...]:
        return self.input.options or (self.key.lower().replace("_", "-"),)

    @property
    def shown_default(self) -> str:
        """Its default as a user would write it."""
        return "none" if self.default is None else self.input.shown(self.default)


def given(default: Any, described: Input, group: str = "") -> Any:
    """A field of a dataclass whose values are described, in a group of its own if not in that of a part."""
    return field(default=default, metadata={"input": described, "group": group})


def slots(whole: DataclassInstance) -> tuple[Slot, ...]:
    """All inputs of a dataclass and of its parts, with the values of this instance as defaults."""
    found: list[Slot] = []

    def add(entry: Field[Any], default: Any, table: str, part: Part) -> None:
        described = entry.metadata["input"]
        found.append(Slot(field=entry.name, table=table, input=described, default=default, **vars(part)))

    for entry in fields(whole):
        value = getattr(whole, entry.name)
        if (part := entry.metadata.get("part")) is None:
            add(entry, value, "", Part(group=entry.metadata["group"]))
            continue
        for inner in fields(value):
            add(inner, getattr(value, inner.name), entry.name, part)
    return tuple(found)


def by_name(kind: type[T]) -> type[T]:
    """Make a dataclass of inputs refuse names that it does not have, with the nearest one, and unnamed values.

    Its descriptions get what the names of its fields say.
    """
    make: Callable[..., None] = kind.__init__
    for entry in fields(kind):
        if described := entry.metadata.get("input"):
            entry.metadata = MappingProxyType({**entry.metadata, "input": _filled(described, entry.name)})

    @wraps(make)
    def checked(self: T, *unnamed: Any, **values: Any) -> None:
        if unnamed:
            named = ", ".join(f"{entry.name}=..." for entry in fields(kind)[:2])
            raise InputError(f"{kind.__name__} takes inputs by their names: {kind.__name__}({named})")
        for name in values.keys() - {entry.name for entry in fields(kind)}:
            raise InputError(renamed(name) or f"{name}: {kind.__name__} has no such input{_meant(kind, name)}")
        make(self, **values)

    # mypy: a method is no plain function
    setattr(kind, "__init__", checked)  # noqa: B010
    return kind


def _filled(described: Input, name: str) -> Input:
    """A description with the label, the unit and the key that the name of its field says, where none are given."""
    if not isinstance(described, Number):
        return replace(described, label=described.label or name.replace("_", " "))
    stem, _, unit = name.rpartition("_")
    if unit not in _UNITS:
        stem, unit = name, ""
    shown = described.shown_unit
    return replace(
        described,
        label=described.label or stem.replace("_", " "),
        unit=described.unit or unit,
        key=described.key or (f"{stem}_{shown}" if shown else ""),
    )


def _meant(kind: type[DataclassInstance], name: str) -> str:
    """Where an input stands that is none of a dataclass's own, or which of its own may be meant."""
    known: dict[str, str] = {}
    for entry in fields(kind):
        known[entry.name] = entry.name
        if described := entry.metadata.get("input"):
            known |= dict.fromkeys((described.key or entry.name, *described.options), entry.name)
            continue
        part = _default(entry)
        if name in (inner.name for inner in fields(part)):
            return f"; it is one of {type(part).__name__}: {entry.name}={type(part).__name__}({name}=...)"
    return nearest(name, known)


def _default(entry: Field[Any]) -> Any:
    return entry.default if entry.default_factory is MISSING else entry.default_factory()


def check_inputs(instance: DataclassInstance) -> None:
    """Check each field that has a description, and that each part is one; None is allowed where it is the default.

    Raises
    ------
    InputError
        For the first value outside its range.
    """
    for entry in fields(instance):
        value = getattr(instance, entry.name)
        if "part" in entry.metadata:
            part = type(_default(entry))
            if not isinstance(value, part):
                raise InputError(
                    f"{entry.name} is {value!r}; allowed: a {part.__name__}, such as {entry.name}={part.__name__}(...)"
                )
        if "input" in entry.metadata and not (value is None and entry.default is None):
            entry.metadata["input"].check(value)
