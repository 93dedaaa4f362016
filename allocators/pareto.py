"""The Pareto front of makespan and energy: how much energy a shorter makespan costs."""

import math
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

import numpy as np

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.registry import load
from alloc.allocators.request import as_allocation
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import signals_set
from alloc.allocators.solve import solve
from alloc.problems import Allocation, Evaluation, Instance, Objective, evaluate
from alloc.problems.arguments import event, flag, function, listed, of_type, whole
from alloc.problems.formats.allocation_file import FRONT_FORMAT

CLOSE = 1e-3
"""Relative difference of two neighbouring makespans up to which no run is made between them."""


@dataclass(frozen=True, eq=False)
class Front:
    """Allocations none of which dominates another in makespan and energy, fastest first.

    Attributes
    ----------
    instance : Instance
    points : tuple of Result
        Allocations with the least energy found within their `makespan_limit`, and the bound on it; at least one.
    complete : bool
        False if a run was interrupted.
    """

    instance: Instance
    points: tuple[Result, ...]
    complete: bool

    def to_dict(self) -> dict[str, object]:
        """Return the fields of the format `alloc-pareto/1`, ready for JSON.

        Returns
        -------
        dict
        """
        return {
            "format": FRONT_FORMAT,
            "instance": self.instance.name,
            "complete": self.complete,
            "points": [_point(result) for result in self.points],
        }


def _point(result: Result) -> dict[str, object]:
    names = (
        "method", "status", "stop_reason", "makespan", "lower_bound", "makespan_limit", "energy", "energy_lower_bound",
        "energy_gap", "unserved_tasks", "runtime_s", "assignment",
    )  # fmt: skip
    fields = result.to_dict()
    return {name: fields.get(name) for name in names}


def pareto(
    instance: Instance,
    method: str | Allocator = "auto",
    *,
    points: int = 10,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    seed: int = 0,
    starts: Sequence[Allocation | Result] = (),
    threads: int | None = None,
    on_point: Callable[[Result], None] | None = None,
    stop: threading.Event | None = None,
    handle_signals: bool = True,
    parameters: object = None,
    **settings: object,
) -> Front:
    """Trace the Pareto front of makespan and energy.

    The first run seeks the fastest allocation, the second the one with the least energy at any makespan. Each further
    run minimises the energy under a makespan limit between the two neighbouring points that leave the largest area
    open (the epsilon-constraint method of Haimes, Lasdon and Wismer 1971, doi:10.1109/TSMC.1971.4308298, on an adaptive
    grid). Every run starts from the best allocation within its limit that earlier runs found.

    Parameters
    ----------
    instance : Instance
    method : str or Allocator
        A method that makes use of makespan slack, or ``auto``.
    points : int
        Number of runs, >= 1; raised to the number of `starts` if that is larger. The front has fewer points if several
        limits have the same best allocation.
    time_limit_s, iterations, seed, threads
        For each single run, as in `solve`.
    starts : sequence of Allocation or Result
        Known allocations, such as those of an earlier front; their makespans are the first limits.
    on_point : callable, optional
        Called with the result of every run.
    stop : threading.Event, optional
        Setting it ends the run in progress; the front so far is returned.
    handle_signals : bool
        Whether SIGINT and SIGTERM have the same effect.
    parameters, **settings
        Parameters of the method, as in `solve`.

    Returns
    -------
    Front

    Raises
    ------
    InputError, RefusedError
        As `solve` does.
    """
    of_type(instance, Instance, "instance")
    of_type(method, (str, Allocator), "method")
    points = whole(points, "points", 1)
    Budget(time_limit_s, iterations)
    plans = [as_allocation(instance, start, "starts") for start in listed(starts, "starts", "allocations")]
    function(on_point, "on_point")
    stop = event(stop, "stop") or threading.Event()
    handle_signals = flag(handle_signals, "handle_signals")
    if isinstance(method, str) and method != "auto":
        method, parameters, settings = load(method, parameters, **settings), None, {}
    run: Callable[..., Result] = solve
    run = partial(
        run,
        instance,
        method,
        objective=Objective.MAKESPAN_ENERGY,
        time_limit_s=time_limit_s,
        iterations=iterations,
        seed=seed,
        threads=threads,
        stop=stop,
        handle_signals=False,
        parameters=parameters,
        **settings,
    )
    with signals_set(stop) if handle_signals else nullcontext():
        results = _traced(run, instance, plans, points, on_point or (lambda _: None), stop)
    return Front(instance, _undominated(results), complete=not stop.is_set())


def _traced(
    run: Callable[..., Result],
    instance: Instance,
    plans: Sequence[Allocation],
    points: int,
    on_point: Callable[[Result], None],
    stop: threading.Event,
) -> list[Result]:
    """Return the results of all runs, each with its own makespan limit."""
    known = [(start, evaluate(instance, start)) for start in plans]
    wanted = sorted((score.served_makespan, score.energy) for _, score in known if score.makespan)
    points = max(points, len(wanted))
    results: list[Result] = []
    while len(results) < points:
        limit = _next_limit(instance, results, wanted)
        if limit is None or (results and stop.is_set()):
            break
        result = run(start=_best_within(known, limit), makespan_limit=None if limit == 0 else limit)
        results.append(result)
        if result.allocation is not None and result.evaluation is not None:
            known.append((result.allocation, result.evaluation))
        on_point(result)
    return results


def _next_limit(instance: Instance, results: Sequence[Result], wanted: Sequence[tuple[float, float]]) -> float | None:
    """Return the makespan limit of the next run; 0 for the fastest allocation, None if no run is left.

    After both ends of the front come the makespans of the given allocations, each unless a result is as good already;
    `wanted` has their makespans and energies.
    """
    if not results:
        return 0.0
    fastest = results[0]
    if not fastest.makespan or not fastest.energy:
        return None
    if len(results) == 1:
        return slowest(instance)
    for hours, energy in wanted:
        if not any(_is_as_good(result, hours, energy) for result in results):
            return hours
    area, limit = max(_gaps(results), default=(0.0, None))
    return limit if area > 0 else None


def _gaps(results: Sequence[Result]) -> list[tuple[float, float]]:
    """Return the open area between each pair of neighbours, with makespans on a logarithmic scale, and its middle."""
    ends = sorted((_limit(result), result.makespan or 0.0, result.energy or 0.0) for result in results)
    gaps, (left, _, costly) = [], ends[0]
    for limit, right, cheap in ends[1:]:
        if right > left * (1 + CLOSE) and costly > cheap * (1 + PROVEN):
            gaps.append((math.log(right / left) * (costly - cheap), math.sqrt(left * right)))
        left, costly = limit, min(costly, cheap)
    return gaps


def _is_as_good(result: Result, hours: float, energy: float) -> bool:
    """Return whether `result` is neither slower nor costlier, up to a small tolerance."""
    slow, costly = result.makespan or 0.0, result.energy or 0.0
    return slow <= hours * (1 + CLOSE) and costly <= energy * (1 + PROVEN)


def _limit(result: Result) -> float:
    """Return the makespan limit under which this run minimised the energy."""
    return max(result.makespan_limit or 0.0, result.makespan or 0.0)


def slowest(instance: Instance) -> float:
    """Return an upper bound, in hours, on the makespan of any allocation that serves all tasks."""
    hours = float(instance.workload.max()) / float(instance.ability.min())
    if instance.has_travel_time:
        hours += _farthest(instance) / float(instance.speed.min())
    return min(hours, sys.float_info.max)


def _farthest(instance: Instance) -> float:
    """Return an upper bound on the distance of any flight."""
    reach = instance.reach
    if reach.geometry.is_euclidean:
        places = np.vstack([instance.start_position, instance.task_position])
        places = places[~np.isnan(places).any(axis=1)]
        return float(np.linalg.norm(np.ptp(places, axis=0))) if len(places) else 0.0
    near = reach.neighbours
    assert near is not None, "an instance with too many pairs is refused"
    return float(near.distance.max(initial=0.0))


def _best_within(known: Sequence[tuple[Allocation, Evaluation]], limit: float) -> Allocation | None:
    """Return the allocation with the least energy within `limit` hours, else the fastest one; None if none is known."""
    serving = [(plan, score) for plan, score in known if score.makespan is not None and not score.violations]
    if not serving:
        return None
    in_time = [(plan, score) for plan, score in serving if score.served_makespan <= limit]
    if in_time:
        return min(in_time, key=lambda pair: (pair[1].cost, pair[1].served_makespan))[0]
    return min(serving, key=lambda pair: (pair[1].served_makespan, pair[1].cost))[0]


def _undominated(results: Sequence[Result]) -> tuple[Result, ...]:
    """Return the results that have less energy than all faster ones; the first result if none serves all tasks."""
    kept: list[Result] = []
    for result in sorted(results, key=lambda one: (one.makespan or 0.0, one.energy or 0.0)):
        if result.makespan is not None and (not kept or (result.energy or 0.0) < (kept[-1].energy or 0.0)):
            kept.append(result)
    return tuple(kept or results[:1])
