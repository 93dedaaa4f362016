"""Who holds a lease: a process, known so well that others on the machine can tell whether it is still there."""

import os
import secrets
from pathlib import Path


def this_process() -> str:
    """Return a name for this process that no other ever has, nor a second store that it opens."""
    return " ".join([_place(), str(os.getpid()), _started(os.getpid()), secrets.token_hex(8)])


def is_gone(owner: str) -> bool:
    """Whether the process is known to have ended; False where that cannot be known, as on another machine."""
    place, pid, started, _ = owner.split(" ")
    return bool(started) and started != "-" and place == _place() and _started(int(pid)) != started


def _place() -> str:
    """Return where process ids mean the same: one boot of a machine, and one namespace of processes on it."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot}/{os.stat('/proc/self/ns/pid').st_ino}"
    except OSError:
        return "-"


def _started(pid: int) -> str:
    """Return when a process began, in ticks since the boot; ``-`` where that is not known, or it is not there."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return "-"
    return "-" if fields[0] in "ZX" else fields[19]
