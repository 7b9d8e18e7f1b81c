"""FASTSIM, Kalker's simplified theory of rolling contact: on an ellipse, and in strips over any pressure.

The tangential displacement of a point is L times the traction there alone. In each strip along the rolling direction
the traction begins with zero at the leading edge, grows with the slip of the rigid bodies over L, and is cut back to mu
times the bound of the pressure (Kalker 1982). The three flexibilities make the force without slip that of his linear
theory.

Range of validity: forces within 5 to 10 % of the exact theory of the half-space; the moment of spin without slip is
three quarters of the exact one. Where all slips under xi and eta together the force goes along (xi/L1, eta/L2) instead
of (xi, eta): 12 % of mu N off on a patch much wider than long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.errors import InputError
from fecontact.theory.creep.contact import Creepages, CreepForce, Motion, RollingEllipse
from fecontact.theory.creep.kalker import coefficients_of

Floats = NDArray[np.float64]
Bound = Literal["parabolic", "elliptic", "strips"]
CELLS = 50
"""Cells along and across an ellipse: forces within 0.02 % of mu N of the limit of fine cells without spin.

With spin the error is of first order in the length of a cell: 0.1 to 0.3 % at 1e-4/mm under 80 kN, 1 % on a flange
(2 by 8 mm, 20 kN, 4e-3/mm), 1.9 % at most, where spin alone slides a round patch.
"""


@dataclass(frozen=True, kw_only=True)
class Flexibilities:
    """Displacement over traction in mm/MPa: L1 along, L2 across, L3 for the part of spin."""

    L1: float
    L2: float
    L3: float


def flexibilities(contact: RollingEllipse) -> Flexibilities:
    """L1 = 8 a / (3 G c11), L2 = 8 a / (3 G c22), L3 = pi a sqrt(a/b) / (4 G c23) (Kalker 1982)."""
    c, a, G = coefficients_of(contact), contact.a_mm, contact.shear_MPa
    return Flexibilities(
        L1=8.0 * a / (3.0 * G * c.c11),
        L2=8.0 * a / (3.0 * G * c.c22),
        L3=math.pi * a * math.sqrt(a / contact.b_mm) / (4.0 * G * c.c23),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Strips:
    """A separate patch in strips along the rolling direction.

    Attributes
    ----------
    contact
        The ellipse that gives the flexibilities; its load is that of all strips.
    centre_x_mm, centre_y_mm
        Its centre.
    y_mm, width_mm, middle_x_mm, half_length_mm (n,)
        Place, width, middle and half length of each strip.
    force_N_per_mm (n,)
        Normal force of each over its width.
    """

    contact: RollingEllipse
    centre_x_mm: float
    centre_y_mm: float
    y_mm: Floats
    width_mm: Floats
    middle_x_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats


def ellipse_strips(contact: RollingEllipse, strips: int = CELLS) -> Strips:
    """Hertz's pressure on an ellipse in strips of equal width."""
    places = np.asarray((np.arange(strips) + 0.5) * (2.0 / strips) - 1.0)
    inside = 1.0 - places**2
    width = 2.0 * contact.b_mm / strips
    return Strips(
        contact=contact,
        centre_x_mm=0.0,
        centre_y_mm=0.0,
        y_mm=contact.b_mm * places,
        width_mm=np.full(strips, width),
        middle_x_mm=np.zeros(strips),
        half_length_mm=contact.a_mm * np.sqrt(inside),
        force_N_per_mm=0.75 * contact.normal_force_N / contact.b_mm * inside,
    )


def fastsim(
    contact: RollingEllipse,
    creepages: Creepages,
    *,
    bound: Bound = "parabolic",
    cells: tuple[int, int] = (CELLS, CELLS),
) -> CreepForce:
    """FASTSIM on an ellipse.

    Parameters
    ----------
    bound
        `parabolic`, which is Kalker's paraboloid, `elliptic`, which is Hertz's pressure: better power and moment at
        small creepage, or `strips`, as in `fastsim_strips`.
    cells
        Cells along each strip, and strips.
    """
    return fastsim_strips((ellipse_strips(contact, cells[1]),), creepages, bound=bound, cells=cells[0])


def fastsim_strips(
    pieces: Sequence[Strips], creepages: Motion, *, bound: Bound = "strips", cells: int = CELLS
) -> CreepForce:
    """FASTSIM on any patch in strips; each separate patch has flexibilities of its own.

    Parameters
    ----------
    creepages
        At the origin of the strips' coordinates, or of surfaces that are curved across.
    bound
        Of the traction along each strip: `elliptic` is the pressure of the strip, `strips` a parabola of the same force
        (nearest to the exact theory on real patches); `parabolic` moves force to the longer strips as Kalker's
        paraboloid does over an ellipse.
    """
    if cells < 1:
        raise InputError(f"cells along a strip are {cells!r}; allowed: 1 and more; 20 to 50 are usual")
    parts = [_march(piece, creepages, bound, cells) for piece in pieces]
    fx, fy, mz, power, adhesion, slip = (sum(part[k] for part in parts) for k in range(6))
    return CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=adhesion,
        slip_area_mm2=slip,
        # zero is told without a sign
        power_per_speed_N=0.0 + power,
    )


def strip_forces(piece: Strips, creepages: Motion, *, cells: int = CELLS) -> tuple[Floats, Floats, Floats]:
    """FASTSIM strip by strip (n,): forces along and across in N, and moment of the latter about the strip's x = 0."""
    x, sums, _ = _tractions(piece, creepages, "strips", cells)
    return sums.real.sum(axis=0), sums.imag.sum(axis=0), (x * sums.imag).sum(axis=0)


def _march(piece: Strips, creepages: Motion, bound: Bound, cells: int) -> tuple[float, ...]:
    """Fx, Fy, Mz, power, and areas of adhesion and slip of one patch."""
    (xi, spin), eta = creepages.across(piece.y_mm), creepages.eta
    x, sums, slips = _tractions(piece, creepages, bound, cells)
    area = 2.0 * piece.half_length_mm / cells * piece.width_mm
    fx, fy = float(sums.real.sum()), float(sums.imag.sum())
    mz = float((x * sums.imag - piece.y_mm * sums.real).sum())
    power = -float((xi * sums.real + (eta + spin * x) * sums.imag).sum())
    slipping = float((slips * area).sum())
    return fx, fy, mz, power, cells * float(area.sum()) - slipping, slipping


def _tractions(
    piece: Strips, creepages: Motion, bound: Bound, cells: int
) -> tuple[Floats, NDArray[np.complex128], NDArray[np.bool_]]:
    """Places x, forces and whether there is slip of all cells (cells, n), from the leading edge backwards.

    Forces are complex: along the rolling direction, and i times across.
    """
    L = flexibilities(piece.contact)
    (xi, spin), eta = creepages.across(piece.y_mm), creepages.eta
    force = piece.force_N_per_mm * piece.width_mm
    # over the plane that is the creepage of the centre
    xi_mean = float(xi @ force) / float(force.sum())
    step = 2.0 * piece.half_length_mm / cells
    # middles of the cells from the leading edge, over the half length
    places = np.asarray(1.0 - (np.arange(cells) + 0.5) * (2.0 / cells))
    x = piece.middle_x_mm + places[:, None] * piece.half_length_mm
    limit = piece.contact.friction * _bound(piece, places, bound)
    # spin is taken in the middle of each step
    moved = x - piece.centre_x_mm + 0.5 * step
    length = np.broadcast_to(step, x.shape).copy()
    moved[0] -= 0.25 * step
    length[0] *= 0.5
    lateral = eta + spin * piece.centre_x_mm
    slope = (xi_mean / L.L1 + (xi - xi_mean) / L.L3) + 1j * (lateral / L.L2 + spin / L.L3 * moved)
    drive = length * slope
    traction, trial = np.empty_like(drive), np.empty_like(x)
    now = np.zeros(piece.y_mm.size, dtype=complex)
    for k in range(cells):
        now = now - drive[k]
        np.abs(now, out=trial[k])
        now *= limit[k] / np.maximum(trial[k], limit[k])
        traction[k] = now
    return x, np.asarray(step * piece.width_mm * traction, dtype=complex), trial > limit


def _bound(piece: Strips, places: Floats, bound: Bound) -> Floats:
    """Bound of the pressure (cells, n) in MPa whose sum over the cells is the patch's load."""
    inside, force = 1.0 - places**2, piece.force_N_per_mm
    along = np.sqrt(inside) if bound == "elliptic" else inside
    # over an ellipse, where the force of a strip goes with the square of its length, `parabolic` is the paraboloid
    shape = along[:, None] * (force if bound == "parabolic" else force / piece.half_length_mm)
    cell = (2.0 / places.size) * piece.half_length_mm * piece.width_mm
    return np.asarray(shape * (piece.contact.normal_force_N / float((shape * cell).sum())))
