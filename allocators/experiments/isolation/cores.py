"""Exclusive processors for timed runs, coordinated across commands on the same machine."""

import contextlib
import os
import socket
import sys
from dataclasses import dataclass, field

CAN_PIN = sys.platform == "linux"

LOCK = "\0alloc-core-"
"""Prefix of the names by which processors are locked on a machine."""


@dataclass(frozen=True)
class Cores:
    """Locked processors, held until `free` is called here and in every process that inherited the descriptors.

    Attributes
    ----------
    numbers : tuple of int
        Empty if no processors are held; the system then schedules runs freely.
    locks : tuple of socket
        Sockets bound in the abstract namespace of Linux, which are released when the last process that holds them
        ends, in any way, and leave no files behind.
    """

    numbers: tuple[int, ...] = ()
    locks: tuple[socket.socket, ...] = field(default=(), repr=False)

    def free(self) -> None:
        """Release the processors."""
        for lock in self.locks:
            lock.close()


def take(count: int) -> Cores | None:
    """Lock `count` free processors that this process may use; None if there are too few."""
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
