"""Elastic half-space: opening of two flat bodies under a pressure, and their contact for any gap even across."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, fft, idct, ifft, irfft, next_fast_len, rfft
from scipy.linalg import block_diag

from fecontact.arrays import Complexes, Floats
from fecontact.contact.grid import ContactGrid, Field
from fecontact.contact.solver import Compliance, ContactProblem, ContactSolution, solve_contact
from fecontact.errors import ConvergenceError, InputError

# What one band does to another one is exact but for this part of it.
_PARTS_OF_BETWEEN = 1e8


def half_space_problem(
    grid: ContactGrid,
    gap_mm: Floats,
    *,
    contact_modulus_MPa: float,
    closing: Floats | None = None,
    angle_rad: Floats | None = None,
) -> ContactProblem:
    """Contact problem of a gap on a pair of half-spaces.

    Parameters
    ----------
    gap_mm (n,)
        Undeformed gap at the grid's nodes.
    closing (n,)
        How much the gap closes when the bodies approach by 1; 1 everywhere if not given.
    angle_rad (ns,)
        Angles of the normals along which pressures act, as in `along_normals`; all in one plane if not given.
    """
    return ContactProblem(
        compliance=half_space_below(grid, contact_modulus_MPa, angle_rad),
        gap_mm=gap_mm,
        closing=np.ones(gap_mm.size) if closing is None else closing,
        area_mm2=grid.whole_area_mm2(),
        stiffness=stiffness_below(grid, contact_modulus_MPa),
    )


def half_space_below(grid: ContactGrid, contact_modulus_MPa: float, angle_rad: Floats | None = None) -> Compliance:
    """Compliance of a pair of half-spaces on the nodes of a uniform grid.

    Each node carries its pressure on a rectangle of one step by one step around it (Love 1929; Johnson 1985, eq. 3.25);
    convolution by FFT with zero padding, exact for these rectangles. In a half model row 0 lies on the plane of
    symmetry x = 0 and the mirrored pressure acts as well.

    On a grid of several bands each one is convolved by itself, and acts on the others as `_between` has it. Pressures
    may act along normals of these angles (ns,), see `along_normals`.

    Range of validity: flat surfaces; on a curved surface arc lengths are taken for distances.
    """
    if angle_rad is not None and np.ptp(angle_rad) > 0.0:
        return along_normals(half_space_below(grid, contact_modulus_MPa), np.tile(angle_rad, grid.shape[0]))
    if len(grid.bands) > 1:
        return _in_bands(grid, contact_modulus_MPa)
    (nodes_x, nodes_s), (step_x, step_s) = grid.shape, grid.steps_mm
    rows = 2 * nodes_x - 1 if grid.half else nodes_x
    kernel = love_influence(
        np.asarray(np.arange(rows)[:, None] * step_x),
        np.asarray(np.arange(1 - nodes_s, nodes_s)[None, :] * step_s),
        step_x,
        step_s,
    ) / (np.pi * contact_modulus_MPa)
    return convolution(kernel, grid.shape, half=grid.half)


def stiffness_below(grid: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Pressures that open a pair of half-spaces by a displacement of the nodes, about: each band by itself.

    A wave of length 2 pi / k opens by 2 / (k E*) of its pressure (Johnson 1985, sec. 13.2). Waves go on beyond the ends
    of the grid, and the mean is taken for half of the longest wave.
    """
    ends = np.cumsum([band.s_mm.size for band in grid.bands])[:-1]
    below = [_of_waves(band, contact_modulus_MPa) for band in grid.bands]

    def apply(opening: Floats) -> Floats:
        parts = zip(np.split(opening.reshape(grid.shape), ends, axis=1), below, strict=True)
        return np.hstack([pressing(part.ravel()).reshape(part.shape) for part, pressing in parts]).ravel()

    return apply


def _of_waves(band: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    (nodes_x, nodes_s), (step_x, step_s), half = band.shape, band.steps_mm, band.half
    length_s = next_fast_len(nodes_s + 1, real=True)
    length_x = next_fast_len(nodes_x, real=True) + 1 if half else next_fast_len(nodes_x + 1)
    along_x = np.arange(length_x) / (2 * length_x - 2) if half else np.fft.fftfreq(length_x)
    k = 2.0 * np.pi * np.hypot(along_x[:, None] / step_x, np.fft.rfftfreq(length_s, step_s))
    k[0, 0] = 0.5 * min(k[0, 1], k[1, 0])
    return _Waves((nodes_x, nodes_s), (length_x, length_s), half).times(0.5 * contact_modulus_MPa * k)


def _in_bands(grid: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Compliance of a pair of half-spaces on the nodes of several bands."""
    ends = np.cumsum([band.s_mm.size for band in grid.bands])[:-1]
    within = [half_space_below(band, contact_modulus_MPa) for band in grid.bands]
    between = _between(grid, contact_modulus_MPa)

    def apply(pressure: Floats) -> Floats:
        own = pressure.reshape(grid.shape)
        parts = zip(np.split(own, ends, axis=1), within, strict=True)
        opening = np.hstack([compliance(part.ravel()).reshape(part.shape) for part, compliance in parts])
        return np.asarray((opening + between(own)).ravel())

    return apply


def _between(grid: ContactGrid, contact_modulus_MPa: float) -> Callable[[Floats], Floats]:
    """Opening (nx, ns) that the pressures (nx, ns) of all other bands cause in each band.

    Across, what one band does to another one is smooth: a polynomial through a few places of each carries it (Chebyshev
    points; Trefethen 2013, ch. 8), along x it is a convolution. A force is spread over the cell of the pressing node,
    and then over the cell of the answering node: the mean of both is symmetric, as a compliance must be, and Love's
    rectangle if cells are equal.
    """
    nodes_x, step_x = grid.shape[0], grid.steps_mm[0]
    rows = 2 * nodes_x - 1 if grid.half else nodes_x
    places = [_places(band, grid) for band in grid.bands]
    at_node, over_cell = (
        block_diag(*(_polynomials(own, band, spread) for own, band in zip(places, grid.bands, strict=True)))
        for spread in (0.0, 1.0)
    )
    all_places, owner = np.concatenate(places), np.repeat(np.arange(len(places)), [own.size for own in places])
    others = owner[:, None] != owner
    away = np.where(others, np.abs(all_places[:, None] - all_places), 1.0)
    x = step_x * np.arange(rows)[:, None, None]
    kernel = np.arcsinh((x + 0.5 * step_x) / away) - np.arcsinh((x - 0.5 * step_x) / away)
    kernel *= others / (np.pi * contact_modulus_MPa)
    size = next_fast_len(2 * rows - 1, real=True)
    around = np.zeros((size, *away.shape))
    around[:rows], around[size - rows + 1 :] = kernel, kernel[:0:-1]
    # the spectrum is real, since opposite sides are equal
    spectrum = rfft(around, axis=0).real

    def apply(pressure: Floats) -> Floats:
        force = pressure * grid.cells_mm
        if grid.half:
            force = np.concatenate([force[:0:-1], force])
        waves = rfft(np.stack([force @ over_cell.T, force @ at_node.T], axis=-1), size, axis=0)
        answer = np.matmul(spectrum, np.concatenate([waves.real, waves.imag], axis=-1))
        opening = irfft(answer[..., :2] + 1j * answer[..., 2:], size, axis=0)[rows - nodes_x : rows]
        return np.asarray(0.5 * (opening[..., 0] @ at_node + opening[..., 1] @ over_cell))

    return apply


def _places(band: ContactGrid, grid: ContactGrid) -> Floats:
    """Places across of a band by which others act on it: more of them the nearer the next band is for its width."""
    low, high = float(band.s_mm[0]), float(band.s_mm[-1])
    half = 0.5 * (high - low + band.steps_mm[1])
    beyond = grid.s_mm[(grid.s_mm < low) | (grid.s_mm > high)]
    away = float(np.abs(beyond - 0.5 * (low + high)).min()) / half
    count = math.ceil(math.log(_PARTS_OF_BETWEEN) / math.log(away + math.sqrt(away**2 - 1.0))) + 1
    return np.asarray(0.5 * (low + high) + half * np.cos(np.pi * (np.arange(count) + 0.5) / count))


def _polynomials(places: Floats, band: ContactGrid, spread: float) -> Floats:
    """Polynomials (m, n), each 1 at one of m places and 0 at the others, in the mean over a part of a node's cell."""
    low, high = places[-1], places[0]
    points, weights = np.polynomial.legendre.leggauss(3)
    s = band.s_mm[:, None] + 0.5 * spread * band.steps_mm[1] * points

    def terms(of: Floats) -> Floats:
        return np.polynomial.chebyshev.chebvander((2.0 * of - low - high) / (high - low), places.size - 1)

    mean = 0.5 * np.einsum("ngk,g->nk", terms(s), weights)
    return np.asarray(np.linalg.solve(terms(places).T, mean.T))


def along_normals(flat: Compliance, angle_rad: Floats) -> Compliance:
    """Compliance of a half-space below pressures (n,) along normals at these angles (n,), in a plane across.

    A pressure along a normal opens two bodies of one material along this normal alone, since their tangential
    displacements are equal (Johnson 1985, sec. 3.2). Along another normal the opening is smaller by the cosine of the
    angle between both. This cosine is a sum of two products, so that the flat compliance is applied once for each. The
    result is symmetric and positive definite if the flat compliance is, and equal to it if all angles are equal. For a
    circle inside another of equal radius it is exact up to a constant term, with chords for distances.

    Range of validity: distances are arc lengths, longer than chords by 1/24 of the square of the angle; the cosine is
    smaller by 1/2 of this square. For unlike materials Dundurs' second constant times the sine is left out.
    """
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)

    def apply(pressure: Floats) -> Floats:
        return np.asarray(cosine * flat(cosine * pressure) + sine * flat(sine * pressure))

    return apply


def convolution(kernel: Floats, shape: tuple[int, int], *, half: bool, least_spectrum: float = -np.inf) -> Compliance:
    """Compliance of nodes of this shape (nodes_x, nodes_s), flattened in this order, that is the same at every node.

    Parameters
    ----------
    kernel (rows, 2 nodes_s - 1)
        Response at x offsets 0 to rows - 1 and s offsets 1 - nodes_s to nodes_s - 1 steps from a node of unit pressure;
        equal at the opposite offset. rows is nodes_x, or 2 nodes_x - 1 in a half model, whose response is even in x.
    least_spectrum
        Lower bound of the kernel's spectrum, relative to the largest value; above 0: positive definite.
    """
    rows, nodes_s = kernel.shape[0], shape[1]
    length_s = next_fast_len(2 * nodes_s - 1, real=True)
    # a half model is even in x and needs cosines alone: a quarter of the time
    length_x = next_fast_len(rows - 1, real=True) + 1 if half else next_fast_len(2 * rows - 1)

    waves = _Waves(shape, (length_x, length_s), half)
    wrapped = np.zeros((length_x, length_s))
    wrapped[:rows, :nodes_s] = kernel[:, nodes_s - 1 :]
    wrapped[:rows, 1 - nodes_s :] = kernel[:, : nodes_s - 1]
    if not half:
        # the opposite side: both offsets change sign
        wrapped[1 - rows :, :nodes_s] = kernel[:0:-1, nodes_s - 1 :: -1]
        wrapped[1 - rows :, 1 - nodes_s :] = kernel[:0:-1, : nodes_s - 1 : -1]
    # the spectrum is real, since opposite sides are equal
    spectrum = waves.forward(wrapped).real
    return waves.times(np.maximum(spectrum, least_spectrum * spectrum.max()))


@dataclass(frozen=True)
class _Waves:
    """Waves of these lengths, in steps, on nodes of a shape: of cosines along x in a half model."""

    shape: tuple[int, int]
    lengths: tuple[int, int]
    half: bool

    def forward(self, of_nodes: Floats) -> Complexes:
        """Spectrum of values (nx, ns), continued by zeros."""
        along_x = dct(of_nodes, 1, self.lengths[0], axis=0) if self.half else of_nodes
        spectrum = rfft(along_x, self.lengths[1])
        return np.asarray(spectrum if self.half else fft(spectrum, self.lengths[0], axis=0))

    def _back(self, spectrum: Complexes) -> Floats:
        nodes_x, nodes_s = self.shape
        along_x = spectrum if self.half else ifft(spectrum, axis=0)[:nodes_x]
        of_nodes = irfft(along_x, self.lengths[1])[:, :nodes_s]
        return np.asarray(idct(of_nodes, 1, axis=0)[:nodes_x] if self.half else of_nodes)

    def times(self, factors: Floats) -> Compliance:
        """Function that multiplies the spectrum of nodal values (n,) by factors."""

        def apply(of_nodes: Floats) -> Floats:
            return np.ascontiguousarray(self._back(self.forward(of_nodes.reshape(self.shape)) * factors)).ravel()

        return apply


def love_influence(x: Floats, y: Floats, step_x: float, step_y: float | Floats) -> Floats:
    """Love's integral of 1/r over a rectangle step_x by step_y around the origin, seen from (x, y) (mm).

    The surface displacement under a pressure p is p / (pi E*) times this.
    """
    x1, x2 = x + 0.5 * step_x, x - 0.5 * step_x
    y1, y2 = y + 0.5 * step_y, y - 0.5 * step_y

    def term(u: Floats, v: Floats, w: Floats) -> Floats:
        # u * ln((v + r(u, v)) / (w + r(u, w))), with asinh for accuracy where v, w < 0
        size = np.maximum(np.abs(u), 1e-300)  # on the line of an edge the limit is zero
        return np.asarray(u * (np.arcsinh(v / size) - np.arcsinh(w / size)))

    return np.asarray(term(x1, y1, y2) - term(x2, y1, y2) + term(y1, x1, x2) - term(y2, x1, x2))


# --- Contact on a half-space for any gap even across, on nodes that follow the patch; no profiles, no placement.

Gap = Callable[[Floats, Floats], Floats]
NODES = 16
"""Nodes on the half length and the half width of the narrowest piece of a patch."""
# Relative to the approach: this error changes approach and pressure by less than the discretisation does.
_TOLERANCE = 1e-5
_COARSE = (49, 13)
# Part of the longest piece: the spacing of nodes does not follow pieces shorter than this.
_FINEST = 0.2
_MOST_NODES = 60_000
_ENLARGED = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class OnGap:
    """A solved contact on a half-space.

    Attributes
    ----------
    pressure
        Pressure in MPa over (x, y), on both sides of y = 0.
    approach_mm
        Approach from the position in which the gap is as given.
    residual
        Contact residual plus penetration residual, relative to the approach.
    """

    pressure: Field
    approach_mm: float
    residual: float


def contact_on_gap(
    gap_mm: Gap,
    load_N: float,
    contact_modulus_MPa: float,
    *,
    reach_mm: float,
    far_mm: tuple[float, float],
    nodes: int = NODES,
) -> OnGap:
    """Solve the contact of a gap on a half-space, first on coarse nodes over a large area, then on nodes that fit it.

    Parameters
    ----------
    gap_mm
        Function from x (n, 1) and y (1, m), in mm, y >= 0, to the undeformed gap (n, m), even in y.
    reach_mm
        First guess of the approach beyond the least gap; enlarged until the patch cannot reach further.
    far_mm
        Half length and half width of a box in which the contact lies.

    Raises
    ------
    InputError
        If the patch reaches the end of the box.
    ConvergenceError
        If the contact is not found.
    """
    x = np.linspace(-far_mm[0], far_mm[0], 801)
    y = np.linspace(0.0, far_mm[1], 41)
    wide = gap_mm(x[:, None], y[None, :])
    least = float(wide.min())
    for _ in range(12):
        solution, grid = _solve(gap_mm, _box(x, y, wide - least <= reach_mm), load_N, contact_modulus_MPa)
        if solution.approach_mm - least < reach_mm:
            break
        reach_mm = _ENLARGED * max(reach_mm, solution.approach_mm - least)
    else:
        raise ConvergenceError(f"the patch grows without bound under {load_N:g} N; reduce the load")
    for share in (0.5, 1.0):
        fitted = _fitted(grid, solution, nodes * share)
        solution, grid = _solve(gap_mm, fitted, load_N, contact_modulus_MPa)
    if solution.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[1]} by {grid.shape[0]} nodes did not converge (residual"
            f" {solution.residual:.1e} of the approach); try another load or place"
        )
    whole = Field.of_nodes(grid, solution.pressure_MPa).whole()
    over = ContactGrid(x_mm=grid.s_mm, s_mm=whole.grid.x_mm, half=False)
    return OnGap(
        pressure=Field(grid=over, values=np.ascontiguousarray(whole.values.T)),
        approach_mm=solution.approach_mm,
        residual=solution.residual,
    )


def _solve(gap_mm: Gap, grid: ContactGrid, load_N: float, modulus: float) -> tuple[ContactSolution, ContactGrid]:
    """Contact on a grid whose first direction is y: its plane of symmetry is y = 0."""
    gap = np.ascontiguousarray(gap_mm(grid.s_mm[:, None], grid.x_mm[None, :]).T)
    problem = half_space_problem(grid, gap.ravel(), contact_modulus_MPa=modulus)
    return solve_contact(problem, load_N, tolerance=_TOLERANCE), grid


def _box(x: Floats, y: Floats, near: NDArray[np.bool_]) -> ContactGrid:
    """Coarse nodes over all places that are near."""
    along, across = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    if along[0] == 0 or along[-1] == x.size - 1 or across[-1] == y.size - 1:
        raise InputError(
            f"the contact reaches further than {x[-1]:g} by {y[-1]:g} mm from its middle; reduce the load, or the"
            " depth of the irregularity"
        )
    low, high, wide = x[along[0] - 1], x[along[-1] + 1], y[across[-1] + 1]
    return _grid(float(low), float(high), float(wide), (high - low) / _COARSE[0], wide / _COARSE[1])


def _fitted(grid: ContactGrid, solution: ContactSolution, nodes: float) -> ContactGrid:
    inside = solution.in_contact.reshape(grid.shape)
    (step_y, step_x), columns = grid.steps_mm, np.flatnonzero(inside.any(axis=0))
    pieces = np.split(columns, np.flatnonzero(np.diff(columns) > 1) + 1)
    lengths = [piece.size * step_x for piece in pieces]
    wide = (np.flatnonzero(inside.any(axis=1))[-1] + 0.5) * step_y
    shortest = max(min(lengths), _FINEST * max(lengths))
    low, high = (float(grid.s_mm[columns[end]]) + side * 0.5 * step_x for end, side in ((0, -1.0), (-1, 1.0)))
    return _grid(low, high, float(wide), 0.5 * shortest / nodes, wide / nodes)


def _grid(low: float, high: float, wide: float, step_x: float, step_y: float) -> ContactGrid:
    """Nodes along x from low to high and across up to `wide`, with two more at each end."""
    count_x, count_y = int(np.ceil((high - low) / step_x)) + 5, int(np.ceil(wide / step_y)) + 3
    if count_x * count_y > _MOST_NODES:
        raise ConvergenceError(
            f"the contact would need {count_x} by {count_y} nodes, and at most {_MOST_NODES} are solved: its shortest"
            " piece is too short relative to the whole; try another place along the irregularity"
        )
    middle = 0.5 * (low + high)
    x = middle + step_x * (np.arange(count_x) - 0.5 * (count_x - 1))
    return ContactGrid(x_mm=np.asarray(step_y * np.arange(count_y)), s_mm=np.asarray(x), half=True)
