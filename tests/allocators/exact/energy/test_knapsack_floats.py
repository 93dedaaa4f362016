"""The cheapest group for a task where weights are no integers, against all groups written out."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alloc.allocators.exact.energy import knapsack_floats
from alloc.allocators.exact.energy.knapsack_floats import cheapest_in_floats


def by_trying(weight, price, copies, need):
    """Least cost over all groups, one by one."""
    groups = np.array(list(product(*(range(most + 1) for most in copies))))
    return float((groups @ price)[groups @ weight >= need].min(initial=np.inf))


float_classes = st.lists(
    st.tuples(st.integers(1, 40), st.integers(0, 30), st.integers(1, 3), st.floats(0.9, 1.1)), min_size=1, max_size=6
)


@given(float_classes, st.integers(1, 160))
def test_states_find_the_cheapest_group(rows, need):
    """With weights that are no integers, cost, group and the bounds on the excess agree with all groups written out."""
    whole, price, copies, factor = (np.array(column) for column in zip(*rows, strict=True))
    weight, price, copies, need = whole * factor / 40, price / 20, copies.astype(np.int64), need / 40
    group, excess = np.zeros(len(rows), dtype=np.int64), np.zeros(len(rows))
    cost = cheapest_in_floats(weight, price, copies, need, group, excess)
    assert cost == pytest.approx(by_trying(weight, price, copies, need))
    if np.isfinite(cost):
        assert group @ weight >= need
        assert ((group >= 0) & (group <= copies)).all()
        assert group @ price == pytest.approx(cost)
        for k in range(len(rows)):
            others = copies - (np.arange(len(rows)) == k)
            with_one = by_trying(weight, price, others, need - weight[k]) + price[k]
            assert cost + excess[k] <= with_one + 1e-9


@pytest.mark.parametrize("most", [1, 3, 10, 30])
@pytest.mark.parametrize("seed", range(5))
def test_states_that_end_early_still_give_a_bound(seed, most):
    """With room for a few states only, what is returned is at most the cost of the best group."""
    rng = np.random.default_rng(seed)
    weight, copies = rng.uniform(0.2, 0.4, 10), np.ones(10, dtype=np.int64)
    price, group = weight + rng.uniform(0, 0.01, 10), np.zeros(10, dtype=np.int64)
    few = knapsack_floats.best_states.py_func
    reduced = price - 1.01 * weight
    base = float(weight[reduced < 0].sum())
    group[reduced < 0] = 1
    relaxed = 1.01 * 1.5 + reduced[reduced < 0].sum()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(knapsack_floats, "MAX_STATES", most)
        beyond = few(weight, reduced, np.abs(reduced), copies, base, 1.01, 1.5, group)
    assert relaxed + beyond <= by_trying(weight, price, copies, 1.5) + 1e-12
