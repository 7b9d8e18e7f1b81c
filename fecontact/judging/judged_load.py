"""Judged load: theories compared with the finite elements, with all results of a solved load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ, HERTZ_GAUGE
from fecontact.contact_theories.touch_hertz import Side
from fecontact.errors import CONVERGED
from fecontact.judging.causes import PatchGeometry
from fecontact.judging.comparison import Comparison
from fecontact.judging.ladder import Ladder
from fecontact.judging.lobes import LobeJudgement
from fecontact.judging.own_measures import OwnEvaluations
from fecontact.judging.solved_load import Level, SolvedLoad, Status
from fecontact.judging.verdict import Judgement, PlasticVerdict, Verdict, select_worst_judgement


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedLoad:
    """Solved load with all results that are read from it.

    Attributes
    ----------
    solved
        Contacts of the load on all mesh levels.
    judgements
        Judgement of each theory by its name (`theories.THEORIES`), if it was requested and has a contact. Hertz is
        always there. It has two entries if the contact point is at a curvature junction, where its ellipse is not
        defined.
    without
        Reason for each requested theory without a judgement.
    comparison, ladder, geometry
        Finest mesh level compared with Hertz on the field side, the rungs between both, and the profiles below the
        patch.
    bodies_step_uncertainty
        Uncertainty of the relative step of each measure from the half-space to the bodies (-).
    elements_uncertainty
        Relative uncertainty of the measures on the elements' nodes (-), if meshes show it.
    by_elements
        Hertz compared with the contact on the elements' nodes, on the side with the worse answer.
    status
        `converged` if the numbers may be used; any other status gives the reason against it.
    verdict
        Requested verdict on Hertz: against bodies that yield if there is a yield stress, else against elastic bodies.
        It is the worst of both sides, since users must be able to rely on it with either curvature.
    warnings
        Warnings that do not change the verdict.
    lobes
        Judgement of every lobe and separate patch, in the order of their forces; empty if only Hertz was requested.
    elastic_verdict
        Verdict on Hertz against elastic bodies, in addition to `verdict`; None without a yield stress.
    plastic
        First loading of bodies that may yield, with the verdict on Hertz; None without a yield stress.
    features
        Readings of features by their names, if more than Hertz was requested.
    own_evaluations
        Evaluations of criteria of a user, for another judgement without their functions.
    """

    solved: SolvedLoad
    judgements: Mapping[str, Judgement]
    without: Mapping[str, str]
    comparison: Comparison
    ladder: Ladder
    geometry: PatchGeometry
    bodies_step_uncertainty: Mapping[str, float]
    elements_uncertainty: Mapping[str, float]
    by_elements: Judgement
    status: Status
    verdict: Verdict
    warnings: tuple[str, ...]
    lobes: tuple[LobeJudgement, ...] = ()
    elastic_verdict: Verdict | None = None
    plastic: PlasticVerdict | None = None
    features: Mapping[str, Any] = field(default_factory=dict)
    own_evaluations: OwnEvaluations = field(default_factory=dict)

    def __repr__(self) -> str:
        case, verdict = self.case, self.verdict
        return (
            f"<JudgedLoad {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {self.load_N / 1e3:g} kN:"
            f" {self.status}, Hertz {verdict.answer} by {verdict.measure}"
            f"{', own criteria by stored values' * bool(self.stored_own)}>"
        )

    @property
    def case(self) -> Case:
        """Position under this load."""
        return self.solved.case

    @property
    def load_N(self) -> float:
        """Load of the case in N."""
        return self.solved.case.load_N

    @property
    def stored_own(self) -> tuple[str, ...]:
        """Measures of a user with stored values, because their functions are not available."""
        values = self.ladder.own_values.get("fe", {})
        return tuple(
            criterion.key
            for criterion in self.case.criteria.own or ()
            if not criterion.is_available and criterion.key in values
        )

    @property
    def level(self) -> Level:
        """Finest mesh level."""
        return self.solved.levels[0]

    @property
    def fe(self) -> Rung:
        """Contact between the finite bodies, on the finest mesh level."""
        return self.level.fe

    @property
    def usable(self) -> bool:
        """Whether the numbers of the load may be used."""
        return self.status == CONVERGED

    @property
    def normal_force_N(self) -> float:
        """Normal force of the finite elements along the contact normal at first contact."""
        return self.fe.normal_force_N

    @property
    def sides(self) -> Mapping[Side, Judgement]:
        """Judgement of Hertz by side: gauge and field, or both.

        The key is `both` if the curvatures of both sides are equal.
        """
        gauge, field = (self.judgements.get(name) for name in (HERTZ_GAUGE, HERTZ))
        assert field is not None
        return {"both": field} if gauge is None else {"gauge": gauge, "field": field}

    @property
    def deciding_side(self) -> Side:
        """Side of a junction that decides the verdict against elastic bodies.

        The field side decides if both answers are equal.
        """
        worst = select_worst_judgement(self.sides)
        return next(side for side, judgement in self.sides.items() if judgement is worst)

    @property
    def deciding(self) -> Judgement:
        """Judgement of Hertz against elastic bodies on the deciding side, with the load's verdict."""
        return replace(self.sides[self.deciding_side], verdict=self.elastic_verdict or self.verdict)

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse under the normal force, with the field side's curvature at a junction."""
        return self.judgements[HERTZ].hertz

    @property
    def deciding_ellipse(self) -> HertzContact:
        """Hertz's ellipse with the curvature of the side that decides the requested verdict."""
        return self.sides[(self.plastic or self).deciding_side].hertz

    @property
    def deviation(self) -> Mapping[str, float]:
        """(Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`, on the deciding side."""
        return self.deciding.deviation

    @property
    def uncertainty(self) -> Mapping[str, float]:
        """Numerical uncertainty of the deviations on the deciding side (-).

        A measure without a stated uncertainty has no entry.
        """
        return self.deciding.uncertainty

    @property
    def limit_utilisation(self) -> float:
        """Limit utilisation of Hertz against elastic bodies on the deciding side.

        Above 1 Hertz fails.
        """
        return self.deciding.limit_utilisation
