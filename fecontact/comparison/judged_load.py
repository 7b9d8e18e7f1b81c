"""A solved load and everything that is read from it: theories against the finite elements, each with its verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from fecontact.case import Case
from fecontact.comparison.cause import PatchGeometry
from fecontact.comparison.compare import Comparison
from fecontact.comparison.creep_comparison import CreepComparison
from fecontact.comparison.judgement import Judgement
from fecontact.comparison.ladder import Ladder
from fecontact.comparison.lobes import LobeJudgement
from fecontact.comparison.plastic_verdict import PlasticVerdict
from fecontact.comparison.solved_load import Level, SolvedLoad, Status
from fecontact.comparison.theories import HERTZ, HERTZ_GAUGE
from fecontact.comparison.verdict import Verdict
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import Side


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
        Of Hertz, the worst of both sides: who takes either curvature must be able to rely on it.
    warnings
        What does not change the verdict.
    lobes
        Every lobe and separate patch by itself, in the order of their forces; none where Hertz alone was asked for.
    creep
        Creep forces, where there is a friction and more than Hertz was asked for.
    plastic
        The first loading of bodies that may yield, and Hertz against it; None without a yield stress.
    creep_laws
        Each law of creep forces by its name (`creep_theories.CREEP_LAWS`), where they were asked for.
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
    verdict: Verdict
    warnings: tuple[str, ...]
    lobes: tuple[LobeJudgement, ...] = ()
    creep: CreepComparison | None = None
    plastic: PlasticVerdict | None = None
    creep_laws: Mapping[str, Judgement] = field(default_factory=dict)

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
    def status(self) -> Status:
        """`converged`, or why the load must not be used."""
        return self.solved.status

    @property
    def usable(self) -> bool:
        """Whether its numbers may be used."""
        return self.solved.usable

    @property
    def normal_force_N(self) -> float:
        """Force along the contact normal at first touch that the finite elements carry."""
        return self.fe.normal_force_N

    @property
    def sides(self) -> Mapping[Side, Judgement]:
        """Hertz with the curvature of the gauge side and of the field side, or of both where it is the same."""
        gauge, field = (self.judgements.get(name) for name in (HERTZ_GAUGE, HERTZ))
        assert field is not None
        return {"both": field} if gauge is None else {"gauge": gauge, "field": field}

    @property
    def deciding_side(self) -> tuple[Side, Judgement]:
        """The side whose verdict is that of the load; the field side where both say the same."""
        decided = (self.verdict.each, self.verdict.measure)
        return next(
            (side, one)
            for side, one in reversed([*self.sides.items()])
            if (one.verdict.each, one.verdict.measure) == decided
        )

    @property
    def hertz(self) -> HertzContact:
        """Hertz's ellipse under that force, with the field side's curvature at a junction."""
        return self.judgements[HERTZ].hertz

    @property
    def deviation(self) -> Mapping[str, float]:
        """(Hertz - FE) / FE of each of `MEASURES`, and the `MISFITS`."""
        return self.judgements[HERTZ].deviation

    @property
    def uncertainty(self) -> Mapping[str, float]:
        """Numerical uncertainty of the deviations, of those where it is known."""
        return self.judgements[HERTZ].uncertainty

    @property
    def limit_used(self) -> float:
        """By how much the measure that uses most of its limit does so, on the worst side; Hertz is off from 1 on."""
        used = [side.limit_used for side in self.sides.values()]
        return math.nan if any(math.isnan(part) for part in used) else max(used)
