"""Removal and addition of features.

A feature is removed with its folder, its tests and its studies; it is added by a folder or a package.
"""

import ast
import filecmp
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fecontact.feature_registry import FEATURES

ROOT = Path(__file__).parents[1]
# Features that can be taken away alone.
REMOVED = FEATURES
PAIR = (
    *("--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none"),
    *("--resolution", "quick", "--refine", "never"),
)
# What each user does first, with one real solution and a study of a stand-in.
USED = f"""
import sys
from pathlib import Path

import fake_solve
from inline import inline_crew, study_by

import fecontact
from fecontact.cli import call
from fecontact.feature_registry import FEATURES
from fecontact.runs.casefile import Study

assert [getattr(fecontact, name) for name in fecontact.__all__]
cases = tuple(fecontact.Case(load_N=load_N, lateral_shift_mm=2.0) for load_N in (50e3, 60e3))
assert call(["--help"]) == 0
assert call(["solve", *{PAIR!r}, "--out", "one"]) == 0
assert call(["judge", "one", "--p-max-percent", "3"]) == 0
assert call(["compare", "one", "one"]) == 0
assert fecontact.load("one").status == "converged"
assert fecontact.rows(fecontact.load("one"))[0]["status"] == "converged"
assert study_by(Study(name="two", cases=cases), Path("two"), crew=inline_crew(), work=fake_solve.FakeWork).all_converged
assert call(["compare", "two", "two"]) == 0
"""
# What is refused without a feature, and what that says.
REFUSED = {
    "curves": "assert call(['geometry', '--shifts', '0', '--loaded-kn', '50']) == 2",
}


def offered_names(feature: str) -> set[str]:
    """Functions and classes of the package that a feature has."""
    tree = ast.parse((ROOT / "fecontact" / "features" / feature / "feature.py").read_text("utf-8"))
    constants = {
        statement.targets[0].id: ast.literal_eval(statement.value)
        for statement in tree.body
        if isinstance(statement, ast.Assign)
    }
    return {place.rpartition(".")[2].rstrip("_") for place in constants["NAMES"]}


def copied(to: Path, *patterns: str) -> Path:
    """A copy of the package, with its tests and whatever else they need."""
    for name in ("fecontact", *patterns):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, to / name, ignore=shutil.ignore_patterns("__pycache__", "out"))
        else:
            shutil.copyfile(source, to / name)
    return to


def remove_feature(feature: str, tree: Path) -> None:
    """Remove a feature from a copy of the repository.

    Its tests and its studies, with their baselines and pages, are removed too.
    """
    shutil.rmtree(tree / "fecontact" / "features" / feature)
    shutil.rmtree(tree / "tests" / feature, ignore_errors=True)
    usage = re.compile(rf"fecontact\.({'|'.join((f'features.{feature}', *offered_names(feature)))})\b")
    for study in (tree / "studies").glob("*.py"):
        if usage.search(study.read_text("utf-8")):
            study.unlink()
            for stored in ("baselines/{}.csv", "baselines/{}.json", "validation/{}.md"):
                (tree / "studies" / stored.format(study.stem)).unlink(missing_ok=True)
            table = tree / "studies" / "VALIDATION.md"
            lines = table.read_text("utf-8").splitlines(keepends=True)
            table.write_text("".join(line for line in lines if f"(validation/{study.stem}.md)" not in line), "utf-8")


def python(tree: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run Python with the package of a copy."""
    paths = os.pathsep.join(map(str, (tree, tree / "tests")))
    return subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        cwd=tree,
        env={**os.environ, "PYTHONPATH": paths, **environment},
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("feature", REMOVED)
def test_the_program_works_without_a_feature(feature, tmp_path):
    tree = copied(tmp_path, "tests")
    remove_feature(feature, tree)
    absence = f"assert not {offered_names(feature)!r} & set(fecontact.__all__)\nassert {feature!r} not in FEATURES\n"
    process = python(tree, "-c", USED + absence + REFUSED.get(feature, ""))
    assert process.returncode == 0, process.stderr
    commands = process.stdout.partition("Exit codes")[0]
    assert not re.search(rf"│ ({'|'.join(offered_names(feature))}) ", commands)
    if feature in REFUSED:
        assert "not installed" in process.stderr


@pytest.mark.slow
def test_the_program_works_without_any_feature(tmp_path):
    tree = copied(tmp_path, "tests", "studies")
    for feature in FEATURES:
        remove_feature(feature, tree)
    process = python(tree, "-c", USED + "assert FEATURES == ()\n")
    assert process.returncode == 0, process.stderr


# all other tests, some twenty minutes of a core
@pytest.mark.slow
@pytest.mark.parametrize("feature", REMOVED)
def test_all_other_tests_pass_without_a_feature(feature, tmp_path):
    names = ("tests", "studies", "meshes", ".ci", "Makefile", "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE")
    tree = copied(tmp_path, *names, "CITATION.cff", "pyproject.toml", "requirements.lock")
    remove_feature(feature, tree)
    # pages tell of all features, and a copy is no clone
    options = [f"--ignore=tests/test_{name}.py" for name in ("documents", "fresh_clone", "features", "package")]
    process = python(tree, "-m", "pytest", "-q", "-x", "-n", "2", "-m", "not slow", *options)
    assert process.returncode == 0, process.stdout[-4000:]


DUMMY = {
    "__init__": "",
    "feature": """
COMMANDS = {"Look": ("command.twice",)}
NAMES = ("running.peaks",)
READINGS = {"twice": "model.twice_of"}
TELLINGS = {"twice": "telling.TWICE"}
""",
    "model": """
from dataclasses import dataclass


@dataclass(frozen=True)
class Twice:
    peak_MPa: float


def twice_of(load, placement):
    return Twice(peak_MPa=2.0 * load.comparison.fe.p_max_MPa)
""",
    "telling": """
from fecontact.outputs.style import blank_figure, save_figure
from fecontact.outputs.parts import Telling
from fecontact.outputs.tables import number_column

TWICE = Telling(
    columns=(number_column("twice", "twice_peak_MPa"),),
    parts=lambda record: [f"twice the peak is {record['peak_MPa']:.0f} MPa"],
)


def twice_figure(peaks, path):
    figure = blank_figure(3.0, 3.0)
    figure.add_subplot().plot(peaks)
    return save_figure(figure, path)
""",
    "running": """
from fecontact.runs.load import load


def peaks(folder):
    return [load(folder).load.features["twice"].peak_MPa]
""",
    "command": """
from pathlib import Path


def twice(folder: Path, *, out: Path) -> int:
    '''Twice the peak of a solved case.'''
    from fecontact.features.dummy.running import peaks
    from fecontact.features.dummy.telling import twice_figure

    found = peaks(folder)
    print(f"twice: {found[0]:.1f}")
    twice_figure(found, out)
    return 0
""",
}


def different(first: Path, second: Path) -> set[str]:
    """Files that differ between two trees, and folders that are missing in either tree."""
    comparison = filecmp.dircmp(first, second, ignore=["__pycache__"])
    differences = {*comparison.left_only, *comparison.right_only, *comparison.diff_files}
    for name in comparison.common_dirs:
        differences |= {f"{name}/{path}" for path in different(first / name, second / name)}
    return differences


@pytest.mark.slow
def test_a_feature_is_put_in_by_its_folder(tmp_path):
    tree = copied(tmp_path, "tests")
    (tree / "fecontact" / "features" / "dummy").mkdir()
    for name, text in DUMMY.items():
        (tree / "fecontact" / "features" / "dummy" / f"{name}.py").write_text(text, "utf-8")
    assert different(ROOT / "fecontact", tree / "fecontact") == {"features/dummy"}
    code = (
        USED
        + """
import json

result, record = fecontact.load("one"), json.loads(Path("one/result.json").read_text())
assert record["twice"] == {"peak_MPa": 2.0 * result.comparison.fe.p_max_MPa}
assert fecontact.rows(result)[0]["twice_peak_MPa"] == fecontact.peaks("one")[0] == record["twice"]["peak_MPa"]
assert call(["twice", "one", "--out", "twice.png"]) == 0
assert "twice the peak is" in Path("one/report.html").read_text()
"""
    )
    process = python(tree, "-c", code)
    assert process.returncode == 0, process.stderr
    assert "twice: " in process.stdout
    assert (tree / "twice.png").stat().st_size > 500


@pytest.fixture(scope="module")
def third_party(tmp_path_factory) -> Path:
    """The folder into which the example of a third-party feature is built and installed."""
    folder = tmp_path_factory.mktemp("third_party")
    source = shutil.copytree(ROOT / "tests" / "third_party_feature", folder / "source")
    assert {path.name for path in source.rglob("*.py")} == {"__init__.py", "feature.py"}
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    offline = ("--quiet", "--no-index", "--no-deps", "--no-build-isolation")
    subprocess.run([*pip, "wheel", *offline, "--wheel-dir", str(folder), str(source)], check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", *offline, "--target", str(folder / "installed"), str(wheel)], check=True)
    return folder / "installed"


def run_with_third_party(third_party: Path, code: str, cwd: Path) -> str:
    """Output of code in a process that finds the modules of a third party."""
    paths = os.pathsep.join(map(str, (third_party, ROOT)))
    command = [sys.executable, "-c", f"import fecontact\nfrom fecontact.cli import call\n{code}"]
    process = subprocess.run(
        command, capture_output=True, text=True, cwd=cwd, env={**os.environ, "PYTHONPATH": paths}, check=False
    )
    assert process.returncode == 0, process.stderr
    return process.stdout


@pytest.mark.slow
def test_a_third_party_feature_is_found_where_its_package_is_installed(third_party, tmp_path):
    code = """
from fecontact.feature_registry import FEATURES
assert "mean_pressure" in FEATURES and "mean_pressure_MPa" in fecontact.__all__
assert call(["--help"]) == 0
assert call(["mean_pressure", "--help"]) == 0
assert call(["mean_pressure", "nothing"]) == 2
"""
    said = run_with_third_party(third_party, code, tmp_path)
    assert re.search(r"mean_pressure +Print the mean pressure over the contact patch", said)
    assert "mean_pressure" not in FEATURES


@pytest.mark.slow
def test_a_third_party_feature_has_its_reading_in_every_output(third_party, tmp_path):
    """The mean pressure of an ellipse is two thirds of its peak."""
    code = f"""
import csv, json
from pathlib import Path
assert call(["solve", *{PAIR!r}, "--out", "one"]) == 0
assert call(["mean_pressure", "one"]) == 0
result, record = fecontact.load("one"), json.loads(Path("one/result.json").read_text())
read = record["mean_pressure"]
assert abs(read["hertz_MPa"] / (2.0 / 3.0 * result.comparison.hertz.p_max_MPa) - 1.0) < 1e-9
assert abs(read["fe_MPa"] / read["hertz_MPa"] - 1.0) < 0.005
assert fecontact.rows(result)[0]["mean_pressure_fe_MPa"] == read["fe_MPa"] == fecontact.mean_pressure_MPa("one")
assert f"mean pressure {{read['fe_MPa']:.0f}} MPa" in Path("one/report.html").read_text()
from fecontact.runs import sources
assert [path.name for path in sources._list_foreign_folders()] == ["fecontact_mean_pressure"]
assert sources.read_digests().evaluating != sources.compute_digests(sources._PACKAGE).evaluating
"""
    assert re.search(r"mean pressure \d+\.\d MPa", run_with_third_party(third_party, code, tmp_path))
