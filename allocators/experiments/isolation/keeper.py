"""A supervisor process that starts one worker and cleans up all its processes; run as a script.

It uses only the standard library, so that it can fork safely and needs little memory. As the subreaper (Linux) of the
worker's descendants, it ends processes that the worker leaves behind, even those in a session of their own. It ends
everything once the other end of its socket is closed: when the command that started it requests this, or dies.
"""

import contextlib
import ctypes
import json
import os
import select
import signal
import socket
import sys
from pathlib import Path

SET_PARENT_DEATH_SIGNAL, SET_SUBREAPER = 1, 36
"""Options of prctl(2)."""


def main(life: int, channel: int, setup: str) -> None:
    """Start the worker, and wait until it ends or is to be ended.

    Parameters
    ----------
    life : int
        Descriptor of a socket: the exit status of the worker is written to it, and end of file ends everything.
    channel : int
        Descriptor of the socket for the worker's orders and answers.
    setup : str
        JSON object with the module search path, and the cores to run on, if any.
    """
    _control(SET_SUBREAPER, 1)
    wake, woken = socket.socketpair()
    wake.setblocking(False)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    signal.set_wakeup_fd(wake.fileno(), warn_on_full_buffer=False)
    keeper, worker = os.getpid(), os.fork()
    if worker == 0:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        _work(keeper, channel, json.loads(setup))
    os.close(channel)
    for stream in (0, 1, 2):
        with contextlib.suppress(OSError):
            os.close(stream)  # so that the worker's output ends with the worker
    told, status = socket.socket(fileno=life), None
    while status is None and not select.select([told, woken], [], [])[0].count(told):
        woken.recv(4096)
        status = _reaped(worker)
    _end_all(worker, reaped=status is not None)
    if status is not None:
        with contextlib.suppress(OSError):
            told.sendall(str(os.waitstatus_to_exitcode(status)).encode())


def _work(keeper: int, channel: int, setup: dict[str, list[str]]) -> None:
    """Become the worker: in a new session, with no open files but its channel and its output."""
    os.setsid()
    _control(SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != keeper:  # the keeper died before
        os._exit(1)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")  # the kernel's first choice when memory is short
    for name in os.listdir("/dev/fd"):
        if int(name) > 2 and int(name) != channel:
            with contextlib.suppress(OSError):
                os.close(int(name))
    if setup["cores"]:
        os.sched_setaffinity(0, map(int, setup["cores"]))
    sys.path[:] = setup["path"]
    from alloc.allocators.experiments.isolation.serve import serve

    serve(channel)
    os._exit(0)


def _reaped(worker: int) -> int | None:
    """Reap processes that have ended; return the status of the worker if it is one of them."""
    found = None
    with contextlib.suppress(ChildProcessError):
        while True:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                break
            if pid == worker:
                found = status
    return found


def _end_all(worker: int, *, reaped: bool) -> None:
    """Kill the worker with its group, and all its descendants, until none remain."""
    if not reaped or sys.platform != "linux":  # elsewhere, its descendants have been reparented
        with contextlib.suppress(OSError):
            os.killpg(worker, signal.SIGKILL)
    own = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    while True:
        with contextlib.suppress(OSError):
            for child in own.read_text().split():
                os.kill(int(child), signal.SIGKILL)
        try:
            os.waitpid(-1, 0)
        except ChildProcessError:
            return


def _control(option: int, value: int) -> None:
    """Call prctl(2), which exists only on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
