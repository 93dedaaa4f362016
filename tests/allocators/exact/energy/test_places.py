import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import tiny_instance

from alloc.allocators.exact.energy.places import nearest_places, without_idlers
from alloc.allocators.exact.model import Model
from alloc.problems import IDLE, Allocation, Instance, agent_classes, evaluate


def test_identical_agents_swap_tasks_to_save_distance():
    """Two agents of the same ability that were sent past each other each take the near task instead."""
    instance = Instance(
        ability=[1, 1], workload=[1, 1], agent_position=[[0, 0], [1, 0]], task_position=[[0, 0], [1, 0]]
    )
    assert nearest_places(instance, Allocation([1, 0])) == Allocation([0, 1])


def test_nearer_idle_agent_takes_over():
    """Idle agents of the class take part in the exchange."""
    instance = Instance(ability=[1, 1], workload=[1], agent_position=[[5, 0], [1, 0]], task_position=[[0, 0]])
    assert nearest_places(instance, Allocation([0, IDLE])) == Allocation([IDLE, 0])


@pytest.mark.parametrize("seed", range(30))
def test_exchange_keeps_the_makespan(seed):
    """Whatever the plan, no completion time changes, no rule is broken and no more energy is used."""
    instance = tiny_instance(seed)
    plan = Allocation(brute_force(instance).plan)
    before, after = evaluate(instance, plan), evaluate(instance, nearest_places(instance, plan))
    assert after.completion_time == pytest.approx(before.completion_time)
    assert not after.violations
    assert after.energy <= before.energy * (1 + 1e-12)


@pytest.mark.parametrize("size", [401, 950])
def test_large_classes_are_split(size):
    """No agent is lost or duplicated if a class is split."""
    rng = np.random.default_rng(0)
    instance = Instance(
        ability=np.ones(size),
        workload=np.full(5, 9.0),
        agent_position=rng.random((size, 3)),
        task_position=rng.random((5, 3)),
    )
    plan = Allocation(rng.integers(-1, 5, size))
    found = nearest_places(instance, plan)
    assert np.array_equal(np.sort(found.task_of_agent), np.sort(plan.task_of_agent))
    assert evaluate(instance, found).energy < evaluate(instance, plan).energy


def test_unneeded_agents_become_idle():
    """Of four agents on a task of two hours' work with two hours left, only the nearest one is kept."""
    instance = Instance(
        ability=[1, 1, 1, 1],
        workload=[2, 2],
        agent_position=[[3, 0], [1, 0], [2, 0], [9, 9]],
        task_position=[[0, 0], [9, 9]],
    )
    model = Model.build(instance, agent_classes(instance, by_place=True), 2)
    assert without_idlers(model, Allocation([0, 0, 0, 1]), 2.0) == Allocation([IDLE, 0, IDLE, 1])
    assert without_idlers(model, Allocation([0, 0, 0, 1]), 1.0) == Allocation([IDLE, 0, 0, 1])
