"""Instances too large for most methods: these refuse at once, and the others build no table of all pairs."""

import time
from collections.abc import Iterator
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from alloc.allocators import Budget, RefusedError, load, solve
from alloc.allocators.auto import choose
from alloc.problems import Family, Instance, Objective, Reach, evaluate, random_instance
from alloc.problems.distances.reach import TABLE_LIMIT
from alloc.problems.vocabulary import OBJECTIVES


@pytest.fixture(autouse=True)
def no_large_table() -> Iterator[None]:
    """Make every large table of all pairs an error."""

    def guarded(name: str) -> property:
        build = Reach.__dict__[name].func

        def table(reach: Reach) -> Any:
            assert reach.pairs <= TABLE_LIMIT, "a table of all pairs was built"
            return build(reach)

        return property(table)

    with patch.object(Reach, "distance", guarded("distance")), patch.object(Reach, "mask", guarded("mask")):
        yield


@pytest.fixture(scope="module")
def far_and_wide() -> Instance:
    """100,000 agents with places and ranges of their own, 10,000 tasks."""
    family = Family(agents=100_000, tasks=10_000, starts="own", communication_range=(0.2, 0.4), integer=False)
    return random_instance(family, 0)


@pytest.mark.parametrize("method", ["ga", "gappo", "milp", "cpsat"])
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_refusals_are_fast(far_and_wide: Instance, method: str, objective: Objective) -> None:
    """A method that cannot hold a table of all pairs refuses before building one, and names its limit."""
    allocator = load(method)
    instance = far_and_wide
    instance.reach.is_complete  # noqa: B018 - what any method needs
    begin = time.process_time()
    with pytest.raises(RefusedError, match=r"\d"):
        solve(instance, allocator, objective=objective)
    assert time.process_time() - begin < 1.0  # milliseconds, and not those of others


@pytest.mark.parametrize(
    ("starts", "objective"),
    [
        pytest.param(starts, objective, marks=[pytest.mark.slow] * ((starts == "own") == (objective == OBJECTIVES[0])))
        for starts in ("tasks", "own")
        for objective in OBJECTIVES
    ],
)
def test_greedy_with_complete_reach_is_near_the_bound(starts: str, objective: Objective) -> None:
    """200,000 agents and 2,500 tasks: within 0.1 % of the bound, for any starts."""
    instance = random_instance(Family(agents=200_000, tasks=2_500, starts=starts), 0)
    result = solve(instance, "greedy", objective=objective, time_limit_s=60)
    assert result.gap is not None
    assert result.gap < 0.001
    assert result.allocation is not None
    assert evaluate(instance, result.allocation).energy == result.energy


def test_repair_after_zero_time_serves_tasks(far_and_wide: Instance) -> None:
    """The repair after a run without time takes at most seconds, with complete and with limited reach."""
    free = Instance(
        ability=np.ones(300_000), workload=np.ones(5_000), task_position=np.random.default_rng(0).random((5_000, 3))
    )
    for instance in (free, far_and_wide):
        result = solve(instance, "greedy", time_limit_s=0)
        assert result.evaluation is not None
        assert not result.evaluation.unserved_tasks


def test_auto_picks_without_delay(far_and_wide: Instance) -> None:
    """Methods that cannot hold the instance are not picked."""
    begin = time.process_time()
    for objective in OBJECTIVES:
        method, _ = choose(far_and_wide, objective, Budget(10))
        assert method in ("greedy", "local-search")
    assert time.process_time() - begin < 2.0
