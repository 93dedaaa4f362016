from functools import cache
from itertools import product

import numpy as np
import pytest

from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.energy.lagrangian import LagrangianBound
from alloc.allocators.exact.energy.subproblems import solve_subproblems


@cache
def model_of(seed: int, tasks: int, *, limited: bool) -> tuple[EnergyModel, float, np.ndarray]:
    """A model of six agents that all differ, the cost of its best plan, and that plan; the last task is idleness."""
    rng = np.random.default_rng(seed)
    ability = rng.integers(1, 6, 6)
    start = rng.permutation(np.append(np.arange(tasks), rng.integers(0, tasks + (not limited), 6 - tasks)))
    need = np.bincount(start, ability, tasks + 1)[:tasks].astype(np.int64)
    cost = rng.random((6, tasks))
    best, plan = np.inf, start
    for goal in product(range(tasks + 1), repeat=6):
        done = np.bincount(goal, ability, tasks + 1)[:tasks]
        if (done >= need).all() and (not limited or (done == need).all()):
            total = sum(cost[i, j] for i, j in enumerate(goal) if j < tasks)
            if total < best:
                best, plan = total, np.array(goal)
    task, agent = (index.ravel().astype(np.int64) for index in np.indices((tasks, 6)))
    ones = np.ones(6, dtype=np.int64)
    model = EnergyModel(
        class_of_pair=agent,
        task_of_pair=task,
        weight=ability[agent],
        copies=np.ones(len(agent), dtype=np.int64),
        cost=cost[agent, task],
        need=need,
        max_weight=need if limited else np.full(tasks, -1),
        count=ones,
        min_agents=ones if limited else 0 * ones,
        ability=ability,
    )
    return model, best, plan


@pytest.mark.parametrize("worse", [1.0001, 1.3])
@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_bound_is_below_the_best_plan_and_its_pairs_are_kept(seed, limited, worse):
    """However long prices move towards the cost of a worse plan, the best one bounds the bound and loses no pair."""
    model, best, plan = model_of(seed, 4, limited=limited)
    distance = np.abs(np.subtract.outer(np.arange(4.0), np.arange(4.0)))
    bound = LagrangianBound(model, distance, np.zeros(len(model.count)))
    bound.ascend(1000, best * worse)
    assert 0.5 * best < bound.bound <= best * (1 + 1e-9)
    used = model.task_of_pair == plan[model.class_of_pair]
    assert bound.kept[used].all()


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_excess_is_what_a_pair_costs_more(seed, limited):
    """The best group with an agent of the pair, of all groups written out, is dearer by no less than the excess."""
    model, _, _ = model_of(seed, 2, limited=limited)
    group, excess, total = solve_subproblems(model, model.cost)
    assert total == pytest.approx(float(group @ model.cost))
    for j in range(2):
        pairs = np.flatnonzero(model.task_of_pair == j)
        groups = np.array(list(product((0, 1), repeat=6)))
        done = groups @ model.weight[pairs]
        groups = groups[(done >= model.need[j]) & ((done <= model.max_weight[j]) | (not limited))]
        cost = groups @ model.cost[pairs]
        assert cost.min() == pytest.approx(float(group[pairs] @ model.cost[pairs]))
        for p, pair in enumerate(pairs):
            best_with = cost[groups[:, p] > 0].min(initial=np.inf)
            assert excess[pair] <= best_with - cost.min() + 1e-9
