"""Access to the theories in the record of a load."""

from __future__ import annotations

import math

from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE
from fecontact.judging.measures import MEASURES
from fecontact.outputs.flat_records import Record
from fecontact.outputs.tables import TableRecord
from fecontact.own_criterion import is_own


def judged_theories(record: TableRecord) -> dict[str, TableRecord]:
    """Records of the judged theories, by name, without theories that have no contact.

    Parameters
    ----------
    record
        Record of a load.

    Returns
    -------
    dict
        Records with a verdict, the cheapest theory first.
    """
    return {
        name: theory for name, theory in record["theories"].items() if theory is not None and theory["problem"] is None
    }


def deciding_hertz(record: TableRecord) -> TableRecord:
    """Record of Hertz with the curvature of the side that decided the verdict.

    Parameters
    ----------
    record
        Record of a result.

    Returns
    -------
    dict
        Record of Hertz of the gauge side or of the field side.
    """
    hertz: TableRecord = record["theories"][HERTZ_GAUGE if record["verdict"]["side"] == "gauge" else HERTZ]
    return hertz


def select_measures(theory: TableRecord) -> Record:
    """Measures in the record of a theory, with the measures of a user."""
    return {name: value for name, value in theory.items() if name in MEASURES or is_own(name)}


def has_measures(theory: TableRecord, contact: Record) -> bool:
    """Whether the record of a theory has the measures of a contact, up to rounding.

    Parameters
    ----------
    theory
        Record of a theory.
    contact
        Measures of a contact.

    Returns
    -------
    bool
        False if a measure is missing or differs.
    """
    theory_measures = {name: theory[name] for name in MEASURES if name in theory}
    return contact.keys() == theory_measures.keys() and all(
        math.isclose(value, theory_measures[name], rel_tol=1e-9) for name, value in contact.items()
    )
