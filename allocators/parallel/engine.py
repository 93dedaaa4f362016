"""The protocol of engines: one function applied to many items, wherever the work is done.

The function is pure and importable by name (a top-level function, or a `functools.partial` of one), so that an item
whose process or machine dies is simply run again, and every engine returns the same results. Engines know nothing of
what the function computes; one that depends on the number of threads of a library sets it itself.
"""

from collections.abc import Callable, Sequence
from typing import Protocol, Self, TypeVar

from alloc.problems import AllocError

T = TypeVar("T")
R = TypeVar("R")

POLL_S = 0.05
"""Seconds between two checks for a stop request."""


class EngineError(AllocError, RuntimeError):
    """An item was given up, as every process that worked on it died."""


def never_stop() -> bool:
    """Return False: there is no stop request."""
    return False


class Engine(Protocol):
    """Applies a function to many items; a context manager that ends its processes.

    Attributes
    ----------
    threads : int
        Threads that each item may use.
    """

    threads: int

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never_stop
    ) -> list[R] | None:
        """Return the results of the function for all items, in the order of `items`.

        Parameters
        ----------
        function : callable
            Pure and picklable; its exceptions are raised here.
        items : sequence
            Picklable values. A tensor is sent with the whole storage that it is a view of.
        should_stop : callable
            Whether to stop; called every `POLL_S` seconds, by the serial engine between two items only.

        Returns
        -------
        list or None
            None if `should_stop` returned True before every item was done; unfinished items are dropped.

        Raises
        ------
        EngineError
            If the process that works on an item dies again and again.
        """
        ...

    def close(self) -> None:
        """End the processes and connections; a second call does nothing."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
