from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alloc.allocators.exact.knapsack import cheapest_group, fill_table, read_group
from alloc.allocators.exact.knapsack_core import cheapest_by_core
from alloc.allocators.exact.knapsack_states import CHEAPER, MAX_STATES, cheapest_by_states, room_for_states

classes = st.lists(st.tuples(st.integers(1, 7), st.integers(-2, 9), st.integers(0, 3)), min_size=1, max_size=4)


def arrays(rows):
    """Return weights, prices and copies as arrays for compiled code."""
    weight, price, copies = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True))
    return weight, price / 4, copies


def by_states(weight, price, copies, need, cheaper, group, *, size=MAX_STATES, excess=()):
    """Return the result of lists of states with a given capacity."""
    weight, states = weight.astype(float), room_for_states(size)
    return cheapest_by_states(
        weight, price, copies, float(need), cheaper, states, group, np.asarray(excess, dtype=float)
    )


def by_trying(weight, price, copies, need, enough):
    """Return the least cost by brute force over all groups."""
    groups = np.array(list(product(*(range(most + 1) for most in copies))))
    total = groups @ weight
    good = (total >= need) & (total <= enough)
    return float((groups @ price)[good].min(initial=np.inf))


@given(classes, st.integers(0, 12), st.one_of(st.just(-1), st.integers(0, 6)))
def test_cheapest_group_matches_brute_force(rows, need, spare):
    """Cost and group are right for prices of either sign, with and without a limit on the sum."""
    weight, price, copies = arrays(rows)
    enough = need + spare if spare >= 0 else -1
    cost, group = cheapest_group(weight, price, copies, need, enough)
    assert cost == pytest.approx(by_trying(weight, price, copies, need, enough if enough >= 0 else np.inf))
    if np.isfinite(cost):
        assert need <= group @ weight
        assert enough < 0 or group @ weight <= enough
        assert (group >= 0).all()
        assert (group <= copies).all()
        assert group @ price == pytest.approx(cost)


@pytest.mark.parametrize("exact", [False, True])
def test_one_table_answers_for_every_need(exact):
    """The table filled for the largest need has the costs and groups of all smaller ones."""
    rng = np.random.default_rng(0)
    weight, price, copies = rng.integers(1, 9, 12), rng.random(12), rng.integers(1, 6, 12)
    table = fill_table(weight, price, copies, 40, exact)
    for need in range(41):
        cost, _ = cheapest_group(weight, price, copies, need, need if exact else -1)
        group = read_group(table, 12, need)
        assert table[0][need] == pytest.approx(cost)
        assert group @ price == pytest.approx(cost)
        assert group @ weight >= need


def test_weights_are_capped_at_the_need():
    """An agent that alone exceeds the need meets it, but meets no smaller sum exactly."""
    weight, price, copies = np.array([50, 2]), np.array([1.0, 0.4]), np.array([1, 9])
    assert cheapest_group(weight, price, copies, 10, -1)[0] == 1.0
    assert cheapest_group(weight, price, copies, 10, 10)[0] == 2.0


def test_infeasible_needs_cost_infinity():
    """If all agents are too few, or no sum fits, the cost is infinite and no agent is taken."""
    weight, price, copies = np.array([2]), np.array([1.0]), np.array([3])
    for need, enough in ((7, -1), (3, 3)):
        cost, group = cheapest_group(weight, price, copies, need, enough)
        assert cost == np.inf
        assert not group.any()


@given(st.integers(0, 2**32), st.integers(0, 3), st.integers(1, 90))
def test_core_contains_the_cheapest_group(seed, spare, classes):
    """Optimising only the core loses nothing, for prices of either sign."""
    rng = np.random.default_rng(seed)
    weight, copies = rng.integers(1, 11, classes), rng.integers(1, 4, classes)
    price = rng.normal(0, 1, classes)
    need = int(rng.integers(0, 1 + weight @ copies))
    cost, group = cheapest_by_core(weight, price, copies, need, need + spare)
    assert cost == pytest.approx(cheapest_group(weight, price, copies, need, need + spare)[0])
    if np.isfinite(cost):
        assert group @ price == pytest.approx(cost)
        assert need <= group @ weight <= need + spare
        assert (group <= copies).all()


@settings(max_examples=20)
@given(st.integers(0, 2**32), st.integers(1, 60), st.sampled_from([1, 2**30]))
def test_state_lists_find_the_cheapest_group(seed, classes, scale):
    """Lists of states agree with the table, also for numbers far beyond any table."""
    rng = np.random.default_rng(seed)
    weight, copies = rng.integers(1, 40, classes), rng.integers(1, 4, classes)
    price = rng.integers(0, 500, classes).astype(float)
    need, group = int(rng.integers(1, 2 + weight @ copies)), np.zeros(classes, dtype=np.int64)
    cost = by_states(weight * scale, price, copies, need * scale, CHEAPER, group)
    assert cost == cheapest_group(weight, price, copies, need, -1)[0]
    if np.isfinite(cost):
        assert group @ price == cost
        assert group @ weight >= need
        assert (group >= 0).all()
        assert (group <= copies).all()


@given(st.integers(0, 2**32), st.integers(2, 6), st.sampled_from([0.0, CHEAPER]))
def test_cost_is_a_bound_with_too_few_states(seed, size, cheaper):
    """If states do not fit, no group is cheaper than the returned cost, and the returned group meets the need."""
    rng = np.random.default_rng(seed)
    weight, price, copies = rng.integers(5, 40, 30), rng.integers(1, 500, 30).astype(float), np.ones(30, dtype=np.int64)
    need, group = int(weight.sum() // 2), np.zeros(30, dtype=np.int64)
    cost = by_states(weight, price, copies, need, cheaper, group, size=size)
    assert cost <= cheapest_group(weight, price, copies, need, -1)[0] + 1e-9 <= group @ price + 1e-8
    assert group @ weight >= need


float_classes = st.lists(
    st.tuples(st.integers(1, 40), st.integers(0, 30), st.integers(1, 3), st.floats(0.9, 1.1)), min_size=1, max_size=6
)


@given(float_classes, st.integers(1, 160))
def test_state_lists_of_reals_find_the_cheapest_group(rows, need):
    """With non-integer weights, cost, group and bounds on the excess agree with brute force."""
    whole, price, copies, factor = (np.array(column) for column in zip(*rows, strict=True))
    weight, price, copies, need = whole * factor / 40, price / 20, copies.astype(np.int64), need / 40
    group, excess = np.zeros(len(rows), dtype=np.int64), np.zeros(len(rows))
    cost = by_states(weight, price, copies, need, 0.0, group, excess=excess)
    assert cost == pytest.approx(by_trying(weight, price, copies, need, np.inf))
    if np.isfinite(cost):
        assert group @ weight >= need
        assert ((group >= 0) & (group <= copies)).all()
        assert group @ price == pytest.approx(cost)
        for k in range(len(rows)):
            others = copies - (np.arange(len(rows)) == k)
            with_one = by_trying(weight, price, others, need - weight[k], np.inf) + price[k]
            assert cost + excess[k] <= with_one + 1e-9
