"""Where an increasing function along a chain of segments has a value: Newton steps from a table of the chain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fecontact.profiles.segments import CurvePoints, Floats, Integers

# A coordinate this little beyond an end still counts as the end (mm).
_END_SLACK_MM = 1e-9


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """Samples of a chain of segments, both ends of every segment included (so each joint is there twice)."""

    segment: Integers
    v: Floats
    points: CurvePoints

    @property
    def chords(self) -> Floats:
        """Length of each interval (mm)."""
        return np.hypot(np.diff(self.points.y), np.diff(self.points.z))

    @cached_property
    def joints(self) -> NDArray[np.bool_]:
        """Whether the interval after each sample only steps from one segment to the next."""
        return np.diff(self.segment) > 0


def inverted(
    table: Table,
    values: Floats,
    part: slice,
    t: ArrayLike,
    function: Callable[[Integers, Floats], tuple[Floats, Floats]],
) -> Floats:
    """Parameter u where an increasing function is t, NaN beyond its ends, by bracketed Newton steps.

    `values` are those of the function on the table, and only the table's `part` is searched. `function` returns the
    value and its derivative by v at the local parameters v of the segments k.
    """
    t = np.asarray(t, dtype=float)
    table_k, table_v, values = table.segment[part], table.v[part], values[part]
    inside = (t >= values[0] - _END_SLACK_MM) & (t <= values[-1] + _END_SLACK_MM)
    target = np.clip(t[inside], values[0], values[-1])

    # rounded data may step back by a hair at a joint
    j = np.searchsorted(np.maximum.accumulate(values), target, side="right") - 1
    j = np.clip(j, 0, values.size - 2)
    k, high = table_k[j + 1], table_v[j + 1]
    low = np.where(k == table_k[j], table_v[j], high)
    rise = values[j + 1] - values[j]
    v = low + (high - low) * np.clip((target - values[j]) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)

    active = np.flatnonzero(high > low)
    for _ in range(60):
        if not active.size:
            break
        v_old = v[active]
        value, rate = function(k[active], v_old)
        residual = target[active] - value
        low[active] = np.where(residual >= 0.0, v_old, low[active])
        high[active] = np.where(residual <= 0.0, v_old, high[active])
        with np.errstate(divide="ignore", invalid="ignore"):
            v_new = v_old + residual / rate
        trapped = (v_new >= low[active]) & (v_new <= high[active])
        v_new = np.where(trapped, v_new, 0.5 * (low[active] + high[active]))
        v[active] = v_new
        # Newton steps converge quadratically: after one of this size the next would be lost in rounding
        active = active[np.abs(v_new - v_old) > 1e-11]
    u = np.full(t.shape, np.nan)
    u[inside] = k + v
    return u
