"""Views of a map for tables and pictures: verdicts, the cheapest theory, and the answer in sentences."""

from __future__ import annotations

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.sentences import write_theory_sentences, write_verdict_sentences
from fecontact.maps.text_map import format_map_table
from fecontact.maps.theory_views import build_law_view, build_theory_view, find_judged_laws
from fecontact.maps.verdict_views import build_feature_view, build_verdict_view, describe_bodies
from fecontact.maps.view import MapView
from fecontact.outputs.theory_alone import check_theory

# --- Measures of a map: the pressure by a theory, the cheapest theory, or the verdicts of features.


def refuse_measure(case: Case, measure: str, theory: str = HERTZ) -> None:
    """Refuse an unavailable measure, and a theory that does not fit the measure.

    Parameters
    ----------
    case
        Base case of the map.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.

    Raises
    ------
    InputError
        If the measure does not exist or the case does not request it, or if a theory is given with another measure than
        `pressure`. The message has the remedy.
    """
    feature_verdicts = load_offers("MAPS")
    if measure not in ("pressure", "theory", *feature_verdicts):
        raise InputError(f"measure is {measure!r}; allowed: {', '.join(('pressure', 'theory', *feature_verdicts))}")
    if measure in feature_verdicts and feature_verdicts[measure].criterion(case) is None:
        raise InputError(f"measure is {measure!r}, but {feature_verdicts[measure].missing}")
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory needs the"
            " measure pressure, and the measure theory shows all theories"
        )


def build_views(applicability_map: ApplicabilityMap, theory: str = HERTZ) -> dict[str, MapView]:
    """Views of all pictures of a map, by the endings of their file names.

    Parameters
    ----------
    applicability_map
        Map.
    theory
        Further theory of the pressure.

    Returns
    -------
    dict of MapView
        First the verdicts, then the cheapest theory, then the laws of features.
    """
    views = {
        "": build_verdict_view(applicability_map),
        **({} if theory == HERTZ else {theory: build_verdict_view(applicability_map, theory)}),
    }
    views |= {
        name: build_feature_view(applicability_map, name)
        for name, verdict in load_offers("MAPS").items()
        if verdict.criterion(applicability_map.case)
    }
    return (
        views
        | {"theory": build_theory_view(applicability_map)}
        | {
            verdict: build_law_view(applicability_map, laws)
            for verdict, laws in find_judged_laws(applicability_map).items()
        }
    )


def build_map_view(applicability_map: ApplicabilityMap, measure: str, theory: str = HERTZ) -> MapView:
    """View of a map by a measure, for the measure `pressure` also by a theory.

    Parameters
    ----------
    applicability_map
        Map.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.

    Returns
    -------
    MapView
        View.
    """
    if measure == "pressure":
        return build_verdict_view(applicability_map, theory)
    return (
        build_theory_view(applicability_map) if measure == "theory" else build_feature_view(applicability_map, measure)
    )


def write_map_answer(applicability_map: ApplicabilityMap, measure: str, theory: str = HERTZ) -> list[str]:
    """Answer of a map by a measure, in sentences.

    Parameters
    ----------
    applicability_map
        Map.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.

    Returns
    -------
    list of str
        Sentences.
    """
    view = build_map_view(applicability_map, measure, theory)
    if measure == "theory":
        return write_theory_sentences(view)
    name = THEORIES[theory].in_sentence if measure == "pressure" else load_offers("MAPS")[measure].name
    bodies = describe_bodies(applicability_map, theory == HERTZ).removeprefix(", ") if measure == "pressure" else ""
    notes = [f"Verdicts are {bodies}."] if bodies else []
    return write_verdict_sentences(applicability_map, view, name, why=measure == "pressure" and theory == HERTZ) + notes


def format_map(
    applicability_map: ApplicabilityMap, measure: str, *, theory: str = HERTZ, width: int | None = None
) -> str:
    """Text of a map by a measure; for the measure `theory` also of the laws of features.

    Parameters
    ----------
    applicability_map
        Map.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.
    width
        Width in characters; None without a limit.

    Returns
    -------
    str
        Tables of the map.
    """
    views = [build_map_view(applicability_map, measure, theory)]
    views += (
        [build_law_view(applicability_map, laws) for laws in find_judged_laws(applicability_map).values()]
        if measure == "theory"
        else []
    )
    return "\n\n".join(format_map_table(view, width=width) for view in views)
