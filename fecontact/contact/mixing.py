"""Mixing of the last solutions of a fixed-point iteration (Anderson 1965; Walker and Ni 2011)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def mixture(solved: Sequence[Floats], changes: Sequence[Floats]) -> Floats:
    """The combination (n,) of solutions whose changes cancel best; the solution itself where there is only one.

    Parameters
    ----------
    solved, changes
        What each step of the iteration gave (n,), and its weighted difference from what went in (n,), the last at the
        end.
    """
    if len(solved) == 1:
        return solved[0]
    columns = np.stack([changes[-1] - change for change in changes[:-1]], axis=1)
    part, *_ = np.linalg.lstsq(columns, changes[-1], rcond=1e-10)
    return np.asarray(solved[-1] - sum(t * (solved[-1] - q) for t, q in zip(part, solved[:-1], strict=True)))
