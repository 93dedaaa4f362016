"""The serial engine: runs items one after another in the calling thread."""

from collections.abc import Callable, Sequence

from alloc.allocators.parallel.engine import Engine, R, T, never_stop


class SerialEngine(Engine):
    """Runs items one after another in the calling thread.

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
        """See `Engine.close`; does nothing."""
