"""Campaigns: execute all runs of a comparison that are missing in a store, in parallel and in separate processes."""

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
from alloc.allocators.experiments.isolation.places import Handle, Place, ThisMachine
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
"""Seconds between two polls of the runs that other commands have left."""

MAX_WARM = 12
"""Maximum number of idle processes kept for further runs of their method; the longest idle one is ended first."""

OVERRUN, OVERRUN_S = 1.2, 10.0
"""Default limit on the duration of a run: this factor times its time limit, plus this many seconds."""


@dataclass(frozen=True)
class Job:
    """A run to execute, with its problem and parameters."""

    run: Run
    settings: dict[str, object]
    instance: Instance | Mission = field(repr=False)


@dataclass(frozen=True)
class Resources:
    """Resources for the runs; they do not affect results unless a run exceeds a limit.

    Attributes
    ----------
    workers : int, optional
        Parallel runs; by default, as many as have their own processors.
    memory_mb : float, optional
        Memory of a run, including all processes that it starts, in MiB; by default its share of the machine's memory.
    kill_after_s : float, optional
        Seconds after which a run is killed; by default 1.2 times the time limit plus 10 s, or never without a time
        limit.
    """

    workers: int | None = None
    memory_mb: float | None = None
    kill_after_s: float | None = None


@dataclass
class _Slot:
    """A slot for one run at a time: its processors, the current run, and idle processes by method."""

    cores: Cores
    idle: dict[str, Handle] = field(default_factory=dict)
    worker: Handle | None = None
    job: Job | None = None
    started_at: float = 0.0
    begin: float = 0.0
    at_once: int = 1


class Campaign:
    """Executes the runs that are missing in a store.

    Parameters
    ----------
    store : Store
    jobs : sequence of Job
        In order of execution; all with the same budget and threads.
    resources : Resources
    on_end : callable
        Called with each run that this command has executed, and its ending.
    on_wait : callable
        Called once if other commands occupy all processors.
    place : Place, optional
        Where runs are executed; by default this machine.

    Raises
    ------
    InputError
        If there are too few processors (`place` is ``workers``).
    """

    def __init__(
        self,
        store: Store,
        jobs: Sequence[Job],
        resources: Resources,
        on_end: Callable[[Run, Ending], None] = lambda run, ending: None,
        on_wait: Callable[[], None] = lambda: None,
        place: Place | None = None,
    ) -> None:
        self._place = ThisMachine() if place is None else place
        self._store, self._on_end, self._on_wait = store, on_end, on_wait
        self._jobs = {job.run.key: job for job in jobs}
        self._pending = list(self._jobs)
        first = jobs[0].run if jobs else None
        self._threads = 1 if first is None else first.threads
        self._is_pinned = CAN_PIN and first is not None and first.is_timed
        limit = None if first is None else first.time_limit_s
        self._workers, room = resources.workers, self._place.room(self._threads)
        _check_workers(resources.workers, self._threads, room, pinned=self._is_pinned)
        usual = math.inf if limit is None else OVERRUN * limit + OVERRUN_S
        self._limits = Limits(
            usual if resources.kill_after_s is None else resources.kill_after_s,
            self._place.memory_mb(resources.workers or max(1, room))
            if resources.memory_mb is None
            else resources.memory_mb,
        )
        self._slots: list[_Slot] = []
        self._revision = revision()
        self._renewed_at = self._asked_at = self._opened_at = -math.inf
        self._instances: dict[str, bytes] = {}

    def run(self, stop: threading.Event) -> bool:
        """Execute the runs until all have ended, here or in other commands; return False if `stop` is set before."""
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
        """Acquire processors while slots are missing; other commands may release some later."""
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
        """Assign a run to every free slot, as long as there are unclaimed runs."""
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
        """Return the pickled problem of a job; only the last one is cached, as runs on one problem are consecutive."""
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
        if sum(len(one.idle) for one in self._slots) > MAX_WARM:
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
                with contextlib.suppress(InputError):  # closing follows a failure of this file
                    self._store.release(slot.job.run.key)
            for worker in slot.idle.values():
                worker.end()
            slot.cores.free()


def _check_workers(workers: int | None, threads: int, room: int, *, pinned: bool) -> None:
    """Raise an error if there are more parallel timed runs than processors, as these never share one."""
    if pinned and (workers or 1) > room:
        raise InputError(
            f"{workers or 1} parallel timed runs of {counted(threads, 'thread')} need {(workers or 1) * threads} "
            f"processors, and there is room for {room}; use fewer workers or threads, or limit iterations instead of "
            "time",
            "workers",
        )
