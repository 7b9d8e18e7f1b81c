"""The points behind a smoothed line."""

from __future__ import annotations

from dataclasses import dataclass

from fecontact.profiles.segments import Floats, Segment


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """The points behind a smoothed line, and how it was made from them.

    Attributes
    ----------
    points (n, 2)
        In mm, without those that were left out.
    s_mm, residual_mm (n,)
        Arc length of each point along the line that it was held against, and how far it lies to the left of the
        smoothed line.
    noise_mm
        Standard deviation of the points across the line.
    width_mm
        Wave length of which the smoothing leaves half, where the line is flat.
    relative_width (n,)
        Width at each point over that, where it follows the curvature.
    nominal, turn_rad, shift
        Name of the profile from which the deviation was smoothed, if any; how that was turned and moved to lie on
        the points.
    curvature_noise_per_mm (n,)
        Standard deviation of the line's curvature from the noise of the points.
    reference
        Segments of the nominal profile.
    """

    points: Floats
    s_mm: Floats
    residual_mm: Floats
    noise_mm: float
    width_mm: float
    curvature_noise_per_mm: Floats
    nominal: str = ""
    turn_rad: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    reference: tuple[Segment, ...] = ()
    relative_width: Floats | None = None
