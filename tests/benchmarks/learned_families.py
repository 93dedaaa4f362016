"""Instances that learned methods are measured on: the paper's scenarios, and kinds that no policy was trained on.

Seeds are small here, while training and validation draw theirs from 10^9 on.
"""

from collections.abc import Callable

from alloc.problems import Family, Instance, paper, paper_like, random_instance

Maker = Callable[[int], Instance]

PAPER: dict[str, Maker] = {
    f"paper-{number}": lambda seed, number=number: paper(number, seed) for number in (1, 2, 3, 4)
}


def _random(**options: object) -> Maker:
    family = Family(**{"agents": 300, "tasks": 30, "battery": 30.0, **options})  # type: ignore[arg-type]
    return lambda seed: random_instance(family, seed)


LARGE: dict[str, Maker] = {
    "2000/100": lambda seed: paper_like(2000, 100, 9600, seed, battery=30.0),
    "5000/200": lambda seed: paper_like(5000, 200, 24000, seed, battery=30.0),
}
"""Like the paper's scenarios 3 and 4: 4.8 units of ability per agent."""

UNSEEN: dict[str, Maker] = {
    **LARGE,
    "clustered": _random(sites="clustered", starts="own"),
    "real-valued": _random(integer=False),
    "lognormal": _random(ability="lognormal", ability_max=100.0, workload="lognormal", integer=False),
    "pareto": _random(ability="pareto", integer=False),
    "ability 0.7": _random(load=1 / 0.7),
    "ability 2": _random(load=0.5),
    "ranges, cube": _random(communication_range=0.25),
    "ranges, plane": _random(communication_range=0.25, starts="own", dimensions=2),
    "speeds 0.5-2": _random(speed=(0.5, 2.0), starts="own", agents=100, tasks=20),
    "speeds 2-8": _random(speed=(2.0, 8.0), starts="own"),
}
"""300 agents and 30 tasks where nothing else is said; ranges are a quarter of the world's side, speeds sides an hour.

Abilities are 1 to 10 or, heavy-tailed, lognormal (95 % from 1 to 100) or Pareto of shape 1.5, without a variance.
"""

ALL: dict[str, Maker] = {**PAPER, **UNSEEN}
