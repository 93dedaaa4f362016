"""The recipe of the exact methods: a start, the least makespan, then the least energy at it."""

from abc import abstractmethod
from typing import ClassVar

import numpy as np
import scipy.optimize
import scipy.sparse.csgraph  # noqa: F401 - both are loaded with the method, so that no run waits for them

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy import narrowing
from alloc.allocators.exact.energy.least_energy import least_energy
from alloc.allocators.exact.makespan import enumeration
from alloc.allocators.exact.makespan import repartition_search as wandering
from alloc.allocators.exact.makespan.bisection import LeastMakespan
from alloc.allocators.exact.solver_model import Answer, Question, Watch, is_over
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Instance, Objective, count_classes, fewest_unserved, serve_all

MAKESPAN_SHARE = 0.6
"""Part of the time limit after which the makespan gives way to the energy, proven or not."""


class ExactAllocator(Allocator):
    """Proves optima with a solver for integer programmes; subclasses say how to ask it.

    Parameters
    ----------
    descent : bool
        Whether a descent looks for a plan before the solver is asked.

    Attributes
    ----------
    most_pairs : int
        Pairs of agent class and task beyond which no model is built.
    pairs_per_second : int
        Pairs of which a model is built in a second.
    """

    most_pairs: ClassVar[int]
    pairs_per_second: ClassVar[int]

    def __init__(self, *, descent: bool = True) -> None:
        self._descent = descent
        enumeration.compile_loops()
        wandering.compile_loops()
        narrowing.compile_loops()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse models that would take most of the time only to be built."""
        limit, seconds = self.most_pairs, budget.time_limit_s
        if seconds is not None:
            limit = min(limit, max(self.pairs_per_second // 4, int(self.pairs_per_second * seconds / 2)))
        pairs = count_pairs(instance, objective)
        if pairs <= limit:
            return None
        in_time = "" if seconds is None else f" within {seconds:g} s"
        return f"it takes {limit} pairs of agent class and task{in_time}, this has {pairs}"

    def allocate(self, search: Search) -> Proposal:
        """Return bounds; every plan on the way is submitted."""
        instance = search.instance
        search.submit(serve_all(instance, greedy(instance, search)))
        serve = int((instance.workload > 0).sum()) - fewest_unserved(instance)
        if serve == 0:
            return Proposal(energy_lower_bound=0.0)
        if search.objective is Objective.MAKESPAN:
            self._lessen_makespan(search, serve, 1.0)
            return Proposal()
        bound: float | None = None
        while True:  # again where the energy was settled early, and the makespan had not had all its time
            in_vain = self._lessen_makespan(search, serve, MAKESPAN_SHARE)
            found = None
            with search.improving("the search for the least energy"):
                found = least_energy(search, self.ask, serve)
            bound = max((known for known in (bound, found) if known is not None), default=None)
            if found is None or in_vain or search.fast_enough or is_over(search):
                return Proposal(energy_lower_bound=bound)  # what holds within a makespan holds within a lesser one

    def _lessen_makespan(self, search: Search, serve: int, share: float) -> bool:
        """Look for the least makespan within a share of the time left; whether more time would be of no use."""
        until_s = np.inf
        if search.budget.time_limit_s is not None:
            until_s = search.elapsed_s + share * search.remaining_s
        LeastMakespan(search, self.ask, serve, until_s, self.pairs_per_second, descent=self._descent).run()
        return search.elapsed_s < until_s

    @abstractmethod
    def ask(self, question: Question, watch: Watch) -> Answer:
        """Put `question` to the solver."""


def count_pairs(instance: Instance, objective: Objective) -> int:
    """Return the number of pairs of agent class and task that the largest model for `objective` has."""
    classes = count_classes(instance, by_place=objective is Objective.MAKESPAN_ENERGY)
    return classes * int((instance.workload > 0).sum())
