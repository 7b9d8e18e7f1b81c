"""Contact between bodies that have yielded, as solved: fields and numbers alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from fecontact.contact.grid import Rung

YIELD_BAND = 0.15
"""Part by which a yield stress is taken lower and higher: steels of one name differ by so much, and bend gradually."""


@dataclass(frozen=True, kw_only=True)
class PathPoint:
    """A load on the way up from first yield.

    Attributes
    ----------
    steps
        Change of each of `measures.MEASURES` by plasticity alone, relative to elastic bodies under the same load.
    largest_strain
        Largest equivalent plastic strain in either body.
    corrections, change
        How many corrections were made, and the relative change by the last of them.
    """

    load_N: float
    steps: Mapping[str, float]
    largest_strain: float
    corrections: int
    change: float


@dataclass(frozen=True, kw_only=True)
class YieldedBody:
    """Where a body has yielded; depths lie below its surface, along the normals.

    Attributes
    ----------
    first_yield_N
        Load at which it yields first, where plastic strain is followed; from the third root of the load, as below an
        ellipse, where the load is less.
    largest_strain, x_mm, y_mm, depth_mm
        Largest equivalent plastic strain, and where; 0 of a body that has not yielded.
    top_mm, bottom_mm
        Between which depths it has yielded.
    volume_mm3
        Volume that has.
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
class Yielded:
    """The first loading of virgin bodies on one pair of meshes.

    Attributes
    ----------
    fe, nodal
        Contact between the bodies after it, on the nodes of the elastic rungs of the same name.
    bodies
        What yielded, by `rail` and `wheel`; a body without a yield stress is not there.
    path
        Loads from first yield up to the load; none where nothing yields.
    fewer_steps
        `fe` in half as many steps; None where that was not solved.
    by_band
        Change of each measure by plasticity with yield stresses lower and higher by `YIELD_BAND`, and as they are, in
        half as many steps; empty where that was not solved.
    imprint_mm
        How far the unloaded surfaces have parted below the patch, at most.
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
        """The body that yields first."""
        return min(self.bodies, key=lambda name: self.bodies[name].first_yield_N)

    @property
    def first_yield_N(self) -> float:
        """Load at which either body yields first."""
        return self.bodies[self.first_body].first_yield_N

    @property
    def status(self) -> str:
        """Whether the contact may be used."""
        return "converged" if self.fe.status == self.nodal.status == "converged" else "not converged"
