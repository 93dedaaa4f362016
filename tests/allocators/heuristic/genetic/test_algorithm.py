"""The genetic algorithm as a method."""

import random
import threading
import time
from unittest.mock import patch

import numpy as np
import pytest

from alloc.allocators import Budget, Improvement, Result, Search, StopReason, load, solve
from alloc.allocators.heuristic.genetic.algorithm import GeneticAlgorithm
from alloc.allocators.heuristic.genetic.encoding import Encoding
from alloc.allocators.heuristic.genetic.evolution import GeneticParameters
from alloc.allocators.heuristic.genetic.islands import GENERATIONS, Island, evolve_islands
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Allocation, InputError, Instance, Objective, evaluate, fewest_unserved, serve_all
from alloc.problems.generate import paper


def hard(n: int = 30, m: int = 10, seed: int = 0) -> Instance:
    """Wide abilities and few agents a task: no perfect partition."""
    rng = np.random.default_rng(seed)
    return Instance(
        ability=rng.uniform(1, 100, n),
        workload=rng.uniform(20, 100, m),
        task_position=rng.random((m, 3)),
        start_task=rng.integers(0, m, n),
        allowed_tasks=[rng.choice(m, 5, replace=False) for _ in range(n)],
    )


@pytest.mark.parametrize(("scenario", "seed"), [(1, 0), (1, 1), (4, 0)])
def test_finds_perfect_partitions_of_the_paper(scenario: int, seed: int) -> None:
    """On the paper's instances it reaches T = 1, and stops as this is the lower bound."""
    result = solve(paper(scenario, seed), "ga", time_limit_s=30)
    assert result.makespan == pytest.approx(1.0, rel=1e-9)
    assert result.stop_reason is StopReason.PROVEN


@pytest.fixture(scope="module")
def evolved() -> Result:
    """A few hundred generations on a hard instance."""
    return solve(hard(), "ga", time_limit_s=None, iterations=300)


def test_improves_on_greedy(evolved: Result) -> None:
    """A few hundred generations close most of the gap of list scheduling on a hard instance."""
    greedy, ga = solve(hard(), "greedy"), evolved
    assert ga.makespan is not None
    assert greedy.gap is not None
    assert ga.gap is not None
    assert ga.gap < 0.7 * greedy.gap


@pytest.mark.parametrize("objective", ["makespan", "makespan-energy"])
def test_never_submits_infeasible_plans(objective: str) -> None:
    """All submitted plans respect task lists."""
    told: list[Improvement] = []
    solve(hard(), "ga", objective=objective, time_limit_s=None, iterations=60, on_improvement=told.append)
    assert len(told) > 2
    assert all(not step.evaluation.violations for step in told)


@pytest.mark.slow
def test_saves_energy_at_equal_makespan() -> None:
    """With energy in the objective it keeps T = 1 with far less energy."""
    instance = paper(1, 3)
    fast = solve(instance, "ga", time_limit_s=None, iterations=300)
    saving = solve(instance, "ga", objective="makespan-energy", time_limit_s=None, iterations=300)
    assert saving.makespan == pytest.approx(1.0)
    assert fast.energy is not None
    assert saving.energy is not None
    assert saving.energy < 0.5 * fast.energy


def outcome(result: Result) -> tuple[object, ...]:
    return result.allocation, result.makespan, result.energy, len(result.trace)


def test_same_seed_gives_same_answer() -> None:
    """With an iteration budget a seed determines the answer and its trace; another seed has another trace."""
    answers = [solve(hard(), "ga", time_limit_s=None, iterations=40, seed=seed) for seed in (1, 1, 2)]
    assert outcome(answers[0]) == outcome(answers[1])
    assert outcome(answers[0]) != outcome(answers[2])


def test_global_generators_are_not_used() -> None:
    """Neither of the two global generators is used or seeded."""
    before, numpy_before = random.getstate(), np.random.get_state()  # noqa: NPY002
    solve(hard(), "ga", time_limit_s=None, iterations=5)
    assert random.getstate() == before
    assert np.array_equal(np.random.get_state()[1], numpy_before[1])  # noqa: NPY002


def test_threads_can_share_an_allocator() -> None:
    """Concurrent runs on one object give the same results as single ones."""
    allocator, alone = (
        load("ga"),
        [outcome(solve(hard(seed=s), "ga", time_limit_s=None, iterations=20)) for s in (0, 1)],
    )
    together: dict[int, tuple[object, ...]] = {}

    def run(seed: int) -> None:
        together[seed] = outcome(solve(hard(seed=seed), allocator, time_limit_s=None, iterations=20))

    threads = [threading.Thread(target=run, args=(seed,)) for seed in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [together[0], together[1]] == alone


def test_warm_start_is_never_lost(evolved: Result) -> None:
    """The answer is never worse than the warm start, which is better than one generation from scratch."""
    good = evolved
    assert good.allocation is not None
    cold = solve(hard(), "ga", time_limit_s=None, iterations=1, seed=5)
    warm = solve(hard(), "ga", time_limit_s=None, iterations=1, seed=5, start=good.allocation)
    assert warm.makespan is not None
    assert cold.makespan is not None
    assert warm.makespan <= good.makespan < cold.makespan


@pytest.mark.parametrize("iterations", [0, 1])
def test_smallest_budget_gives_a_plan(iterations: int) -> None:
    """Even without a generation, every task is served."""
    assert solve(hard(), "ga", time_limit_s=None, iterations=iterations).makespan is not None


def test_no_workload() -> None:
    """Without workload all agents are idle, and the makespan is 0."""
    result = solve(Instance(ability=[1, 2], workload=[0, 0, 0]), "ga")
    assert result.allocation == Allocation([-1, -1])
    assert result.makespan == 0


def test_too_few_agents() -> None:
    """If not all tasks can be served, as many as possible are served, with a small makespan."""
    instance = Instance(ability=[5, 1, 3], workload=[10, 20, 6, 0, 7], allowed_tasks=[[0, 1], [0, 1, 3], [0, 1]])
    result = solve(instance, "ga", time_limit_s=None, iterations=30)
    assert result.evaluation is not None
    assert len(result.evaluation.unserved_tasks) == fewest_unserved(instance) == 2
    best = min(
        evaluate(instance, Allocation([i, j, k])).served_makespan
        for i in (-1, 0, 1)
        for j in (-1, 0, 1, 3)
        for k in (-1, 0, 1)
        if len(evaluate(instance, Allocation([i, j, k])).unserved_tasks) == 2
    )
    assert result.evaluation.served_makespan == pytest.approx(best)


@pytest.mark.parametrize("ratio", [1e-50, 1e50])
def test_extreme_units(ratio: float) -> None:
    """Extreme units change only the magnitude of the figures."""
    plain = solve(Instance(ability=[3, 2, 2, 1], workload=[5, 3]), "ga", time_limit_s=None, iterations=20)
    scaled = solve(
        Instance(ability=[3, 2, 2, 1], workload=[5 * ratio, 3 * ratio]), "ga", time_limit_s=None, iterations=20
    )
    assert plain.makespan == pytest.approx(1.0)
    assert scaled.makespan == pytest.approx(ratio)


def test_time_limit_is_respected_with_many_agents() -> None:
    """With ten thousand agents with ranges, a limit of 0.5 s is exceeded by at most 10 % + 0.5 s of processor time."""
    rng = np.random.default_rng(0)
    instance = Instance(
        ability=rng.uniform(1, 10, 10_000),
        workload=rng.uniform(1, 40, 100),
        agent_position=rng.random((10_000, 3)),
        task_position=rng.random((100, 3)),
        communication_range=np.full(10_000, 0.7),
    )
    begin_s = time.process_time()
    result = solve(instance, "ga", time_limit_s=0.5, threads=1)
    assert result.makespan is not None
    assert time.process_time() - begin_s < 0.5 * 1.1 + 0.5


def test_all_agents_idle_if_no_task_can_be_served():
    """If no task with workload is within reach, all agents are idle, at once and without warnings."""
    instance = Instance(
        ability=[1, 2], workload=[3, 4], agent_position=[[0, 0], [1, 1]], task_position=[[9, 9], [8, 8]],
        communication_range=[1, 1],
    )  # fmt: skip
    result = solve(instance, "ga", objective="makespan-energy", time_limit_s=5)
    assert result.allocation == Allocation.idle(instance)
    assert result.runtime_s < 1


def test_parameters_are_set_by_keyword() -> None:
    """A larger population takes other steps with the same seed; wrong parameters are named."""
    large = GeneticAlgorithm(population=200)
    assert large.parameters == GeneticParameters(population=200)
    usual, other = (solve(hard(), one, time_limit_s=None, iterations=20) for one in (GeneticAlgorithm(), large))
    assert outcome(usual) != outcome(other)
    for name, value in (("population", 1), ("crossover", 1.1), ("populations", 20)):
        with pytest.raises(InputError) as caught:
            GeneticAlgorithm(**{name: value})
        assert caught.value.place == name


def test_islands_are_reproducible() -> None:
    """With a budget of generations shared by the islands, three threads are reproducible."""
    settings = {"objective": "makespan-energy", "iterations": 70, "time_limit_s": None, "threads": 3}
    first, again = (solve(hard(), GeneticAlgorithm(population=16), **settings) for _ in range(2))
    assert first.allocation == again.allocation
    assert first.makespan < solve(hard(), "greedy").makespan


def test_islands_exchange_their_best_plans() -> None:
    """The best plan of one island reaches all others at the next exchange; generations are counted in total."""
    instance = hard()
    search = Search(instance, Objective.MAKESPAN, Budget(None, 3 * GENERATIONS), threads=3)
    search.submit(serve_all(instance, greedy(instance)))
    received = []
    with patch.object(Island, "receive", lambda island, allocation: received.append(allocation)):
        evolve_islands(search, Encoding(instance), GeneticParameters(population=16))
    assert search.iteration == 3 * GENERATIONS
    assert not received, "the budget was over"
    longer = Search(instance, Objective.MAKESPAN, Budget(None, 3 * GENERATIONS + 1), threads=3)
    longer.submit(serve_all(instance, greedy(instance)))
    with patch.object(Island, "receive", lambda island, allocation: received.append(allocation)):
        evolve_islands(longer, Encoding(instance), GeneticParameters(population=16))
    assert received == [search.best.allocation] * 3
