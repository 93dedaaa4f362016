"""A plan from prices of tasks: agents that prefer one task get it, and those that hardly care even out the rest."""

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import Floats, Indices
from alloc.allocators.heuristic.task_prices.prices import TaskPrices
from alloc.allocators.heuristic.task_prices.shortlists import Shortlists
from alloc.allocators.runtime.compiled import compiled
from alloc.problems import Allocation

FREE = 0.3
"""Part of the agents that go where they are needed most among tasks where they have nearly the most value."""


def rounded(prices: TaskPrices) -> Allocation:
    """Return a plan in which each agent does a task where it has nearly the most value.

    Parameters
    ----------
    prices : TaskPrices
        With bidders.
    """
    bidders, instance = prices.bidders, prices.instance
    assert bidders is not None
    scale = bidders.makespan / prices.makespan
    regret = np.empty(instance.n)
    find_regrets(bidders.lists, scale, prices.price, regret)
    least = float(np.quantile(regret, FREE))
    order = np.argsort(-instance.ability, kind="stable")
    task = np.full(instance.n, -1, dtype=np.intp)
    done = np.zeros(instance.m)
    assign(order, bidders.lists, scale, prices.price, regret, least, instance.ability, instance.workload, done, task)
    return Allocation(task)


@compiled
def find_regrets(lists: Shortlists, scale: float, price: Floats, regret: Floats) -> None:
    """Set the part of its value that each agent loses on its second-best task."""
    for agent in range(len(regret)):
        best, second = 0.0, 0.0
        for k in range(lists.task.shape[1]):
            task = lists.task[agent, k]
            if task < 0:
                break
            value = price[task] * (1.0 - lists.lost[agent, k] * scale)
            best, second = max(best, value), max(second, min(best, value))
        regret[agent] = 1.0 - second / best if best > 0.0 else 1.0


@compiled
def assign(
    order: Indices,
    lists: Shortlists,
    scale: float,
    price: Floats,
    regret: Floats,
    least: float,
    ability: Floats,
    workload: Floats,
    done: Floats,
    chosen: Indices,
) -> None:
    """Assign agents with more than the `least` regret to their best tasks, then the others where most is missing.

    Parameters
    ----------
    order : ndarray of int, shape (n,)
        Agents, the ablest first.
    done : ndarray, shape (m,)
        Ability on each task, less what is lost on the way; changed in place.
    chosen : ndarray of int, shape (n,)
        Task of each agent; changed in place.
    """
    for is_free in (False, True):
        for agent in order:
            if (regret[agent] <= least) != is_free:
                continue
            best = 0.0
            for k in range(lists.task.shape[1]):
                if lists.task[agent, k] >= 0:
                    best = max(best, price[lists.task[agent, k]] * (1.0 - lists.lost[agent, k] * scale))
            at, coverage = -1, np.inf
            for k in range(lists.task.shape[1]):
                task = lists.task[agent, k]
                if task < 0:
                    break
                value = price[task] * (1.0 - lists.lost[agent, k] * scale)
                enough = best * (1.0 - least) if is_free else best
                if value >= enough and value > 0.0 and done[task] < coverage * workload[task]:
                    at, coverage = k, done[task] / workload[task]
            if at >= 0:
                chosen[agent] = lists.task[agent, at]
                done[chosen[agent]] += ability[agent] * (1.0 - lists.lost[agent, at] * scale)
