"""Recovery after a kill or a loss of power at every single file operation.

Nothing is lost, and a repetition of the command resumes the run. The stand-in solver of `fake_solve` runs in this
process. The content of the disk before each operation on a file is copied: it is the state after `kill -9`, without
a message and without a clean-up. The run is started again from each of these states.

Of 268 ends at an operation and 162 without power nothing was lost. Also tried without a loss: `kill -9` of
28 real runs at any time, dead workers and schedulers, parts of job arrays, full disks and limits (19), values changed
in 1,000 results. Not tried: file systems over a network, and a Dask worker that is only slow.
"""

import os
import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import fake_solve
import pytest
from inline import inline_crew, study_by
from pictures import draw_nothing
from test_study import study, table

from fecontact.jobs.engine import RunSettings


@dataclass(frozen=True, kw_only=True)
class Point:
    """Content of the disk just before an operation."""

    folder: Path
    # of these the content was never synced
    unsynced: frozenset[str]
    # whether it is what the point before had, which was followed by a sync alone
    as_before: bool


class Disk:
    """Recorder of the disk before each operation that changes it, and of the content that has been synced."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.watching, self.points = folder, False, list[Point]()
        self.unsynced: set[str] = set()
        self.synced = False

    def operation(self, path: object, *, syncs: bool = False) -> None:
        """Copy the folder before an operation."""
        if not self.watching or not str(path).startswith(str(self.folder)):
            return
        copy = shutil.copytree(self.folder, self.folder.parent / "points" / str(len(self.points)))
        self.points.append(Point(folder=copy, unsynced=frozenset(self.unsynced), as_before=self.synced))
        self.synced = syncs

    def back_to(self, point: Point, *, power_cut: bool) -> bool:
        """Restore the state at a point, without content that was never synced.

        Returns whether this state differs from the states that were tried before.
        """
        shutil.rmtree(self.folder)
        shutil.copytree(point.folder, self.folder)
        if not power_cut:
            return not point.as_before
        lost = [path for path in map(Path, point.unsynced) if path.is_file() and path.stat().st_size]
        for path in lost:
            path.write_bytes(b"")
        return bool(lost)


@pytest.fixture
def disk(tmp_path, monkeypatch) -> Disk:
    """Folder with an observer of all changes by this process."""
    watched = Disk(tmp_path / "out")
    (tmp_path / "out").mkdir()
    opened, renamed = Path.open, {name: getattr(os, name) for name in ("rename", "replace")}

    def open_(path, mode="r", *arguments, **options):
        # what the stand-in notes for the test is none of the run's files
        if set(mode) & set("wax+") and path.name != "solves.txt":
            watched.operation(path)
            watched.unsynced.add(str(path))
        return opened(path, mode, *arguments, **options)

    def fsync(number):
        name = os.readlink(f"/proc/self/fd/{number}")
        # it is only told: no power will be cut
        watched.operation(name, syncs=True)
        watched.unsynced.discard(name)

    def moved(name):
        def move(source, target, **options):
            watched.operation(target)
            renamed[name](source, target, **options)
            if not os.path.isdir(target):
                # what was there is replaced by what may be synced, or not
                watched.unsynced.discard(str(target))
            for path in [path for path in watched.unsynced if f"{path}/".startswith(f"{source}/")]:
                watched.unsynced.discard(path)
                watched.unsynced.add(path.replace(str(source), str(target), 1))

        return move

    make_folder = os.mkdir

    def before(function: Callable) -> Callable:
        """Function that reports the operation on a path before it runs."""

        def checked(path, *arguments, **options):
            # what is there already, or is not there, is no change
            if os.path.exists(path) != (function is make_folder):
                watched.operation(path)
            return function(path, *arguments, **options)

        return checked

    monkeypatch.setattr(Path, "open", open_)
    monkeypatch.setattr(os, "fsync", fsync)
    for name in ("rename", "replace"):
        monkeypatch.setattr(os, name, moved(name))
    for name in ("mkdir", "unlink"):
        monkeypatch.setattr(os, name, before(getattr(os, name)))
    removed = shutil.rmtree

    def rmtree(path, ignore_errors=False, **options):
        if os.path.exists(path):
            watched.operation(path)
        return removed(path, ignore_errors=ignore_errors, **options)

    monkeypatch.setattr(shutil, "rmtree", rmtree)
    draw_nothing(monkeypatch, of_studies=False)
    monkeypatch.setattr("fecontact.runs.study.study_pair", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.study.report_study", lambda *arguments: None)
    monkeypatch.setattr("fecontact.runs.study._TABLE_INTERVAL_S", 0.0)
    return watched


def run_fake_study(out: Path, *, force: bool = False) -> None:
    study_by(study((50, 60)), out, settings=RunSettings(force=force), crew=inline_crew(), work=fake_solve.FakeWork)


def run_forced_study(out: Path) -> None:
    run_fake_study(out, force=True)


def content(out: Path) -> dict[str, object]:
    """Files that a run leaves, without the values that differ between runs."""
    contents: dict[str, object] = {str(path.relative_to(out)): "" for path in out.rglob("*") if path.is_file()}
    contents.pop("solves.txt", None)
    if (out / "study.csv").exists():
        contents["study.csv"] = table(out / "study.csv")
    else:
        contents["map.csv"] = [{**row, "status": row["status"].split(" in ")[0]} for row in table(out / "map.csv")]
    return contents


@pytest.mark.parametrize("run", [run_fake_study, run_forced_study])
def test_a_run_that_ends_at_any_file_operation_goes_on(disk, run):
    goes_on(disk, run)


def goes_on(disk, run):
    out = disk.folder
    if run is run_forced_study:
        run_fake_study(out)
    disk.watching = True
    run(out)
    disk.watching = False
    complete = content(out)
    assert len(disk.points) > 30
    tried = Counter[str]()
    for at, point in enumerate(disk.points):
        for cut in ("kill",) if run is run_forced_study else ("kill", "power"):
            if not disk.back_to(point, power_cut=cut == "power"):
                continue
            tried[cut] += 1
            finished = {path.name for store in ("cases", "positions") for path in (out / store).glob("[!.]*")}
            begun = len(fake_solve.solves(out))
            run(out)
            assert content(out) == complete, (at, cut)
            if run is run_fake_study:
                # what was finished is not solved again; by force it is, as are positions whose loads failed
                assert len(fake_solve.solves(out)) - begun <= 2 - len(finished), (at, cut)
    assert tried["kill"] > 20
    assert tried["power"] > 20 or run is run_forced_study
