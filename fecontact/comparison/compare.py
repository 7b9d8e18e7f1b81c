"""The finite-element pressure beside the Hertz ellipse, on the same points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from fecontact.comparison.measures import Measures, deviations, hertz_measures, measures_of
from fecontact.contact.grid import ContactGrid
from fecontact.contact.patch import measure_patch, signed_square
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]
_OVERLAP_REFINEMENT = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz against the finite elements at equal normal force.

    Attributes
    ----------
    deviation
        (Hertz - FE) / FE for each measure.
    pressure_l2
        Norm of the pressure difference over the norm of the finite-element pressure, over both patches.
    overlap
        Area of the intersection of the patches over the area of their union.
    centre_x_mm, centre_y_mm
        Centre of the finite-element pressure, from the touch point, where Hertz has it.
    pieces
        Number of separate finite-element patches.
    area_reading
        Relative uncertainty of reading the area off the finite-element pressure: a quarter of the difference between
        the areas with and without the outermost nodes.
    hertz_pressure_MPa (nx, ns)
        Hertz pressure on the nodes.
    """

    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    pressure_l2: float
    overlap: float
    centre_x_mm: float
    centre_y_mm: float
    pieces: int
    area_reading: float
    hertz_pressure_MPa: Floats


def compare(grid: ContactGrid, pressure: Floats, approach_mm: float, hertz: HertzContact) -> Comparison:
    """Compare a pressure (nx, ns) in MPa on the grid, with its approach, to Hertz's ellipse at the grid's origin."""
    patch = measure_patch(grid.x_mm, grid.s_mm, pressure, half=grid.half)
    fe = measures_of(patch, approach_mm)
    analytic = hertz_measures(hertz)
    x, s, padded = _cover_ellipse(grid, pressure, hertz)
    reference = hertz.pressure_MPa(x[:, None], s[None, :])
    return Comparison(
        fe=fe,
        hertz=analytic,
        deviation=deviations(analytic, fe),
        pressure_l2=float(np.linalg.norm(reference - padded) / np.linalg.norm(padded)),
        overlap=_overlap(x, s, padded, hertz),
        centre_x_mm=patch.centre_x_mm,
        centre_y_mm=patch.centre_y_mm,
        pieces=patch.pieces,
        area_reading=0.25 * patch.area_spread_mm2 / patch.area_mm2,
        hertz_pressure_MPa=np.asarray(hertz.pressure_MPa(grid.x_mm[:, None], grid.s_mm[None, :])),
    )


def _cover_ellipse(grid: ContactGrid, pressure: Floats, hertz: HertzContact) -> tuple[Floats, Floats, Floats]:
    """The whole grid (both halves) continued with zero pressure until it covers the ellipse as well."""
    x, p = grid.x_mm, pressure
    if grid.half:
        x, p = np.concatenate([-x[:0:-1], x]), np.concatenate([p[:0:-1], p])
    hx, hs = grid.steps_mm
    more = [
        max(0, int(np.ceil((0.5 * hertz.extent_x_mm + x[0]) / hx)) + 1),
        max(0, int(np.ceil((0.5 * hertz.extent_x_mm - x[-1]) / hx)) + 1),
        max(0, int(np.ceil((0.5 * hertz.extent_y_mm + grid.s_mm[0]) / hs)) + 1),
        max(0, int(np.ceil((0.5 * hertz.extent_y_mm - grid.s_mm[-1]) / hs)) + 1),
    ]
    x = np.concatenate([x[0] - hx * np.arange(more[0], 0, -1), x, x[-1] + hx * np.arange(1, more[1] + 1)])
    s = grid.s_mm
    s = np.concatenate([s[0] - hs * np.arange(more[2], 0, -1), s, s[-1] + hs * np.arange(1, more[3] + 1)])
    return x, s, np.pad(p, ((more[0], more[1]), (more[2], more[3])))


def _overlap(x: Floats, s: Floats, pressure: Floats, hertz: HertzContact) -> float:
    square = signed_square(pressure)[1:-1, 1:-1]
    count = [(n - 1) * _OVERLAP_REFINEMENT + 1 for n in square.shape]
    fine = zoom(square, [c / n for c, n in zip(count, square.shape, strict=True)], order=1, grid_mode=False)
    inside = fine > 0.0
    xs, ss = (np.linspace(line[0], line[-1], n) for line, n in zip((x, s), fine.shape, strict=True))
    ellipse = hertz.pressure_MPa(xs[:, None], ss[None, :]) > 0.0
    return float(np.count_nonzero(inside & ellipse) / np.count_nonzero(inside | ellipse))
