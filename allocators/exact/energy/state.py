"""The shared state of the phases of the energy stage."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.energy.primal_dual import MAX_TASKS, PrimalDual
from alloc.allocators.exact.energy.travel.phase import TravelPhase
from alloc.allocators.exact.local_search import LocalSearchPhase
from alloc.allocators.exact.model import FEW_PAIRS, Model
from alloc.allocators.exact.solver_model import is_repeatable
from alloc.problems import Allocation, Objective

STAGE_S = 60.0
"""Seconds to which the shares of phases refer without a time limit, or with a longer one."""

LINEAR_SHARE = 0.1
"""Largest share of the stage's time for the initial linear programme."""


@dataclass(frozen=True, eq=False)
class EnergyState:
    """The model at the makespan, the time, and both sides of the gap; plans go to `search`.

    Attributes
    ----------
    search : Search
    model : Model
        Classes that distinguish places.
    demand : Demand
        The constraints at the makespan.
    begin_s, until_s : float
        Seconds since the run began at which the stage began and must end; the latter ``inf`` without a time limit.
    repeatable : bool
        Whether effort is counted rather than timed.
    primal_dual : PrimalDual or None
        None if the solver is fast enough by itself, or neither side is tractable.
    local_search : LocalSearchPhase or None
        None if `primal_dual` finds plans without rounding, or the solver is fast enough by itself.
    travel : TravelPhase or None
        None if travel takes no time, or `primal_dual` has no prices.
    """

    search: Search
    model: Model
    demand: Demand
    begin_s: float
    until_s: float
    repeatable: bool
    primal_dual: PrimalDual | None
    local_search: LocalSearchPhase | None
    travel: TravelPhase | None

    @classmethod
    def begin(cls, search: Search, model: Model, demand: Demand) -> "EnergyState":
        """Start from the best plan of `search`."""
        assert search.best is not None
        begin_s, limit_s = search.elapsed_s, search.budget.time_limit_s
        primal_dual, local_search = None, None
        until_s = np.inf if limit_s is None else limit_s
        if len(demand.class_of_pair) > FEW_PAIRS and len(demand.need) <= MAX_TASKS:
            seconds = np.inf if is_repeatable(search) else LINEAR_SHARE * min(STAGE_S, search.remaining_s)
            plan = search.best.allocation
            both = PrimalDual(search.instance, model, demand, plan, search.seed, seconds, search.should_stop)
            primal_dual = None if both.is_empty else both
        # with non-integer weights, which it rounds, the primal side has few plans at the least makespan
        enough = primal_dual is not None and primal_dual.finds_plans and demand.integral
        if len(demand.class_of_pair) > FEW_PAIRS and not enough:
            local_search = LocalSearchPhase(search, Objective.MAKESPAN_ENERGY, until_s, search.makespan_limit)
        travel = (
            None if primal_dual is None or not TravelPhase.is_applicable(search, model) else TravelPhase(search, model)
        )
        return cls(
            search=search,
            model=model,
            demand=demand,
            begin_s=begin_s,
            until_s=until_s,
            repeatable=is_repeatable(search),
            primal_dual=primal_dual,
            local_search=local_search,
            travel=travel,
        )

    @property
    def spare_threads(self) -> int:
        """Number of threads used neither by the caller nor by parallel local search."""
        beside = self.local_search is not None and self.local_search.is_beside
        return max(0, self.search.threads - 1 - beside)

    @property
    def cost(self) -> float:
        """Cost of the best plan, in units of distance."""
        assert self.search.best is not None
        return self.search.best.evaluation.cost_in_distance

    @property
    def stage_s(self) -> float:
        """Seconds to which the shares of phases refer."""
        return min(STAGE_S, self.until_s - self.begin_s)

    @property
    def progress(self) -> float:
        """Share of the stage's time that has passed; may exceed 1."""
        return (self.search.elapsed_s - self.begin_s) / self.stage_s if self.stage_s > 0 else 1.0

    def submit(self, plan: Allocation | None) -> None:
        """Submit a plan of `primal_dual`, if it is new, and pass the best plan to `primal_dual`."""
        if plan is not None:
            self.search.submit(plan)
        if self.local_search is not None:
            self.local_search.exchange()
        if self.travel is not None and self.primal_dual is not None:
            self.travel.turn(self.primal_dual)
        if self.primal_dual is not None:
            assert self.search.best is not None
            self.primal_dual.note_plan(self.search.best.allocation, self.cost)
