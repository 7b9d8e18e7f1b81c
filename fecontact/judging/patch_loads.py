"""Load of each of several separate patches, in two contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from fecontact.arrays import find_runs
from fecontact.contact.grid import Rung

PATCH_LOADS_LIMIT = 1.5
"""Largest `PatchLoads.difference` of two contacts between equal bodies.

102 random contacts of two or three patches were measured at `quick` (eight rails with S1002 and wheels of EN 15302, 4.5
to 6.5 mm, 6 to 130 kN, and measured pairs). Healthy elements have at most 1.19, where a patch has 4 % of the load
(UIC60 with S1002, 1:40, 4.73 mm, 14.6 kN). The second largest difference is 0.79, 95 % have at most 0.73, and half of
them at most 0.27. In 25 other contacts the contribution of the finite bodies was falsified. With the wrong sign, the
difference is 1.1 to 6.9 wherever a measure on the finer nodes changes by more than its stated uncertainty. Without the
contribution it is 0.5 to 4.1 there, and with a doubled contribution 0.3 to 3.1. Where patches nearly join, their loads
depend on the element size, and the check is less sensitive. A contribution that is changed between the elements and the
finer nodes also changes the gap (`solution_faults.GAP_DISTANCE_LIMIT_MM`).
"""
ELEMENT_LOAD_ERROR = 0.002
"""Error of the load fraction of a patch on the elements' nodes that the change between meshes does not show.

In 31 other contacts (4 to 19 elements per semi-axis, 23 to 159 kN) the load fraction of healthy elements differs by up
to 0.0026 from the load fraction of the finer nodes. The last change between their meshes is 0.0 to 0.002. In half of
the 102 contacts above the difference is at most 0.0014.
"""


@dataclass(frozen=True, kw_only=True)
class PatchLoads:
    """Load fraction on the gauge side of a free strip between two patches, in two contacts.

    Attributes
    ----------
    on_elements, on_finer_nodes
        Fraction of the whole load (-), on the nodes of the elements and on the finer nodes.
    uncertainty
        Sum of both uncertainties (-), without the contribution of the cut planes: both contacts have equal bodies.
    """

    on_elements: float
    on_finer_nodes: float
    uncertainty: float

    @property
    def difference(self) -> float:
        """Difference of the two load fractions divided by their uncertainty (-)."""
        return abs(self.on_elements - self.on_finer_nodes) / self.uncertainty


def find_free_strips_mm(rung: Rung) -> list[float]:
    """Lateral centres of the free strips between separate patches.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    list of float
        Positions s in mm from the first contact point, from the gauge side on; empty for a single patch.
    """
    s_mm, runs = rung.grid.s_mm, find_runs(rung.pressure_MPa.sum(axis=0) > 0.0)
    return [float(0.5 * (s_mm[last] + s_mm[first])) for (_, last), (first, _) in pairwise(runs)]


def compute_load_fractions(rung: Rung, positions_mm: Sequence[float]) -> list[float]:
    """Load fraction on the gauge side of each lateral position.

    Parameters
    ----------
    rung
        Solved contact.
    positions_mm
        Lateral positions s in mm from the first contact point.

    Returns
    -------
    list of float
        Fraction of the whole load (-) for each position.
    """
    force = (rung.pressure_MPa * rung.grid.whole_area_mm2().reshape(rung.grid.shape)).sum(axis=0)
    return [float(force[rung.grid.s_mm < position_mm].sum() / force.sum()) for position_mm in positions_mm]
