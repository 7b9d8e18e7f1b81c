"""Check that the system libraries behind gmsh and pyvista are there, and install or name the missing ones.

No wheel carries libGL and its relatives, and a missing one can end the process with a signal instead of an exception.
Each probe therefore runs in a process of its own, and this module imports the standard library only.

Run it as ``python -m fecontact.system_check``. Exit code 1 means that gmsh does not work. Rendering that does not
work is a warning: only the pictures made by pyvista depend on it. With ``--before`` no package need be installed yet:
it looks for the libraries that gmsh is linked to, so that nobody downloads all packages in vain.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

#: Debian and Ubuntu packages; the names are the same in both.
PACKAGES = ("libglu1-mesa", "libgl1", "libegl1", "libxcursor1", "libxft2", "libxinerama1", "libgomp1")

PROBE_SECONDS = 120.0

_GMSH_CODE = """
import gmsh
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.finalize()
"""

# An image of one colour means that nothing was drawn.
_RENDERING_CODE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(None, return_img=True)
plotter.close()
assert image.min() < image.max(), "the off-screen image is empty"
"""


#: What gmsh's wheel is linked to beyond a minimal Debian.
_LIBRARIES = ("libGLU.so.1", "libGL.so.1", "libXcursor.so.1", "libXft.so.2", "libXinerama.so.1", "libgomp.so.1")
_LIBRARIES_CODE = f"""
import ctypes
for name in {_LIBRARIES}:
    ctypes.CDLL(name)
"""


@dataclass(frozen=True, kw_only=True)
class Probe:
    """A command that succeeds only where a library works, tried in each of `environments` until one succeeds."""

    name: str
    command: tuple[str, ...]
    environments: tuple[Mapping[str, str], ...] = field(default=({},))


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a probe showed; `reason` is one line and empty on success."""

    ok: bool
    reason: str = ""


GMSH = Probe(name="gmsh", command=(sys.executable, "-c", _GMSH_CODE))
RENDERING = Probe(
    name="off-screen rendering",
    command=(sys.executable, "-c", _RENDERING_CODE),
    environments=({}, {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}),
)

LIBRARIES = Probe(name="the system libraries of gmsh", command=(sys.executable, "-c", _LIBRARIES_CODE))

Installer = Callable[[Sequence[str]], Outcome]


def run_probe(probe: Probe, *, timeout: float = PROBE_SECONDS) -> Outcome:
    """Run `probe` in a process of its own, at most `timeout` seconds for each environment.

    Returns
    -------
    Outcome
        Success, or the reason of the first failure.
    """
    failures: list[Outcome] = []
    for environment in probe.environments:
        outcome = _run_once(probe.command, environment, timeout)
        if outcome.ok:
            return outcome
        failures.append(outcome)
    return failures[0]


def install_command(packages: Sequence[str]) -> str:
    """Return the shell command that installs `packages`, for root where there is no sudo."""
    sudo = "sudo " if shutil.which("sudo") else ""
    names = shlex.join(packages)
    command = f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {names}"
    return command if sudo else f"as root: {command}"


def apt_installer() -> Installer | None:
    """Return a function that installs packages, or None if this user or this system has no way to."""
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    return _apt_install if is_root and shutil.which("apt-get") else None


def missing_packages(packages: Sequence[str] = PACKAGES) -> tuple[str, ...]:
    """Return those of `packages` that dpkg does not list as installed: all of them where there is no dpkg."""
    if not shutil.which("dpkg-query"):
        return tuple(packages)
    query = ("dpkg-query", "-W", "-f", "${Package} ${db:Status-Status}\n", *packages)
    listed = subprocess.run(query, capture_output=True, text=True, check=False).stdout
    present = {line.split()[0] for line in listed.splitlines() if line.endswith(" installed")}
    return tuple(name for name in packages if name not in present)


def check(
    *,
    gmsh: Probe = GMSH,
    rendering: Probe = RENDERING,
    missing: Sequence[str] = PACKAGES,
    install: Installer | None = None,
    say: Callable[[str], None] = print,
) -> int:
    """Run both probes, install the `missing` packages if `install` is given, and report through `say`.

    Returns
    -------
    int
        0 if gmsh works, else 1. A failure of `rendering` alone is reported and returns 0.
    """
    results = (run_probe(gmsh), run_probe(rendering))
    remedies: list[str] = []
    if install is not None and missing and any(_packages_may_help(result) for result in results):
        failure = _install(missing, install, say)
        results = (run_probe(gmsh), run_probe(rendering))
        if failure:
            remedies.append(failure)
        else:
            missing = ()

    gmsh_result, rendering_result = results
    if gmsh_result.ok and rendering_result.ok:
        say(f"System libraries: {gmsh.name} and {rendering.name} work.")
        return 0
    if not gmsh_result.ok:
        say(f"error: {gmsh.name} does not work: {gmsh_result.reason}")
    if not rendering_result.ok:
        say(f"warning: {rendering.name} does not work: {rendering_result.reason}")
        remedies.insert(0, "Pictures made by pyvista are skipped; numbers, reports and VTK files do not need it.")
    if any(_packages_may_help(result) for result in results):
        remedies.append(_packages_remedy(missing))
    if any(lacks_python_package(result) for result in results):
        remedies.append("A Python package is missing from this environment: run `make setup`.")
    for remedy in remedies:
        say(f"  {remedy}")
    return 0 if gmsh_result.ok else 1


def check_before(
    *,
    libraries: Probe = LIBRARIES,
    missing: Sequence[str] = PACKAGES,
    install: Installer | None = None,
    say: Callable[[str], None] = print,
) -> int:
    """Look for gmsh's libraries before gmsh is there, and install the `missing` packages if `install` is given.

    Returns
    -------
    int
        0 if they are there, or the system is none on which that can be said, else 1.
    """
    found = run_probe(libraries)
    if not found.ok and install is not None and missing:
        failure = _install(missing, install, say)
        found = run_probe(libraries)
        if failure:
            say(f"  {failure}")
    if found.ok:
        return 0
    say(f"error: {libraries.name} are not all there: {found.reason}; nothing was downloaded")
    say(f"  {_packages_remedy(missing)}")
    return 1


def _install(missing: Sequence[str], install: Installer, say: Callable[[str], None]) -> str:
    """Say what is installed, and install it; why that failed, or nothing."""
    say("Installing system libraries with apt-get: " + " ".join(missing))
    outcome = install(missing)
    return "" if outcome.ok else f"apt-get failed: {outcome.reason}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the check from the command line and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m fecontact.system_check",
        description="Check the system libraries behind gmsh and pyvista; as root, install the missing ones.",
    )
    parser.add_argument("--no-install", action="store_true", help="report only, even as root")
    parser.add_argument("--before", action="store_true", help="before the Python packages are installed; Linux only")
    options = parser.parse_args(arguments)
    if options.before:
        if not sys.platform.startswith("linux"):
            return 0
        return check_before(missing=missing_packages(), install=None if options.no_install else apt_installer())
    return check(missing=missing_packages(), install=None if options.no_install else apt_installer())


def _run_once(command: Sequence[str], extra: Mapping[str, str], timeout: float) -> Outcome:
    # In an empty directory: a core file lands nowhere that matters, and nothing there shadows an import.
    with tempfile.TemporaryDirectory(prefix="fecontact-check-") as directory:
        try:
            done = subprocess.run(
                command,
                cwd=directory,
                env={**os.environ, **extra},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=timeout,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Outcome(ok=False, reason=f"no answer within {timeout:g} s")
    if done.returncode == 0:
        return Outcome(ok=True)
    if done.returncode < 0:
        # The last words of VTK before a crash recommend a library that is not the cause: not passed on.
        return Outcome(ok=False, reason=f"the process was ended by {_signal_name(-done.returncode)}")
    return Outcome(ok=False, reason=_last_line(done.stderr) or f"exit code {done.returncode}")


def lacks_python_package(outcome: Outcome) -> bool:
    """Whether a probe failed because a Python package is not installed."""
    return outcome.reason.startswith("ModuleNotFoundError")


def _packages_may_help(outcome: Outcome) -> bool:
    return not outcome.ok and not lacks_python_package(outcome)


def _packages_remedy(missing: Sequence[str]) -> str:
    if not missing:
        return "All Debian packages it is known to need are installed: the cause is another one."
    return f"Install (Debian, Ubuntu; elsewhere the packages with the same libraries): {install_command(missing)}"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _last_line(text: str) -> str:
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    lines = [line.strip() for line in plain.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def _apt_install(packages: Sequence[str]) -> Outcome:
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    # A fresh machine often runs its own upgrade in the first minutes: wait for the lock instead of failing.
    wait = ("-o", "DPkg::Lock::Timeout=300")
    outcome = Outcome(ok=True)
    for step in (("update",), ("install", "-y", "--no-install-recommends", *packages)):
        done = subprocess.run(
            ("apt-get", "-q", *wait, *step),
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        # A failed update may still leave usable lists: only the install decides.
        outcome = Outcome(ok=done.returncode == 0, reason="" if done.returncode == 0 else _last_line(done.stderr))
    return outcome


if __name__ == "__main__":
    sys.exit(main())
