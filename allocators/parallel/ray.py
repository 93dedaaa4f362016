"""Members of a population on the machines of a Ray cluster; what dies with a machine is done again on another."""

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import torch

from alloc.allocators.parallel.engine import PATIENCE_S, Engine, EngineError, R, T, answer, never, request, result
from alloc.problems import InputError, MissingPackageError

TRIES = 5
"""Times that an item is begun at the most; more than in processes, as whole machines come and go."""

CONNECT_S = 5.0
"""How long the head of the cluster may take to answer."""


class RayEngine(Engine):
    """Items as tasks of a Ray cluster, on whose machines this package must be installed as here.

    Parameters
    ----------
    address : str, optional
        Head of the cluster, as ``host:port``; ``local`` starts one on this machine alone. The environment's
        ``RAY_ADDRESS``, or the cluster that runs on this machine, if not given. A connection that this process has
        made by itself is used, and left open in the end.
    threads : int
        Threads of torch for each item, and the processors that Ray sets aside for it.
    tries : int
        Times that an item is begun at the most.

    Raises
    ------
    InputError
        If Ray is not installed, nobody is at `address`, or no machine there has so many processors.
    """

    def __init__(self, address: str | None = None, threads: int = 1, tries: int = TRIES) -> None:
        try:
            import ray
        except ImportError as error:
            raise MissingPackageError("Ray is not installed: pip install 'alloc-mrta[cluster]'", "engine") from error
        self._ray: Any = ray
        self._ours = not ray.is_initialized()
        if self._ours:
            self._connect(address or os.environ.get("RAY_ADDRESS", "auto"))
        try:
            self._check_processors(threads)
        except InputError:
            self.close()
            raise
        self._task = ray.remote(num_cpus=threads, max_retries=tries - 1)(_work)
        self.threads = threads

    def _connect(self, address: str) -> None:
        _check_reachable(address)
        try:
            with _terminations_kept():
                self._ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except Exception as error:  # of whatever kind the versions of Ray raise
            raise InputError(f"no Ray cluster at {address!r}: {_reason(error)}", "address") from error

    def _check_processors(self, threads: int) -> None:
        """Raise an `InputError` where Ray would wait forever, without a word, for a machine that is large enough."""
        most = max((int(node["Resources"].get("CPU", 0)) for node in self._ray.nodes() if node["Alive"]), default=0)
        if 0 < most < threads:  # a cluster without any may grow with the work
            raise InputError(f"no machine of the cluster has {threads} processors; the largest has {most}", "threads")

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never
    ) -> list[R] | None:
        """See `Engine.map`."""
        tasks = {self._task.remote(request(function, item), self.threads): i for i, item in enumerate(items)}
        pending, results = list(tasks), dict[int, R]()
        try:
            while pending:
                if should_stop():
                    return None
                # fetched at once, so that no machine keeps what could die with it
                done, pending = self._ray.wait(pending, timeout=PATIENCE_S)
                for task in done:
                    results[tasks[task]] = result(self._ray.get(task))
        except self._ray.exceptions.RayError as error:
            raise EngineError(f"Ray gave an item up: {_reason(error)}") from error
        finally:
            for task in pending:
                self._ray.cancel(task, force=True)
        return [results[index] for index in range(len(items))]

    def close(self) -> None:
        """See `Engine.close`."""
        if self._ours:
            self._ours = False
            self._ray.shutdown()


def _work(asked: bytes, threads: int) -> bytes:
    torch.set_num_threads(threads)
    return answer(asked)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:300] or type(error).__name__


def _check_reachable(address: str) -> None:
    """Raise an `InputError` if nobody listens there, which Ray itself takes minutes to find and then aborts on."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=CONNECT_S).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise InputError(f"no Ray cluster at {address!r}: {error}", "address") from error


@contextlib.contextmanager
def _terminations_kept() -> Iterator[None]:
    """Put our handler of SIGTERM back: Ray replaces it by one that does not ask for a stop, but exits."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread() and before is not None:
            signal.signal(signal.SIGTERM, before)
