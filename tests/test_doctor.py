"""The report of `fecontact doctor` on a machine with fake probes.

It has the working and the installed packages, the remedy and the exit code.
"""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from fecontact import doctor
from fecontact.doctor import DEBIAN_PACKAGES, PROBES, Probe, find_failure, format_install_command, run_probes

# What a missing libGL does: the process ends by a signal, without an exception. No core file is left behind.
CRASH = (
    "import os, resource, signal;resource.setrlimit(resource.RLIMIT_CORE, (0, 0));os.kill(os.getpid(), signal.SIGSEGV)"
)


def probe(code: str, name: str = "probe", **fields) -> Probe:
    return Probe(name=name, code=code, **{"consequence": "nothing goes", **fields})


GOOD = probe("pass")
CRASHING = probe(CRASH)
MISSING_LIBRARY = probe("raise OSError('libGLU.so.1: cannot open shared object file')")


@pytest.fixture(autouse=True)
def bare_debian(monkeypatch):
    """Hide all packages; a test adds its packages."""
    missing = list(DEBIAN_PACKAGES)
    monkeypatch.setattr(doctor, "find_missing_debian_packages", lambda: tuple(missing))
    return missing


def test_what_works_is_a_line_each():
    assert run_probes((GOOD, replace(GOOD, name="other"))) == (["probe: works", "other: works"], False)


@pytest.mark.parametrize(("failing", "says"), [(CRASHING, "SIGSEGV"), (MISSING_LIBRARY, "libGLU.so.1")])
def test_what_is_needed_and_does_not_work_is_named_with_its_consequence_and_the_packages(failing, says):
    (first, remedy), lacks = run_probes((failing,))
    assert lacks
    assert first.startswith("probe: does not work: ")
    assert says in first
    assert first.endswith("; nothing goes")
    assert remedy.startswith(f"remedy: {format_install_command(DEBIAN_PACKAGES)}")


def test_what_is_not_needed_says_what_goes_without_it():
    lines, lacks = run_probes(
        (GOOD, replace(CRASHING, needed=False), replace(CRASHING, needed=False, remedy="pip install it"))
    )
    assert not lacks
    assert [line for line in lines if line.startswith("remedy")][1:] == ["remedy: pip install it"]


def test_the_probes_of_a_machine_say_what_goes_without_each(monkeypatch):
    gmsh, pardiso = PROBES
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "" if probe is gmsh else "gone")
    lines, lacks = run_probes()
    assert not lacks
    assert lines[0] == "gmsh: works"
    assert "multigrid is used instead, which takes 1.5 to 1.7 times as long" in lines[1]
    assert "pip install pypardiso" in lines[2]
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "gone" if probe is gmsh else "")
    assert run_probes()[1]
    assert [probe.needed for probe in (gmsh, pardiso)] == [True, False]


@pytest.fixture
def root_with_apt(monkeypatch):
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    monkeypatch.setattr(doctor.os, "geteuid", lambda: 0)
    monkeypatch.setattr(doctor.shutil, "which", lambda name: "/x/" + name)


def test_installing_repairs_a_crash(tmp_path: Path, bare_debian, root_with_apt, monkeypatch, capsys):
    library = tmp_path / "library"
    code = f"import pathlib\nif not pathlib.Path({str(library)!r}).exists(): {CRASH}"
    monkeypatch.setattr(doctor, "LIBRARIES_PROBE", probe(code))
    bare_debian[:] = ["libgl1"]
    monkeypatch.setattr(doctor, "_apt_install", lambda packages: library.write_text(" ".join(packages)) and "")
    assert doctor.main(["--before", "--install"]) == 0
    assert library.read_text() == "libgl1"
    assert capsys.readouterr().out == "Installing system libraries with apt-get: libgl1\n"


def test_an_installation_that_failed_is_said_with_the_command(root_with_apt, monkeypatch, capsys):
    monkeypatch.setattr(doctor, "LIBRARIES_PROBE", CRASHING)
    monkeypatch.setattr(doctor, "_apt_install", lambda packages: "E: no network")
    assert doctor.main(["--before", "--install"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "apt-get failed: E: no network" in lines
    assert format_install_command(DEBIAN_PACKAGES) in lines[-1]


@pytest.mark.parametrize(
    ("failing", "missing", "says"),
    [
        (CRASHING, [], "unknown; all required Debian packages are installed"),
        (probe("import no_such_module_here"), DEBIAN_PACKAGES, "make setup"),
    ],
    ids=["all packages present", "Python package missing"],
)
def test_packages_are_not_advised_where_they_cannot_help(failing, missing, says, bare_debian):
    bare_debian[:] = missing
    lines, lacks = run_probes((failing,))
    assert lacks
    assert says in lines[-1]
    assert not any("apt-get" in line for line in lines)


@pytest.mark.parametrize(("user", "apt"), [(1000, "/x/apt-get"), (0, None)])
def test_only_root_with_apt_installs(monkeypatch: pytest.MonkeyPatch, user: int, apt: str | None):
    monkeypatch.setattr(doctor.os, "geteuid", lambda: user)
    monkeypatch.setattr(doctor.shutil, "which", lambda name: apt)
    monkeypatch.setattr(doctor, "LIBRARIES_PROBE", CRASHING)
    monkeypatch.setattr(doctor, "_apt_install", pytest.fail)
    assert doctor.main(["--before", "--install"]) == 1


def test_a_reason_is_the_last_line_without_colour_codes():
    code = "import sys; sys.exit('first\\n\\x1b[33mbad X server connection\\x1b[0m\\n\\n')"
    assert find_failure(probe(code)) == "bad X server connection"


def test_a_probe_that_hangs_fails(monkeypatch):
    monkeypatch.setattr(doctor, "PROBE_SECONDS", 0.2)
    assert find_failure(probe("import time; time.sleep(60)")) == "no answer within 0.2 s"


def test_a_machine_that_has_all(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "")
    assert doctor.print_diagnosis() == 0
    lines = capsys.readouterr().out.splitlines()
    assert "gmsh: works" in lines
    assert any("scikit-fem 1" in line for line in lines)
    assert lines[-1].startswith("All requirements found")


def test_a_machine_without_a_system_library_cannot_solve(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "no libGLU.so.1" if probe.name == "gmsh" else "")
    assert doctor.print_diagnosis() == 1
    lines = capsys.readouterr().out.splitlines()
    assert "cannot solve a case yet" in lines[-1]


def test_a_machine_without_a_python_package_gets_the_command(monkeypatch, capsys):
    required = ["numpy>=2.0", "no-such-thing>=1; extra == 'x'", "nosuch>=3"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda name: required)
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "")
    assert doctor.print_diagnosis() == 1
    text = capsys.readouterr().out
    assert "missing packages: nosuch>=3" in text
    assert "-m pip install 'nosuch>=3'" in text
    assert "no-such-thing" not in text


def test_importing_the_doctor_loads_nothing_that_is_probed():
    code = "import sys, fecontact.doctor; print(sorted({'gmsh', 'pyvista', 'vtk', 'vtkmodules'} & set(sys.modules)))"
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "[]"


@pytest.mark.parametrize(("sudo", "begins"), [("/usr/bin/sudo", "sudo apt-get"), (None, "as root: apt-get")])
def test_the_remedy_asks_for_sudo_only_where_it_is(monkeypatch: pytest.MonkeyPatch, sudo: str | None, begins: str):
    monkeypatch.setattr(doctor.shutil, "which", lambda name: sudo)
    assert format_install_command(("libgl1",)).startswith(begins)


def test_libraries_are_missed_before_anything_is_downloaded(monkeypatch, capsys):
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "libGL.so.1: cannot open shared object file")
    assert doctor.main(["--before"]) == 1
    first, remedy = capsys.readouterr().out.splitlines()
    assert "libGL.so.1" in first
    assert first.endswith("nothing was downloaded")
    assert format_install_command(DEBIAN_PACKAGES) in remedy
    monkeypatch.setattr(doctor, "find_failure", lambda probe: "")
    assert doctor.main(["--before"]) == 0
    assert capsys.readouterr().out == ""


def test_the_check_before_needs_no_package():
    # -S: no site-packages; -I would not find the package itself
    root = Path(__file__).parents[1]
    code = "import sys; from fecontact.doctor import main; sys.exit(main(['--before']))"
    process = subprocess.run([sys.executable, "-S", "-c", code], capture_output=True, text=True, cwd=root)
    assert process.returncode in (0, 1)
    assert process.stderr == ""
