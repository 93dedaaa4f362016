"""Change a plan in force as little as need be: exchanges from it, until no task is later than it may be."""

import time

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.improve import HARD
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.problems import IDLE, Allocation, only_allowed
from alloc.problems.instance import IntArray

EXCHANGES_PER_AGENT = 200
"""Most exchanges, for each agent."""


def repair(search: Search, *, seconds: float) -> None:
    """Submit plans that keep to the makespan limit and are as near as possible to the plan in force.

    Parameters
    ----------
    search : Search
        Its instance has a price on moves, and its best plan serves the tasks that are to be served.
    seconds : float
        Time for it; at most `EXCHANGES_PER_AGENT` are made.
    """
    move, origin = search.instance.reach.move, search.instance.reach.origin
    assert move is not None
    assert search.best is not None
    parameters, best = LocalSearchParameters(), search.best
    if best.evaluation.cost == 0 or best.evaluation.served_makespan == 0:
        return
    state = AnnealingState(search.instance, search.seed, parameters.neighbours)
    start = _serving(only_allowed(search.instance, Allocation(move.task[origin])), best.allocation, search.instance.m)
    state.begin(start, search.makespan_limit)
    end = time.monotonic() + seconds
    for _ in range(1 + EXCHANGES_PER_AGENT * search.instance.n // parameters.exchanges):
        if search.interrupted or time.monotonic() >= end:
            break
        state.run(parameters.exchanges, parameters.weights(state, parameters.final_noise, HARD))
    if state.best is not None:
        search.submit(state.best)


def _serving(plan: Allocation, other: Allocation, m: int) -> Allocation:
    """Return a plan that serves all tasks that another one does, with its agents where `plan` has none."""
    task: IntArray = plan.task_of_agent.copy()
    served = np.isin(np.arange(m), task)
    wanted = other.task_of_agent
    taken = (wanted != IDLE) & ~served[wanted]
    task[taken] = wanted[taken]
    return Allocation(task)
