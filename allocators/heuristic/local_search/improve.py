"""From any plan to a better one: first the makespan, then the energy within it."""

import math
import time
from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import Chain
from alloc.allocators.heuristic.local_search.clock import Clock
from alloc.allocators.heuristic.local_search.plan import Weights
from alloc.problems import Allocation, Objective
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import FloatArray

HARD = 100.0
"""Factor of penalties that no distance outweighs."""

TAIL = 0.95
"""Part of the budget after which no plan may lack anything any more."""

FORETASTE = 0.1
"""Part of a long budget for a first cycle, so that an early end finds a good plan."""


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
    shaken : tuple of float
        First noise of one attempt at a makespan after the other, as a part of the mean ability.
    calm : float
        Their last noise.
    attempt : int
        Iterations of the first attempt at a makespan; each that fails makes the next longer.
    longer : float
        Factor by which.
    share : float
        Largest part of the budget that is spent on the makespan where energy counts as well.
    cycle : int
        Iterations of the first cycle of cooling down where no budget is known; each cycle is twice as long.
    few, many : float
        Exchanges per agent up to which noise is never more than `cold`, and from which on it begins at `hot`.
    """

    exchanges: int = 1000
    near: int = 10
    hot: float = 0.12
    cold: float = 0.007
    charge: float = 1.2
    lack: float = 5.0
    shaken: tuple[float, ...] = (0.1, 0.01, 0.001)
    calm: float = 1e-6
    attempt: int = 4
    longer: float = 1.2
    share: float = 0.5
    cycle: int = 100
    few: float = 10.0
    many: float = 100.0

    def weights(self, chain: Chain, noise: float, stiffness: float) -> Weights:
        """Return the weights of exchanges that lessen the distance.

        Parameters
        ----------
        noise : float
            As a part of the distance to a near task.
        stiffness : float
            Factor of the penalties.
        """
        unit = stiffness * max(chain.step, chain.distance / chain.instance.n)
        mean = float(chain.ground.ability.mean())
        return Weights(1.0, noise * chain.step, self.charge * unit, self.lack * unit / mean, 2.0, chain.sums)

    def warmth(self, exchanges: float) -> float:
        """Return the part of `hot` to begin with, where there is time for so many exchanges per agent."""
        rise = math.log(max(exchanges, 1e-9) / self.few) / math.log(self.many / self.few)
        part: float = (self.cold / self.hot) ** (1 - min(1.0, max(0.0, rise)))
        return part


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
    if search.best.evaluation.served_makespan == 0:  # no task that takes time can be served
        search.submit(Allocation.idle(search.instance))
        return
    if clock.is_over:
        return
    parameters = parameters or Parameters()
    economical = search.objective is Objective.MAKESPAN_ENERGY
    if clock.is_endless and economical:
        _improve_endlessly(search, parameters, clock)
        return
    chain = Chain(search.instance, search.seed, parameters.near)
    lessen_makespan(search, chain, parameters, clock.part(parameters.share) if economical else clock)
    if economical and clock.is_long:
        lessen_energy(search, chain, parameters, clock.part(FORETASTE))
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
    patience, fraction, attempts = float(parameters.attempt), 0.0, 0
    mean = float(chain.ground.ability.mean())
    while not clock.is_over and not search.fast_enough:
        fastest = search.fastest.evaluation
        time_now = fastest.served_makespan
        bound = min(search.lower_bound, time_now) if fastest.makespan is not None else 0.5 * time_now
        if bound >= time_now * (1 - RELATIVE_TOLERANCE):
            return
        shaken = parameters.shaken[attempts % len(parameters.shaken)]
        noises = mean * np.geomspace(shaken, parameters.calm, int(patience) + 1)[1:]
        reached = _attempt(search, chain, clock, bound + fraction * (time_now - bound), noises, parameters.exchanges)
        fraction = 0.5 * fraction if reached else min(0.5 * (1 + fraction), 0.999)
        patience *= 1.0 if reached else parameters.longer
        attempts += 1


def _attempt(search: Search, chain: Chain, clock: Clock, hours: float, noises: FloatArray, exchanges: int) -> bool:
    """Look for a plan that takes at most so long, with one noise per iteration; whether there is one."""
    assert search.fastest is not None
    chain.aim(hours)
    for noise in noises.tolist():
        if clock.is_over or not chain.short:
            break
        chain.run(exchanges, Weights(0.0, noise, 0.0, 1.0, 2.0, chain.sums), 1.0)
        search.iteration += 1
    # where travel takes time, only the score tells how long a plan takes
    if not chain.short or not chain.ground.instant or chain.longest() < search.fastest.evaluation.served_makespan:
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
    report = Reporter(search, chain)
    chain.run(parameters.exchanges, parameters.weights(chain, parameters.cold, HARD), 1.0)  # tells the pace
    search.iteration += 1
    warmth = parameters.warmth(parameters.exchanges * clock.left / search.instance.n)
    hot = parameters.hot * warmth
    while not clock.is_over:
        progress = clock.progress
        noise = hot * (parameters.cold / hot) ** progress
        stiffness = HARD if hot <= parameters.cold * 1.001 or progress > TAIL else 1.0
        chain.run(parameters.exchanges, parameters.weights(chain, noise, stiffness), 1.0)
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
