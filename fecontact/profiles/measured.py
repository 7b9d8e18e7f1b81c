"""The points behind a smoothed line."""

from __future__ import annotations

from dataclasses import dataclass

from fecontact.profiles.segments import IN_PLACE, Floats, Registration, Segment


@dataclass(frozen=True, kw_only=True, eq=False)
class Held:
    """Points held against a line, which may be their own.

    Attributes
    ----------
    points (n, 2)
        In mm, without those that were left out.
    s_mm (n,)
        Arc length of each point along the line that it is held against.
    values (n, 2)
        What is smoothed: how far the points lie off their nominal profile, or the points themselves.
    normals (n, 2)
        Of the line, to its left.
    relative_width (n,)
        Width of the smoothing at each point over the whole one, where it follows the curvature.
    nominal, registration, reference
        Name of the profile that the points are held against, if any; how that was turned and moved to lie on the
        points; its segments.
    """

    points: Floats
    s_mm: Floats
    values: Floats
    normals: Floats
    relative_width: Floats | None = None
    nominal: str = ""
    registration: Registration = IN_PLACE
    reference: tuple[Segment, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Measured:
    """The points behind a smoothed line, and how it was made from them.

    Attributes
    ----------
    held
        The points and what they were held against.
    residual_mm (n,)
        How far each point lies to the left of the smoothed line.
    noise_mm
        Standard deviation of the points across the line.
    width_mm
        Wave length of which the smoothing leaves half, where the line is flat.
    curvature_noise_per_mm (n,)
        Standard deviation of the line's curvature from the noise of the points.
    """

    held: Held
    residual_mm: Floats
    noise_mm: float
    width_mm: float
    curvature_noise_per_mm: Floats

    @property
    def points(self) -> Floats:
        """The points (n, 2) in mm."""
        return self.held.points

    @property
    def s_mm(self) -> Floats:
        """Arc length (n,) of each point along the line that it was held against."""
        return self.held.s_mm

    @property
    def nominal(self) -> str:
        """Name of the profile from which the deviation was smoothed; empty where there is none."""
        return self.held.nominal
