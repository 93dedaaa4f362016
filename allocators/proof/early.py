"""Bounds before and during a run, if they are cheap relative to it; the run ends as soon as its plan meets them."""

from dataclasses import replace

from alloc.allocators.contract.base import Proposal
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN, relative_gap
from alloc.allocators.proof.groups import is_tiny, optimum
from alloc.problems import Instance, Objective, energy_lower_bound, lp_makespan_lower_bound
from alloc.problems.evaluation import last_equal

SHARE, MAX_TIME_S = 0.02, 0.1
"""Share of the time limit, and seconds, that a linear programme may take at most before or during the run."""

MAX_AGENTS = 5000
"""Maximum number of agents for bounding the makespan by a linear programme before the run."""

MAX_PAIRS = 500
"""Maximum number of agent-task pairs for bounding the energy by one; with more, plans hardly ever meet the bound."""


class EarlyProof:
    """Bounds on the least makespan and cost of a run, which ends as soon as its plan meets them.

    For tiny instances, both optima are computed by enumerating groups of agents. For others, the makespan bound is that
    of a linear programme, if not every agent can take every task, and the energy bound is one that plans often meet if
    each task needs one agent.

    Parameters
    ----------
    search : Search
        The run, at its beginning. Its bound is not raised if iterations are limited, as it influences the methods.

    Attributes
    ----------
    hours : float
        Lower bound on the makespan.
    """

    def __init__(self, search: Search) -> None:
        limit = search.budget.time_limit_s
        self._seconds = MAX_TIME_S if limit is None else min(MAX_TIME_S, SHARE * limit)
        self._within, self._cost = 0.0, 0.0
        self.hours = self._makespan_bound(search)
        if search.budget.iterations is None:
            search.raise_bound(self.hours)
        search.end_when(self._is_met)

    def _makespan_bound(self, search: Search) -> float:
        if is_tiny(search.instance):
            least = optimum(search.instance, search.tolerance)
            if least is None:
                return 0.0
            self._within, self._cost = least.within, least.cost
            return least.hours
        if search.budget.iterations is None and _is_restricted(search.instance):
            return lp_makespan_lower_bound(search.instance, self._seconds) or 0.0
        return 0.0

    def _is_met(self, search: Search) -> bool:
        """Return whether the best plan of the run is proven to be optimal."""
        best, fastest = search.best, search.fastest
        if best is None or fastest is None or fastest.evaluation.makespan is None:
            return False
        if not (search.fast_enough or relative_gap(fastest.evaluation.makespan, self.hours) <= PROVEN):
            return False
        if search.objective is Objective.MAKESPAN:
            return True
        limit = search.makespan_limit
        if limit > self._within and _has_few_pairs(search.instance):
            bound = energy_lower_bound(search.instance, limit, self._seconds)
            self._within, self._cost = last_equal(limit), bound or 0.0
        return relative_gap(best.evaluation.cost, self._bound(search)) <= PROVEN

    def _bound(self, search: Search) -> float:
        """Return the lower bound on the cost of plans within the makespan limit of the run."""
        return self._cost if search.makespan_limit <= self._within else 0.0

    def added_to(self, proposal: Proposal, search: Search) -> Proposal:
        """Return the proposal of a method with these bounds where they are tighter."""
        return replace(
            proposal,
            makespan_lower_bound=max(proposal.makespan_lower_bound or 0.0, self.hours),
            energy_lower_bound=max(proposal.energy_lower_bound or 0.0, self._bound(search)) or None,
        )


def needs_solver(instance: Instance, objective: Objective) -> bool:
    """Return whether a linear programme may be solved during the run, so that its solver should be loaded before."""
    energy = objective is Objective.MAKESPAN_ENERGY and _has_few_pairs(instance)
    return not is_tiny(instance) and (energy or _is_restricted(instance))


def _is_restricted(instance: Instance) -> bool:
    """Return whether there are few agents, no travel times, and not every agent can take every task."""
    return instance.n <= MAX_AGENTS and not instance.has_travel_time and not instance.reach.is_complete


def _has_few_pairs(instance: Instance) -> bool:
    return instance.n * instance.m <= MAX_PAIRS
