"""Proximal policy optimisation: play, estimate advantages, climb the clipped surrogate; again and again.

References
----------
Schulman et al. (2017), arXiv:1707.06347; Fang et al. (2025), equations (9)-(11) and (13)-(15),
doi:10.20944/preprints202502.0192.v1. That all who moved in a step share its advantage is MAPPO (Yu et al. 2022,
arXiv:2103.01955).
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.algorithms.learner import Lesson, LessonReport
from alloc.allocators.learned.algorithms.replay import Replay
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import Trajectories, advantages, collect
from alloc.problems.game import Board, Rules, State

__all__ = ["Ppo", "PpoParameters", "Samples", "adapted_rate", "reused", "samples_of", "surrogate", "value_loss"]

LOWEST_LEARNING_RATE = 2e-5
"""Where slowing down ends."""


class Samples(NamedTuple):
    """States of one board with what was done there; all arrays begin with (N,).

    Attributes
    ----------
    board : Board
        The games; `game` says which one each state is of.
    game : Tensor of int
    state : State
    actions : Tensor of int, shape (N, k)
    log_probability : Tensor, shape (N, k)
        By the policy that played.
    centre : Tensor, shape (N, k)
        How likely each action was when the update began, over how likely it was when it was played; 1 if fresh.
    advantage, target : Tensor, shape (N,)
    """

    board: Board
    game: Tensor
    state: State
    actions: Tensor
    log_probability: Tensor
    centre: Tensor
    advantage: Tensor
    target: Tensor


def surrogate(ratio: Tensor, advantage: Tensor, clip: float, centre: Tensor | float = 1.0) -> Tensor:
    """Return the clipped surrogate (13), (14), to be maximised; all arguments of one shape.

    Samples that an older policy played are clipped around `centre`, how much likelier the policy at the beginning of
    the update makes them: what is bounded is how far that policy moves (Queeney et al. 2021, arXiv:2111.00072).
    """
    clipped = torch.minimum(torch.maximum(ratio, torch.as_tensor(centre - clip)), torch.as_tensor(centre + clip))
    return torch.minimum(ratio * advantage, clipped * advantage)


def value_loss(value: Tensor, target: Tensor) -> Tensor:
    """Return (15), the mean over all states."""
    return 0.5 * (target - value).square().mean()


def adapted_rate(rate: float, divergence: float, target: float | None, highest: float) -> float:
    """Slow down where the policy moved more than twice as far as intended, and speed up where less than half.

    The paper's adaptive learning rate by KL target; that it stays below `highest` is ours.
    """
    factor = 1.0
    if target is not None:
        factor = 1 / 1.5 if divergence > 2 * target else 1.5 if divergence < target / 2 else 1.0
    return min(highest, max(LOWEST_LEARNING_RATE, rate * factor))


class Ppo:
    """A learner by PPO; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : PpoParameters, optional
    seed : int
        Of the first weights.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: PpoParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or PpoParameters()
        (self.network,) = initialised(size, seed, 1)
        self.optimiser = torch.optim.Adam(self.network.parameters(), self.parameters.learning_rate)
        self.replay = Replay(self.parameters.capacity)

    @property
    def policy(self) -> ActorCritic:
        """The network that plays."""
        return self.network

    def take(self, lesson: Lesson) -> LessonReport:
        """Play on boards of the curriculum and learn from each, until the lesson's decisions are made."""
        rng, generator = np.random.default_rng(lesson.seed), torch.Generator().manual_seed(lesson.seed)
        highest = self.parameters.highest_rate * (1 - (1 - self.parameters.final_share) * lesson.progress)
        decisions = evaluations = 0
        rewards, outcomes = [], []
        while decisions < lesson.decisions:
            board = lesson.curriculum.draw(rng, lesson.progress)
            steps = lesson.curriculum.steps(board)
            played = collect(self.network, board, steps, generator, lesson.rules, self.parameters.reward_scale)
            old = self.replay.draw(generator)
            outcomes.append(self.update(played, old, lesson.rules, generator, highest))
            self.replay.add(played)
            decisions += played.decisions
            evaluations += played.evaluations * (1 + self.parameters.epochs)
            evaluations += 0 if old is None else 2 * old.evaluations
            rewards.append(float(played.reward.sum(0).mean()) / self.parameters.reward_scale)
        divergence, entropy = (float(np.mean(column)) for column in zip(*outcomes, strict=True))
        return LessonReport(decisions, evaluations, float(np.mean(rewards)), entropy, divergence, self.learning_rate)

    @property
    def learning_rate(self) -> float:
        """Step size of the optimiser."""
        return float(self.optimiser.param_groups[0]["lr"])

    def update(
        self, fresh: Trajectories, old: Trajectories | None, rules: Rules, generator: torch.Generator, highest: float
    ) -> tuple[float, float]:
        """Fit actor and critic to trajectories; return divergence of the fresh ones and mean entropy."""
        parameters = self.parameters
        self._set_rate(min(highest, self.learning_rate))
        samples = samples_of(fresh, parameters)
        batches = [(samples, index) for _ in range(parameters.epochs) for index in self._shuffled(samples, generator)]
        if old is not None:
            again = reused(self.network, old, parameters, rules)
            batches += [(again, index) for index in self._shuffled(again, generator)]
            order = torch.randperm(len(batches), generator=generator).tolist()
            batches = [batches[number] for number in order]
        divergences, entropies = [], []
        for source, index in batches:
            divergence, entropy = self._descend(source, index, rules)
            entropies.append(entropy)
            if source is samples:
                divergences.append(divergence)
        mean = float(np.mean(divergences))
        self._set_rate(adapted_rate(self.learning_rate, mean, parameters.kl_target, highest))
        return mean, float(np.mean(entropies))

    def _descend(self, samples: Samples, index: Tensor, rules: Rules) -> tuple[float, float]:
        """Take one gradient step; return divergence from the policy that played, and entropy."""
        parameters = self.parameters
        board, state, actions = samples.board[samples.game[index]], samples.state[index], samples.actions[index]
        scores = self.network(board, state)
        log_probability, entropy = log_probabilities(board, state, scores, actions, rules)
        real = actions >= 0
        shift = (log_probability - samples.log_probability[index])[real]
        advantage = samples.advantage[index][:, None].expand_as(log_probability)[real]
        gain = surrogate(shift.exp(), advantage, parameters.clip, samples.centre[index][real]).mean()
        fault = value_loss(scores.value, samples.target[index])
        loss = parameters.value_weight * fault - gain - parameters.entropy_weight * entropy.mean()
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), parameters.max_gradient_norm)
        self.optimiser.step()
        moved = shift.detach()
        return float((moved.exp() - 1 - moved).mean()), float(entropy.detach().mean())

    def _shuffled(self, samples: Samples, generator: torch.Generator) -> tuple[Tensor, ...]:
        order = torch.randperm(len(samples.game), generator=generator)
        batches: tuple[Tensor, ...] = order.split(self.parameters.minibatch)
        return batches

    def _set_rate(self, rate: float) -> None:
        for group in self.optimiser.param_groups:
            group["lr"] = rate

    def state(self) -> dict[str, Any]:
        """Return weights, optimiser and replay buffer."""
        return {
            "network": self.network.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "replay": self.replay.state(),
        }

    def load(self, state: dict[str, Any]) -> None:
        """Take up what `state` returned."""
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.replay.load(state["replay"])


def samples_of(played: Trajectories, parameters: PpoParameters) -> Samples:
    """Return the samples of fresh trajectories, with advantages (9) and the returns that the critic is to learn."""
    gain = advantages(
        played.reward, played.value, played.alive, played.last_value, parameters.discount, parameters.smoothing
    )
    return _samples(played, gain, gain + played.value, torch.ones_like(played.log_probability))


@torch.no_grad()
def reused(network: ActorCritic, old: Trajectories, parameters: PpoParameters, rules: Rules) -> Samples:
    """Return the samples of trajectories that an older policy played, corrected for what this one would do.

    Values are those of the critic today, and traces are cut where today's policy is less likely to act as the older
    one did, whose probabilities were kept.
    """
    value, log_probability = torch.zeros_like(old.value), torch.zeros_like(old.log_probability)
    when, game = torch.nonzero(old.alive, as_tuple=True)
    for index in torch.arange(len(when)).split(4 * parameters.minibatch):
        t, b = when[index], game[index]
        board, state, actions = old.board[b], old.state[t, b], old.actions[t, b]
        scores = network(board, state)
        value[t, b] = scores.value
        log_probability[t, b] = log_probabilities(board, state, scores, actions, rules)[0]
    shift = (log_probability - old.log_probability) * (old.actions >= 0)
    likelihood = shift.sum(2).exp()
    last = old.last_value
    gain = advantages(old.reward, value, old.alive, last, parameters.discount, parameters.smoothing, likelihood)
    return _samples(old, gain, value + likelihood.clamp(max=1.0) * gain, shift.exp())


def _samples(played: Trajectories, gain: Tensor, target: Tensor, centre: Tensor) -> Samples:
    when, game = torch.nonzero(played.alive, as_tuple=True)
    advantage = gain[when, game]
    actions = played.actions[when, game]
    several = advantage[:, None].expand_as(actions)[actions >= 0]
    return Samples(
        played.board,
        game,
        played.state[when, game],
        actions,
        played.log_probability[when, game],
        centre[when, game],
        (advantage - several.mean()) / (several.std(correction=0) + 1e-6),
        target[when, game],
    )
