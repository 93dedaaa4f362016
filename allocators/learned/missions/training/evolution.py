"""The linear part of the network, evolved: where PPO begins.

References
----------
Hansen and Ostermeier (2001), doi:10.1162/106365601750190398, as in DEAP (Fortin et al. 2012, JMLR 13:2171-2175).
"""

from collections.abc import Callable

import numpy as np
import torch
from deap import base, cma

from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum
from alloc.allocators.learned.missions.training.validation import validate

STEP = 1.0
"""Initial standard deviation of a weight."""


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0,)


class _Rule(list[float]):
    """Linear weights, as DEAP expects individuals."""

    def __init__(self, weights: list[float], cost: float) -> None:
        super().__init__(weights)
        self.fitness = _Fitness((cost,))


def evolve(
    network: MissionNetwork,
    curriculum: MissionCurriculum,
    seed: int,
    generations: int,
    *,
    population: int = 16,
    missions: int = 12,
    on_generation: Callable[[int, float], None] = lambda generation, cost: None,
) -> None:
    """Evolve the linear weights of a network in place, by the cost of missions that it leads.

    Parameters
    ----------
    network : MissionNetwork
    curriculum : MissionCurriculum
    seed : int
        Of all random numbers.
    generations : int
    population : int
        Candidates in a generation.
    missions : int
        On which all candidates of a generation are compared.
    on_generation : callable
        Called with the number of each generation and the mean cost of its candidates.
    """
    rng = np.random.default_rng(seed)
    first = network.skip.weight.detach().numpy()[0].astype(np.float64)
    strategy = cma.Strategy(centroid=first, sigma=STEP, lambda_=population)
    for generation in range(1, generations + 1):
        drawn = curriculum.draw(rng, missions, generation / generations)
        steps = (
            rng.standard_normal((population, len(first))) @ strategy.BD.T
        )  # `generate` draws from a global generator
        rules = []
        for weights in strategy.centroid + strategy.sigma * steps:
            _set(network, weights)
            rules.append(_Rule(weights.tolist(), validate(network, drawn).cost))
        on_generation(generation, float(np.mean([rule.fitness.values[0] for rule in rules])))
        strategy.update(rules)
    _set(network, strategy.centroid)


@torch.no_grad()
def _set(network: MissionNetwork, weights: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> None:
    network.skip.weight.copy_(torch.from_numpy(weights).float()[None])
