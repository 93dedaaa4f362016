"""Metrics, given distances, rates and flights back give the same results without a table of all pairs."""

from collections.abc import Iterator
from unittest.mock import patch

import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import varied_instance

from alloc.allocators import load, solve
from alloc.allocators.heuristic.greedy import list_schedule
from alloc.allocators.heuristic.local_search import candidates, instance_arrays
from alloc.problems import Objective, evaluate, makespan_lower_bound
from alloc.problems.distances import reach


@pytest.fixture
def tableless() -> Iterator[None]:
    """Let no reach have a table, and greedy and local search none either."""
    with (
        patch.object(reach, "TABLE_LIMIT", -1),
        patch.object(candidates, "TABLE_LIMIT", -1),
        patch.object(instance_arrays, "TABLE_LIMIT", -1),
        patch.object(list_schedule, "MAX_SCANNED", -1),
    ):
        yield


@pytest.mark.usefixtures("tableless")
@pytest.mark.parametrize("seed", range(120))
def test_pairs_agree_with_the_table(seed: int) -> None:
    """Distances, costs, reachability, and the neighbours of each origin agree."""
    lazy = varied_instance(seed).reach
    assert not lazy.has_table
    agents, tasks = np.indices((len(lazy.origin), len(lazy.goal))).reshape(2, -1)
    near, origins = lazy.neighbours, np.arange(len(lazy.place))
    with patch.object(reach, "TABLE_LIMIT", 1000):
        full = varied_instance(seed).reach
        np.testing.assert_allclose(lazy.distances_between(lazy.origin[agents], tasks), full.distance_of(agents, tasks))
        expected_mask, expected_cost = full.allows(agents, tasks), full.cost_of(agents, tasks)
    np.testing.assert_array_equal(lazy.allows(agents, tasks), expected_mask)
    np.testing.assert_allclose(lazy.cost_of(agents, tasks), expected_cost)
    pairs = set(zip(near.origin.tolist(), near.task.tolist(), strict=True))
    assert pairs == {
        (int(lazy.origin[a]), int(t)) for a, t, able in zip(agents, tasks, expected_mask, strict=True) if able
    }
    np.testing.assert_allclose(near.distance, lazy.distances_between(near.origin, near.task))
    assert len(origins) == len(near.first) - 1


@pytest.mark.usefixtures("tableless")
@pytest.mark.parametrize("method", ["greedy", pytest.param("local-search", marks=pytest.mark.slow)])
def test_methods_without_a_table_match_brute_force(method: str) -> None:
    """They serve as many tasks as brute force, with feasible plans and the same energy."""
    allocator = load(method)
    for seed in range(16):
        instance = varied_instance(seed)
        best = brute_force(instance)
        result = solve(instance, allocator, objective=Objective.MAKESPAN_ENERGY, time_limit_s=None, iterations=5)
        score = evaluate(varied_instance(seed), result.allocation)
        assert not score.violations
        assert len(score.unserved_tasks) == best.unserved
        assert score.served_makespan >= best.makespan * (1 - 1e-9)
        assert score.energy == pytest.approx(result.energy)
        if not best.unserved:
            assert makespan_lower_bound(instance) <= best.makespan * (1 + 1e-9)
