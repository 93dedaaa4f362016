import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators.heuristic.greedy.task_tree import build_tree
from alloc.allocators.heuristic.task_prices.prices import TaskPrices
from alloc.allocators.heuristic.task_prices.regions import regions_of
from alloc.allocators.heuristic.task_prices.rounding import rounded
from alloc.allocators.heuristic.task_prices.sample import representatives
from alloc.problems import Instance, evaluate, makespan_lower_bound, serve_all


def never() -> bool:
    return False


def prices_of(instance: Instance) -> TaskPrices:
    """Return prices from the simple bound on, improved without a limit."""
    prices = TaskPrices(instance, makespan_lower_bound(instance), map, 1)
    prices.improve(np.inf, never)
    return prices


def travelling(agents: int, tasks: int, seed: int = 0, *, reach: float = 0.5) -> Instance:
    """Return an instance in the unit square with speeds and ranges."""
    rng = np.random.default_rng(seed)
    return Instance(
        ability=rng.integers(1, 10, agents),
        workload=rng.integers(50, 800, tasks) * (agents / (80 * tasks)),
        agent_position=rng.random((agents, 2)),
        task_position=rng.random((tasks, 2)),
        communication_range=np.full(agents, reach),
        speed=rng.uniform(1, 5, agents),
    )


@pytest.mark.parametrize("seed", seeds_where(all_can_be_served, 40))
def test_bound_never_exceeds_the_optimum(seed):
    """On tiny instances of every kind, the bound lies between the simple bound and the optimum of brute force."""
    instance = tiny_instance(seed)
    if instance.workload.any():
        bound = prices_of(instance).bound
        assert makespan_lower_bound(instance) <= bound <= brute_force(instance).makespan * (1 + 1e-9)


def test_shortlists_contain_the_most_valuable_tasks():
    """The tree finds the same tasks and values as checking all pairs."""
    instance = travelling(200, 60)
    prices = TaskPrices(instance, 1.0, map, 1)
    price = np.random.default_rng(1).uniform(0.5, 1.0, instance.m)
    bidders = prices._bidders(np.arange(instance.n), instance.ability, 5)
    total = bidders.renew(price, 2.0)
    distance, mask = instance.reach.rows(instance.reach.origin)
    value = np.where(mask, price * np.maximum(0, 1 - distance / (2.0 * instance.speed[:, None])), 0.0)
    assert total == pytest.approx(float(instance.ability @ value.max(axis=1)))
    assert (np.argsort(-value, axis=1)[:, :5] == bidders.lists.task).all()


def test_prices_raise_the_bound_with_short_shortlists():
    """If agents reach many tasks, prices still raise the bound."""
    instance = travelling(20_000, 300, reach=np.inf)
    assert prices_of(instance).bound > 1.005 * makespan_lower_bound(instance)


def test_prices_raise_the_bound_to_the_fractional_optimum():
    """With travel times, bound and fractional makespan nearly meet, well above the simple bound."""
    instance = travelling(3_000, 30)
    prices = prices_of(instance)
    assert prices.bound > 1.002 * makespan_lower_bound(instance)
    assert prices.makespan < 1.0005 * prices.bound


def test_bound_does_not_depend_on_threads():
    """Agents divided among threads have the same values."""
    instance = travelling(1_000, 20)
    bounds = []
    for threads in (1, 3):
        prices = TaskPrices(instance, makespan_lower_bound(instance), map, threads)
        prices.improve(np.inf, never)
        bounds.append(prices.bound)
    assert bounds[0] == pytest.approx(bounds[1], rel=1e-5)


def test_rounded_plan_lacks_little_of_the_work():
    """A rounded plan respects reach, and has small shortfalls."""
    instance = travelling(3_000, 30)
    prices = prices_of(instance)
    plan = rounded(prices)
    score = evaluate(instance, serve_all(instance, plan))
    assert not score.violations
    assert score.makespan < 1.03 * prices.bound


def test_best_response_passes_reduce_shortfalls():
    """Without passes in which agents move to where they contribute most, the plan is much slower."""
    instance = travelling(3_000, 30)
    prices = prices_of(instance)
    settled, calls = rounded(prices), iter([False, False])  # both passes of the assignment, and no other
    unsettled = rounded(prices, lambda: next(calls, True))
    slow, fast = (evaluate(instance, plan).served_makespan for plan in (unsettled, settled))
    assert fast - prices.bound < 0.3 * (slow - prices.bound)


@pytest.mark.parametrize("count", [10, 1_000])
def test_sample_represents_all_ability_in_every_quarter(count):
    """Representatives have the total ability, and in each quarter of the square about the actual one."""
    instance = travelling(4_000, 10, seed=3)
    chosen, ability = representatives(instance, count)
    assert len(np.unique(chosen)) == count
    assert ability.sum() == pytest.approx(instance.ability.sum())
    place = instance.reach.place[instance.reach.origin]
    quarter = (place[:, 0] > 0.5) + 2 * (place[:, 1] > 0.5)
    total, sampled = np.bincount(quarter, instance.ability), np.bincount(quarter[chosen], ability, 4)
    assert sampled == pytest.approx(total, rel=0.01 if count == 1_000 else 0.6)


def test_sample_with_few_agents_or_no_positions():
    """At most all agents are sampled; without positions, any agents represent the others."""
    instance = Instance(ability=np.arange(1, 101), workload=[1.0, 2.0])
    chosen, ability = representatives(instance, 1_000)
    assert chosen.tolist() == [*range(100)]
    assert (ability == instance.ability).all()
    chosen, ability = representatives(instance, 7)
    assert len(np.unique(chosen)) == 7
    assert ability.sum() == pytest.approx(5050)


def test_prices_end_early_without_travel_times():
    """Without travel times and with similar reach, a sample shows that prices prove nothing."""
    instance = Instance(ability=np.ones(100), workload=np.full(10, 5.0), allowed_tasks=[[*range(10)]] * 100)
    prices = TaskPrices(instance, makespan_lower_bound(instance), map, 1)
    assert not prices.improve(np.inf, never)
    assert prices.bidders is None


def test_distant_shortfall_is_priced_in_few_iterations():
    """With agents at one end of a line, work at the other, and partial reach, bounds converge quickly."""
    n, m = 8_000, 200
    rng = np.random.default_rng(0)
    along = np.linspace(0, 1, m)
    instance = Instance(
        ability=rng.integers(1, 10, n),
        workload=(0.6 + 0.4 * along) * 5 * n / (0.8 * m),
        agent_position=np.stack([rng.random(n) ** 1.4, np.zeros(n)], axis=1),
        task_position=np.stack([along, np.zeros(m)], axis=1),
        speed=rng.uniform(1, 5, n),
        communication_range=np.full(n, 0.05),
    )
    prices, others = (TaskPrices(instance, makespan_lower_bound(instance), map, 1) for _ in range(2))
    others._regions = others._regions[:, :0]
    for one in (prices, others):
        one.improve(np.inf, never)
    assert prices.bound > 1.04 * others.bound
    assert prices.makespan < 1.00001 * prices.bound


def test_regions_are_the_nodes_of_the_tree():
    """Each task belongs to all regions on its path to the root, with weights that decrease with their size."""
    position = np.random.default_rng(0).random((50, 3))
    tree = build_tree(position, np.arange(10, 50))
    weight = regions_of(tree).toarray()
    assert weight.shape == (40, len(tree.begin))
    for node, (begin, end) in enumerate(zip(tree.begin, tree.end, strict=True)):
        inside = np.isin(np.arange(10, 50), tree.order[begin:end])
        assert weight[:, node] == pytest.approx(np.where(inside, (end - begin) ** -0.25, 0.0))


def test_single_tasks_are_not_regions():
    """A single task already has its own variable."""
    assert regions_of(build_tree(np.zeros((3, 3)), np.array([1]))).shape == (1, 0)
