"""Hypothesis strategies: tiny instances of every kind, and allocations for them."""

import numpy as np
from hypothesis import strategies as st

from alloc.problems import Allocation, Instance


@st.composite
def instances(draw: st.DrawFn, *, most_agents: int = 5, most_tasks: int = 4, speeds: bool = True) -> Instance:
    """Draw an instance small enough for brute force.

    Abilities and workloads are whole or not, workloads may be 0, places and start tasks may be missing, and there may
    be ranges, batteries, lists of tasks and, with `speeds`, travel times.
    """
    n, m = draw(st.integers(1, most_agents)), draw(st.integers(1, most_tasks))
    whole = draw(st.booleans())
    ability = st.integers(1, 6) if whole else st.floats(0.25, 8)
    workload = st.one_of(st.just(0), st.integers(1, 12) if whole else st.floats(0.25, 12))
    coordinate = st.sampled_from([0.0, 0.5, 1.0, 2.0])
    place = st.one_of(st.just((np.nan,) * 3), st.tuples(coordinate, coordinate, coordinate))
    limit = st.one_of(st.just(np.inf), st.sampled_from([0.0, 0.5, 1.0, 2.5]))
    lists = st.one_of(st.none(), st.lists(st.integers(0, m - 1), unique=True))
    speed = st.one_of(st.just(np.inf), st.sampled_from([0.25, 1.0, 3.0]))

    def each(strategy: st.SearchStrategy, count: int) -> list:
        return draw(st.lists(strategy, min_size=count, max_size=count))

    def maybe(strategy: st.SearchStrategy) -> list | None:
        return each(strategy, n) if draw(st.booleans()) else None

    return Instance(
        ability=each(ability, n),
        workload=each(workload, m),
        agent_position=each(place, n),
        task_position=each(place, m),
        start_task=each(st.integers(-1, m - 1), n),
        battery=maybe(limit),
        communication_range=maybe(limit),
        speed=maybe(speed) if speeds else None,
        allowed_tasks=maybe(lists),
        energy_per_distance=draw(st.sampled_from([0.0, 1.0, 6.0])),
    )


@st.composite
def allocated(draw: st.DrawFn, *, speeds: bool = True) -> tuple[Instance, Allocation]:
    """Draw an instance, and an allocation that may break its rules."""
    instance = draw(instances(speeds=speeds))
    tasks = draw(st.lists(st.integers(-1, instance.m - 1), min_size=instance.n, max_size=instance.n))
    return instance, Allocation(tasks)


def rebuilt(instance: Instance, agents: np.ndarray, tasks: np.ndarray, scale: float = 1.0) -> Instance:
    """Return `instance` with agents and tasks in another order (or fewer), and workloads times `scale`."""
    place = np.full(instance.m + 1, -1)
    place[tasks] = np.arange(len(tasks))
    lists = instance.allowed_tasks
    return Instance(
        ability=instance.ability[agents],
        workload=instance.workload[tasks] * scale,
        agent_position=instance.start_position[agents],
        task_position=instance.task_position[tasks],
        battery=instance.battery[agents],
        communication_range=instance.communication_range[agents],
        speed=instance.speed[agents],
        allowed_tasks=None
        if lists is None
        else [None if lists[i] is None else [j for j in place[lists[i]] if j >= 0] for i in agents],
        tau=instance.tau,
        energy_per_distance=instance.energy_per_distance,
    )
