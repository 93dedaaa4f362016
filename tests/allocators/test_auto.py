import numpy as np
import pytest

from alloc.allocators import Budget
from alloc.allocators.auto import choose
from alloc.problems import Instance, Objective


def scattered(n: int, m: int, *, speed: float | None = None) -> Instance:
    """Every agent has an ability and a location of its own: as many classes as agents."""
    rng = np.random.default_rng(0)
    return Instance(
        ability=rng.uniform(1, 9, n),
        workload=rng.uniform(1, 9, m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
        speed=None if speed is None else np.full(n, speed),
    )


@pytest.mark.parametrize(
    ("n", "m", "speed", "objective", "seconds", "expected"),
    [
        (20, 5, None, "makespan", 10, "cpsat"),
        (20, 5, None, "makespan-energy", 10, "milp"),
        (500, 50, None, "makespan", 3, "cpsat"),
        (500, 50, None, "makespan-energy", 3, "milp"),
        (500, 50, None, "makespan-energy", 30, "milp"),
        (2000, 200, None, "makespan", 1, "local-search"),
        (2000, 200, None, "makespan-energy", 1, "local-search"),
        (200, 20, 1.0, "makespan", 10, "cpsat"),
        (200, 20, 1.0, "makespan-energy", 10, "milp"),
        (2000, 200, 1.0, "makespan", 1, "local-search"),
        (3000, 1000, None, "makespan", 10, "local-search"),
    ],
)
def test_choice_follows_size_budget_and_objective(
    n: int, m: int, speed: float | None, objective: str, seconds: float, expected: str
) -> None:
    """Small instances go to a solver, larger ones to local search, also with travel times."""
    method, reason = choose(scattered(n, m, speed=speed), Objective(objective), Budget(seconds))
    assert method == expected
    assert " for " in reason


def test_equal_agents_count_once() -> None:
    """Ten thousand agents of two classes are a small model."""
    instance = Instance(ability=np.tile([1.0, 2.0], 5000), workload=np.full(40, 100.0))
    assert choose(instance, Objective.MAKESPAN, Budget(1.0))[0] == "cpsat"


def test_longer_limits_favour_exact_methods() -> None:
    """With a minute or without a limit, a solver is picked for an instance for which it is not within a second."""
    instance = scattered(1000, 100)
    picks = [choose(instance, Objective.MAKESPAN_ENERGY, Budget(seconds))[0] for seconds in (1.0, 60.0, None)]
    assert picks == ["local-search", "milp", "milp"]


def test_reason_is_grammatical_for_one_and_many_pairs() -> None:
    """One agent and one task are "1 pair", and the time has few digits."""
    one = Instance(ability=[1], workload=[1])
    assert choose(one, Objective.MAKESPAN, Budget(0.0308532))[1].startswith(
        "1 pair of agent class and task, few enough for a proof, or a small gap, in 0.0309 s"
    )
