"""Values as records, and records as rows: results keep the names that they have in the program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias

import numpy as np

Record: TypeAlias = dict[str, Any]

# Beginnings of groups of relative numbers: relative to the finite elements, or a step relative to the rung before it.
_RELATIVE = ("deviation", "uncertainty", "step")


def told(value: Any) -> Any:
    """A value in plain JSON; a dataclass gives the fields and properties in its `TELLS`, or all its fields."""
    if is_dataclass(value):
        names: tuple[str, ...] = getattr(type(value), "TELLS", None) or tuple(one.name for one in fields(value))
        return {name: told(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {str(key): told(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [told(one) for one in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def picked(value: object, names: str, before: str = "") -> Record:
    """Attributes of a value by their names, which are separated by blanks; keys get the prefix `before`."""
    return {f"{before}{name}": told(getattr(value, name)) for name in names.split()}


def flat(record: Mapping[str, Any]) -> Record:
    """A record as a row: each number and text by its path, joined by `_`.

    Numbers of a relative group are in percent, and `percent` replaces the unit in their names. A list of records is
    counted, a list of texts is joined.
    """
    return dict(_columns(record, "", relative=False))


def _columns(record: Mapping[str, Any], before: str, *, relative: bool) -> Iterator[tuple[str, Any]]:
    for name, value in record.items():
        if isinstance(value, Mapping):
            yield from _columns(value, f"{before}{name}_", relative=relative or name.startswith(_RELATIVE))
        elif isinstance(value, list):
            of_records = any(isinstance(one, Mapping) for one in value)
            yield f"{before}{name}", len(value) if of_records else "; ".join(map(str, value))
        elif relative:
            column = relative_name(name)
            yield f"{before}{column}", 1e2 * value if column.endswith("_percent") and value is not None else value
        else:
            yield f"{before}{name}", value


def relative_name(measure: str) -> str:
    """Column of a relative number: `p_max_percent` for `p_max_MPa`, `valley_percent` for `valley`, `centre_over_b`."""
    stem, _, unit = measure.rpartition("_")
    if measure.endswith("_over_b"):
        return measure
    return f"{stem if unit in ('MPa', 'mm', 'mm2') else measure}_percent"
