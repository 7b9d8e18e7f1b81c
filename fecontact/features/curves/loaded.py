"""Rolling radii and conicity of a loaded wheelset over its lateral shift.

The rolling radii are at the centres of pressure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fecontact.arrays import Floats
from fecontact.bodies import STEEL, Material, combine_moduli_MPa
from fecontact.case import Case
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.features.curves.conditions import DEFAULT_THEORY
from fecontact.features.curves.newton import estimate_jacobian, largest_magnitude, solve_newton
from fecontact.features.curves.normal import Overlap, Surfaces, normal_theory, solve_normal_contact
from fecontact.features.curves.steady import START_DEPTH_MM
from fecontact.jobs.remaining import Progress, report_progress
from fecontact.placement.conicity import RadiusDifference
from fecontact.placement.wheelset import Wheelset, compute_radius_difference
from fecontact.solving.placing import make_wheelset

_MAX_ITERATIONS = 60
# Tolerance of the vertical forces as a fraction of the wheel load, and step of the Jacobian (mm and mrad).
_LOAD_TOLERANCE, _JACOBIAN_STEP = 1e-9, 1e-5
_AMPLITUDES_MM = (1.0, 2.0, 3.0)
# Spacing of the shifts at which the loaded wheelset is solved, margin of the shifts beyond the rigid motion of an
# unsymmetric wheelset, and largest shift of the search for this motion.
_SHIFT_STEP_MM, _SHIFT_MARGIN_MM, _MAX_SHIFT_MM = 0.1, 0.5, 10.0
_CONICITY_THEORIES = ("overlap", "half_space")


@dataclass(frozen=True, kw_only=True, eq=False)
class _WheelPair:
    """Residual of the vertical forces of both wheels, and their rolling radii.

    Attributes
    ----------
    residual_N : ndarray of shape (2,)
        Vertical forces minus the wheel load.
    radii_mm : ndarray of shape (2,)
        Rolling radii at the centres of pressure; NaN without contact.
    """

    residual_N: Floats
    radii_mm: Floats


def compute_radius_differences_mm(
    wheelset: Wheelset,
    shifts_mm: Sequence[float],
    wheel_load_N: float,
    *,
    theory: str = DEFAULT_THEORY,
    materials: tuple[Material, Material] = (STEEL, STEEL),
    progress: Progress | None = None,
) -> list[float]:
    """Differences of the rolling radii at the centres of pressure, left minus right.

    The wheelset has no yaw, both wheels carry an equal vertical load, and there is no friction.

    Parameters
    ----------
    wheelset
        Both wheels over their rails.
    shifts_mm
        Lateral shifts of the wheelset.
    wheel_load_N
        Vertical load of each wheel.
    theory
        Name of the theory of the normal force.
    materials
        Materials of wheel and rail.
    progress
        Receives the number of solved shifts.

    Returns
    -------
    list of float
        A difference in mm for each shift.

    Raises
    ------
    InputError
        If the load is not positive, or if a shift is not possible under it.
    ConvergenceError
        If the theory finds no contact at a shift.

    Notes
    -----
    Range of validity: quasi-static contact without creep forces.
    """
    check_positive("wheel load", wheel_load_N, "N", "give the vertical load per wheel")
    sides, normal, modulus = Surfaces.make_sides(wheelset), normal_theory(theory), combine_moduli_MPa(*materials)

    def solve_wheel(overlap: Overlap | None) -> tuple[float, float]:
        """Vertical force (N) and rolling radius (mm) of a wheel at its centre of pressure."""
        patches = solve_normal_contact(overlap, normal, modulus)
        if overlap is None or not patches:
            return 0.0, np.nan
        if problem := patches[0].problem:
            raise ConvergenceError(problem)
        strips = overlap.interpolate(np.concatenate([patch.s_mm for patch in patches]))
        force = np.concatenate([patch.force_N_per_mm * patch.width_mm for patch in patches])
        return float(force @ np.cos(strips.angle_rad)), float(force @ strips.radius_mm) / float(force.sum())

    def solve_wheels(shift: float, position: Floats) -> _WheelPair:
        """Errors of both normal forces (N) and rolling radii (mm) at a shift (mm).

        `position` is the height of the wheelset in mm, and its roll in mrad.
        """
        height, roll = float(position[0]), 1e-3 * float(position[1])
        wheels = [
            solve_wheel(side.overlap(sign * shift, height, sign * roll, 0.0))
            for side, sign in zip(sides, (1.0, -1.0), strict=True)
        ]
        forces, radii = np.array(wheels).T
        return _WheelPair(residual_N=forces - wheel_load_N, radii_mm=radii)

    def solve_shift(shift: float) -> float:
        """Difference of the rolling radii, left minus right (mm), at a shift (mm).

        Raises InputError for a shift at which the wheelset cannot stand or does not carry the load on both wheels.
        """
        rigid_position = wheelset.stand(shift)
        if isinstance(rigid_position, str):
            raise InputError(f"lateral shift {shift:g} mm of the wheelset: {rigid_position}; give smaller shifts")
        evaluate = partial(solve_wheels, shift)
        _, wheels, _ = solve_newton(
            evaluate,
            lambda position: estimate_jacobian(
                lambda varied_position: evaluate(varied_position).residual_N, position, _JACOBIAN_STEP
            ),
            np.array([rigid_position.left.axle_mm - START_DEPTH_MM, 1e3 * rigid_position.roll_rad]),
            wanted_N=_LOAD_TOLERANCE * wheel_load_N,
            most=_MAX_ITERATIONS,
        )
        if largest_magnitude(wheels.residual_N) >= _LOAD_TOLERANCE * wheel_load_N:
            raise InputError(
                f"lateral shift {shift:g} mm: no position of the wheelset carries {wheel_load_N:g} N on both wheels;"
                " change the load, or give smaller shifts"
            )
        return float(wheels.radii_mm[0] - wheels.radii_mm[1])

    return list(report_progress(map(solve_shift, shifts_mm), len(shifts_mm), progress, f"loaded wheelset by {theory}"))


def compute_loaded_conicities(
    case: Case, wheel_load_N: float, *, progress: Progress | None = None
) -> list[dict[str, float]]:
    """Equivalent conicity of the loaded wheelset of a case by two theories.

    The rolling radii are those at the centres of pressure. The amplitudes are 1, 2 and 3 mm. The conicity is derived
    from the kinematic motion about the shift at which both rolling radii are equal (EN 15302).

    Parameters
    ----------
    case
        Case with the profiles, the track and the materials.
    wheel_load_N
        Vertical load of each wheel.
    progress
        Receives the number of solved shifts.

    Returns
    -------
    list of dict
        For each amplitude `amplitude_mm`, `wheel_load_N`, and the conicity by `overlap` and `half_space`. A conicity is
        NaN if the loaded wheelset has no motion of this amplitude.

    Raises
    ------
    InputError
        If the load is not positive, or if the wheelset cannot be at the shifts of a motion of 3 mm.
    """
    wheelset, materials = make_wheelset(case), (case.wheel_material, case.rail_material)
    shifts = _choose_shifts(wheelset)
    differences = {
        theory: RadiusDifference(
            shifts_mm=np.array(shifts),
            difference_mm=np.array(
                compute_radius_differences_mm(
                    wheelset, shifts, wheel_load_N, theory=theory, materials=materials, progress=progress
                )
            ),
        )
        for theory in _CONICITY_THEORIES
    }
    return [
        {"amplitude_mm": amplitude, "wheel_load_N": wheel_load_N}
        | {theory: difference.conicity(amplitude) for theory, difference in differences.items()}
        for amplitude in _AMPLITUDES_MM
    ]


def _choose_shifts(wheelset: Wheelset) -> list[float]:
    """Choose the shifts (mm) of the largest motion.

    They reach to both sides of the middle, or of the rigid motion of an unsymmetric wheelset.

    Raises
    ------
    InputError
        If an unsymmetric wheelset has no rigid motion of 3 mm.
    """
    low, high = -_AMPLITUDES_MM[-1], _AMPLITUDES_MM[-1]
    if not wheelset.symmetric:
        rigid = compute_radius_difference(wheelset, -_MAX_SHIFT_MM, _MAX_SHIFT_MM, rolls=True)
        motion = None if rigid is None else rigid.motion(_AMPLITUDES_MM[-1])
        if motion is None:
            raise InputError(
                f"no shift between {-_MAX_SHIFT_MM:g} and {_MAX_SHIFT_MM:g} mm has equal rolling radii of both wheels"
                f" and allows a motion of {_AMPLITUDES_MM[-1]:g} mm; check profiles and diameters of both sides"
            )
        low, high = motion.low_mm - _SHIFT_MARGIN_MM, motion.high_mm + _SHIFT_MARGIN_MM
    return [float(shift) for shift in np.linspace(low, high, round((high - low) / _SHIFT_STEP_MM) + 1)]
