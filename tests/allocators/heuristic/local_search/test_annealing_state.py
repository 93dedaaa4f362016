"""The state of annealing stays consistent over many exchanges."""

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import allocated

from alloc.allocators.heuristic.local_search import candidates
from alloc.allocators.heuristic.local_search.annealing import draw_helper
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.problems import IDLE, Allocation, Instance, evaluate, serve_all


@settings(max_examples=40, deadline=None)
@given(allocated())
@pytest.mark.parametrize("limit", [0, 10_000])
def test_incremental_updates_match_recomputation(limit, drawn):
    """After many exchanges, groups, group abilities and the distance equal those computed from scratch."""
    instance, start = drawn
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(candidates, "TABLE_LIMIT", limit)
        state = AnnealingState(instance, 1, 3)
        start = serve_all(instance, start)
        makespan = max(evaluate(instance, start).served_makespan, 1e-3)
        state.begin(start, makespan)
        state.run(300, state.weights(1.0, 0.3, 0.5, 0.5), 0.99)
        score = evaluate(instance, state.allocation)
        assert score.violations == ()
        plan = state.plan
        assert state.cost == pytest.approx(score.distance, abs=1e-9)
        group_ability, n_short = plan.group_ability.copy(), state.n_short
        state.recompute()
        assert plan.group_ability == pytest.approx(group_ability, abs=1e-9)
        assert state.n_short == n_short
        members = [plan.slot[plan.begin[j] : plan.begin[j] + plan.size[j]] for j in range(instance.m + 1)]
        assert sorted(np.concatenate(members).tolist()) == list(range(instance.n))
        for group, agents in enumerate(members):
            assert (plan.group_of_agent[agents] == group).all()


def test_full_groups_get_more_slots():
    """A group that outgrows its slots gets more, and no agent is lost."""
    instance = Instance(ability=np.ones(200), workload=[*[1.0] * 49, 151.0])
    state = AnnealingState(instance, 0, 5)
    state.begin(Allocation(np.arange(200) % 50), 1.0)
    for _ in range(50):
        if state.n_short:
            state.run(1000, state.weights(0.0, 0.01, 0.0, 1.0))
    assert state.n_short == 0
    assert evaluate(instance, state.allocation).makespan == 1.0


def test_helpers_can_reach_the_task():
    """The agent sampled to help a task can reach it, if any can."""
    instance = Instance(ability=[1.0] * 4, workload=[1.0, 1.0], allowed_tasks=[[0], [0], [1], [0, 1]])
    state = AnnealingState(instance, 0, 2)
    state.begin(Allocation([0, IDLE, 1, IDLE]), 1.0)
    assert {int(draw_helper(state.arrays, state.plan, state.candidates, np.int32(1))) for _ in range(50)} == {2, 3}


def test_helpers_come_from_nearby_tasks_without_a_table(monkeypatch):
    """Without a table of distances, most helpers are from nearby tasks, hardly any from distant ones."""
    monkeypatch.setattr(candidates, "TABLE_LIMIT", 0)
    places = np.linspace([0.0, 0.0], [1.0, 0.0], 100)
    instance = Instance(
        ability=np.ones(100), workload=np.ones(100), agent_position=places, task_position=places,
        communication_range=np.full(100, 0.05),
    )  # fmt: skip
    state = AnnealingState(instance, 0, 5)
    state.begin(Allocation(np.arange(100)), 1.0)
    drawn = [int(draw_helper(state.arrays, state.plan, state.candidates, np.int32(50))) for _ in range(200)]
    assert sum(abs(agent - 50) <= 5 for agent in drawn) > 100


def test_prices_escape_local_minima_of_the_shortfall():
    """The price of a short task rises until it takes an agent from a task that then has a larger shortfall."""
    instance = Instance(ability=[1, 2, 1, 2], workload=[2, 3], allowed_tasks=[[0], [0, 1], [1], [1]])
    state = AnnealingState(instance, 0, 2)
    state.begin(Allocation([0, 1, 1, IDLE]), 1.0)
    state.run(100, state.weights(0.0, 1e-6, 0.0, 1.0))
    assert state.allocation == Allocation([0, 0, 1, 1])
