"""At which loads of a position Hertz holds for what it is used for: the sets of measures side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fecontact.case import Criteria
from fecontact.comparison.judged_load import JudgedLoad
from fecontact.comparison.verdict import FROM_BEST, Answer, judge
from fecontact.map.cells import ApplicabilityMap, LoadLimit, MapPosition
from fecontact.map.load_limit import intervals_of

USES = ("strength", "patch", "all")
"""Sets of measures: for what yields below the patch, for creep forces and wear, for the contact as a whole."""


def limits_by_use(made: ApplicabilityMap) -> dict[str, tuple[LoadLimit, ...]]:
    """For each set of measures a limit a position, by the limits of the map, from the loads that were solved for it."""
    return {
        use: tuple(_limit(position, replace(made.case.criteria, judged_by=(use,))) for position in made.positions)
        for use in USES
    }


def _limit(position: MapPosition, criteria: Criteria) -> LoadLimit:
    usable = sorted((one for one in position.solved if one.usable), key=lambda one: one.load_N)
    known: Sequence[tuple[float, Answer]] = [(one.load_N, _answer(one, criteria)) for one in usable]
    return LoadLimit(
        intervals=intervals_of(known),
        reason=None if known else position.limit.reason,
        note=position.limit.note,
        tried=tuple(known),
    )


def _answer(load: JudgedLoad, criteria: Criteria) -> Answer:
    """The worst of both sides, as for the verdict itself."""
    answers = (judge(side.deviation, side.uncertainty, criteria).answer for side in load.sides.values())
    return max(answers, key=FROM_BEST.index)
