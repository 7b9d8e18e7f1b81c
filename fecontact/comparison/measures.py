"""Measures of one contact: how each is read from a pressure field and from Hertz's ellipse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import Patch, measure_patch
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]

MEASURES = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "extent_x_mm", "extent_y_mm", "approach_mm")


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, semi-axes (a along x, b across), full extents and approach of one contact."""

    p_max_MPa: float
    area_mm2: float
    a_mm: float
    b_mm: float
    extent_x_mm: float
    extent_y_mm: float
    approach_mm: float

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MEASURES}


def measure(grid: ContactGrid, pressure: Floats, approach_mm: float) -> Measures:
    """Measures of a pressure (nx, ns) in MPa on the grid, with its approach."""
    return measures_of(measure_patch(grid.x_mm, grid.s_mm, pressure, half=grid.half), approach_mm)


def measures_of(patch: Patch, approach_mm: float) -> Measures:
    """Measures of a patch with its approach."""
    return Measures(
        p_max_MPa=patch.p_max_MPa,
        area_mm2=patch.area_mm2,
        a_mm=patch.a_mm,
        b_mm=patch.b_mm,
        extent_x_mm=patch.extent_x_mm,
        extent_y_mm=patch.extent_y_mm,
        approach_mm=approach_mm,
    )


def deviations(hertz: Measures, fe: Measures) -> dict[str, float]:
    """(Hertz - FE) / FE of each measure."""
    h, f = hertz.as_dict(), fe.as_dict()
    return {name: h[name] / f[name] - 1.0 for name in MEASURES}


def hertz_measures(hertz: HertzContact) -> Measures:
    """The measures of a Hertz ellipse, a along x and b across also where its axes are turned."""
    return Measures(
        p_max_MPa=hertz.p0_MPa,
        area_mm2=hertz.area_mm2,
        a_mm=hertz.a_mm,
        b_mm=hertz.b_mm,
        extent_x_mm=hertz.extent_x_mm,
        extent_y_mm=hertz.extent_y_mm,
        approach_mm=hertz.approach_mm,
    )
