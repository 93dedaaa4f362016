"""Annealing by several threads: of parts of one plan, which change from round to round, or of one plan per thread."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.clock import Clock
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.plan import Weights
from alloc.allocators.heuristic.task_prices.start import PricedPlan
from alloc.allocators.parallel.pool import RunAll
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import FloatArray, IntArray

MAX_STATES = 32
"""Maximum number of annealing states; further threads are not used."""

MIN_TASKS = 8
"""Minimum number of tasks in a part."""

DRAWS = 1.3
"""Number of exchanges drawn per exchange required, as some are with tasks of other parts."""

WHOLE = 8
"""Number of exchanges in each part per exchange that is then made in the whole plan."""

RUNS = 2
"""Runs of each part in a round; in longer rounds, each part would converge by itself."""

AGENTS_PER_RUN = 2_000
"""Number of agents per additional run in a round, as the time for dividing and merging a plan grows with its size."""


PATIENCE_PER_TASK, MIN_PATIENCE = 10.0, 10
"""Exchanges per task, and least number of iterations, without fewer short tasks after which an attempt ends."""

MAX_FAILURES = 3
"""Number of consecutive rounds of attempts without success after which other searches continue."""


@dataclass(frozen=True)
class Team:
    """Annealing states of an instance, each with its own random numbers, and a `map` that runs them concurrently."""

    states: list[AnnealingState]
    run_all: RunAll

    @classmethod
    def of(cls, search: Search, neighbours: int, run_all: RunAll) -> "Team":
        """Return a team for the threads of a run; its first state is the same as with a single thread."""
        first = AnnealingState(search.instance, search.seed, neighbours)
        clones = [first.clone([search.seed, number]) for number in range(1, min(search.threads, MAX_STATES))]
        return cls([first, *clones], run_all)


@dataclass
class Attempt:
    """An attempt at a target makespan, with the noise of each iteration."""

    state: AnnealingState
    fraction: float
    makespan: float
    noise: FloatArray
    iterations: float
    done: int = 0

    def run(self, clock: Clock, exchanges: int) -> "Attempt":
        """Search for a plan within the target makespan."""
        self.state.set_target(self.makespan)
        for level in self.noise.tolist():
            if clock.is_over or not self.state.n_short:
                break
            self.state.run(exchanges, self.state.weights(0.0, level, 0.0, 1.0))
            self.done += 1
        return self

    @property
    def is_reached(self) -> bool:
        """Whether no task is short."""
        return not self.state.n_short

    def submit(self, search: Search) -> None:
        """Submit the plan if it may be faster than the fastest one."""
        assert search.fastest is not None
        fastest = search.fastest.evaluation.served_makespan
        # with travel times, the makespan is known only after evaluation
        if self.is_reached or not self.state.arrays.instant_travel or self.state.current_makespan < fastest:
            search.submit(self.state.allocation)


class Parts:
    """Anneals parts of a plan concurrently.

    A part consists of neighbouring tasks, their agents, and some of the idle agents; exchanges are made within parts.
    In each round, the tasks are divided along a different direction.

    Parameters
    ----------
    team : Team
        The team, whose first state has the plan.
    seed : int

    Attributes
    ----------
    count : int
        Number of parts.
    """

    def __init__(self, team: Team, seed: int) -> None:
        self.team, self.state, self.rng = team, team.states[0], np.random.default_rng(seed)
        tasks = int(np.count_nonzero(self.state.plan.demand))
        self.count = max(1, min(len(team.states), tasks // MIN_TASKS))
        first = [self.state.clone(seed)] if self.count > 1 else []
        self._parts = [*first, *team.states[1 : self.count]]

    def run(self, iterations: float, steps: int, weights: Weights) -> int:
        """Make up to `iterations` iterations of `steps` exchanges each; return the number made."""
        if self.count == 1:
            self.state.run(steps, weights)
            return 1
        runs = int(min(max(RUNS, self.state.instance.n // AGENTS_PER_RUN), iterations // self.count))
        if runs < 1:
            self.state.run(steps, weights)
            return 1
        parts = self._parts
        part_of_task, part_of_agent = self._divide()

        def work(number: int) -> None:
            parts[number].begin_part(self.state, number, part_of_task, part_of_agent)
            for _ in range(runs):
                parts[number].run(int(steps * self.count * DRAWS), weights)  # one of `count` agents is in the part

        list(self.team.run_all(work, range(self.count)))
        self.state.join(parts, part_of_task, part_of_agent)
        self.state.run(runs * steps // WHOLE, weights)  # shortfalls in one part may need a surplus in another
        return runs * self.count

    def _divide(self) -> tuple[IntArray, IntArray]:
        """Return the part of each task and agent: slabs across a random direction with similar numbers of agents."""
        plan, rng, count = self.state.plan, self.rng, self.count
        tasks = np.flatnonzero(plan.demand[:-1] > 0)
        order = tasks[np.argsort(_along(self.state.arrays.task_position[tasks], rng), kind="stable")]
        agents = np.cumsum(plan.size[order])
        cut = np.searchsorted(agents, agents[-1] * np.arange(1, count) / count)
        number = np.arange(1, count)
        cut = np.clip(cut, number, len(tasks) - count + number)
        cut = np.maximum.accumulate(cut - number) + number  # no part is empty
        part_of_task = np.full(self.state.instance.m, -1)
        part_of_task[order] = np.searchsorted(cut, np.arange(len(tasks)), side="right")
        of_group = np.append(part_of_task, -1)[plan.group_of_agent]
        return part_of_task, np.where(of_group < 0, rng.integers(count, size=len(of_group)), of_group)


def _along(position: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return the coordinate of each position along a random direction; a random number if it is unknown."""
    key: FloatArray = position @ rng.standard_normal(position.shape[1])
    return np.where(np.isnan(key), rng.random(len(key)), key)


def tighten(search: Search, team: Team, priced: PricedPlan, clock: Clock, exchanges: int) -> None:
    """Halve the gap of a plan from prices as long as exchanges without noise succeed; submit the plans found.

    Noise would undo what prices have balanced. Each attempt begins with the plan of the last success; after a failure,
    the target moves halfway to the fastest makespan. Several threads try such targets speculatively.

    Parameters
    ----------
    search : Search
        A run that has a plan.
    team : Team
    priced : PricedPlan
        Its prices are the initial prices of shortfalls in each attempt.
    clock : Clock
    exchanges : int
        Number of exchanges per iteration.
    """
    plan, count = priced.allocation, len(team.states)
    patience = max(MIN_PATIENCE, int(PATIENCE_PER_TASK * search.instance.m / exchanges))
    fraction, failures = 0.5, 0

    def attempt(number: int) -> int:
        """Try a target makespan, beginning with the plan, and return the number of iterations."""
        state, waited, done = team.states[number], 0, 0
        state.begin(plan, targets[number], priced.price)
        least, most = state.n_short, clock.iterations_of(number, count)
        while least and waited < patience and done < most and not clock.is_over:
            state.run(exchanges, state.weights(0.0, 0.0, 0.0, 1.0))
            done, waited = done + 1, waited + 1
            if state.n_short < least:
                least, waited = state.n_short, 0
        return done

    while failures < MAX_FAILURES and not clock.is_over and not search.fast_enough:
        assert search.fastest is not None
        best = search.fastest.evaluation.served_makespan
        bound = min(search.lower_bound, best)
        if bound >= best * (1 - RELATIVE_TOLERANCE):
            return
        targets = [best - (best - bound) * (1 - fraction) * 0.5**number for number in range(count)]
        search.iteration += sum(team.run_all(attempt, range(count)))
        reached = next((state for state in team.states if not state.n_short), None)
        if reached is None:
            fraction, failures = 1 - (1 - fraction) * 0.5**count, failures + 1
        else:
            plan, fraction, failures = reached.allocation, 0.5, 0
            search.submit(plan)
