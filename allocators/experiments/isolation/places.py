"""Places where runs are executed: this machine, or a cluster."""

from multiprocessing.connection import Connection
from socket import socket
from typing import Protocol, Self

from alloc.allocators.experiments.isolation.cores import Cores, take
from alloc.allocators.experiments.isolation.serve import Figures, Order
from alloc.allocators.experiments.isolation.tree import memory_mb
from alloc.allocators.experiments.isolation.worker import Limits, Worker
from alloc.allocators.experiments.store.key import this_machine
from alloc.allocators.parallel.processors import available_threads

MEMORY_SHARE = 0.8
"""Default share of a machine's memory for all runs together."""


class Handle(Protocol):
    """Executes one run at a time; see `Worker`."""

    is_reusable: bool

    @property
    def handles(self) -> "list[Connection[bytes, bytes] | socket | int]":
        """Objects to wait on, readable when `figures` may have a result; empty if it has to be polled."""
        ...

    @property
    def is_alive(self) -> bool:
        """Whether it can execute another run."""
        ...

    def send(self, order: Order, limits: Limits) -> None:
        """Start a run."""
        ...

    def figures(self) -> Figures | None:
        """Return the ending of the run, or None while it is in progress."""
        ...

    def end(self) -> None:
        """End the run, if any, and all processes that it has started."""
        ...


class Place(Protocol):
    """Processors on which runs are executed; a context manager.

    Attributes
    ----------
    machine : str
        Description of the hardware, as it determines the speed of runs; see `this_machine`.
    """

    machine: str

    def room(self, threads: int) -> int:
        """Return how many runs of `threads` threads can execute in parallel, including those of other commands."""
        ...

    def take(self, threads: int) -> Cores | None:
        """Take processors for timed runs; None if others use them."""
        ...

    def memory_mb(self, runs: int) -> float:
        """Return the default memory limit of each of `runs` parallel runs, in MiB."""
        ...

    def handle(self, cores: Cores, threads: int, *, is_timed: bool) -> Handle:
        """Return a handle that executes runs on the given processors."""
        ...

    def close(self) -> None:
        """Release all resources."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ThisMachine(Place):
    """The machine that the command runs on."""

    def __init__(self) -> None:
        self.machine = this_machine()

    def room(self, threads: int) -> int:
        """See `Place.room`."""
        return available_threads() // threads

    def take(self, threads: int) -> Cores | None:
        """See `Place.take`."""
        return take(threads)

    def memory_mb(self, runs: int) -> float:
        """See `Place.memory_mb`."""
        return MEMORY_SHARE * memory_mb() / runs

    def handle(self, cores: Cores, threads: int, *, is_timed: bool) -> Handle:
        """See `Place.handle`."""
        return Worker(cores, threads)

    def close(self) -> None:
        """See `Place.close`."""
