"""What a theory of strips says of a contact: a half-elliptic pressure over the length of each strip along the rail."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.theory.gap_line import GapLine

Floats = NDArray[np.float64]
TheoryStatus = Literal["solved", "several solutions", "jump", "out of range", "not converged"]


@dataclass(frozen=True, kw_only=True, eq=False)
class StripContact:
    """A contact in strips along x; p(x, t) = p(0, t) sqrt(1 - x^2 / a(t)^2).

    Attributes
    ----------
    status
        `solved`; or the worst of what `notes` tell: several approaches carry the load, the force jumps over it, the
        theory is out of its range, or its iterations did not end. Numbers are given all the same.
    solutions
        Number of approaches that were found to carry the wanted load; 1 where the approach was given.
    approach_mm, normal_force_N
        Of this contact, whatever load was wanted.
    t_mm, width_mm (n,)
        Middles and widths of the strips, in the tangent plane at first touch; of the strip method along the rail's
        surface, where the line knows it.
    half_length_mm, centre_pressure_MPa (n,)
        a(t) and p(0, t), both 0 outside the patch.
    """

    status: TheoryStatus
    notes: tuple[str, ...]
    solutions: int
    approach_mm: float
    normal_force_N: float
    t_mm: Floats
    width_mm: Floats
    half_length_mm: Floats
    centre_pressure_MPa: Floats

    @property
    def p_max_MPa(self) -> float:
        """Largest pressure of a strip."""
        return float(self.centre_pressure_MPa.max())

    @property
    def area_mm2(self) -> float:
        """Area of the patch."""
        return float(2.0 * (self.width_mm @ self.half_length_mm))

    @property
    def centre_t_mm(self) -> float:
        """Centre of pressure across; NaN without a force."""
        return self._mean(self.t_mm)

    @property
    def a_mm(self) -> float:
        """Half-width along x from the second moment of the pressure, sqrt(5 <x^2>); NaN without a force."""
        # <x^2> of a half-elliptic strip is a quarter of its half length squared
        return math.sqrt(5.0 * self._mean(0.25 * self.half_length_mm**2))

    @property
    def b_mm(self) -> float:
        """Half-width across from the second moment of the pressure about its centre, sqrt(5 <t^2>)."""
        # a strip's own width counts with it
        return math.sqrt(5.0 * (self._mean((self.t_mm - self.centre_t_mm) ** 2 + self.width_mm**2 / 12.0)))

    def pressure_MPa(self, x_mm: ArrayLike, t_mm: ArrayLike) -> Floats:
        """Pressure at any points; shapes broadcast. Squares of lengths and pressures are linear between the strips."""
        x, t = np.asarray(x_mm, dtype=np.float64), np.asarray(t_mm, dtype=np.float64)
        a_square = np.interp(t, self.t_mm, self.half_length_mm**2, left=0.0, right=0.0)
        p_square = np.interp(t, self.t_mm, self.centre_pressure_MPa**2, left=0.0, right=0.0)
        # what goes with t alone first: a line of x beside one of t costs four operations a point
        in_a, p_square = 1.0 / np.where(a_square > 0.0, a_square, 1.0), np.where(a_square > 0.0, p_square, 0.0)
        pressure = np.asarray(1.0 - x**2 * in_a)
        np.maximum(pressure, 0.0, out=pressure)
        pressure *= p_square
        return np.sqrt(pressure, out=pressure)

    def _mean(self, values: Floats) -> float:
        weights = self.width_mm * self.centre_pressure_MPa * self.half_length_mm
        total = float(weights.sum())
        return float(weights @ values) / total if total > 0.0 else math.nan


def strip_contact(
    line: GapLine, approach_mm: float, half_length_mm: Floats, centre_pressure_MPa: Floats, out: list[str]
) -> StripContact:
    """Contact of strips on the places of a line; `out` are the reasons why the theory is out of its range."""
    notes = list(out)
    if half_length_mm[0] > 0.0 or half_length_mm[-1] > 0.0:
        notes.append("the patch reaches the end of the line; give a longer one")
    return StripContact(
        status="out of range" if notes else "solved",
        notes=tuple(notes),
        solutions=1,
        approach_mm=approach_mm,
        normal_force_N=float(0.5 * np.pi * line.step_mm * (half_length_mm @ centre_pressure_MPa)),
        t_mm=line.t_mm,
        width_mm=np.full_like(line.t_mm, line.step_mm),
        half_length_mm=half_length_mm,
        centre_pressure_MPa=centre_pressure_MPa,
    )
