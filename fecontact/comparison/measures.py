"""Measures of one contact: how each is read from a pressure field and from a theory's patches.

Every measure is one field of `Measures`, or of `Misfit` if a theory has no value of it: its name with its unit, how it
is read, and how well. All that judges, tells or draws measures goes through these tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from fecontact.comparison.approximation import Approximation
from fecontact.comparison.patch import Patch, measure_patch, valley_of
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact

Floats = NDArray[np.float64]


def _measure(
    of_contact: Callable[[Patch, Rung], float],
    of_theory: Callable[[Approximation], float],
    *,
    floor: float | None,
    cut_planes: float,
    meshes: float = 0.0,
) -> Any:
    metadata = {"of_contact": of_contact, "of_theory": of_theory, "floor": floor, "cut_planes": cut_planes}
    return field(metadata=metadata | {"meshes": meshes})


@dataclass(frozen=True, kw_only=True)
class Measures:
    """Peak pressure, area, half-widths (a along x, b across), full extents and approach of one contact.

    `floor` in the metadata is the relative uncertainty of reading the measure off 32 nodes a semi-axis; None where it
    is not known. The approach is that of the bodies down to their cut planes: a deeper rail moves it, and no mesh says
    by how much. `cut_planes` is how much the other measures change at most when one cut plane is moved out by half
    (studies/02_independence.py), `meshes` what two meshes of 4 and 2.7 elements happen to have in common: with it 81 or
    more of the 84 real positions of studies/12_uncertainty.py on which it was chosen are inside what is stated.
    """

    p_max_MPa: float = _measure(
        lambda patch, rung: patch.p_max_MPa,
        lambda theory: max(one.p_max_MPa for one in theory.patches),
        floor=0.0006,
        cut_planes=0.0014,
        meshes=0.0006,
    )
    # where the line of zero pressure lies between nodes is a matter of chance; all other measures are sums
    area_mm2: float = _measure(
        lambda patch, rung: patch.area_mm2,
        lambda theory: sum(one.area_mm2 for one in theory.patches),
        floor=0.0025,
        cut_planes=0.0019,
    )
    a_mm: float = _measure(
        lambda patch, rung: patch.a_mm, lambda theory: theory.half_widths_mm[0], floor=0.0004, cut_planes=0.0009
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


def _misfit(
    of: Callable[[Patch, Rung, Approximation], float],
    *,
    floor: float,
    cut_planes: float,
    meshes: float = 0.0,
    noise: float = 0.0,
) -> Any:
    return field(metadata={"of": of, "floor": floor, "cut_planes": cut_planes, "meshes": meshes, "noise": noise})


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """What sizes do not see of a contact beside a theory; all are zero for the theory's own pressure.

    Attributes
    ----------
    centre_over_b
        Centre of pressure beside that of the theory, across, over the theory's half-width b.
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
    the load, and would move each away from its own place (studies/README.md, "Several ellipses in place of one").

    `floor`, `cut_planes` and `meshes` in the metadata are uncertainties that no mesh takes away, as in `Measures`;
    `noise` is what is read where there is nothing, and adds in quadrature to what there is.
    """

    centre_over_b: float = _misfit(
        lambda patch, rung, theory: (patch.centre_y_mm - theory.centre_mm[1]) / theory.half_widths_mm[1],
        floor=0.0003,
        cut_planes=0.004,
        meshes=0.0021,
    )
    valley: float = _misfit(
        lambda patch, rung, theory: patch.valley - _own_valley(rung, theory),
        floor=0.0005,
        cut_planes=0.001,
        meshes=0.0006,
    )
    separate_load: float = _misfit(
        lambda patch, rung, theory: patch.separate_load if theory.single else _unknown_load(rung, theory),
        floor=0.000025,
        cut_planes=0.0,
    )
    # cells at the edge of the patch are wholly in contact or not: so much is read for Hertz's own ellipse. On finer
    # elements the change from mesh to mesh does not show it: of 63 slender exact contacts on meshes of 6, 4 and 2.7
    # elements a semi-axis 86 % were inside the floor alone; with what is common all, and all of 59 others
    # (studies/12_uncertainty.py)
    misplaced_load: float = _misfit(
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
"""What the bodies' cut planes leave open of each, in the same way."""
IN_COMMON: dict[str, float] = {name: read["meshes"] for name, read in (_READ | _READ_BESIDE).items()}
"""What two coarse meshes have in common of each, in the same way."""


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
    return Misfit(**{name: read["of"](patch, rung, theory) for name, read in _READ_BESIDE.items()})


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
def _beside(rung: Rung, theory: Approximation) -> tuple[Floats, Floats]:
    """Pressures of a contact and of a theory on the same nodes; a single patch at the contact's centre of pressure."""
    if theory.single is None:
        return theory.beside(rung)
    patch, (x, s) = patch_of(rung), theory.centre_mm
    return theory.beside(rung, (patch.centre_x_mm - x, patch.centre_y_mm - s))


def _misplaced_load(rung: Rung, theory: Approximation) -> float:
    return part_elsewhere(*_beside(rung, theory))


def _own_valley(rung: Rung, theory: Approximation) -> float:
    """The valley of a theory's own pressure, read on the nodes of a contact; an ellipse has none."""
    is_ellipse = theory.single is not None and theory.single.hertz is not None
    return 0.0 if is_ellipse else valley_of(_beside(rung, theory)[1])


def _unknown_load(rung: Rung, theory: Approximation) -> float:
    """Part of the force on separate patches that are none of a theory's, and of its patches that the contact has not.

    A patch of a theory has one of the contact at most: of those below it the heaviest that a heavier one has not taken,
    or, where all are taken, the heaviest, which they then share. Several would fail for every second patch that they
    rightly have, if they were judged as a single one is: whether they give it the right load is the misplaced load's
    matter, and the peak's.
    """
    whole = rung.pressure.whole()
    s, step = whole.grid.s_mm, whole.grid.steps_mm[1]
    pieces, count = label(whole.values > 0.0, structure=np.ones((3, 3)))
    ends = [s[(pieces == k).any(axis=0)][[0, -1]] for k in range(1, count + 1)]
    loads = np.array([whole.values[pieces == k].sum() for k in range(1, count + 1)])
    taken: set[int] = set()
    missing = 0.0
    for one in sorted(theory.patches, key=lambda one: -one.normal_force_N):
        low, high = one.low_mm[1], one.high_mm[1]
        below = [k for k, (first, last) in enumerate(ends) if first - step <= high and low <= last + step]
        if not below:
            missing += one.normal_force_N / theory.normal_force_N
            continue
        free = [k for k in below if k not in taken]
        taken.add(max(free or below, key=lambda k: loads[k]))
    unknown = sum(load for k, load in enumerate(loads) if k not in taken) / loads.sum()
    return float(unknown + missing)


def part_elsewhere(pressure_MPa: Floats, reference_MPa: Floats) -> float:
    """Part of the force of a pressure that is elsewhere than a reference on the same cells has it."""
    # at equal force, whatever the cells leave of it
    return float(0.5 * np.abs(pressure_MPa / pressure_MPa.sum() - reference_MPa / reference_MPa.sum()).sum())
