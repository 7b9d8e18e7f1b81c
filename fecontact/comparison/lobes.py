"""Every patch of a contact, and every lobe of a joined one, as a contact of its own beside Hertz's ellipse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from fecontact.comparison.approximation import Approximation, ellipse
from fecontact.comparison.measures import MEASURES, MISFITS, hertz_measures, measures_of, misfit_of_theory, patch_of
from fecontact.comparison.patch import area_between, lobe_columns
from fecontact.comparison.solved_load import SolvedLoad, uncertainties
from fecontact.comparison.verdict import Verdict, judge
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact, hertz_from_hessian

# What is read off a lobe; its approach is that of the bodies, and its extents end where the next one begins.
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
    normal_force_N
        Sum of its pressures.
    centre_mm, rail_y_mm, contact_angle_rad
        Its centre of pressure (x, s from the first touch point), and the rail there.
    touch_point, touch
        Number of the touch point, the one of the smallest gap between its ends; None without one, and then without an
        ellipse, deviations and a verdict.
    fe
        Its measures between the finite bodies.
    rungs
        Those of the lobe at the same place on the other rungs, as far as they have one.
    """

    normal_force_N: float
    centre_mm: tuple[float, float]
    rail_y_mm: float
    contact_angle_rad: float
    separate: bool
    touch_point: int | None
    touch: TouchPoint | None
    fe: Mapping[str, float]
    rungs: Mapping[str, Mapping[str, float]]
    hertz: HertzContact | None
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    verdict: Verdict | None


# each lobe looks for itself on all rungs
@lru_cache(maxsize=32)
def parts_of(rung: Rung) -> tuple[Part, ...]:
    """The lobes of a contact, from the gauge side on."""
    pressure, s = rung.pressure, rung.grid.s_mm
    columns = lobe_columns(pressure.whole().values)
    # what is read of the whole contact is read of a single lobe
    only = len(columns) == 1
    whole_area, force = rung.grid.whole_area_mm2(), rung.pressure_MPa.sum(axis=0)
    found = []
    for own in columns:
        kept = np.zeros_like(rung.pressure_MPa)
        kept[:, own] = rung.pressure_MPa[:, own]
        own_force_N = float(np.sum(kept.ravel() * whole_area))
        first, last = own.start, own.stop - 1
        # the column of a valley belongs to the lobe behind it
        after = own.stop if own.stop < s.size else last
        low, high = float(s[first]), float(s[after])
        found.append(
            Part(
                rung=rung if only else replace(rung, pressure_MPa=kept, normal_force_N=own_force_N),
                normal_force_N=own_force_N,
                low_mm=low,
                high_mm=high,
                area_mm2=patch_of(rung).area_mm2
                if only
                else area_between(
                    pressure, -np.inf if own is columns[0] else low, np.inf if own is columns[-1] else high
                ),
                separate=bool(force[first] == 0.0 or first == 0) and bool(force[after] == 0.0 or after == s.size - 1),
            )
        )
    return tuple(found)


def judge_lobes(solved: SolvedLoad, placement: Placement) -> tuple[LobeJudgement, ...]:
    """All lobes of a solved load, in the order of their forces."""
    half_space = parts_of(solved.half_space)
    judged = (_judge(part, solved, placement, half_space) for part in parts_of(solved.levels[0].fe))
    return tuple(sorted(judged, key=lambda one: -one.normal_force_N))


def _judge(part: Part, solved: SolvedLoad, placement: Placement, half_space: Sequence[Part]) -> LobeJudgement:
    patch = patch_of(part.rung)
    rail_y, _, angle = placement.on_profiles(patch.centre_x_mm, patch.centre_y_mm)
    number = _touch_below(part, placement)
    on_half_space = _same(half_space, part)
    measured = _measures(part)
    judgement = LobeJudgement(
        normal_force_N=part.normal_force_N,
        centre_mm=(patch.centre_x_mm, patch.centre_y_mm),
        rail_y_mm=rail_y,
        contact_angle_rad=angle,
        separate=part.separate,
        touch_point=number,
        touch=None if number is None else placement.touch_points[number],
        fe=measured,
        rungs={"fe": measured, **({} if on_half_space is None else {"half_space": _measures(on_half_space)})},
        hertz=None,
        deviation={},
        uncertainty={},
        verdict=None,
    )
    return judgement if number is None else _beside_hertz(judgement, part, solved, placement)


def _beside_hertz(judgement: LobeJudgement, part: Part, solved: SolvedLoad, placement: Placement) -> LobeJudgement:
    touch = judgement.touch
    assert touch is not None
    hessian = touch.curvature.hessian
    if np.linalg.eigvalsh(hessian)[0] <= 0.0:
        # the surfaces conform there
        return judgement
    hertz = hertz_from_hessian(
        hessian, normal_force_N=part.normal_force_N, contact_modulus_MPa=solved.case.contact_modulus_MPa
    )
    place = touch.x_mm - placement.first.x_mm, placement.arc_mm(touch)
    theory = Approximation(patches=(ellipse(hertz, place),), approach_mm=hertz.approach_mm)

    def read(rung: Rung) -> dict[str, float]:
        same = _same(parts_of(rung), part)
        return dict.fromkeys((*_READ, *MISFITS), float("nan")) if same is None else _values(same, theory)

    values, own = _values(part, theory), hertz_measures(hertz).as_dict()
    deviation = {name: own[name] / values[name] - 1.0 if name in MEASURES else values[name] for name in values}
    uncertainty = uncertainties(solved.levels, read, deviation)
    verdict = judge(deviation, uncertainty, solved.case.criteria).usable(solved.usable)
    return replace(judgement, hertz=hertz, deviation=deviation, uncertainty=uncertainty, verdict=verdict)


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
