"""Theories by themselves as records: the list of those that are judged, and one of them at a case's position."""

from __future__ import annotations

from dataclasses import asdict

from fecontact.alone.position import TheoryAlone
from fecontact.comparison.creep_theories import CREEP_LAWS
from fecontact.comparison.theories import THEORIES, Theory
from fecontact.errors import InputError
from fecontact.outputs.records.results import case_inputs, contact_record, profile_notes, versions
from fecontact.outputs.records.told import Record, picked

SCHEMA = "fecontact/theory/1"


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
    """The theories of the `pressure` and the laws of `forces`, each from the cheapest."""
    return {
        "pressure": {name: _theory_record(theory) for name, theory in THEORIES.items()},
        "forces": {name: asdict(law) for name, law in CREEP_LAWS.items()},
    }


def _theory_record(theory: Theory) -> Record:
    return picked(theory, "words cost source range differs")


def alone_record(found: TheoryAlone) -> Record:
    """What a theory says at a position; without a contact its `problem` is why there is none."""
    placement, measures = found.placement, found.measures
    said: Record = {"status": found.status, "notes": [], "solutions": 0, "patches": []}
    if found.contact is not None and measures is not None:
        said = contact_record(found.contact, measures) | {"normal_force_N": found.contact.normal_force_N}
    return {
        "schema": SCHEMA,
        "theory": found.name,
        **_theory_record(THEORIES[found.name]),
        "case": case_inputs(found.case, placement),
        "contact_angle_rad": placement.first.contact_angle_rad,
        "given_normal_force_N": found.normal_force_N,
        "problem": found.problem,
        **said,
        "warnings": profile_notes(placement),
        "versions": versions(),
    }
