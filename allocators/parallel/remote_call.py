"""Serialisation of calls: how a function and its item reach another process, and how the result returns."""

import pickle
import traceback
from collections.abc import Callable
from typing import Generic

from alloc.allocators.parallel.engine import R, T


class RemoteCall(Generic[T, R]):
    """A function whose calls `run_call` runs in another process.

    Uses plain pickle in place of `Connection.send`, for which torch registers shared-memory handles that become invalid
    when the sender dies.

    Parameters
    ----------
    function : callable
        Importable by name in the other process.
    """

    def __init__(self, function: Callable[[T], R]) -> None:
        self.function = function

    def request(self, item: T) -> bytes:
        """Return the serialised call of the function with `item`, for `run_call`."""
        return pickle.dumps((self.function, item))

    def result(self, reply: bytes) -> R:
        """Return the result in a reply of `run_call`, or raise its exception with the remote traceback as a note."""
        value, trace = pickle.loads(reply)
        if trace is not None:
            value.add_note(f"In a worker process:\n{trace}")
            raise value
        outcome: R = value
        return outcome


def run_call(request: bytes) -> bytes:
    """Run a call; return a pickle of its result and None, or of its exception and traceback."""
    try:
        function, item = pickle.loads(request)
        return pickle.dumps((function(item), None))
    except Exception as error:  # raised again by `RemoteCall.result`
        trace = traceback.format_exc()
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # an exception of another package that cannot be pickled
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return pickle.dumps((error, trace))
