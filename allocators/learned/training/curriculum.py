"""The curriculum: games on small instances of many kinds, drawn for every update.

Sizes are below those of the paper's scenarios, which are never used for training. Seeds are disjoint from all others:
from 10^9 on for training, and from 2 * 10^9 on for validation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.learned.play.reference import reference_makespan
from alloc.allocators.learned.training.families import draw_instance
from alloc.problems import Instance
from alloc.problems.game import Board, make_board

TRAINING_SEED = 10**9


@dataclass(frozen=True)
class TrainingInstance:
    """An instance and its reference makespan T_ref in hours, a lower bound that sets the target of its games."""

    instance: Instance
    reference_h: float


@dataclass(frozen=True)
class Curriculum:
    """The distribution of training games.

    Attributes
    ----------
    families : tuple of str
        Names in `families.FAMILIES`, one of which is drawn for each game.
    initial_tasks, tasks : (int, int)
        Minimum and maximum number of tasks at the beginning of the training, and after `growth_fraction` of it.
    growth_fraction : float
        Share of the training after which sizes have their full range.
    agents_per_task : (float, float)
        Minimum and maximum number of agents per task.
    max_agents : int
    energy_weight : (float, float)
        Minimum and maximum weight of energy, drawn log-uniformly.
    relaxed_fraction, max_relaxation : float
        Share of games whose target makespan is longer than T_ref, and the largest factor; there is then more ability
        than needed, and some agents may stay idle.
    max_pairs : int
        Approximate number of agent-place pairs on a board, independent of the size of its games, so that updates take
        equally long.
    games : (int, int)
        Minimum and maximum number of games on a board.
    instances : tuple of TrainingInstance
        Given instances to play in place of drawn ones.
    """

    families: tuple[str, ...] = ("mixed",)
    initial_tasks: tuple[int, int] = (4, 8)
    tasks: tuple[int, int] = (3, 16)
    growth_fraction: float = 0.4
    agents_per_task: tuple[float, float] = (3.5, 12.0)
    max_agents: int = 80
    energy_weight: tuple[float, float] = (0.2, 3.0)
    relaxed_fraction: float = 0.2
    max_relaxation: float = 1.3
    max_pairs: int = 12_000
    games: tuple[int, int] = (8, 48)
    instances: tuple[TrainingInstance, ...] = ()

    def draw(self, rng: np.random.Generator, progress: float = 1.0) -> Board:
        """Draw a board of games for one update; `progress` is the share of the training that is done."""
        drawn = self._given(rng) if self.instances else self._new(rng, progress)
        count = len(drawn)
        relaxed = rng.random(count) < self.relaxed_fraction
        factors = np.where(relaxed, rng.uniform(1.0, self.max_relaxation, count), 1.0)
        targets = [one.reference_h * float(factor) for one, factor in zip(drawn, factors, strict=True)]
        low, high = self.energy_weight
        energy_weights = (low * (high / low) ** rng.random(count)).tolist()
        n, m = drawn[0].instance.n, drawn[0].instance.m
        near = max(8, self.max_pairs // n) if n * m > self.max_pairs else None
        return make_board([one.instance for one in drawn], targets, energy_weights, rng, near=near)

    def max_steps(self, board: Board) -> int:
        """Return the maximum number of steps of a game on `board`."""
        return 8 + board.shape[1] // 6

    def _new(self, rng: np.random.Generator, progress: float) -> list[TrainingInstance]:
        growth = min(1.0, progress / self.growth_fraction) if self.growth_fraction > 0 else 1.0
        low, high = (round(a + growth * (b - a)) for a, b in zip(self.initial_tasks, self.tasks, strict=True))
        m = int(rng.integers(low, high + 1))
        n = max(1, min(self.max_agents, round(m * rng.uniform(*self.agents_per_task))))
        instances = []
        for seed in TRAINING_SEED + rng.integers(0, 10**8, self._count(n, m)):
            family = self.families[int(rng.integers(len(self.families)))]
            instances.append(draw_instance(family, n, m, int(seed), rng))
        return with_reference(instances)

    def _given(self, rng: np.random.Generator) -> list[TrainingInstance]:
        """Draw from the given instances that have the size of a random one."""
        first = self.instances[int(rng.integers(len(self.instances)))].instance
        alike = [one for one in self.instances if (one.instance.n, one.instance.m) == (first.n, first.m)]
        return [alike[int(number)] for number in rng.integers(0, len(alike), self._count(first.n, first.m))]

    def _count(self, n: int, m: int) -> int:
        """Return the number of games on a board of games of this size."""
        least = self.games[0] if n * (m + 1) <= self.max_pairs else 1
        return int(np.clip(self.max_pairs // (n * (m + 1)), least, self.games[1]))


def with_reference(instances: Sequence[Instance]) -> list[TrainingInstance]:
    """Return each instance with its reference makespan."""
    return [TrainingInstance(instance, reference_makespan(instance)) for instance in instances]
