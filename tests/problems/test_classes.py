"""Classes of interchangeable agents."""

import numpy as np
import pytest
from hypothesis import given
from strategies import allocated, instances

from alloc.problems import Allocation, Instance, Objective, agent_classes, evaluate


@given(allocated())
def test_spread_and_tally_are_inverse(case: tuple[Instance, Allocation]) -> None:
    """Numbers per class and task survive being spread over agents, and the scores with them."""
    instance, allocation = case
    for by_place in (False, True):
        classes = agent_classes(instance, by_place=by_place)
        counts = classes.tally(allocation)
        spread = classes.spread(counts)
        assert (classes.tally(spread) == counts).all()
        goal = Objective.MAKESPAN_ENERGY if by_place else Objective.MAKESPAN
        assert evaluate(instance, spread).key(goal) == pytest.approx(evaluate(instance, allocation).key(goal))


@given(instances())
def test_members_of_a_class_are_identical(instance: Instance) -> None:
    """A class has the ability, speed, tasks and, by place, distances of each of its members."""
    for by_place in (False, True):
        classes = agent_classes(instance, by_place=by_place)
        kind = classes.class_of_agent
        assert classes.count.tolist() == np.bincount(kind).tolist()
        assert (classes.ability[kind] == instance.ability).all()
        assert (classes.speed[kind] == instance.speed).all()
        assert (classes.mask[kind] == instance.reach.mask[instance.reach.origin]).all()
        if by_place:
            assert (classes.distance[kind] == instance.reach.distance[instance.reach.origin]).all()


def test_class_counts_match_hand_calculation() -> None:
    """Three abilities at two places: three classes, four by place; travel times tell places apart as well."""
    fields = {
        "ability": [1, 2, 2, 3, 2],
        "workload": [1, 1],
        "task_position": [[0, 0], [1, 0]],
        "start_task": [0, 0, 1, 1, 0],
    }
    instance = Instance(**fields)
    assert agent_classes(instance, by_place=False).size == 3
    assert agent_classes(instance, by_place=True).size == 4
    assert agent_classes(Instance(**fields, speed=[1] * 5), by_place=False).size == 4


def test_more_agents_than_a_class_has_are_refused() -> None:
    """More agents than a class has cannot be spread."""
    classes = agent_classes(Instance(ability=[1, 1], workload=[1]), by_place=False)
    with pytest.raises(ValueError, match="more agents"):
        classes.spread(np.array([[3]]))
