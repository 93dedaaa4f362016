"""The annealing search as a phase of the energy stage: its turns, target makespan, and submission of plans."""

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy.clusters import pairwise_distance
from alloc.allocators.exact.energy.primal_dual import PrimalDual
from alloc.allocators.exact.energy.timer import Timer
from alloc.allocators.exact.energy.travel.search import TravelSearch
from alloc.allocators.exact.model import ROUNDING, Model
from alloc.problems.evaluation import last_equal

MAX_PAIRS = 2_000_000
"""Number of agents times tasks above which tables take too much memory."""

CALLS = 10
"""Number of repartitions in a round of the timer."""

REPEATABLE_CALLS = 2000
"""Number of repartitions of a turn in repeatable runs."""

WORTHWHILE = 2e-3
"""Relative gain from which a plan is submitted at the end of a cycle. A submitted plan is slightly faster than
required, and later plans must be as fast, so that each submission costs some energy."""

PATIENCE, MIN_SHARE = 1.0, 0.3
"""Time without a better plan, as a multiple of the time until the best was found, after which the search has stalled;
and lower limit of the latter, as a share of the stage."""


class TravelPhase:
    """Searches for plans of less energy by `TravelSearch`, with prices from the bounds of `PrimalDual`.

    Parameters
    ----------
    search : Search
        The run; its best plan must serve all tasks with workload.
    model : Model
        Classes that distinguish places.
    """

    def __init__(self, search: Search, model: Model) -> None:
        assert search.best is not None
        self._search, self._model, self._timer = search, model, Timer()
        self._class = model.classes.class_of_agent
        cost = np.where(model.classes.mask, model.classes.cost, np.inf)[:, model.tasks][self._class]
        distance = pairwise_distance(search.instance.reach.goal[model.tasks])
        self._annealing = TravelSearch(cost, model.columns(search.best.allocation), distance, search.seed)
        self._limit, self._reported = 0.0, np.inf
        self._begin_s = self._found_s = self._last_s = search.elapsed_s

    @staticmethod
    def is_applicable(search: Search, model: Model) -> bool:
        """Whether travel takes time, all tasks are served, and tables fit."""
        agents, tasks = search.instance.n, len(model.tasks)
        return model.travel_time is not None and model.min_served == tasks > 1 and agents * tasks <= MAX_PAIRS

    def turn(self, both: PrimalDual) -> None:
        """Once there are prices, search for as long as other phases did since the last turn, or by count.

        Plans of a cycle are submitted at its end.
        """
        search, annealing = self._search, self._annealing
        until_s = 2 * search.elapsed_s - self._last_s
        self._last_s = search.elapsed_s
        if annealing.is_between_cycles:
            price = both.price
            if price is None:
                return
            self._begin_cycle()
            annealing.set_prices(price[self._class])
        if search.budget.time_limit_s is None:
            annealing.anneal(REPEATABLE_CALLS)
        else:
            self._timer.run(lambda rounds: annealing.anneal(CALLS * rounds))
            while search.elapsed_s < until_s and not (annealing.is_between_cycles or search.interrupted):
                self._timer.run(lambda rounds: annealing.anneal(CALLS * rounds))
        self._last_s = search.elapsed_s
        if annealing.is_between_cycles and annealing.cost < self._reported * (1 - WORTHWHILE):
            self.submit()

    def submit(self) -> None:
        """Submit the best plan if it is new."""
        if self._annealing.cost < self._reported * (1 - 1e-9):
            self._reported, self._found_s = self._annealing.cost, self._search.elapsed_s
            self._search.submit(self._model.plan_of(self._annealing.best))

    def has_stalled(self, stage_s: float) -> bool:
        """Whether no better plan has been found for long, in a stage of `stage_s` seconds."""
        took_s = max(self._found_s - self._begin_s, MIN_SHARE * stage_s)
        return self._search.elapsed_s - self._found_s > PATIENCE * took_s

    def _begin_cycle(self) -> None:
        """Adopt the best plan and its makespan, which may be less than before."""
        search, model = self._search, self._model
        assert search.best is not None
        limit, plan = search.makespan_limit, search.best.allocation
        if limit != self._limit:
            share = model.shares(last_equal(limit))[self._class] / (1 - ROUNDING)
            self._annealing.set_weights(share, model.columns(plan))
            self._limit, self._reported = limit, self._annealing.cost
        elif search.best.evaluation.cost_in_distance < self._annealing.cost * (1 - 1e-9):
            self._annealing.set_plan(model.columns(plan))
            self._reported = self._annealing.cost
