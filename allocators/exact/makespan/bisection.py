"""The least makespan: bisection on T, each test a question of feasibility."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.exact.makespan.configuration import Configurations
from alloc.allocators.exact.makespan.descent import descend
from alloc.allocators.exact.makespan.enumeration import choose_groups, enumerate_groups
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.makespan.repartition_search import Wanderer
from alloc.allocators.exact.model import FEW_PAIRS, Model
from alloc.allocators.exact.solver_model import Answer, Question, Test, Watch, is_over
from alloc.problems import Evaluation, agent_classes

TIGHT = 1e-8
"""Relative gap at which the search ends; well above the tolerance of 1e-9 that solvers and scores have."""

UNLIMITED_S = 60.0
"""What the parts of the time that tests get are measured by where there is no time limit."""

REPEATABLE_ROUNDS = 20
"""Times that are wandered for where runs must be repeatable."""

CALM_S = 0.05
"""Seconds without success after which wandering may end."""

STEPS_PER_TIME = 1000
"""Splits for one time."""

STEPS_PER_TEST = 20_000
"""Splits for a time that is tested."""

LONG, SHORT = 300, 20
"""Kicks of a descent: where solvers have failed, and at the start."""


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
    pairs_per_second : int
        Pairs of class and task of which the solver's model is built in a second.
    descent : bool
        Whether to descend before asking.
    """

    def __init__(
        self,
        search: Search,
        ask: Callable[[Question, Watch], Answer],
        serve: int,
        until_s: float,
        pairs_per_second: int,
        *,
        descent: bool,
    ) -> None:
        self._search, self._ask, self._until_s, self._descent = search, ask, until_s, descent
        self._model = Model.build(search.instance, agent_classes(search.instance, by_place=False), serve)
        self._rng = np.random.default_rng(search.seed)
        self._wanderer = Wanderer(self._model, search.seed)
        self._repeatable = search.budget.time_limit_s is None and search.budget.iterations is not None
        self._build_s = 2 * len(self._model.kind) / pairs_per_second
        self._low = self._simple_bound()
        self._wall = 0.0
        self._hard = False
        self._configurations: Configurations | None = None

    @property
    def _high(self) -> float:
        assert self._search.fastest is not None
        return self._search.fastest.evaluation.served_makespan

    @property
    def _closed(self) -> bool:
        given = self._search.tolerance.limit
        return self._high <= max(self._low * (1 + TIGHT), given or 0.0)

    @property
    def _over(self) -> bool:
        return is_over(self._search) or self._search.elapsed_s >= self._until_s

    def run(self) -> None:
        """Narrow the gap until it is closed or time is up; plans and bounds go to the search."""
        if self._descent:
            self._quick_plans()
            turns = (0.005, 0.2) if len(self._model.kind) > FEW_PAIRS else ()
            for part in turns:  # plans and bounds by turns, as either alone often closes the gap
                self._wander(part)
                self._raise_by_prices(part)
        elif self._search.instance.has_travel_time or not self._search.instance.reach.is_complete:
            self._raise_by_relaxation()
        test = Test(self._low, self._part(0.25))
        while not (self._closed or self._over):
            found = self._try(test)
            if found is None:
                if test.last or self._near(self._low):
                    return
                self._wall = self._wall if test.top else max(self._wall, test.time)
                if not self._hard:
                    self._raise_by_prices(0.2)
            test = self._next(ruled_out=found is False)

    def _next(self, *, ruled_out: bool) -> Test:
        high, floor = self._high, max(self._low, self._wall)
        if self._near(floor) and self._wall > self._low:
            self._wall = 0.0
            return Test(high * (1 - 0.9 * PROVEN), np.inf, last=True)
        if self._near(floor) or (ruled_out and not self._hard):
            return Test(high * (1 - TIGHT / 2), self._part(0.1), top=True)
        return Test(float(np.sqrt(floor * high)) if high > 2 * floor else (floor + high) / 2, self._part(0.1))

    def _near(self, time: float) -> bool:
        """Whether the best plan is proven to 1e-6 if `time` is a lower bound."""
        return self._high - time <= PROVEN * self._high

    def _try(self, test: Test) -> bool | None:
        """Whether this makespan can be had, None if that stays open."""
        demand = self._model.at(test.time)
        if demand.hopeless:
            return self._rule_out(test.time)
        if self._hard and self._descent and self._find_plan(test.time):
            return True
        if self._hard and self._configurations is not None:
            known = self._try_groups(test, self._configurations)
            if known is not None:
                return known
        assert self._search.fastest is not None
        until_s = min(self._search.elapsed_s + test.seconds + self._build_s, self._until_s)
        question = Question(
            demand=demand,
            cost=None,
            hint=self._model.counts(demand, self._search.fastest.allocation),
            seconds=until_s - self._search.elapsed_s,
            threads=self._search.threads,
            seed=self._search.seed,
            repeatable=self._repeatable,
        )
        answer, high = self._ask(question, Watch(self._search, self._model, demand, until_s)), self._high
        self._search.iteration += 1
        if answer.impossible:
            return self._rule_out(test.time)
        if answer.counts is None:
            return None
        score = self._search.submit(self._model.allocation(demand, answer.counts))
        return True if self._is_met(score, test.time) and score.served_makespan < high else None

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

    def _raise_by_prices(self, part: float) -> None:
        """Let the configuration linear programme push the lower bound, or a simpler one where that takes too long."""
        first, self._hard = not self._hard, True
        if self._closed or self._over or self._model.serve < len(self._model.tasks):
            return
        if first:
            configurations = Configurations(self._model, self._low)
            self._configurations = configurations if configurations.able else None
        if self._configurations is None:
            if first:
                self._raise_by_relaxation()
            return
        configurations, until_s = self._configurations, self._search.elapsed_s + self._part(part)
        time, possible = self._low, self._high
        while not (self._closed or self._over) and possible > self._low * (1 + TIGHT):
            prices, solved = configurations.best_prices(time, lambda: self._over or self._search.elapsed_s > until_s)
            if prices is None or not (solved or prices.theta > 1):
                return
            if prices.theta > 1:
                self._rule_out(configurations.reach_of(prices, time, possible))
            else:
                possible = max(self._low, self._model.least_alike(time))
            time = (self._low + min(possible, self._high)) / 2

    def _try_groups(self, test: Test, configurations: Configurations) -> bool | None:
        """Whether some choice of groups makes a plan, None if that stays open."""
        until_s = min(self._search.elapsed_s + test.seconds, self._until_s)

        def over() -> bool:
            return self._over or self._search.elapsed_s >= until_s

        prices, _ = configurations.best_prices(test.time, over, converge=True)
        if prices is None:
            return None
        if prices.theta > 1:
            return self._rule_out(configurations.reach_of(prices, test.time, self._high))
        choice = enumerate_groups(configurations, prices, test.time, over)
        if choice is None or over():
            return None
        table, impossible = choose_groups(choice, self._search.seed, over)
        if impossible:
            return self._rule_out(test.time)
        if table is None:
            return None
        full = np.zeros(self._model.classes.mask.shape, dtype=np.intp)
        full[:, self._model.tasks] = table
        high, score = self._high, self._search.submit(self._model.classes.spread(full))
        return True if self._is_met(score, test.time) and score.served_makespan < high else None

    def _find_plan(self, time: float) -> bool:
        """Wander, or descend where that cannot be; whether a plan with makespan `time` was found."""
        if not self._wanderer.able:
            return self._descend(time, 0.05, kicks=LONG)
        self._settle()
        until_s = np.inf if self._repeatable else self._search.elapsed_s + self._part(0.01)
        found, plan = self._wanderer.walk(
            time, lambda: self._over or self._search.elapsed_s >= until_s, most_steps=STEPS_PER_TEST
        )
        return self._is_met(self._search.submit(plan), time) and found

    def _raise_by_relaxation(self) -> None:
        """Let linear programmes push the lower bound; they see more than the simple bounds, and less than a test."""
        if self._closed or self._over or self._model.serve < len(self._model.tasks):
            return
        seconds = 1.0 if self._repeatable else self._part(0.1)
        bound = relaxed_lower_bound(self._model, self._low, self._high, seconds, lambda: self._over)
        if bound > self._low:
            self._rule_out(bound)

    def _quick_plans(self) -> None:
        """Descend for the lower bound, then for times closer to the best plan."""
        for weight in (1.0, 0.5, 0.25):
            if self._closed or self._over:
                return
            time = self._high + weight * (self._low - self._high)
            self._descend(max(self._low, time), 0.03, kicks=SHORT)  # below only by rounding

    def _descend(self, time: float, part: float, kicks: int) -> bool:
        """Descend from the best plan; whether one with makespan `time` was found."""
        assert self._search.fastest is not None
        table = self._model.classes.tally(self._search.fastest.allocation)[:, self._model.tasks]
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

    def _wander(self, part: float) -> None:
        """Wander for times closer to the best plan for this part of the time, less where nothing gets better."""
        partial = self._model.serve < len(self._model.tasks)  # which tasks to serve is the question there
        if not self._wanderer.able or partial or self._closed or self._over:
            return
        self._settle()
        begin_s = last_s = self._search.elapsed_s
        rounds, weight = 0, 1.0
        while not (self._closed or self._over):
            high, now_s, rounds = self._high, self._search.elapsed_s, rounds + 1
            patience_s = max(self._part(part / 10, CALM_S), last_s - begin_s)
            late = now_s - begin_s > self._part(part) or now_s - last_s > patience_s
            if rounds > REPEATABLE_ROUNDS if self._repeatable else late:
                return
            time = max(self._low, high + weight * (self._low - high) - TIGHT / 2 * high)
            _, plan = self._wanderer.walk(time, lambda: self._over, most_steps=STEPS_PER_TIME)
            self._search.submit(plan)
            if self._high < high:
                last_s = self._search.elapsed_s
            else:
                weight = weight / 2 if weight > 0.1 else float(self._rng.choice([0.0, 0.5, 1.0]))

    def _settle(self) -> None:
        assert self._search.fastest is not None
        self._wanderer.settle(self._search.fastest.allocation)

    def _part(self, part: float, least_s: float = 0.3) -> float:
        """Seconds that are this part of the time, at least `least_s`; no limit where runs must be repeatable."""
        if self._repeatable:
            return float("inf")
        return max(least_s, part * (self._until_s if np.isfinite(self._until_s) else UNLIMITED_S))
