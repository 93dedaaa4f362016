"""A series of auctions, whose deadline is moved between the lower bound and the best makespan met."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised.auction_rounds import ROUNDS, Market, run_rounds
from alloc.problems import Allocation, Objective
from alloc.problems.instance import FloatArray

EVALUATIONS_PER_SLICE = 2_000_000
"""Evaluations of an agent by a task between two checks of the clock: a few milliseconds."""

CLOSE = 1e-6
"""Relative excess over the lower bound up to which no earlier deadline is tried."""


@dataclass(frozen=True)
class AuctionParameters(CheckedParameters):
    """Parameters of the auction.

    Attributes
    ----------
    patience : int
        Rounds per task after which a deadline counts as too early.
    first_excess : float
        Relative excess of the first deadline over the lower bound.
    deadlines : int
        Number of deadlines that are tried: each is half as far from the bound as the best one met, or later than one
        that was missed.
    increment : float
        Least increase of a price, in units of the mean distance, or of the price of an average agent.
    cost_noise : float
        Largest noise on costs, in the same unit, from the second series on.
    """

    patience: int = bounded(30, low=1)
    first_excess: float = bounded(0.05, low=0)
    deadlines: int = bounded(8, low=1)
    increment: float = bounded(0.1, low=0, above=True)
    cost_noise: float = bounded(0.3, low=0)


class DeadlineSeries:
    """A series of auctions of all agents, one for each deadline.

    Parameters
    ----------
    search : Search
        A run on an instance with at least one task that has workload.
    parameters : AuctionParameters

    Attributes
    ----------
    best : Allocation
        Allocation for the earliest deadline met in the last series, or the last allocation if none was met.
    count : int
        Number of series so far.
    """

    def __init__(self, search: Search, parameters: AuctionParameters) -> None:
        self.search, self.parameters = search, parameters
        instance, reach = search.instance, search.instance.reach
        self.rng = np.random.default_rng(search.seed)
        energy_counts = search.objective is Objective.MAKESPAN_ENERGY
        mean = float(reach.cost.mean()) or 1.0
        self.cost: FloatArray = reach.cost / mean if energy_counts else np.zeros(reach.distance.shape)
        self.market = Market(
            ability=instance.ability,
            origin=reach.origin,
            cost=self.cost.copy(),
            mask=reach.mask,
            price=np.zeros(instance.n),
            owner=np.full(instance.n, -1, dtype=np.intp),
            counts=np.zeros(3, dtype=np.intp),
        )
        self.best = Allocation.idle(instance)
        self.count = 0

    def perturb(self) -> None:
        """Add noise to the costs."""
        self.market.cost[:] = self.cost + self.parameters.cost_noise * self.rng.random(self.cost.shape)

    def run(self) -> None:
        """Try deadlines, and keep the best allocation that meets one, or the last allocation if none is met."""
        self.count += 1
        bound = max(self.search.lower_bound, np.finfo(float).tiny)
        excess, met = self.parameters.first_excess, np.inf
        for _ in range(self.parameters.deadlines):
            if self.search.should_stop():
                break
            if self.meet(bound * (1 + excess)):
                self.best = Allocation(self.market.owner.copy())
                met = max(0.0, self.search.submit(self.best).served_makespan / bound - 1)
                excess = met / 2
            else:
                if met == np.inf:
                    self.best = Allocation(self.market.owner.copy())
                    self.search.submit(self.best)
                excess = 2 * excess + CLOSE if met == np.inf else (excess + met) / 2
            if met <= CLOSE:
                break

    def meet(self, deadline: float) -> bool:
        """Run an auction for a deadline in hours; return whether the demand of every task was met."""
        search, market, parameters = self.search, self.market, self.parameters
        instance = search.instance
        market.owner[:], market.price[:] = -1, 0.0
        with np.errstate(over="ignore"):
            demand = np.minimum(instance.workload / deadline, np.finfo(float).max)
        left = parameters.patience * instance.m + instance.n
        while left > 0 and not search.should_stop():
            rounds = max(1, min(left, EVALUATIONS_PER_SLICE // (instance.n * instance.m)))
            if search.budget.iterations is not None:
                rounds = min(rounds, search.budget.iterations - search.iteration)
            before = int(market.counts[ROUNDS])
            served = run_rounds(rounds, demand, market, parameters.increment)
            search.iteration += int(market.counts[ROUNDS]) - before
            left -= rounds
            if served:
                return True
        return False
