"""Steady rolling without slip on an ellipse, by polynomials: a reference that shares nothing with the cells.

Tractions are a polynomial in x/a and y/b over sqrt(1 - x^2/a^2 - y^2/b^2), which cause displacements that are a
polynomial of the same degree (Galin 1953; Kalker 1967, 1990). Without slip they grow along x as the creepages say, up
to a function of y alone; that is found from the tractions being zero on the leading edge, by least squares.

Semi-axis along x and shear modulus are 1. With degree 12 the coefficients are within 1e-4 of those of degree 20 for
a/b from 0.3 to 1 / 0.3, c33 within 3e-4.
"""

import math

import numpy as np
from numpy.polynomial import chebyshev

DEGREE = 12


def no_slip_coefficients(a_over_b: float, poisson: float, degree: int = DEGREE) -> dict[str, float]:
    """Kalker's coefficients; c23 and c32 are equal by reciprocity, here from two solutions."""
    b = 1.0 / a_over_b
    motions = {
        "xi": lambda x, y: (x, 0.0 * x),
        "eta": lambda x, y: (0.0 * x, x),
        "spin": lambda x, y: (-x * y, 0.5 * x**2),
    }
    forces = no_slip_forces(a_over_b, poisson, motions, degree)
    root = math.sqrt(b)
    return {
        "c11": -forces["xi"][0] / b,
        "c22": -forces["eta"][1] / b,
        "c23": -forces["spin"][1] / (b * root),
        "c32": forces["eta"][2] / (b * root),
        "c33": -forces["spin"][2] / b**2,
    }


def no_slip_forces(a_over_b, poisson, motions, degree=DEGREE):
    """Fx, Fy and Mz of each motion.

    A motion is a displacement (u, v) of (x, y); its derivative along x is the rigid slip.
    """
    b = 1.0 / a_over_b
    # about the square root of as many points each way as polynomials have
    places = np.sqrt((np.arange(degree // 2 + 2) + 0.5) / (degree // 2 + 2))
    turns = 2.0 * np.pi * np.arange(2 * degree + 3) / (2 * degree + 3)
    x, y = (np.outer(places, turn).ravel() for turn in (np.cos(turns), np.sin(turns)))
    fit = np.linalg.pinv(_polynomials(degree, x, y))
    slips = fit @ _displacements(degree, x, y, b, poisson, math.ceil(60 * max(b, 1.0 / b)))
    along = [number for number, (power, _) in enumerate(_powers(degree)) if power > 0]
    # both components of the displacement in those polynomials that are not of y alone
    slopes = np.block([[slips[0], slips[2]], [slips[2], slips[1]]])[along + [len(fit) + number for number in along]]
    edge = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 8 * degree)
    leading = _polynomials(degree, np.cos(edge), np.sin(edge))
    leading = np.block([[leading, 0.0 * leading], [0.0 * leading, leading]])
    # slopes @ c = rhs leaves as many unknown as there are polynomials of y alone
    rows = len(slopes)
    orthogonal, triangle = np.linalg.qr(slopes.T, mode="complete")
    forces = _forces(degree, b)
    found = {}
    for name, displacement in motions.items():
        u, v = displacement(x, b * y)
        rhs = np.concatenate([(fit @ u)[along], (fit @ v)[along]])
        c = orthogonal[:, :rows] @ np.linalg.solve(triangle[:rows].T, rhs)
        free = orthogonal[:, rows:]
        found[name] = forces @ (c - free @ np.linalg.lstsq(leading @ free, leading @ c, rcond=None)[0])
    return found


def _powers(degree):
    return [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]


def _polynomials(degree, x, y):
    """Products of Chebyshev polynomials (..., n) up to a degree in both together."""
    along, across = chebyshev.chebvander(x, degree), chebyshev.chebvander(y, degree)
    return np.stack([along[..., i] * across[..., j] for i, j in _powers(degree)], axis=-1)


def _displacements(degree, x, y, b, poisson, angles):
    """Displacements of the first body against the second under the tractions on it.

    They are xx, yy and xy, of shape (3, points, n). In polar coordinates about the point 1/r goes, and along each chord
    Gauss and Chebyshev's rule is exact.
    """
    count = degree // 2 + 1
    nodes = np.cos((2 * np.arange(count) + 1) * np.pi / (2 * count))
    displacements = np.zeros((3, x.size, len(_powers(degree))))
    for angle in np.pi * (np.arange(angles) + 0.5) / angles:
        cos, sin = math.cos(angle), math.sin(angle)
        step = (cos, sin / b)
        squared = step[0] ** 2 + step[1] ** 2
        middle = -(x * step[0] + y * step[1]) / squared
        half = np.sqrt(middle**2 + (1.0 - x**2 - y**2) / squared)
        r = middle[:, None] + half[:, None] * nodes
        chord = _polynomials(degree, x[:, None] + r * step[0], y[:, None] + r * step[1]).sum(axis=1)
        chord *= np.pi / count / math.sqrt(squared)
        kernels = (1.0 - poisson * sin**2, 1.0 - poisson * cos**2, poisson * sin * cos)
        displacements += np.array(kernels)[:, None, None] * (np.pi / angles) * chord
    return displacements / math.pi


def _forces(degree, b):
    """Fx, Fy and Mz (3, 2 n) of each polynomial of both components."""
    nodes, weights = np.polynomial.legendre.leggauss(degree + 4)
    tilt, weights = 0.25 * np.pi * (nodes + 1.0), 0.25 * np.pi * weights
    turns = np.pi * np.arange(2 * degree + 8) / (degree + 4)
    x, y = (np.outer(np.sin(tilt), turn).ravel() for turn in (np.cos(turns), np.sin(turns)))
    # on the half-sphere x = sin(tilt) cos(turn) the root is cos(tilt) and goes
    area = b * np.repeat(weights * np.sin(tilt), turns.size) * (np.pi / (degree + 4))
    tractions = _polynomials(degree, x, y) * area[:, None]
    force, zeros = tractions.sum(axis=0), np.zeros(tractions.shape[1])
    return np.array(
        [np.append(force, zeros), np.append(zeros, force), np.append(-b * (y @ tractions), x @ tractions)],
    )
