"""Descendants of a process and their memory; on Linux only, elsewhere empty."""

import os
from pathlib import Path

MIB = 2**20


def descendants(pid: int) -> list[int]:
    """Return the ids of all processes below `pid`."""
    found: list[int] = []
    pending = [pid]
    while pending:
        children = _children(pending.pop())
        found += children
        pending += children
    return found


def _children(pid: int) -> list[int]:
    try:
        threads = os.listdir(f"/proc/{pid}/task")
        return [int(child) for one in threads for child in Path(f"/proc/{pid}/task/{one}/children").read_text().split()]
    except OSError:  # the process has ended, or the system has no /proc
        return []


def resident_mb(pids: list[int]) -> float:
    """Return the total resident memory of processes in MiB; shared memory counts for each process."""
    pages = sum(_resident_pages(pid) for pid in pids)
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


def proportional_mb(pids: list[int]) -> float:
    """Return the total resident memory of processes in MiB, counting shared memory once; slower."""
    return sum(map(_proportional_kb, pids)) / 1024


def memory_mb() -> float:
    """Return the memory available to this process in MiB: that of the machine, or of its control group if less."""
    found = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / MIB]
    for name in ("memory.max", "memory/memory.limit_in_bytes"):
        try:
            found.append(int(Path("/sys/fs/cgroup", name).read_text()) / MIB)
        except (OSError, ValueError):  # there is no such limit, or it is "max"
            continue
    return min(found)


def _resident_pages(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0


def _proportional_kb(pid: int) -> int:
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
