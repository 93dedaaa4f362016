"""The method `local-search`, and `improve` for others to use."""

import numpy as np
import pytest
from hypothesis import given, settings
from oracle import brute_force
from strategies import allocated
from tiny_instances import long_travel, tiny_instance

from alloc.allocators import load, solve
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search import annealing, candidates, instance_arrays
from alloc.allocators.heuristic.local_search.allocator import LocalSearch
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.problems import Allocation, InputError, Instance, Objective, evaluate, serve_all
from alloc.problems.generate import paper, random_instance
from alloc.problems.generate.family import Family
from alloc.problems.vocabulary import OBJECTIVES


@pytest.fixture(scope="module")
def allocator():
    return load("local-search")


@pytest.mark.parametrize("scenario", [1, 2, 3, 4])
def test_paper_scenarios_reach_the_optimum(allocator, scenario):
    """T = 1 takes a few iterations in each of the paper's scenarios."""
    result = solve(paper(scenario, 1500), allocator, iterations=40, time_limit_s=None)
    assert result.makespan == 1.0


def test_energy_of_a_paper_scenario_is_near_the_optimum(allocator):
    """After a hundred thousand exchanges the energy is near the least, 88.824 by `milp`."""
    result = solve(paper(1, 1000), allocator, objective="makespan-energy", iterations=100, time_limit_s=None)
    assert result.makespan == 1.0
    assert 88.824 * (1 - 1e-6) <= result.energy <= 88.824 * 1.08


@pytest.mark.parametrize("seed", range(24))
def test_tiny_instances_match_brute_force(allocator, seed):
    """On tiny instances as many tasks are served as possible; if all are, makespan and energy are optimal."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    result = solve(instance, allocator, objective="makespan-energy", iterations=60, time_limit_s=None)
    assert len(result.evaluation.unserved_tasks) == best.unserved
    if not best.unserved:
        assert result.makespan == pytest.approx(best.makespan, rel=1e-9)
        assert result.energy == pytest.approx(best.energy, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(allocated())
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_never_worse_than_start_or_greedy(allocator, objective, drawn):
    """For any start, the answer is feasible and no worse than it or than greedy."""
    instance, start = drawn
    result = solve(instance, allocator, objective=objective, start=start, iterations=3, time_limit_s=None)
    assert result.evaluation.violations == ()
    for other in (start, greedy(instance)):
        assert not evaluate(instance, serve_all(instance, other)).is_better_than(result.evaluation, objective)


def test_slack_saves_energy(allocator):
    """With 10 % more time, the plan takes less energy and meets the limit."""
    instance = paper(1, 1001)
    strict = solve(instance, allocator, objective="makespan-energy", iterations=60, time_limit_s=None)
    slack = solve(
        instance, allocator, objective="makespan-energy", iterations=60, time_limit_s=None, makespan_slack=0.1
    )
    assert slack.energy < strict.energy
    assert slack.makespan <= 1.1 * (1 + 1e-9)


def test_travel_times_and_real_abilities_beat_greedy(allocator):
    """With speeds, or real abilities in large groups, plans are faster than greedy's and take far less energy."""
    settings = {"objective": "makespan-energy", "iterations": 60, "time_limit_s": None, "makespan_slack": 0.01}
    for speed in ((1.0, 3.0), None):
        instance = random_instance(Family(agents=80, tasks=5, integer=False, speed=speed, starts="own"), 1)
        first = evaluate(instance, serve_all(instance, greedy(instance)))
        result = solve(instance, allocator, **settings)
        assert result.lower_bound <= result.makespan <= first.makespan * 1.01
        assert result.energy < 0.8 * first.energy


@pytest.mark.parametrize(("seed", "least"), [(1, 77.27), (2, 57.17), (3, 63.68)])
def test_long_travel_of_equal_agents(allocator, seed, least):
    """If travel takes half of the time, the makespan of equal agents is within 1 % of that of `cpsat`."""
    result = solve(long_travel(seed), allocator, iterations=60, time_limit_s=None)
    assert result.lower_bound <= result.makespan <= 1.01 * least


def test_no_servable_work(allocator):
    """If no task with work can be served, or none has any, all agents are idle."""
    places = {"agent_position": [[0, 0], [0, 1]], "task_position": [[1, 0], [2, 0]]}
    for work, lists in (([0, 0], None), ([0, 1], [[0], [0]])):
        instance = Instance(ability=[1, 1], workload=work, allowed_tasks=lists, **places)
        start = Allocation([0, 0])
        result = solve(instance, allocator, objective="makespan-energy", start=start, iterations=3, time_limit_s=None)
        assert result.energy == 0


def test_tasks_without_work(allocator):
    """Agents whose start is a task without work become idle."""
    places = {"agent_position": [[0, 0], [0, 1]], "task_position": [[0, 0], [2, 0]]}
    instance = Instance(ability=[1, 1], workload=[1, 0], **places)
    start = Allocation([0, 1])
    result = solve(instance, allocator, objective="makespan-energy", start=start, iterations=3, time_limit_s=None)
    assert result.allocation == Allocation([0, 0])


def test_few_agents_per_task_reach_the_bound(allocator):
    """With four agents per task and abilities up to 1000, the bound is met within 0.1 %."""
    rng = np.random.default_rng(4)
    instance = Instance(ability=rng.integers(1, 1001, 100), workload=np.full(25, 1000.0))
    result = solve(instance, allocator, iterations=60, time_limit_s=None)
    assert result.gap < 1e-3


def test_many_agents_reach_the_bound(allocator):
    """Without a table of distances, thirty thousand agents reach the bound, with less energy than greedy."""
    instance = random_instance(Family(agents=30_000, tasks=300, starts="own", battery=None), 2)
    result = solve(instance, allocator, objective="makespan-energy", iterations=40, time_limit_s=None)
    assert result.gap < 1e-9
    assert result.energy < evaluate(instance, greedy(instance)).energy


@pytest.mark.parametrize("places", [{}, {"start_task": [0, 1]}, {"agent_position": [[0, 0], [3, 1]]}])
@pytest.mark.parametrize("distances", [None, [("a1", "t2", 2.5)]])
def test_no_compilation_within_a_run(allocator, places, distances, monkeypatch):
    """Whatever positions and distances an instance has, arrays have the types of the compiled loops."""
    kwargs = {"ability": [1, 2], "workload": [2, 2], "task_position": [[0, 0], [1, 2]], "distances": distances}
    instance, before = Instance(**kwargs, **places), annealing.anneal.signatures
    assert len(before) == 1
    for limit in (instance_arrays.TABLE_LIMIT, 1):  # with a table of distances, and without one
        for module in (instance_arrays, candidates):
            monkeypatch.setattr(module, "TABLE_LIMIT", limit)
        solve(instance, allocator, objective="makespan-energy", iterations=3, time_limit_s=None)
    assert annealing.anneal.signatures == before


def test_improve_continues_any_search():
    """`improve` continues from the best plan of any search, within its own limits, and submits better ones."""
    instance = paper(1, 1002)
    search = Search(instance, Objective.MAKESPAN_ENERGY, Budget(None, 1000), seed=1)
    first = search.submit(greedy(instance))
    improve(search, iterations=30, parameters=LocalSearchParameters(exchanges=500))
    assert search.iteration <= 30
    assert search.best.evaluation.is_better_than(first, Objective.MAKESPAN_ENERGY)


def test_parameters_are_set_by_keyword():
    """Keywords override parameters of an object and change the answer; wrong ones are named."""
    instance = paper(1, 1003)
    settings = {"objective": "makespan-energy", "iterations": 20, "time_limit_s": None}
    few = LocalSearch(exchanges=100)
    assert few.parameters == LocalSearchParameters(exchanges=100)
    assert LocalSearch(few.parameters, neighbours=3).parameters == LocalSearchParameters(exchanges=100, neighbours=3)
    assert solve(instance, few, **settings).energy > solve(instance, LocalSearch(), **settings).energy
    for name, value in (("exchanges", 0), ("final_noise", -1.0), ("exchange", 10)):
        with pytest.raises(InputError) as caught:
            LocalSearch(**{name: value})
        assert caught.value.place == name
