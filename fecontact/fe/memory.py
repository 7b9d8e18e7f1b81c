"""Memory needed by the solution of a body, and the memory of the machine."""

from __future__ import annotations

from fecontact.errors import MemoryShortageError

# Bytes of a Cholesky factor are this coefficient times n^(4/3) for n degrees of freedom (the growth of nested
# dissection in space), and its analysis needs these bytes per degree of freedom. PARDISO itself counts coefficients of
# 71 to 85 and 206 to 242 bytes on bodies of 11 to 158 thousand degrees of freedom.
_FACTOR_COEFFICIENT_BYTES = 86.0
_ANALYSIS_BYTES_PER_UNKNOWN = 242.0
# Fraction of the available memory for factors. The matrix, its assembly and the other body need the rest.
USABLE_MEMORY = 0.8


def factor_bytes(degrees_of_freedom: int) -> float:
    """Estimate the memory that PARDISO needs for a body, in bytes.

    Parameters
    ----------
    degrees_of_freedom
        Unknowns of the body.

    Returns
    -------
    float
        Memory in bytes.
    """
    return float(
        _FACTOR_COEFFICIENT_BYTES * degrees_of_freedom ** (4.0 / 3.0) + _ANALYSIS_BYTES_PER_UNKNOWN * degrees_of_freedom
    )


def check_memory(needed_bytes: float, what: str) -> None:
    """Refuse work that needs more memory than the machine has, before the work begins.

    Parameters
    ----------
    needed_bytes
        Memory that the work needs, in bytes.
    what
        The work, as the subject of the message.

    Raises
    ------
    MemoryShortageError
        If the work needs more memory than is available now.
    """
    import psutil

    available = float(psutil.virtual_memory().available)
    if needed_bytes > available:
        raise MemoryShortageError(
            f"{what} needs about {needed_bytes / 1e9:.1f} GB of memory; {available / 1e9:.1f} GB are available;"
            " use a coarser resolution, the amg solver, or a machine with more memory"
        )
