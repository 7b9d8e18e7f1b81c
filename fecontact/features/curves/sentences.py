"""Sentences about the results of a vehicle in curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from fecontact.features.curves.stability import StraightTrack
from fecontact.features.curves.visits import NO_CELL, NO_EQUILIBRIUM, CurveResults, TheoryDifference
from fecontact.outputs.style import (
    ANSWER_WORDS,
    BETWEEN_VERDICTS,
)

# Results of a map at the positions of the wheels, in the order of the report.
ZONE_ORDER = ("HOLDS", "UNRESOLVED", "FAILS", BETWEEN_VERDICTS, NO_CELL, NO_EQUILIBRIUM)


def describe_difference(difference: TheoryDifference) -> str:
    """Describe the differences between a theory and the reference in a sentence.

    Parameters
    ----------
    difference
        Differences over all curves.

    Returns
    -------
    str
        The sentence.
    """
    phrases = []
    if difference.without_m:
        phrases.append(f"no equilibrium at R {', '.join(f'{radius:g}' for radius in difference.without_m)} m")
    if math.isfinite(difference.shift_mm):
        phrases.append(f"shift differs by up to {difference.shift_mm:.2f} mm (R {difference.shift_at_m:g} m)")
        phrases.append(f"Y/Q by up to {difference.y_over_q:.3f} (R {difference.y_over_q_at_m:g} m)")
    if difference.critical_speed is not None:
        phrases.append(f"the critical speed by {1e2 * difference.critical_speed:+.0f} %")
    elif difference.without_speed:
        phrases.append(f"critical speeds are not compared ({difference.without_speed})")
    return f"{difference.theory} against {difference.reference}: {', '.join(phrases) or 'no results to compare'}"


def describe_straight_track(track: StraightTrack) -> str:
    """Describe the stability on straight track in a sentence.

    Parameters
    ----------
    track
        Stability by a theory.

    Returns
    -------
    str
        The sentence.
    """
    if track.wavelength_m is None or track.slow_wavelength_m is None or track.frequency_Hz is None:
        return f"straight track, {track.theory}: {track.problem}"
    slow = f"wavelength {track.slow_wavelength_m:.1f} m at {track.slow_km_h:g} km/h"
    if track.problem or track.critical_speed_km_h is None:
        return f"straight track, {track.theory}: {track.problem}; {slow}"
    return (
        f"straight track, {track.theory}: critical speed {track.critical_speed_km_h:.0f} km/h, hunting at"
        f" {track.frequency_Hz:.1f} Hz with wavelength {track.wavelength_m:.1f} m; {slow}"
    )


def describe_paths(results: CurveResults) -> list[str]:
    """Describe the ends of paths from straight track, and the curves beyond them.

    Parameters
    ----------
    results
        Results of a vehicle in curves.

    Returns
    -------
    list of str
        A sentence for each theory and side with an end.
    """
    sentences = []
    for theory, side in itertools.product(results.runs, (1.0, -1.0)):
        runs_beyond = [run for run in results.runs[theory] if run.path_ends_m and run.radius_m * side > 0.0]
        if not runs_beyond:
            continue
        first_end, *later_ends = max((run.path_ends_m for run in runs_beyond), key=len)
        end = f"at R {first_end:.0f} m" if math.isfinite(first_end) else "at its start"
        further = f", the next at R {_format_radii(later_ends)} m" if later_ends else ""
        radii_without, radii_with = (
            [run.radius_m for run in runs_beyond if run.is_balanced is is_balanced] for is_balanced in (False, True)
        )
        outcomes = [f"no equilibrium found at R {_format_radii(radii_without)} m"] if radii_without else []
        outcomes += [f"another equilibrium at R {_format_radii(radii_with)} m"] if radii_with else []
        sentences.append(f"{theory}: the path from straight track ends {end}{further}; beyond: {', '.join(outcomes)}")
    return sentences


def _format_radii(radii_m: Sequence[float]) -> str:
    return ", ".join(f"{radius:.4g}" for radius in radii_m)


def describe_shares(shares: Mapping[str, float], order: tuple[str, ...] = ()) -> str:
    """Describe shares of the way in percent.

    Parameters
    ----------
    shares
        Share of the way by name.
    order
        Names that come first. All other names follow by decreasing share.

    Returns
    -------
    str
        Shares that are not zero, separated by commas.
    """
    rest = sorted((name for name in shares if name not in order), key=lambda name: -shares[name])
    labels = {BETWEEN_VERDICTS: ANSWER_WORDS[BETWEEN_VERDICTS]}
    return ", ".join(
        f"{labels.get(name, name)} {1e2 * shares[name]:.3g} %" for name in (*order, *rest) if shares.get(name)
    )
