"""Exchanges without noise that tighten a plan from prices, and what is loaded for that beforehand."""

import numpy as np
import pytest

from alloc.allocators import solve
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.clock import Clock
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search import allocator
from alloc.allocators.heuristic.local_search.allocator import LocalSearch
from alloc.allocators.heuristic.local_search.parts import Team, tighten
from alloc.allocators.heuristic.task_prices.start import plan_by_prices
from alloc.allocators.parallel.pool import thread_map
from alloc.problems import Instance, Objective


def travelling(agents: int, tasks: int) -> Instance:
    """Return an instance in the unit square with speeds and short ranges."""
    rng = np.random.default_rng(0)
    return Instance(
        ability=rng.integers(1, 10, agents),
        workload=rng.integers(50, 800, tasks) * (agents / (80 * tasks)),
        agent_position=rng.random((agents, 2)),
        task_position=rng.random((tasks, 2)),
        communication_range=np.full(agents, 0.5),
        speed=rng.uniform(1, 5, agents),
    )


@pytest.mark.parametrize("threads", [1, 2])
def test_plan_from_prices_is_tightened(threads: int) -> None:
    """Few exchanges close most of the gap of a plan from prices, within the iteration limit."""
    search = Search(travelling(6_000, 60), Objective.MAKESPAN, Budget(None, 60), threads=threads)
    priced = plan_by_prices(search)
    assert priced is not None
    before = search.gap
    with thread_map(threads) as run_all:
        tighten(search, Team.of(search, 10, run_all), priced, Clock(search), 1000)
    assert search.gap < 0.5 * before
    assert 0 < search.iteration <= 60


def test_same_seed_gives_same_plan() -> None:
    """With an iteration budget, two runs give the same answer."""
    instance = travelling(5_000, 50)
    first, second = (solve(instance, "local-search", time_limit_s=None, iterations=20, threads=2) for _ in range(2))
    assert first.allocation == second.allocation
    assert first.gap < 0.01


@pytest.mark.parametrize(("agents", "loaded"), [(100, 0), (5_000, 1)])
def test_price_loops_are_compiled_before_the_clock_starts(
    monkeypatch: pytest.MonkeyPatch, agents: int, loaded: int
) -> None:
    """The method loads them if it uses them, as `solve` asks it to, whatever its name."""
    calls: list[str] = []
    monkeypatch.setattr(allocator, "compile_prices", lambda: calls.append("prices"))

    class Renamed(LocalSearch):
        pass

    solve(travelling(agents, 5), Renamed(), time_limit_s=None, iterations=1, threads=1)
    assert len(calls) == loaded
