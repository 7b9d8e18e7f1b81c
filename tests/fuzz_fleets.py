"""Damaged fleets: file, tables and finished folder; each is used, or refused in a line, and nothing else happens.

`python tests/fuzz_fleets.py [--count N] [--seed S]` (part of `make fuzz`) changes the file of a fleet, its tables of
wheels, rails, pairs and positions (CSV and Parquet), and finished folders of a fleet. It prints how many were tried,
used, refused and bad. Bad ones stay in `fuzz_failures/`.
"""

import argparse
import contextlib
import csv
import io
import json
import os
import random
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pyarrow
from fuzz_commands import LONGEST_MESSAGE, Ended, run
from fuzz_results import INSERTED, mutate
from inline import inline_crew, stand_ins
from pyarrow import parquet

from fecontact.files import SEAL_KEY, write_sealed
from fecontact.profiles.library import load_library_profile
from fecontact.profiles.writers import csv_text

SLOWEST_S, LONGEST_S = 30.0, 60.0
FLEET = """seed = 1
theory = "strip"
[wheels]
files = "wheels{ending}"
[rails]
files = ["rails{ending}", "60E1"]
[pairs]
table = "pairs{ending}"
[positions]
table = "positions{ending}"
[case]
inclination = "1:40"
"""
RANGES = """[shifts_mm]
normal = [0.0, 2.0]
count = 2
[loads_kN]
values = [60, 100]
weights = [1, 2]
"""
TABLES: dict[str, list[dict[str, Any]]] = {
    "wheels": [{"file": "wheel.csv", "name": "w", "weight": 1.0, "mirror": False, "rolling_radius_mm": 460.0}],
    "rails": [{"file": "rail.csv", "name": "r", "weight": 2.0, "line": "A"}],
    "pairs": [{"wheel": "w", "rail": "r", "weight": 1.0}, {"wheel": "w", "rail": "60E1", "weight": 1.0}],
    "positions": [{"shift_mm": 0.0, "load_kN": 60.0, "weight": 1.0}, {"shift_mm": 3.0, "load_kN": 90.0, "weight": 2.0}],
}
VALUES = (
    "", " ", "nan", "inf", "-1", "0", "1e400", "9" * 400, "007", "1,5", "yes", "no", "TRUE", "left", "x" * 5000, "ü",
    "../../../../etc/passwd", "/dev/zero", "/", ".", "*", "[a-", "**", "$\\frac{$", "=1+1", "'; DROP TABLE screen;--",
    '"', "a\nb", "\u202e", "\x1b[2J", "<script>", "60E1", "pipe", "folder", "loop", "away", "wheel.csv", "w", "\ufffe",
)  # fmt: skip
TYPED = (
    None, True, -1, 2**62, 1e308, float("nan"), b"\xff\xfe", [1, 2], {"a": 1}, "x", "", *VALUES,
)  # fmt: skip
COLUMNS = (
    "status",
    "reason",
    "wear_mm",
    "noise_um",
    "body",
    "name",
    "Weight",
    "weight",
    "mirror",
    "",
    "a" * 300,
    "$x_",
)


@dataclass
class Tally:
    """Counts of tried, used and refused inputs, and problems of the bad inputs."""

    tried: int = 0
    endings: Counter[str] = field(default_factory=Counter)
    bad: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {ending}" for ending, count in sorted(self.endings.items()))
        return f"{self.tried} tried: {counts}; {len(self.bad)} bad"

    def add(self, line: list[str], what: str, keep: Callable[[int], object] | None = None) -> Ended:
        """Run a command line, and count its end."""
        ended = run_timed(line)
        self.tried += 1
        if problem := find_problem(ended):
            self.bad.append(f"{what}; {' '.join(line)[:120]}: {problem}")
            if keep:
                keep(len(self.bad))
        else:
            self.endings["used" if ended.code in (0, 3) else "refused"] += 1
        return ended


def run_timed(line: list[str]) -> Ended:
    """Run a command line in this process, with its jobs, for at most `LONGEST_S`."""
    with stand_ins(inline_crew(), None, ""):
        return run(line, slowest_s=SLOWEST_S, longest_s=LONGEST_S)


def find_problem(ended: Ended) -> str:
    """Problem of the end of a command; empty after a result or a refusal in a line."""
    if ended.raised:
        return ended.raised
    if "Traceback" in ended.err or "Exception ignored" in ended.err:
        return f"prints a traceback: {ended.err[-200:]!r}"
    if ended.code in (0, 3):
        return ""
    if ended.code not in (1, 2):
        return f"exit code {ended.code}: {ended.err[-300:]!r}"
    lines = [line for line in ended.err.splitlines() if line.startswith("error: ")]
    after = ended.err[ended.err.rfind("error: ") :] if lines else ""
    if len(lines) != 1 or "\n" in after.rstrip("\n") or len(after) > LONGEST_MESSAGE:
        return f"no refusal in one line: {ended.err[-300:]!r}"
    return ""


def write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write a table as CSV or Parquet."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    if path.suffix == ".csv":
        text = io.StringIO()
        writer = csv.DictWriter(text, names)
        writer.writeheader()
        writer.writerows(rows)
        path.write_bytes(text.getvalue().encode("utf-8", "surrogatepass"))
        return
    columns: dict[str, Any] = {}
    for name in names:
        values = [row.get(name) for row in rows]
        try:
            columns[name] = pyarrow.array(values)
        except (pyarrow.ArrowException, TypeError, ValueError, OverflowError):
            columns[name] = pyarrow.array([None if value is None else str(value) for value in values])
    parquet.write_table(pyarrow.table(columns), path)


def write_fleet(folder: Path, ending: str = ".csv") -> Path:
    """Write a fleet of a wheel on two rails, with tables of an ending; returns its file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "wheel.csv").write_text(csv_text(load_library_profile("S1002"), step_mm=0.5), "utf-8")
    (folder / "rail.csv").write_text(csv_text(load_library_profile("54E1"), step_mm=0.5), "utf-8")
    for name, rows in TABLES.items():
        write_rows(folder / f"{name}{ending}", rows)
    path = folder / "fleet.toml"
    path.write_text(FLEET.format(ending=ending), "utf-8")
    return path


def add_hostile_files(folder: Path) -> None:
    """Add a pipe, a folder and two broken links, which tables may name."""
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    (folder / "loop").symlink_to("loop")
    (folder / "away").symlink_to("/nowhere/at/all")


def change_bytes(content: bytes, rng: random.Random) -> bytes:
    """Change, remove, repeat or insert bytes."""
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(changed) + 1)
        match rng.randrange(4):
            case 0:
                changed[at : at + 1] = bytes([rng.randrange(256)])
            case 1:
                del changed[at : at + rng.choice((1, 1, 10, 80))]
            case 2:
                changed[at:at] = changed[at : at + rng.choice((1, 10, 80))]
            case _:
                changed[at:at] = rng.choice(INSERTED)
    return bytes(changed)


def change_rows(rows: list[dict[str, Any]], values: tuple[Any, ...], rng: random.Random) -> str:
    """Change a value, a column or a row of a table; returns the change."""
    row = rng.choice(rows)
    match rng.randrange(5):
        case 0 | 1:
            name = rng.choice(list(row))
            row[name] = rng.choice(values)
            return f"{name} = {row[name]!r:.60}"
        case 2:
            name, new = rng.choice(list(row)), rng.choice(COLUMNS)
            for changed_row in rows:
                changed_row[new] = changed_row.pop(name, None)
            return f"{name} renamed {new!r:.30}"
        case 3:
            name = rng.choice(COLUMNS)
            for changed_row in rows:
                changed_row[name] = rng.choice(values)
            return f"column {name!r:.30} = {rows[0][name]!r:.60}"
        case _:
            rows.append(dict(row)) if rng.random() < 0.5 else rows.remove(row)
            return "a row twice, or removed"


def damage_inputs(folder: Path, ending: str, rng: random.Random) -> str:
    """Change the file of a fleet or a table; returns the change."""
    if rng.random() < 0.4:
        path = folder / "fleet.toml"
        if rng.random() < 0.5:
            path.write_text(path.read_text("utf-8").partition("[positions]")[0] + RANGES, "utf-8")
        if rng.random() < 0.4:
            key, value = rng.choice(("files", "table", "draw", "seed", "inclination")), rng.choice(VALUES)
            lines = [f"{key} = {json.dumps(value)}" if x.startswith(key) else x for x in path.read_text().splitlines()]
            path.write_text("\n".join(lines), "utf-8", "surrogatepass")
            return f"fleet.toml: {key} = {value!r:.60}"
        path.write_bytes(change_bytes(path.read_bytes(), rng))
        return "fleet.toml"
    name = rng.choice(list(TABLES))
    path = folder / f"{name}{ending}"
    if rng.random() < 0.3:
        path.write_bytes(change_bytes(path.read_bytes(), rng))
        return f"{path.name}: bytes"
    rows = [dict(row) for row in TABLES[name]]
    what = change_rows(rows, VALUES if ending == ".csv" else TYPED, rng)
    write_rows(path, rows)
    return f"{path.name}: {what}"


def keep_in(keep: Path | None, folder: Path, name: str) -> Callable[[int], object] | None:
    """Function that copies a folder to the failures."""
    if keep is None:
        return None
    return lambda number: shutil.copytree(
        folder,
        keep / f"{name}_{number}",
        symlinks=True,
        dirs_exist_ok=True,
        # a pipe would be waited for
        ignore=lambda *_: ["pipe"],
    )


def fuzz_inputs(count: int, seed: int, keep: Path | None = None, *, screen_every: int = 5) -> Tally:
    """Change and check the inputs of a fleet a number of times.

    Every `screen_every`-th usable fleet is screened.
    """
    rng, tally = random.Random(seed), Tally()
    for number in range(count):
        with TemporaryDirectory() as temporary, contextlib.chdir(temporary):
            ending = rng.choice((".csv", ".parquet"))
            folder = write_fleet(Path("trial"), ending).parent
            add_hostile_files(folder)
            what = damage_inputs(folder, ending, rng)
            keep_copy = keep_in(keep, folder, f"fleet_{seed}_{number}")
            checked = tally.add(["fleet", "check", "trial/fleet.toml"], what, keep_copy)
            if checked.code == 0 and number % screen_every == 0:
                tally.add(["fleet", "run", "trial/fleet.toml", "--out=out", "--workers=1"], what, keep_copy)
    return tally


def damage_results(folder: Path, rng: random.Random) -> str:
    """Change a file of a finished fleet; in half of the draws all tables get new checksums."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".lock"]
    path = rng.choice(paths)
    name = path.relative_to(folder).as_posix()
    if path.suffix == ".parquet" and rng.random() < 0.7:
        rows = parquet.read_table(path).to_pylist()
        what = change_rows(rows, TYPED, rng)
        write_rows(path, rows or [{}])
    elif path.name == "fleet.json" and rng.random() < 0.7:
        record = json.loads(path.read_text("utf-8"))
        record.pop(SEAL_KEY, None)
        what = mutate(record, rng)
        with contextlib.suppress(UnicodeEncodeError):
            write_sealed(path, record, list_tables(folder))
    elif rng.random() < 0.3:
        path.unlink()
        what = "removed"
    else:
        path.write_bytes(change_bytes(path.read_bytes(), rng))
        what = "bytes"
    if rng.random() < 0.5:
        what += "; new checksums" * renew_checksums(folder)
    return f"{name}: {what}"


def list_tables(folder: Path) -> list[Path]:
    """Tables of a finished fleet that have checksums in `fleet.json`."""
    paths = [folder / "profiles.parquet", folder / "fleet.toml", *sorted((folder / "screen").iterdir())]
    return [path for path in paths if path.is_file()]


def renew_checksums(folder: Path) -> bool:
    """Give the present tables of a finished fleet new checksums; returns whether the record could be read."""
    try:
        record = json.loads((folder / "fleet.json").read_text("utf-8"))
        record.pop(SEAL_KEY, None)
        write_sealed(folder / "fleet.json", record, list_tables(folder))
    except (OSError, ValueError, TypeError, AttributeError):
        return False
    return True


def finished_fleet(folder: Path) -> Path:
    """Screen the fleet in a folder; returns the folder of its results."""
    write_fleet(folder / "trial")
    with contextlib.chdir(folder):
        ended = run_timed(["fleet", "run", "trial/fleet.toml", "--out=out", "--workers=1"])
    assert ended.code == 0, ended
    return folder / "out"


def fuzz_finished(count: int, seed: int, keep: Path | None = None) -> Tally:
    """Change a file of a finished fleet a number of times; report it, and screen it again.

    A report must have the answer of the unchanged fleet. A record with a new checksum may change it.
    """
    rng, tally = random.Random(seed), Tally()
    with TemporaryDirectory() as temporary:
        original = finished_fleet(Path(temporary) / "fleet")
        expected = report_copy(original.parent, Path(temporary) / "reported")
        for number in range(count):
            folder = Path(temporary) / str(number)
            shutil.copytree(original.parent, folder)
            with contextlib.chdir(folder):
                what = damage_results(folder / "out", rng)
                keep_copy = keep_in(keep, folder, f"finished_{seed}_{number}")
                for line in finished_lines(rng):
                    ended = tally.add(line, what, keep_copy)
                    is_report = "report" in line and ended.code == 0
                    if is_report and not what.startswith("fleet.json") and read_answer() != expected:
                        tally.bad.append(f"{what}; {' '.join(line)}: a different answer")
            shutil.rmtree(folder)
    return tally


def report_copy(fleet: Path, copy: Path) -> bytes:
    """Report a copy of a finished fleet; returns the answer."""
    shutil.copytree(fleet, copy)
    with contextlib.chdir(copy):
        assert run_timed(["fleet", "report", "out"]).code == 0
        return read_answer()


def read_answer() -> bytes:
    """Table of the answer of the fleet in this folder."""
    return Path("out/answer.csv").read_bytes()


def finished_lines(rng: random.Random) -> Iterator[list[str]]:
    """Commands on a finished fleet; a second run costs more than a report, and is in a third of the draws."""
    yield ["fleet", "report", "out", *rng.choice(([], ["--json"]))]
    if rng.random() < 0.3:
        yield ["fleet", "run", "trial/fleet.toml", "--out=out", "--workers=1"]
        yield ["fleet", "report", "out", "--json"]


def main() -> int:
    """Fuzz fleets and print the counts."""
    parser = argparse.ArgumentParser(description="Damage fleets: inputs and finished folders.")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--finished", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    os.environ.setdefault("COLUMNS", "200")
    keep = Path("fuzz_failures").absolute()
    bad = 0
    for name, tally in (
        ("fleet inputs", fuzz_inputs(options.count, options.seed, keep)),
        ("finished fleets", fuzz_finished(options.finished, options.seed, keep)),
    ):
        print(f"{name}: {tally}", flush=True)
        for text in tally.bad:
            print(f"      {text}")
        bad += len(tally.bad)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
