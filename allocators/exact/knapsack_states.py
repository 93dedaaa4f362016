"""The cheapest group for a task by lists of states, for weights of any size and for reals; compiled.

Agents are sorted by price per weight, and a group that takes them in this order until the need is met is the first
state. Around the last agent taken, one after the other is left open: each state may do without the next agent before,
or with the next one after. A state is dropped where another weighs no less and costs no more, or where the linear
relaxation of all agents not yet open leaves it no cheaper than the best group known. So the time depends on how many
agents nearly pay, and not on the size of the numbers.

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
"""States of one knapsack after which it ends with a bound by their linear relaxations."""

CHEAPER = 0.5
"""By how much a group must be cheaper where prices are whole: less than 1, more than the rounding of relaxations."""


class States(NamedTuple):
    """Space for states: what each weighs and costs, and the agent that it takes or leaves other than its parent.

    Attributes
    ----------
    weight, cost : ndarray, shape (s,)
    parent, changed : ndarray of int64, shape (s,)
    live, next_live : ndarray of int64, shape (s,)
        States that are still of interest, by falling weight and cost.
    """

    weight: FloatArray
    cost: FloatArray
    parent: WholeArray
    changed: WholeArray
    live: WholeArray
    next_live: WholeArray


@compiled
def room_for_states(size: int) -> States:
    """Return space for so many states."""
    real, whole = np.empty((2, size)), np.empty((4, size), dtype=np.int64)
    return States(real[0], real[1], whole[0], whole[1], whole[2], whole[3])


@compiled
def extend(
    states: States, live: int, used: int, item: int, weight: float, price: float, need: float, best: int,
    before: float, after: float, cheaper: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Give every live state the choice to change an item; return how many live and are used, and the best group.

    Parameters
    ----------
    live, used : int
        How many states live, and how many have been written.
    item : int
        The agent that is left open now.
    weight, price : float
        What the change adds; negative where the agent is left.
    best : int
        The cheapest state that meets `need`.
    before, after : float
        Prices per weight of the agents that are left open next.
    cheaper : float
        By how much a group must be cheaper than the best to be of interest.
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
    """Return the cost of the linear relaxation by what a state has to spare and the next prices per weight."""
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
        What one agent of each class adds, > 0. Where they are whole, sums up to the need and one more agent are exact.
    price : ndarray, shape (k,)
        >= 0.
    copies : ndarray of int64, shape (k,)
    need : float
        > 0.
    cheaper : float
        `CHEAPER` where prices are whole, all together less than 2^50; else 0.
    states : States
        Space to work in. Where it does not suffice, the cost is a lower bound on that of the cheapest group.
    group : ndarray of int64, shape (k,)
        Gets the agents of each class in the cheapest group that was found.
    excess : ndarray, shape (k,) or (0,)
        Gets lower bounds on how much dearer the best group with an agent of the class is.
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
    """Change `group`, which has the first `taken` agents, to that of a state."""
    while states.parent[state] >= 0:
        item = states.changed[state]
        group[agent[item]] += -1 if item < taken else 1
        state = states.parent[state]
