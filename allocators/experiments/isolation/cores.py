"""Processors that timed runs have to themselves, also beside other commands on the same machine."""

import contextlib
import os
import socket
import sys
from dataclasses import dataclass, field

CAN_PIN = sys.platform == "linux"

LOCK = "\0alloc-core-"
"""Beginning of the names by which processors are taken, on one machine."""


@dataclass(frozen=True)
class Cores:
    """Some processors, held until `free` is called here and in every process that got the descriptors.

    Attributes
    ----------
    numbers : tuple of int
        Empty where nothing is held: runs go wherever the system puts them.
    locks : tuple of socket
        Bound names in the abstract name space of Linux, which end with the last process that has them, however it
        ends, and which leave no files behind.
    """

    numbers: tuple[int, ...] = ()
    locks: tuple[socket.socket, ...] = field(default=(), repr=False)

    def free(self) -> None:
        """Let others have them."""
        for lock in self.locks:
            lock.close()


def take(count: int) -> Cores | None:
    """Take `count` processors that this process may use and nobody has taken; None if there are not so many."""
    numbers: list[int] = []
    locks: list[socket.socket] = []
    for number in sorted(os.sched_getaffinity(0)):
        lock = _locked(number)
        if lock is not None:
            numbers.append(number)
            locks.append(lock)
        if len(numbers) == count:
            return Cores(tuple(numbers), tuple(locks))
    Cores((), tuple(locks)).free()
    return None


def _locked(number: int) -> socket.socket | None:
    lock = socket.socket(socket.AF_UNIX)
    with contextlib.suppress(OSError):
        lock.bind(f"{LOCK}{number}")
        return lock
    lock.close()
    return None
