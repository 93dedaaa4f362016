"""Random instances of machine covering, P||Cmin and Q||Cmin: few agents per task, and a wide range of abilities."""

import numpy as np

from alloc.problems import arguments
from alloc.problems.fields import IntArray
from alloc.problems.instance import Instance

EQUAL_WORKLOAD = 1000
"""Workload of every task if all are equal."""

WORKLOADS = (200, 2000)
"""Smallest and largest workload if they differ."""


def machine_covering(
    agents: int,
    tasks: int,
    low: int,
    high: int,
    seed: int,
    *,
    equal: bool = True,
    whole: bool = True,
    choices: int | None = None,
) -> Instance:
    """Return an instance without places, with abilities U[low, high] and workloads of 1000 or U[200, 2000].

    ``numpy.random.default_rng([agents, tasks, low, high, seed])`` draws first the abilities, by ``integers`` (ends
    included) or ``uniform``, and then the workloads, by ``integers``, so that instances with equal and unequal
    workloads have the same abilities.

    Parameters
    ----------
    agents, tasks : int
        Numbers of agents and tasks, >= 1.
    low, high : int
        Range of the abilities, 1 <= low <= high.
    seed : int
        Random seed, >= 0.
    equal : bool
        Whether all workloads are 1000.
    whole : bool
        Whether abilities are whole numbers.
    choices : int, optional
        Number of tasks that each agent may take, by default all: agent i may take task i modulo m, and others drawn by
        ``numpy.random.default_rng([agents, tasks, seed])``, possibly including that task again.

    Raises
    ------
    InputError
        If a number is out of its range.

    References
    ----------
    Families of abilities as in Haouari and Jemmali (2008), doi:10.1007/s10288-007-0053-5, and Walter, Wirth and
    Lawrinenko (2017), doi:10.1007/s10951-016-0477-x, for equal workloads; the unequal ones are ours.
    """
    agents, tasks = arguments.whole(agents, "agents", 1), arguments.whole(tasks, "tasks", 1)
    low = arguments.whole(low, "low", 1)
    high, seed = arguments.whole(high, "high", low), arguments.whole(seed, "seed")
    equal, whole = arguments.flag(equal, "equal"), arguments.flag(whole, "whole")
    others = None if choices is None else arguments.whole(choices, "choices", 1, tasks) - 1
    rng = np.random.default_rng([agents, tasks, low, high, seed])
    ability = rng.integers(low, high, agents, endpoint=True) if whole else rng.uniform(low, high, agents)
    unequal = rng.integers(*WORKLOADS, tasks, endpoint=True)
    kind = f"{'' if whole else 'real-'}{'equal' if equal else 'unequal'}"
    prefix = "" if others is None else "restricted-"
    return Instance(
        name=f"{prefix}covering-{agents}x{tasks}-{low}-{high}-{kind}-seed-{seed}",
        ability=ability,
        workload=np.full(tasks, EQUAL_WORKLOAD) if equal else unequal,
        allowed_tasks=None if others is None else _lists(agents, tasks, others, seed),
    )


def _lists(agents: int, tasks: int, others: int, seed: int) -> list[IntArray]:
    rng = np.random.default_rng([agents, tasks, seed])
    return [np.unique(np.append(i % tasks, rng.choice(tasks, others, replace=False))) for i in range(agents)]
