"""Judged theories of a load, and the cheapest theory that holds."""

from __future__ import annotations

from fecontact.contact_theories.registry import HERTZ, HERTZ_OF_EACH_SIDE
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.verdict import Judgement, TheoryAnswer, find_cheapest_theory, list_theory_answers
from fecontact.outputs.flat_records import Record


def judgements_of_other_theories(load: JudgedLoad) -> dict[str, Judgement]:
    """Judgements of all theories except Hertz's ellipse at the first contact point."""
    return {name: judgement for name, judgement in load.judgements.items() if name not in HERTZ_OF_EACH_SIDE}


def judgements_by_theory(load: JudgedLoad) -> dict[str, Judgement]:
    """Judgements of all theories against elastic bodies.

    The numbers and the verdict of Hertz are those of the deciding side.
    """
    return {HERTZ: load.deciding} | judgements_of_other_theories(load)


def find_cheapest_of_load(load: JudgedLoad) -> TheoryAnswer:
    """Cheapest theory of the pressure that holds for a load."""
    return find_cheapest_theory(
        list_theory_answers(judgements_by_theory(load)), in_range=not load.case.criteria.theories_out_of_range
    )


def cheapest_columns(column: str, standing: TheoryAnswer) -> Record:
    """Columns of the cheapest theory that holds.

    Parameters
    ----------
    column
        Name of the column of the theory's name.
    standing
        Cheapest theory with its answer.

    Returns
    -------
    Record
        Name of the theory, its status (in its range or not) and the reasons of the status. Status and reasons are empty
        if no theory holds.
    """
    theory_contact = standing.made if standing.answer == "HOLDS" else None
    status, notes = ("", ()) if theory_contact is None else (theory_contact.status, theory_contact.notes)
    return {column: standing.label, f"{column}_status": status, f"{column}_reason": "; ".join(notes)}
