"""Arrays and values of every stored kind.

They are read back on the running interpreter to the last bit.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from types import UnionType
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
from numpy.typing import NDArray

from fecontact.arrays import Bools, Floats, Integers
from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.files import format_json
from fecontact.judging.solved_load import SolvedLoad
from fecontact.outputs.records import stored
from fecontact.placement.along_track import PlacedIrregularities
from fecontact.placement.wheel_on_rail import Placement
from fecontact.profiles.curve import Profile


@dataclass(frozen=True, kw_only=True, eq=False)
class EveryKind:
    """A field of each kind that stored results have.

    The arrays have each type name that NumPy gives them.
    """

    floats: NDArray[np.float64]
    alias: Floats
    integers: Integers
    flags: Bools
    bare: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
    optional: Floats | None
    missing: Floats | None
    arrays: tuple[Floats, ...]
    by_name: Mapping[str, Mapping[str, Floats]]
    number: float
    not_a_number: float
    text: str
    flag: bool
    parts: "tuple[EveryKind, ...]"


def test_every_kind_of_array_is_read_back_on_this_python():
    line, table = np.array([0.1, -np.pi, 1e-300]), np.arange(6.0).reshape(2, 3) / 7.0
    values = dict(
        floats=table, alias=line, integers=np.array([1, -2**53]), flags=np.array([[True], [False]]), bare=np.array(0.3),
        optional=line, missing=None, arrays=(line, table), by_name={"rail": {"top": table}}, number=1 / 3,
        not_a_number=math.nan, text="left", flag=True,
    )  # fmt: skip
    value = EveryKind(**values, parts=(EveryKind(**values, parts=()),))
    value_read = stored._restore_value(EveryKind, json.loads(format_json(stored._to_plain(value, {}, "value"))), {})
    for first, second in ((value, value_read), (value.parts[0], value_read.parts[0])):
        for field in fields(EveryKind):
            if field.name != "parts":
                assert_same_kind(getattr(first, field.name), getattr(second, field.name))


def assert_same_kind(value: Any, value_read: Any) -> None:
    """Compare type, shape, number type and bits, also in tuples and mappings."""
    assert type(value) is type(value_read)
    if isinstance(value, np.ndarray):
        assert (value.dtype, value.shape, value.tobytes()) == (value_read.dtype, value_read.shape, value_read.tobytes())
    elif isinstance(value, tuple):
        for first, second in zip(value, value_read, strict=True):
            assert_same_kind(first, second)
    elif isinstance(value, dict):
        assert_same_kind(tuple(value.items()), tuple(value_read.items()))
    else:
        assert value == value_read or (value != value and value_read != value_read)


def test_an_annotation_that_cannot_be_read_back_is_an_error():
    """A list that stays a list would fail far from here.

    Arrays did so on Python 3.12 with NumPy 2.5.
    """
    with pytest.raises(TypeError, match="a stored list cannot be converted to list"):
        stored._restore_value(list[float], [0.0], {})


def test_stored_results_have_only_kinds_that_are_read_back():
    """Annotations of all stored values.

    Everything except numbers, texts and flags is read by its own branch.
    """
    leaves, kinds_met = set(), set()

    def walk(kind: Any) -> None:
        """Collect the kinds of values inside a kind of stored value."""
        kind = stored._resolve_alias(kind)
        origin = get_origin(kind)
        if kind in (Rung, Case, Profile, PlacedIrregularities, type(None)) or kind in kinds_met:
            return
        kinds_met.add(kind)
        if is_dataclass(kind):
            for hint in stored._type_hints(kind).values():
                walk(hint)
        elif origin in (tuple, UnionType, Mapping):
            for argument in get_args(kind):
                walk(argument)
        else:
            leaves.add(origin or kind)

    walk(SolvedLoad)
    walk(Placement)
    assert np.ndarray in leaves
    assert leaves <= {np.ndarray, float, int, bool, str, Literal, Ellipsis}, leaves
