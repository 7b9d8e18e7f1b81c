"""The rungs between Hertz and the finite elements on the same nodes, and the change by each step and its cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.contact.grid import Rung
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    Measures,
    Misfit,
    hertz_measures,
    measures_of,
    misfit_of,
)


@dataclass(frozen=True, kw_only=True)
class Step:
    """A step of the ladder, from a rung to another.

    Attributes
    ----------
    shown
        Whether tables and pictures show the step; not if it only checks the numbers.
    cause
        Why Hertz is off if this step changes a measure most.
    """

    name: str
    start: str
    end: str
    shown: bool = False
    cause: str = ""


GAP = Step(
    name="quadratic_to_true_gap",
    start="half_space_quadratic",
    end="half_space",
    shown=True,
    cause="shape of the gap",
)
BODIES = Step(name="half_space_to_bodies", start="half_space", end="fe", shown=True, cause="finite bodies")
PLASTIC = Step(name="bodies_to_plastic", start="fe", end="fe_plastic", shown=True, cause="plasticity")
DISCRETE = Step(name="hertz_to_quadratic", start="hertz", end="half_space_quadratic")
STEPS = (
    DISCRETE,
    GAP,
    BODIES,
    Step(name="elements_to_fe", start="elements", end="fe"),
    PLASTIC,
)
"""All steps in order; the last step is for bodies that may yield."""


RUNGS: Mapping[str, str] = {
    "hertz": "closed form",
    "half_space_quadratic": "Hertz's gap on a discrete half-space, which checks the discretisation",
    "half_space": "the true gap on the half-space",
    "elements": "the true gap between the finite bodies, on their elements' own nodes",
    "fe": "on finer nodes, with a half-space of the bodies' material in place of what the elements answer near by",
    "fe_plastic": "the first loading of bodies that yield, where a yield stress is given",
}
"""Description of each rung, by its name, from Hertz on."""


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Measures on each of the `RUNGS`, and their deviations from Hertz, all under the same normal force.

    `half_space`, `fe` and `fe_plastic` have the same nodes: their differences do not come from the discretisation.
    """

    rungs: Mapping[str, Measures]
    misfits: Mapping[str, Misfit]

    @classmethod
    def of(cls, hertz: HertzContact, rungs: Sequence[tuple[str, Rung]]) -> Ladder:
        """Read the rungs of a load, from Hertz on."""
        return cls(
            rungs={"hertz": hertz_measures(hertz), **{name: measures_of(rung) for name, rung in rungs}},
            misfits={name: misfit_of(rung, hertz) for name, rung in rungs},
        )

    @property
    def steps(self) -> dict[str, dict[str, float]]:
        """Change of each measure by each step: relative, or absolute if Hertz has no value."""
        rungs = {name: rung.as_dict() for name, rung in self.rungs.items()}
        beside = {"hertz": dict.fromkeys(MISFITS, 0.0)} | {name: one.as_dict() for name, one in self.misfits.items()}
        return {
            step.name: {m: rungs[step.end][m] / rungs[step.start][m] - 1.0 for m in MEASURES}
            | {m: beside[step.end][m] - beside[step.start][m] for m in MISFITS}
            for step in STEPS
            if step.end in rungs
        }
