"""A sequence of coalition-formation games, each from the best partition so far with a few groups dissolved."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.decentralised.communication import CommunicationGraph, communication_graph
from alloc.allocators.heuristic.decentralised.game_rounds import ROUNDS, Beliefs, play
from alloc.allocators.heuristic.decentralised.utilities import GameData
from alloc.problems import IDLE, Allocation, Instance, Objective
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, IntArray

MAX_CELLS = 30_000_000
"""Largest value of n (n + m), as each of the n agents stores the plan of all agents."""

EVALUATIONS_PER_SLICE = 500_000
"""Evaluations of a task, neighbour or partner between two checks of the clock: about 2 ms."""

TIE_BREAKING_NOISE = 1e-3
"""Noise on the stamps of the first game, which breaks ties and makes all stamps different."""


@dataclass(frozen=True)
class HedonicParameters(CheckedParameters):
    """Parameters of the coalition-formation game, tuned on the paper's scenarios.

    Attributes
    ----------
    communication_radius : float or None
        Distance up to which agents communicate; None for the communication ranges of the instance.
    partners : int
        Number of neighbours to which an agent may propose a swap, drawn at random if it has more.
    distance_weight : float
        Weight of the mean distance, relative to the shortfall of an unserved task, if energy counts or the
        communication graph is disconnected.
    stamp_noise : float
        Noise on the precedence of agents, from the second game on.
    most_dissolved : int
        From 2 to this number of groups are dissolved before the next game.
    """

    communication_radius: float | None = bounded(None, low=0, infinite=True)
    partners: int = bounded(64, low=0)
    distance_weight: float = bounded(8.0, low=0)
    stamp_noise: float = bounded(0.5, low=0)
    most_dissolved: int = bounded(4, low=2)


def too_many_agents(instance: Instance) -> str | None:
    """Return why each agent cannot store the plan of all agents, None if it can."""
    if instance.n * (instance.n + instance.m) > MAX_CELLS:
        return f"each of {instance.n} agents would store the plan of all; at most about {int(MAX_CELLS**0.5)} can"
    return None


class CoalitionGame:
    """The agents with their beliefs, which play one game after another.

    Parameters
    ----------
    search : Search
        A run on an instance with at least one task that has workload.
    graph : CommunicationGraph
    parameters : HedonicParameters

    Attributes
    ----------
    beliefs : Beliefs
    games : int
        Number of games played so far.
    """

    def __init__(self, search: Search, graph: CommunicationGraph, parameters: HedonicParameters) -> None:
        self.search, self.graph, self.parameters = search, graph, parameters
        self.rng = np.random.default_rng(search.seed)
        self.energy_counts = search.objective is Objective.MAKESPAN_ENERGY
        instance = search.instance
        self.data = _game_data(instance, graph, parameters.partners, self.rng)
        self.beliefs = _empty_beliefs(instance.n, instance.m)
        ability = np.bincount(graph.component, weights=instance.ability)
        self.target: FloatArray = (ability / instance.workload.sum())[graph.component]
        distance_counts = self.energy_counts or graph.n_components > 1
        mean = float(instance.reach.cost[:, instance.workload > 0].mean())
        self.distance_weight = parameters.distance_weight / mean if distance_counts and mean > 0 else 0.0
        self.games = 0

    def begin(self, allocation: Allocation) -> None:
        """Set the beliefs of every agent to `allocation` for its own component, with all other agents idle."""
        instance, beliefs, task = self.search.instance, self.beliefs, allocation.task_of_agent
        task = np.where(instance.workload[task] > 0, task, IDLE)  # a task without workload needs no agent
        for number in range(self.graph.n_components):
            own = np.where(self.graph.component == number, task, IDLE)
            busy = own != IDLE
            group = np.bincount(own[busy], weights=instance.ability[busy], minlength=instance.m)
            beliefs.plans[number] = own
            beliefs.coverages[number] = np.inf
            np.divide(group, instance.workload, out=beliefs.coverages[number], where=instance.workload > 0)
        beliefs.version[:] = self.graph.component
        beliefs.is_content[:], beliefs.is_news[:] = False, False

    def run(self, stamp_noise: float = TIE_BREAKING_NOISE) -> bool:
        """Play until no agent wants a change, and submit the result; return whether a stable partition was reached."""
        self.games += 1
        stable = self._play(self.target, False, stamp_noise)
        score, limit = self.search.submit(self.allocation), self.search.makespan_limit
        in_time = not score.unserved_tasks and 0 < score.served_makespan <= last_equal(limit)
        if stable and self.energy_counts and in_time:
            self.beliefs.is_content[:] = False
            connected = self.graph.n_components == 1
            floor = np.full_like(self.target, 1 / limit) if connected else self.target
            stable = self._play(floor, True, stamp_noise)
            self.search.submit(self.allocation)
        return stable

    def perturb(self) -> None:
        """Return to the best partition, and dissolve a few groups: neighbouring ones if energy counts, else any."""
        instance, rng, best = self.search.instance, self.rng, self.search.best
        assert best is not None
        order = rng.random(instance.m)
        position = instance.task_position
        if self.energy_counts and not np.isnan(position).any():
            order *= np.linalg.norm(position - position[rng.integers(instance.m)], axis=1)
        elif rng.random() < 0.5:
            order[best.evaluation.completion_time.argmax()] = -1.0
        dissolved = np.argsort(order)[: int(rng.integers(2, self.parameters.most_dissolved + 1))]
        task = best.allocation.task_of_agent.copy()
        task[np.isin(task, dissolved)] = IDLE
        self.begin(Allocation(task))

    @property
    def allocation(self) -> Allocation:
        """The allocation in which every agent has the task that it believes it has."""
        version = self.beliefs.version
        return Allocation(self.beliefs.plans[version, np.arange(len(version))].astype(np.intp))

    def _play(self, target: FloatArray, saving: bool, stamp_noise: float) -> bool:
        """Play in slices; return whether the game ended."""
        search, data, counts = self.search, self.data, self.beliefs.counts
        noise = self.rng.random(max(4096, 2 * search.instance.n))
        evaluations = search.instance.n * (search.instance.m + 8) + len(data.partner) + len(data.neighbour)
        over = False
        while not over and not search.should_stop():
            rounds = max(1, EVALUATIONS_PER_SLICE // evaluations)
            if search.budget.iterations is not None:
                rounds = min(rounds, search.budget.iterations - search.iteration)
            before = int(counts[ROUNDS])
            over = play(rounds, data, self.beliefs, target, saving, self.distance_weight, stamp_noise, noise)
            search.iteration += int(counts[ROUNDS]) - before
        return over


def _game_data(instance: Instance, graph: CommunicationGraph, partners: int, rng: np.random.Generator) -> GameData:
    reach = instance.reach
    partner_begin, partner = _draw_partners(graph, partners, rng)
    return GameData(
        ability=instance.ability,
        origin=reach.origin,
        cost=reach.cost,
        mask=reach.mask,
        workload=instance.workload,
        neighbour_begin=graph.begin,
        neighbour=graph.neighbour,
        is_complete=graph.is_complete,
        partner_begin=partner_begin,
        partner=partner,
        largest_ability=float(instance.ability.max()),
    )


def _empty_beliefs(n: int, m: int) -> Beliefs:
    return Beliefs(
        version=np.zeros(n, dtype=np.intp),
        n_changes=np.zeros(n, dtype=np.intp),
        stamp=np.zeros(n),
        is_content=np.zeros(n, dtype=bool),
        is_news=np.zeros(n, dtype=bool),
        plans=np.empty((2 * n, n), dtype=np.int32),
        coverages=np.empty((2 * n, m)),
        counts=np.zeros(3, np.intp),
    )


def _draw_partners(graph: CommunicationGraph, most: int, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Draw up to `most` neighbours of each agent; return the index where those of each begin, and all of them."""
    n = len(graph.component)
    drawn = [_sample(n - 1 if graph.is_complete else int(graph.degree[i]), most, rng) for i in range(n)]
    for i, chosen in enumerate(drawn):
        drawn[i] = chosen + (chosen >= i) if graph.is_complete else graph.neighbour[graph.begin[i] + chosen]
    begin = np.concatenate([[0], np.cumsum([len(chosen) for chosen in drawn])])
    return begin.astype(np.intp), np.concatenate(drawn).astype(np.intp)


def _sample(count: int, most: int, rng: np.random.Generator) -> IntArray:
    return np.arange(count) if count <= most else rng.choice(count, most, replace=False)


def compile_game() -> None:
    """Compile the loops of the game, or load them from the cache, before the clock starts."""
    instance = Instance(ability=[1, 2], workload=[2, 1])
    search = Search(instance, Objective.MAKESPAN, Budget(None, 1))
    game = CoalitionGame(search, communication_graph(instance), HedonicParameters())
    game.begin(Allocation.idle(instance))
    game.run()
