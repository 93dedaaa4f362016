"""If not all tasks can be served, every method serves the most urgent ones, compared with brute force."""

from itertools import pairwise

import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import scarce_instance

from alloc.allocators import Allocator, load, solve
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, Instance, Objective, evaluate, find_shortage

METHODS = (
    "auto",
    "greedy",
    "local-search",
    "lp-round",
    "hedonic",
    "auction",
    "ga",
    "cpsat",
    "milp",
    "gappo",
    "gappo-ls",
)
EXACT = ("cpsat", "milp")
SCARCE = [scarce_instance(seed) for seed in range(20)]


@pytest.fixture(scope="module", params=METHODS)
def method(request: pytest.FixtureRequest) -> tuple[str, str | Allocator]:
    """Each method by name, and loaded."""
    return request.param, "auto" if request.param == "auto" else load(request.param)


@pytest.mark.parametrize("objective", [Objective.MAKESPAN, Objective.MAKESPAN_ENERGY])
def test_served_priority_is_maximal(method: tuple[str, str | Allocator], objective: Objective) -> None:
    """As many tasks as possible are served, with most priority; exact methods have the least makespan and energy."""
    name, allocator = method
    for instance in SCARCE:
        if instance.has_travel_time and name != "auto" and not BUILT_IN[name].finite_speeds:
            continue
        best = brute_force(instance)
        score = solve(instance, allocator, objective=objective, time_limit_s=None, iterations=3).evaluation
        assert not score.violations
        assert len(score.unserved_tasks) == best.unserved
        assert sum(score.unserved_priorities) == pytest.approx(best.lost, rel=1e-9, abs=1e-12)
        if name in EXACT and objective is Objective.MAKESPAN_ENERGY:
            exact = solve(instance, allocator, objective=objective, time_limit_s=None).evaluation
            assert exact.served_makespan == pytest.approx(best.makespan, rel=1e-6)
            assert exact.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)


def test_one_agent_serves_the_more_urgent_task(method: tuple[str, str | Allocator]) -> None:
    """Priority precedes work, and overrides a start that serves the other task."""
    instance = Instance(ability=[1], workload=[1, 50], priority=[1, 2])
    assert solve(instance, method[1], time_limit_s=1).allocation == Allocation([1])
    assert solve(instance, method[1], start=Allocation([0]), time_limit_s=1).allocation == Allocation([1])


def test_equal_priorities_have_no_effect() -> None:
    """Any common priority gives the same plan as none, bit for bit."""
    for seed in range(30):
        instance = scarce_instance(seed)
        fields = {
            name: getattr(instance, name)
            for name in ("ability", "workload", "agent_position", "task_position", "communication_range", "speed")
        }
        fields |= {"allowed_tasks": instance.allowed_tasks, "battery": instance.battery}
        plain, equal = Instance(**fields), Instance(**fields, priority=np.full(instance.m, 7.5))
        assert find_shortage(plain).merged() == find_shortage(equal).merged()


def test_order_of_objectives_with_priorities() -> None:
    """Fewer unserved tasks, then less unserved priority, then a shorter makespan."""
    instance = Instance(ability=[1, 1], workload=[1, 5, 9, 2], priority=[1, 3, 3, 0])
    plans = [[1, 2], [2, 1], [1, 0], [0, 3], [1, 1], [3, 3]]
    scores = [evaluate(instance, Allocation(plan)) for plan in plans]
    assert scores[0].unserved_priorities == (1.0, 0.0)
    assert not scores[0].is_better_than(scores[1], Objective.MAKESPAN)
    for better, worse in pairwise(scores[1:]):
        assert better.is_better_than(worse, Objective.MAKESPAN)
        assert not worse.is_better_than(better, Objective.MAKESPAN)
