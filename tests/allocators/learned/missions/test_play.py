"""`gappo` in missions: the network in torch and compiled, and its policy in both simulations."""

from pathlib import Path

import numpy as np
import pytest
import torch

from alloc.allocators.learned.missions.feature_names import FEATURES
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.messages import should_send
from alloc.allocators.learned.missions.network import compiled_weights, first_network
from alloc.allocators.learned.missions.play import new_buffers, play
from alloc.allocators.learned.missions.policy_file import load_network, save_network
from alloc.allocators.missions.pack import begun, measure, pack
from alloc.allocators.online.policies.gappo import NetworkPolicy
from alloc.allocators.online.run import simulate
from alloc.problems import InputError
from alloc.problems.missions.families.draw import random_mission
from alloc.problems.missions.families.parameters import MissionParameters

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load


def scored(options: np.ndarray, seed: int) -> np.ndarray:
    """Return the scores that the compiled network gives."""
    buffers = new_buffers(0, len(options))
    buffers.options[: len(options), :FEATURES] = options
    score(
        buffers.options,
        len(options),
        compiled_weights(first_network(seed)),
        buffers.token,
        buffers.pooled,
        buffers.scores,
    )
    return buffers.scores[: len(options)]


def test_compiled_scores_match_torch() -> None:
    """The compiled network gives the scores of the torch module, also if that has padding rows."""
    options = np.random.default_rng(0).normal(size=(7, FEATURES)).astype(np.float32)
    filled = torch.zeros(1, 9, FEATURES)
    filled[0, :7] = torch.tensor(options)
    with torch.no_grad():
        expected = first_network(1)(filled, torch.arange(9)[None] < 7)
    assert scored(options, 1) == pytest.approx(expected[0, :7].numpy(), abs=1e-5)
    assert expected[0, 7:].isneginf().all()


def test_scores_do_not_depend_on_the_order_of_options() -> None:
    """Permuted options have permuted scores."""
    rng = np.random.default_rng(1)
    options, order = rng.normal(size=(6, FEATURES)).astype(np.float32), rng.permutation(6)
    assert scored(options[order], 2) == pytest.approx(scored(options, 2)[order], abs=1e-5)


@pytest.mark.parametrize(
    ("family", "knowledge", "size"),
    [
        ("steady", "local", (6, 8)),
        ("failures", "full", (6, 8)),
        ("recharging", "local", (6, 8)),
        ("deadlines", "local", (6, 8)),
        ("silence", "local", (6, 8)),
        ("failures", "local", (20, 40)),  # agents stand at one place, and are rivals or not by a rounding
    ],
)
def test_policy_gives_the_same_measures_in_both_simulations(
    tmp_path: Path, family: str, knowledge: str, size: tuple[int, int]
) -> None:
    """The Python policy and the compiled one reach the same measures."""
    network = first_network(3)
    save_network(tmp_path / "policy.safetensors", network, "gappo")
    mission = random_mission(MissionParameters(family, *size, knowledge=knowledge), 4)
    expected = simulate(mission, NetworkPolicy(policy=tmp_path / "policy.safetensors", periods=3), seed=5).result
    state = begun(pack(mission), 5)
    play(state, new_buffers(*size, 3), compiled_weights(network), 5)
    found = measure(mission, state, "gappo", 5)
    for name in ("mission_time", "tasks_done", "tasks_missed", "energy", "distance", "switches", "messages", "bytes"):
        value = getattr(expected, name)
        assert getattr(found, name) == (None if value is None else pytest.approx(value, rel=1e-9)), name


def test_message_rate_depends_on_news() -> None:
    """After the first two, one message per ten periods; news is sent as soon as possible, with one message reserved."""
    counted, news = np.zeros(1, np.intp), np.zeros(1, np.intp)
    saved = new_buffers(1, 1, 10).saved  # of three messages
    sent = []
    for tick in range(100):
        news[0] |= 15 <= tick < 60
        if should_send(10, saved, counted, news, 0, tick):
            sent.append(tick)
    assert sent == [0, 1, 10, 15, 20, 30, 40, 50, 60, 80, 90]


def test_policy_file_for_instances_is_refused(tmp_path: Path) -> None:
    """A policy file for instances is refused with advice."""
    from alloc.allocators.learned.missions import policy_file

    instances = policy_file.SHIPPED.with_name("gappo.safetensors")
    with pytest.raises(InputError, match="alloc train gappo --missions"):
        load_network(instances)
