"""Jobs done in this process, in sequence: the tests already run in parallel."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

import pytest

from fecontact.jobs.workers import Crew
from fecontact.runs.study import StudyOutcome, run_study


class Inline(Executor):
    """Immediate calls in the calling thread: gmsh must not be used from another thread."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def inline_crew() -> Crew:
    """A crew of this process alone."""
    return Crew(open=lambda count: Inline(), workers=1, together=1)


@contextmanager
def stand_ins(crew: Crew | None, work: Callable[..., Any] | None, place: str) -> Iterator[None]:
    """Replace the crew of processes by another crew, and the work of the solution by another work."""
    with pytest.MonkeyPatch.context() as patch:
        if crew is not None:
            patch.setattr("fecontact.jobs.engine.make_process_crew", lambda workers, threads: crew)
        if work is not None:
            patch.setattr(place, work)
        yield


def study_by(
    *arguments: Any, crew: Crew | None = None, work: Callable[..., Any] | None = None, **options: Any
) -> StudyOutcome:
    """`run_study` with another crew or work."""
    with stand_ins(crew, work, "fecontact.runs.study.CaseWork"):
        return run_study(*arguments, **options)
