"""Views of a map for tables and pictures: verdicts, the cheapest theory, and the answer in sentences."""

from __future__ import annotations

from dataclasses import replace

from fecontact.case import Case
from fecontact.contact_theories.registry import HERTZ, THEORIES
from fecontact.errors import InputError
from fecontact.feature_registry import load_offers
from fecontact.judging.readings import NumberReadingView
from fecontact.maps.measure_views import list_verdict_measures
from fecontact.maps.model import ApplicabilityMap
from fecontact.maps.number_views import build_number_view, write_number_sentences
from fecontact.maps.sentences import write_theory_sentences, write_verdict_sentences, write_yaw_sentences
from fecontact.maps.text_map import format_map_table
from fecontact.maps.theory_views import build_law_view, build_theory_view, find_judged_laws
from fecontact.maps.verdict_views import build_feature_view, build_verdict_view, describe_bodies
from fecontact.maps.view import MapView
from fecontact.maps.yaw_map import YawMap
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
    feature_measures = {**list_verdict_measures(case), **load_offers("NUMBERS")}
    if measure not in ("pressure", "theory", *feature_measures):
        raise InputError(f"measure is {measure!r}; allowed: {', '.join(('pressure', 'theory', *feature_measures))}")
    if measure in feature_measures and feature_measures[measure].criterion(case) is None:
        raise InputError(f"measure is {measure!r}, but {feature_measures[measure].missing}")
    check_theory(theory)
    if measure != "pressure" and theory != HERTZ:
        raise InputError(
            f"theory is {theory!r}, but the measure is {measure!r}; leave one of them out: a theory needs the"
            " measure pressure, and the measure theory shows all theories"
        )


def build_views(
    applicability_map: ApplicabilityMap, theory: str = HERTZ, *, at_yaw: bool = False
) -> dict[str, MapView]:
    """Views of all pictures of a map, by the endings of their file names.

    Parameters
    ----------
    applicability_map
        Map.
    theory
        Further theory of the pressure.
    at_yaw
        Whether the title has the yaw also if the yaw is zero.

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
        for name, verdict in list_verdict_measures(applicability_map.case).items()
        if verdict.criterion(applicability_map.case)
    }
    views |= {
        name: build_number_view(applicability_map, number)
        for name, number in list_asked_numbers(applicability_map.case).items()
    }
    views |= {"theory": build_theory_view(applicability_map)}
    views |= {
        verdict: build_law_view(applicability_map, laws)
        for verdict, laws in find_judged_laws(applicability_map).items()
    }
    return {name: _add_yaw(view, at_yaw=at_yaw) for name, view in views.items()}


def list_asked_numbers(case: Case) -> dict[str, NumberReadingView]:
    """Quantities of features with a deviation that a case asks for.

    Parameters
    ----------
    case
        Base case of a map.

    Returns
    -------
    dict of NumberReadingView
        Quantities by the map's measure.
    """
    return {name: number for name, number in load_offers("NUMBERS").items() if number.criterion(case)}


def write_number_answer(applicability_map: ApplicabilityMap) -> list[str]:
    """Sentences on the deviation of Hertz in the quantities of features.

    Parameters
    ----------
    applicability_map
        Map.

    Returns
    -------
    list of str
        Sentences; empty if the case asks for no quantity.
    """
    return [
        sentence
        for number in list_asked_numbers(applicability_map.case).values()
        for sentence in write_number_sentences(applicability_map, number)
    ]


def _add_yaw(view: MapView, *, at_yaw: bool = False) -> MapView:
    """View with the yaw of its case in the title, if necessary.

    The title has a yaw of zero only with `at_yaw`."""
    yaw_rad = view.case.yaw_rad
    return replace(view, yaw_mrad=1e3 * yaw_rad) if yaw_rad or at_yaw else view


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
        return _add_yaw(build_verdict_view(applicability_map, theory))
    if measure in load_offers("NUMBERS"):
        return _add_yaw(build_number_view(applicability_map, load_offers("NUMBERS")[measure]))
    return _add_yaw(
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
    if measure in load_offers("NUMBERS"):
        return write_number_sentences(applicability_map, load_offers("NUMBERS")[measure])
    view = build_map_view(applicability_map, measure, theory)
    if measure == "theory":
        return write_theory_sentences(view)
    name = _name_answer(applicability_map.case, measure, theory)
    bodies = describe_bodies(applicability_map, theory == HERTZ).removeprefix(", ") if measure == "pressure" else ""
    notes = [f"Verdicts are {bodies}."] if bodies else []
    return write_verdict_sentences(applicability_map, view, name, why=measure == "pressure" and theory == HERTZ) + notes


def _name_answer(case: Case, measure: str, theory: str) -> str:
    """Name of the theory or force of a measure, in a sentence."""
    if measure == "theory":
        return "the cheapest theory that holds"
    return str(THEORIES[theory].in_sentence if measure == "pressure" else list_verdict_measures(case)[measure].name)


def write_yaw_answer(yaw_map: YawMap, measure: str, theory: str = HERTZ) -> list[str]:
    """Cells in which the answer of maps changes with the yaw, in sentences.

    Parameters
    ----------
    yaw_map
        Maps of several yaws.
    measure
        `pressure`, `theory`, or the name of a feature's verdict.
    theory
        Name of a theory of the pressure.

    Returns
    -------
    list of str
        Sentences.
    """
    if measure in load_offers("NUMBERS"):
        # a number has no verdict that changes
        measure = "pressure"
    views = {single_map.yaw_mrad: build_map_view(single_map, measure, theory) for single_map in yaw_map.maps}
    return write_yaw_sentences(
        views, _name_answer(yaw_map.maps[0].case, measure, theory), of_theories=measure == "theory"
    )


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
