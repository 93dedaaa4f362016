"""Instances that the tests of the game share."""

import pytest
from boards import layout

from alloc.problems import Instance
from alloc.problems.game import Board


@pytest.fixture
def pair() -> Instance:
    """Two tasks at 0 and 1 on a line; agents of ability 1, 2, 3 at 0, 0.9 and 0.2, the first with a range of 0.5."""
    return Instance(
        ability=[1, 2, 3],
        workload=[4, 2],
        task_position=[[0, 0], [1, 0]],
        agent_position=[[0, 0], [0.9, 0], [0.2, 0]],
        communication_range=[0.5, 5, 5],
        tau=0.5,
    )


@pytest.fixture
def board(pair: Instance) -> Board:
    return layout(pair)


@pytest.fixture
def route() -> Instance:
    """Tasks at 0, 3 and 7 on a line; two agents of ability 1 begin at the first; batteries last for 11 and 7."""
    return Instance(
        ability=[1, 1],
        workload=[1, 1, 1],
        task_position=[[0, 0], [3, 0], [7, 0]],
        start_task=[0, 0],
        battery=[22, 14],
        energy_per_distance=2.0,
    )
