"""Models of irregularities over wavelength and amplitude, or along an irregularity.

The half-space is solved in several processes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.irregular.limit import LIMIT
from fecontact.features.irregular.model_errors import (
    JudgedPlace,
    SmoothPair,
    judge_cell,
    judge_place,
    make_irregular_place,
    make_smooth_pair,
)
from fecontact.features.irregular.models import SmoothBodies
from fecontact.features.irregular.telling import make_irregular_map_record, make_irregularity_record
from fecontact.jobs.remaining import report_progress
from fecontact.jobs.workers import open_evaluators
from fecontact.outputs.flat_records import Record
from fecontact.placement.irregularity import Irregularity, parse_irregularity

Progress = Callable[[int, int, str], None]
_MAX_PLACES = 2000
# Number of places per half length of the patch along a table, if no positions are given.
_PLACES_PER_HALF_LENGTH = 2.0


def irregular(
    case: Case,
    *,
    wavelengths_mm: Sequence[float] = (),
    amplitudes_mm: Sequence[float] = (),
    irregularity: Irregularity | str | None = None,
    positions_mm: Sequence[float] = (),
    limit: float = LIMIT,
    workers: int = 1,
    progress: Progress | None = None,
) -> Record:
    """Judge Hertz's spring over an irregular wheel or rail by the half-space.

    The models are Otero Yugat's spring (Part I, eq. 6) and four similar models.

    >>> import fecontact
    >>> case = fecontact.Case(lateral_shift_mm=3.0)
    >>> record = fecontact.irregular(case, wavelengths_mm=[30.0], amplitudes_mm=[0.025])
    >>> record["cells"][0]["models"]["eq6"]["holds"]
    False

    Parameters
    ----------
    case
        Profiles, position, load and materials; only the curvatures at first touch are taken from the profiles.
    wavelengths_mm, amplitudes_mm
        Wavelengths and amplitudes of a map, with `cells` and `limits`. An amplitude is half of peak to valley.
    irregularity, positions_mm
        Instead of a map, an irregularity or its text, for results of the models along it, with `places` and `worst`.
        Without positions there are two places per half length of the patch.
    limit
        Error of force and peak up to which a model holds.
    workers
        Number of processes; results are equal to the last bit for any number.
    progress
        Receives the number of finished cells or places, their total, and a text.

    Returns
    -------
    Record
        Plain values for JSON: the pair, the models with their ranges of validity, and `cells` and `limits` of a map, or
        `places` and `worst` along an irregularity.

    Raises
    ------
    InputError
        For inputs out of range, with the allowed range; as in `make_smooth_pair` and `make_irregular_place`.
    WorkersLost
        If a process ends early.
    """
    if (irregularity is None) == (not len(wavelengths_mm) and not len(amplitudes_mm)):
        raise InputError("irregular: give either wavelengths and amplitudes for a map, or an irregularity")
    if not 0.0 < limit < 1.0:
        raise InputError(f"limit is {limit!r}; allowed: between 0 and 1, such as 0.05")
    smooth = make_smooth_pair(case)
    run_all = partial(_run_all, workers=workers, progress=progress)
    if irregularity is None:
        waves = _pair_waves(smooth, wavelengths_mm, amplitudes_mm)
        return make_irregular_map_record(
            smooth, run_all(partial(_judge_cell, smooth.pair, smooth.hertz.normal_force_N), waves), limit=limit
        )
    parsed = parse_irregularity(irregularity) if isinstance(irregularity, str) else irregularity
    complete_irregularity = parsed.on_wheel(0.5 / smooth.pair.A_per_mm)
    places = _choose_positions(smooth, complete_irregularity, positions_mm)
    judged_places = run_all(
        partial(_judge_place, smooth.pair, smooth.hertz.normal_force_N, complete_irregularity), places
    )
    return make_irregularity_record(
        smooth, complete_irregularity, dict(zip(places, judged_places, strict=True)), limit=limit
    )


def _pair_waves(
    smooth: SmoothPair, wavelengths: Sequence[float], amplitudes: Sequence[float]
) -> list[tuple[float, float]]:
    """Pair wavelengths and amplitudes in increasing order.

    Raises
    ------
    InputError
        If wavelengths or amplitudes are missing, or if the shortest wave is not possible.
    """
    if not len(wavelengths) or not len(amplitudes):
        raise InputError("irregular: a map needs both wavelengths and amplitudes; give at least one of each")
    ordered = [sorted({float(value) for value in values}) for values in (wavelengths, amplitudes)]
    # impossible waves are refused before anything is computed
    shortest = Irregularity(kind="sine", wavelength_mm=ordered[0][0], amplitude_mm=ordered[1][0])
    make_irregular_place(smooth.pair, smooth.hertz.normal_force_N, shortest, 0.0)
    return [(wavelength, amplitude) for wavelength in ordered[0] for amplitude in ordered[1]]


def _choose_positions(smooth: SmoothPair, irregularity: Irregularity, positions_mm: Sequence[float]) -> list[float]:
    """Choose the positions (mm) along an irregularity.

    They are the given positions. If there are none, then they cover the whole of a table, half of a wave, or a flat and
    its surroundings.

    Raises
    ------
    InputError
        If there are more than 2000 positions.
    """
    if len(positions_mm):
        places = sorted({float(position) for position in positions_mm})
    else:
        half_length = smooth.hertz.a_mm
        if irregularity.kind == "table":
            low, high = irregularity.points_mm[0][0] + half_length, irregularity.points_mm[-1][0] - half_length
        elif irregularity.kind == "sine":
            low, high = 0.0, 0.5 * (irregularity.wavelength_mm or 0.0)
        else:
            low, high = 0.0, 0.5 * (irregularity.length_mm or 0.0) + 2.0 * half_length
        count = max(9, int(np.ceil((high - low) / half_length * _PLACES_PER_HALF_LENGTH)) + 1)
        places = [round(float(position), 3) for position in np.linspace(low, high, count)]
    if len(places) > _MAX_PLACES:
        raise InputError(
            f"irregular: {len(places)} positions; allowed: at most {_MAX_PLACES}; give a shorter range or larger steps"
        )
    return places


def _judge_cell(pair: SmoothBodies, force_N: float, wave: tuple[float, float]) -> Any:
    """Judge all models on a wave, given as wavelength and amplitude (mm)."""
    return judge_cell(pair, force_N, *wave)


def _judge_place(pair: SmoothBodies, force_N: float, irregularity: Irregularity, s_mm: float) -> JudgedPlace | str:
    """Judge a place, or give the reason why it did not converge.

    Input errors are raised.
    """
    try:
        return judge_place(pair, force_N, irregularity, s_mm)
    except ConvergenceError as error:
        return str(error)


def _run_all(work: Callable[[Any], Any], tasks: Sequence[Any], *, workers: int, progress: Progress | None) -> list[Any]:
    """Results of `work` for all tasks, in their order, from `workers` processes."""
    with open_evaluators(len(tasks), here=1 in (workers, len(tasks)), workers=workers) as map_over:
        return list(report_progress(map_over(work, tasks), len(tasks), progress, "models against the half-space"))
