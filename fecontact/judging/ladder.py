"""The rungs between Hertz and the finite elements on the same nodes, and the change by each step and its cause."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import zoom

from fecontact.arrays import Floats
from fecontact.contact.grid import Field, Rung
from fecontact.contact.patch import Patch, signed_square
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact
from fecontact.judging.measures import (
    MEASURES,
    MISFITS,
    Measures,
    Misfit,
    deviations,
    hertz_measures,
    measures_of,
    misfit_of,
    patch_of,
)
from fecontact.placement.wheel_on_rail import Placement


@dataclass(frozen=True, kw_only=True)
class Step:
    """A step of the ladder, from a rung to another.

    Attributes
    ----------
    shown
        Whether tables and pictures show the step; not if it only checks the numbers.
    cause
        Why Hertz is off if this step changes a measure most.
    """

    name: str
    start: str
    end: str
    shown: bool = False
    cause: str = ""


GAP = Step(
    name="quadratic_to_true_gap",
    start="half_space_quadratic",
    end="half_space",
    shown=True,
    cause="shape of the gap",
)
BODIES = Step(name="half_space_to_bodies", start="half_space", end="fe", shown=True, cause="finite bodies")
PLASTIC = Step(name="bodies_to_plastic", start="fe", end="fe_plastic", shown=True, cause="plasticity")
DISCRETE = Step(name="hertz_to_quadratic", start="hertz", end="half_space_quadratic")
STEPS = (
    DISCRETE,
    GAP,
    BODIES,
    Step(name="elements_to_fe", start="elements", end="fe"),
    PLASTIC,
)
"""All steps in order; the last step is for bodies that may yield."""


RUNGS: Mapping[str, str] = {
    "hertz": "closed form",
    "half_space_quadratic": "Hertz's gap on a discrete half-space, which checks the discretisation",
    "half_space": "the true gap on the half-space",
    "elements": "the true gap between the finite bodies, on their elements' own nodes",
    "fe": "on finer nodes, with a half-space of the bodies' material in place of what the elements answer near by",
    "fe_plastic": "the first loading of bodies that yield, where a yield stress is given",
}
"""Description of each rung, by its name, from Hertz on."""


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """Measures on each of the `RUNGS`, and their deviations from Hertz, all under the same normal force.

    `half_space`, `fe` and `fe_plastic` have the same nodes: their differences do not come from the discretisation.
    """

    rungs: Mapping[str, Measures]
    misfits: Mapping[str, Misfit]

    @classmethod
    def of(cls, hertz: HertzContact, rungs: Sequence[tuple[str, Rung]]) -> Ladder:
        """Read the rungs of a load, from Hertz on."""
        return cls(
            rungs={"hertz": hertz_measures(hertz), **{name: measures_of(rung) for name, rung in rungs}},
            misfits={name: misfit_of(rung, hertz) for name, rung in rungs},
        )

    @property
    def steps(self) -> dict[str, dict[str, float]]:
        """Change of each measure by each step: relative, or absolute if Hertz has no value."""
        rungs = {name: rung.as_dict() for name, rung in self.rungs.items()}
        beside = {"hertz": dict.fromkeys(MISFITS, 0.0)} | {name: one.as_dict() for name, one in self.misfits.items()}
        return {
            step.name: {m: rungs[step.end][m] / rungs[step.start][m] - 1.0 for m in MEASURES}
            | {m: beside[step.end][m] - beside[step.start][m] for m in MISFITS}
            for step in STEPS
            if step.end in rungs
        }


# --- Whether Hertz, the half-space and the true gap say the same where all three are one.

REFERENCE_LIMIT = 1e-3
"""Largest `reference_error` with which a load may be used; healthy ones have 3e-4 at most, a fault of 1 % has 1e-2."""
# Measures in which Hertz's gap on the half-space must be Hertz's ellipse, and how many times worse than the others each
# is read. Of 84 pairs of the library (10 to 160 kN, a/b 0.5 to 22, yaw 0 and 5 mrad) peak, a and b are within 6.1e-5,
# 2.1e-4 and 6.2e-5, and the area, whose edge lies between nodes, within 1.4e-3. It is within 2.4e-3 of ellipses with
# curvatures of 1 to 500 that are turned by 50 mrad, and within 7e-3 of 1 to 1000.
_READ_WORSE = {"p_max_MPa": 1.0, "a_mm": 1.0, "b_mm": 1.0, "area_mm2": 10.0}
# Curvatures are read off the gap on so many mm: farther, junctions and knots of lines come in; nearer, rounding.
_READ_OVER_MM = 0.002


def reference_error(ladder: Ladder, placement: Placement) -> float:
    """Largest error of the references against each other, relative.

    Hertz's gap on the half-space has Hertz's peak pressure, semi-axes and area (whose error counts a tenth, as it is
    read worse), and the true gap has Hertz's curvatures at the touch point (on its field side, since curvatures may
    jump there).
    """
    discrete = ladder.steps[DISCRETE.name]
    half_space = max(abs(discrete[name]) / worse for name, worse in _READ_WORSE.items())
    curvature = placement.first.curvature.hessian
    off = np.abs(curvature_of_gap(placement) - curvature).max() / np.abs(curvature).max()
    return max(half_space, float(off))


def curvature_of_gap(placement: Placement) -> Floats:
    """Second derivatives (2, 2) of the true gap at the touch point in 1/mm; across by differences to its field side."""
    h = _READ_OVER_MM

    def gap(x: float, s: float) -> float:
        return float(placement.gap(h * x, h * s))

    along = gap(1, 0) - 2.0 * gap(0, 0) + gap(-1, 0)
    across = 2.0 * gap(0, 0) - 5.0 * gap(0, 1) + 4.0 * gap(0, 2) - gap(0, 3)
    mixed = 0.25 * (gap(1, 1) - gap(-1, 1) - gap(1, -1) + gap(-1, -1))
    return np.array([[along, mixed], [mixed, across]]) / h**2


# --- Why Hertz is off: the step of the ladder that changed a measure most, and the profiles below the patch.

# If the normals below the patch turn by more than this, the surfaces are called conforming: a flat half-space has an
# error of about the square of half the turn, 2 % here.
_CONFORMING_RAD = 0.3


@dataclass(frozen=True, kw_only=True)
class PatchGeometry:
    """Geometry of the profiles below the finite-element patch.

    Attributes
    ----------
    junction_distance_mm
        Distance from the touch point to the next curvature junction of either profile; inf without a junction.
    junction_distance_over_b
        This distance over Hertz's semi-axis on this side.
    junction_in_patch
        Whether the patch covers a junction.
    curvature_variation
        Largest minus smallest relative lateral curvature below the patch, over its value at the touch point.
    normal_turn_rad
        Angle by which the rail's normal turns below the patch: the measure of conformity.
    lobes, pieces
        Lobes of the pressure, and separate patches.
    """

    TELLS = (
        *("junction_distance_mm", "junction_distance_over_b", "junction_in_patch"),
        *("curvature_variation", "normal_turn_rad"),
    )

    junction_distance_mm: float
    junction_distance_over_b: float
    junction_in_patch: bool
    curvature_variation: float
    normal_turn_rad: float
    lobes: int
    pieces: int


def cause_of(
    steps: Mapping[str, Mapping[str, float]], measure: str, geometry: PatchGeometry, *, plastic: bool = False
) -> str:
    """Why Hertz is off in a measure, from the step of the ladder that changed the measure most and from the geometry.

    With `plastic` Hertz is compared with bodies that yield, else with elastic bodies.
    """
    # the load on a second patch jumps to zero when the two patches join, on one rung or another; the valley between the
    # peaks shows whether there are two
    told_by = "valley" if measure == "separate_load" else measure
    counted = (step for step in STEPS if step.cause and step.name in steps and (plastic or step is not PLASTIC))
    moved_most = max(counted, key=lambda step: abs(steps[step.name][told_by]))
    return cause_in_gap(geometry) if moved_most is GAP else moved_most.cause


def cause_in_gap(geometry: PatchGeometry) -> str:
    """Why Hertz is off where the shape of the gap moved most."""
    if geometry.pieces > 1:
        return "second patch"
    if geometry.lobes > 1:
        return "second lobe"
    if geometry.junction_in_patch:
        return "curvature change within the patch"
    if geometry.normal_turn_rad > _CONFORMING_RAD:
        return "conformity"
    return "curvature varies over the patch"


def patch_geometry(placement: Placement, fe: Rung, hertz: HertzContact, patch: Patch) -> PatchGeometry:
    """Geometry of both profiles below the finite-element patch."""
    touch = placement.first
    below = np.flatnonzero(fe.pressure_MPa.max(axis=0) > 0.0)
    low, high = fe.grid.s_mm[below[0]], fe.grid.s_mm[below[-1]]
    places = [junction.s_mm for junction in placement.junctions]
    nearest = min(places, key=abs, default=float("inf"))
    s = np.linspace(low, high, 201)
    u = placement.rail.profile.at_arc_length(s + placement.first_arc_length_mm)
    wheel = placement.wheel.profile
    w = wheel.at_arc_length(np.clip(s + float(wheel.arc_length(touch.wheel_u)), 0.0, wheel.length_mm))
    rail_curve = placement.rail.profile.convex_sign * placement.rail.profile.evaluate(u).curvature_per_mm
    relative = rail_curve + wheel.convex_sign * wheel.evaluate(w).curvature_per_mm
    angles = placement.rail.section(u)[2]
    return PatchGeometry(
        junction_distance_mm=abs(nearest),
        junction_distance_over_b=abs(nearest) / (0.5 * hertz.extent_y_mm),
        junction_in_patch=any(low <= place <= high for place in places),
        curvature_variation=float(np.ptp(relative) / abs(touch.curvature.yy_per_mm)),
        normal_turn_rad=float(np.ptp(angles)),
        lobes=len(patch.lobes),
        pieces=patch.pieces,
    )


# --- The finite-element pressure beside the Hertz ellipse, on the same points.

# Points to a step of the nodes for the overlap of two patches, at most and at least, and of all of them in between:
# with 4 in place of 8 it moves by up to 1.4e-4 on 221 thousand nodes, with 2 by 2.5e-4 on 1.3 million.
_OVERLAP_REFINEMENT, _LEAST_REFINEMENT, _OVERLAP_POINTS = 8, 2, 4e6


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """Hertz against the finite elements at equal normal force.

    Attributes
    ----------
    contact, ellipse
        The two contacts.
    patch
        Measures of the finite elements' patch.
    deviation
        (Hertz - FE) / FE for each of `MEASURES`, and the `MISFITS`.
    pressure_l2
        Norm of the pressure difference over the norm of the finite-element pressure, over both patches.
    """

    contact: Rung
    ellipse: HertzContact
    patch: Patch
    fe: Measures
    hertz: Measures
    deviation: Mapping[str, float]
    pressure_l2: float

    # cached and not computed at once: it takes hundredths of a second, and few loads of a map need it
    @cached_property
    def overlap(self) -> float:
        """Area of the intersection of the patches over the area of their union."""
        hertz = self.ellipse
        return _overlap(self.contact.even().pressure.covering(hertz.extent_x_mm, hertz.extent_y_mm), hertz)


def compare(fe: Rung, hertz: HertzContact) -> Comparison:
    """Compare a solved contact with Hertz's ellipse at the origin of its grid."""
    contact, theory, weights = Approximation.of(hertz).beside(fe)
    return Comparison(
        contact=fe,
        ellipse=hertz,
        patch=patch_of(fe),
        fe=measures_of(fe),
        hertz=hertz_measures(hertz),
        deviation=deviations(fe, hertz),
        # not by numpy.linalg.norm: the sum of BLAS depends on the number of its threads
        pressure_l2=float(
            np.sqrt((np.square(theory - contact) * weights).sum() / (np.square(contact) * weights).sum())
        ),
    )


def _overlap(pressure: Field, hertz: HertzContact) -> float:
    square = signed_square(pressure.values)[1:-1, 1:-1]
    finer = min(_OVERLAP_REFINEMENT, max(_LEAST_REFINEMENT, int(math.sqrt(_OVERLAP_POINTS / square.size))))
    count = [(n - 1) * finer + 1 for n in square.shape]
    fine = zoom(square, [c / n for c, n in zip(count, square.shape, strict=True)], order=1, grid_mode=False)
    inside = fine > 0.0
    lines = (pressure.grid.x_mm, pressure.grid.s_mm)
    xs, ss = (np.linspace(line[0], line[-1], n) for line, n in zip(lines, fine.shape, strict=True))
    ellipse = hertz.pressure_MPa(xs[:, None], ss[None, :]) > 0.0
    return float(np.count_nonzero(inside & ellipse) / np.count_nonzero(inside | ellipse))
