"""Where a position's meshes are fine: around the expected patch, and where the contact turns out to reach further."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fecontact.contact.grid import Rung
from fecontact.fe.meshing import FineZone
from fecontact.fe.section import Stretch
from fecontact.solving.element_sizes import element_width_mm
from fecontact.solving.expected_patch import ExpectedPatch

MARGIN_ELEMENTS = 4
"""Elements of free room around the expected patch."""


# A patch within so many elements of the edge enlarges the zone.
EDGE_ELEMENTS = 2
# A patch that is a whole number of elements long but for rounding gets no element more.
_ROUNDING = 1e-6


@dataclass(frozen=True, kw_only=True)
class Room:
    """Free room around the expected patch (mm), where the contact may turn out larger than expected.

    `joined` where it goes on between patches that were expected far apart.
    """

    x: float = 0.0
    s_low: float = 0.0
    s_high: float = 0.0
    joined: bool = False


def fine_zone(expected: ExpectedPatch, element_size_mm: tuple[float, float], room: Room | None = None) -> FineZone:
    """The zone of these elements: the expected patch and a margin, in bands where patches are far apart."""
    room = room or Room()
    step_x, step_s = element_size_mm
    bands = () if room.joined else _bands(expected, element_size_mm, room)
    length = max(expected.x_high_mm, -expected.x_low_mm) + MARGIN_ELEMENTS * step_x + room.x
    low = expected.s_low_mm - MARGIN_ELEMENTS * step_s - room.s_low
    high = expected.s_high_mm + MARGIN_ELEMENTS * step_s + room.s_high
    whole = _even_stretch(low, high, step_s)
    return FineZone(
        half_length_mm=step_x * math.ceil(length / step_x - _ROUNDING),
        s_low_mm=bands[0].low_mm if bands else whole.low_mm,
        s_high_mm=bands[-1].high_mm if bands else whole.high_mm,
        step_x_mm=step_x,
        step_s_mm=step_s,
        semi_axis_mm=expected.semi_axis_s_mm,
        bands=bands,
    )


def _even_stretch(low: float, high: float, step: float) -> Stretch:
    steps = 2 * math.ceil(0.5 * (high - low) / step - _ROUNDING)
    middle = 0.5 * (low + high)
    return Stretch(low_mm=middle - 0.5 * steps * step, high_mm=middle + 0.5 * steps * step, intervals=steps)


def _bands(expected: ExpectedPatch, element_size_mm: tuple[float, float], room: Room) -> tuple[Stretch, ...]:
    """A band for each of several patches far apart; none where margins leave too little between them."""
    found = []
    for part in expected.parts:
        step = element_width_mm(element_size_mm, part)
        low = part.s_low_mm - MARGIN_ELEMENTS * step - (room.s_low if part is expected.parts[0] else 0.0)
        high = part.s_high_mm + MARGIN_ELEMENTS * step + (room.s_high if part is expected.parts[-1] else 0.0)
        found.append(_even_stretch(low, high, step))
    short = (after.low_mm - before.high_mm < before.step_mm + after.step_mm for before, after in pairwise(found))
    return () if len(found) == 1 or any(short) else tuple(found)


def more_room(room: Room, nodal: Rung, expected: ExpectedPatch, bands: Sequence[slice]) -> Room:
    """More room where the contact comes within EDGE_ELEMENTS of the edge; the same room if it nowhere does."""
    contact = nodal.pressure_MPa > 0.0
    rows, columns = np.asarray(contact.any(axis=1)), np.asarray(contact.any(axis=0))
    between = np.ones(columns.size, dtype=bool)
    for band in bands:
        start, stop, _ = band.indices(columns.size)
        between[start + (EDGE_ELEMENTS if start else 0) : stop - (EDGE_ELEMENTS if stop < columns.size else 0)] = False
    at_end = bool(rows[-EDGE_ELEMENTS:].any() or (not nodal.grid.half and rows[:EDGE_ELEMENTS].any()))
    quarter = 0.25 * (expected.s_high_mm - expected.s_low_mm)
    return Room(
        x=room.x + (0.25 * expected.x_high_mm if at_end else 0.0),
        s_low=room.s_low + (quarter if columns[:EDGE_ELEMENTS].any() else 0.0),
        s_high=room.s_high + (quarter if columns[-EDGE_ELEMENTS:].any() else 0.0),
        joined=room.joined or bool(columns[between].any()),
    )
