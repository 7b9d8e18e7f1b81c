"""Measured profiles: how far each theory is off the half-space on every line that the points allow.

Noise and filters move a line, and with it the theory and the contact together. So what points leave open of a theory is
how its deviation changes from line to line, and not how the contact does.

A change from line to line is known only between contacts of the same patches. A second patch that one line has and
another one has not is no change: there the line is judged by its own contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fecontact.arrays import Floats
from fecontact.judging.measures import MEASURES

Deviations = Mapping[str, float]
_UNKNOWN: Deviations = {}
_SEPARATE = "separate_load"
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
    patches
        Number of separate patches of the half-space.
    lobes
        From the gauge side on.
    """

    label: str
    p_max_MPa: float = math.nan
    deviations: Mapping[str, Deviations] = field(default_factory=dict)
    patches: int = 1
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
    half_space
        Deviations from the half-space on each line, by the label of the line.
    own
        Deviations from the half-space on the own line.
    other_patches
        Labels of the lines whose half-space has other patches than the half-space on the own line.
    """

    by_line: Mapping[str, Deviations] = field(default_factory=dict)
    peaks: Mapping[str, float] = field(default_factory=dict)
    half_space: Mapping[str, Deviations] = field(default_factory=dict)
    own: Deviations = field(default_factory=dict)
    other_patches: frozenset[str] = frozenset()

    def deviations(self, deviation: Deviations) -> dict[str, dict[str, float]]:
        """Deviations from the finite elements on each line, from those on the own line.

        On a line with other patches they are the deviations from the half-space on that line.
        """
        return {
            label: {name: self.half_space[label].get(name, math.nan) for name in deviation}
            if self._is_judged_alone(label, deviation)
            else self._moved(label, deviation)
            for label in self.by_line
        }

    def step_uncertainty(self, label: str, deviation: Deviations) -> dict[str, float]:
        """Uncertainty of the deviations on a line from the step between half-space and finite elements.

        The step is known on the own line alone. It is the uncertainty on a line with other patches, and zero on lines
        with the same patches, whose deviations have the step already.
        """
        if not self._is_judged_alone(label, deviation):
            return dict.fromkeys(deviation, 0.0)
        alone = self.half_space[label]
        return {name: self._step(name, value, alone.get(name, math.nan)) for name, value in deviation.items()}

    def _moved(self, label: str, deviation: Deviations) -> dict[str, float]:
        move = self.by_line[label]
        return {
            name: (1.0 + value) * move.get(name, math.nan) - 1.0
            if name in MEASURES
            else value + move.get(name, math.nan)
            for name, value in deviation.items()
        }

    def _step(self, name: str, value: float, alone: float) -> float:
        """Step of a deviation on the own line; of `MEASURES` relative to 1 + the deviation on another line."""
        own = self.own.get(name, math.nan)
        return abs((1.0 + alone) * ((1.0 + value) / (1.0 + own) - 1.0)) if name in MEASURES else abs(value - own)

    def _is_judged_alone(self, label: str, deviation: Deviations) -> bool:
        """Whether a line is judged by its own half-space: moves do not lead to its patches, or to a negative load."""
        moved = deviation.get(_SEPARATE, math.nan) + self.by_line[label].get(_SEPARATE, math.nan)
        return label in self.other_patches or (label in self.half_space and moved < 0.0)

    def farthest(self, name: str, value: float) -> float:
        """By how much a deviation differs at most on any line from its value on the own line.

        Lines with other patches count singly, with their step to finite elements.
        """
        moves = {
            label: move.get(name, math.nan) for label, move in self.by_line.items() if label not in self.other_patches
        }
        by = (1.0 + value) * (_together(moves, np.multiply) - 1.0) if name in MEASURES else _together(moves, np.add)
        alone = [self.half_space[label].get(name, math.nan) for label in self.other_patches]
        apart = [abs(one - value) + self._step(name, value, one) for one in alone]
        found = np.array([*np.abs(by), *apart])
        found = found[np.isfinite(found)]
        return float(found.max()) if found.size else math.nan

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
        moves = _moves({line.label: (line.deviations.get(theory, _UNKNOWN), line.p_max_MPa) for line in self.all})
        return replace(moves, other_patches=frozenset(self._with_other_patches(theory)))

    def _with_other_patches(self, theory: str) -> Iterator[str]:
        """Labels of lines with another number of patches, or where load on patches beside the theory's comes or goes.

        Lines without a contact are not among them.
        """
        own = self.own.deviations.get(theory, _UNKNOWN)
        for line in self.others:
            deviation = line.deviations.get(theory, _UNKNOWN)
            if own and deviation:
                beside = (one.get(_SEPARATE, 0.0) > 0.0 for one in (own, deviation))
                if line.patches != self.own.patches or len({*beside}) > 1:
                    yield line.label

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
    return Moves(
        by_line=by_line,
        peaks={label: peak / first_peak for label, (_, peak) in read.items()},
        half_space={label: deviation for label, (deviation, _) in read.items()},
        own=first,
    )
