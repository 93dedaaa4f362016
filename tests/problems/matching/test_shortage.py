"""Assignment of agents to competing tasks, compared with brute force."""

import numpy as np
import pytest
from hypothesis import given
from oracle import brute_force
from strategies import instances

from alloc.problems import Allocation, Instance, evaluate, find_shortage


@given(instances(most_agents=4, most_tasks=5))
def test_shortage_matches_brute_force(instance: Instance) -> None:
    """There is a shortage if tasks stay unserved; its bound is valid, and the optimum if nothing else is left."""
    best, shortage = brute_force(instance), find_shortage(instance)
    assert (shortage is None) == (best.unserved == 0)
    if shortage is not None:
        assert len(shortage.tasks) - len(shortage.agents) == best.unserved
        assert shortage.bound == pytest.approx(shortage.hours, rel=1e-9)
        assert shortage.bound <= best.makespan * (1 + 1e-9)
        if shortage.rest is None:
            score = evaluate(instance, shortage.economical(best.makespan, lambda: np.inf).merged())
            assert score.served_makespan == pytest.approx(best.makespan, rel=1e-9)
            assert score.energy == pytest.approx(best.energy, rel=1e-9, abs=1e-9)
        else:
            assert find_shortage(shortage.rest) is None
            assert (
                shortage.bound <= max(shortage.hours, brute_force(shortage.rest).makespan) <= best.makespan * 1.000001
            )


def test_plan_matches_hand_calculation() -> None:
    """Agent 0 leaves the easiest task to agent 1, which would take ten hours for the other that it can do."""
    instance = Instance(
        ability=[100, 1, 1], workload=[1, 10, 11, 5], allowed_tasks=[[0, 2], [0, 1], [3]]
    )  # the least work, tasks 0 and 1, would take agent 1 ten hours
    shortage = find_shortage(instance)
    assert shortage is not None
    assert shortage.merged(Allocation([0])) == Allocation([2, 0, 3])
    assert (shortage.hours, shortage.bound) == (1.0, 1.0)
    assert shortage.part_of(Allocation([2, 0, 3])) == Allocation([0])


def test_zero_time_still_gives_a_maximum_matching() -> None:
    """Without time the matching is not improved, but is still valid."""
    rng = np.random.default_rng(1)
    lists = [rng.permutation(60)[:8].tolist() for _ in range(20)]
    instance = Instance(ability=rng.uniform(1, 9, 20), workload=rng.uniform(1, 9, 60), allowed_tasks=lists)
    hurried, unhurried = find_shortage(instance, lambda: 0.0), find_shortage(instance)
    assert hurried is not None
    assert unhurried is not None
    assert len(np.unique(hurried.task_of_agent)) == 20
    assert hurried.bound <= unhurried.bound == unhurried.hours <= hurried.hours
