"""Planning with a policy: games on the whole instance, then on regions of it until the budget ends."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from functools import cached_property

import numpy as np
import scipy.optimize
import scipy.sparse.csgraph  # noqa: F401 - bounds and matchings load both: loaded here, that takes no time of a run
import torch
from numpy.typing import NDArray

from alloc.allocators.contract.search import Search
from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.allocators.learned.play.limits import NEAR
from alloc.allocators.learned.play.rollout import Best, position
from alloc.allocators.learned.search.fine_tuning import FineTuning
from alloc.allocators.learned.search.regions import partition, reach_graph
from alloc.allocators.learned.search.target_makespan import TargetMakespan
from alloc.allocators.parallel.pool import RunAll, thread_map
from alloc.problems import IDLE, Allocation, Objective, serve_all
from alloc.problems.game import Board, at_slot, make_board, reset
from alloc.problems.game.candidates import Candidates, candidate_tasks
from alloc.problems.game.regions import Regions, lay_out_regions

Ints = NDArray[np.int64]

STREAMS = 2
"""Number of batches of games played concurrently, in as many threads if these are available."""

WHOLE_ROUNDS = 16
"""Maximum number of rounds of a game on the whole instance, to which twice the mean number of agents per task, or the
number that the largest task needs, is added."""

SECOND_GAME = 0.15
"""Share of the budget after which no second game on the whole instance is started."""


@dataclass(frozen=True)
class PlannerParameters:
    """Parameters of planning with a policy.

    Attributes
    ----------
    near : int
        Candidates per agent in games on the whole instance.
    pairs_per_stream : int
        Pairs of agent and candidate in the games of a stream.
    games_per_region : int
        Maximum number of games on one region in a stream.
    region_tasks : (int, int)
        Minimum and maximum number of tasks of a region.
    extra_tasks, random_share : int, float
        Number of additional tasks of regions at full stagnation, and share of regions with random tasks at that point.
    rounds : int
        Maximum number of rounds of a game on a region; more games are better than more rounds.
    restart_share : float
        Share of the games on regions in which all agents start at the nearest task.
    moved : (float, float)
        Minimum and maximum probability that an agent starts at the nearest task in the other games, instead of at its
        task in the plan.
    scattered_share : float
        Share of the streams in which agents start at a random candidate instead of the nearest task.
    scattered : (float, float)
        Minimum and maximum probability that an agent does so.
    temperature : (float, float)
        Minimum and maximum temperature of scores in games on regions.
    patience : int
        Number of sweeps over all regions without success after which the target makespan is raised; see
        `TargetMakespan`.
    makespan_share : float
        Share of the budget after which games are for energy, if it counts, even if the makespan may not be minimal.
    first_energy_weight, second_energy_weight : float
        Weight of energy in the first game, which gives the first answer, and in the second game, from which games on
        regions start if energy counts, as repairing a shortfall is easier than saving energy.
    """

    near: int = NEAR
    pairs_per_stream: int = 4_000
    games_per_region: int = 64
    region_tasks: tuple[int, int] = (2, 5)
    extra_tasks: int = 3
    random_share: float = 0.5
    rounds: int = 8
    restart_share: float = 0.3
    moved: tuple[float, float] = (0.2, 0.9)
    scattered_share: float = 0.1
    scattered: tuple[float, float] = (0.05, 0.4)
    temperature: tuple[float, float] = (0.4, 0.9)
    patience: int = 20
    makespan_share: float = 0.6
    first_energy_weight: float = 0.8
    second_energy_weight: float = 3.0


ENERGY_WEIGHTS = {Objective.MAKESPAN: (0.2, 0.8), Objective.MAKESPAN_ENERGY: (0.6, 3.0)}
"""Minimum and maximum weight of energy in games on regions."""


class Planner:
    """A run of one or more policies on an instance.

    Parameters
    ----------
    search : Search
    networks : sequence of ActorCritic
        The networks, best first.
    parameters : PlannerParameters, optional
    tuning : FineTuning, optional
        Fine-tunes the networks between sweeps.
    """

    def __init__(
        self,
        search: Search,
        networks: Sequence[ActorCritic],
        parameters: PlannerParameters | None = None,
        tuning: FineTuning | None = None,
    ) -> None:
        self.search, self.networks = search, networks
        self.parameters = parameters or PlannerParameters()
        self.tuning = tuning
        self.run_all: RunAll = map
        self.rng = np.random.default_rng(search.seed)
        self.instance = search.instance
        self.target = TargetMakespan(search, self.instance, self.parameters.patience, self.parameters.makespan_share)
        self.plan = np.full(search.instance.n, IDLE)

    def run(self) -> None:
        """Play until the budget ends, and submit every improvement."""
        self.play_whole(self.parameters.first_energy_weight)
        if not (self.instance.workload > 0).any():
            return
        if self.search.objective is Objective.MAKESPAN_ENERGY and self.target.spent < SECOND_GAME:
            self.play_whole(self.parameters.second_energy_weight)
        threads = min(self.search.threads, STREAMS)
        with self.search.improving("playing on regions"), thread_map(threads) as self.run_all:
            while not self.search.should_stop():
                self._sweep()
                self.search.iteration += 1

    def play_whole(self, energy_weight: float) -> None:
        """Play one greedy game on the whole instance, and continue from its best plan."""
        search, instance = self.search, self.instance
        plan = None if search.start is None else search.start.task_of_agent
        board = make_board(
            [instance], [self.target.hours], [energy_weight], self.rng, near=self.parameters.near, plan=plan
        )
        games = Games(np.zeros(1, dtype=np.int64), board.energy_weight.numpy(), board.start.numpy())
        rounds = WHOLE_ROUNDS + max(2 * instance.n // instance.m, most_helpers(board))
        best = play_games(self.networks[0], board, games, rounds=rounds, should_stop=self._late)
        place = at_slot(board.candidates, best.slot)[0].numpy()
        self._continue_from(np.where(place == instance.m, IDLE, place))

    def _late(self) -> bool:
        """Return whether a game must stop; if there is no plan yet, only at the time limit or on a stop request."""
        search = self.search
        return search.should_stop() if search.best is not None else search.interrupted or search.remaining_s <= 0

    def _continue_from(self, plan: Ints) -> None:
        """Submit a plan that serves as many tasks as possible, and make it the current one."""
        allocation = Allocation(plan)
        if not np.isin(np.flatnonzero(self.instance.workload > 0), plan).all():
            allocation = serve_all(self.instance, allocation)
        self.search.submit(allocation)
        self.plan = allocation.task_of_agent

    def _sweep(self) -> None:
        """Partition the tasks into regions, play many games on each, and keep improvements."""
        search, target = self.search, self.target
        assert search.best is not None
        if target.update(self.plan):
            self.plan = search.best.allocation.task_of_agent
        surplus = target.surplus(self.plan)
        target.record(surplus)
        tasks, agents = self._partition(surplus)
        regions = lay_out_regions(self.instance, target.hours, self.plan, tasks, agents)
        if self.tuning is not None and self.tuning.is_due():
            self._learn(self.tuning, regions)
        network = self.networks[int(self.rng.integers(len(self.networks)))]
        objective = Objective.MAKESPAN if (surplus < 0).any() else search.objective
        accepted, slots = self._play_regions(network, regions, ENERGY_WEIGHTS[objective])
        if accepted.any():
            self._continue_from(regions.merge(self.plan, slots, accepted))

    def _learn(self, tuning: FineTuning, regions: Regions) -> None:
        """Fine-tune the networks; if that fails, return to the shipped ones without further learning."""
        self.networks, self.tuning = tuning.shipped, None
        with self.search.improving("fine-tuning"):
            self.networks, self.tuning = tuning.learn(regions), tuning

    def _partition(self, surplus: NDArray[np.float64]) -> tuple[Ints, list[Ints]]:
        """Partition the tasks into regions; return their tasks, and their agents including idle ones within reach."""
        instance, rng = self.instance, self.rng
        low, high = self.parameters.region_tasks
        is_short = bool((surplus < 0).any())
        stagnation = self.target.stagnation if is_short else 0.0
        high += round(self.parameters.extra_tasks * stagnation)
        size = min(int(rng.integers(low, high + 1)), instance.m)
        bound_by_reach = is_short and not instance.reach.is_complete
        graph = reach_graph(self._near, self.plan, instance.m, rng) if bound_by_reach else None
        tasks = partition(instance.reach.goal, surplus, size, rng, self.parameters.random_share * stagnation, graph)
        region_of = np.full(instance.m + 1, -1)
        region_of[tasks.ravel()] = np.repeat(np.arange(len(tasks)), size)
        chosen = region_of[self.plan]  # idle agents have no region yet: index -1 is the last entry
        idle = np.flatnonzero(self.plan == IDLE)
        if len(idle):
            place, legal = self._near.place, self._near.legal
            chance = np.where(
                legal[idle] & (region_of[place[idle]] >= 0), rng.random((len(idle), place.shape[1])), -1.0
            )
            chosen[idle] = np.where(chance.max(1) >= 0, region_of[place[idle, chance.argmax(1)]], -1)
        order = np.argsort(chosen, kind="stable")
        first = np.searchsorted(chosen[order], np.arange(len(tasks) + 1))
        return tasks, [order[first[p] : first[p + 1]] for p in range(len(tasks))]

    @cached_property
    def _near(self) -> Candidates:
        """Candidates of each agent in games on the whole instance; see `candidate_tasks`."""
        return candidate_tasks(self.instance, self.parameters.near, None)

    def _play_regions(
        self, network: ActorCritic, regions: Regions, energy_weights: tuple[float, float]
    ) -> tuple[NDArray[np.bool_], Ints]:
        """Play the regions in several streams.

        Returns
        -------
        accepted : ndarray of bool, shape (G,)
            Whether the best game is better than the plan.
        slots : ndarray of int, shape (G, k)
            Slots of the agents in the best game.
        """
        streams = [self._games(regions, energy_weights) for _ in range(STREAMS)]
        temperatures = self.rng.uniform(*self.parameters.temperature, STREAMS).tolist()
        seeds = self.rng.integers(2**63, size=STREAMS).tolist()

        def one(number: int) -> Best:
            return play_games(
                network,
                regions.board,
                streams[number],
                rounds=self.parameters.rounds,
                seed=seeds[number],
                temperature=temperatures[number],
                total=True,
                should_stop=self.search.should_stop,
            )

        best = Best(
            *(torch.cat(column) for column in zip(*map(astuple, self.run_all(one, range(STREAMS))), strict=True))
        )
        row = np.concatenate([games.row for games in streams])
        order = np.lexsort((best.distance.numpy(), best.shortfall.numpy().round(6), best.unserved.numpy(), row))
        first = torch.from_numpy(order[:: len(row) // len(regions.tasks)].copy())
        found = Best(*(getattr(best, field.name)[first] for field in fields(Best)))
        now = position(regions.board, reset(regions.board), total=True)
        return found.better_than(now).numpy(), found.slot.numpy()

    def _games(self, regions: Regions, energy_weights: tuple[float, float]) -> Games:
        """Return several games on every region, with different starts and weights of energy."""
        parameters, rng, board, count = self.parameters, self.rng, regions.board, len(regions.tasks)
        pairs = board.shape[1] * board.shape[2]
        games = count * int(np.clip(parameters.pairs_per_stream // (count * pairs), 1, parameters.games_per_region))
        row = np.arange(count).repeat(games // count)
        moved = rng.uniform(*parameters.moved, games)
        moved[rng.random(games) < parameters.restart_share] = 1.0
        elsewhere = regions.nearest.numpy()[row]
        if rng.random() < parameters.scattered_share:
            moved = rng.uniform(*parameters.scattered, games)
            elsewhere = np.where(board.legal.numpy()[row], rng.random((games, *board.shape[1:])), -1.0).argmax(2)
        is_moved = rng.random((games, board.shape[1])) < moved[:, None]
        start = np.where(is_moved, elsewhere, board.start.numpy()[row])
        low, high = np.log(energy_weights)
        return Games(row, np.exp(rng.uniform(low, high, games)), start)


def most_helpers(board: Board) -> int:
    """Return how many agents of mean ability the largest task needs, at most all agents; one joins it per round."""
    return min(board.shape[1], math.ceil(float(board.need.max())))
