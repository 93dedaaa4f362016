"""Search for plans of less energy by annealing with repartitions, in cycles."""

import numpy as np

from alloc.allocators.exact.energy.travel.annealing import Groups, anneal
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray, IntArray

NEAR = 10
"""Number of nearest tasks with which a task is repartitioned."""

NOISE_SIZE = 2**14
"""Number of samples of noise, which are drawn only once."""

FIRST_CYCLE, GROWTH = 100_000, 1.1
"""Number of repartitions of the first cycle, and its growth factor per cycle."""

STEP = 1000
"""Largest number of successive repartitions with the same penalties."""

LAST_HEAT = 0.05
"""Final noise of each cycle, in mean flights."""

FIXED_PENALTY, PENALTY = 0.5, 4.0
"""Penalties at full strength: of any shortfall, as a multiple of the median price of an agent, and of missing work, as
a multiple of its price."""

CYCLES = (0.3, 1.0, 1.0), (0.2, 0.4, 0.8), (0.4, 1.0, 1.0), (0.3, 0.4, 0.8), (0.6, 0.25, 1.0)
"""Initial noise, and initial and final strength of penalties, of successive cycles; a cycle that finds a better plan is
repeated. If agents reach few tasks in time, only the last one finds plans."""


class TravelSearch:
    """An annealing search for plans that meet all needs, with weights that depend on the task.

    Parameters
    ----------
    cost : ndarray, shape (n, m)
        Cost of the flight of an agent to a task, ``inf`` out of reach.
    task : ndarray of int, shape (n,)
        A plan that meets all needs; m for idle agents.
    task_distance : ndarray, shape (m, m)
        Distances between tasks.
    seed : int
    """

    def __init__(self, cost: FloatArray, task: IntArray, task_distance: FloatArray, seed: int) -> None:
        agents, tasks = cost.shape
        working = np.flatnonzero(task < tasks)
        with np.errstate(over="ignore"):
            self._scale = agents / max(1e-300, float(cost[working, task[working]].sum()))
            scaled = np.ascontiguousarray(cost * self._scale)
        rng = np.random.default_rng(seed)
        near = np.argsort(task_distance + 1e300 * np.eye(tasks), axis=1, kind="stable")[:, : min(NEAR, tasks - 1)]
        self._groups = Groups(
            weight=np.zeros((agents, tasks)),
            cost=scaled,
            near=np.ascontiguousarray(near.astype(np.int64)),
            noise=rng.logistic(size=NOISE_SIZE),
            task=task.astype(np.int64),
            member=np.zeros((tasks + 1, agents), dtype=np.int64),
            size=np.zeros(tasks + 1, dtype=np.int64),
            done=np.zeros(tasks),
            random=rng.integers(1, 2**63, 1, dtype=np.uint64),
            best=task.astype(np.int64),
            total=np.zeros(2),
        )
        self._price, self._fixed = np.zeros(tasks), 0.0
        self._length, self._made, self._number = FIRST_CYCLE, 0, 0
        self._restart()

    @property
    def is_between_cycles(self) -> bool:
        """Whether a cycle begins next, so that weights, prices and the plan may be changed."""
        return self._made == 0

    @property
    def best(self) -> WholeArray:
        """Task of each agent in the best plan, shape (n,)."""
        return self._groups.best

    @property
    def cost(self) -> float:
        """Total cost of flights in the best plan."""
        return float(self._groups.total[1] / self._scale)

    def set_weights(self, weight: FloatArray, task: IntArray) -> None:
        """Set the share of each task that an agent does, shape (n, m), 0 out of reach, and a feasible plan."""
        self._groups.weight[:] = weight
        self.set_plan(task)

    def set_plan(self, task: IntArray) -> None:
        """Continue from another plan."""
        self._groups.best[:] = task
        self._restart()

    def set_prices(self, price: FloatArray) -> None:
        """Set the price of each agent, shape (n,), in the unit of costs, from which prices of work on tasks follow."""
        groups, price = self._groups, price * self._scale
        self._fixed = FIXED_PENALTY * float(np.median(price))
        for j in range(len(groups.done)):
            able = np.flatnonzero(groups.weight[:, j] > 0)
            paid, weight = groups.cost[able, j] + price[able], groups.weight[able, j]
            with np.errstate(over="ignore"):
                ratio = paid / weight
            order = np.argsort(ratio)
            last = min(int(np.searchsorted(np.cumsum(weight[order]), 1.0)), len(order) - 1)
            self._price[j] = ratio[order[last]]

    def anneal(self, calls: int) -> None:
        """Make `calls` repartitions, at most to the end of the cycle; the next cycle starts from the best plan."""
        calls = min(calls, self._length - self._made)
        while calls > 0:
            now, progress = min(calls, STEP, self._length - self._made), self._made / self._length
            first, soft, hard = CYCLES[self._number % len(CYCLES)]
            cooling = (LAST_HEAT / first) ** (1 / self._length)
            part = soft * (hard / soft) ** progress
            fixed, penalty = part * self._fixed, part * PENALTY
            anneal(self._groups, self._price, fixed, penalty, now, first * cooling**self._made, cooling)
            self._made, calls = self._made + now, calls - now
        if self._made == self._length:
            self._end_cycle()

    def _end_cycle(self) -> None:
        is_better = self.cost < self._cost_before * (1 - 1e-9)
        self._restart()
        self._length, self._made = int(GROWTH * self._length), 0
        self._number += not is_better

    def _restart(self) -> None:
        """Return to the best plan, and recompute sums to remove accumulated rounding errors."""
        groups, tasks = self._groups, len(self._groups.done)
        groups.task[:] = groups.best
        groups.size[:] = 0
        for agent, task in enumerate(groups.best.tolist()):
            groups.member[task, groups.size[task]] = agent
            groups.size[task] += 1
        working = np.flatnonzero(groups.best < tasks)
        task = groups.best[working]
        groups.done[:] = np.bincount(task, groups.weight[working, task], tasks)
        groups.total[:] = groups.cost[working, task].sum()
        self._cost_before = self.cost


def compile_loops() -> None:
    """Compile all loops, or load them from the cache, so that they do not delay a run."""
    search = TravelSearch(np.ones((2, 2)), np.array([0, 1]), np.ones((2, 2)), 0)
    search.set_weights(np.ones((2, 2)), np.array([0, 1]))
    search.set_prices(np.ones(2))
    search.anneal(1)
