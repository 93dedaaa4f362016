"""A member of the population: its initial state, and its training in one generation."""

import copy
from collections.abc import Sequence
from typing import NamedTuple

import torch

from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.registry import new_learner
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.validation import Validation, validate
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems.game import Board

Weights = dict[str, torch.Tensor]
"""Weights of a network by name."""


class MemberJob(NamedTuple):
    """The training of one member in a generation, in a form that can be sent to another process.

    Attributes
    ----------
    parameters : TrainingParameters
    state : StateDict
        State of the member's learner.
    job : TrainingJob
    boards : sequence of Board
        Validation games.
    threads : int
        Threads of torch; the last bits of the result depend on them.
    """

    parameters: TrainingParameters
    state: StateDict
    job: TrainingJob
    boards: Sequence[Board]
    threads: int = 1


class MemberResult(NamedTuple):
    """Result of a `MemberJob`: the learner's new state, its policy's weights, and statistics of both."""

    state: StateDict
    policy: Weights
    stats: TrainingStats
    validation: Validation


def initial_state(parameters: TrainingParameters, seed: int, weights: Weights | None = None) -> StateDict:
    """Return the state of an untrained member, whose policy has the given weights, if any."""
    learner = new_learner(parameters.method, parameters.network, parameters.learner, seed)
    if weights is not None:
        learner.policy.load_state_dict(weights)
    state = learner.state_dict()
    for target, source in (("target", "network"), ("targets", "networks")):
        if target in state:  # target networks begin as copies, also of given weights
            state[target] = copy.deepcopy(state[source])
    return state


def train_member(job: MemberJob) -> MemberResult:
    """Train a member and validate its policy; a pure function of the job."""
    parameters = job.parameters
    with plain_torch(), torch_threads(job.threads):
        learner = new_learner(parameters.method, parameters.network, parameters.learner, 0)
        learner.load_state_dict(copy.deepcopy(job.state))  # optimisers write to the tensors that they are given
        stats = learner.train_on(job.job)
        validation = validate(learner.policy, job.boards, parameters.rules, parameters.curriculum)
        policy = {name: weight.clone() for name, weight in learner.policy.state_dict().items()}
    return MemberResult(learner.state_dict(), policy, stats, validation)
