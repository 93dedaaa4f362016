from itertools import product

import numpy as np
import pytest
from oracle import brute_force
from scipy.optimize import linprog
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.model import Model
from alloc.problems import Instance, agent_classes, machine_covering, makespan_lower_bound


def model_of(instance: Instance) -> Model:
    return Model.build(instance, agent_classes(instance, by_place=False), int((instance.workload > 0).sum()))


def never() -> bool:
    return False


@pytest.mark.parametrize("seed", seeds_where(all_can_be_served, 40))
def test_no_feasible_makespan_is_excluded(seed):
    """On tiny instances of every kind, no prices exclude the optimum of brute force."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    assert not best.unserved
    low = makespan_lower_bound(instance)
    configurations = ConfigurationProgramme(model_of(instance), low)
    for time in (low, (low + best.makespan) / 2, best.makespan * (1 - 1e-6), best.makespan * (1 + 1e-9)):
        prices = configurations.dual_prices(time, never, converge=True)
        assert prices is not None
        assert prices.converged
        if prices.theta > 1:
            assert time < best.makespan
            assert configurations.largest_infeasible(prices, time, 2 * best.makespan) < best.makespan * (1 + 1e-9)


def test_arrays_have_the_compiled_types():
    """Weights are contiguous; a column of a table would cause a recompilation within a run."""
    instance = Instance(ability=[3, 5, 6, 7], workload=[10, 14], allowed_tasks=[None, None, [0], [1]])
    needs = ConfigurationProgramme(model_of(instance), 1.0).needs(1.0)
    assert [len(each.tasks) for each in needs] == [1, 1]
    assert all(each.weight.flags.c_contiguous for each in needs)


def test_theta_matches_the_programme_over_all_groups():
    """Column generation ends at the optimum of the programme over all enumerated groups."""
    instance = Instance(ability=[3, 5, 6, 7, 9, 11], workload=[10, 14, 17])
    model = model_of(instance)
    time, columns, rows, values = 1.05, [], [], []
    need = [need for each in ConfigurationProgramme(model, time).needs(time) for need in each.need]
    for j, group in product(range(3), product((0, 1), repeat=6)):
        if np.dot(group, instance.ability) >= need[j]:
            columns.append(np.concatenate([np.eye(3)[j], group]))
    a_eq = np.array([np.append(column[:3], 0) for column in columns]).T[:3]
    rows, values = np.array([column[3:] for column in columns]).T, np.ones((6, 1))
    answer = linprog(
        np.append(np.zeros(len(columns)), 1),
        A_ub=np.hstack([rows, -values]),
        b_ub=np.zeros(6),
        A_eq=np.hstack([a_eq, np.zeros((3, 1))]),
        b_eq=np.ones(3),
    )
    prices = ConfigurationProgramme(model, time).dual_prices(time, never, converge=True)
    assert prices is not None
    assert prices.converged
    if answer.fun <= 1:
        assert prices.theta == pytest.approx(answer.fun, rel=1e-6)
    else:
        assert prices.theta > 1


def test_raises_the_simple_bound():
    """With 2.5 agents per task, the bound of (40, 16) U[1,100], seed 1, rises by 2.2 %."""
    instance = machine_covering(40, 16, 1, 100, 1)
    low = makespan_lower_bound(instance)
    configurations = ConfigurationProgramme(model_of(instance), low)
    prices = configurations.dual_prices(low * 1.0215, never)
    assert prices is not None
    assert prices.theta > 1


@pytest.mark.parametrize("seed", range(3))
def test_real_abilities_are_rounded_conservatively(seed):
    """On a grid, weights are not rounded down, and needs are not rounded up."""
    instance = machine_covering(30, 10, 1, 100, seed, equal=False, whole=False)
    model = model_of(instance)
    low = makespan_lower_bound(instance)
    configurations = ConfigurationProgramme(model, low)
    (needs,) = configurations.needs(low * 1.1)
    assert needs.need.max() > 1000
    share = needs.weight[model.class_of_pair] / needs.need[model.task_of_pair]
    truth = model.classes.ability[model.class_of_pair] * low * 1.1 / model.workload[model.task_of_pair]
    assert (share >= truth).all()


def test_stops_on_request():
    """There are no prices then, and nothing is claimed."""
    instance = machine_covering(40, 16, 1, 100, 1)
    configurations = ConfigurationProgramme(model_of(instance), makespan_lower_bound(instance))
    assert configurations.dual_prices(1.0, lambda: True) is None
