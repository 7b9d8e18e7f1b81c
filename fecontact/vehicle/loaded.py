"""Contact of a loaded wheelset over its lateral shift: loads, centres of pressure, rolling radii, conicity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fecontact.errors import InputError, check_positive
from fecontact.geometry.contact_functions import harmonic_conicity
from fecontact.geometry.wheelset import Wheelset
from fecontact.material import STEEL, Material, contact_modulus_MPa
from fecontact.vehicle.normal import DEFAULT_THEORY, NormalTheory, normal_theory
from fecontact.vehicle.surfaces import Surfaces

_ITERATIONS = 60
# Of the wheel load, and in mm and mrad.
_MET, _STEP = 1e-9, 1e-5
_LONGEST_STEP = 0.05
_PRESSED_MM = 0.1
_SHIFT_STEP_MM = 0.1


@dataclass(frozen=True, kw_only=True)
class LoadedContact:
    """A wheelset at a shift with both wheels under one vertical load.

    Attributes
    ----------
    height_mm, roll_mrad
        Of the axle.
    left_radius_mm, right_radius_mm
        Rolling radii at the centres of pressure.
    left_centre_mm, right_centre_mm
        Lateral positions of those, each from the middle towards its own rail.
    left_patches, right_patches
        Numbers of separate patches.
    """

    shift_mm: float
    height_mm: float
    roll_mrad: float
    left_radius_mm: float
    right_radius_mm: float
    left_centre_mm: float
    right_centre_mm: float
    left_patches: int
    right_patches: int

    @property
    def radius_difference_mm(self) -> float:
        """Rolling radius of the left wheel less that of the right one."""
        return self.left_radius_mm - self.right_radius_mm


@dataclass(frozen=True, kw_only=True)
class _Wheel:
    load_N: float
    radius_mm: float
    centre_mm: float
    patches: int


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
    """
    check_positive("wheel load", wheel_load_N, "N", "give the vertical load of one wheel")
    left = Surfaces(pair=wheelset.left.pair)
    sides = (left, left if wheelset.symmetric else Surfaces(pair=wheelset.right.pair))
    normal, modulus = normal_theory(theory), contact_modulus_MPa(*materials)
    found: dict[float, LoadedContact] = {}
    # from the middle outwards on either side, each from the one before it
    for direction in (1.0, -1.0):
        guess: tuple[float, float] | None = None
        for shift in sorted({one for one in shifts_mm if one * direction >= 0.0}, key=abs):
            guess = _start(wheelset, shift) if guess is None else guess
            found[shift] = _loaded(sides, shift, wheel_load_N, normal, modulus, guess)
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


def _loaded(
    sides: tuple[Surfaces, Surfaces],
    shift: float,
    load: float,
    normal: NormalTheory,
    modulus: float,
    guess: tuple[float, float],
) -> LoadedContact:
    """Newton's method for height and roll."""
    at = np.array(guess)

    def wheels(place: np.ndarray) -> tuple[_Wheel, _Wheel]:
        left = _wheel(sides[0], shift, float(place[0]), 1e-3 * float(place[1]), normal, modulus)
        return left, _wheel(sides[1], -shift, float(place[0]), -1e-3 * float(place[1]), normal, modulus)

    for _ in range(_ITERATIONS):
        here = wheels(at)
        missing = np.array([one.load_N - load for one in here])
        if float(np.abs(missing).max()) < _MET * load:
            break
        slopes = np.stack(
            [
                (np.array([one.load_N - load for one in wheels(at + _STEP * unit)]) - missing) / _STEP
                for unit in np.eye(2)
            ],
            axis=1,
        )
        if abs(float(np.linalg.det(slopes))) < 1.0:
            # a wheel that does not touch: lower
            at = at - np.array([_LONGEST_STEP, 0.0])
            continue
        step = np.linalg.solve(slopes, -missing)
        at = at + step * min(1.0, _LONGEST_STEP / float(np.abs(step).max()))
    else:
        raise InputError(f"lateral shift {shift:g} mm: no height and roll carry {load:g} N on both wheels")
    left, right = here
    return LoadedContact(
        shift_mm=shift,
        height_mm=float(at[0]),
        roll_mrad=float(at[1]),
        left_radius_mm=left.radius_mm,
        right_radius_mm=right.radius_mm,
        left_centre_mm=left.centre_mm,
        right_centre_mm=right.centre_mm,
        left_patches=left.patches,
        right_patches=right.patches,
    )


def _wheel(
    surfaces: Surfaces, shift: float, height: float, roll: float, normal: NormalTheory, modulus: float
) -> _Wheel:
    overlap = surfaces.overlap(shift, height, roll, 0.0)
    pressed = () if overlap is None else normal(overlap, modulus)
    if overlap is None or not pressed:
        return _Wheel(load_N=0.0, radius_mm=float("nan"), centre_mm=float("nan"), patches=0)
    s = np.concatenate([one.s_mm for one in pressed])
    force = np.concatenate([one.force_N_per_mm * one.width_mm for one in pressed])
    share = force / force.sum()
    return _Wheel(
        load_N=float(force @ np.cos(np.interp(s, overlap.s_mm, overlap.angle_rad))),
        radius_mm=float(share @ np.interp(s, overlap.s_mm, overlap.radius_mm)),
        centre_mm=float(share @ np.interp(s, overlap.s_mm, overlap.place_mm[:, 1])),
        patches=len(pressed),
    )
