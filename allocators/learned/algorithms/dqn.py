"""Deep Q-learning: the scores of the bids are their values, learned from a memory of single moves.

What a bid is worth above stopping is its score above the reserve: Q(s, bid) = score - reserve. Stopping ends the game
and so brings 0, which need not be learned: the terminal mask of (17) is built in. A game that was cut off is not over,
and what follows its last move counts like any other.

The paper's (17) has neither a target network nor a terminal mask; both are needed, the first for a target that holds
still, the second because nothing follows the end of a game.

References
----------
Mnih et al. (2015), doi:10.1038/nature14236; van Hasselt, Guez and Silver (2016), arXiv:1509.06461, for the double
estimate; Wang et al. (2016), arXiv:1511.06581, for values as a sum; Fang et al. (2025), equation (17),
doi:10.20944/preprints202502.0192.v1.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import DqnParameters
from alloc.allocators.learned.algorithms.learner import Lesson, LessonReport
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.play.transitions import TransitionMemory, next_state, play, scores_above_reserve
from alloc.problems.game import Board, Rules, State


def td_target(reward: Tensor, following: Tensor, over: Tensor, discount: float) -> Tensor:
    """Return r + gamma * max Q(s', .) of (17), without what follows where the game is over; all of shape (B,)."""
    return reward + discount * following.masked_fill(over, 0.0)


def best_gain(value: Tensor, picker: Tensor) -> Tensor:
    """Return the value of the best move, shape (B,), the best by `picker`; both of shape (B, n * c + 1)."""
    return value.gather(1, picker.argmax(1, keepdim=True))[:, 0]


class Dqn:
    """A learner by DQN; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : DqnParameters, optional
    seed : int
        Of the first weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: DqnParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or DqnParameters()
        self.network, self.target = initialised(size, seed, 2)
        self.target.load_state_dict(self.network.state_dict())
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)
        self.memory = TransitionMemory(self.parameters.capacity)
        self.updates = 0

    @property
    def policy(self) -> ActorCritic:
        """The network whose scores are the values of bids."""
        return self.network

    def take(self, lesson: Lesson) -> LessonReport:
        """Play on boards of the curriculum and learn from the memory, until the lesson's decisions are made."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(lesson.seed), torch.Generator().manual_seed(lesson.seed)
        rate = parameters.learning_rate * (1 - (1 - parameters.final_share) * lesson.progress)
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        warmth = parameters.temperature * (parameters.final_temperature / parameters.temperature) ** lesson.progress
        decisions = evaluations = 0
        rewards = []
        while decisions < lesson.decisions:
            board = lesson.curriculum.draw(rng, lesson.progress)
            steps = lesson.curriculum.steps(board)
            exploring, scale = parameters.exploring * (1 - lesson.progress), parameters.reward_scale
            played = play(self.network, board, steps, generator, lesson.rules, warmth, exploring, scale)
            self.memory.add(played.transitions)
            repeats = max(1, round(parameters.reuse * len(played.transitions.action) / parameters.minibatch))
            repeats = repeats if self.memory.kept else 0
            for _ in range(repeats):
                self.update(lesson.rules, generator)
            decisions += played.decisions
            evaluations += played.evaluations + repeats * parameters.minibatch * (3 if parameters.double else 2)
            rewards.append(played.reward)
        return LessonReport(decisions, evaluations, float(np.mean(rewards)), 0.0, 0.0, rate)

    def update(self, rules: Rules, generator: torch.Generator) -> None:
        """Take one gradient step on remembered moves, and now and then renew the target network."""
        board, state, action, reward = self.memory.draw(self.parameters.minibatch, generator)
        scores = self.network(board, state)
        value = scores_above_reserve(scores.bids, scores.reserve, board, state, rules).gather(1, action[:, None])[:, 0]
        loss = nn.functional.huber_loss(value, self.wanted(board, next_state(board, state, action), reward, rules))
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.parameters.max_gradient_norm)
        self.optimiser.step()
        self.updates += 1
        if self.updates % self.parameters.target_period == 0:
            self.target.load_state_dict(self.network.state_dict())

    @torch.no_grad()
    def wanted(self, board: Board, following: State, reward: Tensor, rules: Rules) -> Tensor:
        """Return the targets of (17), shape (B,)."""
        scores = self.target(board, following)
        value = picker = scores_above_reserve(scores.bids, scores.reserve, board, following, rules)
        if self.parameters.double:
            own = self.network(board, following)
            picker = scores_above_reserve(own.bids, own.reserve, board, following, rules)
        return td_target(reward, best_gain(value, picker), following.done, self.parameters.discount)

    def state(self) -> dict[str, Any]:
        """Return weights, optimiser, memory and how many updates were made."""
        return {
            "network": self.network.state_dict(),
            "target": self.target.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "memory": self.memory.state(),
            "updates": self.updates,
        }

    def load(self, state: dict[str, Any]) -> None:
        """Take up what `state` returned."""
        self.network.load_state_dict(state["network"])
        self.target.load_state_dict(state["target"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.memory.load(state["memory"])
        self.updates = state["updates"]
