"""Where the members of a population are worked on: one by one, in processes of this machine, or on a Ray cluster.

An engine applies one function to many items. The function is pure and found by its name (a top-level function, or a
`functools.partial` of one), so an item whose process or machine dies is simply run again, and every engine gives the
same results to the last bit: they all give torch the same number of threads.
"""

import pickle
import traceback
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any, Protocol, Self, TypeVar

from alloc.allocators.parallel.torch_state import plain_torch, torch_threads
from alloc.problems import InputError, MissingPackageError, TrainingError
from alloc.problems.errors import nearest

T = TypeVar("T")
R = TypeVar("R")

ENGINES = ("serial", "processes", "ray")
PATIENCE_S = 0.05
"""Time between two questions whether to stop."""


class EngineError(TrainingError):
    """An item was given up, as every process that worked on it died."""


def never() -> bool:
    """Return False: nobody asks to stop."""
    return False


class Engine(Protocol):
    """Applies a function to many items; a context manager that ends its processes."""

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never
    ) -> list[R] | None:
        """Return the function of every item, in the order of `items`.

        Parameters
        ----------
        function : callable
            Pure and picklable; what it raises is raised here.
        items : sequence
            Picklable values. A tensor travels with all of the storage that it is a view of.
        should_stop : callable
            Asked all the time, by the serial engine between two items only.

        Returns
        -------
        list or None
            None if `should_stop` said so before every item was done; items under work are dropped.

        Raises
        ------
        EngineError
            If processes keep dying at an item.
        """
        ...

    def close(self) -> None:
        """End the processes and connections; a second call does nothing."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class SerialEngine(Engine):
    """One item after the other, in this process.

    Parameters
    ----------
    threads : int
        Threads of torch while it works; figures depend on it in the last bits.
    """

    def __init__(self, threads: int = 1) -> None:
        self.threads = threads

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never
    ) -> list[R] | None:
        """See `Engine.map`."""
        results = []
        with plain_torch(), torch_threads(self.threads):
            for item in items:
                if should_stop():
                    return None
                results.append(function(item))
        return results

    def close(self) -> None:
        """See `Engine.close`; there is nothing to end."""


def request(function: Callable[[T], R], item: T) -> bytes:
    """Return a piece of work, for `answer` in another process.

    Plain pickle, not the one of `Connection.send`, which torch makes send handles of shared memory: they die with
    their sender.
    """
    return pickle.dumps((function, item))


def answer(asked: bytes) -> bytes:
    """Do the work, and return its pickled result, or the pickled exception and its traceback."""
    try:
        function, item = pickle.loads(asked)
        return pickle.dumps((function(item), None))
    except Exception as error:  # raised again where the work was asked for
        story = traceback.format_exc()
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # an exception of somebody else that does not travel
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return pickle.dumps((error, story))


def result(answered: bytes) -> Any:
    """Return the result in an answer, or raise its exception."""
    value, story = pickle.loads(answered)
    if story is None:
        return value
    value.add_note(f"In a worker process:\n{story}")
    raise value


def check_engine(name: str, workers: int | None = None, address: str | None = None) -> None:
    """Raise an `InputError` for options that `make_engine` would refuse, as far as that can be told at once."""
    if name not in ENGINES:
        raise InputError(f"no such engine: {name!r}{nearest(name, ENGINES)}", "engine")
    if workers is not None and name != "processes":
        raise InputError("belongs to the engine processes", "workers")
    if address is not None and name != "ray":
        raise InputError("belongs to the engine ray", "address")
    if name == "ray" and find_spec("ray") is None:
        raise MissingPackageError("Ray is not installed: pip install 'alloc-mrta[cluster]'", "engine")


def make_engine(
    name: str = "serial", workers: int | None = None, address: str | None = None, threads: int = 1
) -> Engine:
    """Return an engine.

    Parameters
    ----------
    name : str
        ``serial``, ``processes`` or ``ray``.
    workers : int, optional
        Processes, for ``processes`` only.
    address : str, optional
        Head of the cluster, for ``ray`` only; see `RayEngine`.
    threads : int
        Threads of torch for each item.

    Raises
    ------
    InputError
        If there is no such engine, if an option does not belong to it, if Ray is not installed or nobody is at
        `address`.
    """
    check_engine(name, workers, address)
    if name == "ray":
        from alloc.allocators.parallel.ray import RayEngine

        return RayEngine(address, threads)
    if name == "processes":
        from alloc.allocators.parallel.processes import ProcessEngine

        return ProcessEngine(workers, threads)
    return SerialEngine(threads)
