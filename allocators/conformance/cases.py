"""Instances small enough to be solved by enumeration, each with a feature that is easy to get wrong."""

from functools import cache
from itertools import product
from typing import Any

import numpy as np

from alloc.problems import IDLE, Allocation, Evaluation, Instance, Objective, evaluate

NAN, INF = np.nan, np.inf


def _case(name: str, **changes: Any) -> Instance:
    """Return five agents of integer ability and three tasks, with `changes` of fields; None removes a field."""
    fields: dict[str, Any] = {
        "ability": (5, 3, 3, 2, 1),
        "workload": (6, 5, 3),
        "agent_position": ((0.5, 0.0), (3.0, 0.5), (1.0, 1.0), (0.0, 2.5), (4.0, 3.0)),
        "task_position": ((0.0, 0.0), (4.0, 0.0), (0.0, 3.0)),
    }
    return Instance(name=name, **fields | changes)


def _bare(name: str, **fields: Any) -> Instance:
    """Return an instance without positions."""
    return _case(name, **{"agent_position": None, "task_position": None} | fields)


CASES: dict[str, Instance] = {
    case.name: case
    for case in (
        _case("integer"),
        _case("real", ability=(0.731, 2.25, 1.9, 0.404, 1.11), workload=(1.37, 3.3, 0.951)),
        _case("ranges", communication_range=(3.0, 2.0, 1.5, 3.0, 4.5)),
        _case("batteries", battery=(9.0, 4.0, 5.0, INF, 12.0), energy_per_distance=2.5, tau=0.9),
        _case("allowed tasks", allowed_tasks=([0, 1], None, [2], [], [1, 2])),
        _case("zero workloads", workload=(0, 4, 0)),
        _bare("nothing to do", ability=(2, 1), workload=(0, 0)),
        _bare("fewer agents than tasks", ability=(3, 1), workload=(2, 5, 1, 4)),
        _bare("priorities", ability=(3, 1), workload=(2, 5, 1, 4), priority=(1, 3, 0, 3)),
        _bare(
            "urgent tasks compete",
            ability=(3, 2, 2),
            workload=(4, 1, 2, 5),
            priority=(1, 2, 5, 4),
            allowed_tasks=([0, 1], [2, 3], [2, 3]),
        ),
        _case("unreachable task", task_position=((0, 0), (4, 0), (99, 99)), communication_range=(9,) * 5),
        _bare("competing tasks", ability=(3, 2, 2), workload=(4, 1, 2), allowed_tasks=([0, 1], [2], [2])),
        _bare("one way to serve all", ability=(9, 1, 1), workload=(1, 5, 5), allowed_tasks=(None, [0], [0, 2])),
        _case(
            "missing positions",
            agent_position=((0.5, 0), (NAN, NAN), (1, 1), (NAN, NAN), (4, 3)),
            task_position=((0, 0), (NAN, NAN), (0, 3)),
            communication_range=(3.5,) * 5,
        ),
        _case("start tasks", agent_position=None, start_task=(0, 0, 2, 1, IDLE), battery=(4,) * 5),
        _case("alike", ability=(2,) * 5, workload=(7, 5, 5), agent_position=None, start_task=(0,) * 5),
        _bare("one agent, one task", ability=(2,), workload=(3,)),
        _bare("large numbers", ability=(7e8, 3e9, 2e9, 9e8), workload=(8e11, 5e11, 2e11), tau=0.01),
        _bare("small numbers", ability=(7e-9, 3e-8, 2e-8, 9e-9), workload=(8e-12, 5e-12, 2e-12)),
        _case("travel times", speed=(1.0, 2.0, 4.0, 2.0, 8.0)),
        _case("manhattan", metric="manhattan", communication_range=(4.0, 3.0, 2.0, 4.0, 6.0)),
        _case(
            "geographic", metric="geographic", task_position=((0, 89), (180, 89), (-179.9, 88)), energy_per_distance=0.1
        ),
        _case("one energy each", agent_energy_per_distance=(0.5, 2, 1, 0, 3), battery=(3,) * 5),
        _case("returns", returns=(True, False, True, True, False), battery=(6,) * 5),
        _case(
            "bases",
            bases={"north": (0, 4), "nowhere": None},
            return_base=(0, IDLE, 1, 0, IDLE),
            returns=(True, True, True, True, False),
            battery=(6.5,) * 5,
        ),
        _case("skills", skills=(["lift"], ["lift", "see"], ["see"], [], ["lift"]), needs=(["lift"], [], ["see"])),
        _case(
            "own distances", distances=(("a1", "t1", 9), ("a2", "t3", 0.5), ("t2", "a3", 2)), speed=(INF, 1, 2, 4, 8)
        ),
        _case("some travel times", speed=(INF, 0.5, 3.0, INF, 1.0), communication_range=(4,) * 5),
    )
}


def medium_case() -> Instance:
    """Return an instance that a greedy pass does not solve optimally, but an exact method solves quickly."""
    return _scattered("medium", 12, 4)


def large_case() -> Instance:
    """Return an instance that takes every method some time: real numbers, ranges, all agents different."""
    return _scattered("large", 150, 15)


def _scattered(name: str, n: int, m: int) -> Instance:
    rng = np.random.default_rng(20250101)
    return Instance(
        name=name,
        ability=rng.uniform(1, 10, n),
        workload=rng.uniform(10, 100, m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
        communication_range=rng.uniform(0.5, 1.2, n),
    )


@cache
def every_evaluation(case: str) -> tuple[Evaluation, ...]:
    """Return the scores of all allocations of a case that leave the fewest and least urgent tasks unserved."""
    instance = CASES[case]
    options = [[IDLE, *np.flatnonzero(row).tolist()] for row in instance.reach.mask[instance.reach.origin]]
    scores = [evaluate(instance, Allocation(choice)) for choice in product(*options)]
    fewest = min(score.unserved_rank for score in scores)
    return tuple(score for score in scores if score.unserved_rank == fewest)


@cache
def optimum(case: str, objective: Objective) -> Evaluation:
    """Return the scores of the optimal allocation of a case."""
    best, *others = every_evaluation(case)
    for score in others:
        if score.is_better_than(best, objective):
            best = score
    return best


def least_energy(case: str, makespan: float) -> float:
    """Return the least energy of the allocations of a case with at most this makespan."""
    return min(score.energy for score in every_evaluation(case) if score.served_makespan <= makespan * (1 + 1e-9))
