"""Kills of fleet commands at random times, and repetitions that must give equal files.

`python tests/crash_fleets.py [--kills N] [--sample] [--seed S]` (`make crash`) writes an example, screens a small fleet
and reports it; with `--sample` it also solves a sample by finite elements. Then it repeats each command in a new
folder, kills its main process, a worker or all of them (SIGKILL), and runs the command again. A third of the
repetitions is killed too. All files must have the bytes of the run without a kill, except times, memory and logs; no
temporary file and no process may be left.
"""

import argparse
import csv
import io
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import psutil
from fuzz_fleets import TABLES, write_fleet, write_rows

ROOT = Path(__file__).parents[1]
# Commands of 62 CPU s in all took 549 s while other programs ran; a hang has no end.
LONGEST_S = 600.0
TOO_LATE = "ended before the kill"
WHOM = ("main", "worker", "all")
COARSE = 'resolution = "quick"\nrefine = "never"\n'
RUN = ["fleet", "run", "trial/fleet.toml", "--out", "out", "--workers", "2"]
EXAMPLES = ["fleet", "examples", "example", "--wheels", "4", "--rails", "4"]
REPORT = ["fleet", "report", "out"]
SAMPLE = ["fleet", "sample", "out", "--finite-elements", "2", "--workers", "2"]
# times, memory, names of runs, and checksums of files that have these
EFFORT = {"seconds", "cpu_seconds", "fe_cpu_seconds", "memory_MB", "peak_memory_MB", "run", "sha256"}
# logs, and files that consist of times and checksums only in addition to compared files
NOT_COMPARED = {"said.txt", "run.log", "run.lock", "stored.json"}


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A command, its CPU time, and the folders before and after it without a kill."""

    words: list[str]
    before: Path
    after: Path
    cpu_s: float


def start(words: list[str], folder: Path) -> subprocess.Popen[bytes]:
    """Start a command in a folder, in a new session, to find all its processes."""
    command = [sys.executable, "-m", "fecontact", *words]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with (folder / "said.txt").open("ab") as said:
        return subprocess.Popen(command, cwd=folder, env=environment, stdout=said, stderr=said, start_new_session=True)


def list_processes(session: int) -> list[psutil.Process]:
    """Living processes of a session."""
    living = []
    for pid in psutil.pids():
        try:
            if os.getsid(pid) == session and (process := psutil.Process(pid)).status() != psutil.STATUS_ZOMBIE:
                living.append(process)
        except (OSError, psutil.Error):
            continue
    return living


def measure_cpu_s(session: int) -> float:
    """CPU time of a session so far, with the processes that have ended."""
    total_s = 0.0
    for process in list_processes(session):
        try:
            total_s += sum(process.cpu_times()[:4])
        except psutil.Error:
            continue
    return total_s


def kill(process: subprocess.Popen[bytes], whom: str, rng: random.Random) -> None:
    """Kill the main process, a worker or all processes of a command."""
    living = list_processes(process.pid)
    workers = [member for member in living if member.pid != process.pid and "spawn_main" in " ".join(member.cmdline())]
    main = [member for member in living if member.pid == process.pid]
    chosen = {"main": main, "worker": [rng.choice(workers)] if workers else main, "all": living}[whom]
    for member in chosen:
        try:
            member.send_signal(signal.SIGKILL)
        except psutil.NoSuchProcess:
            continue


def remove_effort(value: Any) -> Any:
    """Value of a JSON file without times, memory, names of runs and checksums."""
    if isinstance(value, dict):
        return {key: remove_effort(inner) for key, inner in value.items() if key not in EFFORT}
    return [remove_effort(inner) for inner in value] if isinstance(value, list) else value


def read_results(folder: Path) -> dict[str, object]:
    """Contents of the files that a repetition must give again, by their paths."""
    contents: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or path.name in NOT_COMPARED:
            continue
        name, content = path.relative_to(folder).as_posix(), path.read_bytes()
        if path.suffix == ".json":
            contents[name] = remove_effort(json.loads(content))
        elif path.name == "study.csv":
            contents[name] = [
                {key: value for key, value in row.items() if key not in EFFORT}
                for row in csv.DictReader(io.StringIO(content.decode("utf-8")))
            ]
        else:
            # the report of a study has the times of its cases
            contents[name] = b"" if name.endswith("sample/report.html") else content
    return contents


def find_leftovers(folder: Path) -> list[str]:
    """Temporary files and folders: their names begin with a point."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob(".*"))


def wait_for_end(session: int) -> list[str]:
    """Command lines of processes that outlive the main process by 20 s."""
    end = time.monotonic() + 20.0
    while (living := list_processes(session)) and time.monotonic() < end:
        time.sleep(0.2)
    return [" ".join(process.cmdline())[:80] for process in living]


def kill_once(words: list[str], folder: Path, cpu_s: float, whom: str, rng: random.Random) -> tuple[str, str]:
    """Kill a command at a CPU time; returns its end and any problem.

    CPU time decides, since the time on the clock depends on other programs.
    """
    process = start(words, folder)
    while process.poll() is None and measure_cpu_s(process.pid) < cpu_s:
        time.sleep(0.05)
    if process.poll() is not None:
        return TOO_LATE, ""
    kill(process, whom, rng)
    try:
        code = process.wait(timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return "", f"hangs for {LONGEST_S:g} s after the kill"
    if living := wait_for_end(process.pid):
        os.killpg(process.pid, signal.SIGKILL)
        return "", f"leaves processes: {living}"
    return f"exit code {code}", ""


def try_kill(stage: Stage, folder: Path, seed: str) -> tuple[str, str, bool]:
    """Kill a command and run it again; returns the kills, any problem, and whether a kill came before the end.

    A third of the commands is killed twice.

    The tables have the paths of the profiles in `folder`, which must be that of the runs without a kill.
    """
    rng, ends, killed = random.Random(seed), [], False
    shutil.rmtree(folder)
    shutil.copytree(stage.before, folder)
    for _ in range(rng.choice((1, 1, 2))):
        # half of the kills hit the end, where the tables are written
        share, whom = rng.uniform(*rng.choice(((0.05, 1.0), (0.8, 1.0)))), rng.choice(WHOM)
        end, problem = kill_once(stage.words, folder, share * stage.cpu_s, whom, rng)
        ends.append(f"{whom} killed after {share * stage.cpu_s:.1f} of {stage.cpu_s:.1f} CPU s, {end}")
        killed |= end != TOO_LATE
        if problem:
            return f"seed {seed}: {'; '.join(ends)}", problem, killed
    return f"seed {seed}: {'; '.join(ends)}", find_difference(stage, folder), killed


def find_difference(stage: Stage, folder: Path) -> str:
    """Run a killed command to its end; returns any difference from the run without a kill."""
    again = start(stage.words, folder)
    try:
        if (second := again.wait(timeout=LONGEST_S)) not in (0, 3):
            return f"exit code {second} of the last run: {(folder / 'said.txt').read_text()[-300:]!r}"
    except subprocess.TimeoutExpired:
        os.killpg(again.pid, signal.SIGKILL)
        return "the last run hangs"
    if living := wait_for_end(again.pid):
        os.killpg(again.pid, signal.SIGKILL)
        return f"the last run leaves processes: {living}"
    if leftovers := find_leftovers(folder):
        return f"leaves {leftovers[:3]}"
    results, expected = read_results(folder), read_results(stage.after)
    names = [name for name in sorted({*results, *expected}) if results.get(name) != expected.get(name)]
    return f"different {', '.join(names[:5])}" if names else ""


def prepare_stages(temporary: Path, work: Path, *, with_sample: bool = False) -> dict[str, Stage]:
    """Run each command without a kill, and copy `work` before and after it."""
    commands = {"examples": EXAMPLES, "run": RUN, **({"sample": SAMPLE} if with_sample else {}), "report": REPORT}
    path = write_fleet(work / "trial")
    path.write_text(path.read_text("utf-8") + COARSE, "utf-8")
    write_rows(path.with_name("positions.csv"), TABLES["positions"][:1])
    before, stages = shutil.copytree(work, temporary / "start"), {}
    for name, words in commands.items():
        begin = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert start(words, work).wait(timeout=LONGEST_S) in (0, 3), (work / "said.txt").read_text()
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        after = shutil.copytree(work, temporary / name)
        cpu_s = end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime
        stages[name] = Stage(words=words, before=before, after=after, cpu_s=cpu_s)
        before = after
    return stages


def crash(kills: int, seed: int, *, with_sample: bool = False) -> Iterator[tuple[str, str, bool]]:
    """Kill each command of a fleet in turn; yields each kill, any problem, and whether it came before the end."""
    with TemporaryDirectory() as temporary:
        work = Path(temporary) / "work"
        stages = prepare_stages(Path(temporary), work, with_sample=with_sample)
        for number in range(kills):
            name = list(stages)[number % len(stages)]
            what, problem, killed = try_kill(stages[name], work, f"{seed}.{number}")
            yield f"fleet {name}, {what}", problem, killed


def main() -> int:
    """Kill fleet commands and print the counts."""
    parser = argparse.ArgumentParser(description="Kill fleet commands at random times and run them again.")
    parser.add_argument("--kills", type=int, default=32)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sample", action="store_true", help="also the sample by finite elements")
    options = parser.parse_args()
    bad_count = killed_count = 0
    for what, problem, killed in crash(options.kills, options.seed, with_sample=options.sample):
        print(f"{what}{': ' * bool(problem)}{problem}", flush=True)
        bad_count += bool(problem)
        killed_count += killed
    print(f"kills: {options.kills} tried, {killed_count} before the end, {bad_count} bad")
    return int(bool(bad_count))


if __name__ == "__main__":
    sys.exit(main())
