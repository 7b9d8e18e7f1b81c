"""What measured profiles leave open: the same contact on the other lines that their points allow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fecontact.comparison.measures import deviations
from fecontact.contact.rung import Rung
from fecontact.theory.hertz import HertzContact

# Student's factor for 95 % by the number of draws.
_STUDENT = {1: 12.71, 2: 4.30, 3: 3.18, 4: 2.78, 5: 2.57, 6: 2.45, 7: 2.36, 8: 2.31}

# What a smoothing blurs grows with the fourth power of its width: 0.71 of that shows three quarters of it. On half of
# it the noise, which is six times as large there, hid what was to be shown.
_BLURRED = (4.0 / 3.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class PointNoise:
    """Hertz and the half-space under the true gap, for profiles given by points and for others that these allow.

    None stands for profiles that do not come into contact.

    Attributes
    ----------
    own
        The profiles as they are.
    thinned
        Lines through points with every second point left out; `own` again where there are none.
    widths
        Smoothed lines with 0.71 of the width, and with double the width.
    draws
        Smoothed lines from points with other noise of the same size.
    """

    own: tuple[HertzContact, Rung]
    thinned: tuple[HertzContact, Rung] | None
    widths: tuple[tuple[HertzContact, Rung] | None, ...] = ()
    draws: tuple[tuple[HertzContact, Rung] | None, ...] = ()

    @property
    def others(self) -> tuple[tuple[HertzContact, Rung] | None, ...]:
        """All but `own`."""
        return (self.thinned, *self.widths, *self.draws)

    def uncertainty(self) -> dict[str, float]:
        """Part of the uncertainty of each deviation that is the profile's; NaN where a line does not come into contact.

        Deviations are those of Hertz from the half-space, which sees curvature, noise and spacing alike.
        """

        def read(solved: tuple[HertzContact, Rung] | None) -> dict[str, float] | None:
            return None if solved is None else deviations(solved[1], solved[0])

        return spread(
            deviations(self.own[1], self.own[0]),
            thinned=() if self.thinned is self.own else (read(self.thinned),),
            widths=[read(one) for one in self.widths],
            draws=[read(one) for one in self.draws],
        )


def spread(
    own: Mapping[str, float],
    *,
    thinned: Sequence[Mapping[str, float] | None] = (),
    widths: Sequence[Mapping[str, float] | None] = (),
    draws: Sequence[Mapping[str, float] | None] = (),
) -> dict[str, float]:
    """How far values may be off for what points leave open: NaN where one of the other lines has none.

    Added are the change by thinning, and the root of the sum of the squares of two: the scatter of the draws for 95 %
    (what the noise does), and the change by another width (what the smoothing blurs), which has noise of its own.
    """
    if any(one is None for one in (*thinned, *widths, *draws)):
        return dict.fromkeys(own, math.nan)

    def changes(of: Sequence[Mapping[str, float] | None], name: str) -> list[float]:
        return [abs(one[name] - own[name]) for one in of if one is not None]

    found = {}
    for name in own:
        drawn = changes(draws, name)
        scatter = math.sqrt(sum(change**2 for change in drawn) / len(drawn)) if drawn else 0.0
        blurred = max(
            (part * change for part, change in zip(_BLURRED, changes(widths, name), strict=False)), default=0.0
        )
        found[name] = sum(changes(thinned, name)) + math.hypot(blurred, _STUDENT.get(len(drawn), 2.0) * scatter)
    return found
