"""Proximal policy optimisation (PPO): play, estimate advantages, and maximise the clipped surrogate objective.

References
----------
Schulman et al. (2017), arXiv:1707.06347; Fang et al. (2025), equations (9)-(11) and (13)-(15),
doi:10.20944/preprints202502.0192.v1. All agents that move in a step share its advantage, as in MAPPO (Yu et al. 2022,
arXiv:2103.01955).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.replay import ReplayBuffer
from alloc.allocators.learned.algorithms.schedules import linear, set_learning_rate
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, advantages, collect
from alloc.problems.game import Board, Rules, State

MIN_LEARNING_RATE = 2e-5
"""Lower bound of the adaptive learning rate."""


class Samples(NamedTuple):
    """N states of the games on one board, with the actions taken there.

    Attributes
    ----------
    board : Board
    game : Tensor of int, shape (N,)
        Index on the board of the game of each state.
    state : State
        Arrays begin with (N,).
    actions : Tensor of int, shape (N, k)
        At most k actions in a state, filled up with -1.
    log_probability : Tensor, shape (N, k)
        Log-probability of each action under the policy that played.
    centre : Tensor, shape (N, k)
        Probability ratio of each action at the start of the update, relative to the policy that played; 1 on-policy.
    advantage, target : Tensor, shape (N,)
        Normalised advantage, and target return of the critic.
    """

    board: Board
    game: Tensor
    state: State
    actions: Tensor
    log_probability: Tensor
    centre: Tensor
    advantage: Tensor
    target: Tensor


class Update(NamedTuple):
    """An update on the new trajectories of one policy.

    Attributes
    ----------
    decisions, evaluations : int
        Decisions of agents that were played, and states that the network evaluated while playing and learning.
    reward : float
        Mean undiscounted return of a game.
    approx_kl, entropy : float
        Mean divergence from the policy that played, and mean entropy, in nats.
    """

    decisions: int
    evaluations: int
    reward: float
    approx_kl: float
    entropy: float


def clipped_surrogate(ratio: Tensor, advantage: Tensor, clip_coef: float, centre: Tensor | float = 1.0) -> Tensor:
    """Return the clipped surrogate (13), (14), to be maximised; all arguments of one shape.

    Ratios of off-policy samples are clipped around `centre`, the ratio at the start of the update: the bound is on the
    change of the current policy (Queeney et al. 2021, arXiv:2111.00072).
    """
    low, high = torch.as_tensor(centre - clip_coef), torch.as_tensor(centre + clip_coef)
    clipped = torch.minimum(torch.maximum(ratio, low), high)
    return torch.minimum(ratio * advantage, clipped * advantage)


def value_loss(value: Tensor, target: Tensor) -> Tensor:
    """Return (15), half the mean squared error of the critic over all states."""
    return 0.5 * (target - value).square().mean()


def adapted_learning_rate(rate: float, approx_kl: float, target_kl: float | None, max_rate: float) -> float:
    """Lower the learning rate if the divergence exceeds twice its target, and raise it below half the target.

    This is the paper's adaptive learning rate; the bounds `MIN_LEARNING_RATE` and `max_rate` are ours. Without a
    target, the rate is only bounded.
    """
    factor = 1.0
    if target_kl is not None:
        factor = 1 / 1.5 if approx_kl > 2 * target_kl else 1.5 if approx_kl < target_kl / 2 else 1.0
    return min(max_rate, max(MIN_LEARNING_RATE, rate * factor))


class Ppo:
    """A learner by PPO; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : PpoParameters, optional
    seed : int
        Seed of the initial weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: PpoParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or PpoParameters()
        (self.network,) = initialised(size, seed, 1)
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)
        self.replay = ReplayBuffer(self.parameters.buffer_size)

    @property
    def policy(self) -> ActorCritic:
        """The network that plays."""
        return self.network

    def train_on(self, job: TrainingJob) -> TrainingStats:
        """Play on boards of the curriculum with an update after each; see `Learner.train_on`."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(job.seed), torch.Generator().manual_seed(job.seed)
        max_rate = linear(parameters.max_learning_rate, parameters.final_lr_fraction, job.progress)
        updates: list[Update] = []
        while sum(one.decisions for one in updates) < job.decisions:
            board = job.curriculum.draw(rng, job.progress)
            updates += self.learn(board, job.curriculum.max_steps(board), job.rules, generator, max_rate)
        reward, approx_kl, entropy = (
            float(np.mean([getattr(one, name) for one in updates])) for name in ("reward", "approx_kl", "entropy")
        )
        decisions, evaluations = (sum(column) for column in zip(*(one[:2] for one in updates), strict=True))
        return TrainingStats(decisions, evaluations, reward, entropy, approx_kl, self.learning_rate)

    def learn(
        self, board: Board, steps: int, rules: Rules, generator: torch.Generator, max_rate: float
    ) -> "list[Update]":
        """Play up to `steps` steps of each game on a board, and train on them; return the updates."""
        played = collect(self.network, board, steps, generator, rules, self.parameters.reward_scale)
        return [self.learn_from(played, rules, generator, max_rate)]

    def learn_from(self, played: Trajectories, rules: Rules, generator: torch.Generator, max_rate: float) -> "Update":
        """Train on new trajectories and on draws from the replay buffer, to which the new ones are then added."""
        parameters = self.parameters
        old = [one for _ in range(parameters.replay_draws) if (one := self.replay.draw(generator)) is not None]
        approx_kl, entropy = self.update(played, old, rules, generator, max_rate)
        self.replay.add(played)
        evaluations = played.evaluations * (1 + parameters.update_epochs) + sum(2 * one.evaluations for one in old)
        reward = float(played.reward.sum(0).mean()) / parameters.reward_scale
        return Update(played.decisions, evaluations, reward, approx_kl, entropy)

    @property
    def learning_rate(self) -> float:
        """Learning rate of the optimiser."""
        return float(self.optimiser.param_groups[0]["lr"])

    def update(
        self,
        fresh: Trajectories,
        old: Sequence[Trajectories],
        rules: Rules,
        generator: torch.Generator,
        max_rate: float,
    ) -> tuple[float, float]:
        """Train actor and critic on new trajectories, and on `old` ones of other policies.

        Returns
        -------
        float, float
            Mean divergence from the policy that played the new trajectories, and mean entropy, both in nats.
        """
        parameters = self.parameters
        set_learning_rate(self.optimiser, min(max_rate, self.learning_rate))
        samples = on_policy_samples(fresh, parameters)
        batches = [
            (samples, index) for _ in range(parameters.update_epochs) for index in self._minibatches(samples, generator)
        ]
        for one in old:
            replayed = off_policy_samples(self.network, one, parameters, rules)
            batches += [(replayed, index) for index in self._minibatches(replayed, generator)]
        if old:
            order = torch.randperm(len(batches), generator=generator).tolist()
            batches = [batches[number] for number in order]
        divergences, entropies = [], []
        for source, index in batches:
            approx_kl, entropy = self._gradient_step(source, index, rules)
            entropies.append(entropy)
            if source is samples:
                divergences.append(approx_kl)
        mean = float(np.mean(divergences))
        rate = adapted_learning_rate(self.learning_rate, mean, parameters.target_kl, max_rate)
        set_learning_rate(self.optimiser, rate)
        return mean, float(np.mean(entropies))

    def _gradient_step(self, samples: Samples, index: Tensor, rules: Rules) -> tuple[float, float]:
        """Take one gradient step on a minibatch; return divergence from the policy that played, and entropy."""
        parameters = self.parameters
        board, state, actions = samples.board[samples.game[index]], samples.state[index], samples.actions[index]
        scores = self.network(board, state)
        log_probability, entropy = log_probabilities(board, state, scores, actions, rules)
        real = actions >= 0
        log_ratio = (log_probability - samples.log_probability[index])[real]
        advantage = samples.advantage[index][:, None].expand_as(log_probability)[real]
        centre = samples.centre[index][real]
        gain = clipped_surrogate(log_ratio.exp(), advantage, parameters.clip_coef, centre).mean()
        critic_loss = value_loss(scores.value, samples.target[index])
        loss = parameters.vf_coef * critic_loss - gain - parameters.ent_coef * entropy.mean()
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), parameters.max_grad_norm)
        self.optimiser.step()
        moved = log_ratio.detach()
        return float((moved.exp() - 1 - moved).mean()), float(entropy.detach().mean())

    def _minibatches(self, samples: Samples, generator: torch.Generator) -> tuple[Tensor, ...]:
        order = torch.randperm(len(samples.game), generator=generator)
        batches: tuple[Tensor, ...] = order.split(self.parameters.minibatch_size)
        return batches

    def state_dict(self) -> StateDict:
        """Return weights, optimiser and replay buffer; see `Learner.state_dict`."""
        return {
            "network": self.network.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "replay": self.replay.state_dict(),
        }

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.replay.load_state_dict(state["replay"])


def on_policy_samples(played: Trajectories, parameters: PpoParameters) -> Samples:
    """Return the samples of new trajectories, with advantages (9) and target returns of the critic."""
    gain = advantages(
        played.reward, played.value, played.alive, played.last_value, parameters.gamma, parameters.gae_lambda
    )
    return _samples(played, gain, gain + played.value, torch.ones_like(played.log_probability))


@torch.no_grad()
def off_policy_samples(network: ActorCritic, old: Trajectories, parameters: PpoParameters, rules: Rules) -> Samples:
    """Return the samples of trajectories that an earlier policy played, corrected for the current policy.

    Values are those of the current critic, and traces are cut, as in V-trace, where the current policy is less likely
    to take the actions than the earlier policy, whose probabilities are stored.
    """
    value, log_probability = torch.zeros_like(old.value), torch.zeros_like(old.log_probability)
    when, game = torch.nonzero(old.alive, as_tuple=True)
    for index in torch.arange(len(when)).split(4 * parameters.minibatch_size):
        t, b = when[index], game[index]
        board, state, actions = old.board[b], old.state[t, b], old.actions[t, b]
        scores = network(board, state)
        value[t, b] = scores.value
        log_probability[t, b] = log_probabilities(board, state, scores, actions, rules)[0]
    log_ratio = (log_probability - old.log_probability) * (old.actions >= 0)
    likelihood = log_ratio.sum(2).exp()
    last = old.last_value
    gain = advantages(old.reward, value, old.alive, last, parameters.gamma, parameters.gae_lambda, likelihood)
    return _samples(old, gain, value + likelihood.clamp(max=1.0) * gain, log_ratio.exp())


def _samples(played: Trajectories, gain: Tensor, target: Tensor, centre: Tensor) -> Samples:
    when, game = torch.nonzero(played.alive, as_tuple=True)
    advantage = gain[when, game]
    actions = played.actions[when, game]
    per_action = advantage[:, None].expand_as(actions)[actions >= 0]
    return Samples(
        played.board,
        game,
        played.state[when, game],
        actions,
        played.log_probability[when, game],
        centre[when, game],
        (advantage - per_action.mean()) / (per_action.std(correction=0) + 1e-6),
        target[when, game],
    )
