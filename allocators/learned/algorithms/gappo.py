"""A population of actor-critics, bred by a genetic algorithm with DEAP's operators.

References
----------
Fang et al. (2025), Algorithm 1 and equation (12), doi:10.20944/preprints202502.0192.v1; Fortin et al. (2012),
JMLR 13:2171-2175 (DEAP). Unlike Algorithm 1, which evolves only after all training, generations and gradient steps
alternate here, as in population-based training (Jaderberg et al. 2017, arXiv:1711.09846).
"""

import copy
import random
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

import numpy as np
import torch
from deap import base, tools

from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, GappoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo

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
    rng = random.Random(seed)
    toolbox = _toolbox(parameters, rng)
    while len(following) < len(members):
        mother, father = toolbox.select(genomes, 2)
        following.append(_child(members[mother.number], mother, father, parameters, toolbox, rng))
    return following


def _toolbox(parameters: BreedingParameters, rng: random.Random) -> base.Toolbox:
    """Return DEAP's tournament, blend and Gaussian mutation, which draw from `rng`."""
    toolbox = base.Toolbox()
    toolbox.register("select", _drawing_from(rng, tools.selTournament), tournsize=parameters.tournament)
    toolbox.register("mate", _drawing_from(rng, tools.cxBlend), alpha=0.0)
    mutation = _drawing_from(rng, tools.mutGaussian)
    toolbox.register("mutate", mutation, mu=0.0, sigma=parameters.mutation_size, indpb=parameters.mutated_share)
    return toolbox


def _drawing_from(rng: random.Random, operator: FunctionType) -> Callable[..., Any]:
    """Return an operator of DEAP over a copy of its module, where `random` is `rng` and not the global generator.

    That generator is shared by all threads of the process, and with the program that this is part of.
    """
    module: dict[str, Any] = {**operator.__globals__, "random": rng}
    for name, thing in operator.__globals__.items():
        if isinstance(thing, FunctionType) and thing.__globals__ is operator.__globals__:
            module[name] = FunctionType(thing.__code__, module, name, thing.__defaults__, thing.__closure__)
    own: Callable[..., Any] = module[operator.__name__]
    return own


def _child(
    parent: Member,
    mother: _Genome,
    father: _Genome,
    parameters: BreedingParameters,
    toolbox: base.Toolbox,
    rng: random.Random,
) -> Member:
    """Return a child with the optimiser and the replay buffer of its mother, the parent."""
    genome = copy.deepcopy(mother)
    if rng.random() < parameters.crossover_probability:
        genome, _ = toolbox.mate(genome, copy.deepcopy(father))
    factor = 1.0
    if rng.random() < parameters.mutation_probability:
        (genome,) = toolbox.mutate(genome)
        factor = rng.choice((0.8, 1.25))
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
