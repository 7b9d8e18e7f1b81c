"""Kinds of inputs with their units and ranges, and the dataclass fields that declare them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

from fecontact.errors import EXTREME_QUANTITY_TEXT, LARGEST_QUANTITY, SMALLEST_QUANTITY, InputError
from fecontact.inputs.texts import suggest_name

# An input reads a value as a user writes it, checks a value as the program holds it, and describes the allowed values.
# The first message is for a value that cannot be understood. The second message is for a value that is understood but
# lies outside the range.

_TRUTH_VALUES = {"yes": True, "true": True, "no": False, "false": False}


# Factors from the unit inside the program to the unit that users write.
_FACTORS = {"mrad": 1e3, "kN": 1e-3, "%": 100.0}
# Unit by the ending of a field's name. Longer endings come first.
_UNITS = {
    **{"Ns_per_m": "N s/m", "Nm_per_rad": "N m/rad", "N_per_m": "N/m", "per_mm": "1/mm", "kg_m2": "kg m2"},
    **{"m_s2": "m/s2", "km_h": "km/h", "kN": "kN", "kg": "kg", "MPa": "MPa", "mm": "mm", "rad": "rad"},
    **{"N": "N", "m": "m"},
}


def _identity(value: Any) -> Any:
    return value


@dataclass(frozen=True, kw_only=True)
class Input:
    """Description of an input field: its names, its meaning and its allowed values.

    An empty label, unit or key is derived from the name of the field.

    Attributes
    ----------
    label, help, remedy
        Name in messages; meaning; advice for a value outside the range.
    group
        Group of inputs. Commands take whole groups.
    key, options
        Key in files, if it differs from the field's name; names on the command line (without hyphens), if they are not
        derived from the key.
    domain, words
        Allowed values; their wording in messages, if it differs.
    known
        Names from which a misspelt value gets a suggestion.
    parse, holds, show
        Function from the user's text to the value; predicate for a valid value; function from the value to the user's
        text.
    each
        Whether the value is a list, written with commas.
    one_list
        Predicate for a list that is a single value and not a list of values.
    alone
        Whether the option is a flag, without a word after it on the command line.
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
    parse: Callable[[Any], Any] = _identity
    holds: Callable[[Any], bool] = bool
    show: Callable[[Any], str] = str
    each: bool = False
    one_list: Callable[[Any], bool] = lambda _: False
    alone: bool = False

    @property
    def allowed(self) -> str:
        """Text on the values that a user may write."""
        return self.words or self.domain

    def shown(self, value: Any) -> str:
        """Text of a value as a user would write it."""
        return ",".join(map(self.show, value)) if self.each else self.show(value)

    def refusal(self, value: Any) -> InputError:
        """Error for an invalid value, with a suggestion if the value is a misspelt name.

        Parameters
        ----------
        value
            Value as the user wrote it, or as the program holds it.

        Returns
        -------
        InputError
            Error with the label, the value, the allowed values and the suggestion.
        """
        suggestion = suggest_name(value, {name: name for name in self.known}) if isinstance(value, str) else ""
        return InputError(f"{self.label} is {value!r}; allowed: {self.allowed}{suggestion}")

    def read(self, value: Any) -> Any:
        """Convert a user's value to the value inside the program, and check it.

        Parameters
        ----------
        value
            Value as the user wrote it: a text from the command line, or a value of a file.

        Returns
        -------
        Any
            Value inside the program; a tuple if `each` is set and the value is a text with commas.

        Raises
        ------
        InputError
            If the value is invalid.
        """
        is_comma_list = self.each and isinstance(value, str)
        parsed = tuple(word.strip() for word in value.split(",")) if is_comma_list else self.parse(value)
        self.check(parsed)
        return parsed

    def read_word(self, word: str) -> Any:
        """Value of a word on the command line."""
        return self.read(word)

    def check(self, value: Any) -> None:
        """Refuse an invalid value.

        Parameters
        ----------
        value
            Value inside the program; a list or a tuple if `each` is set.

        Raises
        ------
        InputError
            With the value, the allowed values, and a suggestion for a misspelt name.
        """
        if self.each and not (isinstance(value, list | tuple) and value):
            raise self.refusal(value)
        for single_value in value if self.each else (value,):
            if not self.holds(single_value):
                raise self.refusal(single_value)

    def complete_for_field(self, name: str) -> Input:
        """Copy with an empty label derived from the name of the field."""
        return replace(self, label=self.label or name.replace("_", " "))


@dataclass(frozen=True, kw_only=True)
class Number(Input):
    """Description of a number with its unit and range.

    Attributes
    ----------
    unit, shown_unit
        Unit inside the program; unit that users write, if it differs.
    low, high, inclusive
        Bounds in the unit inside the program, and whether the bounds are allowed values. If `high` is infinite, `low`
        is 0 and every number above 0 is allowed.
    symbol
        Symbol of the number in the text of an exclusive range.
    usual
        Range in the unit inside the program without a note.
    whole_only
        Whether only whole numbers are allowed.
    forms
        Allowed forms of a number that is written as a text. `parse` and `show` then convert this text.
    """

    unit: str = ""
    shown_unit: str = ""
    low: float = 0.0
    high: float = math.inf
    inclusive: bool = True
    symbol: str = ""
    usual: tuple[float, float] = (-math.inf, math.inf)
    whole_only: bool = False
    forms: str = ""

    def complete_for_field(self, name: str) -> Number:
        """Copy with an empty label, unit and key derived from the name of the field.

        Parameters
        ----------
        name
            Name of the field; its ending gives the unit, as in `load_N`.

        Returns
        -------
        Number
            Description with label, unit, key and domain.
        """
        suffix = next((ending for ending in _UNITS if name.endswith(f"_{ending}")), "")
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
        """Factor from the value inside the program to the value that users write."""
        return _FACTORS.get(self.shown_unit, 1.0)

    @property
    def allowed(self) -> str:
        """Text on the values that a user may write."""
        return self.domain if self.forms else f"a number ({self.domain})"

    def shown(self, value: float) -> str:
        """Text of a value as a user would write it.

        Parameters
        ----------
        value
            Number in the unit inside the program.

        Returns
        -------
        str
            Number in the unit that users give, without the unit.
        """
        return self.show(value) if self.forms else f"{value * self.factor:.12g}"

    def note(self, value: float) -> str:
        """Note on a valid but unusual value.

        Parameters
        ----------
        value
            Value in the unit inside the program.

        Returns
        -------
        str
            Note with the value, the usual range and the remedy; empty for a usual value.
        """
        low, high = self.usual
        if low <= value <= high:
            return ""
        value_text, bounds = self.shown(value), f"{low * self.factor:g} to {high * self.factor:g}"
        return f"{self.label} is {value_text} {self._outside_unit}; usual: {bounds}; {self.remedy}"

    def read(self, value: Any) -> float:
        """Convert a number from the user's unit to the unit inside the program.

        The range is not checked here.

        Parameters
        ----------
        value
            Number in the user's unit, or a text if the number has `forms`.

        Returns
        -------
        float
            Number in the unit inside the program.

        Raises
        ------
        InputError
            If the value is not a number.
        """
        if self.forms and isinstance(value, str):
            return float(self.parse(value))
        number = None if self.forms else to_float(value)
        if number is None:
            raise self.refusal(value)
        # The division uses whole numbers, so that 9 mrad is 0.009 rad to the last bit.
        return number * round(1.0 / self.factor) if self.factor < 1.0 else number / self.factor

    def read_word(self, word: str) -> float:
        """Number of a word on the command line, in the unit inside the program.

        Parameters
        ----------
        word
            Number in the unit that users give.

        Returns
        -------
        float
            Number in the unit inside the program.
        """
        return self.read(word if self.forms else parse_number_or_text(word))

    def check(self, value: Any) -> None:
        """Refuse a number outside the range.

        Parameters
        ----------
        value
            Number in the unit inside the program.

        Raises
        ------
        InputError
            With the value, the unit, the allowed range and the remedy.
        """
        number = to_float(value)
        if number is not None and self._within(number):
            return
        value_text = f"{float(value)!r}" if isinstance(value, float) else f"{value!r}"
        outer_unit = self._outside_unit if self._outside_unit != self.unit else ""
        message = f"{self.label} is {' '.join(filter(None, (value_text, self.unit)))}"
        if number is not None and outer_unit:
            message += f" ({number * self.factor:g} {outer_unit})"
        if number is not None and math.isinf(self.high) and self.low < number < math.inf:
            raise InputError("; ".join(filter(None, (message, EXTREME_QUANTITY_TEXT, self.remedy))))
        allowed_range = self._range(1.0) + (f" {self.unit}" if math.isfinite(self.high) and self.unit else "")
        if outer_unit and math.isfinite(self.high):
            allowed_range += f" ({self._range(self.factor)} {outer_unit})"
        raise InputError("; ".join(filter(None, (message, f"allowed: {allowed_range}", self.remedy))))

    @property
    def _outside_unit(self) -> str:
        return self.shown_unit or self.unit

    def _within(self, number: float) -> bool:
        """Whether a number in the unit inside the program is allowed."""
        if not math.isfinite(number) or (self.whole_only and not number.is_integer()):
            return False
        if self.inclusive and math.isfinite(self.high):
            return self.low <= number <= self.high
        # Without an upper bound, numbers are refused if they are so large or so small that nothing can be computed with
        # them.
        return self.low < number < self.high and (
            math.isfinite(self.high) or SMALLEST_QUANTITY <= number <= LARGEST_QUANTITY
        )

    def _range(self, factor: float) -> str:
        low, high = self.low * factor, self.high * factor
        if not math.isfinite(high):
            return f"finite and > {low:g}"
        if self.inclusive:
            return f"{'whole numbers from ' * self.whole_only}{low:.12g} to {high:.12g}"
        return f"{low:g} < {self.symbol} < {high:g}" if self.symbol else f"between {low:g} and {high:g}"


def to_float(value: Any) -> float | None:
    """Convert a number to a float.

    Parameters
    ----------
    value
        Any value.

    Returns
    -------
    float or None
        The float; None for a value that is not a number, and for an integer that is too large for a float.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def parse_number_or_text(text: str) -> float | str:
    """Number of a text; any other text is returned unchanged.

    Parameters
    ----------
    text
        Text of a word on the command line.

    Returns
    -------
    float or str
        The number, or the text if it is not a number.
    """
    try:
        return float(text)
    except ValueError:
        return text


def input_field(default: Any, described: Input, **metadata: Any) -> Any:
    """Dataclass field with an input description; `metadata` is further metadata of the field.

    Parameters
    ----------
    default
        Default of the field, in the unit inside the program.
    described
        Description of the input.
    **metadata
        Further metadata of the field.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    return field(default=default, metadata={"input": described, **metadata})


def number_field(default: Any, help: str, **attributes: Any) -> Any:
    """Dataclass field of a number; `attributes` are further attributes of `Number`.

    Parameters
    ----------
    default
        Default of the field, in the unit inside the program.
    help
        Text for `--help` and the documentation.
    **attributes
        Further attributes of `Number`, such as `low`, `high` and `remedy`.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    return input_field(default, Number(help=help, **attributes))


def custom_field(default: Any, help: str, **attributes: Any) -> Any:
    """Dataclass field with functions for reading and checking; `attributes` are attributes of `Input`.

    Parameters
    ----------
    default
        Default of the field.
    help
        Text for `--help` and the documentation.
    **attributes
        Further attributes of `Input`.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    return input_field(default, Input(help=help, **attributes))


def text_field(default: str | None, help: str, domain: str, **attributes: Any) -> Any:
    """Dataclass field of a non-empty text.

    Parameters
    ----------
    default
        Default of the field.
    help
        Text for `--help` and the documentation.
    domain
        Allowed texts, in words.
    **attributes
        Further attributes of `Input`.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    return custom_field(default, help, domain=domain, words=f"a text ({domain})", holds=_is_text, **attributes)


def choice_field(default: Any, help: str, names: Sequence[str], **attributes: Any) -> Any:
    """Dataclass field of a name from a list.

    Parameters
    ----------
    default
        Default of the field.
    help
        Text for `--help` and the documentation.
    names
        Allowed names.
    **attributes
        Further attributes of `Input`.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    return custom_field(
        default, help, known=names, holds=names.__contains__, **{"domain": ", ".join(names), **attributes}
    )


def flag_field(help: str, *, default: bool | None = False, **attributes: Any) -> Any:
    """Dataclass field of a truth value, false by default.

    Its option on the command line has no value after it.

    Parameters
    ----------
    help
        Meaning of the flag.
    default
        Default value; None if the flag is undecided by default.
    attributes
        Further attributes of `Input`.

    Returns
    -------
    Any
        Field of a dataclass.
    """
    texts = {True: "yes", False: "no"}
    words = "yes or no, true or false"
    flag_attributes = {"alone": True, "parse": _parse_truth_value, "holds": _is_truth_value, "show": texts.__getitem__}
    return custom_field(default, help, domain="yes or no", words=words, **{**flag_attributes, **attributes})


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_truth_value(value: Any) -> bool:
    return isinstance(value, bool)


def _parse_truth_value(value: Any) -> Any:
    return _TRUTH_VALUES.get(value.strip().lower(), value) if isinstance(value, str) else value
