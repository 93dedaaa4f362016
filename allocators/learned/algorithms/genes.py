"""GAPPO with one network for its whole population, whose members differ only in their biases.

When trained from scratch, members with separate networks have to divide the games among them. Here all members train
the same weights, and each adds its gene, a vector, to the biases: a reference point for exploration, subject to
selection, crossover and mutation as in Algorithm 1. All members share a replay buffer, and learning from it is
corrected for the policy of the member that played.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1; for members that learn from each other
Singla et al. (2024), arXiv:2407.20230 (SAPG), and for genes of a shared network arXiv:2503.19037 (EPO).
"""

import random
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from alloc.allocators.learned.algorithms.gappo import fitness, offspring
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, GappoParameters, PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo, Update
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize, uninitialised
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.problems.game import Board, Rules


class Genes:
    """The vectors that the members add to the biases of their shared network.

    Parameters
    ----------
    network : ActorCritic
        The shared network; it initially expresses the first member's gene, which is 0.
    count : int
    sigma : float
        Standard deviation of the entries of the other genes.
    seed : int

    Attributes
    ----------
    vectors : Tensor, shape (count, number of biases)
    expressed : int
        The member whose gene is currently added to the network.
    """

    def __init__(self, network: ActorCritic, count: int, sigma: float, seed: int) -> None:
        self._biases = [weight for weight in network.parameters() if weight.dim() == 1]
        size = sum(weight.numel() for weight in self._biases)
        drawn = sigma * torch.randn(count - 1, size, generator=torch.Generator().manual_seed(seed))
        self.vectors = torch.cat([torch.zeros(1, size), drawn])
        self.expressed = 0

    @torch.no_grad()
    def express(self, member: int) -> None:
        """Add the gene of a member to the network, in place of that of the current member."""
        self._add(self.vectors[member] - self.vectors[self.expressed])
        self.expressed = member

    @torch.no_grad()
    def replace(self, vectors: Tensor) -> None:
        """Replace all genes, and express the first."""
        self._add(vectors[0] - self.vectors[self.expressed])
        self.vectors, self.expressed = vectors, 0

    def _add(self, change: Tensor) -> None:
        parts = change.split([weight.numel() for weight in self._biases])
        for weight, part in zip(self._biases, parts, strict=True):
            weight.add_(part)


class GeneticPpo(Ppo):
    """A learner by PPO of `GappoParameters.genes` members that share a network; see `Learner`.

    They take turns, with one update each. Their fitness (12) is measured in the games that they learn from, so that no
    games are needed for comparisons only. The policy is that of the fittest member.

    Parameters
    ----------
    size : NetworkSize, optional
    parameters : GappoParameters or PpoParameters, optional
        Those of PPO describe a single member.
    seed : int
        Seed of the initial weights and genes.
    """

    def __init__(self, size: NetworkSize | None = None, parameters: PpoParameters | None = None, seed: int = 0) -> None:
        parameters = parameters or GappoParameters()
        super().__init__(size, parameters, seed)
        self.population = parameters if isinstance(parameters, GappoParameters) else GappoParameters()
        self.genes = Genes(self.network, self.population.genes, self.population.gene_sigma, seed)
        self.since: list[Update] = []

    def policies(self) -> list[ActorCritic]:
        """Return a copy of each member's network, fittest first."""
        copies = []
        for member in range(self.population.genes):
            self.genes.express(member)
            one = uninitialised(self.network.size)
            one.load_state_dict(self.network.state_dict())
            copies.append(one)
        self.genes.express(0)
        return copies

    def learn(
        self, board: Board, steps: int, rules: Rules, generator: torch.Generator, max_rate: float
    ) -> list[Update]:
        """Let the member whose turn it is play and learn, and breed at the end of a generation; see `Ppo.learn`."""
        updates = self._turn(len(self.since) % self.population.genes, board, steps, rules, generator, max_rate)
        self.since += updates
        if len(self.since) >= max(self.population.breeding_interval, self.population.genes):
            if self.population.breeding_interval and self.population.genes > 1:
                self._breed(int(torch.randint(2**62, (1,), generator=generator)))
            self.since = []
        return updates

    def _turn(
        self, member: int, board: Board, steps: int, rules: Rules, generator: torch.Generator, max_rate: float
    ) -> list[Update]:
        """Let one member play and learn."""
        self.genes.express(member)
        updates = super().learn(board, steps, rules, generator, max_rate)
        self.genes.express(0)
        return updates

    def _breed(self, seed: int) -> None:
        """Replace the genes by those of the next generation, fittest first."""
        parameters = replace(BreedingParameters(), mutation_sigma=self.population.gene_sigma, mutated_fraction=1.0)
        old = self.genes.vectors
        born = offspring(old.tolist(), self._fitness(parameters), parameters, random.Random(seed))
        self.genes.replace(
            torch.stack([old[one.parent] if one.genome is None else torch.tensor(one.genome) for one in born])
        )

    def _fitness(self, parameters: BreedingParameters) -> list[float]:
        """Return the fitness (12) of each member in the updates since the last generation."""
        count = self.population.genes
        returns, entropies, evaluations = (
            [float(np.mean([getattr(one, name) for one in self.since[member::count]])) for member in range(count)]
            for name in ("reward", "entropy", "evaluations")
        )
        return fitness(returns, entropies, evaluations, parameters)

    def state_dict(self) -> StateDict:
        """Return weights with the fittest member's biases, optimiser, replay buffer and genes."""
        state = super().state_dict()
        if self.population.genes == 1:
            return state
        return {**state, "genes": self.genes.vectors, "since": [tuple(one) for one in self.since]}

    def load_state_dict(self, state: StateDict) -> None:
        """See `Learner.load_state_dict`."""
        super().load_state_dict(state)
        if self.population.genes > 1:
            self.genes.vectors, self.genes.expressed = state["genes"], 0
            self.since = [Update(*one) for one in state["since"]]
