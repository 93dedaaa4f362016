from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import allocated, instances

from alloc.allocators.heuristic.local_search import annealing_state as chain_module
from alloc.allocators.heuristic.local_search.anneal import helper
from alloc.allocators.heuristic.local_search.annealing_state import Chain, measure
from alloc.allocators.heuristic.local_search.instance_arrays import survey
from alloc.allocators.heuristic.local_search.kernels import by_halves, by_sums, by_trial, distance_of, sorted_subsets
from alloc.allocators.heuristic.local_search.plan import Weights, room_to_work
from alloc.problems import IDLE, Allocation, Instance, evaluate, serve_all

WEIGHTS = Weights(distance=1.0, noise=0.0, charge=3.0, lack=0.7, spare=2.0, sums=10.0)


def pool_of(seed, size, *, whole):
    rng = np.random.default_rng(seed)
    scratch = room_to_work(seed)
    ability = rng.integers(1, 9, size) if whole else rng.uniform(0.5, 8, size)
    scratch.here[:size] = scratch.there[:size] = ability
    scratch.price[:size] = rng.normal(size=size)
    left = float(rng.integers(1, 4 * size)) if whole else rng.uniform(1, 4 * size)
    return scratch, left, float(ability.sum()) - left - float(rng.integers(-2, 4))


def value(scratch, size, chosen, left, right, weights):
    """Return the price of sending the agents with bits in `chosen` to the first task, from the definition."""
    goes = np.array([int(chosen) >> bit & 1 for bit in range(size)], dtype=bool)
    price = float(scratch.price[:size][goes].sum())
    for lack in (left - scratch.here[:size][goes].sum(), right - scratch.there[:size][~goes].sum()):
        price += weights.charge + weights.lack * lack if lack > 0 else 0.0
    return price


def cheapest(scratch, size, left, right, weights):
    return min(value(scratch, size, chosen, left, right, weights) for chosen in range(1 << size))


@pytest.mark.parametrize("seed", range(20))
def test_trial_is_exact(seed):
    """Trying all sets finds the cheapest."""
    size = 1 + seed % 8
    scratch, left, right = pool_of(seed, size, whole=False)
    chosen = by_trial(scratch, WEIGHTS, size, left, right, False, False)
    found = value(scratch, size, chosen, left, right, WEIGHTS)
    assert found == pytest.approx(cheapest(scratch, size, left, right, WEIGHTS))


@pytest.mark.parametrize("seed", range(20))
def test_sums_are_exact(seed):
    """Dynamic programming over all sums finds the cheapest set where abilities are whole numbers."""
    size = 1 + seed % 8
    scratch, left, right = pool_of(seed, size, whole=True)
    total = float(scratch.here[:size].sum())
    chosen = by_sums(scratch, WEIGHTS, size, int(total), total, left, right, False, False)
    found = value(scratch, size, chosen, left, right, WEIGHTS)
    assert found == pytest.approx(cheapest(scratch, size, left, right, WEIGHTS))


@pytest.mark.parametrize("seed", range(20))
def test_halves_lack_least(seed):
    """Where prices do not count, two halves find a set that lacks as little as any."""
    size = 2 + seed % 8
    scratch, left, right = pool_of(seed, size, whole=False)
    scratch.price[:size] = 0.0
    weights = WEIGHTS._replace(charge=0.0)
    chosen = by_halves(scratch, weights, size, left, right)
    found = value(scratch, size, chosen, left, right, weights)
    assert found == pytest.approx(cheapest(scratch, size, left, right, weights))


def test_nobody_is_left_alone():
    """A task that would lose its last agent keeps it, however dear that is."""
    scratch = room_to_work(0)
    scratch.here[0], scratch.there[0], scratch.price[0] = 1.0, 1.0, 1e6
    assert by_trial(scratch, WEIGHTS, 1, 1e-9, 0.0, True, False) == 1
    assert by_sums(scratch, WEIGHTS, 1, 1, 1.0, 1e-9, 0.0, True, False) == 1


def test_subsets_come_in_order():
    """All sets are there, sorted by their sums, each with its own price."""
    scratch, *_ = pool_of(3, 7, whole=False)
    size = sorted_subsets(scratch, 2, 5, 0)
    assert size == 32
    assert (np.diff(scratch.trial_here[:size]) >= 0).all()
    for entry in range(size):
        goes = [bit for bit in range(7) if scratch.trial_set[entry] >> bit & 1]
        assert scratch.trial_here[entry] == pytest.approx(scratch.here[goes].sum())
        assert scratch.trial_cost[entry] == pytest.approx(scratch.price[goes].sum())
    assert len(set(scratch.trial_set[:size].tolist())) == size


@settings(max_examples=60, deadline=None)
@given(instances())
def test_distances_are_those_of_reach(instance):
    """The loops measure what `Reach` does, to the last bit, and out of reach is infinitely far."""
    ground = survey(instance)
    expected = np.where(instance.reach.mask, instance.reach.distance, np.inf)
    for row, task in product(range(len(ground.place)), range(instance.m)):
        assert distance_of.py_func(ground, row, task) == expected[row, task]
    table, _ = measure(instance, 2)
    assert np.array_equal(table.table, expected)


def test_far_places():
    """Coordinates at the ends of what is valid are measured as `Reach` measures them."""
    instance = Instance(
        ability=[1, 1], workload=[1, 1], agent_position=[[1e60, 0], [0, 3e40]], task_position=[[0, 1e60], [5, 5]]
    )
    ground, _ = measure(instance, 2)
    assert np.array_equal(ground.table, instance.reach.distance)


@settings(max_examples=40, deadline=None)
@given(allocated())
@pytest.mark.parametrize("limit", [0, 10_000])
def test_books_are_kept(limit, drawn):
    """After many exchanges, groups, loads and the distance are what they would be if worked out anew."""
    instance, start = drawn
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chain_module, "TABLE_LIMIT", limit)
        chain = Chain(instance, 1, 3)
        start = serve_all(instance, start)
        hours = max(evaluate(instance, start).served_makespan, 1e-3)
        chain.begin(start, hours)
        chain.run(300, Weights(1.0, 0.3, 0.5, 0.5, 2.0, chain.sums), 0.99)
        score = evaluate(instance, chain.allocation)
        assert score.violations == ()
        plan = chain.plan
        assert chain.distance == pytest.approx(score.distance, abs=1e-9)
        load, short = plan.load.copy(), chain.short
        chain.refresh()
        assert plan.load == pytest.approx(load, abs=1e-9)
        assert chain.short == short
        members = [plan.slot[plan.begin[j] : plan.begin[j] + plan.size[j]] for j in range(instance.m + 1)]
        assert sorted(np.concatenate(members).tolist()) == list(range(instance.n))
        for group, agents in enumerate(members):
            assert (plan.task[agents] == group).all()


def test_full_groups_get_more_room():
    """A group that outgrows its room is laid out anew, and nobody gets lost."""
    instance = Instance(ability=np.ones(200), workload=[*[1.0] * 49, 151.0])
    chain = Chain(instance, 0, 5)
    chain.begin(Allocation(np.arange(200) % 50), 1.0)
    for _ in range(50):
        if chain.short:
            chain.run(1000, Weights(0.0, 0.01, 0.0, 1.0, 2.0, chain.sums), 1.0)
    assert chain.short == 0
    assert evaluate(instance, chain.allocation).makespan == 1.0


def test_helpers_can_come():
    """The agent that is to help a task reaches it, where there is one that does."""
    instance = Instance(ability=[1.0] * 4, workload=[1.0, 1.0], allowed_tasks=[[0], [0], [1], [0, 1]])
    chain = Chain(instance, 0, 2)
    chain.begin(Allocation([0, IDLE, 1, IDLE]), 1.0)
    assert {int(helper(chain.ground, chain.plan, 1)) for _ in range(50)} == {2, 3}
