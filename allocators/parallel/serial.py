"""The serial engine: one item after the other, in the calling thread."""

from collections.abc import Callable, Sequence

from alloc.allocators.parallel.engine import Engine, R, T, never_stop


class SerialEngine(Engine):
    """One item after the other, in this process.

    Parameters
    ----------
    threads : int
        Threads that each item may use.
    """

    def __init__(self, threads: int = 1) -> None:
        self.threads = threads

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never_stop
    ) -> list[R] | None:
        """See `Engine.map`."""
        results = []
        for item in items:
            if should_stop():
                return None
            results.append(function(item))
        return results

    def close(self) -> None:
        """See `Engine.close`; there is nothing to end."""
