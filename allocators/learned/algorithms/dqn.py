"""Deep Q-learning (DQN): the scores of the bids are their values, learned from a replay memory of single moves.

The value of a bid is its score above the reserve: Q(s, bid) = score - reserve. Stopping ends the game and has value 0,
which need not be learned: the terminal mask of (17) is built in. A game truncated at the maximum number of steps has
not ended, and the target of its last move includes the value of the next state, like any other.

The paper's (17) has neither a target network nor a terminal mask; both are needed: the former for stable targets, the
latter because the end of a game has no successor.

References
----------
Mnih et al. (2015), doi:10.1038/nature14236; van Hasselt, Guez and Silver (2016), arXiv:1509.06461, for double
Q-learning; Wang et al. (2016), arXiv:1511.06581, for values as a sum; Fang et al. (2025), equation (17),
doi:10.20944/preprints202502.0192.v1.
"""

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import DqnParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.schedules import exponential, linear, set_learning_rate
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.play.transitions import TransitionMemory, next_state, play, scores_above_reserve
from alloc.problems.game import Board, Rules, State


def td_target(reward: Tensor, next_value: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Return the target r + gamma * V(s') of (17), or r if the game is `done`; all of shape (B,)."""
    return reward + gamma * next_value.masked_fill(done, 0.0)


def best_move_value(value: Tensor, selector: Tensor) -> Tensor:
    """Return the value of the move that is best by `selector`, shape (B,); arguments of shape (B, n * c + 1)."""
    return value.gather(1, selector.argmax(1, keepdim=True))[:, 0]


def gradient_steps(moves: int, replay_ratio: float, batch_size: int) -> int:
    """Return the gradient steps after which each of these new moves is replayed `replay_ratio` times on average."""
    return max(1, round(replay_ratio * moves / batch_size))


class Dqn:
    """A learner by DQN; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : DqnParameters, optional
    seed : int
        Seed of the initial weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: DqnParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or DqnParameters()
        self.network, self.target = initialised(size, seed, 2)
        self.target.load_state_dict(self.network.state_dict())
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)
        self.memory = TransitionMemory(self.parameters.buffer_size)
        self.updates = 0

    @property
    def policy(self) -> ActorCritic:
        """The network whose scores are the values of bids."""
        return self.network

    def train_on(self, job: TrainingJob) -> TrainingStats:
        """Play on boards of the curriculum and learn from the memory; see `Learner.train_on`."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(job.seed), torch.Generator().manual_seed(job.seed)
        rate = linear(parameters.learning_rate, parameters.final_lr_fraction, job.progress)
        set_learning_rate(self.optimiser, rate)
        temperature = exponential(parameters.temperature, parameters.final_temperature, job.progress)
        exploring = parameters.exploration_initial_eps * (1 - job.progress)
        decisions = evaluations = 0
        rewards = []
        while decisions < job.decisions:
            board = job.curriculum.draw(rng, job.progress)
            steps, scale = job.curriculum.max_steps(board), parameters.reward_scale
            played = play(self.network, board, steps, generator, job.rules, temperature, exploring, scale)
            self.memory.add(played.transitions)
            count = gradient_steps(len(played.transitions.action), parameters.replay_ratio, parameters.batch_size)
            count = count if self.memory.kept else 0
            for _ in range(count):
                self.update(job.rules, generator)
            decisions += played.decisions
            evaluations += played.evaluations + count * parameters.batch_size * (3 if parameters.double_q else 2)
            rewards.append(played.reward)
        return TrainingStats(decisions, evaluations, float(np.mean(rewards)), 0.0, 0.0, rate)

    def update(self, rules: Rules, generator: torch.Generator) -> None:
        """Take one gradient step on replayed moves, and update the target network at its interval."""
        board, state, action, reward = self.memory.draw(self.parameters.batch_size, generator)
        scores = self.network(board, state)
        value = scores_above_reserve(scores.bids, scores.reserve, board, state, rules).gather(1, action[:, None])[:, 0]
        loss = nn.functional.huber_loss(value, self.td_targets(board, next_state(board, state, action), reward, rules))
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.parameters.max_grad_norm)
        self.optimiser.step()
        self.updates += 1
        if self.updates % self.parameters.target_update_interval == 0:
            self.target.load_state_dict(self.network.state_dict())

    @torch.no_grad()
    def td_targets(self, board: Board, following: State, reward: Tensor, rules: Rules) -> Tensor:
        """Return the targets of (17), shape (B,), from the next states and the rewards, shape (B,)."""
        scores = self.target(board, following)
        value = selector = scores_above_reserve(scores.bids, scores.reserve, board, following, rules)
        if self.parameters.double_q:
            own = self.network(board, following)
            selector = scores_above_reserve(own.bids, own.reserve, board, following, rules)
        return td_target(reward, best_move_value(value, selector), following.done, self.parameters.gamma)

    def state_dict(self) -> StateDict:
        """Return weights, optimiser, memory and the number of updates; see `Learner.state_dict`."""
        return {
            "network": self.network.state_dict(),
            "target": self.target.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "memory": self.memory.state(),
            "updates": self.updates,
        }

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        self.network.load_state_dict(state["network"])
        self.target.load_state_dict(state["target"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.memory.load(state["memory"])
        self.updates = state["updates"]
