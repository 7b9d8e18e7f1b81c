"""A loaded wheelset over its lateral shift: rolling radii at the centres of pressure, and conicity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import STEEL, Material, contact_modulus_MPa
from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.features.curves.newton import differences, largest, newton
from fecontact.features.curves.normal import DEFAULT_THEORY, Overlap, Surfaces, normal_theory, press
from fecontact.features.curves.steady import PRESSED_MM
from fecontact.jobs.remaining import Progress, watched
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.wheelset import Wheelset, radius_difference
from fecontact.solving.placing import wheelset_of_case

_ITERATIONS = 60
# Of the wheel load, and in mm and mrad.
_MET, _STEP = 1e-9, 1e-5
_AMPLITUDES_MM = (1.0, 2.0, 3.0)
# Shifts at which the loaded wheelset is solved, and how far they go beyond the rigid motion of an unsymmetric one.
_SHIFT_STEP_MM, _BEYOND_MM, _FARTHEST_MM = 0.1, 0.5, 10.0
_LOADED = ("overlap", "half_space")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Both:
    """Vertical forces of both wheels less the load, and rolling radii at their centres of pressure."""

    residual_N: Floats
    radii_mm: Floats


def radius_differences_mm(
    wheelset: Wheelset,
    shifts_mm: Sequence[float],
    wheel_load_N: float,
    *,
    theory: str = DEFAULT_THEORY,
    materials: tuple[Material, Material] = (STEEL, STEEL),
    progress: Progress | None = None,
) -> list[float]:
    """Rolling radii, left less right, at the centres of pressure, at many shifts.

    The wheelset has no yaw, both its wheels are under one vertical load, and there is no friction.

    Raises
    ------
    InputError
        If the load is not positive, or a shift is not possible under it.
    ConvergenceError
        If the theory finds no contact at a shift.
    """
    check_positive("wheel load", wheel_load_N, "N", "give the vertical load of one wheel")
    sides, normal, modulus = Surfaces.of(wheelset), normal_theory(theory), contact_modulus_MPa(*materials)

    def wheel(overlap: Overlap | None) -> tuple[float, float]:
        pressed = press(overlap, normal, modulus)
        if overlap is None or not pressed:
            return 0.0, np.nan
        if problem := pressed[0].problem:
            raise ConvergenceError(problem)
        here = overlap.at(np.concatenate([one.s_mm for one in pressed]))
        force = np.concatenate([one.force_N_per_mm * one.width_mm for one in pressed])
        return float(force @ np.cos(here.angle_rad)), float(force @ here.radius_mm) / float(force.sum())

    def both(shift: float, place: Floats) -> _Both:
        height, roll = float(place[0]), 1e-3 * float(place[1])
        wheels = [
            wheel(side.overlap(sign * shift, height, sign * roll, 0.0))
            for side, sign in zip(sides, (1.0, -1.0), strict=True)
        ]
        forces, radii = np.array(wheels).T
        return _Both(residual_N=forces - wheel_load_N, radii_mm=radii)

    def at(shift: float) -> float:
        stand = wheelset.stand(shift)
        if isinstance(stand, str):
            raise InputError(f"lateral shift {shift:g} mm of the wheelset: {stand}; give smaller shifts")
        here = partial(both, shift)
        _, found, _ = newton(
            here,
            lambda place: differences(lambda one: here(one).residual_N, place, _STEP),
            np.array([stand.left.axle_mm - PRESSED_MM, 1e3 * stand.roll_rad]),
            wanted_N=_MET * wheel_load_N,
            most=_ITERATIONS,
        )
        if largest(found.residual_N) >= _MET * wheel_load_N:
            raise InputError(
                f"lateral shift {shift:g} mm: no height and roll carry {wheel_load_N:g} N on both wheels; give another"
                " load, or smaller shifts"
            )
        return float(found.radii_mm[0] - found.radii_mm[1])

    return list(watched(map(at, shifts_mm), len(shifts_mm), progress, f"loaded wheelset by {theory}"))


def loaded_conicities(case: Case, wheel_load_N: float, *, progress: Progress | None = None) -> list[dict[str, float]]:
    """Equivalent conicity of the wheelset of a case under load at whole amplitudes up to 3 mm, by two theories.

    The rolling radii are those at the centres of pressure. The conicity is by the kinematic motion about the shift at
    which they are equal (EN 15302); NaN if the loaded wheelset has no motion of this amplitude.

    Raises
    ------
    InputError
        If the load is not positive, or the wheelset cannot be at the shifts of a motion of 3 mm.
    """
    wheelset, materials = wheelset_of_case(case), (case.wheel_material, case.rail_material)
    shifts = _shifts_of_motion(wheelset)
    found = {
        theory: RadiusDifference(
            shifts_mm=np.array(shifts),
            difference_mm=np.array(
                radius_differences_mm(
                    wheelset, shifts, wheel_load_N, theory=theory, materials=materials, progress=progress
                )
            ),
        )
        for theory in _LOADED
    }
    return [
        {"amplitude_mm": amplitude, "wheel_load_N": wheel_load_N}
        | {theory: difference.conicity(amplitude) for theory, difference in found.items()}
        for amplitude in _AMPLITUDES_MM
    ]


def _shifts_of_motion(wheelset: Wheelset) -> list[float]:
    """Shifts (mm) of the largest motion: to both sides of the middle, or of the rigid wheelset's motion."""
    low, high = -_AMPLITUDES_MM[-1], _AMPLITUDES_MM[-1]
    if not wheelset.symmetric:
        rigid = radius_difference(wheelset, -_FARTHEST_MM, _FARTHEST_MM, rolls=True)
        motion = None if rigid is None else rigid.motion(_AMPLITUDES_MM[-1])
        if motion is None:
            raise InputError(
                f"the rolling radii of both wheels are equal at no shift between {-_FARTHEST_MM:g} and"
                f" {_FARTHEST_MM:g} mm about which the wheelset could move by {_AMPLITUDES_MM[-1]:g} mm; check profiles"
                " and diameters of both sides"
            )
        low, high = motion.low_mm - _BEYOND_MM, motion.high_mm + _BEYOND_MM
    return [float(shift) for shift in np.linspace(low, high, round((high - low) / _SHIFT_STEP_MM) + 1)]
