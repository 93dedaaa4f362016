import numpy as np
import pytest

from alloc.allocators.explain import explain, makespan_with_agent
from alloc.problems import Allocation, Instance, evaluate


def test_enough_is_the_least_ability_that_moves_the_bottleneck():
    """With `enough` the next task is last; with slightly less the makespan is longer; with more it is the same."""
    instance = Instance(ability=[5, 5, 4], workload=[12, 4, 1])
    allocation = Allocation([0, 1, 2])
    found = explain(instance, allocation)
    assert (found.last, found.next_task, found.agents) == ((0,), 1, (0,))
    assert (found.makespan, found.next_time) == (12 / 5, 4 / 5)
    assert found.enough.ability == pytest.approx(12 / 0.8 - 5)
    assert found.enough.makespan == pytest.approx(0.8)
    score, group = evaluate(instance, allocation), np.array([0])
    more = makespan_with_agent(instance, score, group, 0, found.enough.ability * 2)
    less = makespan_with_agent(instance, score, group, 0, found.enough.ability * 0.99)
    assert more == pytest.approx(0.8)
    assert less > 0.8 * 1.001
    assert found.typical.ability == 5
    assert found.typical.makespan == 1.2
    assert found.use == pytest.approx(17 / (14 * 2.4))


def test_travel_times_count_for_the_present_group():
    """With finite speeds the group works from its arrivals on, and the additional agent from hour 0 on."""
    instance = Instance(
        ability=[2, 1],
        workload=[6, 2],
        speed=[1, np.inf],
        agent_position=[[0, 0], [5, 0]],
        task_position=[[1, 0], [5, 0]],
    )
    found = explain(instance, Allocation([0, 1]))
    assert (found.makespan, found.next_time) == (4.0, 2.0)
    assert found.enough.ability == pytest.approx((6 - 2 * 1) / 2)  # one hour of the two is travel
    assert found.enough.makespan == pytest.approx(2.0)


def test_tied_bottlenecks():
    """If several tasks are last, no single agent gains anything."""
    found = explain(Instance(ability=[1, 2], workload=[2, 4]), Allocation([0, 1]))
    assert found.last == (0, 1)
    assert (found.enough, found.typical, found.next_task) == (None, None, None)
    assert found.use == 1


def test_single_task():
    """Without a next task there is only the gain of a typical agent."""
    found = explain(Instance(ability=[1, 3], workload=[8, 0]), Allocation([0, 0]))
    assert (found.next_task, found.enough) == (None, None)
    assert (found.typical.ability, found.typical.makespan) == (2, 8 / 6)


def test_infeasible_agents_do_not_count():
    """An agent on a task that it may not do is not in the group."""
    instance = Instance(ability=[1, 3], workload=[8], allowed_tasks=[None, []])
    assert explain(instance, Allocation([0, 0])).agents == (0,)


@pytest.mark.parametrize(("workload", "tasks"), [([1, 1], [0, 0]), ([0, 0], [0, 1])])
def test_no_bottleneck(workload, tasks):
    """Unserved tasks, or no work at all, have no bottleneck."""
    assert explain(Instance(ability=[1, 3], workload=workload), Allocation(tasks)) is None
