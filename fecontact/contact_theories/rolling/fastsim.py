"""FASTSIM, Kalker's simplified theory of rolling contact, on an ellipse and in strips.

The strips may have any pressure. The tangential displacement of a point is L times the traction at this point. In each
strip along the rolling direction the traction is zero at the leading edge, grows with the slip of the rigid bodies
divided by L, and is limited to mu times the bound of the pressure (Kalker 1982). The three flexibilities are chosen so
that the force without slip agrees with Kalker's linear theory.

Range of validity: forces are within 5 to 10 % of the exact theory of the half-space. The moment of spin without slip is
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
from fecontact.contact_theories.rolling.creepage import CreepageField, Creepages, CreepForce, RollingEllipse
from fecontact.contact_theories.rolling.kalker import find_kalker_coefficients
from fecontact.errors import InputError

TractionBound = Literal["parabolic", "elliptic", "strips"]
CELLS_PER_DIRECTION = 50
"""Number of cells along and across an ellipse.

Without spin, forces are within 0.02 % of mu N of the limit of fine cells. With spin the error is of first order in the
length of a cell: 0.1 to 0.3 % at 1e-4/mm under 80 kN, 1 % on a flange (2 by 8 mm, 20 kN, 4e-3/mm), and at most 1.9 %,
on a round patch that slips by spin alone.
"""


@dataclass(frozen=True, kw_only=True)
class FastsimFlexibilities:
    """Flexibilities, displacement divided by traction, in mm/MPa.

    Attributes
    ----------
    L1, L2, L3
        Flexibility along the rolling direction, across, and for spin.
    """

    L1: float
    L2: float
    L3: float


def calculate_flexibilities(contact: RollingEllipse) -> FastsimFlexibilities:
    """Flexibilities of an ellipse from Kalker's coefficients (Kalker 1982).

    L1 = 8 a / (3 G c11), L2 = 8 a / (3 G c22), L3 = pi a sqrt(a/b) / (4 G c23).

    Parameters
    ----------
    contact
        Elliptic contact that rolls.

    Returns
    -------
    FastsimFlexibilities
        Flexibilities in mm/MPa.
    """
    coefficients, a, G = find_kalker_coefficients(contact), contact.a_mm, contact.shear_MPa
    return FastsimFlexibilities(
        L1=8.0 * a / (3.0 * G * coefficients.c11),
        L2=8.0 * a / (3.0 * G * coefficients.c22),
        L3=math.pi * a * math.sqrt(a / contact.b_mm) / (4.0 * G * coefficients.c23),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class RollingStrips:
    """Separate patch in strips along the rolling direction.

    Attributes
    ----------
    contact
        Ellipse that defines the flexibilities; its load is the load of all strips.
    centre_x_mm, centre_y_mm
        Centre of the patch.
    y_mm, width_mm, middle_x_mm, half_length_mm : ndarray of shape (n,)
        Position, width, middle and half length of each strip.
    force_N_per_mm : ndarray of shape (n,)
        Normal force of each strip, divided by its width.
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
    def of(cls, pair: RollingPair, **strip_arrays: Floats) -> RollingStrips:
        """Strips of a pair, with the ellipse of their second moments.

        Parameters
        ----------
        pair
            Friction and elastic constants.
        strip_arrays : ndarray of shape (n,)
            Arrays of the strips by the names of their attributes.

        Returns
        -------
        RollingStrips
            The strips with their ellipse and centre.
        """
        contact, centre_x, centre_y = _fit_ellipse(pair, **strip_arrays)
        return cls(contact=contact, centre_x_mm=centre_x, centre_y_mm=centre_y, **strip_arrays)


def divide_ellipse(contact: RollingEllipse, strips: int = CELLS_PER_DIRECTION) -> RollingStrips:
    """Divide Hertz's pressure on an ellipse into strips of equal width.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    strips
        Number of strips.

    Returns
    -------
    RollingStrips
        The strips, with their centre at the origin.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import RollingEllipse
    >>> from fecontact.contact_theories.rolling.fastsim import divide_ellipse
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> strips = divide_ellipse(ellipse)
    >>> bool(abs(strips.force_N_per_mm @ strips.width_mm / 80e3 - 1.0) < 1e-3)
    True
    """
    relative_positions = np.asarray((np.arange(strips) + 0.5) * (2.0 / strips) - 1.0)
    length_square = 1.0 - relative_positions**2
    width = 2.0 * contact.b_mm / strips
    return RollingStrips(
        contact=contact,
        centre_x_mm=0.0,
        centre_y_mm=0.0,
        y_mm=contact.b_mm * relative_positions,
        width_mm=np.full(strips, width),
        middle_x_mm=np.zeros(strips),
        half_length_mm=contact.a_mm * np.sqrt(length_square),
        force_N_per_mm=0.75 * contact.normal_force_N / contact.b_mm * length_square,
    )


def fastsim(
    contact: RollingEllipse,
    creepages: Creepages,
    *,
    bound: TractionBound = "parabolic",
    cells: tuple[int, int] = (CELLS_PER_DIRECTION, CELLS_PER_DIRECTION),
) -> CreepForce:
    """Creep force by FASTSIM on an ellipse.

    Parameters
    ----------
    contact
        Elliptic contact that rolls.
    creepages
        Creepages at its centre.
    bound
        `parabolic` is Kalker's paraboloid. `elliptic` is Hertz's pressure, with more accurate power and moment at small
        creepage. `strips` is as in `fastsim_strips`.
    cells
        Number of cells along each strip, and number of strips.

    Returns
    -------
    CreepForce
        Force, moment, areas and power.

    Notes
    -----
    Source: Kalker (1982). Range of validity: forces within 5 to 10 % of the exact theory of the half-space, and the
    moment of spin as described in the module.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.fastsim import fastsim
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> force = fastsim(ellipse, Creepages(xi=0.1))
    >>> round(force.fx_N), round(force.adhesion_area_mm2, 6)
    (-24000, 0.0)
    """
    return fastsim_strips((divide_ellipse(contact, cells[1]),), creepages, bound=bound, cells=cells[0])


def fastsim_strips(
    pieces: Sequence[RollingStrips],
    creepages: CreepageField,
    *,
    bound: TractionBound = "strips",
    cells: int = CELLS_PER_DIRECTION,
) -> CreepForce:
    """Creep force by FASTSIM on any patch in strips.

    Each separate patch has its flexibilities.

    Parameters
    ----------
    pieces
        Separate patches in strips.
    creepages
        Creepages at the origin of the coordinates of the strips, or over surfaces that are curved across.
    bound
        Bound of the traction along each strip. `elliptic` is the pressure of the strip. `strips` is a parabola with an
        equal force (nearest to the exact theory on real patches). `parabolic` moves force to the longer strips as
        Kalker's paraboloid does over an ellipse.
    cells
        Number of cells along each strip, at least 1.

    Returns
    -------
    CreepForce
        Force, moment about the origin, areas and power of all patches.

    Raises
    ------
    InputError
        If there is no cell along a strip.

    Examples
    --------
    >>> from fecontact.contact_theories.rolling.creepage import Creepages, RollingEllipse
    >>> from fecontact.contact_theories.rolling.fastsim import divide_ellipse, fastsim_strips
    >>> ellipse = RollingEllipse(a_mm=5.0, b_mm=5.0, normal_force_N=80e3, friction=0.3, shear_MPa=80e3, poisson=0.25)
    >>> round(fastsim_strips([divide_ellipse(ellipse)], Creepages(xi=0.1)).fx_N)
    -24000
    """
    if cells < 1:
        raise InputError(f"cells along a strip are {cells!r}; allowed: at least 1; 20 to 50 are usual")
    piece_sums = [_integrate_tractions(piece, creepages, bound, cells) for piece in pieces]
    fx, fy, mz, power, adhesion, slip = (sum(piece_sum[index] for piece_sum in piece_sums) for index in range(6))
    return CreepForce(
        fx_N=fx,
        fy_N=fy,
        mz_Nmm=mz,
        adhesion_area_mm2=adhesion,
        slip_area_mm2=slip,
        # Adding 0.0 turns -0.0 into 0.0.
        power_per_speed_N=0.0 + power,
    )


def calculate_strip_forces(
    piece: RollingStrips, creepages: CreepageField, *, cells: int = CELLS_PER_DIRECTION
) -> tuple[Floats, Floats, Floats]:
    """Creep forces by FASTSIM for each strip.

    Parameters
    ----------
    piece
        Separate patch in strips.
    creepages
        Creepages at the origin of the coordinates, or over surfaces that are curved across.
    cells
        Number of cells along each strip.

    Returns
    -------
    fx_N, fy_N, mz_Nmm (n,)
        Forces along the rolling direction and across in N, and moment of the lateral force about x = 0.
    """
    x, cell_forces, _ = _calculate_tractions(piece, creepages, "strips", cells)
    return cell_forces.real.sum(axis=0), cell_forces.imag.sum(axis=0), (x * cell_forces.imag).sum(axis=0)


def _integrate_tractions(
    piece: RollingStrips, creepages: CreepageField, bound: TractionBound, cells: int
) -> tuple[float, ...]:
    """Sum the tractions of a patch.

    The sums are Fx, Fy, Mz, power, and the areas of adhesion and slip.
    """
    (xi, spin), eta = creepages.across(piece.y_mm), creepages.eta
    x, cell_forces, is_slipping = _calculate_tractions(piece, creepages, bound, cells)
    cell_areas = 2.0 * piece.half_length_mm / cells * piece.width_mm
    fx, fy = float(cell_forces.real.sum()), float(cell_forces.imag.sum())
    mz = float((x * cell_forces.imag - piece.y_mm * cell_forces.real).sum())
    power = -float((xi * cell_forces.real + (eta + spin * x) * cell_forces.imag).sum())
    slip_area = float((is_slipping * cell_areas).sum())
    return fx, fy, mz, power, cells * float(cell_areas.sum()) - slip_area, slip_area


def _calculate_tractions(
    piece: RollingStrips, creepages: CreepageField, bound: TractionBound, cells: int
) -> tuple[Floats, NDArray[np.complex128], NDArray[np.bool_]]:
    """Position x, force and slip of all cells (cells, n), from the leading edge backwards.

    The slip is true or false. Forces are complex: the real component is along the rolling direction, and the imaginary
    component across.
    """
    L = calculate_flexibilities(piece.contact)
    (xi, spin), eta = creepages.across(piece.y_mm), creepages.eta
    force = piece.force_N_per_mm * piece.width_mm
    # Over a plane the mean is the creepage at the centre.
    xi_mean = float(xi @ force) / float(force.sum())
    step = 2.0 * piece.half_length_mm / cells
    # Middles of the cells from the leading edge, divided by the half length.
    relative_positions = np.asarray(1.0 - (np.arange(cells) + 0.5) * (2.0 / cells))
    x = piece.middle_x_mm + relative_positions[:, None] * piece.half_length_mm
    limit = piece.contact.friction * _pressure_bound(piece, relative_positions, bound)
    # Spin is evaluated in the middle of each step.
    step_middles = x - piece.centre_x_mm + 0.5 * step
    length = np.broadcast_to(step, x.shape).copy()
    step_middles[0] -= 0.25 * step
    length[0] *= 0.5
    lateral = eta + spin * piece.centre_x_mm
    slope = (xi_mean / L.L1 + (xi - xi_mean) / L.L3) + 1j * (lateral / L.L2 + spin / L.L3 * step_middles)
    drive = length * slope
    traction, trial_size = np.empty_like(drive), np.empty_like(x)
    current_traction = np.zeros(piece.y_mm.size, dtype=complex)
    for cell in range(cells):
        current_traction = current_traction - drive[cell]
        np.abs(current_traction, out=trial_size[cell])
        current_traction *= limit[cell] / np.maximum(trial_size[cell], limit[cell])
        traction[cell] = current_traction
    return x, np.asarray(step * piece.width_mm * traction, dtype=complex), trial_size > limit


def _pressure_bound(piece: RollingStrips, relative_positions: Floats, bound: TractionBound) -> Floats:
    """Bound of the pressure (cells, n) in MPa.

    The sum of the bound over the cells is the load of the patch.
    """
    parabola, force = 1.0 - relative_positions**2, piece.force_N_per_mm
    shape_along = np.sqrt(parabola) if bound == "elliptic" else parabola
    # Over an ellipse the force of a strip is in proportion to its squared length, so that `parabolic` is the
    # paraboloid.
    shape = shape_along[:, None] * (force if bound == "parabolic" else force / piece.half_length_mm)
    cell_areas = (2.0 / relative_positions.size) * piece.half_length_mm * piece.width_mm
    return np.asarray(shape * (piece.contact.normal_force_N / float((shape * cell_areas).sum())))


# --- Any pressure field in strips along the rolling direction, and its ellipse for the flexibilities.

PRESSURE_STRIPS = 80
"""Number of strips over a pressure field."""


def divide_pressure(
    x_mm: Floats, y_mm: Floats, pressure_MPa: Floats, pair: RollingPair, *, strips: int = PRESSURE_STRIPS
) -> tuple[RollingStrips, ...]:
    """Divide a pressure on a uniform grid into strips, for each separate patch.

    The ellipse of a patch has the second moments of its pressure, sqrt(5 <x^2>) and sqrt(5 <y^2>) about its centre,
    scaled to the true area. For a Hertz pressure it is Hertz's ellipse. A strip reaches over sqrt(4 <x^2>) to each side
    of its middle. Lobes of a patch share an ellipse: an ellipse for each lobe agrees less with the rolling half-space.

    Parameters
    ----------
    x_mm, y_mm : ndarrays of shapes (nx,), (ny,)
        Nodes along the rolling direction and across.
    pressure_MPa : ndarray of shape (nx, ny)
        Pressure at the nodes.
    pair
        Friction and elastic constants.
    strips
        Target number of strips. Neighbouring nodes across are combined until there are fewer than twice this number.

    Returns
    -------
    tuple of RollingStrips
        A patch in strips with its ellipse, for each separate patch.

    Notes
    -----
    Source: Kik and Piotrowski (1996), who integrate over the true patch in strips. Range of validity: each strip has a
    single interval in contact, as on prismatic rails.
    """
    width = float(y_mm[1] - y_mm[0])
    nodes_per_strip = max(1, y_mm.size // strips)
    padded_count = y_mm.size + -y_mm.size % nodes_per_strip
    strip_pressure = (
        np.pad(pressure_MPa, ((0, 0), (0, padded_count - y_mm.size)))
        .reshape(x_mm.size, -1, nodes_per_strip)
        .mean(axis=2)
    )
    middles = y_mm[0] + width * (
        nodes_per_strip * np.arange(padded_count // nodes_per_strip) + 0.5 * (nodes_per_strip - 1)
    )
    # A strip with a single node has no length.
    is_in_contact = np.count_nonzero(strip_pressure > 0.0, axis=0) > 1
    starts = np.flatnonzero(is_in_contact & ~np.append(False, is_in_contact[:-1]))
    ends = np.flatnonzero(is_in_contact & ~np.append(is_in_contact[1:], False)) + 1
    column_slices = [slice(int(low), int(high)) for low, high in zip(starts, ends, strict=True)]
    return tuple(
        _build_strips(x_mm, middles[columns], strip_pressure[:, columns], nodes_per_strip * width, pair)
        for columns in column_slices
    )


def _build_strips(x: Floats, y: Floats, p: Floats, width: float, pair: RollingPair) -> RollingStrips:
    """Strips of a patch from its pressure (nx, n) in MPa.

    The half length of a strip is from the second moment of its pressure, as for an elliptical distribution.

    Parameters
    ----------
    x, y
        Uniform positions along (nx,) and across (n,), in mm.
    p
        Pressure, positive in each column.
    width
        Width of each strip in mm.
    pair
        Friction and elastic constants of the pair.
    """
    column_sums = p.sum(axis=0)
    middle_x = x @ p / column_sums
    return RollingStrips.of(
        pair,
        y_mm=y,
        width_mm=np.full(y.size, width),
        middle_x_mm=middle_x,
        half_length_mm=2.0 * np.sqrt(np.maximum(x**2 @ p / column_sums - middle_x**2, 0.0)),
        force_N_per_mm=float(x[1] - x[0]) * column_sums,
    )


def average_creepages(pieces: Sequence[RollingStrips], creepages: CreepageField) -> Creepages:
    """Creepages at the centre of all patches together.

    Over curved surfaces they are the mean weighted by the load.

    Parameters
    ----------
    pieces
        Separate patches in strips.
    creepages
        Creepages at the origin of the coordinates, or over surfaces that are curved across.

    Returns
    -------
    Creepages
        Creepages at the centre of the load.
    """
    piece_arrays = ((piece.force_N_per_mm * piece.width_mm, piece.middle_x_mm, piece.y_mm) for piece in pieces)
    force, middle, y = (np.concatenate(arrays) for arrays in zip(*piece_arrays, strict=True))
    return creepages.mean(middle, y, force / force.sum())


def fit_common_ellipse(pieces: Sequence[RollingStrips]) -> tuple[RollingEllipse, float, float]:
    """Ellipse of all patches together, from their second moments.

    Parameters
    ----------
    pieces
        Separate patches in strips.

    Returns
    -------
    contact, centre_x_mm, centre_y_mm
        Ellipse scaled to the area of the patches, and its centre.
    """
    names = ("y_mm", "width_mm", "middle_x_mm", "half_length_mm", "force_N_per_mm")
    strip_arrays = {name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in names}
    return _fit_ellipse(pieces[0].contact, **strip_arrays)


def _fit_ellipse(
    pair: RollingPair,
    *,
    y_mm: Floats,
    width_mm: Floats,
    middle_x_mm: Floats,
    half_length_mm: Floats,
    force_N_per_mm: Floats,
) -> tuple[RollingEllipse, float, float]:
    """Ellipse with the second moments of strips, and its centre (mm).

    The ellipse is scaled to the area of the strips.
    """
    force = force_N_per_mm * width_mm
    share = force / force.sum()
    centre_x, centre_y = float(middle_x_mm @ share), float(y_mm @ share)
    a = math.sqrt(5.0 * float((half_length_mm**2 / 4.0 + (middle_x_mm - centre_x) ** 2) @ share))
    # The width of a strip adds to the second moment across.
    b = math.sqrt(5.0 * float(((y_mm - centre_y) ** 2 + width_mm**2 / 12.0) @ share))
    scale = math.sqrt(2.0 * float(half_length_mm @ width_mm) / (math.pi * a * b))
    contact = RollingEllipse.of(pair, a_mm=scale * a, b_mm=scale * b, normal_force_N=float(force.sum()))
    return contact, centre_x, centre_y
