"""Cases from a TOML file: keys with units, lists that are combined, and [[case]] tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

from fecontact.case import INPUTS, PARTS, Case, case_with
from fecontact.errors import InputError
from fecontact.files import toml_content
from fecontact.inputs.kinds import Number
from fecontact.inputs.slots import Slot
from fecontact.inputs.texts import nearest, parse_numbers, renamed

_INNERMOST = ("rail", "wheel", "load_N", "lateral_shift_mm")
_MOST_CASES = 100_000

Values = dict[Slot, list[Any]]


def toml_cases(path: Path, *, quick: bool = False) -> tuple[Case, ...]:
    """All cases of a file; `quick` takes the resolution of that name for each.

    Raises
    ------
    InputError
        If the file cannot be read, or has a key, a type or a value that is not allowed.
    """
    data = _parsed(path)
    with _named(f"study {path}"):
        tables = data.pop("case", None)
        common = _values(data)
        if tables is None:
            return _combined(common, quick)
        if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
            raise InputError("case: cases are given as tables, each of which begins with the line [[case]]")
    cases: list[Case] = []
    for number, table in enumerate(tables, start=1):
        with _named(f"study {path}, [[case]] {number}"):
            cases += _combined(common | _values(table, "case."), quick)
    return tuple(cases)


def case_of(table: Mapping[str, Any]) -> Case:
    """The case that the table `case` of another file describes, with the keys of a study.

    Raises
    ------
    InputError
        For a key or a value that is not allowed, and for lists, which make several cases.
    """
    with _named("[case]"):
        cases = _combined(_values(table, "case."), quick=False)
        if len(cases) > 1:
            raise InputError(f"its lists make {len(cases)} cases; allowed: one; give one value for each key")
    return cases[0]


def _parsed(path: Path) -> dict[str, Any]:
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"study {path}: it cannot be read ({error})") from error
    return toml_content(text, f"study {path}")


@contextmanager
def _named(where: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _values(data: Mapping[str, Any], prefix: str = "") -> Values:
    """Lists of values, of which most have one, by their inputs."""
    values: Values = {}
    for key, value in data.items():
        if key not in PARTS:
            slot = _slot(key, "", prefix)
            with _named(key):
                values[slot] = _listed(slot, value)
        elif isinstance(value, dict):
            with _named(f"[{prefix}{key}]"):
                values |= _table(value, key, prefix)
        else:
            raise InputError(f"{key} is {value!r}; it is a table, which begins with the line [{prefix}{key}]")
    return values


def _table(data: Mapping[str, Any], table: str, prefix: str) -> Values:
    values: Values = {}
    for key, value in data.items():
        slot = _slot(key, table, prefix)
        with _named(key):
            if isinstance(value, list) and not slot.input.each:
                raise InputError(f"it is {value!r}; allowed: {slot.input.allowed}; a list cannot stand in a table")
            values[slot] = [slot.input.read(value)]
    return values


def _slot(key: str, table: str, prefix: str) -> Slot:
    own = {slot.key: slot for slot in INPUTS if slot.table == table}
    if key in own:
        return own[key]
    if old := renamed(key):
        raise InputError(old)
    elsewhere = [f"[{prefix}{slot.table}]" if slot.table else "no table" for slot in INPUTS if slot.key == key]
    beside = () if table else tuple(PARTS) if prefix else (*PARTS, "case")
    known = {name: name for name in (*own, *beside)}
    # a user may know an input by its name in Python or on the command line
    known |= {name: slot.key for slot in own.values() for name in (slot.field, *slot.input.options)}
    meant = f"; {key} stands in {' or '.join(elsewhere)}" if elsewhere else nearest(key, known)
    tables = "" if table else f"; tables: {', '.join(f'[{prefix}{name}]' for name in PARTS)}"
    raise InputError(f"{key}: there is no such key{meant}; keys: {', '.join(own)}{tables}")


def _listed(slot: Slot, value: Any) -> list[Any]:
    described = slot.input
    if isinstance(value, list) and not (value and described.one_list(value)):
        if not value:
            raise InputError(f"it is an empty list; allowed: {described.allowed}, or a list of such values")
        return [read for item in value for read in _listed_item(slot, item)]
    return _listed_item(slot, value)


def _listed_item(slot: Slot, value: Any) -> list[Any]:
    described = slot.input
    if not (isinstance(described, Number) and not described.forms and isinstance(value, str)):
        return [described.read(value)]
    try:
        numbers = parse_numbers(value, described.label)
    except InputError as error:
        raise InputError(f"{error}; allowed: {described.allowed}") from error
    return [described.read(number) for number in numbers]


def _combined(values: Values, quick: bool) -> tuple[Case, ...]:
    if quick:
        values = values | {_slot("resolution", "", ""): ["quick"]}
    # the last one changes fastest, so that a series over the shift stays together
    slots = sorted(values, key=_place)
    count = math.prod(len(values[slot]) for slot in slots)
    if count > _MOST_CASES:
        raise InputError(f"the lists make {count} cases; allowed are {_MOST_CASES}; take shorter lists or [[case]]")
    return tuple(
        case_with(dict(zip(slots, combination, strict=True))) for combination in product(*(values[s] for s in slots))
    )


def _place(slot: Slot) -> tuple[int, int]:
    return (_INNERMOST.index(slot.field) if slot.field in _INNERMOST else -1, INPUTS.index(slot))
