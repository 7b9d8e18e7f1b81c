"""The system check with fake probes: what is reported, what is installed and which exit code follows."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from fecontact import system_check
from fecontact.system_check import PACKAGES, Outcome, Probe, check, check_before, install_command, run_probe

# What a missing libGL does: the process ends by a signal, without an exception. No core file is left behind.
CRASH = (
    "import os, resource, signal;resource.setrlimit(resource.RLIMIT_CORE, (0, 0));os.kill(os.getpid(), signal.SIGSEGV)"
)


def probe(code: str, name: str = "probe", **fields) -> Probe:
    return Probe(name=name, command=(sys.executable, "-c", code), **fields)


GOOD = probe("pass")
CRASHING = probe(CRASH)
MISSING_LIBRARY = probe("raise OSError('libGLU.so.1: cannot open shared object file')")


class Report:
    """Run `check` and keep the lines that it says and the packages that it installs."""

    def __init__(self, gmsh: Probe, rendering: Probe, *, installs: Outcome | None = None, **fields):
        self.lines: list[str] = []
        self.installed: list[Sequence[str]] = []

        def install(packages: Sequence[str]) -> Outcome:
            self.installed.append(packages)
            return installs

        self.code = check(
            gmsh=gmsh,
            rendering=rendering,
            install=install if installs is not None else None,
            say=self.lines.append,
            **fields,
        )
        self.text = "\n".join(self.lines)


def test_success_is_one_line_and_installs_nothing():
    report = Report(GOOD, GOOD, installs=Outcome(ok=True))
    assert report.code == 0
    assert len(report.lines) == 1
    assert report.installed == []


def test_crash_of_gmsh_is_fatal_and_names_signal_and_packages():
    report = Report(CRASHING, GOOD)
    assert report.code == 1
    assert "SIGSEGV" in report.text
    assert install_command(PACKAGES) in report.text
    assert "warning" not in report.text


def test_exception_in_gmsh_is_fatal_and_names_the_library():
    report = Report(MISSING_LIBRARY, GOOD)
    assert report.code == 1
    assert "libGLU.so.1" in report.text
    assert install_command(PACKAGES) in report.text


def test_crash_of_rendering_is_a_warning():
    report = Report(GOOD, CRASHING)
    assert report.code == 0
    assert "error" not in report.text
    assert "skipped" in report.text
    assert install_command(PACKAGES) in report.text


def test_install_repairs_a_crash(tmp_path: Path):
    library = tmp_path / "library"
    gmsh = probe(f"import pathlib\nif not pathlib.Path({str(library)!r}).exists(): {CRASH}")
    lines: list[str] = []

    def install(packages: Sequence[str]) -> Outcome:
        library.write_text(" ".join(packages))
        return Outcome(ok=True)

    assert check(gmsh=gmsh, rendering=GOOD, missing=("libgl1",), install=install, say=lines.append) == 0
    assert library.read_text() == "libgl1"
    assert lines[-1].startswith("System libraries:")


def test_failed_install_is_reported_with_the_command():
    report = Report(CRASHING, GOOD, installs=Outcome(ok=False, reason="E: no network"))
    assert report.code == 1
    assert report.installed == [PACKAGES]
    assert "E: no network" in report.text
    assert install_command(PACKAGES) in report.text


@pytest.mark.parametrize(
    ("gmsh", "missing"),
    [(CRASHING, ()), (probe("import no_such_module_for_this_test"), PACKAGES)],
    ids=["all packages present", "Python package missing"],
)
def test_apt_is_left_alone_where_it_cannot_help(gmsh: Probe, missing: Sequence[str]):
    report = Report(gmsh, GOOD, missing=missing, installs=Outcome(ok=True))
    assert report.code == 1
    assert report.installed == []
    assert "apt-get install" not in report.text


@pytest.mark.parametrize(
    ("user", "apt", "installs"), [(0, "/x/apt-get", True), (1000, "/x/apt-get", False), (0, None, False)]
)
def test_only_root_with_apt_installs(monkeypatch: pytest.MonkeyPatch, user: int, apt: str | None, installs: bool):
    monkeypatch.setattr(system_check.os, "geteuid", lambda: user)
    monkeypatch.setattr(system_check.shutil, "which", lambda name: apt)
    assert (system_check.apt_installer() is not None) is installs


def test_second_environment_is_the_fallback():
    code = "import os; assert os.environ.get('FECONTACT_TEST_WINDOW') == 'egl'"
    assert not run_probe(probe(code)).ok
    assert run_probe(probe(code, environments=({}, {"FECONTACT_TEST_WINDOW": "egl"}))).ok


def test_reason_is_the_last_line_without_colour_codes():
    code = "import sys; sys.exit('first\\n\\x1b[33mbad X server connection\\x1b[0m\\n\\n')"
    assert run_probe(probe(code)).reason == "bad X server connection"


def test_probe_that_hangs_fails():
    outcome = run_probe(probe("import time; time.sleep(60)"), timeout=0.2)
    assert not outcome.ok
    assert "0.2 s" in outcome.reason


def test_command_line_exits_with_1_after_a_crash(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setattr(system_check, "check", lambda **fields: check(gmsh=CRASHING, rendering=GOOD, **fields))
    monkeypatch.setattr(system_check, "missing_packages", lambda: PACKAGES)
    assert system_check.main(["--no-install"]) == 1
    assert " ".join(PACKAGES) in capsys.readouterr().out


def test_importing_the_check_loads_no_probed_library():
    code = (
        "import sys, fecontact.system_check; print(sorted({'gmsh', 'pyvista', 'vtk', 'vtkmodules'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(("sudo", "begins"), [("/usr/bin/sudo", "sudo apt-get"), (None, "as root: apt-get")])
def test_the_remedy_asks_for_sudo_only_where_it_is(monkeypatch: pytest.MonkeyPatch, sudo: str | None, begins: str):
    monkeypatch.setattr(system_check.shutil, "which", lambda name: sudo)
    assert install_command(("libgl1",)).startswith(begins)


def test_libraries_are_missed_before_anything_is_downloaded():
    lines: list[str] = []
    missing = probe("import ctypes; ctypes.CDLL('libno-such-thing.so.1')")
    assert check_before(libraries=missing, missing=("libgl1",), say=lines.append) == 1
    assert "libno-such-thing.so.1" in lines[0]
    assert "nothing was downloaded" in lines[0]
    assert install_command(("libgl1",)) in lines[1]


def test_libraries_are_installed_before_by_root(tmp_path: Path):
    library = tmp_path / "library"
    needs = probe(f"import pathlib, sys; sys.exit(not pathlib.Path({str(library)!r}).exists())")

    def install(packages: Sequence[str]) -> Outcome:
        library.write_text(" ".join(packages))
        return Outcome(ok=True)

    lines: list[str] = []
    assert check_before(libraries=needs, missing=("libgl1",), install=install, say=lines.append) == 0
    assert library.read_text() == "libgl1"


def test_the_check_before_needs_no_package():
    # -S: no site-packages; -I would not find the package itself
    root = Path(__file__).parents[1]
    code = "import sys; from fecontact.system_check import main; sys.exit(main(['--before', '--no-install']))"
    done = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, cwd=root)
    assert done.returncode in (0, 1)
    assert done.stderr == ""
