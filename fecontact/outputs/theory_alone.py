"""Theories without finite elements: the list of theories, and one theory at a position."""

from __future__ import annotations

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import offered
from fecontact.outputs.flat_records import Record, picked, told
from fecontact.outputs.own_profiles import geometry_line, own_profiles_record
from fecontact.outputs.records.results import case_inputs, contact_record, versions
from fecontact.outputs.tables import Item, number, table_of, text
from fecontact.outputs.terminal import Lines, notes
from fecontact.solving.alone import TheoryAlone

_THEORY = "words cost source range differs"


def check_theory(name: str) -> None:
    """Refuse a theory of the pressure that there is not.

    Raises
    ------
    InputError
        With those that there are.
    """
    if name not in THEORIES:
        raise InputError(f"theory is {name!r}; allowed: {', '.join(THEORIES)}; `fecontact theories` says what they are")


def theories_listed() -> Record:
    """The theories of the `pressure`, and the laws that features judge, each from the cheapest."""
    return {
        "pressure": {name: picked(theory, _THEORY) for name, theory in THEORIES.items()},
        **{laws.kind: told(laws.laws) for laws in offered("LAWS").values()},
    }


def alone_record(found: TheoryAlone) -> Record:
    """What a theory says at a position; without a contact its `problem` is why there is none."""
    placement, measures = found.placement, found.measures
    said: Record = {"status": found.status, "notes": [], "solutions": 0, "patches": []}
    if found.contact is not None and measures is not None:
        said = contact_record(found.contact, measures) | {"normal_force_N": found.contact.normal_force_N}
    return {
        "schema": "fecontact/theory/1",
        "theory": found.name,
        **picked(THEORIES[found.name], _THEORY),
        "case": case_inputs(found.case, placement),
        **own_profiles_record(found.case, placement),
        "contact_angle_rad": placement.first.contact_angle_rad,
        "given_normal_force_N": found.normal_force_N,
        "problem": found.problem,
        **said,
        "warnings": list(placement.notes),
        "versions": versions(),
    }


_PATCH = (
    text("patch", "patch"),
    number("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number("p_max\nMPa", "p_max_MPa", "{:.1f}"),
    number("area\nmm²", "area_mm2", "{:.2f}"),
    number("a\nmm", "a_mm", "{:.3f}"),
    number("b\nmm", "b_mm", "{:.3f}"),
    number("approach\nmm", "approach_mm", "{:.5f}", none=""),
    number("centre s\nmm", lambda patch: patch["centre_mm"][1], "{:+z.3f}"),
)


def theories_lines(listed: Item) -> Lines:
    """What each theory is, where it is from, what it takes for granted, and what differs from its source."""
    headings = {laws.kind: laws.heading for laws in offered("LAWS").values()}
    for kind, theories in listed.items():
        yield f"{headings.get(kind, 'Theories of the pressure')}, from the cheapest:"
        for name, theory in theories.items():
            yield f"  {name}: {theory['words']}; {theory['cost']}"
            yield from (f"      {key}: {theory[key]}" for key in ("source", "range", "differs") if theory.get(key))


def alone_lines(record: Item) -> Lines:
    """What a theory says at a position, and each of its patches where there are several."""
    yield from geometry_line(record)
    if record["problem"] is None:
        patches = record["patches"] if len(record["patches"]) > 1 else []
        numbered = ({**patch, "patch": place, "approach_mm": None} for place, patch in enumerate(patches, 1))
        yield table_of(record["words"], _PATCH, [{**record, "patch": "all"}, *numbered])
    yield f"status: {record['status']}"
    yield from filter(None, (record["problem"], *record["notes"]))
    if record["solutions"] > 1:
        yield f"approaches that carry the force: {record['solutions']}"
    yield from notes(record["warnings"])
