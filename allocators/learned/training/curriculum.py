"""Games to train on: small instances of many kinds, drawn anew for every update.

Sizes are below those of the paper's scenarios, which are never trained on. Seeds start where nobody else's do:
10^9 for training, 2 * 10^9 for validation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.allocators.learned.training.families import draw_instance
from alloc.problems import Instance, lp_makespan_lower_bound, makespan_lower_bound
from alloc.problems.game import Board, make_board

TRAINING_SEED = 10**9


@dataclass(frozen=True)
class Aimed:
    """An instance, and the makespan in hours at which it is aimed: a lower bound."""

    instance: Instance
    hours: float


@dataclass(frozen=True)
class Curriculum:
    """What games are drawn.

    Attributes
    ----------
    families : tuple of str
        Of `families.FAMILIES`; each game draws one of them.
    first_tasks, tasks : (int, int)
        Least and most tasks, when training begins and when all of it is `grown`.
    grown : float
        Share of the training after which sizes are at their full range.
    agents_per_task : (float, float)
        Least and most agents per task.
    most_agents : int
    price : (float, float)
        Least and most weight of energy, drawn in proportion.
    eased_share, easing : float
        Share of games that aim at a longer makespan than the bound, and how much longer at most: there is ability to
        spare, and some agents may stay idle.
    pairs : int
        Pairs of agent and place on a board, about, whatever the size of its games: an update always takes as long.
    games : (int, int)
        Least and most games on a board.
    own : tuple of Aimed
        Instances to play instead of drawn ones.
    """

    families: tuple[str, ...] = ("mixed",)
    first_tasks: tuple[int, int] = (4, 8)
    tasks: tuple[int, int] = (3, 16)
    grown: float = 0.4
    agents_per_task: tuple[float, float] = (3.5, 12.0)
    most_agents: int = 80
    price: tuple[float, float] = (0.2, 3.0)
    eased_share: float = 0.2
    easing: float = 1.3
    pairs: int = 12_000
    games: tuple[int, int] = (8, 48)
    own: tuple[Aimed, ...] = ()

    def draw(self, rng: np.random.Generator, progress: float = 1.0) -> Board:
        """Draw a board of games for one update.

        Parameters
        ----------
        progress : float
            Share of the training that is behind.
        """
        aimed = self._own(rng) if self.own else self._new(rng, progress)
        eased = np.where(rng.random(len(aimed)) < self.eased_share, rng.uniform(1.0, self.easing, len(aimed)), 1.0)
        hours = [one.hours * float(ease) for one, ease in zip(aimed, eased, strict=True)]
        cheap, dear = self.price
        prices = (cheap * (dear / cheap) ** rng.random(len(aimed))).tolist()
        n, m = aimed[0].instance.n, aimed[0].instance.m
        near = max(8, self.pairs // n) if n * m > self.pairs else None
        return make_board([one.instance for one in aimed], hours, prices, rng, near=near)

    def steps(self, board: Board) -> int:
        """Return how many rounds games on `board` last at most."""
        return 8 + board.shape[1] // 6

    def _new(self, rng: np.random.Generator, progress: float) -> list[Aimed]:
        along = min(1.0, progress / self.grown) if self.grown > 0 else 1.0
        low, high = (round(a + along * (b - a)) for a, b in zip(self.first_tasks, self.tasks, strict=True))
        m = int(rng.integers(low, high + 1))
        n = max(1, min(self.most_agents, round(m * rng.uniform(*self.agents_per_task))))
        instances = []
        for seed in TRAINING_SEED + rng.integers(0, 10**8, self._count(n, m)):
            family = self.families[int(rng.integers(len(self.families)))]
            instances.append(draw_instance(family, n, m, int(seed), rng))
        return aim(instances)

    def _own(self, rng: np.random.Generator) -> list[Aimed]:
        """Draw from those instances that are as large as one drawn before."""
        first = self.own[int(rng.integers(len(self.own)))].instance
        alike = [one for one in self.own if (one.instance.n, one.instance.m) == (first.n, first.m)]
        return [alike[int(number)] for number in rng.integers(0, len(alike), self._count(first.n, first.m))]

    def _count(self, n: int, m: int) -> int:
        """Games of this size on a board."""
        least = self.games[0] if n * (m + 1) <= self.pairs else 1
        return int(np.clip(self.pairs // (n * (m + 1)), least, self.games[1]))


def reference_makespan(instance: Instance, patience_s: float = 1.0) -> float:
    """Return the best lower bound at hand on the makespan, in hours: demands are set by it."""
    bound = makespan_lower_bound(instance)
    if not instance.reach.is_complete:
        bound = max(bound, lp_makespan_lower_bound(instance, patience_s) or 0.0)
    return bound


def aim(instances: Sequence[Instance]) -> list[Aimed]:
    """Aim each instance at its lower bound."""
    return [Aimed(instance, reference_makespan(instance)) for instance in instances]


def reference_board(instances: Sequence[Instance], price: Sequence[float], rng: np.random.Generator) -> Board:
    """Lay out games with demands at the lower bound of each instance."""
    return make_board(instances, [reference_makespan(instance) for instance in instances], price, rng)
