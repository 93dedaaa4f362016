"""A linear programme over classes of agents, rounded by a matching, and mended by local search."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse import csr_array, hstack, vstack

from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.allocators.heuristic.local_search import improve as local
from alloc.allocators.heuristic.local_search.annealing_state import Chain
from alloc.allocators.heuristic.local_search.plan import Weights
from alloc.allocators.heuristic.local_search.warm_up import warm_up
from alloc.allocators.heuristic.lp_rounding.rounding import round_fractions
from alloc.allocators.registry import BUILT_IN
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems import Allocation, Instance, Objective, agent_classes, serve_all
from alloc.problems.bounds import LP_PAIRS_PER_SECOND, LP_SIZE_LIMIT, scale_to_one, typical_distance
from alloc.problems.instance import FloatArray

SAFETY = 1e-9
"""Relative amount by which a makespan is raised above what the programme reached, to be feasible in floats."""

MOST_STEPS = 8
"""Programmes on the way to the least fractional makespan; one is enough where travel takes no time."""


@dataclass(frozen=True)
class Parameters:
    """Of rounding and mending.

    Attributes
    ----------
    slack : tuple of float
        Makespans aimed at one after the other, until one is met: relative excess over the least fractional one.
    tries : int
        Iterations of local search, at most, for each.
    warm, cold : float
        First and last noise of the mending, as of `local-search`; far below its own, so that what the programme chose
        stands where it can.
    hot : float
        First noise of the exchanges that use what is left of the budget, where energy counts.
    share : float
        Most of the time left that a programme may take.
    """

    slack: tuple[float, ...] = (0.0, 0.001, 0.003, 0.01, 0.03)
    tries: int = 60
    warm: float = 0.03
    cold: float = 0.007
    hot: float = 0.09
    share: float = 0.4


class LpRound(Allocator):
    """Relax, round, mend.

    The programme shares fractions of agents out so that the last task is done as early as possible, then, where energy
    counts, so that they fly least in that time. Its corners have few fractions; they are rounded by Shmoys and Tardos's
    matching, which takes at most one agent too many from each task. Exchanges of the local search then make up for
    that, at a makespan a little above that of the programme if need be, and use what is left of the budget. An
    iteration is one of the local search.

    References
    ----------
    Shmoys and Tardos (1993), doi:10.1007/BF01585178; Bezakova and Dani (2005), doi:10.1145/1120680.1120683.
    """

    method = BUILT_IN["lp-round"]
    parameters = Parameters()

    def __init__(self) -> None:
        warm_up()

    def refusal(self, instance: Instance, objective: Objective, budget: Budget) -> str | None:
        """A linear programme cannot be told to stop early with an answer."""
        seconds = 10.0 if budget.time_limit_s is None else max(1.0, budget.time_limit_s)
        most = min(LP_SIZE_LIMIT, int(LP_PAIRS_PER_SECOND * seconds))
        alike = len(np.unique(instance.ability)) * (len(instance.reach.place) if objective != "makespan" else 1)
        pairs = min(instance.n, alike) * instance.m if not instance.has_travel_time else instance.n * instance.m
        if pairs > most:
            return f"a linear programme of up to {pairs} pairs of agents and tasks; in this time it can solve {most}"
        return None

    def allocate(self, search: Search) -> Proposal:
        """Relax, round and mend until the search says stop; every improvement has been submitted by then."""
        instance = search.instance
        if not (instance.workload > 0).any():
            return Proposal(Allocation.idle(instance))
        search.submit(serve_all(instance, greedy(instance, search)))
        if search.should_stop():
            return Proposal()
        economical = search.objective is Objective.MAKESPAN_ENERGY
        programme = Programme(instance, by_place=economical, time_share=self.parameters.share)
        hours = programme.least_hours(search)
        if hours is not None and (economical or not search.fast_enough):
            chain = Chain(instance, search.seed, local.Parameters().near)
            for slack in self.parameters.slack:
                if search.should_stop() or self._met(search, programme, chain, hours * (1 + slack)):
                    break
        known = local.Parameters(hot=self.parameters.hot, cold=self.parameters.cold)
        local.improve(search, parameters=known if economical else None)
        return Proposal()

    def _met(self, search: Search, programme: "Programme", chain: Chain, hours: float) -> bool:
        """Round a plan for `hours`, mend it, and submit what comes out; whether it keeps to them."""
        rounded = programme.rounded(search, hours)
        if rounded is None:
            return False
        search.submit(rounded)
        chain.begin(rounded, max(hours, search.lower_bound))
        parameters, scale = self.parameters, local.Parameters()
        lack = chain.step * scale.lack / float(chain.ground.ability.mean())
        for step in range(parameters.tries):
            if search.should_stop():
                break
            noise = chain.step * parameters.warm * (parameters.cold / parameters.warm) ** (step / parameters.tries)
            weights = Weights(float(programme.by_place), noise, scale.charge * chain.step, lack, 2.0, chain.sums)
            chain.run(scale.exchanges, weights, 1.0)
            search.iteration += 1
            if chain.best is not None and not programme.by_place:
                break
        search.submit(chain.best or chain.allocation)
        return chain.best is not None


class Programme:
    """Fractions of agents per class and task.

    Parameters
    ----------
    instance : Instance
    by_place : bool
        Whether agents are told apart by place, as energy asks for.
    time_share : float
        Most of the time left that a programme may take.
    """

    def __init__(self, instance: Instance, *, by_place: bool, time_share: float) -> None:
        self.instance, self.by_place, self.time_share = instance, by_place, time_share
        self.classes = agent_classes(instance, by_place=by_place)
        self.kind, goal = np.nonzero(self.classes.mask[:, instance.workload > 0])
        self.work = np.flatnonzero(instance.workload > 0)
        self.goal, self.task = goal, self.work[goal]
        self.distance = self.classes.distance[self.kind, self.task]
        columns = np.arange(len(self.kind))
        ones = np.ones(len(self.kind))
        self.used = csr_array((ones, (self.kind, columns)), shape=(self.classes.size, len(columns)))

    def share(self, hours: float) -> FloatArray:
        """Return what part of its task one agent of each pair does in time, at most all of it."""
        with np.errstate(over="ignore", invalid="ignore"):
            at_work = np.maximum(0.0, hours - self.distance / self.classes.speed[self.kind])
            done = self.classes.ability[self.kind] * at_work / self.instance.workload[self.task]
        return np.minimum(1.0, np.nan_to_num(done, nan=0.0))

    def least_hours(self, search: Search) -> float | None:
        """Return about the least makespan of a fractional plan, None where it is not at hand."""
        hours = search.lower_bound
        for _ in range(MOST_STEPS):
            cover = self._cover(self.share(hours))
            matrix = vstack(
                [
                    hstack([-cover, csr_array(np.ones((len(self.work), 1)))]),
                    hstack([self.used, csr_array((self.classes.size, 1))]),
                ]
            )
            limits = np.concatenate([np.zeros(len(self.work)), self.classes.count])
            answer = _solve(search, np.append(np.zeros(len(self.kind)), -1.0), matrix, limits, self.time_share)
            part = 0.0 if answer is None else float(-answer.fun)
            if part <= 0:
                return None  # some task is out of reach, or there was no time
            if part >= 1 - SAFETY:
                return hours * (1 + SAFETY)
            hours /= part
        return hours

    def rounded(self, search: Search, hours: float) -> Allocation | None:
        """Return a fractional plan that takes `hours` and flies least, made whole; None where it is not at hand."""
        share = self.share(hours)
        rng = np.random.default_rng(search.seed)
        by_distance = self.distance * scale_to_one(typical_distance(self.distance))
        cost = by_distance if self.by_place else rng.random(len(share))  # any corner is as good as another
        matrix = vstack([-self._cover(share), self.used])
        limits = np.concatenate([np.full(len(self.work), SAFETY - 1), self.classes.count])
        answer = _solve(search, cost, matrix, limits, self.time_share)
        if answer is None:
            return None
        amount = np.maximum(0.0, answer.x)
        whole = round_fractions(self.kind, self.task, amount, share, cost, self.classes.count)
        counts = np.zeros(self.classes.mask.shape, dtype=np.intp)
        counts[self.kind, self.task] = whole
        return serve_all(self.instance, self.classes.spread(counts))

    def _cover(self, share: FloatArray) -> csr_array:
        return csr_array((share, (self.goal, np.arange(len(share)))), shape=(len(self.work), len(share)))


def _solve(
    search: Search, cost: FloatArray, matrix: csr_array, limits: FloatArray, share: float
) -> OptimizeResult | None:
    """Minimise ``cost @ x`` with ``matrix @ x <= limits`` and x >= 0; None where time does not allow it."""
    seconds = share * search.remaining_s
    options = {} if seconds == math.inf else {"time_limit": seconds}

    def work() -> OptimizeResult:
        return linprog(cost, matrix, limits, method="highs", options=options)

    counted = search.budget.time_limit_s is None and search.budget.iterations is not None
    answer = run_native(work, lambda: search.interrupted if counted else search.should_stop(), lambda: None)
    return answer if answer is not None and answer.status == 0 else None
