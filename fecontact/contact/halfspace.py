"""Elastic half-space: opening under a pressure, and contact of an even gap.

The opening is the displacement of two flat bodies away from each other. The gap of the contact is arbitrary along the
first axis and even across it.
"""

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

# Inverse of the relative error of the opening of a band under the pressure of a different band.
_INVERSE_INTERPOLATION_ERROR = 1e8


def build_half_space_problem(
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
    grid
        Grid of the pressure nodes.
    gap_mm : ndarray of shape (n,)
        Undeformed gap at the nodes.
    contact_modulus_MPa
        E* of the pair.
    closing : ndarray of shape (n,) or None
        Closing of the gap per approach of the bodies; 1 everywhere by default.
    angle_rad : ndarray of shape (ns,) or None
        Angles of the normals along which pressures act, as in `project_on_normals`; parallel by default.

    Returns
    -------
    ContactProblem
        Problem with the compliance of the half-spaces and an approximate stiffness.
    """
    return ContactProblem(
        compliance=build_half_space_compliance(grid, contact_modulus_MPa, angle_rad),
        gap_mm=gap_mm,
        closing=np.ones(gap_mm.size) if closing is None else closing,
        area_mm2=grid.whole_area_mm2(),
        stiffness=build_half_space_stiffness(grid, contact_modulus_MPa),
    )


def build_half_space_compliance(
    grid: ContactGrid, contact_modulus_MPa: float, angle_rad: Floats | None = None
) -> Compliance:
    """Compliance of a pair of half-spaces on the nodes of a grid.

    Each node has its pressure on a rectangle of one step by one step around it (Love 1929; Johnson 1985, eq. 3.25). The
    compliance is a convolution by FFT with zero padding, which is exact for these rectangles. In a half model row 0
    lies on the plane of symmetry x = 0, and the mirrored pressure acts as well.

    On a grid of several bands, each band has its convolution, and the opening under the pressure of a different band is
    interpolated (`_opening_between_bands`).

    Parameters
    ----------
    grid
        Uniform grid, or grid of several bands.
    contact_modulus_MPa
        E* of the pair.
    angle_rad : ndarray of shape (ns,) or None
        Angles of the normals along which pressures act, as in `project_on_normals`; parallel by default.

    Returns
    -------
    Compliance
        Function from pressures (n,) in MPa to openings (n,) in mm.

    Notes
    -----
    Range of validity: flat surfaces. On a curved surface arc lengths replace distances.

    Examples
    --------
    A square of 1 mm under 1 MPa, at its centre (Love 1929: 4 asinh(1) mm / (pi E*)):

    >>> import numpy as np
    >>> from fecontact.contact.grid import ContactGrid
    >>> from fecontact.contact.halfspace import build_half_space_compliance
    >>> grid = ContactGrid(x_mm=np.arange(3.0), s_mm=np.arange(3.0), half=False)
    >>> pressure = np.zeros((3, 3))
    >>> pressure[1, 1] = 1.0
    >>> opening = build_half_space_compliance(grid, 115e3)(pressure.ravel()).reshape(3, 3)
    >>> bool(np.isclose(opening[1, 1], 4.0 * np.arcsinh(1.0) / (np.pi * 115e3)))
    True
    """
    if angle_rad is not None and np.ptp(angle_rad) > 0.0:
        return project_on_normals(
            build_half_space_compliance(grid, contact_modulus_MPa), np.tile(angle_rad, grid.shape[0])
        )
    if len(grid.bands) > 1:
        return _compliance_on_bands(grid, contact_modulus_MPa)
    (nodes_x, nodes_s), (step_x, step_s) = grid.shape, grid.steps_mm
    rows = 2 * nodes_x - 1 if grid.half else nodes_x
    kernel = love_influence(
        np.asarray(np.arange(rows)[:, None] * step_x),
        np.asarray(np.arange(1 - nodes_s, nodes_s)[None, :] * step_s),
        step_x,
        step_s,
    ) / (np.pi * contact_modulus_MPa)
    return build_convolution(kernel, grid.shape, half=grid.half)


def build_half_space_stiffness(grid: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Approximate inverse of the compliance of half-spaces, for each band alone.

    A wave of length 2 pi / k has an opening of 2 / (k E*) times its pressure (Johnson 1985, sec. 13.2). The waves
    continue beyond the ends of the grid. The mean has the stiffness of half of the longest wave.

    Parameters
    ----------
    grid
        Uniform grid, or grid of several bands.
    contact_modulus_MPa
        E* of the pair.

    Returns
    -------
    Compliance
        Function from openings (n,) in mm to approximate pressures (n,) in MPa.
    """
    ends = np.cumsum([band.s_mm.size for band in grid.bands])[:-1]
    band_stiffnesses = [_wave_stiffness(band, contact_modulus_MPa) for band in grid.bands]

    def apply(opening: Floats) -> Floats:
        """Approximate pressures (n,) in MPa from openings (n,) in mm."""
        band_openings = zip(np.split(opening.reshape(grid.shape), ends, axis=1), band_stiffnesses, strict=True)
        return np.hstack(
            [
                band_stiffness(band_opening.ravel()).reshape(band_opening.shape)
                for band_opening, band_stiffness in band_openings
            ]
        ).ravel()

    return apply


def _wave_stiffness(band: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Approximate stiffness of half-spaces on the nodes of a band.

    It multiplies the spectrum of an opening by 0.5 k E*, with the wave number k in 1/mm.
    """
    (nodes_x, nodes_s), (step_x, step_s), half = band.shape, band.steps_mm, band.half
    length_s = next_fast_len(nodes_s + 1, real=True)
    length_x = next_fast_len(nodes_x, real=True) + 1 if half else next_fast_len(nodes_x + 1)
    along_x = np.arange(length_x) / (2 * length_x - 2) if half else np.fft.fftfreq(length_x)
    wave_number = 2.0 * np.pi * np.hypot(along_x[:, None] / step_x, np.fft.rfftfreq(length_s, step_s))
    wave_number[0, 0] = 0.5 * min(wave_number[0, 1], wave_number[1, 0])
    return _Waves((nodes_x, nodes_s), (length_x, length_s), half).multiply_spectrum(
        0.5 * contact_modulus_MPa * wave_number
    )


def _compliance_on_bands(grid: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Compliance of a pair of half-spaces on the nodes of several bands.

    The result maps pressures (n,) in MPa at all nodes of the grid to openings (n,) in mm. Within a band it uses the
    fast compliance of a uniform grid; between bands it uses `_opening_between_bands`.
    """
    ends = np.cumsum([band.s_mm.size for band in grid.bands])[:-1]
    band_compliances = [build_half_space_compliance(band, contact_modulus_MPa) for band in grid.bands]
    opening_between_bands = _opening_between_bands(grid, contact_modulus_MPa)

    def apply(pressure: Floats) -> Floats:
        nodal_pressure = pressure.reshape(grid.shape)
        bands = zip(np.split(nodal_pressure, ends, axis=1), band_compliances, strict=True)
        opening = np.hstack(
            [compliance(band_pressure.ravel()).reshape(band_pressure.shape) for band_pressure, compliance in bands]
        )
        return np.asarray((opening + opening_between_bands(nodal_pressure)).ravel())

    return apply


def _opening_between_bands(grid: ContactGrid, contact_modulus_MPa: float) -> Callable[[Floats], Floats]:
    """Opening in each band under the pressures of all other bands.

    The returned function maps pressures (nx, ns) in MPa to openings (nx, ns) in mm.

    Across, the opening under the pressure of a different band is smooth. Therefore it is interpolated by a polynomial
    through a few positions of each band (Chebyshev points; Trefethen 2013, ch. 8). Along x it is a convolution. A force
    is spread over the cell of the pressing node, and then over the cell of the responding node. The mean of both is
    symmetric, as every compliance is, and equals Love's rectangle for equal cells.
    """
    nodes_x, step_x = grid.shape[0], grid.steps_mm[0]
    rows = 2 * nodes_x - 1 if grid.half else nodes_x
    points_by_band = [_interpolation_points(band, grid) for band in grid.bands]
    polynomials_at_nodes, polynomials_over_cells = (
        block_diag(
            *(
                _lagrange_polynomials(points, band, cell_fraction)
                for points, band in zip(points_by_band, grid.bands, strict=True)
            )
        )
        for cell_fraction in (0.0, 1.0)
    )
    all_points, point_bands = (
        np.concatenate(points_by_band),
        np.repeat(np.arange(len(points_by_band)), [points.size for points in points_by_band]),
    )
    is_other_band = point_bands[:, None] != point_bands
    distances = np.where(is_other_band, np.abs(all_points[:, None] - all_points), 1.0)
    x = step_x * np.arange(rows)[:, None, None]
    kernel = np.arcsinh((x + 0.5 * step_x) / distances) - np.arcsinh((x - 0.5 * step_x) / distances)
    kernel *= is_other_band / (np.pi * contact_modulus_MPa)
    length = next_fast_len(2 * rows - 1, real=True)
    periodic_kernel = np.zeros((length, *distances.shape))
    periodic_kernel[:rows], periodic_kernel[length - rows + 1 :] = kernel, kernel[:0:-1]
    # The spectrum is real, because opposite offsets have equal influence.
    spectrum = rfft(periodic_kernel, axis=0).real

    def apply(pressure: Floats) -> Floats:
        """Opening (nx, ns) in mm under pressures (nx, ns) in MPa."""
        force = pressure * grid.cells_mm
        if grid.half:
            force = np.concatenate([force[:0:-1], force])
        waves = rfft(
            np.stack([force @ polynomials_over_cells.T, force @ polynomials_at_nodes.T], axis=-1), length, axis=0
        )
        opening_waves = np.matmul(spectrum, np.concatenate([waves.real, waves.imag], axis=-1))
        opening = irfft(opening_waves[..., :2] + 1j * opening_waves[..., 2:], length, axis=0)[rows - nodes_x : rows]
        return np.asarray(0.5 * (opening[..., 0] @ polynomials_at_nodes + opening[..., 1] @ polynomials_over_cells))

    return apply


def _interpolation_points(band: ContactGrid, grid: ContactGrid) -> Floats:
    """Chebyshev points across of a band for its interaction with other bands.

    Their number is larger if the distance to the next band is small relative to the width of the band.
    """
    low, high = float(band.s_mm[0]), float(band.s_mm[-1])
    half_width = 0.5 * (high - low + band.steps_mm[1])
    outside_nodes = grid.s_mm[(grid.s_mm < low) | (grid.s_mm > high)]
    relative_distance = float(np.abs(outside_nodes - 0.5 * (low + high)).min()) / half_width
    count = (
        math.ceil(
            math.log(_INVERSE_INTERPOLATION_ERROR) / math.log(relative_distance + math.sqrt(relative_distance**2 - 1.0))
        )
        + 1
    )
    return np.asarray(0.5 * (low + high) + half_width * np.cos(np.pi * (np.arange(count) + 0.5) / count))


def _lagrange_polynomials(points: Floats, band: ContactGrid, cell_fraction: float) -> Floats:
    """Lagrange polynomials of m points at the n nodes of a band.

    Each polynomial (m, n) is 1 at its point and 0 at all other points. It is averaged over the given fraction of the
    cell of each node.
    """
    low, high = points[-1], points[0]
    gauss_points, gauss_weights = np.polynomial.legendre.leggauss(3)
    positions = band.s_mm[:, None] + 0.5 * cell_fraction * band.steps_mm[1] * gauss_points

    def terms(at: Floats) -> Floats:
        return np.polynomial.chebyshev.chebvander((2.0 * at - low - high) / (high - low), points.size - 1)

    node_means = 0.5 * np.einsum("ngk,g->nk", terms(positions), gauss_weights)
    return np.asarray(np.linalg.solve(terms(points).T, node_means.T))


def project_on_normals(parallel_compliance: Compliance, angle_rad: Floats) -> Compliance:
    """Compliance of a half-space under pressures along normals in a plane across.

    A pressure along a normal opens two bodies of equal material along this normal only, because their tangential
    displacements are equal (Johnson 1985, sec. 3.2). Along a normal in a different direction, the opening is multiplied
    by the cosine of the angle between both normals. This cosine is a sum of two products, so that the flat compliance
    is applied twice. The result is symmetric and positive definite if the flat compliance is, and equal to the flat
    compliance if all angles are equal. For a circle inside a circle of equal radius, it is exact up to a constant term,
    with chords as distances.

    Parameters
    ----------
    parallel_compliance
        Compliance of half-spaces with parallel normals.
    angle_rad : ndarray of shape (n,)
        Angle of the normal at each node.

    Returns
    -------
    Compliance
        Function from pressures (n,) in MPa along the normals to openings (n,) in mm along the normals.

    Notes
    -----
    Range of validity: distances are arc lengths, which are longer than chords by 1/24 of the square of the angle. The
    cosine is smaller than 1 by 1/2 of this square. For different materials, the term with Dundurs' second constant
    times the sine is left out.
    """
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)

    def apply(pressure: Floats) -> Floats:
        return np.asarray(cosine * parallel_compliance(cosine * pressure) + sine * parallel_compliance(sine * pressure))

    return apply


def build_convolution(
    kernel: Floats, shape: tuple[int, int], *, half: bool, least_spectrum: float = -np.inf
) -> Compliance:
    """Compliance with an equal response at every node.

    Parameters
    ----------
    kernel : ndarray of shape (rows, 2 nodes_s - 1)
        Response at x offsets 0 to rows - 1 and s offsets 1 - nodes_s to nodes_s - 1 steps from a node with unit
        pressure. It is equal at the opposite offset. The number of rows is nodes_x, or 2 nodes_x - 1 in a half model.
        The response of a half model is even in x.
    shape
        Numbers of nodes (nodes_x, nodes_s). Nodal values are flattened in this order.
    half
        Whether the nodes are a half model.
    least_spectrum
        Lower bound of the spectrum of the kernel, relative to its largest value. A bound above 0 makes the compliance
        positive definite.

    Returns
    -------
    Compliance
        Function from pressures (nodes_x nodes_s,) to openings, in the units of the kernel.
    """
    rows, nodes_s = kernel.shape[0], shape[1]
    length_s = next_fast_len(2 * nodes_s - 1, real=True)
    # A half model is even in x and needs only cosines, in a quarter of the time.
    length_x = next_fast_len(rows - 1, real=True) + 1 if half else next_fast_len(2 * rows - 1)

    waves = _Waves(shape, (length_x, length_s), half)
    periodic_kernel = np.zeros((length_x, length_s))
    periodic_kernel[:rows, :nodes_s] = kernel[:, nodes_s - 1 :]
    periodic_kernel[:rows, 1 - nodes_s :] = kernel[:, : nodes_s - 1]
    if not half:
        # Both offsets change sign at the opposite side.
        periodic_kernel[1 - rows :, :nodes_s] = kernel[:0:-1, nodes_s - 1 :: -1]
        periodic_kernel[1 - rows :, 1 - nodes_s :] = kernel[:0:-1, : nodes_s - 1 : -1]
    # The spectrum is real, because opposite offsets have equal influence.
    spectrum = waves.forward(periodic_kernel).real
    return waves.multiply_spectrum(np.maximum(spectrum, least_spectrum * spectrum.max()))


@dataclass(frozen=True)
class _Waves:
    """Waves on the nodes of a grid; cosines along x in a half model.

    Attributes
    ----------
    shape
        Numbers of nodes along x and across.
    lengths
        Numbers of steps in the period along x and across.
    half
        Whether the nodes are a half model.
    """

    shape: tuple[int, int]
    lengths: tuple[int, int]
    half: bool

    def forward(self, nodal_values: Floats) -> Complexes:
        """Spectrum of values (nx, ns) with zero padding."""
        values_along_x = dct(nodal_values, 1, self.lengths[0], axis=0) if self.half else nodal_values
        spectrum = rfft(values_along_x, self.lengths[1])
        return np.asarray(spectrum if self.half else fft(spectrum, self.lengths[0], axis=0))

    def _inverse(self, spectrum: Complexes) -> Floats:
        """Values (nx, ns) of a spectrum at the nodes."""
        nodes_x, nodes_s = self.shape
        rows = spectrum if self.half else ifft(spectrum, axis=0)[:nodes_x]
        nodal_values = irfft(rows, self.lengths[1])[:, :nodes_s]
        return np.asarray(idct(nodal_values, 1, axis=0)[:nodes_x] if self.half else nodal_values)

    def multiply_spectrum(self, factors: Floats) -> Compliance:
        """Function that multiplies the spectrum of nodal values (n,) by factors."""

        def apply(nodal_values: Floats) -> Floats:
            return np.ascontiguousarray(self._inverse(self.forward(nodal_values.reshape(self.shape)) * factors)).ravel()

        return apply


def love_influence(x: Floats, y: Floats, step_x: float, step_y: float | Floats) -> Floats:
    """Love's integral of 1/r over a rectangle around the origin.

    The surface displacement under a uniform pressure p on the rectangle is p / (pi E*) times this integral (Love 1929;
    Johnson 1985, eq. 3.25).

    Parameters
    ----------
    x, y
        Coordinates of the points in mm; shapes that broadcast together.
    step_x, step_y
        Side lengths of the rectangle in mm.

    Returns
    -------
    array
        Integral at each point in mm.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.contact.halfspace import love_influence
    >>> centre = float(love_influence(np.array(0.0), np.array(0.0), 1.0, 1.0))
    >>> bool(np.isclose(centre, 4.0 * np.arcsinh(1.0)))
    True
    """
    x1, x2 = x + 0.5 * step_x, x - 0.5 * step_x
    y1, y2 = y + 0.5 * step_y, y - 0.5 * step_y

    def term(u: Floats, v: Floats, w: Floats) -> Floats:
        # u * ln((v + r(u, v)) / (w + r(u, w))). The inverse hyperbolic sine is accurate for negative v and w.
        size = np.maximum(np.abs(u), 1e-300)  # on the line of an edge the limit is zero
        return np.asarray(u * (np.arcsinh(v / size) - np.arcsinh(w / size)))

    return np.asarray(term(x1, y1, y2) - term(x2, y1, y2) + term(y1, x1, x2) - term(y2, x1, x2))


# --- Contact of an even gap on a half-space, on nodes that follow the patch, without profiles and placement.

GapFunction = Callable[[Floats, Floats], Floats]
NODES_PER_HALF_LENGTH = 16
"""Number of nodes on the half length and the half width of the narrowest piece of a patch."""
# Bound of the residuals, relative to the approach. The resulting error of approach and pressure is smaller than the
# discretisation error.
_RESIDUAL_TOLERANCE = 1e-5
_COARSE_NODES = (49, 13)
# Slack of the number of steps over a length. The nodes are centred, so that one more node moves all of them by half a
# step: without the slack, rounding errors changed the approach on a wave by 0.01 %.
_COUNT_SLACK = 1e-6
# Length of the longest piece times this fraction is the least length that the spacing of nodes follows. Shorter pieces
# do not refine the grid.
_MIN_RELATIVE_PIECE_LENGTH = 0.2
_MAX_NODES = 60_000
_REACH_ENLARGEMENT = 1.4


@dataclass(frozen=True, kw_only=True, eq=False)
class GapContact:
    """Solved contact on a half-space.

    Attributes
    ----------
    pressure
        Pressure in MPa over (x, y), on both sides of y = 0.
    approach_mm
        Approach, measured from the position with the given gap.
    residual
        Contact residual plus penetration residual, relative to the approach.
    """

    pressure: Field
    approach_mm: float
    residual: float


def solve_gap_contact(
    gap_mm: GapFunction,
    load_N: float,
    contact_modulus_MPa: float,
    *,
    reach_mm: float,
    far_mm: tuple[float, float],
    nodes: int = NODES_PER_HALF_LENGTH,
) -> GapContact:
    """Solve the contact of an even gap on a half-space.

    The first solution is on coarse nodes over a large area. The following solutions are on nodes that fit the patch.

    Parameters
    ----------
    gap_mm
        Function from x (n, 1) and y (1, m) in mm, y >= 0, to the undeformed gap (n, m) in mm, even in y.
    load_N
        Normal force, > 0.
    contact_modulus_MPa
        E* of the pair.
    reach_mm
        Initial value of the approach minus the least gap. It is enlarged until the patch lies inside the area that it
        covers.
    far_mm
        Half length and half width of a box around the contact.
    nodes
        Number of nodes on the half length and the half width of the narrowest piece.

    Returns
    -------
    GapContact
        Pressure and approach.

    Raises
    ------
    InputError
        If the patch reaches the end of the box.
    ConvergenceError
        If the contact does not converge, or needs too many nodes.

    Examples
    --------
    A sphere of radius 100 mm has Hertz's approach (Johnson 1985, eq. 4.23) within 1 %:

    >>> from fecontact.contact.halfspace import solve_gap_contact
    >>> contact = solve_gap_contact(
    ...     lambda x, y: (x**2 + y**2) / 200.0, 1e3, 115e3, reach_mm=0.02, far_mm=(10.0, 10.0), nodes=8
    ... )
    >>> abs(contact.approach_mm / (9.0 * 1e3**2 / (16.0 * 100.0 * 115e3**2)) ** (1 / 3) - 1.0) < 0.01
    True
    """
    x = np.linspace(-far_mm[0], far_mm[0], 801)
    y = np.linspace(0.0, far_mm[1], 41)
    sampled_gap = gap_mm(x[:, None], y[None, :])
    least_gap = float(sampled_gap.min())
    for _ in range(12):
        solution, grid = _solve_on_grid(
            gap_mm, _build_coarse_grid(x, y, sampled_gap - least_gap <= reach_mm), load_N, contact_modulus_MPa
        )
        if solution.approach_mm - least_gap < reach_mm:
            break
        reach_mm = _REACH_ENLARGEMENT * max(reach_mm, solution.approach_mm - least_gap)
    else:
        raise ConvergenceError(f"the patch grows without bound under {load_N:g} N; reduce the load")
    for node_fraction in (0.5, 1.0):
        fitted_grid = _fit_grid(grid, solution, nodes * node_fraction)
        solution, grid = _solve_on_grid(gap_mm, fitted_grid, load_N, contact_modulus_MPa)
    if solution.status != "converged":
        raise ConvergenceError(
            f"the contact on a half-space of {grid.shape[1]} by {grid.shape[0]} nodes did not converge (residual"
            f" {solution.residual:.1e} of the approach); try a different load or position"
        )
    whole_field = Field.of_nodes(grid, solution.pressure_MPa).whole()
    rail_grid = ContactGrid(x_mm=grid.s_mm, s_mm=whole_field.grid.x_mm, half=False)
    return GapContact(
        pressure=Field(grid=rail_grid, values=np.ascontiguousarray(whole_field.values.T)),
        approach_mm=solution.approach_mm,
        residual=solution.residual,
    )


def _solve_on_grid(
    gap_mm: GapFunction, grid: ContactGrid, load_N: float, modulus: float
) -> tuple[ContactSolution, ContactGrid]:
    """Solve the contact on a grid with the plane of symmetry y = 0.

    The first direction of the grid is y.
    """
    gap = np.ascontiguousarray(gap_mm(grid.s_mm[:, None], grid.x_mm[None, :]).T)
    problem = build_half_space_problem(grid, gap.ravel(), contact_modulus_MPa=modulus)
    return solve_contact(problem, load_N, tolerance=_RESIDUAL_TOLERANCE), grid


def _build_coarse_grid(x: Floats, y: Floats, is_near: NDArray[np.bool_]) -> ContactGrid:
    """Coarse nodes over all positions with a small gap.

    Parameters
    ----------
    x, y : ndarrays of shapes (n,), (m,)
        Positions along and across in mm.
    is_near : ndarray of shape (n, m)
        Whether the gap is small.
    """
    rows, columns = np.flatnonzero(is_near.any(axis=1)), np.flatnonzero(is_near.any(axis=0))
    if rows[0] == 0 or rows[-1] == x.size - 1 or columns[-1] == y.size - 1:
        raise InputError(
            f"the contact patch reaches further than {x[-1]:g} by {y[-1]:g} mm from its middle; reduce the load or"
            " the depth of the irregularity"
        )
    low, high, half_width = x[rows[0] - 1], x[rows[-1] + 1], y[columns[-1] + 1]
    return _build_grid(
        float(low), float(high), float(half_width), (high - low) / _COARSE_NODES[0], half_width / _COARSE_NODES[1]
    )


def _fit_grid(grid: ContactGrid, solution: ContactSolution, nodes: float) -> ContactGrid:
    """Grid that fits the patch of a solution.

    The given number of nodes lies on the half length of the shortest piece, and on the half width of the patch.
    """
    is_in_contact = solution.in_contact.reshape(grid.shape)
    (step_y, step_x), columns = grid.steps_mm, np.flatnonzero(is_in_contact.any(axis=0))
    pieces = np.split(columns, np.flatnonzero(np.diff(columns) > 1) + 1)
    lengths = [piece.size * step_x for piece in pieces]
    half_width = (np.flatnonzero(is_in_contact.any(axis=1))[-1] + 0.5) * step_y
    shortest_length = max(min(lengths), _MIN_RELATIVE_PIECE_LENGTH * max(lengths))
    low, high = (float(grid.s_mm[columns[end]]) + side * 0.5 * step_x for end, side in ((0, -1.0), (-1, 1.0)))
    return _build_grid(low, high, float(half_width), 0.5 * shortest_length / nodes, half_width / nodes)


def _build_grid(low: float, high: float, half_width: float, step_x: float, step_y: float) -> ContactGrid:
    """Nodes along x from low to high, and across up to the half width.

    All lengths are in mm. There are two more nodes at each end. The grid is half across, and its axis `s_mm` is along
    the rail (`step_x`).

    Raises
    ------
    ConvergenceError
        If there are more than `_MAX_NODES` nodes.
    """
    count_x, count_y = (
        math.ceil(length / step - _COUNT_SLACK) + margin_count
        for length, step, margin_count in ((high - low, step_x, 5), (half_width, step_y, 3))
    )
    if count_x * count_y > _MAX_NODES:
        raise ConvergenceError(
            f"the contact needs {count_x} by {count_y} nodes; allowed: at most {_MAX_NODES}; its shortest patch is too"
            " short relative to the whole contact; try a different distance along the irregularity"
        )
    middle = 0.5 * (low + high)
    x = middle + step_x * (np.arange(count_x) - 0.5 * (count_x - 1))
    return ContactGrid(x_mm=np.asarray(step_y * np.arange(count_y)), s_mm=np.asarray(x), half=True)
