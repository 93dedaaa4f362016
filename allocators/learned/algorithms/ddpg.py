"""Deep deterministic policy gradient (DDPG), relaxed to discrete actions.

DDPG differentiates the critic with respect to a continuous action. A bid is a discrete action, so the action is relaxed
to the softmax over the open bids and stopping: a point of the simplex whose vertices are the actions themselves. The
critic values such a point by its multilinear extension, Q(s, x) = sum over b of x_b * q(s, b), which agrees with q at
the vertices; stopping ends the game, so that its q is 0 and bids are valued relative to it. Hence
d Q / d x_b = q(s, b), and (18) becomes the gradient of the mean of q over the actor's actions: a policy gradient over
all bids at once, without the variance of sampled ones. Since Q is linear in x, its maximum lies at a vertex: an entropy
bonus keeps the actor from converging there too early.

Bids are executed in the order of the actor's scores, with Gumbel noise added in training, which samples them from the
softmax; this takes the place of the exploration noise that DDPG adds to its actions.

References
----------
Lillicrap et al. (2016), arXiv:1509.02971; Jang, Gu and Poole (2017), arXiv:1611.01144, for actions relaxed by a
softmax; Christodoulou (2019), arXiv:1910.07207, for critics that value all actions at once; Fang et al. (2025),
equation (18), doi:10.20944/preprints202502.0192.v1.
"""

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.dqn import gradient_steps, td_target
from alloc.allocators.learned.algorithms.hyperparameters import DdpgParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob, TrainingStats
from alloc.allocators.learned.algorithms.schedules import exponential, linear, set_learning_rate
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, initialised
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.play.transitions import TransitionMemory, next_state, play, scores_above_reserve
from alloc.problems.game import Board, Rules, State


def relaxed_action(gain: Tensor, temperature: float) -> Tensor:
    """Return the softmax over open bids and stopping, shape (B, n * c + 1); see `gains`."""
    return (gain / temperature).softmax(1)


def relaxed_value(action: Tensor, q_value: Tensor) -> Tensor:
    """Return Q(s, x), the multilinear extension of `q_value`, shape (B,); closed bids have probability 0."""
    return (action * q_value.masked_fill(q_value == -torch.inf, 0.0)).sum(1)


def entropy_of(action: Tensor) -> Tensor:
    """Return the entropy of each row in nats, shape (B,); gradients are finite where a probability is 0."""
    return -(action * action.clamp(min=1e-30).log()).sum(1)


@torch.no_grad()
def polyak_update(target: nn.Module, network: nn.Module, tau: float) -> None:
    """Move the weights of `target` towards those of `network` by the fraction `tau` of their difference."""
    for old, new in zip(target.parameters(), network.parameters(), strict=True):
        old.lerp_(new, tau)


class Ddpg:
    """A learner by DDPG; see `Learner`.

    Parameters
    ----------
    size : NetworkSize, optional
        Size of both actor and critic.
    parameters : DdpgParameters, optional
    seed : int
        Seed of the initial weights.
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
        self.memory = TransitionMemory(self.parameters.buffer_size)

    @property
    def policy(self) -> ActorCritic:
        """The actor."""
        actor = self.networks["actor"]
        assert isinstance(actor, ActorCritic)
        return actor

    def train_on(self, job: TrainingJob) -> TrainingStats:
        """Play on boards of the curriculum and learn from the memory; see `Learner.train_on`."""
        parameters = self.parameters
        rng, generator = np.random.default_rng(job.seed), torch.Generator().manual_seed(job.seed)
        rate = linear(parameters.learning_rate, parameters.final_lr_fraction, job.progress)
        set_learning_rate(self.optimisers["actor"], rate * parameters.actor_lr_fraction)
        set_learning_rate(self.optimisers["critic"], rate)
        ent_coef = exponential(parameters.ent_coef, parameters.final_ent_coef, job.progress)
        exploring = parameters.exploration_initial_eps * (1 - job.progress)
        decisions = evaluations = 0
        rewards, entropies = [], []
        while decisions < job.decisions:
            board = job.curriculum.draw(rng, job.progress)
            steps = job.curriculum.max_steps(board)
            temperature, scale = parameters.softmax_temperature, parameters.reward_scale
            played = play(self.policy, board, steps, generator, job.rules, temperature, exploring, scale)
            self.memory.add(played.transitions)
            count = gradient_steps(len(played.transitions.action), parameters.replay_ratio, parameters.batch_size)
            count = count if self.memory.kept else 0
            entropies += [self.update(job.rules, ent_coef, generator) for _ in range(count)]
            decisions += played.decisions
            evaluations += played.evaluations + count * parameters.batch_size * 5
            rewards.append(played.reward)
        entropy = float(np.mean(entropies)) if entropies else 0.0
        return TrainingStats(decisions, evaluations, float(np.mean(rewards)), entropy, 0.0, rate)

    def update(self, rules: Rules, ent_coef: float, generator: torch.Generator) -> float:
        """Take one gradient step of critic and actor on replayed moves; return the actor's mean entropy in nats."""
        board, state, action, reward = self.memory.draw(self.parameters.batch_size, generator)
        q_value = self._gains(self.networks["critic"], board, state, rules)
        target = self.td_targets(board, next_state(board, state, action), reward, rules)
        value = q_value.gather(1, action[:, None])[:, 0]
        self._gradient_step("critic", nn.functional.huber_loss(value, target))
        relaxed = self._act(self.networks["actor"], board, state, rules)
        entropy = entropy_of(relaxed).mean()
        self._gradient_step("actor", -relaxed_value(relaxed, q_value.detach()).mean() - ent_coef * entropy)
        for name, network in self.networks.items():
            polyak_update(self.targets[name], network, self.parameters.tau)
        return float(entropy.detach())

    @torch.no_grad()
    def td_targets(self, board: Board, following: State, reward: Tensor, rules: Rules) -> Tensor:
        """Return the targets of the critic, shape (B,), from the next states and the rewards, shape (B,)."""
        relaxed = self._act(self.targets["actor"], board, following, rules)
        q_value = self._gains(self.targets["critic"], board, following, rules)
        return td_target(reward, relaxed_value(relaxed, q_value), following.done, self.parameters.gamma)

    def _act(self, actor: nn.Module, board: Board, state: State, rules: Rules) -> Tensor:
        return relaxed_action(self._gains(actor, board, state, rules), self.parameters.softmax_temperature)

    def _gains(self, network: nn.Module, board: Board, state: State, rules: Rules) -> Tensor:
        scores = network(board, state)
        return scores_above_reserve(scores.bids, scores.reserve, board, state, rules)

    def _gradient_step(self, name: str, loss: Tensor) -> None:
        optimiser, network = self.optimisers[name], self.networks[name]
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), self.parameters.max_grad_norm)
        optimiser.step()

    def state_dict(self) -> StateDict:
        """Return weights, optimisers and memory; see `Learner.state_dict`."""
        return {
            "networks": self.networks.state_dict(),
            "targets": self.targets.state_dict(),
            "optimisers": {name: one.state_dict() for name, one in self.optimisers.items()},
            "memory": self.memory.state(),
        }

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        self.networks.load_state_dict(state["networks"])
        self.targets.load_state_dict(state["targets"])
        for name, one in self.optimisers.items():
            one.load_state_dict(state["optimisers"][name])
        self.memory.load(state["memory"])
