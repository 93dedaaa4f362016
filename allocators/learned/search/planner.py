"""From a policy to a plan: games on the whole instance first, then games on parts of it, until time is up."""

import math
from collections.abc import Callable, Iterable, Sequence
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
from alloc.allocators.learned.play.rollout import Best, position
from alloc.allocators.learned.search.fine_tuning import FineTuning
from alloc.allocators.learned.search.limits import NEAR
from alloc.allocators.learned.search.regions import cover, links_between
from alloc.allocators.learned.search.target_makespan import Aims
from alloc.allocators.parallel.pool import Pool
from alloc.problems import IDLE, Allocation, Objective, serve_all
from alloc.problems.game import Board, begin, make_board, pick
from alloc.problems.game.candidates import Layout, near_tasks
from alloc.problems.game.parts import Parts, lay_out_parts

Ints = NDArray[np.int64]

STREAMS = 2
"""Batches of games that are played side by side, in as many threads if the run may have them."""

WHOLE_ROUNDS = 16
"""Most rounds of a game on the whole instance, besides two for every agent that a task has in the mean, or one for each
that the largest task needs."""

SECOND_GAME = 0.15
"""Share of the budget after which no second game on the whole instance is begun."""


@dataclass(frozen=True)
class PlannerParameters:
    """How a policy is put to use.

    Attributes
    ----------
    near : int
        Candidates per agent in games on the whole instance.
    lane_pairs : int
        Pairs of agent and candidate in the games of a stream.
    most_lanes : int
        Games on one part in a stream, at the most.
    part_tasks : (int, int)
        Least and most tasks of a part.
    larger_parts, far_share : int, float
        How much larger parts may be when patience runs out, and the share of those then that are of tasks anywhere.
    rounds : int
        Most rounds of a game on a part; more of them are worth less than more games.
    fresh_share : float
        Share of the games on parts in which everybody begins at the nearest task.
    ruined : (float, float)
        Least and most chance of an agent to begin at the nearest task in the other games; the rest keep their place.
    scattered_share : float
        Share of the streams in which agents begin at any candidate instead of the nearest.
    scattered : (float, float)
        Least and most chance of an agent to do so.
    temperature : (float, float)
        Least and most of what scores are divided by in games on parts.
    patience : int
        Sweeps over all parts without success after which a longer makespan is aimed at; see `Aims`.
    makespan_share : float
        Share of the budget after which energy counts, if it does, even if the makespan may not be the least.
    first_price, second_price : float
        Weight of energy in the first game, which is the first answer; and in the second, from where games on parts go
        on if energy counts: it is easier to mend a lack than to save energy.
    """

    near: int = NEAR
    lane_pairs: int = 4_000
    most_lanes: int = 64
    part_tasks: tuple[int, int] = (2, 5)
    larger_parts: int = 3
    far_share: float = 0.5
    rounds: int = 8
    fresh_share: float = 0.3
    ruined: tuple[float, float] = (0.2, 0.9)
    scattered_share: float = 0.1
    scattered: tuple[float, float] = (0.05, 0.4)
    temperature: tuple[float, float] = (0.4, 0.9)
    patience: int = 20
    makespan_share: float = 0.6
    first_price: float = 0.8
    second_price: float = 3.0


PRICES = {Objective.MAKESPAN: (0.2, 0.8), Objective.MAKESPAN_ENERGY: (0.6, 3.0)}
"""Weights of energy that games on parts are played at."""


class Planner:
    """One run of a policy, or of several, on one instance.

    Parameters
    ----------
    search : Search
    networks : sequence of ActorCritic
        The best first.
    parameters : PlannerParameters, optional
    tuning : FineTuning, optional
        Learns on in between.
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
        self.run_all: Callable[..., Iterable[Best]] = map
        self.rng = np.random.default_rng(search.seed)
        self.instance = search.instance
        self.aims = Aims(search, self.instance, self.parameters.patience, self.parameters.makespan_share)
        self.plan = np.full(search.instance.n, IDLE)

    def run(self) -> None:
        """Play until the budget ends; every improvement has been submitted by then."""
        self.play_whole(self.parameters.first_price)
        if not (self.instance.workload > 0).any():
            return
        if self.search.objective is Objective.MAKESPAN_ENERGY and self.aims.spent < SECOND_GAME:
            self.play_whole(self.parameters.second_price)
        with self.search.improving("playing on parts"), Pool(STREAMS) as pool:
            self.run_all = pool.map if self.search.threads > 1 else map
            while not self.search.should_stop():
                self._sweep()
                self.search.iteration += 1

    def play_whole(self, price: float) -> None:
        """Play one greedy game on the whole instance, and go on from where it ends."""
        search, instance = self.search, self.instance
        plan = None if search.start is None else search.start.task_of_agent
        board = make_board([instance], [self.aims.hours], [price], self.rng, near=self.parameters.near, plan=plan)
        games = Games(np.zeros(1, dtype=np.int64), board.price.numpy(), board.start.numpy())
        rounds = WHOLE_ROUNDS + max(2 * instance.n // instance.m, most_helpers(board))
        best = play_games(self.networks[0], board, games, rounds=rounds, should_stop=self._late)
        place = pick(board.goal, best.slot)[0].numpy()
        self._go_on_from(np.where(place == instance.m, IDLE, place))

    def _late(self) -> bool:
        """Whether a game has to end where it is: the first one goes on unless the time itself is up."""
        search = self.search
        return search.should_stop() if search.best is not None else search.interrupted or search.remaining_s <= 0

    def _go_on_from(self, plan: Ints) -> None:
        """Score a plan, with all tasks served that can be, and take it for the one to be improved."""
        allocation = Allocation(plan)
        if not np.isin(np.flatnonzero(self.instance.workload > 0), plan).all():
            allocation = serve_all(self.instance, allocation)
        self.search.submit(allocation)
        self.plan = allocation.task_of_agent

    def _sweep(self) -> None:
        """Cover the instance with parts, play each many times, and keep what is better."""
        search, aims = self.search, self.aims
        assert search.best is not None
        if aims.set(self.plan):
            self.plan = search.best.allocation.task_of_agent
        surplus = aims.surplus(self.plan)
        aims.note(surplus)
        tasks, agents = self._cover(surplus)
        parts = lay_out_parts(self.instance, aims.hours, self.plan, tasks, agents)
        if self.tuning is not None and self.tuning.is_due():
            self._learn(self.tuning, parts)
        network = self.networks[int(self.rng.integers(len(self.networks)))]
        goal = Objective.MAKESPAN if (surplus < 0).any() else search.objective
        accepted, slots = self._play_parts(network, parts, PRICES[goal])
        if accepted.any():
            self._go_on_from(parts.merge(self.plan, slots, accepted))

    def _learn(self, tuning: FineTuning, parts: Parts) -> None:
        """Play on with what is learned; should that fail, with the policy as it was, and learn no more."""
        self.networks, self.tuning = tuning.shipped, None
        with self.search.improving("learning on"):
            self.networks, self.tuning = tuning.learn(parts), tuning

    def _cover(self, surplus: NDArray[np.float64]) -> tuple[Ints, list[Ints]]:
        """Partition tasks into neighbours, and find the agents that work there, and idle ones that could."""
        instance, rng = self.instance, self.rng
        low, high = self.parameters.part_tasks
        lacking = bool((surplus < 0).any())
        in_vain = self.aims.in_vain if lacking else 0.0
        high += round(self.parameters.larger_parts * in_vain)
        size = min(int(rng.integers(low, high + 1)), instance.m)
        bound_by_reach = lacking and not instance.reach.is_complete
        links = links_between(self._near, self.plan, instance.m, rng) if bound_by_reach else None
        tasks = cover(instance.task_position, surplus, size, rng, self.parameters.far_share * in_vain, links)
        part_of = np.full(instance.m + 1, -1)
        part_of[tasks.ravel()] = np.repeat(np.arange(len(tasks)), size)
        chosen = part_of[self.plan]  # idle agents have no part yet: index -1 is the last entry
        idle = np.flatnonzero(self.plan == IDLE)
        if len(idle):
            goal, _, legal = self._near
            chance = np.where(legal[idle] & (part_of[goal[idle]] >= 0), rng.random((len(idle), goal.shape[1])), -1.0)
            chosen[idle] = np.where(chance.max(1) >= 0, part_of[goal[idle, chance.argmax(1)]], -1)
        order = np.argsort(chosen, kind="stable")
        first = np.searchsorted(chosen[order], np.arange(len(tasks) + 1))
        return tasks, [order[first[p] : first[p + 1]] for p in range(len(tasks))]

    @cached_property
    def _near(self) -> Layout:
        """Candidates of each agent, in games on the whole; see `near_tasks`."""
        return near_tasks(self.instance, self.parameters.near, None)

    def _play_parts(
        self, network: ActorCritic, parts: Parts, prices: tuple[float, float]
    ) -> tuple[NDArray[np.bool_], Ints]:
        """Play the parts in several streams; return which games are better than the plan, and their slots."""
        streams = [self._games(parts, prices) for _ in range(STREAMS)]
        temperatures = self.rng.uniform(*self.parameters.temperature, STREAMS).tolist()
        seeds = self.rng.integers(2**63, size=STREAMS).tolist()

        def one(number: int) -> Best:
            return play_games(
                network,
                parts.board,
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
        first = torch.from_numpy(order[:: len(row) // len(parts.tasks)].copy())
        found = Best(*(getattr(best, field.name)[first] for field in fields(Best)))
        now = position(parts.board, begin(parts.board), total=True)
        return found.better_than(now).numpy(), found.slot.numpy()

    def _games(self, parts: Parts, prices: tuple[float, float]) -> Games:
        """Lay out several games on every part, from various beginnings and at various prices."""
        parameters, rng, board, count = self.parameters, self.rng, parts.board, len(parts.tasks)
        pairs = board.shape[1] * board.shape[2]
        lanes = count * int(np.clip(parameters.lane_pairs // (count * pairs), 1, parameters.most_lanes))
        row = np.arange(count).repeat(lanes // count)
        ruined = rng.uniform(*parameters.ruined, lanes)
        ruined[rng.random(lanes) < parameters.fresh_share] = 1.0
        away = parts.home.numpy()[row]
        if rng.random() < parameters.scattered_share:
            ruined = rng.uniform(*parameters.scattered, lanes)
            away = np.where(board.legal.numpy()[row], rng.random((lanes, *board.shape[1:])), -1.0).argmax(2)
        back = rng.random((lanes, board.shape[1])) < ruined[:, None]
        start = np.where(back, away, board.start.numpy()[row])
        cheap, dear = np.log(prices)
        return Games(row, np.exp(rng.uniform(cheap, dear, lanes)), start)


def most_helpers(board: Board) -> int:
    """Return how many mean agents the largest task needs, but not more than there are: one joins it in a round."""
    return min(board.shape[1], math.ceil(float(board.need.max())))
