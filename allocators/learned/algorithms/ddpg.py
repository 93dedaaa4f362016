"""Deep deterministic policy gradient, relaxed to discrete choice.

DDPG differentiates the critic with respect to a continuous action. A bid is a discrete choice, so the action is relaxed
to the vector of shares that a softmax gives to the open bids and to stopping: a point of the simplex whose corners are
the choices themselves. The critic values shares by its multilinear extension, Q(s, shares) = sum over b of
share_b * q(s, b), which agrees with q at the corners; stopping ends the game, so that its q is 0 and bids are valued
above it. With that, d Q / d share_b = q(s, b), and (18) becomes the gradient of the mean of q over the actor's choices:
a policy gradient over all bids at once, without the noise of drawn ones. Since Q is linear in the shares, the best lie
at a corner: a bonus on their entropy keeps them from freezing there too soon.

What is executed are bids granted in the order of the actor's scores, perturbed by Gumbel noise while it learns, which
draws them from the shares; this takes the place of the noise that DDPG adds to its actions.

References
----------
Lillicrap et al. (2016), arXiv:1509.02971; Jang, Gu and Poole (2017), arXiv:1611.01144, for choices relaxed by a
softmax; Christodoulou (2019), arXiv:1910.07207, for critics that value all choices at once; Fang et al. (2025),
equation (18), doi:10.20944/preprints202502.0192.v1.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import DdpgParameters
from alloc.allocators.learned.algorithms.learner import Lesson, LessonReport
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.play.transitions import TransitionMemory, next_state, play, scores_above_reserve
from alloc.problems.game import Board, Rules, State


def shares_of(gain: Tensor, softness: float) -> Tensor:
    """Relax a choice: the softmax over open bids and stopping, shape (B, n * c + 1); see `gains`."""
    return (gain / softness).softmax(1)


def value_of_shares(shares: Tensor, quality: Tensor) -> Tensor:
    """Return Q(s, shares), the multilinear extension of `quality`, shape (B,); closed bids have no share."""
    return (shares * quality.masked_fill(quality == -torch.inf, 0.0)).sum(1)


def entropy_of(shares: Tensor) -> Tensor:
    """Return the entropy of each row, shape (B,); finite gradients where a share is 0."""
    return -(shares * shares.clamp(min=1e-30).log()).sum(1)


def td_target(reward: Tensor, following: Tensor, over: Tensor, discount: float) -> Tensor:
    """Return r + gamma * Q(s', shares'), without what follows where the game is over; all of shape (B,)."""
    return reward + discount * following.masked_fill(over, 0.0)


@torch.no_grad()
def follow(target: nn.Module, network: nn.Module, share: float) -> None:
    """Move the weights of `target` towards those of `network` by this share of the way."""
    for old, new in zip(target.parameters(), network.parameters(), strict=True):
        old.lerp_(new, share)


class Ddpg:
    """A learner by DDPG; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
        Of actor and critic each.
    parameters : DdpgParameters, optional
    seed : int
        Of the first weights.
    """

    def __init__(
        self, size: NetworkSize | None = None, parameters: DdpgParameters | None = None, seed: int = 0
    ) -> None:
        self.parameters = parameters or DdpgParameters()
        actor, critic, *targets = initialised(size, seed, 4)
        self.networks = nn.ModuleDict({"actor": actor, "critic": critic})
        self.targets = nn.ModuleDict(dict(zip(self.networks, targets, strict=True)))
        self.targets.load_state_dict(self.networks.state_dict())
        self.optimisers = {name: torch.optim.Adam(one.parameters()) for name, one in self.networks.items()}
        self.memory = TransitionMemory(self.parameters.capacity)

    @property
    def policy(self) -> ActorCritic:
        """The actor."""
        actor = self.networks["actor"]
        assert isinstance(actor, ActorCritic)
        return actor

    def take(self, lesson: Lesson) -> LessonReport:
        """Play on boards of the curriculum and learn from the memory, until the lesson's decisions are made."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(lesson.seed), torch.Generator().manual_seed(lesson.seed)
        rate = parameters.learning_rate * (1 - (1 - parameters.final_share) * lesson.progress)
        for name, share in (("actor", parameters.actor_share), ("critic", 1.0)):
            for group in self.optimisers[name].param_groups:
                group["lr"] = rate * share
        bonus = parameters.entropy_weight
        if bonus > 0:
            bonus *= (parameters.final_entropy_weight / parameters.entropy_weight) ** lesson.progress
        decisions = evaluations = 0
        rewards, entropies = [], []
        while decisions < lesson.decisions:
            board = lesson.curriculum.draw(rng, lesson.progress)
            steps = lesson.curriculum.steps(board)
            softness, scale = parameters.softness, parameters.reward_scale
            exploring = parameters.exploring * (1 - lesson.progress)
            played = play(self.policy, board, steps, generator, lesson.rules, softness, exploring, scale)
            self.memory.add(played.transitions)
            repeats = max(1, round(parameters.reuse * len(played.transitions.action) / parameters.minibatch))
            repeats = repeats if self.memory.kept else 0
            entropies += [self.update(lesson.rules, bonus, generator) for _ in range(repeats)]
            decisions += played.decisions
            evaluations += played.evaluations + repeats * parameters.minibatch * 5
            rewards.append(played.reward)
        entropy = float(np.mean(entropies)) if entropies else 0.0
        return LessonReport(decisions, evaluations, float(np.mean(rewards)), entropy, 0.0, rate)

    def update(self, rules: Rules, bonus: float, generator: torch.Generator) -> float:
        """Take one gradient step of critic and actor on remembered moves; return the mean entropy of the shares."""
        board, state, action, reward = self.memory.draw(self.parameters.minibatch, generator)
        quality = self._gains(self.networks["critic"], board, state, rules)
        wanted = self.wanted(board, next_state(board, state, action), reward, rules)
        value = quality.gather(1, action[:, None])[:, 0]
        self._descend("critic", nn.functional.huber_loss(value, wanted))
        shares = shares_of(self._gains(self.networks["actor"], board, state, rules), self.parameters.softness)
        entropy = entropy_of(shares).mean()
        self._descend("actor", -value_of_shares(shares, quality.detach()).mean() - bonus * entropy)
        for name, network in self.networks.items():
            follow(self.targets[name], network, self.parameters.target_share)
        return float(entropy.detach())

    @torch.no_grad()
    def wanted(self, board: Board, following: State, reward: Tensor, rules: Rules) -> Tensor:
        """Return what the critic is to learn, shape (B,)."""
        shares = shares_of(self._gains(self.targets["actor"], board, following, rules), self.parameters.softness)
        quality = self._gains(self.targets["critic"], board, following, rules)
        return td_target(reward, value_of_shares(shares, quality), following.done, self.parameters.discount)

    def _gains(self, network: nn.Module, board: Board, state: State, rules: Rules) -> Tensor:
        scores = network(board, state)
        return scores_above_reserve(scores.bids, scores.reserve, board, state, rules)

    def _descend(self, name: str, loss: Tensor) -> None:
        optimiser, network = self.optimisers[name], self.networks[name]
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), self.parameters.max_gradient_norm)
        optimiser.step()

    def state(self) -> dict[str, Any]:
        """Return weights, optimisers and memory."""
        return {
            "networks": self.networks.state_dict(),
            "targets": self.targets.state_dict(),
            "optimisers": {name: one.state_dict() for name, one in self.optimisers.items()},
            "memory": self.memory.state(),
        }

    def load(self, state: dict[str, Any]) -> None:
        """Take up what `state` returned."""
        self.networks.load_state_dict(state["networks"])
        self.targets.load_state_dict(state["targets"])
        for name, one in self.optimisers.items():
            one.load_state_dict(state["optimisers"][name])
        self.memory.load(state["memory"])
