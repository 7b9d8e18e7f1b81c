"""Contact between bodies that have yielded, as fields and numbers of the solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fecontact.contact.grid import Rung

YIELD_STRESS_SPREAD = 0.15
"""Fraction by which the yield stress is varied downwards and upwards.

Steels of equal designation differ by this fraction, and real steels begin to yield gradually.
"""


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """Load on the path from first yield to the load of the case.

    Attributes
    ----------
    load_N
        Normal force in N.
    steps
        Change of each of `measures.MEASURES` by plasticity alone (-), relative to elastic bodies under an equal load.
    largest_strain
        Largest equivalent plastic strain in either body (-).
    corrections, change
        Number of corrections, and relative change by the last correction (-).
    """

    load_N: float
    steps: Mapping[str, float]
    largest_strain: float
    corrections: int
    change: float


@dataclass(frozen=True, kw_only=True)
class YieldedBody:
    """Plastic zone of a body.

    A depth is measured from the surface of the body, along the normal of the surface.

    Attributes
    ----------
    yield_MPa, tangent_MPa
        Yield stress and tangent modulus in MPa.
    first_yield_N
        Load at which the body yields first in the region where plastic strain is solved. Under a smaller load, the
        stress is scaled with the third root of the load, as below an ellipse.
    largest_strain, x_mm, y_mm, depth_mm
        Largest equivalent plastic strain (-), and its place; 0 for a body that has not yielded.
    top_mm, bottom_mm
        Smallest and largest depth of the plastic zone.
    volume_mm3
        Volume of the plastic zone.
    """

    yield_MPa: float
    tangent_MPa: float
    first_yield_N: float
    largest_strain: float = 0.0
    x_mm: float = 0.0
    y_mm: float = 0.0
    depth_mm: float = 0.0
    top_mm: float = 0.0
    bottom_mm: float = 0.0
    volume_mm3: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PlasticResult:
    """First loading of virgin bodies, on a single mesh level.

    Attributes
    ----------
    fe, nodal
        Contact between the bodies with plastic strain, on the nodes of the elastic rungs of equal name.
    bodies
        Plastic zone of each body, by `rail` and `wheel`; a body without a yield stress has no entry.
    path
        Loads from first yield to the load of the case; empty if no body yields.
    fewer_steps
        `fe` with half as many load steps; None if it was not solved.
    by_band
        Change of each measure by plasticity with a yield stress that is lower and higher by `YIELD_STRESS_SPREAD`, and
        with the given yield stress, all with half as many load steps; empty if they were not solved.
    imprint_mm
        Largest distance by which the unloaded surfaces have separated below the patch.
    """

    fe: Rung
    nodal: Rung
    fewer_steps: Rung | None = None
    bodies: Mapping[str, YieldedBody]
    path: tuple[PathPoint, ...] = ()
    by_band: Mapping[str, Mapping[str, float]]
    imprint_mm: float = 0.0

    @property
    def first_body(self) -> str:
        """Name of the body that yields at the smallest load."""
        return min(self.bodies, key=lambda name: self.bodies[name].first_yield_N)

    @property
    def first_yield_N(self) -> float:
        """Smallest load in N at which a body yields."""
        return self.bodies[self.first_body].first_yield_N

    @property
    def status(self) -> str:
        """Status of the plastic contact: `converged` only if both of its rungs are."""
        return "converged" if self.fe.status == self.nodal.status == "converged" else "not converged"
