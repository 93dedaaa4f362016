"""The Ray engine: runs items on a Ray cluster; if a machine dies, its item is run again on another."""

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from types import ModuleType

from alloc.allocators.parallel.engine import POLL_S, Engine, EngineError, R, T, never_stop
from alloc.allocators.parallel.remote_call import RemoteCall, run_call
from alloc.problems import InputError, MissingPackageError

MAX_ATTEMPTS = 5
"""Attempts at an item; more than for processes, as whole machines join and leave."""

CONNECT_S = 5.0
"""Seconds that the head of the cluster may take to respond."""

RAY_MISSING = "Ray is not installed: pip install 'alloc-mrta[cluster]'"


class RayEngine(Engine):
    """Runs items as tasks of a Ray cluster, whose machines must have the same version of this package installed.

    Parameters
    ----------
    address : str, optional
        Head of the cluster, as ``host:port``; ``local`` starts a cluster on this machine only. By default the
        environment variable ``RAY_ADDRESS``, or the cluster that runs on this machine. An existing connection of this
        process is used, and left open by `close`.
    threads : int
        Threads that each item may use, which is the number of processors that Ray reserves for it.
    max_attempts : int
        Attempts at an item before it is given up.

    Raises
    ------
    InputError
        If Ray is not installed, there is no cluster at `address`, or none of its machines has `threads` processors.
    """

    def __init__(self, address: str | None = None, threads: int = 1, max_attempts: int = MAX_ATTEMPTS) -> None:
        try:
            import ray
        except ImportError as error:
            raise MissingPackageError(RAY_MISSING, "engine") from error
        self._ray: ModuleType = ray
        self._owns_connection = not ray.is_initialized()
        if self._owns_connection:
            self._connect(address or os.environ.get("RAY_ADDRESS", "auto"))
        try:
            self._check_processors(threads)
        except InputError:
            self.close()
            raise
        self._task = ray.remote(num_cpus=threads, max_retries=max_attempts - 1)(_run_item)
        self.threads = threads

    def _connect(self, address: str) -> None:
        _check_reachable(address)
        try:
            with _sigterm_handler_kept():
                self._ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except Exception as error:  # the types differ between versions of Ray
            raise InputError(f"no Ray cluster at {address!r}: {_reason(error)}", "address") from error

    def _check_processors(self, threads: int) -> None:
        """Raise an `InputError` if no machine is large enough, as Ray would silently wait for one forever."""
        most = max((int(node["Resources"].get("CPU", 0)) for node in self._ray.nodes() if node["Alive"]), default=0)
        if 0 < most < threads:  # a cluster without processors may be scaled up on demand
            raise InputError(f"no machine of the cluster has {threads} processors; the largest has {most}", "threads")

    def map(
        self, function: Callable[[T], R], items: Sequence[T], should_stop: Callable[[], bool] = never_stop
    ) -> list[R] | None:
        """See `Engine.map`."""
        call = RemoteCall(function)
        tasks = {self._task.remote(call.request(item)): index for index, item in enumerate(items)}
        pending, results = list(tasks), dict[int, R]()
        try:
            while pending:
                if should_stop():
                    return None
                with self._ray_errors_converted():
                    # fetched immediately, so that results are not lost with the machine that holds them
                    done, pending = self._ray.wait(pending, timeout=POLL_S)
                    replies = [self._ray.get(task) for task in done]
                for task, reply in zip(done, replies, strict=True):
                    results[tasks[task]] = call.result(reply)
        finally:
            for task in pending:
                self._ray.cancel(task, force=True)
        return [results[index] for index in range(len(items))]

    @contextlib.contextmanager
    def _ray_errors_converted(self) -> Iterator[None]:
        """Convert errors of Ray, and connection errors, which some versions raise directly, to an `EngineError`."""
        try:
            yield
        except (self._ray.exceptions.RayError, OSError) as error:
            raise EngineError(f"Ray gave an item up: {_reason(error)}") from error

    def close(self) -> None:
        """See `Engine.close`."""
        if self._owns_connection:
            self._owns_connection = False
            self._ray.shutdown()


def _run_item(request: bytes) -> bytes:
    return run_call(request)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:300] or type(error).__name__


def _check_reachable(address: str) -> None:
    """Raise an `InputError` if nothing listens at `address`; Ray would take minutes and then abort the process."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=CONNECT_S).close()
    except (OSError, OverflowError, UnicodeError) as error:
        raise InputError(f"no Ray cluster at {address!r}: {error}", "address") from error


@contextlib.contextmanager
def _sigterm_handler_kept() -> Iterator[None]:
    """Restore the SIGTERM handler after the block: Ray installs one that exits immediately."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        if threading.current_thread() is threading.main_thread() and before is not None:
            signal.signal(signal.SIGTERM, before)
