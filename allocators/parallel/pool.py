"""A thread pool for parts of a run that proceed concurrently."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


class Pool(ThreadPoolExecutor):
    """A thread pool that runs calls in the calling thread once the interpreter shuts down and starts no threads.

    A run in a non-daemon thread, which the program waits for at its end, has its whole time limit even then.
    """

    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        """See `concurrent.futures.Executor.submit`."""
        try:
            return super().submit(fn, *args, **kwargs)
        except RuntimeError as error:
            if "after" not in str(error):  # "cannot schedule new futures after [interpreter] shutdown"
                raise
        done: Future[R] = Future()
        try:
            done.set_result(fn(*args, **kwargs))
        except BaseException as error:
            done.set_exception(error)
        return done
