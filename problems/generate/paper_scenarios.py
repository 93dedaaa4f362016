"""Random instances of the paper's four scenarios, and similar ones of other sizes."""

from dataclasses import dataclass

import numpy as np

from alloc.problems.arguments import real, shown, whole
from alloc.problems.errors import InputError
from alloc.problems.instance import Instance, IntArray


@dataclass(frozen=True)
class Scenario:
    """A scenario of the paper: sizes, total of abilities and of workloads, and battery (ours)."""

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
        Random seed, >= 0.

    Raises
    ------
    InputError
        If `scenario` or `seed` is out of its range.

    References
    ----------
    Fang et al. (2025), section 5, doi:10.20944/preprints202502.0192.v1. Sizes and totals are the paper's; the unit
    cube, the distribution of workloads, 6 units of energy per unit of distance, the batteries and tau are ours.
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
    """Return a random instance like those of the paper, of any size.

    Parameters
    ----------
    agents, tasks : int
    total : int
        Sum of all abilities (integers from 1 to 10), and of all workloads (distinct positive integers).
    seed : int
    battery : float
        Battery of each agent; a unit of distance costs 6.
    name : str, optional

    Raises
    ------
    InputError
        If no such abilities or workloads exist.
    """
    agents, tasks, total = whole(agents, "agents", 1), whole(tasks, "tasks", 1), whole(total, "total")
    real(battery, "battery")
    if not agents <= total <= 10 * agents:
        raise InputError(f"must be from 1 to 10 per agent, got {total} for {agents} agents", "total")
    if tasks * (tasks + 1) // 2 > total:
        raise InputError(f"must be at least {tasks * (tasks + 1) // 2} for {tasks} distinct workloads", "total")
    rng = np.random.default_rng(whole(seed, "seed"))
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


def _abilities_summing_to(total: int, agents: int, rng: np.random.Generator) -> IntArray:
    """Return integers from 1 to 10: uniform, then changed by 1 at random agents until the sum is right."""
    ability = rng.integers(1, 11, agents)
    while (gap := total - int(ability.sum())) != 0:
        moves = np.bincount(rng.integers(0, agents, abs(gap)), minlength=agents)
        ability = np.clip(ability + np.sign(gap) * moves, 1, 10)
    return ability


def _distinct_workloads(total: int, tasks: int, rng: np.random.Generator) -> IntArray:
    """Return distinct positive integers: 1, 2, ..., m plus Dirichlet(2) shares of the remainder."""
    spare = total - tasks * (tasks + 1) // 2
    spread = np.sort(np.floor(rng.dirichlet(np.full(tasks, 2.0)) * spare).astype(np.int64))
    spread += np.arange(1, tasks + 1)
    spread[-1] += total - spread.sum()
    return rng.permutation(spread)
