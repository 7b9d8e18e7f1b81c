"""Tests on every supported Python: `nox --list` shows the sessions, `python noxfile.py` is `make test-all`.

The classifiers in pyproject.toml say which versions are supported. Sessions exist for those that this machine has, on
`PATH` or in pyenv.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import nox

ROOT = Path(__file__).parent
RESULTS = ROOT / "out" / "pythons"
SUPPORTED = nox.project.python_versions(nox.project.load_toml(ROOT / "pyproject.toml"))
# Files of tests that use most packages, in about a minute.
SMOKE = ("test_cli", "test_docstrings", "test_hertz", "test_inputs", "test_mortar", "test_package", "test_paraview")
# Solvers are as fast with one thread per test, and rounding does not depend on the number of threads.
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
# The peak pressure in the README, with half of its last digit and more.
PEAK_MPA, PEAK_TOLERANCE_MPA = 1578.47, 0.01

# A shim of pyenv runs only the version that is selected, so the versions themselves go first; the newest patch wins.
PYENV = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
PYENV_BINS = sorted(PYENV.glob("versions/3.*[0-9]/bin"), key=lambda path: [*map(int, path.parent.name.split("."))])
os.environ["PATH"] = os.pathsep.join([*map(str, reversed(PYENV_BINS)), os.environ["PATH"]])


def find_interpreters() -> dict[str, str]:
    """Paths of the supported interpreters on this machine, by version, the oldest first."""
    candidates = {version: shutil.which(f"python{version}") for version in SUPPORTED}
    return {
        version: path
        for version, path in candidates.items()
        if path and subprocess.run([path, "-c", ""], capture_output=True, check=False).returncode == 0
    }


INTERPRETERS = find_interpreters()
nox.options.default_venv_backend = "uv"
nox.options.sessions = ["tests"]


def install_locked(session: nox.Session) -> None:
    """Install the packages of requirements.lock by their hashes, and fecontact as `make setup` does."""
    session.install("--require-hashes", "--requirement", "requirements.lock")
    session.install("--no-deps", "--no-build-isolation", "--editable", ".")


def run_demo(session: nox.Session) -> None:
    """Solve the demo as `make demo` does, for the comparison of all versions."""
    session.run("fecontact", "demo", "--out", str(RESULTS / str(session.python) / "demo"), env=ONE_THREAD)


def run_pytest(session: nox.Session, *selected: str) -> None:
    """Run tests that are not slow; counts are written for the closing line."""
    report = RESULTS / f"{session.name}.xml"
    workers = ("-n", os.environ.get("TEST_WORKERS", "2"), "--dist", "worksteal")
    words = ("-q", "-m", "not slow", f"--junitxml={report}", *selected, *session.posargs)
    session.run("python", "-m", "pytest", *workers, *words, env=ONE_THREAD)


# some tests make environments and install archives by pip
@nox.session(python=list(INTERPRETERS), venv_params=["--seed"])
def tests(session: nox.Session) -> None:
    """The demo and all tests that are not slow."""
    install_locked(session)
    run_demo(session)
    run_pytest(session)


@nox.session(python=list(INTERPRETERS), venv_params=["--seed"])
def smoke(session: nox.Session) -> None:
    """The demo and a few files of tests."""
    install_locked(session)
    run_demo(session)
    run_pytest(session, *(f"tests/{name}.py" for name in SMOKE))


@nox.session(python=False)
def same(session: nox.Session) -> None:
    """Compare the demos of all versions: equal verdicts, and peak pressures that differ by rounding only."""
    first, *others = (path for version in SUPPORTED if (path := RESULTS / version / "demo").exists())
    for other in others:
        words = ("compare", str(first), str(other), "--tolerance", ".ci/rounding.toml")
        session.run(sys.executable, "-m", "fecontact", *words)


@nox.session(python=False)
def lint(session: nox.Session) -> None:
    """Ruff and mypy, once."""
    session.run("make", "lint")


@nox.session(python=list(INTERPRETERS)[:1], venv_params=["--seed"])
def lowest(session: nox.Session) -> None:
    """All tests that are not slow, with the oldest direct dependencies that pyproject.toml allows."""
    lowest_versions = Path(session.create_tmp()) / "lowest.txt"
    extras = ("--extra", "dev", "--extra", "cluster", "--extra", "fleet", "--extra", "xarray")
    words = ("--resolution", "lowest-direct", "--only-binary", ":all:", "--python-version", str(session.python))
    session.run("uv", "pip", "compile", "-q", "pyproject.toml", *extras, *words, "-o", str(lowest_versions))
    session.install("--only-binary", ":all:", "--requirement", str(lowest_versions))
    session.install("--no-deps", "--no-build-isolation", "--editable", ".")
    run_pytest(session)


@nox.session(python=list(INTERPRETERS))
@nox.parametrize("archive", ["fecontact-*.whl", "fecontact-*.tar.gz"], ids=["wheel", "sdist"])
def dist(session: nox.Session, archive: str) -> None:
    """Install an archive of dist/ as a user does, and run it from another folder."""
    (path,) = (ROOT / "dist").glob(archive)
    session.install(str(path))
    with session.chdir(session.create_tmp()):
        version = (session.run("fecontact", "--version", silent=True) or "").strip()
        record = json.loads(session.run("fecontact", "hertz", "--shift", "3", "--json", silent=True) or "")
    if not path.name.startswith(f"fecontact-{version}"):
        session.error(f"{path.name} prints version {version}")
    peak = record["ellipses"][0]["p_max_MPa"]
    if abs(peak - PEAK_MPA) > PEAK_TOLERANCE_MPA:
        session.error(f"peak pressure {peak} MPa instead of {PEAK_MPA}")
    session.log(f"{path.name}: version {version}, peak pressure {peak:.4f} MPa")


def count_results(sessions: list[str], code: int) -> str:
    """The closing line: tests of all sessions; a session without a report counts as one failure."""
    passed = failed = skipped = 0
    for name in sessions:
        report = RESULTS / f"{name}.xml"
        if not report.exists():
            failed += 1
            continue
        (suite,) = ElementTree.parse(report).getroot().iter("testsuite")
        total, failures, errors, left_out = (
            int(suite.get(key, 0)) for key in ("tests", "failures", "errors", "skipped")
        )
        passed += total - failures - errors - left_out
        failed += failures + errors
        skipped += left_out
    # what failed beside the tests, such as the comparison
    failed += bool(code and not failed)
    return f"{passed} passed, {failed} failed, {skipped} skipped"


def main() -> int:
    """All tests on the oldest and on the newest interpreter, a few on those between; returns an exit code."""
    for version, path in INTERPRETERS.items():
        print(f"Python {version}: {path}")
    missing = [version for version in SUPPORTED if version not in INTERPRETERS]
    print(f"not on this machine: {', '.join(missing) or 'none'}", flush=True)
    if len(INTERPRETERS) < 2:
        print(
            f"error: {len(INTERPRETERS)} of the supported Python versions found; at least 2 of {', '.join(SUPPORTED)} "
            "are needed on PATH or in pyenv (pyenv install 3.13)",
            file=sys.stderr,
        )
        return 1
    oldest, *between, newest = INTERPRETERS
    sessions = [f"tests-{oldest}", *(f"smoke-{version}" for version in between), f"tests-{newest}"]
    shutil.rmtree(RESULTS, ignore_errors=True)
    command = [sys.executable, "-m", "nox", "--noxfile", __file__, "--session", *sessions, "same"]
    code = subprocess.run(command, stderr=subprocess.STDOUT, check=False).returncode
    print(count_results(sessions, code), flush=True)
    return code


if __name__ == "__main__":
    sys.exit(main())
