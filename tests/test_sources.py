"""Which sources decide about a stored result: what solves, what only evaluates, and what is neither."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_architecture import MODULES, PACKAGE, imported, room

from fecontact.case import Case
from fecontact.runs.sources import EVALUATE, INPUTS, JUDGES, SHOWN, SOLVE, _read, closure, digests, digests_of
from fecontact.solving import meshes
from fecontact.solving.meshes import Meshes
from fecontact.solving.position import position_of

SOLVING = closure(PACKAGE, SOLVE, (*JUDGES, *INPUTS))
EVALUATING = closure(PACKAGE, EVALUATE, (*INPUTS, *SHOWN))
BOTH = {"solving", "evaluating"}


def within(module: str, names: tuple[str, ...]) -> bool:
    return any(f"{module}.".startswith(f"{name}.") for name in names)


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    copied = tmp_path_factory.mktemp("sources") / "fecontact"
    shutil.copytree(PACKAGE, copied, ignore=shutil.ignore_patterns("__pycache__"))
    assert digests_of(copied) == digests()
    return copied


@pytest.mark.parametrize(
    ("file", "old", "new", "seen_by"),
    [
        # code
        ("contact/solver.py", "", "\nADDED = 1\n", {"solving"}),
        ("case.py", "NODES_A_SEMI_AXIS = 32", "NODES_A_SEMI_AXIS = 33", {"solving"}),
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
    path, before = package / file, digests_of(package)
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1) if old else text + new, "utf-8")
    try:
        after = digests_of(package)
    finally:
        path.write_text(text, "utf-8")
    assert {name for name in BOTH if getattr(after, name) != getattr(before, name)} == seen_by


def test_whatever_runs_while_a_load_is_solved_is_in_the_digest_of_solving(monkeypatch):
    """Found by what is called, and not by who imports whom; a verdict is asked for by one function alone."""
    run: set[str] = set()

    def note(frame, event, argument):
        run.add(frame.f_code.co_filename)

    monkeypatch.setattr(meshes, "is_open", lambda *arguments: False)
    sys.setprofile(note)
    try:
        case = Case(lateral_shift_mm=3.0, refine="never", resolution=(1.5, 1.5))
        position = position_of(case)
        Meshes(position).solve(position)
    finally:
        sys.setprofile(None)
    own = {module for module, path in MODULES.items() if str(path) in run}
    assert {"solving.meshes", "contact.patch", "fe.coupling", "placement.wheelset"} <= own
    # both are values of the case that nothing asks for here
    assert {module for module in own - SOLVING if not within(module, INPUTS)} <= {"creep", "criteria"}


def test_only_those_who_ask_for_a_verdict_import_the_judges():
    # the digest of solving does not look into them: what else they decided about a solution would be missed
    asking = {module for module in SOLVING if any(within(other, JUDGES) for other in imported(module)[0])}
    assert asking == {"case", "solving.solve", "solving.meshes", "solving.profile_variants"}
    # what `solving.profile_variants` stores of the judges is of measured files alone, whose results both digests guard
    used = imported("solving.profile_variants")[0]
    assert {other for other in used if within(other, JUDGES)} == {"judging.lobes"}
    assert {other for other in imported("case")[0] if within(other, JUDGES)} == {"criteria"}
    for name in (*JUDGES, *INPUTS, *SHOWN):
        assert any(within(module, (name,)) for module in MODULES), name


def test_what_reads_inputs_knows_no_physics():
    left_out = {module for module in MODULES if within(module, INPUTS)}
    used = {other for module in left_out for other in imported(module)[0]} - left_out
    assert used == {"errors"}


def test_all_that_judges_and_tells_a_stored_result_is_in_a_digest():
    told = {"judging", "contact_theories", "solving", "features.creep"}
    judged = {module for module in SOLVING | EVALUATING if room(module) in told}
    assert {"judging.judge", "judging.theory", "contact_theories.strips"} <= judged
    assert {"outputs.records.results", "outputs.records.stored", "runs.store"} <= EVALUATING
    pytest.importorskip("fecontact.features.creep")
    assert {"contact_theories.rolling.kalker", "features.creep.steady"} <= judged


def test_digests_are_kept_beside_the_compiled_modules(tmp_path):
    """A digest takes half a second once, and each further process hundredths of one."""
    code = "import time; from fecontact.runs.sources import digests; begun = time.process_time(); made = digests()"
    code += "; print(made.solving, made.evaluating, time.process_time() - begun)"
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(tmp_path)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    told = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment).stdout
        for _ in range(2)
    ]
    own = [digests().solving, digests().evaluating]
    assert [one.split()[:2] for one in told] == [own, own]
    assert float(told[1].split()[2]) < 0.15
    (kept,) = tmp_path.rglob("sources*.json")
    # of other sources
    kept.write_text(kept.read_text().replace('"sources": "', '"sources": "0').replace(own[0], "x"))
    again = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert again.stdout.split()[:2] == own


def test_the_digest_of_a_source_is_the_same_on_every_python():
    """Frozen, so that the tests on each Python hold it; by `ast.dump` 3.11, 3.12 and 3.13 had three digests."""
    text = "def f(x, w, *, end=''):\n    return f'{x:{w}} ' if x else None\n"
    assert _read(text) == ([], "03917d2e725c74af1920f35ba6e422fae4a0868438ec1395bedc1f967f6effbb")
