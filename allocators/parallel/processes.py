"""Members of a population in processes of this machine; what dies with a process is done again in another."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import connection, resource_tracker
from typing import Any

import torch

from alloc.allocators.parallel.engine import PATIENCE_S, Engine, EngineError, R, T, answer, never, request, result
from alloc.allocators.parallel.processors import available_threads

TRIES = 3
"""Times that an item is begun at the most; a process that dies three times at it will die again."""


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


def _given_up(tries: int, exit_code: int | None) -> str:
    return (
        f"a worker process died {tries} times at the same item (exit code {exit_code}); too little memory is the usual "
        "reason: use fewer workers. A script that trains needs `if __name__ == '__main__':`"
    )


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Start processes that Ctrl-C does not reach before they can say so themselves: they inherit the mask."""
    resource_tracker.ensure_running()  # otherwise it starts with the first process, and unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
