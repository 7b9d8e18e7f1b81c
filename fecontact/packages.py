"""Python packages of the finite elements, which have no wheels for Linux on ARM."""

from __future__ import annotations

import platform
import sys
from importlib.util import find_spec

from fecontact.errors import InputError

REQUIRED_PACKAGES = ("gmsh", "pyamg")


def has_wheels() -> bool:
    """Whether the packages have wheels for this machine, as the markers in pyproject.toml state."""
    return sys.platform != "linux" or platform.machine() == "x86_64"


def find_missing_packages() -> tuple[str, ...]:
    """Packages of the finite elements that are not installed; nothing is imported.

    Returns
    -------
    tuple of str
        Names of the packages, empty if the finite elements can run.
    """
    return tuple(name for name in REQUIRED_PACKAGES if find_spec(name) is None)


def suggest_remedy() -> str:
    """Advice for this machine if a package of the finite elements is missing.

    Returns
    -------
    str
        Command to install the packages, or the commands that work without them on machines without wheels.
    """
    if has_wheels():
        return f"make setup, or pip install {' '.join(REQUIRED_PACKAGES)}"
    return (
        f"{' and '.join(REQUIRED_PACKAGES)} have no Python wheels for Linux on {platform.machine()}: solve on an x86-64"
        " machine; commands without finite elements, such as hertz, theory, place, table and judge, work here"
    )


def require_finite_elements() -> None:
    """Check before any work that the packages of the finite elements are installed.

    Raises
    ------
    InputError
        If a package is missing. The message has the names of the missing packages and the remedy.
    """
    if missing := find_missing_packages():
        verb = "is" if len(missing) == 1 else "are"
        raise InputError(
            f"finite elements need {' and '.join(missing)}, which {verb} not installed; {suggest_remedy()}"
        )
