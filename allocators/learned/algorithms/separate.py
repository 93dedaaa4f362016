"""GAPPO whose members share only the replay buffer: literally Algorithm 1, with a separate network for each member.

For an ablation of sharing: `GeneticPpo` has the same initial members, turns, buffer and generations.
"""

import copy

import torch

from alloc.allocators.learned.algorithms.gappo import breed
from alloc.allocators.learned.algorithms.genes import GeneticPpo
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo, Update
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.problems.game import Board, Rules


class SeparateMembers(GeneticPpo):
    """A learner by PPO of `GappoParameters.genes` members, each with its own network and step size; see `GeneticPpo`.

    Initially they equal the members of `GeneticPpo`; from then on, all their weights are separate, and are bred like
    those of a population in `train`.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : GappoParameters or PpoParameters, optional
    seed : int
        Seed of the initial weights and genes.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: PpoParameters | None = None, seed: int = 0) -> None:
        super().__init__(size, parameters, seed)
        self.members: list[Ppo] = []
        for network in super().policies():
            member = Ppo(size, self.parameters, seed)
            member.network.load_state_dict(network.state_dict())
            member.replay = self.replay
            self.members.append(member)

    @property
    def policy(self) -> ActorCritic:
        """The network of the fittest member."""
        return self.members[0].network

    @property
    def learning_rate(self) -> float:
        """Learning rate of the fittest member."""
        return self.members[0].learning_rate

    def policies(self) -> list[ActorCritic]:
        """Return each member's network, fittest first."""
        return [member.network for member in self.members]

    def _turn(
        self, member: int, board: Board, steps: int, rules: Rules, generator: torch.Generator, max_rate: float
    ) -> list[Update]:
        return self.members[member].learn(board, steps, rules, generator, max_rate)

    def _breed(self, seed: int) -> None:
        """Replace weights and step sizes by those of the next generation, fittest first."""
        parameters = BreedingParameters()
        self._load(breed(self._members(), self._fitness(parameters), parameters, seed))

    def _members(self) -> list[StateDict]:
        """Return weights and optimiser of each member, without the shared buffer."""
        return [
            {"network": member.network.state_dict(), "optimiser": member.optimiser.state_dict()}
            for member in self.members
        ]

    def _load(self, states: list[StateDict]) -> None:
        for member, state in zip(self.members, copy.deepcopy(states), strict=True):
            member.network.load_state_dict(state["network"])
            member.optimiser.load_state_dict(state["optimiser"])

    def state_dict(self) -> StateDict:
        """Return weights and optimiser of each member, and the replay buffer."""
        since = [tuple(one) for one in self.since]
        return {"members": self._members(), "replay": self.replay.state_dict(), "since": since}

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        self._load(state["members"])
        self.replay.load_state_dict(state["replay"])
        self.since = [Update(*one) for one in state["since"]]
