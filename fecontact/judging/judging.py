"""From a solved load to what it says: the ladder, the lobes, and each theory judged alike."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from fecontact.case import Case
from fecontact.contact.elements import UNSEEN_COMPLIANCE
from fecontact.contact.grid import Rung
from fecontact.contact.patch import area_between, lobe_windows
from fecontact.contact_theories.approximation import Approximation, ellipse
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, HERTZ_GAUGE, THEORIES, Loaded
from fecontact.contact_theories.touch_hertz import Side
from fecontact.errors import CONVERGED
from fecontact.features import offered
from fecontact.judging.ladder import (
    REFERENCE_LIMIT,
    Comparison,
    Ladder,
    PatchGeometry,
    cause_of,
    compare,
    patch_geometry,
    reference_error,
)
from fecontact.judging.lines import EXACT, Lines, LobeOnLine, Moves, OnLine
from fecontact.judging.measures import (
    FLOORS,
    MEASURES,
    MISFITS,
    deviations_of,
    measures_of,
    measures_of_theory,
    misfit_of_theory,
    patch_of,
    values_of,
)
from fecontact.judging.solved_load import (
    CONTRADICTION,
    ELEMENTS_OFF,
    REFERENCES_OFF,
    Level,
    SolvedLoad,
    Status,
    as_solved,
    cut_planes_share,
    elements_uncertainties,
    finest_otherwise,
    share_uncertainty,
    step_uncertainty,
    uncertainties,
    unmeshed_uncertainties,
    unmeshed_uncertainty,
)
from fecontact.judging.verdict import (
    AT_JUNCTION,
    ELEMENTS,
    PROFILE,
    Answer,
    Judgement,
    PlasticVerdict,
    Verdict,
    judge_on_lines,
    judge_plastic,
    plastic_warnings,
    worst_judgement,
    worst_of,
)
from fecontact.placement.placement import Placement
from fecontact.placement.poses import TouchPoint

# --- Every patch of a contact, and every lobe of a joined one, as a contact of its own beside Hertz's ellipse.

# What is read off a lobe; its approach is the approach of the bodies, and its extents end where the next one begins.
_READ = ("p_max_MPa", "area_mm2", "a_mm", "b_mm")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A lobe of a contact: its pressure alone, and where it lies across (mm from the first touch point).

    Attributes
    ----------
    rung
        The contact with all other pressures taken away; itself where there are none.
    normal_force_N
        Sum of its pressures.
    low_mm, high_mm
        Its ends: valleys, or the edge of the patch.
    area_mm2
        Its area up to them.
    separate
        Whether the pressure falls to zero at both ends.
    """

    rung: Rung
    normal_force_N: float
    low_mm: float
    high_mm: float
    area_mm2: float
    separate: bool


@dataclass(frozen=True, kw_only=True)
class LobeJudgement:
    """A lobe or a separate patch, and Hertz's ellipse under its force at the touch point that lies below it.

    Attributes
    ----------
    p_max_lines_MPa
        Its least and largest peak over the lines that measured points allow, with what meshes leave open of it; None of
        exact lines.
    normal_force_N
        Sum of its pressures.
    centre_mm, rail_y_mm, contact_angle_rad
        Its centre of pressure (x, s from the first touch point), and the rail there.
    touch_point, touch
        Number of the touch point, the one of the smallest gap between its ends; None without one, and then without an
        ellipse, deviations and a verdict.
    fe, fe_uncertainty
        Its measures between the finite bodies, and what meshes and their nodes leave open of them and of its force
        (relative).
    rungs
        Measures of the lobe on each other rung that has a lobe at this place.
    """

    normal_force_N: float
    centre_mm: tuple[float, float]
    rail_y_mm: float
    contact_angle_rad: float
    separate: bool
    touch_point: int | None
    touch: TouchPoint | None
    fe: Mapping[str, float]
    fe_uncertainty: Mapping[str, float]
    rungs: Mapping[str, Mapping[str, float]]
    hertz: HertzContact | None = None
    deviation: Mapping[str, float] = field(default_factory=dict)
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    verdict: Verdict | None = None
    p_max_lines_MPa: tuple[float, float] | None = None


# each lobe looks for itself on all rungs
@lru_cache(maxsize=32)
def parts_of(rung: Rung) -> tuple[Part, ...]:
    """The lobes of a contact, from the gauge side on."""
    pressure, s = rung.pressure, rung.grid.s_mm
    windows = lobe_windows(pressure.whole().values)
    # what is read of the whole contact is read of a single lobe
    only = len(windows) == 1
    whole_area, force = rung.grid.whole_area_mm2(), rung.pressure_MPa.sum(axis=0)
    found = []
    for own in windows:
        kept = np.zeros_like(rung.pressure_MPa)
        kept[:, own.columns] = own.parts * rung.pressure_MPa[:, own.columns]
        own_force_N = float(np.sum(kept.ravel() * whole_area))
        first, last = own.columns.start, own.columns.stop - 1
        low, high = (float(np.interp(end, np.arange(s.size), s)) for end in (own.low, own.high))
        found.append(
            Part(
                rung=rung if only else replace(rung, pressure_MPa=kept, normal_force_N=own_force_N),
                normal_force_N=own_force_N,
                low_mm=low,
                high_mm=high,
                area_mm2=patch_of(rung).area_mm2
                if only
                else area_between(
                    pressure, -np.inf if own is windows[0] else low, np.inf if own is windows[-1] else high
                ),
                separate=bool(force[first] == 0.0 or first == 0) and bool(force[last] == 0.0 or last == s.size - 1),
            )
        )
    return tuple(found)


def judge_lobes(solved: SolvedLoad, placement: Placement, *, usable: bool) -> tuple[LobeJudgement, ...]:
    """All lobes of a solved load, in the order of their forces."""
    half_space = parts_of(solved.half_space)
    judged = (_judge(part, solved, placement, half_space, usable=usable) for part in parts_of(solved.levels[0].fe))
    return tuple(sorted(judged, key=lambda one: -one.normal_force_N))


def _judge(
    part: Part, solved: SolvedLoad, placement: Placement, half_space: Sequence[Part], *, usable: bool
) -> LobeJudgement:
    patch = patch_of(part.rung)
    rail_y, _, angle = placement.on_profiles(patch.centre_x_mm, patch.centre_y_mm)
    number = _touch_below(part, placement)
    on_half_space = _same(half_space, part)
    measured, unsure = _measures(part), lobe_uncertainties(part, solved.levels)
    moves = EXACT if solved.lines is None else solved.lines.moves_of_lobe(rail_y)
    judgement = LobeJudgement(
        normal_force_N=part.normal_force_N,
        centre_mm=(patch.centre_x_mm, patch.centre_y_mm),
        rail_y_mm=rail_y,
        contact_angle_rad=angle,
        separate=part.separate,
        touch_point=number,
        touch=None if number is None else placement.touch_points[number],
        fe=measured,
        fe_uncertainty=unsure,
        rungs={"fe": measured, **({} if on_half_space is None else {"half_space": _measures(on_half_space)})},
        p_max_lines_MPa=moves.band(measured["p_max_MPa"], unsure["p_max_MPa"]),
    )
    if number is None:
        return judgement
    beside = _beside_hertz(judgement, part, solved, placement, moves)
    return beside if beside.verdict is None else replace(beside, verdict=beside.verdict.usable(usable))


def _beside_hertz(
    judgement: LobeJudgement, part: Part, solved: SolvedLoad, placement: Placement, moves: Moves
) -> LobeJudgement:
    assert judgement.touch_point is not None
    theory = _ellipse_below(part, judgement.touch_point, placement, solved.case)
    if theory is None:
        # the surfaces conform there
        return judgement

    def read(rung: Rung) -> dict[str, float]:
        same = _same(parts_of(rung), part)
        return dict.fromkeys((*_READ, *MISFITS), float("nan")) if same is None else _values(same, theory)

    deviation = _off(_values(part, theory), theory)
    numerical = uncertainties(solved.levels, read, deviation)
    verdict, uncertainty = judge_on_lines(deviation, numerical, moves, solved.case.criteria)
    assert theory.single is not None
    return replace(
        judgement,
        hertz=theory.single.hertz,
        deviation=deviation,
        uncertainty=uncertainty,
        verdict=verdict,
    )


def lobe_uncertainties(part: Part, levels: Sequence[Level]) -> dict[str, float]:
    """Uncertainty of a lobe's force and of what is read off it on the finest level, relative."""

    def read(rung: Rung) -> dict[str, float]:
        same = _same(parts_of(rung), part)
        return dict.fromkeys(_READ, float("nan")) if same is None else _measures(same)

    def share(rung: Rung) -> float:
        parts = parts_of(rung)
        same = _same(parts, part)
        return math.nan if same is None else same.normal_force_N / sum(one.normal_force_N for one in parts)

    found = uncertainties(levels, read, dict.fromkeys(_READ, 0.0))
    shares, otherwise = [share(level.fe) for level in levels], share(finest_otherwise(levels))
    of_share = share_uncertainty(shares, as_solved(levels), otherwise=otherwise) + cut_planes_share(shares[0])
    return {"normal_force_N": of_share / shares[0]} | found


def _ellipse_below(part: Part, touch_point: int, placement: Placement, case: Case) -> Approximation | None:
    """Hertz at a touch point under a lobe's force; None where the surfaces conform."""
    touch = placement.touch_points[touch_point]
    hessian = touch.curvature.hessian
    if np.linalg.eigvalsh(hessian)[0] <= 0.0:
        return None
    hertz = hertz_from_hessian(
        hessian, normal_force_N=part.normal_force_N, contact_modulus_MPa=case.contact_modulus_MPa
    )
    place = touch.x_mm - placement.first.x_mm, placement.arc_mm(touch)
    return Approximation(patches=(ellipse(hertz, place),), approach_mm=hertz.approach_mm)


def _off(values: Mapping[str, float], theory: Approximation) -> dict[str, float]:
    """What an ellipse is off the values of a lobe."""
    own = measures_of_theory(theory).as_dict()
    return {name: own[name] / values[name] - 1.0 if name in MEASURES else values[name] for name in values}


def _measures(part: Part) -> dict[str, float]:
    read = measures_of(part.rung).as_dict()
    return {name: read[name] for name in _READ} | {"area_mm2": part.area_mm2}


def _values(part: Part, theory: Approximation) -> dict[str, float]:
    """Measures of a lobe, and of what is beside its ellipse."""
    return _measures(part) | misfit_of_theory(part.rung, theory).as_dict()


def _same(parts: Sequence[Part], part: Part) -> Part | None:
    """The lobe that carries most of those whose centre of pressure lies within another one's ends."""
    inside = [one for one in parts if part.low_mm <= patch_of(one.rung).centre_y_mm <= part.high_mm]
    return max(inside, key=lambda one: one.normal_force_N, default=None)


def _touch_below(part: Part, placement: Placement) -> int | None:
    inside = [
        number
        for number, touch in enumerate(placement.touch_points)
        if part.low_mm <= placement.arc_mm(touch) <= part.high_mm
    ]
    return min(inside, key=lambda number: placement.touch_points[number].vertical_gap_mm, default=None)


# --- One line that measured points allow: theories and every lobe against the half-space on it.


def judge_line(label: str, case: Case, placement: Placement, half_space: Rung) -> OnLine:
    """What theories are off the half-space on a line of rail and wheel, and Hertz on every lobe of it."""
    loaded = Loaded(placement=placement, case=case, normal_force_N=half_space.normal_force_N, half_space=half_space)
    deviations: dict[str, dict[str, float]] = {}
    for name, theory in THEORIES.items():
        made = theory.approximate(loaded)
        if made is None:
            # it is Hertz on this line
            deviations[name] = deviations[HERTZ]
        elif not isinstance(made, str) and made.definite:
            deviations[name] = deviations_of(half_space, made)
    lobes = (_on_line(part, case, placement) for part in parts_of(half_space))
    return OnLine(label=label, p_max_MPa=patch_of(half_space).p_max_MPa, deviations=deviations, lobes=tuple(lobes))


def _on_line(part: Part, case: Case, placement: Placement) -> LobeOnLine:
    low, high = sorted(placement.on_profiles(0.0, end)[0] for end in (part.low_mm, part.high_mm))
    number = _touch_below(part, placement)
    theory = None if number is None else _ellipse_below(part, number, placement, case)
    return LobeOnLine(
        low_y_mm=low,
        high_y_mm=high,
        normal_force_N=part.normal_force_N,
        p_max_MPa=_measures(part)["p_max_MPa"],
        deviation={} if theory is None else _off(_values(part, theory), theory),
    )


# --- A solved load and everything that is read from it: theories against the finite elements, each with its verdict.


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
    plastic: PlasticVerdict | None = None
    features: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        case, verdict = self.case, self.answer
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
    def deciding_side(self) -> tuple[Side, Judgement]:
        """The side that decides the load's verdict; the field side if both agree."""
        decided = (self.verdict.each, self.verdict.measure)
        return next(
            (side, one)
            for side, one in reversed([*self.sides.items()])
            if (one.verdict.each, one.verdict.measure) == decided
        )

    @property
    def answer(self) -> Verdict:
        """The verdict that was asked for: against bodies that yield if there is a yield stress, else `verdict`."""
        return self.verdict if self.plastic is None else self.plastic.verdict

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
        """Largest part of a limit that Hertz uses, on the worst side; above 1 Hertz fails."""
        return float(np.max([side.limit_used for side in self.sides.values()]))


# --- What a judged load has to say beside its verdict.

# Displacements are taken for small beside the patch.
_SMALL_SLIDE = 0.1


def warnings_of(load: JudgedLoad) -> Iterator[str]:
    """What makes a load doubtful."""
    level, sides = load.level, load.sides
    if len(sides) > 1:
        said = (
            f"with the ellipse of its {side} side Hertz {one.verdict.answer} ({one.deviation['p_max_MPa']:+.1%} in peak"
            f" pressure, {one.deviation['area_mm2']:+.1%} in area)"
            for side, one in sides.items()
        )
        yield f"the curvature is undefined at the touch point: {'; '.join(said)}"
    yield from load.solved.limits
    # too little is seen of a half-space on them
    if math.isnan(level.compliance_error):
        yield (
            "the compliance of the elements is not checked: there are too few of them around the patch, or the head is"
            f" narrow or round for their size; {UNSEEN_COMPLIANCE:.0%} of it is taken for its uncertainty, more"
            " elements (--resolution) may show it"
        )
    part = abs(level.slide_mm) / load.comparison.fe.b_mm
    if not part <= _SMALL_SLIDE:
        yield (
            f"the wheel slides {abs(level.slide_mm):.2f} mm down the steep rail under the load, {part:.2f} of the"
            f" patch's half-width: beyond {_SMALL_SLIDE:g} of it what is stated for the finite elements does not cover"
            " what displacements do that are not small; a smaller load or a place that is less steep is known better"
        )
    yield from plastic_warnings(load.plastic)


def position_notes(placement: Placement, comparison: Comparison) -> Iterator[str]:
    """What is to be known of the profiles and of the contact as a whole."""
    rail = placement.rail.profile
    yield from placement.notes
    if not rail.outline:
        yield f"rail {rail.name}: only its running surface is known; the body below it is a block down to the cut"
    if placement.first.at_junction:
        yield (
            "the touch point lies at a curvature junction: deviations are those from Hertz with the curvature of its"
            " field side; the verdict is the worse of both sides"
        )
    if (pieces := comparison.patch.pieces) > 1:
        yield f"the contact has {pieces} separate patches; Hertz stands for the first touch point alone"


# --- From a solved load to what it says: the ladder, the lobes, and each theory judged alike.

Evidence = Literal["fe", "elements", "profiles"]
"""What a theory is held against."""


def judge_load(solved: SolvedLoad, placement: Placement, theories: Iterable[str] = THEORIES) -> JudgedLoad:
    """Read everything from a solved load, by the criteria of its case.

    Parameters
    ----------
    theories
        Those of the pressure that are asked for. Hertz is always judged; by Hertz alone lobes are not looked at, and
        features read nothing.
    """
    case, finest, touch = solved.case, solved.levels[0], placement.first
    judged = judge_hertz(case, solved.levels, placement, solved.lines)
    by_elements = worst_judgement(judge_hertz(case, solved.levels, placement, solved.lines, by="elements"))
    hertz = judged[HERTZ].hertz
    comparison = compare(finest.fe, hertz)
    ladder = Ladder.of(hertz, solved.rungs)
    geometry = patch_geometry(placement, finest.fe, hertz, comparison.patch)
    worst = worst_of(judged)
    status = _status(solved, ladder, placement, {worst.answer, by_elements.verdict.answer})
    usable = status == CONVERGED
    others = [name for name in theories if name not in EITHER_SIDE]
    found, without = _judge_theories(others, solved, placement, usable=usable)
    cause: str | None = None
    if _is_off(judged, worst, case):
        cause = AT_JUNCTION if touch.at_junction else cause_of(ladder.steps, worst.measure, geometry)
    if worst.answer == "UNRESOLVED" and profiles_leave_open(case, solved.levels, placement, solved.lines):
        cause = PROFILE
    certain = solved.status == ELEMENTS_OFF and fails_for_certain(judged, solved.half_space)
    if solved.status == ELEMENTS_OFF and not certain:
        cause = ELEMENTS
    plastic = judge_plastic(solved, judged, ladder, geometry, at_junction=touch.at_junction)
    load = JudgedLoad(
        solved=solved,
        judgements=judged | found,
        without=without,
        comparison=comparison,
        ladder=ladder,
        geometry=geometry,
        bodies_step_uncertainty=_bodies_step_uncertainty(solved, Approximation.of(hertz)),
        elements_uncertainty=elements_uncertainties(solved.levels),
        by_elements=replace(by_elements, verdict=by_elements.verdict.usable(usable)),
        status=status,
        verdict=replace(worst, cause=cause).usable(usable or certain),
        warnings=(),
        lobes=judge_lobes(solved, placement, usable=usable) if others else (),
        plastic=plastic,
    )
    load = replace(load, warnings=tuple(warnings_of(load)))
    return with_readings(load, placement) if others else load


def with_readings(load: JudgedLoad, placement: Placement, kind: str = "READINGS") -> JudgedLoad:
    """A judged load with what features read of it."""
    found = {name: read(load, placement) for name, read in offered(kind).items()}
    return replace(load, features={**load.features, **{name: one for name, one in found.items() if one is not None}})


def judge_hertz(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: Lines | None,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
) -> dict[str, Judgement]:
    """Judge Hertz with the curvature of each side of the first touch point, under the finest level's normal force."""
    found = {}
    for name in EITHER_SIDE:
        made = THEORIES[name].approximate(
            Loaded(placement=placement, case=case, normal_force_N=levels[0].fe.normal_force_N)
        )
        if isinstance(made, Approximation):
            moves = EXACT if lines is None else lines.moves(name)
            found[name] = judge_theory(case, levels, made, moves, by=by, refinements=refinements)
    return found


def profiles_leave_open(case: Case, levels: Sequence[Level], placement: Placement, lines: Lines | None) -> bool:
    """Whether Hertz is open by the lines that measured points allow alone."""
    if lines is None:
        return False
    return worst_of(judge_hertz(case, levels, placement, lines, by="profiles")).answer == "UNRESOLVED"


def no_mesh_decides(
    case: Case,
    levels: Sequence[Level],
    placement: Placement,
    lines: Lines | None,
    *,
    by: Evidence = "fe",
    refinements: int = 0,
) -> bool:
    """Whether Hertz stays open by what so many finer meshes leave as it is, if their numbers are those of today's.

    These are the lines that measured points allow, reading a measure off its nodes, and the bodies' cut planes.
    """
    worst = worst_of(judge_hertz(case, levels, placement, lines, by=by, refinements=refinements))
    return worst.answer == "UNRESOLVED" and (lines is not None or not worst.unknown)


def _judge_theories(
    names: Iterable[str], solved: SolvedLoad, placement: Placement, *, usable: bool
) -> tuple[dict[str, Judgement], dict[str, str]]:
    """Each theory judged, and why others have no contact."""
    loaded = Loaded(
        placement=placement,
        case=solved.case,
        normal_force_N=solved.levels[0].fe.normal_force_N,
        half_space=solved.half_space,
    )
    found, without = {}, {}
    for name in names:
        made = THEORIES[name].approximate(loaded)
        if isinstance(made, str):
            without[name] = made
        elif made is not None:
            moves = EXACT if solved.lines is None else solved.lines.moves(name)
            one = judge_theory(solved.case, solved.levels, made, moves)
            found[name] = replace(one, verdict=one.verdict.usable(usable and made.definite))
    return found, without


def judge_theory(
    case: Case,
    levels: Sequence[Level],
    made: Approximation,
    moves: Moves = EXACT,
    *,
    by: Evidence = "fe",
    refinements: int | None = None,
) -> Judgement:
    """Judge a theory against the finest level, by the criteria of a case.

    Parameters
    ----------
    moves
        How its deviations move over the lines that points of the profiles allow.
    by
        The contact on the finer nodes, that on the elements' own ones, or the finer one as if its meshes were exact, by
        the uncertainty of the profiles alone.
    refinements
        If given, the deviations are those of the finer nodes, and their uncertainty is what so many finer meshes would
        leave of it.
    """

    def read(rung: Rung) -> dict[str, float]:
        return values_of(rung, made)

    if refinements is not None:
        deviation = deviations_of(levels[0].fe, made)
        on_elements = refinements if by == "elements" else None
        left = unmeshed_uncertainties(levels[0], read, deviation, on_elements=on_elements)
        # of what meshes know less well than that finer ones may say anything
        known = {
            name: left[name] if value <= 2.0 * left[name] else 0.0
            for name, value in uncertainties(levels, read, deviation).items()
            if name in left
        }
    elif by == "elements":
        deviation = deviations_of(levels[0].on_elements, made)
        # of (Hertz - FE) / FE, from the uncertainty of the finite-element measure
        known = {
            name: value * abs(1.0 + deviation[name]) if name in MEASURES else value
            for name, value in elements_uncertainties(levels, read).items()
        }
    else:
        deviation = deviations_of(levels[0].fe, made)
        known = uncertainties(levels, read, deviation)
    slope = sum(line.largest_slope for line in case.irregularities)
    exact = by == "profiles"
    numerical = {
        name: (0.0 if exact else value) + unmeshed_uncertainty(name, deviation[name], slope=slope)
        for name, value in known.items()
    }
    verdict, uncertainty = judge_on_lines(deviation, numerical, moves, case.criteria)
    return Judgement(
        approximation=made,
        deviation=deviation,
        uncertainty=uncertainty,
        limits=case.criteria.limits,
        verdict=verdict,
        numerical=numerical,
        moves=moves,
    )


def _status(solved: SolvedLoad, ladder: Ladder, placement: Placement, answers: set[Answer]) -> Status:
    """Whether a load may be used: its solutions and elements, its references, and the answers of both verdicts."""
    if not solved.usable:
        return solved.status
    if not reference_error(ladder, placement) <= REFERENCE_LIMIT:
        return REFERENCES_OFF
    return CONTRADICTION if {"HOLDS", "FAILS"} <= answers else solved.status


# So many times its uncertainty beyond a limit a failure is certain, whatever the elements are.
_CERTAIN = 5.0


def fails_for_certain(judged: Mapping[str, Judgement], half_space: Rung) -> bool:
    """Whether the half-space alone says on every line of measured points that Hertz fails.

    Beyond a limit by five times any uncertainty, what the bodies change being one. Exact lines are never certain:
    meshes are refined there until they show what their numbers are.
    """
    return any(_is_certain(one, half_space) for one in judged.values() if one.moves.by_line)


def _is_certain(judged: Judgement, half_space: Rung) -> bool:
    assert judged.approximation is not None
    flat = deviations_of(half_space, judged.approximation)
    unsure = {
        name: judged.numerical.get(name, math.nan) + abs(flat[name] - judged.deviation[name]) for name in judged.limits
    }
    return all(
        any(abs(there[name]) - limit > _CERTAIN * unsure[name] for name, limit in judged.limits.items())
        for there in judged.moves.deviations(flat).values()
    )


def _is_off(judged: Mapping[str, Judgement], worst: Verdict, case: Case) -> bool:
    """Whether Hertz fails, or would if the numbers were exact: an open verdict by itself needs no cause."""
    limit = case.criteria.limits[worst.measure]
    return worst.answer != "HOLDS" and any(abs(one.deviation[worst.measure]) > limit for one in judged.values())


def _bodies_step_uncertainty(solved: SolvedLoad, hertz: Approximation) -> dict[str, float]:
    """Uncertainty of the step of each measure from the half-space to the bodies; it has no approach.

    The half-space of several lobes is not a single thing where the surface turns from one to the other: what lies
    between planes for patches and normals that all turn is a part.
    """
    on_half_space = values_of(solved.half_space, hertz)
    otherwise = values_of(finest_otherwise(solved.levels), hertz)
    turned = on_half_space if solved.turned is None else values_of(solved.turned, hertz)
    levels = [values_of(level.fe, hertz) for level in solved.levels]
    known, found = as_solved(solved.levels), {}
    for name, flat in on_half_space.items():
        if FLOORS[name] is not None:
            values = [one[name] for one in levels]
            ratio, size = (values[0] / flat, abs(flat)) if name in MEASURES else (1.0, 1.0)
            of_meshes = step_uncertainty(name, values, known, otherwise=otherwise[name])
            found[name] = abs(ratio) * (of_meshes + abs(turned[name] - flat) / size)
    return found
