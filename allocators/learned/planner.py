"""From a policy to a plan: games on the whole instance first, then games on parts of it, until time is up."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.allocators.learned.curriculum import reference_makespan
from alloc.allocators.learned.fine_tuning import FineTuning
from alloc.allocators.learned.network import ActorCritic
from alloc.allocators.learned.rollout import Best, play, position
from alloc.allocators.search import Search
from alloc.problems import IDLE, Allocation, Objective, serve_all
from alloc.problems.game import Board, begin, make_board, pick
from alloc.problems.game.board import working_share
from alloc.problems.game.parts import Parts, lay_out_parts

Ints = NDArray[np.int64]

ATTRACTION = 0.3
"""Factor on the distance from a task that lacks something to those with a surplus, in making parts."""

ROUNDING = 1e-9
"""Share of the need by which a group may be off and still be right."""


@dataclass(frozen=True)
class PlannerParameters:
    """How a policy is put to use.

    Attributes
    ----------
    near : int
        Candidates per agent in games on the whole instance.
    lane_pairs : int
        Pairs of agent and candidate in the games that are played side by side.
    part_tasks : (int, int)
        Least and most tasks of a part.
    rounds : int
        Most rounds of a game.
    fresh_share : float
        Share of the games on parts in which everybody begins at the nearest task.
    ruined : (float, float)
        Least and most chance of an agent to begin at the nearest task in the other games; the rest keep their place.
    temperature : (float, float)
        Least and most of what scores are divided by in games on parts.
    patience : int
        Sweeps over all parts without success after which a longer makespan is aimed at.
    """

    near: int = 20
    lane_pairs: int = 40_000
    part_tasks: tuple[int, int] = (2, 6)
    rounds: int = 60
    fresh_share: float = 0.3
    ruined: tuple[float, float] = (0.2, 0.9)
    temperature: tuple[float, float] = (0.5, 1.0)
    patience: int = 12
    first_price: float = 1.0


PRICES = {Objective.MAKESPAN: (0.2, 0.8), Objective.MAKESPAN_ENERGY: (0.4, 2.4)}
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
        self.rng = np.random.default_rng(search.seed)
        self.generator = torch.Generator().manual_seed(search.seed)
        self.failed = reference_makespan(search.instance)
        self.aim = self.failed
        self.stale = 0
        self.sweeps = 0

    def run(self) -> None:
        """Play until the budget ends; every improvement has been submitted by then."""
        self.play_whole()
        while not self.search.should_stop():
            self._sweep()
            self.search.iteration += 1

    def play_whole(self) -> None:
        """Play one greedy game on the whole instance, then one per further network or price."""
        search, parameters = self.search, self.parameters
        instance = search.instance
        plan = None if search.start is None else search.start.task_of_agent
        board = make_board([instance], [self.aim], [parameters.first_price], self.rng, near=parameters.near, plan=plan)
        for network in self.networks[:1]:
            best = play(network, board, steps=2 * parameters.rounds, should_stop=self._late)
            place = pick(board.goal, best.slot)[0].numpy()
            self._submit(np.where(place == instance.m, IDLE, place))

    def _late(self) -> bool:
        return self.search.best is not None and self.search.should_stop()

    def _submit(self, plan: Ints) -> None:
        search = self.search
        allocation = Allocation(plan)
        served = np.isin(np.flatnonzero(search.instance.workload > 0), plan)
        if not served.all():
            allocation = serve_all(search.instance, allocation)
        search.submit(allocation)

    def _sweep(self) -> None:
        """Cover the instance with parts, play each many times, and keep what is better."""
        search = self.search
        assert search.best is not None
        assert search.fastest is not None
        energy = self._set_aim()
        plan = search.best.allocation.task_of_agent if energy else search.fastest.allocation.task_of_agent
        network = self.networks[int(self.rng.integers(len(self.networks)))]
        tasks, agents = self._cover(plan)
        if not len(tasks):
            return
        parts = lay_out_parts(search.instance, self.aim, plan, tasks, agents)
        if self.tuning is not None and self.tuning.is_due():
            self.networks = self.tuning.learn(parts)
        accepted, slots = self._play_parts(network, parts)
        if accepted.any():
            self._submit(parts.merge(plan, slots, accepted))
        self.sweeps += 1

    def _set_aim(self) -> bool:
        """Decide on the makespan to aim at; return whether it is reached already, and energy counts."""
        search = self.search
        reached = search.fastest.evaluation.served_makespan
        if search.objective is Objective.MAKESPAN_ENERGY and (
            reached <= self.failed * (1 + 1e-9) or search.remaining_s < 0.5 * (search.budget.time_limit_s or np.inf)
        ):
            self.aim = search.makespan_limit
            return True
        if reached <= self.aim * (1 + 1e-9):
            self.aim, self.stale = (self.failed + reached) / 2, 0
        elif self.stale >= self.parameters.patience:
            self.failed, self.aim, self.stale = self.aim, (self.aim + reached) / 2, 0
        self.stale += 1
        return False

    def _cover(self, plan: Ints) -> tuple[Ints, list[Ints]]:
        """Partition tasks into neighbours, and find the agents that work there."""
        instance, rng = self.search.instance, self.rng
        low, high = self.parameters.part_tasks
        size = int(min(rng.integers(low, high + 1), instance.m))
        tasks = cover(instance.task_position, self._surplus(plan), size, rng)
        part_of = np.full(instance.m + 1, -1)
        part_of[tasks.ravel()] = np.repeat(np.arange(len(tasks)), size)
        chosen = part_of[plan]  # idle agents have no part yet: index -1 is the last entry
        idle = np.flatnonzero(plan == IDLE)
        if len(idle):
            chosen[idle] = rng.integers(len(tasks), size=len(idle))
        order = np.argsort(chosen, kind="stable")
        first = np.searchsorted(chosen[order], np.arange(len(tasks) + 1))
        return tasks, [order[first[p] : first[p + 1]] for p in range(len(tasks))]

    def _surplus(self, plan: Ints) -> NDArray[np.float64]:
        """Ability that each task has too much for the makespan aimed at, negative where it lacks some, shape (m,)."""
        instance = self.search.instance
        agent = np.flatnonzero(plan != IDLE)
        share = working_share(instance.speed[agent], instance.reach.distance_of(agent, plan[agent]), self.aim)
        group = np.bincount(plan[agent], instance.ability[agent] * share, minlength=instance.m)
        need = instance.workload / max(self.aim, 1e-300)
        return np.where(np.abs(group - need) <= ROUNDING * need, 0.0, group - need)

    def _play_parts(self, network: ActorCritic, parts: Parts) -> tuple[NDArray[np.bool_], Ints]:
        parameters, rng = self.parameters, self.rng
        board, count = parts.board, len(parts.tasks)
        pairs = board.shape[1] * board.shape[2]
        lanes = int(np.clip(parameters.lane_pairs // (count * pairs), 1, 64))
        rows = torch.arange(count).repeat_interleave(lanes)
        low, high = np.log(PRICES[self.search.objective])
        price = torch.from_numpy(np.exp(rng.uniform(low, high, count * lanes)).astype(np.float32))
        ruined = rng.uniform(*parameters.ruined, count * lanes)
        ruined[rng.random(count * lanes) < parameters.fresh_share] = 1.0
        back = torch.from_numpy(rng.random((count * lanes, board.shape[1])) < ruined[:, None])
        start = torch.where(back, parts.home[rows], board.start[rows])
        games = replace(board[rows], price=price, start=start)
        best = play(
            network,
            games,
            steps=parameters.rounds,
            temperature=float(rng.uniform(*parameters.temperature)),
            generator=self.generator,
            total=True,
            should_stop=self.search.should_stop,
        )
        now = _stand(board)
        order = np.lexsort(
            (best.distance.numpy(), best.shortfall.numpy().round(6), best.unserved.numpy(), rows.numpy())
        )
        first = torch.from_numpy(order[::lanes].copy())
        found = Best(best.slot[first], best.unserved[first], best.shortfall[first], best.distance[first])
        return found.better_than(now).numpy(), found.slot.numpy()


def _stand(board: Board) -> Best:
    return position(board, begin(board), total=True)


def cover(position: NDArray[np.float64], surplus: NDArray[np.float64], size: int, rng: np.random.Generator) -> Ints:
    """Partition places into groups of neighbours, shape (groups, size); some are left over.

    Each group is made of a place and of those left that are nearest to it, more or less. Places that lack something
    come first, in random order, and those with a surplus seem nearer to them.

    Parameters
    ----------
    position : ndarray, shape (m, 3)
    surplus : ndarray, shape (m,)
        Negative where something is lacking.
    """
    m = len(position)
    position = np.nan_to_num(position)
    free = np.ones(m, dtype=bool)
    groups = []
    for centre in np.lexsort((rng.random(m), surplus >= 0)).tolist():
        if not free[centre]:
            continue
        if free.sum() < size:
            break
        with np.errstate(over="ignore"):
            away = np.sqrt(((position - position[centre]) ** 2).sum(1)) * rng.uniform(0.6, 1.4, m)
        if surplus[centre] < 0:
            away[surplus > 0] *= ATTRACTION
        away[~free], away[centre] = np.inf, -1.0
        group = np.argpartition(away, size - 1)[:size]
        free[group] = False
        groups.append(group)
    return np.array(groups, dtype=np.int64).reshape(-1, size)
