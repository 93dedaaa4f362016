"""What a worker does: it makes one run after the other, of one method or policy, and says how each ended."""

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
from alloc.allocators.runtime.interrupts import left_behind
from alloc.allocators.solve import solve
from alloc.problems import Family, Instance, MissingPackageError, Mission, Objective, RefusedError, random_instance

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
        Parameters of the method or policy, as `load` and `load_policy` take them.
    instance : bytes
        An instance or a mission, pickled, so that every run has one of its own: what one remembers would favour
        whoever comes second.
    """

    run: Run
    settings: dict[str, object]
    instance: bytes


def serve(channel: int) -> None:
    """Make runs until the other end of the channel is closed."""
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
                gc.freeze()  # what is loaded is never searched for garbage again
            connection.send_bytes(LOADED)
            problem, begin = pickle.loads(order.instance), time.process_time()
            figures = make(order.run, problem)
            figures["cpu_s"] = time.process_time() - begin
        except BaseException as error:  # whatever a method raises is how its run ended, also SystemExit
            figures = failure(error)
        figures["reusable"] = not left_behind()
        connection.send_bytes(json.dumps(figures).encode())
        del order, problem
        gc.collect()


def _warm_up() -> None:
    """Load what every run uses at its beginning and its end, which would count for the first one."""
    solve(_warming(), "greedy", objective=Objective.MAKESPAN_ENERGY, iterations=1, threads=1, handle_signals=False)


def _warming() -> Instance:
    return random_instance(Family(agents=12, tasks=3), 0)


def maker(order: Order) -> Callable[[Run, Any], Figures]:
    """Load what the order names, and return what makes its runs."""
    name = order.run.method
    if order.run.objective == MISSION:
        policy = load_policy(name, **order.settings)
        with contextlib.suppress(Exception):  # its runs will tell
            simulate(Mission.from_instance(_warming()), policy, knowledge=order.run.knowledge)
        return partial(_lead, policy)
    if name == "auto":
        for one in PICKED:
            load(one)  # which one it takes depends on the instance, and is known when the run's time counts already
        return partial(_solve, name)
    return partial(_solve, load(name, **order.settings))


def _solve(allocator: str | Allocator, run: Run, instance: Instance) -> Figures:
    """Make one run, and return what is to be kept of its result."""
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
    """Make one run of a policy, likewise."""
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
    """Return how a run ended that raised an error."""
    outcome = next(outcome for kind, outcome in OUTCOMES if isinstance(error, kind))
    if outcome in (Outcome.REFUSED, Outcome.MISSING_PACKAGE):
        return {"outcome": outcome, "reason": str(error)}
    details = "".join(traceback.format_exception(error))[-LONGEST_DETAILS:]
    return {"outcome": outcome, "reason": f"{type(error).__name__}: {error}".rstrip(": "), "details": details}
