"""More tasks than agents can serve: every method serves the right ones, and reports what is proven."""

from functools import cache

import numpy as np
import pytest
from oracle import brute_force

from alloc.allocators import Allocator, Status, load, solve
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, Instance

METHODS = ("auto", "greedy", "local-search", "lp-round", "hedonic", "auction", "ga", "cpsat", "milp", "gappo")
EXACT = ("auto", "cpsat", "milp")


@pytest.fixture(scope="module", params=METHODS)
def method(request: pytest.FixtureRequest) -> tuple[str, str | Allocator]:
    """Each method by name, and loaded."""
    return request.param, "auto" if request.param == "auto" else load(request.param)


@cache
def scarce(seed: int) -> Instance:
    """Draw a small instance with short ranges, some speeds and lists of tasks, where agents lack as a rule."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 5)), int(rng.integers(4, 6))
    lists = [None if rng.random() < 0.7 else rng.permutation(m)[:2].tolist() for _ in range(n)]
    return Instance(
        ability=rng.choice([0.5, 1, 2, 20], n),
        workload=rng.choice([0, 1, 3, 30, 200], m),
        agent_position=rng.random((n, 2)),
        task_position=rng.random((m, 2)),
        communication_range=rng.uniform(0.2, 0.8, n),
        speed=rng.choice([0.3, 2.0, np.inf], n) if seed % 3 == 0 else None,
        allowed_tasks=lists,
    )


def test_smallest_tasks_are_served_with_complete_reach(method):
    """The optimum of n agents for more tasks: the n smallest workloads and the abilities, both sorted."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        n, m = int(rng.integers(2, 40)), int(rng.integers(41, 200))
        instance = Instance(ability=rng.uniform(1, 10, n), workload=rng.pareto(1.5, m) + 0.1)
        best = (np.sort(instance.workload)[:n] / np.sort(instance.ability)).max()
        result = solve(instance, method[1], time_limit_s=None, iterations=3)
        assert result.evaluation.served_makespan == pytest.approx(best)
        assert len(result.evaluation.unserved_tasks) == m - n
        assert (result.makespan, result.lower_bound, result.gap) == (None, None, None)
        assert "no plan that serves as many tasks has a shorter makespan" in result.notes[-1]


@pytest.mark.parametrize("objective", ["makespan", "makespan-energy"])
def test_short_reach_matches_brute_force(method, objective):
    """Exact methods equal brute force, with the same energy; the others are at most 1.5 times slower."""
    name, allocator = method
    for seed in range(12):
        instance = scarce(seed)
        if instance.has_travel_time and not (name == "auto" or BUILT_IN[name].finite_speeds):
            continue
        best = brute_force(instance)
        result = solve(
            instance, allocator, objective=objective, time_limit_s=None if name in EXACT else 5, iterations=10
        )
        score = result.evaluation
        assert not score.violations
        assert len(score.unserved_tasks) == best.unserved
        assert score.served_makespan >= best.makespan * (1 - 1e-9)
        assert score.served_makespan <= best.makespan * (1 + 1e-6 if name in EXACT else 1.5)
        if name in EXACT and objective == "makespan-energy":
            assert score.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)


def test_start_that_serves_less_is_improved(method):
    """A warm start that serves the wrong tasks is improved, and all agents are within reach."""
    instance = scarce(5)
    best = brute_force(instance)
    start = Allocation(np.zeros(instance.n, dtype=int))
    result = solve(instance, method[1], start=start, time_limit_s=None, iterations=30)
    assert result.status is (Status.INFEASIBLE if best.unserved else result.status)
    assert len(result.evaluation.unserved_tasks) == best.unserved
    assert not result.evaluation.violations
