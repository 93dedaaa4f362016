"""The penalty on shortfalls adapts to how rare plans without any are."""

import numpy as np
import pytest

from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search.annealing_state import (
    FALL,
    LOWEST,
    MIN_EXCHANGES,
    PATIENCE,
    RISE,
    AnnealingState,
    PenaltyFactor,
)
from alloc.problems import evaluate
from alloc.problems.generate import paper


@pytest.fixture
def state():
    """A state with a plan, at its makespan, that has been saved as the best."""
    instance = paper(1, 0)
    plan = greedy(instance)
    state = AnnealingState(instance, 0, 5)
    state.begin(plan, evaluate(instance, plan).makespan)
    state.run(100, state.weights(1.0, 0.0, 1e3, 1e3))
    assert state.best is not None
    return state


def lose(state):
    """Leave every other agent idle, so that tasks are short."""
    best = state.best
    group = np.where(np.arange(state.instance.n) % 2 == 0, best.task_of_agent, -1)
    state._set_groups(np.where(group < 0, state.instance.m, group).astype(np.int32))
    state.recompute()
    assert state.n_short > 0


def test_penalty_decreases_without_shortfalls_to_a_minimum(state):
    """Periods that end without a shortfall lower it, down to a limit."""
    factor = PenaltyFactor(state, 10**9, 1e9)
    factor.update(1)
    assert factor.value == pytest.approx(FALL)
    for _ in range(100):
        factor.update(1)
    assert factor.value == LOWEST


def test_search_returns_to_its_best_plan(state):
    """After consecutive periods with shortfalls, which raise the penalty, the plan is again the best one."""
    factor, best = PenaltyFactor(state, 10**9, 1e9), state.best
    lose(state)
    for _ in range(PATIENCE):
        factor.update(1)
        assert state.n_short > 0
    factor.update(1)
    assert state.allocation == best
    assert state.n_short == 0
    assert factor.value == pytest.approx(RISE ** (PATIENCE + 1))
    state.run(200, state.weights(1.0, 0.01, 1e3, 1e3))
    assert evaluate(state.instance, state.best).makespan <= state.makespan * (1 + 1e-9)


def test_penalty_is_constant_on_a_short_budget(state):
    """If the budget allows few exchanges per agent, nothing adapts."""
    factor = PenaltyFactor(state, 10**9, MIN_EXCHANGES - 1)
    for _ in range(10):
        factor.update(1)
    assert factor.value == 1.0
