"""Seeded instances: the four scenarios of the paper, and those of a general family."""

from dataclasses import dataclass

import numpy as np

from alloc.problems.arguments import of_type, real, shown, whole
from alloc.problems.errors import InputError
from alloc.problems.generate.family import Distribution, Family, Sites, Spread, Starts
from alloc.problems.instance import FloatArray, Instance, IntArray


@dataclass(frozen=True)
class Scenario:
    """One scenario of the paper: sizes, total of all abilities and of all workloads, and battery (ours)."""

    agents: int
    tasks: int
    total: int
    battery: float


SCENARIOS = {
    1: Scenario(100, 20, 400, 20.0),
    2: Scenario(300, 30, 1200, 30.0),
    3: Scenario(500, 30, 2400, 30.0),
    4: Scenario(500, 50, 2400, 30.0),
}


def paper(scenario: int, seed: int) -> Instance:
    """Return an instance of one of the paper's four scenarios.

    Parameters
    ----------
    scenario : int
        1 to 4.
    seed : int
        Source of all randomness, >= 0.

    Raises
    ------
    InputError
        If `scenario` or `seed` is out of its range.

    References
    ----------
    Fang et al. (2025), section 5, doi:10.20944/preprints202502.0192.v1. Sizes and totals are the paper's; the unit
    cube, the spread of the workloads, 6 units of energy per unit of distance, the batteries and tau are ours.
    """
    if isinstance(scenario, bool) or not isinstance(scenario, int | np.integer) or scenario not in SCENARIOS:
        raise InputError(f"must be 1, 2, 3 or 4, got {shown(scenario)}", "scenario")
    sizes = SCENARIOS[scenario]
    return paper_like(
        sizes.agents, sizes.tasks, sizes.total, seed, battery=sizes.battery, name=f"paper-{scenario}-seed-{seed}"
    )


def paper_like(
    agents: int, tasks: int, total: int, seed: int, *, battery: float = 20.0, name: str | None = None
) -> Instance:
    """Return an instance like those of the paper, of any size.

    Parameters
    ----------
    agents, tasks : int
    total : int
        Sum of all abilities (whole numbers from 1 to 10), and of all workloads (distinct positive whole numbers).
    seed : int
    battery : float
        Energy of each agent; a unit of distance costs 6.
    name : str, optional

    Raises
    ------
    InputError
        If no such abilities or workloads exist.
    """
    agents, tasks, total = whole(agents, "agents", 1), whole(tasks, "tasks", 1), whole(total, "total")
    real(battery, "battery")
    if not agents <= total <= 10 * agents:
        raise InputError(f"must lie from 1 to 10 per agent, got {total} for {agents} agents", "total")
    if tasks * (tasks + 1) // 2 > total:
        raise InputError(f"must be at least {tasks * (tasks + 1) // 2} for {tasks} distinct workloads", "total")
    rng = _generator(seed)
    return Instance(
        name=name if name is not None else f"paper-like-{agents}x{tasks}-seed-{seed}",
        ability=_abilities_summing_to(total, agents, rng),
        workload=_distinct_workloads(total, tasks, rng),
        task_position=rng.random((tasks, 3)),
        start_task=rng.integers(0, tasks, agents),
        battery=np.full(agents, battery),
        energy_per_distance=6.0,
        tau=0.5,
    )


def random_instance(family: Family, seed: int, *, name: str | None = None) -> Instance:
    """Return a random instance of `family`; the same seed gives the same instance.

    Parameters
    ----------
    family : Family
    seed : int
        Seed of all random numbers, >= 0.
    name : str, optional
        Name of the instance.
    """
    of_type(family, Family, "family")
    rng = _generator(seed)
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


def _generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(whole(seed, "seed"))


def _abilities_summing_to(total: int, agents: int, rng: np.random.Generator) -> IntArray:
    """Whole numbers from 1 to 10: uniform at first, then moved by 1 at random agents until the sum is right."""
    ability = rng.integers(1, 11, agents)
    while (gap := total - int(ability.sum())) != 0:
        moves = np.bincount(rng.integers(0, agents, abs(gap)), minlength=agents)
        ability = np.clip(ability + np.sign(gap) * moves, 1, 10)
    return ability


def _distinct_workloads(total: int, tasks: int, rng: np.random.Generator) -> IntArray:
    """Distinct positive whole numbers: a Dirichlet(2) spread over the staircase 1, 2, ..., m."""
    spare = total - tasks * (tasks + 1) // 2
    spread = np.sort(np.floor(rng.dirichlet(np.full(tasks, 2.0)) * spare).astype(np.int64))
    spread += np.arange(1, tasks + 1)
    spread[-1] += total - spread.sum()
    return rng.permutation(spread)


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
        weight = rng.gamma(2.0, 1.0, m)  # in proportion, that is Dirichlet(2)
    elif family.workload is Distribution.LOGNORMAL:
        weight = rng.lognormal(0.0, 1.0, m)
    else:
        weight = 1 + rng.pareto(1.5, m)
    share, total = weight / weight.sum(), family.load * ability
    return _whole(share, max(m, round(total))) if family.integer else share * total


def _whole(share: FloatArray, total: int) -> FloatArray:
    """Round `total` times `share` to whole numbers >= 1 of this total, by the largest remainder."""
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
    """One random set of tasks per agent, drawn in blocks to bound the memory."""
    n, m = family.agents, family.tasks
    size, block = max(1, round(family.allowed_fraction * m)), max(1, 1_000_000 // m)
    lists: list[IntArray] = []
    for first in range(0, n, block):
        order = np.argsort(rng.random((min(block, n - first), m)), axis=1)
        lists.extend(np.sort(order[:, :size], axis=1))
    return lists
