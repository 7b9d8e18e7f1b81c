"""The zone of equal elements around the expected patch, on which both meshes meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.fe.section import Grading, Stretch, lines_of

Floats = NDArray[np.float64]

# A block that is wider than a single patch holds several: it need be as deep as for one. That takes a quarter to two
# fifths off the cost of a two-lobed contact, and moves its peak pressure by 2e-4 to 5e-4 at `quick`. Depths follow the
# patch and not the element size alone, or finer meshes would not converge to the same bodies. With 20 steps two lobes
# take a tenth less time, but healthy elements of a gauge corner read -2.3 % too soft, beyond their limit, for -1.3 %.
_PART_STEPS = 25
_PART_SEMI_AXES = 3.0


@dataclass(frozen=True, kw_only=True)
class FineZone:
    """Uniform zone around the expected patch on the rail's surface, about the first touch point (mm).

    The nodes lie at x = -half_length..half_length in steps of `step_x_mm` and at the arc lengths s from `s_low_mm` to
    `s_high_mm` in steps of `step_s_mm`, both in an even number of steps. `semi_axis_mm` is that of the narrowest part
    of the patch, across.

    Patches far apart have `bands` of their own, the first one from `s_low_mm` and the last one to `s_high_mm`; then
    `step_s_mm` is the finest step, and on the strips between them steps grow as they do around the zone.
    """

    half_length_mm: float
    s_low_mm: float
    s_high_mm: float
    step_x_mm: float
    step_s_mm: float
    semi_axis_mm: float
    bands: tuple[Stretch, ...] = ()

    @property
    def block_width_mm(self) -> float:
        """Width of the patch, or part of it, for which the uniform block below the zone is deep enough."""
        part = max(_PART_STEPS * self.step_s_mm, _PART_SEMI_AXES * self.semi_axis_mm)
        return min(self.s_high_mm - self.s_low_mm, 2.0 * self.half_length_mm, part)

    @property
    def intervals_x(self) -> int:
        """Steps from the middle to one end."""
        return max(2, round(self.half_length_mm / self.step_x_mm))

    @property
    def intervals_s(self) -> int:
        """Steps across, always even."""
        return self.s_mm.size - 1

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """Its bands; all of it where there are none."""
        intervals = max(4, 2 * round(0.5 * (self.s_high_mm - self.s_low_mm) / self.step_s_mm))
        return self.bands or (Stretch(low_mm=self.s_low_mm, high_mm=self.s_high_mm, intervals=intervals),)

    @property
    def s_mm(self) -> Floats:
        """Nodes across, those on the strips between bands included."""
        return lines_of(self.stretches, Grading())

    @property
    def columns(self) -> tuple[slice, ...]:
        """Which of the nodes across belong to each of its stretches."""
        s = self.s_mm
        starts = [int(np.argmin(np.abs(s - stretch.low_mm))) for stretch in self.stretches]
        return tuple(
            slice(start, start + stretch.intervals + 1) for start, stretch in zip(starts, self.stretches, strict=True)
        )


# Bytes a node while the mesh is made and the stiffness assembled (8 to 12 kB measured, with small factors).
_BYTES_A_NODE = 8e3


def least_memory_bytes(zone: FineZone) -> float:
    """A lower bound of the memory that both bodies need, from the nodes of the uniform blocks under the zone."""
    ratio = Grading().layer_ratio
    layers = 0.45 * zone.block_width_mm / min(zone.step_x_mm, zone.step_s_mm)
    nodes = zone.intervals_x * zone.intervals_s * max(2.0, np.log1p((ratio - 1.0) * layers) / np.log(ratio))
    return float(2.0 * nodes * _BYTES_A_NODE)
