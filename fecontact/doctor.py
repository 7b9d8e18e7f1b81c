"""What a machine has for fecontact, what does not go without it, and the remedy; the standard library and psutil alone.

No wheel carries libGL and its relatives, and a missing one can end the process with a signal instead of an exception:
each probe runs in a process of its own.

`python -m fecontact.doctor` is what `fecontact doctor` prints; with `--install` root gets the missing system libraries.
With `--before` no package need be installed yet: it looks for the libraries that gmsh is linked to, so that nobody
downloads all packages in vain.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata

from fecontact import __version__

#: Debian and Ubuntu packages; the names are the same in both.
PACKAGES = ("libglu1-mesa", "libgl1", "libegl1", "libxcursor1", "libxft2", "libxinerama1", "libgomp1")
PROBE_SECONDS = 120.0
# What a case needs at `quick` with a patch of several lobes.
_ENOUGH_GB = 4.0


@dataclass(frozen=True, kw_only=True)
class Probe:
    """A Python program that succeeds only where something works, in one of some environments.

    Attributes
    ----------
    consequence
        What does not go where it fails.
    remedy
        What to do then; empty where Debian packages may be missing.
    needed
        Whether no case can be solved without it.
    """

    name: str
    code: str
    consequence: str
    remedy: str = ""
    needed: bool = True
    environments: tuple[Mapping[str, str], ...] = field(default=({},), hash=False)


# What gmsh's wheel is linked to beyond a minimal Debian.
BEFORE = Probe(
    name="system libraries of gmsh",
    code="""
import ctypes
for name in ("GLU.so.1", "GL.so.1", "Xcursor.so.1", "Xft.so.2", "Xinerama.so.1", "gomp.so.1"):
    ctypes.CDLL("lib" + name)
""",
    consequence="nothing was downloaded",
)
PROBES = (
    Probe(
        name="gmsh",
        code="import gmsh; gmsh.initialize(readConfigFiles=False, interruptible=False); gmsh.finalize()",
        consequence="nothing can be meshed without it",
    ),
    # an image of one colour means that nothing was drawn
    Probe(
        name="off-screen rendering",
        code="""
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(None, return_img=True)
plotter.close()
assert image.min() < image.max(), "the off-screen image is empty"
""",
        consequence="three-dimensional pictures are left out; numbers, reports and VTK files do not need it",
        needed=False,
        environments=({}, {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}),
    ),
    Probe(
        name="MKL PARDISO",
        code="""
import numpy, pypardiso, scipy.sparse
assert abs(pypardiso.spsolve(scipy.sparse.eye(3, format="csr") * 2.0, numpy.ones(3))[0] - 0.5) < 1e-12
""",
        consequence="multigrid solves, 1.5 to 1.7 times as slow",
        remedy="pip install pypardiso (x86-64 Linux and Windows)",
        needed=False,
    ),
)

Try = Callable[[Probe], str]
Install = Callable[[Sequence[str]], str]


def examine(
    probes: Sequence[Probe] = PROBES,
    *,
    attempt: Try | None = None,
    install: Install | None = None,
    say: Callable[[str], None] = print,
) -> int:
    """Say what works, what does not go without the rest and what to do, after the `install` of what may help if given.

    Returns
    -------
    int
        1 if something does not work that is needed, else 0.
    """
    attempt = attempt or failure
    failures = {probe: attempt(probe) for probe in probes}
    missing = missing_packages() if any(_may_lack_packages(*one) for one in failures.items()) else ()
    if missing and install is not None:
        say(f"Installing system libraries with apt-get: {' '.join(missing)}")
        if refused := install(missing):
            say(f"apt-get failed: {refused}")
        failures = {probe: attempt(probe) for probe in probes}
        missing = missing_packages()
    for probe, reason in failures.items():
        say(f"{probe.name}: {f'does not work: {reason}; {probe.consequence}' if reason else 'works'}")
    for remedy in dict.fromkeys(_remedy(probe, reason, missing) for probe, reason in failures.items() if reason):
        say(f"remedy: {remedy}")
    return int(any(reason and probe.needed for probe, reason in failures.items()))


def _remedy(probe: Probe, reason: str, missing: Sequence[str]) -> str:
    if probe.remedy:
        return probe.remedy
    if not _may_lack_packages(probe, reason):
        return "a Python package is missing from this environment: make setup, or pip install fecontact"
    if not missing:
        return "the Debian packages that are known to be needed are all installed: the cause is another one"
    return f"{install_command(missing)} (Debian, Ubuntu; elsewhere the packages with the same libraries)"


def _may_lack_packages(probe: Probe, reason: str) -> bool:
    return bool(reason) and not probe.remedy and not reason.startswith("ModuleNotFoundError")


def doctor(*, install: bool = False, say: Callable[[str], None] = print) -> int:
    """Say what this machine has for fecontact; 1 if no case can be solved here, else 0."""
    say(f"fecontact {__version__}, Python {platform.python_version()} ({sys.executable})")
    say(f"{platform.platform()}, {platform.machine()}")
    lacks = False
    for line, good in (*_packages(), *_machine()):
        say(line)
        lacks = lacks or not good
    lacks = bool(examine(install=_apt_install if install and _can_install() else None, say=say)) or lacks
    say("A case cannot be solved here yet; see above." if lacks else "All that is needed is here: fecontact demo")
    return int(lacks)


def _packages() -> Iterator[tuple[str, bool]]:
    found, missing = [], []
    try:
        required = metadata.requires("fecontact") or []
    except metadata.PackageNotFoundError:
        # set-up is not at its end yet
        return
    for requirement in required:
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


def failure(probe: Probe, *, seconds: float = PROBE_SECONDS) -> str:
    """Why a probe fails in the first of its environments, in one line; nothing if it succeeds in one of them."""
    reasons = []
    for environment in probe.environments:
        reason = _run([sys.executable, "-c", probe.code], environment, seconds)
        if not reason:
            return ""
        reasons.append(reason)
    return reasons[0]


def _run(command: Sequence[str], extra: Mapping[str, str], seconds: float | None) -> str:
    """Why a program fails, or nothing."""
    # In an empty directory: a core file lands nowhere that matters, and nothing there shadows an import.
    with tempfile.TemporaryDirectory(prefix="fecontact-") as directory:
        try:
            done = subprocess.run(
                command,
                cwd=directory,
                env={**os.environ, **extra},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"no answer within {seconds:g} s"
    if done.returncode < 0:
        # the last words of VTK before a crash recommend a library that is not the cause: not passed on
        return f"the process was ended by {_signal_name(-done.returncode)}"
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", done.stderr).splitlines() if line.strip()]
    return (lines[-1] if lines else f"exit code {done.returncode}") if done.returncode else ""


def _signal_name(number: int) -> str:
    return signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"


def missing_packages(packages: Sequence[str] = PACKAGES) -> tuple[str, ...]:
    """Those of some Debian packages that dpkg does not list as installed: all of them where there is no dpkg."""
    if not shutil.which("dpkg-query"):
        return tuple(packages)
    query = ("dpkg-query", "-W", "-f", "${Package} ${db:Status-Status}\n", *packages)
    listed = subprocess.run(query, capture_output=True, text=True, check=False).stdout
    present = {line.split()[0] for line in listed.splitlines() if line.endswith(" installed")}
    return tuple(name for name in packages if name not in present)


def install_command(packages: Sequence[str]) -> str:
    """The shell command that installs Debian packages, for root where there is no sudo."""
    sudo = "sudo " if shutil.which("sudo") else ""
    names = shlex.join(packages)
    command = f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {names}"
    return command if sudo else f"as root: {command}"


def _can_install() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get") is not None


def _apt_install(packages: Sequence[str]) -> str:
    # A fresh machine often runs its own upgrade in the first minutes: wait for the lock instead of failing.
    apt = ("apt-get", "-q", "-o", "DPkg::Lock::Timeout=300")
    quiet = {"DEBIAN_FRONTEND": "noninteractive"}
    # A failed update may still leave usable lists: only the install decides.
    _run([*apt, "update"], quiet, None)
    return _run([*apt, "install", "-y", "--no-install-recommends", *packages], quiet, None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Examine the machine from the command line and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m fecontact.doctor", description=__doc__)
    parser.add_argument("--install", action="store_true", help="as root, install the system libraries that are missing")
    parser.add_argument("--before", action="store_true", help="before the Python packages are installed; Linux only")
    options = parser.parse_args(arguments)
    if not options.before:
        return doctor(install=options.install)
    if not sys.platform.startswith("linux"):
        return 0
    said: list[str] = []
    lacks = examine((BEFORE,), install=_apt_install if options.install and _can_install() else None, say=said.append)
    if lacks or len(said) > 1:
        print("\n".join(said))
    return lacks


if __name__ == "__main__":
    sys.exit(main())
