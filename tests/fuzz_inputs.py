"""Damaged vehicles, tolerances, baselines, studies and positions: used, or refused with a remedy.

`python tests/fuzz_inputs.py [--count N] [--seed S] [--kind K]` (part of `make fuzz`) changes a file that a command
reads, and runs the command. It prints how many were tried, used, refused and bad. Bad files stay in `fuzz_failures/`.
"""

import argparse
import contextlib
import os
import random
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files as files_of
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz_commands import Ended
from fuzz_fleets import Tally, change_bytes, find_problem, run_timed, write_fleet
from fuzz_results import STUDIES

VEHICLES = files_of("fecontact.features.curves") / "data"
TOLERANCES = """[kinds.pressure]
relative = 0.01
[columns.p_max_fe_MPa]
relative = 0.01
absolute = 0.5
"""
TABLE = "id,p_max_fe_MPa,area_fe_mm2,note\na,1.0,100.0,x\nb,2.5,90.0,y\n"
BASELINE = '{"schema": "fecontact/baseline/1", "study": "base", "reason": "x", "versions": {"numpy": "2"}}\n'
POSITIONS = "shift_mm,load_kN,weight\n0.0,60.0,1.0\n3.0,90.0,2.0\n"
VALUES = (
    "nan", "-inf", "1e400", "9" * 400, "-1", "0", "1e308", "1e-308", "true", '"x"', '""', "[]", "[[1], [2]]", "{}",
    "{a = 1}", "[" * 5000, "[" * 80 + "]" * 80, "1979-05-27", "07:32:00", "0xff", "1_000", '"\\u202e"', '"""', "'",
    '"' + "x" * 20_000 + '"', "[" + "1, " * 20_000 + "]", "1,5", "1;5", "", "=1+1", "ü", '"\\ud800"',
)  # fmt: skip
KEYS = (
    "x", "k" * 50_000, ".".join("k" * 50_000), '"a b"', '""', "name", "1", "nan", "__class__", "é", '"\\u0000"',
    "relative.x", "[" * 300,
)  # fmt: skip
# a remedy has one of these words
_REMEDY = re.compile(r"; |: give |allowed|is not valid TOML")


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Kind of an input file: its good contents, its name, and the command that reads it."""

    contents: Callable[[], tuple[str, ...]]
    name: str
    line: tuple[str, ...]


KINDS: Mapping[str, Kind] = {
    "vehicle": Kind(
        contents=lambda: tuple((VEHICLES / f"{name}.toml").read_text("utf-8") for name in ("wheelset", "manchester")),
        name="x.toml",
        line=("curve", "--vehicle=x.toml", "--radii=2000"),
    ),
    "tolerance": Kind(
        contents=lambda: (TOLERANCES,), name="x.toml", line=("compare", "table.csv", "table.csv", "--tolerance=x.toml")
    ),
    "baseline table": Kind(contents=lambda: (TABLE,), name="base.csv", line=("compare", "base.csv", "table.csv")),
    "baseline record": Kind(contents=lambda: (BASELINE,), name="base.json", line=("compare", "base.csv", "table.csv")),
    "study": Kind(contents=lambda: (STUDIES,), name="x.toml", line=("check", "x.toml")),
    "positions": Kind(
        contents=lambda: (POSITIONS,), name="trial/positions.csv", line=("fleet", "check", "trial/fleet.toml")
    ),
}


def damage(content: str, rng: random.Random) -> bytes:
    """Damaged bytes of a text file."""
    content_bytes = content.encode()
    lines = content.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    key, equals, _ = lines[at].partition("=")
    cells = lines[at].rstrip("\n").split(",")
    value = rng.choice(VALUES)
    match rng.randrange(12):
        case 0:
            return content_bytes[: rng.randrange(len(content_bytes))]
        case 1 | 2:
            return change_bytes(content_bytes, rng)
        case 3:
            return content.encode(rng.choice(("utf-16", "utf-32", "utf-8-sig", "utf-7", "cp037")))
        case 4:
            return rng.choice((b"", b"\n", b"\0" * 1000, b"\xff\xfe", b"#" * 100_000, b"[" * 100_000, b"\r" * 1000))
        case 5:
            lines.insert(at, f"{rng.choice(KEYS)} = {value}\n")
        case 6:
            lines.insert(at, rng.choice(lines))
        case 7:
            del lines[at]
        case 8:
            lines[at] = f"{rng.choice(KEYS)}{equals or ','}{lines[at].partition('=')[2] or value}\n"
        case 9 if not equals:
            lines[at] = ",".join([*cells, *([value] * rng.choice((1, 1, 20_000)))]) + "\n"
        case _:
            cells[rng.randrange(len(cells))] = value
            lines[at] = f"{key}= {value}\n" if equals else ",".join(cells) + "\n"
    return "".join(lines).encode("utf-8", "surrogatepass")


def find_refusal_problem(ended: Ended) -> str:
    """Problem of the end of a command; a comparison that finds differences has none."""
    if ended.code == 1 and "error: " not in ended.err and not ended.raised and "Traceback" not in ended.err:
        return ""
    problem = find_problem(ended)
    if not problem and ended.code == 2 and not _REMEDY.search(ended.err):
        return f"no remedy: {ended.err[-300:]!r}"
    return problem


def fuzz_input(kind: Kind, count: int, seed: int, keep: Path | None = None) -> Tally:
    """Damage a file of a kind a number of times and run its command."""
    rng, tally = random.Random(seed), Tally()
    with TemporaryDirectory() as folder, contextlib.chdir(folder):
        write_fleet(Path("trial"))
        for name, text in (("table.csv", TABLE), ("base.csv", TABLE), ("base.json", BASELINE)):
            Path(name).write_text(text, "utf-8")
        for number in range(count):
            content_bytes = damage(rng.choice(kind.contents()), rng)
            Path(kind.name).write_bytes(content_bytes)
            ended = run_timed([*kind.line])
            tally.tried += 1
            if problem := find_refusal_problem(ended):
                tally.bad.append(f"{number}: {content_bytes[:60]!r}: {problem}")
                if keep is not None:
                    keep.mkdir(exist_ok=True)
                    (keep / f"{seed}_{number}_{Path(kind.name).name}").write_bytes(content_bytes)
            else:
                tally.endings["refused" if ended.code == 2 else "used"] += 1
    return tally


def main() -> int:
    """Fuzz all kinds of input files and print the counts."""
    parser = argparse.ArgumentParser(description="Damage vehicles, tolerances, baselines, studies and positions.")
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", action="append", choices=KINDS)
    options = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    keep = Path("fuzz_failures").absolute()
    bad = 0
    for name in options.kind or KINDS:
        tally = fuzz_input(KINDS[name], options.count, options.seed, keep)
        print(f"{name}: {tally}", flush=True)
        for text in tally.bad:
            print(f"      {text}")
        bad += len(tally.bad)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
