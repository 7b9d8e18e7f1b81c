"""Mutants: changes of a single operator, constant or sign of the physics, and the tests that notice them.

`python tests/mutants.py [--count N] [--seed S]` (`make mutants`) draws places in the rooms of the physics, changes one
at a time in a copy of the program and runs the tests that call the function there, quick ones first. A mutant that no
test notices is printed with its place. Two hours for 200; no test of the suite runs it.

Which test calls which function is noted once, by a run in which calls are traced; a test that takes longer than
`NOTED_S` is cut off and takes no part. Notes and finished mutants stay in `--out`: a run that was stopped goes on, and
`--again` asks those that nobody noticed once more, such as after a new test (which is noted first).
"""

import argparse
import ast
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
ROOMS = (
    "contact", "fe", "contact_theories", "judging", "placement", "profiles/curve.py",
    "profiles/segments.py", "profiles/registration.py", "profiles/smoothing.py", "profiles/variants.py",
    "profiles/pieces.py", "profiles/point_noise.py", "profiles/smoothing_splines.py", "profiles/point_problems.py",
    "features/curves/model.py", "features/curves/normal.py", "features/curves/stability.py",
    "features/curves/steady.py", "features/curves/wheel_forces.py", "features/curves/balance.py",
    "features/curves/newton.py", "features/creep/forces.py", "features/creep/steady.py",
)  # fmt: skip
COPIED = ("fecontact", "tests", "studies", "meshes", "pyproject.toml", "README.md", "CONTRIBUTING.md")
# CPU seconds of a test while calls are noted.
NOTED_S = 20.0
# The few tests that call least beside its function are asked first, then others that call it and others of their files,
# which use what the first left in a cache: so many, and CPU seconds as noted (of the others as asked).
FEW, FEW_S = 12, 6.0
# A mutant may make an endless loop, or a mesh without end: so many CPU seconds for those that are noted, and a start.
MOST_TIMES, START_S, MOST_BYTES = 2.0, 15.0, 8 * 2**30
# Imported once, before each mutant has its own process.
HEAVY = ("gmsh", "hypothesis", "matplotlib.pyplot", "numpy", "pypardiso", "pytest", "scipy.optimize", "skfem")
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
    """Functions of the package, by file and first line, that each test calls; a line of JSON for each test."""

    def __init__(self) -> None:
        self.of: set[str] = set()
        self.begun_s = 0.0
        self.package = str(ROOT / "fecontact") + os.sep

    def trace(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(self.package):
            self.of.add(f"{code.co_filename[len(self.package) :]}:{code.co_firstlineno}")


CALLS = Calls()


def cpu_s() -> float:
    """CPU time of this process and of those that it waited for."""
    return sum(os.times()[:4])


def too_long(*_: object) -> None:
    """Ends a test that would cost too much for each mutant."""
    raise TimeoutError(f"longer than {NOTED_S:g} CPU s")


def pytest_collection_modifyitems(items: list[Any]) -> None:
    """Leave out the tests that were noted before."""
    _, seconds = reached(Path(os.environ["FECONTACT_CALLS"]))
    items[:] = [item for item in items if item.nodeid not in seconds]


def pytest_runtest_logstart(nodeid: str, location: object) -> None:
    """Trace calls alone: lines would cost ten times as long."""
    CALLS.of, CALLS.begun_s = set(), cpu_s()
    signal.signal(signal.SIGPROF, too_long)
    signal.setitimer(signal.ITIMER_PROF, NOTED_S)
    sys.settrace(CALLS.trace)
    threading.settrace(CALLS.trace)


def pytest_runtest_logreport(report: Any) -> None:
    """A test that does not pass as the program is cannot notice a mutant."""
    if report.failed:
        CALLS.of = set()
        CALLS.begun_s = -1e9


def pytest_runtest_logfinish(nodeid: str, location: object) -> None:
    """Write the note of a test."""
    sys.settrace(None)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    with (Path(os.environ["FECONTACT_CALLS"]) / "calls.jsonl").open("a") as file:
        record = {"test": nodeid, "seconds": round(cpu_s() - CALLS.begun_s, 3), "calls": sorted(CALLS.of)}
        file.write(json.dumps(record) + "\n")


# ----------------------------------------------------------------------------------------------------------------------
# Mutants


@dataclass(frozen=True)
class Mutant:
    """A place in a file of the package, and the change there."""

    file: str
    index: int
    line: int
    function: int
    change: str


def changed(node: ast.AST) -> str:
    """Change a node in place and describe the change.

    The text is empty if there is nothing to change.
    """
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
                inside = first_line(child)
            if isinstance(child, ast.expr):
                yield child, inside
            yield from places(child, inside)


def mutants_of(file: str) -> list[Mutant]:
    """All of a file."""
    mutants = []
    tree = ast.parse((ROOT / "fecontact" / file).read_text())
    for index, (node, function) in enumerate(places(tree)):
        if change := changed(node):
            mutants.append(Mutant(file, index, node.lineno, function, change))  # type: ignore[attr-defined]
    return mutants


def functions_with(mutant: Mutant) -> list[str]:
    """The function around a mutant.

    For a constant of the module these are the functions in its file that name it, or else the file.
    """
    if mutant.function:
        return [f"{mutant.file}:{mutant.function}"]
    tree = ast.parse((ROOT / "fecontact" / mutant.file).read_text())
    around = next(node for node in tree.body if node.lineno <= mutant.line <= (node.end_lineno or 0))
    names = {node.id for node in ast.walk(around) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    users = [
        f"{mutant.file}:{first_line(node)}"
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(name, ast.Name) and name.id in names for name in ast.walk(node))
    ]
    return users or [mutant.file]


def first_line(function: ast.FunctionDef) -> int:
    """As its compiled code has it."""
    return min([function.lineno, *(decorator.lineno for decorator in function.decorator_list)])


def mutated(mutant: Mutant) -> str:
    """The file with the change, its comments lost."""
    tree = ast.parse((ROOT / "fecontact" / mutant.file).read_text())
    changed(list(places(tree))[mutant.index][0])
    return ast.unparse(tree)


# ----------------------------------------------------------------------------------------------------------------------
# Runs


def environment(root: Path, **extra: str) -> dict[str, str]:
    """Environment variables of a run of mutants.

    One thread per process, the copy before the installed package, and no compiled file that outlives its mutant.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    variables = {"PYTHONPATH": f"{root}{os.pathsep}{root / 'tests'}", "PYTHONDONTWRITEBYTECODE": "1"}
    return {**os.environ, **threads, **variables, **extra}


def noted(folder: Path, files: list[str]) -> None:
    """Runs tests once, those that were not noted before, and notes their calls."""
    command = ["-m", "pytest", "-q", "-m", "not slow", "-p", "mutants", "-p", "no:cacheprovider", *files]
    subprocess.run([sys.executable, *command], cwd=ROOT, env=environment(ROOT, FECONTACT_CALLS=str(folder)))


def reached(folder: Path) -> tuple[dict[str, list[str]], dict[str, float]]:
    """Tests that call each function or file, and their seconds.

    Tests that call little else and take little time come first.
    """
    tests, seconds, cost = defaultdict(set), {}, {}
    path = folder / "calls.jsonl"
    for line in path.read_text().splitlines() if path.exists() else []:
        record = json.loads(line)
        seconds[record["test"]] = record["seconds"]
        cost[record["test"]] = (record["seconds"] + 0.05) * len(record["calls"])
        for function in record["calls"]:
            tests[function].add(record["test"])
            tests[function.partition(":")[0]].add(record["test"])
    return {key: sorted(callers, key=lambda test: (cost[test], test)) for key, callers in tests.items()}, seconds


def within(tests: list[str], seconds: dict[str, float], budget_s: float) -> list[str]:
    """The first tests that fit into the time, at least a single test."""
    chosen: list[str] = []
    for test in tests:
        budget_s -= seconds[test]
        if chosen and budget_s < 0.0:
            break
        chosen.append(test)
    return chosen


class First:
    """Reporter of the first failing test through a pipe."""

    def __init__(self, pipe: int) -> None:
        self.pipe = pipe

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Tells it."""
        if report.failed:
            os.write(self.pipe, f"{report.nodeid}\n".encode())


def noticing(root: Path, tests: list[str], seconds: dict[str, float]) -> str:
    """The test that fails first.

    "the end" if the process ends without a report, or nothing if all pass. The tests run in a separate process, which
    has all imports but the package.
    """
    reader, pipe = os.pipe()
    if (child := os.fork()) == 0:
        os.setpgid(0, 0)
        longest_s = int(START_S + MOST_TIMES * sum(seconds[test] for test in tests))
        resource.setrlimit(resource.RLIMIT_CPU, (longest_s, longest_s))
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
        # one that waits takes no CPU time
        signal.alarm(20 * longest_s)
        os.chdir(root)
        os.environ.update(environment(root))
        sys.path[:0], sys.dont_write_bytecode = [str(root), str(root / "tests")], True
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
        command = ["-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", *tests]
        os._exit(int(import_module("pytest").main(command, plugins=[First(pipe)])))
    os.close(pipe)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    with os.fdopen(reader) as lines:
        return "" if code in (0, 5) else lines.readline().strip() or "the end"


def noticed_by(
    root: Path, mutant: Mutant, tests: dict[str, list[str]], seconds: dict[str, float], most_s: float
) -> str:
    """The test that notices a mutant, "nobody", or "unreached"."""
    calling = list(dict.fromkeys(test for function in functions_with(mutant) for test in tests.get(function, [])))
    if not calling:
        return "unreached"
    nearest = within(calling[:FEW], seconds, FEW_S)
    files = {test.partition("::")[0] for test in calling}
    other_tests = [test for test in seconds if test.partition("::")[0] in files and seconds[test] < NOTED_S]
    other_tests = sorted(set(other_tests) - set(nearest), key=lambda test: (test not in calling, seconds[test], test))
    path = root / "fecontact" / mutant.file
    original = path.read_text()
    try:
        path.write_text(mutated(mutant))
        return (
            noticing(root, nearest, seconds)
            or (other_tests and noticing(root, within(other_tests, seconds, most_s), seconds))
            or "nobody"
        )
    finally:
        path.write_text(original)


def drawn(count: int, seed: int, room: str) -> list[Mutant]:
    """Random mutants, of a single room or file if it is named."""
    package = ROOT / "fecontact"
    names = []
    for each in ROOMS:
        paths = [package / each] if each.endswith(".py") else sorted((package / each).glob("*.py"))
        names += [path.relative_to(package).as_posix() for path in paths]
    mutants = [mutant for name in names if name.startswith(room) for mutant in mutants_of(name)]
    print(f"{count} of {len(mutants)} places")
    return random.Random(seed).sample(mutants, min(count, len(mutants)))


def finished(path: Path, again: bool) -> dict[Mutant, str]:
    """Results of earlier runs; `again` leaves out the mutants that nobody noticed."""
    results = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        record = json.loads(line)
        test, _ = record.pop("noticed_by"), record.pop("seconds")
        results[Mutant(**record)] = test
    return {mutant: test for mutant, test in results.items() if not again or test not in ("nobody", "unreached")}


def copied(root: Path) -> None:
    """A copy of the program with its tests."""
    for name in COPIED:
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, root / name)


def main() -> None:
    """Draw mutants, run their tests, and print the survivors.

    Finished mutants stay in the folder.
    """
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--room", default="", help="places of this room or file alone, such as fe or fe/section.py")
    parser.add_argument("--again", action="store_true", help="those that nobody noticed once more")
    parser.add_argument("--seconds", type=float, default=45.0, help="CPU time of tests after the first few, for each")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutants")
    parser.add_argument("tests", nargs="*", help="files of tests whose calls are noted before; all where none were")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.tests or not (options.out / "calls.jsonl").exists():
        noted(options.out, options.tests)
    tests, seconds = reached(options.out)
    record = options.out / "mutants.jsonl"
    before, counts = finished(record, options.again), defaultdict(int)
    for name in HEAVY:
        import_module(name)
    with TemporaryDirectory() as folder:
        copied(Path(folder))
        for number, mutant in enumerate(drawn(options.count, options.seed, options.room), 1):
            begun_s = time.monotonic()
            if mutant not in before:
                before[mutant] = noticed_by(Path(folder), mutant, tests, seconds, options.seconds)
                told = {**vars(mutant), "noticed_by": before[mutant], "seconds": time.monotonic() - begun_s}
                with record.open("a") as file:
                    file.write(json.dumps(told) + "\n")
            survives = before[mutant] in ("nobody", "unreached")
            counts[before[mutant] if survives else "noticed"] += 1
            if survives:
                print(
                    f"{number:4d} {before[mutant]}: fecontact/{mutant.file}:{mutant.line} {mutant.change}", flush=True
                )
    print(", ".join(f"{count} {noticer}" for noticer, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
