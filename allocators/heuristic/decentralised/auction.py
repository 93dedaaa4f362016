"""A decentralised auction: tasks bid for agents against a deadline, and the agents exchange places afterwards."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised.auction_rounds import Market, bid
from alloc.allocators.heuristic.decentralised.communication import hearing
from alloc.allocators.heuristic.decentralised.hedonic import CHANCE, Game, compile_game, too_many_minds
from alloc.allocators.heuristic.decentralised.hedonic import Parameters as GameParameters
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, Instance, Objective
from alloc.problems.instance import FloatArray

SLICE = 20_000_000
"""Looks of tasks at agents between two looks at the clock; some 40 ms."""


@dataclass(frozen=True)
class Parameters:
    """Of the auction.

    Attributes
    ----------
    patience : int
        Rounds per task after which a deadline counts as too early.
    first : float
        First deadline: relative excess over the lower bound.
    closings : int
        Deadlines that are tried, each half as far from the bound as the best met, or later than the last one missed.
    increment : float
        Least rise of a price, in units of the flight over a mean distance, or of the price of a mean agent.
    chance : float
        Spread of the costs by chance, in the same unit, from the second auction on.
    """

    patience: int = 30
    first: float = 0.05
    closings: int = 8
    increment: float = 0.1
    chance: float = 0.3


class Auction(Allocator):
    """Tasks that lack ability bid for agents, until all have what they need by a deadline.

    Each task has a bidder, say one of its agents; each agent sells itself to the highest bid. Prices rise where several
    tasks want the same agents, as in Bertsekas's auction, but what a task buys is ability, not heads: it bids by the
    price for what it lacks. Deadlines are moved to and fro between the lower bound and the best one met. When no
    earlier one is met, agents exchange places as in the game of `hedonic`, everybody hearing everybody. Where energy
    counts, flights are part of what an agent costs. Then all begins again with costs shaken a little. An iteration is a
    round of bids.

    References
    ----------
    Bertsekas (1992), doi:10.1007/BF00247653; Choi, Brunet and How (2009), doi:10.1109/TRO.2009.2022423, for agents
    that agree on the winner without an auctioneer.
    """

    method = BUILT_IN["auction"]
    parameters = Parameters()

    def __init__(self) -> None:
        compile_game()
        tiny = Instance(ability=[1, 2], workload=[2, 1])
        Sale(Search(tiny, Objective.MAKESPAN, Budget(None, 1)), self.parameters).hold(1.0)

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """The exchanges keep a plan of all for every agent."""
        return too_many_minds(instance)

    def allocate(self, search: Search) -> Proposal:
        """Hold auctions until the search says stop; every improvement has been submitted by then."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        sale = Sale(search, self.parameters)
        game = Game(search, hearing(instance, np.inf), GameParameters())
        notes: list[str] = []
        while True:
            sale.close()
            game.begin(sale.best)
            game.run(CHANCE)
            if not notes:
                notes.append(_report(sale, game, "the first auction"))
            if search.should_stop():
                break
            sale.shake()
        if sale.auctions > 1:
            notes.append(_report(sale, game, f"{sale.auctions} auctions"))
        return Proposal(notes=tuple(notes))


def _report(sale: "Sale", game: Game, what: str) -> str:
    rounds, messages, sales = sale.market.tally.tolist()
    return (
        f"{what} took {rounds} rounds, {sales} sales and {messages} messages; "
        f"the exchanges after that {game.minds.tally[0]} rounds and {game.minds.tally[1]} messages"
    )


class Sale:
    """All agents for sale, and the deadlines that are tried.

    Parameters
    ----------
    search : Search
        Of an instance in which some task has workload.
    parameters : Parameters
    """

    def __init__(self, search: Search, parameters: Parameters) -> None:
        self.search, self.parameters = search, parameters
        instance, reach = search.instance, search.instance.reach
        self.rng = np.random.default_rng(search.seed)
        self.economical = search.objective is Objective.MAKESPAN_ENERGY
        mean = float(reach.distance.mean()) or 1.0
        self.cost: FloatArray = reach.distance / mean if self.economical else np.zeros(reach.distance.shape)
        self.market = Market(
            instance.ability,
            reach.origin,
            self.cost.copy(),
            reach.mask,
            np.zeros(instance.n),
            np.full(instance.n, -1, dtype=np.intp),
            np.zeros(3, dtype=np.intp),
        )
        self.best = Allocation.idle(instance)
        self.auctions = 0

    def shake(self) -> None:
        """Shake what agents cost."""
        self.market.cost[:] = self.cost + self.parameters.chance * self.rng.random(self.cost.shape)

    def close(self) -> None:
        """Try deadlines, and keep the best allocation that meets one, or the last one that met none."""
        self.auctions += 1
        bound = max(self.search.lower_bound, np.finfo(float).tiny)
        excess, met = self.parameters.first, np.inf
        for _ in range(self.parameters.closings):
            if self.search.should_stop():
                break
            if self.hold(bound * (1 + excess)):
                self.best = Allocation(self.market.owner.copy())
                met = max(0.0, self.search.submit(self.best).served_makespan / bound - 1)
                excess = met / 2
            else:
                if met == np.inf:
                    self.best = Allocation(self.market.owner.copy())
                    self.search.submit(self.best)
                excess = 2 * excess + 1e-6 if met == np.inf else (excess + met) / 2
            if met <= 1e-6:
                break

    def hold(self, hours: float) -> bool:
        """Hold an auction for a deadline; return whether every task got what it needs."""
        search, market, parameters = self.search, self.market, self.parameters
        instance = search.instance
        market.owner[:], market.price[:] = -1, 0.0
        with np.errstate(over="ignore"):
            need = np.minimum(instance.workload / hours, np.finfo(float).max)
        left = parameters.patience * instance.m + instance.n
        while left > 0 and not search.should_stop():
            rounds = max(1, min(left, SLICE // (instance.n * instance.m)))
            if search.budget.iterations is not None:
                rounds = min(rounds, search.budget.iterations - search.iteration)
            before = int(market.tally[0])
            served = bid(rounds, need, market, parameters.increment)
            held = int(market.tally[0]) - before
            search.iteration += held
            left -= rounds
            if served:
                return True
        return False
