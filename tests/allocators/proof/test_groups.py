"""The optimum of tiny instances by all groups of agents."""

import numpy as np
import pytest
from oracle import brute_force, least_energy_within
from tiny_instances import tiny_instance

from alloc.allocators import MakespanTolerance
from alloc.allocators.contract.tolerance import EXACT
from alloc.allocators.proof.groups import is_tiny, optimum
from alloc.problems import Instance


@pytest.mark.parametrize("seed", range(60))
def test_optimum_matches_brute_force(seed: int) -> None:
    """Makespan and energy equal brute force, with lists, limits, travel times and idle tasks."""
    instance = tiny_instance(seed)
    best, found = brute_force(instance), optimum(instance, EXACT)
    assert (found is None) == (best.unserved > 0)
    if found is not None:
        assert found.hours == pytest.approx(best.makespan, rel=1e-9)
        assert found.cost == pytest.approx(best.energy, rel=1e-9)
        assert found.hours <= best.makespan
        assert found.cost <= best.energy


def test_cheapest_plan_within_slack_is_best() -> None:
    """With 50 % more time, the cost is the least of all plans within that time."""
    instance = next(one for one in map(tiny_instance, range(60)) if brute_force(one).energy > 1 and one.n > 3)
    found = optimum(instance, MakespanTolerance(0.5))
    assert found is not None
    assert found.cost == pytest.approx(least_energy_within(instance, 1.5 * found.hours), rel=1e-9)


def test_size_determines_whether_groups_are_enumerated() -> None:
    """A dozen agents are few for one task, and too many for ten."""
    assert is_tiny(Instance(ability=np.ones(12), workload=[1]))
    assert not is_tiny(Instance(ability=np.ones(12), workload=np.ones(10)))
    assert not is_tiny(Instance(ability=np.ones(13), workload=[1]))
