"""How often does the stated numerical uncertainty hold?

Reference (analytic), over 300 contacts between finite elements for which Hertz is exact: the gap is quadratic to the
last digit, radii 10 to 2000 mm, 5 to 200 kN, axes along the track or turned, nodes anywhere. They go through the two
meshes of the product and its half-space of 32 nodes a semi-axis, at `quick`, refined once, and at `standard`, half of
them on meshes that were made for a larger load. Reference (same code, finer), over 126 real positions:
`standard`, with 9 elements and 48 nodes a semi-axis. Exact contacts are split by chance before anything is solved:
constants are chosen on one half and tested on the other. Of the real positions 42, many with two lobes or a thin tail,
and 42 that lie anywhere helped to choose what two coarse meshes have in common; 42 others test it. Expected of every
measure that is judged: in 95 % of the cases the true error is inside the stated one, of which half are not more than
three times the error that 95 % of the cases stay within. (Their mean is dominated by a few thin tails and tiny second
patches, where the stated error has to grow.) Ellipses cannot check this for the centre of pressure: they are symmetric.

Ellipses are symmetric and have one lobe. Others are exact too (Galin 1953): a pressure that is a polynomial times an
ellipsoid has a polynomial as its gap. They are shifted by up to 0.45 b, flat on top, or have two lobes with a valley of
up to 80 %; a/b is 0.2 to 5, coefficients and places of the nodes are by chance, no pressure is negative and the gap is
open outside. Elements are made for a lobe, as in the product. The exact contacts are read on the elements' own nodes
too, at any offset: 95 % inside the stated uncertainty of these nodes are expected. It was chosen on 26 different
contacts.

The stated uncertainty of the cut planes is left out here: study 02 moves them, and both compared solutions have equal
cut planes. The patches of exact cases are scaled to a semi-axis of 6 mm and less on bodies of 60 mm whose surfaces
are flat there: one mesh serves many radii and loads. The cut planes, which the exact solution does not have, are ten
semi-axes away or more: they raise the peak pressure by 0.02 %.

Found: for the ellipses, 98 to 100 % of both halves are inside, measure by measure. Of the 84 real positions that helped
to choose, 96 to 100 % are inside, and of the 42 others 95 to 100 %; these figures are from before steps of published
digits were closed and the constant of the centre depended on the skewness of the patch. For the 60 others on the
half-space alone the peak is within 0.006 %, the area within 0.2 %, the centre within 0.00003 b. Between finite elements
81 of 100 lengths a were inside, and the stated uncertainty of the centre was 5 times too large, before a contribution
was added for a and the constant of the centre depended on the skewness.

Now, at `quick`: all 260 ellipses are inside in all measures, and the stated uncertainty is 2.2 to 2.8 times the error
that 95 % stay within; in the peak it is 4.7 times, more than expected. At all resolutions the peak has 4.0 and 3.8
times in the two halves: these two checks fail. The stated 0.20 % covers all errors, of which 95 % are below 0.05 %, so
that no verdict is wrong; verdicts with a margin below the difference of 0.15 % of the peak are UNRESOLVED without need.
The wide contribution is the error that meshes have in common, 0.06 % of the peak. It was chosen for real positions on
earlier meshes. Without it, 100 % of the tuning halves, of the tested ellipses and of the other contacts would be
inside, and 41 of the 42 tested real positions, as with it; the stated uncertainty would be 2.8 and 2.6 times the error.
Of the others, 97 to 100 % of both halves are inside, with 0.5 to 2.3 times. For reading an area 0.25 % was stated, and
with it 3.04 times the error; on the half-space alone the area is read within 0.17 %.

On the elements' own nodes 95 to 100 % are inside: these are 262 cases. The other 58 are patches that are at most 0.18
times, or at least 5.6 times, as long as wide, which the product leaves unresolved (their elements have a compliance
that is 6 to 7 % too stiff). On the earlier meshes these 60 others by another seed (20301101), which were not used for
any choice, were inside in 96 to 100 % in both halves, and on the elements' own nodes in 97 to 100 %.
"""

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polypow, polyval, polyval2d

from fecontact.case import RESOLUTIONS, Case
from fecontact.contact.elements import COMPLIANCE_ERROR_LIMIT
from fecontact.contact.grid import ContactGrid, Rung
from fecontact.contact.patch import measure_valley_depth
from fecontact.contact_theories.hertz import HertzContact, hertz_from_hessian
from fecontact.fe.coupling import CoupledBodies
from fecontact.fe.meshing import FineZone
from fecontact.judging.measures import (
    MEASURES,
    UNCERTAINTIES,
    read_hertz_measures,
    read_hertz_misfit,
    read_measures,
    read_patch,
)
from fecontact.judging.solved_load import compute_skewness, is_barely_separate
from fecontact.judging.uncertainty import MESH_RATIO, estimate_elements_budget, estimate_uncertainty
from fecontact.judging.uncertainty import SolutionQuality as Stated
from fecontact.outputs.style import (
    SERIES_COLOURS,
    add_grid,
    add_legend_beside,
    blank_figure,
    save_figure,
    set_plain_log_scale,
)
from fecontact.outputs.words import MEASURE_WORDS, deviation_columns
from fecontact.placement.wheel_on_rail import Placement
from fecontact.regression.checks import Check
from fecontact.solving.expected_patch import measure_resolved_lobes_mm
from fecontact.solving.lobe_sizes import measure_element_semi_axes_mm, measure_lobe_sizes
from fecontact.solving.meshes import CoupledProblem, couple_bodies, make_coupled_problem, make_covering_grid
from fecontact.solving.placing import place_case
from fecontact.solving.position import Clock, make_true_gap

JUDGED = ("p_max_MPa", "area_mm2", "a_mm", "b_mm", "centre_over_b", "valley", "separate_load", "misplaced_load")
SETS = ("ellipses, tuning", "ellipses, testing", "others, tuning", "others, testing", "real, tuning", "real, testing")
# The contact on the elements' own nodes. Its constants were chosen on different contacts.
OWN_NODES = ("ellipses, own nodes", "others, own nodes")
# Largest share of true errors outside the stated errors, and largest stated error over the 95 % quantile.
OUTSIDE_PERCENT = 5.0
MOST_STATED = 3.0
WIDE_REASON = (
    "The stated uncertainty covers the error and is wider than necessary: near a limit it costs verdicts, which are"
    " UNRESOLVED, and makes no verdict wrong."
)
# Measures that are too small in symmetric contacts to decide whether their stated error is too large.
OF_SKEW = ("centre_over_b",)
SEED = 20240612

# --- real positions ----------------------------------------------------------------------------------------------

INCLINATIONS = {"1:20": math.atan(1.0 / 20.0), "1:40": math.atan(1.0 / 40.0), "0": 0.0}
# Single patches, patches across a junction of curvatures, two lobes, separate patches and thin tails.
SHIFTS_MM = {
    ("60E1", "1:40"): (-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.25, 0.5, 1.0, 2.0, 2.5, 3.0, 5.0),
    ("60E1", "1:20"): (-6.0, 0.5, 5.0),
    ("60E1", "0"): (-8.0, -6.0, -1.0, 2.5),
    ("60E2", "1:40"): (-6.0, 1.0, 2.0, 2.5, 3.0, 5.0),
    ("60E2", "1:20"): (-2.0, 3.0),
    ("60E2", "0"): (-2.0, -1.0, 0.5),
    ("54E1", "1:40"): (-4.0, -2.0, -1.0, -0.5, 0.0, 1.0, 2.5),
    ("54E1", "1:20"): (-1.0, 5.0),
    ("54E1", "0"): (-8.0, 0.25),
}
LOADS_N = (20e3, 50e3, 80e3, 100e3, 125e3, 150e3)
# Seeds and numbers of random positions: some helped to choose constants, an equal number did not.
TUNING, TESTING = (SEED + 2, 43), (SEED + 3, 44)
# Positions that are left out. The elements of their `quick` or `standard` meshes are rejected, and may not be refined
# here. In the third, 48 nodes on the semi-axis of its smallest lobe would be too many.
REFUSED = (("60E2", "0", 5.15), ("54E1", "0", 3.39), ("60E1", "0", 3.56))


def cases(quick: bool = False) -> list[Case]:
    """Cases of each real position: `quick` without refinement, then the `standard` reference."""
    rng = np.random.default_rng(SEED)
    chosen = [
        (rail, slope, shift, float(rng.choice(LOADS_N)))
        for (rail, slope), shifts in SHIFTS_MM.items()
        for shift in shifts
    ]
    positions = [*chosen, *random_positions(*TUNING), *random_positions(*TESTING)]
    case_list = []
    for rail, slope, shift, load_N in chosen[1:11:9] if quick else positions:
        case = Case(
            rail=rail,
            inclination_rad=INCLINATIONS[slope],
            lateral_shift_mm=shift,
            roll="given",
            load_N=load_N,
            resolution="quick",
            refine="never",
        )
        case_list += [case, replace(case, resolution="standard")]
    return case_list


def random_positions(seed: int, number: int) -> list[tuple[str, str, float, float]]:
    """Rail, slope, lateral shift (mm) and load (N) of random positions."""
    rng = np.random.default_rng(seed)
    pairs = list(SHIFTS_MM)
    positions = [
        (*pairs[rng.integers(len(pairs))], round(float(rng.uniform(-8.0, 6.0)), 2), float(rng.choice(LOADS_N)))
        for _ in range(number)
    ]
    return [position for position in positions if position[:3] not in REFUSED]


# --- contacts that are known exactly: Hertz's ellipses, and pressures that are a polynomial times an ellipsoid -------

MODULUS_MPA = Case().contact_modulus_MPa
# Number of lines through a place along which a pressure is integrated; more than enough for 1e-13.
LINES = 300
# The gap is the polynomial up to this distance from the middle, in semi-axes. Beyond it, any gap that stays open has
# an equal pressure; here it grows with the distance. The factors of OUTSIDE are where the gap is checked to be open.
RIM = 1.25
OUTSIDE = (1.02, 1.1, 1.25, 1.5, 2.0)
MOST_VALLEY, MOST_CENTRE = 0.8, 0.45
# Powers of a length in measures.
LENGTHS = {"area_mm2": 2, "a_mm": 1, "b_mm": 1}


@dataclass(frozen=True, kw_only=True, eq=False)
class Exact:
    """Exact contact and Hertz's ellipse under its force.

    Coordinates and ellipse refer to the place where the surfaces touch first.

    Attributes
    ----------
    hessian_per_mm (2, 2)
        Second derivatives of the gap there.
    gap
        Gap (mm) at places x and s.
    true
        Values of the judged measures, including the measures relative to Hertz's ellipse.
    elements_mm, nodes_mm
        Half length along x and half width across that elements and nodes are made for.
    middle_mm, reach_mm
        Middle of the patch across; half its length along x, and across.
    """

    hertz: HertzContact
    hessian_per_mm: np.ndarray
    gap: Callable[[Any, Any], np.ndarray]
    true: Mapping[str, float]
    elements_mm: tuple[float, float]
    nodes_mm: tuple[float, float]
    middle_mm: float
    reach_mm: tuple[float, float]

    def scaled(self, k: float) -> "Exact":
        """Contact with lengths times k and load times k^2: the pressures stay unchanged."""
        gap, hessian = self.gap, self.hessian_per_mm / k
        return Exact(
            hertz=hertz_from_hessian(
                hessian, normal_force_N=k**2 * self.hertz.normal_force_N, contact_modulus_MPa=MODULUS_MPA
            ),
            hessian_per_mm=hessian,
            gap=lambda x, s: k * gap(x / k, s / k),
            true={name: value * k ** LENGTHS.get(name, 0) for name, value in self.true.items()},
            elements_mm=(k * self.elements_mm[0], k * self.elements_mm[1]),
            nodes_mm=(k * self.nodes_mm[0], k * self.nodes_mm[1]),
            middle_mm=k * self.middle_mm,
            reach_mm=(k * self.reach_mm[0], k * self.reach_mm[1]),
        )

    def fine_grid(self, offset: tuple[float, float], *, half: bool) -> ContactGrid:
        """Nodes of the half-space over the patch and beyond, with the density of the product."""
        x, s = (
            np.arange(-count, count + 1) * step
            for step, count in (
                (length / FLAT.nodes_per_semi_axis, math.ceil(1.2 * reach * FLAT.nodes_per_semi_axis / length))
                for length, reach in zip(self.nodes_mm, self.reach_mm, strict=True)
            )
        )
        return move_grid(ContactGrid(x_mm=x[x.size // 2 :] if half else x, s_mm=self.middle_mm + s, half=half), offset)


@dataclass(frozen=True, kw_only=True)
class Ellipse:
    """Quadratic gap under a load.

    The radii are of the relative curvature in its principal axes; the first axis is turned from x.
    """

    radius_x_mm: float
    radius_s_mm: float
    turn_rad: float
    load_N: float

    @property
    def half(self) -> bool:
        """Whether the gap is even along x."""
        return self.turn_rad == 0.0

    @cached_property
    def exact(self) -> Exact:
        """Exact contact at the original size."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        turn = np.array([[c, -s], [s, c]])
        h = turn @ np.diag([1.0 / self.radius_x_mm, 1.0 / self.radius_s_mm]) @ turn.T
        hertz = hertz_from_hessian(h, normal_force_N=self.load_N, contact_modulus_MPa=MODULUS_MPA)
        measures = read_hertz_measures(hertz).as_dict()
        # half the chord along x through the centre, and half the extent across
        c, s = math.cos(hertz.orientation_rad), math.sin(hertz.orientation_rad)
        length, width = 1.0 / math.hypot(c / hertz.a_mm, s / hertz.b_mm), 0.5 * hertz.extent_y_mm
        return Exact(
            hertz=hertz,
            hessian_per_mm=h,
            gap=lambda x, s: 0.5 * h[0, 0] * x**2 + h[0, 1] * x * s + 0.5 * h[1, 1] * s**2,
            true={name: measures.get(name, 0.0) for name in JUDGED},
            elements_mm=(length, width),
            nodes_mm=(length, width),
            middle_mm=0.0,
            reach_mm=(MOST_LEANING * length, MOST_LEANING * width),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Galin:
    """Pressure with a polynomial gap: an ellipsoid times a polynomial.

    p = sqrt(1 - X^2 - Y^2) sum c[i, j] X^i Y^j with X = x / a, Y = y / b, even in X. Source: Galin (1953); Johnson
    (1985), section 3.2: polynomial pressures over an ellipse have polynomial deflections, of a degree higher by two.
    Here u is integrated along lines through a place, on which p / r dA is a polynomial times a root of a square (Gauss
    and Chebyshev's quadrature, exact), and over their angles, which converges exponentially.

    Attributes
    ----------
    coefficients (n, m)
        c in MPa.
    """

    coefficients: np.ndarray
    a_mm: float
    b_mm: float
    half = True

    def pressure_MPa(self, x: Any, y: Any) -> np.ndarray:
        """Pressure at places (mm) from the middle of the ellipse."""
        x, y = np.broadcast_arrays(x / self.a_mm, y / self.b_mm)
        return polyval2d(x, y, self.coefficients) * np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))

    def over_ellipse(self) -> np.ndarray:
        """Pressure on a grid over the ellipse."""
        steps = np.linspace(-1.0, 1.0, 161)
        return self.pressure_MPa(self.a_mm * steps[80:, None], self.b_mm * steps)

    @property
    def is_contact(self) -> bool:
        """Whether this is a contact within the limits of the study.

        No pressure is negative, nothing else touches, and centre and valley are within their limits.
        """
        return bool(
            self.over_ellipse().min() >= 0.0
            and self.least_opening > 0.0
            and not math.isnan(self.touch)
            and abs(self.centre) <= MOST_CENTRE
            and self.exact.true["valley"] <= MOST_VALLEY
        )

    def deflection_mm(self, x: Any, y: Any) -> np.ndarray:
        """Sum of both bodies' deflections (n,) at places X, Y (n,) inside or outside."""
        x, y = np.asarray(x)[:, None], np.asarray(y)[:, None]
        away, fractions = np.maximum(np.hypot(x, y), 1.0 + 1e-12), (np.arange(LINES) + 0.5) / LINES
        # from outside, only lines that meet the ellipse count: the sine is their distance from its middle
        passing = np.pi * (fractions - 0.5)
        turn, inside = np.arcsin(np.sin(passing) / away), np.hypot(x, y) < 1.0
        angle = np.where(inside, np.pi * fractions, np.arctan2(y, x) + turn)
        weight = np.where(inside, 1.0, np.cos(passing) / (away * np.cos(turn))) * np.pi / LINES
        c, s = np.cos(angle), np.sin(angle)
        over_distance = self.a_mm * self.b_mm / np.hypot(self.a_mm * c, self.b_mm * s)
        total = weight * over_distance * self._along_lines(x, y, c, s)
        return np.asarray(total.sum(axis=1)) / (np.pi * MODULUS_MPA)

    def _along_lines(self, x: np.ndarray, y: np.ndarray, c: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Integrals of the pressure along lines through places in directions (c, s).

        In X, Y the ellipse is a circle.
        """
        count = sum(self.coefficients.shape)
        at = np.arange(1, count + 1) * np.pi / (count + 1)
        nodes, weights = np.cos(at), np.pi / (count + 1) * np.sin(at) ** 2
        square = np.maximum(1.0 - (x * s - y * c) ** 2, 0.0)
        t = np.sqrt(square)[..., None] * nodes - (x * c + y * s)[..., None]
        values = polyval2d(x[..., None] + t * c[..., None], y[..., None] + t * s[..., None], self.coefficients)
        return np.asarray(square * (values @ weights))

    @cached_property
    def gap_coefficients_mm(self) -> np.ndarray:
        """Coefficients (n, m) in X and Y of the gap less the approach.

        Inside, this is the negative deflection.
        """
        degree = max(i + j for i, j in np.argwhere(self.coefficients)) + 2
        powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
        radius = 0.98 * np.cos((np.arange(degree + 2) + 0.5) * np.pi / (2 * degree + 4))[:, None]
        around = 2.0 * np.pi * np.arange(2 * degree + 5) / (2 * degree + 5)
        x, y = (radius * np.cos(around)).ravel(), (radius * np.sin(around)).ravel()
        terms = np.array([x**i * y**j for i, j in powers]).T
        deflection = self.deflection_mm(x, y)
        gap_terms, *_ = np.linalg.lstsq(terms, deflection, rcond=None)
        assert np.abs(terms @ gap_terms - deflection).max() < 1e-12 * deflection.max()
        gap = np.zeros((degree + 1, degree + 1))
        gap[tuple(np.transpose(powers))] = -gap_terms
        return gap

    @cached_property
    def least_opening(self) -> float:
        """Smallest gap of the loaded surfaces outside, over the approach.

        It is positive if nothing else touches.
        """
        radius, around = np.array(OUTSIDE)[:, None], np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
        x, y = (radius * np.cos(around)).ravel(), (radius * np.sin(around)).ravel()
        return float((self.gap_mm(x, y) + self.deflection_mm(x, y)).min() / -self.gap_coefficients_mm[0, 0])

    def gap_mm(self, x: Any, y: Any) -> np.ndarray:
        """Gap less the approach at places X, Y."""
        x, y = np.broadcast_arrays(x, y)
        rim_ratio = np.maximum(np.hypot(x, y) / RIM, 1.0)
        gap = self.gap_coefficients_mm
        return polyval2d(x / rim_ratio, y / rim_ratio, gap) - 2.0 * gap[0, 0] * (rim_ratio - 1.0)

    @cached_property
    def touch(self) -> float:
        """Y of the place where the unloaded surfaces touch first.

        NaN if that place is not on the line X = 0 of the patch.
        """
        x, y = np.meshgrid(np.linspace(0.0, 1.5, 76), np.linspace(-1.5, 1.5, 1501), indexing="ij")
        gap = self.gap_coefficients_mm
        i, j = np.unravel_index(np.argmin(values := self.gap_mm(x, y)), values.shape)
        if i > 0 or abs(y[i, j]) > 1.0:
            return math.nan
        place, slope = float(y[i, j]), polyder(gap[0])
        for _ in range(20):
            place -= float(polyval(place, slope) / polyval(place, polyder(slope)))
        return place

    @property
    def approach_mm(self) -> float:
        """Approach of the bodies from their first touch."""
        return -float(self.gap_mm(0.0, self.touch))

    def moment(self, i: int, j: int) -> float:
        """Mean of X^i Y^j over the pressure, times the force over a b."""
        gamma = math.gamma
        return sum(
            float(c)
            * gamma(0.5 * (i + k + 1))
            * gamma(0.5 * (j + n + 1))
            * gamma(1.5)
            / gamma(0.5 * (i + k + j + n + 5))
            for (k, n), c in np.ndenumerate(self.coefficients)
            if (i + k) % 2 == (j + n) % 2 == 0
        )

    @cached_property
    def centre(self) -> float:
        """Y of the centre of pressure."""
        return self.moment(0, 1) / self.moment(0, 0)

    def on(self, grid: ContactGrid) -> Rung:
        """Pressure on a grid about the contact point."""
        pressure = self.pressure_MPa(grid.x_mm[:, None], grid.s_mm + self.touch * self.b_mm)
        area = grid.whole_area_mm2()
        return Rung(
            grid=grid,
            pressure_MPa=pressure,
            gap_mm=np.zeros(grid.shape),
            approach_mm=1.0,
            normal_force_N=float(area @ pressure.ravel()),
            status="converged",
            iterations=1,
            compliance_calls=1,
            contact_residual=0.0,
            penetration_residual=0.0,
            load_balance=0.0,
        )

    @cached_property
    def exact(self) -> Exact:
        """Exact contact at the original size."""
        a, b, y, gap, force = self.a_mm, self.b_mm, self.touch, self.gap_coefficients_mm, self.moment(0, 0)
        hessian = np.diag([polyval(y, gap[2]) * 2.0 / a**2, polyval(y, polyder(gap[0], 2)) / b**2])
        hertz = hertz_from_hessian(hessian, normal_force_N=a * b * force, contact_modulus_MPa=MODULUS_MPA)
        # a fine grid is affordable: the pressure is evaluated, not solved
        steps = np.arange(-301, 302) / 300.0
        fine = self.on(ContactGrid(x_mm=a * steps[301:], s_mm=b * (steps - y), half=True))
        return Exact(
            hertz=hertz,
            hessian_per_mm=hessian,
            gap=lambda x, s: self.gap_mm(x / a, s / b + y) + self.approach_mm,
            true={
                "p_max_MPa": float(fine.pressure_MPa.max()),
                "area_mm2": math.pi * a * b,
                "a_mm": a * math.sqrt(5.0 * self.moment(2, 0) / force),
                "b_mm": b * math.sqrt(5.0 * (self.moment(0, 2) / force - self.centre**2)),
                "centre_over_b": (self.centre - y) * b / (0.5 * hertz.extent_y_mm),
                "valley": measure_valley_depth(fine.pressure_MPa),
                "separate_load": 0.0,
                "misplaced_load": read_hertz_misfit(fine, hertz).misplaced_load,
            },
            elements_mm=measure_element_semi_axes_mm(fine),
            nodes_mm=measure_resolved_lobes_mm(measure_lobe_sizes(fine)),
            middle_mm=-y * b,
            reach_mm=(a, b),
        )


def galin_by_chance(rng: np.random.Generator) -> Galin:
    """Random contact that is not an ellipse.

    It is shifted, flat on top, or has two lobes, equal or unequal.
    """
    # many contacts with two lobes are not open outside, and are left out
    kind, between = (0, 0, 0, 1, 2, 2, 3, 3, 3)[int(rng.integers(9))], rng.uniform
    across = np.zeros(6)
    lobes = math.exp(between(0.0, math.log(60.0)))
    if kind == 0:
        line = polypow([1.0, rng.choice((-1.0, 1.0)) * between(0.4, 1.0)], int(rng.integers(1, 4)))
    elif kind == 1:
        line = np.array([1.0, 0.0, between(0.2, 0.7), 0.0, between(0.0, 0.3)])
    elif kind == 2:
        line = np.array([1.0, 0.0, lobes, 0.0, between(0.0, 2.0)])
    else:
        unlike = math.sqrt(lobes)
        line = np.array([1.0, unlike * between(-1.0, 1.0), lobes, unlike * between(-0.3, 0.3), between(0.0, 2.0)])
    across[: line.size] = line
    coefficients = np.zeros((3, 6))
    coefficients[0], coefficients[2, :2] = across, (between(-0.3, 0.6), between(-0.3, 0.3))
    b_mm = math.exp(between(0.0, math.log(10.0)))
    galin = Galin(coefficients=coefficients, a_mm=b_mm * math.exp(between(-math.log(5.0), math.log(5.0))), b_mm=b_mm)
    return replace(galin, coefficients=coefficients * between(600.0, 1800.0) / galin.over_ellipse().max())


# Surfaces that are flat over the zone.
FLAT = Case(rail="circle:20000", wheel="cylinder:20000", inclination_rad=0.0)
LONGEST_MM = 6.0
# Length over width of the elements is close to the ratio of the patch: a mesh serves ratios within a third of its own.
# ASPECTS are for axes along the track, TURNED_ASPECTS for turned axes. SHARED meshes are made for larger loads than the
# loads that use them, as in a sweep. REFINED have finer meshes too.
ASPECTS = tuple(float(ratio) for ratio in np.geomspace(0.1, 10.0, 9))
TURNED_ASPECTS = (ASPECTS[3], ASPECTS[4], ASPECTS[6])
SHARED = ASPECTS[1::2]
REFINED = ((ASPECTS[1], True), (ASPECTS[4], True), (ASPECTS[6], True), (ASPECTS[4], False))
# For contacts that are not ellipses, elements are made for a lobe: length over width, and width of the zone over lobe.
OTHER_ZONES = ((ASPECTS[2], 1.6), (ASPECTS[4], 1.6), (ASPECTS[6], 1.6), (ASPECTS[4], 2.8), (ASPECTS[4], 5.3))
LONGER = 1.7
# Mesh levels after an unresolved verdict on the first two, and levels of `standard`, the finest first; 0 is coarsest.
MORE_MESHES = {"refined": (2, 1, 0), "standard": (3, 2)}
# Elements on the semi-axis of a patch on the coarsest mesh, as in the product at `quick`.
FEWEST = (RESOLUTIONS["quick"] + 0.25) / MESH_RATIO
# Loads of a sweep share meshes whose elements are finer than necessary by at most this factor.
MOST_FINER = 1.5
MOST_UNEQUAL = 1.34
# Largest extent of a turned ellipse along x, over its chord through the centre.
MOST_LEANING = 1.3
MARGIN_ELEMENTS = 4
NUMBER, QUICK_NUMBER = 260, 24
OTHERS, QUICK_OTHERS = 60, 6


@dataclass(frozen=True, kw_only=True)
class Zone:
    """Fine meshes that several contacts share.

    Attributes
    ----------
    aspect
        Length over width of the elements.
    longer, wider
        Length and width of the zone, over the lengths that elements are made for.
    finer
        Largest factor by which elements may be finer than a contact needs.
    """

    aspect: float
    half: bool
    longer: float = 1.0
    wider: float = 1.0
    finer: float = MOST_UNEQUAL

    def steps_mm(self, level: int) -> tuple[float, float]:
        """Element sizes along x and across; level 0 is the coarsest."""
        longest = LONGEST_MM / (FEWEST * MOST_FINER * max(self.longer, self.wider)) / MESH_RATIO**level
        return (longest, longest / self.aspect) if self.aspect >= 1.0 else (longest * self.aspect, longest)

    def counts(self, level: int) -> tuple[float, float]:
        """Elements on half the length and width of the largest patch."""
        elements = FEWEST * self.finer * MESH_RATIO**level
        return elements * self.longer * (1.0 if self.half else MOST_LEANING), elements * self.wider


@dataclass(frozen=True, kw_only=True)
class ExactCase:
    """Exact contact with its meshes and the offsets of their nodes.

    Attributes
    ----------
    finer
        Elements on the patch, over the elements that it needs.
    offset
        Where the nodes lie, in parts of a step along x and across: on the meshes and on the finer grid.
    """

    contact: Ellipse | Galin
    zone: Zone
    finer: float
    testing: bool
    offset: tuple[tuple[float, float], ...]

    @cached_property
    def exact(self) -> Exact:
        """The contact at the size of its meshes."""
        steps, elements = self.zone.steps_mm(0), FEWEST * self.finer
        return self.contact.exact.scaled(
            max(elements * step / size for step, size in zip(steps, self.sizes, strict=True))
        )

    @property
    def sizes(self) -> tuple[float, float]:
        """Half length and width that elements are made for, at the original size."""
        return self.contact.exact.elements_mm

    @property
    def unequal(self) -> float:
        """Ratio between the aspects of patch and elements, at least 1."""
        ratio = self.sizes[0] / self.sizes[1] / self.zone.aspect
        return max(ratio, 1.0 / ratio)

    @property
    def fits(self) -> bool:
        """Whether the patch lies in the zone."""
        room = (count * step for count, step in zip(self.zone.counts(0), self.zone.steps_mm(0), strict=True))
        return all(reach <= limit for reach, limit in zip(self.exact.reach_mm, room, strict=True))


def offsets(rng: np.random.Generator) -> tuple[tuple[float, float], ...]:
    """Random offsets of nodes."""
    return tuple((float(rng.uniform()), float(rng.uniform())) for _ in range(4))


def exact_cases(quick: bool = False) -> list[ExactCase]:
    """Random ellipses from a fixed seed."""
    rng = np.random.default_rng(SEED)
    straight_aspects, turned_aspects = ((ASPECTS[4], ASPECTS[6]), ()) if quick else (ASPECTS, TURNED_ASPECTS)
    case_list: list[ExactCase] = []
    while len(case_list) < (QUICK_NUMBER if quick else NUMBER):
        radii = np.exp(rng.uniform(math.log(10.0), math.log(2000.0), 2))
        load = math.exp(rng.uniform(math.log(5e3), math.log(200e3)))
        turn = rng.uniform(-0.25, 0.25) * math.pi if rng.uniform() < 0.3 else 0.0
        offset, testing, spare = offsets(rng), bool(rng.integers(2)), rng.uniform()
        ellipse = Ellipse(radius_x_mm=float(radii[0]), radius_s_mm=float(radii[1]), turn_rad=turn, load_N=load)
        hertz, (length, width) = ellipse.exact.hertz, ellipse.exact.elements_mm
        ratio = length / width
        unequal = {
            aspect: max(ratio / aspect, aspect / ratio) for aspect in (turned_aspects if turn else straight_aspects)
        }
        aspect = min(unequal, key=lambda a: unequal[a], default=math.nan)
        leans = 0.5 * hertz.extent_x_mm > MOST_LEANING * length
        if unequal and unequal[aspect] <= MOST_UNEQUAL and not leans and 0.1 <= hertz.a_mm / hertz.b_mm <= 10.0:
            shared = aspect in SHARED
            finer = (MOST_FINER / MOST_UNEQUAL) ** spare if shared else 1.0
            zone = Zone(aspect=aspect, half=ellipse.half, finer=MOST_FINER if shared else MOST_UNEQUAL)
            case_list.append(ExactCase(contact=ellipse, zone=zone, finer=finer, testing=testing, offset=offset))
    return case_list


def other_cases(quick: bool = False) -> list[ExactCase]:
    """Random contacts that are not ellipses.

    No pressure is negative, and the gap is open outside.
    """
    rng = np.random.default_rng(SEED + 4)
    zone_shapes = OTHER_ZONES[3:4] if quick else OTHER_ZONES
    zones = [Zone(aspect=aspect, half=True, longer=LONGER, wider=wider) for aspect, wider in zone_shapes]
    case_list: list[ExactCase] = []
    while len(case_list) < (QUICK_OTHERS if quick else OTHERS):
        contact, offset, testing = galin_by_chance(rng), offsets(rng), bool(rng.integers(2))
        if not contact.is_contact:
            continue
        candidates = [
            ExactCase(contact=contact, zone=zone, finer=1.0, testing=testing, offset=offset) for zone in zones
        ]
        # the narrowest zone, and among equally wide zones the elements whose aspect is closest to the patch
        fitting = [case for case in candidates if case.fits]
        if fitting:
            case_list.append(min(fitting, key=lambda case: (case.zone.wider, case.unequal)))
    return case_list


@dataclass(frozen=True, kw_only=True, eq=False)
class GivenGap(Placement):
    """Flat bodies with a given gap (mm), independent of their surfaces."""

    of: Exact

    def gap(self, x: Any, s: Any) -> np.ndarray:
        """The gap at places (mm) from its lowest point."""
        return self.of.gap(np.asarray(x), np.asarray(s))


def flat_bodies(kind: Zone, level: int) -> CoupledBodies:
    """Coupled bodies with a zone for the largest patch of these elements."""
    # a negligible yaw makes it the whole model instead of half
    case = replace(FLAT, yaw_rad=0.0 if kind.half else 1e-9)
    (step_x, step_s), (along_x, across) = kind.steps_mm(level), kind.counts(level)
    count_x, count = math.ceil(along_x) + MARGIN_ELEMENTS, math.ceil(across) + MARGIN_ELEMENTS
    zone = FineZone(
        half_length_mm=count_x * step_x,
        s_low_mm=-count * step_s,
        s_high_mm=count * step_s,
        step_x_mm=step_x,
        step_s_mm=step_s,
        semi_axis_mm=across / kind.wider * step_s,
    )
    return couple_bodies(case, place_case(case), zone, Clock(None))


def move_grid(grid: ContactGrid, offset: tuple[float, float], middle_mm: float = 0.0) -> ContactGrid:
    """Move a grid by fractions of its spacing, and across to a middle.

    The offset is at most half a spacing to each side.
    """
    (x, s), (step_x, step_s) = offset, grid.steps_mm
    along_x = 0.0 if grid.half else (x - 0.5) * step_x
    return replace(grid, x_mm=grid.x_mm + along_x, s_mm=grid.s_mm + middle_mm + (s - 0.5) * step_s)


ContactSolutions = tuple[Rung, Rung, Rung, float]
"""Rungs of a contact, and the compliance error of its elements.

Two rungs have different estimates of the opening that is due to the elements; the third is on the elements' own nodes.
"""


def contact(base: CoupledProblem, bodies: CoupledBodies, case: ExactCase, level: int) -> ContactSolutions:
    """Solve an exact case on a mesh level, and read it like the product."""
    exact, flat_placement = case.exact, place_case(FLAT)
    gap = GivenGap(
        rail=flat_placement.rail, wheel=flat_placement.wheel, contact_points=flat_placement.contact_points, of=exact
    )
    shifted_bodies = replace(bodies, grid=move_grid(bodies.grid, case.offset[level], exact.middle_mm))
    problem = base.with_gap(shifted_bodies.grid.weighted_mean(gap.gap))
    load = exact.hertz.normal_force_N
    solution = problem.solve(load)
    true_gap = replace(make_true_gap(FLAT, flat_placement), placement=gap)
    nodal, *added_openings = problem.read(solution, true_gap, shifted_bodies)
    grid = make_covering_grid(exact.fine_grid(case.offset[3], half=case.contact.half), nodal)
    fe, alternative = (true_gap.solve(grid, load, added=added) for added in added_openings)
    assert solution.status == fe.status == alternative.status == "converged"
    return fe, alternative, nodal, base.compliance_error


# --- errors ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class ErrorRow:
    """True and stated errors of the judged measures of a case.

    They are relative to the finite elements, or absolute.
    """

    of: str
    case: str
    resolution: str
    true: Mapping[str, float]
    stated: Mapping[str, float]


@lru_cache(maxsize=2)
def exact_errors(quick: bool = False) -> tuple[ErrorRow, ...]:
    """Errors of all exact cases; meshes are made once per zone."""
    cases = [*exact_cases(quick), *other_cases(quick)]
    error_rows: list[ErrorRow] = []
    for zone in sorted({case.zone for case in cases}, key=lambda zone: (zone.aspect, zone.half, zone.wider)):
        zone_cases = [case for case in cases if case.zone == zone]
        refined = zone.wider == 1.0 and (zone.aspect, zone.half) in REFINED and not quick
        meshes = {"quick": (1, 0)} | (MORE_MESHES if refined else {})
        solutions = [_on_meshes(zone_cases, level) for level in range(max(levels[0] for levels in meshes.values()) + 1)]
        for resolution, levels in meshes.items():
            for case, *by_level in zip(zone_cases, *(solutions[level] for level in levels), strict=True):
                error_rows.append(_finest_errors(case, resolution, by_level))
                # elements that are too slender are unresolved in the product, and have no stated error
                if not abs(by_level[0][3]) > COMPLIANCE_ERROR_LIMIT:
                    error_rows.append(_own_nodes_errors(case, resolution, by_level))
    return tuple(error_rows)


def _on_meshes(cases: Sequence[ExactCase], level: int) -> list[ContactSolutions]:
    """Solutions of the cases of a zone on a mesh level."""
    bodies = flat_bodies(cases[0].zone, level)
    try:
        base = make_coupled_problem(make_true_gap(FLAT, place_case(FLAT)), bodies)
        return [contact(base, bodies, case, level) for case in cases]
    finally:
        bodies.close()


def _finest_errors(case: ExactCase, resolution: str, solutions: Sequence[ContactSolutions]) -> ErrorRow:
    """True and stated errors on the finest of several mesh levels."""
    finest, alternative, *_ = solutions[0]
    rungs = [fe for fe, *_ in solutions]
    values, (alternative_measures,) = _read(rungs, case.exact), _read([alternative], case.exact)
    quality = Stated(
        residual=finest.residual, parting=any(is_barely_separate(rung) for rung in rungs), skew=compute_skewness(finest)
    )
    stated = {
        name: estimate_uncertainty(
            name, [measures[name] for measures in values], quality, otherwise=alternative_measures[name]
        )
        for name in JUDGED
    }
    return _error_row(
        case, SETS[2 * int(isinstance(case.contact, Galin)) + int(case.testing)], resolution, values[0], stated
    )


def _own_nodes_errors(case: ExactCase, resolution: str, solutions: Sequence[ContactSolutions]) -> ErrorRow:
    """Errors of the contact on the nodes of the finest elements."""
    rungs = [nodal for _, _, nodal, _ in solutions]
    finest, values = rungs[0], _read(rungs, case.exact)
    patch = read_patch(finest)
    lengths = (
        case.exact.elements_mm if isinstance(case.contact, Ellipse) else (patch.a_mm, patch.b_mm / len(patch.lobes))
    )
    stated = {
        name: estimate_elements_budget(
            name,
            [measures[name] for measures in values],
            elements=min(length / step for length, step in zip(lengths, finest.grid.steps_mm, strict=True)),
            compliance_error=solutions[0][3],
            residual=finest.residual,
        ).total
        for name in JUDGED
    }
    return _error_row(case, OWN_NODES[int(isinstance(case.contact, Galin))], resolution, values[0], stated)


def _read(rungs: Sequence[Rung], exact: Exact) -> list[dict[str, float]]:
    """Judged measures of rungs, with Hertz's ellipse at the contact point as reference."""
    return [read_measures(rung).as_dict() | read_hertz_misfit(rung, exact.hertz).as_dict() for rung in rungs]


def _error_row(
    case: ExactCase, set_name: str, resolution: str, measures: Mapping[str, float], stated: Mapping[str, float]
) -> ErrorRow:
    """Error row of a case.

    Errors are relative to the value read if Hertz's theory has the measure too, otherwise absolute.
    """
    true = case.exact.true
    return ErrorRow(
        of=set_name,
        case=_case_text(case),
        resolution=resolution,
        true={
            name: abs(true[name] / measures[name] - 1.0) if name in MEASURES else abs(true[name] - measures[name])
            for name in JUDGED
        },
        stated={
            name: (stated[name] - UNCERTAINTIES[name].cut_planes)
            * (true[name] / measures[name] if name in MEASURES else 1.0)
            for name in JUDGED
        },
    )


def _case_text(case: ExactCase) -> str:
    exact = case.exact
    if isinstance(case.contact, Galin):
        return (
            f"a/b {case.contact.a_mm / case.contact.b_mm:.2f}, centre {case.contact.centre:+.2f} b,"
            f" valley {exact.true['valley']:.2f}"
        )
    hertz = exact.hertz
    return (
        f"a/b {hertz.a_mm / hertz.b_mm:.2f}, {math.degrees(hertz.orientation_rad):.0f} degrees,"
        f" {case.finer:.2f} times finer"
    )


def real_errors(rows: Sequence[Mapping[str, Any]]) -> list[ErrorRow]:
    """Errors of each real position against its solution on the finest meshes."""
    place = ("rail", "inclination_rad", "lateral_shift_mm", "load_kN")
    finest = {tuple(row[key] for key in place): row for row in rows if row["resolution"] == "standard"}
    coarse_rows = [
        row for row in rows if row["resolution"] != "standard" and tuple(row[key] for key in place) in finest
    ]
    testing = {(rail, INCLINATIONS[slope], shift) for rail, slope, shift, _ in random_positions(*TESTING)}
    error_rows = []
    for row in coarse_rows:
        best = finest[tuple(row[key] for key in place)]
        true, stated = {}, {}
        for name in JUDGED:
            value, uncertainty, factor = deviation_columns(name)
            true[name] = abs(float(row[value]) - float(best[value])) / factor
            of_bodies = UNCERTAINTIES[name].cut_planes * (
                abs(1.0 + float(row[value]) / factor) if name in MEASURES else 1.0
            )
            stated[name] = float(row[uncertainty]) / factor - of_bodies
        error_rows.append(
            ErrorRow(
                of=SETS[4 + int((row["rail"], row["inclination_rad"], row["lateral_shift_mm"]) in testing)],
                case=f"{row['rail']}, inclined {1e3 * row['inclination_rad']:.0f} mrad, {row['lateral_shift_mm']:g} mm,"
                f" {row['load_kN']:g} kN",
                resolution=str(row["resolution"]),
                true=true,
                stated=stated,
            )
        )
    return error_rows


def outside_percent(error_rows: Sequence[ErrorRow], measure: str) -> float:
    """Percentage of cases with a true error larger than the stated error."""
    return 100.0 * float(np.mean([error_row.true[measure] > error_row.stated[measure] for error_row in error_rows]))


def stated_over_true(error_rows: Sequence[ErrorRow], measure: str) -> float:
    """Median of the stated errors over the 95 % quantile of the true errors.

    Infinite if no case has a true error.
    """
    quantile_95 = float(np.quantile([error_row.true[measure] for error_row in error_rows], 0.95))
    return (
        float(np.median([error_row.stated[measure] for error_row in error_rows])) / quantile_95
        if quantile_95 > 1e-9
        else math.inf
    )


# --- tables and checks ----------------------------------------------------------------------------------------------


def conclude(rows: list[dict[str, Any]], out: Path) -> str:
    """Share of cases inside the stated error, by measure and set."""
    error_rows = [*exact_errors(_is_quick(rows)), *real_errors(rows)]
    _write(error_rows, out / "errors.csv")
    _figure(error_rows, out / "12_uncertainty.png")
    lines = [
        "measure          set              cases  inside   true 95 %   stated mean  median  median stated / true 95 %"
    ]
    for name in JUDGED:
        for set_name in (*SETS, *OWN_NODES):
            set_rows = [error_row for error_row in error_rows if error_row.of == set_name]
            if set_rows:
                true, stated = (
                    100.0 * np.array([getattr(error_row, k)[name] for error_row in set_rows])
                    for k in ("true", "stated")
                )
                lines.append(
                    f"{name:<16} {set_name:<15} {len(set_rows):6d} {100.0 - outside_percent(set_rows, name):6.1f} %"
                    f" {np.quantile(true, 0.95):9.3f} % {stated.mean():11.3f} % {np.median(stated):6.3f} %"
                    f" {stated_over_true(set_rows, name):10.2f}"
                )
    missed = [check for check in checks(rows) if not check.passed]
    return "\n".join([*lines, f"{len(missed)} of {len(checks(rows))} expectations are not met."])


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """Checks of the cases outside, and of stated over true errors, by measure and set."""
    error_rows = [*exact_errors(_is_quick(rows)), *real_errors(rows)]
    check_list = []
    for name in JUDGED:
        for set_name in (*SETS, *OWN_NODES):
            set_rows = [error_row for error_row in error_rows if error_row.of == set_name]
            if not set_rows:
                continue
            exact = not set_name.startswith("real")
            common_entries = {
                "case": f"{set_name}, {len(set_rows)} cases",
                "reference": "exact contact" if exact else "9 elements and 48 nodes a semi-axis",
                "kind": "analytic" if exact else "invariant",
                "expected": None,
            }
            outside = outside_percent(set_rows, name)
            check_list.append(
                Check(
                    quantity=f"{name}, cases outside, %", value=outside, limit_percent=OUTSIDE_PERCENT, **common_entries
                )
            )
            # readings of coarse nodes have large stated errors: they decide only the verdict on these nodes
            if set_name in OWN_NODES or (set_name.startswith("ellipses") and name in OF_SKEW):
                continue
            # measures that are zero, and read as zero, have no true error
            if math.isfinite(ratio := stated_over_true(set_rows, name)) and not _is_quick(rows):
                limit = 100.0 * MOST_STATED
                check_list.append(
                    Check(
                        quantity=f"{name}, stated uncertainty over true error, %",
                        value=100.0 * ratio,
                        limit_percent=limit,
                        is_error=False,
                        explanation=WIDE_REASON,
                        **common_entries,
                    )
                )
    return check_list


def _is_quick(rows: Sequence[Mapping[str, Any]]) -> bool:
    return len(rows) <= len(cases(quick=True))


def _write(error_rows: Sequence[ErrorRow], path: Path) -> None:
    """Write all errors as a table with a line per case."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["set", "case", "resolution", *(f"{k} {name}" for name in JUDGED for k in ("true", "stated"))])
        for error_row in error_rows:
            numbers = [f"{values[name]:.6g}" for name in JUDGED for values in (error_row.true, error_row.stated)]
            writer.writerow([error_row.of, error_row.case, error_row.resolution, *numbers])


def _figure(error_rows: Sequence[ErrorRow], path: Path) -> None:
    """Draw the stated against the true error of every measure.

    Below the line the stated error is too small.
    """
    figure = blank_figure(13.5, 6.6)
    panels = figure.subplots(2, 4)
    # an error of zero has no place on logarithmic axes
    smallest_percent = 1e-4
    for name, ax in zip(JUDGED, panels.flat, strict=True):
        for set_name, marker, colour in zip(SETS, "ox+*^s", SERIES_COLOURS, strict=False):
            set_rows = [error_row for error_row in error_rows if error_row.of == set_name]
            true, stated = (
                [max(100.0 * getattr(error_row, k)[name], smallest_percent) for error_row in set_rows]
                for k in ("true", "stated")
            )
            ax.plot(true, stated, marker, ms=4, mfc="none", color=colour, label=set_name)
        ends = (
            smallest_percent,
            100.0 * max(max(error_row.true[name], error_row.stated[name]) for error_row in error_rows),
        )
        ax.plot(ends, ends, color="0.4", lw=0.8)
        set_plain_log_scale(ax)
        ax.set_title(MEASURE_WORDS[name].name, fontsize=10)
        add_grid(ax)
    for ax in panels[1]:
        ax.set_xlabel("true error in %")
    for ax in panels[:, 0]:
        ax.set_ylabel("stated error in %")
    add_legend_beside(panels[0, -1])
    save_figure(figure, path)


def main() -> None:
    from fecontact.cli import run_script

    run_script(__file__)


if __name__ == "__main__":
    main()
