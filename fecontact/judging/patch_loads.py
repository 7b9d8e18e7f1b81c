"""Load on each of several separate patches, on the elements' own nodes and on the finer nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.contact.grid import Rung

PATCH_LOADS_LIMIT = 1.0
"""Largest `PatchLoads.difference` of two contacts between the same bodies.

Of 31 contacts of two or three patches (library pairs at `quick`, 4 to 19 elements per semi-axis, 23 to 159 kN) healthy
elements have at most 0.52, and half of them at most 0.22. Of 25 of them a bodies' part of the wrong sign has 1.1 to 6.9
wherever it moves a measure of the finer nodes by more than its stated uncertainty; left out it has 0.5 to 4.1 there,
doubled 0.3 to 3.1. Where patches nearly join their load depends on the elements' size, and less is seen.
"""
ELEMENT_LOAD_PART = 0.002
"""Error of the part of the load on a patch on the elements' own nodes, which the change between meshes does not show.

Of those contacts the part of healthy elements differs by up to 0.0026 from that of the finer nodes, where their last
change is 0.0 to 0.002.
"""


@dataclass(frozen=True, kw_only=True)
class PatchLoads:
    """Part of the load on all patches that lie on the gauge side of a free strip between two patches.

    Attributes
    ----------
    on_elements, on_finer_nodes
        Part of the whole load, on the nodes of the elements and on the finer nodes.
    uncertainty
        Sum of both uncertainties, without the contribution of the cut planes: both contacts have the same bodies.
    """

    on_elements: float
    on_finer_nodes: float
    uncertainty: float

    @property
    def difference(self) -> float:
        """Difference of both parts over their uncertainty."""
        return abs(self.on_elements - self.on_finer_nodes) / self.uncertainty


def free_strips_mm(rung: Rung) -> list[float]:
    """Middles across (mm from first touch) of the free strips between separate patches, from the gauge side on."""
    s, pressed = rung.grid.s_mm, np.flatnonzero(rung.pressure_MPa.any(axis=0))
    before, after = pressed[:-1], pressed[1:]
    apart = after - before > 1
    return [float(middle) for middle in 0.5 * (s[before] + s[after])[apart]]


def load_parts(rung: Rung, places_mm: Sequence[float]) -> list[float]:
    """Parts of the load on the gauge side of each place across (mm from first touch)."""
    force = (rung.pressure_MPa * rung.grid.whole_area_mm2().reshape(rung.grid.shape)).sum(axis=0)
    return [float(force[rung.grid.s_mm < place].sum() / force.sum()) for place in places_mm]
