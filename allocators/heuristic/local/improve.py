"""From any plan to a better one: first the makespan, then the energy within it."""

import math
import time
from dataclasses import dataclass

import numpy as np

from alloc.allocators.heuristic.local.chain import Chain
from alloc.allocators.heuristic.local.plan import Weights
from alloc.allocators.search import Search
from alloc.problems import Objective
from alloc.problems.evaluation import RELATIVE_TOLERANCE


@dataclass(frozen=True)
class Parameters:
    """Of the local search; chosen on the paper's scenarios with seeds from 1000 on, and on hard instances.

    Attributes
    ----------
    exchanges : int
        Exchanges in an iteration, some 5 ms.
    near : int
        Candidates per place.
    hot, cold : float
        First and last noise on distances, as a part of the distance to a near task.
    charge, lack : float
        Penalty of a task that lacks ability, and of each mean ability that it lacks, in the same unit.
    shaken, calm : float
        First and last noise while the makespan is lessened, as a part of the mean ability.
    attempt : int
        Iterations of the first attempt at a makespan; each that fails makes the next longer.
    longer : float
        Factor by which.
    share : float
        Largest part of the budget that is spent on the makespan where energy counts as well.
    cycle : int
        Iterations of the first cycle of cooling down where no budget is known; each cycle is twice as long.
    """

    exchanges: int = 1000
    near: int = 10
    hot: float = 0.12
    cold: float = 0.007
    charge: float = 1.2
    lack: float = 5.0
    shaken: float = 0.1
    calm: float = 0.001
    attempt: int = 4
    longer: float = 1.2
    share: float = 0.5
    cycle: int = 100


class Clock:
    """How much of a part of the budget is gone, in time or iterations, whichever is further."""

    def __init__(self, search: Search, until_s: float = math.inf, until_iteration: float = math.inf) -> None:
        budget = search.budget
        self.search = search
        self.until_s = min(until_s, math.inf if budget.time_limit_s is None else budget.time_limit_s)
        self.until_iteration = min(until_iteration, math.inf if budget.iterations is None else budget.iterations)
        self.begin_s, self.begin_iteration = search.elapsed_s, search.iteration

    def part(self, share: float) -> "Clock":
        """Return a clock for the first part of what is left."""
        search = self.search
        seconds = search.elapsed_s + share * (self.until_s - search.elapsed_s)
        iterations = (
            search.iteration + math.ceil(share * (self.until_iteration - search.iteration))
            if self.until_iteration < math.inf
            else math.inf
        )
        return Clock(search, seconds, iterations)

    @property
    def is_endless(self) -> bool:
        """Whether nothing but a stop from outside ends it."""
        return min(self.until_s, self.until_iteration) == math.inf

    @property
    def progress(self) -> float:
        """From 0 to 1."""
        search = self.search
        seconds = (search.elapsed_s - self.begin_s) / max(1e-9, self.until_s - self.begin_s)
        iterations = (search.iteration - self.begin_iteration) / max(1, self.until_iteration - self.begin_iteration)
        return min(1.0, max(seconds, iterations))

    @property
    def is_over(self) -> bool:
        """Whether it is time to end."""
        search = self.search
        return search.elapsed_s >= self.until_s or search.iteration >= self.until_iteration or search.should_stop()


def improve(
    search: Search, *, until_s: float = math.inf, iterations: float = math.inf, parameters: Parameters | None = None
) -> None:
    """Improve ``search.best``, which must be there, and submit what is better.

    Ends when the search says so, and before that at either limit.

    Parameters
    ----------
    search : Search
        Its best plan is where the chain begins.
    until_s : float
        Second of the run, on ``search.elapsed_s``, when to end.
    iterations : float
        Iterations to make at most, each of ``parameters.exchanges`` exchanges.
    parameters : Parameters, optional
    """
    assert search.best is not None
    clock = Clock(search, until_s, search.iteration + iterations)
    if clock.is_over or not (search.instance.workload > 0).any():
        return
    parameters = parameters or Parameters()
    economical = search.objective is Objective.MAKESPAN_ENERGY
    if clock.is_endless and economical:
        _improve_endlessly(search, parameters, clock)
        return
    chain = Chain(search.instance, search.seed, parameters.near)
    lessen_makespan(search, chain, parameters, clock.part(parameters.share) if economical else clock)
    if economical:
        lessen_energy(search, chain, parameters, clock)


def _improve_endlessly(search: Search, parameters: Parameters, clock: Clock) -> None:
    """Lessen makespan and energy by turns, each for twice as long as before."""
    chain, cycle = Chain(search.instance, search.seed, parameters.near), parameters.cycle
    while not clock.is_over:
        lessen_makespan(search, chain, parameters, Clock(search, until_iteration=search.iteration + cycle))
        lessen_energy(search, chain, parameters, Clock(search, until_iteration=search.iteration + cycle))
        cycle *= 2


def lessen_makespan(search: Search, chain: Chain, parameters: Parameters, clock: Clock) -> None:
    """Aim at makespans between the bound and the best; the nearer to the best, the more often it failed."""
    assert search.fastest is not None
    chain.begin(search.fastest.allocation, search.fastest.evaluation.served_makespan)
    patience, fraction = float(parameters.attempt), 0.0
    while not clock.is_over and not search.fast_enough:
        fastest = search.fastest.evaluation
        time_now = fastest.served_makespan
        bound = min(search.lower_bound, time_now) if fastest.makespan is not None else 0.5 * time_now
        if bound >= time_now * (1 - RELATIVE_TOLERANCE):
            return
        reached = _attempt(search, chain, parameters, clock, bound + fraction * (time_now - bound), int(patience))
        fraction = 0.5 * fraction if reached else min(0.5 * (1 + fraction), 0.999)
        patience *= 1.0 if reached else parameters.longer


def _attempt(search: Search, chain: Chain, parameters: Parameters, clock: Clock, hours: float, iterations: int) -> bool:
    """Look for a plan that takes at most so long, the noise falling; whether there is one."""
    assert search.fastest is not None
    chain.aim(hours)
    mean = float(chain.ground.ability.mean())
    for step in range(iterations):
        if clock.is_over or not chain.short:
            break
        noise = mean * parameters.shaken * (parameters.calm / parameters.shaken) ** ((step + 1) / iterations)
        chain.run(parameters.exchanges, Weights(0.0, noise, 0.0, 1.0, 2.0, chain.sums), 1.0)
        search.iteration += 1
    if not chain.short or chain.longest() < search.fastest.evaluation.served_makespan:
        search.submit(chain.allocation)
    return not chain.short


def lessen_energy(search: Search, chain: Chain, parameters: Parameters, clock: Clock) -> None:
    """Anneal at the makespan of the best; what is left of the budget is one cycle."""
    best = search.best
    assert best is not None
    if clock.is_over or best.evaluation.energy == 0:
        return
    chain.begin(best.allocation, search.makespan_limit)
    clock = Clock(search, clock.until_s, clock.until_iteration)
    ratio = parameters.cold / parameters.hot
    report = Reporter(search, chain)
    lack = chain.step * parameters.lack / float(chain.ground.ability.mean())
    while not clock.is_over:
        noise = chain.step * parameters.hot * ratio**clock.progress
        chain.run(
            parameters.exchanges,
            Weights(1.0, noise, parameters.charge * chain.step, lack, 2.0, chain.sums),
            1.0,
        )
        search.iteration += 1
        report()
    report(at_once=True)


class Reporter:
    """Submits the best of a chain, so seldom that scoring takes a small part of the time."""

    def __init__(self, search: Search, chain: Chain, rarely: float = 20.0) -> None:
        self.search, self.chain, self.rarely = search, chain, rarely
        self.known, self.next_s = np.inf, 0.0

    def __call__(self, *, at_once: bool = False) -> None:
        """Submit what is news."""
        if self.chain.best_distance >= self.known or not (at_once or time.monotonic() >= self.next_s):
            return
        begin = time.monotonic()
        self.known = self.chain.best_distance
        found = self.chain.best
        if found is not None:
            self.search.submit(found)
        self.next_s = time.monotonic() + self.rarely * (time.monotonic() - begin)
