"""Rounds of an auction in which tasks bid for agents, compiled."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray, IntArray

TOLERANCE = 1e-12
"""Relative part of a need that is forgiven, for what sums of floats may be off."""


class Market(NamedTuple):
    """The goods, what they cost to get, and who has them; the last three are changed in place.

    `origin`, `cost` and `mask` are as in `Reach`, the cost of a flight in place of its distance; `price` and `owner` (a
    task, or -1) are of shape (n,), and `tally` counts rounds, messages and sales, shape (3,).
    """

    ability: FloatArray
    origin: IntArray
    cost: FloatArray
    mask: NDArray[np.bool_]
    price: FloatArray
    owner: IntArray
    tally: IntArray


@compiled
def bid(rounds: int, need: FloatArray, market: Market, increment: float) -> bool:
    """Hold up to `rounds` rounds; return whether every task got what it needs.

    In a round each task that lacks ability bids for the agent that is cheapest for what it lacks, flight and price
    together, and as much as makes it as dear as the second cheapest, and an increment. The agent goes with the highest
    bid. Whom a task can do without it dismisses, and who has no task asks nothing.

    Parameters
    ----------
    need : ndarray, shape (m,)
        Ability that each task needs.
    increment : float
        Least rise of a price, > 0.

    References
    ----------
    Bertsekas (1992), doi:10.1007/BF00247653; there each bidder wants one object.
    """
    n, m = len(market.price), len(need)
    have = np.zeros(m)
    for i in range(n):
        if market.owner[i] >= 0:
            have[market.owner[i]] += market.ability[i]
    offer, bidder = np.zeros(n), np.full(n, -1)
    for _ in range(rounds):
        served = True
        bidder[:] = -1
        for j in range(m):
            if have[j] < need[j] * (1 - TOLERANCE):
                served = False
                i, amount = choose(j, need[j] - have[j], market, increment)
                if i >= 0:
                    market.tally[1] += 1
                    if bidder[i] < 0 or amount > offer[i]:
                        offer[i], bidder[i] = amount, j
        if served:
            return True
        market.tally[0] += 1
        for i in range(n):
            j = bidder[i]
            if j < 0:
                continue
            if market.owner[i] >= 0:
                have[market.owner[i]] -= market.ability[i]
            have[j] += market.ability[i]
            market.owner[i], market.price[i] = j, offer[i]
            market.tally[1] += m  # all tasks hear the price
            market.tally[2] += 1
        for i in range(n):
            j = market.owner[i]
            if j >= 0 and have[j] - market.ability[i] >= need[j] * (1 - TOLERANCE):
                have[j] -= market.ability[i]
                market.owner[i], market.price[i] = -1, 0.0
                market.tally[1] += m
    return False


@compiled
def choose(j: int, lack: float, market: Market, increment: float) -> tuple[int, float]:
    """Return whom task `j` bids for, and how much; -1 where there is nobody."""
    best, second, agent = np.inf, np.inf, -1
    for i in range(len(market.price)):
        row = market.origin[i]
        if market.owner[i] != j and market.mask[row, j]:
            rate = (market.cost[row, j] + market.price[i]) / min(market.ability[i], lack)
            if rate < best:
                best, second, agent = rate, best, i
            elif rate < second:
                second = rate
    if agent < 0:
        return -1, 0.0
    amount = market.price[agent] + increment
    if second < np.inf:
        amount += (second - best) * min(market.ability[agent], lack)
    return agent, amount
