"""Reach without tables: the same answers to the last bit, by trees and pair by pair."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import allocated, instances

from alloc.problems import (
    Allocation,
    Instance,
    Reach,
    evaluate,
    fewest_unserved,
    makespan_lower_bound,
    minimal_unservable_set,
    serve_all,
)
from alloc.problems.distances import reach
from alloc.problems.distances.neighbours import nearest_distance


@contextmanager
def tableless() -> Iterator[None]:
    """Let no reach have a table: asking for one is an error."""

    def forbidden(_: Reach) -> None:
        raise AssertionError("a table of all pairs was built")

    with (
        patch.object(reach, "TABLE_LIMIT", -1),
        patch.object(Reach, "distance", property(forbidden)),
        patch.object(Reach, "mask", property(forbidden)),
    ):
        yield


def stretched(instance: Instance, factor: float) -> Instance:
    """Return `instance` with all distances, and what they are measured against, times `factor`."""
    with np.errstate(over="ignore"):
        return replace(
            instance,
            agent_position=instance.agent_position * factor,
            task_position=instance.task_position * factor,
            communication_range=instance.communication_range * factor,
            battery=instance.battery * factor,
        )


FACTORS = st.sampled_from([1.0, 0.1, 1 / 3, 1e-200, 1e30, 1e59])


@given(instances(), FACTORS)
def test_pairs_agree_with_the_table(instance: Instance, factor: float) -> None:
    """Distances, permissions, rows and agents of a task are those of the table, bit for bit."""
    instance = stretched(instance, factor)
    agents, tasks = np.indices((instance.n, instance.m)).reshape(2, -1)
    origin, distance, mask = instance.reach.origin, instance.reach.distance, instance.reach.mask
    with tableless():
        lazy = replace(instance).reach
        assert (lazy.distance_of(agents, tasks) == distance[origin[agents], tasks]).all()
        assert (lazy.allows(agents, tasks) == mask[origin[agents], tasks]).all()
        assert lazy.is_complete == mask.all()
        assert lazy.density == pytest.approx(mask[origin].mean())
        rows = lazy.rows(np.arange(len(lazy.place)))
        assert (rows[0] == distance).all()
        assert (rows[1] == mask).all()
        for task in range(instance.m):
            assert lazy.agents_of(task).tolist() == np.flatnonzero(mask[origin, task]).tolist()


@given(instances(), FACTORS, st.sampled_from([1, 4, 1 << 20]))
def test_neighbours_match_the_table(instance: Instance, factor: float, chunk: int) -> None:
    """Gathered by trees, in chunks of any size, they equal the table; the nearest is the minimum of a row."""
    instance = stretched(instance, factor)
    table = instance.reach
    with tableless(), patch("alloc.problems.distances.neighbours.CHUNK", chunk):
        lazy = replace(instance).reach
        near = lazy.neighbours
        wanted = instance.workload > 0
        nearest = nearest_distance(lazy, wanted)
    assert near is not None
    origin, task = np.nonzero(table.mask)
    assert near.origin.tolist() == origin.tolist()
    assert near.task.tolist() == task.tolist()
    assert (near.distance == table.distance[origin, task]).all()
    assert nearest == pytest.approx(np.where(table.mask & wanted, table.distance, np.inf).min(axis=1), rel=1e-15)


@given(allocated(), st.sampled_from([0, 50_000_000]))
def test_scores_bounds_and_matchings_match_the_table(case: tuple[Instance, Allocation], many: int) -> None:
    """Scores, bounds and how many tasks can be served do not depend on how reach is looked at, to the last bit.

    Abilities are made such that sums of them are exact, as each way of looking sums them up in another order.
    """
    instance, allocation = case
    instance = replace(instance, ability=np.ceil(1024 * instance.ability) / 1024)
    with_table = _figures(instance, allocation)
    with tableless(), patch("alloc.problems.matching.serving.MANY", many):
        assert _figures(replace(instance), allocation) == with_table


def _figures(instance: Instance, allocation: Allocation) -> list[Any]:
    score = evaluate(instance, allocation)
    return [
        makespan_lower_bound(instance),
        fewest_unserved(instance),
        len(evaluate(instance, serve_all(instance, allocation)).unserved_tasks),
        minimal_unservable_set(instance) is None,
        score.served_makespan,
        score.violations,
        score.energy,
        score.battery_remaining_percent,
    ]


def test_hundred_thousand_agents_need_no_table() -> None:
    """Scores, bounds and repair of 100,000 agents with positions and short ranges need no table of all pairs."""
    rng = np.random.default_rng(0)
    n, m = 100_000, 1_000
    instance = Instance(
        ability=rng.integers(1, 10, n),
        workload=rng.integers(1, 10, m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
        communication_range=np.full(n, 0.1),
    )
    with tableless():
        assert not instance.reach.is_complete
        assert fewest_unserved(instance) == 0
        plan = serve_all(instance, Allocation.idle(instance))
        score = evaluate(instance, plan)
        assert not score.unserved_tasks
        assert not score.violations
        assert makespan_lower_bound(instance) < score.served_makespan


@pytest.mark.parametrize("limit", [0.05, 0.5, 1.6])
def test_neighbours_are_gathered_only_where_they_can_be_held(limit: float) -> None:
    """Few are gathered; more than the limit are refused at once."""
    rng = np.random.default_rng(0)
    n, m = 5_000, 1_000
    instance = Instance(
        ability=np.ones(n),
        workload=np.ones(m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
        communication_range=np.full(n, limit),
    )
    with patch.object(reach, "MAX_NEIGHBOURS", 100_000):
        near = instance.reach.neighbours
    assert (near is None) == (limit > 0.4)
    assert not instance.reach.is_complete
    if near is not None:
        assert len(near.task) == pytest.approx(n * m * 4 / 3 * np.pi * limit**3, rel=0.2)
