"""A plan from prices of tasks: agents do tasks where they have nearly the most value, and little is missing.

First, agents that prefer one task get it, and those that hardly care go where most is missing. Then each agent in turn
changes to the task to which it brings most, counted by price and by how much is missing there.
"""

from collections.abc import Callable, Iterator

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import Floats, Indices
from alloc.allocators.heuristic.task_prices.prices import TaskPrices
from alloc.allocators.heuristic.task_prices.shortlists import Shortlists
from alloc.allocators.runtime.compiled import compiled
from alloc.problems import IDLE, Allocation

FREE = 0.3
"""Part of the agents that go where they are needed most among tasks where they have nearly the most value."""

SLACK = 0.001
"""Part by which the makespan aimed at exceeds that of a fractional allocation: whole agents leave some ability over."""

WIDTHS = (0.02, 0.01, 0.005)
"""Excess of work done, as a part of a task's workload, that divides the utility of more by e; for each pass."""

LARGEST_EXPONENT = 300.0
"""Of the factor on the utility of a task that has no agent yet."""

SLICE = 65_536
"""Agents that compiled code looks at between two checks of the clock."""


def rounded(prices: TaskPrices, stopped: Callable[[], bool] = lambda: False) -> Allocation:
    """Return a plan in which each agent does a task where it has nearly the most value.

    Parameters
    ----------
    prices : TaskPrices
        With bidders.
    stopped : callable
        Checked now and then; once it is true, agents stay where they are, or idle.

    References
    ----------
    Exponential potential: Plotkin, Shmoys and Tardos (1995), doi:10.1287/moor.20.2.257. That agents which improve a
    potential in turn come to an end: Monderer and Shapley (1996), doi:10.1006/game.1996.0044.
    """
    bidders, instance = prices.bidders, prices.instance
    assert bidders is not None
    lists, ability = bidders.lists, instance.ability
    makespan = prices.makespan * (1 + SLACK)
    scale, need = bidders.makespan / makespan, instance.workload / makespan
    regret = np.empty(instance.n)
    find_regrets(lists, scale, prices.price, regret)
    least = float(np.quantile(regret, FREE))
    order, entry = np.argsort(-ability, kind="stable"), np.full(instance.n, -1, dtype=np.intp)
    done, factor = np.zeros(instance.m), np.zeros(instance.m)
    for is_free in (False, True):
        for chosen in _slices(order, stopped):
            assign(chosen, is_free, lists, scale, prices.price, regret, least, ability, need, done, entry)
    for width in WIDTHS:
        excess = np.divide(done, need, out=np.full(instance.m, np.inf), where=need > 0) - 1
        factor[:] = prices.price * np.exp(-np.maximum(excess / width, -LARGEST_EXPONENT))
        for chosen in _slices(order, stopped):
            change_tasks(chosen, lists, scale, prices.price, ability, need, width, done, factor, entry)
    task = lists.task[np.arange(instance.n), np.maximum(entry, 0)]
    return Allocation(np.where(entry < 0, IDLE, task).astype(np.intp))


def _slices(order: Indices, stopped: Callable[[], bool]) -> Iterator[Indices]:
    """Yield the agents in parts, until that is to stop."""
    for begin in range(0, len(order), SLICE):
        if stopped():
            return
        yield order[begin : begin + SLICE]


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
    chosen: Indices,
    is_free: bool,
    lists: Shortlists,
    scale: float,
    price: Floats,
    regret: Floats,
    least: float,
    ability: Floats,
    need: Floats,
    done: Floats,
    entry: Indices,
) -> None:
    """Assign agents with more than the `least` regret to their best tasks, or the others where most is missing.

    Parameters
    ----------
    chosen : ndarray of int
        Agents, the ablest first.
    is_free : bool
        Whether the others are meant.
    need : ndarray, shape (m,)
        Ability that each task needs.
    done : ndarray, shape (m,)
        Ability on each task, less what is lost on the way; changed in place.
    entry : ndarray of int, shape (n,)
        Where the task of each agent stands on its shortlist; changed in place.
    """
    for agent in chosen:
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
            if value >= enough and value > 0.0 and done[task] < coverage * need[task]:
                at, coverage = k, done[task] / need[task]
        if at >= 0:
            entry[agent] = at
            done[lists.task[agent, at]] += ability[agent] * (1.0 - lists.lost[agent, at] * scale)


@compiled
def change_tasks(
    chosen: Indices,
    lists: Shortlists,
    scale: float,
    price: Floats,
    ability: Floats,
    need: Floats,
    width: float,
    done: Floats,
    factor: Floats,
    entry: Indices,
) -> None:
    """Let each agent change to the task where its utility is most, one after the other.

    The utility of a unit of ability is the price of the task, times e for each `width` that the work falls short; an
    agent counts with the mean of what that is without it and with it, about.

    Parameters
    ----------
    chosen, need, done, entry
        As in `assign`.
    factor : ndarray, shape (m,)
        Utility of a unit more on each task as it is; changed in place.
    """
    for agent in chosen:
        now, best = entry[agent], 0.0
        if now >= 0:
            task = lists.task[agent, now]
            brought = ability[agent] * (1.0 - lists.lost[agent, now] * scale)
            best = brought * _utility(task, done[task] - 0.5 * brought, price, need, width) * (1.0 + 1e-9)
        at = now
        for k in range(lists.task.shape[1]):
            task = lists.task[agent, k]
            if task < 0:
                break
            brought = ability[agent] * (1.0 - lists.lost[agent, k] * scale)
            if k == now or brought * factor[task] <= best:  # its utility is less than that of its first part
                continue
            gain = brought * _utility(task, done[task] + 0.5 * brought, price, need, width)
            if gain > best:
                at, best = k, gain
        if at == now:
            continue
        for k, sign in ((now, -1.0), (at, 1.0)):
            if k >= 0:
                task = lists.task[agent, k]
                done[task] += sign * ability[agent] * (1.0 - lists.lost[agent, k] * scale)
                factor[task] = _utility(task, done[task], price, need, width)
        entry[agent] = at


@compiled
def _utility(task: int, done: float, price: Floats, need: Floats, width: float) -> float:
    """Return the utility of a unit of ability more where that much is there."""
    return float(price[task] * np.exp(min(LARGEST_EXPONENT, (1.0 - done / need[task]) / width)))
