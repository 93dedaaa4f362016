"""A campaign: all runs of a comparison that a store has not yet, several at a time, each in a process of its own."""

import contextlib
import math
import pickle
import threading
import time
from base64 import b64decode
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from multiprocessing import connection

from alloc.allocators.experiments.isolation.cores import CAN_PIN, Cores
from alloc.allocators.experiments.isolation.places import Handle, Here, Place
from alloc.allocators.experiments.isolation.serve import Figures, Order
from alloc.allocators.experiments.isolation.worker import Limits
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.store.revision import revision
from alloc.allocators.experiments.store.store import LEASE_S, Store
from alloc.allocators.parallel.engine import POLL_S
from alloc.problems import InputError, Instance, Mission
from alloc.problems.text import counted

OTHERS_S = 0.3
"""Seconds between two looks at what other commands have left to do."""

MOST_WARM = 12
"""Processes that wait for another run of their method; beyond, the one that has waited longest is ended."""

OVERRUN, OVERRUN_S = 1.2, 10.0
"""A run is ended, by default, when it takes longer than this factor times its time limit and so many seconds more."""


@dataclass(frozen=True)
class Job:
    """A run that is wanted, with what it takes to make it."""

    run: Run
    settings: dict[str, object]
    instance: Instance | Mission = field(repr=False)


@dataclass(frozen=True)
class Means:
    """With what the runs are made; none of it decides how they end, unless they hit a limit.

    Attributes
    ----------
    workers : int, optional
        Runs at a time; as many as have processors of their own by default.
    memory_mb : float, optional
        Memory of one run, with all processes that it starts, in MiB; by default its part of most of the machine's.
    kill_after_s : float, optional
        Seconds after which a run is ended. By default 1.2 times the time limit and 10 s more; no limit where there is
        no time limit.
    """

    workers: int | None = None
    memory_mb: float | None = None
    kill_after_s: float | None = None


@dataclass
class _Slot:
    """A place for one run at a time: its processors, the run, and the idle processes by method."""

    cores: Cores
    idle: dict[str, Handle] = field(default_factory=dict)
    worker: Handle | None = None
    job: Job | None = None
    started_at: float = 0.0
    begin: float = 0.0
    at_once: int = 1


class Campaign:
    """Makes the runs that a store has not yet.

    Parameters
    ----------
    store : Store
    jobs : sequence of Job
        In the order in which they are made; all with the same budget and threads.
    means : Means
    on_end : callable
        Called with each run that this command has made, and how it ended.
    on_wait : callable
        Called once if other commands have all processors.
    place : Place, optional
        Where runs are made; this machine by default.

    Raises
    ------
    InputError
        If there are not so many processors; its place is ``workers``.
    """

    def __init__(
        self,
        store: Store,
        jobs: Sequence[Job],
        means: Means,
        on_end: Callable[[Run, Ending], None] = lambda run, ending: None,
        on_wait: Callable[[], None] = lambda: None,
        place: Place | None = None,
    ) -> None:
        self._place = Here() if place is None else place
        self._store, self._on_end, self._on_wait = store, on_end, on_wait
        self._jobs = {job.run.key: job for job in jobs}
        self._pending = list(self._jobs)
        first = jobs[0].run if jobs else None
        self._threads = 1 if first is None else first.threads
        self._is_pinned = CAN_PIN and first is not None and first.is_timed
        limit = None if first is None else first.time_limit_s
        self._workers, room = means.workers, self._place.room(self._threads)
        _check_workers(means.workers, self._threads, room, pinned=self._is_pinned)
        usual = math.inf if limit is None else OVERRUN * limit + OVERRUN_S
        self._limits = Limits(
            usual if means.kill_after_s is None else means.kill_after_s,
            self._place.memory_mb(means.workers or max(1, room)) if means.memory_mb is None else means.memory_mb,
        )
        self._slots: list[_Slot] = []
        self._revision = revision()
        self._renewed_at = self._asked_at = self._opened_at = -math.inf
        self._instances: dict[str, bytes] = {}

    def run(self, stop: threading.Event) -> bool:
        """Make the runs, until all have ended here or elsewhere; False if `stop` was set before."""
        try:
            while not stop.is_set():
                self._open_slots()
                self._assign()
                busy = [slot for slot in self._slots if slot.worker is not None]
                if not busy and not self._pending:
                    return True
                if busy:
                    connection.wait([one for slot in busy if slot.worker for one in slot.worker.handles], POLL_S)
                else:
                    stop.wait(OTHERS_S)
                for slot in busy:
                    self._look_at(slot)
                self._renew()
            return False
        finally:
            self._close()

    def _open_slots(self) -> None:
        """Take processors as long as there are too few slots; other commands may free some later."""
        if time.monotonic() - self._opened_at < OTHERS_S:
            return
        self._opened_at = time.monotonic()
        room = self._workers or max(1, self._place.room(self._threads))
        wanted = min(room, len(self._slots) + len(self._pending))
        while len(self._slots) < wanted:
            cores = self._place.take(self._threads) if self._is_pinned else Cores()
            if cores is None:
                break
            self._slots.append(_Slot(cores))
        if not self._slots:
            self._on_wait()
            self._on_wait = lambda: None

    def _assign(self) -> None:
        """Give every free slot a run, as long as there are some that nobody works on."""
        for slot in self._slots:
            if slot.worker is not None or not self._pending or time.monotonic() - self._asked_at < OTHERS_S:
                continue
            claim = self._store.claim(self._pending)
            gone = claim.done | {claim.key}
            self._pending = [key for key in self._pending if key not in gone]
            if claim.key is None:
                self._asked_at = time.monotonic()
            else:
                self._begin(slot, self._jobs[claim.key])

    def _begin(self, slot: _Slot, job: Job) -> None:
        method = f"{job.run.method} {job.run.parameters}"
        worker = slot.idle.pop(method, None)
        if worker is not None and not worker.is_alive:
            worker.end()
            worker = None
        if worker is None:
            worker = self._place.handle(slot.cores, self._threads, is_timed=self._is_pinned)
        slot.worker, slot.job = worker, job
        slot.started_at, slot.begin = time.time(), time.monotonic()
        worker.send(Order(job.run, job.settings, self._pickled(job)), self._limits)
        busy = [one for one in self._slots if one.worker is not None]
        slot.at_once = 1
        for one in busy:
            one.at_once = max(one.at_once, len(busy))

    def _pickled(self, job: Job) -> bytes:
        """Return the instance of a job; only the last one is kept, as runs on one instance follow each other."""
        if job.run.instance not in self._instances:
            self._instances = {job.run.instance: pickle.dumps(job.instance)}
        return self._instances[job.run.instance]

    def _look_at(self, slot: _Slot) -> None:
        assert slot.worker is not None
        assert slot.job is not None
        figures = slot.worker.figures()
        if figures is None:
            return
        plan = figures.pop("plan", None)
        run, worker, ending = slot.job.run, slot.worker, self._ending(slot, figures)
        if self._store.finish(run, ending, None if plan is None else b64decode(str(plan))):
            self._on_end(run, ending)
        slot.worker = None
        if not worker.is_reusable:
            worker.end()
            return
        slot.idle[f"{run.method} {run.parameters}"] = worker
        if sum(len(one.idle) for one in self._slots) > MOST_WARM:
            slot.idle.pop(next(iter(slot.idle))).end()

    def _ending(self, slot: _Slot, figures: Figures) -> Ending:
        points: list[list[float]] = figures.pop("trace", [])  # type: ignore[assignment]
        known: Figures = {
            "trace": tuple(map(tuple, points)),
            "wall_s": time.monotonic() - slot.begin,
            "memory_limit_mb": self._limits.memory_mb,
            "cores": ",".join(map(str, slot.cores.numbers)),
            "at_once": slot.at_once,
            "started_at": slot.started_at,
            "finished_at": time.time(),
            "revision": self._revision,
        }
        return Ending(**known | figures)  # type: ignore[arg-type]

    def _renew(self) -> None:
        if time.monotonic() - self._renewed_at > LEASE_S / 6:
            self._renewed_at = time.monotonic()
            self._store.renew()

    def _close(self) -> None:
        for slot in self._slots:
            if slot.worker is not None and slot.job is not None:
                slot.worker.end()
                with contextlib.suppress(InputError):  # what is wrong with the file is what led here
                    self._store.release(slot.job.run.key)
            for worker in slot.idle.values():
                worker.end()
            slot.cores.free()


def _check_workers(workers: int | None, threads: int, room: int, *, pinned: bool) -> None:
    """Raise an error for more timed runs at a time than there are processors, as they never share one."""
    if pinned and (workers or 1) > room:
        raise InputError(
            f"{workers or 1} timed runs of {counted(threads, 'thread')} at a time need {(workers or 1) * threads} "
            f"processors, and there is room for {room}; take fewer workers or threads, or limit iterations instead of "
            "time",
            "workers",
        )
