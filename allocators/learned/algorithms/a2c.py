"""Advantage actor-critic: a few steps of every game, one gradient step on them, and on.

The advantage (16) is Q(s, a) - V(s), where Q is the return of the n steps that were played, or of those left until
the update, and the value of the state after them. The paper leaves open how Q is estimated. All who moved in a step
share its advantage.

References
----------
Mnih et al. (2016), arXiv:1602.01783; Fang et al. (2025), equation (16), doi:10.20944/preprints202502.0192.v1.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import A2cParameters
from alloc.allocators.learned.algorithms.learner import Lesson, LessonReport
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, collect
from alloc.problems.game import Rules, apply_moves, reset, step


def n_step_returns(reward: Tensor, alive: Tensor, last_value: Tensor, discount: float) -> Tensor:
    """Return Q(s, a) of (16) by the rewards up to the last step and the value after it, shape (S, B).

    Parameters
    ----------
    reward : Tensor, shape (S, B)
    alive : Tensor of bool, shape (S, B)
        Whether each game was still on before each step.
    last_value : Tensor, shape (B,)
        Value after the last step, 0 where the game is over.
    """
    result = torch.zeros_like(reward)
    following = last_value
    for t in reversed(range(len(reward))):
        following = (reward[t] + discount * following) * alive[t]
        result[t] = following
    return result


class A2c:
    """A learner by A2C; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : A2cParameters, optional
    seed : int
        Of the first weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: A2cParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or A2cParameters()
        (self.network,) = initialised(size, seed, 1)
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)

    @property
    def policy(self) -> ActorCritic:
        """The network that plays."""
        return self.network

    def take(self, lesson: Lesson) -> LessonReport:
        """Play on boards of the curriculum and learn every few steps, until the lesson's decisions are made."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(lesson.seed), torch.Generator().manual_seed(lesson.seed)
        rate = parameters.learning_rate * (1 - (1 - parameters.final_share) * lesson.progress)
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        decisions = evaluations = 0
        rewards, entropies = [], []
        while decisions < lesson.decisions:
            board = lesson.curriculum.draw(rng, lesson.progress)
            state, left, total = reset(board), lesson.curriculum.steps(board), 0.0
            while left > 0 and not bool(state.done.all()):
                count = min(parameters.steps, left)
                played = collect(
                    self.network, board, count, generator, lesson.rules, parameters.reward_scale, state=state
                )
                entropies.append(self.update(played, lesson.rules))
                left -= count
                before = played.state[torch.tensor(len(played.reward) - 1)]
                state = step(board, before, apply_moves(board, before, played.actions[-1]))
                decisions += played.decisions
                evaluations += 2 * played.evaluations
                total += float(played.reward.sum(0).mean()) / parameters.reward_scale
            rewards.append(total)
        return LessonReport(decisions, evaluations, float(np.mean(rewards)), float(np.mean(entropies)), 0.0, rate)

    def update(self, played: Trajectories, rules: Rules) -> float:
        """Take one gradient step on what was just played; return the mean entropy of the draws."""
        parameters = self.parameters
        when, game = torch.nonzero(played.alive, as_tuple=True)
        board, state, actions = played.board[game], played.state[when, game], played.actions[when, game]
        returns = n_step_returns(played.reward, played.alive, played.last_value, parameters.discount)[when, game]
        scores = self.network(board, state)
        log_probability, entropy = log_probabilities(board, state, scores, actions, rules)
        advantage = returns - scores.value
        real = actions >= 0
        gain = (log_probability * advantage.detach()[:, None])[real].mean()
        loss = parameters.value_weight * 0.5 * advantage.square().mean() - gain
        loss = loss - parameters.entropy_weight * entropy.mean()
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), parameters.max_gradient_norm)
        self.optimiser.step()
        return float(entropy.detach().mean())

    def state(self) -> dict[str, Any]:
        """Return weights and optimiser."""
        return {"network": self.network.state_dict(), "optimiser": self.optimiser.state_dict()}

    def load(self, state: dict[str, Any]) -> None:
        """Take up what `state` returned."""
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])
