"""Random instances of a general family."""

import numpy as np

from alloc.problems.arguments import of_type, whole
from alloc.problems.generate.family import Family, Spread
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.vocabulary import Distribution, Sites, Starts


def random_instance(family: Family, seed: int, *, name: str | None = None) -> Instance:
    """Return a random instance of `family`; the same seed gives the same instance.

    Parameters
    ----------
    family : Family
    seed : int
        Random seed, >= 0.
    name : str, optional
        Name of the instance.
    """
    of_type(family, Family, "family")
    rng = np.random.default_rng(whole(seed, "seed"))
    n, m = family.agents, family.tasks
    ability = _abilities(family, rng)
    workload = _workloads(family, float(ability.sum()), rng)
    centres = rng.random((family.clusters, family.dimensions)) * family.world_size
    sites = _places(family, m, centres, rng)
    start_task, own = None, None
    if family.starts is Starts.TASKS:
        start_task = rng.integers(0, m, n)
    elif family.starts is Starts.OWN:
        own = _places(family, n, centres, rng)
    elif family.starts is Starts.DEPOTS:
        own = _places(family, family.depots, centres, rng)[rng.integers(0, family.depots, n)]
    return Instance(
        name=name if name is not None else f"random-{n}x{m}-seed-{seed}",
        ability=ability,
        workload=workload,
        agent_position=own,
        task_position=sites,
        start_task=start_task,
        communication_range=_draw(family.communication_range, n, rng),
        battery=_draw(family.battery, n, rng),
        speed=_draw(family.speed, n, rng),
        priority=_draw(family.priority, m, rng),
        allowed_tasks=None if family.allowed_fraction == 1 else _allowed(family, rng),
        energy_per_distance=family.energy_per_distance,
        tau=family.tau,
    )


def _abilities(family: Family, rng: np.random.Generator) -> FloatArray:
    low, high, n = family.ability_min, family.ability_max, family.agents
    if family.ability is Distribution.EQUAL:
        ability = np.full(n, high)
    elif family.ability is Distribution.LOGNORMAL:
        ability = np.exp(rng.normal(np.log(low * high) / 2, np.log(high / low) / (2 * 1.96), n))
    elif family.ability is Distribution.PARETO:
        ability = low * (1 + rng.pareto(1.5, n))
    elif family.integer:
        least = max(1, int(np.ceil(low)))
        ability = rng.integers(least, max(least, int(high)) + 1, n).astype(np.float64)
    else:
        ability = rng.uniform(low, high, n)
    return np.maximum(1.0, np.round(ability)) if family.integer else ability


def _workloads(family: Family, ability: float, rng: np.random.Generator) -> FloatArray:
    m = family.tasks
    if family.workload is Distribution.EQUAL:
        weight = np.ones(m)
    elif family.workload is Distribution.UNIFORM:
        weight = rng.uniform(0.1, 1.0, m)
    elif family.workload is Distribution.DIRICHLET:
        weight = rng.gamma(2.0, 1.0, m)  # normalised, this is Dirichlet(2)
    elif family.workload is Distribution.LOGNORMAL:
        weight = rng.lognormal(0.0, 1.0, m)
    else:
        weight = 1 + rng.pareto(1.5, m)
    share, total = weight / weight.sum(), family.load * ability
    return _whole(share, max(m, round(total))) if family.integer else share * total


def _whole(share: FloatArray, total: int) -> FloatArray:
    """Round `total` times `share` to integers >= 1 with this total, by largest remainders."""
    exact = share * (total - len(share))
    whole = np.floor(exact)
    left = int(total - len(share) - whole.sum())
    whole[np.argsort(whole - exact, kind="stable")[:left]] += 1
    return whole + 1


def _places(family: Family, count: int, centres: FloatArray, rng: np.random.Generator) -> FloatArray:
    if family.sites is Sites.UNIFORM:
        return rng.random((count, family.dimensions)) * family.world_size
    around = centres[rng.integers(0, len(centres), count)]
    return np.clip(rng.normal(around, 0.05 * family.world_size), 0.0, family.world_size)


def _draw(spread: Spread, count: int, rng: np.random.Generator) -> FloatArray | None:
    if spread is None:
        return None
    return rng.uniform(*spread, count) if isinstance(spread, tuple) else np.full(count, float(spread))


def _allowed(family: Family, rng: np.random.Generator) -> list[IntArray]:
    """Return a random set of tasks per agent, drawn in blocks to limit memory."""
    n, m = family.agents, family.tasks
    size, block = max(1, round(family.allowed_fraction * m)), max(1, 1_000_000 // m)
    lists: list[IntArray] = []
    for first in range(0, n, block):
        order = np.argsort(rng.random((min(block, n - first), m)), axis=1)
        lists.extend(np.sort(order[:, :size], axis=1))
    return lists
