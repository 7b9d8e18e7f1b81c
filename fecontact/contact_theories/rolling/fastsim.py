"""FASTSIM, Kalker's simplified theory of rolling contact: on an ellipse, and in strips over any pressure.

The tangential displacement of a point is L times the traction at this point. In each strip along the rolling direction
the traction is zero at the leading edge, grows with the slip of the rigid bodies over L, and is limited to mu times the
bound of the pressure (Kalker 1982). The three flexibilities are chosen so that the force without slip agrees with
Kalker's linear theory.

Range of validity: forces within 5 to 10 % of the exact theory of the half-space; the moment of spin without slip is
three quarters of the exact moment. If the whole patch slips under xi and eta together, the force acts along (xi/L1,
eta/L2) instead of (xi, eta): an error of 12 % of mu N on a patch much wider than long.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.bodies import RollingPair
from fecontact.contact_theories.rolling.creepage import Creepages, CreepForce, Motion, RollingEllipse
from fecontact.contact_theories.rolling.kalker import coefficients_of
from fecontact.errors import InputError

Bound = Literal["parabolic", "elliptic", "strips"]
CELLS = 50
"""Cells along and across an ellipse: without spin, forces are within 0.02 % of mu N of the limit of fine cells.

With spin the error is of first order in the length of a cell: 0.1 to 0.3 % at 1e-4/mm under 80 kN, 1 % on a flange
(2 by 8 mm, 20 kN, 4e-3/mm), and at most 1.9 %, on a round patch that slips by spin alone.
"""


@dataclass(frozen=True, kw_only=True)
class Flexibilities:
    """Flexibilities, displacement over traction in mm/MPa: L1 along, L2 across, L3 for spin."""

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
        Ellipse that gives the flexibilities; its load is the load of all strips.
    centre_x_mm, centre_y_mm
        Centre of the patch.
    y_mm, width_mm, middle_x_mm, half_length_mm (n,)
        Position, width, middle and half length of each strip.
    force_N_per_mm (n,)
        Normal force of each strip over its width.
    """

    contact: RollingEllipse
    centre_x_mm: float
    centre_y_mm: float
    y_mm: Floats
    width_mm: Floats
    middle_x_mm: Floats
    half_length_mm: Floats
    force_N_per_mm: Floats

    @classmethod
    def of(cls, pair: RollingPair, **lines: Floats) -> Strips:
        """Strips of a pair with the ellipse of their second moments."""
        contact, centre_x, centre_y = _ellipse_of(pair, **lines)
        return cls(contact=contact, centre_x_mm=centre_x, centre_y_mm=centre_y, **lines)


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
        `parabolic` is Kalker's paraboloid. `elliptic` is Hertz's pressure, with better power and moment at small
        creepage. `strips` is as in `fastsim_strips`.
    cells
        Cells along each strip, and strips.
    """
    return fastsim_strips((ellipse_strips(contact, cells[1]),), creepages, bound=bound, cells=cells[0])


def fastsim_strips(
    pieces: Sequence[Strips], creepages: Motion, *, bound: Bound = "strips", cells: int = CELLS
) -> CreepForce:
    """FASTSIM on any patch in strips; each separate patch has its flexibilities.

    Parameters
    ----------
    creepages
        Creepages at the origin of the strips' coordinates, or over surfaces that are curved across.
    bound
        Bound of the traction along each strip: `elliptic` is the strip's pressure, `strips` a parabola with an equal
        force (nearest to the exact theory on real patches); `parabolic` moves force to the longer strips as Kalker's
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
        # 0.0 + turns -0.0 into 0.0
        power_per_speed_N=0.0 + power,
    )


def strip_forces(piece: Strips, creepages: Motion, *, cells: int = CELLS) -> tuple[Floats, Floats, Floats]:
    """FASTSIM strip by strip (n,): forces along and across in N, and moment of the lateral force about x = 0."""
    x, sums, _ = _tractions(piece, creepages, "strips", cells)
    return sums.real.sum(axis=0), sums.imag.sum(axis=0), (x * sums.imag).sum(axis=0)


def _march(piece: Strips, creepages: Motion, bound: Bound, cells: int) -> tuple[float, ...]:
    """Fx, Fy, Mz, power, and areas of adhesion and slip of a patch."""
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
    """Place x, force and slip (true or false) of all cells (cells, n), from the leading edge backwards.

    Forces are complex: along the rolling direction, and i times across.
    """
    L = flexibilities(piece.contact)
    (xi, spin), eta = creepages.across(piece.y_mm), creepages.eta
    force = piece.force_N_per_mm * piece.width_mm
    # over a plane the mean is the creepage at the centre
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
    # over an ellipse the force of a strip is in proportion to its squared length: `parabolic` is then the paraboloid
    shape = along[:, None] * (force if bound == "parabolic" else force / piece.half_length_mm)
    cell = (2.0 / places.size) * piece.half_length_mm * piece.width_mm
    return np.asarray(shape * (piece.contact.normal_force_N / float((shape * cell).sum())))


# --- Any pressure field in strips along the rolling direction, and its ellipse for the flexibilities.

STRIPS = 80
"""Number of strips over a pressure field."""


def pressure_strips(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, pair: RollingPair, *, strips: int = STRIPS
) -> tuple[Strips, ...]:
    """Separate patches of a pressure on a uniform grid, each in strips and with an ellipse.

    The ellipse has the second moments of the patch's pressure, sqrt(5 <x^2>) and sqrt(5 <y^2>) about its centre, scaled
    to the true area; for a Hertz pressure it is Hertz's ellipse. A strip reaches over sqrt(4 <x^2>) to each side of its
    middle. Lobes of a patch share an ellipse: an ellipse for each lobe agrees less with the rolling half-space.

    Parameters
    ----------
    x_mm (nx,), y_mm (ny,)
        Nodes along the rolling direction and across.
    pressure_MPa (nx, ny)
        Pressure at the nodes.
    strips
        Neighbouring nodes across are put together until there are fewer than twice as many as this.

    Notes
    -----
    After Kik and Piotrowski (1996), who march over the true patch in strips. Range of validity: each strip has a single
    stretch in contact, as on prismatic rails.
    """
    width = float(y_mm[1] - y_mm[0])
    group = max(1, y_mm.size // strips)
    kept = y_mm.size + -y_mm.size % group
    padded = np.pad(pressure_MPa, ((0, 0), (0, kept - y_mm.size))).reshape(x_mm.size, -1, group).mean(axis=2)
    middles = y_mm[0] + width * (group * np.arange(kept // group) + 0.5 * (group - 1))
    # a strip of one node has no length
    here = np.count_nonzero(padded > 0.0, axis=0) > 1
    starts = np.flatnonzero(here & ~np.append(False, here[:-1]))
    ends = np.flatnonzero(here & ~np.append(here[1:], False)) + 1
    own = [slice(int(low), int(high)) for low, high in zip(starts, ends, strict=True)]
    return tuple(_piece(x_mm, middles[one], padded[:, one], group * width, pair) for one in own)


def _piece(x: Floats, y: Floats, p: Floats, width: float, pair: RollingPair) -> Strips:
    total = p.sum(axis=0)
    middle = x @ p / total
    return Strips.of(
        pair,
        y_mm=y,
        width_mm=np.full(y.size, width),
        middle_x_mm=middle,
        half_length_mm=2.0 * np.sqrt(np.maximum(x**2 @ p / total - middle**2, 0.0)),
        force_N_per_mm=float(x[1] - x[0]) * total,
    )


def mean_creepages(pieces: Sequence[Strips], creepages: Motion) -> Creepages:
    """Creepages at the centre of all patches together; over curved surfaces the mean weighted by the load."""
    parts = ((one.force_N_per_mm * one.width_mm, one.middle_x_mm, one.y_mm) for one in pieces)
    force, middle, y = (np.concatenate(each) for each in zip(*parts, strict=True))
    return creepages.mean(middle, y, force / force.sum())


def one_ellipse(pieces: Sequence[Strips]) -> tuple[RollingEllipse, float, float]:
    """The ellipse of second moments of all patches together, scaled to their area, and its centre (mm)."""
    names = ("y_mm", "width_mm", "middle_x_mm", "half_length_mm", "force_N_per_mm")
    lines = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in names}
    return _ellipse_of(pieces[0].contact, **lines)


def _ellipse_of(
    pair: RollingPair,
    *,
    y_mm: Floats,
    width_mm: Floats,
    middle_x_mm: Floats,
    half_length_mm: Floats,
    force_N_per_mm: Floats,
) -> tuple[RollingEllipse, float, float]:
    force = force_N_per_mm * width_mm
    share = force / force.sum()
    centre_x, centre_y = float(middle_x_mm @ share), float(y_mm @ share)
    a = math.sqrt(5.0 * float((half_length_mm**2 / 4.0 + (middle_x_mm - centre_x) ** 2) @ share))
    # the width of a strip adds to the second moment across
    b = math.sqrt(5.0 * float(((y_mm - centre_y) ** 2 + width_mm**2 / 12.0) @ share))
    scale = math.sqrt(2.0 * float(half_length_mm @ width_mm) / (math.pi * a * b))
    contact = RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=float(force.sum()))
    return contact, centre_x, centre_y
