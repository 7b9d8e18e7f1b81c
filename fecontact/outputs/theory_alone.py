"""Theories without finite elements: the list of theories, and a theory at a position."""

from __future__ import annotations

from fecontact.contact_theories.registry import THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.outputs.codes import read_codes
from fecontact.outputs.flat_records import Record, select_attributes, to_plain
from fecontact.outputs.geometry import contact_point_records
from fecontact.outputs.pair_geometry import pair_geometry_lines, pair_geometry_record
from fecontact.outputs.records.results import case_inputs, contact_record, package_versions
from fecontact.outputs.tables import TableRecord, make_table, number_column, text_column
from fecontact.outputs.terminal import OutputLines, note_lines
from fecontact.solving.alone import TheoryEvaluation

_THEORY_ATTRIBUTES = "words cost source range differs"


def check_theory(name: str) -> None:
    """Refuse the name of a theory of the pressure that does not exist.

    Parameters
    ----------
    name
        Name of a theory.

    Raises
    ------
    InputError
        If there is no such theory; the message has the allowed names.
    """
    if name not in THEORIES:
        raise InputError(f"theory is {name!r}; allowed: {', '.join(THEORIES)}; `fecontact theories` describes them")


def list_theories() -> Record:
    """List of the theories of the `pressure` and of the laws of features.

    The cheapest theory and the cheapest law of each kind come first.

    Returns
    -------
    Record
        Description by name, for each kind.
    """
    return {
        "pressure": {name: select_attributes(theory, _THEORY_ATTRIBUTES) for name, theory in THEORIES.items()},
        **{laws.kind: to_plain(laws.laws) for laws in load_offers("LAWS").values()},
    }


def theory_record(theory_alone: TheoryEvaluation) -> Record:
    """Record of a theory at a position.

    Parameters
    ----------
    theory_alone
        Result of the theory.

    Returns
    -------
    Record
        Content of the JSON output. Without a contact the entry `problem` has the reason.
    """
    placement, measures = theory_alone.placement, theory_alone.measures
    contact_entries: Record = {"status": theory_alone.status, "notes": [], "solutions": 0, "patches": []}
    if theory_alone.contact is not None and measures is not None:
        contact_entries = contact_record(theory_alone.contact, measures) | {
            "normal_force_N": theory_alone.contact.normal_force_N
        }
    return {
        "schema": "fecontact/theory/1",
        "theory": theory_alone.name,
        **select_attributes(THEORIES[theory_alone.name], _THEORY_ATTRIBUTES),
        "case": case_inputs(theory_alone.case, placement),
        **pair_geometry_record(theory_alone.case, placement),
        **contact_point_records(placement),
        "given_normal_force_N": theory_alone.normal_force_N,
        "problem": theory_alone.problem,
        **contact_entries,
        "warnings": list(placement.notes),
        "versions": package_versions(),
    }


_PATCH_COLUMNS = (
    text_column("patch", "patch"),
    number_column("F_n\nkN", "normal_force_N", "{:.3f}", 1e-3),
    number_column("p_max\nMPa", "p_max_MPa", "{:.1f}"),
    number_column("area\nmm²", "area_mm2", "{:.2f}"),
    number_column("a\nmm", "a_mm", "{:.3f}"),
    number_column("b\nmm", "b_mm", "{:.3f}"),
    number_column("approach\nmm", "approach_mm", "{:.5f}", none=""),
    number_column("centre s\nmm", lambda patch: patch["centre_mm"][1], "{:+z.3f}"),
)


def theories_lines(listed: TableRecord) -> OutputLines:
    """Iterate over the descriptions of all theories.

    Parameters
    ----------
    listed
        Record of `list_theories`.

    Returns
    -------
    iterator of Table and str
        Name, cost, source, range of validity and differences from the source of each theory.
    """
    headings = {laws.kind: laws.heading for laws in load_offers("LAWS").values()}
    for kind, theories in listed.items():
        yield f"{headings.get(kind, 'Theories of the pressure')}, the cheapest first:"
        for name, theory in theories.items():
            yield f"  {name}: {theory['words']}; {theory['cost']}"
            yield from (f"      {key}: {theory[key]}" for key in ("source", "range", "differs") if theory.get(key))
    yield f"fecontact theories --in CODE lists settings in a vehicle code: {', '.join(read_codes())}"


def theory_lines(record: TableRecord) -> OutputLines:
    """Iterate over the outputs of a theory at a position.

    Parameters
    ----------
    record
        Record of the theory.

    Returns
    -------
    iterator of Table and str
        Table of the contact, and of each patch if there are several; status and notes.
    """
    yield from pair_geometry_lines(record)
    if record["problem"] is None:
        patches = record["patches"] if len(record["patches"]) > 1 else []
        numbered_patches = ({**patch, "patch": place, "approach_mm": None} for place, patch in enumerate(patches, 1))
        yield make_table(record["words"], _PATCH_COLUMNS, [{**record, "patch": "all"}, *numbered_patches])
    yield f"status: {record['status']}"
    yield from filter(None, (record["problem"], *record["notes"]))
    if record["solutions"] > 1:
        yield f"number of approaches with this normal force: {record['solutions']}"
    yield from note_lines(record["warnings"])
