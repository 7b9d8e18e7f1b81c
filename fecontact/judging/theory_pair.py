"""Contact by a theory and contact by another theory, on common points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fecontact.arrays import Floats
from fecontact.contact.patch import find_ridge_peaks
from fecontact.contact_theories.approximation import TheoryContact

# Number of points along and across at which the pressures of two theories are compared.
_POINTS_ALONG, POINTS_ACROSS = 24, 160


@dataclass(frozen=True, kw_only=True, eq=False)
class TheoryPair:
    """Theory that is compared with a reference theory.

    Attributes
    ----------
    reference
        Contact by the reference theory, which replaces a solved contact.
    theory
        Contact by the theory that is compared.
    """

    reference: TheoryContact
    theory: TheoryContact

    @property
    def distance_mm(self) -> float:
        """Lateral distance from the theory's centre of pressure to the reference's centre in mm."""
        return self.reference.centre_mm[1] - self.theory.centre_mm[1]

    @property
    def valley_difference(self) -> float:
        """Valley of the reference minus valley of the theory, each over its highest peak (-)."""
        reference_valley, valley = (_measure_valley(pressure_MPa) for pressure_MPa in self.pressures_MPa)
        return reference_valley - valley

    @cached_property
    def pressures_MPa(self) -> tuple[Floats, Floats]:
        """Pressures of reference and theory in MPa on the middles of equal cells, (24, 160).

        The cells cover a quarter of both contacts. A theory with a single patch is moved to the centre of pressure of
        the reference.
        """
        moved_mm = self.distance_mm if self.theory.single is not None else 0.0
        (_, low), (length, high) = self.reference.box_mm
        (_, theory_low), (theory_length, theory_high) = self.theory.box_mm
        low, high = min(low, theory_low + moved_mm), max(high, theory_high + moved_mm)
        x = (np.arange(_POINTS_ALONG) + 0.5) / _POINTS_ALONG * max(length, theory_length)
        s = low + (np.arange(POINTS_ACROSS) + 0.5) / POINTS_ACROSS * (high - low)
        return evaluate_pressure(self.reference, x, s), evaluate_pressure(self.theory, x, s - moved_mm)


def evaluate_pressure(theory: TheoryContact, x: Floats, s: Floats) -> Floats:
    """Pressure of a theory at all places (x, s).

    Parameters
    ----------
    theory
        Contact by a theory.
    x, s : ndarrays of shapes (n,), (m,)
        Places along and across in mm.

    Returns
    -------
    array (n, m)
        Pressure in MPa.
    """
    patch_pressures = [
        patch.shape.pressure_MPa(x[:, None] - patch.origin_mm[0], s[None, :] - patch.origin_mm[1])
        for patch in theory.patches
    ]
    return np.asarray(sum(patch_pressures))


def _measure_valley(pressure: Floats) -> float:
    """Largest prominence of a peak other than the highest, along x = 0.

    It is relative to the highest peak.
    """
    return find_ridge_peaks(np.concatenate(([0.0], pressure[0], [0.0])), 0.0)[1]
