"""Owners of leases: processes, identified such that others on the machine can tell whether they are alive."""

import os
import secrets
from pathlib import Path


def this_process() -> str:
    """Return a unique name, which neither another process nor another store of this process ever has."""
    return " ".join([_place(), str(os.getpid()), _started(os.getpid()), secrets.token_hex(8)])


def is_gone(owner: str) -> bool:
    """Return whether the process is known to have ended; False if unknown, as on another machine."""
    place, pid, started, _ = owner.split(" ")
    return bool(started) and started != "-" and place == _place() and _started(int(pid)) != started


def _place() -> str:
    """Return the scope in which process ids are unique: a boot of a machine and a process namespace on it."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot}/{os.stat('/proc/self/ns/pid').st_ino}"
    except OSError:
        return "-"


def _started(pid: int) -> str:
    """Return the start time of a process in ticks since boot; ``-`` if unknown or if there is no such process."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "-"
    return "-" if fields[0] in "ZX" else fields[19]
