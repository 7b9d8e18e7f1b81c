"""Inputs at their places: `metadata={"input": ...}` of a field, and `metadata={"part": ...}` of one that has fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, dataclass, fields
from dataclasses import field as dataclass_field
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar

from fecontact.errors import InputError
from fecontact.inputs.kinds import Input
from fecontact.inputs.texts import nearest, renamed

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

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
class Slot:
    """An input at its place.

    Attributes
    ----------
    field, table
        Name of its field, and of the part that the field belongs to (empty at the top level).
    input, default
        What it is, and its value if none is given.
    group, body, both
        As those of `Part`.
    """

    field: str
    table: str
    input: Input
    default: Any
    group: str
    body: str = ""
    both: bool = False

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


def given(default: Any, described: Input) -> Any:
    """A field of a dataclass whose values are described."""
    return dataclass_field(default=default, metadata={"input": described})


def slots(whole: DataclassInstance) -> tuple[Slot, ...]:
    """All inputs of a dataclass and of its parts, with the values of this instance as defaults."""
    found: list[Slot] = []
    for field in fields(whole):
        value = getattr(whole, field.name)
        if (part := field.metadata.get("part")) is None:
            found.append(_slot(field, value, "", Part(group=field.metadata["input"].group)))
        else:
            found += [_slot(inner, getattr(value, inner.name), field.name, part) for inner in fields(value)]
    return tuple(found)


def _slot(field: Field[Any], default: Any, table: str, part: Part) -> Slot:
    described = field.metadata["input"]
    return Slot(
        field=field.name,
        table=table,
        input=described,
        default=default,
        group=part.group,
        body=part.body,
        both=part.both,
    )


def by_name(kind: type[T]) -> type[T]:
    """Make a dataclass of inputs refuse names that it does not have, with the nearest one, and unnamed values."""
    make: Callable[..., None] = kind.__init__

    @wraps(make)
    def checked(self: T, *unnamed: Any, **values: Any) -> None:
        if unnamed:
            named = ", ".join(f"{field.name}=..." for field in fields(kind)[:2])
            raise InputError(f"{kind.__name__} takes inputs by their names: {kind.__name__}({named})")
        for name in values.keys() - {field.name for field in fields(kind)}:
            raise InputError(renamed(name) or f"{name}: {kind.__name__} has no such input{_meant(kind, name)}")
        make(self, **values)

    # mypy: a method is no plain function
    setattr(kind, "__init__", checked)  # noqa: B010
    return kind


def _meant(kind: type[DataclassInstance], name: str) -> str:
    """Where an input stands that is none of a dataclass's own, or which of its own may be meant."""
    known: dict[str, str] = {}
    for field in fields(kind):
        known[field.name] = field.name
        if described := field.metadata.get("input"):
            known |= dict.fromkeys((described.key or field.name, *described.options), field.name)
            continue
        part = _default(field)
        if name in (inner.name for inner in fields(part)):
            return f"; it is one of {type(part).__name__}: {field.name}={type(part).__name__}({name}=...)"
    return nearest(name, known)


def _default(field: Field[Any]) -> Any:
    return (
        field.default_factory() if field.default is MISSING and field.default_factory is not MISSING else field.default
    )


def check_inputs(instance: DataclassInstance) -> None:
    """Check each field that has a description, and that each part is one; None is allowed where it is the default.

    Raises
    ------
    InputError
        For the first value outside its range.
    """
    for field in fields(instance):
        value = getattr(instance, field.name)
        if "part" in field.metadata:
            part = type(_default(field))
            if not isinstance(value, part):
                raise InputError(
                    f"{field.name} is {value!r}; allowed: a {part.__name__}, such as {field.name}={part.__name__}(...)"
                )
        if "input" in field.metadata and not (value is None and field.default is None):
            field.metadata["input"].check(value)
