"""Models of irregularities over wavelength and amplitude, or along an irregularity, in several processes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError
from fecontact.features.irregular.model_errors import (
    LIMIT,
    JudgedPlace,
    SmoothPair,
    judge_cell,
    judge_place,
    place_on,
    smooth_pair,
)
from fecontact.features.irregular.models import Pair
from fecontact.features.irregular.telling import along_record, map_record
from fecontact.jobs.remaining import watched
from fecontact.jobs.workers import evaluators
from fecontact.outputs.flat_records import Record
from fecontact.placement.irregularity import Irregularity, parse_irregularity

Progress = Callable[[int, int, str], None]
_MOST_PLACES = 2000
# Places for each half length of the patch along a table, if no positions are given.
_A_HALF_LENGTH = 2.0


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
    """Hertz's spring over an irregular wheel or rail (eq. 6) and four models like it, judged by the half-space.

    >>> import fecontact
    >>> found = fecontact.irregular(fecontact.Case(lateral_shift_mm=3.0), wavelengths_mm=[30.0], amplitudes_mm=[0.025])
    >>> found["cells"][0]["models"]["eq6"]["holds"]
    False

    Parameters
    ----------
    case
        Profiles, position, load and materials; only the curvatures at first touch are taken from the profiles.
    wavelengths_mm, amplitudes_mm
        Wavelengths and amplitudes of a map, with `cells` and `limits`. An amplitude is half of peak to valley.
    irregularity, positions_mm
        Instead of a map, an irregularity or its text: answers of the models along it, with `places` and `worst`.
        Without positions there are two places for each half length of the patch.
    limit
        Error of force and peak up to which a model holds.
    workers
        Number of processes; results are equal to the last bit for any number.

    Raises
    ------
    InputError
        For inputs out of range, with the allowed range; as in `smooth_pair` and `place_on`.
    WorkersLost
        If a process ends early.
    """
    if (irregularity is None) == (not len(wavelengths_mm) and not len(amplitudes_mm)):
        raise InputError("irregular: give either wavelengths and amplitudes for a map, or an irregularity")
    if not 0.0 < limit < 1.0:
        raise InputError(f"limit is {limit!r}; allowed: between 0 and 1, such as 0.05")
    smooth = smooth_pair(case)
    by = partial(_all, workers=workers, progress=progress)
    if irregularity is None:
        waves = _waves(smooth, wavelengths_mm, amplitudes_mm)
        return map_record(smooth, by(partial(_cell, smooth.pair, smooth.hertz.normal_force_N), waves), limit=limit)
    given = parse_irregularity(irregularity) if isinstance(irregularity, str) else irregularity
    line = given.on_wheel(0.5 / smooth.pair.A_per_mm)
    places = _positions(smooth, line, positions_mm)
    found = by(partial(_place, smooth.pair, smooth.hertz.normal_force_N, line), places)
    return along_record(smooth, line, dict(zip(places, found, strict=True)), limit=limit)


def _waves(smooth: SmoothPair, wavelengths: Sequence[float], amplitudes: Sequence[float]) -> list[tuple[float, float]]:
    """All pairs of wavelength and amplitude in increasing order, after a check that the shortest wave is possible."""
    if not len(wavelengths) or not len(amplitudes):
        raise InputError("irregular: a map needs both wavelengths and amplitudes; give at least one of each")
    ordered = [sorted({float(one) for one in values}) for values in (wavelengths, amplitudes)]
    # impossible waves are refused before anything is computed
    shortest = Irregularity(kind="sine", wavelength_mm=ordered[0][0], amplitude_mm=ordered[1][0])
    place_on(smooth.pair, smooth.hertz.normal_force_N, shortest, 0.0)
    return [(wavelength, amplitude) for wavelength in ordered[0] for amplitude in ordered[1]]


def _positions(smooth: SmoothPair, line: Irregularity, positions_mm: Sequence[float]) -> list[float]:
    """Positions as given, or over the whole of a table or a wave, or to both sides of a flat."""
    if len(positions_mm):
        places = sorted({float(one) for one in positions_mm})
    else:
        a = smooth.hertz.a_mm
        if line.kind == "table":
            low, high = line.points_mm[0][0] + a, line.points_mm[-1][0] - a
        elif line.kind == "sine":
            low, high = 0.0, 0.5 * (line.wavelength_mm or 0.0)
        else:
            low, high = 0.0, 0.5 * (line.length_mm or 0.0) + 2.0 * a
        count = max(9, int(np.ceil((high - low) / a * _A_HALF_LENGTH)) + 1)
        places = [round(float(one), 3) for one in np.linspace(low, high, count)]
    if len(places) > _MOST_PLACES:
        raise InputError(
            f"irregular: {len(places)} positions; allowed: up to {_MOST_PLACES}; give a part of the line, or steps"
        )
    return places


def _cell(pair: Pair, force_N: float, wave: tuple[float, float]) -> Any:
    return judge_cell(pair, force_N, *wave)


def _place(pair: Pair, force_N: float, line: Irregularity, s_mm: float) -> JudgedPlace | str:
    """A judged place, or why it did not converge; input errors are raised."""
    try:
        return judge_place(pair, force_N, line, s_mm)
    except ConvergenceError as error:
        return str(error)


def _all(work: Callable[[Any], Any], items: Sequence[Any], *, workers: int, progress: Progress | None) -> list[Any]:
    """Results of `work` for all items, in their order, from several processes."""
    with evaluators(len(items), here=1 in (workers, len(items)), workers=workers) as map_over:
        return list(watched(map_over(work, items), len(items), progress, "models beside the half-space"))
