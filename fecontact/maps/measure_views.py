"""Verdicts that a map can show besides the pressure: verdicts of features and of a user's criteria."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from fecontact.case import Case
from fecontact.feature_registry import load_offers
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import VerdictReadingView
from fecontact.judging.verdict import Judgement
from fecontact.outputs.words import MEASURE_WORDS


def list_verdict_measures(case: Case) -> Mapping[str, VerdictReadingView]:
    """Verdicts of features and of a user's criteria, by the measure.

    Parameters
    ----------
    case
        Base case of the map, with the criteria of the user.

    Returns
    -------
    mapping of str to VerdictReadingView
        First the verdicts of features, then `own_NAME` for each criterion of the user.
    """
    own_views = {f"own_{criterion.name}": _build_own_reading(criterion.key) for criterion in case.criteria.own or ()}
    return {**load_offers("MAPS"), **own_views}


def _build_own_reading(measure: str) -> VerdictReadingView:
    """Reading of the verdict on Hertz by a single measure of a user."""
    words = MEASURE_WORDS[measure]

    def read_criterion(case: Case) -> str | None:
        limit = case.criteria.limits.get(measure)
        return None if limit is None else f"{words.limit_text(limit)} {words.short}"

    return VerdictReadingView(
        title=f"where Hertz holds by the {words.name}",
        criterion=read_criterion,
        lost="no usable result",
        name=f"Hertz's {words.name}",
        short=words.short,
        read=partial(_read_own_judgement, measure),
        judge=lambda load, placement: _read_own_judgement(measure, load),
        causes={},
        missing=f"the map has no criterion {words.short}; give it as Criteria(own=...) in Python",
    )


def _read_own_judgement(measure: str, load: JudgedLoad) -> Judgement:
    """Judgement of Hertz by a single measure of a user."""
    deciding = (load.plastic or load).deciding
    verdict = deciding.verdict
    return replace(
        deciding,
        limits={measure: deciding.limits[measure]},
        verdict=replace(
            verdict,
            answer=verdict.each[measure] if load.usable else "UNRESOLVED",
            measure=measure,
            each={measure: verdict.each[measure]},
            cause=None,
        ),
    )
