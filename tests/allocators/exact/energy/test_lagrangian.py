from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from oracle import brute_force, least_energy_within
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators.exact.energy import lagrangian
from alloc.allocators.exact.energy.clusters import overlapping_clusters
from alloc.allocators.exact.energy.cuts.cutting_planes import CuttingPlanes
from alloc.allocators.exact.energy.energy_model import EnergyModel, round_demand
from alloc.allocators.exact.energy.lagrangian import LagrangianBound
from alloc.allocators.exact.energy.subproblems import solve_subproblems
from alloc.allocators.exact.model import Model
from alloc.problems import agent_classes
from alloc.problems.evaluation import last_equal

LINE = np.abs(np.subtract.outer(np.arange(4.0), np.arange(4.0)))


@cache
def model_of(seed: int, tasks: int, *, limited: bool) -> tuple[EnergyModel, float, np.ndarray]:
    """Return a model of six different agents, the cost of its best plan, and that plan; the last task is idleness."""
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
@pytest.mark.parametrize("seed", range(4))
def test_bound_never_exceeds_the_optimum_and_keeps_its_pairs(seed, limited, worse, monkeypatch):
    """However long prices aim at the cost of a worse plan, the bound is below the best plan, which loses no pair."""
    monkeypatch.setattr(lagrangian, "is_small", lambda model: False)  # small models have no prices of clusters
    model, best, plan = model_of(seed, 4, limited=limited)
    bound = LagrangianBound(model, LINE, np.zeros(len(model.count)))
    bound.ascend(1000, best * worse)
    assert 0.5 * best < bound.bound <= best * (1 + 1e-9)
    used = model.task_of_pair == plan[model.class_of_pair]
    assert bound.kept[used].all()


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_excess_is_a_lower_bound_on_the_extra_cost_of_a_pair(seed, limited):
    """The best group with an agent of the pair, of all enumerated groups, costs more by at least the excess."""
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


@pytest.mark.parametrize("worse", [1.0, 1.2])
@pytest.mark.parametrize("kind", ["whole", "limited", "real"])
@pytest.mark.parametrize("seed", range(8))
def test_bound_by_cutting_planes_never_exceeds_the_optimum(seed, kind, worse):
    """Until no cut is violated any more, the bound is below the best plan, which loses no pair."""
    model, best, plan = model_of(seed, 4, limited=kind == "limited")
    if kind == "real":
        part, need = model.weight / model.need[model.task_of_pair], np.full(len(model.need), 1 - 1e-10)
        model = replace(model, weight=part, need=need, ability=None)
    group = (model.task_of_pair == plan[model.class_of_pair]).astype(np.int64)
    member = overlapping_clusters(LINE, 100) if model.ability is not None else np.zeros((0, 4), dtype=bool)
    cuts = CuttingPlanes(model, member, np.zeros(len(model.count)), [group])
    for _ in range(200):
        cuts.ascend(1, best * worse)
        assert cuts.bound <= best * (1 + 1e-9)
    assert cuts.converged or cuts.bound >= best * (1 - 1e-9)
    assert cuts.kept[group > 0].all()
    assert cuts.bound >= 0.9 * best


@pytest.mark.parametrize("worse", [1.0, 1.2])
@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_best_plan_over_enumerated_groups_is_optimal(seed, limited, worse):
    """The groups of all plans cheaper than a given one contain the best plan, and none cheaper."""
    model, best, plan = model_of(seed, 4, limited=limited)
    group = (model.task_of_pair == plan[model.class_of_pair]).astype(np.int64)
    cuts = CuttingPlanes(model, overlapping_clusters(LINE, 100), np.zeros(len(model.count)), [group])
    cuts.ascend(20, best * worse)
    monitor = SimpleNamespace(run=lambda work, stop: work())
    programme = cuts.all_groups(best * worse, 1000)
    counts, bound = programme.solve(monitor, 0, repeatable=True)
    assert bound == pytest.approx(best, rel=1e-6)
    assert counts is None or counts @ programme.model.cost == pytest.approx(best)
    assert counts is not None or worse == 1.0
    nothing, bound = cuts.all_groups(best * 0.999, 1000).solve(monitor, 0, repeatable=True)
    assert nothing is None
    assert bound <= best


def has_float_weights(instance):
    """Return whether weights are not integers, and some flights have a cost."""
    model = Model.build(instance, agent_classes(instance, by_place=True), instance.m)
    return all_can_be_served(instance) and model.unit is None and model.cost.any()


@pytest.mark.parametrize("slack", [1.0, 1.2])
@pytest.mark.parametrize("seed", seeds_where(has_float_weights, 30))
def test_bound_in_floats_never_exceeds_the_least_energy(seed, slack):
    """With speeds and real-valued abilities, brute force finds no plan in time that costs less than the bound."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    time = best.makespan * slack
    if time == 0:
        return
    energy = least_energy_within(instance, time)
    model = Model.build(instance, agent_classes(instance, by_place=True), int((instance.workload > 0).sum()))
    demand = model.at(last_equal(time))
    rounded, _ = round_demand(demand, model.cost[model.pairs_at(demand)])
    assert not rounded.is_whole
    tasks = len(rounded.need)
    bound = LagrangianBound(rounded, np.zeros((tasks, tasks)), np.zeros(len(rounded.count)))
    least = energy / instance.energy_per_distance
    bound.ascend(200, least * 1.1 + 1e-9)
    assert bound.bound <= least * (1 + 1e-9) + 1e-12
    assert bound.bound >= 0.3 * least
