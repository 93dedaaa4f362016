"""Stored policies: round trip, and refusal of whatever does not fit."""

import json
import math
import pickle
from pathlib import Path

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from alloc.allocators.learned.files.policy_file import load_policy, save_policy
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.problems import InputError
from alloc.problems.game import FEATURE_SET


@pytest.fixture
def networks() -> list[ActorCritic]:
    torch.manual_seed(0)
    return [ActorCritic(NetworkSize(8, 8, 2)) for _ in range(2)]


def test_round_trip(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """Networks are read back in order, weight for weight."""
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    for before, after in zip(networks, load_policy(tmp_path / "p.safetensors", "gappo"), strict=True):
        assert after.size == before.size
        for name, weight in before.state_dict().items():
            assert torch.equal(weight, after.state_dict()[name])


def test_missing_file_is_named(tmp_path: Path) -> None:
    """The error names a missing file."""
    with pytest.raises(InputError, match=r"nowhere\.safetensors: no such policy file"):
        load_policy(tmp_path / "nowhere.safetensors", "gappo")


@pytest.mark.parametrize("content", [b"", b"\0" * 7, b"hello, world", pickle.dumps({"a": 1}), b"\xff" * 64])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    """Other files are refused in one line, and pickles are not executed."""
    path = tmp_path / "p.safetensors"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is not a policy file") as caught:
        load_policy(path, "gappo")
    assert "\n" not in str(caught.value)


def test_folders_and_empty_names_are_refused(tmp_path: Path) -> None:
    """A folder and an empty name are reported as such."""
    with pytest.raises(InputError, match="is a folder"):
        load_policy(tmp_path, "gappo")
    with pytest.raises(InputError, match="policy: names no file"):
        load_policy("", "gappo")


def test_policy_of_another_method_is_refused(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """A policy trained by another method is refused."""
    save_policy(tmp_path / "p.safetensors", networks, "dqn")
    with pytest.raises(InputError, match="holds a policy of dqn; use it with the method dqn"):
        load_policy(tmp_path / "p.safetensors", "gappo")
    save_policy(tmp_path / "p.safetensors", networks, "newer")
    with pytest.raises(InputError, match="method: is 'newer', this version needs 'gappo'"):
        load_policy(tmp_path / "p.safetensors", "gappo")


@pytest.mark.parametrize("weight", [math.nan, math.inf, -math.inf])
def test_non_finite_weights_are_refused(tmp_path: Path, networks: list[ActorCritic], weight: float) -> None:
    """A policy of a diverged training is refused, whichever network has diverged."""
    with torch.no_grad():
        next(networks[1].parameters()).flatten()[-1] = weight
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    for method in ("gappo", None):
        with pytest.raises(InputError, match=r"p\.safetensors: weights are not finite"):
            load_policy(tmp_path / "p.safetensors", method)


def test_same_networks_give_the_same_bytes(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """Equal trainings give equal files, readable as before."""
    figures = {"seed": 3, "place": "Århus"}
    files = [tmp_path / f"{number}.safetensors" for number in range(6)]
    for path in files:
        save_policy(path, networks, "gappo", figures)
    assert len({path.read_bytes() for path in files}) == 1
    with safe_open(files[0], framework="pt") as file:
        assert json.loads(file.metadata()["training"]) == figures
        assert torch.equal(file.get_tensor("1.critic.0.weight"), networks[1].state_dict()["critic.0.weight"])


def test_policy_of_another_feature_set_is_refused(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """A policy for other observations is an error."""
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    path = tmp_path / "p.safetensors"
    path.write_bytes(path.read_bytes().replace(FEATURE_SET.encode(), b"x" * len(FEATURE_SET)))
    with pytest.raises(InputError, match="features"):
        load_policy(path, "gappo")


def test_weights_of_other_sizes_are_refused(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """Weights whose sizes contradict the metadata are refused."""
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    path = tmp_path / "p.safetensors"
    path.write_bytes(path.read_bytes().replace(b'pair_width\\": 8', b'pair_width\\": 9'))
    with pytest.raises(InputError, match="size"):
        load_policy(path, "gappo")


def test_truncated_files_are_refused(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """A file truncated in its header or its weights is refused in one line."""
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    path = tmp_path / "p.safetensors"
    whole = path.read_bytes()
    for length in (4, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match="is not a policy file") as caught:
            load_policy(path, "gappo")
        assert "\n" not in str(caught.value)


def test_file_with_fewer_networks_than_declared_is_refused(tmp_path: Path, networks: list[ActorCritic]) -> None:
    """A file with fewer networks than declared is refused."""
    save_policy(tmp_path / "p.safetensors", networks, "gappo")
    path = tmp_path / "p.safetensors"
    path.write_bytes(path.read_bytes().replace(b'"networks":"2"', b'"networks":"3"'))
    with pytest.raises(InputError, match="size"):
        load_policy(path, "gappo")


def test_tensors_without_metadata_are_refused(tmp_path: Path) -> None:
    """A foreign safetensors file is not a policy."""
    save_file({"a": torch.zeros(2)}, tmp_path / "p.safetensors")
    with pytest.raises(InputError, match="does not describe its networks"):
        load_policy(tmp_path / "p.safetensors", "gappo")


def test_policies_for_other_turns_are_refused(tmp_path: Path) -> None:
    """A policy trained with simultaneous choices cannot bid; training can continue from it."""
    path = tmp_path / "policy.safetensors"
    save_policy(path, [ActorCritic()], "ppo", {"turn": "simultaneous"})
    with pytest.raises(InputError, match=r"turn: was trained for turns by simultaneous"):
        load_policy(path, "ppo")
    assert len(load_policy(path, None)) == 1
    save_policy(path, [ActorCritic()], "ppo", {"turn": "bidding"})
    assert len(load_policy(path, "ppo")) == 1
