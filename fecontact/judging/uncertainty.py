"""Numerical uncertainty of a measure from a contact on several mesh levels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

from fecontact.contact.elements import COMPLIANCE_ERROR_LIMIT, UNCHECKED_COMPLIANCE_ERROR
from fecontact.judging.measures import MEASURES, SEPARATE_LOAD_ERROR, UNCERTAINTIES
from fecontact.judging.uncertainty_budget import UncertaintyBudget

# Ratio of the element sizes of neighbouring mesh levels.
MESH_RATIO = 1.5
# The remaining error is at most the last change between meshes multiplied by this factor; studies/12_uncertainty.py
# counts how often this is true. With three meshes, the last change alone covers the peak of 88 % of exact contacts, and
# together with the change before it 99 %.
_CHANGE_FACTOR = 1.0
# A notch with a width of one to three nodes, and a patch that ends just beyond a junction, are read with an error that
# is proportional to the grid spacing. On 32 nodes, the remaining error is three times the change to 48 nodes.
_NODE_CHANGE_FACTOR, NODE_NUMBER_RATIO = 3.0, 1.5
# With three times the number of nodes, the change shows at least 0.81 of the error of the area and of the lateral
# length, wherever that error is larger than the stated uncertainty of reading. This was measured at 70 random positions
# with a junction below the patch, compared with 192 nodes, in 8 areas (0.22 to 0.91 %) and in 8 lengths (1.2 to 4.6 %).
# The stored change is half of the change to 96 nodes. The stated uncertainty is 1.25 of the whole change, or the usual
# uncertainty of reading if that is larger.
_CHECKED_CHANGE_FACTOR = 2.5
# Where patches just separate, the last change is not a bound: the error of b is 1.07 of it, and the error of the valley
# 1.09.
_SEPARATION_CHANGE_FACTOR = 1.5
# Joined lobes share the load by the stiffness of the bodies behind them, as separate patches do, and the peak of the
# highest lobe is proportional to the third root of its load (`lobe_load_exponent`; the exponent also holds for the
# force along another normal). A lobe of 0.35 mm beside a lobe of 2 mm (50E6 with S1002, 1:40, 1.74 mm, 57.1 kN) has
# 15.19, 15.19, 15.15 and 15.25 % of the load on meshes of 2.7, 4, 6 and 9 elements per semi-axis of the wider lobe. Its
# peak is 0.95, 1.01, 1.15 and 0.93 % below the peak on the half-space, and 1.32 % with 13.5 elements. Changes between
# meshes do not bound that error: they gave an uncertainty of 0.28 %.
# The end of a joined lobe is read from the nodes of its valley. In 24 exact contacts of two lobes (such as the contacts
# of study 12) the load fraction of a lobe is within 2e-4 plus two changes between meshes.
_SHARE_FLOOR, _SHARE_CHANGE_FACTOR = 2e-4, 2.0
# The response of the elements is separated from the response of the bodies by a quadratic function of the place, and
# again by a function of the fourth degree. On a head of 20 mm, where quick and fine meshes differ by 1.3 % in peak
# pressure, the two fits differ by 0.4 % on meshes that differ by 0.2 %. On heads that are wide for their patch they
# differ by 0.01 to 0.06 %.
_FIT_DIFFERENCE_FACTOR = 2.0
# If bodies are softer than their material by a fraction, the peak of the fine pressure changes by 0.02 of that
# fraction, half-widths by 0.015 and the area by 0.045 (R 300, S1002 on 60E1 at 3 mm and on 60E2 at 2.5 mm, 100 kN;
# factors up to 1.2).
_COMPLIANCE_SENSITIVITY = 0.05
# Number of elements per semi-axis for which `elements_reading` is declared.
_REFERENCE_ELEMENTS = 6.0


@dataclass(frozen=True, kw_only=True)
class SolutionQuality:
    """Errors and properties of a solved contact that its uncertainty depends on.

    Attributes
    ----------
    residual
        Relative residual of the contact solution (-).
    compliance_error
        Relative error of the compliance of the elements (-); NaN if it could not be measured.
    parting, shared
        Whether patches just separate, and whether several separate patches share the load.
    skew
        Lateral skewness of the pressure (-), from `compute_skewness`.
    more_nodes
        Change of some measures on more nodes (-), from `compare_with_more_nodes`.
    joined_share
        Load fraction of the lobe with the measured peak, if other lobes are joined to it (-); else 1.
    turned_force
        Relative difference of the force along another normal (-), from `Level.turned_force`.
    """

    residual: float = 0.0
    compliance_error: float = 0.0
    parting: bool = False
    shared: bool = False
    skew: float = 0.0
    more_nodes: Mapping[str, float] = field(default_factory=dict)
    joined_share: float = 1.0
    turned_force: float = 0.0


_NO_ERRORS = SolutionQuality()


def estimate_uncertainty(
    measure: str, values: Sequence[float], quality: SolutionQuality = _NO_ERRORS, *, otherwise: float | None = None
) -> float | None:
    """Uncertainty of a measure on the finest mesh.

    Parameters
    ----------
    measure, values, quality, otherwise
        As in `estimate_budget`.

    Returns
    -------
    float or None
        Sum of the contributions of `estimate_budget` (-); None if meshes do not show the uncertainty of the measure.

    Examples
    --------
    >>> from fecontact.judging.uncertainty import estimate_uncertainty
    >>> f"{estimate_uncertainty('p_max_MPa', [1000.0, 1002.0, 1010.0]):.4f}"
    '0.0079'
    """
    budget = estimate_budget(measure, values, quality, otherwise=otherwise)
    return None if budget is None else budget.total


def estimate_budget(
    measure: str, values: Sequence[float], quality: SolutionQuality = _NO_ERRORS, *, otherwise: float | None = None
) -> UncertaintyBudget | None:
    """Contributions to the uncertainty of a measure on the finest mesh.

    Parameters
    ----------
    measure
        Name of the measure.
    values
        Values of the measure on at least two meshes, the finest first, each `MESH_RATIO` coarser than the mesh before.
        A single value stands for equal values on all meshes.
    quality
        Errors and properties of the solved contact.
    otherwise
        Value on the finest mesh with the other fit that separates the response of the elements from the response of the
        bodies; None if it was not solved.

    Returns
    -------
    UncertaintyBudget or None
        Relative for `MEASURES`, absolute for `MISFITS` (-). NaN if a value is not finite, or if a relative value is 0;
        None if meshes do not show the uncertainty of the measure.

    Examples
    --------
    >>> from fecontact.judging.uncertainty import estimate_budget
    >>> budget = estimate_budget("p_max_MPa", [1000.0, 1002.0, 1010.0])
    >>> f"{budget.mesh_change:.4f}", f"{budget.cut_planes:.4f}"
    ('0.0053', '0.0014')
    """
    reading = estimate_reading_uncertainty(measure, values[0])
    if reading is None:
        return None
    declared, node_change = UNCERTAINTIES[measure], quality.more_nodes.get(measure, 0.0)
    return replace(
        estimate_step_budget(measure, values, quality, otherwise=otherwise),
        reading=reading,
        more_nodes=max(0.0, _CHECKED_CHANGE_FACTOR * node_change - reading)
        if declared.more_nodes == "at least"
        else _NODE_CHANGE_FACTOR * node_change,
        turned_force=declared.lobe_load_exponent * abs(quality.turned_force),
    )


def estimate_reading_uncertainty(measure: str, value: float) -> float | None:
    """Uncertainty of reading a measure from its nodes.

    Parameters
    ----------
    measure
        Name of the measure.
    value
        Value of the measure, in its unit.

    Returns
    -------
    float or None
        Relative for `MEASURES`, absolute for `MISFITS` (-); None if it has not been measured.
    """
    declared = UNCERTAINTIES[measure]
    reading, noise = declared.reading, declared.noise
    if reading is None:
        return None
    # The value is the root of the sum of two squares: noise and true value.
    return reading + (noise if value <= noise else value - math.sqrt(value**2 - noise**2))


def estimate_step_budget(
    measure: str, values: Sequence[float], quality: SolutionQuality = _NO_ERRORS, *, otherwise: float | None = None
) -> UncertaintyBudget:
    """Contributions to the uncertainty of the step from the half-space to the bodies.

    Both rungs have equal nodes. The contributions of `estimate_budget` without reading therefore remain.

    Parameters
    ----------
    measure
        Name of the measure.
    values
        Values of the measure on the mesh levels, as in `estimate_budget`.
    quality
        Errors and properties of the solved contact.
    otherwise
        Value with the other fit, as in `estimate_budget`.

    Returns
    -------
    UncertaintyBudget
        Relative for `MEASURES`, absolute for `MISFITS` (-); NaN if a value is not finite, or if a relative value is 0.
    """
    declared, value_by_other_fit = UNCERTAINTIES[measure], values[0] if otherwise is None else otherwise
    size = abs(values[0]) if measure in MEASURES else 1.0
    # a lobe on a single line of nodes has the half-width 0, but for rounding errors
    if size == 0.0 or not all(math.isfinite(value) for value in (*values, value_by_other_fit)):
        return UncertaintyBudget(mesh_change=math.nan)
    change_factor = _SEPARATION_CHANGE_FACTOR if quality.parting else _CHANGE_FACTOR
    return UncertaintyBudget(
        mesh_change=change_factor * compute_mesh_change(values) / size,
        common_mesh_error=declared.common_mesh_error,
        skewness=declared.skewness_error * abs(quality.skew),
        fit_difference=_FIT_DIFFERENCE_FACTOR * abs(values[0] - value_by_other_fit) / size,
        cut_planes=_cut_plane_uncertainty(measure, values[0], quality.shared),
        joined_lobe=0.0
        if quality.shared
        else declared.lobe_load_exponent * estimate_cut_plane_share(quality.joined_share) / quality.joined_share,
        # The misfits may be zero, on soft elements too.
        elements_compliance=_COMPLIANCE_SENSITIVITY
        * _bound_compliance_error(quality.compliance_error, UNCHECKED_COMPLIANCE_ERROR)
        * abs(values[0])
        / size,
        residual=quality.residual,
    )


def estimate_share_uncertainty(
    values: Sequence[float], quality: SolutionQuality = _NO_ERRORS, *, otherwise: float | None = None
) -> float:
    """Uncertainty of the load fraction of a lobe or a patch.

    The uncertainty by the cut planes is not included; see `estimate_cut_plane_share`.

    Parameters
    ----------
    values
        Load fractions (-) on the mesh levels, as in `estimate_uncertainty`.
    quality
        Errors and properties of the solved contact.
    otherwise
        Load fraction with the other fit, as in `estimate_uncertainty`.

    Returns
    -------
    float
        Absolute uncertainty (-); NaN if a value is not finite.
    """
    value_by_other_fit = values[0] if otherwise is None else otherwise
    if not all(math.isfinite(value) for value in (*values, value_by_other_fit)):
        return math.nan
    compliance_uncertainty = (
        _COMPLIANCE_SENSITIVITY
        * _bound_compliance_error(quality.compliance_error, UNCHECKED_COMPLIANCE_ERROR)
        * values[0]
    )
    fit_uncertainty = _FIT_DIFFERENCE_FACTOR * abs(values[0] - value_by_other_fit)
    return (
        _SHARE_FLOOR
        + _SHARE_CHANGE_FACTOR * compute_mesh_change(values)
        + fit_uncertainty
        + compliance_uncertainty
        + quality.residual
    )


def estimate_cut_plane_share(value: float) -> float:
    """Uncertainty of a lobe's load fraction from the cut planes.

    The lobe takes this load from all other lobes, or loses it to them.

    Parameters
    ----------
    value
        Fraction of the load on the lobe, from 0 to 1.

    Returns
    -------
    float
        Uncertainty of the fraction (-).
    """
    return SEPARATE_LOAD_ERROR * min(value, 1.0 - value)


def compute_mesh_change(values: Sequence[float]) -> float:
    """Largest change between neighbouring meshes, reduced to the finest mesh.

    Earlier changes are divided by `MESH_RATIO` for each later mesh, since errors decrease with the element size. A last
    change that is small by chance does not hide the earlier changes.

    Parameters
    ----------
    values
        Values on the mesh levels, the finest first.

    Returns
    -------
    float
        Absolute change in the unit of the values; 0 for a single value.

    Examples
    --------
    >>> from fecontact.judging.uncertainty import compute_mesh_change
    >>> round(compute_mesh_change([1.0, 1.02, 1.08]), 6)
    0.04
    """
    return max(
        (abs(finer - coarser) / MESH_RATIO**number for number, (finer, coarser) in enumerate(pairwise(values))),
        default=0.0,
    )


def _cut_plane_uncertainty(measure: str, value: float, shared: bool) -> float:
    """Uncertainty of a measure from the cut planes (-).

    It is larger if several separate patches share the load (`shared`); then a part is proportional to `value`, the
    value of the measure.
    """
    declared = UNCERTAINTIES[measure]
    if not shared:
        return declared.cut_planes
    # The approach has a cut-plane uncertainty of NaN, which is the result if it is the first argument.
    return max(declared.cut_planes, declared.shared_cut_planes, declared.shared_cut_planes_of_value * value)


def estimate_turned_force_uncertainty(turned_force: float) -> float:
    """Relative uncertainty of the peak from a force along another normal.

    Parameters
    ----------
    turned_force
        Relative difference of the force along another normal (-), from `Level.turned_force`.

    Returns
    -------
    float
        Relative uncertainty (-).
    """
    return UNCERTAINTIES["p_max_MPa"].lobe_load_exponent * abs(turned_force)


def _bound_compliance_error(compliance_error: float, error_if_unchecked: float) -> float:
    """Absolute error of the elements' compliance, or a given bound if it was not measured."""
    return error_if_unchecked if math.isnan(compliance_error) else abs(compliance_error)


def estimate_elements_budget(
    measure: str, values: Sequence[float], *, elements: float, compliance_error: float, residual: float = 0.0
) -> UncertaintyBudget | None:
    """Contributions to the uncertainty of a measure of the contact on the elements' nodes.

    Parameters
    ----------
    measure
        Name of the measure.
    values
        Values of the measure on these nodes of at least two mesh levels, as in `estimate_budget`.
    elements
        Number of elements per semi-axis on the finest mesh.
    compliance_error
        Relative error of the compliance of the elements (-); NaN if it could not be measured.
    residual
        Relative residual of the contact solution (-).

    Returns
    -------
    UncertaintyBudget or None
        Relative for `MEASURES`, absolute for `MISFITS` (-). NaN if a value is not finite, or if a relative value is 0;
        None if meshes do not show the uncertainty of the measure.
    """
    declared = UNCERTAINTIES[measure]
    if declared.elements_reading is None:
        return None
    size = abs(values[0]) if measure in MEASURES else 1.0
    if size == 0.0:
        return UncertaintyBudget(mesh_change=math.nan)
    return UncertaintyBudget(
        reading=declared.elements_reading * (_REFERENCE_ELEMENTS / elements) ** declared.elements_order,
        mesh_change=compute_mesh_change(values) / size,
        cut_planes=declared.cut_planes,
        # A larger error would be visible in the difference between this contact and the contact of the finer nodes
        # (`has_faulty_elements`).
        elements_compliance=declared.modulus_sensitivity
        * _bound_compliance_error(compliance_error, COMPLIANCE_ERROR_LIMIT)
        * abs(values[0])
        / size,
        residual=residual,
    )


def estimate_irregularity_uncertainty(measure: str, deviation: float, *, slope: float) -> float:
    """Uncertainty of a deviation if track irregularities are in the gap but in no mesh.

    The deformation of a body below a pressure along its normals differs from the deformation of the smooth body by
    about the largest slope. This was measured in plane strain: for waves of 14 and 30 mm with slopes of 0.002 to 0.022,
    the difference is 0.15 to 1.6 % of the shape below the patch, and 0.4 % at a flat of 60 mm with a slope of 0.05. For
    the misfits, the uncertainty is this fraction of their values.

    Parameters
    ----------
    measure
        Name of the measure.
    deviation
        Deviation of the measure (-).
    slope
        Largest slope of the irregularities (-).

    Returns
    -------
    float
        Uncertainty of the deviation (-).
    """
    return slope * abs(deviation) if UNCERTAINTIES[measure].irregularity_of_value else slope


# --- Measures that a user has defined: their uncertainty follows from declared uncertainties of the built-in measures.


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """Changes of a user's measure with small changes of the contact.

    All values are per unit of the change, in the unit of the measure's deviation. The measure must be read from the
    finite elements.

    Attributes
    ----------
    along, across
        Change with the length along x or across (relative), under an equal force.
    force
        Change with the force (relative), by which lengths and pressures grow as in Hertz's theory.
    centre
        Change with the lateral position of the contact, in half-widths b.
    lobe
        Change with the load of the highest lobe (relative); 0 for a single lobe.
    """

    along: float
    across: float
    force: float
    centre: float
    lobe: float

    def bound_change(self, peak: float, length_x: float, length_y: float) -> float:
        """Largest change of the measure for bounds of the errors of the built-in measures.

        Errors of both lengths have equal signs if the peak is wrong, and may have opposite signs otherwise.

        Parameters
        ----------
        peak, length_x, length_y
            Bounds of the relative errors of peak pressure, half-width a and half-width b (-).

        Returns
        -------
        float
            Largest change, in the unit of the measure's deviation.
        """
        changes = (
            0.5 * (self.along + self.across) * peak,
            self.along * length_x,
            self.across * length_y,
            self.along * length_x - self.across * length_y,
        )
        return max(map(abs, changes))

    def bound_declared(self, uncertainty_name: str) -> float:
        """Largest change of the measure for a declared uncertainty.

        Parameters
        ----------
        uncertainty_name
            Attribute of `MeasureUncertainty`, of which peak, half-widths and centre of pressure are read.

        Returns
        -------
        float
            Largest change, in the unit of the measure's deviation.
        """
        sizes: tuple[float, ...] = tuple(
            getattr(UNCERTAINTIES[name], uncertainty_name) for name in ("p_max_MPa", "a_mm", "b_mm")
        )
        centre: float = getattr(UNCERTAINTIES["centre_over_b"], uncertainty_name)
        return self.bound_change(*sizes) + abs(self.centre) * centre


def estimate_own_budget(
    deviations: Sequence[float],
    sensitivity: Sensitivity,
    quality: SolutionQuality,
    *,
    by_other_fit: float,
    node_change: float,
    irregularity_slope: float = 0.0,
) -> UncertaintyBudget:
    """Contributions to the uncertainty of a deviation in a user's measure.

    Nothing is known about the measure itself. The meshes and the nodes are compared in the measure. Errors that all
    meshes have in common are taken from the built-in measures, with the sensitivity of the measure.

    Parameters
    ----------
    deviations
        Deviations of a theory on the mesh levels, the finest first, in the unit of the deviation.
    sensitivity
        Sensitivity of the measure on the finest level, in the unit of the deviation.
    quality
        Errors and properties of the solved contact.
    by_other_fit
        Deviation with the other fit, as in `estimate_budget`.
    node_change
        Change of the deviation with the nodes, from `own_measures.OwnMeasures`.
    irregularity_slope
        Largest slope of irregularities that no mesh has (-).

    Returns
    -------
    UncertaintyBudget
        In the unit of the deviation; NaN if a deviation is not finite.
    """
    if not all(math.isfinite(value) for value in (*deviations, by_other_fit, node_change)):
        return UncertaintyBudget(mesh_change=math.nan)
    change_factor = _SEPARATION_CHANGE_FACTOR if quality.parting else _CHANGE_FACTOR
    # the change of an edge between nodes is in `node_change`
    more_nodes = _NODE_CHANGE_FACTOR * quality.more_nodes.get("p_max_MPa", 0.0)
    compliance = _COMPLIANCE_SENSITIVITY * _bound_compliance_error(quality.compliance_error, UNCHECKED_COMPLIANCE_ERROR)
    lobe_share = quality.joined_share

    def bound_equal(error: float) -> float:
        return sensitivity.bound_change(error, error, error)

    return UncertaintyBudget(
        reading=node_change + sensitivity.bound_declared("reading"),
        more_nodes=bound_equal(more_nodes),
        mesh_change=change_factor * compute_mesh_change(deviations),
        common_mesh_error=sensitivity.bound_declared("common_mesh_error"),
        skewness=abs(sensitivity.centre * quality.skew) * UNCERTAINTIES["centre_over_b"].skewness_error,
        fit_difference=_FIT_DIFFERENCE_FACTOR * abs(deviations[0] - by_other_fit),
        cut_planes=sensitivity.bound_declared("cut_planes"),
        joined_lobe=abs(sensitivity.lobe) * estimate_cut_plane_share(lobe_share) / lobe_share,
        turned_force=abs(sensitivity.force * quality.turned_force),
        elements_compliance=bound_equal(compliance),
        residual=bound_equal(quality.residual),
        irregularity=bound_equal(irregularity_slope),
    )


def estimate_own_elements_budget(
    deviations: Sequence[float],
    sensitivity: Sensitivity,
    *,
    elements: float,
    compliance_error: float,
    residual: float,
    node_change: float,
    irregularity_slope: float = 0.0,
) -> UncertaintyBudget:
    """Contributions to the uncertainty of a deviation in a user's measure on the elements' nodes.

    Parameters
    ----------
    deviations, sensitivity, node_change, irregularity_slope
        As in `estimate_own_budget`, on the elements' nodes.
    elements, compliance_error, residual
        As in `estimate_elements_budget`.

    Returns
    -------
    UncertaintyBudget
        In the unit of the deviation; NaN if a deviation is not finite.
    """
    if not all(math.isfinite(value) for value in (*deviations, node_change)):
        return UncertaintyBudget(mesh_change=math.nan)
    declared = [UNCERTAINTIES[name] for name in ("p_max_MPa", "a_mm", "b_mm")]
    readings = (
        (measure.elements_reading or 0.0) * (_REFERENCE_ELEMENTS / elements) ** measure.elements_order
        for measure in declared
    )
    compliance = _bound_compliance_error(compliance_error, COMPLIANCE_ERROR_LIMIT)
    centre_reading = abs(sensitivity.centre) * (UNCERTAINTIES["centre_over_b"].elements_reading or 0.0)
    return UncertaintyBudget(
        reading=node_change + sensitivity.bound_change(*readings) + centre_reading,
        mesh_change=compute_mesh_change(deviations),
        cut_planes=sensitivity.bound_declared("cut_planes"),
        elements_compliance=sensitivity.bound_change(
            *(measure.modulus_sensitivity * compliance for measure in declared)
        ),
        residual=sensitivity.bound_change(residual, residual, residual),
        irregularity=sensitivity.bound_change(irregularity_slope, irregularity_slope, irregularity_slope),
    )
