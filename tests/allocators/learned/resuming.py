"""Tests of every learner: the result of a training job depends only on the state and the job."""

import io
from collections.abc import Callable

import torch
from probes import probe
from torch import Tensor

from alloc.allocators.learned.algorithms.learner import Learner, TrainingJob


def weights(learner: Learner) -> Tensor:
    """Return all weights of the policy in one row."""
    return torch.cat([one.detach().flatten() for one in learner.policy.parameters()])


def assert_resumes_elsewhere(make: Callable[..., Learner]) -> None:
    """Jobs in sequence, and with the state written to a file in between, give the same weights and statistics."""
    games = probe("pairing")
    jobs = [TrainingJob(seed, 60, games, seed / 4) for seed in range(4)]
    first, second = make(seed=0), make(seed=0)
    for job in jobs[:2]:
        first.train_on(job)
        second.train_on(job)
    file = io.BytesIO()
    torch.save(first.state_dict(), file)
    file.seek(0)
    torch.manual_seed(12345)  # no learner draws from the global generator
    third = make(seed=7)
    third.load_state_dict(torch.load(file, weights_only=True))
    for job in jobs[2:]:
        assert second.train_on(job) == third.train_on(job)
    assert torch.equal(weights(second), weights(third))
    assert not torch.equal(weights(first), weights(third)), "nothing was learned in between"
