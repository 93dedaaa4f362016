"""What holds for every learner: a lesson is a function of state and lesson, and nothing else."""

import io
from collections.abc import Callable

import torch
from probes import probe
from torch import Tensor

from alloc.allocators.learned.algorithms.learner import Learner, Lesson


def weights(learner: Learner) -> Tensor:
    """Return all weights of the policy in one row."""
    return torch.cat([one.detach().flatten() for one in learner.policy.parameters()])


def assert_taken_up_elsewhere(make: Callable[..., Learner]) -> None:
    """Two lessons on end, and two with the state written to a file in between, end at the same weights and reports."""
    games = probe("pairing")
    lessons = [Lesson(seed, 60, games, seed / 4) for seed in range(4)]
    first, second = make(seed=0), make(seed=0)
    for lesson in lessons[:2]:
        first.take(lesson)
        second.take(lesson)
    file = io.BytesIO()
    torch.save(first.state(), file)
    file.seek(0)
    torch.manual_seed(12345)  # the default generator is nobody's source
    third = make(seed=7)
    third.load(torch.load(file, weights_only=True))
    for lesson in lessons[2:]:
        assert second.take(lesson) == third.take(lesson)
    assert torch.equal(weights(second), weights(third))
    assert not torch.equal(weights(first), weights(third)), "nothing was learned in between"
