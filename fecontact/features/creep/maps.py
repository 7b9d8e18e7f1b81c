"""Creep forces in maps: where Hertz holds for them, and the cheapest law that holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.case import Case
from fecontact.features.creep.creep_comparison import TheoryForces
from fecontact.features.creep.force_verdict import (
    DECIDING_THEORY,
    DISPLACED_CENTRE,
    PATCH_SHAPE,
    judge_hertz_force,
)
from fecontact.features.creep.judged_force import FORCE_MEASURE, ForceJudgement
from fecontact.features.creep.laws import CREEP_LAWS, REFERENCE_LAW
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import LawReadingView, NumberReading, NumberReadingView, VerdictReadingView
from fecontact.judging.verdict import Judgement

_UNSOLVED_TEXT = "no forces: not solved"
_NO_FRICTION_TEXT = (
    "the map has no friction coefficient; add one, for example --friction 0.3 (for a stored map without friction use"
    " fecontact judge FOLDER --friction 0.3, which solves no case again)"
)


def force_criterion(case: Case) -> str | None:
    """Limit, friction and creepages in words.

    Parameters
    ----------
    case
        Case of the map.

    Returns
    -------
    str or None
        None without friction.
    """
    creep = case.creep
    if creep.friction is None:
        return None
    surfaces = ", which follow the curved surfaces" if creep.curved else ""
    return (
        f"{1e2 * creep.force_limit:g} % of µN, friction {creep.friction:g}, creepages up to"
        f" {1e2 * creep.largest_creepage:g} %{surfaces}"
    )


def _read_hertz_judgement(load: JudgedLoad) -> ForceJudgement | None:
    """Judgement of Hertz for the creep forces of a load; None without creep forces."""
    return load.features["creep"].verdict if "creep" in load.features else None


FORCE_MAP = VerdictReadingView(
    title="where Hertz holds for creep forces",
    criterion=force_criterion,
    lost=_UNSOLVED_TEXT,
    name="Hertz's creep force",
    short="creep forces",
    read=_read_hertz_judgement,
    judge=judge_hertz_force,
    causes={
        DISPLACED_CENTRE: ("D", "centre of pressure away from\nthe contact point"),
        PATCH_SHAPE: ("F", PATCH_SHAPE),
    },
    missing=_NO_FRICTION_TEXT,
)


def _describe_rolling(case: Case) -> str | None:
    """Friction and creepages of a position in words; None without friction."""
    creep = case.creep
    if creep.friction is None:
        return None
    creepages = {"xi": (creep.xi, 1e2, " %"), "eta": (creep.eta, 1e2, " %"), "spin": (creep.spin_per_mm, 1.0, "/mm")}
    texts = [
        f"{name} {value * factor:g}{unit}" for name, (value, factor, unit) in creepages.items() if value is not None
    ]
    speed = "" if creep.speed_ratio == 1.0 else f" at {creep.speed_ratio:g} times the rolling speed"
    free = [f"{'other ' if texts else ''}creepages of the wheelset{speed}"] if len(texts) < len(creepages) else []
    surfaces = " on the curved surfaces" if creep.curved else ""
    return f"friction {creep.friction:g}, {', '.join(texts + free)}{surfaces}"


def _read_t_gamma(load: JudgedLoad) -> NumberReading | None:
    """Deviation of Hertz's T-gamma at a load; None without creep forces."""
    if "creep" not in load.features:
        return None
    forces: TheoryForces = load.features["creep"].theories[DECIDING_THEORY]
    return NumberReading(
        deviation_percent=forces.t_gamma_deviation_percent, uncertainty_percent=forces.t_gamma_uncertainty_percent
    )


T_GAMMA_MAP = NumberReadingView(
    title="by how much Hertz makes T-gamma (wear number) wrong",
    criterion=_describe_rolling,
    lost=_UNSOLVED_TEXT,
    name="T-gamma (wear number)",
    read_deviation=_read_t_gamma,
    without="no T-gamma: no slip, or no force",
    missing=_NO_FRICTION_TEXT,
)


def _make_law_columns(name: str, judgement: Judgement) -> Mapping[str, Any]:
    """Columns of a law in the table of a map: its deviation, and its creepages.

    Empty for the reference law.
    """
    assert isinstance(judgement, ForceJudgement)
    creepages = judgement.decided[0].creepages
    columns = {
        "verdict": judgement.verdict.answer,
        "off_percent_of_muN": 1e2 * judgement.deviation[FORCE_MEASURE],
        "uncertainty_percent_of_muN": 1e2 * judgement.uncertainty[FORCE_MEASURE],
        "xi": creepages.xi,
        "eta": creepages.eta,
    }
    return {} if name == REFERENCE_LAW else {f"{name}_{column}": value for column, value in columns.items()}


LAW_MAP = LawReadingView(
    title="the cheapest theory of creep forces that holds",
    criterion=force_criterion,
    lost=_UNSOLVED_TEXT,
    kind="forces",
    heading="Laws of creep forces",
    laws=CREEP_LAWS,
    read=lambda load: load.features.get("creep_laws", {}),
    # blue if Hertz's ellipse suffices, green for several ellipses, orange if the real patch is needed; a darker shade
    # is a more expensive law
    marks={
        "polach": ("Po", "#d3ebf8"),
        "fastsim": ("FA", "#8fcbed"),
        "exact": ("EX", "#56a5d8"),
        "multi_hertz": ("FM", "#66c2a5"),
        "strips": ("FS", "#f5b878"),
        "real": ("ER", "#d55e00"),
    },
    note="cheapest theory of creep forces within {within}, and its largest deviation in % of µN",
    number="largest deviation, % of µN",
    of=lambda name, judgement: "" if name == REFERENCE_LAW else f"{1e2 * judgement.deviation[FORCE_MEASURE]:.1f}",
    columns=_make_law_columns,
)
