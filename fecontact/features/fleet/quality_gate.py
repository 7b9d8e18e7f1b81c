"""Quality gate of a fleet: suspicious profiles stay out of the answer until their rows settle them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.features.fleet.model import Fleet
from fecontact.features.fleet.population import Candidate
from fecontact.features.fleet.table_columns import ACCEPTED_COLUMN, INCLINATION_COLUMN, READ, REFUSED, SUSPICIOUS
from fecontact.profiles.suspicions import SuspicionKind

# What settles each kind of suspicion, beside `accepted`, in the words of a row of the table.
_ANSWERS: dict[SuspicionKind, str] = {
    "mirrored": "mirror = yes if the file is of the other side of the track, or mirror = no if it is not",
    "canted": "inclination = none if the rail in the file is canted already, or its inclination if it is not",
    "shifted": "tape_circle_mm, the y of the file at the tape circle",
    "short": "a file with the whole running surface",
    "dented": "a corrected file",
    "tape circle": "tape_circle_mm, the y of the file at the tape circle",
    "other body": "the file in the table of the other body",
    "wear": "the right file",
}


def is_left_out(candidate: Candidate) -> bool:
    """Whether the row of a profile leaves it out: `accepted` is no."""
    return candidate.known.get(ACCEPTED_COLUMN) is False


def judge_profile(fleet: Fleet, candidate: Candidate, record: Mapping[str, Any]) -> dict[str, Any]:
    """Record of a profile with the status after the quality gate.

    Parameters
    ----------
    fleet
        Fleet with its case.
    candidate
        Profile with the values of its row.
    record
        Record of the reading, with the suspicions of the reader.

    Returns
    -------
    dict
        Record with the status `read`, `suspicious` or `refused`, its reason and remedy, and the suspicions in its
        notes.
    """
    suspicions = record.get("suspicions", ())
    texts, notes = [suspicion["text"] for suspicion in suspicions], record.get("notes", ())
    gate_record = {**record, "kinds": [suspicion["kind"] for suspicion in suspicions]}
    if record["status"] == REFUSED:
        if not suspicions:
            return gate_record
        if candidate.known.get(ACCEPTED_COLUMN):
            return {**gate_record, "remedy": f"accepted = yes does not answer this; {record['remedy']}"}
        remedy = f"{record['remedy']}; such an option is a column of the table too, and accepted = no leaves it out"
        return {**gate_record, "status": SUSPICIOUS, "remedy": remedy}
    gate_record["notes"] = [*notes, *texts]
    unsettled = [suspicion for suspicion in suspicions if not _is_settled(suspicion["kind"], fleet, candidate)]
    if not unsettled:
        return {**gate_record, "status": READ}
    answers = dict.fromkeys(_ANSWERS[suspicion["kind"]] for suspicion in unsettled)
    return {
        **gate_record,
        "status": SUSPICIOUS,
        "reason": "; ".join(suspicion["text"] for suspicion in unsettled),
        "remedy": f"in its row of the table, give {'; '.join(answers)}; or accepted = yes to use it as it is, or"
        " accepted = no to leave it out",
    }


def _is_settled(kind: SuspicionKind, fleet: Fleet, candidate: Candidate) -> bool:
    """Whether the row of a profile answers a suspicion.

    The inclination of the case answers a suspicion of a cant, if it is none.
    """
    if candidate.known.get(ACCEPTED_COLUMN):
        return True
    return kind == "canted" and (INCLINATION_COLUMN in candidate.known or fleet.case.inclination_rad == 0.0)
