"""Compiled searches for the most valuable tasks of each agent at given prices, in a tree over the tasks.

The value of an agent on a task is the price of the task times the share of the makespan that is left on arrival.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.greedy.task_tree import Floats, Indices, Tree
from alloc.allocators.heuristic.greedy.tree_search import MARGIN, STACK_SIZE, Agents, is_reachable, straight_distance
from alloc.allocators.runtime.compiled import compiled, inlined


class Shortlists(NamedTuple):
    """The most valuable tasks of each agent, best first.

    Attributes
    ----------
    task : ndarray of int32, shape (agents, length)
        Tasks, followed by -1 if there are fewer.
    lost : ndarray of float32, shape (agents, length)
        Share of the makespan that passes before arrival.
    """

    task: NDArray[np.int32]
    lost: NDArray[np.float32]


def empty_shortlists(agents: int, length: int) -> Shortlists:
    """Return empty shortlists."""
    return Shortlists(np.full((agents, length), -1, dtype=np.int32), np.zeros((agents, length), dtype=np.float32))


@compiled
def fill_highest(tree: Tree, price: Floats, highest: Floats) -> None:
    """Set the highest price of a task in each node of the tree."""
    for node in range(len(tree.begin) - 1, -1, -1):
        if 2 * node + 2 < len(tree.begin):
            highest[node] = max(highest[2 * node + 1], highest[2 * node + 2])
        else:
            highest[node] = 0.0
            for entry in range(tree.begin[node], tree.end[node]):
                highest[node] = max(highest[node], price[tree.order[entry]])


@compiled
def find_shortlists(
    first: int, last: int, agents: Agents, tree: Tree, goal: Floats, price: Floats, highest: Floats, found: Shortlists
) -> float:
    """Fill the shortlists of agents `first` to `last`; return their total value, each on its best task.

    Parameters
    ----------
    first, last : int
    agents, tree
        As in the greedy method, with `Agents.horizon` for the makespan.
    goal : ndarray, shape (m, 3)
        Positions of the tasks.
    price : ndarray, shape (m,)
        0 for tasks outside the tree.
    highest : ndarray, shape (nodes,)
        Highest price in each node.
    found : Shortlists
    """
    stack, value = np.empty(STACK_SIZE, dtype=np.intp), np.empty(found.task.shape[1])
    total = 0.0
    for agent in range(first, last):
        value[:] = 0.0
        found.task[agent, :] = -1
        if agents.list_of[agents.origin[agent]] >= 0:
            _search_list(agent, agents, goal, price, value, found)
        else:
            _search_tree(agent, agents, tree, goal, price, highest, stack, value, found)
        total += agents.ability[agent] * value[0]
    return total


@inlined
def _offer(agent: int, task: int, gain: float, lost: float, value: Floats, found: Shortlists) -> None:
    """Insert a task into the shortlist of an agent, in place of the last one."""
    at = len(value) - 1
    while at > 0 and value[at - 1] < gain:
        value[at] = value[at - 1]
        found.task[agent, at], found.lost[agent, at] = found.task[agent, at - 1], found.lost[agent, at - 1]
        at -= 1
    value[at], found.task[agent, at], found.lost[agent, at] = gain, task, lost


@compiled
def _search_list(agent: int, agents: Agents, goal: Floats, price: Floats, value: Floats, found: Shortlists) -> None:
    origin = agents.origin[agent]
    number, horizon = agents.list_of[origin], agents.horizon[agent]
    is_known = agents.listed_distance.shape[0] > 0
    for entry in range(agents.list_begin[number], agents.list_begin[number + 1]):
        task = agents.listed_task[entry]
        if is_known:
            distance = agents.listed_distance[entry]
            if not distance < horizon:
                continue
        else:
            distance = straight_distance(agents.position[origin], goal[task])
            longest, battery = agents.longest_distance[origin], agents.battery[origin]
            if not is_reachable(distance, longest, battery, agents.energy_per_distance, horizon):
                continue
        gain = price[task] * (1.0 - distance / horizon)
        if gain > value[-1]:
            _offer(agent, task, gain, distance / horizon, value, found)


@compiled
def _search_tree(
    agent: int,
    agents: Agents,
    tree: Tree,
    goal: Floats,
    price: Floats,
    highest: Floats,
    stack: Indices,
    value: Floats,
    found: Shortlists,
) -> None:
    origin = agents.origin[agent]
    position, horizon = agents.position[origin], agents.horizon[agent]
    longest, battery = agents.longest_distance[origin], agents.battery[origin]
    limit = min(agents.radius[origin], horizon)
    size, stack[0] = 1, 0
    while size > 0:
        size -= 1
        node = stack[size]
        away = _distance_to_box(position, tree.low[node], tree.high[node])
        if away > limit or highest[node] * (1.0 - away / horizon) <= value[-1]:
            continue
        if 2 * node + 2 < len(tree.begin):
            left, right = 2 * node + 1, 2 * node + 2
            if _distance_to_box(position, tree.low[left], tree.high[left]) < _distance_to_box(
                position, tree.low[right], tree.high[right]
            ):
                left, right = right, left
            stack[size], stack[size + 1] = left, right  # the nearer child is visited first
            size += 2
            continue
        for entry in range(tree.begin[node], tree.end[node]):
            task = tree.order[entry]
            distance = straight_distance(position, goal[task])
            if is_reachable(distance, longest, battery, agents.energy_per_distance, horizon):
                gain = price[task] * (1.0 - distance / horizon)
                if gain > value[-1]:
                    _offer(agent, task, gain, distance / horizon, value, found)


@compiled
def _distance_to_box(position: Floats, low: Floats, high: Floats) -> float:
    """Return a lower bound on the distance to any task in the box; 0 if the position is unknown."""
    total = 0.0
    for axis in range(3):
        step = max(0.0, low[axis] - position[axis], position[axis] - high[axis])
        if step > 0.0:
            total += step * step
    return float(np.sqrt(total) * MARGIN)


@compiled
def smooth_value(
    first: int,
    last: int,
    ability: Floats,
    lists: Shortlists,
    scale: float,
    price: Floats,
    width: float,
    share: Floats,
) -> tuple[float, float]:
    """Return the total value of agents `first` to `last`, smoothed and exact; add the value by task to `share`.

    The smoothed value of an agent is the p-norm of its values on tasks, with p = 1 / `width`.

    Parameters
    ----------
    scale : float
        Factor on `Shortlists.lost`, for a makespan different from that of the shortlists.
    width : float
        Width of the smoothing: relative difference of values that counts as small.
    """
    length = lists.task.shape[1]
    value = np.empty(length)
    smoothed, exact = 0.0, 0.0
    for agent in range(first, last):
        best = 0.0
        for k in range(length):
            task = lists.task[agent, k]
            value[k] = 0.0 if task < 0 else max(0.0, price[task] * (1.0 - lists.lost[agent, k] * scale))
            best = max(best, value[k])
        if best == 0.0:
            continue
        total = 0.0
        for k in range(length):
            exponent = (value[k] / best - 1.0) / width  # close to the logarithm where it matters
            value[k] = np.exp(exponent) if exponent > -12.0 else 0.0
            total += value[k]
        norm = ability[agent] * best * total**width
        smoothed += norm
        exact += ability[agent] * best
        for k in range(length):
            if value[k] > 0.0:
                share[lists.task[agent, k]] += norm * value[k] / total
    return smoothed, exact
