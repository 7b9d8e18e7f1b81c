"""Fine zone of a position's meshes, around the expected patch.

The zone grows where the contact reaches further than expected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.fe.meshing import FineZone
from fecontact.fe.section import Stretch
from fecontact.solving.element_sizes import choose_element_width_mm
from fecontact.solving.expected_patch import ExpectedPatch

MARGIN_ELEMENTS = 4
"""Number of free elements around the expected patch."""


# A patch within this number of elements from the edge enlarges the zone.
EDGE_ELEMENTS = 2
# Allowance for rounding, so that a patch with a whole number of elements does not receive an additional element.
_ROUNDING = 1e-6


@dataclass(frozen=True, kw_only=True)
class ZoneMargin:
    """Free room around the expected patch (mm), for a contact that is larger than expected.

    Attributes
    ----------
    x
        Additional half length along x.
    s_low, s_high
        Additional width on the gauge side and on the field side.
    joined
        Whether the contact continues between patches that were expected at a large distance.
    """

    x: float = 0.0
    s_low: float = 0.0
    s_high: float = 0.0
    joined: bool = False


def make_fine_zone(
    expected: ExpectedPatch, element_size_mm: tuple[float, float], room: ZoneMargin | None = None
) -> FineZone:
    """Fine zone over the expected patch and a margin.

    Patches at a large distance have a band each.

    Parameters
    ----------
    expected
        Expected patch.
    element_size_mm
        Length and width of the elements in mm.
    room
        Additional room; None for none.

    Returns
    -------
    FineZone
        Zone with an even number of elements across.
    """
    room = room or ZoneMargin()
    step_x_mm, step_s_mm = element_size_mm
    bands = () if room.joined else _make_bands(expected, element_size_mm, room)
    half_length_mm = max(expected.x_high_mm, -expected.x_low_mm) + MARGIN_ELEMENTS * step_x_mm + room.x
    low_mm = expected.s_low_mm - MARGIN_ELEMENTS * step_s_mm - room.s_low
    high_mm = expected.s_high_mm + MARGIN_ELEMENTS * step_s_mm + room.s_high
    stretch = _make_even_stretch(low_mm, high_mm, step_s_mm)
    return FineZone(
        half_length_mm=step_x_mm * math.ceil(half_length_mm / step_x_mm - _ROUNDING),
        s_low_mm=bands[0].low_mm if bands else stretch.low_mm,
        s_high_mm=bands[-1].high_mm if bands else stretch.high_mm,
        step_x_mm=step_x_mm,
        step_s_mm=step_s_mm,
        semi_axis_mm=expected.semi_axis_s_mm,
        bands=bands,
    )


def _make_even_stretch(low_mm: float, high_mm: float, step_mm: float) -> Stretch:
    """Lateral stretch with an even number of elements that covers both limits."""
    intervals = 2 * math.ceil(0.5 * (high_mm - low_mm) / step_mm - _ROUNDING)
    middle_mm = 0.5 * (low_mm + high_mm)
    return Stretch(
        low_mm=middle_mm - 0.5 * intervals * step_mm, high_mm=middle_mm + 0.5 * intervals * step_mm, intervals=intervals
    )


def _make_bands(expected: ExpectedPatch, element_size_mm: tuple[float, float], room: ZoneMargin) -> tuple[Stretch, ...]:
    """Band for each of several patches at a large distance.

    Empty if the margins leave too little between the patches.
    """
    bands = []
    for patch in expected.parts:
        step_mm = choose_element_width_mm(element_size_mm, patch)
        low_mm = patch.s_low_mm - MARGIN_ELEMENTS * step_mm - (room.s_low if patch is expected.parts[0] else 0.0)
        high_mm = patch.s_high_mm + MARGIN_ELEMENTS * step_mm + (room.s_high if patch is expected.parts[-1] else 0.0)
        bands.append(_make_even_stretch(low_mm, high_mm, step_mm))
    is_too_short = (
        right_band.low_mm - left_band.high_mm < left_band.step_mm + right_band.step_mm
        for left_band, right_band in pairwise(bands)
    )
    return () if len(bands) == 1 or any(is_too_short) else tuple(bands)


def enlarge_room(room: ZoneMargin, nodal: Rung, expected: ExpectedPatch, bands: Sequence[slice]) -> ZoneMargin:
    """Enlarge the room where the contact is within EDGE_ELEMENTS of the edge.

    Parameters
    ----------
    room
        Present room.
    nodal
        Contact on the elements' nodes.
    expected
        Expected patch; the room grows by a quarter of its size.
    bands
        Columns of each band of the zone.

    Returns
    -------
    ZoneMargin
        Equal to `room` if the contact is not near an edge.
    """
    is_in_contact = nodal.pressure_MPa > 0.0
    rows, columns = np.asarray(is_in_contact.any(axis=1)), np.asarray(is_in_contact.any(axis=0))
    is_near_edge = np.ones(columns.size, dtype=bool)
    for band in bands:
        start, stop, _ = band.indices(columns.size)
        is_near_edge[start + (EDGE_ELEMENTS if start else 0) : stop - (EDGE_ELEMENTS if stop < columns.size else 0)] = (
            False
        )
    is_at_end = bool(rows[-EDGE_ELEMENTS:].any() or (not nodal.grid.half and rows[:EDGE_ELEMENTS].any()))
    quarter_mm = 0.25 * (expected.s_high_mm - expected.s_low_mm)
    return ZoneMargin(
        x=room.x + (0.25 * expected.x_high_mm if is_at_end else 0.0),
        s_low=room.s_low + (quarter_mm if columns[:EDGE_ELEMENTS].any() else 0.0),
        s_high=room.s_high + (quarter_mm if columns[-EDGE_ELEMENTS:].any() else 0.0),
        joined=room.joined or bool(columns[is_near_edge].any()),
    )
