"""The linear relaxation of the allocation problem, with fractions of agents per class and task, solved by HiGHS."""

import numpy as np
from scipy.sparse import csr_array, hstack, vstack

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.lp_rounding.rounding import round_fractions
from alloc.allocators.runtime.linear_programme import Optimum, minimise
from alloc.problems import Allocation, Instance, agent_classes, serve_all
from alloc.problems.bounds import scale_to_one, typical_distance
from alloc.problems.instance import FloatArray

SAFETY = 1e-9
"""Relative amount added to the optimal makespan of the relaxation, so that it is feasible in floating point."""

MAX_STEPS = 8
"""Maximum number of linear programmes for the least fractional makespan; one is enough without travel times."""


class Relaxation:
    """Linear programmes whose variables are the fractions of agents of each class on each task that they can reach.

    Parameters
    ----------
    instance : Instance
    by_place : bool
        Whether classes distinguish agents by their position, as required for energy.
    time_share : float
        Largest share of the remaining time that one linear programme may take.
    """

    def __init__(self, instance: Instance, *, by_place: bool, time_share: float) -> None:
        self.instance, self.by_place, self.time_share = instance, by_place, time_share
        self.classes = agent_classes(instance, by_place=by_place)
        self.working_tasks = np.flatnonzero(instance.workload > 0)
        self.agent_class, self.row = np.nonzero(self.classes.mask[:, instance.workload > 0])
        self.task = self.working_tasks[self.row]
        self.distance = self.classes.distance[self.agent_class, self.task]
        self.flight_cost = self.classes.cost[self.agent_class, self.task]
        columns = np.arange(len(self.agent_class))
        ones = np.ones(len(self.agent_class))
        self.used = csr_array((ones, (self.agent_class, columns)), shape=(self.classes.size, len(columns)))

    def task_share(self, makespan: float) -> FloatArray:
        """Return the share of the task that an agent of each pair completes within a makespan, at most 1."""
        with np.errstate(over="ignore", invalid="ignore"):
            hours_on_task = np.maximum(0.0, makespan - self.distance / self.classes.speed[self.agent_class])
            done = self.classes.ability[self.agent_class] * hours_on_task / self.instance.workload[self.task]
        return np.minimum(1.0, np.nan_to_num(done, nan=0.0))

    def least_makespan(self, search: Search) -> float | None:
        """Return approximately the least makespan of a fractional allocation in hours, or None without an answer."""
        makespan = search.lower_bound
        for _ in range(MAX_STEPS):
            matrix = vstack(
                [
                    hstack([-self._coverage(self.task_share(makespan)), csr_array(np.ones((self._n_tasks, 1)))]),
                    hstack([self.used, csr_array((self.classes.size, 1))]),
                ]
            )
            limits = np.concatenate([np.zeros(self._n_tasks), self.classes.count])
            answer = _minimise(search, np.append(np.zeros(len(self.task)), -1.0), matrix, limits, self.time_share)
            completed = 0.0 if answer is None else -answer.value
            if completed <= 0:
                return None  # a task is out of reach, or time ran out
            if completed >= 1 - SAFETY:
                return makespan * (1 + SAFETY)
            makespan /= completed
        return makespan

    def rounded(self, search: Search, makespan: float) -> Allocation | None:
        """Return a rounded fractional allocation of least cost within a makespan, or None without an answer."""
        share = self.task_share(makespan)
        rng = np.random.default_rng(search.seed)
        scaled = self.flight_cost * scale_to_one(typical_distance(self.flight_cost))
        cost = scaled if self.by_place else rng.random(len(share))  # without energy, any vertex will do
        matrix = vstack([-self._coverage(share), self.used])
        limits = np.concatenate([np.full(self._n_tasks, SAFETY - 1), self.classes.count])
        answer = _minimise(search, cost, matrix, limits, self.time_share)
        if answer is None:
            return None
        amount = np.maximum(0.0, answer.x)
        integer = round_fractions(self.agent_class, self.task, amount, share, cost, self.classes.count)
        counts = np.zeros(self.classes.mask.shape, dtype=np.intp)
        counts[self.agent_class, self.task] = integer
        return serve_all(self.instance, self.classes.spread(counts))

    @property
    def _n_tasks(self) -> int:
        return len(self.working_tasks)

    def _coverage(self, share: FloatArray) -> csr_array:
        """Return the matrix that maps the fractions to the completed share of each task."""
        return csr_array((share, (self.row, np.arange(len(share)))), shape=(self._n_tasks, len(share)))


def _minimise(
    search: Search, cost: FloatArray, matrix: csr_array, limits: FloatArray, time_share: float
) -> Optimum | None:
    """Minimise ``cost @ x`` subject to ``matrix @ x <= limits`` and x >= 0; None if there was no answer in time."""
    reproducible = search.budget.time_limit_s is None and search.budget.iterations is not None
    should_stop = (lambda: search.interrupted) if reproducible else search.should_stop
    return minimise(cost, matrix, limits, should_stop=should_stop, seconds=time_share * search.remaining_s)
