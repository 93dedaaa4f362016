"""PPO in missions, with one network for the asynchronous decisions of all agents.

Each mission is played several times, with the same events and the same random losses of messages. The advantage of a
decision is the reduction of the cost of all agents soon after it, relative to the other plays in the same hours. A
critic in place of the other plays explained 0.02 to 0.28 of the variance, and did not improve mission times.

References
----------
Schulman et al. (2017), arXiv:1707.06347; all agents share one policy, as in MAPPO (Yu et al. 2022, arXiv:2103.01955).
Other plays as the baseline: Kool, van Hoof and Welling (2019), "Buy 4 REINFORCE samples, get a baseline for free!".
"""

import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from alloc.allocators.learned.algorithms.hyperparameters import PpoParameters
from alloc.allocators.learned.algorithms.ppo import adapted_learning_rate, clipped_surrogate
from alloc.allocators.learned.algorithms.schedules import linear, set_learning_rate
from alloc.allocators.learned.missions.network import compiled_weights, first_network
from alloc.allocators.learned.missions.play import new_buffers
from alloc.allocators.learned.missions.rollout import Record, record_for, rollout
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum, PackedMission
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.missions.pack import begun
from alloc.problems.fields import FloatArray

PLAYS = 6
"""Number of plays of each mission."""

WINDOW = 0.35
"""Time after a decision in which costs count, in ideal mission times."""

MAX_DECISIONS = 3000
"""Maximum number of decisions of a mission used for learning."""


class MissionSamples(NamedTuple):
    """Decisions of all agents in some missions."""

    options: Tensor
    is_option: Tensor
    action: Tensor
    log_probability: Tensor
    advantage: Tensor


@dataclass(frozen=True)
class MissionStats:
    """Statistics of updates: decisions, mean cost of a mission, mean entropy and divergence in nats."""

    decisions: int
    cost: float
    entropy: float
    approx_kl: float


class MissionPpo:
    """A learner by PPO in missions.

    Parameters
    ----------
    parameters : PpoParameters
    seed : int
        Seed of the initial weights.
    """

    def __init__(self, parameters: PpoParameters, seed: int = 0) -> None:
        self.parameters, self.network = parameters, first_network(seed)
        self.optimiser = torch.optim.Adam(self.network.parameters(), parameters.learning_rate)

    def train_on(
        self, curriculum: MissionCurriculum, seed: int, decisions: int, missions: int, progress: float
    ) -> MissionStats:
        """Play missions, with an update after every `missions` of them, until `decisions` decisions are made.

        Parameters
        ----------
        curriculum : MissionCurriculum
        seed : int
            Seed of all random numbers.
        decisions : int
        missions : int
            Number of missions between two updates; each is played `PLAYS` times.
        progress : float
            Share of the training that is done, 0 to 1.
        """
        rng, generator = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
        parameters, done = self.parameters, 0
        figures: list[tuple[float, float, float]] = []
        while done < decisions:
            groups = [self._play(*one) for one in curriculum.draw(rng, missions, progress)]
            samples = self._samples(groups)
            done += len(samples.action)
            max_rate = linear(parameters.max_learning_rate, parameters.final_lr_fraction, progress)
            cost = float(np.mean([record.total[0] / record.total[1] for group in groups for record in group]))
            figures.append((cost, *self._update(samples, generator, max_rate)))
        cost, entropy, approx_kl = (float(np.mean(column)) for column in zip(*figures, strict=True))
        return MissionStats(done, cost, entropy, approx_kl)

    def _play(self, mission: PackedMission, seed: int) -> list[Record]:
        """Return the plays of a mission, which differ only in the sampled decisions."""
        n, m = len(mission.arrays.agents), len(mission.arrays.tasks)
        weights, records = compiled_weights(self.network), []
        for play in range(PLAYS):
            record = record_for(n, m, MAX_DECISIONS, mission.ideal)
            buffers = new_buffers(n, m, mission.periods)
            rollout(begun(mission.arrays, seed), buffers, weights, PLAYS * seed + play, record)
            records.append(record)
        return records

    def _samples(self, groups: list[list[Record]]) -> MissionSamples:
        most = max(int(record.choices[: record.length[0]].max(initial=1)) for group in groups for record in group)
        parts = []
        for group in groups:
            for record, advantage in zip(group, group_advantages(group), strict=True):
                length = int(record.length[0])
                options = torch.from_numpy(record.options[:length, :most])
                options = nn.functional.pad(options, (0, 0, 0, most - options.shape[1]))
                is_option = torch.arange(most)[None] < torch.from_numpy(record.choices[:length])[:, None]
                old = torch.from_numpy(record.log_probability[:length]).float()
                action = torch.from_numpy(record.action[:length])
                parts.append((options, is_option, action, old, torch.from_numpy(advantage).float()))
        samples = MissionSamples(*(torch.cat(column) for column in zip(*parts, strict=True)))
        return samples._replace(advantage=samples.advantage / (samples.advantage.std(correction=0) + 1e-6))

    def _update(self, samples: MissionSamples, generator: torch.Generator, max_rate: float) -> tuple[float, float]:
        """Take gradient steps; return mean entropy and divergence in nats."""
        parameters, figures = self.parameters, []
        rate = float(self.optimiser.param_groups[0]["lr"])
        set_learning_rate(self.optimiser, min(max_rate, rate))
        for _ in range(parameters.update_epochs):
            order = torch.randperm(len(samples.action), generator=generator)
            batches = order.split(parameters.minibatch_size)
            figures += [self._gradient_step(MissionSamples(*(part[index] for part in samples))) for index in batches]
        entropy, approx_kl = (float(np.mean(column)) for column in zip(*figures, strict=True))
        rate = float(self.optimiser.param_groups[0]["lr"])
        set_learning_rate(self.optimiser, adapted_learning_rate(rate, approx_kl, parameters.target_kl, max_rate))
        return entropy, approx_kl

    def _gradient_step(self, batch: MissionSamples) -> tuple[float, float]:
        parameters = self.parameters
        scores = self.network(batch.options, batch.is_option)
        log_all = scores.log_softmax(-1)
        log_probability = log_all.gather(1, batch.action[:, None])[:, 0]
        entropy = -(log_all.exp() * log_all.masked_fill(~batch.is_option, 0.0)).sum(-1).mean()
        log_ratio = log_probability - batch.log_probability
        gain = clipped_surrogate(log_ratio.exp(), batch.advantage, parameters.clip_coef).mean()
        loss = -gain - parameters.ent_coef * entropy
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), parameters.max_grad_norm)
        self.optimiser.step()
        moved = log_ratio.detach()
        return float(entropy.detach()), float((moved.exp() - 1 - moved).mean())

    def state_dict(self) -> StateDict:
        """Return weights and optimiser."""
        return {"network": self.network.state_dict(), "optimiser": self.optimiser.state_dict()}

    def load_state_dict(self, state: StateDict) -> None:
        """Restore what `state_dict` returned."""
        state = copy.deepcopy(state)
        self.network.load_state_dict(state["network"])
        self.optimiser.load_state_dict(state["optimiser"])


def group_advantages(group: list[Record]) -> list[FloatArray]:
    """Return the advantage of each decision over the other plays of a mission, in ideal mission times.

    Parameters
    ----------
    group : list of Record
        Records of at least two completed plays.
    """
    gained = []
    for record in group:
        hours, ideal = record.hour[: record.length[0]], float(record.total[1])
        lost = [_lost_after(one, hours, WINDOW * ideal) for one in group]
        own = _lost_after(record, hours, WINDOW * ideal)
        others = (np.sum(lost, axis=0) - own) / (len(group) - 1)
        gained.append((others - own) / ideal)
    return gained


def _lost_after(record: Record, hours: FloatArray, window: float) -> FloatArray:
    """Return the cost of a play within `window` after each of the hours."""
    length = int(record.length[0])
    at = np.append(record.hour[:length], record.asked.max())
    cost = np.append(record.cost[:length], record.total[0])
    lost: FloatArray = np.interp(hours + window, at, cost) - np.interp(hours, at, cost)
    return lost
