"""Proximal policy optimisation in four pure functions: collect, advantages, loss, update.

References
----------
Schulman et al. (2017), arXiv:1707.06347; Fang et al. (2025), equations (9)-(11) and (13)-(15),
doi:10.20944/preprints202502.0192.v1.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.distributions import Categorical

from alloc.allocators.learned.network import ActorCritic
from alloc.problems.game import Board, State, begin, step, value_of

LOWEST_LEARNING_RATE = 2e-5
"""Where slowing down ends."""


@dataclass(frozen=True)
class PpoParameters:
    """Hyperparameters of PPO; the paper leaves all of them open, so these are ours.

    Attributes
    ----------
    discount, smoothing : float
        gamma and lambda of (9).
    clip : float
        epsilon of (13).
    entropy_weight, value_weight : float
        Weights of the entropy bonus and of (15).
    reward_scale : float
        Factor on rewards, which are fractions of 1 by nature.
    epochs, minibatch : int
        Passes over a batch of trajectories, and states per gradient step.
    kl_target : float
        Divergence per update at which the learning rate stays as it is.
    max_gradient_norm : float
        Where gradients are clipped.
    """

    discount: float = 0.995
    smoothing: float = 0.95
    clip: float = 0.2
    entropy_weight: float = 0.003
    value_weight: float = 0.5
    reward_scale: float = 20.0
    epochs: int = 3
    minibatch: int = 128
    kl_target: float = 0.012
    max_gradient_norm: float = 0.5


@dataclass(frozen=True, eq=False)
class Trajectories:
    """What B games brought in S steps; all arrays start with (S, B).

    Attributes
    ----------
    task : Tensor of int, shape (S, B, n)
    group : Tensor, shape (S, B, m + 1)
        Together the states.
    alive : Tensor of bool, shape (S, B)
        Whether the game was still on before the step.
    action, log_probability, value, reward : Tensor, shape (S, B)
        The probability is that of the policy that played, so that the ratio of (13) is sound.
    last_value : Tensor, shape (B,)
        Value of the state after the last step, 0 in games that had ended: a game that was cut off is not over.
    """

    task: Tensor
    group: Tensor
    alive: Tensor
    action: Tensor
    log_probability: Tensor
    value: Tensor
    reward: Tensor
    last_value: Tensor


@torch.no_grad()
def collect(
    network: ActorCritic, board: Board, steps: int, parameters: PpoParameters, generator: torch.Generator
) -> Trajectories:
    """Play `steps` steps of every game on `board`, drawing actions from the policy."""
    state = begin(board)
    worth = value_of(board, state)
    columns: list[tuple[Tensor, ...]] = []
    for _ in range(steps):
        logits, value = network(board, state)
        probabilities = logits.log_softmax(-1)
        action = torch.multinomial(probabilities.exp(), 1, generator=generator)[:, 0]
        after = step(board, state, action)
        new_worth = value_of(board, after)
        log_probability = probabilities.gather(1, action[:, None])[:, 0]
        reward = parameters.reward_scale * (new_worth - worth)
        columns.append((state.task, state.group, ~state.done, action, log_probability, value, reward))
        state, worth = after, new_worth
    last = network(board, state)[1].masked_fill(state.done, 0.0)
    task, group, alive, action, log_probability, value, reward = (torch.stack(c) for c in zip(*columns, strict=True))
    return Trajectories(task, group, alive, action, log_probability, value, reward, last)


def advantages(
    reward: Tensor, value: Tensor, alive: Tensor, last_value: Tensor, discount: float, smoothing: float
) -> Tensor:
    """Generalised advantage estimation, (9) and (10), shape (S, B).

    Parameters
    ----------
    reward, value : Tensor, shape (S, B)
    alive : Tensor of bool, shape (S, B)
        Whether the game was still on before each step.
    last_value : Tensor, shape (B,)
        Value after the last step, 0 where the game is over.
    """
    result = torch.zeros_like(reward)
    following, later = last_value, torch.zeros_like(last_value)
    for t in reversed(range(len(reward))):
        error = reward[t] + discount * following - value[t]
        later = (error + discount * smoothing * later) * alive[t]
        result[t] = later
        following = value[t] * alive[t]
    return result


def loss(
    ratio: Tensor, advantage: Tensor, value: Tensor, target: Tensor, entropy: Tensor, parameters: PpoParameters
) -> Tensor:
    """Clipped surrogate (13), (14) with the value loss (15) and an entropy bonus, to be minimised."""
    clipped = ratio.clamp(1 - parameters.clip, 1 + parameters.clip)
    surrogate = torch.minimum(ratio * advantage, clipped * advantage).mean()
    value_loss = 0.5 * (value - target).square().mean()
    return parameters.value_weight * value_loss - surrogate - parameters.entropy_weight * entropy.mean()


@dataclass(frozen=True)
class UpdateStatistics:
    """Means over an update: divergence from the policy that played, entropy, and gradient steps taken."""

    divergence: float
    entropy: float
    gradient_steps: int


def update(
    network: ActorCritic,
    optimiser: torch.optim.Optimizer,
    board: Board,
    played: Trajectories,
    parameters: PpoParameters,
    generator: torch.Generator,
    highest_learning_rate: float = 3e-3,
) -> UpdateStatistics:
    """Fit actor and critic to the trajectories, and adapt the learning rate to the divergence that came of it."""
    gain = advantages(
        played.reward,
        played.value,
        played.alive,
        played.last_value,
        parameters.discount,
        parameters.smoothing,
    )
    when, game = torch.nonzero(played.alive, as_tuple=True)
    gained = gain[when, game]
    advantage = (gained - gained.mean()) / (gained.std() + 1e-6)
    target = gained + played.value[when, game]
    divergences, entropies, count = [], [], 0
    for _ in range(parameters.epochs):
        for index in torch.randperm(len(when), generator=generator).split(parameters.minibatch):
            t, b = when[index], game[index]
            state = State(played.task[t, b], played.group[t, b], torch.zeros(len(b), dtype=torch.bool))
            logits, value = network(board[b], state)
            policy = Categorical(logits=logits, validate_args=False)
            shift = policy.log_prob(played.action[t, b]) - played.log_probability[t, b]
            entropy = policy.entropy()
            objective = loss(shift.exp(), advantage[index], value, target[index], entropy, parameters)
            optimiser.zero_grad(set_to_none=True)
            objective.backward()
            nn.utils.clip_grad_norm_(network.parameters(), parameters.max_gradient_norm)
            optimiser.step()
            divergences.append(float((shift.detach().exp() - 1 - shift.detach()).mean()))
            entropies.append(float(entropy.detach().mean()))
            count += 1
    divergence = sum(divergences) / count
    adapt_learning_rate(optimiser, divergence, parameters.kl_target, highest_learning_rate)
    return UpdateStatistics(divergence, sum(entropies) / count, count)


def adapt_learning_rate(
    optimiser: torch.optim.Optimizer, divergence: float, target: float, highest: float = 3e-3
) -> None:
    """Slow down where the policy moved more than twice as far as intended, and speed up where less than half.

    The paper's adaptive learning rate by KL target; that it stays below `highest` is ours.
    """
    factor = 1 / 1.5 if divergence > 2 * target else 1.5 if divergence < target / 2 else 1.0
    for group in optimiser.param_groups:
        group["lr"] = min(highest, max(LOWEST_LEARNING_RATE, group["lr"] * factor))
