"""Evolution of the linear part of the network and its last layer, from which PPO starts.

References
----------
Hansen and Ostermeier (2001), doi:10.1162/106365601750190398, as in DEAP (Fortin et al. 2012, JMLR 13:2171-2175).
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import torch
from deap import base, cma

from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum
from alloc.allocators.learned.missions.training.validation import validate
from alloc.allocators.learned.training.member import Weights
from alloc.allocators.parallel.engine import Engine
from alloc.problems.fields import FloatArray

STEP, FINE_STEP = 1.0, 0.3
"""Initial standard deviation of a weight, without and with an initial policy."""

EVOLVED = ("skip.weight", "out.weight")
"""Evolved weights: those of the features, and those of the last layer, whose inputs are fixed random functions."""

STATE = ("centroid", "sigma", "pc", "ps", "C", "diagD", "B", "BD", "update_count")
"""Attributes of DEAP's strategy that change from generation to generation."""


class _Fitness(base.Fitness):  # type: ignore[misc]
    weights = (-1.0,)


class _Rule(list[float]):
    """Evolved weights, as DEAP expects individuals."""

    def __init__(self, weights: list[float], cost: float) -> None:
        super().__init__(weights)
        self.fitness = _Fitness((cost,))


class RuleJob(NamedTuple):
    """A candidate and the missions on which it is evaluated, in a form that can be sent to another process."""

    network: Weights
    rule: list[float]
    curriculum: MissionCurriculum
    seed: int
    missions: int
    progress: float


def try_rule(job: RuleJob) -> float:
    """Return the cost of missions under a candidate; a pure function of the job."""
    network = MissionNetwork()
    network.load_state_dict(with_rule(job.network, job.rule))
    drawn = job.curriculum.draw(np.random.default_rng(job.seed), job.missions, job.progress)
    return validate(network, drawn).cost


def with_rule(network: Weights, rule: Sequence[float]) -> Weights:
    """Return the weights of a network with the evolved ones replaced."""
    parts = torch.tensor(list(rule), dtype=torch.float32).split([network[name].numel() for name in EVOLVED])
    return {**network, **{name: part[None] for name, part in zip(EVOLVED, parts, strict=True)}}


class Evolution:
    """The evolution of the weights of scores, generation by generation.

    Parameters
    ----------
    network : weights
        Weights of the initial network.
    population : int
        Number of candidates in a generation.
    missions : int
        Number of missions on which all candidates of a generation are compared.
    step : float
        Initial standard deviation of a weight.
    """

    def __init__(self, network: Weights, population: int, missions: int, step: float = STEP) -> None:
        self._network, self._population, self._missions = network, population, missions
        first = torch.cat([network[name][0] for name in EVOLVED]).double().numpy()
        self._strategy = cma.Strategy(centroid=first, sigma=step, lambda_=population)

    def advance(
        self, curriculum: MissionCurriculum, seed: int, progress: float, engine: Engine, should_stop: Callable[[], bool]
    ) -> Weights | None:
        """Return the network with the mean of the next generation; None if `should_stop` returned True before.

        Parameters
        ----------
        curriculum : MissionCurriculum
        seed : int
            Seed of all random numbers.
        progress : float
            Share of the training that is done, 0 to 1.
        engine : Engine
            Engine that evaluates the candidates.
        should_stop : callable
        """
        strategy, rng = self._strategy, np.random.default_rng(seed)
        # `Strategy.generate` would draw from the global generator
        steps = rng.standard_normal((self._population, strategy.dim)) @ strategy.BD.T
        rules = (strategy.centroid + strategy.sigma * steps).tolist()
        jobs = [RuleJob(self._network, rule, curriculum, seed, self._missions, progress) for rule in rules]
        tried = engine.map(try_rule, jobs, should_stop)
        if tried is None:
            return None
        strategy.update([_Rule(rule, cost) for rule, cost in zip(rules, tried, strict=True)])
        return with_rule(self._network, strategy.centroid.tolist())

    def state_dict(self) -> dict[str, torch.Tensor]:
        """Return the state that changes from generation to generation."""
        return {name: torch.tensor(value) for name, value in state_of(self._strategy).items()}

    def load_state_dict(self, state: dict[str, torch.Tensor]) -> None:
        """Restore what `state_dict` returned."""
        restore(self._strategy, {name: value.numpy() for name, value in state.items()})


def state_of(strategy: cma.Strategy) -> dict[str, FloatArray]:
    """Return the attributes of a strategy that change from generation to generation."""
    return {name: np.array(getattr(strategy, name)) for name in STATE}


def restore(strategy: cma.Strategy, state: Mapping[str, FloatArray]) -> None:
    """Restore what `state_of` returned."""
    for name in STATE:
        value = state[name]
        setattr(strategy, name, value if value.ndim else value.item())
