"""Contents of an installation besides the modules."""

import ast
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
from importlib import metadata, resources
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from flit_core import buildapi

import fecontact
from fecontact.case import Case
from fecontact.cli import call
from fecontact.fe.linear_solver import is_pardiso_available
from fecontact.guide.pages import read_titles
from fecontact.profiles.library import list_names

ROOT = Path(__file__).parents[1]
# Without the marker, type checkers ignore the annotations of the package where it is imported.
WANTED = {
    "fecontact/py.typed",
    *(f"fecontact/profiles/data/{name}.toml" for name in list_names()),
    *(f"fecontact/guide/{topic}.md" for topic in read_titles()),
}


def test_the_package_says_that_it_is_typed():
    assert resources.files("fecontact").joinpath("py.typed").read_bytes() == b""


def tracked_files() -> list[str]:
    """Files that git tracks; none outside a clone."""
    try:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    except OSError:
        return []
    return listed.stdout.splitlines()


def test_a_clone_has_few_folders():
    """Files of the studies, such as their validation and the site, are below the studies."""
    folders = {name.partition("/")[0] for name in tracked_files() if "/" in name}
    if not folders:
        pytest.skip("no clone of the repository")
    assert {name for name in folders if not name.startswith(".")} == {"fecontact", "meshes", "studies", "tests"}


@pytest.mark.parametrize("kind", ["wheel", "sdist"])
def test_archives_hold_the_files_that_are_no_modules(tmp_path, monkeypatch, kind):
    # flit builds the project of the current folder
    monkeypatch.chdir(ROOT)
    if kind == "wheel":
        with ZipFile(tmp_path / buildapi.build_wheel(os.fspath(tmp_path))) as archive:
            files = set(archive.namelist())
    else:
        name = buildapi.build_sdist(os.fspath(tmp_path))
        assert name == f"fecontact-{fecontact.__version__}.tar.gz"
        with tarfile.open(tmp_path / name) as archive:
            files = {name.partition("/")[2] for name in archive.getnames()}
        # the sdist has the files for its tests
        assert files >= {
            "tests/test_package.py",
            "studies/first_light.py",
            "Makefile",
            "noxfile.py",
            "requirements.lock",
        }
        assert files >= {name for name in tracked_files() if not name.startswith(".") or name.startswith(".ci/")}
    assert files >= WANTED


# files that an sdist lacks are found by the test of its contents
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["wheel", "sdist"])
def test_an_installed_archive_answers_from_another_folder(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(ROOT)
    build = buildapi.build_wheel if kind == "wheel" else buildapi.build_sdist
    archive = tmp_path / build(os.fspath(tmp_path))
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--no-build-isolation"]
    subprocess.run([*pip, "--target", site, archive], check=True, cwd=elsewhere)
    code = (
        "import fecontact; print(fecontact.__file__); from fecontact.cli import call;"
        "call(['hertz', '--shift', '3', '--json'])"
    )
    process = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=elsewhere,
        env={**os.environ, "PYTHONPATH": os.fspath(site)},
    )
    where, _, record = process.stdout.partition("\n")
    assert Path(where).is_relative_to(site)
    # equal to the value here, where the profiles come from the repository
    assert json.loads(record)["ellipses"][0]["p_max_MPa"] == pytest.approx(1578.47, abs=0.01)


def test_every_package_that_is_imported_is_declared_and_locked():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = declared["optional-dependencies"]
    requirements = [*declared["dependencies"], *extras["cluster"], *extras["fleet"]]
    names = {re.match(r"[\w.-]+", requirement)[0].lower() for requirement in requirements}
    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else alias.name).partition(".")[0]
        for path in (ROOT / "fecontact").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    homes = metadata.packages_distributions()
    # the first is only for type checkers; VTK comes with pyvista, which limits its version; xarray is an option that
    # users install for data sets
    foreign = imported - sys.stdlib_module_names - {"fecontact", "_typeshed", "vtk", "vtkmodules", "xarray"}
    assert extras["xarray"]
    assert {module for module in foreign if not {home.lower() for home in homes[module]} & names} == set()
    locked = (ROOT / "requirements.lock").read_text("utf-8")
    assert names <= set(re.findall(r"^([\w.-]+)==", locked, re.MULTILINE))
    assert "://" not in locked


def test_the_version_is_defined_once(capsys):
    """In the package, from where archives have it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert "version" not in project
    assert "version" in project["dynamic"]
    assert call(["--version"]) == 0
    assert capsys.readouterr().out == f"{fecontact.__version__}\n"


def test_supported_versions_begin_where_an_installation_is_allowed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    versions = re.findall(r"Python :: (3\.\d+)", " ".join(project["classifiers"]))
    assert project["requires-python"] == f">={versions[0]}"
    first, last = (int(version.partition(".")[2]) for version in (versions[0], versions[-1]))
    assert versions == [f"3.{minor}" for minor in range(first, last + 1)]
    makefile = (ROOT / "Makefile").read_text("utf-8")
    assert f"--universal --python-version {versions[0]} " in makefile


def test_what_cites_and_tells_of_changes_is_of_this_version():
    """CITATION.cff has the keys that CFF 1.2.0 requires, and agrees with the project.

    Its version and date agree with the changelog too.
    """
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert cited["cff-version"] == "1.2.0"
    assert cited["message"]
    assert cited["title"].startswith(f"{project['name']}: ")
    assert len(cited["abstract"]) > 100
    assert cited["type"] == "software"
    assert cited["version"] == fecontact.__version__
    assert cited["license"] == project["license"]
    assert cited["authors"] == project["authors"]
    # the schema requires each exactly once
    assert sorted(cited["keywords"]) == sorted(set(project["keywords"]))
    # readers of the file refuse keys that are not in the schema
    keys = {"cff-version", "message", "title", "abstract", "type", "version", "date-released", "license", "authors"}
    assert set(cited) == keys | {"keywords"}
    first = re.search(r"^## (\S+), (\d{4}-\d\d-\d\d)$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert first is not None
    assert first.groups() == (fecontact.__version__, cited["date-released"].isoformat())


def test_the_readme_and_the_guide_agree_on_the_systems():
    """The README claims no more systems than the table of the guide."""
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert "Only these two systems are tested" in readme
    guide = (ROOT / "fecontact" / "guide" / "setup.md").read_text("utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in guide.splitlines() if line.startswith("| ")]
    tested = {row[0]: row[1] for row in rows if len(row) == 4}
    assert {name.partition(",")[0] for name, text in tested.items() if not text.startswith(("nothing", "tested"))} == {
        "Debian 12", "Debian 13",
    }  # fmt: skip
    wheels = {row[0]: row[2] for row in rows if len(row) == 4}
    assert wheels["Windows, x86-64"].startswith("all")
    assert wheels["macOS 12 or newer, ARM and x86-64"].startswith("all;")
    assert wheels["Linux, ARM (aarch64)"].startswith("all but gmsh and pyamg")
    requirements = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["dependencies"]
    marker = "sys_platform != 'linux' or platform_machine == 'x86_64'"
    assert {line.partition(">")[0] for line in requirements if line.endswith(marker)} == {"gmsh", "pyamg"}


def test_a_newcomer_can_read_the_changes():
    """An entry of the changelog has a few hundred words, in groups."""
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8").partition("\n### Names from before")[0]
    assert len(changes.split()) < 560
    assert re.findall(r"^### (.*)$", changes, re.MULTILINE) == [
        "Positions", "Maps", "Theories", "Measured profiles", "Vehicles", "Outputs", "Systems",
    ]  # fmt: skip


def test_multigrid_without_mkl_solves_the_same(solved):
    pair = ["--rail", "circle:300", "--wheel", "cylinder:460", "--inclination", "none", "--resolution", "2,1.8"]
    solve = ["solve", *pair, "--refine", "never", "--json"]
    code = f"import sys; sys.modules['pypardiso'] = None\nfrom fecontact.cli import call\ncall({solve!r})"
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    without = json.loads(process.stdout)
    shape = {"rail": "circle:300", "wheel": "cylinder:460", "inclination_rad": 0.0}
    result = solved(Case(**shape, resolution=(2.0, 1.8), refine="never"))
    assert without["solver"]["path"] == "amg"
    # if MKL is not installed, both results are from multigrid
    assert result.effort.path == ("pardiso" if is_pardiso_available() else "amg")
    # multigrid stops at residuals of 1e-10
    for measure, value in result.comparison.fe.as_dict().items():
        assert without["fe"][measure] == pytest.approx(value, rel=1e-7), measure
