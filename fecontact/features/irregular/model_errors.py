"""One-point models of a wheel on an irregularity, judged by the half-space with the irregularity in its gap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.case import Case
from fecontact.contact.halfspace import NODES, contact_on_gap
from fecontact.contact.patch import Patch, measure_patch
from fecontact.contact_theories.hertz import HertzContact, hertz_spring_force_N
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.irregular.models import MODELS, Model, Pair, Place
from fecontact.placement.irregularity import Irregularity
from fecontact.placement.wheel_on_rail import Placement
from fecontact.solving.alone import HALF_SPACE, normal_force_of, theory_alone
from fecontact.solving.placing import place_case

# Fewest nodes on a wave, if a patch has NODES on its half length.
_FEWEST_A_WAVE = 4
# Factor on the number of nodes for an edge: the approach is then within 0.02 %, without the factor within 0.15 %.
_EDGED = 2
# Places may touch if their gap is below the irregularity's height plus this many times Hertz's approach.
_BEYOND = 1.6
LIMIT = 0.05
"""Largest error of force and peak with which a model holds, unless another limit is given."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Truth:
    """Contact on the half-space with the irregularity in the gap.

    Attributes
    ----------
    approach_mm
        Approach from the position in which wheel and rail would touch without the irregularity.
    patch
        Measures of the patch.
    p_max_MPa
        Peak pressure; None if an edge lies in the patch, where the pressure is unbounded.
    residual
        Contact residual plus penetration residual, relative to the approach.
    """

    approach_mm: float
    patch: Patch
    p_max_MPa: float | None
    residual: float


@dataclass(frozen=True, kw_only=True)
class ModelErrors:
    """Errors of a model at one place, or the largest errors over several places with their signs.

    Attributes
    ----------
    force_error
        Error of the force over the load, at the approach at which the half-space carries the load; NaN without a force.
    peak_error
        Relative error of the peak pressure under the load; NaN if the model or the half-space has no peak.
    """

    force_error: float
    peak_error: float

    def holds(self, limit: float = LIMIT) -> bool:
        """Whether both errors are within a limit; NaN is not."""
        return abs(self.force_error) <= limit and abs(self.peak_error) <= limit


@dataclass(frozen=True, kw_only=True)
class JudgedModel(ModelErrors):
    """A model at one place.

    Attributes
    ----------
    approach_mm
        Approach under the load.
    force_N
        Force at the approach at which the half-space carries the load.
    problem
        Why the model has no answer.
    """

    approach_mm: float
    force_N: float
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedPlace:
    """All models at one place of an irregularity, and the half-space by which they are judged."""

    s_mm: float
    truth: Truth
    models: Mapping[str, JudgedModel]


def place_on(pair: Pair, normal_force_N: float, irregularity: Irregularity, s_mm: float) -> Place:
    """A pair at a distance along an irregularity.

    Raises
    ------
    InputError
        If a table does not reach over the contact, or waves are too short for the nodes.
    """
    hertz = pair.hertz(normal_force_N)
    step = hertz.a_mm / NODES
    if irregularity.finest_mm < _FEWEST_A_WAVE * step:
        raise InputError(
            f"irregularity {irregularity.kind}: its shortest wave is {irregularity.finest_mm:g} mm, and the patch of"
            f" {2.0 * hertz.a_mm:.1f} mm has nodes {step:.2g} mm apart; allowed: {_FEWEST_A_WAVE * step:.2g} mm and"
            " more; shorter ones are roughness, which the patch flattens: leave them out"
        )
    reach = math.sqrt((_BEYOND * hertz.approach_mm + irregularity.height_mm) / pair.A_per_mm)
    if irregularity.kind == "table":
        first, last = irregularity.points_mm[0][0], irregularity.points_mm[-1][0]
        if not first + hertz.a_mm <= s_mm <= last - hertz.a_mm:
            raise InputError(
                f"irregularity table: the contact at {s_mm:g} mm reaches past its ends, {first:g} and {last:g} mm;"
                f" allowed: {first + hertz.a_mm:.6g} to {last - hertz.a_mm:.6g} mm"
            )
    return Place(
        pair=pair,
        opening=lambda x: irregularity.opening_mm(s_mm + x),
        reach_mm=reach,
        normal_force_N=normal_force_N,
        kinks_mm=tuple(kink - s_mm for kink in irregularity.kinks_mm),
    )


def truth_on(
    pair: Pair, normal_force_N: float, irregularity: Irregularity, s_mm: float, *, nodes: int | None = None
) -> Truth:
    """The half-space at a distance along an irregularity, on 16 nodes per semi-axis, or 32 if it has edges.

    Raises
    ------
    InputError, ConvergenceError
        As in `place_on` and `contact_on_gap`.
    """
    return _truth(place_on(pair, normal_force_N, irregularity, s_mm), irregularity, s_mm, nodes)


def judge_place(pair: Pair, normal_force_N: float, irregularity: Irregularity, s_mm: float) -> JudgedPlace:
    """All models at a distance along an irregularity, compared with the half-space.

    Raises
    ------
    InputError, ConvergenceError
        As in `truth_on`.
    """
    place = place_on(pair, normal_force_N, irregularity, s_mm)
    truth = _truth(place, irregularity, s_mm)
    return JudgedPlace(
        s_mm=s_mm,
        truth=truth,
        models={name: _judged(model, place, truth) for name, model in MODELS.items()},
    )


def _truth(place: Place, irregularity: Irregularity, s_mm: float, nodes: int | None = None) -> Truth:
    pair = place.pair

    def gap(x: Floats, y: Floats) -> Floats:
        return pair.A_per_mm * x**2 + pair.B_per_mm * y**2 + irregularity.opening_mm(s_mm + x)

    solved = contact_on_gap(
        gap,
        place.normal_force_N,
        pair.contact_modulus_MPa,
        reach_mm=1.2 * place.hertz.approach_mm,
        far_mm=(
            2.0 * place.reach_mm,
            2.0 * math.sqrt((_BEYOND * place.hertz.approach_mm + irregularity.height_mm) / pair.B_per_mm),
        ),
        nodes=nodes or (_EDGED * NODES if irregularity.kinks_mm else NODES),
    )
    patch, x = measure_patch(solved.pressure), solved.pressure.grid.x_mm
    columns = np.flatnonzero(solved.pressure.values.any(axis=1))
    step = solved.pressure.grid.steps_mm[0]
    low, high = x[columns[0]] - step, x[columns[-1]] + step
    edge = any(low < kink < high for kink in place.kinks_mm)
    return Truth(
        approach_mm=solved.approach_mm,
        patch=patch,
        p_max_MPa=None if edge else patch.p_max_MPa,
        residual=solved.residual,
    )


def _judged(model: Model, place: Place, truth: Truth) -> JudgedModel:
    said = model.under(place)
    force = np.nan if said.problem else model.force_N(place, truth.approach_mm)
    peak = np.nan if truth.p_max_MPa is None else said.p_max_MPa / truth.p_max_MPa - 1.0
    return JudgedModel(
        force_error=force / place.normal_force_N - 1.0,
        peak_error=float(peak),
        approach_mm=said.approach_mm,
        force_N=force,
        problem=said.problem,
    )


# --- Range in which models of the contact on a wave hold: cells over wavelength and amplitude, and largest amplitudes.

PHASES = (0.0, 0.125, 0.25, 0.375, 0.5)
"""Places along half a wave at which a cell is judged, in wavelengths; the other half is the mirror image."""
ERRORS = ("force_error", "peak_error")


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """All models on a wave, and the half-space by which they are judged.

    Attributes
    ----------
    models
        Largest errors over all places, by name; empty if the half-space has no solution, see `problem`.
    p_max_MPa
        Largest peak of the half-space over all places.
    pieces
        Largest number of pieces into which the patch splits at a place.
    residual
        Largest residual of all solutions.
    """

    wavelength_mm: float
    amplitude_mm: float
    models: Mapping[str, ModelErrors]
    p_max_MPa: float = np.nan
    pieces: int = 0
    residual: float = np.nan
    problem: str = ""


def judge_cell(pair: Pair, normal_force_N: float, wavelength_mm: float, amplitude_mm: float) -> Cell:
    """Judge all models at five places of a wave; a cell without a solution gives the reason."""
    try:
        wave = Irregularity(kind="sine", wavelength_mm=wavelength_mm, amplitude_mm=amplitude_mm)
        places = [judge_place(pair, normal_force_N, wave, phase * wavelength_mm) for phase in PHASES]
    except (InputError, ConvergenceError) as error:
        return Cell(wavelength_mm=wavelength_mm, amplitude_mm=amplitude_mm, models={}, problem=str(error))
    return Cell(
        wavelength_mm=wavelength_mm,
        amplitude_mm=amplitude_mm,
        models={name: worst_of_places(name, places) for name in MODELS},
        p_max_MPa=max(place.truth.patch.p_max_MPa for place in places),
        pieces=max(place.truth.patch.pieces for place in places),
        residual=max(place.truth.residual for place in places),
    )


def worst_of_places(name: str, places: Sequence[JudgedPlace]) -> ModelErrors:
    """Largest errors of a model over some places."""
    forces, peaks = (np.array([getattr(place.models[name], error) for place in places]) for error in ERRORS)
    # a NaN counts as the largest
    return ModelErrors(
        force_error=float(forces[np.argmax(np.abs(forces))]), peak_error=float(peaks[np.argmax(np.abs(peaks))])
    )


def largest_amplitude_mm(
    cells: Sequence[Cell], model: str, errors: Sequence[str] = ERRORS, limit: float = LIMIT
) -> float | None:
    """Amplitude up to which a model holds on waves of one length; None if the model holds on all cells, or on no cell.

    Parameters
    ----------
    cells
        Cells of one wavelength, from small to large amplitudes.
    errors
        Names of the errors that must be within the limit.

    Notes
    -----
    Between two cells the logarithm of the larger error is linear over the logarithm of the amplitude.
    """
    worst = [_worst(cell, model, errors) for cell in cells]
    first = next((number for number, one in enumerate(worst) if one > limit), 0)
    return None if first == 0 else _between([cell.amplitude_mm for cell in cells], worst, first, limit)


def _worst(cell: Cell, model: str, errors: Sequence[str]) -> float:
    """The larger error of a model; infinite if the model or the half-space has no answer."""
    if not cell.models:
        return np.inf
    found = [abs(getattr(cell.models[model], error)) for error in errors]
    return np.inf if np.isnan(found).any() else float(max(found))


def _between(places: Sequence[float], worst: Sequence[float], number: int, limit: float) -> float:
    """Amplitude between two cells at which the error passes the limit; the holding cell's if an error is unknown."""
    (low, high), (below, above) = places[number - 1 : number + 1], worst[number - 1 : number + 1]
    if not np.isfinite([below, above]).all() or min(below, above) <= 0.0:
        return low if below <= limit else high
    share = np.log(limit / below) / np.log(above / below)
    return float(low * (high / low) ** share)


# --- The smooth pair of a case, on which models of an irregularity are judged: Hertz's bodies at the first touch point.

# Amplitude of a wave of practically no height, for comparing the half-space with Hertz's closed form.
_NONE = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothPair:
    """Hertz's bodies at the first touch point of a case.

    Attributes
    ----------
    pair, hertz
        Gap of the bodies, and Hertz under the force along the normal.
    approach_error, peak_error
        Errors of the half-space on its nodes against Hertz on these bodies without an irregularity.
    on_profiles
        Errors of Hertz without an irregularity against the half-space on the whole profiles, or why they are not known.
    notes
        What is left out.
    """

    case: Case
    placement: Placement
    pair: Pair
    hertz: HertzContact
    approach_error: float
    peak_error: float
    on_profiles: ModelErrors | str
    notes: tuple[str, ...] = ()


def smooth_pair(case: Case) -> SmoothPair:
    """The smooth pair of a case; only the curvatures at first touch are taken from its profiles.

    Raises
    ------
    InputError
        As in `place_case`; also for a yaw, for an irregular case, and if the surfaces conform, so that there is no
        Hertz.
    """
    if case.yaw_rad != 0.0:
        raise InputError(
            f"yaw is {1e3 * case.yaw_rad:g} mrad; allowed: 0, for the models lie along the track; leave the yaw out"
        )
    if case.irregularities:
        raise InputError("rail or wheel of the case is irregular; leave that out, and give it as the irregularity")
    placement = place_case(case)
    touch, force = placement.first, normal_force_of(case, placement)
    curvature = touch.curvature
    pair = Pair(
        A_per_mm=0.5 * curvature.xx_per_mm,
        B_per_mm=0.5 * curvature.yy_per_mm,
        contact_modulus_MPa=case.contact_modulus_MPa,
    )
    hertz = pair.hertz(force)
    flat = truth_on(pair, force, Irregularity(kind="sine", wavelength_mm=8.0 * hertz.a_mm, amplitude_mm=_NONE), 0.0)
    assert flat.p_max_MPa is not None
    return SmoothPair(
        case=case,
        placement=placement,
        pair=pair,
        hertz=hertz,
        approach_error=flat.approach_mm / hertz.approach_mm - 1.0,
        peak_error=flat.p_max_MPa / hertz.p0_MPa - 1.0,
        on_profiles=_on_profiles(case, hertz),
        notes=("the touch point lies at a curvature junction: field side",) if touch.at_junction else (),
    )


def _on_profiles(case: Case, hertz: HertzContact) -> ModelErrors | str:
    """Errors of Hertz against the half-space on the whole profiles of a smooth case, or why they are not known."""
    try:
        found = theory_alone(case, HALF_SPACE)
    except (InputError, ConvergenceError) as error:
        return str(error)
    contact = found.contact
    if contact is None or not contact.definite:
        return found.problem or found.status
    force_N = float(hertz_spring_force_N(hertz.stiffness_N_per_mm15, contact.approach_mm))
    return ModelErrors(
        force_error=force_N / contact.normal_force_N - 1.0,
        peak_error=hertz.p0_MPa / max(one.p_max_MPa for one in contact.patches) - 1.0,
    )
