"""Solution of a load on all its mesh levels, as fields and numbers.

The module does not need finite elements. A stored load is judged again in milliseconds, with other criteria or with new
readings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from fecontact.case import Case
from fecontact.contact.elements import COMPLIANCE_ERROR_LIMIT
from fecontact.contact.grid import Rung, calculate_misplaced_load
from fecontact.contact.patch import find_lobe_windows
from fecontact.errors import CONVERGED
from fecontact.judging.lines import ProfileVariants
from fecontact.judging.measures import MEASURES, UNCERTAINTIES, read_measures, read_patch
from fecontact.judging.patch_loads import (
    ELEMENT_LOAD_ERROR,
    PATCH_LOADS_LIMIT,
    PatchLoads,
    compute_load_fractions,
    find_free_strips_mm,
)
from fecontact.judging.uncertainty import (
    MESH_RATIO,
    NODE_NUMBER_RATIO,
    SolutionQuality,
    compute_mesh_change,
    estimate_budget,
    estimate_elements_budget,
    estimate_share_uncertainty,
    estimate_uncertainty,
)
from fecontact.judging.uncertainty_budget import UncertaintyBudget
from fecontact.judging.yielded import PlasticResult

# --- Solution of a load on all its mesh levels, without anything that needs finite elements.

Status = Literal[
    "converged",
    "not converged",
    "patch at the edge of the fine mesh",
    "elements too soft or too stiff",
    "references disagree",
    "verdicts contradict",
]
# Limit below which lobes are barely joined, or patches barely separate: pressure between two lobes as a fraction of the
# peak, or width of the free strip as a fraction of the width of the patch.
_SEPARATION_FRACTION = 0.1
# Largest difference between the contact on the elements' nodes and the contact on the finer nodes, in units of the sum
# of both uncertainties.
_ELEMENTS_LIMIT = 2.0
# Largest distance between the centres of pressure of both contacts, in units of the sum of both uncertainties. Of 80
# contacts with healthy elements the largest distance is 0.38; elements with a gap that is shifted by 0.2 mm from the
# gap of the finer nodes have 2.2.
_CENTRES_LIMIT, _CENTRE = 1.0, "centre_over_b"
ELEMENTS_STATUS: Status = "elements too soft or too stiff"
"""Status of a load with elements that do not behave as the material of the bodies, or have a poor shape."""
REFERENCES_STATUS: Status = "references disagree"
"""Status of a load with an error in Hertz, the half-space, the gap or a load (`solution_faults`,
`reference_check.compute_reference_error`).
"""
CONTRADICTION_STATUS: Status = "verdicts contradict"
"""Status of a load with contrary verdicts on the elements' nodes and on the finer nodes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Level:
    """Solution of a load on a single mesh level.

    Attributes
    ----------
    nodal
        Contact between the finite bodies, with the forces of the nodes of their elements.
    fe
        Contact of the finite bodies on finer nodes: the true gap on a half-space, opened by the difference between the
        bodies of `nodal` and a half-space of equal elements. This difference is smooth and accurate on coarse meshes,
        so that the fine pressure does not depend on the softness or the size of the elements.
    otherwise
        Contact as in `fe`, with another fit that separates the response of the elements from the response of the
        bodies; None on meshes that are coarser than the meshes of the case, where it is not needed.
    compliance_error
        Relative error of the compliance of the elements, far from a unit pressure (-); positive if the elements are
        softer than their material. NaN if it could not be measured.
    degrees_of_freedom, elements
        Number of degrees of freedom and number of elements of rail and wheel.
    enlarged, at_edge
        Number of enlargements of the fine zone, and whether the patch still reaches its edge.
    slide_mm
        Distance that the wheel moves along the rail under the load, if the surface is steep.
    force_balance, moment_balance
        Relative difference between the nodal pressures on both bodies in force and moment (-), from `fe.coupling`.
    more_nodes
        Change of the half-space on more nodes (-), where it may be larger than usual (`compare_with_more_nodes`).
    turned_force
        Relative difference of the force along the normal at the weighted centre of a single patch from the force along
        the normal at first contact (-), from `solving.plane_angles.compute_turned_force`.
    yielded
        First loading of bodies that may yield; None without a yield stress.
    gap_distance_error_mm
        Largest difference between the gap on the nodes of `fe` and the distance of the meshes' surfaces; None if it was
        not measured.
    correction_error
        Fraction of the elements' softness that is left in the contact on the finer nodes (-); None if it was not
        measured.
    """

    nodal: Rung
    fe: Rung
    otherwise: Rung | None
    compliance_error: float
    degrees_of_freedom: Mapping[str, int]
    elements: Mapping[str, int]
    enlarged: int
    slide_mm: float = 0.0
    force_balance: float = 0.0
    moment_balance: float = 0.0
    at_edge: bool
    more_nodes: Mapping[str, float] = field(default_factory=dict)
    turned_force: float = 0.0
    yielded: PlasticResult | None = None
    gap_distance_error_mm: float | None = None
    correction_error: float | None = None

    @property
    def rungs(self) -> dict[str, Rung]:
        """Contacts of the level by name."""
        rungs = {"nodal": self.nodal, "fe": self.fe}
        return rungs if self.otherwise is None else {**rungs, "otherwise": self.otherwise}

    @property
    def status(self) -> Status:
        """Status of the level: `converged` if its numbers may be used."""
        return "patch at the edge of the fine mesh" if self.at_edge else _worst_status(*self.rungs.values())

    @cached_property
    def on_elements(self) -> Rung:
        """Contact on the elements' nodes, with an even grid for readers of pressures."""
        return self.nodal.even()

    @property
    def misfit(self) -> float:
        """Misplaced fraction of the load on the elements' nodes, relative to the finer nodes."""
        return calculate_misplaced_load(self.nodal, self.fe)


def _worst_status(*rungs: Rung) -> Status:
    return "converged" if all(rung.status == "converged" for rung in rungs) else "not converged"


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedLoad:
    """Load at a position, solved on at least two mesh levels.

    Attributes
    ----------
    case
        Position under this load.
    levels
        Mesh levels, the finest first.
    half_space
        True gap on a half-space; separate patches have a plane each.
    turned
        True gap on a half-space, with each pressure along the normal at its place; None for a single lobe.
    quadratic
        Hertz's gap on a half-space, with an equal number of nodes per semi-axis.
    lines
        Theories compared with the half-space on each profile variant; None if both profiles are exact.
    limits
        Reasons that stopped a refinement.
    short_of_memory
        Whether the machine had too little memory for the settings of the case.
    gap_curvature_error
        Error of the second differences of the gap on the nodes of `half_space` at the contact point, relative to the
        largest curvature; None if it was not measured.
    load_error
        Largest difference between the loads of the contacts and the load of the case, relative to the load of the case;
        None if it was not measured.
    """

    case: Case
    levels: tuple[Level, ...]
    half_space: Rung
    turned: Rung | None = None
    quadratic: Rung
    lines: ProfileVariants | None
    limits: tuple[str, ...] = ()
    short_of_memory: bool = False
    gap_curvature_error: float | None = None
    load_error: float | None = None

    @property
    def rungs(self) -> tuple[tuple[str, Rung], ...]:
        """Rungs above Hertz with their names, in the order of the ladder."""
        return (
            ("half_space_quadratic", self.quadratic),
            ("half_space", self.half_space),
            ("elements", self.levels[0].on_elements),
            ("fe", self.levels[0].fe),
            *(() if (yielded := self.levels[0].yielded) is None else (("fe_plastic", yielded.fe),)),
        )

    # The status is cached: it is read for every row and verdict, also of a map that is written after each of its
    # positions.
    @cached_property
    def status(self) -> Status:
        """Status of the load: `converged` if all solutions on all meshes are.

        Any other status gives the reason why the load must not be used.
        """
        for level in self.levels:
            if level.status != "converged":
                return level.status
        turned = () if self.turned is None else (self.turned,)
        rung_status = _worst_status(self.half_space, self.quadratic, *turned)
        return ELEMENTS_STATUS if rung_status == "converged" and has_faulty_elements(self.levels) else rung_status

    @property
    def usable(self) -> bool:
        """Whether the numbers of the load may be used."""
        return self.status == CONVERGED


def has_faulty_elements(levels: Sequence[Level]) -> bool:
    """Whether the elements of the finest meshes behave differently from their material.

    There are three checks. The compliance far from a pressure must be within its limit. The contact on the elements'
    nodes must agree with the contact on the finer nodes within the uncertainty of the meshes; of 24 contacts with
    healthy elements the difference is at most half of that. Each of several separate patches must have equal load
    fractions in both contacts.

    Parameters
    ----------
    levels
        Mesh levels, the finest first; at least two.

    Returns
    -------
    bool
        True if a check fails.
    """
    finest, coarser = levels[:2]
    if abs(finest.compliance_error) > COMPLIANCE_ERROR_LIMIT:
        return True
    read_rung = make_centre_reader(finest)
    elements_values, fine_values, coarser_values = (
        read_rung(rung) for rung in (finest.on_elements, finest.fe, coarser.fe)
    )
    elements_uncertainty = estimate_elements_uncertainties(levels, read_rung)
    if any(patch_loads.difference > PATCH_LOADS_LIMIT for patch_loads in compare_patch_loads(levels)):
        return True
    return compute_centre_distance(levels, elements_uncertainty) > _CENTRES_LIMIT or any(
        abs(elements_values[name] / fine_values[name] - 1.0)
        > _ELEMENTS_LIMIT * (elements_uncertainty[name] + abs(coarser_values[name] / fine_values[name] - 1.0))
        for name, declared in UNCERTAINTIES.items()
        if declared.shows_faulty_elements
    )


def compare_patch_loads(levels: Sequence[Level]) -> list[PatchLoads]:
    """Compare the loads of separate patches on the elements' nodes and on the finer nodes.

    The comparison shows whether the contribution of the finite bodies is missing on the finer nodes, doubled or of the
    wrong sign. Peaks and areas of separate patches hardly show such an error.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.

    Returns
    -------
    list of PatchLoads
        Load fractions for each free strip between patches; empty for a single patch.
    """
    strips_mm = find_free_strips_mm(levels[0].fe)
    if not strips_mm:
        return []
    element_fractions = [compute_load_fractions(level.nodal, strips_mm) for level in levels]
    fine_fractions = [compute_load_fractions(level.fe, strips_mm) for level in levels]
    other_fit_fractions, quality = compute_load_fractions(read_other_fit(levels), strips_mm), read_quality(levels)
    patch_loads = []
    for number, other_fit_fraction in enumerate(other_fit_fractions):
        on_elements, on_finer_nodes = (
            [fractions[number] for fractions in element_fractions],
            [fractions[number] for fractions in fine_fractions],
        )
        fine_uncertainty = estimate_share_uncertainty(on_finer_nodes, quality, otherwise=other_fit_fraction)
        patch_loads.append(
            PatchLoads(
                on_elements=on_elements[0],
                on_finer_nodes=on_finer_nodes[0],
                uncertainty=fine_uncertainty + ELEMENT_LOAD_ERROR + compute_mesh_change(on_elements),
            )
        )
    return patch_loads


def make_centre_reader(level: Level) -> Callable[[Rung], dict[str, float]]:
    """Make a reader of measures that includes the centre of pressure.

    Parameters
    ----------
    level
        Mesh level; the half-width b of its contact scales the centre.

    Returns
    -------
    callable
        Function that returns the measures of a rung, and its centre of pressure divided by b (-).
    """
    b_mm = read_patch(level.fe).b_mm
    return lambda rung: _read_measures(rung) | {_CENTRE: read_patch(rung).centre_y_mm / b_mm}


def compute_centre_distance(levels: Sequence[Level], elements_uncertainty: Mapping[str, float]) -> float:
    """Distance between the centres of pressure in units of their combined uncertainty.

    The centres are on the elements' nodes and on the finer nodes. The distance shows elements with a shifted gap, which
    peak and half-widths do not show.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.
    elements_uncertainty
        Uncertainty on the elements' nodes (-), for the measures of `make_centre_reader`.

    Returns
    -------
    float
        Distance divided by the sum of both uncertainties (-).
    """
    b_mm = read_patch(levels[0].fe).b_mm
    elements_centre, *fine_centres = (
        read_patch(rung).centre_y_mm / b_mm for rung in (levels[0].on_elements, *(level.fe for level in levels))
    )
    fine_uncertainty = estimate_uncertainty(_CENTRE, fine_centres, read_quality(levels))
    assert fine_uncertainty is not None
    return abs(elements_centre - fine_centres[0]) / (elements_uncertainty[_CENTRE] + fine_uncertainty)


def _read_measures(rung: Rung) -> dict[str, float]:
    return read_measures(rung).as_dict()


def estimate_elements_uncertainties(
    levels: Sequence[Level], read_rung: Callable[[Rung], Mapping[str, float]] = _read_measures
) -> dict[str, float]:
    """Uncertainty of each measure on the elements' nodes, from all mesh levels.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.
    read_rung
        Function that reads measures from a rung.

    Returns
    -------
    dict of str to float
        Relative for `MEASURES`, absolute for `MISFITS` (-); a measure without a stated uncertainty has no entry.
    """
    return {name: budget.total for name, budget in estimate_elements_budgets(levels, read_rung).items()}


def estimate_elements_budgets(
    levels: Sequence[Level], read_rung: Callable[[Rung], Mapping[str, float]] = _read_measures
) -> dict[str, UncertaintyBudget]:
    """Contributions to the uncertainty of each measure on the elements' nodes, from all mesh levels.

    Parameters
    ----------
    levels, read_rung
        As in `estimate_elements_uncertainties`.

    Returns
    -------
    dict of str to UncertaintyBudget
        Relative for `MEASURES`, absolute for `MISFITS` (-); a measure without a stated uncertainty has no entry.
    """
    finest, rungs = levels[0], [level.on_elements for level in levels]
    elements = compute_elements_per_semi_axis(finest)
    measured = [read_rung(rung) for rung in rungs]
    budgets = {
        name: estimate_elements_budget(
            name,
            [values[name] for values in measured],
            elements=elements,
            compliance_error=finest.compliance_error,
            residual=finest.nodal.residual,
        )
        for name in measured[0]
    }
    return {name: budget for name, budget in budgets.items() if budget is not None}


def compute_elements_per_semi_axis(level: Level) -> float:
    """Number of elements per semi-axis, in the direction with fewer elements.

    Parameters
    ----------
    level
        Mesh level.

    Returns
    -------
    float
        Number of elements (-).
    """
    patch, (spacing_x_mm, spacing_s_mm) = read_patch(level.on_elements), level.on_elements.grid.steps_mm
    return min(patch.a_mm / spacing_x_mm, patch.b_mm / spacing_s_mm / len(patch.lobes))


def estimate_irreducible_budgets(
    level: Level,
    read_rung: Callable[[Rung], Mapping[str, float]],
    deviation: Mapping[str, float],
    *,
    on_elements: int | None,
) -> dict[str, UncertaintyBudget]:
    """Contributions to the uncertainty of each deviation that finer meshes do not remove.

    Parameters
    ----------
    level
        Finest mesh level.
    read_rung
        Function that reads all measures from a rung.
    deviation
        Deviations (-), by the name of the measure.
    on_elements
        Number of further refinements, for the contact on the elements' nodes with the measures of the finer nodes; None
        for the contact on the finer nodes.

    Returns
    -------
    dict of str to UncertaintyBudget
        Contributions to the uncertainty of each deviation (-); a measure without a stated uncertainty has no entry.
    """
    measured, budgets = read_rung(level.fe), {}
    quality = SolutionQuality(
        shared=read_patch(level.fe).patch_count > 1,
        more_nodes=level.more_nodes,
        joined_share=compute_peak_lobe_share(level.fe),
        turned_force=level.turned_force,
    )
    for name in deviation:
        if on_elements is None:
            budget = estimate_budget(name, [measured[name]], quality)
        else:
            elements = compute_elements_per_semi_axis(level) * MESH_RATIO**on_elements
            budget = estimate_elements_budget(name, [measured[name]], elements=elements, compliance_error=0.0)
        if budget is not None:
            budgets[name] = scale_to_deviation(name, budget, deviation[name])
    return budgets


def estimate_budgets(
    levels: Sequence[Level],
    read_rung: Callable[[Rung], Mapping[str, float]],
    deviation: Mapping[str, float],
    *,
    share: float | None = None,
) -> dict[str, UncertaintyBudget]:
    """Contributions to the uncertainty of each deviation from the mesh levels.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.
    read_rung
        Function that reads all measures from a rung.
    deviation
        Deviations (-), by the name of the measure.
    share
        Load fraction of the lobe that is read (-); None for the lobe with the highest peak.

    Returns
    -------
    dict of str to UncertaintyBudget
        Contributions to the uncertainty of each deviation (-); a measure without a stated uncertainty has no entry.
    """
    measured, other_fit_values = [read_rung(level.fe) for level in levels], read_rung(read_other_fit(levels))
    quality, budgets = read_quality(levels), {}
    if share is not None:
        quality = replace(quality, joined_share=share)
    for name in deviation:
        budget = estimate_budget(name, [values[name] for values in measured], quality, otherwise=other_fit_values[name])
        if budget is not None:
            budgets[name] = scale_to_deviation(name, budget, deviation[name])
    return budgets


def scale_to_deviation(measure: str, budget: UncertaintyBudget, deviation: float) -> UncertaintyBudget:
    """Contributions to the uncertainty of a deviation, from the contributions of the measure.

    Parameters
    ----------
    measure
        Name of the measure.
    budget
        Contributions to the uncertainty of the measure of the finite elements (-).
    deviation
        Deviation of the theory (-).

    Returns
    -------
    UncertaintyBudget
        For `MEASURES`, the deviation is (theory - FE) / FE, and the contributions are multiplied by abs(1 + deviation).
        For `MISFITS` they are unchanged.
    """
    return budget.scaled(abs(1.0 + deviation)) if measure in MEASURES else budget


def read_other_fit(levels: Sequence[Level]) -> Rung:
    """Contact of the finest level with the other fit for the response of the elements.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.

    Returns
    -------
    Rung
        Contact with the other fit.

    Raises
    ------
    AssertionError
        If the finest meshes are coarser than the meshes of the case.
    """
    rung = levels[0].otherwise
    assert rung is not None, "the finest meshes are coarser than those of the case"
    return rung


def read_quality(levels: Sequence[Level]) -> SolutionQuality:
    """Errors and properties of the finest level for the uncertainty of its measures.

    Parameters
    ----------
    levels
        Mesh levels, the finest first.

    Returns
    -------
    SolutionQuality
        Residual, compliance error and skewness of the finest level, with the flags of all levels.
    """
    finest = levels[0]
    return SolutionQuality(
        residual=finest.fe.residual,
        compliance_error=finest.compliance_error,
        parting=any(is_barely_separate(level.fe) for level in levels),
        shared=read_patch(finest.fe).patch_count > 1,
        skew=compute_skewness(finest.fe),
        more_nodes=finest.more_nodes,
        joined_share=compute_peak_lobe_share(finest.fe),
        turned_force=finest.turned_force,
    )


def compute_peak_lobe_share(rung: Rung) -> float:
    """Load fraction of the lobe with the highest peak (-); 1 for a single lobe.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    float
        Fraction from 0 to 1.
    """
    lobes = read_patch(rung).lobes
    return lobes[0].force_share if len(lobes) > 1 else 1.0


# The half-widths a and b, which are sums over all nodes, do not need this check: on 151 real positions and on 15
# positions with the edge of the patch at a junction they are within 0.00022 and 0.00016, and 0.0004 and 0.0005 are
# stated for all positions.
_NODE_DEPENDENT_MEASURES = tuple(name for name in MEASURES if UNCERTAINTIES[name].more_nodes != "not compared")


def compare_with_more_nodes(
    rung: Rung, finer: Rung, sizes: Sequence[str] = _NODE_DEPENDENT_MEASURES
) -> dict[str, float]:
    """Change of sizes and valley from a half-space to 1.5 times its nodes.

    The stated uncertainty of reading was chosen on contacts without a junction of curvatures, a step or a notch below
    the patch. Of 13 valleys beside these three, the errors were 5 to 41 times the stated uncertainty. Where a patch
    ends one to three nodes beyond a junction, its area was up to 1.4 % too large. Half as many additional nodes showed
    between a fifth and two thirds of that error, and three times the number of nodes nine tenths.

    Parameters
    ----------
    rung
        Contact on the half-space.
    finer
        Contact on the half-space with any larger number of nodes. Errors are taken as proportional to the grid spacing,
        and the change is scaled accordingly.
    sizes
        Names of the measures to compare.

    Returns
    -------
    dict of str to float
        Relative change of each size, and absolute change of the valley (-).
    """
    change_factor = (1.0 - 1.0 / NODE_NUMBER_RATIO) / (1.0 - finer.grid.steps_mm[1] / rung.grid.steps_mm[1])
    values, finer_values = _read_measures(rung), _read_measures(finer)
    changes = {name: change_factor * abs(values[name] / finer_values[name] - 1.0) for name in sizes}
    return changes | {"valley": change_factor * abs(read_patch(rung).valley - read_patch(finer).valley)}


def compute_skewness(rung: Rung) -> float:
    """Lateral skewness of the pressure.

    The skewness is the third central moment divided by the power 3/2 of the second central moment.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    float
        Skewness (-); 0 for a symmetric pressure.
    """
    field = rung.pressure.whole()
    line_load = field.values.sum(axis=0) * field.grid.weights
    load_fraction = line_load / line_load.sum()
    offset_mm = field.grid.s_mm - field.grid.s_mm @ load_fraction
    return float(offset_mm**3 @ load_fraction / (offset_mm**2 @ load_fraction) ** 1.5)


def is_barely_separate(rung: Rung) -> bool:
    """Whether two lobes are barely joined, or two patches barely separate.

    Parameters
    ----------
    rung
        Solved contact.

    Returns
    -------
    bool
        False for a single lobe, and for patches at a large distance.
    """
    if len(rung.grid.bands) > 1:
        # Patches on several bands of the grid are at a large distance.
        return False
    ridge_MPa = rung.pressure_MPa.max(axis=0)
    loaded_columns = np.flatnonzero(ridge_MPa)
    lobes = find_lobe_windows(rung.pressure.whole().values)
    if len(lobes) == 1:
        return False
    # Either the pressure that remains between two lobes, or the free surface between two patches.
    valley_MPa = min(float(ridge_MPa[lobe.columns.start]) for lobe in lobes[1:])
    free_count = int(np.diff(loaded_columns).max()) - 1
    return (
        valley_MPa < _SEPARATION_FRACTION * float(ridge_MPa.max())
        and free_count < _SEPARATION_FRACTION * loaded_columns.size
    )
