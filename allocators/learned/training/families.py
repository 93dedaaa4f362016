"""Families of training instances: each stresses one property, and `varied` combines all of them."""

from collections.abc import Callable, Iterable

import numpy as np

from alloc.problems import InputError, Instance
from alloc.problems.errors import nearest
from alloc.problems.generate import paper_like, random_instance
from alloc.problems.generate.family import Family

Recipe = Callable[[int, int, np.random.Generator], Family]

MEAN_DISTANCE = 0.5
"""Approximate mean distance of two points in the unit square or cube."""


def _real(n: int, m: int, rng: np.random.Generator) -> Family:
    workload = str(rng.choice(["uniform", "dirichlet"]))
    return Family(agents=n, tasks=m, workload=workload, integer=False, dimensions=_dimensions(rng))


def _elsewhere(n: int, m: int, rng: np.random.Generator) -> Family:
    """Return integer workloads that can be matched exactly, as in the paper, with agents that start anywhere."""
    return Family(agents=n, tasks=m, workload="dirichlet", starts="own", dimensions=_dimensions(rng), battery=None)


def _heavy_tailed(n: int, m: int, rng: np.random.Generator) -> Family:
    ability, workload = (str(rng.choice(["lognormal", "pareto"])) for _ in range(2))
    return Family(agents=n, tasks=m, ability=ability, workload=workload, integer=False, battery=None)


def _clustered(n: int, m: int, rng: np.random.Generator) -> Family:
    return Family(
        agents=n,
        tasks=m,
        starts="own",
        sites="clustered",
        clusters=int(rng.integers(2, 6)),
        dimensions=_dimensions(rng),
        integer=bool(rng.random() < 0.5),
        battery=None,
    )


def _depots(n: int, m: int, rng: np.random.Generator) -> Family:
    depots = int(rng.integers(1, 5))
    return Family(agents=n, tasks=m, starts="depots", depots=depots, dimensions=2, battery=(3.0, 8.0))


def _short_range(n: int, m: int, rng: np.random.Generator) -> Family:
    reach, further = rng.uniform(0.25, 0.7), rng.uniform(1.0, 2.0)
    return Family(
        agents=n,
        tasks=m,
        workload=str(rng.choice(["dirichlet", "lognormal", "pareto"])),
        integer=bool(rng.random() < 0.5),
        starts="own",
        sites=str(rng.choice(["uniform", "clustered"])),
        dimensions=_dimensions(rng),
        communication_range=(reach, further * reach),
        battery=None,
    )


def _travel(n: int, m: int, rng: np.random.Generator) -> Family:
    """Return a family whose travel times are 5 % to 50 % of the time of the work alone."""
    return Family(
        agents=n,
        tasks=m,
        starts=str(rng.choice(["own", "tasks"])),
        dimensions=_dimensions(rng),
        speed=_speeds(1.0, rng),
        battery=None,
    )


def _battery(n: int, m: int, rng: np.random.Generator) -> Family:
    least = rng.uniform(1.0, 3.0)
    return Family(agents=n, tasks=m, starts="own", dimensions=_dimensions(rng), battery=(least, 3 * least))


def _priority(n: int, m: int, rng: np.random.Generator) -> Family:
    return Family(agents=n, tasks=m, priority=(0.3, 3.0))


def _unbalanced(n: int, m: int, rng: np.random.Generator) -> Family:
    """Return a family whose total ability is 0.7 to 2 times the total workload, so that ability is shared unevenly."""
    return Family(agents=n, tasks=m, load=1 / rng.uniform(0.7, 2.0))


def _varied(n: int, m: int, rng: np.random.Generator) -> Family:
    load = 1 / rng.uniform(0.7, 2.0)
    reach, least = rng.uniform(0.3, 1.0), rng.uniform(1.5, 8.0)
    return Family(
        agents=n,
        tasks=m,
        ability=str(rng.choice(["uniform", "uniform", "lognormal", "pareto", "equal"])),
        workload=str(rng.choice(["uniform", "dirichlet", "lognormal", "pareto", "equal"])),
        load=load,
        integer=bool(rng.random() < 0.5),
        sites=str(rng.choice(["uniform", "clustered"])),
        dimensions=_dimensions(rng),
        starts=str(rng.choice(["tasks", "own", "depots"])),
        depots=int(rng.integers(1, 5)),
        communication_range=(reach, 2 * reach) if rng.random() < 0.3 else None,
        battery=(least, 2 * least) if rng.random() < 0.5 else None,
        speed=_speeds(load, rng) if rng.random() < 0.3 else None,
        priority=(0.3, 3.0) if rng.random() < 0.3 else 1.0,
        allowed_fraction=rng.uniform(0.3, 1.0) if rng.random() < 0.2 else 1.0,
    )


def _dimensions(rng: np.random.Generator) -> int:
    return int(rng.integers(2, 4))


def _speeds(load: float, rng: np.random.Generator) -> tuple[float, float]:
    speed = MEAN_DISTANCE / (load * rng.uniform(0.05, 0.5))
    return 0.7 * speed, 1.4 * speed


RECIPES: dict[str, Recipe] = {
    "elsewhere": _elsewhere,
    "real": _real,
    "heavy-tailed": _heavy_tailed,
    "clustered": _clustered,
    "depots": _depots,
    "short-range": _short_range,
    "travel": _travel,
    "battery": _battery,
    "priority": _priority,
    "unbalanced": _unbalanced,
    "varied": _varied,
}

FAMILIES = ("mixed", "paper", *RECIPES)
"""Names of all families; `mixed` draws instances like those of the paper and of all other families."""

PAPER_SHARE = 0.4
"""Share of instances like those of the paper in `mixed`."""


def check_families(names: Iterable[str]) -> None:
    """Raise an `InputError` if one of the names is not in `FAMILIES`."""
    for name in names:
        if name not in FAMILIES:
            raise InputError(f"no such family: {name!r}{nearest(name, FAMILIES)}", "family")


def draw_instance(family: str, n: int, m: int, seed: int, rng: np.random.Generator) -> Instance:
    """Draw an instance of one of `FAMILIES`.

    Parameters
    ----------
    n, m : int
        Numbers of agents and tasks.
    seed : int
        Seed of the instance; `rng` draws the parameters of its family.
    """
    if family == "mixed":
        kinds = ("elsewhere", "elsewhere", *RECIPES)  # doubled, as games on parts of an instance resemble it
        family = "paper" if rng.random() < PAPER_SHARE else kinds[int(rng.integers(len(kinds)))]
    if family == "paper":
        least = max(4 * n, m * (m + 1) // 2)
        return paper_like(n, m, int(rng.integers(least, max(least, 5 * n) + 1)), seed)
    return random_instance(RECIPES[family](n, m, rng), seed)
