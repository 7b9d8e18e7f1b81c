"""Packages that only fleets need: pyarrow and DuckDB."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from fecontact.errors import InputError, MemoryShortageError, is_memory_shortage


def import_arrow(module: str) -> Any:
    """Import a module of pyarrow.

    Parameters
    ----------
    module
        Name below `pyarrow`.

    Returns
    -------
    module
        The imported module.

    Raises
    ------
    InputError
        If pyarrow is not installed, or cannot be loaded.
    """
    return _import_package(f"pyarrow.{module}")


def import_parquet() -> Any:
    """Import the reader and writer of Parquet files; raises InputError as `import_arrow` does."""
    return import_arrow("parquet")


def import_duckdb() -> Any:
    """Import DuckDB; raises InputError as `import_arrow` does."""
    return _import_package("duckdb")


def _import_package(name: str) -> Any:
    """Import a package or a module of it.

    Raises
    ------
    InputError
        If it is not installed, or cannot be loaded.
    MemoryShortageError
        If the memory does not suffice to load it.
    """
    package = name.partition(".")[0]
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in ("", package):
            raise InputError(
                f"fleets need the package {package}; install it: pip install 'fecontact[fleet]'"
            ) from error
        raise InputError(f"the package {package} cannot be loaded ({error}); install it again") from error
    except (ImportError, MemoryError) as error:
        reason = " ".join(str(error).split()) or "out of memory"
        if is_memory_shortage(error):
            raise MemoryShortageError(
                f"not enough memory to load the package {package} ({reason}); close other programs, use fewer"
                " --workers, or raise the limit with ulimit -v"
            ) from error
        raise InputError(f"the package {package} cannot be loaded ({reason}); install it again") from error
