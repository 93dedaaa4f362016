"""Calls as bytes: how a function and its item reach another process, and how the result comes back."""

import pickle
import traceback
from collections.abc import Callable
from typing import Generic

from alloc.allocators.parallel.engine import R, T


class RemoteCall(Generic[T, R]):
    """A function whose calls are run by `run_call` in another process.

    Plain pickle, not that of `Connection.send`, for which torch registers handles of shared memory: they die with
    their sender.

    Parameters
    ----------
    function : callable
        Importable by name in the other process.
    """

    def __init__(self, function: Callable[[T], R]) -> None:
        self.function = function

    def request(self, item: T) -> bytes:
        """Return the call of the function with `item`, for `run_call`."""
        return pickle.dumps((self.function, item))

    def result(self, reply: bytes) -> R:
        """Return the result in a reply of `run_call`, or raise its exception with a note of the remote traceback."""
        value, trace = pickle.loads(reply)
        if trace is not None:
            value.add_note(f"In a worker process:\n{trace}")
            raise value
        outcome: R = value
        return outcome


def run_call(request: bytes) -> bytes:
    """Run a call; return its pickled result and None, or its pickled exception and the traceback."""
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
