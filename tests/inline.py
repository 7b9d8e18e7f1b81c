"""Jobs done in this process, one after the other: the tests run beside each other already."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

import pytest

from fecontact.jobs.workers import Crew
from fecontact.runs.study import StudyOutcome, run_study


class Inline(Executor):
    """Calls at once, in the thread that asks: gmsh must not be used from another one."""

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
    """Another crew in the place of processes, and another work in that of the solution."""
    with pytest.MonkeyPatch.context() as patch:
        if crew is not None:
            patch.setattr("fecontact.jobs.engine.process_crew", lambda workers, threads: crew)
        if work is not None:
            patch.setattr(place, work)
        yield


def study_by(
    *arguments: Any, crew: Crew | None = None, work: Callable[..., Any] | None = None, **more: Any
) -> StudyOutcome:
    """`run_study` with another crew or work."""
    with stand_ins(crew, work, "fecontact.runs.study.Solving"):
        return run_study(*arguments, **more)
