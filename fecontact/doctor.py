"""Check of a machine for fecontact: components that work, components that do not, and remedies.

No wheel contains libGL and related libraries, and a missing library can end the process with a signal instead of an
exception. So each probe runs in a separate process.

The check uses the standard library and psutil only.

`python -m fecontact.doctor` prints the same as `fecontact doctor`. `--before` needs no installed package: it checks the
libraries that gmsh is linked to before you download all packages. With `--install`, as root, it also installs missing
libraries.
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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata

from fecontact import __version__, packages
from fecontact.process import count_cores

# : Debian and Ubuntu packages; both distributions use these names.
DEBIAN_PACKAGES = ("libglu1-mesa", "libgl1", "libegl1", "libxcursor1", "libxft2", "libxinerama1", "libgomp1")
PROBE_SECONDS = 120.0
# Memory of a case at `quick` whose patch has several lobes.
_LOBED_CASE_GB = 4.0


@dataclass(frozen=True, kw_only=True)
class Probe:
    """Python program that succeeds only if a component works on this machine.

    Attributes
    ----------
    name
        Name of the component.
    code
        Python code of the program.
    consequence
        Consequence of a failed probe.
    remedy
        Remedy for a failed probe; empty if Debian packages may be missing.
    needed
        Whether no case can be solved without the component.
    """

    name: str
    code: str
    consequence: str
    remedy: str = ""
    needed: bool = True


# Libraries that gmsh's wheel is linked to and that a minimal Debian lacks.
LIBRARIES_PROBE = Probe(
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
        consequence="no body can be meshed without it",
    ),
    Probe(
        name="MKL PARDISO",
        code="""
import numpy, pypardiso, scipy.sparse
assert abs(pypardiso.spsolve(scipy.sparse.eye(3, format="csr") * 2.0, numpy.ones(3))[0] - 0.5) < 1e-12
""",
        consequence="multigrid is used instead, which takes 1.5 to 1.7 times as long",
        remedy="pip install pypardiso (x86-64 Linux and Windows)",
        needed=False,
    ),
)


def run_probes(probes: Sequence[Probe] = PROBES) -> tuple[list[str], bool]:
    """Run probes and describe their results.

    Parameters
    ----------
    probes
        Probes to run.

    Returns
    -------
    list of str
        Lines on working components, failing components and remedies.
    bool
        Whether an essential component fails.
    """
    failures = {probe: reason for probe in probes if (reason := find_failure(probe))}
    lines = [
        f"{probe.name}: does not work: {failures[probe]}; {probe.consequence}"
        if probe in failures
        else f"{probe.name}: works"
        for probe in probes
    ]
    missing = find_missing_debian_packages() if failures else ()
    remedies = dict.fromkeys(_find_remedy(probe, reason, missing) for probe, reason in failures.items())
    return [*lines, *(f"remedy: {remedy}" for remedy in remedies)], any(probe.needed for probe in failures)


def _find_remedy(probe: Probe, reason: str, missing: Sequence[str]) -> str:
    """Remedy for a failed probe, from its reason and the missing Debian packages."""
    if probe.remedy:
        return probe.remedy
    if reason.startswith("ModuleNotFoundError"):
        return f"a Python package is missing from this environment: {packages.suggest_remedy()}"
    if not missing:
        return "unknown; all required Debian packages are installed"
    return f"{format_install_command(missing)} (Debian, Ubuntu; on other systems, packages with the same libraries)"


def print_diagnosis() -> int:
    """Print the state of this machine.

    Returns
    -------
    int
        Exit code: 1 if no case can be solved here, else 0.
    """
    print(f"fecontact {__version__}, Python {platform.python_version()} ({sys.executable})")
    print(f"{platform.platform()}, {platform.machine()}")
    installed, incomplete = _describe_packages()
    for line in (*installed, *_describe_machine()):
        print(line)
    if not packages.has_wheels() and packages.find_missing_packages():
        print(packages.suggest_remedy())
        return 1
    lines, is_unusable = run_probes()
    print("\n".join(lines))
    is_incomplete = incomplete or is_unusable
    print(
        "This machine cannot solve a case yet; follow the remedies above."
        if is_incomplete
        else "All requirements found. Try: fecontact demo"
    )
    return int(is_incomplete)


def check_before_install(*, install: bool) -> int:
    """Check the libraries of gmsh, and install missing libraries as root on request.

    Parameters
    ----------
    install
        Whether missing libraries are installed.

    Returns
    -------
    int
        Exit code: 1 if libraries are missing, else 0.
    """
    if not sys.platform.startswith("linux") or not packages.has_wheels():
        return 0
    lines, is_incomplete = run_probes((LIBRARIES_PROBE,))
    if is_incomplete and install and _can_install() and (missing := find_missing_debian_packages()):
        print(f"Installing system libraries with apt-get: {' '.join(missing)}")
        if reason := _apt_install(missing):
            print(f"apt-get failed: {reason}")
        lines, is_incomplete = run_probes((LIBRARIES_PROBE,))
    if is_incomplete:
        print("\n".join(lines))
    return int(is_incomplete)


def _describe_packages() -> tuple[list[str], bool]:
    """Lines on the required Python packages, and whether packages are missing."""
    try:
        required = metadata.requires("fecontact") or []
    except metadata.PackageNotFoundError:
        # fecontact itself is not installed yet.
        return [], False
    installed, missing = [], []
    for requirement, package in _find_requirements(required):
        try:
            installed.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            missing.append(requirement)
    lines = [f"packages: {', '.join(installed)}"]
    if missing:
        lines.append(f"missing packages: {', '.join(missing)}; {sys.executable} -m pip install {shlex.join(missing)}")
    return lines, bool(missing)


def _find_requirements(required: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Requirements of this machine without their markers, and the names of their packages.

    Requirements of extras and MKL are left out. On a machine without wheels of gmsh and pyamg, these are left out too.
    """
    for line in required:
        requirement, _, marker = (text.strip() for text in line.partition(";"))
        package = re.split(r"[^\w.-]", requirement)[0]
        is_needed_for_elements = package in packages.REQUIRED_PACKAGES and packages.has_wheels()
        if is_needed_for_elements or not re.search("extra|platform_machine", marker):
            yield requirement, package


def _describe_machine() -> list[str]:
    """Line on the cores and the memory of this machine; empty without psutil."""
    cores = count_cores()
    try:
        import psutil
    except ImportError:
        return []
    memory = psutil.virtual_memory()
    line = (
        f"{cores} core{'s' * (cores != 1)}, {memory.total / 1e9:.1f} GB of memory, {memory.available / 1e9:.1f} GB free"
    )
    if memory.available < _LOBED_CASE_GB * 1e9:
        line += "; a patch with several lobes needs 4 GB: close other programs, or use --solver amg"
    return [line]


def find_failure(probe: Probe) -> str:
    """Reason why a probe fails, in a single line; empty if the probe succeeds."""
    return _run_program([sys.executable, "-c", probe.code], PROBE_SECONDS)


def _run_program(command: Sequence[str], seconds: float | None) -> str:
    """Reason why a program fails; empty if the program succeeds.

    Parameters
    ----------
    command
        Program with its arguments.
    seconds
        Time limit in s; None without a limit.
    """
    # The program runs in an empty directory: a core file does no harm there, and no file there shadows an import.
    with tempfile.TemporaryDirectory(prefix="fecontact-") as directory:
        try:
            process = subprocess.run(
                command,
                cwd=directory,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"no answer within {seconds:g} s"
    if process.returncode < 0:
        # VTK's last output before a crash recommends a library that is not the cause, so the output is not reported.
        return f"the process was ended by {_signal_name(-process.returncode)}"
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", process.stderr).splitlines() if line.strip()]
    return (lines[-1] if lines else f"exit code {process.returncode}") if process.returncode else ""


def _signal_name(number: int) -> str:
    return signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"


def find_missing_debian_packages() -> tuple[str, ...]:
    """Debian packages that dpkg does not list as installed; all packages without dpkg.

    Returns
    -------
    tuple of str
        Names of the missing packages out of `DEBIAN_PACKAGES`.
    """
    if not shutil.which("dpkg-query"):
        return DEBIAN_PACKAGES
    query = ("dpkg-query", "-W", "-f", "${Package} ${db:Status-Status}\n", *DEBIAN_PACKAGES)
    listed = subprocess.run(query, capture_output=True, text=True, check=False).stdout
    installed = {line.split()[0] for line in listed.splitlines() if line.endswith(" installed")}
    return tuple(name for name in DEBIAN_PACKAGES if name not in installed)


def format_install_command(packages: Sequence[str]) -> str:
    """Shell command that installs Debian packages; without sudo, a command for root.

    Parameters
    ----------
    packages
        Names of the packages.

    Returns
    -------
    str
        Command.
    """
    sudo = "sudo " if shutil.which("sudo") else ""
    names = shlex.join(packages)
    command = f"{sudo}apt-get update && {sudo}apt-get install -y --no-install-recommends {names}"
    return command if sudo else f"as root: {command}"


def _can_install() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("apt-get") is not None


def _apt_install(packages: Sequence[str]) -> str:
    """Install Debian packages as root; the reason of a failure, or an empty text."""
    # A fresh machine often runs its upgrade in the first minutes: apt-get waits for the lock instead of failing.
    apt = ("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-q", "-o", "DPkg::Lock::Timeout=300")
    # A failed update may still leave usable lists, so only the result of the installation counts.
    _run_program([*apt, "update"], None)
    return _run_program([*apt, "install", "-y", "--no-install-recommends", *packages], None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Examine the machine from the command line.

    Parameters
    ----------
    arguments
        Arguments of the command line; None for those of the process.

    Returns
    -------
    int
        Exit code.
    """
    parser = argparse.ArgumentParser(prog="python -m fecontact.doctor", description=__doc__)
    parser.add_argument(
        "--before",
        action="store_true",
        help="check the system libraries before the Python packages are installed (Linux only)",
    )
    parser.add_argument("--install", action="store_true", help="with --before, as root: install missing libraries")
    options = parser.parse_args(arguments)
    return check_before_install(install=options.install) if options.before else print_diagnosis()


if __name__ == "__main__":
    sys.exit(main())
