"""Training: resumes to the same curve, stops at once, and leaves whole files."""

from dataclasses import asdict, replace
from pathlib import Path

import pytest
import torch
from torch.nn.utils import parameters_to_vector

from alloc.allocators.learned import train as module
from alloc.allocators.learned.curriculum import Curriculum, validation_boards
from alloc.allocators.learned.network import NetworkSize
from alloc.allocators.learned.policy_file import load_policy
from alloc.allocators.learned.ppo import PpoParameters
from alloc.allocators.learned.train import Trainer, TrainingParameters, train
from alloc.problems import InputError

TINY = TrainingParameters(
    population=3,
    updates_per_generation=1,
    network=NetworkSize(8, 8, 2),
    ppo=PpoParameters(epochs=1, minibatch=64),
    curriculum=Curriculum(tasks=(3, 4), agents_per_task=(3.0, 3.0), games=4),
)


@pytest.fixture(autouse=True)
def few_validation_games(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge by two of the validation boards' games each; all of them would take a second per member."""
    boards = [board[torch.arange(2)] for board in validation_boards()[1:2]]
    monkeypatch.setattr(module, "validation_boards", lambda: boards)


def weights(trainer: Trainer) -> torch.Tensor:
    return torch.cat([parameters_to_vector(member.network.parameters()).detach() for member in trainer.members])


def test_a_resumed_run_goes_on_as_if_nothing_had_happened(tmp_path: Path) -> None:
    """Two generations at once, and two with a checkpoint between them, give the same figures and weights."""
    whole = Trainer(TINY, seed=5)
    whole.advance()
    expected = whole.advance()
    first = Trainer(TINY, seed=5)
    first.advance()
    first.save(tmp_path / "checkpoint")
    second = Trainer.resume(tmp_path / "checkpoint", TINY)
    got = second.advance()
    assert expected is not None
    assert got is not None
    assert asdict(replace(got, seconds=0.0)) == asdict(replace(expected, seconds=0.0))
    assert torch.equal(weights(whole), weights(second))


def test_train_writes_policy_checkpoint_and_log(tmp_path: Path) -> None:
    """After every generation all three files are whole; the policy holds the population, the fittest first."""
    paths = [tmp_path / name for name in ("policy", "checkpoint", "log.csv")]
    trainer = Trainer(TINY, seed=1)
    train(trainer, paths[0], checkpoint=paths[1], log=paths[2], generations=2)
    assert len(load_policy(paths[0], "gappo")) == 3
    assert Trainer.resume(paths[1], TINY).generation == 2
    lines = paths[2].read_text().splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("generation,seconds,fitness")


def test_training_stops_between_updates(tmp_path: Path) -> None:
    """An interrupted generation is dropped, and what the last one wrote stays as it is."""
    paths = [tmp_path / name for name in ("policy", "checkpoint", "log.csv")]
    trainer = Trainer(TINY, seed=1)
    train(trainer, paths[0], checkpoint=paths[1], log=paths[2], generations=1)
    before = [path.read_bytes() for path in paths]
    asked = iter([False, False, True, True, True, True])
    train(trainer, paths[0], checkpoint=paths[1], log=paths[2], generations=9, should_stop=lambda: next(asked))
    assert [path.read_bytes() for path in paths] == before


@pytest.mark.parametrize("content", [None, b"", b"not a checkpoint"])
def test_bad_checkpoints(tmp_path: Path, content: bytes | None) -> None:
    """A missing or broken checkpoint is told in one line."""
    if content is not None:
        (tmp_path / "checkpoint").write_bytes(content)
    with pytest.raises(InputError, match="checkpoint") as caught:
        Trainer.resume(tmp_path / "checkpoint", TINY)
    assert "\n" not in str(caught.value)


def test_checkpoint_of_another_shape(tmp_path: Path) -> None:
    """A checkpoint of another population is refused."""
    Trainer(TINY).save(tmp_path / "checkpoint")
    with pytest.raises(InputError, match="another population or network size"):
        Trainer.resume(tmp_path / "checkpoint", replace(TINY, population=2))
