"""Compiled rounds of an auction in which tasks bid for agents."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray, IntArray

TOLERANCE = 1e-12
"""Relative tolerance on demands, against rounding errors of sums."""

ROUNDS, MESSAGES, SALES = 0, 1, 2
"""Entries of `Market.counts`."""


class Market(NamedTuple):
    """Agents with their costs, prices and owners; the last three fields are changed in place.

    Attributes
    ----------
    ability : ndarray, shape (n,)
    origin : ndarray of int, shape (n,)
        Row of each agent in `cost` and `mask`, as in `Reach`.
    cost : ndarray, shape (origins, m)
        Cost of each agent on each task besides its price.
    mask : ndarray of bool, shape (origins, m)
    price : ndarray, shape (n,)
    owner : ndarray of int, shape (n,)
        Task that owns each agent, or -1.
    counts : ndarray of int, shape (3,)
        Rounds, messages and sales so far.
    """

    ability: FloatArray
    origin: IntArray
    cost: FloatArray
    mask: NDArray[np.bool_]
    price: FloatArray
    owner: IntArray
    counts: IntArray


@compiled
def run_rounds(rounds: int, demand: FloatArray, market: Market, increment: float) -> bool:
    """Run up to `rounds` rounds; return whether the demand of every task is met.

    In a round, each task with a shortfall bids for the agent with the least sum of cost and price per unit of missing
    ability. The bid raises the price to where the agent is as expensive as the second cheapest, plus an increment. The
    agent goes to the highest bidder. Agents that a task does not need are released, and their price becomes 0.

    Parameters
    ----------
    demand : ndarray, shape (m,)
        Ability that each task needs.
    increment : float
        Least increase of a price, > 0.

    References
    ----------
    Bertsekas (1992), doi:10.1007/BF00247653, in which each bidder wants one object.
    """
    n, m = len(market.price), len(demand)
    group_ability = np.zeros(m)
    for i in range(n):
        if market.owner[i] >= 0:
            group_ability[market.owner[i]] += market.ability[i]
    offer, bidder = np.zeros(n), np.full(n, -1)
    for _ in range(rounds):
        if not collect_bids(demand, group_ability, offer, bidder, market, increment):
            return True
        market.counts[ROUNDS] += 1
        for i in range(n):
            j = bidder[i]
            if j < 0:
                continue
            if market.owner[i] >= 0:
                group_ability[market.owner[i]] -= market.ability[i]
            group_ability[j] += market.ability[i]
            market.owner[i], market.price[i] = j, offer[i]
            market.counts[MESSAGES] += m  # the price is announced to all tasks
            market.counts[SALES] += 1
        for i in range(n):
            j = market.owner[i]
            if j >= 0 and group_ability[j] - market.ability[i] >= demand[j] * (1 - TOLERANCE):
                group_ability[j] -= market.ability[i]
                market.owner[i], market.price[i] = -1, 0.0
                market.counts[MESSAGES] += m
    return False


@compiled
def collect_bids(
    demand: FloatArray, group_ability: FloatArray, offer: FloatArray, bidder: IntArray, market: Market, increment: float
) -> bool:
    """Write the highest bid for each agent and its bidder (-1 for none); return whether any task has a shortfall."""
    any_short = False
    bidder[:] = -1
    for j in range(len(demand)):
        if group_ability[j] < demand[j] * (1 - TOLERANCE):
            any_short = True
            i, amount = choose_agent(j, demand[j] - group_ability[j], market, increment)
            if i >= 0:
                market.counts[MESSAGES] += 1
                if bidder[i] < 0 or amount > offer[i]:
                    offer[i], bidder[i] = amount, j
    return any_short


@compiled
def choose_agent(j: int, shortfall: float, market: Market, increment: float) -> tuple[int, float]:
    """Return the agent that task `j` bids for, -1 for none, and the bid."""
    best, second, agent = np.inf, np.inf, -1
    for i in range(len(market.price)):
        row = market.origin[i]
        if market.owner[i] != j and market.mask[row, j]:
            rate = (market.cost[row, j] + market.price[i]) / min(market.ability[i], shortfall)
            if rate < best:
                best, second, agent = rate, best, i
            elif rate < second:
                second = rate
    if agent < 0:
        return -1, 0.0
    amount = market.price[agent] + increment
    if second < np.inf:
        amount += (second - best) * min(market.ability[agent], shortfall)
    return agent, amount
