"""Studies on many processes.

Nothing is solved twice, nothing is lost, and the table does not depend on the number of processes.
"""

import contextlib
import csv
import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import fake_solve
import psutil
import pytest
from inline import study_by
from marks import slow_but
from pictures import draw_nothing
from points import MEASURED_COLUMNS
from test_store import profile

from fecontact.bodies import Material
from fecontact.case import Case, Criteria
from fecontact.errors import InputError, ProgramError
from fecontact.jobs import workers
from fecontact.jobs.engine import RunSettings, parse_part
from fecontact.jobs.workers import Crew, Job, count_default_workers, divide_into_groups, run_job, set_thread_environment
from fecontact.runs import identity
from fecontact.runs.casefile import Study
from fecontact.runs.cost import sort_longest_first
from fecontact.runs.identity import make_case_id
from fecontact.runs.sources import read_digests
from fecontact.runs.store import CaseWork, make_job, name_case_folder
from fecontact.runs.study import StudyOutcome, _share_loads, run_study
from fecontact.runs.varied import describe_varied_inputs
from fecontact.solving.solve import SharedLoads

LOADS_KN = (50, 60, 70, 80, 90)
HERE = Path(__file__).parent


def case(load_kN: float) -> Case:
    return Case(rail="circle:300", wheel="cylinder:460", inclination_rad=0.0, load_N=1e3 * load_kN)


def study(loads: tuple[float, ...] = LOADS_KN, **settings: Any) -> Study:
    return Study(name="fake", cases=tuple(case(load) for load in loads), **settings)


def inline_workers() -> Crew:
    return Crew(open=ThreadPoolExecutor, workers=1, together=1)


def run(out: Path, varied: Study | None = None, *, crew: Crew | None = None, **settings: Any) -> StudyOutcome:
    """Run with the stand-in.

    It runs in this process unless a number of workers is given.
    """
    chosen = RunSettings(**settings)
    if crew is None and chosen.workers is None and chosen.scheduler is None:
        crew = inline_workers()
    return study_by(varied or study(), out, settings=chosen, crew=crew, work=fake_solve.FakeWork)


def table(path: Path) -> list[dict[str, str]]:
    """Rows of a CSV without the columns that differ from run to run."""
    with path.open() as file:
        return [{key: row[key] for key in row if key not in MEASURED_COLUMNS} for row in csv.DictReader(file)]


@pytest.fixture(autouse=True)
def _no_figures(request, monkeypatch):
    draw_nothing(monkeypatch, of_studies="figures" in request.node.name)


@pytest.fixture(scope="module")
def serial(tmp_path_factory) -> list[dict[str, str]]:
    out = tmp_path_factory.mktemp("serial")
    # made before the patches of the first test that asks for it
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        run(out)
    return table(out / "study.csv")


def statuses(outcome: StudyOutcome) -> list[str]:
    return [row["status"] for row in outcome.rows]


def test_finished_cases_are_reused_without_solving_and_give_the_same_table(tmp_path):
    first = run(tmp_path)
    before = (tmp_path / "study.csv").read_bytes()
    again = run(tmp_path)
    assert len(fake_solve.solves(tmp_path)) == len(LOADS_KN)
    assert first.reused == ()
    assert again.reused == tuple(make_case_id(c) for c in study().cases)
    # seconds and memory are those of the first run, so all bytes are the same
    assert (tmp_path / "study.csv").read_bytes() == before
    run(tmp_path, force=True)
    assert fake_solve.solves(tmp_path) == 2 * [make_case_id(c) for c in study().cases]


def test_figures_and_collections_are_of_the_whole_study(tmp_path):
    assert run(tmp_path, part=(1, 2)).collections == ()
    assert not (tmp_path / "study.png").exists()
    # two loads at one shift are no series, and the third case is the first one again
    assert run(tmp_path, study((50, 60, 50))).collections == ()
    assert {path.name for path in tmp_path.glob("study*.p[nv]*")} == {"study.png"}
    assert run(tmp_path, study((50,))).collections == ("study.pvd",)
    assert {path.name for path in tmp_path.glob("study*.p[nv]*")} == {"study.png", "study.pvd", "study_bodies.pvd"}


def test_limits_are_drawn_where_all_cases_have_the_same(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(
        "fecontact.runs.study.study_figures", lambda rows, out, rail, criteria: figures.append(criteria)
    )
    strict = Criteria(p_max=0.03, judged_by=("strength",))
    by_strict = tuple(replace(case(load), criteria=strict) for load in (50, 60))
    run(tmp_path / "same", Study(name="fake", cases=by_strict))
    run(tmp_path / "two", Study(name="fake", cases=(by_strict[0], case(60))))
    assert figures == [strict, None]


def test_a_case_that_occurs_twice_is_solved_once(tmp_path):
    outcome = run(tmp_path, study((50, 60, 50)))
    assert len(fake_solve.solves(tmp_path)) == 2
    assert [row["load_kN"] for row in outcome.rows] == [50, 60, 50]


def test_another_version_is_solved_again_and_said(tmp_path, monkeypatch):
    run(tmp_path, study((50, 60)))
    monkeypatch.setattr(identity, "__version__", "99")
    identity._determine_solving_origin.cache_clear()
    outcome = run(tmp_path, study((50, 60)))
    assert set(outcome.recomputed.values()) == {"made by a different version: fecontact 0.1.0 -> 99"}
    assert len(fake_solve.solves(tmp_path)) == 4
    assert run(tmp_path, study((50, 60))).recomputed == {}
    identity._determine_solving_origin.cache_clear()


def test_another_evaluation_or_other_criteria_judge_again_and_solve_nothing(tmp_path, monkeypatch):
    run(tmp_path, study((50, 60)))
    by_other = tuple(replace(case(load), criteria=Criteria(p_max=0.03)) for load in (50, 60))
    outcome = run(tmp_path, Study(name="fake", cases=by_other))
    assert set(outcome.recomputed.values()) == {"judged by different criteria: criterion p_max 0.05 -> 0.03"}
    names = [make_case_id(case(load)) for load in (50, 60)]
    assert fake_solve.solves(tmp_path) == [*names, *(f"again:{name}" for name in names)]
    monkeypatch.setattr(identity, "read_digests", lambda: replace(read_digests(), evaluating="another"))
    outcome = run(tmp_path, Study(name="fake", cases=by_other))
    assert all("source of evaluation" in why for why in outcome.recomputed.values())


def test_cases_that_differ_in_their_criteria_alone_are_refused(tmp_path):
    twice = (case(50), replace(case(50), criteria=Criteria(area=0.2)))
    with pytest.raises(InputError, match="fecontact judge"):
        run(tmp_path, Study(name="fake", cases=twice))


def test_a_damaged_case_is_named_and_solved_again(tmp_path, serial):
    run(tmp_path)
    bad = make_case_id(case(60))
    with (name_case_folder(tmp_path, bad) / "rail.vtu").open("a") as file:
        file.write("x")
    outcome = run(tmp_path)
    assert list(outcome.recomputed) == [bad]
    assert "rail.vtu" in outcome.recomputed[bad]
    assert fake_solve.solves(tmp_path)[len(LOADS_KN) :] == [bad]
    assert table(tmp_path / "study.csv") == serial


def test_a_moved_profile_is_reused_and_a_changed_one_is_not(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    old = replace(case(50), rail=profile(tmp_path / "a" / "head.txt", 300.0))
    moved_case = replace(case(50), rail=profile(tmp_path / "b" / "head.txt", 300.0))
    run(out, Study(name="x", cases=(old,)))
    outcome = run(out, Study(name="x", cases=(moved_case,)))
    assert outcome.reused
    # the name and the content, not the folder
    assert re.fullmatch(r"head\.txt@[0-9a-f]{8}", outcome.rows[0]["rail"])
    profile(tmp_path / "b" / "head.txt", 301.0)
    assert not run(out, Study(name="x", cases=(moved_case,))).reused


def test_failures_are_rows_and_the_rest_goes_on(tmp_path):
    fake_solve.plan(tmp_path, kN50="disk", kN60="bug", kN70="iteration")
    outcome = run(tmp_path, study(conclude=lambda rows, out: pytest.fail("concluded from rows that cannot be used")))
    assert statuses(outcome) == [
        "failed: No space left on device (rail.vtu)",
        f"failed: ZeroDivisionError: no such thing; see {make_case_id(case(60))}.error.txt",
        "failed: it did not converge",
        "converged",
        "converged",
    ]
    assert "3 of 5" in outcome.conclusion
    trace = tmp_path / "cases" / f"{make_case_id(case(60))}.error.txt"
    assert "_act" in trace.read_text()
    assert sorted(path.name for path in (tmp_path / "cases").iterdir() if path.is_dir()) == sorted(
        make_case_id(case(load)) for load in (80, 90)
    )
    fake_solve.plan(tmp_path)
    assert statuses(run(tmp_path)) == ["converged"] * 5
    assert not trace.exists()
    assert len(fake_solve.solves(tmp_path)) == 5 + 3


def test_an_error_of_the_program_is_no_row_and_ends_the_run_when_the_rest_is_kept(tmp_path):
    fake_solve.plan(tmp_path, kN60="wrong", kN80="wrong", kN90="iteration")
    bad = [make_case_id(case(load)) for load in (60, 80)]
    with pytest.raises(
        ProgramError, match=r"2 of 5 jobs ended with an error of the program.*KeyError: 'area_mm2'"
    ) as raised:
        run(tmp_path, study(conclude=lambda rows, out: pytest.fail("concluded from a part of the rows")))
    assert any(f"{name}.error.txt in {tmp_path / 'cases'}" in str(raised.value) for name in bad)
    assert all("fake_solve" in (tmp_path / "cases" / f"{name}.error.txt").read_text() for name in bad)
    assert [row["load_kN"] for row in json.loads((tmp_path / "study.json").read_text())["rows"]] == [50, 70, 90]
    assert not (tmp_path / "report.html").exists()
    # with a corrected program the same command resumes
    fake_solve.plan(tmp_path)
    outcome = run(tmp_path)
    assert statuses(outcome) == ["converged"] * 5
    assert sorted(outcome.reused) == sorted(make_case_id(case(load)) for load in (50, 70))


def test_a_full_disk_at_the_tables_does_not_end_the_run(tmp_path, monkeypatch):
    from fecontact.runs import study as module

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device", "study.csv")

    with monkeypatch.context() as patch:
        patch.setattr(module, "_TABLE_INTERVAL_S", 0.0)
        patch.setattr(module, "write_tables", full)
        with pytest.raises(OSError, match="No space"):
            run(tmp_path)
    assert len(run(tmp_path).reused) == len(LOADS_KN)


@pytest.mark.parametrize("what", ["memory", "less"])
def test_what_was_short_of_memory_beside_others_is_solved_again_alone(tmp_path, serial, what):
    fake_solve.plan(tmp_path, kN50=what)
    outcome = run(tmp_path, crew=Crew(open=ThreadPoolExecutor, workers=2, together=2))
    assert statuses(outcome) == ["converged"] * 5
    order = fake_solve.solves(tmp_path)
    assert order.count(make_case_id(case(50))) == 2
    assert order[-1] == make_case_id(case(50))
    assert table(tmp_path / "study.csv") == serial


def test_what_is_short_of_memory_alone_says_so(tmp_path):
    fake_solve.plan(tmp_path, kN50="memory", kN60="less")
    outcome = run(tmp_path, study((50, 60)))
    assert statuses(outcome)[0].startswith("failed: the factor of 9")
    assert "GB of memory" in outcome.rows[1]["verdict_warnings"]
    assert len(fake_solve.solves(tmp_path)) == 2


@pytest.mark.slow
def test_any_number_of_processes_gives_the_same_table_in_the_study_s_order(tmp_path, serial):
    fake_solve.plan(tmp_path, kN50="sleep 0.3")
    environment = dict(os.environ)
    run(tmp_path, workers=2)
    assert table(tmp_path / "study.csv") == serial
    assert dict(os.environ) == environment
    rows = json.loads((tmp_path / "study.json").read_text())["rows"]
    assert [row["load_kN"] for row in rows] == list(LOADS_KN)


@pytest.mark.slow
def test_a_worker_that_dies_once_costs_nothing(tmp_path, serial):
    fake_solve.plan(tmp_path, kN60="die once", all="sleep 0.1")
    outcome = run(tmp_path, workers=2)
    assert statuses(outcome) == ["converged"] * 5
    assert table(tmp_path / "study.csv") == serial


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2])
def test_a_case_that_always_kills_its_worker_is_a_failed_row_and_the_others_are_kept(tmp_path, count):
    fake_solve.plan(tmp_path, kN60="die", all="sleep 0.1")
    outcome = run(tmp_path, study((50, 60, 70)), workers=count)
    assert statuses(outcome) == ["converged", "failed: the process died twice (out of memory?)", "converged"]
    assert fake_solve.solves(tmp_path).count(make_case_id(case(60))) == 2


@pytest.mark.slow
def test_a_full_disk_that_ends_the_process_is_named_and_its_room_given_back(tmp_path, monkeypatch):
    fake_solve.plan(tmp_path, kN60="die")
    usage = type("Usage", (), {"free": 1e6})
    monkeypatch.setattr(workers.shutil, "disk_usage", lambda path: usage)
    outcome = run(tmp_path, study((60,)), workers=1)
    assert statuses(outcome) == ["failed: the process died twice (disk full?)"]
    assert not list((tmp_path / "cases").iterdir())


def job(out: Path, load_kN: float = 50, **settings: Any) -> Job:
    name = make_case_id(case(load_kN))
    work = fake_solve.FakeWork(case=case(load_kN), name=name, settings={})
    return replace(make_job(case(load_kN), name_case_folder(out, name), work), **settings)


def test_a_group_is_done_in_turn_and_shares_its_works_objects_after_pickling(tmp_path):
    shared = SharedLoads(case=case(50), loads_N=(50e3, 60e3))
    works = [CaseWork(case=case(load), name=f"{load}", loads=shared) for load in (50, 60)]
    jobs = tuple(replace(job(tmp_path, load), work=work) for load, work in zip((50, 60), works, strict=True))
    again = pickle.loads(pickle.dumps(jobs))
    assert again[0].work.loads is again[1].work.loads


@pytest.mark.parametrize(("workers", "sizes"), [(1, [3, 2, 1]), (3, [3, 2, 1]), (4, [2, 1, 1, 1, 1]), (9, [1] * 6)])
def test_groups_are_split_only_where_they_are_fewer_than_workers(tmp_path, workers, sizes):
    jobs = [job(tmp_path, load, group=group) for load, group in zip(range(50, 56), "aaabbc", strict=True)]
    groups = divide_into_groups(jobs, workers)
    assert [len(job_group) for job_group in groups] == sizes
    assert [job_group for group in groups for job_group in group] == jobs


@pytest.mark.parametrize(
    ("workers", "order"), [(1, "abcd"), (2, "bdac"), (3, "bdac"), (4, "abcd")], ids=["one", "two", "three", "enough"]
)
def test_the_longest_position_is_solved_first_where_workers_would_wait_for_it(monkeypatch, workers, order):
    seconds = {50e3: 3.0, 60e3: 9.0, 80e3: 5.0}

    def stand_in_preview(preview_case: Case) -> Any:
        if preview_case.load_N not in seconds:
            raise InputError("no contact")
        return type("Preview", (), {"cpu_seconds": seconds[preview_case.load_N]})

    monkeypatch.setattr("fecontact.runs.cost.preview_case", stand_in_preview)
    cases = dict(zip("abcd", map(case, (50, 60, 70, 80)), strict=True))
    assert sort_longest_first(cases, workers) == list(order)


def test_the_forecast_knows_that_two_patches_take_longer_than_one():
    cases = {f"{shift}": Case(lateral_shift_mm=shift, load_N=50e3) for shift in (3.0, 5.0, -2.0)}
    assert sort_longest_first(cases, 2)[0] == "5.0"


def test_loads_of_a_position_are_one_group_and_what_else_varies_is_another():
    cases = {
        f"{number}": replace(case(load), lateral_shift_mm=shift, **varied)
        for number, (load, shift, varied) in enumerate(
            [(60, 0.0, {}), (50, 0.0, {}), (50, 1.0, {}), (50, 0.0, {"resolution": "fine"})]
        )
    }
    shared = _share_loads(cases)
    assert shared["0"] == shared["1"]
    assert shared["0"][1].loads_N == (50e3, 60e3)
    assert [name for name, (_, loads) in shared.items() if loads is None] == ["2", "3"]
    assert len({where for where, _ in shared.values()}) == 3
    rolled = {f"{load}": replace(case(load), roll="loaded") for load in (50, 60)}
    assert all(loads is None for _, loads in _share_loads(rolled).values())


@pytest.mark.parametrize(("second", "times"), [("one", 1), ("two", 2)])
def test_a_job_that_comes_twice_in_a_run_is_done_once_even_by_force(tmp_path, second, times):
    first = job(tmp_path, run="one", force=True)
    assert run_job(first).failure is None
    assert run_job(replace(first, run=second)).failure is None
    assert len(fake_solve.solves(tmp_path)) == times


@pytest.mark.parametrize("field", ["solved_by", "evaluated_by"])
def test_a_worker_with_other_versions_solves_nothing(tmp_path, field):
    own_job = job(tmp_path)
    versions = {field: {**getattr(own_job.origin, field), "numpy": "99.1"}}
    outcome = run_job(replace(own_job, origin=replace(own_job.origin, **versions)))
    assert "numpy 99.1 -> " in (outcome.failure or "")
    assert fake_solve.solves(tmp_path) == []


def test_parts_together_give_the_whole_table(tmp_path, serial):
    for number in (2, 1):
        outcome = run(tmp_path, part=(number, 2))
        assert outcome.conclusion is None
    assert len(table(tmp_path / "study.part-1-of-2.csv")) == 3
    assert not (tmp_path / "study.csv").exists()
    parts = {path.name for path in tmp_path.glob("*.part-*")}
    assert parts >= {
        f"{file}.part-{k}-of-2.{kind}" for k in (1, 2) for file, kind in (("study", "csv"), ("run", "lock"))
    }
    # what a part says of itself is not needed: its cases are
    (tmp_path / "study.part-2-of-2.csv").unlink()
    (tmp_path / "run.part-1-of-2.lock").unlink()
    whole_run = run(tmp_path, study(conclude=lambda rows, out: f"{len(rows)} rows"))
    assert whole_run.conclusion == "5 rows"
    assert len(whole_run.reused) == 5
    assert len(fake_solve.solves(tmp_path)) == 5
    assert table(tmp_path / "study.csv") == serial
    # nothing is left that would look like a part to be put together
    assert list(tmp_path.glob("*.part-*")) == []


def test_a_part_that_lost_a_case_is_noticed_when_all_are_put_together(tmp_path, serial):
    for number in (1, 2):
        run(tmp_path, part=(number, 2))
    lost, damaged = sorted((tmp_path / "cases").iterdir())[:2]
    shutil.rmtree(lost)
    (damaged / "row.json").write_text("{}")
    whole_run = run(tmp_path)
    assert len(whole_run.reused) == 3
    assert whole_run.recomputed == {damaged.name: "row.json is damaged (its checksum differs)"}
    assert sorted(fake_solve.solves(tmp_path)[5:]) == sorted([lost.name, damaged.name])
    assert table(tmp_path / "study.csv") == serial


SCRIPT = """
import signal, sys
from pathlib import Path
sys.path.insert(0, {here!r})
from test_study import run
def main():
    run(Path(sys.argv[1]), workers=2)
if __name__ == "__main__":
    # a test run in the background has Ctrl-C ignored, and its children with it
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main()
"""


def begun_run(tmp_path: Path, out: Path) -> subprocess.Popen[str]:
    """A run as a process, with two cases finished and others under way."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(here=str(HERE)))
    process = subprocess.Popen([sys.executable, script, out], stderr=subprocess.PIPE, text=True)
    wait_until(lambda: len(list((out / "cases").glob("[!.]*"))) >= 2 and len(fake_solve.solves(out)) >= 3)
    return process


def wait_until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path, serial, number):
    out = tmp_path / "out"
    out.mkdir()
    fake_solve.plan(out, kN50="sleep 0.1", kN60="sleep 0.1", all="sleep 30")
    process = begun_run(tmp_path, out)
    children = psutil.Process(process.pid).children(recursive=True)
    assert len(children) >= 2
    process.send_signal(number)
    error = process.communicate(timeout=20)[1]
    _, alive = psutil.wait_procs(children, timeout=10)
    assert alive == [], "workers linger"
    if number == signal.SIGINT:
        assert "KeyboardInterrupt" in error
        assert len(table(out / "study.csv")) == 2
    fake_solve.plan(out)
    outcome = run(out)
    assert len(outcome.reused) == 2
    assert table(out / "study.csv") == serial
    assert not list((out / "cases").glob(".*"))


def begun_command(words: str) -> tuple[subprocess.Popen[str], list[psutil.Process]]:
    """A command on two workers that have begun, and all processes that it has started."""
    process = subprocess.Popen(
        [sys.executable, "-m", "fecontact", *words.split(), "--workers", "2"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    started = psutil.Process(process.pid)
    wait_until(
        lambda: sum("spawn_main" in " ".join(child_process.cmdline()) for child_process in started.children()) == 2
    )
    return process, started.children(recursive=True)


POOLED = [
    ("fecontact.features.irregular", "irregular --wavelengths-mm 30:200:1 --amplitudes-um 5:50:5"),
    ("fecontact.features.curves", "curve --radii 300,400,500 --theory half_space,strip"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("feature", "words"), POOLED)
def test_workers_end_with_their_command(feature, words):
    pytest.importorskip(feature)
    process, children = begun_command(words)
    process.kill()
    process.communicate(timeout=20)
    _, alive = psutil.wait_procs(children, timeout=10)
    assert alive == [], "workers linger"


@pytest.mark.parametrize(("feature", "words"), slow_but(POOLED, 0))
def test_a_command_whose_worker_is_killed_says_so(feature, words):
    pytest.importorskip(feature)
    process, children = begun_command(words)
    next(child for child in children if "spawn_main" in " ".join(child.cmdline())).kill()
    error = process.communicate(timeout=20)[1]
    assert "a worker process ended early" in error
    assert "Traceback" not in error
    assert process.returncode == 3
    assert psutil.wait_procs(children, timeout=10)[1] == []


@pytest.mark.parametrize(
    ("settings", "says"),
    [({"workers": 0}, "workers is 0"), ({"threads": 0}, "threads is 0"), ({"part": (3, 2)}, "part is 3/2")],
)
def test_settings_that_cannot_be(settings, says):
    with pytest.raises(InputError, match=says):
        RunSettings(**settings)


def test_part_is_written_as_i_of_n():
    assert parse_part("2/4") == (2, 4)
    with pytest.raises(InputError, match="such as 2/4"):
        parse_part("2")


def test_workers_are_bounded_by_cores_and_memory(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    memory = type("Memory", (), {"available": 7e9})
    monkeypatch.setattr(psutil, "virtual_memory", lambda: memory)
    assert count_default_workers() == 3
    memory.available = 1e9
    assert count_default_workers() == 1
    memory.available = 1e12
    assert count_default_workers() == 8


def test_threads_are_set_for_workers_and_restored(monkeypatch):
    monkeypatch.setenv("MKL_NUM_THREADS", "7")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with set_thread_environment(2):
        assert os.environ["MKL_NUM_THREADS"] == os.environ["OMP_NUM_THREADS"] == "2"
        assert workers.describe_wrong_threads(2) is None
        assert "MKL" in (workers.describe_wrong_threads(3) or "") or "OMP" in (workers.describe_wrong_threads(3) or "")
    assert os.environ["MKL_NUM_THREADS"] == "7"
    assert "OMP_NUM_THREADS" not in os.environ


@pytest.mark.slow
def test_real_cases_are_bit_identical_for_one_and_two_processes(tmp_path):
    cases = tuple(replace(case(load), resolution=(2.0, 1.8)) for load in (50, 80, 100))
    real = Study(name="real", cases=cases)
    for count in (1, 2):
        assert run_study(real, tmp_path / str(count), settings=RunSettings(workers=count)).all_converged
    assert table(tmp_path / "1" / "study.csv") == table(tmp_path / "2" / "study.csv")


@contextlib.contextmanager
def dask_processes(tmp_path: Path, count: int, strange: int = 0, **environment: str):
    """A scheduler and workers on loopback, some of another version.

    Returns the address and the processes, with the scheduler first.
    """
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    path = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    with set_thread_environment(1):
        env = dict(os.environ) | {"PYTHONPATH": path} | environment
    common = ["--scheduler-file", str(file), "--no-dashboard"]
    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", *common]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", *common]
    worker += ["--local-directory", str(tmp_path)]
    with (tmp_path / "dask.log").open("w") as log:
        processes = [subprocess.Popen(scheduler, stdout=log, stderr=log, env=env)]
        try:
            wait_until(file.exists)
            # elsewhere, as on another machine
            (tmp_path / "strange").mkdir()
            (tmp_path / "strange" / "sitecustomize.py").write_text("import fecontact; fecontact.__version__ = '99'")
            strange_env = env | {"PYTHONPATH": os.pathsep.join([str(tmp_path / "strange"), path])}
            environments = strange * [strange_env] + count * [env]
            processes += [
                subprocess.Popen(worker, stdout=log, stderr=log, env=worker_env, cwd="/") for worker_env in environments
            ]
            yield json.loads(file.read_text())["address"], processes
        finally:
            for process in processes:
                process.kill()
                process.wait()


@contextlib.contextmanager
def dask_cluster(tmp_path: Path, count: int, **environment: str):
    """A scheduler and workers on loopback: address, and the workers' processes."""
    with dask_processes(tmp_path, count, **environment) as (address, processes):
        yield address, processes[1:]


@pytest.mark.slow
def test_dask_workers_of_another_version_solve_nothing_and_others_do_their_jobs(tmp_path, serial, caplog):
    fake_solve.plan(tmp_path, all="sleep 0.3")
    with dask_processes(tmp_path, 1, strange=1) as (address, processes):
        wait_until(lambda: "Register worker" in (tmp_path / "dask.log").read_text() and _workers(address) == 2)
        outcome = run(tmp_path, scheduler=address)
        assert statuses(outcome) == ["converged"] * 5
        assert table(tmp_path / "study.csv") == serial
        # once, and not for each job that it was handed
        (warning,) = [message for message in caplog.messages if "has different versions or sources" in message]
        assert "fecontact 0.1.0 -> 99" in warning
        assert "other workers take its jobs" in warning
        # a job alone, with the scheduler's turn at each of both workers, is not handed to the same one for ever
        for load in (100.0, 110.0):
            with ThreadPoolExecutor(1) as runner:
                running = runner.submit(run, tmp_path / f"{load}", study((load,)), scheduler=address)
                try:
                    assert statuses(running.result(timeout=60)) == ["converged"]
                except TimeoutError:
                    processes[0].kill()
                    raise
        # none is left that could
        processes[2].kill()
        wait_until(lambda: _workers(address) == 1)
        with pytest.raises(InputError, match=r"fecontact 0\.1\.0 -> 99.*start workers with the same installation"):
            run(tmp_path / "none", scheduler=address)


def _workers(address: str) -> int:
    import distributed

    with distributed.Client(address, set_as_default=False) as client:
        return len(client.nthreads())


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_said_in_a_line_and_the_run_goes_on(tmp_path, serial):
    from fecontact.jobs.workers import WorkersLost

    out = tmp_path / "out"
    out.mkdir()
    fake_solve.plan(out, kN50="sleep 0.1", all="sleep 60")
    with dask_processes(tmp_path, 1) as (address, processes), ThreadPoolExecutor(1) as runner:
        running = runner.submit(run, out, scheduler=address)
        wait_until(lambda: len(fake_solve.solves(out)) >= 2 or running.done())
        processes[0].kill()
        with pytest.raises(WorkersLost, match=rf"scheduler {address}: connection lost .* run the same command") as lost:
            running.result(timeout=120)
        assert "\n" not in str(lost.value)
    assert len(table(out / "study.csv")) == 1
    fake_solve.plan(out)
    outcome = run(out)
    assert outcome.reused == (make_case_id(case(50)),)
    assert table(out / "study.csv") == serial
    assert not list((out / "cases").glob(".*"))


@pytest.mark.slow
def test_a_dask_worker_that_is_killed_loses_nothing_and_nothing_is_done_twice(tmp_path, serial):
    out = tmp_path / "out"
    out.mkdir()
    fake_solve.plan(out, kN60="sleep 2", kN80="sleep 2", all="sleep 0.1")
    with dask_cluster(tmp_path, 2) as (address, processes), ThreadPoolExecutor(1) as runner:
        running = runner.submit(run, out, scheduler=address)
        wait_until(lambda: len(set(fake_solve.solves(out))) >= 2 or running.done())
        time.sleep(0.5)
        finished = {path.name for path in (out / "cases").glob("[!.]*")}
        processes[0].kill()
        outcome = running.result(timeout=60)
    assert statuses(outcome) == ["converged"] * 5
    assert table(out / "study.csv") == serial
    solves = fake_solve.solves(out)
    assert set(solves) == {make_case_id(c) for c in study().cases}
    assert len(solves) <= len(LOADS_KN) + 1
    assert all(solves.count(name) == 1 for name in finished)


def test_a_scheduler_that_is_not_there(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    from fecontact.jobs import cluster

    monkeypatch.setattr(cluster, "_CONNECT_S", 1)
    with pytest.raises(InputError, match=r"scheduler tcp://127\.0\.0\.1:9: not reachable within 1 s"):
        run(tmp_path, scheduler="tcp://127.0.0.1:9")


def test_a_dask_worker_on_other_threads_is_refused(tmp_path):
    with (
        dask_cluster(tmp_path, 1, MKL_NUM_THREADS="2") as (address, _),
        pytest.raises(InputError, match="MKL_NUM_THREADS is 2; required: 1"),
    ):
        run(tmp_path / "out", scheduler=address)


def test_without_distributed_the_remedy_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="pip install distributed"):
        run(tmp_path, scheduler="tcp://127.0.0.1:9")


def test_a_worker_that_does_not_see_the_folder_says_so(tmp_path, monkeypatch):
    from fecontact.jobs import cluster

    monkeypatch.setattr(cluster, "_LOCK_FILE_WAIT_S", 0.0)
    with set_thread_environment(1):
        (tmp_path / "run.lock").touch()
        assert cluster.find_worker_problem(tmp_path / "run.lock", 1) is None
        assert "share" in (cluster.find_worker_problem(tmp_path / "other" / "run.lock", 1) or "")


@pytest.mark.slow
def test_real_cases_on_dask_are_those_of_one_process(tmp_path):
    cases = tuple(replace(case(load), resolution=(2.0, 1.8)) for load in (50, 80))
    real = Study(name="real", cases=cases)
    with dask_cluster(tmp_path, 2) as (address, _):
        run_study(real, tmp_path / "dask", settings=RunSettings(scheduler=address))
    run_study(real, tmp_path / "one", settings=RunSettings(workers=1))
    assert table(tmp_path / "dask" / "study.csv") == table(tmp_path / "one" / "study.csv")


def test_the_inputs_that_vary_are_named_with_their_values():
    base, soft = Case(), Material(young_MPa=200e3, poisson=0.3)
    assert describe_varied_inputs([base, replace(base, lateral_shift_mm=1.0, load_N=5e4, rail="54E1")]) == ["", ""]
    assert describe_varied_inputs([base, replace(base, resolution="fine")]) == ["resolution quick", "resolution fine"]
    assert describe_varied_inputs([base, replace(base, rail_material=soft)])[1] == "rail young_MPa 200000"
    both_soft = replace(base, rail_material=soft, wheel_material=soft, yaw_rad=1e-3)
    assert describe_varied_inputs([base, both_soft]) == ["yaw_mrad 0, young_MPa 210000", "yaw_mrad 1, young_MPa 200000"]
    # what a wheelset has is known by its wheel, what differs with one wheel is not
    other_case = replace(base, wheel="EN15302_A", rolling_radius_mm=500.0)
    assert describe_varied_inputs([base, other_case]) == ["", ""]
    assert describe_varied_inputs([base, other_case, replace(other_case, rolling_radius_mm=400.0)])[1:] == [
        "rolling_radius_mm 500", "rolling_radius_mm 400",
    ]  # fmt: skip
    # criteria make no other case: results are judged by others
    assert describe_varied_inputs([base, replace(base, criteria=Criteria(p_max=0.03))]) == ["", ""]
