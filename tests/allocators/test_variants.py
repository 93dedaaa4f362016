"""Every method compared with brute force: metrics, custom distances, energy per agent, return flights and skills."""

from functools import cache

import numpy as np
import pytest
from oracle import brute_force, flight_energies, reachable
from tiny_instances import FIELDS, varied_instance

from alloc.allocators import load, solve
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, Instance, Objective, energy_lower_bound, evaluate, makespan_lower_bound
from alloc.problems.vocabulary import OBJECTIVES

EXACT = ("cpsat", "milp")
OTHERS = ("greedy", "local-search", "lp-round", "hedonic", "auction", "ga", "gappo", "gappo-ls")
TOGETHER = [None] * 9
ALONE = [{name} for name in FIELDS]
COMBINATIONS = [*ALONE, *TOGETHER]


@cache
def combined_instance(number: int) -> Instance:
    """Return the instance of a combination, the same for all methods, so that brute force solves it once."""
    return varied_instance(number, COMBINATIONS[number])


@pytest.mark.parametrize("seed", range(300))
def test_reach_and_scores_match_brute_force(seed: int) -> None:
    """Distances, reachability and energy of an allocation match the definitions."""
    instance = varied_instance(seed)
    distance, able = reachable(instance)
    energy = flight_energies(instance, distance)
    agents, tasks = np.indices((instance.n, instance.m)).reshape(2, -1)
    reach = instance.reach
    np.testing.assert_array_equal(reach.allows(agents, tasks), able.ravel())
    np.testing.assert_allclose(reach.distance_of(agents, tasks), distance.ravel(), rtol=1e-9, atol=1e-9)
    goal = np.random.default_rng(seed).integers(-1, instance.m, instance.n)
    flown = sum(energy[i, j] for i, j in enumerate(goal) if j >= 0 and able[i, j])
    score = evaluate(instance, Allocation(goal))
    assert score.energy == pytest.approx(flown, rel=1e-9, abs=1e-9)
    assert {(one.agent, one.task) for one in score.violations} == {
        (i, j) for i, j in enumerate(goal.tolist()) if j >= 0 and not able[i, j]
    }


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("method", EXACT)
def test_exact_methods_find_the_optimum(method: str, objective: Objective) -> None:
    """Exact methods equal brute force, with each field alone and all together, and bounds hold."""
    allocator = load(method)
    for number in range(len(COMBINATIONS)):
        instance = combined_instance(number)
        best = brute_force(instance)
        result = solve(instance, allocator, objective=objective, time_limit_s=None)
        score = result.evaluation
        assert not score.violations
        assert len(score.unserved_tasks) == best.unserved
        assert score.served_makespan == pytest.approx(best.makespan, rel=1e-6)
        if objective is Objective.MAKESPAN_ENERGY:
            assert score.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)
        if not best.unserved:
            assert makespan_lower_bound(instance) <= best.makespan * (1 + 1e-9)
            bound = energy_lower_bound(instance, best.makespan)
            assert bound is None or bound <= best.energy * (1 + 1e-9) + 1e-9


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("method", [pytest.param(one, marks=[pytest.mark.slow] * (one == "gappo")) for one in OTHERS])
def test_all_methods_give_feasible_plans(method: str, objective: Objective) -> None:
    """Every method serves as many tasks as possible with a feasible plan, and none is better than the optimum."""
    allocator = load(method)
    for number in range(len(COMBINATIONS)):
        instance = combined_instance(number)
        if instance.has_travel_time and not BUILT_IN[method].finite_speeds:
            continue
        best = brute_force(instance)
        score = solve(instance, allocator, objective=objective, time_limit_s=None, iterations=10).evaluation
        assert not score.violations
        assert len(score.unserved_tasks) == best.unserved
        assert score.served_makespan >= best.makespan * (1 - 1e-9)
        if score.served_makespan <= best.makespan * (1 + 1e-9):
            assert score.energy >= best.energy * (1 - 1e-9) - 1e-9
