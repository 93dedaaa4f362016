"""GAPPO: rollouts of a trained population of actor-critics, greedy ones first, then sampled until time is up."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import torch

from alloc.allocators.base import Allocator, Proposal
from alloc.allocators.learned.curriculum import reference_makespan
from alloc.allocators.learned.policy_file import load_policy
from alloc.allocators.learned.rollout import Best, play, repeat
from alloc.allocators.registry import BUILT_IN
from alloc.allocators.search import Budget, Search
from alloc.problems import IDLE, Allocation, Instance, Objective, serve_all
from alloc.problems.game import make_board

PAIRS_PER_SECOND = 400_000
"""Pairs of agent and task that are scored, placed and tried within a second on one slow core."""

LARGEST = 6_000_000
"""Pairs beyond which the scores of one game alone take more than a gigabyte."""


@dataclass(frozen=True)
class Rollouts:
    """One batch of games: which network plays, at which prices of energy, and how boldly."""

    network: int
    prices: tuple[float, ...]
    temperature: float


class Gappo(Allocator):
    """The learned policy of the paper, as shipped or from a file that `alloc train` wrote.

    Parameters
    ----------
    policy : Path or str, optional
        Policy file; the one that ships with the package by default.
    device : str
        Where the networks run, such as ``cpu``.

    Raises
    ------
    InputError
        If the policy file is not one, or does not fit this version.

    References
    ----------
    Fang et al. (2025), doi:10.20944/preprints202502.0192.v1.
    """

    method = BUILT_IN["gappo"]

    def __init__(self, policy: Path | str | None = None, device: str = "cpu") -> None:
        if policy is not None:
            self.networks = load_policy(policy, "gappo", device)
        else:
            with as_file(files("alloc.allocators.learned") / "policies" / "gappo.safetensors") as shipped:
                self.networks = load_policy(shipped, "gappo", device)

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse where not even one game could be laid out in time."""
        pairs = instance.n * (instance.m + 1)
        limit = LARGEST
        if budget.time_limit_s is not None:
            limit = min(limit, int(PAIRS_PER_SECOND * max(0.05, budget.time_limit_s)))
        if pairs > limit:
            return (
                f"{pairs} pairs of agent and task are more than the {limit} that it can handle in this time; "
                "give more time, or use greedy or ga"
            )
        return None

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
        generator = torch.Generator().manual_seed(search.seed)
        board = make_board([instance], [reference_makespan(instance)], [1.0], rng)
        if search.start is not None:
            board = replace(board, start=_places(instance, search.start))
        moves = max(1, instance.n // 800)
        for batch in _plan(len(self.networks), search, instance.n * (instance.m + 1), rng):
            if search.best is not None and search.should_stop():
                return
            best = play(
                self.networks[batch.network],
                repeat(board, torch.tensor(batch.prices)),
                steps=int(0.8 * instance.n / moves) + 8,
                moves_per_step=moves,
                temperature=batch.temperature,
                generator=generator,
                should_stop=search.should_stop,
            )
            _submit(search, best)
            search.iteration += 1


def _plan(networks: int, search: Search, pairs: int, rng: np.random.Generator) -> Iterator[Rollouts]:
    """One greedy game, greedy games of every network at several prices, and then sampled ones without end."""
    energy = search.objective is Objective.MAKESPAN_ENERGY
    prices = (1.0, 0.6, 1.5, 2.0) if energy else (0.2, 0.6)
    width = int(np.clip(60_000 // pairs, 1, 16))
    yield Rollouts(0, prices[:1], 0.0)
    for number in range(networks):
        for first in range(0, len(prices), width):
            yield Rollouts(number, prices[first : first + width], 0.0)
    while True:
        for number in range(networks):
            drawn = np.exp(rng.uniform(np.log(min(prices)), np.log(max(prices)), width))
            yield Rollouts(number, tuple(drawn.tolist()), 1.0)


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
