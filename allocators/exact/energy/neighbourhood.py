"""Relaxation induced neighbourhood search: agents on whom a plan and a mixture of groups agree are fixed.

References
----------
Danna, Rothberg and Le Pape (2005), Exploring relaxation induced neighborhoods to improve MIP solutions,
doi:10.1007/s10107-004-0518-7.
"""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.exact.energy.energy_model import Mask
from alloc.allocators.exact.energy.state import EnergyState
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.allocators.exact.solver_model import Solver, SolverLimits, SolverModel
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True)
class Size:
    """Size of a neighbourhood.

    Attributes
    ----------
    agreed : float
        Difference in agents up to which plan and mixture agree on a pair of class and task, which is then fixed.
    least : float
        Agents of the mixture up to which a pair that the plan does not use is left out.
    """

    agreed: float
    least: float


SIZES = Size(0.15, 0.1), Size(0.15, 0.05), Size(0.1, 0.02), Size(0.05, 0.02), Size(0.03, 0.01), Size(1e-3, 1e-3)
"""Sizes of neighbourhoods in ascending order."""

FIRST_SIZE = 2
"""Index of the size of the first neighbourhood."""

FIRST_TRY, PAUSE, SHARE = 0.1, 0.05, 0.05
"""Shares of the stage's time before the first search of a neighbourhood, between a successful search and the next one,
and for one search at most."""

SHORT_S = 0.8
"""Length of the stage up to which no neighbourhood is searched, as building the solver's model takes time."""

PROVEN_GAP = 1e-6
"""Relative gap at which the search of a neighbourhood counts as complete."""


def induced_pairs(agent_class: IntArray, plan: IntArray, mixed: FloatArray, size: Size) -> Mask:
    """Return the pairs of class and task in the neighbourhood, shape (p,), those of the plan among them.

    Parameters
    ----------
    agent_class : ndarray of int, shape (p,)
    plan : ndarray of int, shape (p,)
        Agents of each pair in the plan.
    mixed : ndarray, shape (p,)
        Agents of each pair in the mixture.
    size : Size
    """
    has_agreed = np.bincount(agent_class, np.abs(plan - mixed) > size.agreed) == 0
    return np.asarray((plan > 0) | ((mixed > size.least) & ~has_agreed[agent_class]))


class InducedSearch:
    """Occasionally searches neighbourhoods of the best plan by a solver.

    After a complete search without a better plan the next neighbourhood is larger, after an incomplete one smaller; in
    both cases the pause is doubled.
    """

    def __init__(self) -> None:
        self._size, self._next_try, self._pause = FIRST_SIZE, FIRST_TRY, PAUSE

    def is_due(self, state: EnergyState) -> bool:
        """Whether enough time has passed since the last search."""
        return state.travel is None and state.stage_s > SHORT_S and state.progress >= self._next_try

    def turn(self, state: EnergyState, solver: Solver) -> None:
        """Search the neighbourhood of the best plan, and submit a better plan."""
        mixed = None if state.primal_dual is None else state.primal_dual.mixture
        if mixed is not None:
            known = state.cost
            cost, least = _search_induced(state, solver, mixed, SIZES[self._size])
            is_better, is_done = cost < known * (1 - PROVEN_GAP), least >= known * (1 - PROVEN_GAP)
            self._pause = PAUSE if is_better else 2 * self._pause
            if not is_better:
                self._size = int(np.clip(self._size + (1 if is_done else -1), 0, len(SIZES) - 1))
        self._next_try = state.progress + self._pause


def _search_induced(state: EnergyState, solver: Solver, mixed: FloatArray, size: Size) -> tuple[float, float]:
    """Return the cost of the best plan that the solver finds in a neighbourhood, and a lower bound there."""
    search, both = state.search, state.primal_dual
    assert search.best is not None
    plan = state.model.counts(state.demand, search.best.allocation)
    inside = induced_pairs(state.demand.class_of_pair, plan, mixed, size)
    demand = state.demand.only(np.flatnonzero(inside))
    cost = state.model.cost[state.model.pairs_at(demand)]
    seconds = SHARE * state.stage_s
    limits = SolverLimits.of(search, seconds, 1)
    until_s = min(state.until_s, search.elapsed_s + seconds)

    def meanwhile() -> bool:
        if both is not None and state.spare_threads:
            state.submit(both.run(min(1.0, state.progress), None))
        return False

    monitor = SolverMonitor(search, state.model, demand, until_s, meanwhile)
    answer = solver.solve_model(SolverModel(demand, cost, plan[inside], limits), monitor)
    search.iteration += 1
    if answer.counts is not None:
        search.submit(state.model.allocation(demand, answer.counts))
    state.submit(None)
    return np.inf if answer.counts is None else float(cost @ answer.counts), answer.bound
