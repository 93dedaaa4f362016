"""Instances are validated on construction, and read-only."""

import numpy as np
import pytest

from alloc.problems import InputError, Instance

NAN, INF = float("nan"), float("inf")


def test_defaults_are_unlimited_or_unknown() -> None:
    """Ability and workload are enough; all else is unlimited or unknown."""
    instance = Instance(ability=[1, 2], workload=[3])
    assert (instance.n, instance.m, instance.agent_ids, instance.task_ids) == (2, 1, ("a1", "a2"), ("t1",))
    assert (instance.tau, instance.energy_per_distance, instance.allowed_tasks) == (0.5, 1.0, None)
    assert np.isinf(instance.battery).all()
    assert np.isinf(instance.communication_range).all()
    assert np.isnan(instance.start_position).all()
    assert instance.start_task.tolist() == [-1, -1]
    assert instance.priority.tolist() == [1.0]
    assert not instance.has_travel_time


@pytest.mark.parametrize(
    ("fields", "place"),
    [
        ({"ability": []}, "agents"),
        ({"workload": []}, "tasks"),
        ({"ability": [1, 0]}, "agents[1].ability"),
        ({"ability": [INF, 1]}, "agents[0].ability"),
        ({"ability": ["x", 1]}, "ability"),
        ({"workload": [1, -1]}, "tasks[1].workload"),
        ({"workload": [1, NAN]}, "tasks[1].workload"),
        ({"priority": [1, -2]}, "tasks[1].priority"),
        ({"battery": [-1, 1]}, "agents[0].battery"),
        ({"priority": [NAN, 1]}, "tasks[0].priority"),
        ({"communication_range": [1, -1]}, "agents[1].range"),
        ({"speed": [0, 1]}, "agents[0].speed"),
        ({"tau": 1.0}, "tau"),
        ({"tau": NAN}, "tau"),
        ({"energy_per_distance": -1}, "energy_per_distance"),
        ({"agent_position": [[0, 0], [INF, 0]]}, "agents[1].position"),
        ({"start_task": [0, 2]}, "agents[1].start_task"),
        ({"start_task": [0.5, 0]}, "start_task"),
        ({"allowed_tasks": [None, [2]]}, "agents[1].tasks"),
        ({"allowed_tasks": [[], [-1]]}, "agents[1].tasks"),
        ({"allowed_tasks": [None, [0.5]]}, "agents[1].tasks"),
        ({"allowed_tasks": [None]}, "allowed_tasks"),
        ({"ability": [1e61, 1]}, "agents[0].ability"),
        ({"ability": [1, 1e-61]}, "agents[1].ability"),
        ({"workload": [5e-324, 0]}, "tasks[0].workload"),
        ({"workload": [0, 1e300]}, "tasks[1].workload"),
        ({"speed": [1, 5e-324]}, "agents[1].speed"),
        ({"energy_per_distance": 1e61}, "energy_per_distance"),
        ({"task_position": [[0, 0], [0, -1.7e308]]}, "tasks[1].position"),
    ],
)
def test_invalid_values_are_located(fields: dict, place: str) -> None:
    """Invalid values are refused with their place in the data."""
    with pytest.raises(InputError) as caught:
        Instance(**{"ability": [1, 1], "workload": [1, 1], **fields})
    assert caught.value.place == place


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"return_base": [1]}, r"agents\[0\].return_base: is 1, but bases run from 0 to 0"),
        ({"return_base": [0], "returns": [False]}, r"agents\[0\].returns: is False, but 'north' is the base"),
        ({"bases": {"True": None}}, r"bases\[0\].id: 'True' cannot be the name of a base"),
        ({"bases": {"north": (1,)}}, r"bases\[0\].position: must be 2 or 3 numbers"),
    ],
)
def test_invalid_bases_are_refused(fields: dict, message: str) -> None:
    """Unknown bases, contradictions with `returns`, and names and places that files cannot store are refused."""
    with pytest.raises(InputError, match=message):
        Instance(**{"ability": [1], "workload": [1], "bases": {"north": (0, 1)}, **fields})


@pytest.mark.parametrize("kind", ["agent_ids", "task_ids"])
def test_ids_are_unique(kind: str) -> None:
    """Repeated names, and a wrong number of names, are errors."""
    for ids in (["x", "x"], ["x"]):
        with pytest.raises(InputError):
            Instance(ability=[1, 1], workload=[1, 1], **{kind: ids})


def test_position_takes_precedence_over_start_task() -> None:
    """A position takes precedence over a start task; 2-D positions have z = 0."""
    instance = Instance(
        ability=[1, 1, 1],
        workload=[1, 1],
        task_position=[[1, 2], [NAN, NAN]],
        agent_position=[[5, 6], [NAN, NAN], [NAN, NAN]],
        start_task=[0, 0, 1],
    )
    assert instance.start_position[:2].tolist() == [[5, 6, 0], [1, 2, 0]]
    assert np.isnan(instance.start_position[2]).all()


def test_allowed_tasks_are_sorted_and_unique() -> None:
    """Lists are sorted and unique; None differs from an empty list."""
    lists = [(2, 0, 2), None, [], np.array([1]), {1, 0}]
    instance = Instance(ability=np.ones(5), workload=[1, 1, 1], allowed_tasks=lists)
    assert instance.allowed_tasks is not None
    assert [tasks if tasks is None else tasks.tolist() for tasks in instance.allowed_tasks] == [
        [0, 2],
        None,
        [],
        [1],
        [0, 1],
    ]
    assert instance.reach.mask[instance.reach.origin].astype(int).tolist() == [
        [1, 0, 1],
        [1, 1, 1],
        [0, 0, 0],
        [0, 1, 0],
        [1, 1, 0],
    ]


def test_removing_agents_keeps_all_fields() -> None:
    """The remaining agents keep all fields, and tasks are unchanged."""
    instance = Instance(
        ability=[1, 2, 3],
        workload=[4, 5],
        task_position=[[0, 0], [1, 0]],
        start_task=[0, 1, 1],
        battery=[7, 8, 9],
        allowed_tasks=[None, [0], [1]],
        priority=[1, 2],
        tau=0.25,
    )
    left = instance.without_agents({"a2"})
    assert (left.agent_ids, left.task_ids) == (("a1", "a3"), ("t1", "t2"))
    assert (left.ability.tolist(), left.battery.tolist(), left.start_task.tolist()) == ([1, 3], [7, 9], [0, 1])
    assert left.reach.mask[left.reach.origin].tolist() == [[True, True], [False, True]]
    assert (left.priority.tolist(), left.tau) == ([1, 2], 0.25)
    with pytest.raises(InputError, match="no agent 'a4'"):
        instance.without_agents(["a4"])
    with pytest.raises(InputError, match="at least one agent"):
        instance.without_agents(instance.agent_ids)


def test_arrays_are_read_only_copies() -> None:
    """Given arrays can be changed afterwards without effect; arrays of the instance are read-only."""
    given = np.array([1.0, 2.0])
    instance = Instance(ability=given, workload=[1])
    given[0] = 9
    assert instance.ability.tolist() == [1, 2]
    for array in (instance.ability, instance.start_position, instance.battery):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 5
    with pytest.raises(AttributeError):
        instance.tau = 0.1
