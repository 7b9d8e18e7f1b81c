"""A solved load and everything that is read from it: theories against the finite elements, each with its verdict."""

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
from fecontact.judging.solved_load import Level, SolvedLoad, Status
from fecontact.judging.verdict import Judgement, PlasticVerdict, Verdict, worst_judgement


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedLoad:
    """A solved load and everything that is read from it.

    Attributes
    ----------
    judgements
        Each theory by its name (`theories.THEORIES`), as far as it was asked for and has a contact. Hertz is always
        there, with two entries where the touch point lies at a curvature junction, so that its ellipse is not defined.
    without
        Why a theory that was asked for has none.
    comparison, ladder, geometry
        The finest mesh against Hertz on the field side, the rungs between both, and the profiles below the patch.
    bodies_step_uncertainty
        Uncertainty of the relative step of each measure from the half-space to the bodies.
    elements_uncertainty
        Relative uncertainty of the measures on the elements' own nodes, where meshes tell it.
    by_elements
        Hertz against the contact on the elements' own nodes alone, on the worse of both sides.
    verdict
        The verdict on Hertz that was asked for: against bodies that yield if there is a yield stress, else against
        elastic bodies. It is the worst of both sides: who takes either curvature must be able to rely on it.
    warnings
        What does not change the verdict.
    lobes
        Every lobe and separate patch by itself, in the order of their forces; none where Hertz alone was asked for.
    elastic_verdict
        The verdict on Hertz against elastic bodies beside it; None without a yield stress.
    plastic
        The first loading of bodies that may yield, and Hertz against it; None without a yield stress.
    features
        What features read of it, by their names, where more than Hertz was asked for.
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

    def __repr__(self) -> str:
        case, verdict = self.case, self.verdict
        return (
            f"<JudgedLoad {case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {self.load_N / 1e3:g} kN:"
            f" {self.status}, Hertz {verdict.answer} by {verdict.measure}>"
        )

    @property
    def case(self) -> Case:
        """The position under this load."""
        return self.solved.case

    @property
    def load_N(self) -> float:
        """The load of the case."""
        return self.solved.case.load_N

    @property
    def level(self) -> Level:
        """The finest pair of meshes."""
        return self.solved.levels[0]

    @property
    def fe(self) -> Rung:
        """Contact between the finite bodies, from the finest meshes."""
        return self.level.fe

    @property
    def usable(self) -> bool:
        """Whether its numbers may be used."""
        return self.status == CONVERGED

    @property
    def normal_force_N(self) -> float:
        """Force along the contact normal at first touch that the finite elements carry."""
        return self.fe.normal_force_N

    @property
    def sides(self) -> Mapping[Side, Judgement]:
        """Hertz with the curvature of the gauge side and of the field side, or of both if the curvatures are equal."""
        gauge, field = (self.judgements.get(name) for name in (HERTZ_GAUGE, HERTZ))
        assert field is not None
        return {"both": field} if gauge is None else {"gauge": gauge, "field": field}

    @property
    def deciding_side(self) -> Side:
        """Side of a junction that decides the verdict against elastic bodies; the field side for equal answers."""
        worst = worst_judgement(self.sides)
        return next(side for side, judged in self.sides.items() if judged is worst)

    @property
    def deciding(self) -> Judgement:
        """Hertz against elastic bodies, with the curvature of the side that decides, and the verdict of the load."""
        return replace(self.sides[self.deciding_side], verdict=self.elastic_verdict or self.verdict)

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse under that force, with the field side's curvature at a junction."""
        return self.judgements[HERTZ].hertz

    @property
    def deviation(self) -> Mapping[str, float]:
        """(Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`, on the side that decides."""
        return self.deciding.deviation

    @property
    def uncertainty(self) -> Mapping[str, float]:
        """Numerical uncertainty of the deviations, of those where it is known, on the side that decides."""
        return self.deciding.uncertainty

    @property
    def limit_used(self) -> float:
        """Limit utilisation of Hertz against elastic bodies, on the side that decides; above 1 Hertz fails."""
        return self.deciding.limit_used
