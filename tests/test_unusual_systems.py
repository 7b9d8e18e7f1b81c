"""Effects of a system on a run: paused workers, a clock that goes back, other users, long paths, lost Dask workers."""

import contextlib
import os
import shutil
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import browser, shown
from crash_fleets import find_leftovers, list_processes, read_results, start
from fuzz_fleets import find_problem, finished_fleet, run_timed, write_fleet
from small_fleet import write_small_fleet

NOBODY = 65534
# Commands of 62 CPU s in all took 549 s while other programs ran; a hang has no end.
LONGEST_S = 600.0
RUN = ["fleet", "run", "trial/fleet.toml", "--out", "out"]


@contextlib.contextmanager
def other_user() -> Iterator[None]:
    """Rights of the user `nobody` for files, in this process."""
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)


def wait_for(condition, process) -> None:
    end = time.monotonic() + LONGEST_S
    while not condition() and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.slow
def test_a_worker_that_was_paused_costs_nothing(tmp_path):
    write_small_fleet(tmp_path / "trial")
    process = start([*RUN, "--workers", "2"], tmp_path)
    pairs = tmp_path / "out" / "pairs"
    wait_for(pairs.exists, process)
    workers = [member for member in list_processes(process.pid) if "spawn_main" in " ".join(member.cmdline())]
    assert workers
    workers[0].send_signal(signal.SIGSTOP)
    time.sleep(5.0)
    # nothing is taken for finished, and the other processes live
    assert process.poll() is None or process.returncode == 0
    workers[0].send_signal(signal.SIGCONT)
    assert process.wait(timeout=LONGEST_S) == 0
    alone = ["fleet", "run", "trial/fleet.toml", "--out", "alone", "--workers", "1"]
    assert start(alone, tmp_path).wait(timeout=LONGEST_S) == 0
    assert read_results(tmp_path / "out") == read_results(tmp_path / "alone")
    assert find_leftovers(tmp_path / "out") == []


def test_a_clock_that_goes_back_changes_nothing(tmp_path, monkeypatch):
    # the paths of the profiles are in the tables
    expected = read_results(finished_fleet(tmp_path / "one"))
    shutil.rmtree(tmp_path / "one")
    now = [2e9]

    def go_back() -> float:
        now[0] -= 3600.0
        return now[0]

    monkeypatch.setattr(time, "time", go_back)
    out = finished_fleet(tmp_path / "one")
    assert read_results(out) == expected
    # the second run takes the pairs of the first one, although its files seem to be of the future
    monkeypatch.chdir(tmp_path / "one")
    ended = run_timed([*RUN, "--workers=1"])
    assert ended.code == 0
    assert read_results(out) == expected


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize(
    "line",
    [
        ["hertz", "--rail=closed/rail.csv", "--load-kn=80"],
        ["hertz", "--rail=unreadable.csv", "--load-kn=80"],
        ["hertz", "--wheel=closed/absent.csv"],
        ["check", "closed/study.toml"],
        ["curve", "--vehicle=closed/vehicle.toml", "--radii=300"],
        ["place", "--rail-irregularity=table:closed/weld.csv"],
        ["fleet", "check", "closed/fleet.toml"],
        ["place", "--out=closed/picture.png"],
        ["place", "--out=unwritable/picture.png"],
        ["place", "--out=unwritable/new/picture.png"],
        ["init", "unwritable/new"],
        ["fleet", "examples", "unwritable/new", "--wheels=1", "--rails=1"],
        ["fleet", "run", "trial/fleet.toml", "--out=unwritable", "--workers=1"],
        ["compare", "closed", "trial"],
    ],
)
def test_folders_of_another_user_are_refused_in_a_line(tmp_path, monkeypatch, line):
    # modules are imported with the rights of this user, since nobody may not read them
    write_fleet(tmp_path / "trial")
    write_fleet(tmp_path / "closed")
    monkeypatch.chdir(tmp_path)
    warm = [word.replace("closed", "warm").replace("unwritable", "warm").replace("unreadable", "warm") for word in line]
    run_timed(warm)
    (tmp_path / "unwritable").mkdir()
    (tmp_path / "unreadable.csv").write_bytes((tmp_path / "trial" / "rail.csv").read_bytes())
    (tmp_path / "unreadable.csv").chmod(0o600)
    (tmp_path / "closed").chmod(0o700)
    for folder in (tmp_path, *tmp_path.parents):
        if folder.stat().st_uid == 0 and folder.name.startswith(("pytest", "test_")):
            folder.chmod(0o755)
    with other_user():
        ended = run_timed(line)
    assert find_problem(ended) == ""
    assert ended.code == 2
    assert "ermission denied" in ended.err
    assert list((tmp_path / "unwritable").iterdir()) == []


@pytest.mark.parametrize("length", [255, 256, 3000, 4095, 4096, 5000])
@pytest.mark.parametrize(
    "line",
    [
        ["hertz", "--rail={path}.csv"],
        ["place", "--out={path}.png"],
        ["check", "{path}.toml"],
        ["init", "{path}"],
        ["fleet", "check", "{path}.toml"],
        ["fleet", "run", "trial/fleet.toml", "--out={path}", "--workers=1"],
        ["fleet", "examples", "{path}", "--wheels=1", "--rails=1"],
    ],
)
def test_long_paths_are_used_or_refused_in_a_line(tmp_path, monkeypatch, line, length):
    write_fleet(tmp_path / "trial")
    monkeypatch.chdir(tmp_path)
    # above the longest name of a file, a path of many folders
    path = "x" * length if length <= 256 else ("x" * 99 + "/") * (length // 100) + "x" * (length % 100)
    ended = run_timed([word.replace("{path}", path) for word in line])
    assert find_problem(ended) == ""
    assert ended.code in (0, 2)


@pytest.mark.slow
def test_a_dask_worker_that_is_killed_costs_a_fleet_no_row(tmp_path):
    pytest.importorskip("distributed")
    from test_study import dask_cluster

    write_small_fleet(tmp_path / "trial")
    alone = ["fleet", "run", "trial/fleet.toml", "--out", "alone", "--workers", "1"]
    assert start(alone, tmp_path).wait(timeout=LONGEST_S) == 0
    with dask_cluster(tmp_path, 2) as (address, workers):
        process = start([*RUN, "--scheduler", address], tmp_path)
        wait_for(lambda: list((tmp_path / "out").glob("profiles/[!.]*")), process)
        workers[0].kill()
        assert process.wait(timeout=LONGEST_S) == 0
    assert read_results(tmp_path / "out") == read_results(tmp_path / "alone")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["<script>alert(1)</script>", "<img src=x onerror=alert(1)>", '"><svg onload=alert(1)>']
)
def test_a_browser_runs_nothing_of_a_report_with_hostile_names(tmp_path, monkeypatch, name):
    browser()
    path = write_fleet(tmp_path / "trial")
    for table in ("wheels.csv", "pairs.csv"):
        text = (path.parent / table).read_text("utf-8")
        quoted = '"' + name.replace('"', '""') + '"'
        (path.parent / table).write_text(text.replace(",w,", f",{quoted},").replace("\nw,", f"\n{quoted},"), "utf-8")
    monkeypatch.chdir(tmp_path)
    assert run_timed([*RUN, "--workers=1"]).code == 0
    assert run_timed(["fleet", "report", "out"]).code == 0
    assert "alert(1)" in (tmp_path / "out" / "report.html").read_text("utf-8")
    page = shown(Path("out/report.html").absolute(), 1600, tmp_path)
    assert page["requests"] == []
    assert page["console"] == []
