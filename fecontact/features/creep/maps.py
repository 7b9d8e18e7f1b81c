"""Creep forces as maps show them: where Hertz holds for them, and the cheapest law of them that does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fecontact.case import Case
from fecontact.features.creep.force_verdict import PLACE, SHAPE, force_verdict
from fecontact.features.creep.judged_force import FORCE, JudgedForce
from fecontact.features.creep.laws import CREEP_LAWS, REAL
from fecontact.judging.judged_load import JudgedLoad
from fecontact.judging.readings import MappedLaws, MappedVerdicts
from fecontact.judging.verdict import Judgement

_LOST = "no forces: not solved"


def force_criterion(case: Case) -> str | None:
    """Limit, friction and creepages in words; None without friction."""
    creep = case.creep
    if creep.friction is None:
        return None
    surfaces = ", which follow the curved surfaces" if creep.curved else ""
    return (
        f"{1e2 * creep.force_limit:g} % of µN, friction {creep.friction:g}, creepages up to"
        f" {1e2 * creep.largest_creepage:g} %{surfaces}"
    )


def _force_of(load: JudgedLoad) -> JudgedForce | None:
    return load.features["creep"].verdict if "creep" in load.features else None


FORCE_MAP = MappedVerdicts(
    title="where Hertz holds for creep forces",
    criterion=force_criterion,
    lost=_LOST,
    name="Hertz's creep force",
    short="creep forces",
    read=_force_of,
    judge=force_verdict,
    causes={PLACE: ("D", "centre of pressure beside\nthe touch point"), SHAPE: ("F", SHAPE)},
    missing="the map has no friction coefficient; give one too, for example --friction 0.3 (fecontact judge FOLDER"
    " takes it for a map that was made without, and solves nothing again)",
)


def _columns(name: str, judged: Judgement) -> Mapping[str, Any]:
    """How far a law is off, and at which creepages."""
    assert isinstance(judged, JudgedForce)
    worst = judged.decided[0].creepages
    columns = {
        "verdict": judged.verdict.answer,
        "off_percent_of_muN": 1e2 * judged.deviation[FORCE],
        "uncertainty_percent_of_muN": 1e2 * judged.uncertainty[FORCE],
        "xi": worst.xi,
        "eta": worst.eta,
    }
    return {} if name == REAL else {f"{name}_{column}": value for column, value in columns.items()}


LAW_MAP = MappedLaws(
    title="the cheapest theory of creep forces that holds",
    criterion=force_criterion,
    lost=_LOST,
    kind="forces",
    heading="Laws of creep forces",
    laws=CREEP_LAWS,
    read=lambda load: load.features.get("creep_laws", {}),
    # blue where Hertz's ellipse is enough, green for several, orange where the real patch is needed; darker: dearer
    marks={
        "polach": ("Po", "#d3ebf8"),
        "fastsim": ("FA", "#8fcbed"),
        "exact": ("EX", "#56a5d8"),
        "multi_hertz": ("FM", "#66c2a5"),
        "strips": ("FS", "#f5b878"),
        "real": ("ER", "#d55e00"),
    },
    note="the cheapest theory of creep forces within {within}, and by how much of µN it is off, %",
    number="off by at most, % of µN",
    of=lambda name, judged: "" if name == REAL else f"{1e2 * judged.deviation[FORCE]:.1f}",
    columns=_columns,
)
