import numpy as np
import pytest

from alloc.problems import InputError, machine_covering


def test_same_seed_gives_same_instance():
    """The same seed gives the same instance, another seed a different one."""
    first, again, other = (machine_covering(12, 4, 1, 100, seed) for seed in (3, 3, 4))
    assert np.array_equal(first.ability, again.ability)
    assert not np.array_equal(first.ability, other.ability)


def test_abilities_and_workloads_are_in_their_ranges():
    """Abilities are integers in the given range, workloads are all 1000, or integers from 200 to 2000."""
    equal, unequal = (machine_covering(400, 100, 20, 50, 0, equal=equal) for equal in (True, False))
    assert np.array_equal(equal.ability, unequal.ability)
    assert set(equal.ability) == set(range(20, 51))
    assert set(equal.workload) == {1000}
    assert unequal.workload.min() >= 200
    assert unequal.workload.max() <= 2000
    assert len(set(unequal.workload)) > 50
    assert np.array_equal(unequal.workload, np.round(unequal.workload))


def test_real_abilities_are_rarely_integers():
    """Real abilities are rarely integers."""
    ability = machine_covering(50, 20, 1, 100, 0, whole=False).ability
    assert (ability != np.round(ability)).all()
    assert ((ability >= 1) & (ability <= 100)).all()


def test_restricted_agents_have_few_choices():
    """With choices, abilities are the same, and agents may take at most that many tasks, one fixed by their index."""
    free, restricted = machine_covering(20, 6, 1, 9, 0), machine_covering(20, 6, 1, 9, 0, choices=3)
    assert np.array_equal(free.ability, restricted.ability)
    assert free.allowed_tasks is None
    assert all(i % 6 in tasks and 2 <= len(tasks) <= 3 for i, tasks in enumerate(restricted.allowed_tasks))
    assert len({tuple(tasks) for tasks in restricted.allowed_tasks}) > 10
    for choices in (0, 7):
        with pytest.raises(InputError, match="must be"):
            machine_covering(20, 6, 1, 9, 0, choices=choices)


@pytest.mark.parametrize(
    "arguments", [(0, 1, 1, 9, 0), (1, 0, 1, 9, 0), (1, 1, 0, 9, 0), (1, 1, 5, 4, 0), (1, 1, 1, 9, -1)]
)
def test_numbers_out_of_range_are_refused(arguments):
    """Numbers below their minimum are errors."""
    with pytest.raises(InputError, match="must be"):
        machine_covering(*arguments)
