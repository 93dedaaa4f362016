"""Prices of tasks that balance supply and demand, and the bound on the makespan that they prove.

The bound follows from weak duality of the linear programme over single agents: if the total value of the agents, each
on the task where its value is highest, is less than that of all workloads, no plan completes all work in time.
"""

import time
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import Tree, build_tree
from alloc.allocators.heuristic.greedy.tree_search import idle_agents
from alloc.allocators.heuristic.task_prices.regions import regions_of
from alloc.allocators.heuristic.task_prices.sample import representatives
from alloc.allocators.heuristic.task_prices.shortlists import (
    empty_shortlists,
    fill_highest,
    find_shortlists,
    smooth_value,
)
from alloc.allocators.parallel.pool import RunAll
from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray

COARSE = ((5, (*(12 * ((0.25, 6),)), *(12 * ((0.12, 6),)))), (25, 5 * ((0.1, 6),)))
"""Samples, by number of agents per task; for each, widths of the smoothing relative to the spread of values, and the
maximum number of iterations with each. Over long distances, prices converge slowly, in many iterations, so that the
samples are small. With more iterations at a time, prices may diverge if agents reach more tasks than a shortlist holds.
"""

FINE = ((0.025, 35), (0.0125, 25))
"""Widths and iterations for all agents."""

MIN_SPREAD = 1e-3
"""Least spread of values, for instances with negligible travel times."""

COARSE_LENGTH, FINE_LENGTH = 32, 12
"""Number of tasks on the shortlists for samples and for all agents."""

SAFETY = 1e-9
"""Relative amount by which a bound is lowered, against rounding errors of a million terms."""

PROMISING = 1e-5
"""Relative amount by which a bound may be too low before all agents are evaluated again."""

CORRECTIONS = 20
"""Number of steps from which the quasi-Newton method estimates the curvature."""

MIN_SLOPE = 1e-4
"""Gradient component, relative to the mean share of a task in the value, up to which prices count as converged."""

LARGEST_EXPONENT = 50.0
"""Largest difference of logarithms between the highest and any other price."""


class Bidders:
    """Agents with their shortlists of the tasks on which they have the most value.

    Parameters
    ----------
    instance : Instance
    tree : Tree
        Tree over the tasks with workload.
    chosen : ndarray of int
        The agents.
    ability : ndarray
        Their abilities, including those of the agents that they represent.
    length : int
        Number of tasks on each shortlist.
    run_all : callable
        A `map` that makes its calls concurrently.
    threads : int
    """

    def __init__(
        self,
        instance: Instance,
        tree: Tree,
        chosen: IntArray,
        ability: FloatArray,
        length: int,
        run_all: RunAll,
        threads: int,
    ) -> None:
        agents, self.ability = idle_agents(instance, 1.0), ability
        self._agents = agents._replace(origin=agents.origin[chosen], ability=ability)
        self._speed, self._tree = instance.speed[chosen], tree
        self._goal = np.ascontiguousarray(instance.reach.goal)
        self.lists, self.makespan = empty_shortlists(len(chosen), length), 1.0
        self._run_all = run_all
        cut = np.linspace(0, len(chosen), threads + 1).astype(int).tolist()
        self._parts = list(pairwise(cut))

    def renew(self, price: FloatArray, makespan: float) -> float:
        """Fill the shortlists for these prices; return the total value of the agents per hour of `makespan`."""
        self.makespan = makespan
        agents = self._agents._replace(horizon=makespan * self._speed)
        highest = np.zeros(len(self._tree.begin))
        fill_highest(self._tree, price, highest)

        def work(part: tuple[int, int]) -> float:
            return find_shortlists(*part, agents, self._tree, self._goal, price, highest, self.lists)

        return sum(self._run_all(work, self._parts))

    def value(self, price: FloatArray, makespan: float, width: float) -> tuple[float, float, FloatArray]:
        """Return the value on shortlists, smoothed and exact, and the smoothed value by task; see `smooth_value`."""

        def work(part: tuple[int, int]) -> tuple[float, float, FloatArray]:
            share = np.zeros(len(price))
            values = smooth_value(*part, self.ability, self.lists, self.makespan / makespan, price, width, share)
            return *values, share

        smoothed, exact, share = zip(*self._run_all(work, self._parts), strict=True)
        return sum(smoothed), sum(exact), np.sum(share, axis=0)


class TaskPrices:
    """Prices of tasks, found by a quasi-Newton method on a smoothed dual.

    Parameters
    ----------
    instance : Instance
        An instance with at least one task that has workload.
    low : float
        A proven bound on the makespan, > 0, in hours.
    run_all : callable
        A `map` that makes its calls concurrently.
    threads : int

    Attributes
    ----------
    bound : float
        A proven bound on the makespan, in hours.
    makespan : float
        Estimate of the least makespan of a fractional allocation, in hours.
    price : ndarray, shape (m,)
    bidders : Bidders or None
        All agents, as soon as `improve` has found that prices help.

    References
    ----------
    Smoothing of the maximum: Nesterov (2005), doi:10.1007/s10107-004-0552-5.
    """

    def __init__(self, instance: Instance, low: float, run_all: RunAll, threads: int) -> None:
        self.instance, self.bound, self.makespan = instance, low, low
        self._some = instance.workload > 0
        self.price = self._some.astype(float)
        self._most_proven, self._best_price = 0.0, self.price
        self.bidders: Bidders | None = None
        self._tree = build_tree(instance.reach.goal, np.flatnonzero(self._some))
        self._regions = regions_of(self._tree)
        self._run_all, self._threads = run_all, threads

    def improve(self, end: float, stopped: Callable[[], bool]) -> bool:
        """Improve the prices until `end` on the monotonic clock; return whether they raised the bound.

        Ends early if the prices from samples do not raise the bound.
        """

        def is_over() -> bool:
            return stopped() or time.monotonic() >= end

        before = self.bound
        for per_task, steps in COARSE:
            sample = self._bidders(*representatives(self.instance, per_task * int(self._some.sum())), COARSE_LENGTH)
            best, best_price = self._renew(sample), self.price
            spread = max(MIN_SPREAD, float((sample.lists.lost.max(axis=1) - sample.lists.lost[:, 0]).mean()))
            for width, iterations in steps:
                if is_over():
                    return False
                self._adjust(sample, width * spread, iterations, is_over)
                value = self._renew(sample)
                if value > best:
                    best, best_price = value, self.price
            if self.price is not best_price:
                self.price = best_price
                self._renew(sample)
        if is_over() or self.makespan <= before * (1 + SAFETY):
            return False
        everyone = self.evaluate_all()
        for width, iterations in FINE:
            if is_over():
                break
            self._adjust(everyone, width * spread, iterations, is_over)
            self._prove(everyone)
        return self.bound > before * (1 + SAFETY)

    def evaluate_all(self) -> Bidders:
        """Evaluate all agents at the current prices, raise the bound accordingly, and return them."""
        everyone = self.bidders = self._bidders(np.arange(self.instance.n), self.instance.ability, FINE_LENGTH)
        self._prove(everyone)
        return everyone

    def _bidders(self, chosen: IntArray, ability: FloatArray, length: int) -> Bidders:
        return Bidders(self.instance, self._tree, chosen, ability, length, self._run_all, self._threads)

    def _renew(self, bidders: Bidders) -> float:
        """Refill the shortlists; return the makespan at which the value of the agents equals that of all workloads."""
        value = bidders.renew(self.price, self.makespan)
        hours = float(self.price @ self.instance.workload) / max(value, 1e-300)
        before, self.makespan = self.makespan, max(self.bound, hours)
        return min(before, hours)

    def _prove(self, everyone: Bidders) -> None:
        """Raise the bound: the value of agents is convex in T and 0 at 0, so it falls at least in proportion to T."""
        proven = self._renew(everyone)
        if self.makespan > proven * (1 + PROMISING):
            proven = max(proven, self._renew(everyone))
        self.bound = max(self.bound, proven * (1 - SAFETY))
        if proven > self._most_proven:
            self._most_proven, self._best_price = proven, self.price
        elif self.price is not self._best_price:  # the smoothed optimum may be worse in exact values
            self.price = self._best_price
            self._renew(everyone)

    def _adjust(self, bidders: Bidders, width: float, iterations: int, is_over: Callable[[], bool]) -> None:
        """Adjust the prices by up to `iterations` iterations of the quasi-Newton method."""
        from scipy.optimize import minimize

        if not (bidders.lists.task[:, 0] >= 0).any():  # no agent of the sample reaches a task in time
            return
        work, some = self.instance.workload, self._some
        unit = width * np.sqrt(work[some].mean() / work[some])  # the curvature grows with the workload
        regions, tasks = self._regions, len(unit)

        def price_of(x: FloatArray) -> FloatArray:
            exponent = x[:tasks] * unit + width * (regions @ x[tasks:])
            price = np.zeros(len(work))
            price[some] = np.exp(np.clip(exponent - exponent.max(), -LARGEST_EXPONENT, 0))
            return price

        def dual(x: FloatArray) -> tuple[float, FloatArray]:
            price = price_of(x)
            smoothed, _, share = bidders.value(price, self.makespan, width)
            needed = price * work
            slope = (share / smoothed - needed / needed.sum())[some]
            by_variable = np.concatenate([slope * unit / width, regions.T @ slope])
            return float(np.log(smoothed / needed.sum())) / width, by_variable

        def check(_: FloatArray) -> None:
            if is_over():
                raise StopIteration

        options = {"maxiter": iterations, "maxcor": CORRECTIONS, "gtol": MIN_SLOPE / len(work), "ftol": 0.0}
        start = np.concatenate([np.log(self.price[some]) / unit, np.zeros(regions.shape[1])])
        self.price = price_of(minimize(dual, start, jac=True, method="L-BFGS-B", callback=check, options=options).x)
