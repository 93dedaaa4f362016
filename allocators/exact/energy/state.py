"""The state that the phases of the energy stage pass along."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.energy.primal_dual import MAX_TASKS, PrimalDual
from alloc.allocators.exact.model import FEW_PAIRS, Model
from alloc.allocators.exact.solver_model import is_repeatable
from alloc.problems import Allocation

STAGE_S = 60.0
"""Seconds of which phases get their shares where there is no time limit, or a longer one."""


@dataclass(frozen=True, eq=False)
class EnergyState:
    """The model at the makespan, the time, and both sides of the gap; plans go to `search`.

    Attributes
    ----------
    search : Search
    model : Model
        Classes told apart by place.
    demand : Demand
        The constraints at the makespan.
    begin_s, until_s : float
        Seconds since the run began at which the stage began and must end; the latter ``inf`` without a time limit.
    repeatable : bool
        Whether effort is counted and not timed.
    primal_dual : PrimalDual or None
        None where the solver is quick enough by itself, or neither side can be had.
    """

    search: Search
    model: Model
    demand: Demand
    begin_s: float
    until_s: float
    repeatable: bool
    primal_dual: PrimalDual | None

    @classmethod
    def begin(cls, search: Search, model: Model, demand: Demand) -> "EnergyState":
        """Start from the best plan of `search`."""
        assert search.best is not None
        begin_s, limit_s = search.elapsed_s, search.budget.time_limit_s
        primal_dual = None
        if len(demand.class_of_pair) > FEW_PAIRS and len(demand.need) <= MAX_TASKS:
            both = PrimalDual(search.instance, model, demand, search.best.allocation, search.seed)
            primal_dual = None if both.is_empty else both
        return cls(
            search=search,
            model=model,
            demand=demand,
            begin_s=begin_s,
            until_s=np.inf if limit_s is None else limit_s,
            repeatable=is_repeatable(search),
            primal_dual=primal_dual,
        )

    @property
    def cost(self) -> float:
        """Cost of the best plan, in units of distance."""
        assert self.search.best is not None
        return self.search.best.evaluation.cost_in_distance

    @property
    def progress(self) -> float:
        """How much of the stage's time has passed; may exceed 1."""
        stage_s = min(STAGE_S, self.until_s - self.begin_s)
        return (self.search.elapsed_s - self.begin_s) / stage_s if stage_s > 0 else 1.0

    def submit(self, plan: Allocation | None) -> None:
        """Submit a plan of `primal_dual`, if there is a new one, and pass it the cost of the best plan."""
        if plan is not None:
            self.search.submit(plan)
        if self.primal_dual is not None:
            self.primal_dual.note_cost(self.cost)
