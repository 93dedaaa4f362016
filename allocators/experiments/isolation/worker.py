"""Handle of a worker process: sends runs, enforces limits, and ends the process with all its descendants."""

import contextlib
import json
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from alloc.allocators.experiments.isolation.cores import Cores
from alloc.allocators.experiments.isolation.serve import LOADED, Figures, Order
from alloc.allocators.experiments.isolation.tree import descendants, proportional_mb, resident_mb
from alloc.allocators.experiments.store.outcome import Outcome

LOADING_S = 300.0
"""Time limit for loading a method, in seconds."""

PATIENCE_S = 5.0
"""Seconds to wait for the end of a worker before its keeper is killed as well."""

PRINTED = 4000
"""Maximum number of bytes of a run's output that are kept, from its end."""

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that libraries read when they are loaded."""


@dataclass(frozen=True)
class Limits:
    """Limits of a run, which is ended if it exceeds them.

    Attributes
    ----------
    seconds : float
        Seconds from the end of loading; ``inf`` for no limit.
    memory_mb : float
        Resident memory of the process and all its descendants, in MiB.
    """

    seconds: float
    memory_mb: float


class Worker:
    """A process for the runs of one method, with its keeper; see `keeper`.

    Parameters
    ----------
    cores : Cores
        Processors to run on.
    threads : int
        Number of threads for libraries that read it from the environment.
    """

    def __init__(self, cores: Cores, threads: int) -> None:
        with contextlib.ExitStack() as ours, contextlib.ExitStack() as theirs:
            self._life, life = socket.socketpair()
            channel, other = socket.socketpair()
            self._printed, printed = os.pipe()
            ours.callback(os.close, self._printed)
            theirs.callback(os.close, printed)
            for own, given in ((self._life, life), (channel, other)):
                ours.enter_context(own)
                theirs.enter_context(given)
            os.set_blocking(self._printed, False)
            setup = json.dumps({"path": sys.path, "cores": cores.numbers})
            inherited = (life.fileno(), other.fileno(), *(lock.fileno() for lock in cores.locks))
            self._keeper = subprocess.Popen(
                [sys.executable, "-P", str(Path(__file__).with_name("keeper.py")), *map(str, inherited[:2]), setup],
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=printed,
                pass_fds=inherited,
                start_new_session=True,  # Ctrl-C reaches the whole foreground group; the command decides
                env=dict(os.environ, **dict.fromkeys(THREAD_VARIABLES, str(threads))),
            )
            ours.pop_all()  # kept, as the process has started; otherwise all descriptors are closed
        self._channel = Connection(channel.detach())
        self._limits, self._tail, self._loaded = Limits(0, 0), b"", False
        self._sent_at = self._checked_at = 0.0
        self.is_reusable, self.memory_mb, self.cores = True, 0.0, cores

    @property
    def handles(self) -> "list[Connection[bytes, bytes] | socket.socket | int]":
        """See `Handle.handles`."""
        return [self._channel, self._life, *([] if self._printed < 0 else [self._printed])]

    @property
    def is_alive(self) -> bool:
        """Whether the process is alive; a thread left by a run may have ended it."""
        return not select.select([self._life], [], [], 0)[0]

    def send(self, order: Order, limits: Limits) -> None:
        """Start a run."""
        self._limits, self._tail, self._loaded = limits, b"", False
        self._sent_at, self.memory_mb = time.monotonic(), 0.0
        with contextlib.suppress(OSError):  # the process is dead; `figures` reports it
            self._channel.send_bytes(pickle.dumps(order))

    def figures(self) -> Figures | None:
        """Return the ending of the run, or None while it is in progress; end a run that exceeds a limit."""
        self._read_printed()
        figures = self._answer()
        if figures is None:
            figures = self._death() or self._excess()
        if figures is None:
            return None
        figures["memory_mb"] = self.memory_mb
        if figures["outcome"] not in (Outcome.SOLVED, Outcome.REFUSED) and not figures.get("details"):
            figures["details"] = self._tail.decode("utf-8", "replace")
        return figures

    def _answer(self) -> Figures | None:
        with contextlib.suppress(EOFError, OSError, ValueError):  # it died before or while writing
            while self._channel.poll():
                message = self._channel.recv_bytes()
                if message == LOADED:
                    self._loaded, self._sent_at = True, time.monotonic()
                    continue
                figures: Figures = json.loads(message)
                figures["outcome"] = Outcome(str(figures["outcome"]))
                tree = self._measure()
                clean = figures["outcome"] in (Outcome.SOLVED, Outcome.REFUSED, Outcome.MISSING_PACKAGE)
                # a process left behind would take time from later runs
                self.is_reusable = bool(figures.pop("reusable")) and clean and len(tree) <= 1
                return figures
        return None

    def _death(self) -> Figures | None:
        """Return how the process ended, or None while it is alive."""
        self._life.setblocking(False)
        try:
            code = self._life.recv(16)
        except BlockingIOError:
            return None
        except OSError:
            code = b""
        self.is_reusable = False
        self._read_printed()
        if not code:
            return {"outcome": Outcome.KILLED, "reason": "its processes were killed externally", "exit_code": -9}
        number = int(code)
        if number >= 0:
            reason = f"it ended its process with exit code {number}"
            return {"outcome": Outcome.EXITED, "reason": reason, "exit_code": number}
        hint = ", externally or for lack of memory" if number == -9 else ""
        return {"outcome": Outcome.KILLED, "reason": f"killed by {_signal(-number)}{hint}", "exit_code": number}

    def _excess(self) -> Figures | None:
        """Return the limit that the run exceeds, if any, after ending the run."""
        now = time.monotonic()
        seconds = self._limits.seconds if self._loaded else LOADING_S
        if now - self._sent_at > seconds:
            self.end()
            task = "running" if self._loaded else "loading"
            return {"outcome": Outcome.HUNG, "reason": f"still {task} after {seconds:g} s, and killed"}
        if now - self._checked_at > 0.05:
            self._checked_at, tree = now, self._measure()
            if self.memory_mb > self._limits.memory_mb and proportional_mb(tree) > self._limits.memory_mb:
                self.end()
                reason = f"it used more than {self._limits.memory_mb:.0f} MiB of memory, and was killed"
                return {"outcome": Outcome.OUT_OF_MEMORY, "reason": reason}
        return None

    def _measure(self) -> list[int]:
        """Measure the memory of the processes, and return their ids."""
        tree = descendants(self._keeper.pid)
        self.memory_mb = max(self.memory_mb, resident_mb(tree))
        return tree

    def _read_printed(self) -> None:
        """Read available output and keep its end, without blocking on a run that prints endlessly."""
        for _ in range(64):
            if self._printed < 0:
                return
            try:
                part = os.read(self._printed, 65536)
            except BlockingIOError:
                return
            if not part:
                os.close(self._printed)
                self._printed = -1
            self._tail = (self._tail + part)[-PRINTED:]

    def end(self) -> None:
        """End the process with all its descendants; a second call does nothing."""
        self.is_reusable = False
        self._life.close()
        try:
            self._keeper.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._keeper.kill()
            self._keeper.wait()
        self._channel.close()
        if self._printed >= 0:
            os.close(self._printed)
            self._printed = -1


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
