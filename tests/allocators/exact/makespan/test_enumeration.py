from itertools import product

import numpy as np
import pytest
from oracle import brute_force

from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.enumeration import (
    MAX_GROUP_SIZE,
    enumerate_groups,
    fill_least,
    list_groups,
)
from alloc.allocators.exact.makespan.set_partitioning import solve_set_partitioning
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import Verdict
from alloc.problems import agent_classes, evaluate, machine_covering


@pytest.mark.parametrize("seed", range(10))
def test_all_minimal_groups_are_enumerated(seed):
    """The minimal groups that meet the need within the cost limit are those found by brute force."""
    rng = np.random.default_rng(seed)
    weight, price = np.sort(rng.choice(20, 5, replace=False) + 1)[::-1].copy(), rng.integers(0, 10, 5).astype(float)
    count, need, limit = rng.integers(0, 4, 5), int(rng.integers(1, 25)), float(rng.integers(5, 30))
    expected = set()
    for group in product(*(range(agents + 1) for agents in count)):
        done = np.dot(group, weight)
        spare = any(g > 0 and done - w >= need for g, w in zip(group, weight, strict=True))
        if done >= need and not spare and np.dot(group, price) <= limit:
            expected.add(group)
    least, found = np.empty((6, need + 2))[:, : need + 1], np.empty((5000, MAX_GROUP_SIZE), dtype=np.int64)
    fill_least(weight, price, count, least)
    size = list_groups(weight, price, count, least, limit, 1_000_000, found)
    groups = [tuple(np.bincount(row[row >= 0], minlength=5).tolist()) for row in found[:size]]
    assert len(groups) == len(set(groups))
    assert set(groups) == expected


def test_gives_up_if_there_are_too_many():
    """The limits on groups and on nodes are respected."""
    weight, price, count = np.array([3, 2, 1]), np.ones(3), np.full(3, 9)
    least = np.empty((4, 14))[:, :13]  # as the method passes it, of a larger table
    fill_least(weight, price, count, least)
    assert list_groups(weight, price, count, least, 99.0, 1000, np.empty((2, MAX_GROUP_SIZE), dtype=np.int64)) == -1
    assert list_groups(weight, price, count, least, 99.0, 10, np.empty((99, MAX_GROUP_SIZE), dtype=np.int64)) == -1


@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_choice_is_feasible_or_infeasibility_is_proven(seed, equal):
    """At the optimum of brute force a plan is chosen; just below it, infeasibility is proven."""
    instance = machine_covering(8, 3, 1, 30, seed, equal=equal)
    best = brute_force(instance).makespan
    model = Model.build(instance, agent_classes(instance, by_place=False), 3)
    configurations = ConfigurationProgramme(model, best * 0.8)

    def answer(time):
        prices = configurations.dual_prices(time, lambda: False, converge=True)
        if prices.theta > 1:
            return Verdict.INFEASIBLE, None
        programme = enumerate_groups(configurations, prices, time, lambda: False)
        return solve_set_partitioning(programme, 0, lambda: False)

    verdict, table = answer(best * (1 + 1e-9))
    assert verdict is Verdict.FEASIBLE
    assert evaluate(instance, model.plan(table)).makespan == pytest.approx(best)
    assert answer(best * (1 - 1e-6)) == (Verdict.INFEASIBLE, None)
