"""What an input may be: a number within a range, a text, a name, some names, yes and no, or a value of its own class.

Each kind reads a value as a user writes it, checks a value as the program holds it, and says what it allows. The first
message is for a value that cannot be understood, the second for one that is understood and lies outside the range.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any

from fecontact.errors import EXTREME, LARGEST, SMALLEST, InputError
from fecontact.inputs.texts import nearest

_TRUTH = {"yes": True, "true": True, "no": False, "false": False}


@dataclass(frozen=True, kw_only=True)
class Number:
    """A number with its unit and range.

    Attributes
    ----------
    label, help, remedy
        Name in messages; what it is; what to do about a value outside the range.
    unit, shown_unit, factor
        Unit inside the program; unit in which users give it, if it is another; the latter's value is `factor` times the
        former's.
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
    key, group, options
        Key in files, if it is not the field's name; group of the input; names on the command line (without hyphens), if
        they are not made from the key.
    """

    label: str
    help: str
    remedy: str = ""
    unit: str = ""
    shown_unit: str = ""
    factor: float = 1.0
    low: float = 0.0
    high: float = math.inf
    inclusive: bool = True
    symbol: str = ""
    usual: tuple[float, float] = (-math.inf, math.inf)
    whole: bool = False
    parse: Callable[[str], float] | None = None
    show: Callable[[float], str] | None = None
    forms: str = ""
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()

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
            raise InputError(f"{self.label} is {value!r}; allowed: {self.allowed}")
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
        text = f"{self.label} is {' '.join(filter(None, (given, self.unit)))}{self._outside(number)}"
        if number is not None and math.isinf(self.high) and self.low < number < math.inf:
            raise InputError("; ".join(filter(None, (text, EXTREME, self.remedy))))
        allowed = self._range(1.0) + (f" {self.unit}" if math.isfinite(self.high) and self.unit else "")
        if self._outside_unit != self.unit and math.isfinite(self.high):
            allowed += f" ({self._range(self.factor)} {self._outside_unit})"
        raise InputError("; ".join(filter(None, (text, f"allowed: {allowed}", self.remedy))))

    @property
    def _outside_unit(self) -> str:
        return self.shown_unit or self.unit

    def _outside(self, number: float | None) -> str:
        if number is None or self._outside_unit == self.unit:
            return ""
        return f" ({number * self.factor:g} {self._outside_unit})"

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
class Text:
    """A text that is not empty; the attributes are as those of `Number`."""

    label: str
    help: str
    domain: str = "not empty"
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return f"a text ({self.domain})"

    def shown(self, value: str) -> str:
        """A value as a user would write it."""
        return value

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
            raise InputError(f"{self.label} is {value!r}; allowed: {self.allowed}")


@dataclass(frozen=True, kw_only=True)
class Choice:
    """One of several names or, with `pair`, two numbers instead; the other attributes are as those of `Number`."""

    label: str
    help: str
    names: tuple[str, ...]
    pair: Number | None = None
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()

    @property
    def domain(self) -> str:
        """What is allowed."""
        names = ", ".join(self.names)
        if self.pair is None:
            return names
        return f"{names}, or two {self.pair.label}s in {self.pair.unit} such as 0.5,0.4 ({self.pair.domain})"

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.domain

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
            meant = nearest(value, {name: name for name in self.names}) if isinstance(value, str) else ""
            raise InputError(f"{self.label} is {value!r}; allowed: {self.domain}{meant}")


@dataclass(frozen=True, kw_only=True)
class Names:
    """One or more of several names, or of sets of them; the other attributes are as those of `Number`.

    Attributes
    ----------
    sets
        Names in each set; every name is in at least one.
    """

    label: str
    help: str
    sets: Mapping[str, tuple[str, ...]] = field(hash=False)
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()

    @property
    def domain(self) -> str:
        """What is allowed."""
        return f"sets {', '.join(self.sets)}; measures {', '.join(self._single)}; joined by commas"

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.domain

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
            raise InputError(f"{self.label} is {value!r}; allowed: {self.domain}")
        for name in value:
            if name not in known:
                meant = nearest(name, {one: one for one in known}) if isinstance(name, str) else ""
                raise InputError(f"{self.label} is {name!r}; allowed: {self.domain}{meant}")


@dataclass(frozen=True, kw_only=True)
class Flag:
    """Yes or no; the attributes are as those of `Number`.

    Attributes
    ----------
    alone
        Whether its option says yes by itself on the command line, without a word behind it.
    """

    label: str
    help: str
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()
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
            raise InputError(f"{self.label} is {value!r}; allowed: {self.allowed}")


@dataclass(frozen=True, kw_only=True)
class Written:
    """A value of a class of its own that is written as a text or a table; other attributes are as those of `Number`.

    Attributes
    ----------
    kind, parse, show
        Its class; the value from what a user wrote; the text that is shown of it.
    """

    label: str
    help: str
    domain: str
    kind: type
    parse: Callable[[Any], Any] = field(hash=False)
    show: Callable[[Any], str] = field(hash=False)
    key: str = ""
    group: str = ""
    options: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """What a user may write."""
        return self.domain

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
