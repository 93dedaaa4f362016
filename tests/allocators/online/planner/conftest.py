import pytest

from alloc.problems import Instance


@pytest.fixture
def pair() -> Instance:
    """Two agents below two tasks, 1 away; ann needs 2 hours for t1 then, ben 2 for t2."""
    return Instance(
        agent_ids=["ann", "ben"],
        task_ids=["t1", "t2"],
        ability=[2, 3],
        workload=[4, 6],
        agent_position=[[0, 0], [4, 0]],
        task_position=[[0, 1], [4, 1]],
        battery=[20, 20],
        speed=[1, 1],
        energy_per_distance=1.0,
    )
