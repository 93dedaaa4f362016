"""Allocations: indices inside, ids at the edge."""

import numpy as np
import pytest
from hypothesis import given
from strategies import allocated

from alloc.problems import Allocation, InputError, Instance


@given(allocated())
def test_ids_and_indices_are_inverse(case: tuple[Instance, Allocation]) -> None:
    """Every agent is named, and the names lead back."""
    instance, allocation = case
    named = allocation.to_ids(instance)
    assert list(named) == list(instance.agent_ids)
    assert Allocation.from_ids(instance, named) == allocation


def test_missing_agents_are_idle(line: Instance) -> None:
    """Agents that are missing or null have no task."""
    assert Allocation.from_ids(line, {"a2": "t3", "a3": None}) == Allocation([-1, 2, -1, -1])
    assert Allocation.from_ids(line, {}) == Allocation.idle(line)


@pytest.mark.parametrize(("names", "hint"), [({"a22": "t1"}, "'a2'"), ({"a1": "t33"}, "'t3'")])
def test_unknown_ids_are_errors(line: Instance, names: dict, hint: str) -> None:
    """An unknown name is an error with the most similar known one."""
    with pytest.raises(InputError, match=f"did you mean {hint}"):
        Allocation.from_ids(line, names)


def test_allocations_are_compared_by_value() -> None:
    """Allocations are compared and hashed by value; the array is a read-only copy."""
    tasks = np.array([0, 1])
    one, other = Allocation(tasks), Allocation([0, 1])
    tasks[0] = 5
    assert one == other
    assert len({one, other, Allocation([1, 0])}) == 2
    assert one != "0 1"
    with pytest.raises(ValueError, match="read-only"):
        one.task_of_agent[0] = 1
    with pytest.raises(InputError, match="one task index per agent"):
        Allocation([[0, 1]])
