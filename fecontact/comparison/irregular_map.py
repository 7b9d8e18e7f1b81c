"""Where models of the contact on a wave hold: cells over wavelength and amplitude, and the largest amplitudes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.comparison.irregular import LIMIT, MODELS, JudgedPlace, ModelErrors, judge_place
from fecontact.errors import ConvergenceError, InputError
from fecontact.irregularity.shapes import Irregularity
from fecontact.theory.irregular import Pair

PHASES = (0.0, 0.125, 0.25, 0.375, 0.5)
"""Places along a wave at which a cell is judged, in wavelengths; those beyond are mirror images."""
ERRORS = ("force_error", "peak_error")


@dataclass(frozen=True, kw_only=True, eq=False)
class Cell:
    """All models on a wave, and what they are judged by.

    Attributes
    ----------
    models
        Errors by name, the largest over all places; empty where the half-space has no solution, see `problem`.
    p_max_MPa
        Largest peak of the half-space over all places.
    pieces
        Most pieces into which the patch splits at one of them.
    residual
        The largest of all solutions.
    """

    wavelength_mm: float
    amplitude_mm: float
    models: Mapping[str, ModelErrors]
    p_max_MPa: float = np.nan
    pieces: int = 0
    residual: float = np.nan
    problem: str = ""


def judge_cell(pair: Pair, normal_force_N: float, wavelength_mm: float, amplitude_mm: float) -> Cell:
    """Judge all models on a wave, at five places of it; a cell without a solution says why."""
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
    """The largest errors of a model over some places."""
    forces, peaks = (np.array([getattr(place.models[name], error) for place in places]) for error in ERRORS)
    # a NaN counts as the largest
    return ModelErrors(
        force_error=float(forces[np.argmax(np.abs(forces))]), peak_error=float(peaks[np.argmax(np.abs(peaks))])
    )


def largest_amplitude_mm(
    cells: Sequence[Cell], model: str, errors: Sequence[str] = ERRORS, limit: float = LIMIT
) -> float | None:
    """Amplitude up to which a model holds on waves of one length; None if it does on all of its cells, or on none.

    Parameters
    ----------
    cells
        Of one wavelength, from small to large amplitudes.
    errors
        Which of both have to be within the limit.

    Notes
    -----
    The logarithm of the larger error is taken to be straight over that of the amplitude between two cells.
    """
    worst = [_worst(cell, model, errors) for cell in cells]
    first = next((number for number, one in enumerate(worst) if one > limit), 0)
    return None if first == 0 else _between([cell.amplitude_mm for cell in cells], worst, first, limit)


def _worst(cell: Cell, model: str, errors: Sequence[str]) -> float:
    """The larger error of a model; infinite where it, or the half-space, says nothing."""
    if not cell.models:
        return np.inf
    found = [abs(getattr(cell.models[model], error)) for error in errors]
    return np.inf if np.isnan(found).any() else float(max(found))


def _between(places: Sequence[float], worst: Sequence[float], number: int, limit: float) -> float:
    """Where the error passes the limit between a cell and the one before it; the one that holds if one is unknown."""
    (low, high), (below, above) = places[number - 1 : number + 1], worst[number - 1 : number + 1]
    if not np.isfinite([below, above]).all() or min(below, above) <= 0.0:
        return low if below <= limit else high
    share = np.log(limit / below) / np.log(above / below)
    return float(low * (high / low) ** share)
