"""What a machine has for fecontact, and the remedy for what it lacks; the standard library alone, but for psutil."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Callable, Iterator
from importlib import metadata

from fecontact import __version__
from fecontact.system_check import (
    GMSH,
    RENDERING,
    Outcome,
    Probe,
    install_command,
    lacks_python_package,
    missing_packages,
    run_probe,
)

_PARDISO_CODE = """
import numpy, pypardiso, scipy.sparse
assert abs(pypardiso.spsolve(scipy.sparse.eye(3, format="csr") * 2.0, numpy.ones(3))[0] - 0.5) < 1e-12
"""
PARDISO = Probe(name="MKL PARDISO", command=(sys.executable, "-c", _PARDISO_CODE))
# What a case needs at `quick` with a patch of several lobes.
_ENOUGH_GB = 4.0


def examine(*, probe: Callable[[Probe], Outcome] = run_probe, say: Callable[[str], None] = print) -> int:
    """Say what is there and what to do; 1 if no case can be solved here, else 0."""
    say(f"fecontact {__version__}, Python {platform.python_version()} ({sys.executable})")
    say(f"{platform.platform()}, {platform.machine()}")
    fatal = False
    for line, good in (*_packages(), *_machine()):
        say(line)
        fatal = fatal or not good
    libraries, rendering, pardiso = probe(GMSH), probe(RENDERING), probe(PARDISO)
    say(f"gmsh: {'works' if libraries.ok else f'does not work: {libraries.reason}; nothing can be meshed without it'}")
    say(
        "off-screen rendering: works"
        if rendering.ok
        else f"off-screen rendering: does not work: {rendering.reason}; only three-dimensional pictures need it"
    )
    say(
        "solver: MKL PARDISO works, and multigrid takes over where its factors do not fit into memory"
        if pardiso.ok
        else "solver: multigrid, 1.5 to 1.7 times as slow as MKL PARDISO, which does not work here:"
        f" {pardiso.reason}; pip install pypardiso (x86-64 Linux and Windows)"
    )
    if any(not one.ok and not lacks_python_package(one) for one in (libraries, rendering)):
        missing = missing_packages()
        say(
            f"remedy (Debian, Ubuntu; elsewhere the packages with the same libraries): {install_command(missing)}"
            if missing
            else "the Debian packages that are known to be needed are all installed: the cause is another one"
        )
    fatal = fatal or not libraries.ok
    say("A case cannot be solved here yet; see above." if fatal else "All that is needed is here: fecontact demo")
    return int(fatal)


def _packages() -> Iterator[tuple[str, bool]]:
    found, missing = [], []
    for requirement in metadata.requires("fecontact") or []:
        name, _, marker = requirement.partition(";")
        if "extra" in marker or "platform_machine" in marker:
            # what is not needed, or not everywhere
            continue
        package = re.match(r"[\w.-]+", name)
        assert package is not None
        try:
            found.append(f"{package[0]} {metadata.version(package[0])}")
        except metadata.PackageNotFoundError:
            missing.append(name.strip())
    yield f"packages: {', '.join(found)}", True
    if missing:
        quoted = " ".join(f"'{name}'" for name in missing)
        yield f"missing packages: {', '.join(missing)}; {sys.executable} -m pip install {quoted}", False


def _machine() -> Iterator[tuple[str, bool]]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        import psutil
    except ImportError:
        return
    memory = psutil.virtual_memory()
    line = f"{cores} core{'s' * (cores != 1)}, {memory.total / 1e9:.1f} GB of memory, {memory.available / 1e9:.1f} free"
    if memory.available < _ENOUGH_GB * 1e9:
        line += "; a patch of several lobes needs 4 GB: end other programs, or use --solver amg"
    yield line, True
