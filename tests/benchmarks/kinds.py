"""Realistic instances by kind and seed: ranges, batteries, lists, speeds, and abilities of several kinds."""

from collections.abc import Callable

import numpy as np

from alloc.problems import Instance, machine_covering, paper_like

Ends = tuple[float, float]
Maker = Callable[[int], Instance]


def plane(kind: str, agents: int, tasks: int, *, reach: Ends | None = None, battery: Ends | None = None,
          speed: Ends | None = None, most_listed: int | None = None) -> Maker:  # fmt: skip
    """Return a maker of instances in the unit square: abilities 1 to 10, workloads 5 to 80, places of one's own."""

    def make(seed: int) -> Instance:
        rng = np.random.default_rng([agents, tasks, seed])
        ability, workload = rng.integers(1, 10, agents, endpoint=True), rng.integers(5, 80, tasks, endpoint=True)
        places = rng.random((agents, 2)), rng.random((tasks, 2))
        ranges, batteries, speeds = (None if ends is None else rng.uniform(*ends, agents)
                                     for ends in (reach, battery, speed))  # fmt: skip
        sizes = () if most_listed is None else rng.integers(1, most_listed, agents, endpoint=True)
        lists = [np.sort(rng.choice(tasks, size, replace=False)) for size in sizes]
        return Instance(
            name=f"{kind}-{agents}x{tasks}-seed-{seed}", ability=ability, workload=workload, agent_position=places[0],
            task_position=places[1], communication_range=ranges, battery=batteries, speed=speeds,
            allowed_tasks=lists or None,
        )  # fmt: skip

    return make


VARIANTS: dict[str, Maker] = {
    "reach": plane("reach", 300, 40, reach=(0.15, 0.35)),
    "battery": plane("battery", 300, 40, battery=(0.1, 0.4)),
    "lists": plane("lists", 200, 40, most_listed=4),
    "speeds": plane("speeds", 200, 30, speed=(0.5, 2.0)),
    "slow": plane("slow", 200, 30, speed=(0.1, 0.5)),
    "real-equal": lambda seed: machine_covering(100, 40, 20, 50, seed, whole=False),
    "real": lambda seed: machine_covering(90, 30, 1, 100, seed, equal=False, whole=False),
    "covering": lambda seed: machine_covering(200, 50, 1, 1000, seed, equal=False),
    "many": plane("many", 5000, 100),
    "few": plane("few", 200, 5, speed=(0.5, 2.0)),
    "mixed": plane("mixed", 300, 30, reach=(0.3, 0.6), speed=(0.5, 2.0), battery=(0.3, 1.0), most_listed=12),
}

LARGE: dict[str, Maker] = {
    "2000/100": lambda seed: paper_like(2000, 100, 9600, seed, battery=30.0),
    "5000/200": lambda seed: paper_like(5000, 200, 24000, seed, battery=30.0),
}
"""Like the paper's scenarios 3 and 4: 4.8 units of ability per agent."""

KINDS = VARIANTS | LARGE
