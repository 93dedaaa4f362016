from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.cuts import cutting_planes, group_master
from alloc.allocators.exact.energy.cuts.all_groups import write_groups
from alloc.allocators.exact.energy.cuts.cluster_cuts import ClusterSeparation, sharing_clusters
from alloc.allocators.exact.energy.cuts.cutting_planes import CuttingPlanes
from alloc.allocators.exact.energy.cuts.known_prices import KnownPrices
from alloc.allocators.exact.energy.cuts.pricing import price_groups
from alloc.allocators.exact.energy.cuts.subset_rows import violated_sets
from alloc.allocators.exact.energy.energy_model import EnergyModel


class DrawnTask:
    """A task with seven classes of up to two agents and four random cuts, and all of its groups written out."""

    def __init__(self, seed, kind):
        rng = np.random.default_rng(seed)
        self.is_whole = kind != "real"
        self.weight = rng.integers(1, 6, 7).astype(float) if self.is_whole else rng.uniform(0.1, 0.6, 7)
        self.need, self.max_weight = (9.0, 10 if kind == "limited" else -1) if self.is_whole else (1.0, -1)
        self.price = rng.uniform(-0.1 if kind == "limited" else 0.0, 1.0, 7)
        self.copies = rng.integers(1, 3, 7)
        self.member, self.penalty = rng.random((4, 7)) < 0.4, rng.uniform(0.0, 1.0, 4)
        self.first_cut, self.cut = np.append(0, self.member.sum(axis=0).cumsum()), np.nonzero(self.member.T)[1].copy()
        groups = np.array(list(product(*(range(most + 1) for most in self.copies))))
        done = groups @ self.weight
        meets = (done >= self.need) & ((done <= self.max_weight) | (self.max_weight < 0))
        self.groups, self.done = groups[meets], done[meets]
        self.cost = self.costs(self.groups)

    def costs(self, groups):
        return groups @ self.price + (groups @ self.member.T // 2) @ self.penalty


@pytest.mark.parametrize("kind", ["whole", "limited", "real"])
@pytest.mark.parametrize("seed", range(12))
def test_cheapest_group_with_cuts_matches_enumeration(seed, kind):
    """With classes of up to two agents and random cuts, no group is cheaper, and the reported cost is right."""
    task = DrawnTask(seed, kind)
    group = np.zeros(7, dtype=np.int64)
    least = price_groups(
        np.array([0, 7]), task.weight, task.price, task.copies, np.array([task.need]), np.array([task.max_weight]),
        task.is_whole, task.first_cut, task.cut, task.penalty, np.array([100.0]), group, 20_000,
    )  # fmt: skip
    assert least == pytest.approx(task.cost.min(), abs=1e-6)
    assert task.costs(group) == pytest.approx(task.cost.min())


@pytest.mark.parametrize("kind", ["whole", "limited", "real"])
@pytest.mark.parametrize("seed", range(12))
def test_enumeration_finds_all_groups_within_a_limit(seed, kind):
    """No group is missing, except non-minimal ones if sums of weights are unlimited."""
    task = DrawnTask(seed, kind)
    least = np.where(task.groups > 0, task.weight, np.inf).min(axis=1)
    wanted = (kind == "limited") | (task.done - least < task.need)
    limit = float(np.quantile(task.cost[wanted], 0.3)) + 1e-9
    group = np.zeros((1000, 7), dtype=np.int64)
    found = write_groups(
        task.weight, task.price, task.copies, task.need, task.max_weight, task.is_whole, task.first_cut, task.cut,
        task.penalty, limit, group,
    )  # fmt: skip
    every, written = {tuple(one) for one in task.groups[task.cost <= limit].tolist()}, group[:found].tolist()
    needed = {tuple(one) for one in task.groups[wanted & (task.cost <= limit)].tolist()}
    assert needed <= {tuple(one) for one in written} <= every
    assert found == len({tuple(one) for one in written}) > 0


def test_cut_closes_the_gap_of_three_agents_for_two_tasks():
    """If any two of three agents suffice for a task, fractional agents suffice for both tasks, integer ones for one."""
    use = np.array([[1, 0, 1], [1, 1, 0], [0, 1, 1], [0, 0, 0]])
    sets, excess = violated_sets(use, np.array([0.5, 0.5, 0.5]), np.array([1, 1, 1, 0]), 0.05, 10)
    assert sets.tolist() == [[0, 1, 2]]
    assert excess == pytest.approx([0.5])


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_cluster_cut_is_valid_and_violated_by_the_mixture(seed, limited):
    """Agents of 5 and 10 for two tasks of 13 in total give at least 15: fractional agents that give 13 violate it."""
    ability = np.append([5, 10], 5 * np.random.default_rng(seed).integers(1, 2, 4, endpoint=True))
    need = np.array([7, 6])
    model = EnergyModel(
        class_of_pair=np.tile(np.arange(6), 2), task_of_pair=np.repeat([0, 1], 6), weight=np.tile(ability, 2),
        copies=np.ones(12, dtype=np.int64), cost=np.zeros(12), need=need,
        max_weight=need + 4 if limited else np.full(2, -1), count=np.ones(6, dtype=np.int64),
        min_agents=np.zeros(6, dtype=np.int64), ability=ability,
    )  # fmt: skip
    use, task, part = np.ones((1, 6)), np.array([0]), np.array([13 / ability.sum()])
    (cut,) = ClusterSeparation(model, np.ones((1, 2), dtype=bool)).violated(use, task, part, lambda: False)
    whole = np.array(list(product((0, 1), repeat=6)))
    done = whole @ ability
    assert (whole[(done >= 13) & ((done <= 17) | (not limited))] @ cut.factor <= cut.limit).all()
    assert part @ cut.use(use, task) > cut.limit + 0.01


def plain_model(tasks: int, classes: int) -> EnergyModel:
    """Return a model in which any three agents, each a class of its own, suffice for a task."""
    pairs = tasks * classes
    return EnergyModel(
        class_of_pair=np.tile(np.arange(classes), tasks), task_of_pair=np.repeat(np.arange(tasks), classes),
        weight=np.ones(pairs, dtype=np.int64), copies=np.ones(pairs, dtype=np.int64), cost=np.ones(pairs),
        need=np.full(tasks, 3), max_weight=np.full(tasks, -1), count=np.ones(classes, dtype=np.int64),
        min_agents=np.zeros(classes, dtype=np.int64), ability=np.ones(classes, dtype=np.int64),
    )  # fmt: skip


def test_groups_and_cuts_are_limited_by_memory(monkeypatch):
    """Tables of groups grow up to their limit; the programme continues with the groups that it has."""
    monkeypatch.setattr(group_master, "MAX_ENTRIES", 2 * group_master.ROOM * group_master.ROOM_FOR_CUTS)
    master = group_master.GroupMaster(plain_model(1, 30), np.ones((1, 1), dtype=bool))
    added = 0
    for members in combinations(range(30), 3):
        group = np.zeros(30, dtype=np.int64)
        group[list(members)] = 1
        added += master.add(group)
    assert added == 2 * group_master.ROOM < 4060
    assert max(master._use.size, master._used.size) <= group_master.MAX_ENTRIES
    assert master.solve(lambda: False)
    assert master.value == pytest.approx(3.0)
    assert not master._has_room(cut=True) or master._used.shape[1] == group_master.ROOM_FOR_CUTS


def test_tasks_that_share_agents_become_clusters():
    """Tasks 0 and 1, and 1 and 2, share agents; task 3 has integer ones."""
    mixed = np.array([[0.5, 0.0, 1.0], [0.5, 0.4, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, 2.0]])
    clusters = {tuple(np.flatnonzero(inside)) for inside in sharing_clusters(mixed, 8)}
    assert {(0, 1), (1, 2), (0, 1, 2)} <= clusters
    assert not any(3 in cluster and len(cluster) > 1 for cluster in clusters)


def knapsack_of(rng: np.random.Generator, limited: bool) -> EnergyModel:
    """Two tasks of one cluster, and eight classes of one or two agents."""
    ability, count = rng.integers(1, 6, 8), rng.integers(1, 3, 8)
    need = np.array([6, 7])
    return EnergyModel(
        class_of_pair=np.tile(np.arange(8), 2), task_of_pair=np.repeat([0, 1], 8), weight=np.tile(ability, 2),
        copies=np.tile(count, 2), cost=np.zeros(16), need=need, max_weight=need + 1 if limited else np.full(2, -1),
        count=count, min_agents=np.zeros(8, dtype=np.int64), ability=ability,
    )  # fmt: skip


@pytest.mark.parametrize("limited", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_cluster_is_cut_unless_its_mixture_is_a_convex_combination_of_integer_solutions(seed, limited):
    """A linear programme over all enumerated solutions gives the largest violation of a cut."""
    rng = np.random.default_rng(seed)
    model, both = knapsack_of(rng, limited), np.ones((1, 2), dtype=bool)
    knapsack = ClusterSeparation(model, both)._knapsack(both[0])
    every = np.array(list(product(*(range(most + 1) for most in knapsack.copies))))
    done = every @ knapsack.weight
    every = every[(done >= knapsack.need[0]) & ((done <= knapsack.max_weight[0]) | (not limited))]
    use = every[rng.integers(len(every), size=3)].astype(float)
    task, part = np.zeros(3, dtype=int), np.full(3, 1 / 3)
    assert not ClusterSeparation(model, both).violated(use, task, part, lambda: False)
    use[0, np.flatnonzero(use[0])[0]] -= 0.75
    goal = np.append(-part @ use, 1.0)
    ends = [(-1.0, 1.0 if limited else 0.0)] * 8 + [(None, None)]
    most = -linprog(goal, np.hstack([every, -np.ones((len(every), 1))]), np.zeros(len(every)), bounds=ends).fun
    cuts = ClusterSeparation(model, both).violated(use, task, part, lambda: False)
    assert bool(cuts) == (most > 0.021)
    for cut in cuts:
        assert (every @ cut.factor <= cut.limit).all()


def test_groups_too_expensive_at_earlier_prices_are_excluded():
    """Of three groups, one is too expensive by its agents, one by the penalty of its set of classes."""
    model, prices = plain_model(1, 4), KnownPrices()
    prices.note(model, np.array([0.1, 0.1, 0.1, 0.9]), np.array([0.8]), 2.0, np.array([0.3]))
    group = csr_array(np.array([[1, 1, 1, 0], [1, 1, 0, 1], [0, 1, 1, 1]]))
    used, sets, task = np.array([[1.0], [0.0], [0.0]]), np.array([0]), np.zeros(3, dtype=np.int64)
    assert prices.within(model, 2.7, task, group, used, sets).tolist() == [False, False, False]
    assert prices.within(model, 2.85, task, group, used, sets).tolist() == [True, True, True]
    assert prices.within(model, 2.7, task, group, used, sets[:0]).tolist() == [True, False, False]


def three_for_two() -> tuple[EnergyModel, list[np.ndarray]]:
    """Any two of three agents, or an expensive one alone, do either of two tasks; return the groups of both as well."""
    model = EnergyModel(
        class_of_pair=np.tile(np.arange(4), 2), task_of_pair=np.repeat([0, 1], 4), weight=np.tile([1, 1, 1, 2], 2),
        copies=np.ones(8, dtype=np.int64), cost=np.tile([1.0, 1.0, 1.0, 3.0], 2), need=np.array([2, 2]),
        max_weight=np.full(2, -1), count=np.array([1, 1, 1, 4]), min_agents=np.zeros(4, dtype=np.int64),
        ability=None,
    )  # fmt: skip
    return model, [np.tile(group, 2) for group in ([1, 1, 0, 0], [1, 0, 1, 0], [0, 1, 1, 0], [0, 0, 0, 1])]


def test_cuts_over_classes_can_be_removed_again():
    """They raise the value of the mixture; after their removal it is as before, and no new ones are separated."""
    model, groups = three_for_two()
    master = group_master.GroupMaster(model, np.zeros((0, 2), dtype=bool))
    for group in groups:
        master.add(group)
    assert master.solve(lambda: False)
    before = master.value
    assert master.separate(lambda: False)
    assert master.solve(lambda: False)
    assert master.value > before + 0.1
    assert len(master.leave_out_sets()) > 0
    assert master.solve(lambda: False)
    assert master.value == pytest.approx(before)
    assert not master.separate(lambda: False)


def test_expensive_groups_are_left_out_until_they_are_added_again():
    """At prices of zero, an expensive agent costs 1 above the least; with two of each other agent it is not used."""
    model, groups = three_for_two()
    model = replace(model, count=np.array([2, 2, 2, 4]))
    master = group_master.GroupMaster(model, np.zeros((0, 2), dtype=bool))
    for group in groups:
        master.add(group)
    assert master.solve(lambda: False)
    least, at = np.full(2, 2.0), (np.zeros(4), np.zeros(0))
    master.leave_out_dear(*at, least, 0.5)
    kept = np.isfinite(master._cost[:8])
    assert np.bincount(master._task[:8][kept]).tolist() == [3, 3]
    assert master._use[:8][kept][:, 3].max() == 0
    assert master.add(groups[3])
    assert not master.add(groups[3])
    assert np.isfinite(master._cost[:8]).all()


def test_bound_with_cuts_reaches_the_least_cost_with_an_integer_mixture():
    """Two agents for one task and the expensive one for the other cost 5, mixtures 4.5."""
    model, groups = three_for_two()
    cuts = CuttingPlanes(model, np.zeros((0, 2), dtype=bool), np.zeros(4), groups)
    cuts.ascend(50, 5.5)
    assert cuts.bound == pytest.approx(5.0, abs=1e-3)
    mixed = cuts.mixture
    assert mixed @ model.cost >= cuts.bound - 1e-3
    assert (np.bincount(model.class_of_pair, mixed, 4) <= model.count + 1e-6).all()
    assert (np.bincount(model.task_of_pair, mixed * model.weight, 2) >= model.need - 1e-6).all()


@pytest.mark.parametrize(("most", "bound"), [(1000, 5.0), (1, 4.5)])
def test_longer_searches_for_groups_are_tried_before_cuts_over_classes_are_removed(most, bound, monkeypatch):
    """Searches of one node lose so much that cuts are of no use; they are removed if searches may not be longer."""
    monkeypatch.setattr(cutting_planes, "FIRST_NODES", 1)
    monkeypatch.setattr(cutting_planes, "MAX_NODES", most)
    model, groups = three_for_two()
    cuts = CuttingPlanes(model, np.zeros((0, 2), dtype=bool), np.zeros(4), groups)
    cuts.ascend(50, 5.5)
    assert cuts.bound == pytest.approx(bound, abs=1e-3)


def real_tasks(seed):
    """Return a model of three tasks and nine agents whose weights depend on the task."""
    rng, agents, tasks = np.random.default_rng(seed), 9, 3
    count = np.ones(agents, dtype=np.int64)
    return EnergyModel(
        class_of_pair=np.tile(np.arange(agents), tasks), task_of_pair=np.repeat(np.arange(tasks), agents),
        weight=rng.uniform(0.15, 0.6, agents * tasks), copies=np.ones(agents * tasks, dtype=np.int64),
        cost=rng.uniform(0.5, 1.5, agents * tasks), need=np.full(tasks, 1 - 1e-10),
        max_weight=np.full(tasks, -1), count=count, min_agents=0 * count, ability=None,
    )  # fmt: skip


def best_plan(model):
    """Return the least cost of all plans, each tried, and the groups of the best, shape (p,)."""
    agents, tasks = len(model.count), len(model.need)
    weight, cost = (np.vstack([of.reshape(tasks, agents), np.zeros(agents)]) for of in (model.weight, model.cost))
    plans = np.array(list(product(range(tasks + 1), repeat=agents)))
    done = [np.where(plans == j, weight[j], 0.0).sum(axis=1) for j in range(tasks)]
    total = cost[plans, np.arange(agents)].sum(axis=1)
    total[np.any([part < 1 - 1e-10 for part in done], axis=0)] = np.inf
    best = int(total.argmin())
    return float(total[best]), (plans[best] == np.arange(tasks)[:, None]).astype(np.int64).ravel()


@pytest.mark.parametrize("seed", range(6))
def test_bound_with_cuts_holds_where_weights_depend_on_the_task(seed):
    """It is at most the least cost of all plans."""
    model = real_tasks(seed)
    least, plan = best_plan(model)
    cuts = CuttingPlanes(model, np.zeros((0, 3), dtype=bool), np.zeros(9), [plan])
    cuts.ascend(100, 1.1 * least)
    assert 0.9 * least <= cuts.bound <= least * (1 + 1e-9)
