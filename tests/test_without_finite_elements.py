"""Machines such as Linux on ARM, where pip installs no gmsh, pyamg or MKL.

Tested: the commands that work there, and the commands that refuse.
"""

import json
import os
import platform
import re
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

import fecontact
from fecontact import Case, doctor, packages
from fecontact.cli import app, call
from fecontact.errors import InputError

ROOT = Path(__file__).parents[1]
ABSENT = ("gmsh", "pyamg", "pypardiso", "mkl")
PAIR = "--rail circle:300 --wheel cylinder:460 --inclination none"
ROUGH = "--resolution 2,1.8 --refine never"
CASE = """[[case]]
rail = "circle:300"
wheel = "cylinder:460"
inclination = "none"
resolution = "2,1.8"
refine = "never"
"""
THEORIES = ("hertz", "hertz_gauge", "multi_hertz", "equivalent_ellipse", "kik_piotrowski", "kpec", "stripes", "analyn")

# What is run without finite elements, in a folder with results that another machine has solved.
WORKS = (
    "--version",
    "guide setup",
    "init study",
    "check study/cases.toml",
    "profiles 60E1 --out profile.png",
    "place --shift 3 --out place.png",
    "hertz --shift 3",
    "geometry --shifts 0:2:1 --out geometry.csv",
    "theories",
    "keys",
    *(f"theory {name} {PAIR}" for name in (*THEORIES, "strip", "half_space")),
    "table --shifts 3 --loads-kn 100 --out table.csv",
    f"table {PAIR} --shifts 0 --loads-kn 100 --map solved/map",
    "creep --a-mm 5 --b-mm 4 --normal-force-kn 60 --friction 0.3 --xi 0.001",
    "irregular --irregularity sine:wavelength_mm=60,amplitude_um=10 --positions-mm 0 --workers 1",
    "curve --vehicle wheelset --radii 1000",
    "fleet examples fleet --wheels 1 --rails 1",
    "fleet check fleet/fleet.toml",
    "fleet run fleet/fleet.toml --out screened --workers 1",
    "judge solved/study --p-max-percent 1 --out judged",
    "judge solved/study --friction 0.3",
    "judge solved/map --measure theory --out judged_map",
    "compare solved/study solved/study --out compared",
    "compare solved/map judged_map",
    "view solved/study",
    "baseline update solved/study --baselines baselines --reason first",
)
REFUSES = (
    "demo",
    "solve --shift 3",
    "solve --shift 3 --out refused/case",
    "run study/cases.toml --out refused/study",
    "run study/study.py --out refused/study",
    "map --shifts 0 --loads-kn 100 --out refused/map",
    "mesh rail --out refused.inp",
    "mesh both --out refused.inp",
    "validate study/study.py --out refused/validate",
    "fleet sample screened --finite-elements 2",
)
# It looks at the machine, and the test of it is below; reports need a sample by finite elements.
OTHERS = {"doctor", "fleet report"}
RUNNER = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from fecontact.cli import call

if __name__ == "__main__":
    answers = {}
    for command in json.load(sys.stdin):
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = call(command.split())
        answers[command] = [code, out.getvalue(), err.getvalue()]
    json.dump(answers, sys.stdout)
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> Path:
    """The Python of an environment without the packages of the finite elements.

    All other packages of this environment are there.
    """
    folder = tmp_path_factory.mktemp("bare")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True)
    site_packages = folder / "packages"
    site_packages.mkdir()
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if path.suffix != ".pth" and not re.match(rf"({'|'.join(ABSENT)})\b", path.name):
            (site_packages / path.name).symlink_to(path)
    (site,) = (folder / "venv").rglob("site-packages")
    (site / "here.pth").write_text(f"{ROOT}\n{site_packages}\n", "utf-8")
    return folder / "venv" / "bin" / "python"


@pytest.fixture(scope="module")
def answers(bare, tmp_path_factory) -> dict[str, Any]:
    """Exit code, output and messages of each command.

    A study and a map were solved on this machine before.
    """
    folder = tmp_path_factory.mktemp("work")
    (folder / "solved.toml").write_text(CASE, "utf-8")
    assert call(["run", str(folder / "solved.toml"), "--out", str(folder / "solved" / "study"), "--quiet"]) == 0
    mapped = f"map {PAIR} {ROUGH} --shifts 0 --loads-kn 100 --quiet --out"
    assert call([*mapped.split(), str(folder / "solved" / "map")]) == 0
    (folder / "runner.py").write_text(RUNNER, "utf-8")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    completed = subprocess.run(
        [bare, "runner.py"],
        cwd=folder,
        env=environment,
        input=json.dumps([*WORKS, *REFUSES]),
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.returncode == 0, completed.stderr
    written = sorted(path.name for path in folder.iterdir())
    return json.loads(completed.stdout) | {"written": written}


@pytest.mark.slow
def test_the_packages_are_absent_there(bare):
    code = (
        "from importlib.util import find_spec\n"
        f"print([name for name in {ABSENT} if find_spec(name)], find_spec('fecontact').origin, sep='\\n')"
    )
    completed = subprocess.run([bare, "-c", code], capture_output=True, text=True, check=True, cwd="/")
    assert completed.stdout.splitlines() == ["[]", str(ROOT / "fecontact" / "__init__.py")]


@pytest.mark.slow
@pytest.mark.parametrize("command", WORKS)
def test_what_needs_no_finite_elements_works(answers, command):
    code, out, err = answers[command]
    assert code == 0, err
    assert out


@pytest.mark.slow
@pytest.mark.parametrize("command", REFUSES)
def test_what_needs_finite_elements_says_in_one_line_what_is_missing(answers, command):
    code, out, err = answers[command]
    assert (code, out) == (2, "")
    assert err == f"error: finite elements need gmsh and pyamg, which are not installed; {packages.suggest_remedy()}\n"
    assert not [name for name in answers["written"] if name.startswith("refused")]


def test_every_command_is_among_these():
    said = {command.partition(" --")[0] for command in (*WORKS, *REFUSES)} | OTHERS
    for name, command in app.resolved_commands().items():
        if name.startswith("-"):
            continue
        of_its_own = [inner for inner in command.resolved_commands() if not inner.startswith("-")]
        for full in [f"{name} {inner}" for inner in of_its_own] or [name]:
            assert any(f"{command_tried} ".startswith(f"{full} ") for command_tried in said), full


def test_the_doctor_says_what_is_missing(bare):
    completed = subprocess.run(
        [bare, "-m", "fecontact", "doctor"], capture_output=True, text=True, check=False, cwd="/"
    )
    assert completed.returncode == 1
    assert completed.stderr == ""
    assert "gmsh: does not work: ModuleNotFoundError" in completed.stdout
    assert (
        f"remedy: a Python package is missing from this environment: {packages.suggest_remedy()}\n" in completed.stdout
    )


@pytest.fixture
def arm_machine(monkeypatch):
    """Linux on ARM without the packages of the finite elements."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    monkeypatch.setattr(packages, "find_spec", lambda name: None)


def test_on_arm_another_machine_is_the_remedy(arm_machine, capsys):
    assert call(["solve"]) == 2
    assert "have no Python wheels for Linux on aarch64: solve on an x86-64 machine" in capsys.readouterr().err
    assert doctor.print_diagnosis() == 1
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == packages.suggest_remedy()
    assert "missing packages" not in said
    # libraries of gmsh are not asked for
    assert doctor.check_before_install(install=False) == 0


def test_python_refuses_before_any_work(arm_machine, tmp_path):
    for ask in (
        lambda: fecontact.solve(Case()),
        lambda: fecontact.run([Case()], tmp_path / "refused"),
        lambda: fecontact.map(Case(), [0.0], [1e5], tmp_path / "refused"),
        lambda: fecontact.mesh(Case(), "rail"),
    ):
        with pytest.raises(InputError, match="finite elements need gmsh and pyamg"):
            ask()
    assert not (tmp_path / "refused").exists()


@pytest.mark.parametrize(
    ("system", "machine", "has"),
    [
        *(("linux", "x86_64", True), ("linux", "aarch64", False)),
        *(("win32", "AMD64", True), ("darwin", "arm64", True), ("darwin", "x86_64", True)),
    ],
)
def test_pip_installs_the_packages_where_they_have_wheels(system, machine, has, monkeypatch):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    assert packages.has_wheels() == has
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["dependencies"]
    markers = {requirement.name: requirement.marker for requirement in map(Requirement, declared)}
    where = {"sys_platform": system, "platform_machine": machine}
    for name in packages.REQUIRED_PACKAGES:
        assert markers[name].evaluate(where) == has
    # it has wheels for fewer machines
    assert markers["pypardiso"].evaluate(where) == (has and system != "darwin")
