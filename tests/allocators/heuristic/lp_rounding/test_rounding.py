"""From fractions of agents to integer ones."""

import numpy as np
import pytest

from alloc.allocators.heuristic.lp_rounding.rounding import round_fractions


def fractional_plan(rng: np.random.Generator):
    """Draw classes on tasks with fractions that use up at most what each class has."""
    classes, tasks = int(rng.integers(1, 7)), int(rng.integers(1, 6))
    agent_class, task = (axis.ravel() for axis in np.indices((classes, tasks)))
    count = rng.integers(1, 5, classes)
    shares = rng.dirichlet(np.full(tasks, 0.4), classes) * count[:, None] * rng.choice([1.0, 0.7])
    ability = rng.integers(1, 9, classes).astype(float)
    return agent_class, task, shares.ravel(), ability[agent_class], rng.random(len(agent_class)), count


@pytest.mark.parametrize("seed", range(100))
def test_no_task_loses_more_than_one_agent(seed: int) -> None:
    """Each task keeps the ability of its fractions except the largest one, and no agent is used twice."""
    agent_class, task, amount, share, cost, count = fractional_plan(np.random.default_rng(seed))
    integer = round_fractions(agent_class, task, amount, share, cost, count)
    assert (np.bincount(agent_class, weights=integer) <= count).all()
    assert (integer >= np.floor(amount)).all()
    assert (integer <= np.ceil(amount) + (amount % 1 > 0)).all()
    for j in range(task.max() + 1):
        on = task == j
        parts = np.where(amount[on] % 1 > 1e-7, share[on], 0.0)
        assert share[on] @ integer[on] >= share[on] @ amount[on] - parts.max() - 1e-6


def test_integer_plans_are_unchanged() -> None:
    """Values that are integers within the solver's tolerance are kept."""
    agent_class, task = np.array([0, 0, 1]), np.array([0, 1, 1])
    amount = np.array([2 - 1e-10, 1.0, 3 + 1e-10])
    rounded = round_fractions(agent_class, task, amount, np.ones(3), np.zeros(3), np.array([3, 3]))
    assert rounded.tolist() == [2, 1, 3]


def test_cost_never_increases() -> None:
    """Of two ways to fill two half slots, the cheaper is taken, at no more than the cost of the fractions."""
    agent_class, task = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    cost = np.array([1.0, 9.0, 9.0, 1.0])
    rounded = round_fractions(agent_class, task, np.full(4, 0.5), np.ones(4), cost, np.array([1, 1]))
    assert rounded.tolist() == [1, 0, 0, 1]
