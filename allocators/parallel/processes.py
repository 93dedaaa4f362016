"""The process engine: runs items in local processes; if a process dies, its item is run again in another."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import connection, resource_tracker

from alloc.allocators.parallel.engine import POLL_S, Engine, EngineError, R, T, never_stop
from alloc.allocators.parallel.processors import available_threads
from alloc.allocators.parallel.remote_call import RemoteCall, run_call

MAX_ATTEMPTS = 3
"""Attempts at an item; after three deaths, a further attempt would most likely fail as well."""


class ProcessEngine(Engine):
    """Runs items in processes on this machine, each with its own pipe.

    The executors of the standard library lose all workers if one dies, and cannot drop a running item. Here a killed
    worker costs only the time spent on its own item. Not thread-safe.

    Parameters
    ----------
    workers : int, optional
        Number of processes; by default the number of available processors.
    threads : int
        Threads that each item may use.
    max_attempts : int
        Attempts at an item before it is given up.
    """

    def __init__(self, workers: int | None = None, threads: int = 1, max_attempts: int = MAX_ATTEMPTS) -> None:
        self.size = workers or available_threads()
        self.threads, self.max_attempts = threads, max_attempts
        self._workers: list[_Worker] = []

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never_stop
    ) -> list[R] | None:
        """See `Engine.map`."""
        call = RemoteCall(function)
        waiting = deque(range(len(items)))
        attempts, results = [0] * len(items), dict[int, R]()
        try:
            while len(results) < len(items):
                if should_stop():
                    return None
                self._assign(call, items, waiting, attempts)
                for worker in self._finished():
                    index, reply = worker.take_reply()
                    if reply is not None:
                        results[index] = call.result(reply)
                        continue
                    self._dismiss([worker])
                    if attempts[index] == self.max_attempts:
                        raise EngineError(_given_up(self.max_attempts, worker.exit_code))
                    waiting.appendleft(index)
        finally:
            self._dismiss([worker for worker in self._workers if worker.item is not None])
        return [results[index] for index in range(len(items))]

    def _assign(self, call: RemoteCall[T, R], items: Sequence[T], waiting: deque[int], attempts: list[int]) -> None:
        """Assign waiting items to idle workers; replace dead workers, and start more if there are items for them."""
        self._dismiss([worker for worker in self._workers if worker.item is None and not worker.alive])
        busy = sum(worker.item is not None for worker in self._workers)
        while len(self._workers) < min(self.size, busy + len(waiting)):
            self._workers.append(_Worker())
        for worker in self._workers:
            if worker.item is None and waiting:
                index = waiting.popleft()
                attempts[index] += 1
                worker.start(index, call.request(items[index]))

    def _finished(self) -> list["_Worker"]:
        """Return the workers that have replied or died, after waiting up to `POLL_S` seconds for one."""
        busy = [worker for worker in self._workers if worker.item is not None]
        ready = connection.wait([handle for worker in busy for handle in worker.handles], POLL_S)
        return [worker for worker in busy if any(handle in ready for handle in worker.handles)]

    def _dismiss(self, workers: Sequence["_Worker"]) -> None:
        self._workers = [worker for worker in self._workers if worker not in workers]
        for worker in workers:
            worker.kill()

    def close(self) -> None:
        """See `Engine.close`."""
        self._dismiss(self._workers)


class _Worker:
    """A process, the parent's end of its pipe, and the index of its current item."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")  # a forked process would inherit the locks of other threads
        self._pipe, child_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(child_end,), daemon=True)
        try:
            with _interrupts_blocked():
                self._process.start()
        except BaseException:
            self._pipe.close()
            raise
        finally:
            child_end.close()  # so that the pipe is closed when the worker dies, and the parent reads end of file
        self.item: int | None = None
        self.exit_code: int | None = None

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    @property
    def handles(self) -> tuple["connection.Connection[bytes, bytes]", int]:
        """Objects that become readable when there is a reply, or when the process dies."""
        return self._pipe, self._process.sentinel

    def start(self, item: int, request: bytes) -> None:
        self.item = item
        with contextlib.suppress(OSError):  # the process is dead; `take_reply` detects that
            self._pipe.send_bytes(request)

    def take_reply(self) -> tuple[int, bytes | None]:
        """Return the item, and its reply, or None if the process died."""
        assert self.item is not None
        item, self.item = self.item, None
        try:
            return item, self._pipe.recv_bytes() if self._pipe.poll() else None
        except (EOFError, OSError):  # the process died before or during writing
            return item, None

    def kill(self) -> None:
        self._process.kill()
        self._process.join()
        self.exit_code = self._process.exitcode
        self._process.close()
        self._pipe.close()


def _serve(pipe: "connection.Connection[bytes, bytes]") -> None:
    """Run calls until the pipe is closed or the parent process ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole process group; the parent decides
    threading.Thread(target=_die_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send_bytes(run_call(pipe.recv_bytes()))


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _given_up(attempts: int, exit_code: int | None) -> str:
    return (
        f"a worker process died {attempts} times at the same item (exit code {exit_code}); too little memory is the "
        "usual reason: use fewer workers. A script that starts workers needs `if __name__ == '__main__':`"
    )


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block SIGINT while processes start: they inherit the mask until they can ignore the signal."""
    resource_tracker.ensure_running()  # otherwise it is started with the first process, and unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
