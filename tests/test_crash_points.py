"""Killed, or without power, at every single file operation: nothing is lost, and the same command goes on.

The stand-in solver of `fake_solve` runs in this process. Each operation on a file is counted; at a chosen one the run
ends as `kill -9` ends it, with nothing said and nothing cleaned up, and is started again.
"""

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import fake_solve
import pytest
from inline import inline_crew
from pictures import draw_nothing
from test_study import case, fake_position, fake_work, study, table

from fecontact.jobs.engine import RunSettings
from fecontact.runs.map_run import run_map
from fecontact.runs.study import run_study


class Killed(BaseException):
    """Ends the process; nobody who cleans up has a say, see `_dead`."""


class Disk:
    """Counts the operations that change the disk, ends the run at one of them, and knows what has reached it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.count, self.at, self.dead = folder, 0, -1, False
        self.unsynced: set[str] = set()

    def operation(self, path: object) -> None:
        """One operation is about to be done."""
        if not str(path).startswith(str(self.folder)):
            return
        if self.dead or self.count == self.at:
            # what is still run on the way out changes nothing any more, as in a process that is gone
            self.dead = True
            raise Killed
        self.count += 1

    def power_cut(self) -> None:
        """Files whose content was never synced are empty."""
        for path in self.folder.rglob("*"):
            if path.is_file() and str(path) in self.unsynced:
                path.write_bytes(b"")


@pytest.fixture
def disk(tmp_path, monkeypatch) -> Iterator[Disk]:
    watched = Disk(tmp_path / "out")
    (tmp_path / "out").mkdir()
    opened, renamed = Path.open, {name: getattr(os, name) for name in ("rename", "replace")}

    def open_(path, mode="r", *arguments, **more):
        if set(mode) & set("wax+"):
            watched.operation(path)
            watched.unsynced.add(str(path))
        return opened(path, mode, *arguments, **more)

    def fsync(number):
        name = os.readlink(f"/proc/self/fd/{number}")
        # it is only told: no power will be cut
        watched.operation(name)
        watched.unsynced.discard(name)

    def moved(name):
        def move(source, target, **more):
            watched.operation(target)
            renamed[name](source, target, **more)
            if not os.path.isdir(target):
                # what was there is replaced by what may be synced, or not
                watched.unsynced.discard(str(target))
            for path in [path for path in watched.unsynced if f"{path}/".startswith(f"{source}/")]:
                watched.unsynced.discard(path)
                watched.unsynced.add(path.replace(str(source), str(target), 1))

        return move

    made = os.mkdir

    def before(function: Callable) -> Callable:
        def checked(path, *arguments, **more):
            # what is there already, or is not there, is no change
            if os.path.exists(path) != (function is made):
                watched.operation(path)
            return function(path, *arguments, **more)

        return checked

    monkeypatch.setattr(Path, "open", open_)
    monkeypatch.setattr(os, "fsync", fsync)
    for name in ("rename", "replace"):
        monkeypatch.setattr(os, name, moved(name))
    for name in ("mkdir", "unlink"):
        monkeypatch.setattr(os, name, before(getattr(os, name)))
    removed = shutil.rmtree

    def rmtree(path, ignore_errors=False, **more):
        if os.path.exists(path):
            watched.operation(path)
        return removed(path, ignore_errors=ignore_errors, **more)

    monkeypatch.setattr(shutil, "rmtree", rmtree)
    draw_nothing(monkeypatch, of_studies=False)
    monkeypatch.setattr("fecontact.outputs.maps.files.map_figure", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.study.study_pair", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.study.report_study", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.map_run.write_map_report", lambda *arguments, **more: None)
    monkeypatch.setattr("fecontact.runs.study._TABLES_EVERY_S", 0.0)
    yield watched
    watched.dead = False


def run_fake_study(out: Path, *, force: bool = False) -> None:
    run_study(study((50, 60)), out, settings=RunSettings(force=force), crew=inline_crew(), work=fake_work)


def run_forced_study(out: Path) -> None:
    run_fake_study(out, force=True)


def run_fake_map(out: Path) -> None:
    run_map(replace(case(50)), [0.0, 1.0], [50e3], out, crew=inline_crew(), work=fake_position)


def content(out: Path) -> dict[str, object]:
    """What a run leaves, but for what differs from run to run."""
    found: dict[str, object] = {str(path.relative_to(out)): "" for path in out.rglob("*") if path.is_file()}
    found.pop("solves.txt", None)
    if (out / "study.csv").exists():
        found["study.csv"] = table(out / "study.csv")
    else:
        found["map.csv"] = [{**row, "status": row["status"].split(" in ")[0]} for row in table(out / "map.csv")]
    return found


@pytest.mark.parametrize(
    ("run", "cut"),
    [
        (run_fake_study, "kill"),
        (run_fake_study, "power"),
        (run_forced_study, "kill"),
        (run_fake_map, "kill"),
        (run_fake_map, "power"),
    ],
)
def test_a_run_that_ends_at_any_file_operation_goes_on(disk, run, cut):
    out, before = disk.folder, disk.folder.parent / "before"
    if run is run_forced_study:
        run_fake_study(out)
    shutil.copytree(out, before)
    disk.count = 0
    run(out)
    points, whole = disk.count, content(out)
    assert points > 30
    for at in range(points):
        disk.at, disk.dead = -1, False
        shutil.rmtree(out)
        shutil.copytree(before, out)
        disk.count, disk.at = 0, at
        disk.unsynced.clear()
        with contextlib.suppress(Killed):
            run(out)
        assert disk.dead, at
        disk.at, disk.dead = -1, False
        finished = {path.name for store in ("cases", "positions") for path in (out / store).glob("[!.]*")}
        if cut == "power":
            disk.power_cut()
        begun = len(fake_solve.solves(out))
        run(out)
        assert content(out) == whole, at
        if run is run_fake_study:
            # what was finished is not solved again; by force it is, as are positions whose loads failed
            assert len(fake_solve.solves(out)) - begun <= 2 - len(finished), at
