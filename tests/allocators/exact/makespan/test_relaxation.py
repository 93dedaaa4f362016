"""The bound by the linear programme of single agents is valid."""

from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import tiny_instance

from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.model import Model
from alloc.problems import Instance, agent_classes, fewest_unserved

SERVED = [
    seed for seed in range(40) if tiny_instance(seed).workload.any() and fewest_unserved(tiny_instance(seed)) == 0
]


def bound_of(instance: Instance, high: float) -> float:
    """Return the bound between a hundredth of `high` and `high`."""
    model = Model.build(instance, agent_classes(instance, by_place=False), int((instance.workload > 0).sum()))
    return relaxed_lower_bound(model, high / 100, high, 10.0, lambda: False)[0]


@pytest.mark.parametrize("seed", SERVED)
def test_bound_is_valid_for_any_answer_of_the_solver(seed):
    """Neither right nor wrong answers lead to a bound above the optimum."""
    instance, rng = tiny_instance(seed), np.random.default_rng(seed)
    best = brute_force(instance).makespan

    def wrong(cost: np.ndarray, matrix: object, limits: np.ndarray, **_: object) -> SimpleNamespace:
        prices = -rng.exponential(size=len(limits))
        return SimpleNamespace(multiplier=-prices)

    assert bound_of(instance, 2 * best) <= best * (1 + 1e-9)
    with mock.patch("alloc.allocators.exact.makespan.relaxation.minimise", wrong):
        assert bound_of(instance, 2 * best) <= best * (1 + 1e-9)


def test_bound_matches_hand_calculation():
    """Three agents of ability 1 share 9 hours of work, for which a fourth is of no use: the bound is 3 hours."""
    instance = Instance(ability=[1, 1, 1, np.pi], workload=[4, 5, 3], allowed_tasks=[*[[0, 1]] * 3, [2]])
    assert bound_of(instance, 4.0) == pytest.approx(3.0, rel=1e-4)
