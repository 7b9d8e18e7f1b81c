"""Elastic half-space: opening of two flat bodies under a pressure on a uniform grid of nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, fft, idct, ifft, irfft, next_fast_len, rfft

from fecontact.contact.grid import ContactGrid
from fecontact.contact.solver import Compliance, ContactProblem

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def half_space_problem(
    grid: ContactGrid, gap_mm: Floats, *, contact_modulus_MPa: float, closing: Floats | None = None
) -> ContactProblem:
    """Contact of a gap on a pair of half-spaces.

    Parameters
    ----------
    gap_mm (n,)
        Undeformed gap at the grid's nodes.
    closing (n,)
        How much it closes when the bodies approach by 1; 1 everywhere if not given.
    """
    return ContactProblem(
        compliance=half_space_below(grid, contact_modulus_MPa),
        gap_mm=gap_mm,
        closing=np.ones(gap_mm.size) if closing is None else closing,
        area_mm2=grid.whole_area_mm2(),
    )


def half_space_below(grid: ContactGrid, contact_modulus_MPa: float) -> Compliance:
    """Compliance of a pair of half-spaces on the nodes of a uniform grid.

    Each node carries its pressure on a rectangle of one step by one step around it (Love 1929; Johnson 1985, eq. 3.25);
    convolution by FFT with zero padding, exact for these rectangles. In a half model row 0 lies on the plane of
    symmetry x = 0 and the mirrored pressure acts as well.

    Range of validity: flat surfaces; over a curved surface it takes arc lengths for distances.
    """
    (nodes_x, nodes_s), (step_x, step_s) = grid.shape, grid.steps_mm
    rows = 2 * nodes_x - 1 if grid.half else nodes_x
    kernel = love_influence(
        np.asarray(np.arange(rows)[:, None] * step_x),
        np.asarray(np.arange(1 - nodes_s, nodes_s)[None, :] * step_s),
        step_x,
        step_s,
    ) / (np.pi * contact_modulus_MPa)
    return convolution(kernel, grid.shape, half=grid.half)


def along_normals(flat: Compliance, angle_rad: Floats) -> Compliance:
    """Compliance of a half-space below pressures (n,) along normals at these angles (n,), in a plane across.

    A pressure along a normal moves the surfaces of two bodies of one material apart along it alone, for their tangents
    move alike (Johnson 1985, sec. 3.2). What another normal sees of it is the cosine between both: that of flat
    surfaces once for each of two directions. It is symmetric and positive definite where that is, and the same where
    all angles are equal. Circles of one radius in each other answer so but for a term that is the same everywhere,
    with chords for distances.

    Range of validity: distances are those along the surface, longer than chords by a 24th of the square of the angle,
    of which the cosine takes a half. For unlike materials it leaves out Dundurs' second constant times the sine.
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
        the same on the opposite side of it. rows is nodes_x, or 2 nodes_x - 1 in a half model, where it is even in x.
    least_spectrum
        Lower bound of its spectrum, relative to the largest value; above zero the compliance is positive definite.
    """
    nodes_x, nodes_s = shape
    rows = kernel.shape[0]
    length_s = next_fast_len(2 * nodes_s - 1, real=True)
    # cosines alone where all is even in x: a quarter of the time
    length_x = next_fast_len(rows - 1, real=True) + 1 if half else next_fast_len(2 * rows - 1)

    def forward(of_nodes: Floats) -> Complexes:
        along_x = dct(of_nodes, 1, length_x, axis=0) if half else of_nodes
        spectrum = rfft(along_x, length_s)
        return np.asarray(spectrum if half else fft(spectrum, length_x, axis=0))

    def back(spectrum: Complexes) -> Floats:
        along_x = spectrum if half else ifft(spectrum, axis=0)[:nodes_x]
        of_nodes = irfft(along_x, length_s)[:, :nodes_s]
        return np.asarray(idct(of_nodes, 1, axis=0)[:nodes_x] if half else of_nodes)

    wrapped = np.zeros((length_x, length_s))
    wrapped[:rows, :nodes_s] = kernel[:, nodes_s - 1 :]
    wrapped[:rows, 1 - nodes_s :] = kernel[:, : nodes_s - 1]
    if not half:
        # the opposite side: both offsets change sign
        wrapped[1 - rows :, :nodes_s] = kernel[:0:-1, nodes_s - 1 :: -1]
        wrapped[1 - rows :, 1 - nodes_s :] = kernel[:0:-1, : nodes_s - 1 : -1]
    # real, since opposite sides are equal
    spectrum = forward(wrapped).real
    spectrum = np.maximum(spectrum, least_spectrum * spectrum.max())

    def apply(pressure: Floats) -> Floats:
        return np.ascontiguousarray(back(forward(pressure.reshape(nodes_x, nodes_s)) * spectrum)).ravel()

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
