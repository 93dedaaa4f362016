"""A decentralised coalition-formation game: agents join, leave and exchange on what they and their neighbours know."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised.communication import Hearing, hearing
from alloc.allocators.heuristic.decentralised.hedonic_game import Minds, World, play
from alloc.allocators.registry import BUILT_IN
from alloc.problems import IDLE, Allocation, Instance, Objective
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, IntArray

MOST_CELLS = 30_000_000
"""Most agents times agents and tasks; a plan of all is kept for each."""

SLICE = 20_000_000
"""Looks at a task, neighbour or partner between two looks at the clock; some 40 ms."""

CHANCE = 1e-3
"""Say of chance in who goes first in the first game: it decides between equals, and no two stamps are the same."""


@dataclass(frozen=True)
class Parameters:
    """Of the coalition-formation game; chosen on the paper's scenarios.

    Attributes
    ----------
    partners : int
        Neighbours that an agent may offer an exchange to, drawn at random where it has more.
    thrift : float
        Weight of a mean distance against a task that lacks everything, where energy counts or not all hear each other.
    jitter : float
        Say of chance in who goes first, from the second game on.
    upset : int
        Most groups that are dissolved before the next game; at least two are.
    """

    partners: int = 64
    thrift: float = 8.0
    jitter: float = 0.5
    upset: int = 3


class Hedonic(Allocator):
    """GRAPE with abilities in place of head counts, exchanges, and further games from the best partition reached.

    Each agent knows the tasks, the abilities of those that it can hear of, and one partition of them into coalitions.
    In a round, which is an iteration, it joins the coalition where it is needed most, or offers a neighbour to change
    places where both tasks together gain by it; it tells its neighbours the partition, how often that was changed, and
    a stamp, and takes over the one among those it hears that was changed most often. What a move is worth to an agent
    is what it is worth to the tasks, so that the lack of all tasks is a potential of the game, and it ends with a
    partition that nobody wants to leave alone or by an exchange (Nash-stable). Where energy counts, a second game
    follows in which agents leave, move or exchange to fly less while no task falls back.

    What is not as in the paper: coalitions are worth what their abilities are, not their heads; stamps are not plain
    chance, but let who is able go first; exchanges; and further games, in which a few groups are dissolved and the old
    partition stands unless the new one is better. Who never hears of each other, over whatever way, cannot agree: each
    connected part then shares its own ability out among all tasks, as a note tells. That a game is over is seen from
    outside; messages that would tell agents so are not counted.

    Parameters
    ----------
    hearing : float, optional
        Distance up to which agents hear each other, instead of their communication ranges.

    References
    ----------
    Jang, Shin and Tsourdos (2018), doi:10.1109/TRO.2018.2858292; for the potential, Monderer and Shapley (1996),
    doi:10.1006/game.1996.0044.
    """

    method = BUILT_IN["hedonic"]
    parameters = Parameters()

    def __init__(self, hearing: float | None = None) -> None:
        self.hearing = hearing
        compile_game()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Every agent keeps what it knows of all others."""
        return too_many_minds(instance)

    def allocate(self, search: Search) -> Proposal:
        """Play until the search says stop; every improvement has been submitted by then."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        game = Game(search, hearing(instance, self.hearing), self.parameters)
        game.begin(Allocation.idle(instance) if search.start is None else search.start)
        stable = game.run(CHANCE)
        notes = [_report(game.minds.tally, "the first game" if stable else "the game, cut short,")]
        if game.graph.parts > 1:
            notes.append(f"{game.graph.parts} parts of the agents cannot hear each other; each played for itself")
        while not search.should_stop():
            game.upset()
            game.run(self.parameters.jitter)
        if game.games > 1:
            notes.append(_report(game.minds.tally, f"{game.games} games in all"))
        return Proposal(notes=tuple(notes))


def too_many_minds(instance: Instance) -> str | None:
    """Say why so many agents cannot each keep a plan of all, None if they can."""
    if instance.n * (instance.n + instance.m) > MOST_CELLS:
        return f"each of {instance.n} agents would keep a plan of all; some {int(MOST_CELLS**0.5)} are the most"
    return None


def _report(tally: IntArray, what: str) -> str:
    rounds, messages, _ = tally.tolist()
    return f"{what} took {rounds} rounds and {messages} messages"


class Game:
    """All agents with what they know; plays games one after the other.

    Parameters
    ----------
    search : Search
        Of an instance in which some task has workload.
    graph : Hearing
    parameters : Parameters
    """

    def __init__(self, search: Search, graph: Hearing, parameters: Parameters) -> None:
        self.search, self.graph, self.parameters = search, graph, parameters
        self.rng = np.random.default_rng(search.seed)
        self.economical = search.objective is Objective.MAKESPAN_ENERGY
        instance = search.instance
        n, m, reach = instance.n, instance.m, instance.reach
        first, partner = _partners(graph, parameters.partners, self.rng)
        self.world = World(
            instance.ability,
            reach.origin,
            reach.distance,
            reach.mask,
            instance.workload,
            graph.first,
            graph.neighbour,
            graph.everybody,
            first,
            partner,
            float(instance.ability.max()),
        )
        flags = np.zeros((2, n), dtype=bool)
        numbers = np.zeros((2, n), dtype=np.intp)
        versions = np.empty((2 * n, n), dtype=np.int32), np.empty((2 * n, m))
        self.minds = Minds(numbers[0], numbers[1], np.zeros(n), flags[0], flags[1], *versions, np.zeros(3, np.intp))
        per_part = np.bincount(graph.part, weights=instance.ability)
        self.aim: FloatArray = (per_part / instance.workload.sum())[graph.part]
        weighs = self.economical or graph.parts > 1
        mean = float(reach.distance[:, instance.workload > 0].mean())
        self.thrift = parameters.thrift / mean if weighs and mean > 0 else 0.0
        self.games = 0

    def begin(self, allocation: Allocation) -> None:
        """Let every agent know what `allocation` says of its part of the graph, and nothing of the others."""
        instance, minds, task = self.search.instance, self.minds, allocation.task_of_agent
        task = np.where(instance.workload[task] > 0, task, IDLE)  # nobody is needed where there is nothing to do
        for number in range(self.graph.parts):
            own = np.where(self.graph.part == number, task, IDLE)
            at = own != IDLE
            group = np.bincount(own[at], weights=instance.ability[at], minlength=instance.m)
            minds.plans[number] = own
            minds.covers[number] = np.inf
            np.divide(group, instance.workload, out=minds.covers[number], where=instance.workload > 0)
        minds.knows[:] = self.graph.part
        minds.settled[:], minds.fresh[:] = False, False

    def run(self, jitter: float) -> bool:
        """Play until nobody wants a change, and submit what came out; return whether it came that far."""
        self.games += 1
        stable = self._play(self.aim, False, jitter)
        score, limit = self.search.submit(self.allocation), self.search.makespan_limit
        close = not score.unserved_tasks and 0 < score.served_makespan <= last_equal(limit)
        if stable and self.economical and close:
            self.minds.settled[:] = False
            floor = np.full_like(self.aim, 1 / limit) if self.graph.parts == 1 else self.aim
            stable = self._play(floor, True, jitter)
            self.search.submit(self.allocation)
        return stable

    def upset(self) -> None:
        """Go back to the best partition, and dissolve a few groups: near ones where energy counts, else any."""
        instance, rng, best = self.search.instance, self.rng, self.search.best
        assert best is not None
        order = rng.random(instance.m)
        place = instance.task_position
        if self.economical and not np.isnan(place).any():
            order *= np.linalg.norm(place - place[rng.integers(instance.m)], axis=1)
        elif rng.random() < 0.5:
            order[best.evaluation.completion_time.argmax()] = -1.0
        dissolved = np.argsort(order)[: int(rng.integers(2, self.parameters.upset + 2))]
        task = best.allocation.task_of_agent.copy()
        task[np.isin(task, dissolved)] = IDLE
        self.begin(Allocation(task))

    @property
    def allocation(self) -> Allocation:
        """Every agent where it thinks that it is."""
        knows = self.minds.knows
        return Allocation(self.minds.plans[knows, np.arange(len(knows))].astype(np.intp))

    def _play(self, aim: FloatArray, saving: bool, jitter: float) -> bool:
        """Play in slices; return whether the game came to its end."""
        search, world, tally = self.search, self.world, self.minds.tally
        noise = self.rng.random(max(4096, 2 * search.instance.n))
        looks = search.instance.n * (search.instance.m + 8) + len(world.partner) + len(world.neighbour)
        over = False
        while not over and not search.should_stop():
            rounds = max(1, SLICE // looks)
            if search.budget.iterations is not None:
                rounds = min(rounds, search.budget.iterations - search.iteration)
            before = int(tally[0])
            over = play(rounds, world, self.minds, aim, saving, self.thrift, jitter, noise)
            search.iteration += int(tally[0]) - before
        return over


def _partners(graph: Hearing, most: int, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Draw up to `most` neighbours of each agent; return where those of each begin, and all of them."""
    n = len(graph.part)
    some = [_sample(n - 1 if graph.everybody else int(graph.degree[i]), most, rng) for i in range(n)]
    for i, chosen in enumerate(some):
        some[i] = chosen + (chosen >= i) if graph.everybody else graph.neighbour[graph.first[i] + chosen]
    first = np.concatenate([[0], np.cumsum([len(chosen) for chosen in some])])
    return first.astype(np.intp), np.concatenate(some).astype(np.intp)


def _sample(count: int, most: int, rng: np.random.Generator) -> IntArray:
    return np.arange(count) if count <= most else rng.choice(count, most, replace=False)


def compile_game() -> None:
    """Compile the loops of the game, or read them from their cache, before a clock runs."""
    instance = Instance(ability=[1, 2], workload=[2, 1])
    game = Game(Search(instance, Objective.MAKESPAN, Budget(None, 1)), hearing(instance), Parameters())
    game.begin(Allocation.idle(instance))
    game.run(CHANCE)
