"""Conversion of values to records, and of records to flat rows.

Keys and columns are the names of the attributes in the program.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np

from fecontact.own_criterion import OWN_PREFIX, is_own, is_own_relative, split_own_measure

Record: TypeAlias = dict[str, Any]

# Beginnings of names of groups with relative numbers. Deviations and uncertainties are relative to the finite elements,
# a ladder step is relative to the rung before it.
_RELATIVE_GROUPS = ("deviation", "uncertainty", "step")


def to_plain(value: Any) -> Any:
    """Convert a value to plain JSON types.

    A dataclass gives the fields and properties that its `TELLS` lists, or else all its fields.

    Parameters
    ----------
    value
        Dataclass, mapping, tuple, list, array, number or text.

    Returns
    -------
    dict, list, number, str or None
        The plain value.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.outputs.flat_records import to_plain
    >>> to_plain({"a_mm": np.array([1.0, 2.0])})
    {'a_mm': [1.0, 2.0]}
    """
    if is_dataclass(value):
        names: tuple[str, ...] = getattr(type(value), "TELLS", None) or tuple(
            attribute.name for attribute in fields(value)
        )
        return {name: to_plain(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): to_plain(member) for key, member in value.items()}
    if isinstance(value, tuple | list):
        return [to_plain(member) for member in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def select_attributes(value: object, names: str, prefix: str = "") -> Record:
    """Select attributes of a value as a record.

    Parameters
    ----------
    value
        Any object.
    names
        Names of attributes, separated by blanks.
    prefix
        Prefix of the keys.

    Returns
    -------
    Record
        Plain values by name.
    """
    return {f"{prefix}{name}": to_plain(getattr(value, name)) for name in names.split()}


def flatten(record: Mapping[str, Any]) -> Record:
    """Flatten a record to a row: each number or text by its path, joined by `_`.

    Numbers of a relative group are in percent, and `percent` replaces the unit in their names. For a list of records
    the row has the length; a list of texts is joined.

    Parameters
    ----------
    record
        Nested record.

    Returns
    -------
    Record
        Row without nested values.

    Examples
    --------
    >>> from fecontact.outputs.flat_records import flatten
    >>> flatten({"fe": {"p_max_MPa": 1000.0}, "hertz": {"deviation": {"p_max_MPa": 0.05}}, "notes": ["a", "b"]})
    {'fe_p_max_MPa': 1000.0, 'hertz_deviation_p_max_percent': 5.0, 'notes': 'a; b'}
    """
    return dict(_flatten(record, "", relative=False))


def _flatten(record: Mapping[str, Any], prefix: str, *, relative: bool) -> Iterator[tuple[str, Any]]:
    """Iterate over the columns of a record; nested keys get the prefix.

    With `relative` numbers are converted to percent.
    """
    for name, value in record.items():
        if isinstance(value, Mapping):
            # contributions to the uncertainty of a difference have its unit
            is_difference = is_own(name) and not is_own_relative(name)
            is_relative = (relative or name.startswith(_RELATIVE_GROUPS)) and not is_difference
            yield from _flatten(value, f"{prefix}{name}_", relative=is_relative)
        elif isinstance(value, list):
            has_records = any(isinstance(member, Mapping) for member in value)
            yield f"{prefix}{name}", len(value) if has_records else "; ".join(map(str, value))
        elif relative:
            column = relative_name(name)
            yield f"{prefix}{column}", 1e2 * value if column.endswith("_percent") and value is not None else value
        else:
            yield f"{prefix}{name}", value


def relative_name(measure: str) -> str:
    """Column of a relative number, such as `p_max_percent` for `p_max_MPa`.

    Measures without a unit of pressure, length or area get the ending too (`valley_percent` for `valley`). Names that
    end in `_over_b` stay (`centre_over_b`), and so do differences of a user's measures, which have a unit.

    Parameters
    ----------
    measure
        Name of a measure.

    Returns
    -------
    str
        Name of the column.

    Examples
    --------
    >>> from fecontact.outputs.flat_records import relative_name
    >>> relative_name("p_max_MPa"), relative_name("centre_over_b")
    ('p_max_percent', 'centre_over_b')
    """
    if is_own(measure):
        # a difference keeps its unit
        return f"{OWN_PREFIX}{split_own_measure(measure)[0]}_percent" if is_own_relative(measure) else measure
    stem, _, unit = measure.rpartition("_")
    if measure.endswith("_over_b"):
        return measure
    return f"{stem if unit in ('MPa', 'mm', 'mm2') else measure}_percent"
