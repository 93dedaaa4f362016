import numpy as np
import pytest
from oracle import brute_force, reachable
from tiny_instances import tiny_instance

from alloc.problems import Allocation, Instance, evaluate


@pytest.mark.parametrize("seed", range(30))
def test_evaluator_agrees_with_the_oracle(seed):
    """The optimum found by brute force has the same scores by `evaluate`, which shares no code with it."""
    instance = tiny_instance(seed)
    best = brute_force(instance)
    score = evaluate(instance, Allocation(best.plan))
    assert not score.violations
    assert len(score.unserved_tasks) == best.unserved
    assert score.served_makespan == pytest.approx(best.makespan, rel=1e-9)
    assert score.energy == pytest.approx(best.energy, rel=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_no_random_plan_beats_the_optimum(seed):
    """No random plan is better than the optimum in the order of objectives."""
    instance, rng = tiny_instance(seed), np.random.default_rng(seed)
    best = evaluate(instance, Allocation(brute_force(instance).plan))
    for _ in range(50):
        score = evaluate(instance, Allocation(rng.integers(-1, instance.m, instance.n)))
        assert not score.is_better_than(best, "makespan-energy") or score.violations


def test_optimum_matches_hand_calculation():
    """Two agents of ability 2 and 1, tasks of 4 and 1: the strong one does the large task, T = 2, and flies 3."""
    instance = Instance(
        ability=[2, 1],
        workload=[4, 1],
        agent_position=[[0, 0, 0], [0, 0, 0]],
        task_position=[[2, 0, 0], [0, 1, 0]],
    )
    best = brute_force(instance)
    assert (best.unserved, best.makespan, best.energy, best.plan) == (0, 2.0, 3.0, (0, 1))


def test_travel_delays_work():
    """Ability 2, workload 4, distance 3 at speed 1: three hours of flight and two of work."""
    instance = Instance(ability=[2], workload=[4], agent_position=[[0, 0]], task_position=[[3, 0]], speed=[1])
    assert brute_force(instance).makespan == 5.0


def test_reach_has_a_tolerance():
    """A battery that suffices up to rounding is enough."""
    instance = Instance(ability=[1], workload=[1], agent_position=[[0, 0]], task_position=[[0.3, 0]], battery=[0.3])
    assert reachable(instance)[1].all()
