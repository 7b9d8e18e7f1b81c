"""What is said of a vehicle in curves."""

from __future__ import annotations

import math
from collections.abc import Mapping

from fecontact.vehicle.differences import Difference
from fecontact.vehicle.stability import StraightTrack
from fecontact.vehicle.visits import NO_CELL, NO_EQUILIBRIUM

ZONES = ("HOLDS", "UNRESOLVED", "FAILS", "failed", NO_CELL, NO_EQUILIBRIUM)
"""What a map says of the places that a vehicle visits."""


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


def share_words(parts: Mapping[str, float], order: tuple[str, ...] = ()) -> str:
    """Shares of the way in percent, those in a given order first, the rest from the largest."""
    rest = sorted((name for name in parts if name not in order), key=lambda name: -parts[name])
    return ", ".join(f"{name} {1e2 * parts[name]:.3g} %" for name in (*order, *rest) if parts.get(name))
