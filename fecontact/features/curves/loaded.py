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
from fecontact.features.curves.normal import DEFAULT_THEORY, Overlap, Surfaces, normal_theory, press
from fecontact.features.curves.steady import PRESSED_MM, differences, largest, newton
from fecontact.jobs.remaining import Progress, watched
from fecontact.placement.wheelset import Wheelset, harmonic_conicity
from fecontact.solving.placing import wheelset_of_case

_ITERATIONS = 60
# Of the wheel load, and in mm and mrad.
_MET, _STEP = 1e-9, 1e-5
_AMPLITUDES_MM = (1.0, 2.0, 3.0)
_SHIFTS_MM = [float(one) for one in np.linspace(-3.0, 3.0, 61)]
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

    It is found from the rolling radii at the centres of pressure, by harmonic linearisation.

    Raises
    ------
    InputError
        If the load is not positive, or the wheelset cannot be at 3 mm.
    """
    wheelset, materials = wheelset_of_case(case), (case.wheel_material, case.rail_material)
    found = {
        theory: radius_differences_mm(
            wheelset, _SHIFTS_MM, wheel_load_N, theory=theory, materials=materials, progress=progress
        )
        for theory in _LOADED
    }

    def conicity(theory: str, amplitude: float) -> float:
        return harmonic_conicity(lambda shift: float(np.interp(shift, _SHIFTS_MM, found[theory])), amplitude)

    return [
        {"amplitude_mm": amplitude, "wheel_load_N": wheel_load_N}
        | {theory: conicity(theory, amplitude) for theory in _LOADED}
        for amplitude in _AMPLITUDES_MM
    ]
