"""Where the members of a population are worked on: one by one, in processes of this machine, or on a Ray cluster.

An engine applies one function to many items. The function is pure and found by its name (a top-level function, or a
`functools.partial` of one), so an item whose process or machine dies is simply run again, and every engine gives the
same results to the last bit: they all give torch the same number of threads.
"""

import contextlib
import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import connection, resource_tracker
from typing import Any, Protocol, Self, TypeVar

import torch

from alloc.allocators.solve import available_threads
from alloc.problems import InputError
from alloc.problems.errors import nearest

T = TypeVar("T")
R = TypeVar("R")

ENGINES = ("serial", "processes", "ray")
TRIES = 3
"""Times that an item is begun at the most; a process that dies three times at it will die again."""

PATIENCE_S = 0.05
"""Time between two questions whether to stop."""


class EngineError(RuntimeError):
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
        with _torch_threads(self.threads):
            for item in items:
                if should_stop():
                    return None
                results.append(function(item))
        return results

    def close(self) -> None:
        """See `Engine.close`; there is nothing to end."""


class ProcessEngine(Engine):
    """Items in processes of this machine, each with a pipe of its own.

    The executors of the standard library lose all workers with one, and cannot drop an item under work. Here a killed
    worker costs nothing but its own item's time. Not for use by several threads at once.

    Parameters
    ----------
    workers : int, optional
        Processes; as many as this process may use processors if not given.
    threads : int
        Threads of torch in each.
    tries : int
        Times that an item is begun at the most.
    """

    def __init__(self, workers: int | None = None, threads: int = 1, tries: int = TRIES) -> None:
        self.size = workers or available_threads()
        self.threads, self.tries = threads, tries
        self._workers: list[_Worker] = []

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never
    ) -> list[R] | None:
        """See `Engine.map`."""
        waiting = deque(range(len(items)))
        tries, results = [0] * len(items), dict[int, R]()
        try:
            while len(results) < len(items):
                if should_stop():
                    return None
                self._hand_out(function, items, waiting, tries)
                for worker in self._ready():
                    index, answered = worker.end()
                    if answered is not None:
                        results[index] = result(answered)
                        continue
                    self._dismiss([worker])
                    if tries[index] == self.tries:
                        raise EngineError(_given_up(self.tries, worker.exit_code))
                    waiting.appendleft(index)
        finally:
            self._dismiss([worker for worker in self._workers if worker.item is not None])
        return [results[index] for index in range(len(items))]

    def _hand_out(self, function: Callable[[T], R], items: Sequence[T], waiting: deque[int], tries: list[int]) -> None:
        """Give every idle worker an item, with new workers in the place of dead ones and as far as there is work."""
        self._dismiss([worker for worker in self._workers if worker.item is None and not worker.alive])
        busy = sum(worker.item is not None for worker in self._workers)
        while len(self._workers) < min(self.size, busy + len(waiting)):
            self._workers.append(_Worker(self.threads))
        for worker in self._workers:
            if worker.item is None and waiting:
                index = waiting.popleft()
                tries[index] += 1
                worker.begin(index, request(function, items[index]))

    def _ready(self) -> list["_Worker"]:
        """Wait a little for workers that answer or die."""
        busy = [worker for worker in self._workers if worker.item is not None]
        signs = connection.wait([sign for worker in busy for sign in worker.signs], PATIENCE_S)
        return [worker for worker in busy if any(sign in signs for sign in worker.signs)]

    def _dismiss(self, workers: Sequence["_Worker"]) -> None:
        self._workers = [worker for worker in self._workers if worker not in workers]
        for worker in workers:
            worker.kill()

    def close(self) -> None:
        """See `Engine.close`."""
        self._dismiss(self._workers)


class _Worker:
    """A process, our end of its pipe, and the index of the item that it works on."""

    def __init__(self, threads: int) -> None:
        context = multiprocessing.get_context("spawn")  # a fork would inherit torch's threads in a state of ruin
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, threads), daemon=True)
        with _interrupts_blocked():
            self._process.start()
        theirs.close()  # the worker's death closes the last copy, and we read the end of file
        self.item: int | None = None
        self.exit_code: int | None = None

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    @property
    def signs(self) -> tuple[Any, int]:
        """What becomes readable when there is an answer, or when the process is dead."""
        return self._pipe, self._process.sentinel

    def begin(self, item: int, asked: bytes) -> None:
        self.item = item
        with contextlib.suppress(OSError):  # it is dead, as `end` will find
            self._pipe.send_bytes(asked)

    def end(self) -> tuple[int, bytes | None]:
        """Return the item, and the answer or None if the process died."""
        assert self.item is not None
        item, self.item = self.item, None
        try:
            return item, self._pipe.recv_bytes() if self._pipe.poll() else None
        except (EOFError, OSError):  # it died before or while it wrote
            return item, None

    def kill(self) -> None:
        self._process.kill()
        self._process.join()
        self.exit_code = self._process.exitcode
        self._process.close()
        self._pipe.close()


def _serve(pipe: "connection.Connection[bytes, bytes]", threads: int) -> None:
    """Answer requests until the pipe is closed or the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent decides
    threading.Thread(target=_die_with_parent, daemon=True).start()
    torch.set_num_threads(threads)
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(answer(pipe.recv_bytes()))


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


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
    except Exception as error:
        story = traceback.format_exc()
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return pickle.dumps((error, story))


def result(answered: bytes) -> Any:
    """Return the result in an answer, or raise its exception."""
    value, story = pickle.loads(answered)
    if story is None:
        return value
    value.add_note(f"In a worker process:\n{story}")
    raise value


def _given_up(tries: int, exit_code: int | None) -> str:
    return (
        f"a worker process died {tries} times at the same item (exit code {exit_code}); too little memory is the usual "
        "reason: use fewer workers. A script that trains needs `if __name__ == '__main__':`"
    )


@contextlib.contextmanager
def _torch_threads(threads: int) -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach before they can say so themselves: they inherit the mask."""
    resource_tracker.ensure_running()  # otherwise it starts with the first process, and unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def make_engine(
    name: str = "serial", workers: int | None = None, address: str | None = None, threads: int = 1
) -> Engine:
    """Return the engine of the options ``--engine``, ``--workers`` and ``--address``.

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
    if name not in ENGINES:
        raise InputError(f"no such engine: {name!r}{nearest(name, ENGINES)}", "--engine")
    if workers is not None and name != "processes":
        raise InputError("belongs to --engine processes", "--workers")
    if address is not None and name != "ray":
        raise InputError("belongs to --engine ray", "--address")
    if name == "ray":
        from alloc.allocators.learned.ray_engine import RayEngine

        return RayEngine(address, threads)
    return ProcessEngine(workers, threads) if name == "processes" else SerialEngine(threads)
