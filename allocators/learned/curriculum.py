"""Games to train on: small instances of many kinds, drawn anew for every update.

All sizes are far below those of the paper's scenarios, which are never trained on. Seeds start where nobody else's
do: 10^9 for training, 2 * 10^9 for validation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems import Instance, lp_makespan_lower_bound, makespan_lower_bound
from alloc.problems.game import Board, make_board
from alloc.problems.generate import paper_like, random_instance
from alloc.problems.generate_family import Family

TRAINING_SEED = 10**9
VALIDATION_SEED = 2 * 10**9


@dataclass(frozen=True)
class Curriculum:
    """What games are drawn.

    Attributes
    ----------
    tasks : (int, int)
        Least and most tasks.
    agents_per_task : (float, float)
        Least and most agents per task.
    most_agents : int
    paper_share : float
        Share of instances like the paper's; the others are drawn from families with reach, clusters or real values.
    price : (float, float)
        Least and most weight of energy.
    games : int
        Games per board.
    steps_per_agent : float
        Length of a game.
    """

    tasks: tuple[int, int] = (6, 13)
    agents_per_task: tuple[float, float] = (3.5, 9.0)
    most_agents: int = 72
    paper_share: float = 0.5
    price: tuple[float, float] = (0.2, 2.4)
    games: int = 20
    steps_per_agent: float = 0.6

    def draw(self, rng: np.random.Generator, progress: float = 1.0) -> Board:
        """Draw a board of games for one update."""
        m = int(rng.integers(self.tasks[0], self.tasks[1] + 1))
        n = min(self.most_agents, round(m * rng.uniform(*self.agents_per_task)))
        seeds = TRAINING_SEED + rng.integers(0, 10**8, self.games)
        instances = [self._instance(n, m, int(seed), rng) for seed in seeds]
        prices = [float(price) for price in rng.uniform(*self.price, self.games)]
        return reference_board(instances, prices, rng)

    def steps(self, board: Board) -> int:
        """How long games on `board` last."""
        return 20

    def _instance(self, n: int, m: int, seed: int, rng: np.random.Generator) -> Instance:
        if rng.random() < self.paper_share:
            return paper_like(n, m, int(rng.integers(4 * n, 5 * n + 1)), seed)
        return random_instance(_FAMILIES[int(rng.integers(len(_FAMILIES)))](n, m, rng), seed)


def _reach_limited(n: int, m: int, rng: np.random.Generator) -> Family:
    reach = rng.uniform(0.3, 0.7)
    return Family(agents=n, tasks=m, starts="own", communication_range=(reach, 1.5 * reach), battery=None)


def _scattered(n: int, m: int, rng: np.random.Generator) -> Family:
    """Few can reach what is far off, loads differ widely, and agents crowd elsewhere."""
    reach = rng.uniform(0.25, 0.6)
    return Family(
        agents=n,
        tasks=m,
        workload=str(rng.choice(["lognormal", "pareto"])),
        integer=False,
        starts="own",
        sites=str(rng.choice(["uniform", "clustered"])),
        dimensions=2,
        communication_range=(reach, 3 * reach),
        battery=None,
    )


def _clustered(n: int, m: int, rng: np.random.Generator) -> Family:
    return Family(agents=n, tasks=m, starts="own", sites="clustered", dimensions=2, integer=False, battery=None)


def _heavy_tailed(n: int, m: int, rng: np.random.Generator) -> Family:
    return Family(agents=n, tasks=m, ability="lognormal", workload="lognormal", integer=False, battery=None)


def _depots(n: int, m: int, rng: np.random.Generator) -> Family:
    return Family(agents=n, tasks=m, starts="depots", depots=3, dimensions=2, battery=(3.0, 8.0))


_FAMILIES = (_reach_limited, _scattered, _scattered, _clustered, _heavy_tailed, _depots)


def reference_makespan(instance: Instance, patience_s: float = 1.0) -> float:
    """Return the best lower bound at hand on the makespan, in hours: demands are set by it."""
    bound = makespan_lower_bound(instance)
    if not instance.reach.is_complete:
        bound = max(bound, lp_makespan_lower_bound(instance, patience_s) or 0.0)
    return bound


def reference_board(instances: Sequence[Instance], price: Sequence[float], rng: np.random.Generator) -> Board:
    """Lay out games with demands at the lower bound of each instance."""
    return make_board(instances, [reference_makespan(instance) for instance in instances], price, rng)


def validation_boards() -> list[Board]:
    """Return the games on which generations are compared: always the same, none of them trained on."""
    rng = np.random.default_rng(VALIDATION_SEED)
    seeds = iter(range(VALIDATION_SEED, VALIDATION_SEED + 1000))
    kinds = (
        [paper_like(100, 20, 400, next(seeds)) for _ in range(8)],
        [paper_like(60, 6, 300, next(seeds)) for _ in range(8)],
        [random_instance(make(60, 10, rng), next(seeds)) for make in _FAMILIES for _ in range(2)],
    )
    return [reference_board(kind, [0.6] * len(kind), rng) for kind in kinds]
