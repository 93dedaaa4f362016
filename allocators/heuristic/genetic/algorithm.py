"""A genetic algorithm over assignments, on DEAP's toolbox."""

from dataclasses import dataclass

import numpy as np
from deap import base, tools

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.genetic.operators import cross_groups, mutate, tournament
from alloc.allocators.heuristic.genetic.population import Genes, Landscape, list_schedules
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, Instance, Objective, serve_all
from alloc.problems.instance import FloatArray

AIMS = (0.0, 0.5, 0.8, 0.95)
"""Where the makespans that epochs aim at lie, between the lower bound (0) and the best so far (1)."""


MOST_AGENTS = 200_000
"""Agents beyond which a generation takes longer than a run may overrun its time limit."""

MOST_PAIRS = 20_000_000
"""Pairs of starting place and task beyond which the table of distances takes longer than that."""


@dataclass(frozen=True)
class Parameters:
    """Of the genetic algorithm; chosen on the paper's scenarios and on hard instances with 2 to 4 agents a task.

    Attributes
    ----------
    genes : int
        Genes and tasks in a whole population, which keeps a generation below a tenth of a second.
    least, most : int
        Bounds on the size of the population.
    crossover : float
        Probability that a child has two parents.
    share : float
        Largest share of the groups that a child takes from the second parent.
    patience : int
        Generations without a better individual after which a new epoch begins.
    noise, nearness : float
        Largest disorder, and largest say of a mean distance, in the list schedules that a population begins with.
    """

    genes: int = 24_000
    least: int = 16
    most: int = 100
    crossover: float = 0.5
    share: float = 0.3
    patience: int = 400
    noise: float = 0.5
    nearness: float = 2.0

    def size(self, landscape: Landscape) -> int:
        """Return the size of the population."""
        return int(np.clip(self.genes // (landscape.n + landscape.bench), self.least, self.most))


class Fitness(base.Fitness):  # type: ignore[misc]
    """Fewest unserved tasks, least shortfall at the makespan aimed at, least makespan, least energy: in this order.

    The shortfall tells how far all tasks are from the aim together, where the makespan tells of the worst alone. Among
    individuals that meet the aim, only the order of the project is left.
    """

    weights = (-1.0, -1.0, -1.0, -1.0)


class Individual:
    """Genes of one allocation, what they are worth, and `kin`: what all individuals have in common that rank alike."""

    def __init__(self, genes: Genes, values: tuple[float, ...], kin: int) -> None:
        self.genes, self.kin = genes, kin
        self.fitness = Fitness(values)

    @property
    def rank(self) -> tuple[float, ...]:
        """Unserved tasks, makespan and energy, as the project compares them."""
        unserved, _, makespan, energy = self.fitness.values
        return unserved, makespan, energy


class GeneticAlgorithm(Allocator):
    """Evolve whole assignments by selection, crossover of groups and mutation by exchange, and nothing else.

    Elitist without duplicates, and begun afresh around the best when nothing improves any more, as in CHC (Eshelman
    1991, doi:10.1016/B978-0-08-050684-5.50020-3); each new epoch aims at another makespan between the lower bound and
    the best. An iteration is a generation. It begins with list schedules (that of `greedy` among them), and has no
    local search: a child enters the population as crossover and mutation made it, or not at all.

    References
    ----------
    Fortin et al. (2012), DEAP, JMLR 13:2171-2175; Falkenauer (1994), doi:10.1162/evco.1994.2.2.123.
    """

    method = BUILT_IN["ga"]
    parameters = Parameters()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse what would take most of a usual time limit only to be looked at once."""
        if instance.n > MOST_AGENTS:
            return f"it takes {MOST_AGENTS} agents, this has {instance.n}; use greedy"
        pairs = instance.reach.pairs
        by_place = objective is Objective.MAKESPAN_ENERGY or not instance.reach.is_complete
        if by_place and pairs > MOST_PAIRS:
            return f"it takes {MOST_PAIRS} pairs of starting place and task, this has {pairs}; use greedy"
        return None

    def allocate(self, search: Search) -> Proposal:
        """Evolve until the search says stop; every improvement has been submitted by then."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search)))
        assert search.best is not None
        if search.best.evaluation.served_makespan == 0:  # no task that takes time can be served
            return Proposal(Allocation.idle(instance))
        landscape, epoch = Landscape(instance), 0
        rng = np.random.default_rng(search.seed)
        while not search.should_stop():
            evolution = Evolution(search, landscape, self.parameters, rng, _aim(search, epoch))
            evolution.run()
            epoch += 1
        return Proposal()


def _aim(search: Search, epoch: int) -> float:
    """Return the makespan that an epoch aims at, in hours."""
    assert search.best is not None
    best = search.best.evaluation.served_makespan
    bound = min(search.lower_bound, best)
    return max(bound + AIMS[epoch % len(AIMS)] * (best - bound), np.finfo(float).tiny)


class Evolution:
    """One epoch: a population that evolves towards one makespan until nothing improves any more.

    Parameters
    ----------
    search : Search
    landscape : Landscape
    parameters : Parameters
    rng : Generator
    aim : float
        Makespan in hours that the shortfall is measured against.
    """

    def __init__(
        self, search: Search, landscape: Landscape, parameters: Parameters, rng: np.random.Generator, aim: float
    ) -> None:
        self.search, self.landscape, self.parameters, self.rng, self.aim = search, landscape, parameters, rng, aim
        self.size = parameters.size(landscape)
        self.economical = search.objective is Objective.MAKESPAN_ENERGY
        self.toolbox = base.Toolbox()
        self.toolbox.register("select", tournament, rng=rng)
        self.toolbox.register("mate", cross_groups, rng=rng)
        self.toolbox.register("mutate", mutate, aim=aim, landscape=landscape, rng=rng, economical=self.economical)
        self.toolbox.register("survive", tools.selBest, k=self.size)

    def run(self) -> None:
        """Evolve for as long as individuals get better every now and then."""
        population = self._survivors(self._judge(self._first()))
        best, stale = population[0].fitness, 0
        while stale < self.parameters.patience and not self.search.should_stop():
            population = self._survivors(population + self._judge(self._offspring(population)))
            stale = 0 if population[0].fitness > best else stale + 1
            best = population[0].fitness
            self.search.iteration += 1

    def _first(self) -> Genes:
        """Begin with the best so far, the start if there is one, and noisy list schedules."""
        search, landscape, rng = self.search, self.landscape, self.rng
        assert search.best is not None
        known = [allocation for allocation in (search.best.allocation, search.start) if allocation is not None]
        rows = self.size - len(known)
        noise = self.parameters.noise * rng.random(rows)
        nearness = self.parameters.nearness * rng.random(rows) ** 2 * self.economical
        fresh = list_schedules(landscape, noise, nearness, rng, search.should_stop)
        return np.concatenate([np.stack([landscape.encode(allocation) for allocation in known]), fresh])

    def _offspring(self, population: list[Individual]) -> Genes:
        """Return as many children as there are places."""
        toolbox, rng = self.toolbox, self.rng
        genes = np.stack([individual.genes for individual in population])
        parents = toolbox.select(len(population), self.size)
        children: Genes = genes[parents]  # indexing by a list of rows clones them
        mated = np.flatnonzero(rng.random(self.size) < self.parameters.crossover)
        if len(mated):
            partners = genes[toolbox.select(len(population), len(mated))]
            share = self.parameters.share * rng.random(len(mated))
            children[mated] = toolbox.mate(children[mated], partners, share)
        mutated: Genes = toolbox.mutate(children)
        return mutated

    def _judge(self, genes: Genes) -> list[Individual]:
        """Give each row its fitness, all at once, and submit the best row if it is news."""
        figures = self.landscape.figures(genes, self.aim, self.economical)
        columns = (figures.unserved, figures.shortfall, figures.makespan, figures.energy)
        values = zip(*(column.tolist() for column in columns), strict=True)
        kin = _kin(figures.group, figures.energy)
        individuals = [Individual(*parts) for parts in zip(genes, values, kin, strict=True)]
        best = min(individuals, key=lambda individual: individual.rank)
        if self._is_news(best):
            self.search.submit(self.landscape.decode(best.genes))
        return individuals

    def _is_news(self, individual: Individual) -> bool:
        """Whether `Search.submit` may find it better than its best; it has the last word."""
        assert self.search.best is not None
        known = self.search.best.evaluation
        return individual.rank < (len(known.unserved_tasks), known.served_makespan, known.energy * self.economical)

    def _survivors(self, individuals: list[Individual]) -> list[Individual]:
        """Keep the best, best first, and only the first of those that are alike in all that counts."""
        unique = {individual.kin: individual for individual in reversed(individuals)}
        survivors: list[Individual] = self.toolbox.survive(list(unique.values()))
        return survivors


def _kin(group: FloatArray, energy: FloatArray) -> list[int]:
    """Number rows such that those with the same group abilities and energy have the same number."""
    return [hash((row.tobytes(), cost)) for row, cost in zip(group, energy.tolist(), strict=True)]
