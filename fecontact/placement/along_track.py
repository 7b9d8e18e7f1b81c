"""Irregularities of wheel and rail together, at a distance along the track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fecontact.arrays import Floats
from fecontact.placement.irregularity import Irregularity


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedIrregularities:
    """Irregularities of both bodies at a distance along the track.

    Attributes
    ----------
    lines
        Irregularities of wheel and rail.
    distance_mm
        Position along the irregularities at which smooth bodies touch.
    middle_x_mm
        This position in the track frame.
    lowered_mm
        Distance by which the rigid wheel is lower than on the smooth rail: the smallest sum of gap and irregularity.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.placement.along_track import PlacedIrregularities
    >>> from fecontact.placement.irregularity import Irregularity
    >>> wave = Irregularity(kind="sine", wavelength_mm=30.0, amplitude_mm=0.025)
    >>> along = PlacedIrregularities(lines=(wave,), distance_mm=15.0, middle_x_mm=0.0)
    >>> along.opening_mm(np.array([-15.0, 0.0])).tolist()
    [0.025, -0.025]
    """

    lines: tuple[Irregularity, ...]
    distance_mm: float
    middle_x_mm: float
    lowered_mm: float = 0.0

    def opening_mm(self, x_mm: Floats) -> Floats:
        """Sum of all openings in mm at places x (n,) in mm.

        Parameters
        ----------
        x_mm : ndarray of shape (n,)
            Positions along the track in mm.

        Returns
        -------
        ndarray of shape (n,)
            Opening in mm.
        """
        s = self.distance_mm + np.asarray(x_mm) - self.middle_x_mm
        return np.asarray(sum(irregularity.opening_mm(s) for irregularity in self.lines))

    @property
    def height_mm(self) -> float:
        """Largest opening minus the smallest opening, in mm."""
        return sum(irregularity.height_mm for irregularity in self.lines)

    @property
    def largest_slope(self) -> float:
        """Largest slope (-) of the sum of all irregularities."""
        return sum(irregularity.largest_slope for irregularity in self.lines)

    @property
    def finest_mm(self) -> float:
        """Shortest length along the track that nodes must resolve, in mm."""
        return min(irregularity.finest_mm for irregularity in self.lines)

    @property
    def kinks_x_mm(self) -> tuple[float, ...]:
        """Places in the track frame at which the slope jumps, in mm."""
        return tuple(
            kink - self.distance_mm + self.middle_x_mm for irregularity in self.lines for kink in irregularity.kinks_mm
        )

    def covers(self, low_x_mm: float, high_x_mm: float) -> bool:
        """Whether all tables of irregularities cover a range of the track frame.

        Parameters
        ----------
        low_x_mm, high_x_mm
            Ends of the range in mm.

        Returns
        -------
        bool
            True without any table.
        """
        shift = self.distance_mm - self.middle_x_mm
        ends = [
            (irregularity.points_mm[0][0], irregularity.points_mm[-1][0])
            for irregularity in self.lines
            if irregularity.points_mm
        ]
        return all(low <= low_x_mm + shift and high_x_mm + shift <= high for low, high in ends)
