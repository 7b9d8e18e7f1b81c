"""Sentences about a vehicle in curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

from fecontact.features.curves.stability import StraightTrack
from fecontact.features.curves.visits import NO_CELL, NO_EQUILIBRIUM, Curves, Difference
from fecontact.outputs.style import (
    ANSWER_WORDS,
    BETWEEN,
)

# what a map says of the places that a vehicle visits
ZONES = ("HOLDS", "UNRESOLVED", "FAILS", BETWEEN, NO_CELL, NO_EQUILIBRIUM)


def difference_words(one: Difference) -> str:
    """What a theory changes against the reference, in a sentence."""
    parts = []
    if one.without_m:
        parts.append(f"no equilibrium at R {', '.join(f'{radius:g}' for radius in one.without_m)} m")
    if math.isfinite(one.shift_mm):
        parts.append(f"shift differs by up to {one.shift_mm:.2f} mm (R {one.shift_at_m:g} m)")
        parts.append(f"Y/Q by up to {one.y_over_q:.3f} (R {one.y_over_q_at_m:g} m)")
    if one.critical_speed is not None:
        parts.append(f"the critical speed by {1e2 * one.critical_speed:+.0f} %")
    elif one.without_speed:
        parts.append(f"critical speeds are not compared ({one.without_speed})")
    return f"{one.theory} against {one.reference}: {', '.join(parts) or 'nothing to compare'}"


def straight_words(one: StraightTrack) -> str:
    """What a theory says of straight track, in a sentence."""
    if one.wavelength_m is None or one.slow_wavelength_m is None or one.frequency_Hz is None:
        return f"straight track, {one.theory}: {one.problem}"
    slow = f"wavelength {one.slow_wavelength_m:.1f} m at {one.slow_km_h:g} km/h"
    if one.problem or one.critical_speed_km_h is None:
        return f"straight track, {one.theory}: {one.problem}; {slow}"
    return (
        f"straight track, {one.theory}: critical speed {one.critical_speed_km_h:.0f} km/h, where it hunts with"
        f" {one.frequency_Hz:.1f} Hz and {one.wavelength_m:.1f} m; {slow}"
    )


def path_words(found: Curves) -> list[str]:
    """Where paths from straight track end, and which of the curves lie beyond: a sentence a theory and side."""
    words = []
    for theory, sign in itertools.product(found.runs, (1.0, -1.0)):
        beyond = [run for run in found.runs[theory] if run.path_ends_m and run.radius_m * sign > 0.0]
        if not beyond:
            continue
        first, *others = max((run.path_ends_m for run in beyond), key=len)
        end = f"at R {first:.0f} m" if math.isfinite(first) else "where it begins"
        further = f", another one at R {_radii_words(others)} m" if others else ""
        without, another = ([run.radius_m for run in beyond if run.is_balanced is had] for had in (False, True))
        reached = [f"no equilibrium was found at R {_radii_words(without)} m"] if without else []
        reached += [f"another equilibrium at R {_radii_words(another)} m"] if another else []
        words.append(f"{theory}: the path from straight track ends {end}{further}; beyond it {', '.join(reached)}")
    return words


def _radii_words(radii_m: Sequence[float]) -> str:
    return ", ".join(f"{radius:.4g}" for radius in radii_m)


def share_words(parts: Mapping[str, float], order: tuple[str, ...] = ()) -> str:
    """Shares of the way in percent, those in a given order first, the rest from the largest."""
    rest = sorted((name for name in parts if name not in order), key=lambda name: -parts[name])
    said = {BETWEEN: ANSWER_WORDS[BETWEEN]}
    return ", ".join(f"{said.get(name, name)} {1e2 * parts[name]:.3g} %" for name in (*order, *rest) if parts.get(name))
