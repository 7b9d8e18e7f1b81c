"""Measures of one contact: how each is read from a pressure field and from Hertz's ellipse.

Every measure is one field of `Measures`, or of `Misfit` if Hertz has no value of it: its name with its unit, how it is
read, and how well. All that judges, tells or draws measures goes through these tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fecontact.comparison.patch import Patch, measure_patch
from fecontact.contact.grid import ContactGrid
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]

# Points a cell and direction at which Hertz's pressure is taken for its mean over the cell.
_POINTS_A_CELL = 5


def _measure(
    of_contact: Callable[[Patch, Rung], float],
    of_hertz: Callable[[HertzContact], float],
    *,
    floor: float | None,
    cut_planes: float,
) -> Any:
    return field(metadata={"of_contact": of_contact, "of_hertz": of_hertz, "floor": floor, "cut_planes": cut_planes})


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, half-widths (a along x, b across), full extents and approach of one contact.

    `floor` in the metadata is the relative uncertainty that no mesh takes away: of reading the measure off 32 nodes a
    semi-axis (studies/12_uncertainty.py); None where what remains is not known. The approach is that of the bodies down
    to their cut planes: a deeper rail moves it, and no mesh says by how much. `cut_planes` is how much the other
    measures change at most when one cut plane is moved out by half (studies/02_independence.py).
    """

    p_max_MPa: float = _measure(
        lambda patch, rung: patch.p_max_MPa, lambda hertz: hertz.p0_MPa, floor=0.0006, cut_planes=0.0014
    )
    # where the line of zero pressure lies between nodes is a matter of chance; all other measures are sums
    area_mm2: float = _measure(
        lambda patch, rung: patch.area_mm2, lambda hertz: hertz.area_mm2, floor=0.003, cut_planes=0.0019
    )
    a_mm: float = _measure(
        lambda patch, rung: patch.a_mm, lambda hertz: 0.5 * hertz.extent_x_mm, floor=0.0004, cut_planes=0.0009
    )
    b_mm: float = _measure(
        lambda patch, rung: patch.b_mm, lambda hertz: 0.5 * hertz.extent_y_mm, floor=0.0005, cut_planes=0.0018
    )
    extent_x_mm: float = _measure(
        lambda patch, rung: patch.extent_x_mm, lambda hertz: hertz.extent_x_mm, floor=0.01, cut_planes=0.0009
    )
    extent_y_mm: float = _measure(
        lambda patch, rung: patch.extent_y_mm, lambda hertz: hertz.extent_y_mm, floor=0.01, cut_planes=0.0018
    )
    approach_mm: float = _measure(
        lambda patch, rung: rung.approach_mm, lambda hertz: hertz.approach_mm, floor=None, cut_planes=math.nan
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MEASURES}


def _misfit(
    of: Callable[[Patch, Rung, HertzContact], float], *, floor: float, cut_planes: float, noise: float = 0.0
) -> Any:
    return field(metadata={"of": of, "floor": floor, "cut_planes": cut_planes, "noise": noise})


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """What sizes do not see of a contact beside Hertz's ellipse; all are zero for Hertz.

    Attributes
    ----------
    centre_over_b
        Centre of pressure from the first touch point, across, over Hertz's half-width b.
    valley
        By how much the pressure falls between its two most prominent peaks, over the highest.
    separate_load
        Part of the force on all separate patches but the one that carries most.
    misplaced_load
        Part of the force that is elsewhere than Hertz has it, with his ellipse at the centre of pressure: half the
        integral of the difference over the force.

    `floor` and `cut_planes` in the metadata are uncertainties that no mesh takes away, as in `Measures`; `noise` is
    what is read where there is nothing, and adds in quadrature to what there is.
    """

    centre_over_b: float = _misfit(
        lambda patch, rung, hertz: patch.centre_y_mm / (0.5 * hertz.extent_y_mm), floor=0.0003, cut_planes=0.004
    )
    valley: float = _misfit(lambda patch, rung, hertz: patch.valley, floor=0.0005, cut_planes=0.001)
    separate_load: float = _misfit(lambda patch, rung, hertz: patch.separate_load, floor=0.00005, cut_planes=0.0)
    # cells at the edge of the patch are wholly in contact or not: so much is read for Hertz's own ellipse
    misplaced_load: float = _misfit(
        lambda patch, rung, hertz: _misplaced_load(rung, hertz, (patch.centre_x_mm, patch.centre_y_mm)),
        floor=0.0003,
        cut_planes=0.0008,
        noise=0.0014,
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MISFITS}


_READ = {measure.name: measure.metadata for measure in fields(Measures)}
_READ_BESIDE = {measure.name: measure.metadata for measure in fields(Misfit)}
MEASURES = tuple(_READ)
"""Names of the measures that Hertz and a contact both have, each ending in its unit."""
MISFITS = tuple(_READ_BESIDE)
"""Names of the measures of a contact beside Hertz; they have no unit."""
FLOORS: dict[str, float | None] = {name: read["floor"] for name, read in (_READ | _READ_BESIDE).items()}
"""What every mesh leaves open of each: relative of `MEASURES`, absolute of `MISFITS`; None where it is not known."""
NOISE: dict[str, float] = {name: read["noise"] for name, read in _READ_BESIDE.items()}
"""What is read of each of `MISFITS` where there is none."""
CUT_PLANES: dict[str, float] = {name: read["cut_planes"] for name, read in (_READ | _READ_BESIDE).items()}
"""What the bodies' cut planes leave open of each, in the same way."""


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


@lru_cache(maxsize=64)
def misfit_of(rung: Rung, hertz: HertzContact) -> Misfit:
    """Measures of a solved contact beside Hertz's ellipse at the origin of its grid."""
    patch = patch_of(rung)
    return Misfit(**{name: read["of"](patch, rung, hertz) for name, read in _READ_BESIDE.items()})


def deviations(rung: Rung, hertz: HertzContact) -> dict[str, float]:
    """(Hertz - contact) / contact of each of `MEASURES`, and the `MISFITS` as they are."""
    h, f = hertz_measures(hertz).as_dict(), measures_of(rung).as_dict()
    return {name: h[name] / f[name] - 1.0 for name in MEASURES} | misfit_of(rung, hertz).as_dict()


def hertz_on(grid: ContactGrid, hertz: HertzContact, centre_mm: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Hertz's pressure (nx, ns) in MPa, in the mean over a cell of each node, his ellipse at a place of the grid.

    A contact on a half-space has its nodal pressures on such cells.
    """
    places = (np.arange(_POINTS_A_CELL) + 0.5) / _POINTS_A_CELL - 0.5
    x, s = (
        (line[:, None] - middle + step * places).ravel()
        for line, middle, step in zip((grid.x_mm, grid.s_mm), centre_mm, grid.steps_mm, strict=True)
    )
    pressure = hertz.pressure_MPa(x[:, None], s[None, :])
    cells = pressure.reshape(grid.x_mm.size, _POINTS_A_CELL, grid.s_mm.size, _POINTS_A_CELL)
    return np.asarray(cells.mean(axis=(1, 3)))


def _misplaced_load(rung: Rung, hertz: HertzContact, centre_mm: tuple[float, float]) -> float:
    lengths = (hertz.extent_x_mm + 2.0 * abs(centre_mm[0]), hertz.extent_y_mm + 2.0 * abs(centre_mm[1]))
    contact = rung.pressure.covering(*lengths)
    return part_elsewhere(contact.values, hertz_on(contact.grid, hertz, centre_mm))


def part_elsewhere(pressure_MPa: Floats, reference_MPa: Floats) -> float:
    """Part of the force of a pressure that is elsewhere than a reference on the same cells has it."""
    # at equal force, whatever the cells leave of it
    return float(0.5 * np.abs(pressure_MPa / pressure_MPa.sum() - reference_MPa / reference_MPa.sum()).sum())
