"""The strip method: a non-elliptic contact of wheel and rail from two conditions on one line. Needs numpy only.

Two half-spaces with the gap f(t) + A x^2 (x along the rail, t across) are pressed together by the approach d. The patch
is cut into strips along x; the strip at t has the half length a(t), q = a^2, and the pressure

    p(x, t) = c(t) sqrt(q(t) - x^2),                                                                              (1)

which is exact for an ellipse (c constant) and for a patch that is long across (c = E* A). Along the line x = 0 a strip
of width h at the distance e opens the surfaces by h c J / (pi E*), with u = sqrt(q + e^2) and the complete elliptic
integrals K, E of the parameter m = q / u^2:

    J  = int sqrt(q - x^2) / sqrt(x^2 + e^2) dx = 2 u (K - E),      dJ/dq = K / u.                                (2)

Its curvature along x there has a closed form too, from the same two integrals: differentiating under the integral and
using d^2/dx^2 = -d^2/de^2 - (1/e) d/de of it,

    -d^2/dx^2 [int sqrt(q - x'^2) / sqrt((x - x')^2 + e^2) dx'] at x = 0  =  2 (K - E) / u  =  J / u^2.           (3)

Surfaces that touch along x = 0 and stay together beside it thus ask for two sums over the strips:

    sum h c J        = pi E* (d - f)    where q > 0; where q = 0 the sum may be larger,                           (4)
    sum h c J / u^2  = 2 pi E* A        where q > 0,                                                              (5)

and the force is (pi / 2) sum h c q. (4) is solved for q and d by Newton's method on the strips in contact. (5) says
little about differences of c between strips that are nearer to each other than they are long. So in each sweep c is
multiplied by the 0.6th power of a mean of 2 pi E* A / sum, weighted by force and J / u^2, with the sum predicted for
after Newton's step. A sweep needs one evaluation of K and E. By the arithmetic-geometric mean (AGM) of u and |e|, with
differences c_k (c_0^2 = q):

    K / u = pi / (2 AGM(u, |e|)),    J = (K / u) (q + 2 c_1^2 + 4 c_2^2 + 8 c_3^2 + ...).                         (6)

J has a logarithm at e = 0, J -> 2 a (ln(4 a / |e|) - 1). The sum over equal strips without it converges fast if the
strip itself counts as 2 a (ln(8 pi a / h) - 1): the punctured trapezoidal rule for a logarithm, ln(h / 2 pi) at the
origin. A strip shorter than 0.4 h counts in proportion to q.

If lobes lie in different planes, t is measured along the surface and f along the approach. A strip whose normal is
turned by the angle g against the approach closes by cos(g) (d - f), so that the right sides of (4) and (5) and the
force have a factor cos(g).

Range: half-spaces, no friction, no yaw; any number of lobes, joined or apart. The opening that a lobe causes at a lobe
in another plane is computed as in one plane; the error is the cosine of the angle between the planes.

Measured: on constant curvature 100 strips are within 0.3 % of Hertz in peak, area, half-widths and approach for a/b
from 0.1 to 4.5; at 10 the half-length is 1.1 % and the approach 0.6 % off. Against a half-space solved by FFT on the
same gap the peak is within 0.1 % at junctions of curvatures and between two lobes; on real pairs see
studies/15_cheaper_than_finite_elements.py.

The idea of strips with a contact condition on the line x = 0 is Knothe and Le The's (1984); condition (5) in this
closed form, which lets c vary across, and the sweeps are this module's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Span = tuple[float, float]

# Halvings of the AGM: 1e-6 of J where strips are 50 times longer than wide.
_AGM_STEPS = 3
_SHORT = 0.4
# A strip without contact keeps a squared half length of this part of its squared width, against division by zero.
_OPEN = 1e-6
_SWEEPS = 60
# Power of the ratio by which c is changed: with 1 it overshoots in patches that are long along the rail.
_BOLDNESS = 0.6
# Strips of the first solution over all places that may touch, and the fewest strips on a region.
_COARSE = 40
_FEWEST = 8
# Margin of the strips beyond the expected patch, relative to its width.
_MARGIN = 0.04
_REGRIDS = 6
# Number of places beside the strips at which an overlap is looked for, and the least overlap relative to the approach.
_LOOKED_AT = 30
_OVERLAP = 1e-3


@dataclass(frozen=True, kw_only=True)
class Strips:
    """A solved contact on strips.

    Attributes
    ----------
    t, h, q, c (n,)
        Middle and width of each strip (mm), squared half length (mm^2), and pressure factor (MPa/mm): the pressure is
        c sqrt(q - x^2).
    approach, force
        Approach in mm, force in N.
    sweeps
        Newton steps on the last set of strips.
    change
        Last change of c and q in a sweep, weighted by force; at most the tolerance if `converged`.
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
class Line:
    """A line across both bodies.

    Attributes
    ----------
    t, f (n,)
        Places across, increasing (mm), and gap at x = 0 (mm), with the minimum 0 and linear between the places.
    A
        Half the relative curvature along the rail (1/mm), cos(contact angle) / (2 rolling radius).
    E
        Contact modulus (MPa), 1/E = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    closing (n,)
        Cosine between the surface's normal and the approach: 1 everywhere in one plane. Else places are measured along
        the surface, gap and force along the approach.
    """

    t: Floats
    f: Floats
    A: float
    E: float
    closing: Floats

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Gap and closing at places."""
        return np.interp(t, self.t, self.f), np.interp(t, self.t, self.closing)


@dataclass(frozen=True, kw_only=True)
class Load:
    """Either a force (N) or an approach (mm)."""

    force: float | None = None
    approach: float | None = None


@dataclass(frozen=True, kw_only=True)
class Search:
    """Accuracy with which a contact is solved.

    Attributes
    ----------
    strips
        Number of strips across the patch.
    tolerance
        Largest change of c and q in the last sweep, weighted by force; the default gives the peak to some 0.1 %.
    most_sweeps
        Largest number of sweeps. With a tolerance of 0 it is the number of sweeps: then forces depend on the line
        smoothly if the start does.
    """

    strips: int = 100
    tolerance: float = 4e-3
    most_sweeps: int = _SWEEPS


_USUAL = Search()


def solve_strips(line: Line, load: Load, search: Search = _USUAL, *, start: Strips | None = None) -> Strips:
    """Contact on a line under a load.

    Parameters
    ----------
    start
        A contact of nearly this load and position; it saves the first solution on few strips.
    """
    found = _first_solution(line, load, search.tolerance) if start is None else start
    spans = _spans(line, found, load)
    for _ in range(_REGRIDS):
        found = _swept(line, _carried(found, *_grid(spans, search.strips)), load, search)
        beside = _overlapping(line, found)
        if not beside:
            return replace(found, at_end=_at_end(line, found))
        spans = _joined([*spans, *beside])
    return replace(found, converged=False, at_end=_at_end(line, found))


def influence(q: Floats, distance2: Floats, h: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """J, dJ/dq, J / u^2 and u^2 of (2) and (3) for strips (n,), in columns, at squared distances (n, n)."""
    u2, slope, J = _off_strip(q, distance2)
    a, own = np.sqrt(q), np.arange(q.size)
    least = np.maximum(a, _SHORT * h)
    log = np.log(8.0 * np.pi * least / h)
    short = a < least
    J[own, own] = np.where(short, q / least, a) * 2.0 * (log - 1.0)
    slope[own, own] = np.where(short, 2.0 * (log - 1.0), log) / least
    u2[own, own] = q
    return J, slope, J / u2, u2


def _off_strip(q: Floats, distance2: Floats) -> tuple[Floats, Floats, Floats]:
    """u^2, dJ/dq and J by (6); not for the distance 0."""
    u2 = distance2 + q
    high, low, half = np.sqrt(u2), np.sqrt(distance2), np.empty_like(u2)
    total = np.broadcast_to(q, u2.shape).copy()
    # in place: this is most of a sweep's time
    for power in range(1, _AGM_STEPS + 2):
        np.subtract(high, low, out=half)
        half *= 0.5
        if power <= _AGM_STEPS:
            low *= high
            np.sqrt(low, out=low)
        high -= half
        half *= half
        half *= 2.0**power
        total += half
    slope = np.divide(0.5 * np.pi, high, out=high)
    total *= slope
    return u2, slope, total


def _swept(line: Line, strips: Strips, load: Load, search: Search) -> Strips:
    """Newton's steps for q and d, each followed by a change of c, until they converge."""
    t, h, c = strips.t, strips.h, strips.c
    d = strips.approach if load.approach is None else load.approach
    f, closing = line.at(t)
    distance2, opened = (t[:, None] - t) ** 2, _OPEN * h**2
    q, change, sweep = np.maximum(strips.q, opened), np.inf, 0
    while change > search.tolerance and sweep < search.most_sweeps:
        sweep += 1
        J, slope, curving, u2 = influence(q, distance2, h)
        weight = h * c / (np.pi * line.E)
        gap = J @ weight + closing * (f - d)
        closed = (q > opened) | (gap < 0.0)
        along, missing = weight * closing, None
        if load.force is not None:
            missing = 2.0 * load.force / (np.pi**2 * line.E) - float(along @ q)
        step, closer = _newton(slope * weight, gap, closed, closing, along, missing)
        after = np.maximum(q + np.minimum(step, 0.5 * q.max()), opened)
        step, q, d = after - q, after, d + closer
        # the sum of (5) after the step: its derivative with respect to q is (dJ/dq - J / u^2) / u^2
        bent = 0.5 * (curving @ weight + ((slope - curving) / u2) @ (weight * step)) / (line.A * closing)
        loaded = q > opened
        share = weight * np.where(loaded, q, 0.0)
        share /= share.sum()
        ratio = np.where(loaded, 1.0 / np.clip(bent, 0.5, 2.0), 1.0)
        # the mean over the strips that a strip's pressure bends, weighted by force
        factor = ((share * ratio) @ curving / (share @ curving)) ** _BOLDNESS
        change = float(np.sqrt(share @ (factor - 1.0) ** 2) + np.sqrt(share @ (step / q.max()) ** 2) + abs(closer) / d)
        if change > search.tolerance:
            c = c * factor
    return replace(
        strips,
        q=np.where(q > opened, q, 0.0),
        c=c,
        approach=float(d),
        force=float(0.5 * np.pi * (h * c * closing) @ np.where(q > opened, q, 0.0)),
        sweeps=sweep,
        change=change,
        converged=change <= search.tolerance,
    )


def _newton(
    slope: Floats, gap: Floats, closed: Bools, closing: Floats, along: Floats, missing: float | None
) -> tuple[Floats, float]:
    """Newton steps of q (n,), zero for open strips, and of the approach; `slope` (n, n) is d gap / d q.

    If a force is given, `missing` is its error over pi^2 E / 2, and `along` (n,) its derivative with respect to q.
    """
    n, opened = gap.size, np.flatnonzero(~closed)
    size = n if missing is None else n + 1
    matrix, right = np.empty((size, size)), np.empty(size)
    matrix[:n, :n], right[:n] = slope, -gap
    if missing is not None:
        matrix[:n, n], matrix[n, :n], matrix[n, n] = -closing, along, 0.0
        right[n] = missing
    matrix[opened] = 0.0
    matrix[opened, opened], right[opened] = 1.0, 0.0
    step = np.linalg.solve(matrix, right)
    return np.asarray(step[:n], dtype=np.float64), 0.0 if missing is None else float(step[n])


def _first_solution(line: Line, load: Load, tolerance: float) -> Strips:
    """A solution by independent springs on few strips over all places in reach: c of a circle, half the approach."""
    c = 4.0 / np.pi * line.E * line.A
    if load.approach is not None:
        d = load.approach
    else:
        # springs (pi / 2) c (d / 2 - f) / A a width: force grows steadily with d
        assert load.force is not None
        wanted, most, step = load.force / (0.5 * np.pi * c / line.A), 2.0 * float(line.f.max()), np.gradient(line.t)

        def over(d: float) -> float:
            return float(step @ np.maximum(0.5 * d - line.f, 0.0)) - wanted

        d = brentq(over, 0.0, most) if over(most) > 0.0 else most
    t, h = _grid(_runs(line, line.f < d), _COARSE)
    q = np.maximum(0.5 * d - line.at(t)[0], 0.0) / line.A
    factor = np.full_like(t, c)
    first = Strips(t=t, h=h, q=q, c=factor, approach=d, force=0.0, sweeps=0, change=np.inf, converged=False)
    for patch in _patches(first):
        factor[patch] = line.E * line.A * factor_of_ellipse(2.0 * np.sqrt(q[patch].max()) / (h[patch].sum()))
    return _swept(line, first, load, Search(tolerance=4.0 * tolerance))


def factor_of_ellipse(ratio: float) -> float:
    """First guess of c / (E* A) from an overlap's axis ratio: Hertz's ellipse, within 5 % for ratios from 0.1 to 10."""
    return float(1.0 + 0.27 * ratio**1.3)


def _grid(spans: list[Span], number: int) -> tuple[Floats, Floats]:
    """Middles and widths of about so many strips in all, equal on each span."""
    total = sum(high - low for low, high in spans)
    t, h = [], []
    for low, high in spans:
        count = max(_FEWEST, round(number * (high - low) / total))
        t.append(low + (high - low) * (np.arange(count) + 0.5) / count)
        h.append(np.full(count, (high - low) / count))
    return np.concatenate(t), np.concatenate(h)


def _carried(found: Strips, t: Floats, h: Floats) -> Strips:
    """A contact interpolated to other strips."""
    q = np.interp(t, found.t, found.q, left=0.0, right=0.0)
    return replace(found, t=t, h=h, q=q, c=np.interp(t, found.t, found.c))


def _spans(line: Line, found: Strips, load: Load) -> list[Span]:
    """Expected patches, with a margin, from a contact of nearly this load."""
    # widths grow with the cube root of the force and the square root of the approach
    grown = 1.0
    if load.force is not None and found.force > 0.0:
        grown = (load.force / found.force) ** (1.0 / 3.0)
    elif load.approach is not None:
        grown = (load.approach / found.approach) ** 0.5
    spans = []
    for patch in _patches(found):
        low, high = found.t[patch[0]], found.t[patch[-1]]
        room = 0.75 * found.h[patch[0]] + (_MARGIN + 0.5 * (grown - 1.0)) * (high - low)
        spans.append((max(low - room, line.t[0]), min(high + room, line.t[-1])))
    return _joined(spans)


def _patches(found: Strips) -> list[NDArray[np.intp]]:
    """Strips in contact, patch by patch."""
    inside = np.flatnonzero(found.q)
    apart = np.diff(found.t[inside]) > 1.01 * np.maximum(found.h[inside[1:]], found.h[inside[:-1]])
    return np.split(inside, np.flatnonzero(apart) + 1)


def _at_end(line: Line, found: Strips) -> bool:
    inside = np.flatnonzero(found.q)
    low = found.t[inside] - 0.51 * found.h[inside] <= line.t[0]
    high = found.t[inside] + 0.51 * found.h[inside] >= line.t[-1]
    return bool(np.any(low | high))


def _joined(spans: list[Span]) -> list[Span]:
    """Spans in order, with overlapping spans joined."""
    joined: list[Span] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1]:
            low, high = joined[-1][0], max(high, joined.pop()[1])
        joined.append((low, high))
    return joined


def _runs(line: Line, wanted: Bools) -> list[Span]:
    """Spans of the line with the wanted places, half a step longer on both sides."""
    places = np.flatnonzero(wanted)
    room = 0.5 * (line.t[-1] - line.t[0]) / (line.t.size - 1)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1)
    return [
        (max(float(line.t[run[0]]) - room, line.t[0]), min(float(line.t[run[-1]]) + room, line.t[-1])) for run in runs
    ]


def _overlapping(line: Line, found: Strips) -> list[Span]:
    """Spans in which the bodies overlap beside the strips; the elastic opening is computed at few places only."""
    near = line.f < found.approach
    reach = 0.5 * found.h
    before = np.searchsorted(found.t, line.t)
    left, right = np.maximum(before - 1, 0), np.minimum(before, found.t.size - 1)
    beside = (
        np.minimum(np.abs(line.t - found.t[left]) / reach[left], np.abs(line.t - found.t[right]) / reach[right]) > 1.01
    )
    places = np.flatnonzero(near & beside)
    if places.size == 0:
        return []
    stride = max(1, places.size // _LOOKED_AT)
    places = places[::stride]
    loaded = found.q > 0.0
    _, _, J = _off_strip(found.q[loaded], (line.t[places, None] - found.t[loaded]) ** 2)
    opening = J @ (found.h * found.c)[loaded] / (np.pi * line.E)
    over = opening < line.closing[places] * (found.approach * (1.0 - _OVERLAP) - line.f[places])
    if not over.any():
        return []
    wanted = np.zeros(line.t.size, dtype=bool)
    for place in places[over]:
        wanted[max(0, place - stride) : place + stride + 1] = True
    return _runs(line, wanted)
