"""Sizes of the lobes of a contact, for the sizes of elements and pressure nodes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import Rung
from fecontact.contact.patch import find_ridge_peaks

# Elements have the size for the lobe with the largest load, but at most this factor larger than for the narrowest lobe.
# The difference between the bodies and a half-space is smooth below the narrowest lobe, and the nodes resolve its
# pressure. Measured at -0.5 mm and 5 mm of S1002 on 60E1 1:40, 100 kN: all measures with 1.5 to 2.5 elements per
# semi-axis of the narrow lobe are within 0.1 % of the measures with 6, for a tenth of the time. With fewer elements the
# load of the lobe changes.
_SIZE_RATIO_LIMIT = 2.5
# A lobe does not affect the size of the elements if its peak is below this fraction of the highest peak, or if its load
# is below that fraction of the whole load.
_SMALL_PEAK = 0.5
SMALL_LOAD_FRACTION = 0.1
# Least load fraction of a lobe that affects the spacing of the nodes.
_NODE_LEAST_LOAD = 0.002
# A peak is a separate lobe if the pressure falls by this fraction of the highest peak on both of its sides.
_VALLEY_DEPTH = 0.05
# On nodes that resolve the lobes, a peak with fewer nodes between peak and valley is a step or a corner of a surface.
# Its width in nodes stays that small on any grid: S1002 on 54E1 has such a peak with half the height of the highest
# peak, 0.9 mm beside it, at 4.07 mm, 50 kN.
_LEAST_NODES = 4
# The nodes also resolve shallower lobes: 16 nodes on the semi-axis of the main lobe give a valley of 0.015 instead of
# 0.047 beside a thin lobe.
_NODE_VALLEY_DEPTH = 0.01


def measure_element_semi_axes_mm(rung: Rung) -> tuple[float, float]:
    """Semi-axes for the size of the elements below a contact.

    The contact must be on nodes that resolve its lobes.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    tuple of float
        Half length along x and smaller half width across in mm.
    """
    sizes = measure_lobe_sizes(rung, least_nodes=_LEAST_NODES)
    semi_axis_x_mm, semi_axis_s_mm = (
        min(main_mm, _SIZE_RATIO_LIMIT * narrowest_mm)
        for main_mm, narrowest_mm in zip(sizes.main, sizes.narrowest, strict=True)
    )
    return semi_axis_x_mm, semi_axis_s_mm


def measure_narrowest_semi_axes_mm(rung: Rung) -> tuple[float, float]:
    """Semi-axes of the narrowest lobe of a contact, without small lobes.

    Half length along x and smaller half width across in mm. The contact must be on nodes that resolve its lobes.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    length, width
        Half length along x, and half width across, in mm.
    """
    return measure_lobe_sizes(rung, least_nodes=_LEAST_NODES).narrowest


@dataclass(frozen=True, kw_only=True)
class LobeSizes:
    """Half lengths along x and smaller half widths of lobes, in mm.

    Attributes
    ----------
    every
        Lobes that the nodes resolve.
    large
        Lobes that affect the size of the elements.
    main
        Lobe with the largest load.
    """

    every: list[tuple[float, float]]
    large: list[tuple[float, float]]
    main: tuple[float, float]

    @property
    def narrowest(self) -> tuple[float, float]:
        """Smallest half length and smallest half width of the large lobes."""
        return min(size[0] for size in self.large), min(size[1] for size in self.large)


@dataclass(frozen=True, kw_only=True)
class _Lobe:
    """Lobe of a contact.

    Half length along x and smaller half width across (mm), height as a fraction of the highest lobe, and load fraction
    (-).
    """

    size_mm: tuple[float, float]
    height: float
    part: float


def measure_lobe_sizes(rung: Rung, *, least_nodes: int = 1) -> LobeSizes:
    """Sizes of the lobes of a contact.

    Parameters
    ----------
    rung
        Solved contact.
    least_nodes
        Smallest number of nodes from peak to valley; a narrower lobe is added to its neighbour.

    Returns
    -------
    LobeSizes
        Half lengths and half widths in mm.
    """
    lobes = _find_lobes(rung, _VALLEY_DEPTH, least_nodes)
    shallow_lobes = _find_lobes(rung, _NODE_VALLEY_DEPTH, least_nodes)
    return LobeSizes(
        every=[lobe.size_mm for lobe in shallow_lobes if lobe.height == 1.0 or lobe.part >= _NODE_LEAST_LOAD],
        large=[
            lobe.size_mm
            for lobe in lobes
            if lobe.height == 1.0 or (lobe.height >= _SMALL_PEAK and lobe.part >= SMALL_LOAD_FRACTION)
        ],
        main=max(lobes, key=lambda lobe: lobe.part).size_mm,
    )


def _find_lobes(rung: Rung, valley_depth: float, least_nodes: int) -> list[_Lobe]:
    """Find the lateral peaks that stand out by a fraction of the highest peak.

    Each lobe extends from valley to valley. `valley_depth` is the fraction (-). Peaks with fewer than `least_nodes`
    nodes to a valley are left out, and their columns belong to their neighbours.
    """
    pressure, spacing_x_mm, cells_mm = rung.pressure_MPa, rung.grid.steps_mm[0], rung.grid.cells_mm
    ridge = np.concatenate(([0.0], pressure.max(axis=0), [0.0]))
    line_load = np.concatenate(([0.0], pressure.sum(axis=0) * rung.grid.weights, [0.0]))
    load = float(line_load.sum())
    peaks, _ = find_ridge_peaks(ridge, valley_depth)
    ends = _find_ends(ridge, peaks)
    wide = [
        number
        for number, (left, right) in enumerate(ends)
        if min(peaks[number] - left, right - peaks[number]) >= least_nodes
    ]
    if 0 < len(wide) < len(peaks):
        peaks = peaks[wide]
        ends = _find_ends(ridge, peaks)
    # A peak that was left out may be the highest: heights are relative to the lobes that remain.
    highest = float(ridge[peaks].max())
    lobes = []
    for peak, (left, right) in zip(peaks, ends, strict=True):
        rows = np.flatnonzero(pressure[:, peak - 1])
        length = (rows[-1] + 0.5) * spacing_x_mm if rung.grid.half else 0.5 * (rows[-1] - rows[0] + 1) * spacing_x_mm
        lobes.append(
            _Lobe(
                size_mm=(length, min(peak - left, right - peak) * float(cells_mm[peak - 1])),
                height=float(ridge[peak]) / highest,
                part=float(line_load[left:right].sum()) / load,
            )
        )
    return lobes


def _find_ends(ridge: NDArray[np.float64], peaks: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Find both ends of every peak: valleys, or the ends of the contact."""
    zeros = np.flatnonzero(ridge == 0.0)
    valleys = [int(left_peak + np.argmin(ridge[left_peak:right_peak])) for left_peak, right_peak in pairwise(peaks)]
    return [
        (max(int(zeros[zeros < peak][-1]), left_valley), min(int(zeros[zeros > peak][0]), right_valley))
        for peak, left_valley, right_valley in zip(peaks, [0, *valleys], [*valleys, ridge.size], strict=True)
    ]
