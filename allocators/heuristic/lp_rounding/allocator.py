"""The method `lp-round`: a linear relaxation over classes of agents, rounded by matching, repaired by local search."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.parameters import CheckedParameters, bounded, with_settings
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState, compile_loops
from alloc.allocators.heuristic.local_search.improve import improve
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.allocators.heuristic.lp_rounding.relaxation import Relaxation
from alloc.problems import Allocation, Instance, Objective, serve_all
from alloc.problems.bounds import LP_PAIRS_PER_SECOND, LP_SIZE_LIMIT

UNHURRIED_S = 10.0
"""Time limit in seconds that `LpRound.refusal` assumes if there is none."""


@dataclass(frozen=True)
class LpRoundParameters(CheckedParameters):
    """Parameters of the rounding, the repair, and the subsequent local search.

    Attributes
    ----------
    makespan_excess : tuple of float
        Target makespans, as relative excess over the least fractional makespan, tried in order until one is met.
    repair_iterations : int
        Maximum number of iterations of local search for each target.
    repair_noise, repair_final_noise : float
        First and last noise of the repair, relative to the mean distance to a candidate task; far below that of
        `local-search`, so that most of the rounded allocation is kept.
    initial_noise : float
        First noise of the local search in the rest of the budget, if energy counts.
    time_share : float
        Largest share of the remaining time that one linear programme may take.
    """

    makespan_excess: tuple[float, ...] = bounded((0.0, 0.001, 0.003, 0.01, 0.03), low=0)
    repair_iterations: int = bounded(60, low=0)
    repair_noise: float = bounded(0.03, low=0, above=True)
    repair_final_noise: float = bounded(0.007, low=0, above=True)
    initial_noise: float = bounded(0.09, low=0, above=True)
    time_share: float = bounded(0.4, low=0, high=1, above=True)


class LpRound(Allocator):
    """Linear relaxation, rounding and repair.

    A linear programme distributes fractions of agents so that the makespan is minimal; if energy counts, a second one
    minimises the distance within that makespan. Vertices have few fractional values, which are rounded by the matching
    of Shmoys and Tardos, so that no task loses more than one agent. Exchanges of the local search then repair
    shortfalls, at a slightly larger makespan if necessary, and use the rest of the budget. An iteration is one of the
    local search.

    Parameters
    ----------
    parameters : LpRoundParameters, optional
    **settings
        Fields of `LpRoundParameters`, such as ``repair_iterations``, in place of those of `parameters`.

    Raises
    ------
    InputError
        If a setting is unknown or out of range.

    References
    ----------
    Shmoys and Tardos (1993), doi:10.1007/BF01585178; Bezakova and Dani (2005), doi:10.1145/1120680.1120683.
    """

    method = BUILT_IN["lp-round"]
    parameters_type: ClassVar[type] = LpRoundParameters

    def __init__(self, parameters: LpRoundParameters | None = None, **settings: object) -> None:
        self.parameters = with_settings(LpRoundParameters, parameters, settings)
        compile_loops()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """Refuse linear programmes that do not fit into the budget, as they give no answer if stopped early."""
        seconds = UNHURRIED_S if budget.time_limit_s is None else max(1.0, budget.time_limit_s)
        most = min(LP_SIZE_LIMIT, int(LP_PAIRS_PER_SECOND * seconds))
        classes = len(np.unique(instance.ability)) * (len(instance.reach.place) if objective != "makespan" else 1)
        pairs = min(instance.n, classes) * instance.m if not instance.has_travel_time else instance.n * instance.m
        if pairs > most:
            return f"the linear programme has up to {pairs} pairs of agents and tasks; in this time it can solve {most}"
        return None

    def allocate(self, search: Search) -> Proposal:
        """Relax, round and repair, then improve until the search should stop; submit every improvement."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search)))
        if search.should_stop():
            return Proposal()
        energy_counts = search.objective is Objective.MAKESPAN_ENERGY
        relaxation = Relaxation(instance, by_place=energy_counts, time_share=self.parameters.time_share)
        makespan = relaxation.least_makespan(search)
        if makespan is not None and (energy_counts or not search.fast_enough):
            state = AnnealingState(instance, search.seed, LocalSearchParameters().neighbours)
            for excess in self.parameters.makespan_excess:
                if search.should_stop() or self._round_and_repair(search, relaxation, state, makespan * (1 + excess)):
                    break
        parameters = self.parameters
        gentle = LocalSearchParameters(
            initial_noise=parameters.initial_noise, final_noise=parameters.repair_final_noise
        )
        improve(search, parameters=gentle if energy_counts else None)
        return Proposal()

    def _round_and_repair(self, search: Search, relaxation: Relaxation, state: AnnealingState, makespan: float) -> bool:
        """Round an allocation for a target makespan, repair it, and submit it; return whether it meets the target."""
        rounded = relaxation.rounded(search, makespan)
        if rounded is None:
            return False
        search.submit(rounded)
        state.begin(rounded, max(makespan, search.lower_bound))
        parameters, local, unit = self.parameters, LocalSearchParameters(), state.candidate_cost
        shortfall = unit * local.shortfall_penalty / state.mean_ability
        cooling = parameters.repair_final_noise / parameters.repair_noise
        for step in range(parameters.repair_iterations):
            if search.should_stop():
                break
            noise = unit * parameters.repair_noise * cooling ** (step / parameters.repair_iterations)
            weights = state.weights(float(relaxation.by_place), noise, local.short_task_penalty * unit, shortfall)
            state.run(local.exchanges, weights)
            search.iteration += 1
            if state.best is not None and not relaxation.by_place:
                break
        search.submit(state.best or state.allocation)
        return state.best is not None
