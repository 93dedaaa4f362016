"""Proximal policy optimisation in pure functions: the loss, an update, and the step size that follows the divergence.

References
----------
Schulman et al. (2017), arXiv:1707.06347; Fang et al. (2025), equations (9)-(11) and (13)-(15),
doi:10.20944/preprints202502.0192.v1.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from alloc.allocators.learned.network import ActorCritic
from alloc.allocators.learned.trajectories import Trajectories, advantages
from alloc.allocators.learned.turns import log_probabilities
from alloc.problems.game import PLANNING, Rules

LOWEST_LEARNING_RATE = 2e-5
"""Where slowing down ends."""


@dataclass(frozen=True)
class PpoParameters:
    discount: float = 0.99
    smoothing: float = 0.95
    clip: float = 0.2
    entropy_weight: float = 0.003
    value_weight: float = 0.5
    reward_scale: float = 20.0
    epochs: int = 3
    minibatch: int = 128
    kl_target: float = 0.012
    max_gradient_norm: float = 0.5
    credit: str = "team"


def loss(
    ratio: Tensor, advantage: Tensor, value: Tensor, target: Tensor, entropy: Tensor, parameters: PpoParameters,
    real: Tensor,
) -> Tensor:
    clipped = ratio.clamp(1 - parameters.clip, 1 + parameters.clip)
    surrogate = torch.minimum(ratio * advantage, clipped * advantage)[real].mean()
    value_loss = 0.5 * (value - target).square().mean()
    return parameters.value_weight * value_loss - surrogate - parameters.entropy_weight * entropy.mean()


def update(network, optimiser, played: Trajectories, parameters: PpoParameters, generator, highest=3e-3, rules=PLANNING):
    gain = advantages(played.reward, played.value, played.alive, played.last_value, parameters.discount, parameters.smoothing)
    when, game = torch.nonzero(played.alive, as_tuple=True)
    gained = gain[when, game]
    target = gained + played.value[when, game]
    real = played.actions[when, game] >= 0
    share = played.share[when, game]
    adv = gained[:, None].expand_as(share)
    count = real.sum(1, keepdim=True)
    if parameters.credit == "team":
        pass
    elif parameters.credit == "share":
        adv = adv / count + share - (share * real).sum(1, keepdim=True) / count
    elif parameters.credit == "own":
        adv = adv - (share.sum(1, keepdim=True) - share) * 1.0 + (count - 1) * (share * real).sum() / real.sum()
    flat = adv[real]
    adv = (adv - flat.mean()) / (flat.std() + 1e-6)
    n = 0; kls = []; ents = []
    for _ in range(parameters.epochs):
        for index in torch.randperm(len(when), generator=generator).split(parameters.minibatch):
            t, b = when[index], game[index]
            board, state = played.board[b], played.state[t, b]
            scores = network(board, state)
            actions = played.actions[t, b]
            lp, entropy = log_probabilities(board, state, scores, actions, rules)
            shift = lp - played.log_probability[t, b]
            r = real[index]
            objective = loss(shift.exp(), adv[index], scores.value, target[index], entropy, parameters, r)
            optimiser.zero_grad(set_to_none=True)
            objective.backward()
            nn.utils.clip_grad_norm_(network.parameters(), parameters.max_gradient_norm)
            optimiser.step()
            s = shift.detach()[r]
            kls.append(float((s.exp() - 1 - s).mean())); ents.append(float(entropy.mean()))
    kl = sum(kls) / len(kls)
    f = 1 / 1.5 if kl > 2 * parameters.kl_target else 1.5 if kl < parameters.kl_target / 2 else 1.0
    for g in optimiser.param_groups:
        g["lr"] = min(highest, max(LOWEST_LEARNING_RATE, g["lr"] * f))
    return kl, sum(ents) / len(ents)
