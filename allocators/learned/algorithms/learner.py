"""What a learner is to its trainer: something that takes lessons, and can be stored and taken up anywhere."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.problems.game import PLANNING, Board, Rules


class Games(Protocol):
    """A source of games, such as a `Curriculum`."""

    def draw(self, rng: np.random.Generator, progress: float) -> Board:
        """Draw the games of an update, where `progress` of the training, 0 to 1, is behind."""

    def steps(self, board: Board) -> int:
        """Most steps of a game on `board`."""


@dataclass(frozen=True)
class Lesson:
    """What is to be learned next; the same lesson teaches the same learner the same, wherever it is taken.

    Attributes
    ----------
    seed : int
        Source of all randomness of this lesson.
    decisions : int
        Decisions of agents after which the lesson ends, with the update that reaches them.
    curriculum : Games
        Which games are played.
    progress : float
        Share of the whole training that is behind, 0 to 1: for schedules.
    rules : Rules
    """

    seed: int
    decisions: int
    curriculum: Games
    progress: float = 0.0
    rules: Rules = PLANNING


@dataclass(frozen=True)
class LessonReport:
    """What a lesson brought.

    Attributes
    ----------
    decisions : int
        Decisions of agents that were played.
    evaluations : int
        States that networks evaluated, in playing and in learning: the cost E_i of (12).
    reward : float
        Mean reward of a game.
    entropy : float
        Mean entropy of the draws, 0 for policies that are not drawn from.
    divergence : float
        Mean Kullback-Leibler divergence of an update, 0 where it is not measured.
    learning_rate : float
    """

    decisions: int
    evaluations: int
    reward: float
    entropy: float
    divergence: float
    learning_rate: float


class Learner(Protocol):
    """One policy that learns."""

    @property
    def policy(self) -> ActorCritic:
        """The network whose scores decide, once trained: the highest bid above the reserve is the best."""

    def take(self, lesson: Lesson) -> LessonReport:
        """Play and learn."""

    def state(self) -> dict[str, Any]:
        """Everything that the learner knows, as tensors, numbers, strings, lists and dictionaries of these."""

    def load(self, state: dict[str, Any]) -> None:
        """Take up such a state."""
