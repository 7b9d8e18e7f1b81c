"""Templates of files with the defaults of inputs."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from string import Template
from typing import Any

from fecontact.inputs.kinds import Input, Number
from fecontact.inputs.slots import InputPlace


class _InputTemplate(Template):
    """Template with places such as `${load_kN}` and `${criteria.area_percent}`."""

    idpattern = r"[A-Za-z]\w*(?:\.[A-Za-z]\w*)?"


def fill_toml_template(text: str, places: Iterable[InputPlace]) -> str:
    """Text of a TOML file from a template with keys of inputs.

    Parameters
    ----------
    text
        Template with `${key}` or `${table.key}` for the default of an input.
    places
        Inputs. An input without a default has no value in a file.

    Returns
    -------
    str
        Text in which each key of the template is replaced by the default of its input.

    Raises
    ------
    KeyError
        If the template has a key of no input with a default.

    Examples
    --------
    >>> from fecontact.case import INPUTS
    >>> from fecontact.inputs.templates import fill_toml_template
    >>> fill_toml_template("area_percent = ${criteria.area_percent}", INPUTS)
    'area_percent = 10.0'
    """
    values = {
        f"{place.table}.{place.key}".lstrip("."): _format_toml(place.input, place.default)
        for place in places
        if place.default is not None
    }
    return _InputTemplate(text).substitute(values)


def fill_python_template(text: str, places: Iterable[InputPlace]) -> str:
    """Text of a script from a template with fields of inputs.

    Parameters
    ----------
    text
        Template with `${field}` or `${table.field}` for the default of an input.
    places
        Inputs.

    Returns
    -------
    str
        Text in which each field of the template is replaced by the default of its input.

    Raises
    ------
    KeyError
        If the template has a field of no input.

    Examples
    --------
    >>> from fecontact.case import INPUTS
    >>> from fecontact.inputs.templates import fill_python_template
    >>> fill_python_template("Case(load_N=${load_N})", INPUTS)
    'Case(load_N=100e3)'
    """
    values = {
        f"{place.table}.{place.field}".lstrip("."): _format_python(place.input, place.default) for place in places
    }
    return _InputTemplate(text).substitute(values)


def _format_toml(described: Input, value: Any) -> str:
    """Value of an input as the text of a TOML file."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(described, Number) and not described.forms:
        return repr(float(described.shown(value)))
    if isinstance(value, tuple) and not described.each:
        return f"[{', '.join(f'{number:.12g}' for number in value)}]"
    return json.dumps(described.shown(value), ensure_ascii=False)


def _format_python(described: Input, value: Any) -> str:
    """Value of an input as a Python expression.

    A load of 100 kN is `100e3`, so that the number is the number in the unit that users write.
    """
    if isinstance(described, Number) and described.factor != 1.0 and not described.forms and value is not None:
        return f"{described.shown(value)}e{-round(math.log10(described.factor))}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)
