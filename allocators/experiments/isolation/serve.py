"""What a worker does: it makes one run after the other, of one method, and says how each ended."""

import gc
import json
import os
import pickle
import time
import traceback
from base64 import b64encode
from dataclasses import dataclass
from multiprocessing.connection import Connection

from alloc.allocators.contract.base import Allocator
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.experiments.store.plan import packed
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import left_behind
from alloc.allocators.solve import solve
from alloc.problems import Family, MissingPackageError, Objective, RefusedError, random_instance

LONGEST_DETAILS = 20_000
"""Characters of a traceback that are kept, from its end."""

LOADED = b"loaded"
"""Sent once the method is loaded, when the run begins."""

Figures = dict[str, object]
"""Fields of an `Ending`."""


@dataclass(frozen=True)
class Order:
    """A run to be made, and with what.

    Attributes
    ----------
    run : Run
    settings : dict
        Parameters of the method, as `load` takes them.
    instance : bytes
        Pickled, so that every run has an instance of its own: what one remembers would favour whoever comes second.
    """

    run: Run
    settings: dict[str, object]
    instance: bytes


def serve(channel: int) -> None:
    """Make runs until the other end of the channel is closed."""
    connection, allocator = Connection(channel), None
    _warm_up()
    while True:
        try:
            order = pickle.loads(connection.recv_bytes())
        except (EOFError, OSError):
            os._exit(0)
        try:
            if allocator is None:
                name = order.run.method
                allocator = name if name == "auto" else load(name, **order.settings)
                gc.freeze()  # what is loaded is never searched for garbage again
            connection.send_bytes(LOADED)
            figures = make(order, allocator)
        except BaseException as error:  # whatever a method raises is how its run ended, also SystemExit
            figures = _failure(error)
        figures["reusable"] = not left_behind()
        connection.send_bytes(json.dumps(figures).encode())
        del order
        gc.collect()


def _warm_up() -> None:
    """Load what every run uses at its beginning and its end, which would count for the first one."""
    instance = random_instance(Family(agents=12, tasks=3), 0)
    solve(instance, "greedy", objective=Objective.MAKESPAN_ENERGY, iterations=1, threads=1, handle_signals=False)


def make(order: Order, allocator: str | Allocator) -> Figures:
    """Make one run, and return what is to be kept of its result."""
    run, instance = order.run, pickle.loads(order.instance)
    begin = time.process_time()
    result = solve(
        instance,
        allocator,
        objective=run.objective,
        time_limit_s=run.time_limit_s,
        iterations=run.iterations,
        target_gap=run.target_gap,
        seed=run.seed,
        threads=run.threads,
        handle_signals=False,
    )
    spent = time.process_time() - begin
    return {**_figures(result), "cpu_s": spent}


def _figures(result: Result) -> Figures:
    score = result.evaluation
    return {
        "outcome": Outcome.SOLVED,
        "picked": result.method,
        "status": str(result.status),
        "stop_reason": str(result.stop_reason),
        "makespan": result.makespan,
        "served_makespan": result.served_makespan,
        "lower_bound": result.lower_bound,
        "gap": result.gap,
        "energy": result.energy,
        "energy_lower_bound": result.energy_lower_bound,
        "energy_gap": result.energy_gap,
        "distance": None if score is None else score.distance,
        "battery_remaining_percent": None if score is None else score.battery_remaining_percent,
        "reward": None if score is None else score.reward,
        "unserved": result.instance.m if score is None else result.unserved_count,
        "runtime_s": result.runtime_s,
        "plan": None if result.allocation is None else b64encode(packed(result.allocation)).decode("ascii"),
        "trace": [(point.time_s, point.makespan, point.energy, point.lower_bound) for point in result.trace],
    }


OUTCOMES: tuple[tuple[type[BaseException], Outcome], ...] = (
    (RefusedError, Outcome.REFUSED),
    (MissingPackageError, Outcome.MISSING_PACKAGE),
    (MemoryError, Outcome.OUT_OF_MEMORY),
    (BaseException, Outcome.FAILED),
)


def _failure(error: BaseException) -> Figures:
    outcome = next(outcome for kind, outcome in OUTCOMES if isinstance(error, kind))
    if outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE):
        return {"outcome": outcome, "reason": str(error)}
    details = "".join(traceback.format_exception(error))[-LONGEST_DETAILS:]
    return {"outcome": outcome, "reason": f"{type(error).__name__}: {error}".rstrip(": "), "details": details}
