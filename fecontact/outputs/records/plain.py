"""What all records share: attributes of values by their names."""

from __future__ import annotations

from typing import Any, TypeAlias

Record: TypeAlias = dict[str, Any]


def picked(value: object, names: str, before: str = "") -> Record:
    """Attributes of a value by their names, which are separated by blanks, with words before them; tuples as lists."""
    found = {f"{before}{name}": getattr(value, name) for name in names.split()}
    return {name: list(one) if isinstance(one, tuple) else one for name, one in found.items()}
