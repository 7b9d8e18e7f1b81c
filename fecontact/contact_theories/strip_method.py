"""Strip method: non-elliptic contact of wheel and rail from two conditions on a single line.

The module needs numpy only.

Two half-spaces with the gap f(t) + A x^2 (x along the rail, t across) are pressed together by the approach d. The patch
is divided into strips along x. The strip at t has the half length a(t), q = a^2, and the pressure

    p(x, t) = c(t) sqrt(q(t) - x^2),                                                                              (1)

which is exact for an ellipse (c constant) and for a patch that is long across (c = E* A). On the line x = 0 a strip of
width h at the distance e opens the surfaces by h c J / (pi E*), with u = sqrt(q + e^2) and the complete elliptic
integrals K, E of the parameter m = q / u^2:

    J  = int sqrt(q - x^2) / sqrt(x^2 + e^2) dx = 2 u (K - E),      dJ/dq = K / u.                                (2)

The curvature of this opening along x has a closed form too, from these two integrals. It follows from differentiation
under the integral with d^2/dx^2 = -d^2/de^2 - (1/e) d/de of the integrand:

    -d^2/dx^2 [int sqrt(q - x'^2) / sqrt((x - x')^2 + e^2) dx'] at x = 0  =  2 (K - E) / u  =  J / u^2.           (3)

Surfaces that touch at x = 0 and stay together on both sides of it thus require two sums over the strips:

    sum h c J        = pi E* (d - f)    where q > 0; where q = 0 the sum may be larger,                           (4)
    sum h c J / u^2  = 2 pi E* A        where q > 0,                                                              (5)

and the force is (pi / 2) sum h c q. Equation (4) is solved for q and d by Newton's method on the strips in contact.
Equation (5) determines poorly the differences of c between strips with distances below their lengths. Therefore in each
sweep c is multiplied by the 0.6th power of a mean of 2 pi E* A / sum. The mean is weighted by force and J / u^2, with
the sum predicted for the state after the Newton step. A sweep needs a single evaluation of K and E. By the
arithmetic-geometric mean (AGM) of u and |e|, with differences c_k (c_0^2 = q):

    K / u = pi / (2 AGM(u, |e|)),    J = (K / u) (q + 2 c_1^2 + 4 c_2^2 + 8 c_3^2 + ...).                         (6)

J has a logarithm at e = 0, J -> 2 a (ln(4 a / |e|) - 1). The sum over equal strips without it converges fast if the
strip at e = 0 counts as 2 a (ln(8 pi a / h) - 1): the punctured trapezoidal rule for a logarithm, ln(h / 2 pi) at the
origin. A strip shorter than 0.4 h counts in proportion to q.

If lobes lie in different planes, t is measured along the surface and f along the approach. A strip with a normal that
is turned by the angle g relative to the approach closes by cos(g) (d - f), so that the right sides of (4) and (5) and
the force have a factor cos(g).

Range of validity: half-spaces, no friction, no yaw; any number of lobes, joined or apart. The opening at a lobe under
the pressure of a lobe in a different plane is calculated as in a single plane; the error is the cosine of the angle
between the planes.

Measured: on constant curvature 100 strips are within 0.3 % of Hertz in peak, area, half-widths and approach for a/b
from 0.1 to 4.5. At a/b = 10 the error of the half-length is 1.1 % and the error of the approach is 0.6 %. Compared with
a half-space solved by FFT on an equal gap, the peak is within 0.1 % at junctions of curvatures and between two lobes.
For real pairs see studies/15_cheaper_than_finite_elements.py.

Source: the idea of strips with a contact condition on the line x = 0 is by Knothe and Le The (1984). Condition (5) in
this closed form, which lets c vary across, and the sweeps are new in this module.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Span = tuple[float, float]

_SHORT_STRIP_RATIO = 0.4
# A strip without contact has a squared half length of this fraction of its squared width, to avoid division by zero.
_OPEN_STRIP_FRACTION = 1e-6
_MAX_SWEEPS = 60
# Number of entries of the influence matrices of contacts that are solved together. Ten contacts on 40 strips share the
# time of a call of numpy, and their matrices stay in the cache of a core.
_STACK_ENTRIES = 16_000
DEFAULT_STRIPS = 100
"""Number of strips across a patch if no number is given."""
# Exponent of the ratio that multiplies c. With an exponent of 1, c overshoots in patches that are long along the rail.
_FACTOR_EXPONENT = 0.6
# Number of strips of the first solution over all positions that may touch, and the least number of strips in a region.
_COARSE_STRIPS = 40
_MIN_STRIPS_PER_REGION = 8
# Margin of the strips beyond the expected patch, relative to the width of the patch.
_SPAN_MARGIN = 0.04
_MAX_REGRIDS = 6
# Number of positions outside the strips that are checked for an overlap, and the least overlap relative to the
# approach.
_OVERLAP_CHECK_POSITIONS = 30
_MIN_OVERLAP = 1e-3


@dataclass(frozen=True, kw_only=True)
class StripSolution:
    """Solved contact on strips.

    Attributes
    ----------
    t, h, q, c : ndarray of shape (n,)
        Middle and width of each strip (mm), squared half length (mm^2), and pressure factor (MPa/mm): the pressure is c
        sqrt(q - x^2).
    approach, force
        Approach in mm, force in N.
    sweeps
        Number of Newton steps on the last set of strips.
    change
        Last change of c and q in a sweep, weighted by force; at most the tolerance if `converged`.
    converged
        Whether the sweeps converged.
    at_end
        Whether the patch reaches an end of the line.
    """

    t: Floats
    h: Floats
    q: Floats
    c: Floats
    approach: float
    force: float = 0.0
    sweeps: int = 0
    change: float = np.inf
    converged: bool = False
    at_end: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class StripGap:
    """Gap on a line across both bodies.

    Attributes
    ----------
    t, f : ndarray of shape (n,)
        Positions across, increasing (mm), and gap at x = 0 (mm), with the minimum 0 and linear between the positions.
    A
        Half the relative curvature along the rail (1/mm), cos(contact angle) / (2 rolling radius).
    E
        Contact modulus (MPa), 1/E = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    closing : ndarray of shape (n,)
        Cosine between the normal of the surface and the approach. In a single plane it is 1 everywhere. If it is not,
        positions are measured along the surface, and gap and force along the approach.
    """

    t: Floats
    f: Floats
    A: float
    E: float
    closing: Floats

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Gap and closing at given positions (m,), linear between the positions of the line.

        Parameters
        ----------
        t : ndarray of shape (m,)
            Positions across in mm.

        Returns
        -------
        gap, closing : ndarrays of shape (m,)
            Gap in mm, and cosine between normal and approach (-).
        """
        return np.interp(t, self.t, self.f), np.interp(t, self.t, self.closing)


@dataclass(frozen=True, kw_only=True)
class StripLoad:
    """Either a force (N) or an approach (mm).

    Attributes
    ----------
    force
        Normal force in N; None if the approach is given.
    approach
        Approach in mm; None if the force is given.
    """

    force: float | None = None
    approach: float | None = None


@dataclass(frozen=True, kw_only=True)
class StripSearch:
    """Number of strips, and convergence criterion.

    Attributes
    ----------
    strips
        Number of strips across the patch.
    tolerance
        Largest change of c and q in the last sweep, weighted by force. With the default, the error of the peak is some
        0.1 %.
    most_sweeps
        Largest number of sweeps. With a tolerance of 0 it is the number of sweeps. Forces are then a smooth function of
        the line if the start is.
    """

    strips: int = DEFAULT_STRIPS
    tolerance: float = 4e-3
    most_sweeps: int = _MAX_SWEEPS


_DEFAULT_SEARCH = StripSearch()


def solve_strips(
    line: StripGap, load: StripLoad, search: StripSearch = _DEFAULT_SEARCH, *, start: StripSolution | None = None
) -> StripSolution:
    """Solve the contact on a line under a load.

    Parameters
    ----------
    line
        Gap, curvature along the rail, and contact modulus.
    load
        Force or approach.
    search
        Number of strips and convergence criterion.
    start
        Contact at nearly this load and position. It saves the first solution on few strips.

    Returns
    -------
    StripSolution
        The contact. `converged` is false if the sweeps do not converge, or if new overlaps appear on every set of
        strips.

    Examples
    --------
    A sphere has Hertz's approach a^2 / R within 0.3 % (Johnson 1985, eq. 4.22):

    >>> import numpy as np
    >>> from fecontact.contact_theories.strip_method import StripGap, StripLoad, solve_strips
    >>> t = np.linspace(-5.0, 5.0, 501)
    >>> line = StripGap(t=t, f=0.005 * t**2, A=0.005, E=115e3, closing=np.ones(501))
    >>> strips = solve_strips(line, StripLoad(force=1e3))
    >>> bool(abs(strips.approach / ((0.75 * 1e3 * 100.0 / 115e3) ** (2 / 3) / 100.0) - 1.0) < 0.003)
    True
    """
    (solution,) = solve_strips_of_lines([line], [load], search, starts=None if start is None else [start])
    return solution


def solve_strips_of_lines(
    lines: Sequence[StripGap],
    loads: Sequence[StripLoad],
    search: StripSearch = _DEFAULT_SEARCH,
    *,
    starts: Sequence[StripSolution] | None = None,
) -> list[StripSolution]:
    """Solve the contacts on many lines, each under its load.

    Lines with equal numbers of strips share their operations on arrays. Each contact is
    exactly the contact by `solve_strips`.

    Parameters
    ----------
    lines
        Gap, curvature along the rail, and contact modulus of each contact.
    loads
        Force or approach of each contact.
    search
        Number of strips and convergence criterion.
    starts
        Contact at nearly the load and position of each line, as in `solve_strips`.

    Returns
    -------
    list of StripSolution
        The contacts in the order of the lines.
    """
    contacts = _solve_coarsely(lines, loads, search.tolerance) if starts is None else list(starts)
    spans = [_expected_spans(*contact) for contact in zip(lines, contacts, loads, strict=True)]
    pending = list(range(len(lines)))
    for _ in range(_MAX_REGRIDS):
        strips = [_interpolate_to(contacts[k], *_build_strips(spans[k], search.strips)) for k in pending]
        swept = _sweep([lines[k] for k in pending], strips, [loads[k] for k in pending], search)
        overlaps = {k: _overlapping_spans(lines[k], contact) for k, contact in zip(pending, swept, strict=True)}
        for k, contact in zip(pending, swept, strict=True):
            contacts[k], spans[k] = contact, _join_spans([*spans[k], *overlaps[k]])
        pending = [k for k in pending if overlaps[k]]
        if not pending:
            break
    return [
        replace(contact, converged=contact.converged and k not in pending, at_end=_reaches_end(line, contact))
        for k, (line, contact) in enumerate(zip(lines, contacts, strict=True))
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class StripDistances:
    """Distances e from strips, with the roots that equation (6) needs.

    Attributes
    ----------
    square, distance, root : ndarray of shape (..., n, n)
        e^2 in mm^2, |e| in mm and its square root.
    """

    square: Floats
    distance: Floats
    root: Floats

    @classmethod
    def build(cls, distance: Floats) -> StripDistances:
        """Absolute distances with their squares and roots.

        Parameters
        ----------
        distance : ndarray of any shape
            Distances in mm, with any sign.

        Returns
        -------
        StripDistances
            Arrays of this shape.
        """
        length = np.abs(distance)
        return cls(square=length * length, distance=length, root=np.sqrt(length))


def calculate_influence(q: Floats, distances: StripDistances, h: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Influence of strips on the opening at strips, by equations (2) and (3).

    Parameters
    ----------
    q : ndarray of shape (..., n)
        Squared half length of each strip in mm^2, in columns.
    distances
        Distances (..., n, n) between the strips.
    h : ndarray of shape (..., n)
        Width of each strip in mm.

    Returns
    -------
    J, dJ/dq, J / u^2, u^2 (..., n, n)
        Integral in mm, its derivative in 1/mm, the curvature factor in 1/mm, and u^2 in mm^2.
    """
    u2, slope, J = _influence_of_distant_strips(q[..., None, :], distances)
    a, diagonal = np.sqrt(q), np.arange(q.shape[-1])
    effective_length = np.maximum(a, _SHORT_STRIP_RATIO * h)
    logarithm = np.log(8.0 * np.pi * effective_length / h)
    is_short = a < effective_length
    J[..., diagonal, diagonal] = np.where(is_short, q / effective_length, a) * 2.0 * (logarithm - 1.0)
    slope[..., diagonal, diagonal] = np.where(is_short, 2.0 * (logarithm - 1.0), logarithm) / effective_length
    u2[..., diagonal, diagonal] = q
    return J, slope, J / u2, u2


def _influence_of_distant_strips(q: Floats, distances: StripDistances) -> tuple[Floats, Floats, Floats]:
    """u^2, dJ/dq and J by equation (6), except for a distance of 0.

    The arithmetic-geometric mean of u and |e| takes three steps: the error is 1e-6 of J for strips that are 50 times
    longer than wide. With its means a_k and g_k, a_2 is the square of
    (sqrt(u) + sqrt(|e|)) / 2 and a_4 the square of (sqrt(a_2) + sqrt(g_2)) / 2, so that four square roots suffice.

    Parameters
    ----------
    q
        Squared half lengths of the strips in mm2.
    distances
        Distances from the strips, > 0; `q` is broadcast to their shape.
    """
    u2 = distances.square + q
    # Calculated in place, because this is most of the time of a sweep: four arrays stay in the cache of a core.
    mean = np.sqrt(u2)
    root = np.sqrt(mean)
    series = mean - distances.distance
    series *= series
    series *= 2.0
    mean += distances.distance
    difference = root * distances.root
    mean *= difference
    mean *= 8.0
    np.sqrt(mean, out=mean)  # 4 g_2
    np.subtract(root, distances.root, out=difference)
    difference *= difference
    difference *= difference
    series += difference
    series *= 2.0
    root += distances.root  # 2 sqrt(a_2)
    np.multiply(root, root, out=difference)
    difference -= mean
    difference *= difference
    series += difference
    series *= 2.0
    np.sqrt(mean, out=mean)  # 2 sqrt(g_2)
    np.subtract(root, mean, out=difference)
    difference *= difference
    difference *= difference
    series += difference
    series *= 0.0625
    series += q
    root += mean  # 4 sqrt(a_4)
    root *= root
    slope = np.divide(8.0 * np.pi, root, out=root)
    series *= slope
    return u2, slope, series


@dataclass(kw_only=True, eq=False)
class _StripStack:
    """Strips of m contacts during the sweeps, n strips per contact. A sweep changes the last attributes.

    Attributes
    ----------
    number : ndarray of shape (m,)
        Number of each contact among the contacts of the stack at its beginning.
    t, h, f, closing, open_q : ndarray of shape (m, n)
        Middles and widths of the strips, gap and closing of the line, and squared half length of a strip without
        contact.
    distances
        Distances (m, n, n) between the strips.
    A, E, force : ndarray of shape (m, 1)
        Constants of the line, and force in N; NaN if the approach is given.
    q, c : ndarray of shape (m, n)
        Squared half lengths and pressure factors as in `StripSolution`.
    approach, change : ndarray of shape (m, 1)
        Approach in mm, and last change of c and q, weighted by force.
    """

    number: NDArray[np.intp]
    t: Floats
    h: Floats
    f: Floats
    closing: Floats
    open_q: Floats
    distances: StripDistances
    A: Floats
    E: Floats
    force: Floats
    q: Floats
    c: Floats
    approach: Floats
    change: Floats

    @classmethod
    def join(
        cls, lines: Sequence[StripGap], strips: Sequence[StripSolution], loads: Sequence[StripLoad]
    ) -> _StripStack:
        """Stack of strips on their lines, before the first sweep."""
        t, h, q, c = (np.stack([getattr(contact, name) for contact in strips]) for name in ("t", "h", "q", "c"))
        gaps, closings = zip(*(line.at(contact.t) for line, contact in zip(lines, strips, strict=True)), strict=True)
        approaches = [
            contact.approach if load.approach is None else load.approach
            for contact, load in zip(strips, loads, strict=True)
        ]
        open_q = _OPEN_STRIP_FRACTION * h**2
        return cls(
            number=np.arange(len(lines)),
            t=t,
            h=h,
            f=np.stack(gaps),
            closing=np.stack(closings),
            open_q=open_q,
            distances=StripDistances.build(t[:, :, None] - t[:, None, :]),
            A=np.array([[line.A] for line in lines]),
            E=np.array([[line.E] for line in lines]),
            force=np.array([[math.nan if load.force is None else load.force] for load in loads]),
            q=np.maximum(q, open_q),
            c=c,
            approach=np.array(approaches)[:, None],
            change=np.full((len(lines), 1), np.inf),
        )

    def select(self, is_selected: Bools) -> _StripStack:
        """Contacts that are selected by a mask (m,)."""
        if is_selected.all():
            return self
        distances = StripDistances(**{name: values[is_selected] for name, values in vars(self.distances).items()})
        arrays = {name: values[is_selected] for name, values in vars(self).items() if name != "distances"}
        return _StripStack(distances=distances, **arrays)

    def make_solution(self, k: int, sweeps: int, tolerance: float) -> StripSolution:
        """Solution of contact k of the stack after its last sweep."""
        q, change = np.where(self.q[k] > self.open_q[k], self.q[k], 0.0), float(self.change[k, 0])
        return StripSolution(
            t=self.t[k],
            h=self.h[k],
            q=q,
            c=self.c[k].copy(),
            approach=float(self.approach[k, 0]),
            force=float(0.5 * np.pi * (self.h[k] * self.c[k] * self.closing[k]) @ q),
            sweeps=sweeps,
            change=change,
            converged=change <= tolerance,
        )


def _sweep(
    lines: Sequence[StripGap], strips: Sequence[StripSolution], loads: Sequence[StripLoad], search: StripSearch
) -> list[StripSolution]:
    """Solve q and d of each contact by Newton steps until they converge.

    A change of c follows each Newton step. Contacts with equal numbers of strips are solved together.
    """
    numbers_by_size: dict[int, list[int]] = {}
    for number, contact in enumerate(strips):
        numbers_by_size.setdefault(contact.t.size, []).append(number)
    solutions = list(strips)
    for size, numbers in numbers_by_size.items():
        stack_size = max(1, _STACK_ENTRIES // size**2)
        for first in range(0, len(numbers), stack_size):
            stacked = numbers[first : first + stack_size]
            stack = _StripStack.join(
                [lines[number] for number in stacked],
                [strips[number] for number in stacked],
                [loads[number] for number in stacked],
            )
            for number, contact in zip(stacked, _sweep_stack(stack, search), strict=True):
                solutions[number] = contact
    return solutions


def _sweep_stack(stack: _StripStack, search: StripSearch) -> list[StripSolution]:
    """Make sweeps until each contact of a stack has converged.

    The number of sweeps is limited by the search.
    """
    solutions: dict[int, StripSolution] = {}
    for sweeps in range(1, search.most_sweeps + 1):
        _make_sweep(stack, search.tolerance)
        is_moving = (stack.change[:, 0] > search.tolerance) & (sweeps < search.most_sweeps)
        for k in np.flatnonzero(~is_moving).tolist():
            solutions[int(stack.number[k])] = stack.make_solution(k, sweeps, search.tolerance)
        if not is_moving.any():
            break
        stack = stack.select(is_moving)
    return [solutions[number] for number in sorted(solutions)]


def _make_sweep(stack: _StripStack, tolerance: float) -> None:
    """Make a Newton step of q and d, and the change of c after it.

    c stays where the change is at most the tolerance.
    """
    q, c, closing, approach = stack.q, stack.c, stack.closing, stack.approach
    J, slope, curvature_influence, u2 = calculate_influence(q, stack.distances, stack.h)
    weight = stack.h * c / (np.pi * stack.E)
    gap = np.matvec(J, weight) + closing * (stack.f - approach)
    step, approach_step = _find_newton_step(stack, slope, weight, gap)
    largest_q = q.max(axis=1, keepdims=True)
    stack.q, stack.approach = np.maximum(q + np.minimum(step, 0.5 * largest_q), stack.open_q), approach + approach_step
    step = stack.q - q
    # The sum of (5) after the step: its derivative with respect to q is (dJ/dq - J / u^2) / u^2.
    slope -= curvature_influence
    slope /= u2
    relative_curvature = (
        0.5 * (np.matvec(curvature_influence, weight) + np.matvec(slope, weight * step)) / (stack.A * closing)
    )
    is_loaded = stack.q > stack.open_q
    force_share = np.where(is_loaded, weight * stack.q, 0.0)
    force_share /= force_share.sum(axis=1, keepdims=True)
    ratio = np.where(is_loaded, 1.0 / np.minimum(np.maximum(relative_curvature, 0.5), 2.0), 1.0)
    # The mean, weighted by force, over the strips that the pressure of a strip bends.
    numerator, denominator = (np.vecmat(weights, curvature_influence) for weights in (force_share * ratio, force_share))
    factor = (numerator / denominator) ** _FACTOR_EXPONENT
    changes = (factor - 1.0) ** 2, (step / stack.q.max(axis=1, keepdims=True)) ** 2
    stack.change = np.abs(approach_step) / stack.approach
    for change in changes:
        stack.change += np.sqrt(np.vecdot(force_share, change))[:, None]
    stack.c = np.where(stack.change > tolerance, c * factor, c)


def _find_newton_step(stack: _StripStack, slope: Floats, weight: Floats, gap: Floats) -> tuple[Floats, Floats]:
    """Newton steps (m, n) of q and (m, 1) of the approach.

    Only closed strips have the equation gap = 0; the step of open strips is zero. `slope` (m, n, n) times `weight`
    (m, n) is d gap / d q. The last equation is the given force; if the approach is given, then its step is zero.
    """
    number, size = gap.shape
    missing_force = 2.0 * stack.force / (np.pi**2 * stack.E) - np.vecdot(weight * stack.closing, stack.q)[:, None]
    matrix, right_side = np.empty((number, size + 1, size + 1)), np.empty((number, size + 1))
    np.multiply(slope, weight[:, None, :], out=matrix[:, :size, :size])
    matrix[:, :size, size], matrix[:, size, :size] = -stack.closing, weight * stack.closing
    matrix[:, size, size] = 0.0
    right_side[:, :size], right_side[:, size:] = -gap, missing_force
    has_equation = np.concatenate(((stack.q > stack.open_q) | (gap < 0.0), np.isfinite(missing_force)), axis=1)
    without = np.nonzero(~has_equation)
    matrix[without], right_side[without] = 0.0, 0.0
    matrix[(*without, without[1])] = 1.0
    steps = np.linalg.solve(matrix, right_side[..., None])[..., 0]
    return steps[:, :size], steps[:, size:]


def _solve_coarsely(lines: Sequence[StripGap], loads: Sequence[StripLoad], tolerance: float) -> list[StripSolution]:
    """Solve the contacts on few strips, from solutions with independent springs.

    The pressures of the springs start the sweeps on the coarse strips, and the results start the sweeps on finer
    strips.

    Parameters
    ----------
    lines
        Gaps and elastic constants.
    loads
        Force or approach of each line.
    tolerance
        Largest change in a sweep on the finer strips (-); 4 times this change is allowed here.

    Returns
    -------
    list of StripSolution
        Solutions on the coarse strips.
    """
    springs = [_solve_springs(line, load) for line, load in zip(lines, loads, strict=True)]
    return _sweep(lines, springs, loads, StripSearch(tolerance=4.0 * tolerance))


def _solve_springs(line: StripGap, load: StripLoad) -> StripSolution:
    """Solve the contact with independent springs on few strips.

    The strips cover all positions within the approach. The springs have the c of a circle at half the approach.
    """
    c = 4.0 / np.pi * line.E * line.A
    if load.approach is not None:
        approach = load.approach
    else:
        assert load.force is not None
        approach = _find_spring_approach(line, load.force / (0.5 * np.pi * c / line.A))
    t, h = _build_strips(_selected_spans(line, line.f < approach), _COARSE_STRIPS)
    q = np.maximum(0.5 * approach - line.at(t)[0], 0.0) / line.A
    factor = np.full_like(t, c)
    spring_solution = StripSolution(
        t=t, h=h, q=q, c=factor, approach=approach, force=0.0, sweeps=0, change=np.inf, converged=False
    )
    for patch in _split_patches(spring_solution):
        factor[patch] = line.E * line.A * estimate_ellipse_factor(2.0 * np.sqrt(q[patch].max()) / (h[patch].sum()))
    return spring_solution


def _find_spring_approach(line: StripGap, overlap_mm2: float) -> float:
    """Approach d at which the springs have a given force.

    The overlaps d / 2 - f, times their widths, have the given sum. The approach is at most twice the largest gap. The
    sum is convex in d with straight pieces, so that Newton steps from a larger approach end at the exact solution.
    """
    approach, f, widths = 2.0 * float(line.f.max()), line.f, np.gradient(line.t)
    while True:
        is_closed = f < 0.5 * approach
        f, widths = f[is_closed], widths[is_closed]
        next_approach = 2.0 * (overlap_mm2 + float(widths @ f)) / float(widths.sum())
        if next_approach >= approach:
            return approach
        approach = next_approach


def estimate_ellipse_factor(ratio: float) -> float:
    """Estimate c / (E* A) from the axis ratio of an overlap.

    The estimate is the factor of Hertz's ellipse, within 5 % for ratios from 0.1 to 10.

    Parameters
    ----------
    ratio
        Axis ratio of the overlap (-).

    Returns
    -------
    float
        Estimate of c / (E* A) (-).

    Examples
    --------
    >>> import math
    >>> from fecontact.contact_theories.strip_method import estimate_ellipse_factor
    >>> abs(estimate_ellipse_factor(1.0) / (4.0 / math.pi) - 1.0) < 0.05
    True
    """
    return float(1.0 + 0.27 * ratio**1.3)


def _build_strips(spans: list[Span], number: int) -> tuple[Floats, Floats]:
    """Middles and widths of about the given total number of strips, equal on each span."""
    total = sum(high - low for low, high in spans)
    t, h = [], []
    for low, high in spans:
        count = max(_MIN_STRIPS_PER_REGION, round(number * (high - low) / total))
        t.append(low + (high - low) * (np.arange(count) + 0.5) / count)
        h.append(np.full(count, (high - low) / count))
    return np.concatenate(t), np.concatenate(h)


def _interpolate_to(strips: StripSolution, t: Floats, h: Floats) -> StripSolution:
    """Contact interpolated to different strips."""
    q = np.interp(t, strips.t, strips.q, left=0.0, right=0.0)
    return replace(strips, t=t, h=h, q=q, c=np.interp(t, strips.t, strips.c))


def _expected_spans(line: StripGap, strips: StripSolution, load: StripLoad) -> list[Span]:
    """Expected patches with a margin, from a contact of nearly this load."""
    # Widths grow with the cube root of the force and the square root of the approach.
    growth = 1.0
    if load.force is not None and strips.force > 0.0:
        growth = (load.force / strips.force) ** (1.0 / 3.0)
    elif load.approach is not None:
        growth = (load.approach / strips.approach) ** 0.5
    spans = []
    for patch in _split_patches(strips):
        low, high = strips.t[patch[0]], strips.t[patch[-1]]
        margin = 0.75 * strips.h[patch[0]] + (_SPAN_MARGIN + 0.5 * (growth - 1.0)) * (high - low)
        spans.append((max(low - margin, line.t[0]), min(high + margin, line.t[-1])))
    return _join_spans(spans)


def _split_patches(strips: StripSolution) -> list[NDArray[np.intp]]:
    """Indices of the strips in contact, for each patch."""
    strips_in_contact = np.flatnonzero(strips.q)
    is_gap = np.diff(strips.t[strips_in_contact]) > 1.01 * np.maximum(
        strips.h[strips_in_contact[1:]], strips.h[strips_in_contact[:-1]]
    )
    return np.split(strips_in_contact, np.flatnonzero(is_gap) + 1)


def _reaches_end(line: StripGap, strips: StripSolution) -> bool:
    """Whether the patch reaches an end of the line."""
    strips_in_contact = np.flatnonzero(strips.q)
    reaches_low_end = strips.t[strips_in_contact] - 0.51 * strips.h[strips_in_contact] <= line.t[0]
    reaches_high_end = strips.t[strips_in_contact] + 0.51 * strips.h[strips_in_contact] >= line.t[-1]
    return bool(np.any(reaches_low_end | reaches_high_end))


def _join_spans(spans: list[Span]) -> list[Span]:
    """Spans in ascending order, with overlapping spans joined."""
    joined: list[Span] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1]:
            low, high = joined[-1][0], max(high, joined.pop()[1])
        joined.append((low, high))
    return joined


def _selected_spans(line: StripGap, is_selected: Bools) -> list[Span]:
    """Spans of the selected positions, half a step longer on both sides."""
    indices = np.flatnonzero(is_selected)
    half_step = 0.5 * (line.t[-1] - line.t[0]) / (line.t.size - 1)
    runs = np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1)
    return [
        (max(float(line.t[run[0]]) - half_step, line.t[0]), min(float(line.t[run[-1]]) + half_step, line.t[-1]))
        for run in runs
    ]


def _overlapping_spans(line: StripGap, strips: StripSolution) -> list[Span]:
    """Spans outside the strips in which the bodies overlap.

    The elastic opening is calculated at few positions only.
    """
    indices = np.flatnonzero(line.f < strips.approach)
    t, half_widths, next_strips = line.t[indices], 0.5 * strips.h, np.searchsorted(strips.t, line.t[indices])
    left, right = np.maximum(next_strips - 1, 0), np.minimum(next_strips, strips.t.size - 1)
    distances_in_widths = np.minimum(
        np.abs(t - strips.t[left]) / half_widths[left], np.abs(t - strips.t[right]) / half_widths[right]
    )
    indices = indices[distances_in_widths > 1.01]
    if indices.size == 0:
        return []
    stride = max(1, indices.size // _OVERLAP_CHECK_POSITIONS)
    indices = indices[::stride]
    is_loaded = strips.q > 0.0
    distances = StripDistances.build(line.t[indices, None] - strips.t[is_loaded])
    _, _, J = _influence_of_distant_strips(strips.q[is_loaded], distances)
    opening = J @ (strips.h * strips.c)[is_loaded] / (np.pi * line.E)
    is_overlapping = opening < line.closing[indices] * (strips.approach * (1.0 - _MIN_OVERLAP) - line.f[indices])
    if not is_overlapping.any():
        return []
    is_selected = np.zeros(line.t.size, dtype=bool)
    for index in indices[is_overlapping]:
        is_selected[max(0, index - stride) : index + stride + 1] = True
    return _selected_spans(line, is_selected)
