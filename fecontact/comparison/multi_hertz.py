"""Hertz's ellipses at all touch points, sharing the load like springs, against the finite elements.

That is what vehicle codes with several contact points take for the contact. It is read by the same measures as one
ellipse, and judged by the same criteria.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from fecontact.comparison.judged_load import JudgedLoad, uncertainties
from fecontact.comparison.measures import MEASURES, Measures, hertz_on, measures_of, part_elsewhere, patch_of
from fecontact.comparison.patch import Patch, measure_patch
from fecontact.comparison.verdict import Verdict, judge
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.rung import Rung
from fecontact.geometry.placement import Placement
from fecontact.geometry.touch_points import TouchPoint
from fecontact.theory.hertz import HertzContact
from fecontact.theory.touch_hertz import HertzPoints

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PlacedEllipse:
    """An ellipse under its share of the load, at its touch point; x and s (mm) from the first touch point."""

    touch_point: int
    touch: TouchPoint
    hertz: HertzContact
    x_mm: float
    s_mm: float


@dataclass(frozen=True, kw_only=True)
class MultiHertz:
    """Ellipses that share a load, in the order of their forces.

    Attributes
    ----------
    approach_mm
        Along the contact normal at first touch.
    overlapping
        Whether two of them overlap, so that they are no patches of their own.
    """

    ellipses: tuple[PlacedEllipse, ...]
    approach_mm: float
    overlapping: bool

    @property
    def _parts(self) -> list[tuple[float, PlacedEllipse]]:
        total = sum(one.hertz.normal_force_N for one in self.ellipses)
        return [(one.hertz.normal_force_N / total, one) for one in self.ellipses]

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Centre of pressure (x, s)."""
        return sum(w * one.x_mm for w, one in self._parts), sum(w * one.s_mm for w, one in self._parts)

    @property
    def measures(self) -> Measures:
        """As of one ellipse: the areas summed up, half-widths from the second moments of all pressures together."""
        x, s = self.centre_mm
        # <x^2> of an ellipse is its half-width squared over 5
        xx = sum(w * ((one.x_mm - x) ** 2 + (0.5 * one.hertz.extent_x_mm) ** 2 / 5.0) for w, one in self._parts)
        ss = sum(w * ((one.s_mm - s) ** 2 + (0.5 * one.hertz.extent_y_mm) ** 2 / 5.0) for w, one in self._parts)
        low, high = self.box_mm
        return Measures(
            p_max_MPa=max(one.hertz.p0_MPa for one in self.ellipses),
            area_mm2=sum(one.hertz.area_mm2 for one in self.ellipses),
            a_mm=math.sqrt(5.0 * xx),
            b_mm=math.sqrt(5.0 * ss),
            extent_x_mm=high[0] - low[0],
            extent_y_mm=high[1] - low[1],
            approach_mm=self.approach_mm,
        )

    @property
    def box_mm(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Smallest and largest (x, s) of all ellipses."""
        ends = [
            (at, 0.5 * length)
            for one in self.ellipses
            for at, length in ((one.x_mm, one.hertz.extent_x_mm), (one.s_mm, one.hertz.extent_y_mm))
        ]
        x, s = ends[::2], ends[1::2]
        return (min(a - e for a, e in x), min(a - e for a, e in s)), (
            max(a + e for a, e in x),
            max(a + e for a, e in s),
        )

    def on(self, grid: ContactGrid, moved_mm: tuple[float, float] = (0.0, 0.0)) -> Floats:
        """Pressure (nx, ns) in MPa of all ellipses, moved together, in the mean over a cell of each node."""
        return np.asarray(
            sum(hertz_on(grid, one.hertz, (one.x_mm + moved_mm[0], one.s_mm + moved_mm[1])) for one in self.ellipses)
        )

    def patch_on(self, rung: Rung) -> Patch:
        """What is read off these ellipses on nodes as those of a contact."""
        covering = _covering(rung, self)
        return measure_patch(Field(grid=covering.grid, values=self.on(covering.grid)))


@dataclass(frozen=True, kw_only=True, eq=False)
class MultiHertzJudgement:
    """Ellipses that share the load against the finite elements; the attributes are as of one side's judgement."""

    contact: MultiHertz
    measures: Measures
    deviation: Mapping[str, float]
    uncertainty: Mapping[str, float]
    verdict: Verdict


def multi_hertz(placement: Placement, points: HertzPoints, direction: Floats) -> MultiHertz | None:
    """The ellipses that share a load along a unit vector (3,); None where surfaces conform at a touch point.

    At a curvature junction the curvature is that of the field side.
    """
    if points.shared_approach_mm is None:
        return None
    ellipses = []
    for point in points.points:
        if point.shared is None:
            continue
        touch = placement.touch_points[point.touch_point]
        ellipses.append(
            PlacedEllipse(
                touch_point=point.touch_point,
                touch=touch,
                hertz=point.shared,
                x_mm=touch.x_mm - placement.first.x_mm,
                s_mm=placement.arc_mm(touch),
            )
        )
    return MultiHertz(
        ellipses=tuple(sorted(ellipses, key=lambda one: -one.hertz.normal_force_N)),
        approach_mm=points.shared_approach_mm * float(placement.first.normal @ direction),
        overlapping=points.overlapping,
    )


def judge_multi_hertz(load: JudgedLoad, contact: MultiHertz) -> MultiHertzJudgement:
    """Judge ellipses that share the load of a solved case, by its criteria and from its stored fields.

    What points of profiles leave open is taken to be that of one ellipse.
    """
    solved, finest = load.solved, load.fe
    measures = contact.measures
    fe, own = measures_of(finest).as_dict(), measures.as_dict()
    deviation = {name: own[name] / fe[name] - 1.0 for name in MEASURES} | _misfits(finest, contact)
    of_points = {} if solved.point_noise is None else solved.point_noise.uncertainty()
    known = uncertainties(solved.levels, lambda rung: measures_of(rung).as_dict() | _misfits(rung, contact), deviation)
    uncertainty = {name: value + of_points.get(name, 0.0) for name, value in known.items()}
    verdict = judge(deviation, uncertainty, load.case.criteria).usable(load.status == "converged")
    return MultiHertzJudgement(
        contact=contact, measures=measures, deviation=deviation, uncertainty=uncertainty, verdict=verdict
    )


@lru_cache(maxsize=16)
def _misfits(rung: Rung, contact: MultiHertz) -> dict[str, float]:
    """The misfits of a contact beside these ellipses; of the valley what it has more of than they.

    A single ellipse is moved to the centre of pressure before the misplaced load is counted, so that a centre that is
    off counts once. Several stay where they are. Their common centre follows from how they share the load: shares that
    are off by 2 to 6 % between patches 11 mm apart would move each away from its own patch by that part of 11 mm. Of
    49 contacts (60E1, 60E2, 54E1 and UIC60 under S1002, 20 and 100 kN, two points, on the half-space) ellipses hold in
    six, with 2 to 8 % misplaced, where one fails; moved together they would misplace 12 to 38 % in five of these. To
    move each to its own patch would change the verdict of none of the 49, and hide from every measure what the patches
    are beside the touch points (up to 0.9 of a half-width at an inclination of 1:20): the half-width over which the
    common centre is taken is then the distance of the patches. So what is misplaced is shares and places alike.
    """
    patch, own = patch_of(rung), contact.patch_on(rung)
    (x, s), half_width = contact.centre_mm, contact.measures.b_mm
    moved = (patch.centre_x_mm - x, patch.centre_y_mm - s) if len(contact.ellipses) == 1 else (0.0, 0.0)
    return {
        "centre_over_b": (patch.centre_y_mm - s) / half_width,
        "valley": patch.valley - own.valley,
        "separate_load": _unknown_load(rung, contact),
        "misplaced_load": _misplaced(rung, contact, moved),
    }


def _unknown_load(rung: Rung, contact: MultiHertz) -> float:
    """Part of the force on separate patches that are no ellipse's, and of ellipses that have no patch.

    One ellipse has one patch at most: of those below it the heaviest that a heavier ellipse has not taken, or, where
    all are taken, the heaviest, which they then share. For a single ellipse on its patch that is the load on all other
    patches, as Hertz is judged. Several would fail for every second patch that they rightly have, if they were judged
    as he is: whether they give it the right load is the misplaced load's matter, and the peak's.
    """
    whole = rung.pressure.whole()
    s, step = whole.grid.s_mm, whole.grid.steps_mm[1]
    pieces, count = label(whole.values > 0.0, structure=np.ones((3, 3)))
    ends = [s[(pieces == k).any(axis=0)][[0, -1]] for k in range(1, count + 1)]
    loads = np.array([whole.values[pieces == k].sum() for k in range(1, count + 1)])
    force = sum(one.hertz.normal_force_N for one in contact.ellipses)
    taken: set[int] = set()
    missing = 0.0
    for one in sorted(contact.ellipses, key=lambda one: -one.hertz.normal_force_N):
        low, high = (one.s_mm + side * 0.5 * one.hertz.extent_y_mm for side in (-1.0, 1.0))
        below = [k for k, (first, last) in enumerate(ends) if first - step <= high and low <= last + step]
        if not below:
            missing += one.hertz.normal_force_N / force
            continue
        free = [k for k in below if k not in taken]
        taken.add(max(free or below, key=lambda k: loads[k]))
    unknown = sum(load for k, load in enumerate(loads) if k not in taken) / loads.sum()
    return float(unknown + missing)


def _misplaced(rung: Rung, contact: MultiHertz, moved_mm: tuple[float, float]) -> float:
    covering = _covering(rung, contact, moved_mm)
    return part_elsewhere(covering.values, contact.on(covering.grid, moved_mm))


def _covering(rung: Rung, contact: MultiHertz, moved_mm: tuple[float, float] = (0.0, 0.0)) -> Field:
    low, high = contact.box_mm
    lengths = (2.0 * (max(abs(low[k]), abs(high[k])) + abs(moved_mm[k])) for k in (0, 1))
    return rung.pressure.covering(*lengths)
