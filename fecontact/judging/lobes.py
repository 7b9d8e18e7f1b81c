"""Every patch of a contact, and every lobe of a joined one, as a contact of its own beside Hertz's ellipse."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from fecontact.case import Case
from fecontact.contact.grid import Rung
from fecontact.contact.patch import area_between, lobe_windows
from fecontact.contact_theories.approximation import Approximation, ellipse
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.contact_theories.registry import HERTZ, THEORIES, Loaded
from fecontact.judging.lines import EXACT, LobeOnLine, Moves, OnLine
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    deviations_of,
    measures_of,
    measures_of_theory,
    misfit_of_theory,
    patch_of,
)
from fecontact.judging.solved_load import Level, SolvedLoad, as_solved, finest_otherwise, uncertainties
from fecontact.judging.uncertainty import cut_planes_share, share_uncertainty
from fecontact.judging.verdict import Verdict, judge_on_lines
from fecontact.placement.poses import TouchPoint
from fecontact.placement.wheel_on_rail import Placement

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
    share = part.normal_force_N / sum(one.normal_force_N for one in parts_of(solved.levels[0].fe))
    numerical = uncertainties(solved.levels, read, deviation, share=share)
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

    shares, otherwise = [share(level.fe) for level in levels], share(finest_otherwise(levels))
    found = uncertainties(levels, read, dict.fromkeys(_READ, 0.0), share=shares[0])
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
    lobes, patch = (_on_line(part, case, placement) for part in parts_of(half_space)), patch_of(half_space)
    return OnLine(
        label=label, p_max_MPa=patch.p_max_MPa, deviations=deviations, patches=patch.pieces, lobes=tuple(lobes)
    )


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
