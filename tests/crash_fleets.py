"""Kills of fleet commands at random times, and repetitions that must give equal tables.

`python tests/crash_fleets.py [--kills N] [--sample] [--seed S]` (`make crash`) screens a small fleet and reports it;
with `--sample` it also solves a sample by finite elements. Then it repeats each command in a new folder, kills its main
process, a worker or all of them (SIGKILL), and runs the command again. The tables must have the bytes of the run
without a kill; no temporary file and no process may be left.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
from fuzz_fleets import write_fleet

ROOT = Path(__file__).parents[1]
LONGEST_S = 240.0
WHOM = ("main", "worker", "all")
COARSE = 'resolution = "quick"\nrefine = "never"\n'
# the report has the time of its making, and pictures have no result that a table lacks
TABLES = ("*.parquet", "answer.csv", "study.csv")


def start(words: list[str], folder: Path) -> subprocess.Popen[bytes]:
    """Start a command in a folder, in a new session, to find all its processes."""
    command = [sys.executable, "-m", "fecontact", *words]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with (folder / "said.txt").open("ab") as said:
        return subprocess.Popen(command, cwd=folder, env=environment, stdout=said, stderr=said, start_new_session=True)


def list_processes(session: int) -> list[psutil.Process]:
    """Living processes of a session."""
    living = []
    for process in psutil.process_iter():
        try:
            if os.getsid(process.pid) == session and process.status() != psutil.STATUS_ZOMBIE:
                living.append(process)
        except (OSError, psutil.Error):
            continue
    return living


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


def read_tables(out: Path) -> dict[str, bytes]:
    """Bytes of the tables of a finished fleet, by their paths."""
    paths = {path for pattern in TABLES for path in out.rglob(pattern) if path.suffix}
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in sorted(paths)}


def find_leftovers(out: Path) -> list[str]:
    """Temporary files and folders: their names begin with a point."""
    return sorted(path.relative_to(out).as_posix() for path in out.rglob(".*"))


def wait_for_end(session: int) -> list[str]:
    """Command lines of processes that outlive the main process by 20 s."""
    end = time.monotonic() + 20.0
    while (living := list_processes(session)) and time.monotonic() < end:
        time.sleep(0.2)
    return [" ".join(process.cmdline())[:80] for process in living]


def try_kill(
    words: list[str], before: Path, after: Path, folder: Path, duration_s: float, seed: str
) -> tuple[str, str]:
    """Kill a command and run it again; returns the kill and the problem, if any.

    `before` and `after` are copies of `folder` without a kill; the tables have the paths of the profiles in `folder`.
    """
    rng = random.Random(seed)
    whom, delay_s = rng.choice(WHOM), rng.uniform(0.05, 1.0) * duration_s
    what = f"seed {seed}: {whom} killed after {delay_s:.1f} of {duration_s:.1f} s"
    shutil.rmtree(folder)
    shutil.copytree(before, folder)
    process = start(words, folder)
    time.sleep(delay_s)
    kill(process, whom, rng)
    try:
        code = process.wait(timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        return what, f"hangs for {LONGEST_S:g} s after the kill"
    if living := wait_for_end(process.pid):
        os.killpg(process.pid, signal.SIGKILL)
        return what, f"leaves processes: {living}"
    again = start(words, folder)
    try:
        if (second := again.wait(timeout=LONGEST_S)) not in (0, 3):
            return what, f"exit code {second} of the second run: {(folder / 'said.txt').read_text()[-300:]!r}"
    except subprocess.TimeoutExpired:
        os.killpg(again.pid, signal.SIGKILL)
        return what, "the second run hangs"
    if read_tables(folder / "out") != read_tables(after / "out"):
        return what, "different tables"
    if leftovers := find_leftovers(folder / "out"):
        return what, f"leaves {leftovers[:3]}"
    return f"{what}, exit code {code}", ""


def crash(kills: int, seed: int, *, with_sample: bool = False) -> tuple[int, list[str]]:
    """Kill each command of a fleet in turn; returns the number of kills and the problems."""
    commands = {
        "run": ["fleet", "run", "trial/fleet.toml", "--out", "out", "--workers", "2"],
        **({"sample": ["fleet", "sample", "out", "--finite-elements", "2", "--workers", "2"]} if with_sample else {}),
        "report": ["fleet", "report", "out"],
    }
    wrong, kill_count = [], 0
    with TemporaryDirectory() as temporary:
        work = Path(temporary) / "work"
        path = write_fleet(work / "trial")
        path.write_text(path.read_text("utf-8") + COARSE, "utf-8")
        stages, durations = [shutil.copytree(work, Path(temporary) / "0")], []
        for number, words in enumerate(commands.values(), start=1):
            begin = time.monotonic()
            assert start(words, work).wait(timeout=LONGEST_S) in (0, 3), (work / "said.txt").read_text()
            durations.append(time.monotonic() - begin)
            stages.append(shutil.copytree(work, Path(temporary) / str(number)))
        for number in range(kills):
            stage = number % len(commands)
            name, words = list(commands.items())[stage]
            what, problem = try_kill(
                words, stages[stage], stages[stage + 1], work, durations[stage], f"{seed}.{number}"
            )
            kill_count += 1
            print(f"fleet {name}, {what}{': ' * bool(problem)}{problem}", flush=True)
            if problem:
                wrong.append(f"fleet {name}, {what}: {problem}")
    return kill_count, wrong


def main() -> int:
    """Kill fleet commands and print the counts."""
    parser = argparse.ArgumentParser(description="Kill fleet commands at random times and run them again.")
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sample", action="store_true", help="also the sample by finite elements")
    options = parser.parse_args()
    kill_count, wrong = crash(options.kills, options.seed, with_sample=options.sample)
    print(f"kills: {kill_count} tried, {len(wrong)} bad")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
