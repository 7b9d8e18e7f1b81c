"""What the solution of a body needs of the machine's memory, and whether it is there."""

from __future__ import annotations

from fecontact.errors import NotEnoughMemory

# Bytes of a Cholesky factor of n degrees of freedom and of its analysis, from PARDISO's own count on bodies of 11 to
# 61 thousand: 145 to 163 n^(4/3), the growth of nested dissection in space, and 1.3 kB each.
_FACTOR_BYTES = 165.0
_ANALYSIS_BYTES = 1300.0
# The matrix itself, its assembly and the other body's work beside it.
USABLE_MEMORY = 0.8


def factor_bytes(degrees_of_freedom: int) -> float:
    """Memory that PARDISO needs for a body, before anything is made."""
    return float(_FACTOR_BYTES * degrees_of_freedom ** (4.0 / 3.0) + _ANALYSIS_BYTES * degrees_of_freedom)


def check_memory(needed_bytes: float, what: str) -> None:
    """Refuse what the machine cannot hold before it is begun.

    Raises
    ------
    NotEnoughMemory
        If more is needed than is available now.
    """
    import psutil

    available = float(psutil.virtual_memory().available)
    if needed_bytes > available:
        raise NotEnoughMemory(
            f"{what} needs about {needed_bytes / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available;"
            " use a coarser resolution, the amg solver, or a larger machine"
        )
