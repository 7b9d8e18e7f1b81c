"""Contact of a loaded wheelset over its lateral shift: loads, centres of pressure, rolling radii, conicity."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.bodies import STEEL, Material, contact_modulus_MPa
from fecontact.errors import ConvergenceError, InputError, check_positive
from fecontact.vehicle.normal import DEFAULT_THEORY, Overlap, Pressed, Surfaces, normal_theory
from fecontact.wheel_rail.wheelset import Wheelset, harmonic_conicity

_ITERATIONS = 60
# Of the wheel load, and in mm and mrad.
_MET, _STEP = 1e-9, 1e-5
_LONGEST_STEP = 0.05
_PRESSED_MM = 0.1
_SHIFT_STEP_MM = 0.1


@dataclass(frozen=True, kw_only=True)
class LoadedWheel:
    """A wheel under a vertical load.

    Attributes
    ----------
    radius_mm
        Rolling radius at the centre of pressure.
    centre_mm
        Lateral position of that, from the middle towards the wheel's own rail.
    patches
        Number of separate patches.
    """

    load_N: float
    radius_mm: float
    centre_mm: float
    patches: int


@dataclass(frozen=True, kw_only=True)
class LoadedContact:
    """A wheelset at a shift with both wheels under one vertical load.

    Attributes
    ----------
    height_mm, roll_mrad
        Of the axle.
    left, right
        Both wheels.
    """

    shift_mm: float
    height_mm: float
    roll_mrad: float
    left: LoadedWheel
    right: LoadedWheel

    @property
    def radius_difference_mm(self) -> float:
        """Rolling radius of the left wheel less that of the right one."""
        return self.left.radius_mm - self.right.radius_mm


def loaded_contacts(
    wheelset: Wheelset,
    shifts_mm: Sequence[float],
    wheel_load_N: float,
    *,
    theory: str = DEFAULT_THEORY,
    materials: tuple[Material, Material] = (STEEL, STEEL),
) -> list[LoadedContact]:
    """A wheelset without yaw at many shifts, both wheels under one vertical load, without friction.

    Raises
    ------
    InputError
        If the load is not positive, or a shift is not possible under it.
    ConvergenceError
        If the theory finds no contact at a shift.
    """
    check_positive("wheel load", wheel_load_N, "N", "give the vertical load of one wheel")
    left = Surfaces(pair=wheelset.left.pair)
    right = left if wheelset.symmetric else Surfaces(pair=wheelset.right.pair)
    normal, modulus = normal_theory(theory), contact_modulus_MPa(*materials)
    loaded = _Loaded(left=left, right=right, pressed=lambda overlap: normal(overlap, modulus), load_N=wheel_load_N)
    found: dict[float, LoadedContact] = {}
    # from the middle outwards on either side, each from the one before it
    for direction in (1.0, -1.0):
        guess: tuple[float, float] | None = None
        for shift in sorted({one for one in shifts_mm if one * direction >= 0.0}, key=abs):
            guess = _start(wheelset, shift) if guess is None else guess
            found[shift] = loaded.at(shift, guess)
            guess = (found[shift].height_mm, found[shift].roll_mrad)
    return [found[shift] for shift in shifts_mm]


def loaded_conicity(contacts: Sequence[LoadedContact], amplitude_mm: float) -> float:
    """Equivalent conicity at an amplitude of rolling radii at the centres of pressure, by harmonic linearisation."""
    shifts = np.array([one.shift_mm for one in contacts])
    order = np.argsort(shifts)
    values = np.array([one.radius_difference_mm for one in contacts])[order]
    return harmonic_conicity(lambda shift: float(np.interp(shift, shifts[order], values)), amplitude_mm)


def conicity_shifts(amplitude_mm: float) -> list[float]:
    """Shifts that a conicity up to an amplitude needs."""
    count = int(np.ceil(amplitude_mm / _SHIFT_STEP_MM))
    return [float(one) for one in np.linspace(-amplitude_mm, amplitude_mm, 2 * count + 1)]


def _start(wheelset: Wheelset, shift: float) -> tuple[float, float]:
    stand = wheelset.stand(shift)
    if isinstance(stand, str):
        raise InputError(f"lateral shift {shift:g} mm of the wheelset: {stand}; give smaller shifts")
    return stand.left.axle_mm - _PRESSED_MM, 1e3 * stand.roll_rad


@dataclass(frozen=True, kw_only=True, eq=False)
class _Loaded:
    """Both sides, what presses them, and the load of each."""

    left: Surfaces
    right: Surfaces
    pressed: Callable[[Overlap], tuple[Pressed, ...]]
    load_N: float

    def at(self, shift: float, guess: tuple[float, float]) -> LoadedContact:
        """Newton's method for height and roll."""
        at, load = np.array(guess), self.load_N
        for _ in range(_ITERATIONS):
            left, right = self._wheels(shift, at)
            missing = np.array([left.load_N - load, right.load_N - load])
            if float(np.abs(missing).max()) < _MET * load:
                break
            beside = [self._wheels(shift, at + _STEP * unit) for unit in np.eye(2)]
            slopes = (np.array([[one.load_N - load for one in wheels] for wheels in beside]) - missing).T / _STEP
            if abs(float(np.linalg.det(slopes))) < 1.0:
                # a wheel that does not touch: lower
                at = at - np.array([_LONGEST_STEP, 0.0])
                continue
            step = np.linalg.solve(slopes, -missing)
            at = at + step * min(1.0, _LONGEST_STEP / float(np.abs(step).max()))
        else:
            raise InputError(f"lateral shift {shift:g} mm: no height and roll carry {load:g} N on both wheels")
        return LoadedContact(shift_mm=shift, height_mm=float(at[0]), roll_mrad=float(at[1]), left=left, right=right)

    def _wheels(self, shift: float, place: np.ndarray) -> tuple[LoadedWheel, LoadedWheel]:
        height, roll = float(place[0]), 1e-3 * float(place[1])
        left, right = self.left.overlap(shift, height, roll, 0.0), self.right.overlap(-shift, height, -roll, 0.0)
        return self._wheel(left), self._wheel(right)

    def _wheel(self, overlap: Overlap | None) -> LoadedWheel:
        pressed = () if overlap is None else self.pressed(overlap)
        if overlap is None or not pressed:
            return LoadedWheel(load_N=0.0, radius_mm=float("nan"), centre_mm=float("nan"), patches=0)
        if problem := pressed[0].problem:
            raise ConvergenceError(problem)
        s = np.concatenate([one.s_mm for one in pressed])
        force = np.concatenate([one.force_N_per_mm * one.width_mm for one in pressed])
        share = force / force.sum()
        return LoadedWheel(
            load_N=float(force @ np.cos(np.interp(s, overlap.s_mm, overlap.angle_rad))),
            radius_mm=float(share @ np.interp(s, overlap.s_mm, overlap.radius_mm)),
            centre_mm=float(share @ np.interp(s, overlap.s_mm, overlap.place_mm[:, 1])),
            patches=len(pressed),
        )
