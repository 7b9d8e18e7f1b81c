"""Ladder from Hertz to the finite elements: rungs, steps between them, and causes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from fecontact.contact.grid import Rung
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    Measures,
    Misfit,
    is_relative,
    read_hertz_measures,
    read_hertz_misfit,
    read_measures,
)
from fecontact.judging.own_measures import NO_OWN_MEASURES, OwnMeasures


@dataclass(frozen=True, kw_only=True)
class LadderStep:
    """Step of the ladder, between two rungs.

    Attributes
    ----------
    name
        Name of the step, also a key of records.
    start, end
        Names of the two rungs.
    shown
        Whether tables and figures show the step; False if the step only checks the numbers.
    cause
        Cause of Hertz's deviation if this step changes a measure most; empty for a step without a physical cause.
    """

    name: str
    start: str
    end: str
    shown: bool = False
    cause: str = ""


GAP_STEP = LadderStep(
    name="quadratic_to_true_gap",
    start="half_space_quadratic",
    end="half_space",
    shown=True,
    cause="shape of the gap",
)
BODIES_STEP = LadderStep(name="half_space_to_bodies", start="half_space", end="fe", shown=True, cause="finite bodies")
PLASTIC_STEP = LadderStep(name="bodies_to_plastic", start="fe", end="fe_plastic", shown=True, cause="plasticity")
DISCRETE_STEP = LadderStep(name="hertz_to_quadratic", start="hertz", end="half_space_quadratic")
LADDER_STEPS = (
    DISCRETE_STEP,
    GAP_STEP,
    BODIES_STEP,
    LadderStep(name="elements_to_fe", start="elements", end="fe"),
    PLASTIC_STEP,
)
"""All steps in order; the last step is for bodies that may yield."""


RUNGS: Mapping[str, str] = {
    "hertz": "closed form",
    "half_space_quadratic": "Hertz's gap on a discrete half-space, as a check of the discretisation",
    "half_space": "the true gap on the half-space",
    "elements": "the true gap between the finite bodies, on the nodes of the elements",
    "fe": "the same on finer nodes, where a half-space replaces the compliance of the elements near the load",
    "fe_plastic": "first loading of bodies that yield, if a yield stress is given",
}
"""Description of each rung, by its name, beginning with Hertz."""


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Measures on each of the `RUNGS` under equal normal force, with their deviations from Hertz.

    `half_space`, `fe` and `fe_plastic` have equal nodes: their differences do not come from the discretisation.

    Attributes
    ----------
    rungs
        Measures of each rung, by its name.
    misfits
        Misfit of each rung relative to Hertz's ellipse, by its name; `hertz` has no entry.
    own_values, own_deviations
        Values of a user's measures on each rung, and Hertz's deviations from the rung, by its name; `hertz` has no
        entry.
    """

    rungs: Mapping[str, Measures]
    misfits: Mapping[str, Misfit]
    own_values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    own_deviations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, hertz: HertzContact, rungs: Sequence[tuple[str, Rung]], own_measures: OwnMeasures = NO_OWN_MEASURES
    ) -> Ladder:
        """Read the measures of all rungs of a load.

        Parameters
        ----------
        hertz
            Hertz's ellipse under the normal force of the rungs.
        rungs
            Name and contact of each rung above Hertz, in the order of the ladder.
        own_measures
            Criteria of a user at this position.

        Returns
        -------
        Ladder
            Measures of all rungs, beginning with Hertz.
        """
        return cls(
            rungs={"hertz": read_hertz_measures(hertz), **{name: read_measures(rung) for name, rung in rungs}},
            misfits={name: read_hertz_misfit(rung, hertz) for name, rung in rungs},
            own_values={name: own_measures.enter_stage(f"rung {name}").read_values(rung) for name, rung in rungs},
            own_deviations={
                name: own_measures.enter_stage(f"rung {name}").compute_deviations(rung, TheoryContact.of(hertz))
                for name, rung in rungs
            },
        )

    @property
    def steps(self) -> dict[str, dict[str, float]]:
        """Change of each measure by each step (-), by step and measure.

        The change is relative for each of `MEASURES`, and absolute for each of `MISFITS`. Steps between missing rungs
        have no entry.
        """
        rungs = {name: rung.as_dict() for name, rung in self.rungs.items()}
        misfits = {"hertz": dict.fromkeys(MISFITS, 0.0)} | {
            name: misfit.as_dict() for name, misfit in self.misfits.items()
        }
        return {
            step.name: {measure: rungs[step.end][measure] / rungs[step.start][measure] - 1.0 for measure in MEASURES}
            | {measure: misfits[step.end][measure] - misfits[step.start][measure] for measure in MISFITS}
            | {
                measure: _compute_own_step(
                    measure, self.own_deviations.get(step.start, {}).get(measure, 0.0), deviation
                )
                for measure, deviation in self.own_deviations.get(step.end, {}).items()
            }
            for step in LADDER_STEPS
            if step.end in rungs
        }


def _compute_own_step(measure: str, start: float, end: float) -> float:
    """Change of a user's measure by a step of the ladder.

    `start` and `end` are the deviations of Hertz from both rungs. The rungs have different nodes, and a deviation
    compares values on equal nodes.
    """
    if not is_relative(measure):
        return start - end
    return (1.0 + start) / (1.0 + end) - 1.0 if end != -1.0 else math.nan
