"""Memory that the solution of a body needs, and whether the machine has it."""

from __future__ import annotations

from fecontact.errors import NotEnoughMemory

# Bytes of a Cholesky factor of n degrees of freedom, and bytes a degree of freedom of its analysis. PARDISO itself
# counts 71 to 85 n^(4/3) (the growth of nested dissection in space) and 206 to 242 on bodies of 11 to 158 thousand.
_FACTOR_BYTES = 86.0
_ANALYSIS_BYTES = 242.0
# Part of the available memory for factors: the matrix, its assembly and the other body need the rest.
USABLE_MEMORY = 0.8


def factor_bytes(degrees_of_freedom: int) -> float:
    """Estimated memory that PARDISO needs for a body."""
    return float(_FACTOR_BYTES * degrees_of_freedom ** (4.0 / 3.0) + _ANALYSIS_BYTES * degrees_of_freedom)


def check_memory(needed_bytes: float, what: str) -> None:
    """Refuse work that needs more memory than the machine has, before the work begins.

    Raises
    ------
    NotEnoughMemory
        If more memory is needed than is available now.
    """
    import psutil

    available = float(psutil.virtual_memory().available)
    if needed_bytes > available:
        raise NotEnoughMemory(
            f"{what} needs about {needed_bytes / 1e9:.1f} GB of memory, {available / 1e9:.1f} GB are available;"
            " use a coarser resolution, the amg solver, or a larger machine"
        )
