"""A process that starts one worker and sees to it that nothing of it is left behind; run as a script.

It loads the standard library alone, so that it can fork safely and takes little memory. As the subreaper (Linux) of
all that the worker starts, it ends what the worker leaves behind, also what has made itself a session of its own. It
ends everything once the other end of its socket is closed: when the command that it belongs to wants it to, or dies.
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
    """Start the worker, and wait until it ends, or is to be ended.

    Parameters
    ----------
    life : int
        Descriptor of a socket: how the worker ended is written to it, and its end of file ends everything.
    channel : int
        Descriptor of the socket by which the worker gets its runs and answers.
    setup : str
        A JSON object with the search path for modules, and the cores to run on, if any.
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
            os.close(stream)  # what the worker prints ends when the worker ends
    told, status = socket.socket(fileno=life), None
    while status is None and not select.select([told, woken], [], [])[0].count(told):
        woken.recv(4096)
        status = _reaped(worker)
    _end_all(worker, reaped=status is not None)
    if status is not None:
        with contextlib.suppress(OSError):
            told.sendall(str(os.waitstatus_to_exitcode(status)).encode())


def _work(keeper: int, channel: int, setup: dict[str, list[str]]) -> None:
    """Become the worker: a session of its own, with nothing open but its channel and what it prints to."""
    os.setsid()
    _control(SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != keeper:  # it died before that
        os._exit(1)
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")  # of all, a run is what the kernel ends for want of memory
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
    """Collect processes that have ended; return the status of the worker if it is one of them."""
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
    """Kill the worker with its group, and all that it has left, until nothing of it remains."""
    if not reaped or sys.platform != "linux":  # elsewhere what it has left has another parent now
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
    """Call prctl(2), which is there on Linux alone."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
