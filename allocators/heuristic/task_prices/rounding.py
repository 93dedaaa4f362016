"""A plan from prices of tasks, in which agents do tasks with nearly their highest value, and shortfalls are small.

First, agents with a clear preference get their best task, and nearly indifferent ones go to tasks with the largest
shortfalls. Then each agent in turn changes to the task of highest utility, given the prices and shortfalls.
"""

from collections.abc import Callable, Iterator

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import Floats, Indices
from alloc.allocators.heuristic.task_prices.prices import TaskPrices
from alloc.allocators.heuristic.task_prices.shortlists import Shortlists
from alloc.allocators.runtime.compiled import compiled
from alloc.problems import IDLE, Allocation

FREE = 0.3
"""Share of the agents that are assigned by shortfall among tasks where they have nearly their highest value."""

SLACK = 0.001
"""Relative excess of the target makespan over that of a fractional allocation, as whole agents waste some ability."""

WIDTHS = (0.02, 0.01, 0.005)
"""Excess work, as a share of a task's workload, that divides the utility of further work by e; one value per pass."""

LARGEST_EXPONENT = 300.0
"""Largest exponent of the factor on the utility of a task, for tasks without agents."""

SLICE = 65_536
"""Number of agents that compiled code processes between two checks of the clock."""


def rounded(prices: TaskPrices, stopped: Callable[[], bool] = lambda: False) -> Allocation:
    """Return a plan in which each agent does a task on which it has nearly its highest value.

    Parameters
    ----------
    prices : TaskPrices
        Prices with bidders.
    stopped : callable
        Checked periodically; when it returns true, agents keep their tasks, or stay idle.

    References
    ----------
    Exponential potential: Plotkin, Shmoys and Tardos (1995), doi:10.1287/moor.20.2.257. Convergence of agents that
    improve a potential in turn: Monderer and Shapley (1996), doi:10.1006/game.1996.0044.
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
    """Yield slices of the agents until `stopped` returns true."""
    for begin in range(0, len(order), SLICE):
        if stopped():
            return
        yield order[begin : begin + SLICE]


@compiled
def find_regrets(lists: Shortlists, scale: float, price: Floats, regret: Floats) -> None:
    """Set the share of its value that each agent loses on its second-best task."""
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
    """Assign agents with more than the `least` regret to their best tasks, or the others by the largest shortfall.

    Parameters
    ----------
    chosen : ndarray of int
        Agents by decreasing ability.
    is_free : bool
        Whether to assign the others.
    need : ndarray, shape (m,)
        Ability that each task needs.
    done : ndarray, shape (m,)
        Ability on each task, reduced by travel times; changed in place.
    entry : ndarray of int, shape (n,)
        Index of the task of each agent on its shortlist; changed in place.
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
    """Let each agent in turn change to the task of highest utility.

    The utility of a unit of ability is the price of the task times exp(relative shortfall / `width`); for an agent, it
    is approximately the mean of the values without and with that agent.

    Parameters
    ----------
    chosen, need, done, entry
        See `assign`.
    factor : ndarray, shape (m,)
        Utility of a further unit of ability on each task; changed in place.
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
            if k == now or brought * factor[task] <= best:  # an upper bound on its utility
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
    """Return the utility of a further unit of ability on a task that has `done`."""
    return float(price[task] * np.exp(min(LARGEST_EXPONENT, (1.0 - done / need[task]) / width)))
