"""Optimal repartition of the agents of a few tasks among these tasks, at prices of work; compiled.

With a price of work on each task, the reduced cost of an agent is its cost less the price of its work; the regret of a
choice is its reduced cost minus the least one. Up to a constant, the cost of a plan is the sum of all regrets and the
price of work beyond the needs. A depth-first search with this bound optimally distributes a dozen agents over two or
three tasks in some hundred nodes, as agents near one task have large regrets elsewhere.

References
----------
Ross and Soland (1975), A branch and bound algorithm for the generalized assignment problem, doi:10.1007/BF01580430.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MIN_GAIN = 1e-9
"""Smallest gain of a change, in mean flights."""


class Tasks(NamedTuple):
    """The work done on some tasks, and its prices; needs are 1, and costs are in mean flights.

    Attributes
    ----------
    done : ndarray, shape (t,)
        Work by agents outside the pool.
    price : ndarray, shape (t,)
        Price of work, up to the need and beyond.
    fixed_penalty, penalty : ndarray, shape (t,)
        Penalty of any shortfall, and per missing work.
    """

    done: FloatArray
    price: FloatArray
    fixed_penalty: FloatArray
    penalty: FloatArray


@compiled
def price_of_work(tasks: Tasks, j: int, done: float, at_most: float) -> float:
    """Return the price of the work in `done` beyond the need, or the penalty if even `at_most` is a shortfall."""
    if done > 1.0:
        return float(tasks.price[j] * (done - 1.0))
    return float(tasks.fixed_penalty[j] + tasks.penalty[j] * (1.0 - at_most)) if at_most < 1.0 else 0.0


@compiled
def sort_options(value: FloatArray, option: WholeArray, regret: FloatArray, second: FloatArray) -> None:
    """Sort the options of each agent by value; write their regrets, shape (n, t + 1), and that of the second one."""
    for i in range(len(value)):
        for z in range(value.shape[1]):
            q = z
            while q > 0 and value[i, option[i, q - 1]] > value[i, z]:
                option[i, q] = option[i, q - 1]
                q -= 1
            option[i, q] = z
        for z in range(value.shape[1]):
            regret[i, z] = value[i, option[i, z]] - value[i, option[i, 0]]
        second[i] = -regret[i, 1]


@compiled
def most_to_come(
    weight: FloatArray, option: WholeArray, regret: FloatArray, order: WholeArray, limit: float
) -> FloatArray:
    """Return the largest work that agents from each position of `order` on can add to each task, shape (n + 1, t)."""
    most = np.zeros((len(order) + 1, weight.shape[1] - 1))
    for q in range(len(order) - 1, -1, -1):
        i = order[q]
        most[q] = most[q + 1]
        for z in range(weight.shape[1]):
            if regret[i, z] >= limit:
                break
            if option[i, z] < most.shape[1]:
                most[q, option[i, z]] += weight[i, option[i, z]]
    return most


@compiled
def repartition(
    value: FloatArray, weight: FloatArray, tasks: Tasks, current: WholeArray, max_nodes: int, best: WholeArray
) -> float:
    """Write the best options of all agents, if they improve on the current ones, and return the gain.

    Parameters
    ----------
    value : ndarray, shape (n, t + 1)
        Reduced cost of each agent on each task, ``inf`` out of reach; the last column is for idle agents.
    weight : ndarray, shape (n, t + 1)
        Work of each agent on each task.
    tasks : Tasks
    current : ndarray of int, shape (n,)
        Current option of each agent.
    max_nodes : int
        Limit on the nodes of the search.
    best : ndarray of int, shape (n,)
        Output: the option of each agent, if there is a gain.
    """
    agents, options = value.shape
    option, regret = np.empty((agents, options), dtype=np.int64), np.empty((agents, options))
    second, done = np.empty(agents), np.zeros((agents + 1, options - 1))
    sort_options(value, option, regret, second)
    done[0] = tasks.done
    now, limit = tasks.done.copy(), 0.0
    for i in range(agents):
        limit += value[i, current[i]] - value[i, option[i, 0]]
        if current[i] < options - 1:
            now[current[i]] += weight[i, current[i]]
    for j in range(options - 1):
        limit += price_of_work(tasks, j, now[j], now[j])
    before = limit
    limit -= MIN_GAIN
    order = np.argsort(second)
    most = most_to_come(weight, option, regret, order, limit)
    paid, branch, taken = np.zeros(agents + 1), np.zeros(agents + 1, dtype=np.int64), np.empty(agents, dtype=np.int64)
    q, nodes, gain = 0, 0, 0.0
    while q >= 0:
        z = branch[q]
        if z == options or paid[q] + regret[order[q], z] >= limit:
            q -= 1
            continue
        branch[q], nodes, i = z + 1, nodes + 1, order[q]
        if nodes > max_nodes:
            break
        paid[q + 1] = paid[q] + regret[i, z]
        total = paid[q + 1]
        for j in range(options - 1):
            done[q + 1, j] = done[q, j] + (weight[i, j] if option[i, z] == j else 0.0)
            total += price_of_work(tasks, j, done[q + 1, j], done[q + 1, j] + most[q + 1, j])
        if total >= limit:
            continue
        taken[q] = option[i, z]
        if q + 1 < agents:
            q += 1
            branch[q] = 0
            continue
        limit, gain = total, before - total
        for p in range(agents):
            best[order[p]] = taken[p]
    return gain
