"""What an agent of `gappo` expects of free neighbours."""

from pathlib import Path

import pytest

from alloc.allocators.learned.missions.network import first_network
from alloc.allocators.learned.missions.policy_file import save_network
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
def test_free_agents_at_one_place_part(tmp_path: Path, metric: str) -> None:
    """Two agents that know the same at the same hour go to different tasks, without a message, and none turns round."""
    save_network(tmp_path / "policy.safetensors", first_network(3), "gappo")
    run = simulate(pair(metric), NetworkPolicy(policy=tmp_path / "policy.safetensors"))
    orders = {one["agent"]: one["task"] for one in run.log.records if one["record"] == "order" and one["hour"] == 0}
    assert sorted(orders) == ["a1", "a2"]
    assert orders["a1"] != orders["a2"]
    assert run.result.switches == 0
