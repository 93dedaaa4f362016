"""The stages of the exact methods: an initial plan, the least makespan, then the least energy at it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.optimize
import scipy.sparse.csgraph  # noqa: F401 - both are loaded with the method, so that they do not delay a run

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.parameters import CheckedParameters, with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy import primal_dual
from alloc.allocators.exact.energy.least_energy import least_energy
from alloc.allocators.exact.energy.travel import search as travel_search
from alloc.allocators.exact.makespan import ascent, enumeration
from alloc.allocators.exact.makespan.bisection import least_makespan
from alloc.allocators.exact.makespan.repartition import search as repartition_search
from alloc.allocators.exact.monitor import is_over
from alloc.allocators.exact.plain.stages import PlainSolver, allocate_plain, refusal_of_plain
from alloc.allocators.exact.solver_model import Solver
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search import annealing_state
from alloc.problems import Instance, Objective, count_classes, fewest_unserved, serve_all

MAKESPAN_SHARE = 0.6
"""Share of the time limit after which the energy stage begins, whether the makespan is proven or not."""

PATIENCE = 2.0
"""The energy stage also begins after this multiple of the time until the fastest plan, without a faster one."""


@dataclass(frozen=True)
class ExactParameters(CheckedParameters):
    """Parameters of the exact methods.

    Attributes
    ----------
    descent : bool
        Whether to search for plans before the solver runs.
    plain : bool
        Whether to only run the solver, without heuristics or bounds of this package, on the model with a variable for
        each agent and task that ``alloc export --model plain`` writes.
    """

    descent: bool = True
    plain: bool = False


class ExactAllocator(Allocator):
    """Proves optima with a solver for integer programmes; subclasses name the solver.

    Parameters
    ----------
    parameters : ExactParameters, optional
    **settings
        Fields of `ExactParameters`, such as ``plain``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a parameter is unknown or of the wrong type.
    """

    solver: ClassVar[Solver]
    plain_solver: ClassVar[type[PlainSolver]]
    parameters_type: ClassVar[type] = ExactParameters

    def __init__(self, parameters: ExactParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(ExactParameters, parameters, settings)
        ascent.compile_loops()
        enumeration.compile_loops()
        repartition_search.compile_loops()
        primal_dual.compile_loops()
        travel_search.compile_loops()
        annealing_state.compile_loops()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse models that would take most of the time limit just to be built."""
        if self.parameters.plain:
            return refusal_of_plain(instance, self.solver.max_pairs)
        limit, per_second, seconds = self.solver.max_pairs, self.solver.pairs_per_second, budget.time_limit_s
        if seconds is not None:
            limit = min(limit, max(per_second // 4, int(per_second * seconds / 2)))
        pairs = count_pairs(instance, objective)
        if pairs <= limit:
            return None
        in_time = "" if seconds is None else f" within {seconds:g} s"
        return f"it takes {limit} pairs of agent class and task{in_time}, this has {pairs}"

    def allocate(self, search: Search) -> Proposal:
        """Return proven bounds; submit every plan found."""
        if self.parameters.plain:
            return allocate_plain(search, self.plain_solver)
        instance = search.instance
        search.submit(serve_all(instance, greedy(instance, search)))
        min_served = int((instance.workload > 0).sum()) - fewest_unserved(instance)
        if min_served == 0:
            return Proposal(energy_lower_bound=0.0)
        if search.objective is Objective.MAKESPAN:
            self._minimise_makespan(search, min_served, 1.0, np.inf)
            return Proposal()
        return Proposal(energy_lower_bound=self._minimise_both(search, min_served))

    def _minimise_both(self, search: Search, min_served: int) -> float | None:
        """Run both stages; repeat if the energy was proven early and the makespan stage had not used all its time."""
        bound: float | None = None
        patience = PATIENCE
        while True:
            complete = self._minimise_makespan(search, min_served, MAKESPAN_SHARE, patience)
            patience = np.inf
            found = None
            with search.improving("the search for the least energy"):
                found = least_energy(search, self.solver, min_served)
            bound = max((known for known in (bound, found) if known is not None), default=None)
            if found is None or complete or search.fast_enough or is_over(search):
                return bound  # bounds at a makespan also hold at smaller ones

    def _minimise_makespan(self, search: Search, min_served: int, share: float, patience: float) -> bool:
        """Run the makespan stage for at most a share of the time left; return whether more time would not help."""
        until_s = np.inf
        if search.budget.time_limit_s is not None:
            until_s = search.elapsed_s + share * search.remaining_s
        return least_makespan(search, self.solver, min_served, until_s, patience, descent=self.parameters.descent)


def count_pairs(instance: Instance, objective: Objective) -> int:
    """Return the number of pairs of agent class and task that the largest model for `objective` has."""
    classes = count_classes(instance, by_place=objective is Objective.MAKESPAN_ENERGY)
    return classes * int((instance.workload > 0).sum())
