"""The method `auction`: tasks bid for agents to meet a deadline; afterwards agents swap tasks."""

from typing import ClassVar

import numpy as np

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.parameters import with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised import auction_rounds, game_rounds
from alloc.allocators.heuristic.decentralised.coalition_game import (
    CoalitionGame,
    HedonicParameters,
    compile_game,
    too_many_agents,
)
from alloc.allocators.heuristic.decentralised.communication import communication_graph
from alloc.allocators.heuristic.decentralised.deadlines import AuctionParameters, DeadlineSeries
from alloc.problems import Allocation, Instance, Objective


class Auction(Allocator):
    """An auction in which tasks with a shortfall bid for agents until the demands for a deadline are met.

    Each task has a bidder, such as one of its agents; each agent goes to the highest bidder. Prices rise if several
    tasks compete for the same agents, as in Bertsekas's auction, but tasks buy ability instead of agents: a bid depends
    on the price per unit of missing ability. The deadline is moved between the lower bound and the earliest one met.
    When no earlier one can be met, agents move and swap as in the game of `hedonic`, on a complete communication graph.
    If energy counts, distances are part of an agent's cost. All of this is then repeated with noise on the costs. An
    iteration is a round of bids.

    Parameters
    ----------
    parameters : AuctionParameters, optional
    **settings
        Fields of `AuctionParameters`, such as ``deadlines``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a setting is unknown or out of range.

    References
    ----------
    Bertsekas (1992), doi:10.1007/BF00247653; Choi, Brunet and How (2009), doi:10.1109/TRO.2009.2022423, for consensus
    on the winner without an auctioneer.
    """

    method = BUILT_IN["auction"]
    parameters_type: ClassVar[type] = AuctionParameters

    def __init__(self, parameters: AuctionParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(AuctionParameters, parameters, settings)
        compile_game()
        tiny = Instance(ability=[1, 2], workload=[2, 1])
        DeadlineSeries(Search(tiny, Objective.MAKESPAN, Budget(None, 1)), self.parameters).meet(1.0)

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse fleets in which each agent cannot store the plan of all agents, as the game requires."""
        return too_many_agents(instance)

    def allocate(self, search: Search) -> Proposal:
        """Run auctions until the search should stop, and submit every improvement."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        auctions = DeadlineSeries(search, self.parameters)
        game = CoalitionGame(search, communication_graph(instance, np.inf), HedonicParameters())
        notes: list[str] = []
        while True:
            auctions.run()
            game.begin(auctions.best)
            game.run()
            if not notes:
                notes.append(_report(auctions, game, "the first auction"))
            if search.should_stop():
                break
            auctions.perturb()
        if auctions.count > 1:
            notes.append(_report(auctions, game, f"{auctions.count} auctions"))
        return Proposal(notes=tuple(notes))


def _report(auctions: DeadlineSeries, game: CoalitionGame, what: str) -> str:
    bids, moves = auctions.market.counts, game.beliefs.counts
    return (
        f"{what} took {bids[auction_rounds.ROUNDS]} rounds, {bids[auction_rounds.SALES]} sales and "
        f"{bids[auction_rounds.MESSAGES]} messages; the exchanges after that {moves[game_rounds.ROUNDS]} rounds and "
        f"{moves[game_rounds.MESSAGES]} messages"
    )
