"""What an agent of `gappo` expects of free neighbours, and policy files of networks that knew less."""

from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from alloc.allocators.learned.missions.feature_names import FORMER_FEATURES, FORMER_SET
from alloc.allocators.learned.missions.network import compiled_weights, first_network
from alloc.allocators.learned.missions.network_arrays import HIDDEN
from alloc.allocators.learned.missions.policy_file import POLICY_FORMAT, load_network, save_network
from alloc.allocators.online.policies.gappo import NetworkPolicy
from alloc.allocators.online.run import simulate
from alloc.problems import InputError, Instance, Mission

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
    return Mission(instance, knowledge="local")


@pytest.mark.parametrize("metric", ["euclidean", "manhattan"])
def test_free_agents_at_one_place_part(tmp_path: Path, metric: str) -> None:
    """Two agents that know the same at the same hour go to different tasks, without a message, and none turns round."""
    save_network(tmp_path / "policy.safetensors", first_network(3), "gappo")
    run = simulate(pair(metric), NetworkPolicy(policy=tmp_path / "policy.safetensors"))
    orders = {one["agent"]: one["task"] for one in run.log.records if one["record"] == "order" and one["hour"] == 0}
    assert sorted(orders) == ["a1", "a2"]
    assert orders["a1"] != orders["a2"]


def former(path: Path) -> dict[str, np.ndarray]:
    """Write the network of a policy file as it was when it knew fewer features; return its weights."""
    weights = load_file(path)
    for name in ("inner.weight", "skip.weight"):
        weights[name] = np.ascontiguousarray(weights[name][:, :FORMER_FEATURES])
    metadata = {"format": POLICY_FORMAT, "features": FORMER_SET, "size": f"[{FORMER_FEATURES}, {HIDDEN}]"}
    save_file(weights, path, metadata)
    return weights


def test_former_policy_files_are_loaded(tmp_path: Path) -> None:
    """A network that was trained with fewer features has its weights, and 0 for features that came later."""
    path = tmp_path / "policy.safetensors"
    save_network(path, first_network(3), "gappo")
    weights, loaded = former(path), compiled_weights(load_network(path))
    assert np.array_equal(loaded.skip[:FORMER_FEATURES], weights["skip.weight"][0])
    assert np.array_equal(loaded.inner[:, :FORMER_FEATURES], weights["inner.weight"])
    assert not loaded.skip[FORMER_FEATURES:].any()
    assert not loaded.inner[:, FORMER_FEATURES:].any()


def test_another_number_of_features_is_told(tmp_path: Path) -> None:
    """A policy file of other features than this version knows is refused in one line."""
    path = tmp_path / "policy.safetensors"
    save_network(path, first_network(3), "gappo")
    metadata = {"format": POLICY_FORMAT, "features": "missions/3", "size": f"[40, {HIDDEN}]"}
    save_file(load_file(path), path, metadata)
    with pytest.raises(InputError, match="missions need 'missions/2'; train anew"):
        load_network(path)
