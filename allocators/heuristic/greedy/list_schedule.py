"""The method `greedy`: in order of decreasing ability, each agent gets the worst-served task within its reach."""

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

MAX_SCANNED = 20_000
"""Number of agents up to which scanning all tasks is as fast as loading compiled code."""

SLICE = 4_096
"""Number of agents that compiled code assigns between two checks of the clock."""

MIN_SHARED = 25_000
"""Minimum number of agents per thread."""

SHARED = 0.9
"""Share of the agents, by decreasing ability, that several threads assign; the others then even out differences."""


class Greedy(Allocator):
    """List scheduling for machine covering: each agent gets the task with the lowest W / h, ties to the largest.

    With travel times, an agent counts with the work that it does until the lower bound on the makespan. There are no
    parameters. With 50,000 agents or more, unless all of them reach every task without travel time, threads divide the
    nine tenths with the highest abilities among them: each serves all tasks with agents of all abilities, and the
    remaining agents even out differences.

    References
    ----------
    Deuermeyer, Friesen and Langston (1982), doi:10.1137/0603019: at most 4/3 of the optimum for equal workloads.
    """

    method = BUILT_IN["greedy"]

    def allocate(self, search: Search) -> Proposal:
        """Return the greedy allocation; agents that are not assigned in time stay idle."""
        return Proposal(greedy(search.instance, search))


def greedy(instance: Instance, search: Search | None = None) -> Allocation:
    """Return the greedy allocation; end early when `search` should stop.

    If energy counts, and every agent reaches every task without travel time, agents of equal ability then swap tasks.
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
    """Load the compiled code that `greedy` uses for this instance, if any, which may take a second."""
    if not (_is_scanned(instance) or (instance.reach.is_complete and not instance.has_travel_time)):
        from alloc.allocators.heuristic.greedy.tree_search import compile_loops

        compile_loops()


def _is_scanned(instance: Instance) -> bool:
    return instance.reach.has_table and instance.n <= MAX_SCANNED


def _by_tree(instance: Instance, search: Search | None) -> NDArray[np.intp]:
    """Return the same as `_by_scan`, in about O(n log m), by compiled code."""
    from alloc.allocators.heuristic.greedy.tree_search import (
        TreeGreedy,  # loads numba, which small instances do not need
    )

    if not (instance.workload > 0).any():
        return np.full(instance.n, IDLE, dtype=np.intp)
    horizon = makespan_lower_bound(instance) if search is None else search.lower_bound
    tree, order = TreeGreedy(instance, horizon), np.array(_order(instance))
    threads = 1 if search is None else min(search.threads, instance.n // MIN_SHARED)
    shared = int(SHARED * instance.n) if threads > 1 else 0

    def assign(part: TreeGreedy, agents: NDArray[np.intp]) -> None:
        for begin in range(0, len(agents), SLICE):
            if search is not None and search.should_stop():
                break
            part.assign(agents[begin : begin + SLICE])

    if shared:
        clones = [tree.clone() for _ in range(threads)]
        with thread_map(threads) as run_all:  # every thread serves all tasks, with agents of all abilities
            list(
                run_all(
                    lambda part: assign(clones[part], np.ascontiguousarray(order[part:shared:threads])), range(threads)
                )
            )
        tree.join(clones)
    assign(tree, order[shared:])
    return tree.task


def _order(instance: Instance) -> list[int]:
    """Return the agents, largest ability first."""
    order: list[int] = np.argsort(-instance.ability, kind="stable").tolist()
    return order


def _by_heap(instance: Instance, search: Search | None) -> NDArray[np.intp]:
    """Return the task of each agent if all agents reach every task, in O(n log m)."""
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
    """Return the task of each agent by scanning the tasks within its reach, in O(n m)."""
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
