"""The least makespan: bisection on T, each test a question of feasibility."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.demand import Model
from alloc.allocators.exact.descent import descend
from alloc.allocators.exact.question import Answer, Question, Watch, is_over
from alloc.allocators.search import PROVEN, Search
from alloc.problems import Evaluation, agent_classes, lp_makespan_lower_bound

TIGHT = 1e-8
"""Relative gap at which the search ends; well above the tolerance of 1e-9 that solvers and scores have."""

UNLIMITED_S = 60.0
"""What the parts of the time that tests get are measured by where there is no time limit."""


class LeastMakespan:
    """A bisection on T between what is proven and the best plan.

    The lower bound is tested first, as it is often the optimum. A test that ends without an answer raises the lower
    end of the bisection (`_wall`) but proves nothing; it gets a longer try once nothing else is left.

    Parameters
    ----------
    search : Search
    ask : callable
        Puts a question to the solver.
    serve : int
        How many tasks are to be served.
    until_s : float
        Seconds since the run began at which this must end.
    descent : bool
        Whether to descend before asking.
    """

    def __init__(
        self,
        search: Search,
        ask: Callable[[Question, Watch], Answer],
        serve: int,
        until_s: float,
        *,
        descent: bool,
    ) -> None:
        self._search, self._ask, self._until_s, self._descent = search, ask, until_s, descent
        self._model = Model.build(search.instance, agent_classes(search.instance, by_place=False), serve)
        self._rng = np.random.default_rng(search.seed)
        self._repeatable = search.budget.time_limit_s is None and search.budget.iterations is not None
        self._low = self._simple_bound()
        self._wall = 0.0
        self._top_tried = np.inf

    @property
    def _high(self) -> float:
        assert self._search.best is not None
        return self._search.best.evaluation.served_makespan

    @property
    def _closed(self) -> bool:
        return self._high <= self._low * (1 + TIGHT)

    @property
    def _over(self) -> bool:
        return is_over(self._search) or self._search.elapsed_s >= self._until_s

    def run(self) -> None:
        """Narrow the gap until it is closed or time is up; plans and bounds go to the search."""
        if self._descent:
            self._quick_plans()
        self._raise_by_lp()
        test, seconds, last = self._low, self._part(0.15), False
        while not (self._closed or self._over):
            found = self._test(test, seconds)
            if last and found is None:
                return
            test, seconds, last = self._next(ruled_out=found is False)

    def _next(self, *, ruled_out: bool) -> tuple[float, float, bool]:
        """Return the next T, the seconds it may take, and whether it is the last resort."""
        high, floor = self._high, max(self._low, self._wall)
        if self._wall > self._low and high - floor <= PROVEN * high:
            self._wall = 0.0
            return high * (1 - 0.9 * PROVEN), np.inf, True
        if (ruled_out and self._top_tried != high) or high - floor <= PROVEN * high:
            self._top_tried = high
            return high * (1 - TIGHT / 2), self._part(0.1), False
        return (float(np.sqrt(floor * high)) if high > 2 * floor else (floor + high) / 2), self._part(0.1), False

    def _test(self, time: float, seconds: float) -> bool | None:
        """Whether a makespan of `time` can be had, None if that stays open."""
        demand = self._model.at(time)
        if demand.hopeless:
            return self._rule_out(time)
        if self._wall > 0 and self._descent and self._descend(time, 0.03, kicks=200 if self._repeatable else 10**9):
            return True
        until_s = min(self._search.elapsed_s + seconds, self._until_s)
        watch = Watch(self._search, self._model, demand, until_s)
        question = Question(
            demand=demand,
            cost=None,
            hint=None,
            seconds=until_s - self._search.elapsed_s,
            threads=self._search.threads,
            seed=self._search.seed,
            repeatable=self._repeatable,
        )
        answer = self._ask(question, watch)
        self._search.iteration += 1
        if answer.impossible:
            return self._rule_out(time)
        if answer.counts is not None:
            high = self._high
            score = self._search.submit(self._model.allocation(demand, answer.counts))
            if self._is_met(score, time) and score.served_makespan < high:
                return True
        self._wall = max(self._wall, time)
        return None

    def _is_met(self, score: Evaluation, time: float) -> bool:
        served = len(self._model.tasks) - len(score.unserved_tasks)
        return served >= self._model.serve and score.served_makespan <= time * (1 + TIGHT / 4)

    def _rule_out(self, time: float) -> bool:
        self._low = max(self._low, self._model.after(time))
        if self._model.serve == len(self._model.tasks):
            self._search.raise_bound(min(self._low, self._high))
        return False

    def _simple_bound(self) -> float:
        """All abilities against the smallest workloads that are to be served."""
        model = self._model
        if model.serve == len(model.tasks):
            return self._search.lower_bound
        return float(np.sort(model.work)[: model.serve].sum() / (model.classes.ability @ model.classes.count))

    def _raise_by_lp(self) -> None:
        """Where reach is limited, a linear programme sees more than the simple bounds."""
        instance = self._search.instance
        if self._closed or self._over or instance.reach.is_complete or self._model.serve < len(self._model.tasks):
            return
        bound = lp_makespan_lower_bound(instance, min(0.5, self._part(0.05)))
        if bound is not None:
            self._low = max(self._low, min(bound, self._high))
            self._search.raise_bound(self._low)

    def _quick_plans(self) -> None:
        """Descend for the lower bound, then for times closer to the best plan."""
        for weight in (1.0, 0.5, 0.25):
            if self._closed or self._over:
                return
            self._descend(self._high + weight * (self._low - self._high), 0.03, kicks=20)

    def _descend(self, time: float, part: float, kicks: int) -> bool:
        """Descend from the best plan; whether one with makespan `time` was found."""
        assert self._search.best is not None
        table = self._model.classes.tally(self._search.best.allocation)[:, self._model.tasks]
        served = table.any(axis=0)
        until_s = np.inf if self._repeatable else self._search.elapsed_s + self._part(part)
        counts, _ = descend(
            self._model.shares(time)[:, served],
            table[:, served],
            self._model.classes.count - table.sum(axis=1),
            self._rng,
            kicks=kicks,
            should_stop=lambda: self._over or self._search.elapsed_s >= until_s,
        )
        full = np.zeros(self._model.classes.mask.shape, dtype=np.intp)
        full[:, self._model.tasks[served]] = counts
        return self._is_met(self._search.submit(self._model.classes.spread(full)), time)

    def _part(self, part: float) -> float:
        """Seconds that are this part of the time, at least 0.3; no limit where runs must be repeatable."""
        if self._repeatable:
            return float("inf")
        return max(0.3, part * (self._until_s if np.isfinite(self._until_s) else UNLIMITED_S))
