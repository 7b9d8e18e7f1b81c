"""Inputs at their places: fields of dataclasses, each found by its name, read from a table and checked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import wraps
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar, dataclass_transform

from fecontact.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance
from fecontact.inputs.kinds import Input
from fecontact.inputs.texts import nearest, renamed

# --- Inputs at their places: `metadata={"input": ...}` of a field, and `metadata={"part": ...}` of one that has fields.

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A field with fields of its own, in files a table.

    Attributes
    ----------
    group
        Group of its inputs that have none of their own.
    body
        The body that it belongs to, if another part has the same inputs for the other body; on the command line it
        stands before their names.
    both
        Whether the names without the body give them for both at once.
    option
        Name of the one option that gives all of them; empty where each has its own.
    """

    group: str
    body: str = ""
    both: bool = False
    option: str = ""


def part(kind: Callable[[], T], group: str, **more: Any) -> T:
    """A field with fields of its own; `more` is what `Part` has."""
    made: T = field(default_factory=kind, metadata={"part": Part(group=group, **more)})
    return made


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
        if self.option:
            return (f"--{self.option}",)
        return tuple(f"--{self.body}-{name}" if self.body else f"--{name}" for name in self.stems)

    @property
    def common_names(self) -> tuple[str, ...]:
        """The names that give it for both bodies; none if nothing does."""
        return tuple(f"--{name}" for name in self.stems) if self.both else ()

    @property
    def stems(self) -> tuple[str, ...]:
        """Its names without the body's."""
        return self.input.options or (self.key.lower().replace("_", "-"),)

    @property
    def shown_default(self) -> str:
        """Its default as a user would write it."""
        return "none" if self.default is None else self.input.shown(self.default)


def described(kind: Any) -> dict[str, Input]:
    """What the fields of a dataclass are that are inputs, by name."""
    return {entry.name: entry.metadata["input"] for entry in fields(kind) if "input" in entry.metadata}


def slots(whole: DataclassInstance) -> tuple[Slot, ...]:
    """All inputs of a dataclass and of its parts, with the values of this instance as defaults."""
    found: list[Slot] = []
    for entry in fields(whole):
        own: Part | None = entry.metadata.get("part")
        value = getattr(whole, entry.name)
        for name, one in ({entry.name: entry.metadata["input"]} if own is None else described(value)).items():
            place = {**vars(own or Part(group="")), "table": entry.name if own else "", "field": name}
            default = getattr(value, name) if own else value
            found.append(Slot(**{**place, "group": one.group or place["group"]}, input=one, default=default))
    return tuple(found)


@dataclass_transform(kw_only_default=True, frozen_default=True)
def inputs(kind: type[T]) -> type[T]:
    """Make a frozen dataclass whose values are checked, before its own `__post_init__`.

    It refuses names that it does not have, with the nearest one, missing ones and unnamed values. Its descriptions get
    what the names of its fields say.
    """
    own: Callable[[T], None] | None = kind.__dict__.get("__post_init__")

    def check(self: T) -> None:
        _check(self)
        if own is not None:
            own(self)

    # mypy: a method is no plain function
    setattr(kind, "__post_init__", check)  # noqa: B010
    made: Any = dataclass(frozen=True, kw_only=True)(kind)
    make: Callable[..., None] = made.__init__
    for entry in fields(made):
        if one := entry.metadata.get("input"):
            entry.metadata = MappingProxyType({**entry.metadata, "input": one.of_field(entry.name)})

    @wraps(make)
    def checked(self: T, *unnamed: Any, **values: Any) -> None:
        if unnamed:
            named = ", ".join(f"{entry.name}=..." for entry in fields(made)[:2])
            raise InputError(f"{kind.__name__} takes inputs by their names: {kind.__name__}({named})")
        for name in values.keys() - {entry.name for entry in fields(made)}:
            raise InputError(renamed(name) or f"{name}: {kind.__name__} has no such input{_meant(made, name)}")
        for entry in fields(made):
            if entry.default is MISSING and entry.default_factory is MISSING and entry.name not in values:
                raise InputError(f"{entry.name} is missing; give it: {kind.__name__}({entry.name}=...)")
        make(self, **values)

    made.__init__ = checked
    return kind


def read_table(kind: type[T], name: str, table: Any) -> T:
    """The value that a table of a file describes, whose keys are the names of inputs.

    Raises
    ------
    InputError
        For no table, unknown and missing keys, and values that are none, with the table's name.
    """
    known = described(kind)
    if not isinstance(table, Mapping):
        raise InputError(f"[{name}] is missing; give it, with {', '.join(known)}")
    try:
        return kind(**{key: known[key].read(value) if key in known else value for key, value in table.items()})
    except InputError as error:
        raise InputError(f"[{name}]: {error}") from error


def _meant(kind: Any, name: str) -> str:
    """Where an input stands that is none of a dataclass's own, or which of its own may be meant."""
    own = described(kind)
    known = {entry.name: entry.name for entry in fields(kind)}
    for field_name, one in own.items():
        known |= dict.fromkeys((one.key or field_name, *one.options), field_name)
    for entry in fields(kind):
        if "part" in entry.metadata and name in described(inner := type(_default(entry))):
            return f"; it is one of {inner.__name__}: {entry.name}={inner.__name__}({name}=...)"
    return nearest(name, known)


def _default(entry: Field[Any]) -> Any:
    return entry.default if entry.default_factory is MISSING else entry.default_factory()


def _check(instance: Any) -> None:
    """Check each field that has a description, and that each part is one; None is allowed where it is the default.

    Raises
    ------
    InputError
        For the first value outside its range.
    """
    for entry in fields(instance):
        value = getattr(instance, entry.name)
        if "part" in entry.metadata and not isinstance(value, part := type(_default(entry))):
            raise InputError(
                f"{entry.name} is {value!r}; allowed: a {part.__name__}, such as {entry.name}={part.__name__}(...)"
            )
        if "input" in entry.metadata and not (value is None and entry.default is None):
            entry.metadata["input"].check(value)
