"""The annealed search for plans of less energy where travel takes time."""

import itertools

import numpy as np
import pytest

from alloc.allocators.exact.energy.travel.repartition import Tasks, repartition
from alloc.allocators.exact.energy.travel.search import TravelSearch


def objective(value, weight, tasks, option):
    """What options of agents cost, with penalties of shortfalls."""
    total = value[np.arange(len(option)), option].sum()
    for j in range(len(tasks.done)):
        done = tasks.done[j] + weight[option == j, j].sum()
        more, short = max(0.0, done - 1), max(0.0, 1 - done)
        total += tasks.price[j] * more + tasks.penalty[j] * short + tasks.fixed_penalty[j] * (short > 0)
    return total


@pytest.mark.parametrize("seed", range(40))
def test_repartition_is_optimal(seed):
    """Of all ways to share some agents among tasks, the search finds one that costs the least."""
    rng = np.random.default_rng(seed)
    agents, count = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    weight = np.hstack([rng.uniform(0.05, 0.6, (agents, count)), np.zeros((agents, 1))])
    price = rng.uniform(0.5, 3, count)
    tasks = Tasks(rng.uniform(0, 0.5, count), price, rng.uniform(0, 1, count), price * rng.uniform(0.5, 4, count))
    value = np.hstack([rng.uniform(0, 1, (agents, count)) - price * weight[:, :-1], np.zeros((agents, 1))])
    value[:, :-1][rng.random((agents, count)) < 0.2] = np.inf
    current, best = np.full(agents, count), np.full(agents, -1)
    gain = repartition(value, weight, tasks, current, 10**6, best)
    all_ways = itertools.product(range(count + 1), repeat=agents)
    least = min(objective(value, weight, tasks, np.array(one)) for one in all_ways)
    before = objective(value, weight, tasks, current)
    assert gain == pytest.approx(before - least, abs=1e-8)
    if gain > 0:
        assert objective(value, weight, tasks, best) == pytest.approx(least)


def test_search_plans_are_feasible_with_the_reported_cost():
    """The best plan leaves no task short, has agents only within reach, and costs less than the first one."""
    rng = np.random.default_rng(5)
    agents, tasks = 40, 6
    cost = rng.random((agents, tasks))
    weight = rng.uniform(0.1, 0.5, (agents, tasks)) * (1 - 0.3 * cost)
    cost[rng.random((agents, tasks)) < 0.2] = np.inf
    weight[np.isinf(cost)] = 0
    first = np.argmin(cost, axis=1)
    weight /= 0.7 * np.bincount(first, weight[np.arange(agents), first], tasks)
    search = TravelSearch(cost, first, rng.random((tasks, tasks)), 0)
    search.set_weights(weight, first)
    search.set_prices(np.full(agents, 0.3))
    before = search.cost
    for _ in range(20):
        search.anneal(10_000)
    working = np.flatnonzero(search.best < tasks)
    task = search.best[working]
    assert search.cost < 0.9 * before
    assert search.cost == pytest.approx(cost[working, task].sum())
    assert (np.bincount(task, weight[working, task], tasks) >= 1).all()
