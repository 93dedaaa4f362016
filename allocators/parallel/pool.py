"""A thread pool for concurrent parts of a run."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


class RunAll(Protocol):
    """Calls a function for each item and returns the results in the order of the items, as `map` does."""

    def __call__(self, function: Callable[[T], R], items: Iterable[T], /) -> Iterable[R]:
        """Call `function` with each of `items`."""


@contextmanager
def thread_map(threads: int) -> Iterator[RunAll]:
    """Yield a `map` that makes its calls in `threads` threads, or in the calling thread if `threads` is 1.

    A method divides a number of iterations into calls that mostly release the global interpreter lock, and waits for
    all of them; it then exchanges plans between them and submits what they found in its own thread. Thus the answer
    depends on the number of threads, but not on their speeds.
    """
    if threads == 1:
        yield map
        return
    with Pool(threads) as pool:
        yield pool.map


class Pool(ThreadPoolExecutor):
    """A thread pool that runs calls in the calling thread when the interpreter shuts down and starts no new threads.

    A run in a non-daemon thread, for which the program waits at its end, thus has its full time limit even then.
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
