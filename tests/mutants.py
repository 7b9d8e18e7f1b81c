"""Mutants: one operator, constant or sign of the physics changed at a time; does a test notice?

`python tests/mutants.py [--count N] [--seed S]` (`make mutants`) draws places in the rooms of the physics, changes one
at a time in a copy of the program and runs the tests that call the function there, quick ones first. A mutant that no
test notices is printed with its place. Two hours for 200; no test of the suite runs it.

Which test calls which function is noted once, by a run of the whole suite in which calls are traced.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
ROOMS = (
    "contact", "fe", "normal", "rolling", "comparison", "wheel_rail", "irregularity", "profiles/curve.py",
    "profiles/segments.py", "profiles/smoothing.py", "curves/model.py", "curves/normal.py", "curves/stability.py",
    "curves/steady.py",
)  # fmt: skip
COPIED = ("fecontact", "tests", "studies", "meshes", "pyproject.toml", "README.md", "CONTRIBUTING.md")
# Seconds of tests, as noted, that a mutant is given: single tests first, then all of their files.
SINGLE_S, FILES_S = 40.0, 240.0
# A mutant may make an endless loop.
LONGEST_S = 600.0
OPERATORS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
# Text and types: a change there is no change of a number.
NO_NUMBERS = ("annotation", "returns", "decorator_list")
SKIPPED = (ast.Raise, ast.JoinedStr, ast.Assert, ast.Import, ast.ImportFrom)


# ----------------------------------------------------------------------------------------------------------------------
# Which test calls which function: this file as a plugin of pytest (`-p mutants`)


class Calls:
    """Functions of the package, by file and first line, that each test calls."""

    def __init__(self) -> None:
        self.of: dict[str, set[str]] = defaultdict(set)
        self.seconds: dict[str, float] = {}
        self.now = ""
        self.package = str(ROOT / "fecontact") + os.sep

    def trace(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(self.package):
            self.of[self.now].add(f"{code.co_filename[len(self.package) :]}:{code.co_firstlineno}")


CALLS = Calls()


def pytest_runtest_logstart(nodeid: str, location: object) -> None:
    """Notes the test, and traces calls alone: lines would cost ten times as much."""
    CALLS.now = nodeid
    sys.settrace(CALLS.trace)
    threading.settrace(CALLS.trace)


def pytest_runtest_logreport(report: Any) -> None:
    """Adds up what set-up, call and end take."""
    CALLS.seconds[report.nodeid] = CALLS.seconds.get(report.nodeid, 0.0) + report.duration


def pytest_sessionfinish() -> None:
    """Writes what this process noted."""
    folder = Path(os.environ["FECONTACT_CALLS"])
    told = {"calls": {test: sorted(what) for test, what in CALLS.of.items()}, "seconds": CALLS.seconds}
    path = folder / f"{os.environ.get('PYTEST_XDIST_WORKER', 'main')}.json"
    path.with_suffix(".part").write_text(json.dumps(told))
    path.with_suffix(".part").rename(path)


# ----------------------------------------------------------------------------------------------------------------------
# Mutants


@dataclass(frozen=True)
class Mutant:
    """A place in a file of the package, and what is changed there."""

    file: str
    index: int
    line: int
    function: int
    change: str


def changed(node: ast.AST) -> str:
    """Changes a node in place and says what; empty where there is nothing to change."""
    match node:
        case ast.BinOp() | ast.BoolOp() if type(node.op) in OPERATORS:
            old, node.op = node.op, OPERATORS[type(node.op)]()  # type: ignore[assignment]
            return f"{type(old).__name__} -> {type(node.op).__name__}"
        case ast.Compare() if type(node.ops[0]) in OPERATORS:
            old, node.ops[0] = node.ops[0], OPERATORS[type(node.ops[0])]()  # type: ignore[call-overload]
            return f"{type(old).__name__} -> {type(node.ops[0]).__name__}"
        case ast.UnaryOp(op=ast.USub()):
            node.op = ast.UAdd()
            return "minus -> plus"
        case ast.Constant() if type(node.value) in (int, float):
            old = node.value
            node.value = old + 1 if isinstance(old, int) else 1.1 * old or 0.1
            return f"{old} -> {node.value}"
    return ""


def places(tree: ast.AST, function: int = 0) -> Iterator[tuple[ast.AST, int]]:
    """Expressions that may be changed, with the first line of the function around each (0: the module)."""
    for name, value in ast.iter_fields(tree):
        if name in NO_NUMBERS:
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or isinstance(child, SKIPPED):
                continue
            inside = function
            if isinstance(child, ast.FunctionDef):
                inside = min([child.lineno, *(each.lineno for each in child.decorator_list)])
            if isinstance(child, ast.expr):
                yield child, inside
            yield from places(child, inside)


def mutants_of(file: str) -> list[Mutant]:
    """All of a file."""
    found = []
    tree = ast.parse((ROOT / "fecontact" / file).read_text())
    for index, (node, function) in enumerate(places(tree)):
        if change := changed(node):
            found.append(Mutant(file, index, node.lineno, function, change))  # type: ignore[attr-defined]
    return found


def mutated(mutant: Mutant) -> str:
    """The file with the change, its comments lost."""
    tree = ast.parse((ROOT / "fecontact" / mutant.file).read_text())
    changed(list(places(tree))[mutant.index][0])
    return ast.unparse(tree)


# ----------------------------------------------------------------------------------------------------------------------
# Runs


def environment(root: Path, **others: str) -> dict[str, str]:
    """One thread a process, and the copy before what is installed."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    return {**os.environ, **threads, "PYTHONPATH": f"{root}{os.pathsep}{root / 'tests'}", **others}


def noted(folder: Path, workers: int) -> None:
    """Runs the suite once and notes the calls of each test."""
    command = ["-m", "pytest", "-q", "-n", str(workers), "-m", "not slow", "-p", "mutants", "--dist", "worksteal"]
    subprocess.run([sys.executable, *command], cwd=ROOT, env=environment(ROOT, FECONTACT_CALLS=str(folder)))


def reached(folder: Path) -> tuple[dict[str, list[str]], dict[str, float]]:
    """Tests that call each function, quickest first, and what each test takes (s)."""
    tests, seconds = defaultdict(list), {}
    for path in folder.glob("*.json"):
        told = json.loads(path.read_text())
        seconds |= told["seconds"]
        for test, functions in told["calls"].items():
            for function in functions:
                tests[function].append(test)
                tests[function.partition(":")[0]].append(test)
    return {key: sorted(set(each), key=lambda test: seconds.get(test, 0.0)) for key, each in tests.items()}, seconds


def within(tests: list[str], seconds: dict[str, float], budget_s: float) -> list[str]:
    """The first of them that fit into the time."""
    chosen: list[str] = []
    for test in tests:
        budget_s -= seconds.get(test, 0.0)
        if chosen and budget_s < 0.0:
            break
        chosen.append(test)
    return chosen


def notices(root: Path, tests: list[str]) -> bool:
    """Whether one of the tests fails, or does not end."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", *tests]
    try:
        done = subprocess.run(command, cwd=root, env=environment(root), capture_output=True, timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        return True
    return done.returncode not in (0, 5)


def killed(root: Path, mutant: Mutant, tests: dict[str, list[str]], seconds: dict[str, float]) -> str:
    """What notices the mutant: "tests", "files" that hold them, "nobody", or "unreached"."""
    calling = tests.get(f"{mutant.file}:{mutant.function}", []) if mutant.function else tests.get(mutant.file, [])
    if not calling:
        return "unreached"
    path = root / "fecontact" / mutant.file
    kept = path.read_text()
    try:
        path.write_text(mutated(mutant))
        if notices(root, within(calling, seconds, SINGLE_S)):
            return "tests"
        whole: dict[str, float] = defaultdict(float)
        for test, each_s in seconds.items():
            whole[test.partition("::")[0]] += each_s
        files = sorted({test.partition("::")[0] for test in calling}, key=whole.__getitem__)
        return "files" if notices(root, within(files, whole, FILES_S)) else "nobody"
    finally:
        path.write_text(kept)


def main() -> None:
    """Draws, changes, runs, and prints who survives; what is finished stays in the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2, help="of the run that notes calls")
    parser.add_argument("--room", default="", help="places of this room or file alone, such as fe or fe/section.py")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutants")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    if not list(asked.out.glob("*.json")):
        noted(asked.out, asked.workers)
    tests, seconds = reached(asked.out)
    package = ROOT / "fecontact"
    names = []
    for room in ROOMS:
        paths = [package / room] if room.endswith(".py") else sorted((package / room).glob("*.py"))
        names += [path.relative_to(package).as_posix() for path in paths]
    every = [mutant for name in names if name.startswith(asked.room) for mutant in mutants_of(name)]
    drawn = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
    counts: dict[str, int] = defaultdict(int)
    with TemporaryDirectory() as folder, (asked.out / "mutants.jsonl").open("a") as record:
        root = Path(folder)
        for name in COPIED:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copy(ROOT / name, root / name)
        for number, mutant in enumerate(drawn, 1):
            begun = time.monotonic()
            by = killed(root, mutant, tests, seconds)
            counts[by] += 1
            record.write(json.dumps({**vars(mutant), "noticed_by": by, "seconds": time.monotonic() - begun}) + "\n")
            record.flush()
            if by in ("nobody", "unreached"):
                print(f"{number:4d} {by}: fecontact/{mutant.file}:{mutant.line} {mutant.change}", flush=True)
    print(f"{len(drawn)} of {len(every)} places: " + ", ".join(f"{count} {by}" for by, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
