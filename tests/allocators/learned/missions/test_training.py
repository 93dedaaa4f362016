"""Training in missions: tiny runs, resumed to the same curve, and what they learn from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from alloc.allocators.learned.missions.policy_file import load_network
from alloc.allocators.learned.missions.rollout import record_for
from alloc.allocators.learned.missions.training.curriculum import FAMILIES, MissionCurriculum
from alloc.allocators.learned.missions.training.ppo import WINDOW, group_advantages
from alloc.allocators.learned.missions.training.run import train_on_missions
from alloc.allocators.learned.missions.training.trainer import MissionTrainer, MissionTrainingParameters
from alloc.problems import InputError

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first: half a minute, more under load

TINY = MissionTrainingParameters(
    population=2,
    decisions=40,
    missions=1,
    groups=1,
    validations=1,
    evolved=1,
    candidates=4,
    curriculum=MissionCurriculum(agents=(2, 3), tasks=(2, 4)),
)


def weights_of(trainer: MissionTrainer) -> torch.Tensor:
    """Return all weights of all members in one vector."""
    members = [member["network"].values() for member in trainer.members]
    return torch.cat([weight.flatten() for member in members for weight in member])


def test_resumed_run_gives_the_same_curve(tmp_path: Path) -> None:
    """A run resumed in its evolution phase has the same members and reports as an uninterrupted one."""
    whole, stored, resumed = (MissionTrainer(TINY, 3) for _ in range(3))
    for _ in range(3):
        whole.advance()
    stored.advance()
    stored.save(tmp_path / "run.checkpoint")
    resumed.resume(tmp_path / "run.checkpoint")
    for _ in range(2):
        resumed.advance()
    assert torch.equal(weights_of(resumed), weights_of(whole))
    assert [one.cost for one in resumed.history] == [one.cost for one in whole.history]
    assert not torch.equal(weights_of(whole), weights_of(MissionTrainer(TINY, 3)))


def test_checkpoint_with_other_parameters_is_refused(tmp_path: Path) -> None:
    """A checkpoint of a run with other parameters is refused."""
    MissionTrainer(TINY, 3).save(tmp_path / "run.checkpoint")
    with pytest.raises(InputError, match="candidates"):
        MissionTrainer(replace(TINY, candidates=6), 3).resume(tmp_path / "run.checkpoint")


def test_trained_policy_can_be_loaded(tmp_path: Path) -> None:
    """The policy file of a run contains its best network."""
    trainer = MissionTrainer(TINY, 1)
    trainer.advance()
    trainer.write_policy(tmp_path / "policy.safetensors")
    loaded = load_network(tmp_path / "policy.safetensors").state_dict()
    assert all(torch.equal(loaded[name], weight) for name, weight in trainer.best[0].items())


def test_unknown_families_are_refused(tmp_path: Path) -> None:
    """The error for an unknown family names the most similar one."""
    with pytest.raises(InputError, match="steady"):
        train_on_missions("gappo", tmp_path / "policy.safetensors", families=["stedy"])


def test_curriculum_becomes_harder() -> None:
    """The first missions are of one family; later ones of all families and of sizes within the given range."""
    curriculum, rng = MissionCurriculum(agents=(2, 3), tasks=(2, 4)), np.random.default_rng(0)
    early = {len(mission.arrays.events) > 0 for mission, _ in curriculum.draw(rng, 3, 0.0)}
    late = curriculum.draw(rng, 12, 1.0)
    assert early
    assert {len(mission.arrays.agents) for mission, _ in late} <= {2, 3}
    assert len({float(mission.arrays.head[0].sensing) for mission, _ in late}) > 1
    assert len(FAMILIES) == 8


def test_advantages_are_relative_to_other_episodes() -> None:
    """The advantage of a decision is the excess cost of other episodes in the same hours; its mean is 0."""
    group = [record_for(1, 1, 2, ideal=4.0) for _ in range(3)]
    for record, lost in zip(group, (0.0, 1.0, 2.0), strict=True):
        record.length[0], record.asked[0] = 2, 10.0
        record.hour[:], record.cost[:], record.total[0] = (0.0, 5.0), (0.0, lost), lost
    early = [float(gained[0]) for gained in group_advantages(group)]
    share = WINDOW * 4.0 / 5.0
    assert early == pytest.approx([1.5 * share / 4.0, 0.0, -1.5 * share / 4.0])
    assert [float(gained[1]) for gained in group_advantages(group)] == pytest.approx([0.0] * 3)
