"""A thread pool for parts of a run that proceed concurrently."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


class RunAll(Protocol):
    """Makes one call for each item, and gives the results in their order, as `map` does."""

    def __call__(self, function: Callable[[T], R], items: Iterable[T], /) -> Iterable[R]:
        """Call `function` with each of `items`."""


@contextmanager
def side_by_side(threads: int) -> Iterator[RunAll]:
    """Give what makes calls in so many threads, or in the calling thread where there is one.

    A method divides a count of iterations into calls, which let go of the interpreter's lock for most of their time,
    and goes on once all have ended: it exchanges plans between them and submits what they found in its own thread.
    Thus the answer depends on the number of threads, but not on which of them is faster.
    """
    if threads == 1:
        yield map
        return
    with Pool(threads) as pool:
        yield pool.map


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
