"""Screening of a pair: every shift and load by a cheap theory, on each line that the points of its profiles allow.

A position is placed once for each shift and line. What all lines say is the verdict, anything else is open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact.patch import standing_peaks
from fecontact.contact_theories.approximation import Approximation, of_rung
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, THEORIES, Loaded, of_many
from fecontact.criteria import Criteria
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.fleet.model import Position, Screen
from fecontact.features.fleet.reading import Kept
from fecontact.features.fleet.tables import of_arrow
from fecontact.jobs.workers import Made
from fecontact.judging.ladder import PatchGeometry, cause_in_gap
from fecontact.judging.measures import FLOORS, MEASURES, deviations_of, measures_of_theory, part_elsewhere, unknown_load
from fecontact.judging.verdict import AT_JUNCTION, FROM_BEST, PROFILE, Answer, judge
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.wheel_on_rail import Placement
from fecontact.placement.wheelset import Wheelset
from fecontact.solving.alone import HALF_SPACE, STRIPS, normal_force_of
from fecontact.solving.placing import place_at_shifts, wheelset_of_case
from fecontact.solving.position import expect_on_half_space

PART = "part.parquet"
COLUMN: dict[str, str] = {
    limit.metadata["measure"]: limit.name for limit in fields(Criteria) if "measure" in limit.metadata
}
"""What the columns of each measure begin with; in percent of the screen's value, of Hertz's b, the peak, the load."""
_FIRST = ("place_y_mm", "touch_angle_mrad", "conicity", "contact_concentration", "hertz_p_max_MPa", "screen_p_max_MPa")
NUMBERS = (
    *("shift_mm", "load_kN", *_FIRST),
    *(f"{name}_{what}" for name in COLUMN.values() for what in ("percent", "uncertainty_percent")),
    *("margin", "lines_holding", "lines"),
)
TEXTS = ("verdict", "measure", "cause", "cheapest_theory", "reason")
Row = dict[str, Any]

# What strips leave open against the half-space on the same gap: of a measure relative, of the others as they are. S1002
# on 60E1 at -6 to 6 mm under 60 to 120 kN: the peak is within 0.32 %, a within 1.8 %, b and the centre within 0.9 %; at
# 5 mm, where patches lie in two planes, the peak within 1.7 % and a within 4.8 %.
_OF_STRIPS = {
    **{"p_max_MPa": 0.005, "area_mm2": 0.01, "a_mm": 0.02, "b_mm": 0.01},
    **{"centre_over_b": 0.01, "valley": 0.01, "separate_load": 0.0005, "misplaced_load": 0.01},
}
# Nodes on the narrowest semi-axis of a half-space, and how much more than `FLOORS` those leave open.
_NODES, _COARSER = 16, 4.0
# Places along and across at which pressures of two theories are held against each other.
_ALONG, _ACROSS = 24, 160


# --- Theories against the strips, by the measures that judge them against the finite elements.


def off_strips(strips: Approximation, theory: Approximation) -> dict[str, float]:
    """(Theory - strips) / strips of each of `MEASURES`, and the `MISFITS` of the strips beside the theory."""
    own, wanted = (measures_of_theory(one).as_dict() for one in (theory, strips))
    found = {name: own[name] / wanted[name] - 1.0 for name in MEASURES}
    apart = strips.centre_mm[1] - theory.centre_mm[1]
    moved = apart if theory.single is not None else 0.0
    pressures = _beside(strips, theory, moved)
    loads = np.array([one.normal_force_N for one in strips.patches])
    alone = 1.0 - float(loads.max() / loads.sum())
    ends = [(one.low_mm[1], one.high_mm[1]) for one in strips.patches]
    return found | {
        "centre_over_b": apart / theory.half_widths_mm[1],
        "valley": _valley(pressures[0]) - _valley(pressures[1]),
        "separate_load": alone if theory.single is not None else unknown_load(ends, loads, theory),
        "misplaced_load": part_elsewhere(*pressures),
    }


def _beside(strips: Approximation, theory: Approximation, moved_mm: float) -> tuple[Floats, Floats]:
    """Pressures of both on the middles of equal cells over a quarter of both, the theory moved across."""
    (_, low), (length, high) = strips.box_mm
    (_, other_low), (other_length, other_high) = theory.box_mm
    low, high = min(low, other_low + moved_mm), max(high, other_high + moved_mm)
    x = (np.arange(_ALONG) + 0.5) / _ALONG * max(length, other_length)
    s = low + (np.arange(_ACROSS) + 0.5) / _ACROSS * (high - low)
    return _pressure(strips, x, s), _pressure(theory, x, s - moved_mm)


def _pressure(theory: Approximation, x: Floats, s: Floats) -> Floats:
    parts = [
        one.shape.pressure_MPa(x[:, None] - one.origin_mm[0], s[None, :] - one.origin_mm[1]) for one in theory.patches
    ]
    return np.asarray(sum(parts))


def _valley(pressure: Floats) -> float:
    return standing_peaks(np.concatenate(([0.0], pressure[0], [0.0])), 0.0)[1]


# --- A position on one line.


@dataclass(frozen=True, kw_only=True, eq=False)
class _OnLine:
    """What the screen says on a line: the contact by its theory, what any other one is off it, and how sure that is."""

    loaded: Loaded
    contact: Approximation
    off: Callable[[Approximation], Mapping[str, float]]
    open: Mapping[str, float]

    def judged(self, name: str) -> tuple[Answer, Mapping[str, float], str] | None:
        """Answer for a theory, what it is off and the measure that decides; None where it has no contact of its own."""
        found: list[tuple[Answer, Mapping[str, float], str]] = []
        for side in EITHER_SIDE if name == HERTZ else (name,):
            made = of_many(side)(self.loaded)
            if isinstance(made, Approximation):
                off = self.off(made)
                verdict = judge(off, self.open, self.loaded.case.criteria)
                sure = made.definite and self.contact.status == "solved"
                found.append((verdict.answer if sure else "UNRESOLVED", off, verdict.measure))
        return max(reversed(found), key=lambda one: FROM_BEST.index(one[0]), default=None)


def _on_line(case: Case, placement: Placement, theory: Screen) -> _OnLine:
    loaded = Loaded(placement=placement, case=case, normal_force_N=normal_force_of(case, placement))
    if theory == STRIPS:
        contact = THEORIES[STRIPS].approximate(loaded)
        if not isinstance(contact, Approximation):
            raise InputError(f"{THEORIES[STRIPS].words}: {contact}")
        return _OnLine(loaded=loaded, contact=contact, off=partial(off_strips, contact), open=_OF_STRIPS)
    half_space = expect_on_half_space(case, placement, nodes=_NODES)[1].half_space
    loaded = replace(loaded, normal_force_N=half_space.normal_force_N, half_space=half_space)
    unsure = {name: _COARSER * floor for name, floor in FLOORS.items() if floor is not None}
    return _OnLine(loaded=loaded, contact=of_rung(half_space), off=partial(deviations_of, half_space), open=unsure)


# --- A position on all lines, and its row.


def _row(lines: Sequence[_OnLine]) -> Row:
    case, contact = lines[0].loaded.case, lines[0].contact
    limits = case.criteria.limits
    found = [one.judged(HERTZ) for one in lines]
    judged = [one for one in found if one is not None]
    if len(judged) < len(lines):
        raise InputError("no ellipse fits at the touch point")
    answers = [answer for answer, _, _ in judged]
    verdict = answers[0] if len(set(answers)) == 1 else "UNRESOLVED"
    off = {name: float(np.mean([one[name] for _, one, _ in judged])) for name in COLUMN}
    unsure = {name: max(abs(one[name] - off[name]) for _, one, _ in judged) + lines[0].open[name] for name in COLUMN}
    row: Row = {"hertz_p_max_MPa": _hertz_peak(lines), "screen_p_max_MPa": _mean_peak(lines)}
    for name, column in COLUMN.items():
        row[f"{column}_percent"], row[f"{column}_uncertainty_percent"] = 1e2 * off[name], 1e2 * unsure[name]
    return row | {
        "verdict": "OPEN" if verdict == "UNRESOLVED" else verdict,
        "measure": next((measure for answer, _, measure in judged if answer == verdict), judged[0][2]),
        "margin": min((1.0 - abs(off[name]) / limit) * limit / unsure[name] for name, limit in limits.items()),
        "lines_holding": answers.count("HOLDS"),
        "lines": len(lines),
        "cause": None if verdict == "HOLDS" else _cause(verdict, answers, lines[0], contact),
        "cheapest_theory": _cheapest(lines, answers),
    }


def _hertz_peak(lines: Sequence[_OnLine]) -> float:
    made = [THEORIES[HERTZ].approximate(one.loaded) for one in lines]
    return float(
        np.mean([max(patch.p_max_MPa for patch in one.patches) for one in made if isinstance(one, Approximation)])
    )


def _mean_peak(lines: Sequence[_OnLine]) -> float:
    return float(np.mean([max(patch.p_max_MPa for patch in one.contact.patches) for one in lines]))


def _cause(verdict: Answer, answers: Sequence[Answer], line: _OnLine, contact: Approximation) -> str:
    if len(set(answers)) > 1:
        return PROFILE
    if line.loaded.placement.first.at_junction:
        return AT_JUNCTION
    if contact.status != "solved":
        return f"{contact.status}: {'; '.join(contact.notes)}"
    return cause_in_gap(_geometry(line.loaded.placement, contact))


def _geometry(placement: Placement, contact: Approximation) -> PatchGeometry:
    """As much of the geometry below the patch as tells a cause."""
    low, high = contact.box_mm[0][1], contact.box_mm[1][1]
    places = [junction.s_mm for junction in placement.junctions]
    s = np.linspace(low, high, _ACROSS)
    ridge = _pressure(contact, np.zeros(1), s)[0]
    peaks, _ = standing_peaks(np.concatenate(([0.0], ridge, [0.0])), _OF_STRIPS["valley"])
    u = placement.rail.profile.at_arc_length(np.array([low, high]) + placement.first_arc_length_mm)
    return PatchGeometry(
        junction_distance_mm=abs(min(places, key=abs, default=math.inf)),
        junction_distance_over_b=math.nan,
        junction_in_patch=any(low <= place <= high for place in places),
        curvature_variation=math.nan,
        normal_turn_rad=float(np.ptp(placement.rail.section(u)[2])),
        lobes=len(peaks),
        pieces=len(contact.patches),
    )


def _cheapest(lines: Sequence[_OnLine], answers: Sequence[Answer]) -> str:
    """Hertz where it holds, OPEN where that is open; where it fails the first theory by cost that holds on all lines.

    The last one is the screen's own, by which all are judged.
    """
    if set(answers) != {"FAILS"}:
        return HERTZ if set(answers) == {"HOLDS"} else "OPEN"
    own = STRIPS if lines[0].open is _OF_STRIPS else HALF_SPACE
    others = (name for name in THEORIES if name not in (*EITHER_SIDE, STRIPS, HALF_SPACE))
    return next((name for name in others if all(_holds(line, name) for line in lines)), own)


def _holds(line: _OnLine, name: str) -> bool:
    judged = line.judged(name)
    return judged is not None and judged[0] == "HOLDS"


# --- A pair on its lines, placed once for each shift, and what its wheelset tells.

AMPLITUDE_MM, BAND_MM = 3.0, 2.0
"""Amplitude of the lateral motion, and width of the band on the rail."""
# Shifts at which both wheels stand. Wheels of unequal diameters have equal radii beside the middle of the track.
_STEP_MM, _FARTHEST_MM = 0.1, 10.0


def conicity_and_concentration(wheelset: Wheelset) -> tuple[float, float]:
    """Equivalent conicity, and concentration of the contact, of a lateral motion of `AMPLITUDE_MM` without roll.

    The conicity is by the kinematic motion about the shift of equal radii (EN 15302). The concentration is the largest
    part of equally likely shifts, about the middle of the track, at which first touch lies within a band of `BAND_MM`
    on the rail: 1 where it does not move, small where wear is spread. It is a definition of this program: the formula
    of Polach and Nicklisch's (2016) index was not found. NaN where a wheel does not stand over its rail, or there is no
    motion of this amplitude.
    """
    count = round(_FARTHEST_MM / _STEP_MM)
    shifts = [round(_STEP_MM * k, 9) for k in range(-count, count + 1)]
    left = wheelset.left.standings(shifts, 0.0, 0.0)
    right = left if wheelset.symmetric else wheelset.right.standings(shifts, 0.0, 0.0)
    radii = [np.array([math.nan if one is None else one.radius_mm for one in side]) for side in (left, right)]
    # what is nearer to the one rail is farther from the other
    difference = RadiusDifference.of(shifts, radii[0] - radii[1][::-1])
    conicity = math.nan if difference is None else difference.conicity(AMPLITUDE_MM)
    run = [one for shift, one in zip(shifts, left, strict=True) if abs(shift) <= AMPLITUDE_MM]
    # the place on the rail, which does not move
    places = np.sort([one.y_mm for one in run if one is not None])
    inside = np.searchsorted(places, places + BAND_MM, side="right") - np.arange(places.size)
    return conicity, float(inside.max() / len(run)) if places.size == len(run) else math.nan


@dataclass(frozen=True, kw_only=True)
class ScreeningPair:
    """What a worker does with a pair: all its positions, as rows of a table.

    Attributes
    ----------
    case
        Everything but profiles, shift and load.
    positions
        By shift, then load.
    """

    wheel: Kept
    rail: Kept
    case: Case
    positions: tuple[Position, ...]
    theory: Screen

    def __call__(self, folder: Path, finished: Path | None) -> Made:
        """Write the part of the table."""
        write_rows(self.rows(), folder / PART)
        return Made()

    def rows(self) -> list[Row]:
        """A row a position."""
        filters = sorted({*self.wheel.filters_mm, *self.rail.filters_mm}) or [0.0]
        lines = [{"rail": self.rail.line(one), "wheel": self.wheel.line(one)} for one in filters]
        conicity, concentration = conicity_and_concentration(wheelset_of_case(self.case, **lines[0]))
        pair = {"conicity": conicity, "contact_concentration": concentration}
        loads: dict[float, list[float]] = {}
        for shift, load in self.positions:
            loads.setdefault(shift, []).append(load)
        placed = [place_at_shifts(self.case, tuple(loads), **line) for line in lines]
        return [
            row | pair for shift, own in loads.items() for row in self._at(shift, own, [one[shift] for one in placed])
        ]

    def _at(self, shift: float, loads_kN: Sequence[float], placed: Sequence[Placement | str]) -> list[Row]:
        keys = [{"shift_mm": shift, "load_kN": load} for load in loads_kN]
        placements = [one for one in placed if not isinstance(one, str)]
        if reasons := [one for one in placed if isinstance(one, str)]:
            return [key | refused(reasons[0]) for key in keys]
        first = placements[0].first
        place = {"place_y_mm": float(first.rail_y_mm), "touch_angle_mrad": 1e3 * float(first.contact_angle_rad)}
        return [key | place | self._under(shift, key["load_kN"], placements) for key in keys]

    def _under(self, shift: float, load_kN: float, placed: Sequence[Placement]) -> Row:
        case = replace(self.case, lateral_shift_mm=shift, load_N=1e3 * load_kN)
        try:
            return _row([_on_line(case, placement, self.theory) for placement in placed])
        except (InputError, ConvergenceError) as error:
            return refused(str(error))


def refused(reason: str) -> Row:
    """What is said of a position that has no answer."""
    return {"verdict": "REFUSED", "reason": reason}


# --- Rows as a table of Parquet.


def schema(*more: tuple[str, str]) -> Any:
    """Columns of the screen's table, after others by name and kind (string, double)."""
    arrow = of_arrow("lib")
    kinds = {"string": arrow.string(), "double": arrow.float64()}
    columns = [*more, *((name, "double") for name in NUMBERS), *((name, "string") for name in TEXTS)]
    return arrow.schema([(name, kinds[kind]) for name, kind in columns])


def write_rows(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write rows of the screen."""
    table = of_arrow("lib").Table.from_pylist([dict(row) for row in rows], schema=schema())
    of_arrow("parquet").write_table(table, path)
