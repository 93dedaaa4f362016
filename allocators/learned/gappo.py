"""A population of actor-critics, bred by a genetic algorithm with DEAP's operators.

References
----------
Fang et al. (2025), Algorithm 1 and equation (12), doi:10.20944/preprints202502.0192.v1; Fortin et al. (2012),
JMLR 13:2171-2175 (DEAP). Unlike Algorithm 1, which evolves only after all training, generations and gradient steps
alternate here, as in population-based training (Jaderberg et al. 2017, arXiv:1711.09846).
"""

import copy
import random
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from deap import base, tools

from alloc.allocators.learned.hyperparameters import BreedingParameters, GappoParameters
from alloc.allocators.learned.ppo import Ppo

__all__ = ["BreedingParameters", "GappoParameters", "Member", "Ppo", "breed", "fitness"]

Member = dict[str, Any]
"""State of a learner by PPO, as `Learner.state` returns it: of its parts, breeding changes `network`, the weights by
name, and the step size in `optimiser`."""


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (1.0,)


class _Genome(list):  # type: ignore[type-arg]
    """All weights of a network, as DEAP's operators want them."""

    def __init__(self, weights: Sequence[float], number: int, fitness: float) -> None:
        super().__init__(weights)
        self.number = number
        self.fitness = _Fitness((fitness,))


def fitness(
    returns: Sequence[float], entropies: Sequence[float], evaluations: Sequence[int], parameters: BreedingParameters
) -> list[float]:
    """Equation (12): returns and entropies count for a member, its cost against it, each over the largest.

    Parameters
    ----------
    returns : sequence of float
        Cumulative reward of each member on the validation games.
    entropies : sequence of float
        Mean entropy of each policy.
    evaluations : sequence of int
        Network evaluations that each member spent, the cost E_i.
    """
    terms = (
        (parameters.return_weight, returns),
        (parameters.entropy_weight, entropies),
        (-parameters.cost_weight, evaluations),
    )
    total = np.zeros(len(returns))
    for weight, values in terms:
        scores = np.asarray(values, dtype=float)
        total += weight * scores / max(float(np.abs(scores).max()), 1e-12)
    return [float(value) for value in total]


def breed(
    members: Sequence[Member], scores: Sequence[float], parameters: BreedingParameters, seed: int
) -> list[Member]:
    """Return the next generation: the elite, and children of tournament winners by crossover and mutation."""
    genomes = [
        _Genome(_weights(member["network"]).tolist(), number, score)
        for number, (member, score) in enumerate(zip(members, scores, strict=True))
    ]
    unchanged = min(parameters.elite, max(1, len(genomes) - 1))  # of two or more, one at least is a child
    elite = tools.selBest(genomes, unchanged)
    following = [members[genome.number] for genome in elite]
    with _seeded(seed):
        while len(following) < len(members):
            mother, father = tools.selTournament(genomes, 2, parameters.tournament)
            following.append(_child(members[mother.number], mother, father, parameters))
    return following


def _child(parent: Member, mother: _Genome, father: _Genome, parameters: BreedingParameters) -> Member:
    """Return a child with the optimiser and the replay buffer of its mother, the parent."""
    genome = copy.deepcopy(mother)
    if random.random() < parameters.crossover_probability:
        genome, _ = tools.cxBlend(genome, copy.deepcopy(father), alpha=0.0)
    factor = 1.0
    if random.random() < parameters.mutation_probability:
        (genome,) = tools.mutGaussian(genome, 0.0, parameters.mutation_size, parameters.mutated_share)
        factor = random.choice((0.8, 1.25))
    child = copy.deepcopy(parent)
    for group in child["optimiser"]["param_groups"]:
        group["lr"] *= factor
    child["network"] = _named(torch.tensor(list(genome)), child["network"])
    return child


def _weights(network: dict[str, torch.Tensor]) -> torch.Tensor:
    """All weights of a network in one row."""
    return torch.cat([weight.detach().flatten() for weight in network.values()])


def _named(weights: torch.Tensor, like: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Undo `_weights`, with the names and shapes of `like`; each tensor has memory of its own."""
    rows = weights.split([weight.numel() for weight in like.values()])
    return {name: row.view_as(old).clone() for (name, old), row in zip(like.items(), rows, strict=True)}


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """DEAP draws from the global generator: seed it, and give it back as it was."""
    before = random.getstate()
    random.seed(seed)
    try:
        yield
    finally:
        random.setstate(before)
