"""GAPPO's genetic algorithm: a population of learners by PPO, bred with DEAP's operators.

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
from typing import NamedTuple

import numpy as np
import torch
from deap import base, tools

from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters
from alloc.allocators.learned.network.state_dict import StateDict

LEARNING_RATE_FACTORS = (0.8, 1.25)
"""Factors by which a mutation changes the learning rate."""


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (1.0,)


class _Genome(list[float]):
    """All weights of a network in one list, as DEAP's operators expect, and the index of its member."""

    def __init__(self, weights: Sequence[float], member: int, fitness: float) -> None:
        super().__init__(weights)
        self.member = member
        self.fitness = _Fitness((fitness,))


def fitness(
    returns: Sequence[float], entropies: Sequence[float], evaluations: Sequence[float], parameters: BreedingParameters
) -> list[float]:
    """Return the fitness (12) of each member; each term is divided by its largest magnitude in the population.

    Parameters
    ----------
    returns : sequence of float
        Cumulative reward of each member on the validation games.
    entropies : sequence of float
        Mean entropy of each policy in nats.
    evaluations : sequence of float
        Network evaluations of each member, which are the cost E_i.
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
    members: Sequence[StateDict], scores: Sequence[float], parameters: BreedingParameters, seed: int
) -> list[StateDict]:
    """Return the next generation: the elite, and children of tournament winners by crossover and mutation.

    Parameters
    ----------
    members : sequence of StateDict
        States of learners by PPO, as `Learner.state_dict` returns them; breeding changes the weights, ``network``, and
        the learning rate in ``optimiser``.
    scores : sequence of float
        Fitness of each member.
    parameters : BreedingParameters
    seed : int
    """
    flat = [_flat_weights(member["network"]).tolist() for member in members]
    return [
        members[one.parent] if one.genome is None else _child(members[one.parent], one)
        for one in offspring(flat, scores, parameters, random.Random(seed))
    ]


class Offspring(NamedTuple):
    """A member of the next generation.

    Attributes
    ----------
    parent : int
        Index of its first parent.
    genome : list of float or None
        Its weights; None if it is the unchanged parent.
    rate_factor : float
        Factor on the parent's learning rate.
    """

    parent: int
    genome: list[float] | None = None
    rate_factor: float = 1.0


def offspring(
    genomes: Sequence[list[float]], scores: Sequence[float], parameters: BreedingParameters, rng: random.Random
) -> list[Offspring]:
    """Return the next generation of the same size, best first: the elite, and children of tournament winners."""
    known = [_Genome(*one) for one in zip(genomes, range(len(genomes)), scores, strict=True)]
    unchanged = min(parameters.elite, max(1, len(known) - 1))  # at least one of several members is a child
    following = [Offspring(genome.member) for genome in tools.selBest(known, unchanged)]
    toolbox = _toolbox(parameters, rng)
    while len(following) < len(known):
        first, second = toolbox.select(known, 2)
        genome, factor = copy.deepcopy(first), 1.0
        if rng.random() < parameters.crossover_probability:
            genome, _ = toolbox.mate(genome, copy.deepcopy(second))
        if rng.random() < parameters.mutation_probability:
            (genome,) = toolbox.mutate(genome)
            factor = rng.choice(LEARNING_RATE_FACTORS)
        following.append(Offspring(first.member, list(genome), factor))
    return following


def _toolbox(parameters: BreedingParameters, rng: random.Random) -> base.Toolbox:
    """Return DEAP's tournament selection, blend crossover and Gaussian mutation, which draw from `rng`."""
    toolbox = base.Toolbox()
    toolbox.register("select", _with_generator(rng, tools.selTournament), tournsize=parameters.tournament_size)
    toolbox.register("mate", _with_generator(rng, tools.cxBlend), alpha=0.0)
    mutation = _with_generator(rng, tools.mutGaussian)
    toolbox.register("mutate", mutation, mu=0.0, sigma=parameters.mutation_sigma, indpb=parameters.mutated_fraction)
    return toolbox


def _with_generator(rng: random.Random, operator: FunctionType) -> Callable[..., object]:
    """Return an operator of DEAP bound to a copy of its module in which `random` is `rng`.

    DEAP draws from the global generator, which is shared by all threads and the embedding program.
    """
    module: dict[str, object] = {**operator.__globals__, "random": rng}
    for name, value in operator.__globals__.items():
        if isinstance(value, FunctionType) and value.__globals__ is operator.__globals__:
            module[name] = FunctionType(value.__code__, module, name, value.__defaults__, value.__closure__)
    bound = module[operator.__name__]
    assert callable(bound)
    return bound


def _child(parent: StateDict, born: Offspring) -> StateDict:
    """Return a child with the optimiser and the replay buffer of its first parent."""
    child = copy.deepcopy(parent)
    for group in child["optimiser"]["param_groups"]:
        group["lr"] *= born.rate_factor
    child["network"] = _named_weights(torch.tensor(born.genome), child["network"])
    return child


def _flat_weights(network: dict[str, torch.Tensor]) -> torch.Tensor:
    """Return all weights of a network in one vector."""
    return torch.cat([weight.detach().flatten() for weight in network.values()])


def _named_weights(weights: torch.Tensor, like: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Undo `_flat_weights`, with the names and shapes of `like`; each tensor has its own storage."""
    parts = weights.split([weight.numel() for weight in like.values()])
    return {name: part.view_as(old).clone() for (name, old), part in zip(like.items(), parts, strict=True)}
