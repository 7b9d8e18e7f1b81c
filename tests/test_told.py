"""Results in their two forms: a record by its names, and a row by the paths of the record."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from marks import slow_but
from points import MEASURED_COLUMNS

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE, MULTI_HERTZ
from fecontact.outputs.flat_records import flatten, to_plain
from fecontact.outputs.records.results import case_row, input_columns, result_record
from fecontact.outputs.theory_records import judged_theories
from fecontact.solving.solve import CaseResult

COARSE = Case(resolution=(1.2, 0.9), refine="never")
CASES = {
    # two lobes that have grown together, between two contact points
    "two lobes": COARSE,
    "at a junction": replace(COARSE, rail="arcs:300/80@0", wheel="cylinder:460", inclination_rad=0.0, roll="given"),
}
# Beside its inputs a row has these that stand in the head of a record, or in other units.
HEAD = {
    *("status", "resolution", "contact_angle_mrad", "contact_rail_y_mm", "contact_wheel_y_mm", "at_junction"),
    *("contact_points", "warnings", *MEASURED_COLUMNS),
}


@dataclass(frozen=True)
class Inner:
    p_max_MPa: float
    centre_over_b: float
    area_mm2: float | None = None


@dataclass(frozen=True)
class Outer:
    """A class with a property in its record, and without some of its fields."""

    TELLS = ("name", "deviation", "twice", "path")

    name: str
    deviation: Inner
    hidden: float = 1.0
    path: tuple[Inner, ...] = field(default=())

    @property
    def twice(self) -> np.ndarray:
        return np.array([2.0, 4.0])


OUTER = Outer("x", Inner(0.25, 0.5), path=(Inner(1.0, 2.0), Inner(3.0, 4.0)))


def test_a_value_is_told_by_its_own_names():
    assert to_plain(Inner(0.25, 0.5)) == {"p_max_MPa": 0.25, "centre_over_b": 0.5, "area_mm2": None}
    record = to_plain({"outer": OUTER, 1: np.float64(1.5)})
    assert record == {
        "outer": {
            "name": "x",
            "deviation": {"p_max_MPa": 0.25, "centre_over_b": 0.5, "area_mm2": None},
            "twice": [2.0, 4.0],
            "path": [to_plain(value) for value in OUTER.path],
        },
        "1": 1.5,
    }
    assert type(record["1"]) is float


def test_a_row_has_paths_and_relative_numbers_in_percent():
    row = flatten(
        {"fe": to_plain(Inner(800.0, 0.5, 90.0)), "hertz": to_plain(OUTER), "steps": {"one": {"a_mm": -0.01}}}
    )
    assert row == {
        "fe_p_max_MPa": 800.0,
        "fe_centre_over_b": 0.5,
        "fe_area_mm2": 90.0,
        "hertz_name": "x",
        # over Hertz's half-width, and no part of a whole
        "hertz_deviation_p_max_percent": 25.0,
        "hertz_deviation_centre_over_b": 0.5,
        # a missing value has no percentage either
        "hertz_deviation_area_percent": None,
        "hertz_twice": "2.0; 4.0",
        "hertz_path": 2,
        "steps_one_a_percent": -1.0,
    }
    assert flatten({"failing": ["a", "b"], "none": []}) == {"failing": "a; b", "none": ""}


@pytest.fixture(scope="module", params=slow_but(CASES, 1))
def result(request, solved) -> CaseResult:
    return solved(CASES[request.param])


@pytest.fixture(scope="module")
def record(result) -> dict:
    return result_record(result)


def contacts(value: object, path: str = "") -> Iterator[tuple[str, Mapping]]:
    """Whole contacts in a record by their paths.

    The parts of a contact, which have a separate list, are not included.
    """
    if isinstance(value, Mapping):
        if {"p_max_MPa", "area_mm2", "approach_mm"} <= set(value) and not re.search("deviation|uncertainty|step", path):
            yield path, value
        for name, contact in value.items():
            yield from contacts(contact, f"{path}.{name}".removeprefix("."))


def test_no_contact_stands_twice_in_a_record(record):
    contacts_by_path = dict(contacts(record))
    assert {"fe", "elements", "half_space_quadratic", "theories.hertz", "theories.half_space"} <= set(contacts_by_path)
    for measure in ("p_max_MPa", "area_mm2", "approach_mm"):
        twice = [
            value
            for value, count in Counter(contact[measure] for contact in contacts_by_path.values()).items()
            if count > 1
        ]
        assert not twice, [path for path, contact in contacts_by_path.items() if contact[measure] in twice]


def test_all_whole_contacts_carry_the_force_of_the_record(record, result):
    assert not [path for path, contact in contacts(record) if "normal_force_N" in contact]
    for name in {HERTZ, HERTZ_GAUGE} & set(judged_theories(record)):
        contact = record["theories"][name]
        mean = 2.0 / 3.0 * contact["p_max_MPa"]
        assert mean * contact["area_mm2"] == pytest.approx(record["normal_force_N"], rel=1e-9)
    # parts have a force each, along their own normals
    parts = [record["lobes"], *(contact["patches"] for contact in judged_theories(record).values())]
    assert all(patch["normal_force_N"] > 0.0 for patches in parts for patch in patches or ())
    assert bool(record["lobes"]) == (len(result.load.lobes) > 1)


def columns_by_path(value: Mapping, path: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    """Columns that a record may have, written apart from `flat`."""
    for name, number in value.items():
        if isinstance(number, Mapping):
            yield from columns_by_path(number, (*path, name))
            continue
        relative = any(key.startswith(("deviation", "uncertainty", "step")) for key in path)
        if relative and not name.endswith("_over_b"):
            name, number = re.sub("_(MPa|mm2?)$", "", name) + "_percent", None if number is None else 100.0 * number
        yield "_".join((*path, name)), number


def test_every_column_of_a_row_is_a_number_of_the_record(record, result):
    row = case_row(result)
    plain = {**record, **record["theories"], "theories": {}}
    record_values = dict(columns_by_path(plain))
    columns = [name for name in row if name not in HEAD | set(input_columns(result.case))]
    assert len(columns) > 100
    for name in columns:
        value = record_values[name]
        if isinstance(value, list):
            value = (
                len(value)
                if any(isinstance(part_value, Mapping) for part_value in value)
                else "; ".join(map(str, value))
            )
        assert row[name] == value or math.isnan(row[name]), name


def test_several_contact_points_are_told_as_patches(solved):
    theories = result_record(solved(CASES["two lobes"]))["theories"]
    springs = theories[MULTI_HERTZ]
    assert len(springs["patches"]) == 2
    assert springs["p_max_MPa"] == max(patch["p_max_MPa"] for patch in springs["patches"])
    assert theories[HERTZ]["patches"] == []
