"""The protocol of engines, which apply a function to many items, in this process or elsewhere.

The function is pure and importable by name (a top-level function, or a `functools.partial` of one), so that an item
whose process or machine dies can be run again, and every engine returns the same results. Engines do not depend on what
the function computes; a function that needs a certain number of threads in a library must set it itself.
"""

from collections.abc import Callable, Sequence
from typing import Protocol, Self, TypeVar

from alloc.problems import AllocError

T = TypeVar("T")
R = TypeVar("R")

POLL_S = 0.05
"""Seconds between two checks for a stop request."""


class EngineError(AllocError, RuntimeError):
    """An item was given up because every process that worked on it died."""


def never_stop() -> bool:
    """Return False, as there is no stop request."""
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
            Pure and picklable; its exceptions are re-raised here.
        items : sequence
            Picklable values. A tensor is sent with the whole storage of which it is a view.
        should_stop : callable
            Returns whether to stop; called every `POLL_S` seconds, or between items by the serial engine.

        Returns
        -------
        list or None
            None if `should_stop` returned True before all items were done; unfinished items are dropped.

        Raises
        ------
        EngineError
            If processes that work on an item die repeatedly.
        """
        ...

    def close(self) -> None:
        """End processes and connections; further calls do nothing."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
