"""One epoch of the genetic algorithm, with DEAP's toolbox: a population evolves towards one target makespan."""

import math
from dataclasses import dataclass

import numpy as np
from deap import base, tools

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.genetic.encoding import Encoding, Genes
from alloc.allocators.heuristic.genetic.list_schedules import list_schedules
from alloc.allocators.heuristic.genetic.mutation import mutate
from alloc.allocators.heuristic.genetic.operators import cross_groups, tournament
from alloc.problems import Allocation, Objective
from alloc.problems.instance import FloatArray


@dataclass(frozen=True)
class GeneticParameters(CheckedParameters):
    """Parameters of the genetic algorithm, tuned on the paper's scenarios and on hard ones of 2 to 4 agents per task.

    Attributes
    ----------
    population : int or None
        Number of individuals; None for as many as `population_genes` allows, between `smallest` and `largest`.
    population_genes : int
        Total number of genes and tasks in a population, which keeps a generation below a tenth of a second.
    smallest, largest : int
        Limits on the number of individuals if `population` is None.
    crossover : float
        Probability that a child has two parents.
    crossover_share : float
        Largest share of the groups that a child takes from the second parent.
    patience : int
        Number of generations without a better individual after which a new epoch begins.
    initial_noise, initial_distance_weight : float
        Largest noise on abilities, and largest weight of the mean distance, in the initial list schedules.
    """

    population: int | None = bounded(None, low=4)
    population_genes: int = bounded(24_000, low=1)
    smallest: int = bounded(16, low=4)
    largest: int = bounded(100, low=4)
    crossover: float = bounded(0.5, low=0, high=1)
    crossover_share: float = bounded(0.3, low=0, high=1)
    patience: int = bounded(400, low=1)
    initial_noise: float = bounded(0.5, low=0)
    initial_distance_weight: float = bounded(2.0, low=0)

    def population_size(self, encoding: Encoding) -> int:
        """Return the number of individuals."""
        if self.population is not None:
            return self.population
        return int(np.clip(self.population_genes // (encoding.n + encoding.idle), self.smallest, self.largest))


class Fitness(base.Fitness):  # type: ignore[misc]
    """Lexicographic fitness: unserved tasks, shortfall at the target makespan, makespan, and energy.

    The shortfall measures how far all tasks together are from the target, whereas the makespan depends only on the
    worst task. Individuals that meet the target are compared by the objective of the instance.
    """

    weights = (-1.0, -1.0, -1.0, -1.0)


class Individual:
    """Genes of an allocation, its fitness, and a fingerprint that is the same for individuals with equal objectives."""

    def __init__(self, genes: Genes, values: tuple[float, ...], fingerprint: int) -> None:
        self.genes, self.fingerprint = genes, fingerprint
        self.fitness = Fitness(values)

    @property
    def rank(self) -> tuple[float, ...]:
        """Unserved tasks, makespan and energy, for comparison by the objective of the instance."""
        unserved, _, makespan, energy = self.fitness.values
        return unserved, makespan, energy


class Evolution:
    """One epoch: a population that evolves towards one target makespan until it no longer improves.

    Parameters
    ----------
    search : Search
    encoding : Encoding
    parameters : GeneticParameters
    rng : Generator
    target_makespan : float
        In hours.
    """

    def __init__(
        self,
        search: Search,
        encoding: Encoding,
        parameters: GeneticParameters,
        rng: np.random.Generator,
        target_makespan: float,
    ) -> None:
        self.search, self.encoding, self.parameters, self.rng = search, encoding, parameters, rng
        self.target_makespan = target_makespan
        self._population: list[Individual] = []
        self._stagnation = 0
        self.size = parameters.population_size(encoding)
        self.energy_counts = search.objective is Objective.MAKESPAN_ENERGY
        self.toolbox = base.Toolbox()
        self.toolbox.register("select", tournament, rng=rng)
        self.toolbox.register("mate", cross_groups, rng=rng)
        self.toolbox.register(
            "mutate",
            mutate,
            target_makespan=target_makespan,
            encoding=encoding,
            rng=rng,
            energy_counts=self.energy_counts,
        )
        self.toolbox.register("survive", tools.selBest, k=self.size)

    @property
    def is_over(self) -> bool:
        """Whether there has been no better individual for `patience` generations."""
        return self._stagnation >= self.parameters.patience

    def run(self, generations: float = math.inf) -> int:
        """Evolve for up to `generations`, until the epoch is over or the search should stop; return the number done."""
        if not self._population:
            self._population = self._survivors(self._evaluated(self._initial_genes()))
        done = 0
        while done < generations and not self.is_over and not self.search.should_stop():
            self._select(self._offspring(self._population))
            self.search.iteration += 1
            done += 1
        return done

    def receive(self, allocation: Allocation) -> None:
        """Let an allocation compete with the population."""
        if self._population:
            self._select(self.encoding.encode(allocation)[None, :])

    def _select(self, genes: Genes) -> None:
        """Keep the best of the population and the given rows of genes."""
        best = self._population[0].fitness
        self._population = self._survivors(self._population + self._evaluated(genes))
        self._stagnation = 0 if self._population[0].fitness > best else self._stagnation + 1

    def _initial_genes(self) -> Genes:
        """Return the best allocation so far, the start if there is one, and noisy list schedules."""
        search, encoding, rng = self.search, self.encoding, self.rng
        assert search.best is not None
        known = [allocation for allocation in (search.best.allocation, search.start) if allocation is not None]
        rows = self.size - len(known)
        noise = self.parameters.initial_noise * rng.random(rows)
        distance_weight = self.parameters.initial_distance_weight * rng.random(rows) ** 2 * self.energy_counts
        fresh = list_schedules(encoding, noise, distance_weight, rng, search.should_stop)
        return np.concatenate([np.stack([encoding.encode(allocation) for allocation in known]), fresh])

    def _offspring(self, population: list[Individual]) -> Genes:
        """Return as many children as the size of the population."""
        toolbox, rng = self.toolbox, self.rng
        genes = np.stack([individual.genes for individual in population])
        parents = toolbox.select(len(population), self.size)
        children: Genes = genes[parents]  # indexing by a list of rows clones them
        mated = np.flatnonzero(rng.random(self.size) < self.parameters.crossover)
        if len(mated):
            partners = genes[toolbox.select(len(population), len(mated))]
            share = self.parameters.crossover_share * rng.random(len(mated))
            children[mated] = toolbox.mate(children[mated], partners, share)
        mutated: Genes = toolbox.mutate(children)
        return mutated

    def _evaluated(self, genes: Genes) -> list[Individual]:
        """Return the individuals of all rows with their fitness, and submit the best if it may be an improvement."""
        found = self.encoding.objectives(genes, self.target_makespan, self.energy_counts)
        columns = (found.unserved, found.shortfall, found.makespan, found.energy)
        values = zip(*(column.tolist() for column in columns), strict=True)
        fingerprints = _fingerprints(found.group_ability, found.energy)
        individuals = [Individual(*parts) for parts in zip(genes, values, fingerprints, strict=True)]
        best = min(individuals, key=lambda individual: individual.rank)
        if self._may_improve(best):
            self.search.submit(self.encoding.decode(best.genes))
        return individuals

    def _may_improve(self, individual: Individual) -> bool:
        """Return whether `Search.submit` may accept it as the best."""
        assert self.search.best is not None
        known = self.search.best.evaluation
        energy = known.energy * self.energy_counts
        return individual.rank < (len(known.unserved_tasks), known.served_makespan, energy)

    def _survivors(self, individuals: list[Individual]) -> list[Individual]:
        """Return the best individuals, best first, keeping only the first of those with equal fingerprints."""
        unique = {individual.fingerprint: individual for individual in reversed(individuals)}
        survivors: list[Individual] = self.toolbox.survive(list(unique.values()))
        return survivors


def _fingerprints(group_ability: FloatArray, energy: FloatArray) -> list[int]:
    """Return a number for each row, which is the same for rows with the same group abilities and energy."""
    return [hash((row.tobytes(), cost)) for row, cost in zip(group_ability, energy.tolist(), strict=True)]
