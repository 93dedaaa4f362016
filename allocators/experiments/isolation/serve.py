"""Main loop of a worker: execute the runs of one method or policy in turn, and report how each ended."""

import contextlib
import gc
import json
import os
import pickle
import time
import traceback
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from alloc.allocators.auto import PICKED
from alloc.allocators.contract.base import Allocator
from alloc.allocators.experiments.store.key import MISSION, Run
from alloc.allocators.experiments.store.outcome import Outcome
from alloc.allocators.experiments.store.plan import packed
from alloc.allocators.online.contract import Policy
from alloc.allocators.online.registry import load_policy
from alloc.allocators.online.run import simulate
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import abandoned_threads
from alloc.allocators.solve import solve
from alloc.problems import Family, Instance, MissingPackageError, Mission, Objective, RefusedError, random_instance

LONGEST_DETAILS = 20_000
"""Maximum number of characters of a traceback that are kept, from its end."""

LOADED = b"loaded"
"""Message that the method is loaded and the run starts."""

Figures = dict[str, object]
"""Fields of an `Ending`."""


@dataclass(frozen=True)
class Order:
    """A run to execute, with its problem and parameters.

    Attributes
    ----------
    run : Run
    settings : dict
        Parameters of the method or policy, as `load` and `load_policy` take them.
    instance : bytes
        A pickled instance or mission, so that every run has its own copy: values cached in a shared one would
        favour later runs.
    """

    run: Run
    settings: dict[str, object]
    instance: bytes


def serve(channel: int) -> None:
    """Execute runs until the other end of the channel is closed."""
    connection, make = Connection(channel), None
    _warm_up()
    while True:
        try:
            order = pickle.loads(connection.recv_bytes())
        except (EOFError, OSError):
            os._exit(0)
        problem = None
        try:
            if make is None:
                make = maker(order)
                gc.freeze()  # exclude loaded modules from garbage collection
            connection.send_bytes(LOADED)
            problem, begin = pickle.loads(order.instance), time.process_time()
            figures = make(order.run, problem)
            figures["cpu_s"] = time.process_time() - begin
        except BaseException as error:  # any exception, also SystemExit, is the ending of the run
            figures = failure(error)
        figures["reusable"] = not abandoned_threads()
        connection.send_bytes(json.dumps(figures).encode())
        del order, problem
        gc.collect()


def _warm_up() -> None:
    """Load modules that every run uses, so that loading does not count as time of the first run."""
    solve(_warming(), "greedy", objective=Objective.MAKESPAN_ENERGY, iterations=1, threads=1, handle_signals=False)


def _warming() -> Instance:
    return random_instance(Family(agents=12, tasks=3), 0)


def maker(order: Order) -> Callable[[Run, Any], Figures]:
    """Load the method or policy of an order, and return a function that executes its runs."""
    name = order.run.method
    if order.run.objective == MISSION:
        policy = load_policy(name, **order.settings)
        with contextlib.suppress(Exception):  # reported by its runs
            simulate(Mission.from_instance(_warming()), policy, knowledge=order.run.knowledge)
        return partial(_lead, policy)
    if name == "auto":
        for one in PICKED:
            load(one)  # its choice depends on the instance, and is made when the run's time already counts
        return partial(_solve, name)
    return partial(_solve, load(name, **order.settings))


def _solve(allocator: str | Allocator, run: Run, instance: Instance) -> Figures:
    """Execute one run of a method, and return the fields of its ending."""
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
    return _figures(result)


def _lead(policy: Policy, run: Run, mission: Mission) -> Figures:
    """Execute one run of a policy, and return the fields of its ending."""
    result = simulate(mission, policy, knowledge=run.knowledge, seed=run.seed, deadline_ms=run.deadline_ms).result
    return {
        "outcome": Outcome.SOLVED,
        "picked": result.policy,
        "status": result.status,
        "energy": result.energy,
        "distance": result.distance,
        "battery_remaining_percent": result.battery_remaining_percent,
        "unserved": result.tasks_missed + result.tasks_left,
        "runtime_s": result.runtime_s,
        "measures": json.dumps(result.to_dict()),
    }


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


def failure(error: BaseException) -> Figures:
    """Return the fields of the ending of a run that raised an error."""
    outcome = next(outcome for kind, outcome in OUTCOMES if isinstance(error, kind))
    if outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE):
        return {"outcome": outcome, "reason": str(error)}
    details = "".join(traceback.format_exception(error))[-LONGEST_DETAILS:]
    return {"outcome": outcome, "reason": f"{type(error).__name__}: {error}".rstrip(": "), "details": details}
