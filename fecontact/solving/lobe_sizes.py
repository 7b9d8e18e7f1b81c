"""Sizes of the lobes of a contact, for which elements and pressure nodes are made."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import Rung
from fecontact.contact.patch import standing_peaks

# Elements are made for the lobe that carries most, and at most so many times too large for the narrowest one: what the
# bodies add to a half-space is smooth below it, and its pressure is the nodes' matter. Measured at -0.5 mm and 5 mm of
# S1002 on 60E1 1:40, 100 kN: all measures with 1.5 to 2.5 elements per semi-axis of the narrow lobe are within 0.1 % of
# those with 6, for a tenth of the time; below that the load of the lobe moves.
_NARROWER = 2.5
# A lobe does not decide about the size of the elements at all if its peak is below this part of the highest one, or its
# load below that part of the whole.
_LESSER_PEAK = 0.5
LESSER_LOAD = 0.1
# The same for the nodes.
_LEAST_LOAD = 0.002
# A peak is a lobe of its own if the pressure falls by this part of the highest peak on both sides of it.
_VALLEY = 0.05
# On nodes that are made for the lobes a peak so few of them from its valley is a step or a corner of a surface, which
# stays that few nodes wide on any: S1002 on 54E1 has one of half the highest peak 0.9 mm beside it at 4.07 mm, 50 kN.
_LEAST_NODES = 4
# Nodes follow a shallower one too: 16 on the semi-axis of the rest read 0.015 of a valley of 0.047 beside a thin lobe.
_LEAST_VALLEY = 0.01


def semi_axes_of_elements_mm(rung: Rung) -> tuple[float, float]:
    """Half length along x and smaller half width across that the elements below a contact are made for.

    The contact is on nodes that follow its lobes.
    """
    sizes = lobe_sizes(rung, least_nodes=_LEAST_NODES)
    along_x, across = (min(main, _NARROWER * least) for main, least in zip(sizes.main, sizes.narrowest, strict=True))
    return along_x, across


def narrowest_semi_axes_mm(rung: Rung) -> tuple[float, float]:
    """Half length along x and smaller half width across of the narrowest lobe of a contact, small ones left out.

    The contact is on nodes that follow its lobes.
    """
    return lobe_sizes(rung, least_nodes=_LEAST_NODES).narrowest


@dataclass(frozen=True, kw_only=True)
class LobeSizes:
    """Half length along x and smaller half width across (mm) of lobes.

    Of all that nodes follow, of large ones, and of the one that carries most.
    """

    every: list[tuple[float, float]]
    large: list[tuple[float, float]]
    main: tuple[float, float]

    @property
    def narrowest(self) -> tuple[float, float]:
        """Least half length and least half width of large ones."""
        return min(size[0] for size in self.large), min(size[1] for size in self.large)


@dataclass(frozen=True, kw_only=True)
class _Lobe:
    """Half length along x and smaller half width across (mm), height over the highest peak and part of the load."""

    size_mm: tuple[float, float]
    height: float
    part: float


def lobe_sizes(rung: Rung, *, least_nodes: int = 1) -> LobeSizes:
    """Sizes of the lobes of a contact; what is narrower than so many nodes from peak to valley is part of another."""
    lobes = _lobes(rung, _VALLEY, least_nodes)
    every = _lobes(rung, _LEAST_VALLEY, least_nodes)
    return LobeSizes(
        every=[lobe.size_mm for lobe in every if lobe.height == 1.0 or lobe.part >= _LEAST_LOAD],
        large=[
            lobe.size_mm
            for lobe in lobes
            if lobe.height == 1.0 or (lobe.height >= _LESSER_PEAK and lobe.part >= LESSER_LOAD)
        ],
        main=max(lobes, key=lambda lobe: lobe.part).size_mm,
    )


def _lobes(rung: Rung, valley: float, least_nodes: int) -> list[_Lobe]:
    """Peaks across that stand out by a part of the highest one, each from valley to valley."""
    p, dx, cells = rung.pressure_MPa, rung.grid.steps_mm[0], rung.grid.cells_mm
    ridge = np.concatenate(([0.0], p.max(axis=0), [0.0]))
    line_load = np.concatenate(([0.0], p.sum(axis=0) * rung.grid.weights, [0.0]))
    top, load = float(ridge.max()), float(line_load.sum())
    peaks, _ = standing_peaks(ridge, valley)
    ends = _ends(ridge, peaks)
    wide = [k for k, (left, right) in enumerate(ends) if min(peaks[k] - left, right - peaks[k]) >= least_nodes]
    if 0 < len(wide) < len(peaks):
        peaks = peaks[wide]
        ends = _ends(ridge, peaks)
    found = []
    for peak, (left, right) in zip(peaks, ends, strict=True):
        rows = np.flatnonzero(p[:, peak - 1])
        length = (rows[-1] + 0.5) * dx if rung.grid.half else 0.5 * (rows[-1] - rows[0] + 1) * dx
        found.append(
            _Lobe(
                size_mm=(length, min(peak - left, right - peak) * float(cells[peak - 1])),
                height=float(ridge[peak]) / top,
                part=float(line_load[left:right].sum()) / load,
            )
        )
    return found


def _ends(ridge: NDArray[np.float64], peaks: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Of every peak the valleys on both sides, or where the contact ends."""
    zeros = np.flatnonzero(ridge == 0.0)
    valleys = [int(low + np.argmin(ridge[low:high])) for low, high in pairwise(peaks)]
    return [
        (max(int(zeros[zeros < peak][-1]), before), min(int(zeros[zeros > peak][0]), after))
        for peak, before, after in zip(peaks, [0, *valleys], [*valleys, ridge.size], strict=True)
    ]
