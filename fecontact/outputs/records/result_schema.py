"""Layout of result.json: its JSON schema, its columns in tables, and the data dictionary."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product
from typing import Any

from fecontact.contact_theories.registry import HERTZ_OF_EACH_SIDE, THEORIES
from fecontact.errors import ProgramError
from fecontact.feature_registry import load_offers
from fecontact.judging.measures import MEASURES, MISFITS
from fecontact.outputs.flat_records import Record, relative_name
from fecontact.outputs.pair_names import BODIES
from fecontact.own_criterion import OWN_PREFIX, is_own

_SIMPLE_TYPES: dict[str, dict[str, Any]] = {
    "number": {"type": "number"},
    "integer": {"type": "integer"},
    "boolean": {"type": "boolean"},
    "text": {"type": "string"},
    "texts": {"type": "array", "items": {"type": "string"}},
    "numbers": {"type": "array", "items": {"type": ["number", "null"]}},
    "inputs": {"type": "object"},
}
# Endings of keys that are units, the longest first, and their units.
_UNITS = {
    "_GN_per_m15": "GN/m^1.5",
    "_percent": "%",
    "_N_per_mm15": "N/mm^1.5",
    "_N_per_mm": "N/mm",
    "_per_mm": "1/mm",
    "_of_muN": "mu N",
    "_over_b": "b",
    "_Nmm": "N mm",
    "_Nmm2": "N mm²",
    "_mm2": "mm²",
    "_mm3": "mm³",
    "_MPa": "MPa",
    "_rad": "rad",
    "_mrad": "mrad",
    "_kN": "kN",
    "_mm": "mm",
    "_MB": "MB",
    "_N": "N",
    "seconds": "s",
}
# Measures of a user are beside the built-in measures everywhere.
_OWN_PATTERNS = {f"^{OWN_PREFIX}": {"type": ["number", "null"]}}
_STEP_MEASURES = ("p_max_MPa", "area_mm2", "approach_mm")
_NUMBER_TYPES = ("number", "integer", "numbers", "measures", "all measures", "contributions")


@dataclass(frozen=True, kw_only=True)
class KeyDeclaration:
    """Declaration of a key of `result.json`.

    Attributes
    ----------
    key
        Path of the key, joined by dots. `<measure>` is each measure, `[]` the members of a list.
    type_name
        Type of the value, with `?` if it may be null.
    unit
        Unit of a number; `-` for a number without a unit, empty for other values.
    meaning
        Meaning in words.
    places
        Places where the value is shown, joined by commas; empty if it is in the file alone.
    """

    key: str
    type_name: str
    unit: str
    meaning: str
    places: str


@cache
def _read_keys() -> dict[str, Any]:
    """Declarations of the core and of all features: keys, shapes and columns."""
    text = (files("fecontact.outputs.records") / "result_keys.toml").read_text("utf-8")
    declared: dict[str, Any] = tomllib.loads(text)
    for name, telling in load_offers("TELLINGS").items():
        if not telling.keys:
            declared["result"][name] = "inputs? | values of the feature; null where it has none"
            continue
        feature_keys = tomllib.loads(telling.keys)
        declared["result"][name] = feature_keys["result"]
        declared["shapes"] |= feature_keys["shapes"]
        declared["columns"]["of_load"] += feature_keys["columns"]
    shapes = declared["shapes"]
    for shape, keys in shapes.items():
        if "include" in keys:
            # the included keys come first
            shapes[shape] = shapes[keys.pop("include")] | keys
    return declared


def result_schema() -> dict[str, Any]:
    """JSON schema of `result.json`.

    Returns
    -------
    dict
        Schema of draft 2020-12. All keys are required; keys that do not apply to a case are null.

    Examples
    --------
    >>> import fecontact
    >>> fecontact.result_schema()["properties"]["status"]["type"]
    'string'
    """
    declared = _read_keys()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "fecontact result",
        **_object_schema(declared["result"]),
        "$defs": {name: _object_schema(shape) for name, shape in declared["shapes"].items()},
    }


def _object_schema(keys: Mapping[str, str]) -> dict[str, Any]:
    """Schema of an object with declared keys, all of them required."""
    properties: dict[str, Any] = {}
    for key, declaration in keys.items():
        type_name, meaning, _ = _split(declaration)
        if key == "measures":
            properties |= _measures_schema(MEASURES)["properties"]
        else:
            properties[key] = _type_schema(type_name) | {"description": meaning}
    patterns = {"patternProperties": _OWN_PATTERNS} if "measures" in keys else {}
    return {
        "type": "object",
        "properties": properties,
        **patterns,
        "required": [*properties],
        "additionalProperties": False,
    }


def _type_schema(type_name: str) -> dict[str, Any]:
    """JSON schema of a value of a declared type, such as `list of number`.

    A type with `?` may be null. A name that is not declared here refers to a definition of the schema.
    """
    if type_name.endswith("?") or type_name.startswith("optional "):
        return {"anyOf": [_type_schema(type_name.removesuffix("?").removeprefix("optional ")), {"type": "null"}]}
    if type_name in _SIMPLE_TYPES:
        return dict(_SIMPLE_TYPES[type_name])
    if type_name in ("measures", "all measures"):
        return _measures_schema(MEASURES if type_name == "measures" else (*MEASURES, *MISFITS))
    if type_name == "contributions":
        return {"type": "object", "additionalProperties": {"type": "number"}}
    if type_name.startswith("list of "):
        return {"type": "array", "items": _type_schema(type_name.removeprefix("list of "))}
    if type_name.startswith("per "):
        name, _, member = type_name.removeprefix("per ").partition(" of ")
        return _members_schema(name, member)
    return {"$ref": f"#/$defs/{type_name}"}


def _members_schema(name: str, member: str) -> dict[str, Any]:
    """Schema of an object with a member for some names."""
    schema: dict[str, Any] = {"type": "object", "additionalProperties": _type_schema(member)}
    known_names = {"measure": (*MEASURES, *MISFITS), "theory": tuple(THEORIES), "body": BODIES}.get(name)
    if known_names is not None:
        schema["propertyNames"] = {"enum": list(known_names)}
    if name == "measure":
        schema["propertyNames"] = {"anyOf": [schema["propertyNames"], {"pattern": f"^{OWN_PREFIX}"}]}
    return schema | ({"required": list(known_names)} if name in ("theory", "body") and known_names else {})


def _measures_schema(measures: tuple[str, ...]) -> dict[str, Any]:
    """Schema of an object with a number or null for each measure."""
    return {
        "type": "object",
        "properties": {measure: {"type": ["number", "null"]} for measure in measures},
        "patternProperties": _OWN_PATTERNS,
        "required": list(measures),
        "additionalProperties": False,
    }


def _split(declaration: str) -> tuple[str, str, str]:
    """Type, meaning and places of a declaration."""
    type_name, _, rest = declaration.partition(" | ")
    meaning, _, places = rest.partition(" | ")
    return type_name, meaning, places


def undeclared_features() -> tuple[str, ...]:
    """Names of the features whose keys are not declared.

    Returns
    -------
    tuple of str
        Names; all numbers and texts of their records are columns of tables.
    """
    return tuple(name for name, telling in load_offers("TELLINGS").items() if not telling.keys)


def complete_record(shape: str, record: Mapping[str, Any]) -> Record:
    """Record with all keys of a shape.

    Keys that the given record does not have are None.

    Parameters
    ----------
    shape
        Name of the shape in `result_keys.toml`.
    record
        Record with some of the keys, and with measures of a user if the shape has measures.

    Returns
    -------
    Record
        Keys in the declared order.

    Raises
    ------
    ProgramError
        If the record has a key that is not declared.
    """
    names = _read_keys()["shapes"][shape]
    declared = [key for name in names for key in (MEASURES if name == "measures" else (name,))]
    own_keys = [key for key in record if "measures" in names and is_own(key)]
    if undeclared := [key for key in record if key not in (*declared, *own_keys)]:
        raise ProgramError(f"keys {', '.join(undeclared)} of {shape} are not declared in result_keys.toml")
    return {key: record.get(key) for key in (*declared, *own_keys)}


def iterate_keys() -> Iterator[KeyDeclaration]:
    """Iterate over the declared keys of `result.json`, in the order of the file.

    Yields
    ------
    KeyDeclaration
        Key with unit, meaning and places; `<measure>` is each measure.
    """
    declared = _read_keys()
    yield from _walk(declared["result"], declared["shapes"], "", "")


def _walk(
    keys: Mapping[str, str], shapes: Mapping[str, Mapping[str, str]], prefix: str, outer_places: str
) -> Iterator[KeyDeclaration]:
    """Iterate over the keys of nested objects; places are inherited."""
    for name, declaration in keys.items():
        type_name, meaning, places = _split(declaration)
        places = places or outer_places
        if name == "measures":
            yield KeyDeclaration(
                key=f"{prefix}<measure>",
                type_name="number",
                unit="of the name",
                meaning="value of each measure",
                places=places,
            )
            continue
        path, inner = f"{prefix}{name}", type_name.removesuffix("?")
        while inner.startswith(("list of ", "per ")):
            first, _, inner = inner.partition(" of ")
            path += "[]" if first == "list" else f".<{first.removeprefix('per ')}>".replace("<...>", "<name>")
            inner = inner.removesuffix("?").removeprefix("optional ")
        yield KeyDeclaration(
            key=path,
            type_name=type_name,
            unit=find_unit(name) if inner in _NUMBER_TYPES else "",
            meaning=meaning,
            places=places,
        )
        if inner in shapes:
            yield from _walk(shapes[inner], shapes, f"{path}.", places)


def find_unit(key: str) -> str:
    """Unit of a number by the ending of its key; `-` without a unit.

    Parameters
    ----------
    key
        Key of a record, or column of a table.

    Returns
    -------
    str
        Unit.

    Examples
    --------
    >>> from fecontact.outputs.records.result_schema import find_unit
    >>> find_unit("p_max_MPa"), find_unit("overlap")
    ('MPa', '-')
    """
    return next((unit for ending, unit in _UNITS.items() if key.endswith(ending)), "-")


def list_columns(group: str, own_measures: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Declared columns of a row.

    Parameters
    ----------
    group
        `of_load` for the columns of a load, `of_case` for further columns of a case.
    own_measures
        Names of a user's measures, which have the columns of the built-in measures.

    Returns
    -------
    tuple of str
        Names of columns in order.
    """
    return _list_columns(group, tuple(THEORIES), own_measures)


# A map makes a row for each cell. Without the cache the columns take two fifths of the time of a row.
@cache
def _list_columns(group: str, theories: tuple[str, ...], own_measures: tuple[str, ...]) -> tuple[str, ...]:
    """Declared columns of a row with the columns of some theories."""
    columns = (column for name in _read_keys()["columns"][group] for column in _expand(name, theories, own_measures))
    return tuple(dict.fromkeys(columns))


def list_column_patterns() -> list[str]:
    """Declared columns from the record, with placeholders.

    Returns
    -------
    list of str
        Columns of a load, then further columns of a case, in order.
    """
    columns = _read_keys()["columns"]
    return [*columns["of_load"], *columns["of_case"]]


def row_column_meanings() -> dict[str, str]:
    """Meanings of the columns of a row that are not from the record.

    Returns
    -------
    dict of str to str
        Meanings by column.
    """
    return dict(_read_keys()["row_columns"])


def _expand(column: str, theories: Sequence[str], own_measures: Sequence[str] = ()) -> Iterator[str]:
    """Columns of a declared column with placeholders."""
    choices = {
        "<size>": (*MEASURES, *own_measures),
        "<deviation>": tuple(relative_name(measure) for measure in (*MEASURES, *MISFITS, *own_measures)),
        "<step>": tuple(relative_name(measure) for measure in _STEP_MEASURES),
        "<hertz>": HERTZ_OF_EACH_SIDE,
        "<theory>": tuple(name for name in theories if name not in HERTZ_OF_EACH_SIDE),
        "<body>": BODIES,
    }
    column = re.sub(r"<name=(\w+)>", r"\1", column)
    placeholders = [placeholder for placeholder in choices if placeholder in column]
    for names in product(*(choices[placeholder] for placeholder in placeholders)):
        expanded = column
        for placeholder, name in zip(placeholders, names, strict=True):
            expanded = expanded.replace(placeholder, name)
        yield expanded
