"""Local search: two groups at a time share their agents out anew, until the budget ends."""

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search.improve import Parameters, improve
from alloc.allocators.heuristic.local_search.warm_up import warm_up
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Allocation, serve_all


class LocalSearch(Allocator):
    """Simulated annealing over exchanges, each of which is the best of exponentially many.

    An exchange takes the agents of two tasks, or of a task and the idle ones, and shares them out anew at the least
    price: the distance flown, a penalty for what either task lacks of what it needs by the makespan aimed at, and a
    random price per agent that falls as the run goes on. Which agents go where is decided exactly, by dynamic
    programming over sums of abilities where they are whole numbers, and else by trying all sets. An iteration is a
    thousand exchanges.

    References
    ----------
    Very large neighbourhoods: Ahuja, Ergun, Orlin and Punnen (2002), doi:10.1016/S0166-218X(01)00338-9. Random prices:
    Charon and Hudry (1993), the noising method, doi:10.1016/0167-6377(93)90023-A.
    """

    method = BUILT_IN["local-search"]
    parameters = Parameters()

    def __init__(self) -> None:
        warm_up()

    def allocate(self, search: Search) -> Proposal:
        """Improve the start, or else the greedy plan; every improvement has been submitted by then."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search), lambda: search.remaining_s))
        improve(search, parameters=self.parameters)
        return Proposal()
