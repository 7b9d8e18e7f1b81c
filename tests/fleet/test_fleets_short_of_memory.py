"""Fleets on a machine without enough memory, disk space, workers or rights."""

import errno
import shutil
import sys
import threading
from pathlib import Path

import pytest
from inline import inline_crew, stand_ins

import fecontact
from fecontact.cli import call
from fecontact.errors import InputError, MemoryShortageError
from fecontact.features.fleet import packages, reading
from fecontact.features.fleet.answer import evaluate_fleet
from fecontact.features.fleet.report import write_headline
from fecontact.features.fleet.screening import ScreeningPair
from fecontact.features.fleet.tables import read_parquet
from fecontact.files import read_json
from fecontact.jobs import workers
from fecontact.jobs.store import replace_folder
from fecontact.jobs.workers import Job, JobOutcome, WorkersLost
from fecontact.runs.folder import prepare_folder

FLEET = """
[wheels]
files = ["S1002", "EN13715_1in40"]
[rails]
files = "60E1"
[shifts_mm]
values = [0]
[loads_kN]
values = [60]
"""


@pytest.fixture
def path(tmp_path) -> Path:
    path = tmp_path / "fleet.toml"
    path.write_text(FLEET, "utf-8")
    return path


def run(path: Path):
    with stand_ins(inline_crew(), None, ""):
        return fecontact.run_fleet(path, path.with_name("out"))


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (MemoryError(), "out of memory"),
        (MemoryShortageError("not enough memory for this file"), "not enough memory for this file"),
        (OSError(errno.ENOSPC, "No space left on device", "a.npz"), "No space left on device (a.npz)"),
        (OSError("died"), "died"),
    ],
)
def test_a_file_that_the_machine_could_not_read_is_not_a_refused_file(path, monkeypatch, capsys, error, reason):
    """Exit code 3; the next run reads the file."""
    find_suspicions = reading.find_suspicions

    def fail(profile, *options):
        if profile.name == "S1002":
            raise error
        return find_suspicions(profile, *options)

    monkeypatch.setattr(reading, "find_suspicions", fail)
    out = path.with_name("out")
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "run", str(path), "--out", str(out)]) == 3
    assert "not read: 1 of 3 files, for want of memory, disk space or workers; run the same command again:\n" in (
        said := capsys.readouterr().err
    )
    assert f"  wheel S1002: {reason}" in said
    statuses = {row["name"]: row["status"] for row in read_parquet(out / "profiles.parquet").to_pylist()}
    assert statuses == {"S1002": "unread", "EN13715_1in40": "read", "60E1": "read"}
    assert "33 % of the files could not be read" in write_headline(evaluate_fleet(out))
    monkeypatch.undo()
    screening = run(path)
    assert (screening.pairs, screening.reused, screening.unread) == (2, 1, {})


def test_a_refused_file_stays_a_refused_file(path, tmp_path):
    (tmp_path / "bad.csv").write_text("nothing to see\n", "utf-8")
    path.write_text(FLEET.replace("EN13715_1in40", "bad.csv"), "utf-8")
    screening = run(path)
    assert (list(screening.refused), screening.unread) == (["wheel bad"], {})


@pytest.mark.parametrize(
    ("failing", "beginning", "ending"),
    [
        (("S1002", "EN13715_1in40"), "the screen decided nothing: 2 of 2 pairs were not screened, for want of", ""),
        (("S1002",), "2 positions of 2 pairs", "; 1 of 2 pairs was not screened, for want of memory"),
    ],
)
def test_pairs_that_the_machine_could_not_screen_are_not_an_answer(
    path, monkeypatch, capsys, failing, beginning, ending
):
    """Headline, rows and report name the shortage and its remedy; the next run decides."""
    rows, remedy = ScreeningPair.rows, "free memory or disk space, or use fewer --workers, and run the same command"

    def fail(self):
        if self.wheel.spec in failing:
            raise MemoryError
        return rows(self)

    monkeypatch.setattr(ScreeningPair, "rows", fail)
    out = path.with_name("out")
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "run", str(path), "--out", str(out)]) == 3
    record = read_json(out / "fleet.json")
    assert record["headline"].startswith(beginning)
    assert ending in record["headline"]
    assert remedy in record["headline"]
    assert record["headline"] in capsys.readouterr().out
    assert ("REFUSED in" in record["headline"]) == bool(ending)
    headline = write_headline(evaluate_fleet(out))
    assert (headline.startswith("The screen decided nothing: 2 of 2 pairs"), remedy in headline) == (not ending, True)
    for part_file in (out / "screen").iterdir():
        for row in read_parquet(part_file).to_pylist():
            is_failing = row["wheel"] in failing
            assert (row["verdict"] == "REFUSED", remedy in (row["remedy"] or "")) == (is_failing, is_failing)
    monkeypatch.undo()
    screening = run(path)
    assert (screening.unscreened, screening.failed) == (0, {})
    assert "not screened" not in screening.headline
    assert "not screened" not in write_headline(evaluate_fleet(out))


def test_a_file_that_changes_while_it_is_refused_is_not_refused_for_good(path, tmp_path, monkeypatch):
    bad = tmp_path / "bad.csv"
    bad.write_text("nothing to see\n", "utf-8")
    path.write_text(FLEET.replace("EN13715_1in40", "bad.csv"), "utf-8")
    resolve_profile = reading._resolve_profile

    def change(body, spec, options):
        if spec == str(bad):
            bad.write_text("half of a file", "utf-8")
        return resolve_profile(body, spec, options)

    monkeypatch.setattr(reading, "_resolve_profile", change)
    assert "changed while it was read" in run(path).unread["wheel bad"]


def test_a_worker_that_dies_at_its_start_is_a_lack_of_memory(path, monkeypatch, capsys):
    """No job has made the folder `profiles/` yet."""

    def die(job, *_, **__):
        shutil.rmtree(job.folder.parent, ignore_errors=True)
        outcome = alone(job, crew, Receiver(), deaths=2)
        outcomes.append(outcome)
        return (outcome,)

    class Receiver:
        def under_way(self, names) -> None:
            pass

    outcomes: list[JobOutcome] = []
    alone, crew = workers._run_alone, inline_crew()
    monkeypatch.setattr(workers, "_collect_outcome", lambda future, group, crew: die(group[0]))
    with stand_ins(inline_crew(), None, ""), pytest.raises(WorkersLost, match=r"no file could be read.*died twice"):
        fecontact.run_fleet(path, path.with_name("out"))
    assert {outcome.failure for outcome in outcomes} == {"the process died twice (out of memory?)"}
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "run", str(path), "--out", str(path.with_name("out"))]) == 3
    assert "use fewer --workers" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ModuleNotFoundError("No module named 'pyarrow'", name="pyarrow"), "install it: pip install"),
        (ModuleNotFoundError("No module named 'numpy'", name="numpy"), "cannot be loaded"),
        (ImportError("libarrow.so: failed to map segment from shared object"), "not enough memory to load"),
        (MemoryError(), "not enough memory to load"),
        (ImportError("libarrow.so: wrong ELF class"), "cannot be loaded"),
    ],
)
def test_a_package_that_does_not_fit_into_the_memory_is_installed(monkeypatch, error, said):
    def fail(name):
        raise error

    monkeypatch.setattr(packages, "import_module", fail)
    with pytest.raises(InputError, match=said) as refused:
        packages.import_parquet()
    assert ("pip install" in str(refused.value)) == ("pip" in said)
    assert isinstance(refused.value, MemoryShortageError) == ("memory" in said)


def test_a_folder_that_cannot_be_written_is_named_without_temporary_files(tmp_path, monkeypatch):
    """An administrator may write everywhere, so that the refusal of the system is planted."""

    def refuse(self, *_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(self))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    with pytest.raises(PermissionError) as refused:
        prepare_folder(tmp_path, "fleet.json", lambda stored: True, force=False, written_files=())
    assert refused.value.filename == str(tmp_path)
    monkeypatch.setattr(Path, "mkdir", refuse)
    job = Job(name="a", folder=tmp_path / "profiles/a", origin=reading.find_origin(), origin_here=None, work=None)  # type: ignore[arg-type]
    with pytest.raises(PermissionError) as refused, replace_folder(job.folder, job.name, job.origin):
        pass
    assert refused.value.filename == str(tmp_path / "profiles/a")


def test_the_message_of_a_missing_package_is_that_of_the_command(path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "duckdb", None)
    run(path)
    assert call(["fleet", "report", str(path.with_name("out"))]) == 2
    assert "the package duckdb; install it: pip install 'fecontact[fleet]'" in capsys.readouterr().err


@pytest.mark.parametrize("started", [0, 1])
def test_a_pool_without_memory_for_its_threads_ends_with_a_message(monkeypatch, started):
    """Without the feeder thread no call reaches a worker, and the caller would wait forever."""
    start, starts = threading.Thread.start, []

    def refuse(thread):
        starts.append(thread)
        if len(starts) > started:
            raise RuntimeError("can't start new thread")
        start(thread)

    def use_pool():
        with workers._process_pool(1, 1) as pool:
            monkeypatch.setattr(threading.Thread, "start", refuse)
            pool.submit(abs, -1).result(timeout=60.0)

    with pytest.raises(WorkersLost, match=r"not enough memory to start a worker process \(can't start new thread\)"):
        use_pool()
    assert len(starts) == started + 1


@pytest.mark.parametrize("error", [OSError(errno.ENOMEM, "Cannot allocate memory"), MemoryError()])
def test_a_worker_that_cannot_be_started_is_a_lack_of_memory(path, monkeypatch, capsys, error):
    def refuse(self):
        raise error

    monkeypatch.setattr(workers.ProcessPoolExecutor, "_adjust_process_count", refuse)
    assert call(["fleet", "run", str(path), "--out", str(path.with_name("out")), "--workers=1", "-q"]) == 3
    said = capsys.readouterr().err
    assert said.startswith("error: not enough memory to start a worker process (")
    assert said.count("\n") == 1


def test_a_library_that_a_job_cannot_load_for_want_of_memory_is_no_error_of_the_program(path, monkeypatch, capsys):
    def fail(*inputs):
        raise ImportError("_flapack.so: failed to map segment from shared object")

    monkeypatch.setattr(reading, "find_suspicions", fail)
    with stand_ins(inline_crew(), None, ""):
        assert call(["fleet", "run", str(path), "--out", str(path.with_name("out"))]) == 3
    assert "out of memory (_flapack.so: failed to map segment" in capsys.readouterr().err
