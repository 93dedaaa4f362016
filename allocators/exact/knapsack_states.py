"""The cheapest group for a task by lists of states, for large or real weights; compiled.

Agents are sorted by price per weight; the group that takes them in this order until the need is met is the first state.
Around the last agent taken, the core is extended alternately: each state may drop the next agent before it, or add the
next one after it. A state is discarded if another weighs no less and costs no more, or if the linear relaxation over
all agents outside the core shows that it leads to no cheaper group than the best known. So the time depends on the
number of agents with small reduced costs rather than on the size of the numbers.

References
----------
Pisinger (1997), A minimal algorithm for the 0-1 knapsack problem, doi:10.1287/opre.45.5.758.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray, order_of
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems.instance import FloatArray

MAX_STATES = 100_000
"""Number of states of one knapsack after which it ends with a lower bound by their linear relaxations."""

CHEAPER = 0.5
"""Least improvement for integer prices: less than 1, more than the rounding errors of relaxations."""


class States(NamedTuple):
    """Arrays of states: weight, cost, parent, and the agent that is added or dropped relative to the parent.

    Attributes
    ----------
    weight, cost : ndarray, shape (s,)
    parent, changed : ndarray of int64, shape (s,)
    live, next_live : ndarray of int64, shape (s,)
        States that have not been discarded, by descending weight and cost.
    """

    weight: FloatArray
    cost: FloatArray
    parent: WholeArray
    changed: WholeArray
    live: WholeArray
    next_live: WholeArray


@compiled
def room_for_states(size: int) -> States:
    """Allocate arrays for `size` states."""
    real, whole = np.empty((2, size)), np.empty((4, size), dtype=np.int64)
    return States(real[0], real[1], whole[0], whole[1], whole[2], whole[3])


@compiled
def extend(
    states: States, live: int, used: int, item: int, weight: float, price: float, need: float, best: int,
    before: float, after: float, cheaper: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Branch every live state on changing an item; return the numbers of live and used states, and the best state.

    Parameters
    ----------
    live, used : int
        Number of live states, and of states written.
    item : int
        The agent that is added to the core.
    weight, price : float
        Effect of the change; negative if the agent is dropped.
    best : int
        The cheapest state that meets `need`.
    before, after : float
        Prices per weight of the agents that come next into the core.
    cheaper : float
        Least improvement on the best group.
    """
    kept, p, q = 0, 0, 0
    least = np.inf
    while p < live or q < live:
        unchanged = q == live
        if p < live and q < live:
            a, b = states.live[p], states.live[q]
            heavier = states.weight[a] - states.weight[b] - weight
            unchanged = heavier > 0 or (heavier == 0 and states.cost[a] <= states.cost[b] + price)
        if unchanged:
            state, p = states.live[p], p + 1
            total, cost = states.weight[state], states.cost[state]
        else:
            state, q = states.live[q], q + 1
            total, cost = states.weight[state] + weight, states.cost[state] + price
        if cost >= least:
            continue
        spare = total - need
        is_better = spare >= 0 and cost < states.cost[best]
        if relax_state(cost, spare, before, after) > states.cost[best] - cheaper and not is_better:
            continue
        least = cost
        if not unchanged:
            states.weight[used], states.cost[used], states.parent[used], states.changed[used] = total, cost, state, item
            state, used = used, used + 1
        if is_better:
            best = state
        states.next_live[kept] = state
        kept += 1
    states.live[:kept] = states.next_live[:kept]
    return kept, used, best


@inlined
def relax_state(cost: float, spare: float, before: float, after: float) -> float:
    """Return the value of a state's linear relaxation, given its surplus and the next prices per weight."""
    return cost - spare * before if spare >= 0 else cost - spare * after


@compiled
def cheapest_by_states(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, cheaper: float, states: States,
    group: WholeArray, excess: FloatArray,
) -> float:  # fmt: skip
    """Return the cost of the cheapest group of weight `need` or more; ``inf`` if there is none.

    Parameters
    ----------
    weight : ndarray, shape (k,)
        Contribution of one agent of each class, > 0. If integer, sums up to the need plus one agent are exact.
    price : ndarray, shape (k,)
        >= 0.
    copies : ndarray of int64, shape (k,)
    need : float
        > 0.
    cheaper : float
        `CHEAPER` for integer prices with a sum less than 2^50; otherwise 0.
    states : States
        Scratch. If it is too small, the returned cost is a lower bound on that of the cheapest group.
    group : ndarray of int64, shape (k,)
        Output: the agents of each class in the cheapest group found.
    excess : ndarray, shape (k,) or (0,)
        Output: lower bounds on the extra cost of the best group with an agent of the class.
    """
    ratio = price / weight
    order = order_of(ratio)
    agent = np.repeat(order, copies[order])
    total, paid, taken = 0.0, 0.0, 0
    group[:] = 0
    while total < need:
        if taken == len(agent):
            return np.inf
        k = agent[taken]
        total, paid, taken = total + weight[k], paid + price[k], taken + 1
        group[k] += 1
    rate = ratio[agent[taken - 1]]
    relaxed = paid - (total - need) * rate
    states.weight[0], states.cost[0], states.parent[0], states.live[0] = total, paid, -1, 0
    live, used, best, low, high, bound = 1, 1, 0, taken, taken, np.inf
    while live > 0 and (low > 0 or high < len(agent)):
        for is_after in range(2):
            if low == 0 if is_after == 0 else high == len(agent):
                continue
            before = ratio[agent[low - 1]] if low > 0 else 0.0
            after = ratio[agent[high]] if high < len(agent) else np.inf
            if used + live > len(states.weight):
                for q in range(live):
                    state = states.live[q]
                    bound = min(bound, relax_state(states.cost[state], states.weight[state] - need, before, after))
                live = 0
                break
            item = high if is_after else low - 1
            low, high = low - (1 - is_after), high + is_after
            k, sign = agent[item], 2.0 * is_after - 1.0
            if relaxed + sign * (price[k] - rate * weight[k]) > states.cost[best] - cheaper:
                continue
            before = ratio[agent[low - 1]] if low > 0 else 0.0
            after = ratio[agent[high]] if high < len(agent) else np.inf
            live, used, best = extend(
                states, live, used, item, sign * weight[k], sign * price[k], need, best, before, after, cheaper
            )
    write_group(states, best, agent, taken, group)
    cost: float = states.cost[best]
    if bound < cost:
        cost = np.floor(bound - cheaper) if cheaper > 0 else bound
    for k in range(len(excess)):
        excess[k] = max(price[k] - rate * weight[k], 0.0) - (cost - relaxed)
    return cost


@compiled
def write_group(states: States, state: int, agent: WholeArray, taken: int, group: WholeArray) -> None:
    """Turn `group`, which consists of the first `taken` agents, into the group of a state."""
    while states.parent[state] >= 0:
        item = states.changed[state]
        group[agent[item]] += -1 if item < taken else 1
        state = states.parent[state]
