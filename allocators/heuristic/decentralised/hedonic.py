"""The method `hedonic`: a decentralised coalition-formation game with local communication."""

from typing import ClassVar

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.parameters import with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised.coalition_game import (
    CoalitionGame,
    HedonicParameters,
    compile_game,
    too_many_agents,
)
from alloc.allocators.heuristic.decentralised.communication import communication_graph
from alloc.allocators.heuristic.decentralised.game_rounds import MESSAGES, ROUNDS
from alloc.problems import Allocation, Instance, Objective


class Hedonic(Allocator):
    """GRAPE with abilities in place of head counts, swaps, and further games from the best partition so far.

    Each agent knows the tasks and the abilities in its component of the communication graph, and believes in one
    partition of the component's agents into coalitions. In a round, which is an iteration, it joins the coalition of
    highest utility, or proposes a swap to a neighbour if both tasks together gain from it; it sends the partition, its
    number of changes and a stamp to its neighbours, and adopts the version with the most changes that it receives. The
    utility of a move is the gain of the tasks, so that their total shortfall is a potential of the game, which ends in
    a Nash-stable partition: no agent wants to leave its coalition, alone or by a swap. If energy counts, a second game
    follows in which agents leave, move or swap to save distance without lowering the coverage of a task.

    Differences from the paper: utilities depend on abilities instead of head counts; stamps are not purely random, but
    give precedence to agents of high ability; agents swap; and there are further games, in which a few groups are
    dissolved, and the old partition is kept unless the new one is better. Agents of different components cannot agree:
    each component divides its own ability among all tasks, and a note says so. The end of a game is detected centrally;
    messages that would inform the agents of it are not counted.

    Parameters
    ----------
    parameters : HedonicParameters, optional
    **settings
        Fields of `HedonicParameters`, such as ``communication_radius``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a setting is unknown or out of range.

    References
    ----------
    Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292; for the potential, Monderer and Shapley (1996),
    doi:10.1006/game.1996.0044.
    """

    method = BUILT_IN["hedonic"]
    parameters_type: ClassVar[type] = HedonicParameters

    def __init__(self, parameters: HedonicParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(HedonicParameters, parameters, settings)
        compile_game()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse fleets in which each agent cannot store the plan of all agents."""
        return too_many_agents(instance)

    def allocate(self, search: Search) -> Proposal:
        """Play games until the search should stop, and submit every improvement."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        graph = communication_graph(instance, self.parameters.communication_radius)
        game = CoalitionGame(search, graph, self.parameters)
        game.begin(Allocation.idle(instance) if search.start is None else search.start)
        stable = game.run()
        notes = [_report(game, "the first game" if stable else "the game, cut short,")]
        if graph.n_components > 1:
            notes.append(f"the communication graph has {graph.n_components} components; each played its own game")
        while not search.should_stop():
            game.perturb()
            game.run(self.parameters.stamp_noise)
        if game.games > 1:
            notes.append(_report(game, f"{game.games} games in all"))
        return Proposal(notes=tuple(notes))


def _report(game: CoalitionGame, what: str) -> str:
    counts = game.beliefs.counts
    return f"{what} took {counts[ROUNDS]} rounds and {counts[MESSAGES]} messages"
