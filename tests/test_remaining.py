"""Estimates of the remaining time, against schedules of invented durations."""

import heapq
from types import SimpleNamespace

import numpy as np
import pytest

from fecontact.jobs.engine import _JobProgress
from fecontact.jobs.remaining import estimate_seconds_left, format_duration, report_progress
from fecontact.jobs.store import Origin, read_job_progress, replace_folder, write_job_progress
from fecontact.jobs.workers import Job, JobOutcome
from fecontact.solving.meshes import Meshes


def schedule(durations: list[float], workers: int) -> list[tuple[float, float]]:
    """Begin and end of each job; the next job goes to the first free worker."""
    free = [0.0] * workers
    spans = []
    for seconds in durations:
        begin = heapq.heappop(free)
        heapq.heappush(free, begin + seconds)
        spans.append((begin, begin + seconds))
    return spans


def remaining_times(durations: list[float], workers: int) -> list[tuple[float, float, float]]:
    """Remaining time at the end of each job: estimate, estimate by the mean, exact value.

    The mean is over all finished jobs.
    """
    spans = schedule(durations, workers)
    last = max(end for _, end in spans)
    lines = []
    for now in sorted({end for _, end in spans})[:-1]:
        finished = [end - begin for begin, end in spans if end <= now]
        ages = [now - begin for begin, end in spans if begin <= now < end]
        left = estimate_seconds_left(finished, ages, len(spans) - len(finished) - len(ages), workers)
        assert left is not None
        lines.append((left, now / len(finished) * (len(spans) - len(finished)), last - now))
    return lines


@pytest.mark.parametrize(("jobs", "workers"), [(9, 2), (10, 3), (4, 4), (7, 1), (13, 5)])
def test_the_time_left_of_equal_jobs_is_exact(jobs, workers):
    lines = remaining_times([12.0] * jobs, workers)
    assert [left for left, _, _ in lines] == pytest.approx([rest for _, _, rest in lines])


@pytest.mark.parametrize(("jobs", "workers"), [(11, 2), (20, 4), (40, 8)])
def test_the_time_left_of_similar_jobs_is_exact_to_half_a_job(jobs, workers):
    """Error of the estimate, compared with the mean over all finished jobs.

    The mean ignores the jobs that are running; its error is more than twice the error of the estimate.
    """
    random = np.random.default_rng(1)
    lines = [line for _ in range(100) for line in remaining_times(list(random.lognormal(2.0, 0.2, jobs)), workers)]
    off = np.mean([[abs(left - rest), abs(before - rest)] for left, before, rest in lines], axis=0)
    assert off[0] < 0.5 * np.exp(2.0)
    assert off[0] < 0.5 * off[1]


def test_the_last_jobs_are_not_told_to_begin_anew():
    # seconds of the nine positions of the first study; the slow positions are in the middle
    lines = remaining_times([6.5, 6.6, 6.2, 10.9, 12.6, 8.9, 12.4, 5.1, 5.3], 2)
    assert [(round(left), round(rest)) for left, _, rest in lines[-2:]] == [(8, 6), (1, 1)]


def test_a_job_that_takes_longer_than_all_others_is_not_told_to_be_over():
    assert estimate_seconds_left([10.0, 12.0], [40.0], 0, 2) == 10.0
    assert estimate_seconds_left([10.0, 12.0], [11.0], 0, 2) == 1.0
    assert estimate_seconds_left([], [3.0], 5, 2) is None


def test_a_run_tells_what_is_left_of_it(monkeypatch, tmp_path):
    now = [100.0]
    monkeypatch.setattr("fecontact.jobs.engine.time.monotonic", lambda: now[0])
    origin = Origin(solved_by={}, evaluated_by={})
    jobs = [
        Job(name=name, folder=tmp_path / name, origin=origin, origin_here=lambda: origin, work=lambda *_: False)
        for name in "abcdef"
    ]
    heard: list[tuple[int, int, str]] = []
    # a single job was finished before, and is only read
    engine = SimpleNamespace(
        reused=["f"], recomputed={}, crew=SimpleNamespace(workers=2), progress=lambda *args: heard.append(args)
    )
    report = _JobProgress(jobs, engine, None)
    report.under_way(["a", "b"])
    now[0] += 10.0
    report.receive(JobOutcome(name="a", seconds=10.0))
    report.under_way(["b", "c"])
    now[0] += 10.0
    report.receive(JobOutcome(name="b", seconds=20.0))
    # a cluster has all jobs, and runs two at a time
    report.under_way(["c", "d", "e", "f"])
    assert heard == [
        (0, 6, "solving a, b"),
        # b is as old as the only finished job: a quarter of its age; c: 10 s; then two more jobs of 10 s
        (1, 6, "solving b, c; about 20 s left"),
        # c has 10 s left of 20 s, the duration of the only longer job; d takes 15 s, like the waiting job
        (2, 6, "solving c, d, e, f; about 25 s left"),
    ]


@pytest.mark.parametrize(("seconds", "text"), [(0.4, "0 s"), (99.0, "99 s"), (150.0, "2 min"), (9000.0, "2.5 h")])
def test_durations_are_short(seconds, text):
    assert format_duration(seconds) == text


def test_a_job_that_tells_its_parts_goes_on_as_it_went():
    assert estimate_seconds_left([], [30.0], 0, 1) is None
    # no job has ended: 3 of 4 parts took 30 s, and a second job waits
    assert estimate_seconds_left([], [30.0], 1, 1, [0.75]) == pytest.approx(10.0 + 40.0)
    # a job that does not report its progress takes as long as the finished jobs
    assert estimate_seconds_left([20.0], [30.0, 5.0], 0, 2, [0.5, 0.0]) == pytest.approx(max(60.0 - 30.0, 40.0 - 5.0))


def test_what_a_job_says_is_beside_its_folder_until_it_ends(tmp_path):
    folder = tmp_path / "positions" / "one"
    origin = Origin(solved_by={}, evaluated_by={})
    assert read_job_progress(folder, "one") == (0.0, "")
    with replace_folder(folder, "one", origin) as temporary:
        write_job_progress(temporary, "one", 0.25, "1 of 3 loads")
        assert read_job_progress(folder, "one") == (0.25, "(1 of 3 loads)")
    assert read_job_progress(folder, "one") == (0.0, "")
    assert [path.name for path in folder.parent.iterdir()] == ["one"]


def test_results_are_watched_with_the_time_that_is_left(monkeypatch):
    clock = iter([0.0, 3.0, 6.0, 9.0])
    monkeypatch.setattr("fecontact.jobs.remaining.time.monotonic", lambda: next(clock))
    calls = []
    assert list(report_progress("abc", 3, lambda *arguments: calls.append(arguments), "lines")) == ["a", "b", "c"]
    assert calls == [(0, 3, "lines"), (1, 3, "lines; about 6 s left"), (2, 3, "lines; about 3 s left")]
    # without jobs, nothing is reported
    assert list(report_progress("", 0, lambda *arguments: calls.append(arguments), "lines")) == []
    assert len(calls) == 3


def test_meshes_say_how_long_they_take_by_what_the_finest_ones_took(monkeypatch):
    """A power of the unknowns, as the cost of a case before it is solved; nothing where steel yields."""
    clock = SimpleNamespace(stage="")
    position = SimpleNamespace(clock=clock, case=SimpleNamespace(may_yield=False, refine="auto"))
    meshes, stages = Meshes(position), []
    now = iter([0.0, 8.0, 8.0, 10.0, 10.0, 26.0, 26.0, 42.0])
    monkeypatch.setattr("fecontact.solving.meshes.time.perf_counter", lambda: next(now))
    monkeypatch.setattr(meshes, "_solved", lambda position, coarser: stages.append(clock.stage))
    level = SimpleNamespace(degrees_of_freedom={"rail": 10_000, "wheel": 20_000})
    for coarser, unknowns in ((1.0, None), (1.5, 15_000.0), (1 / 1.5, 60_000.0)):
        meshes._level(position, coarser, unknowns and meshes._left_s([level], unknowns))
    position.case.refine = "evidence"
    meshes._level(position, 1 / 1.5)
    assert stages == [
        "first meshes",
        f"coarser meshes, for the uncertainty, about {8.0 * 0.5**1.16:.0f} s left",
        f"finer meshes, because the verdict is unresolved, about {8.0 * 2.0**1.16:.0f} s left if these resolve it",
        "finer meshes, because the verdict, or the verdict on the nodes of the elements, is unresolved",
    ]
    # from then on, the finest meshes count
    assert meshes._left_s([level], 30_000.0) == pytest.approx(16.0)
    position.case.may_yield = True
    assert meshes._left_s([level], 30_000.0) is None
