"""Advantage actor-critic (A2C): alternates a few steps of every game with one gradient step on them.

The advantage (16) is Q(s, a) - V(s), where Q is estimated by the n-step return: the rewards of n steps, or of those
until the next update, plus the value of the state after them. The paper does not specify the estimate of Q. All agents
that move in a step share its advantage.

References
----------
Mnih et al. (2016), arXiv:1602.01783; Fang et al. (2025), equation (16), doi:10.20944/preprints202502.0192.v1.
"""

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import A2cParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.schedules import linear, set_learning_rate
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, collect
from alloc.problems.game import Rules, apply_moves, reset, step


def n_step_returns(reward: Tensor, alive: Tensor, last_value: Tensor, gamma: float) -> Tensor:
    """Return Q(s, a) of (16) from the rewards up to the last step and the value after it, shape (S, B).

    Parameters
    ----------
    reward : Tensor, shape (S, B)
    alive : Tensor of bool, shape (S, B)
        Whether each game was still running before each step.
    last_value : Tensor, shape (B,)
        Value after the last step, 0 if the game has ended.
    gamma : float
        Discount per step.
    """
    result = torch.zeros_like(reward)
    following = last_value
    for t in reversed(range(len(reward))):
        following = (reward[t] + gamma * following) * alive[t]
        result[t] = following
    return result


class A2c:
    """A learner by A2C; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : A2cParameters, optional
    seed : int
        Seed of the initial weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: A2cParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or A2cParameters()
        (self.network,) = initialised(size, seed, 1)
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)

    @property
    def policy(self) -> ActorCritic:
        """The network that plays."""
        return self.network

    def train_on(self, job: TrainingJob) -> TrainingStats:
        """Play on boards of the curriculum with an update every few steps; see `Learner.train_on`."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(job.seed), torch.Generator().manual_seed(job.seed)
        rate = linear(parameters.learning_rate, parameters.final_lr_fraction, job.progress)
        set_learning_rate(self.optimiser, rate)
        decisions = evaluations = 0
        rewards, entropies = [], []
        while decisions < job.decisions:
            board = job.curriculum.draw(rng, job.progress)
            state, left, total = reset(board), job.curriculum.max_steps(board), 0.0
            while left > 0 and not bool(state.done.all()):
                count = min(parameters.num_steps, left)
                played = collect(self.network, board, count, generator, job.rules, parameters.reward_scale, state=state)
                entropies.append(self.update(played, job.rules))
                left -= count
                before = played.state[torch.tensor(len(played.reward) - 1)]
                state = step(board, before, apply_moves(board, before, played.actions[-1]))
                decisions += played.decisions
                evaluations += 2 * played.evaluations
                total += float(played.reward.sum(0).mean()) / parameters.reward_scale
            rewards.append(total)
        return TrainingStats(decisions, evaluations, float(np.mean(rewards)), float(np.mean(entropies)), 0.0, rate)

    def update(self, played: Trajectories, rules: Rules) -> float:
        """Take one gradient step on new trajectories; return the mean entropy of the policy in nats."""
        parameters = self.parameters
        when, game = torch.nonzero(played.alive, as_tuple=True)
        board, state, actions = played.board[game], played.state[when, game], played.actions[when, game]
        returns = n_step_returns(played.reward, played.alive, played.last_value, parameters.gamma)[when, game]
        scores = self.network(board, state)
        log_probability, entropy = log_probabilities(board, state, scores, actions, rules)
        advantage = returns - scores.value
        real = actions >= 0
        gain = (log_probability * advantage.detach()[:, None])[real].mean()
        loss = parameters.vf_coef * 0.5 * advantage.square().mean() - gain
        loss = loss - parameters.ent_coef * entropy.mean()
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), parameters.max_grad_norm)
        self.optimiser.step()
        return float(entropy.detach().mean())

    def state_dict(self) -> StateDict:
        """Return weights and optimiser; see `Learner.state_dict`."""
        return {"network": self.network.state_dict(), "optimiser": self.optimiser.state_dict()}

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])
