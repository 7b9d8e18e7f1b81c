"""Measures that a user has defined: their values, deviations and uncertainties.

A user's function is evaluated on the pressure of the finite elements and on the pressure of a theory at the same nodes,
so that most of the error of the nodes is in neither deviation nor verdict.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact.grid import ContactGrid, Field, Rung
from fecontact.contact.patch import find_lobe_windows
from fecontact.contact_theories.approximation import TheoryContact
from fecontact.errors import InputError
from fecontact.judging.measures import read_patch
from fecontact.judging.uncertainty import (
    Sensitivity,
    SolutionQuality,
    estimate_own_budget,
    estimate_own_elements_budget,
)
from fecontact.judging.uncertainty_budget import UncertaintyBudget
from fecontact.own_criterion import ContactField, OwnCriterion
from fecontact.placement.wheel_on_rail import Placement

# Relative change of a length or a load, and change of the position in half-widths b, with which the sensitivity of a
# measure is computed. With 32 nodes per semi-axis it is 1.6 nodes at the edge of the patch: a measure with a threshold
# changes by the nodes that pass the threshold.
_CHANGE = 0.05
# Fraction of the change by which a measure may depend on the outermost loaded nodes. A solver loads nodes up to a tenth
# of a node spacing outside an exact ellipse: on 13 exact contacts the area of the loaded nodes is 0.4 to 0.9 % too
# large, and without the outermost nodes it is 5 to 7 % smaller. Without this contribution 5 of 182 deviations in 14
# measures (areas and means over loaded nodes, widths, gradients, powers of the pressure, loads beyond a place) were not
# covered, by up to 7 % of their uncertainty.
_EDGE_FRACTION = 0.2
_ELEMENTS, _THEORY = "the finite elements", "a theory"
_BUDGETS = "budgets"
Number = TypeVar("Number", float, UncertaintyBudget)
OwnEvaluations = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""Values, deviations or budgets by stage of the judgement, by quantity, and by the name of the measure."""


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnMeasures:
    """Criteria of a user at the position of a case.

    Attributes
    ----------
    criteria
        Criteria whose functions this process can call.
    placement
        Wheel on rail, for the undeformed gap; None without criteria.
    place
        Words for the case, for messages.
    irregularity_slope
        Largest slope of the irregularities (-).
    stored
        Stored evaluations of criteria whose functions this process cannot call.
    evaluations
        All evaluations of this judgement, which are filled in as they are made.
    stage
        Name of the present stage of the judgement; evaluations of an unnamed stage are not kept.
    """

    criteria: tuple[OwnCriterion, ...] = ()
    placement: Placement | None = None
    place: str = ""
    irregularity_slope: float = 0.0
    stored: OwnEvaluations = field(default_factory=dict, repr=False)
    evaluations: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict, repr=False)
    stage: str = ""
    # the same contacts are read for several theories, and for the verdict and its record
    _gaps: dict[tuple[bytes, bytes], Floats] = field(default_factory=dict, repr=False)
    _sensitivities: dict[tuple[Rung, OwnCriterion], Sensitivity] = field(default_factory=dict, repr=False)

    @classmethod
    def read_criteria(cls, case: Case, placement: Placement, stored: OwnEvaluations | None = None) -> OwnMeasures:
        """Criteria of a case at its position.

        Parameters
        ----------
        case
            Case with its criteria.
        placement
            Wheel on rail.
        stored
            Stored evaluations of criteria whose functions are not available.

        Returns
        -------
        OwnMeasures
            Without a criterion that has neither a function nor stored evaluations.
        """
        criteria = tuple(criterion for criterion in case.criteria.own or () if criterion.is_available)
        if not criteria and not stored:
            return NO_OWN_MEASURES
        return cls(
            stored=stored or {},
            criteria=criteria,
            placement=placement,
            place=f"{case.rail} and {case.wheel}, {case.lateral_shift_mm:+z.2f} mm, {case.load_N / 1e3:g} kN",
            irregularity_slope=sum(irregularity.largest_slope for irregularity in case.irregularities),
        )

    def enter_stage(self, stage: str) -> OwnMeasures:
        """Criteria at a stage of the judgement. Evaluations are stored by the name of the stage.

        Parameters
        ----------
        stage
            Name of the stage.

        Returns
        -------
        OwnMeasures
            These criteria, with common evaluations.
        """
        return replace(self, stage=stage) if self.criteria or self.stored else self

    @property
    def zero_budgets(self) -> dict[str, UncertaintyBudget]:
        """Budgets without an uncertainty, by the names of the measures of this stage."""
        stored_budgets = self.stored.get(self.stage, {}).get(_BUDGETS, {})
        return dict.fromkeys(
            (*(criterion.key for criterion in self.criteria), *stored_budgets),
            UncertaintyBudget(),
        )

    def _complete(self, quantity: str, computed_values: dict[str, Number]) -> dict[str, Number]:
        """Computed values, with the stored values of this stage for functions that are not available."""
        if not self.stage:
            return computed_values
        stored_values: Mapping[str, Number] = self.stored.get(self.stage, {}).get(quantity, {})
        values = {**stored_values, **computed_values}
        if values:
            self.evaluations.setdefault(self.stage, {})[quantity] = values
        return values

    def read_values(self, rung: Rung) -> dict[str, float]:
        """Values of a solved contact, in the units of the criteria.

        Parameters
        ----------
        rung
            Solved contact.

        Returns
        -------
        dict of str to float
            Values by the name of the measure.
        """
        if not self.criteria:
            return self._complete("values", {})
        contact = self._build_field(rung.pressure.whole(), rung.normal_force_N)
        values = {criterion.key: self._evaluate(criterion, contact, _ELEMENTS) for criterion in self.criteria}
        return self._complete("values", values)

    def read_theory_values(self, rung: Rung, theory: TheoryContact) -> dict[str, float]:
        """Values of a theory at the nodes of a solved contact.

        Parameters
        ----------
        rung
            Solved contact.
        theory
            Contact predicted by the theory.

        Returns
        -------
        dict of str to float
            Values by the name of the measure.
        """
        if not self.criteria:
            return self._complete("theory_values", {})
        _, contact = self._build_pair(rung, theory)
        values = {criterion.key: self._evaluate(criterion, contact, _THEORY) for criterion in self.criteria}
        return self._complete("theory_values", values)

    def compute_deviations(self, rung: Rung, theory: TheoryContact) -> dict[str, float]:
        """Deviations of a theory from a solved contact.

        Parameters
        ----------
        rung
            Solved contact.
        theory
            Contact predicted by the theory.

        Returns
        -------
        dict of str to float
            (Theory - contact) / contact (-) for relative criteria, else theory - contact in the unit of the criterion.

        Raises
        ------
        InputError
            If a function fails, or if the value of the contact is 0 for a relative criterion.
        """
        return self._complete("deviations", self._compute_deviations(rung, theory))

    def _compute_deviations(self, rung: Rung, theory: TheoryContact) -> dict[str, float]:
        """Deviations of a theory from a solved contact, for all available functions."""
        if not self.criteria:
            return {}
        pair = self._build_pair(rung, theory)
        return {criterion.key: self._compute_deviation(criterion, *pair) for criterion in self.criteria}

    def estimate_budgets(
        self, rungs: Sequence[Rung], other_fit: Rung, theory: TheoryContact, quality: SolutionQuality
    ) -> dict[str, UncertaintyBudget]:
        """Contributions to the uncertainty of each deviation from the mesh levels.

        Parameters
        ----------
        rungs
            Contact on the finer nodes of each mesh level, the finest first.
        other_fit
            Contact of the finest level with the other fit.
        theory
            Contact predicted by the theory.
        quality
            Errors and properties of the finest level.

        Returns
        -------
        dict of str to UncertaintyBudget
            In the unit of each deviation.
        """
        if not self.criteria:
            return self._complete(_BUDGETS, {})
        deviations, other_deviation = self._compare_levels(rungs, theory), self._compute_deviations(other_fit, theory)
        node_changes = self._compute_node_changes(rungs[0], theory)
        budgets = {
            criterion.key: estimate_own_budget(
                deviations[criterion.key],
                self._scale_sensitivity(criterion, rungs[0], deviations[criterion.key][0]),
                quality,
                by_other_fit=other_deviation[criterion.key],
                node_change=node_changes[criterion.key],
                irregularity_slope=self.irregularity_slope,
            )
            for criterion in self.criteria
        }
        return self._complete(_BUDGETS, budgets)

    def estimate_elements_budgets(
        self, rungs: Sequence[Rung], theory: TheoryContact, *, elements: float, compliance_error: float, residual: float
    ) -> dict[str, UncertaintyBudget]:
        """Contributions to the uncertainty of each deviation on the elements' nodes.

        Parameters
        ----------
        rungs
            Contact on the elements' nodes of each mesh level, the finest first.
        theory
            Contact predicted by the theory.
        elements, compliance_error, residual
            As in `uncertainty.estimate_elements_budget`.

        Returns
        -------
        dict of str to UncertaintyBudget
            In the unit of each deviation.
        """
        if not self.criteria:
            return self._complete(_BUDGETS, {})
        deviations, node_changes = self._compare_levels(rungs, theory), self._compute_node_changes(rungs[0], theory)
        budgets = {
            criterion.key: estimate_own_elements_budget(
                deviations[criterion.key],
                self._scale_sensitivity(criterion, rungs[0], deviations[criterion.key][0]),
                elements=elements,
                compliance_error=compliance_error,
                residual=residual,
                node_change=node_changes[criterion.key],
                irregularity_slope=self.irregularity_slope,
            )
            for criterion in self.criteria
        }
        return self._complete(_BUDGETS, budgets)

    def _compare_levels(self, rungs: Sequence[Rung], theory: TheoryContact) -> dict[str, list[float]]:
        """Deviations of a theory on each mesh level, by the name of the measure."""
        levels = [self._compute_deviations(rung, theory) for rung in rungs]
        return {criterion.key: [level[criterion.key] for level in levels] for criterion in self.criteria}

    def _compute_node_changes(self, rung: Rung, theory: TheoryContact) -> dict[str, float]:
        """Change of each deviation with the nodes.

        It is the largest change from every second node to all nodes, and a part of the change without the outermost
        loaded nodes.         There are four such sets of nodes, as every second node counts in both directions. The
        change is NaN if a function has no finite value on a set.
        """
        pair = self._build_pair(rung, theory)
        halves = [
            tuple(self._select_nodes(contact, first_row, first_column) for contact in pair)
            for first_row in (0, 1)
            for first_column in (0, 1)
        ]
        changes = {}
        for criterion in self.criteria:
            deviation = self._compute_deviation(criterion, *pair)
            half_deviations = [self._compute_deviation(criterion, *half, strict=False) for half in halves]
            edge_deviation = self._compute_deviation(criterion, _remove_edge(pair[0]), pair[1], strict=False)
            changes[criterion.key] = float(
                np.max(np.abs(np.array(half_deviations) - deviation)) + _EDGE_FRACTION * abs(edge_deviation - deviation)
            )
        return changes

    def _scale_sensitivity(self, criterion: OwnCriterion, rung: Rung, deviation: float) -> Sensitivity:
        """Sensitivity of the deviation, from the sensitivity of the value of the finite elements.

        A relative deviation is theory / finite elements - 1.
        """
        key = (rung, criterion)
        if key not in self._sensitivities:
            self._sensitivities[key] = self._compute_sensitivity(criterion, rung)
        sensitivity, factor = self._sensitivities[key], abs(1.0 + deviation) if criterion.relative else 1.0
        return Sensitivity(**{name: factor * value for name, value in vars(sensitivity).items()})

    def _compute_sensitivity(self, criterion: OwnCriterion, rung: Rung) -> Sensitivity:
        """Changes of the value of a solved contact with small changes of the contact."""
        contact, patch = self._build_field(rung.pressure.whole(), rung.normal_force_N), read_patch(rung)
        value = self._evaluate(criterion, contact, _ELEMENTS)
        size = abs(value) if criterion.relative else 1.0

        def compute_slope(change_contact: Callable[[float], ContactField]) -> float:
            """Change per unit: the larger of both directions."""
            slopes = [
                (self._evaluate(criterion, change_contact(change), _ELEMENTS, strict=False) - value) / (change * size)
                for change in (-_CHANGE, _CHANGE)
            ]
            return max(slopes, key=lambda slope: math.inf if math.isnan(slope) else abs(slope))

        centre_mm = (patch.centre_x_mm, patch.centre_y_mm)
        return Sensitivity(
            along=compute_slope(lambda change: _stretch(contact, centre_mm, 1.0 + change, 1.0)),
            across=compute_slope(lambda change: _stretch(contact, centre_mm, 1.0, 1.0 + change)),
            force=compute_slope(partial(_change_force, contact, centre_mm)),
            centre=compute_slope(lambda change: replace(contact, s_mm=contact.s_mm + change * patch.b_mm)),
            lobe=compute_slope(partial(_change_lobe, contact)) if len(patch.lobes) > 1 else 0.0,
        )

    def _compute_deviation(
        self, criterion: OwnCriterion, contact: ContactField, theory_contact: ContactField, *, strict: bool = True
    ) -> float:
        """Deviation of a theory's field from the field of a solved contact.

        Without `strict`, the result is NaN instead of an error if a value is not finite or 0.
        """
        value = self._evaluate(criterion, contact, _ELEMENTS, strict=strict)
        theory_value = self._evaluate(criterion, theory_contact, _THEORY, strict=strict)
        if not criterion.relative:
            return theory_value - value
        if value == 0.0:
            if not strict:
                return math.nan
            raise InputError(
                f"own criterion {criterion.name}: {criterion.reference} returned 0 for {_ELEMENTS} at {self.place}; a"
                " relative deviation needs another value than 0; use relative=False with a limit in the unit"
            )
        return theory_value / value - 1.0

    def _evaluate(self, criterion: OwnCriterion, contact: ContactField, owner: str, *, strict: bool = True) -> float:
        """Value of a user's function; every error of the function becomes an `InputError` that names it.

        Without `strict` a value that is not finite becomes NaN.
        """
        function = criterion.function
        assert callable(function)
        subject = f"own criterion {criterion.name}: {criterion.reference}"
        where = f"the pressure of {owner} at {self.place}"
        try:
            returned = function(contact)
        except MemoryError:
            raise
        # a function that calls sys.exit must not end a study of many cases
        except (Exception, SystemExit) as error:
            raise InputError(f"{subject} raised {type(error).__name__}: {error} for {where}; correct it") from error
        try:
            value = float(returned)
        except (TypeError, ValueError) as error:
            raise InputError(f"{subject} returned {returned!r:.80} for {where}; return a number") from error
        if math.isfinite(value):
            return value
        if strict:
            raise InputError(f"{subject} returned {value} for {where}; return a finite number")
        return math.nan

    def _build_pair(self, rung: Rung, theory: TheoryContact) -> tuple[ContactField, ContactField]:
        """Fields of a solved contact and of a theory at common nodes."""
        covering_field = theory.extend_pressure(rung)
        pressure_MPa = _place_theory_pressure(theory, covering_field.grid)
        theory_field = Field(grid=covering_field.grid, values=pressure_MPa)
        return (
            self._build_field(covering_field, rung.normal_force_N),
            self._build_field(theory_field, theory.normal_force_N),
        )

    def _build_field(self, pressure: Field, normal_force_N: float) -> ContactField:
        grid = pressure.grid
        return ContactField(
            x_mm=grid.x_mm,
            s_mm=grid.s_mm,
            pressure_MPa=pressure.values,
            weight_mm2=grid.nodal_area_mm2().reshape(grid.shape),
            normal_force_N=normal_force_N,
            undeformed_gap=self._compute_gap,
        )

    def _select_nodes(self, contact: ContactField, first_row: int, first_column: int) -> ContactField:
        """Field on every second node in each direction, with weights for these nodes."""
        rows, columns = slice(first_row, None, 2), slice(first_column, None, 2)
        # the weights are four times as large, except at the ends of the grid, where the pressure is zero
        return replace(
            contact,
            x_mm=contact.x_mm[rows],
            s_mm=contact.s_mm[columns],
            pressure_MPa=contact.pressure_MPa[rows, columns],
            weight_mm2=4.0 * contact.weight_mm2[rows, columns],
        )

    def _compute_gap(self, x_mm: Floats, s_mm: Floats) -> Floats:
        """Undeformed gap between the bodies at positions in mm; gaps of equal grids are computed once."""
        assert self.placement is not None
        key = (x_mm.tobytes(), s_mm.tobytes())
        if key not in self._gaps:
            self._gaps[key] = np.asarray(self.placement.gap(x_mm, s_mm))
        return self._gaps[key].copy()


NO_OWN_MEASURES = OwnMeasures()
"""No criteria of a user."""


def make_evaluations_record(evaluations: OwnEvaluations) -> dict[str, Any]:
    """Record of evaluations, for a file.

    Parameters
    ----------
    evaluations
        Evaluations of a judgement.

    Returns
    -------
    dict
        Plain values.
    """
    return {
        stage: {
            quantity: {
                measure: value.contributions if isinstance(value, UncertaintyBudget) else value
                for measure, value in values.items()
            }
            for quantity, values in quantities.items()
        }
        for stage, quantities in evaluations.items()
    }


def restore_evaluations(record: Mapping[str, Any], measures: Sequence[str]) -> OwnEvaluations:
    """Restore evaluations from their record.

    Parameters
    ----------
    record
        Record from `make_evaluations_record`; a value that was not a number is None.
    measures
        Names of the measures to restore.

    Returns
    -------
    mapping
        Evaluations of these measures.
    """

    def restore_value(value: Any) -> Any:
        """Number or budget of a plain value."""
        if isinstance(value, Mapping):
            return UncertaintyBudget(**{name: restore_value(contribution) for name, contribution in value.items()})
        return math.nan if value is None else float(value)

    return {
        stage: {
            quantity: {measure: restore_value(values[measure]) for measure in measures if measure in values}
            for quantity, values in quantities.items()
        }
        for stage, quantities in record.items()
        if any(measure in values for values in quantities.values() for measure in measures)
    }


def _place_theory_pressure(theory: TheoryContact, grid: ContactGrid) -> Floats:
    """Pressure of a theory at nodes, as a contact solver places it.

    The pressure is averaged over the cells, so that its sum is the force. A solver has no pressure at nodes outside the
    patch: the force of their cells is moved to the nearest node inside.
    """
    averaged = theory.on(grid)
    at_nodes = np.zeros(grid.shape)
    for patch in theory.patches:
        x, s = patch.origin_mm
        at_nodes += patch.shape.pressure_MPa(grid.x_mm[:, None] - x, grid.s_mm[None, :] - s)
    return _move_inside(averaged, grid.nodal_area_mm2().reshape(grid.shape), at_nodes > 0.0)


def _move_inside(pressure_MPa: Floats, area_mm2: Floats, is_inside: NDArray[np.bool_]) -> Floats:
    """Pressure with the forces of nodes outside a patch at the nearest nodes inside.

    Without a node inside the pressure is unchanged.
    """
    from scipy.ndimage import distance_transform_edt

    is_moved = ~is_inside & (pressure_MPa > 0.0)
    if not is_inside.any() or not is_moved.any():
        return pressure_MPa
    rows, columns = distance_transform_edt(~is_inside, return_distances=False, return_indices=True)
    force_N = pressure_MPa * area_mm2
    placed_force_N = np.where(is_inside, force_N, 0.0)
    np.add.at(placed_force_N, (rows[is_moved], columns[is_moved]), force_N[is_moved])
    return np.asarray(placed_force_N / area_mm2)


def _remove_edge(contact: ContactField) -> ContactField:
    """Field without its outermost loaded nodes; the nodes inside carry their force."""
    from scipy.ndimage import binary_erosion

    is_inside = binary_erosion(contact.pressure_MPa > 0.0)
    return replace(contact, pressure_MPa=_move_inside(contact.pressure_MPa, contact.weight_mm2, is_inside))


def _stretch(contact: ContactField, centre_mm: tuple[float, float], along: float, across: float) -> ContactField:
    """Field with lengths that are multiplied by two factors, under an equal force.

    The centre of pressure stays.
    """
    (x, s), factor = centre_mm, along * across
    return replace(
        contact,
        x_mm=x + along * (contact.x_mm - x),
        s_mm=s + across * (contact.s_mm - s),
        pressure_MPa=contact.pressure_MPa / factor,
        weight_mm2=factor * contact.weight_mm2,
    )


def _change_force(contact: ContactField, centre_mm: tuple[float, float], change: float) -> ContactField:
    """Field under a force that is larger by a fraction; lengths and pressures grow with its third root."""
    length = (1.0 + change) ** (1.0 / 3.0)
    stretched = _stretch(contact, centre_mm, length, length)
    return replace(
        stretched,
        pressure_MPa=(1.0 + change) * stretched.pressure_MPa,
        normal_force_N=(1.0 + change) * contact.normal_force_N,
    )


def _change_lobe(contact: ContactField, change: float) -> ContactField:
    """Field with a larger load on its highest lobe, by a fraction.

    All other lobes lose this load. The pressure of each lobe grows with the third root of its load, and its area with
    the rest.
    """
    lobe_windows = find_lobe_windows(contact.pressure_MPa)
    peaks_MPa = [contact.pressure_MPa[:, window.columns].max() for window in lobe_windows]
    forces_N = [
        float(np.sum(window.parts * contact.pressure_MPa[:, window.columns] * contact.weight_mm2[:, window.columns]))
        for window in lobe_windows
    ]
    highest = int(np.argmax(peaks_MPa))
    share = forces_N[highest] / sum(forces_N)
    load_factor = np.zeros(contact.s_mm.size)
    for number, window in enumerate(lobe_windows):
        factor = 1.0 + change if number == highest else 1.0 - change * share / (1.0 - share)
        load_factor[window.columns] += window.parts * max(factor, 0.0)
    return replace(
        contact,
        pressure_MPa=contact.pressure_MPa * load_factor ** (1.0 / 3.0),
        weight_mm2=contact.weight_mm2 * load_factor ** (2.0 / 3.0),
    )


def keep_irreducible(budget: UncertaintyBudget) -> UncertaintyBudget:
    """Contributions of a user's measure that finer meshes do not remove.

    Parameters
    ----------
    budget
        All contributions.

    Returns
    -------
    UncertaintyBudget
        Contributions of nodes, cut planes, load on lobes and direction of the force, and the common mesh error.
    """
    return replace(budget, mesh_change=0.0, fit_difference=0.0, skewness=0.0, elements_compliance=0.0, residual=0.0)
