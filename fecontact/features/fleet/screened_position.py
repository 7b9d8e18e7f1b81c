"""Screened position of a pair on all profile variants, and its row."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fecontact.case import Case
from fecontact.contact.patch import standing_peaks
from fecontact.contact_theories.approximation import Approximation, of_rung
from fecontact.contact_theories.registry import EITHER_SIDE, HERTZ, THEORIES, Loaded, of_many
from fecontact.errors import InputError
from fecontact.features.fleet.model import Screen
from fecontact.features.fleet.screening_rows import COLUMN, Row
from fecontact.features.fleet.strip_deviations import ACROSS, COARSER, NODES, OF_STRIPS, off_strips, pressure_on_grid
from fecontact.judging.causes import PatchGeometry, cause_in_gap
from fecontact.judging.measures import FLOORS, deviations_of
from fecontact.judging.verdict import AT_JUNCTION, FROM_BEST, PROFILE, Answer, judge
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.alone import HALF_SPACE, STRIPS, normal_force_of
from fecontact.solving.position import expect_on_half_space


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


def position_on_line(case: Case, placement: Placement, theory: Screen) -> _OnLine:
    """Contact at a position on one profile variant, by the screen's theory."""
    loaded = Loaded(placement=placement, case=case, normal_force_N=normal_force_of(case, placement))
    if theory == STRIPS:
        contact = THEORIES[STRIPS].approximate(loaded)
        if not isinstance(contact, Approximation):
            raise InputError(f"{THEORIES[STRIPS].words}: {contact}")
        return _OnLine(loaded=loaded, contact=contact, off=partial(off_strips, contact), open=OF_STRIPS)
    half_space = expect_on_half_space(case, placement, nodes=NODES)[1].half_space
    loaded = replace(loaded, normal_force_N=half_space.normal_force_N, half_space=half_space)
    unsure = {name: COARSER * floor for name, floor in FLOORS.items() if floor is not None}
    return _OnLine(loaded=loaded, contact=of_rung(half_space), off=partial(deviations_of, half_space), open=unsure)


def position_row(lines: Sequence[_OnLine]) -> Row:
    """Row of a position from its contacts on all profile variants."""
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
    s = np.linspace(low, high, ACROSS)
    ridge = pressure_on_grid(contact, np.zeros(1), s)[0]
    peaks, _ = standing_peaks(np.concatenate(([0.0], ridge, [0.0])), OF_STRIPS["valley"])
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
    own = STRIPS if lines[0].open is OF_STRIPS else HALF_SPACE
    others = (name for name in THEORIES if name not in (*EITHER_SIDE, STRIPS, HALF_SPACE))
    return next((name for name in others if all(_holds(line, name) for line in lines)), own)


def _holds(line: _OnLine, name: str) -> bool:
    judged = line.judged(name)
    return judged is not None and judged[0] == "HOLDS"
