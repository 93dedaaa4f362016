"""Local search with several threads: a plan annealed in parts, and parallel attempts."""

import numpy as np
import pytest

from alloc.allocators import Budget, Search, load, solve
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search.improve import HARD
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.allocators.heuristic.local_search.parts import MIN_TASKS, RUNS, Parts, Team
from alloc.problems import Instance, Objective, evaluate
from alloc.problems.generate import Family, random_instance
from alloc.problems.vocabulary import OBJECTIVES

TASKS = 3 * MIN_TASKS


@pytest.fixture(scope="module")
def instance() -> Instance:
    """Enough tasks for three parts, and more ability than they need, so that some agents are idle."""
    return random_instance(Family(agents=150, tasks=TASKS, load=0.8, communication_range=(0.4, 0.9)), 1)


def parts_of(instance: Instance, threads: int) -> Parts:
    """Return the parts of the greedy plan, for a makespan of a tenth more than it has."""
    search = Search(instance, Objective.MAKESPAN_ENERGY, Budget(None), threads=threads)
    team, plan = Team.of(search, 10, map), greedy(instance)
    team.states[0].begin(plan, 1.1 * evaluate(instance, plan).makespan)
    return Parts(team, 0)


def test_every_part_has_tasks_and_their_agents(instance: Instance) -> None:
    """Parts have about equally many agents, and agents are in the part of their task."""
    parts = parts_of(instance, 3)
    part_of_task, part_of_agent = parts._divide()
    group = parts.state.plan.group_of_agent
    busy = group < instance.m
    assert set(part_of_task) == {0, 1, 2}
    assert (part_of_task[group[busy]] == part_of_agent[busy]).all()
    assert np.bincount(part_of_agent).min() > instance.n / 6


def test_joined_plan_is_consistent_with_its_parts(instance: Instance) -> None:
    """After many rounds, groups, cost and abilities equal those computed anew, and the plan is feasible."""
    parts = parts_of(instance, 3)
    state, weights = parts.state, LocalSearchParameters().weights(parts.state, 0.01, HARD)
    before = state.cost
    assert sum(parts.run(np.inf, 200, weights) for _ in range(10)) == 10 * RUNS * parts.count
    cost, ability, best = state.cost, state.plan.group_ability.copy(), state.best_cost
    state.recompute()
    assert state.cost == pytest.approx(cost)
    np.testing.assert_allclose(state.plan.group_ability, ability, atol=1e-9)
    found = state.best
    assert found is not None
    score = evaluate(instance, found)
    assert not score.violations
    assert score.makespan <= state.makespan * (1 + 1e-9)
    assert score.cost == pytest.approx(best * instance.reach.energy_per_distance)
    assert best < before


def test_few_tasks_are_not_partitioned() -> None:
    """With too few tasks for two parts, the whole plan is annealed by a single thread."""
    assert parts_of(random_instance(Family(agents=20, tasks=5), 0), 4).count == 1


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("method", ["local-search", "lp-round"])
def test_same_number_of_threads_gives_same_answer(instance: Instance, method: str, objective: str) -> None:
    """With an iteration budget, three threads are reproducible, and no worse than the start."""
    allocator = load(method)
    settings = {"objective": objective, "iterations": 40, "time_limit_s": None, "threads": 3}
    first, again = (solve(instance, allocator, **settings) for _ in range(2))
    assert first.allocation == again.allocation
    assert first.makespan <= evaluate(instance, greedy(instance)).makespan * (1 + 1e-9)
