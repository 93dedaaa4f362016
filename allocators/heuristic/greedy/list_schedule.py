"""The method `greedy`: largest ability first, each agent to the worst-served task within its reach."""

import heapq

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.swaps import reduce_distance
from alloc.allocators.parallel.pool import thread_map
from alloc.problems import IDLE, Allocation, Instance, Objective, makespan_lower_bound

CHECK_EVERY = 256
"""Agents between two checks of the clock."""

MOST_SCANNED = 20_000
"""Agents up to which scanning all tasks is as fast as loading compiled code."""

SLICE = 4_096
"""Agents that compiled code assigns between two checks of the clock."""

LEAST_SHARED = 25_000
"""Agents that each thread has at least."""

SHARED = 0.9
"""Part of the agents, the ablest, that several threads assign; the others make up for what is uneven then."""


class Greedy(Allocator):
    """List scheduling for machine covering: the task with the lowest W / h next, ties to the largest workload.

    With travel times, an agent counts with what it does until the lower bound on the makespan. It has no parameters.
    From 50,000 agents on, where not all reach every task at once, threads share the ablest nine tenths of them: each
    serves all tasks by some agents of every size, and the other agents even out what is left.

    References
    ----------
    Deuermeyer, Friesen and Langston (1982), doi:10.1137/0603019: 4/3 of the optimum where workloads are equal.
    """

    method = BUILT_IN["greedy"]

    def allocate(self, search: Search) -> Proposal:
        """Return one allocation; agents that are left when time is up stay idle."""
        return Proposal(greedy(search.instance, search))


def greedy(instance: Instance, search: Search | None = None) -> Allocation:
    """Return the greedy allocation; ends early when `search` should stop.

    Where energy counts, and every agent reaches every task at once, agents of equal ability then swap tasks.
    """
    if instance.reach.is_complete and not instance.has_travel_time:
        task = _by_heap(instance, search)
        if search is not None and search.objective is Objective.MAKESPAN_ENERGY:
            task = reduce_distance(instance, task, search.should_stop)
        return Allocation(task)
    if _is_scanned(instance):
        return Allocation(_by_scan(instance, search))
    return Allocation(_by_tree(instance, search))


def load_compiled(instance: Instance) -> None:
    """Load the compiled code that `greedy` uses for this instance, if it does, which may take a second."""
    if not (_is_scanned(instance) or (instance.reach.is_complete and not instance.has_travel_time)):
        from alloc.allocators.heuristic.greedy.tree_search import compile_loops

        compile_loops()


def _is_scanned(instance: Instance) -> bool:
    return instance.reach.has_table and instance.n <= MOST_SCANNED


def _by_tree(instance: Instance, search: Search | None) -> NDArray[np.intp]:
    """Do as `_by_scan` in about O(n log m), by compiled code."""
    from alloc.allocators.heuristic.greedy.tree_search import (
        TreeGreedy,  # loads the compiler, which small instances do without
    )

    if not (instance.workload > 0).any():
        return np.full(instance.n, IDLE, dtype=np.intp)
    horizon = makespan_lower_bound(instance) if search is None else search.lower_bound
    tree, order = TreeGreedy(instance, horizon), np.array(_order(instance))
    threads = 1 if search is None else min(search.threads, instance.n // LEAST_SHARED)
    shared = int(SHARED * instance.n) if threads > 1 else 0

    def assign(part: TreeGreedy, agents: NDArray[np.intp]) -> None:
        for begin in range(0, len(agents), SLICE):
            if search is not None and search.should_stop():
                break
            part.assign(agents[begin : begin + SLICE])

    if shared:
        twins = [tree.twin() for _ in range(threads)]
        with thread_map(threads) as run_all:  # every thread serves all tasks, by agents of all sizes
            list(
                run_all(
                    lambda part: assign(twins[part], np.ascontiguousarray(order[part:shared:threads])), range(threads)
                )
            )
        tree.join(twins)
    assign(tree, order[shared:])
    return tree.task


def _order(instance: Instance) -> list[int]:
    """Return the agents, largest ability first."""
    order: list[int] = np.argsort(-instance.ability, kind="stable").tolist()
    return order


def _by_heap(instance: Instance, search: Search | None) -> NDArray[np.intp]:
    """Assign agents that all reach every task, in O(n log m)."""
    work, ability = instance.workload.tolist(), instance.ability.tolist()
    task = np.full(instance.n, IDLE, dtype=np.intp)
    heap = [(0.0, -h, j) for j, h in enumerate(work) if h > 0]
    heapq.heapify(heap)
    group = [0.0] * instance.m
    for count, agent in enumerate(_order(instance) if heap else []):
        if count % CHECK_EVERY == 0 and search is not None and search.should_stop():
            break
        j = heap[0][2]
        group[j] += ability[agent]
        heapq.heapreplace(heap, (group[j] / work[j], heap[0][1], j))
        task[agent] = j
    return task


def _by_scan(instance: Instance, search: Search | None) -> NDArray[np.intp]:
    """Assign agents in O(n m), each scanning the tasks within its reach."""
    reach, work = instance.reach, instance.workload
    task = np.full(instance.n, IDLE, dtype=np.intp)
    by_size = np.argsort(-work, kind="stable")
    by_size = by_size[work[by_size] > 0]
    if not len(by_size):
        return task
    group = np.zeros(instance.m)
    horizon = makespan_lower_bound(instance) if search is None else search.lower_bound
    options = [by_size[row[by_size]] for row in reach.mask]
    for count, agent in enumerate(_order(instance)):
        if count % CHECK_EVERY == 0 and search is not None and search.should_stop():
            break
        origin = reach.origin[agent]
        tasks = options[origin]
        if instance.has_travel_time:
            tasks = tasks[reach.distance[origin, tasks] < horizon * instance.speed[agent]]
        if len(tasks):
            best = tasks[np.argmin(group[tasks] / work[tasks])]
            task[agent] = best
            share = 1.0
            if instance.has_travel_time:
                share -= reach.distance[origin, best] / (horizon * instance.speed[agent])
            group[best] += instance.ability[agent] * share
    return task
