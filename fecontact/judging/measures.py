"""Measures of one contact: how each is read from a pressure field and from a theory's patches.

Every measure is one field of `Measures`, or of `Misfit` if a theory has no value of it: its name with its unit, how it
is read, and how well. All that judges, tells or draws measures goes through these tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.ndimage import label

from fecontact.arrays import Floats
from fecontact.contact.grid import Rung
from fecontact.contact.patch import Patch, measure_patch, valley_of
from fecontact.contact_theories.approximation import Approximation
from fecontact.contact_theories.hertz import HertzContact

# --- Measures of one contact: how each is read from a pressure field and from a theory's patches.


def _measure(
    of_contact: Callable[..., float], of_theory: Callable[[Approximation], float] | None = None, **known: float | None
) -> Any:
    """A measure: how it is read, and what is known of its uncertainty, as `FLOORS` and the tables below it have it."""
    read = {"of_contact": of_contact, "of_theory": of_theory, "meshes": 0.0, "of_skew": 0.0, "noise": 0.0}
    return field(metadata=read | known)


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, half-widths (a along x, b across), full extents and approach of one contact.

    `floor` in the metadata is the relative uncertainty of reading the measure off 32 nodes per semi-axis; None where it
    is not known. The approach is measured down to the bodies' cut planes: a deeper rail moves it, and no mesh says
    by how much. `cut_planes` is how much the other measures change at most when one cut plane is moved out by half
    (studies/02_independence.py), `meshes` what two meshes of 4 and 2.7 elements happen to have in common: with it 81 or
    more of the 84 real positions of studies/12_uncertainty.py on which it was chosen are inside what is stated.
    """

    # on the half-space, where nothing else errs, the peak is read within 0.00007 (225 exact ellipses, and 126 real
    # positions against 64 nodes). What is stated beyond that belongs to the meshes: of real positions 81 of 84 are
    # inside with the sum of floor and `meshes`
    p_max_MPa: float = _measure(
        lambda patch, rung: patch.p_max_MPa,
        lambda theory: max(one.p_max_MPa for one in theory.patches),
        floor=0.0006,
        cut_planes=0.0014,
        meshes=0.0006,
    )
    # where the line of zero pressure lies between nodes is a matter of chance; all other measures are sums. On the
    # half-space, where nothing else errs, areas of exact contacts (studies/12_uncertainty.py) are read within 0.0017 in
    # the half on which this was chosen, within 0.0016 in the other half
    area_mm2: float = _measure(
        lambda patch, rung: patch.area_mm2,
        lambda theory: sum(one.area_mm2 for one in theory.patches),
        floor=0.002,
        cut_planes=0.0019,
    )
    # two lobes far apart for their length are 0.1 % longer on both meshes: 81 of 100 were inside without what is common
    a_mm: float = _measure(
        lambda patch, rung: patch.a_mm,
        lambda theory: theory.half_widths_mm[0],
        floor=0.0004,
        cut_planes=0.0009,
        meshes=0.0005,
    )
    b_mm: float = _measure(
        lambda patch, rung: patch.b_mm,
        lambda theory: theory.half_widths_mm[1],
        floor=0.0005,
        cut_planes=0.0018,
        meshes=0.0008,
    )
    extent_x_mm: float = _measure(
        lambda patch, rung: patch.extent_x_mm, lambda theory: theory.extents_mm[0], floor=0.01, cut_planes=0.0009
    )
    extent_y_mm: float = _measure(
        lambda patch, rung: patch.extent_y_mm, lambda theory: theory.extents_mm[1], floor=0.01, cut_planes=0.0018
    )
    approach_mm: float = _measure(
        lambda patch, rung: rung.approach_mm, lambda theory: theory.approach_mm, floor=None, cut_planes=math.nan
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MEASURES}


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """What sizes do not see of a contact beside a theory; all are zero for the theory's own pressure.

    Attributes
    ----------
    centre_over_b
        Distance across from the theory's centre of pressure to the contact's, over the theory's half-width b.
    valley
        By how much the pressure falls between its two most prominent peaks, over the highest; of a theory that has a
        valley itself what the contact has more.
    separate_load
        Part of the force on all separate patches but the one that carries most; of several patches in the theory, on
        those that are none of them (`_unknown_load`).
    misplaced_load
        Part of the force that is elsewhere than the theory has it: half the integral of the difference over the force.

    A theory with a single patch is moved to the centre of pressure before the misplaced load is counted, so that a
    centre that is off counts once. Several patches stay where they are: their common centre follows from how they share
    the load, and would move each away from its own place (`studies/15_cheaper_than_finite_elements.py`).

    `floor`, `cut_planes` and `meshes` in the metadata are uncertainties that no mesh takes away, as in `Measures`;
    `noise` is what is read where there is nothing, and adds in quadrature to what there is; `of_skew` is what meshes
    have in common of a patch whose skewness is 1, and falls with it. Of exact contacts the centre is within 0.0005 b;
    0.0021 b, which patches beyond 0.15 b need, was stated for all.
    """

    centre_over_b: float = _measure(
        lambda patch, rung, theory: (patch.centre_y_mm - theory.centre_mm[1]) / theory.half_widths_mm[1],
        floor=0.0003,
        cut_planes=0.004,
        meshes=0.0005,
        of_skew=0.007,
    )
    valley: float = _measure(
        lambda patch, rung, theory: patch.valley - _own_valley(rung, theory),
        floor=0.0005,
        cut_planes=0.001,
        meshes=0.0006,
    )
    separate_load: float = _measure(
        lambda patch, rung, theory: patch.separate_load if theory.single else _unknown_load(rung, theory),
        floor=0.000025,
        cut_planes=0.0,
    )
    # cells at the edge of the patch are wholly in contact or not: so much is read for Hertz's own ellipse. On finer
    # elements the change from mesh to mesh does not show it: of 63 slender exact contacts on meshes of 6, 4 and 2.7
    # elements per semi-axis 86 % were inside the floor alone; with what is common all, and all of 59 others
    # (studies/12_uncertainty.py)
    misplaced_load: float = _measure(
        lambda patch, rung, theory: _misplaced_load(rung, theory),
        floor=0.0008,
        cut_planes=0.0008,
        meshes=0.0004,
        noise=0.0014,
    )

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return {name: float(getattr(self, name)) for name in MISFITS}


_READ = {measure.name: measure.metadata for measure in fields(Measures)}
_READ_BESIDE = {measure.name: measure.metadata for measure in fields(Misfit)}
MEASURES = tuple(_READ)
"""Names of the measures that Hertz and a contact both have, each ending in its unit."""
MISFITS = tuple(_READ_BESIDE)
"""Names of the measures of a contact beside Hertz; they have no unit."""
FLOORS: dict[str, float | None] = {name: read["floor"] for name, read in (_READ | _READ_BESIDE).items()}
"""What reading leaves open of each: relative of `MEASURES`, absolute of `MISFITS`; None where it is not known."""
NOISE: dict[str, float] = {name: read["noise"] for name, read in _READ_BESIDE.items()}
"""What is read of each of `MISFITS` where there is none."""
CUT_PLANES: dict[str, float] = {name: read["cut_planes"] for name, read in (_READ | _READ_BESIDE).items()}
"""Uncertainty of each measure from the bodies' cut planes."""
IN_COMMON: dict[str, float] = {name: read["meshes"] for name, read in (_READ | _READ_BESIDE).items()}
"""Error of each measure that two coarse meshes have in common."""
OF_SKEW: dict[str, float] = {name: read["of_skew"] for name, read in (_READ | _READ_BESIDE).items()}
"""The same that is in proportion to the skewness of the pressure across."""


# a load is judged by its rungs several times while it is refined, and each is read once
@lru_cache(maxsize=64)
def patch_of(rung: Rung) -> Patch:
    """What the pressure of a solved contact says of its patch."""
    return measure_patch(rung.pressure)


def measures_of(rung: Rung) -> Measures:
    """Measures of a solved contact."""
    patch = patch_of(rung)
    return Measures(**{name: read["of_contact"](patch, rung) for name, read in _READ.items()})


def measures_of_theory(theory: Approximation) -> Measures:
    """Measures of a theory's patches, from the theory itself."""
    return Measures(**{name: float(read["of_theory"](theory)) for name, read in _READ.items()})


def hertz_measures(hertz: HertzContact) -> Measures:
    """The measures of a Hertz ellipse, a along x and b across also where its axes are turned."""
    return measures_of_theory(Approximation.of(hertz))


@lru_cache(maxsize=64)
def misfit_of_theory(rung: Rung, theory: Approximation) -> Misfit:
    """Measures of a solved contact beside a theory, both about the origin of its grid."""
    patch = patch_of(rung)
    return Misfit(**{name: read["of_contact"](patch, rung, theory) for name, read in _READ_BESIDE.items()})


def misfit_of(rung: Rung, hertz: HertzContact) -> Misfit:
    """Measures of a solved contact beside Hertz's ellipse at the origin of its grid."""
    return misfit_of_theory(rung, Approximation.of(hertz))


def values_of(rung: Rung, theory: Approximation) -> dict[str, float]:
    """All measures of a solved contact, and what of it is beside a theory."""
    return measures_of(rung).as_dict() | misfit_of_theory(rung, theory).as_dict()


def deviations_of(rung: Rung, theory: Approximation) -> dict[str, float]:
    """(Theory - contact) / contact of each of `MEASURES`, and the `MISFITS` as they are."""
    own, contact = measures_of_theory(theory).as_dict(), values_of(rung, theory)
    return {name: own[name] / contact[name] - 1.0 if name in MEASURES else contact[name] for name in contact}


def deviations(rung: Rung, hertz: HertzContact) -> dict[str, float]:
    """(Hertz - contact) / contact of each of `MEASURES`, and the `MISFITS` as they are."""
    return deviations_of(rung, Approximation.of(hertz))


# read for the valley and for the misplaced load
@lru_cache(maxsize=4)
def _beside(rung: Rung, theory: Approximation) -> tuple[Floats, Floats, Floats]:
    """Pressures as `Approximation.beside` has them; of a single patch at the contact's centre of pressure."""
    if theory.single is None:
        return theory.beside(rung)
    patch, (x, s) = patch_of(rung), theory.centre_mm
    return theory.beside(rung, (patch.centre_x_mm - x, patch.centre_y_mm - s))


def _misplaced_load(rung: Rung, theory: Approximation) -> float:
    pressure, of_theory, weights = _beside(rung, theory)
    return part_elsewhere(pressure * weights, of_theory * weights)


def _own_valley(rung: Rung, theory: Approximation) -> float:
    """The valley of a theory's own pressure, read on the nodes of a contact; an ellipse has none."""
    is_ellipse = theory.single is not None and theory.single.hertz is not None
    return 0.0 if is_ellipse else valley_of(_beside(rung, theory)[1])


def _unknown_load(rung: Rung, theory: Approximation) -> float:
    """Part of the force on separate patches of a contact that a theory does not know (`unknown_load`)."""
    return unknown_load(*_separate_loads(rung), theory)


# every theory is read against the same patches
@lru_cache(maxsize=4)
def _separate_loads(rung: Rung) -> tuple[list[tuple[float, float]], Floats]:
    """Where each separate patch of a contact begins and ends across (mm), and its load (n,)."""
    whole = rung.pressure.whole()
    s, cells = whole.grid.s_mm, whole.grid.cells_mm
    pieces, count = label(whole.values > 0.0, structure=np.ones((3, 3)))
    below = [np.flatnonzero((pieces == k).any(axis=0))[[0, -1]] for k in range(1, count + 1)]
    loads = np.array([(whole.values * (pieces == k)).sum(axis=0) @ cells for k in range(1, count + 1)])
    return [(float(s[first] - cells[first]), float(s[last] + cells[last])) for first, last in below], loads


def unknown_load(ends_mm: Sequence[tuple[float, float]], loads: Floats, theory: Approximation) -> float:
    """Part of the force on separate patches that are none of a theory's, and of its patches that the contact has not.

    A patch of a theory has one of the contact at most: of those below it the heaviest that a heavier one has not taken,
    or, where all are taken, the heaviest, which they then share. Several would fail for every second patch that they
    rightly have, if they were judged as a single one is: whether they give it the right load is the misplaced load's
    matter, and the peak's.

    Parameters
    ----------
    ends_mm, loads
        Where each patch of the contact begins and ends across, and its load in any unit.
    """
    taken: set[int] = set()
    missing = 0.0
    for one in sorted(theory.patches, key=lambda one: -one.normal_force_N):
        low, high = one.low_mm[1], one.high_mm[1]
        below = [k for k, (first, last) in enumerate(ends_mm) if first <= high and low <= last]
        if not below:
            missing += one.normal_force_N / theory.normal_force_N
            continue
        free = [k for k in below if k not in taken]
        taken.add(max(free or below, key=lambda k: loads[k]))
    unknown = sum(load for k, load in enumerate(loads) if k not in taken) / loads.sum()
    return float(unknown + missing)


def part_elsewhere(force: Floats, reference: Floats) -> float:
    """Part of the forces of cells that is elsewhere than a reference on the same cells has it."""
    # at equal force, whatever the cells leave of it
    return float(0.5 * np.abs(force / force.sum() - reference / reference.sum()).sum())
