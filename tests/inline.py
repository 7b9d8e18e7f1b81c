"""Jobs done in this process, one after the other: the tests run beside each other already."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from fecontact.jobs.workers import Crew


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
