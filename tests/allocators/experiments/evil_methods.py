"""Misbehaving methods, for tests of the isolation of runs; `install` makes them a plugin."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from alloc.allocators import Allocator, Method, Proposal
from alloc.problems import Allocation, MissingPackageError, RefusedError


def answer(search):
    return Proposal(Allocation([0] * search.instance.n))


def crash(search):
    ctypes.string_at(0)


def fail(search):
    raise ZeroDivisionError("on purpose")


def leave(search):
    os._exit(3)


def leave_softly(search):
    sys.exit("enough")


def hang(search):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(600)


def eat(search):
    held = []
    while True:
        held.append(bytearray(b"x" * 2**24))


def eat_at_once(search):
    bytearray(2**50)


def garbage(search):
    for _ in range(300):
        os.write(1, os.urandom(4096))
        os.write(2, os.urandom(4096))
    return answer(search)


def fork(search):
    """Leave two processes behind, one of them in its own session, and record their ids."""
    sleep = [sys.executable, "-c", "import time; time.sleep(600)"]
    children = [subprocess.Popen(sleep), subprocess.Popen(sleep, start_new_session=True)]
    with Path(os.environ["FORKED"]).open("a") as file:
        file.writelines(f"{child.pid}\n" for child in children)
    return answer(search)


def fork_and_leave(search):
    fork(search)
    os._exit(0)


def freeze(search):
    os.kill(os.getpid(), signal.SIGSTOP)


def shut(search):
    """Close all file descriptors of the process, including the one for its answer."""
    os.closerange(0, 256)
    return answer(search)


def killed(search):
    os.kill(os.getpid(), signal.SIGKILL)


def refuse(search):
    raise RefusedError("not this one")


def missing(search):
    raise MissingPackageError("needs absent; install with: pip install absent")


def nap(search):
    """Record start, end and process id, so that a test can tell what ran when."""
    with Path(os.environ["NAPS"]).open("ab", buffering=0) as file:
        file.write(f"begin {search.instance.name} {search.seed} {os.getpid()} {time.time()}\n".encode())
        time.sleep(float(os.environ.get("NAP_S", "0.05")))
        file.write(f"end {search.instance.name} {search.seed} {os.getpid()} {time.time()}\n".encode())
    return answer(search)


def busy(search):
    """Use a processor until the time limit."""
    while search.stop_reason() is None or search.remaining_s > 0:
        sum(range(1000))
    return answer(search)


def pid(search):
    """Encode the process in the makespan, by the order of processes."""
    with Path(os.environ["NAPS"]).open("a") as file:
        file.write(f"{os.getpid()} {sorted(os.sched_getaffinity(0))}\n")
    return answer(search)


BEHAVIOURS = (
    answer, crash, fail, leave, leave_softly, hang, eat, eat_at_once, garbage, fork, fork_and_leave, freeze, shut,
    killed, refuse, missing, nap, busy, pid,
)  # fmt: skip


def _method(behaviour):
    name = behaviour.__name__.replace("_", "-")
    return type(
        behaviour.__name__,
        (Allocator,),
        {
            "method": Method(name=name, summary="", finite_speeds=True),
            "allocate": lambda self, search: behaviour(search),
        },
    )


METHODS = {kind.method.name: kind for kind in map(_method, BEHAVIOURS)}
globals().update({f"method_{name.replace('-', '_')}": kind for name, kind in METHODS.items()})


def install(folder):
    """Install the methods into `folder`, as a plugin for processes with this folder on their module search path."""
    (folder / "evil_methods.py").write_text(Path(__file__).read_text())
    information = folder / "evil_methods-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: evil-methods\nVersion: 1.0\n")
    lines = [f"{name} = evil_methods:method_{name.replace('-', '_')}" for name in METHODS]
    (information / "entry_points.txt").write_text("[alloc.allocators]\n" + "\n".join(lines) + "\n")
