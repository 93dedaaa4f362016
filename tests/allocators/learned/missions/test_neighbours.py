"""Predictions of the choices of free neighbours by an agent of `gappo`."""

from pathlib import Path

import numpy as np
import pytest

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network import first_network
from alloc.allocators.learned.missions.options import fill_options
from alloc.allocators.learned.missions.play import new_buffers
from alloc.allocators.learned.missions.policy_file import save_network
from alloc.allocators.learned.missions.turns import fill_shared_parts, nearer, new_joint_decisions
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.layout import ORDERS
from alloc.allocators.missions.pack import begun, pack
from alloc.allocators.online.policies.gappo import NetworkPolicy
from alloc.allocators.online.run import simulate
from alloc.problems import Instance, Mission
from alloc.problems.missions.radio import Radio

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load


def pair(metric: str = "euclidean") -> Mission:
    """Return a mission of two agents at one place, and two tasks as far off from there."""
    instance = Instance(
        ability=[3, 2],
        workload=[9, 9],
        agent_position=[[0.5, 0.5], [0.5, 0.5]],
        task_position=[[0.2, 0.5], [0.8, 0.5]],
        speed=[1, 1],
        metric=metric,
    )
    return Mission(instance, knowledge="local", radio=Radio(radius=0))


@pytest.mark.parametrize("metric", ["euclidean", "manhattan"])
def test_free_agents_at_one_place_choose_different_tasks(tmp_path: Path, metric: str) -> None:
    """Two agents with equal knowledge choose different tasks without a message, and neither turns back."""
    save_network(tmp_path / "policy.safetensors", first_network(3), "gappo")
    run = simulate(pair(metric), NetworkPolicy(policy=tmp_path / "policy.safetensors"))
    orders = {one["agent"]: one["task"] for one in run.log.records if one["record"] == "order" and one["hour"] == 0}
    assert sorted(orders) == ["a1", "a2"]
    assert orders["a1"] != orders["a2"]
    assert run.result.switches == 0


PLACES = [[0.0, 0.0], [0.4, 0.6]]
"""Of two agents: from a task at (1, 0) the second is 0.85 away in a straight line, and 1.2 along the axes."""


@pytest.mark.parametrize(("metric", "rivals"), [("euclidean", 1), ("manhattan", 0)])
def test_nearer_agents_are_determined_by_the_metric(metric: str, rivals: int) -> None:
    """Whether another free agent is nearer to a task depends on the metric of the instance."""
    instance = Instance(
        ability=[1, 1], workload=[9], agent_position=PLACES, task_position=[[1.0, 0.0]], speed=[1, 1], metric=metric
    )
    state, buffers = begun(pack(Mission(instance, knowledge="full"))), new_buffers(2, 1)
    assert advance(state) == ORDERS
    known.fill(state, 0, buffers.situation)
    fill_options(buffers.situation, buffers.look, buffers.options, buffers.choice)
    assert buffers.options[0, names.RIVALS] == np.float32(1 - 1 / (1 + rivals / 3))


@pytest.mark.parametrize(("ways", "rivals"), [(known.EUCLIDEAN_WAYS, 1), (known.MANHATTAN_WAYS, 0)])
def test_nearer_agents_are_determined_by_the_metric_for_agents_in_turn(ways: int, rivals: int) -> None:
    """The same holds for agents that decide in turn."""
    joint = new_joint_decisions(2, 1)
    joint.own[:, [known.X, known.Y]] = PLACES
    joint.own[:, known.TARGET], joint.own[:, known.METRIC], joint.distances[0, 0] = -1, ways, 1.0
    joint.buffers.situation.task[known.TASK_X, 0] = 1.0
    fill_shared_parts(joint)
    assert nearer(joint, 0, 0) == rivals
