"""Kinds of inputs with their units and ranges, and fields of dataclasses that have them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

from fecontact.errors import EXTREME, LARGEST, SMALLEST, InputError
from fecontact.inputs.texts import nearest

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
