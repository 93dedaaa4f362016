"""Random instances small enough for brute force, with all fields of an instance."""

from collections.abc import Callable, Collection
from itertools import count, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from alloc.problems import DistanceTable, Instance, fewest_unserved

FloatArray = NDArray[np.float64]


def tiny_instance(seed: int) -> Instance:
    """Return instance number `seed`: at most 5 agents and 4 tasks; each feature is there about every other time."""
    rng = np.random.default_rng([2025, seed])
    n, m = int(rng.integers(1, 6)), int(rng.integers(1, 5))
    coin = rng.random(9) < 0.5
    whole = coin[0]
    ability = rng.integers(1, 5, n) if whole else rng.uniform(0.5, 4, n).round(int(rng.choice([1, 2, 12])))
    workload = rng.integers(1, 12, m).astype(float) if whole or coin[1] else rng.uniform(0.5, 12, m)
    workload[rng.random(m) < (0.3 if coin[2] else 0.0)] = 0
    task_position, agent_position = rng.random((m, 3)), rng.random((n, 3))
    task_position[rng.random(m) < (0.3 if coin[3] else 0.0)] = np.nan
    start = np.full(n, -1) if coin[4] else rng.integers(-1, m, n)
    agent_position[(start >= 0) | (rng.random(n) < (0.3 if coin[3] else 0.0))] = np.nan
    lists = [rng.choice(m, int(rng.integers(1, m + 1)), replace=False).tolist() for _ in range(n)]
    return Instance(
        name=f"tiny-{seed}",
        ability=ability,
        workload=workload,
        agent_position=agent_position,
        task_position=task_position,
        start_task=start,
        battery=rng.uniform(1, 5, n) if coin[5] else None,
        communication_range=np.where(rng.random(n) < 0.5, rng.uniform(0.3, 1.2, n), np.inf) if coin[6] else None,
        allowed_tasks=[entry if rng.random() < 0.5 else None for entry in lists] if coin[7] else None,
        speed=np.where(rng.random(n) < 0.7, rng.uniform(0.2, 3, n), np.inf) if coin[8] else None,
        energy_per_distance=float(rng.choice([1.0, 6.0])),
    )


def scarce_instance(seed: int) -> Instance:
    """Return instance number `seed`: up to 5 agents, and up to 6 tasks of unequal priority, too many to serve."""
    for attempt in count():
        instance = _drawn_scarce(np.random.default_rng([2027, seed, attempt]), f"scarce-{seed}")
        if fewest_unserved(instance) and np.ptp(instance.priority[instance.workload > 0]) > 0:
            return instance
    raise AssertionError


def _drawn_scarce(rng: np.random.Generator, name: str) -> Instance:
    n, m = int(rng.integers(1, 6)), int(rng.integers(2, 7))
    coin = rng.random(6) < (0.5, 0.5, 0.5, 0.3, 0.3, 0.5)
    lists = [rng.permutation(m)[: rng.integers(1, 4)].tolist() if rng.random() < 0.5 else None for _ in range(n)]
    return Instance(
        name=name,
        ability=rng.choice([0.5, 1, 2, 20], n),
        workload=rng.choice([0, 1, 3, 30, 200], m, p=[0.1, 0.3, 0.2, 0.2, 0.2]),
        priority=rng.choice([0, 1, 2, 3, 5], m) if coin[0] else rng.random(m),
        agent_position=rng.random((n, 2)),
        task_position=rng.random((m, 2)),
        communication_range=rng.uniform(0.2, 1.2, n) if coin[1] else None,
        allowed_tasks=lists if coin[2] else None,
        battery=rng.uniform(0.2, 2, n) if coin[3] else None,
        speed=rng.choice([0.3, 2.0, np.inf], n) if coin[4] else None,
        agent_energy_per_distance=rng.choice([0.5, 1, 2], n) if coin[5] else None,
    )


FIELDS = ("metric", "distances", "rates", "returns", "skills", "speeds", "limits", "bases")
"""What `varied_instance` can give an instance beyond abilities, workloads and places."""


def varied_instance(seed: int, fields: Collection[str] | None = None) -> Instance:
    """Return instance number `seed`: at most 5 agents and 4 tasks, with some of `FIELDS`, or with those named."""
    rng = np.random.default_rng([2026, seed])
    n, m = int(rng.integers(2, 6)), int(rng.integers(2, 5))
    drawn = {name for name in FIELDS if rng.random() < 0.5}
    has = drawn if fields is None else set(fields)
    metric = str(rng.choice(["manhattan", "geographic"])) if "metric" in has else "euclidean"
    corner, size = (
        (np.array([179.9, 88.0]), np.array([0.3, 1.0])) if metric == "geographic" else (np.zeros(2), np.ones(2))
    )
    start = rng.integers(-1, m, n)
    agent_position = corner + size * rng.random((n, 2))
    agent_position[start >= 0] = np.nan
    whole = rng.random() < 0.5
    ids = [f"a{i + 1}" for i in range(n)], [f"t{j + 1}" for j in range(m)]
    unit = 30.0 if metric == "geographic" else 1.0
    homes = _homes(rng, n, corner, size) if "bases" in has else {}
    bases = list(homes.get("bases", ()))
    returns = rng.random(n) < 0.5 if "returns" in has else np.zeros(n, dtype=bool)
    return Instance(
        name=f"varied-{seed}",
        ability=rng.integers(1, 5, n) if whole else rng.uniform(0.5, 4, n),
        workload=rng.integers(1, 12, m) if whole else rng.uniform(0.5, 12, m),
        agent_position=agent_position,
        task_position=corner + size * rng.random((m, 2)),
        start_task=start,
        battery=rng.uniform(0.5, 6, n) * unit if "limits" in has else None,
        communication_range=rng.uniform(0.4, 2, n) * unit if "limits" in has else None,
        speed=np.where(rng.random(n) < 0.7, rng.uniform(0.2, 3, n) * unit, np.inf) if "speeds" in has else None,
        energy_per_distance=float(rng.choice([0.0, 1.0, 6.0] if "rates" in has else [1.0, 6.0])),
        agent_energy_per_distance=rng.choice([0.0, 0.5, 2.0, np.nan], n) if "rates" in has else None,
        **homes,
        returns=returns | (np.array(homes.get("return_base", [-1] * n)) >= 0),
        skills=[rng.permutation(["camera", "pump"])[: rng.integers(0, 3)].tolist() for _ in range(n)]
        if "skills" in has
        else None,
        needs=[["camera", "pump"][: rng.integers(0, 3)] for _ in range(m)] if "skills" in has else None,
        metric=metric,
        distances=_table(rng, *ids, bases, unit) if "distances" in has else None,
        allowed_tasks=[rng.permutation(m)[:2].tolist() if rng.random() < 0.3 else None for _ in range(n)],
    )


def _homes(rng: np.random.Generator, n: int, corner: FloatArray, size: FloatArray) -> dict[str, Any]:
    """Return two bases, one of them sometimes nowhere, and which agents return to which."""
    places = (corner + size * rng.random((2, 2))).tolist()
    bases = {"north": places[0], "south": places[1] if rng.random() < 0.8 else None}
    return {"bases": bases, "return_base": rng.integers(-1, 2, n).tolist()}


def _table(
    rng: np.random.Generator, agents: list[str], tasks: list[str], bases: list[str], unit: float
) -> DistanceTable:
    """Return some distances from agents, from tasks and back, either all that there are or some among others."""
    places = agents + tasks + bases
    pairs = [(one, other) for one in places for other in places if one != other]
    pairs = [pair for pair in pairs if set(pair) & set(tasks) and rng.random() < 0.4]
    rows = [(*pair, float(rng.uniform(0, 1.5)) * unit) for pair in pairs]
    return DistanceTable.of(rows, agents, tasks, missing=str(rng.choice(["metric", "unreachable"])), base_ids=bases)


def seeds_where(holds: Callable[[Instance], bool], number: int) -> list[int]:
    """Return the first seeds whose instances a test is about, so that it says something of each."""
    return list(islice((seed for seed in count() if holds(tiny_instance(seed))), number))


def all_can_be_served(instance: Instance) -> bool:
    """Whether there is work, and a plan that does all of it."""
    return bool((instance.workload > 0).any()) and fewest_unserved(instance) == 0


def scaled_instance(seed: int) -> Instance:
    """Return instance number `seed` in units of its own: places and workloads from 1e-9 to 1e9, abilities far apart."""
    rng = np.random.default_rng([1901, seed])
    n, m = int(rng.integers(2, 6)), int(rng.integers(1, 4))
    far, much = 10.0 ** rng.integers(-9, 10), 10.0 ** rng.integers(-9, 10)
    coin = rng.random(6) < (0.5, 0.3, 0.5, 0.3, 0.3, 0.5)
    position = rng.integers(0, 8, (n + m, 2)) * 1.0 if coin[0] else rng.random((n + m, 2))
    if coin[1]:
        position *= 10.0 ** rng.integers(-6, 1, (n + m, 1))
    ability = rng.integers(1, 4, n) * 1.0 if coin[2] else rng.uniform(0.5, 4, n)
    if coin[3]:
        ability *= 10.0 ** rng.integers(-10, 1, n)
    return Instance(
        name=f"scaled-{seed}",
        ability=ability,
        workload=rng.integers(1, 12, m) * much,
        agent_position=position[:n] * far,
        task_position=position[n:] * far,
        speed=np.where(rng.random(n) < 0.7, rng.uniform(0.2, 3, n) * far / much, np.inf) if coin[4] else None,
        energy_per_distance=6.0 if coin[5] else 1.0,
    )


def long_travel(seed: int) -> Instance:
    """Return 160 equal agents for whom a flight to one of 5 equal tasks takes about as long as the work there."""
    rng = np.random.default_rng(seed)
    world = [1400, 1000]
    return Instance(
        ability=np.ones(160),
        workload=np.full(5, 1000.0),
        agent_position=rng.uniform(0, 1, (160, 2)) * world,
        task_position=rng.uniform(0, 1, (5, 2)) * world,
        battery=rng.uniform(30, 100, 160),
        speed=np.full(160, 10.0),
        energy_per_distance=0.05,
    )
