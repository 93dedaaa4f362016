"""The method `local-search`: simulated annealing over exchanges between two groups, until the budget ends."""

from typing import ClassVar

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.parameters import with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search.annealing_state import compile_loops
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.allocators.heuristic.task_prices.start import compile_loops as compile_prices
from alloc.allocators.heuristic.task_prices.start import plan_by_prices
from alloc.allocators.heuristic.task_prices.use import are_prices_used
from alloc.problems import Allocation, Instance, serve_all


class LocalSearch(Allocator):
    """Simulated annealing in a very large neighbourhood.

    An exchange reassigns the agents of two tasks, or of one task and the idle agents, at the least cost: the distance,
    plus a penalty on the shortfalls of both tasks at the target makespan, plus random noise per agent that decreases
    during the run. The assignment is exact: by dynamic programming over sums of abilities if these are integers, else
    by enumeration of subsets. An iteration is a thousand exchanges. With thousands of agents, the search begins with
    prices of tasks, which give a bound and a plan near it.

    Parameters
    ----------
    parameters : LocalSearchParameters, optional
    **settings
        Fields of `LocalSearchParameters`, such as ``exchanges``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a setting is unknown or out of range.

    References
    ----------
    Very large neighbourhoods: Ahuja, Ergun, Orlin and Punnen (2002), doi:10.1016/S0166-218X(01)00338-9. Noise on
    costs: Charon and Hudry (1993), doi:10.1016/0167-6377(93)90023-A.
    """

    method = BUILT_IN["local-search"]
    parameters_type: ClassVar[type] = LocalSearchParameters

    def __init__(self, parameters: LocalSearchParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(LocalSearchParameters, parameters, settings)
        compile_loops()

    def prepare(self, instance: Instance) -> None:
        """Compile the loops of task prices if these are used."""
        if are_prices_used(instance):
            compile_prices()

    def allocate(self, search: Search) -> Proposal:
        """Improve the better of the start and the greedy allocation, and submit every improvement."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search), lambda: search.remaining_s))
        improve(search, priced=plan_by_prices(search), parameters=self.parameters)
        return Proposal()
