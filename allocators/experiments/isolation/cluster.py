"""Runs on the machines of a Ray cluster; if a machine fails, its runs are repeated on another."""

import contextlib
import math
import pickle
import socket
import time
from dataclasses import replace
from multiprocessing import connection
from types import ModuleType

from alloc.allocators.experiments.isolation.cores import CAN_PIN, Cores, take
from alloc.allocators.experiments.isolation.places import Handle, Place, ThisMachine
from alloc.allocators.experiments.isolation.serve import Figures, Order
from alloc.allocators.experiments.isolation.worker import Limits, Worker
from alloc.allocators.experiments.store.key import this_machine
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.parallel.engine import POLL_S, EngineError
from alloc.allocators.parallel.ray import MAX_ATTEMPTS, RayEngine

OTHERS_S = 0.3
"""Seconds between two attempts to take processors that other commands use."""


class Cluster(Place):
    """A Ray cluster; all machines must have this package and all plugins installed in the same versions.

    Only the command accesses the store; machines receive runs and return their endings. `machine` lists all kinds of
    machines that the cluster has at the start.

    Parameters
    ----------
    address : str, optional
        Address of the cluster; see `RayEngine`.

    Raises
    ------
    InputError
        If Ray is not installed, or there is no cluster at `address`.
    """

    def __init__(self, address: str | None = None) -> None:
        self._engine = RayEngine(address)
        import ray

        self._ray = ray
        self.machine = " and ".join(sorted(set(self._kinds())))

    def _kinds(self) -> list[str]:
        """Return a description of each machine."""
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

        kind_of = self._ray.remote(num_cpus=0)(_kind)
        places = [NodeAffinitySchedulingStrategy(node, soft=True) for node, _ in self._with_processors()]
        kinds: list[str] = self._ray.get([kind_of.options(scheduling_strategy=place).remote() for place in places])
        return kinds

    def _with_processors(self) -> list[tuple[str, int]]:
        """Return the id and the number of processors of each machine that can execute runs."""
        found = [(node["NodeID"], int(node["Resources"].get("CPU", 0))) for node in self._ray.nodes() if node["Alive"]]
        return [(node, processors) for node, processors in found if processors]

    def room(self, threads: int) -> int:
        """See `Place.room`."""
        return sum(processors // threads for _, processors in self._with_processors())

    def take(self, threads: int) -> Cores | None:
        """Return no processors, as each run takes them on its machine."""
        return Cores()

    def memory_mb(self, runs: int) -> float:
        """Return infinity, as each run determines its limit on its machine."""
        return math.inf

    def handle(self, cores: Cores, threads: int, *, is_timed: bool) -> Handle:
        """See `Place.handle`."""
        return _Remote(self._ray, threads, is_timed=is_timed)

    def close(self) -> None:
        """See `Place.close`."""
        self._engine.close()


class _Remote(Handle):
    """Executes runs as tasks of a cluster, which Ray restarts if their machine fails."""

    def __init__(self, ray: ModuleType, threads: int, *, is_timed: bool) -> None:
        self._ray, self._threads, self._is_timed = ray, threads, is_timed
        self._function = ray.remote(num_cpus=threads, max_retries=MAX_ATTEMPTS - 1)(make_run)
        self._task: object = None
        self.is_reusable = True

    @property
    def handles(self) -> "list[connection.Connection[bytes, bytes] | socket.socket | int]":
        """See `Handle.handles`."""
        return []

    @property
    def is_alive(self) -> bool:
        """See `Handle.is_alive`."""
        return True

    def send(self, order: Order, limits: Limits) -> None:
        """See `Handle.send`."""
        self._task = self._function.remote(pickle.dumps(order), limits, self._threads, is_timed=self._is_timed)

    def figures(self) -> Figures | None:
        """See `Handle.figures`.

        Raises
        ------
        EngineError
            If the cluster is lost or a machine cannot execute runs, for instance without a plugin.
        """
        errors = self._ray.exceptions
        try:
            if not self._ray.wait([self._task], timeout=0)[0]:
                return None
            figures: Figures = self._ray.get(self._task)
        except (errors.WorkerCrashedError, errors.OutOfMemoryError) as error:
            figures = {"outcome": Outcome.KILLED, "reason": f"Ray gave up the run: {_reason(error)}"}
        except (errors.RayError, OSError) as error:
            raise EngineError(f"Ray gave up a run: {_reason(error)}") from error
        self._task = None
        return figures

    def end(self) -> None:
        """See `Handle.end`."""
        if self._task is not None:
            with contextlib.suppress(Exception):  # the connection may be what has failed
                self._ray.cancel(self._task, force=True)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[-300:] or type(error).__name__


def _kind() -> str:
    return this_machine()


def make_run(order: bytes, limits: Limits, threads: int, *, is_timed: bool) -> Figures:
    """Execute one run on this machine, in a separate process.

    Parameters
    ----------
    order : bytes
        A pickled `Order`.
    limits : Limits
        Infinite memory stands for an equal share of this machine's memory per run.
    threads : int
    is_timed : bool
        Whether the run waits for processors of its own.
    """
    if math.isinf(limits.memory_mb):
        here = ThisMachine()
        limits = replace(limits, memory_mb=here.memory_mb(max(1, here.room(threads))))
    cores = Cores()
    while is_timed and CAN_PIN and not cores.numbers:
        cores = take(threads) or cores
        time.sleep(0.0 if cores.numbers else OTHERS_S)
    began = time.monotonic()
    try:
        worker = Worker(cores, threads)
        try:
            worker.send(pickle.loads(order), limits)
            while (figures := worker.figures()) is None:
                connection.wait(worker.handles, POLL_S)
        finally:
            worker.end()
    finally:
        cores.free()
    own = {"wall_s": time.monotonic() - began, "memory_limit_mb": limits.memory_mb, "host": socket.gethostname()}
    return {**figures, **own, "cores": ",".join(map(str, cores.numbers))}
