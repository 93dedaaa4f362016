import os
import signal
from pathlib import Path

import pytest

from alloc.allocators.learned.train import Trainer


@pytest.mark.parametrize(
    "more", [("--resume",), ("--checkpoint", "p.safetensors"), ("--checkpoint", "nowhere/c"), ("--population", "0")]
)
def test_bad_usage_is_told_before_training(alloc, more):
    """Missing checkpoints and impossible files are told at once, in one line."""
    ran = alloc("train", "gappo", "--output", "p.safetensors", *more)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert not Path("p.safetensors").exists()


def test_interrupted_before_the_first_generation_writes_no_policy(alloc, monkeypatch):
    """Ctrl-C ends a training between two updates; without a whole generation there is no policy."""
    inner = Trainer.advance

    def advance(self, should_stop):
        os.kill(os.getpid(), signal.SIGINT)
        return inner(self, should_stop)

    monkeypatch.setattr(Trainer, "advance", advance)
    ran = alloc("train", "gappo", "--output", "p.safetensors", "--population", "2", "--threads", "1")
    assert ran.code == 1
    assert "interrupted" in ran.err
    assert not Path("p.safetensors").exists()


def test_a_run_is_not_overwritten_by_mistake(alloc):
    """Where a checkpoint stands already, a new training has to be told to go on, or to go elsewhere."""
    Path("p.checkpoint").write_bytes(b"weeks of training")
    ran = alloc("train", "gappo", "--output", "p.safetensors")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "--resume" in ran.err
    assert Path("p.checkpoint").read_bytes() == b"weeks of training"
