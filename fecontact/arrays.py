"""Type aliases of NumPy arrays, and searches in masks and values."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Complexes: TypeAlias = NDArray[np.complex128]
Bools: TypeAlias = NDArray[np.bool_]


def find_runs(is_selected: Bools) -> list[tuple[int, int]]:
    """First and last index of each unbroken run of true values.

    Parameters
    ----------
    is_selected : ndarray of shape (n,)
        Mask of positions.

    Returns
    -------
    list of (int, int)
        Indices of each run, both included.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.arrays import find_runs
    >>> find_runs(np.array([True, True, False, True]))
    [(0, 1), (3, 3)]
    """
    indices = np.flatnonzero(is_selected)
    if indices.size == 0:
        return []
    # np.split takes five times as long, and fast theories call this at each approach
    breaks = np.flatnonzero(indices[1:] - indices[:-1] > 1)
    firsts, lasts = (indices[0], *indices[breaks + 1]), (*indices[breaks], indices[-1])
    return [(int(first), int(last)) for first, last in zip(firsts, lasts, strict=True)]


def find_range_below(values: Floats, index: int) -> tuple[int, int]:
    """Range around a value without any larger value.

    Parameters
    ----------
    values : ndarray of shape (n,)
        Values.
    index
        Index of the value.

    Returns
    -------
    int, int
        First index of the range, and the index after its end.

    Examples
    --------
    >>> import numpy as np
    >>> from fecontact.arrays import find_range_below
    >>> find_range_below(np.array([3.0, 0.0, 2.0, 1.0, 2.0, 4.0]), 2)
    (1, 5)
    """
    larger = np.flatnonzero(values > values[index])
    next_larger = int(np.searchsorted(larger, index))
    start = int(larger[next_larger - 1]) + 1 if next_larger else 0
    stop = int(larger[next_larger]) if next_larger < larger.size else values.size
    return start, stop
