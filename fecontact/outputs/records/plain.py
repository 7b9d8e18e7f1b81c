"""What all records share: attributes of values by their names."""

from __future__ import annotations

from typing import Any, TypeAlias

Record: TypeAlias = dict[str, Any]


def picked(value: object, names: str) -> Record:
    """Attributes of a value by their names, which are separated by blanks."""
    return {name: getattr(value, name) for name in names.split()}
