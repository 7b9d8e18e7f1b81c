"""Measured profiles: how far each theory is off the half-space on every line that the points allow.

Noise and filters move a line, and with it the theory and the contact together. So what points leave open of a theory is
how its deviation changes from line to line, and not how the contact does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.measures import MEASURES

Deviations = Mapping[str, float]
_UNKNOWN: Deviations = {}
FILTER = "filter"
"""With what the label of a line begins that was smoothed over another length; that length in mm comes next."""
NOISE = "noise"
"""With what the label of a line begins that has another draw of noise."""


def is_drawn(label: str) -> bool:
    """Whether a line is a draw of other noise, by its label."""
    return label.startswith(NOISE)


@dataclass(frozen=True, kw_only=True)
class LobeOnLine:
    """A lobe of a half-space on a line: where it lies across on the rail, its force, and what Hertz is off it.

    `deviation` is the deviation of Hertz's ellipse at the touch point below the lobe; empty without a touch point.
    """

    low_y_mm: float
    high_y_mm: float
    normal_force_N: float
    p_max_MPa: float
    deviation: Deviations = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class OnLine:
    """Theories against the half-space on one line of rail and wheel.

    Attributes
    ----------
    label
        What the line is, such as `filter 4 mm`.
    p_max_MPa
        Peak of the half-space; NaN where the line does not come into contact.
    deviations
        Of each theory by its name, of those that have a contact there.
    lobes
        From the gauge side on.
    """

    label: str
    p_max_MPa: float = math.nan
    deviations: Mapping[str, Deviations] = field(default_factory=dict)
    lobes: tuple[LobeOnLine, ...] = ()

    def lobe_at(self, rail_y_mm: float) -> LobeOnLine | None:
        """The lobe that carries most of those that lie at a place across the rail."""
        there = [lobe for lobe in self.lobes if lobe.low_y_mm <= rail_y_mm <= lobe.high_y_mm]
        return max(there, key=lambda lobe: lobe.normal_force_N, default=None)


@dataclass(frozen=True, kw_only=True)
class Moves:
    """How deviations and a peak move from the own line to each line that points allow, by the label of the line.

    Attributes
    ----------
    by_line
        What 1 + the deviation is multiplied by, for each of `MEASURES`; what is added to the others. Empty where a line
        does not have the contact.
    peaks
        Peak pressures over the peak pressure of the case's line, by the label of the line; NaN without a contact.
    """

    by_line: Mapping[str, Deviations] = field(default_factory=dict)
    peaks: Mapping[str, float] = field(default_factory=dict)

    def deviations(self, deviation: Deviations) -> dict[str, dict[str, float]]:
        """Deviations from the finite elements on each line, from those on the own line."""
        return {
            label: {
                name: (1.0 + value) * move.get(name, math.nan) - 1.0
                if name in MEASURES
                else value + move.get(name, math.nan)
                for name, value in deviation.items()
            }
            for label, move in self.by_line.items()
        }

    def farthest(self, name: str, value: float) -> float:
        """By how much a deviation moves at most from its value on the own line."""
        moves = {label: move.get(name, math.nan) for label, move in self.by_line.items()}
        by = (1.0 + value) * (_together(moves, np.multiply) - 1.0) if name in MEASURES else _together(moves, np.add)
        return float(np.abs(by).max()) if by.size else math.nan

    def band(self, p_max_MPa: float, unsure: float = 0.0) -> tuple[float, float] | None:
        """Least and largest peak over the lines, from that on the own line; None of exact lines.

        `unsure` is what meshes leave open of it (relative).
        """
        moved = p_max_MPa * _together(self.peaks, np.multiply)
        return (float(moved.min()) * (1.0 - unsure), float(moved.max()) * (1.0 + unsure)) if moved.size else None


def _together(moves: Mapping[str, float], both: np.ufunc) -> Floats:
    """Moves to every line, with those by another filter and by other noise taken together: neither knows of the other.

    The filter may lie at an end of what is usual, and the points have their noise there too.
    """
    known = {label: move for label, move in moves.items() if math.isfinite(move)}
    drawn = [move for label, move in known.items() if is_drawn(label)]
    smoothed = [move for label, move in known.items() if not is_drawn(label)]
    return np.asarray(both.outer(smoothed, [both.identity, *drawn])).ravel()


EXACT = Moves()
"""Of lines that are known exactly: there are no others."""


@dataclass(frozen=True, kw_only=True)
class Lines:
    """What is known on the own line, on which finite elements are solved, and on all others that points allow."""

    own: OnLine
    others: tuple[OnLine, ...]

    @property
    def all(self) -> tuple[OnLine, ...]:
        """The own line first."""
        return (self.own, *self.others)

    def moves(self, theory: str) -> Moves:
        """Those of a theory."""
        return _moves({line.label: (line.deviations.get(theory, _UNKNOWN), line.p_max_MPa) for line in self.all})

    def moves_of_lobe(self, rail_y_mm: float) -> Moves:
        """Those of the lobe at a place across the rail."""
        found = {line.label: line.lobe_at(rail_y_mm) for line in self.all}
        return _moves(
            {
                label: (_UNKNOWN, math.nan) if lobe is None else (lobe.deviation, lobe.p_max_MPa)
                for label, lobe in found.items()
            }
        )


def _moves(read: Mapping[str, tuple[Deviations, float]]) -> Moves:
    """Moves from the first line to all, the first one too."""
    (first, first_peak), *_ = read.values()
    by_line = {
        label: {
            name: (1.0 + value) / (1.0 + first[name]) if name in MEASURES else value - first[name]
            for name, value in deviation.items()
            if name in first
        }
        for label, (deviation, _) in read.items()
    }
    return Moves(by_line=by_line, peaks={label: peak / first_peak for label, (_, peak) in read.items()})
