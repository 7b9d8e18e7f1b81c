"""Verdict: does Hertz hold here, by which measure, why not, and how sure is that?"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact
from fecontact.contact_theories.registry import HERTZ_GAUGE
from fecontact.contact_theories.touch_hertz import Side
from fecontact.criteria import Criteria
from fecontact.judging.causes import PatchGeometry, cause_of
from fecontact.judging.ladder import PLASTIC, STEPS, Ladder
from fecontact.judging.lines import EXACT, Moves
from fecontact.judging.measures import MEASURES, Measures, deviations_of, measures_of, measures_of_theory, values_of
from fecontact.judging.solved_load import Level, SolvedLoad
from fecontact.judging.yielded import YIELD_BAND, Yielded

Answer = Literal["HOLDS", "FAILS", "UNRESOLVED"]
FROM_BEST: tuple[Answer, ...] = ("HOLDS", "UNRESOLVED", "FAILS")
"""Answers from the best to the worst."""


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether Hertz holds, and what decided it.

    Attributes
    ----------
    answer
        The worst of `each`.
    measure
        The measure that decided: the one furthest beyond its limit (FAILS), with the largest uncertainty for its limit
        (UNRESOLVED), or using most of its limit (HOLDS).
    each
        The answer of every measure that is judged.
    cause
        Why Hertz is off where it is, by more than a limit; `profile` where the measured profile leaves it open.
    unknown
        Measures that the result does not tell.
    lines
        The answer on each line that measured points allow, by its label; empty for exact lines.
    """

    TELLS = ("answer", "measure", "each", "failing", "cause", "unknown", "lines")

    answer: Answer
    measure: str
    each: Mapping[str, Answer]
    cause: str | None = None
    unknown: tuple[str, ...] = ()
    lines: Mapping[str, Answer] = field(default_factory=dict)

    @property
    def failing(self) -> tuple[str, ...]:
        """The measures that fail."""
        return tuple(measure for measure, answer in self.each.items() if answer == "FAILS")

    def usable(self, converged: bool) -> Verdict:
        """The verdict on a result: one that must not be used leaves it open."""
        return self if converged else replace(self, answer="UNRESOLVED")


def judge(deviation: Mapping[str, float], uncertainty: Mapping[str, float], criteria: Criteria) -> Verdict:
    """Compare deviations with their limits.

    A measure FAILS if it is beyond its limit by more than its uncertainty, HOLDS if it is within by more than that, and
    is UNRESOLVED otherwise, or where the result does not tell it. Hertz fails if a measure does, and holds if all do.
    """
    limits = criteria.limits
    unknown = tuple(measure for measure in limits if measure not in deviation or measure not in uncertainty)
    each = {
        measure: "UNRESOLVED" if measure in unknown else answer_of(deviation[measure], uncertainty[measure], limit)
        for measure, limit in limits.items()
    }
    worst = max(each.values(), key=FROM_BEST.index)

    def weight(measure: str) -> float:
        if measure in unknown or math.isnan(uncertainty[measure]) or math.isnan(deviation[measure]):
            return math.inf
        of = uncertainty[measure] if worst == "UNRESOLVED" else abs(deviation[measure])
        return of / limits[measure]

    decided = max((measure for measure, answer in each.items() if answer == worst), key=weight)
    return Verdict(answer=worst, measure=decided, each=each, unknown=unknown)


# A theory holds, or fails, where it does so on this part of the lines that measured points allow.
_OF_LINES = 0.95


def judge_on_lines(
    deviation: Mapping[str, float], uncertainty: Mapping[str, float], moves: Moves, criteria: Criteria
) -> tuple[Verdict, dict[str, float]]:
    """Judge on every line that measured points allow; with the uncertainty that the lines make of the one given.

    The measure that decided is the one that has the answer on most lines. What is stated covers every filter with every
    noise, of lines that have the contact; one that does not have it leaves the answer on it open. A line with other
    patches is judged by its own half-space, with the step to the finite elements of the own line as uncertainty.
    """
    own, stated = judge(deviation, uncertainty, criteria), dict(uncertainty)
    if not moves.by_line:
        return own, stated
    there = moves.deviations(deviation)
    on_lines = {}
    for label, moved in there.items():
        # relative uncertainties are of what the theory is divided by
        known = {
            name: value * abs((1.0 + moved[name]) / (1.0 + deviation[name])) if name in MEASURES else value
            for name, value in uncertainty.items()
        }
        step = moves.step_uncertainty(label, deviation)
        on_lines[label] = judge(moved, {name: value + step[name] for name, value in known.items()}, criteria)
    for name in stated:
        stated[name] += moves.farthest(name, deviation[name])
    each = {name: _of_lines([one.each[name] for one in on_lines.values()]) for name in own.each}
    answer = _of_lines([one.answer for one in on_lines.values()])

    def weight(measure: str) -> tuple[bool, int, float]:
        having = sum(one.each[measure] == answer for one in on_lines.values())
        of = stated.get(measure, math.inf) if answer == "UNRESOLVED" else abs(deviation.get(measure, math.inf))
        used = of / criteria.limits[measure]
        return each[measure] == answer, having if answer == "FAILS" else 0, math.inf if math.isnan(used) else used

    decided = replace(
        own, answer=answer, measure=max(each, key=weight), each=each, lines={k: v.answer for k, v in on_lines.items()}
    )
    return decided, stated


def _of_lines(answers: Sequence[Answer]) -> Answer:
    decided: tuple[Answer, ...] = ("HOLDS", "FAILS")
    return next((one for one in decided if answers.count(one) >= _OF_LINES * len(answers)), "UNRESOLVED")


def answer_of(deviation: float, uncertainty: float, limit: float) -> Answer:
    """Whether a deviation is within its limit, whatever it is inside its uncertainty."""
    if abs(deviation) - uncertainty > limit:
        return "FAILS"
    # not the other way round: what is not a number does not hold
    return "HOLDS" if abs(deviation) + uncertainty < limit else "UNRESOLVED"


AT_JUNCTION = "curvature undefined at the touch point"
"""Cause where the touch point lies at a curvature junction, whatever the ladder says."""


PROFILE = "profile"
"""Cause where the verdict is open because the measured profile is not known better."""


ELEMENTS = "elements"
"""Cause where the verdict is open because the finite elements do not answer as their material does."""


# --- A judged theory as a value: how far it is off the finite elements, how sure that is, and its verdict.


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """Whether a theory holds by its numbers, and what it says of the contact; without a name where none stands."""

    name: str = ""
    answer: Answer = "FAILS"
    made: Approximation | None = None

    @property
    def out_of_range(self) -> bool:
        """Whether the theory is out of its own range; what no theory of the pressure is has none."""
        return self.made is not None and self.made.status == "out of range"

    @property
    def label(self) -> str:
        """The name of a theory that holds, UNRESOLVED where that is open, `none` where all fail."""
        return {"HOLDS": self.name, "FAILS": "none"}.get(self.answer, self.answer)


@dataclass(frozen=True, kw_only=True, eq=False)
class Judgement:
    """A theory of the contact against the finite elements.

    Attributes
    ----------
    deviation
        (Theory - FE) / FE of each of `MEASURES`, and the `MISFITS`, or of a measure that a feature has.
    uncertainty
        Of the deviations, of those where it is known.
    limits
        Of the measures that decide.
    approximation
        What a theory of the pressure says.
    numerical, moves
        The part of the uncertainty that is the meshes', and how deviations move over the lines that points allow.
    """

    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    limits: Mapping[str, float]
    verdict: Verdict
    approximation: Approximation | None = None
    numerical: Mapping[str, float] = field(default_factory=dict)
    moves: Moves = EXACT

    def band(self, p_max_MPa: float) -> tuple[float, float] | None:
        """Least and largest peak over the lines, from that on the own line, with what meshes leave open of it."""
        unsure = self.numerical["p_max_MPa"] / abs(1.0 + self.deviation["p_max_MPa"])
        return self.moves.band(p_max_MPa, unsure)

    @property
    def measures(self) -> Measures:
        """The own measures of a theory of the pressure."""
        assert self.approximation is not None
        return measures_of_theory(self.approximation)

    @property
    def hertz(self) -> HertzContact:
        """The ellipse of a theory that has a single one."""
        assert self.approximation is not None
        assert self.approximation.single is not None
        ellipse = self.approximation.single.hertz
        assert ellipse is not None
        return ellipse

    @property
    def limit_used(self) -> float:
        """Largest part of a limit that the theory uses; above 1 it fails."""
        return float(np.max([abs(self.deviation[name]) / limit for name, limit in self.limits.items()]))

    @property
    def limit_range(self) -> tuple[float, float]:
        """The least and the most that this part may be; NaN where the uncertainty of a measure is not known."""
        used = np.array([abs(self.deviation[name]) for name in self.limits])
        unsure = np.array([self.uncertainty.get(name, math.nan) for name in self.limits])
        limits = np.array([*self.limits.values()])
        return float(np.max((used - unsure) / limits)), float(np.max((used + unsure) / limits))


def worst_judgement(judged: Mapping[str, Judgement] | Mapping[Side, Judgement]) -> Judgement:
    """The worst judgement of both sides; the field side's if both are equal."""
    return max(reversed([*judged.values()]), key=lambda one: FROM_BEST.index(one.verdict.answer))


def worst_of(judged: Mapping[str, Judgement]) -> Verdict:
    """The worst verdict of both sides; the field side's if both are equal."""
    return worst_judgement(judged).verdict


def standings(judged: Mapping[str, Judgement]) -> list[Standing]:
    """How judged theories stand, in their order."""
    return [Standing(name=name, answer=one.verdict.answer, made=one.approximation) for name, one in judged.items()]


def cheapest(theories: Iterable[Standing], *, in_range: bool = False) -> Standing:
    """The first theory by cost that does not fail; where it is open whether that one holds, so is the answer.

    A theory holds by its numbers. With `in_range` it must be in its own range too.
    """
    left = (one for one in theories if one.answer != "FAILS" and not (in_range and one.out_of_range))
    return next(left, Standing())


# --- What yielding does to a contact, and whether Hertz holds for the first loading of virgin steel.

NOT_IN_IT = "first loading of virgin steel: shakedown, residual stress, friction and repeated passes are not in it"
"""What the plastic rung does not say, wherever its numbers stand."""
# Of the change from half as many load steps: what is left is 0.3 to 0.5 of it.
_OF_THE_STEPS = 0.5
# Of the step itself, over the elements per semi-axis squared: two coarse meshes may agree by chance. With 4 elements
# peak and area of spheres at 1.8 to 3.5 yield stresses are up to 8 % of their step off, and two meshes say half of it.
_OF_ELEMENTS = 1.6
# What corrections leave of the peak, relative.
_OF_CORRECTIONS = 1e-4
# Of the von Mises peak: points of elements see 1 to 2 % too much below spheres, where two meshes agree.
_OF_STRESS = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticVerdict:
    """The first loading of bodies that may yield, as it is judged.

    Attributes
    ----------
    yielded
        As it was solved on the finest meshes.
    step_uncertainty
        Of the step `bodies_to_plastic` of each measure, for a yield stress that is exact.
    band
        The peak's, and each other measure's, step with a yield stress lower and higher by `YIELD_BAND`.
    judgements
        Hertz on each side of the touch point against bodies that yield, by the names of the theories.
    verdict
        The worst of them.
    first_yield_uncertainty
        Relative, of the load of first yield.
    plastic_load_N, plastic_measure
        Load at which plasticity alone takes up the limit of a measure, and which; None where it does not up to the
        load.
    cancelling
        Steps that take each other's place where Hertz holds although one is beyond a limit; empty where none do.
    """

    yielded: Yielded
    status: str
    step_uncertainty: Mapping[str, float]
    band: Mapping[str, tuple[float, float]]
    judgements: Mapping[str, Judgement]
    verdict: Verdict
    first_yield_uncertainty: float
    plastic_load_N: float | None
    plastic_measure: str | None
    cancelling: str

    @property
    def deciding(self) -> Judgement:
        """Hertz on the side that decided, against bodies that yield, with the verdict."""
        return replace(worst_judgement(self.judgements), verdict=self.verdict)

    @property
    def deciding_side(self) -> Side:
        """The side that decided; `both` where the curvature is the same on both."""
        if len(self.judgements) == 1:
            return "both"
        return "gauge" if worst_judgement(self.judgements) is self.judgements[HERTZ_GAUGE] else "field"

    @property
    def has_yielded(self) -> bool:
        """Whether anything yields under the load."""
        return any(body.largest_strain > 0.0 for body in self.yielded.bodies.values())


def judge_plastic(
    solved: SolvedLoad, judged: Mapping[str, Judgement], ladder: Ladder, geometry: PatchGeometry, *, at_junction: bool
) -> PlasticVerdict | None:
    """Judge the plastic rung of a load; None where no body has a yield stress, or it was not solved.

    Parameters
    ----------
    judged
        Hertz on each side of the touch point against elastic bodies.
    """
    finest = solved.levels[0]
    if finest.yielded is None:
        return None
    yielded, limits = finest.yielded, solved.case.criteria.limits
    status = "converged" if _converged(solved) else "not converged"
    (theory, *_) = (one.approximation for one in judged.values())
    assert theory is not None
    unsure = _step_uncertainty(solved.levels, theory)
    others = {name: _against(one, yielded, unsure, solved) for name, one in judged.items()}
    worst = worst_of(others)
    off = any(abs(one.deviation[worst.measure]) > limits[worst.measure] for one in others.values())
    cause: str | None = None
    if worst.answer != "HOLDS" and off:
        cause = AT_JUNCTION if at_junction else cause_of(ladder.steps, worst.measure, geometry, plastic=True)
    load_N, measure = _plastic_load(yielded, limits)
    return PlasticVerdict(
        yielded=yielded,
        status=status,
        step_uncertainty=unsure,
        band=_band(solved.levels),
        judgements=others,
        verdict=replace(worst, cause=cause).usable(status == "converged"),
        first_yield_uncertainty=_first_yield_uncertainty(solved.levels),
        plastic_load_N=load_N,
        plastic_measure=measure,
        cancelling=_cancelling(ladder.steps, limits) if worst.answer == "HOLDS" else "",
    )


def _converged(solved: SolvedLoad) -> bool:
    return solved.status == "converged" and all(
        level.yielded is not None and level.yielded.status == "converged" for level in solved.levels
    )


def _against(elastic: Judgement, yielded: Yielded, unsure: Mapping[str, float], solved: SolvedLoad) -> Judgement:
    """Hertz with one curvature against bodies that yield: as unsure as against elastic ones, and as the step is."""
    made = elastic.approximation
    assert made is not None
    deviation = deviations_of(yielded.fe, made)
    numerical = {
        name: known * _scale(name, deviation, elastic.deviation)
        + unsure[name] * (abs(1.0 + deviation[name]) if name in MEASURES else 1.0)
        for name, known in elastic.numerical.items()
    }
    verdict, uncertainty = judge_on_lines(deviation, numerical, elastic.moves, solved.case.criteria)
    return replace(elastic, deviation=deviation, uncertainty=uncertainty, numerical=numerical, verdict=verdict)


def _scale(name: str, deviation: Mapping[str, float], elastic: Mapping[str, float]) -> float:
    """How much a relative uncertainty of elastic bodies is of what Hertz is off from bodies that yield."""
    return abs((1.0 + deviation[name]) / (1.0 + elastic[name])) if name in MEASURES else 1.0


def _step(level: Level, yielded: Rung, theory: Approximation) -> dict[str, float]:
    """Change of each measure from elastic bodies on the same nodes: relative, or as it is where Hertz has no value."""
    before, after = values_of(level.fe, theory), values_of(yielded, theory)
    return {
        name: value / before[name] - 1.0 if name in MEASURES else value - before[name] for name, value in after.items()
    }


def _step_uncertainty(levels: Sequence[Level], theory: Approximation) -> dict[str, float]:
    """What meshes, load steps, corrections and the elements' own nodes leave open of the step of each measure."""
    told = [(level, level.yielded) for level in levels if level.yielded is not None]
    of_meshes = [_step(level, yielded.fe, theory) for level, yielded in told]
    half = [
        (found, _step(level, yielded.fewer_steps, theory))
        for found, (level, yielded) in zip(of_meshes, told, strict=True)
        if yielded.fewer_steps is not None
    ]
    if len(of_meshes) < 2:
        return dict.fromkeys(of_meshes[0], math.nan)
    finest, coarser = of_meshes[:2]
    on_elements, least = _on_elements(levels[0]), _OF_ELEMENTS / _elements_a_semi_axis(levels[0]) ** 2
    found = {}
    for name, value in finest.items():
        of_steps = _OF_THE_STEPS * abs(half[0][0][name] - half[0][1][name]) if half else 0.0
        own = abs(on_elements[name] - value) if name in on_elements else 0.0
        of_elements = max(abs(value - coarser[name]), least * abs(value))
        found[name] = of_elements + of_steps + own + _OF_CORRECTIONS
    return found


def _elements_a_semi_axis(level: Level) -> float:
    patch, (step_x, step_y) = measures_of(level.fe), level.nodal.grid.steps_mm
    return min(patch.a_mm / step_x, patch.b_mm / step_y)


def _on_elements(level: Level) -> dict[str, float]:
    """The step of what the elements' own nodes tell well of a plastic pressure: its peak, and the approach."""
    assert level.yielded is not None
    before, after = (measures_of(rung).as_dict() for rung in (level.on_elements, level.yielded.nodal.even()))
    return {name: after[name] / before[name] - 1.0 for name in ("p_max_MPa", "approach_mm")}


def _first_yield_uncertainty(levels: Sequence[Level]) -> float:
    loads = [level.yielded.first_yield_N for level in levels if level.yielded is not None]
    # a load goes with the third power of the stress
    return math.nan if len(loads) < 2 else abs(loads[1] / loads[0] - 1.0) + 3.0 * _OF_STRESS


def _band(levels: Sequence[Level]) -> dict[str, tuple[float, float]]:
    """Steps with a lower and a higher yield stress: what those move on coarse meshes, about the finest one's step."""
    coarse = next((level.yielded for level in levels if level.yielded is not None and level.yielded.by_band), None)
    finest = levels[0].yielded
    if coarse is None or finest is None:
        return {}
    before, after = (measures_of(rung).as_dict() for rung in (levels[0].fe, finest.fe))
    of = coarse.by_band
    found = {}
    for name in MEASURES:
        ratio = after[name] / before[name] / (1.0 + of["given"][name])
        found[name] = (ratio * (1.0 + of["lower"][name]) - 1.0, ratio * (1.0 + of["higher"][name]) - 1.0)
    return found


def _plastic_load(yielded: Yielded, limits: Mapping[str, float]) -> tuple[float | None, str | None]:
    """Load at which plasticity alone first takes up the limit of a measure, interpolated between the path's loads."""
    found: list[tuple[float, str]] = []
    for name in (name for name in limits if name in MEASURES):
        load_N, step = yielded.first_yield_N, 0.0
        for point in yielded.path:
            here = abs(point.steps[name])
            if here > limits[name]:
                part = (limits[name] - step) / (here - step)
                found.append((load_N + part * (point.load_N - load_N), name))
                break
            load_N, step = point.load_N, here
    return min(found, default=(None, None), key=lambda one: one[0] or 0.0)


def _cancelling(steps: Mapping[str, Mapping[str, float]], limits: Mapping[str, float]) -> str:
    """Steps of one measure that are beyond its limit and make up for each other."""
    for name in (name for name in limits if name in MEASURES):
        moved = {step.cause: steps[step.name][name] for step in STEPS if step.cause and step.name in steps}
        if abs(moved[PLASTIC.cause]) > limits[name]:
            text = ", ".join(f"{cause} {1e2 * part:+.1f} %" for cause, part in moved.items())
            return f"HOLDS by cancellation of {text}"
    return ""


def plastic_warnings(found: PlasticVerdict | None) -> list[str]:
    """What yielding does, in words, with what is not in it."""
    if found is None:
        return []
    yielded, load_kN = found.yielded, found.yielded.first_yield_N / 1e3
    who = (
        f"the {yielded.first_body} yields first, from {load_kN:.3g} kN ± {1e2 * found.first_yield_uncertainty:.0f} % on"
    )
    if not found.has_yielded:
        return [f"plasticity: nothing yields under this load; {who} ({NOT_IN_IT})"]
    if found.status != "converged":
        return [f"plasticity: {who}; what it does to the contact was not solved: {found.status} ({NOT_IN_IT})"]
    before_to_after = yielded.path[-1].steps
    (low, high) = found.band.get("p_max_MPa", (math.nan, math.nan))
    said = (
        f"plasticity: {who}; the peak changes by {1e2 * before_to_after['p_max_MPa']:+.1f} ±"
        f" {1e2 * found.step_uncertainty['p_max_MPa']:.1f} %, the area by {1e2 * before_to_after['area_mm2']:+.1f} ±"
        f" {1e2 * found.step_uncertainty['area_mm2']:.1f} %; with yield stresses {1e2 * YIELD_BAND:.0f} % lower and"
        f" higher the peak by {1e2 * low:+.1f} and {1e2 * high:+.1f} %"
    )
    against = f"Hertz {found.verdict.answer} against bodies that yield"
    return [f"{said}; {against}{'; ' * bool(found.cancelling)}{found.cancelling} ({NOT_IN_IT})"]
