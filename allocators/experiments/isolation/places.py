"""Where runs are made: on this machine, or on others."""

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
"""Part of the memory of a machine that all runs together may take by default."""


class Handle(Protocol):
    """Makes one run at a time; see `Worker`."""

    is_reusable: bool

    @property
    def handles(self) -> "list[Connection[bytes, bytes] | socket | int]":
        """What becomes readable when there may be news; empty where one has to ask."""
        ...

    @property
    def is_alive(self) -> bool:
        """Whether it can make another run."""
        ...

    def send(self, order: Order, limits: Limits) -> None:
        """Begin a run."""
        ...

    def figures(self) -> Figures | None:
        """Return how the run ended, None while it goes on."""
        ...

    def end(self) -> None:
        """End the run, if there is one, and all that it has started."""
        ...


class Place(Protocol):
    """Processors on which runs are made; a context manager.

    Attributes
    ----------
    machine : str
        What decides how fast runs are there; see `this_machine`.
    """

    machine: str

    def room(self, threads: int) -> int:
        """Return how many runs of so many threads there is room for at a time, whoever has it now."""
        ...

    def take(self, threads: int) -> Cores | None:
        """Take processors for timed runs; None if others have them."""
        ...

    def memory_mb(self, runs: int) -> float:
        """Return the memory that each of so many runs at a time may take by default, in MiB."""
        ...

    def handle(self, cores: Cores, threads: int, *, is_timed: bool) -> Handle:
        """Return what makes runs on some processors."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Here(Place):
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
