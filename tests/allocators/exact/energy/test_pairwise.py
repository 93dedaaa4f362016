from itertools import pairwise, product

import numpy as np
import pytest

from alloc.allocators.exact.energy.pairwise import repartition_pair, total_distance
from alloc.allocators.exact.energy.pairwise_search import CYCLES, PairwiseSearch, Perturbation


@pytest.mark.parametrize("partner", ["task", "idleness"])
@pytest.mark.parametrize("seed", range(10))
def test_repartition_of_a_pair_is_optimal(seed, partner):
    """No assignment of seven agents to two tasks, or a task and idleness, that meets the needs is cheaper."""
    rng = np.random.default_rng(seed)
    weight, task = rng.integers(1, 6, 7), np.append([0, 1], rng.integers(0, 2, 5))
    task = np.where(task == 1, 1 if partner == "task" else 2, 0)
    distance = np.hstack([rng.random((7, 2)), np.zeros((7, 1))])
    distance[1:, :2][rng.random((6, 2)) < 0.2] = np.inf
    distance[np.arange(7), task] = np.minimum(distance[np.arange(7), task], 1.0)
    other = int(task.max())
    need = np.append(np.maximum(0, np.bincount(task, weight, 3)[:2] - 1), 0).astype(np.int64)
    need[1] = need[1] if other == 1 else 0
    best = np.inf
    for goal in product((0, other), repeat=7):
        if (np.bincount(goal, weight, 3) >= need).all():
            best = min(best, distance[np.arange(7), list(goal)].sum())
    before = total_distance(task, distance)
    changed = repartition_pair(0, other, task, weight, distance, need, np.zeros_like(distance))
    assert total_distance(task, distance) == pytest.approx(best)
    assert changed == (best < before - 1e-9)
    assert (np.bincount(task, weight, 3) >= need).all()


def test_search_meets_all_needs_and_never_loses_its_best_plan():
    """Descent and annealing yield plans that do every task, with a best distance that never increases."""
    rng = np.random.default_rng(0)
    weight, task = rng.integers(1, 9, 30), np.arange(30) % 6
    need = np.bincount(task, weight, 6).astype(np.int64) - 2
    place = rng.random((6, 2))
    apart = np.linalg.norm(place[:, None] - place[None], axis=2)
    search = PairwiseSearch(task, weight, rng.random((30, 6)), need, apart, seed=1)
    costs = [search.cost]
    while not search.descend():
        costs.append(search.cost)
    for step in range(5):
        search.anneal(20, step / 5)
        costs.append(search.cost)
        assert (np.bincount(search.best, weight, 7)[:6] >= need).all()
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.6 * costs[0]


def search_of(seed: int) -> tuple[PairwiseSearch, np.ndarray, np.ndarray]:
    """Return a search with 30 agents and six tasks, their distances, and its initial plan."""
    rng = np.random.default_rng(seed)
    weight, task, distance = rng.integers(1, 9, 30), np.arange(30) % 6, rng.random((30, 6))
    need = np.bincount(task, weight, 6).astype(np.int64) - 2
    return PairwiseSearch(task, weight, distance, need, 1 - np.eye(6), seed), distance, task


def test_search_assigns_agents_only_to_allowed_tasks():
    """Or where they already are, which may be far from the best."""
    search, _, task = search_of(2)
    allowed = np.random.default_rng(0).random((30, 6)) < 0.4
    search.restrict(allowed)
    for step in range(5):
        search.anneal(20, step / 5)
    moved = (search.best != task) & (search.best < 6)
    assert moved.any()
    assert allowed[moved, search.best[moved]].all()


def test_each_cooling_cycle_starts_from_the_best_plan():
    """At the start of a cycle, a hot search leaves the best plan; the next cycle returns to it."""
    search, _, _ = search_of(2)
    search._perturbation = Perturbation(temperature=1000.0)
    for begin, end in pairwise((0.0, *CYCLES[:-1])):
        search.anneal(30, begin)
        assert search._task.tolist() != search.best.tolist()
        search.anneal(0, end)
        assert search._task.tolist() == search.best.tolist()


def test_search_adopts_better_feasible_plans():
    """Another search's plan is adopted, even on pairs not allowed here; one that leaves a task undone is not."""
    (search, _, task), (other, *_) = search_of(2), search_of(2)
    search.restrict(np.zeros((30, 6), dtype=bool))
    for step in range(5):
        other.anneal(20, step / 5)
    search.adopt(np.full(30, 6))
    assert search.best.tolist() == task.tolist()
    search.adopt(other.best)
    assert search.cost == pytest.approx(other.cost)
    search.anneal(20, 0.5)
    assert search.cost <= other.cost * (1 + 1e-9)
