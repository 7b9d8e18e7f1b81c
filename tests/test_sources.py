"""Source files that decide about a stored result.

Some solve, some only evaluate, and some do neither.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_architecture import MODULES, PACKAGE, imported, room

from fecontact.case import Case
from fecontact.runs.sources import (
    DISPLAY_MODULES,
    EVALUATING_MODULES,
    INPUT_MODULES,
    JUDGING_MODULES,
    SOLVING_MODULES,
    _read_source,
    collect_imports,
    compute_digests,
    read_digests,
)
from fecontact.solving import meshes
from fecontact.solving.meshes import Meshes
from fecontact.solving.position import expect_position

SOLVING = collect_imports(PACKAGE, SOLVING_MODULES, (*JUDGING_MODULES, *INPUT_MODULES))
EVALUATING = collect_imports(PACKAGE, EVALUATING_MODULES, (*INPUT_MODULES, *DISPLAY_MODULES))
BOTH = {"solving", "evaluating"}


def within(module: str, names: tuple[str, ...]) -> bool:
    return any(f"{module}.".startswith(f"{name}.") for name in names)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    copied = tmp_path_factory.mktemp("sources") / "fecontact"
    shutil.copytree(PACKAGE, copied, ignore=shutil.ignore_patterns("__pycache__"))
    assert compute_digests(copied) == read_digests()
    return copied


@pytest.mark.parametrize(
    ("file", "old", "new", "seen_by"),
    [
        # code
        ("contact/solver.py", "", "\nADDED = 1\n", {"solving"}),
        ("case.py", "NODES_PER_SEMI_AXIS = 32", "NODES_PER_SEMI_AXIS = 33", {"solving"}),
        ("bodies.py", "", "\nADDED = 1\n", {"solving"}),
        ("profiles/readers/columns.py", "", "\nADDED = 1\n", {"solving"}),
        ("profiles/data/60E1.toml", "", "\n# changed\n", {"solving"}),
        ("contact_theories/hertz.py", "", "\nADDED = 1\n", {"solving"}),
        # its lobes decide about the sizes of elements
        ("contact/patch.py", "", "\nADDED = 1\n", {"solving"}),
        ("judging/uncertainty.py", "MESH_RATIO = ", "MESH_RATIO = 1.0 + ", {"solving"}),
        ("contact_theories/strips.py", "", "\nADDED = 1\n", {"evaluating"}),
        ("judging/verdict.py", "", "\nADDED = 1\n", {"evaluating"}),
        ("criteria.py", "", "\nADDED = 1\n", {"evaluating"}),
        ("outputs/records/results.py", "", "\nADDED = 1\n", {"evaluating"}),
        ("maps/model.py", "", "\nADDED = 1\n", {"evaluating"}),
        # what is neither
        ("runs/study.py", "", "\nADDED = 1\n", set()),
        ("outputs/figures/case.py", "", "\nADDED = 1\n", set()),
        ("features/curves/data/metro.toml", "", "\n# changed\n", set()),
        ("jobs/workers.py", "", "\nADDED = 1\n", set()),
        ("inputs/kinds.py", "", "\nADDED = 1\n", set()),
        ("cli.py", "", "\nADDED = 1\n", set()),
        # words
        ("contact/solver.py", "", "\n# a comment\n", set()),
        ("contact/solver.py", '"""', '"""Another docstring. ', set()),
        ("case.py", '"""Nodes of the pressure', '"""Other words for the nodes', set()),
        ("case.py", '"Wheel load"', '"Load of the wheel"', set()),
        ("case.py", 'label="roll angle"', 'label="angle of roll"', set()),
        ("case.py", "but the roll is", "while the roll is", set()),
        ("case.py", "high=60.0", "high=61.0", {"solving"}),
    ],
)
def test_each_digest_sees_its_own_sources_and_no_others(package, file, old, new, seen_by):
    # features may not be there
    if file.startswith("features/"):
        pytest.importorskip(f"fecontact.features.{file.split('/')[1]}")
    path, before = package / file, compute_digests(package)
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1) if old else text + new, "utf-8")
    try:
        after = compute_digests(package)
    finally:
        path.write_text(text, "utf-8")
    assert {name for name in BOTH if getattr(after, name) != getattr(before, name)} == seen_by


def test_whatever_runs_while_a_load_is_solved_is_in_the_digest_of_solving(monkeypatch):
    """Modules that run, found by their calls and not by imports.

    A single function asks for a verdict.
    """
    run: set[str] = set()

    def note(frame, event, argument):
        run.add(frame.f_code.co_filename)

    monkeypatch.setattr(meshes, "is_open", lambda *arguments: False)
    sys.setprofile(note)
    try:
        case = Case(lateral_shift_mm=3.0, refine="never", resolution=(1.5, 1.5))
        position = expect_position(case)
        Meshes(position).solve(position)
    finally:
        sys.setprofile(None)
    modules_run = {module for module, path in MODULES.items() if str(path) in run}
    assert {"solving.meshes", "contact.patch", "fe.coupling", "placement.wheelset"} <= modules_run
    # both are values of the case that nothing asks for here
    assert {module for module in modules_run - SOLVING if not within(module, INPUT_MODULES)} <= {"creep", "criteria"}


def test_only_those_who_ask_for_a_verdict_import_the_judges():
    # the digest of solving does not look into them: what else they decided about a solution would be missed
    asking = {module for module in SOLVING if any(within(user, JUDGING_MODULES) for user in imported(module)[0])}
    assert asking == {"case", "solving.solve", "solving.meshes", "solving.profile_variants"}
    # what `solving.profile_variants` stores of the judges is of measured files alone, whose results both digests guard
    modules_used = imported("solving.profile_variants")[0]
    assert {user for user in modules_used if within(user, JUDGING_MODULES)} == {"judging.lobes"}
    assert {user for user in imported("case")[0] if within(user, JUDGING_MODULES)} == {"criteria"}
    for name in (*JUDGING_MODULES, *INPUT_MODULES, *DISPLAY_MODULES):
        assert any(within(module, (name,)) for module in MODULES), name


def test_what_reads_inputs_knows_no_physics():
    left_out = {module for module in MODULES if within(module, INPUT_MODULES)}
    modules_used = {target for module in left_out for target in imported(module)[0]} - left_out
    assert modules_used == {"errors"}


def test_all_that_judges_and_tells_a_stored_result_is_in_a_digest():
    tracked_rooms = {"judging", "contact_theories", "solving", "features.creep"}
    judging_modules = {module for module in SOLVING | EVALUATING if room(module) in tracked_rooms}
    assert {"judging.judge", "judging.theory", "contact_theories.strips"} <= judging_modules
    assert {"outputs.records.results", "outputs.records.stored", "runs.store"} <= EVALUATING
    pytest.importorskip("fecontact.features.creep")
    assert {"contact_theories.rolling.kalker", "features.creep.steady"} <= judging_modules


def test_digests_are_kept_beside_the_compiled_modules(tmp_path):
    """A digest takes half a second the first time.

    Each further process takes hundredths of a second.
    """
    code = "import time; from fecontact.runs.sources import read_digests; begun = time.process_time()"
    code += "; made = read_digests()"
    code += "; print(made.solving, made.evaluating, time.process_time() - begun)"
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(tmp_path)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    digest_rows = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment).stdout
        for _ in range(2)
    ]
    expected_digests = [read_digests().solving, read_digests().evaluating]
    assert [digest_row.split()[:2] for digest_row in digest_rows] == [expected_digests, expected_digests]
    assert float(digest_rows[1].split()[2]) < 0.15
    (digest_file,) = tmp_path.rglob("sources*.json")
    # of other sources
    digest_file.write_text(
        digest_file.read_text().replace('"sources": "', '"sources": "0').replace(expected_digests[0], "x")
    )
    again = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert again.stdout.split()[:2] == expected_digests


def test_the_digest_of_a_source_is_the_same_on_every_python():
    """A frozen digest for the tests on each Python version.

    By `ast.dump`, Python 3.11, 3.12 and 3.13 had three different digests.
    """
    text = "def f(x, w, *, end=''):\n    return f'{x:{w}} ' if x else None\n"
    assert _read_source(text) == ([], "03917d2e725c74af1920f35ba6e422fae4a0868438ec1395bedc1f967f6effbb")
