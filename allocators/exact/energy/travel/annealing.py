"""Annealing by repartitions of a few tasks, with penalties on shortfalls that rise as it cools; compiled."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.exact.energy.travel.repartition import Tasks, repartition
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.instance import FloatArray

MAX_TASKS, WIDE_PERIOD, WIDE_PERIOD_SHORT = 3, 10, 2
"""Largest number of tasks in a repartition, and one in how many repartitions has that many, in general and if it begins
with a task with a shortfall; the others have one less."""

MAX_OF_TASK, MAX_IDLE = 10, 6
"""Largest numbers of agents of a task, and of idle agents, in a repartition."""

MAX_NODES = 2000
"""Limit on the nodes of the search for one repartition."""

SHORT_PERIOD = 4
"""One in so many repartitions begins with a task with a shortfall, if there is one."""


class Groups(NamedTuple):
    """A plan, with the data for changing it; the last group is that of idle agents.

    Attributes
    ----------
    weight, cost : ndarray, shape (n, m)
        Share of each task that an agent does, and the cost of its flight, in mean flights; ``inf`` out of reach.
    near : ndarray of int, shape (m, p)
        Nearest tasks of each task.
    noise : ndarray, shape (2^q,)
        Samples of logistic noise.
    task : ndarray of int, shape (n,)
    member, size : ndarray of int, shapes (m + 1, n) and (m + 1,)
        Agents of each group, and their number.
    done : ndarray, shape (m,)
    random : ndarray of uint64, shape (1,)
    best : ndarray of int, shape (n,)
        The cheapest plan without a shortfall.
    total : ndarray, shape (2,)
        Cost of the present plan, and of the best one.
    """

    weight: FloatArray
    cost: FloatArray
    near: WholeArray
    noise: FloatArray
    task: WholeArray
    member: WholeArray
    size: WholeArray
    done: FloatArray
    random: RandomState
    best: WholeArray
    total: FloatArray


@compiled
def draw_tasks(groups: Groups, short: int, chosen: WholeArray) -> int:
    """Draw nearby tasks, followed by that of idle agents, into `chosen`; return their number."""
    m, period, count, random = len(groups.done), WIDE_PERIOD, 1, groups.random
    chosen[0] = draw(random, m)
    if short > 0 and draw(random, SHORT_PERIOD) == 0:
        period = WIDE_PERIOD_SHORT
        while groups.done[chosen[0]] >= 1.0:
            chosen[0] = chosen[0] + 1 if chosen[0] + 1 < m else 0
    size = MAX_TASKS if draw(random, period) == 0 else MAX_TASKS - 1
    size = min(size, 1 + groups.near.shape[1])
    while count < size:
        task = groups.near[chosen[draw(random, count)], draw(random, groups.near.shape[1])]
        is_new = True
        for x in range(count):
            is_new = is_new and chosen[x] != task
        if is_new or draw(random, 8) == 0:  # ends even if few tasks are near
            if not is_new:
                break
            chosen[count] = task
            count += 1
    chosen[count] = m
    return count


@compiled
def draw_pool(groups: Groups, chosen: WholeArray, count: int, pool: WholeArray, option: WholeArray) -> int:
    """Move agents of the groups, a sample of large ones, to the ends of their lists and the pool; return the count."""
    agents = 0
    for x in range(count + 1):
        group = chosen[x]
        size = groups.size[group]
        most = min(size, MAX_OF_TASK if x < count else MAX_IDLE)
        member = groups.member[group]
        for y in range(most):
            last = size - 1 - y
            z = draw(groups.random, last + 1) if most < size else last
            member[z], member[last] = member[last], member[z]
            pool[agents], option[agents] = member[last], x
            agents += 1
    return agents


@compiled
def apply(
    groups: Groups, chosen: WholeArray, count: int, pool: WholeArray, option: WholeArray, best: WholeArray
) -> None:
    """Move the agents of the pool, which are the last ones of their groups, to their new tasks."""
    idle, cost, total = len(groups.done), groups.cost, groups.total
    for z in range(len(pool)):
        groups.size[chosen[option[z]]] -= 1
    for z in range(len(pool)):
        agent, old, new = pool[z], chosen[option[z]], chosen[best[z]]
        groups.task[agent] = new
        groups.member[new, groups.size[new]] = agent
        groups.size[new] += 1
        total[0] += (cost[agent, new] if new < idle else 0.0) - (cost[agent, old] if old < idle else 0.0)
    for x in range(count):
        task, done = chosen[x], 0.0
        for y in range(groups.size[task]):
            done += groups.weight[groups.member[task, y], task]
        groups.done[task] = done


@compiled
def anneal(
    groups: Groups, price: FloatArray, fixed: float, penalty: float, calls: int, heat: float, cooling: float
) -> None:
    """Make `calls` repartitions with noise on costs, of initial size `heat`, multiplied by `cooling` after each.

    Parameters
    ----------
    groups : Groups
    price : ndarray, shape (m,)
        Price of the whole work on each task.
    fixed : float
        Penalty of any shortfall, however small.
    penalty : float
        Penalty of missing work, as a multiple of its price, or of the mean price.
    """
    m, mean, random = len(price), price.mean(), groups.random
    most = (MAX_TASKS + 1) * max(MAX_OF_TASK, MAX_IDLE)
    chosen, short = np.empty(MAX_TASKS + 1, dtype=np.int64), 0
    all_agents, options = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    for j in range(m):
        short += groups.done[j] < 1.0
    for _ in range(calls):
        heat *= cooling
        count = draw_tasks(groups, short, chosen)
        agents = draw_pool(groups, chosen, count, all_agents, options)
        if agents == 0:
            continue
        pool, option = all_agents[:agents], options[:agents]
        value, weight = np.zeros((agents, count + 1)), np.zeros((agents, count + 1))
        tasks = Tasks(np.empty(count), np.empty(count), np.full(count, fixed), np.empty(count))
        at = draw(random, len(groups.noise))
        for x in range(count):
            j = chosen[x]
            tasks.done[x], tasks.price[x], tasks.penalty[x] = groups.done[j], price[j], penalty * max(price[j], mean)
            for z in range(agents):
                i, at = pool[z], at + 1 if at + 1 < len(groups.noise) else 0
                weight[z, x] = groups.weight[i, j]
                value[z, x] = groups.cost[i, j] - price[j] * weight[z, x] + heat * groups.noise[at]
                if option[z] == x:
                    tasks.done[x] -= weight[z, x]
        best = np.empty(agents, dtype=np.int64)
        if repartition(value, weight, tasks, option, MAX_NODES, best) <= 0.0:
            continue
        for x in range(count):
            short -= groups.done[chosen[x]] < 1.0
        apply(groups, chosen, count, pool, option, best)
        for x in range(count):
            short += groups.done[chosen[x]] < 1.0
        if short == 0 and groups.total[0] < groups.total[1]:
            groups.best[:], groups.total[1] = groups.task, groups.total[0]
