"""Models of a wheel on an irregularity, judged by the half-space.

The models are one-point models. The half-space has the irregularity in its gap.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact.halfspace import NODES_PER_HALF_LENGTH, solve_gap_contact
from fecontact.contact.patch import Patch, measure_patch
from fecontact.contact_theories.hertz import HertzContact, hertz_spring_force_N
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.irregular.limit import LIMIT
from fecontact.features.irregular.models import MODELS, IrregularPlace, Model, SmoothBodies
from fecontact.placement.irregularity import Irregularity
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.alone import HALF_SPACE, compute_normal_force, evaluate_theory
from fecontact.solving.placing import place_case

# Smallest number of nodes per wave, if a patch has NODES nodes on its half length.
_MIN_NODES_PER_WAVE = 4
# Factor on the number of nodes for an edge. With this factor the error of the approach is at most 0.02 %, and without
# the factor at most 0.15 %.
_EDGE_NODE_FACTOR = 2
# Bodies may touch where their gap is below the irregularity's height plus this multiple of Hertz's approach.
_REACH_FACTOR = 1.6


@dataclass(frozen=True, kw_only=True, eq=False)
class ReferenceContact:
    """Contact on the half-space with the irregularity in the gap.

    Attributes
    ----------
    approach_mm
        Approach from the position in which wheel and rail would touch without the irregularity.
    patch
        Measures of the patch.
    p_max_MPa
        Peak pressure; None if an edge is in the patch, where the pressure is unbounded.
    residual
        Contact residual plus penetration residual, relative to the approach.
    """

    approach_mm: float
    patch: Patch
    p_max_MPa: float | None
    residual: float


@dataclass(frozen=True, kw_only=True)
class ModelErrors:
    """Errors of a model at a place, or its largest errors over several places.

    The errors have their signs.

    Attributes
    ----------
    force_error
        Error of the force divided by the load, at the approach at which the half-space carries the load; NaN without a
        force.
    peak_error
        Relative error of the peak pressure under the load; NaN if the model or the half-space has no peak.
    """

    force_error: float
    peak_error: float

    def holds(self, limit: float = LIMIT) -> bool:
        """Whether both errors are within a limit; NaN is not within it.

        Parameters
        ----------
        limit
            Largest magnitude of both errors (-).

        Returns
        -------
        bool
            Whether the model holds.
        """
        return abs(self.force_error) <= limit and abs(self.peak_error) <= limit


@dataclass(frozen=True, kw_only=True)
class JudgedModel(ModelErrors):
    """Model at a place.

    Attributes
    ----------
    approach_mm
        Approach under the load.
    force_N
        Force at the approach at which the half-space carries the load.
    problem
        Reason why the model has no result; empty if it has a result.
    """

    approach_mm: float
    force_N: float
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedPlace:
    """All models at a place of an irregularity, and the half-space that judges them.

    Attributes
    ----------
    s_mm
        Distance along the irregularity.
    truth
        Contact on the half-space.
    models
        Results and errors by the name of the model.
    """

    s_mm: float
    truth: ReferenceContact
    models: Mapping[str, JudgedModel]


def make_irregular_place(
    pair: SmoothBodies, normal_force_N: float, irregularity: Irregularity, s_mm: float
) -> IrregularPlace:
    """Make the place of a pair at a distance along an irregularity.

    Parameters
    ----------
    pair
        The smooth bodies.
    normal_force_N
        Normal force.
    irregularity
        Irregularity of wheel and rail.
    s_mm
        Distance along the irregularity.

    Returns
    -------
    IrregularPlace
        The place.

    Raises
    ------
    InputError
        If a table does not reach over the contact, or if waves are too short for the nodes.
    """
    hertz = pair.hertz(normal_force_N)
    spacing = hertz.a_mm / NODES_PER_HALF_LENGTH
    if irregularity.finest_mm < _MIN_NODES_PER_WAVE * spacing:
        raise InputError(
            f"irregularity {irregularity.kind}: the shortest wave is {irregularity.finest_mm:g} mm; allowed: at least"
            f" {_MIN_NODES_PER_WAVE * spacing:.2g} mm on a patch of {2.0 * hertz.a_mm:.1f} mm with nodes"
            f" {spacing:.2g} mm apart; omit shorter waves: they are roughness, which the patch flattens"
        )
    reach = math.sqrt((_REACH_FACTOR * hertz.approach_mm + irregularity.height_mm) / pair.A_per_mm)
    if irregularity.kind == "table":
        first, last = irregularity.points_mm[0][0], irregularity.points_mm[-1][0]
        if not first + hertz.a_mm <= s_mm <= last - hertz.a_mm:
            raise InputError(
                f"irregularity table: the contact at {s_mm:g} mm reaches beyond its ends, {first:g} and {last:g} mm;"
                f" allowed: {first + hertz.a_mm:.6g} to {last - hertz.a_mm:.6g} mm; give other positions or a longer"
                " table"
            )
    return IrregularPlace(
        pair=pair,
        opening=lambda x: irregularity.opening_mm(s_mm + x),
        reach_mm=reach,
        normal_force_N=normal_force_N,
        kinks_mm=tuple(kink - s_mm for kink in irregularity.kinks_mm),
    )


def solve_reference(
    pair: SmoothBodies, normal_force_N: float, irregularity: Irregularity, s_mm: float, *, nodes: int | None = None
) -> ReferenceContact:
    """Solve the half-space at a distance along an irregularity.

    Parameters
    ----------
    pair
        The smooth bodies.
    normal_force_N
        Normal force.
    irregularity
        Irregularity of wheel and rail.
    s_mm
        Distance along the irregularity.
    nodes
        Nodes per semi-axis; 16 if not given, or 32 if the irregularity has edges.

    Returns
    -------
    ReferenceContact
        Contact on the half-space.

    Raises
    ------
    InputError, ConvergenceError
        As in `make_irregular_place` and `solve_gap_contact`.
    """
    return _solve_reference(make_irregular_place(pair, normal_force_N, irregularity, s_mm), irregularity, s_mm, nodes)


def judge_place(pair: SmoothBodies, normal_force_N: float, irregularity: Irregularity, s_mm: float) -> JudgedPlace:
    """Judge all models by the half-space at a distance along an irregularity.

    Parameters
    ----------
    pair
        The smooth bodies.
    normal_force_N
        Normal force.
    irregularity
        Irregularity of wheel and rail.
    s_mm
        Distance along the irregularity.

    Returns
    -------
    JudgedPlace
        Results and errors of all models.

    Raises
    ------
    InputError, ConvergenceError
        As in `solve_reference`.

    Examples
    --------
    >>> from fecontact.features.irregular.model_errors import judge_place
    >>> from fecontact.features.irregular.models import SmoothBodies
    >>> from fecontact.placement.irregularity import Irregularity
    >>> pair = SmoothBodies(A_per_mm=1 / 920, B_per_mm=1 / 600, contact_modulus_MPa=115385.0)
    >>> wave = Irregularity(kind="sine", wavelength_mm=60.0, amplitude_mm=0.01)
    >>> judge_place(pair, 1e5, wave, 0.0).models["eq6"].holds()
    True
    """
    place = make_irregular_place(pair, normal_force_N, irregularity, s_mm)
    truth = _solve_reference(place, irregularity, s_mm)
    return JudgedPlace(
        s_mm=s_mm,
        truth=truth,
        models={name: _judge_model(model, place, truth) for name, model in MODELS.items()},
    )


def _solve_reference(
    place: IrregularPlace, irregularity: Irregularity, s_mm: float, nodes: int | None = None
) -> ReferenceContact:
    """Solve the half-space at a place of an irregularity.

    Parameters
    ----------
    place
        Smooth pair with its curvatures, load and Hertz's ellipse.
    irregularity
        Opening of the surface in mm.
    s_mm
        Distance of the contact from the middle of the irregularity along the rail.
    nodes
        Pressure nodes per semi-axis; None for the usual number.
    """
    pair = place.pair

    def gap(x: Floats, y: Floats) -> Floats:
        return pair.A_per_mm * x**2 + pair.B_per_mm * y**2 + irregularity.opening_mm(s_mm + x)

    half_space = solve_gap_contact(
        gap,
        place.normal_force_N,
        pair.contact_modulus_MPa,
        reach_mm=1.2 * place.hertz.approach_mm,
        far_mm=(
            2.0 * place.reach_mm,
            2.0 * math.sqrt((_REACH_FACTOR * place.hertz.approach_mm + irregularity.height_mm) / pair.B_per_mm),
        ),
        nodes=nodes or (_EDGE_NODE_FACTOR * NODES_PER_HALF_LENGTH if irregularity.kinks_mm else NODES_PER_HALF_LENGTH),
    )
    patch, x = measure_patch(half_space.pressure), half_space.pressure.grid.x_mm
    columns = np.flatnonzero(half_space.pressure.values.any(axis=1))
    step = half_space.pressure.grid.steps_mm[0]
    low, high = x[columns[0]] - step, x[columns[-1]] + step
    has_edge = any(low < kink < high for kink in place.kinks_mm)
    return ReferenceContact(
        approach_mm=half_space.approach_mm,
        patch=patch,
        p_max_MPa=None if has_edge else patch.p_max_MPa,
        residual=half_space.residual,
    )


def _judge_model(model: Model, place: IrregularPlace, truth: ReferenceContact) -> JudgedModel:
    """Compare a model with the half-space at a place.

    `force_error` is the relative error of the model's force at the approach of the half-space; `peak_error` is relative
    too. Both are NaN if the model or the half-space has no value.
    """
    estimate = model.under(place)
    force = np.nan if estimate.problem else model.force_N(place, truth.approach_mm)
    peak = np.nan if truth.p_max_MPa is None else estimate.p_max_MPa / truth.p_max_MPa - 1.0
    return JudgedModel(
        force_error=force / place.normal_force_N - 1.0,
        peak_error=float(peak),
        approach_mm=estimate.approach_mm,
        force_N=force,
        problem=estimate.problem,
    )


# --- Range in which models on a wave hold: cells over wavelength and amplitude, and largest amplitudes.

PHASES = (0.0, 0.125, 0.25, 0.375, 0.5)
"""Positions along half a wave at which a cell is judged, in wavelengths; the other half is the mirror image."""
ERRORS = ("force_error", "peak_error")


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """All models on a wave, and the half-space that judges them.

    Attributes
    ----------
    wavelength_mm, amplitude_mm
        Wavelength, and amplitude (half of peak to valley).
    models
        Largest errors over all places, by name; empty if the half-space has no solution, see `problem`.
    p_max_MPa
        Largest peak of the half-space over all places.
    patch_count
        Largest number of patches at a place.
    residual
        Largest residual of all solutions.
    problem
        Reason why there is no solution; empty if there is a solution.
    """

    wavelength_mm: float
    amplitude_mm: float
    models: Mapping[str, ModelErrors]
    p_max_MPa: float = np.nan
    patch_count: int = 0
    residual: float = np.nan
    problem: str = ""


def judge_cell(pair: SmoothBodies, normal_force_N: float, wavelength_mm: float, amplitude_mm: float) -> Cell:
    """Judge all models at five places of a wave.

    Parameters
    ----------
    pair
        The smooth bodies.
    normal_force_N
        Normal force.
    wavelength_mm, amplitude_mm
        Wavelength, and amplitude (half of peak to valley).

    Returns
    -------
    Cell
        Largest errors of all models; a cell without a solution has the reason in `problem`.
    """
    try:
        wave = Irregularity(kind="sine", wavelength_mm=wavelength_mm, amplitude_mm=amplitude_mm)
        places = [judge_place(pair, normal_force_N, wave, phase * wavelength_mm) for phase in PHASES]
    except (InputError, ConvergenceError) as error:
        return Cell(wavelength_mm=wavelength_mm, amplitude_mm=amplitude_mm, models={}, problem=str(error))
    return Cell(
        wavelength_mm=wavelength_mm,
        amplitude_mm=amplitude_mm,
        models={name: find_largest_errors(name, places) for name in MODELS},
        p_max_MPa=max(place.truth.patch.p_max_MPa for place in places),
        patch_count=max(place.truth.patch.patch_count for place in places),
        residual=max(place.truth.residual for place in places),
    )


def find_largest_errors(name: str, places: Sequence[JudgedPlace]) -> ModelErrors:
    """Find the largest errors of a model over several places.

    Parameters
    ----------
    name
        Name of the model.
    places
        Judged places.

    Returns
    -------
    ModelErrors
        Largest errors with their signs; NaN if an error is NaN.
    """
    forces, peaks = (np.array([getattr(place.models[name], error) for place in places]) for error in ERRORS)
    # a NaN counts as the largest
    return ModelErrors(
        force_error=float(forces[np.argmax(np.abs(forces))]), peak_error=float(peaks[np.argmax(np.abs(peaks))])
    )


def find_largest_amplitude_mm(
    cells: Sequence[Cell], model: str, errors: Sequence[str] = ERRORS, limit: float = LIMIT
) -> float | None:
    """Find the amplitude up to which a model holds on waves of a given length.

    Parameters
    ----------
    cells
        Cells of one wavelength, from small to large amplitudes.
    model
        Name of the model.
    errors
        Names of the errors that must be within the limit.
    limit
        Largest error.

    Returns
    -------
    float or None
        Amplitude in mm; None if the model holds on all cells, or not on the first cell.

    Notes
    -----
    Between two cells the logarithm of the larger error is linear over the logarithm of the amplitude.
    """
    largest_errors = [_find_larger_error(cell, model, errors) for cell in cells]
    first_failing = next((index for index, error in enumerate(largest_errors) if error > limit), 0)
    return (
        None
        if first_failing == 0
        else _interpolate_amplitude([cell.amplitude_mm for cell in cells], largest_errors, first_failing, limit)
    )


def _find_larger_error(cell: Cell, model: str, errors: Sequence[str]) -> float:
    """Find the larger error of a model; infinite if the model or the half-space has no result."""
    if not cell.models:
        return np.inf
    values = [abs(getattr(cell.models[model], error)) for error in errors]
    return np.inf if np.isnan(values).any() else float(max(values))


def _interpolate_amplitude(amplitudes: Sequence[float], worst: Sequence[float], index: int, limit: float) -> float:
    """Interpolate the amplitude between two cells at which the error passes the limit.

    If an error is not finite or not positive, then the result is the amplitude of the cell that holds.

    Parameters
    ----------
    amplitudes
        Ascending amplitudes of the cells in mm.
    worst
        Larger of both errors in each cell (-).
    index
        Index of the first cell beyond the limit, at least 1.
    limit
        Limit of the error (-).
    """
    (low, high), (error_below, error_above) = amplitudes[index - 1 : index + 1], worst[index - 1 : index + 1]
    if not np.isfinite([error_below, error_above]).all() or min(error_below, error_above) <= 0.0:
        return low if error_below <= limit else high
    fraction = np.log(limit / error_below) / np.log(error_above / error_below)
    return float(low * (high / low) ** fraction)


# --- Smooth pair of a case, on which models of an irregularity are judged: Hertz's bodies at the first contact point.

# Amplitude (mm) of a wave with practically no height, to compare the half-space with Hertz's closed form.
_FLAT_AMPLITUDE_MM = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothPair:
    """Hertz's bodies at the first contact point of a case.

    Attributes
    ----------
    case, placement
        The case, and its wheel on its rail.
    pair, hertz
        Gap of the bodies, and Hertz under the force along the normal.
    approach_error, peak_error
        Errors of the half-space on its nodes against Hertz on these bodies without an irregularity.
    on_profiles
        Errors of Hertz without an irregularity against the half-space on the whole profiles, or the reason why there
        are no errors.
    notes
        Effects that are not included.
    """

    case: Case
    placement: Placement
    pair: SmoothBodies
    hertz: HertzContact
    approach_error: float
    peak_error: float
    on_profiles: ModelErrors | str
    notes: tuple[str, ...] = ()


def make_smooth_pair(case: Case) -> SmoothPair:
    """Make the smooth pair of a case from the curvatures at the first contact point.

    Other properties of the profiles are not used for the pair.

    Parameters
    ----------
    case
        Case without yaw and without irregularities.

    Returns
    -------
    SmoothPair
        Hertz's bodies.

    Raises
    ------
    InputError
        As in `place_case`; also for a yaw, for an irregular case, and if the surfaces conform, so that Hertz has no
        ellipse.
    """
    if case.yaw_rad != 0.0:
        raise InputError(
            f"yaw is {1e3 * case.yaw_rad:g} mrad; allowed: 0, because the models are along the track; omit the yaw"
        )
    if case.irregularities:
        raise InputError("the case has an irregular rail or wheel; omit it there, and give it as the irregularity")
    placement = place_case(case)
    touch, force = placement.first, compute_normal_force(case, placement)
    curvature = touch.curvature
    pair = SmoothBodies(
        A_per_mm=0.5 * curvature.xx_per_mm,
        B_per_mm=0.5 * curvature.yy_per_mm,
        contact_modulus_MPa=case.contact_modulus_MPa,
    )
    hertz = pair.hertz(force)
    reference = solve_reference(
        pair, force, Irregularity(kind="sine", wavelength_mm=8.0 * hertz.a_mm, amplitude_mm=_FLAT_AMPLITUDE_MM), 0.0
    )
    assert reference.p_max_MPa is not None
    return SmoothPair(
        case=case,
        placement=placement,
        pair=pair,
        hertz=hertz,
        approach_error=reference.approach_mm / hertz.approach_mm - 1.0,
        peak_error=reference.p_max_MPa / hertz.p0_MPa - 1.0,
        on_profiles=_judge_hertz_on_profiles(case, hertz),
        notes=("the contact point is at a curvature junction; the models use the curvature of its field side",)
        if touch.at_junction
        else (),
    )


def _judge_hertz_on_profiles(case: Case, hertz: HertzContact) -> ModelErrors | str:
    """Errors of Hertz against the half-space on the whole profiles of a smooth case.

    If there is no solution, then the result is the reason.
    """
    try:
        half_space = evaluate_theory(case, HALF_SPACE)
    except (InputError, ConvergenceError) as error:
        return str(error)
    contact = half_space.contact
    if contact is None or not contact.definite:
        return half_space.problem or half_space.status
    force_N = float(hertz_spring_force_N(hertz.stiffness_N_per_mm15, contact.approach_mm))
    return ModelErrors(
        force_error=force_N / contact.normal_force_N - 1.0,
        peak_error=hertz.p0_MPa / max(patch.p_max_MPa for patch in contact.patches) - 1.0,
    )
