"""Inputs at their places in dataclasses: found by name, read from tables and checked."""

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
from fecontact.inputs.texts import explain_former_name, suggest_name

# --- Inputs at their places: a field with `metadata={"input": ...}`, and a field with inputs inside, with
# `metadata={"part": ...}`.

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class NestedInputs:
    """Dataclass field with input fields inside; a table in files.

    Attributes
    ----------
    group
        Group of the inputs inside that have no group.
    body
        Body to which the field belongs, if another field has equal inputs for the other body. On the command line the
        body is the prefix of the inputs' names.
    both
        Whether the names without the prefix set the inputs of both bodies.
    option
        Name of a single option that sets all inputs inside; empty if each input has its option.
    """

    group: str
    body: str = ""
    both: bool = False
    option: str = ""


def nested_inputs(kind: Callable[[], T], group: str, **attributes: Any) -> T:
    """Dataclass field with input fields inside; `attributes` are attributes of `NestedInputs`.

    Parameters
    ----------
    kind
        Dataclass of the inputs.
    group
        Group of the help.
    **attributes
        Further attributes of `NestedInputs`.

    Returns
    -------
    object
        The field, for the body of an input dataclass.
    """
    nested_field: T = field(default_factory=kind, metadata={"part": NestedInputs(group=group, **attributes)})
    return nested_field


@dataclass(frozen=True, kw_only=True)
class InputPlace(NestedInputs):
    """Input with its place in a dataclass.

    Attributes
    ----------
    field, table
        Name of the field, and name of the field that contains it (empty at the top level).
    input, default
        Description and default value.
    """

    field: str
    table: str
    input: Input
    default: Any

    @property
    def place(self) -> tuple[str, str]:
        """Names of the table and of the field."""
        return self.table, self.field

    def of(self, instance: Any) -> Any:
        """Value of the input in an instance of the dataclass."""
        return getattr(getattr(instance, self.table) if self.table else instance, self.field)

    @property
    def key(self) -> str:
        """Key in files."""
        return self.input.key or self.field

    @property
    def names(self) -> tuple[str, ...]:
        """Names on the command line."""
        if self.option:
            return (f"--{self.option}",)
        return tuple(f"--{self.body}-{name}" if self.body else f"--{name}" for name in self.stems)

    @property
    def common_names(self) -> tuple[str, ...]:
        """Names on the command line that set the inputs of both bodies; empty without such names."""
        return tuple(f"--{name}" for name in self.stems) if self.both else ()

    @property
    def stems(self) -> tuple[str, ...]:
        """Names on the command line without hyphens and without the body."""
        return self.input.options or (self.key.lower().replace("_", "-"),)

    @property
    def shown_default(self) -> str:
        """Text of the default as a user would write it."""
        return "none" if self.default is None else self.input.shown(self.default)


def list_descriptions(kind: Any) -> dict[str, Input]:
    """Descriptions of a dataclass's input fields, by field name."""
    return {member.name: member.metadata["input"] for member in fields(kind) if "input" in member.metadata}


def list_input_places(instance: DataclassInstance) -> tuple[InputPlace, ...]:
    """Inputs of a dataclass and of the dataclasses inside it, with their places.

    Parameters
    ----------
    instance
        Instance with the default values.

    Returns
    -------
    tuple of InputPlace
        Inputs in the order of the fields.
    """
    places: list[InputPlace] = []
    for member in fields(instance):
        nested: NestedInputs | None = member.metadata.get("part")
        value = getattr(instance, member.name)
        for name, description in (
            {member.name: member.metadata["input"]} if nested is None else list_descriptions(value)
        ).items():
            attributes = {
                **vars(nested or NestedInputs(group="")),
                "table": member.name if nested else "",
                "field": name,
            }
            default = getattr(value, name) if nested else value
            places.append(
                InputPlace(
                    **{**attributes, "group": description.group or attributes["group"]},
                    input=description,
                    default=default,
                )
            )
    return tuple(places)


@dataclass_transform(kw_only_default=True, frozen_default=True)
def input_dataclass(kind: type[T]) -> type[T]:
    """Make a frozen dataclass with checked values.

    The values are checked before the `__post_init__` of the class. Empty labels, units and keys of its descriptions are
    derived from the names of the fields.

    Parameters
    ----------
    kind
        Class with annotated fields.

    Returns
    -------
    type
        The class as a frozen dataclass with keyword arguments only.

    Raises
    ------
    InputError
        Raised by the dataclass for unrecognised names (with the nearest name as a suggestion), for missing names, for
        positional values and for invalid values.
    """
    post_init: Callable[[T], None] | None = kind.__dict__.get("__post_init__")

    def check(self: T) -> None:
        _check_fields(self)
        if post_init is not None:
            post_init(self)

    # mypy refuses a plain function as a method
    setattr(kind, "__post_init__", check)  # noqa: B010
    checked_class: Any = dataclass(frozen=True, kw_only=True)(kind)
    initialise: Callable[..., None] = checked_class.__init__
    for member in fields(checked_class):
        if description := member.metadata.get("input"):
            member.metadata = MappingProxyType(
                {**member.metadata, "input": description.complete_for_field(member.name)}
            )

    @wraps(initialise)
    def checked(self: T, *positional_values: Any, **values: Any) -> None:
        """Refuse positional values, unrecognised names and missing names, then initialise the dataclass."""
        if positional_values:
            example = ", ".join(f"{member.name}=..." for member in fields(checked_class)[:2])
            raise InputError(f"{kind.__name__} takes keyword arguments only: {kind.__name__}({example})")
        names = [member.name for member in fields(checked_class)]
        for name in (name for name in values if name not in names):
            remedy = _suggest_input(checked_class, name) or f"; allowed: {', '.join(names)}"
            raise InputError(explain_former_name(name) or f"{name} is not an input of {kind.__name__}{remedy}")
        for entry in fields(checked_class):
            if entry.default is MISSING and entry.default_factory is MISSING and entry.name not in values:
                raise InputError(f"{entry.name} is missing; give it: {kind.__name__}({entry.name}=...)")
        initialise(self, **values)

    checked_class.__init__ = checked
    return kind


def read_table(kind: type[T], name: str, table: Any) -> T:
    """Read an instance of a dataclass from a table of a file.

    Parameters
    ----------
    kind
        Dataclass with inputs.
    name
        Name of the table in messages.
    table
        Table with the names of inputs as keys.

    Returns
    -------
    T
        Instance of the dataclass.

    Raises
    ------
    InputError
        If the table is missing, for unrecognised or missing keys, and for invalid values. The message has the table's
        name.
    """
    descriptions = list_descriptions(kind)
    if not isinstance(table, Mapping):
        raise InputError(f"table [{name}] is missing; give it with the keys {', '.join(descriptions)}")
    try:
        return kind(
            **{key: descriptions[key].read(value) if key in descriptions else value for key, value in table.items()}
        )
    except InputError as error:
        raise InputError(f"[{name}]: {error}") from error


def _suggest_input(kind: Any, name: str) -> str:
    """Suggestion for the name of an input that a dataclass does not have.

    The suggestion names the inner dataclass that has this input, or the nearest name in the dataclass itself.
    """
    descriptions = list_descriptions(kind)
    proposals = {member.name: member.name for member in fields(kind)}
    for field_name, description in descriptions.items():
        proposals |= dict.fromkeys((description.key or field_name, *description.options), field_name)
    for member in fields(kind):
        if "part" in member.metadata and name in list_descriptions(inner := type(_default_value(member))):
            return f"; it is an input of {inner.__name__}: {member.name}={inner.__name__}({name}=...)"
    return suggest_name(name, proposals)


def _default_value(member: Field[Any]) -> Any:
    return member.default if member.default_factory is MISSING else member.default_factory()


def _check_fields(instance: Any) -> None:
    """Check all fields of an instance that have a description or inputs inside.

    A field with inputs inside must be an instance of its dataclass. None is allowed if None is the default.

    Raises
    ------
    InputError
        For the first value outside its range.
    """
    for member in fields(instance):
        value = getattr(instance, member.name)
        if "part" in member.metadata and not isinstance(value, inner := type(_default_value(member))):
            raise InputError(
                f"{member.name} is {value!r}; allowed: a {inner.__name__}, such as {member.name}={inner.__name__}(...)"
            )
        if "input" in member.metadata and not (value is None and member.default is None):
            member.metadata["input"].check(value)
