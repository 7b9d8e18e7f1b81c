"""Measures of one contact: how each is read from a pressure field and from Hertz's ellipse.

Every measure is one field of `Measures`: its name with its unit, and how it is read. All that judges, tells or draws
measures goes through `MEASURES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any

from fecontact.comparison.patch import Patch, measure_patch
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact


def _measure(
    of_contact: Callable[[Patch, Rung], float],
    of_hertz: Callable[[HertzContact], float],
    *,
    reading: Callable[[Patch], float] = lambda patch: 0.0,
) -> Any:
    """A measure by how it is read from a contact and from Hertz.

    `reading` is the relative uncertainty of reading it off one pressure field.
    """
    return field(metadata={"of_contact": of_contact, "of_hertz": of_hertz, "reading": reading})


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, semi-axes (a along x, b across), full extents and approach of one contact."""

    p_max_MPa: float = _measure(lambda patch, rung: patch.p_max_MPa, lambda hertz: hertz.p0_MPa)
    area_mm2: float = _measure(
        lambda patch, rung: patch.area_mm2,
        lambda hertz: hertz.area_mm2,
        # a quarter of the difference between the areas with and without the outermost nodes
        reading=lambda patch: 0.25 * patch.area_spread_mm2 / patch.area_mm2,
    )
    a_mm: float = _measure(lambda patch, rung: patch.a_mm, lambda hertz: hertz.a_mm)
    b_mm: float = _measure(lambda patch, rung: patch.b_mm, lambda hertz: hertz.b_mm)
    extent_x_mm: float = _measure(lambda patch, rung: patch.extent_x_mm, lambda hertz: hertz.extent_x_mm)
    extent_y_mm: float = _measure(lambda patch, rung: patch.extent_y_mm, lambda hertz: hertz.extent_y_mm)
    approach_mm: float = _measure(lambda patch, rung: rung.approach_mm, lambda hertz: hertz.approach_mm)

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MEASURES}


_READ = {measure.name: measure.metadata for measure in fields(Measures)}
MEASURES = tuple(_READ)
"""Names of all measures, each ending in its unit."""


# a load is judged by its rungs several times while it is refined, and each is read once
@lru_cache(maxsize=64)
def patch_of(rung: Rung) -> Patch:
    """What the pressure of a solved contact says of its patch."""
    return measure_patch(rung.pressure)


def measures_of(rung: Rung) -> Measures:
    """Measures of a solved contact."""
    patch = patch_of(rung)
    return Measures(**{name: read["of_contact"](patch, rung) for name, read in _READ.items()})


def hertz_measures(hertz: HertzContact) -> Measures:
    """The measures of a Hertz ellipse, a along x and b across also where its axes are turned."""
    return Measures(**{name: read["of_hertz"](hertz) for name, read in _READ.items()})


def reading_uncertainty(patch: Patch) -> dict[str, float]:
    """Relative uncertainty of reading each measure off one pressure field."""
    return {name: float(read["reading"](patch)) for name, read in _READ.items()}


def deviations(hertz: Measures, fe: Measures) -> dict[str, float]:
    """(Hertz - FE) / FE of each measure."""
    h, f = hertz.as_dict(), fe.as_dict()
    return {name: h[name] / f[name] - 1.0 for name in MEASURES}
