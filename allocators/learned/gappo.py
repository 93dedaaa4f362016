"""GAPPO: games of a trained population of actor-critics, greedy ones first, then sampled ones until time is up."""

from dataclasses import dataclass, replace
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.allocators.base import Allocator, Proposal
from alloc.allocators.learned.curriculum import reference_makespan
from alloc.allocators.learned.limits import too_large
from alloc.allocators.learned.network import ActorCritic
from alloc.allocators.learned.policy_file import load_policy
from alloc.allocators.learned.rollout import Best, play, repeat
from alloc.allocators.registry import BUILT_IN
from alloc.allocators.search import Budget, Search
from alloc.problems import IDLE, Allocation, InputError, Instance, Objective, serve_all
from alloc.problems.game import Board, make_board

LANE_PAIRS = 100_000
"""Pairs of agent and task in the games that are played side by side."""

PATIENCE = 8
"""Steps without progress after which a game ends, besides one for every 32 agents."""

GREEDY_SHARE = 0.25
"""Share of the time limit after which no network begins its greedy games."""

HASTE = 1 / 16
"""Share of the outstanding moves that are granted at once."""

GREEDY_PRICES = {Objective.MAKESPAN: (0.2, 0.6), Objective.MAKESPAN_ENERGY: (1.5, 1.0, 2.0, 0.6)}
SAMPLED_PRICES = {Objective.MAKESPAN: (0.2, 0.8), Objective.MAKESPAN_ENERGY: (1.2, 3.0)}
"""Weights of energy that are played at; training knows 0.2 to 2.4."""

RUINED_SHARE = (0.03, 0.3)
"""Least and most chance of an agent to be sent home in a scattered ruin."""

RUINED_TASKS = 0.25
"""Share of the tasks in the largest ruin around a place."""

FRESH_SHARE = 0.15
"""Share of the sampled batches that play from the beginning, rather than from the ruins of the best plan."""


class Gappo(Allocator):
    """The learned policy of the paper, as shipped or from a file that `alloc train` wrote.

    Parameters
    ----------
    policy : Path or str, optional
        Policy file; the one that ships with the package by default.
    device : str
        Where the networks run, such as ``cpu`` or ``cuda``.

    Raises
    ------
    InputError
        If the policy file is not one, does not fit this version, or there is no such device.

    References
    ----------
    Fang et al. (2025), doi:10.20944/preprints202502.0192.v1.
    """

    method = BUILT_IN["gappo"]

    def __init__(self, policy: Path | str | None = None, device: str = "cpu") -> None:
        self.device = _usable(device)
        if policy is not None:
            self.networks = load_policy(policy, "gappo", self.device)
        else:
            with as_file(files("alloc.allocators.learned") / "policies" / "gappo.safetensors") as shipped:
                self.networks = load_policy(shipped, "gappo", self.device)

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse where not even one game would end in time."""
        return too_large(instance, budget)

    def allocate(self, search: Search) -> Proposal:
        """Play batch after batch and submit the best position of each game."""
        threads = torch.get_num_threads()
        torch.set_num_threads(1)  # the tensors are small: a second thread costs more than it brings
        try:
            self._play_all(search)
        finally:
            torch.set_num_threads(threads)
        return Proposal()

    def _play_all(self, search: Search) -> None:
        instance = search.instance
        rng = np.random.default_rng(search.seed)
        generator = torch.Generator(self.device).manual_seed(search.seed)
        board = make_board([instance], [reference_makespan(instance)], [1.0], rng)
        if search.start is not None:
            board = replace(board, start=_places(instance, search.start))
        home = board.start[0].numpy()
        board = board.to(self.device)
        games = _Games(search, board, generator)
        width = int(np.clip(LANE_PAIRS // (instance.n * (instance.m + 1)), 1, 24))
        prices = GREEDY_PRICES[search.objective]
        games.play(self.networks[0], board.start, prices[:1])
        for network in self.networks:
            if search.elapsed_s > GREEDY_SHARE * (search.budget.time_limit_s or np.inf):
                break
            for first in range(0, len(prices), width):
                games.play(network, board.start, prices[first : first + width])
        low, high = np.log(SAMPLED_PRICES[search.objective])
        while not search.should_stop():
            network = self.networks[int(rng.integers(len(self.networks)))]
            drawn = tuple(np.exp(rng.uniform(low, high, width)).tolist())
            start = board.start
            if search.best is not None and rng.random() > FRESH_SHARE:
                start = ruin(instance, search.best.allocation, home, width, rng)
            games.play(network, start, drawn, temperature=1.0)


@dataclass(frozen=True, eq=False)
class _Games:
    """Plays batches of games of one run and submits the best positions."""

    search: Search
    board: Board
    generator: torch.Generator

    def play(
        self, network: ActorCritic, start: torch.Tensor, prices: tuple[float, ...], temperature: float = 0.0
    ) -> None:
        """Play one game per price from `start`, shape (1 or len(prices), n), unless it is time to stop."""
        search = self.search
        if search.best is not None and search.should_stop():
            return
        board = repeat(self.board, torch.tensor(prices, device=self.board.price.device))
        lanes = replace(board, start=start.to(board.start.device).expand(len(prices), -1))
        best = play(
            network,
            lanes,
            steps=2 * search.instance.n + PATIENCE,
            patience=PATIENCE + search.instance.n // 32,
            haste=HASTE,
            temperature=temperature,
            generator=self.generator,
            should_stop=search.should_stop,
        )
        _submit(search, best.cpu())
        search.iteration += 1


def ruin(
    instance: Instance, allocation: Allocation, home: NDArray[np.int64], count: int, rng: np.random.Generator
) -> torch.Tensor:
    """Send some agents of a plan back home, for the policy to allocate them anew.

    Either each agent with a certain chance, or those who work at, or come from, one task and its nearest neighbours.

    Parameters
    ----------
    home : ndarray of int, shape (n,)
        Where each agent begins; m for idle.
    count : int
        How many ruins to make.

    Returns
    -------
    Tensor of int, shape (count, n)

    References
    ----------
    Schrimpf et al. (2000), doi:10.1006/jcph.1999.6413.
    """
    plan = np.where(allocation.task_of_agent == IDLE, instance.m, allocation.task_of_agent)
    ruins = np.repeat(plan[None], count, axis=0)
    for row in ruins:
        if rng.random() < 0.5:
            back = rng.random(instance.n) < rng.uniform(*RUINED_SHARE)
        else:
            centre = instance.task_position[rng.integers(instance.m)]
            with np.errstate(over="ignore"):
                away = np.nan_to_num(((instance.task_position - centre) ** 2).sum(axis=1))
            away += 1e-9 * rng.random(instance.m)
            near = np.zeros(instance.m + 1, dtype=bool)
            near[np.argsort(away)[: rng.integers(2, max(4, int(RUINED_TASKS * instance.m)))]] = True
            back = near[plan] | near[home]
        row[back] = home[back]
    return torch.from_numpy(ruins)


def _usable(device: str) -> torch.device:
    try:
        torch.zeros(1, device=device).item()
        return torch.device(device)
    except (RuntimeError, AssertionError) as error:
        reason = next(iter(str(error).splitlines()), "unusable")[:100]
        raise InputError(f"{device!r} cannot be used here ({reason}); use cpu", "device") from None


def _submit(search: Search, best: Best) -> None:
    """Score the most promising positions by the one scorer."""
    instance = search.instance
    order = np.lexsort((best.distance.numpy(), best.time.numpy().round(5), best.unserved.numpy()))
    for game in order[:4].tolist():
        task = best.task[game].numpy()
        allocation = Allocation(np.where(task == instance.m, IDLE, task))
        if int(best.unserved[game]) > 0:
            allocation = serve_all(instance, allocation)
        search.submit(allocation)


def _places(instance: Instance, allocation: Allocation) -> torch.Tensor:
    task = allocation.task_of_agent
    return torch.from_numpy(np.where(task == IDLE, instance.m, task).astype(np.int64))[None]
