"""The protocol of learners, which train one policy, and can be stored and restored anywhere."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.problems.game import PLANNING, Board, Rules


class GameSource(Protocol):
    """A source of games for updates, such as a `Curriculum`."""

    def draw(self, rng: np.random.Generator, progress: float) -> Board:
        """Draw the games of an update; `progress` is the share of the training that is done, 0 to 1."""

    def max_steps(self, board: Board) -> int:
        """Return the maximum number of steps of a game on `board`."""


@dataclass(frozen=True)
class TrainingJob:
    """A section of the training of one learner; its result depends only on the learner's state and the job.

    Attributes
    ----------
    seed : int
        Seed of all random numbers of this job.
    decisions : int
        Decisions of agents to play; the job ends with the update that reaches them.
    curriculum : GameSource
        The games that are played.
    progress : float
        Share of the whole training that is done before this job, 0 to 1, on which schedules depend.
    rules : Rules
    """

    seed: int
    decisions: int
    curriculum: GameSource
    progress: float = 0.0
    rules: Rules = PLANNING


@dataclass(frozen=True)
class TrainingStats:
    """Statistics of a training job.

    Attributes
    ----------
    decisions : int
        Decisions of agents that were played.
    evaluations : int
        States that networks evaluated while playing and learning: the cost E_i of (12).
    reward : float
        Mean undiscounted return of a game.
    entropy : float
        Mean entropy of the policy in nats, 0 for policies that are not sampled.
    approx_kl : float
        Mean Kullback-Leibler divergence of an update in nats, 0 if it is not measured.
    learning_rate : float
        Learning rate at the end of the job.
    """

    decisions: int
    evaluations: int
    reward: float
    entropy: float
    approx_kl: float
    learning_rate: float


class Learner(Protocol):
    """One policy and the algorithm that trains it."""

    @property
    def policy(self) -> ActorCritic:
        """The network that is trained; the best action is the highest bid above the reserve."""

    def train_on(self, job: TrainingJob) -> TrainingStats:
        """Play and learn until the job is done."""

    def state_dict(self) -> StateDict:
        """Return the complete state of the learner; its tensors are references, not copies."""

    def load_state_dict(self, state: StateDict) -> None:
        """Restore a state that `state_dict` returned."""
