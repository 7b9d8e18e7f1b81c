"""What the theory of the contact changes for a vehicle: where it runs, how it guides, how fast it may run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from fecontact.vehicle.curve import CurveRun, WheelsetRun
from fecontact.vehicle.stability import StraightTrack


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A theory against a reference, over all curves in which both have an equilibrium.

    Attributes
    ----------
    without_m
        Radii at which the theory has no equilibrium and the reference has one.
    shift_mm, shift_at_m
        Largest difference of a wheelset's lateral shift, and at which radius; NaN where there is nothing to compare.
    y_over_q, y_over_q_at_m
        The same of Y/Q, over all wheels.
    critical_speed
        Critical speed over that of the reference, less 1; None where one of them has none.
    """

    theory: str
    reference: str
    without_m: tuple[float, ...]
    shift_mm: float
    shift_at_m: float
    y_over_q: float
    y_over_q_at_m: float
    critical_speed: float | None


def differences(
    runs: Mapping[str, Sequence[CurveRun]], straight: Sequence[StraightTrack] = ()
) -> tuple[Difference, ...]:
    """Each theory against the last one, curve by curve in their order."""
    *others, reference = runs
    speeds = {one.theory: one.critical_speed_km_h for one in straight}
    return tuple(_difference(runs, speeds, theory, reference) for theory in others)


def _difference(
    runs: Mapping[str, Sequence[CurveRun]], speeds: Mapping[str, float | None], theory: str, reference: str
) -> Difference:
    pairs = list(zip(runs[theory], runs[reference], strict=True))
    shifts = [(abs(a.lateral_shift_mm - b.lateral_shift_mm), radius) for radius, a, b in _wheelsets(pairs)]
    guiding = [
        (abs(a.wheels[k].y_over_q - b.wheels[k].y_over_q), radius) for radius, a, b in _wheelsets(pairs) for k in (0, 1)
    ]
    nothing = (math.nan, math.nan)
    (shift, shift_at), (y_over_q, y_over_q_at) = max(shifts, default=nothing), max(guiding, default=nothing)
    own, other = speeds.get(theory), speeds.get(reference)
    return Difference(
        theory=theory,
        reference=reference,
        without_m=tuple(one.radius_m for one, other in pairs if not one.is_balanced and other.is_balanced),
        shift_mm=shift,
        shift_at_m=shift_at,
        y_over_q=y_over_q,
        y_over_q_at_m=y_over_q_at,
        critical_speed=own / other - 1.0 if own and other else None,
    )


def _wheelsets(pairs: Sequence[tuple[CurveRun, CurveRun]]) -> Iterator[tuple[float, WheelsetRun, WheelsetRun]]:
    """Radius, and the same wheelset by both theories, where both have an equilibrium."""
    for one, other in pairs:
        if one.is_balanced and other.is_balanced:
            for a, b in zip(one.wheelsets, other.wheelsets, strict=True):
                yield one.radius_m, a, b
