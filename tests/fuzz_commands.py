"""Command lines at random: each ends with an exit code that the manual names, in time, and without a wrong number.

`python tests/fuzz_commands.py [--count N] [--seed S]` (part of `make fuzz`) draws commands that solve nothing, with
options and values of all kinds, and ends with exit code 1 if one of them raises, takes longer than it may, says what
nobody reads, or prints a number that is none.
"""

import argparse
import contextlib
import io
import os
import random
import re
import resource
import shlex
import signal
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fecontact.cli import app, call
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.writers import csv_text

SLOWEST_S, LONGEST_MESSAGE, MOST_BYTES = 20.0, 1200, 6_000_000_000
# what is drawn more often is what has more inputs; no command here meshes or solves
_DRAWN = (
    *(3 * ["hertz"]), *(3 * ["place"]), *(2 * ["creep"]), *(2 * ["theory"]), *(2 * ["table"]), "geometry", "profiles",
    "check", "compare", "judge", "view", "init", "guide", "curve", "baseline", "theories",
)  # fmt: skip
# a feature's command goes with it
COMMANDS = tuple(command for command in _DRAWN if command in app)
# what a command needs beside its options
POSITIONS = {
    "theory": ("hertz", "strip", "half_space", "analyn", "kpec", "stripe", ""),
    "profiles": ("", "60E1", "S1002", "good.csv", "UIC60", "missing.csv", "folder"),
    "check": ("good.toml", "bad.toml", "good.csv", "folder", "missing.toml", "/dev/null"),
    "compare": ("good.csv other.csv", "folder folder", "missing other.csv", "table.csv table.csv", ""),
    "judge": ("folder", "missing", "good.toml"),
    "view": ("folder", "missing"),
    "init": ("new", "folder", "good.toml/new", ""),
    "guide": ("", "results", "result", "../conventions", "x" * 300),
    "baseline": ("update folder", "update", "folder"),
}
NUMBERS = (
    "0", "1", "-1", "3", "0.5", "100", "460", "1e-308", "-1e-308", "1e308", "-1e308", "1e15", "1e-9", "nan", "inf",
    "-inf", "1_000", "0x10", "١", "", " ", "1,5", "3mm", "1:40", "9" * 400, "-0.0",
)  # fmt: skip
USUAL = ("0.1", "0.5", "1", "2", "3", "5", "20", "60", "100", "460", "1360", "100000")
TEXTS = (
    "60E1", "S1002", "54E1", "60E2", "UIC60", "MBench_UIC60", "A100", "circle:300", "circle:0", "circle:1e308",
    "circle:nan", "cylinder:460", "cylinder:-1", "arcs:300/80@2.5", "arcs:300/80@-1", "arcs:1/1@0", "good.csv",
    "folder",
    "missing.csv", "/dev/null", "bad.toml", "quick", "fine", "0.5,0.4", "1e-9,1e-9", "1e9,1e9", "none", "auto", "all",
    "strength", "patch,", "touching", "loaded", "given", "left", "right", "y,z", "2,3", "0,0", "-4:4:2", "-6:6:1e-9",
    "1:0:1", "x" * 3000, "\x00", "ü", "'", "--", "steel", "m", "yes", "no", "manchester", "pressure",
)  # fmt: skip


def options(command: str) -> list[tuple[str, bool]]:
    """Names of a command's options, and whether each takes a value."""
    node: Any = app[command] if command != "baseline" else app["baseline"]["update"]
    return [
        (name, argument.hint not in (bool, bool | None))
        for argument in node.assemble_argument_collection()
        for name in argument.names
        if name.startswith("--")
    ]


def words(rng: random.Random) -> list[str]:
    """A command line."""
    command = rng.choice(COMMANDS)
    line = [command, *shlex.split(rng.choice(POSITIONS.get(command, ("",))))]
    known_options = options(command)
    for _ in range(rng.choice((0, 1, 1, 2, 3, 5)) if known_options else 0):
        name, valued = rng.choice(known_options)
        if command == "curve" and name == "--workers":
            continue
        value = rng.choice(rng.choice((USUAL, USUAL, USUAL, NUMBERS, TEXTS)))
        if rng.random() < 0.03:
            name = name[:-1] + rng.choice("xyz")
        line += [f"{name}={value}"] if valued else [name]
    if command == "table" and not any(word.startswith("--shifts") for word in line):
        line += ["--shifts=-4:4:4", "--loads-kn=50"]
    if command == "creep" and rng.random() < 0.7:
        line += [*("--a-mm", "5.8", "--b-mm", "8.5", "--normal-force-kn", "100", "--friction", "0.3")]
    return line


def files(folder: Path) -> None:
    """Files that the command lines use."""
    for name, text in {
        "good.csv": csv_text(load_library_profile("54E1"), step_mm=0.5),
        "other.csv": csv_text(load_library_profile("60E1"), step_mm=0.5),
        "good.toml": 'load_kN = [50, 100]\nlateral_shift_mm = "-4:4:4"\n',
        "bad.toml": "load_kN = [[1]]\n[case\n",
        "table.csv": "id,p_max_fe_MPa\na,1.0\nb,nan\n",
    }.items():
        (folder / name).write_text(text, "utf-8")
    (folder / "folder").mkdir()


class TooLong(BaseException):
    """The time of a command line is over."""


def _stop(*_: object) -> None:
    raise TooLong


@dataclass(frozen=True, kw_only=True)
class Ended:
    """End of a command line: exit code or raised exception, and printed text."""

    code: int | None
    raised: str
    out: str
    err: str
    cpu_s: float


def run(line: list[str], *, slowest_s: float = SLOWEST_S, longest_s: float = 0.0) -> Ended:
    """Run a command line in this process.

    Limits are `slowest_s` of CPU time, and `longest_s` on the clock if it is not zero.
    """
    out, err = io.StringIO(), io.StringIO()
    signal.signal(signal.SIGVTALRM, _stop)
    signal.signal(signal.SIGALRM, _stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, slowest_s)
    signal.setitimer(signal.ITIMER_REAL, longest_s)
    start, code, raised = time.process_time(), None, ""
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = call(line)
    except TooLong:
        raised = f"took more than {slowest_s:g} CPU s" + (f", or {longest_s:g} s" if longest_s else "")
    except (Exception, SystemExit) as error:
        raised = f"{type(error).__name__}: {str(error)[:200]}"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    cpu_s = time.process_time() - start
    return Ended(code=code, raised=raised, out=out.getvalue(), err=err.getvalue(), cpu_s=cpu_s)


def no_numbers(text: str) -> list[str]:
    """Words of a text in place of numbers, such as nan."""
    return re.findall(r"(?<![\w./-])[+-]?(?:nan|inf)(?![\w./-])", text, re.IGNORECASE)


def tried(line: list[str]) -> tuple[str, str]:
    """Run a command line; returns its exit code, or a failure with its words."""
    ended = run(line)
    if ended.raised:
        return "failure", ended.raised
    if ended.code not in (0, 1, 2, 3):
        return "failure", f"exit code {ended.code}"
    if ended.code == 2 and not 0 < len(ended.err) < LONGEST_MESSAGE:
        return "failure", f"a message of {len(ended.err)} characters"
    numbers = no_numbers(ended.out)
    if ended.code == 0 and numbers and not any(word.endswith(("nan", "inf")) for word in line):
        return "failure", f"prints {numbers[0]}"
    return f"exit code {ended.code}", f"{ended.cpu_s:.1f} CPU s"


def fuzz_commands(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Draw command lines; returns their endings and the failures."""
    rng, endings, failures = random.Random(seed), Counter[str](), []
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        files(Path(folder))
        resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, hard))
        try:
            for _ in range(count):
                line = words(rng)
                result, said = tried(line)
                endings[result] += 1
                if result == "failure":
                    failures.append(f"{shlex.join(word[:80] for word in line)}: {said}")
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    return endings, failures


def main() -> int:
    """Fuzz the command line and print the endings."""
    parser = argparse.ArgumentParser(description="Draw command lines at random.")
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    endings, failures = fuzz_commands(options.count, options.seed)
    print(f"command lines: {dict(endings)}", flush=True)
    for text in failures:
        print(f"      {text}")
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
