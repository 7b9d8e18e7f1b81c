"""Cases from a TOML file: keys with units, lists that are combined, and [[case]] tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

from fecontact.case import INPUTS, PARTS, Case, make_case
from fecontact.errors import InputError
from fecontact.files import read_toml
from fecontact.inputs.kinds import Number
from fecontact.inputs.slots import InputPlace
from fecontact.inputs.texts import explain_former_name, parse_numbers, suggest_name

_FASTEST_FIELDS = ("rail", "wheel", "load_N", "lateral_shift_mm")
_MAX_CASES = 100_000

Values = dict[InputPlace, list[Any]]


def read_toml_cases(path: Path, *, quick: bool = False) -> tuple[Case, ...]:
    """Read all cases of a TOML file.

    Parameters
    ----------
    path
        File.
    quick
        Whether to use the resolution "quick" for each case.

    Returns
    -------
    tuple of Case
        The cases.

    Raises
    ------
    InputError
        If the file cannot be read, or has a key, a type or a value that is not allowed.
    """
    document = read_toml(path, f"study {path}")
    with _name_in_errors(f"study {path}"):
        tables = document.pop("case", None)
        common = _read_values(document)
        if tables is None:
            return _combine(common, quick)
        if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
            raise InputError("case: give each case as a table that begins with the line [[case]]")
    cases: list[Case] = []
    for number, table in enumerate(tables, start=1):
        with _name_in_errors(f"study {path}, [[case]] {number}"):
            cases += _combine(common | _read_values(table, "case."), quick)
    return tuple(cases)


def read_case_table(table: Mapping[str, Any]) -> Case:
    """Read a case from the table `case` of another file.

    The keys are the keys of a study.

    Parameters
    ----------
    table
        The table.

    Returns
    -------
    Case
        The case.

    Raises
    ------
    InputError
        For a key or a value that is not allowed, and for lists, which make several cases.
    """
    with _name_in_errors("[case]"):
        cases = _combine(_read_values(table, "case."), quick=False)
        if len(cases) > 1:
            raise InputError(f"the lists make {len(cases)} cases; allowed: 1; give one value per key")
    return cases[0]


@contextmanager
def _name_in_errors(where: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _read_values(inputs_by_key: Mapping[str, Any], prefix: str = "") -> Values:
    """Lists of values by their inputs; most lists have a single value.

    `prefix` is the path of the outer table, with a point at its end. Tables inside are read too.

    Raises
    ------
    InputError
        For an unknown key, or a table that is given as a value.
    """
    values: Values = {}
    for key, value in inputs_by_key.items():
        if key not in PARTS:
            slot = _find_slot(key, "", prefix)
            with _name_in_errors(key):
                values[slot] = _read_list(slot, value)
        elif isinstance(value, dict):
            with _name_in_errors(f"[{prefix}{key}]"):
                values |= _read_table(value, key, prefix)
        else:
            raise InputError(f"{key} is {value!r}; give a table that begins with the line [{prefix}{key}]")
    return values


def _read_table(entries: Mapping[str, Any], table: str, prefix: str) -> Values:
    """Values of a table of inputs, such as `criteria`.

    Raises
    ------
    InputError
        For a key or a value that is not allowed, and for lists.
    """
    values: Values = {}
    for key, value in entries.items():
        slot = _find_slot(key, table, prefix)
        with _name_in_errors(key):
            if isinstance(value, list) and not slot.input.each:
                raise InputError(f"it is {value!r}; allowed: {slot.input.allowed}; a table must not have lists")
            values[slot] = [slot.input.read(value)]
    return values


def _find_slot(key: str, table: str, prefix: str) -> InputPlace:
    """Input with a key in a table.

    Raises
    ------
    InputError
        If there is no such key; the message has the nearest key or the right table.
    """
    slots_by_key = {slot.key: slot for slot in INPUTS if slot.table == table}
    if key in slots_by_key:
        return slots_by_key[key]
    if advice := explain_former_name(key):
        raise InputError(advice)
    other_tables = [
        f"[{prefix}{slot.table}]" if slot.table else "the keys above all tables" for slot in INPUTS if slot.key == key
    ]
    table_names = () if table else tuple(PARTS) if prefix else (*PARTS, "case")
    slots_by_name = {name: name for name in (*slots_by_key, *table_names)}
    # a user may use the name of an input in Python or on the command line
    slots_by_name |= {name: slot.key for slot in slots_by_key.values() for name in (slot.field, *slot.input.options)}
    suggestion = f"; {key} belongs to {' or '.join(other_tables)}" if other_tables else suggest_name(key, slots_by_name)
    tables = "" if table else f"; tables: {', '.join(f'[{prefix}{name}]' for name in PARTS)}"
    raise InputError(f"{key}: there is no such key{suggestion}; keys: {', '.join(slots_by_key)}{tables}")


def _read_list(slot: InputPlace, value: Any) -> list[Any]:
    """Values of a list, or a list with a single value."""
    description = slot.input
    if isinstance(value, list) and not (value and description.one_list(value)):
        if not value:
            raise InputError(f"the list is empty; allowed: {description.allowed}, or a list of such values")
        return [element_value for element in value for element_value in _read_element(slot, element)]
    return _read_element(slot, value)


def _read_element(slot: InputPlace, value: Any) -> list[Any]:
    """Values of an element of a list; a text may be a range of numbers."""
    description = slot.input
    if not (isinstance(description, Number) and not description.forms and isinstance(value, str)):
        return [description.read(value)]
    try:
        numbers = parse_numbers(value, description.label)
    except InputError as error:
        raise InputError(f"{error}; allowed: {description.allowed}") from error
    return [description.read(number) for number in numbers]


def _combine(values: Values, quick: bool) -> tuple[Case, ...]:
    """Cases for all combinations of values.

    Raises
    ------
    InputError
        If there are more than `_MAX_CASES` combinations.
    """
    if quick:
        values = values | {_find_slot("resolution", "", ""): ["quick"]}
    # the last input changes fastest, so that a series over the shift stays together
    slots = sorted(values, key=_sorting_key)
    count = math.prod(len(values[slot]) for slot in slots)
    if count > _MAX_CASES:
        raise InputError(f"the lists make {count} cases; allowed: at most {_MAX_CASES}; use shorter lists or [[case]]")
    return tuple(
        make_case(dict(zip(slots, combination, strict=True)))
        for combination in product(*(values[combined_slot] for combined_slot in slots))
    )


def _sorting_key(slot: InputPlace) -> tuple[int, int]:
    return (_FASTEST_FIELDS.index(slot.field) if slot.field in _FASTEST_FIELDS else -1, INPUTS.index(slot))
