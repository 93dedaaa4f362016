"""The method `ga`: a genetic algorithm over assignments."""

from typing import ClassVar

import numpy as np

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.parameters import with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.genetic.encoding import Encoding
from alloc.allocators.heuristic.genetic.evolution import GeneticParameters
from alloc.allocators.heuristic.genetic.islands import Island, evolve_islands
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Allocation, Instance, Objective, serve_all

MAX_AGENTS = 200_000
"""Number of agents above which a generation takes longer than a run may exceed its time limit."""

MAX_PAIRS = 20_000_000
"""Number of pairs of origin and task above which the table of distances takes longer than that."""


class GeneticAlgorithm(Allocator):
    """A genetic algorithm with crossover of groups and mutation by exchanges, without local search.

    The population is elitist and free of duplicates, and is restarted around the best individual upon stagnation, as
    in CHC (Eshelman 1991, doi:10.1016/B978-0-08-050684-5.50020-3); each epoch has a different target makespan between
    the lower bound and the best. An iteration is a generation. Initial populations are list schedules, including that
    of `greedy`. Each thread has its own population, and these exchange their best individuals; see `evolve_islands`.

    Parameters
    ----------
    parameters : GeneticParameters, optional
    **settings
        Fields of `GeneticParameters`, such as ``population``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a setting is unknown or out of range.

    References
    ----------
    Fortin et al. (2012), DEAP, JMLR 13:2171-2175; Falkenauer (1994), doi:10.1162/evco.1994.2.2.123.
    """

    method = BUILT_IN["ga"]
    parameters_type: ClassVar[type] = GeneticParameters

    def __init__(self, parameters: GeneticParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(GeneticParameters, parameters, settings)

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse instances for which a single generation would take most of a usual time limit."""
        if instance.n > MAX_AGENTS:
            return f"it handles at most {MAX_AGENTS} agents, not {instance.n}; use greedy"
        pairs = instance.reach.pairs
        by_place = objective is Objective.MAKESPAN_ENERGY or not instance.reach.is_complete
        if by_place and pairs > MAX_PAIRS:
            return f"it handles at most {MAX_PAIRS} pairs of starting place and task, not {pairs}; use greedy"
        return None

    def allocate(self, search: Search) -> Proposal:
        """Evolve until the search should stop, and submit every improvement."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search)))
        assert search.best is not None
        if search.best.evaluation.served_makespan == 0:  # no task with workload can be served
            return Proposal(Allocation.idle(instance))
        encoding = Encoding(instance)
        if search.threads > 1:
            evolve_islands(search, encoding, self.parameters)
        else:
            Island(search, encoding, self.parameters, np.random.default_rng(search.seed)).run()
        return Proposal()
