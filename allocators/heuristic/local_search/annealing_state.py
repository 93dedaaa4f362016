"""The state of simulated annealing: a plan, its target makespan, arrays for the loops, and adaptive penalties."""

import math
from copy import copy, deepcopy

import numpy as np

from alloc.allocators.heuristic.local_search.annealing import SMALLEST_GAIN, anneal
from alloc.allocators.heuristic.local_search.candidates import arrays_and_candidates, mean_candidate_cost
from alloc.allocators.heuristic.local_search.instance_arrays import Int32Array
from alloc.allocators.heuristic.local_search.moves import recompute
from alloc.allocators.heuristic.local_search.plan import (
    BEST,
    CURRENT,
    FULL_GROUP,
    N_MOVES,
    N_SHORT,
    Weights,
    group_slots,
    idle_plan,
    workspace,
)
from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

PRICE_DECAY = 0.99
"""Exponent applied to the prices of tasks in each run in which the cost counts, so that they decay towards 1."""

ROUNDING = 1e-12
"""Relative amount by which demands are lowered, against rounding errors of sums."""

RISE, FALL = 1.2, 0.9
"""Factors on the penalty after a period that ends with a shortfall, and without one."""

LOWEST, HIGHEST = 0.1, 100.0
"""Limits of the penalty factor, which is initially 1."""

EXCHANGES_PER_AGENT = 5.0
"""Length of a period, in exchanges per agent."""

MIN_EXCHANGES = 250.0
"""Least exchanges per agent of a budget with an adaptive penalty, which takes many periods."""

PATIENCE = 3
"""Consecutive periods that may end with a shortfall; after one more, the search returns to the best plan."""


class AnnealingState:
    """A plan that exchanges improve for a target makespan.

    Parameters
    ----------
    instance : Instance
    seed : int
    neighbours : int
        Candidate tasks per origin and per task.

    Attributes
    ----------
    candidate_cost : float
        Mean cost of a flight from an origin to its candidates, which is the unit of noise on costs.
    mean_ability : float
        Mean ability, in the unit of `arrays`.
    """

    def __init__(self, instance: Instance, seed: int, neighbours: int) -> None:
        self.instance = instance
        self.arrays, self.candidates = arrays_and_candidates(instance, neighbours)
        self.workspace = workspace(seed)
        m, n = instance.m, instance.n
        random = np.random.default_rng(seed).integers(1, 2**63, 1, dtype=np.uint64)
        self.makespan = 1.0
        self._is_served = np.ones(instance.m, dtype=bool)
        self._least_slots = np.full(m + 1, min(n, max(16, 2 * n // m)), dtype=np.int64)
        self.plan = idle_plan(n, m, random)
        self.candidate_cost = mean_candidate_cost(self.arrays, self.candidates)
        self.mean_ability = float(self.arrays.ability.mean())
        self._integer_ability = float(self.arrays.ability.max()) if self.arrays.integer_ability else np.inf

    def clone(self, seed: int | list[int]) -> "AnnealingState":
        """Return another state for the same instance, with the same arrays and its own random numbers."""
        clone = copy(self)
        clone.workspace = workspace(seed)
        random = np.random.default_rng(seed).integers(1, 2**63, 1, dtype=np.uint64)
        clone.plan = idle_plan(self.instance.n, self.instance.m, random)
        return clone

    @property
    def n_short(self) -> int:
        """Number of tasks with a shortfall."""
        return int(self.plan.counter[N_SHORT])

    def begin(self, allocation: Allocation, makespan: float, price: FloatArray | None = None) -> None:
        """Continue from an allocation, with a target makespan in hours and prices of tasks, which are 1 by default."""
        idle = self.instance.m
        group = np.where(allocation.task_of_agent == IDLE, idle, allocation.task_of_agent).astype(np.int32)
        group[np.append(self.instance.workload == 0, False)[group]] = idle
        self._is_served = np.isin(np.arange(idle), group)
        self.plan.price[:] = 1.0
        if price is not None:
            self.plan.price[:-1] = np.where(price > 0, price, 1.0)
        self._set_groups(group)
        self.set_target(makespan)

    def set_target(self, makespan: float) -> None:
        """Keep the plan and the prices, set another target makespan, and discard the best plan."""
        arrays, demand, price = self.arrays, self.plan.demand, self.plan.price
        price /= np.exp(np.log(price).mean())
        self.makespan = makespan
        with np.errstate(over="ignore"):
            exact = self.instance.workload / (makespan * arrays.ability_unit) * (1 - ROUNDING)
        exact[~self._is_served] = 0.0
        demand[:-1] = np.minimum(np.ceil(exact) if arrays.integer_ability else exact, 1e300)
        self.recompute()
        self.plan.cost[BEST] = np.inf
        self.plan.counter[N_MOVES] = self.instance.n + 1  # so that the first best plan is written completely

    def return_to_best(self) -> None:
        """Continue from `best`, if there is one, with the current prices."""
        if self.best_cost < np.inf:
            self._set_groups(self.plan.best_group.copy())
            self.recompute()
            self.plan.counter[N_MOVES] = 0

    def weights(self, cost: float, noise: float, short_task: float, shortfall: float) -> Weights:
        """Return the weights of exchanges; see `Weights`."""
        return Weights(cost, noise, short_task, shortfall, 2.0, self._integer_ability)

    def begin_part(self, whole: "AnnealingState", part: int, part_of_task: IntArray, part_of_agent: IntArray) -> None:
        """Continue from another state, changing only the tasks and agents of one part.

        Parameters
        ----------
        whole : AnnealingState
        part : int
            Number of this part.
        part_of_task, part_of_agent : ndarray of int, shape (m,) and (n,)
            Agents belong to the part of their task, idle ones to any part. At least one task belongs to another part.
        """
        plan, idle = deepcopy(whole.plan), self.instance.m
        self.makespan, self._least_slots = whole.makespan, whole._least_slots
        elsewhere = np.flatnonzero(part_of_task != part)
        plan.demand[elsewhere] = 0.0  # tasks without demand are not exchanged with
        spare = plan.slot[plan.begin[idle] : plan.begin[idle] + plan.size[idle]].copy()
        mine = spare[part_of_agent[spare] == part]
        plan.group_of_agent[spare[part_of_agent[spare] != part]] = elsewhere[0]
        plan.slot[plan.begin[idle] : plan.begin[idle] + len(mine)] = mine
        plan.size[idle], plan.position[mine] = len(mine), np.arange(len(mine))
        short = np.flatnonzero(plan.group_ability[:-1] < plan.demand[:-1])
        plan.short_task[: len(short)], plan.counter[N_SHORT] = short, len(short)
        plan.short_position[:] = -1
        plan.short_position[short] = np.arange(len(short))
        plan.best_group[:], plan.counter[N_MOVES] = plan.group_of_agent, 0
        plan.cost[BEST] = np.inf if len(short) else plan.cost[CURRENT]
        self.plan = plan._replace(random=self.plan.random)

    def join(self, parts: "list[AnnealingState]", part_of_task: IntArray, part_of_agent: IntArray) -> None:
        """Merge the plans of parts that began from this state; see `begin_part`."""
        group, best = self.plan.group_of_agent.copy(), self.plan.group_of_agent.copy()
        cost = self.cost
        for number, part in enumerate(parts):
            is_mine, tasks = part_of_agent == number, np.flatnonzero(part_of_task == number)
            group[is_mine], best[is_mine] = part.plan.group_of_agent[is_mine], part.plan.best_group[is_mine]
            self.plan.price[tasks] = part.plan.price[tasks]
            self._least_slots = np.maximum(self._least_slots, part._least_slots)
            cost += part.best_cost - self.cost
        if cost < self.best_cost * (1 - SMALLEST_GAIN):
            self.plan.best_group[:], self.plan.cost[BEST] = best, cost
        self._set_groups(group)
        self.recompute()
        self.plan.counter[N_MOVES] = self.instance.n + 1  # invalidates the journal of moves

    def run(self, steps: int, weights: Weights, cooling: float = 1.0) -> float:
        """Make exchanges; return the last noise."""
        if weights.cost > 0:
            np.maximum(1.0, self.plan.price**PRICE_DECAY, out=self.plan.price)
        noise: float = anneal(
            self.arrays, self.plan, self.workspace, self.candidates, self.makespan, steps, weights, cooling
        )
        if self.plan.counter[FULL_GROUP]:
            self._add_slots()
        return noise

    def recompute(self) -> None:
        """Compute group abilities and cost from scratch, which removes accumulated rounding errors."""
        recompute(self.arrays, self.plan, self.makespan)

    @property
    def allocation(self) -> Allocation:
        """The current plan."""
        return _as_allocation(self.plan.group_of_agent, self.instance.m)

    @property
    def best(self) -> Allocation | None:
        """The plan of least cost without a shortfall since the target was set, if any."""
        return _as_allocation(self.plan.best_group, self.instance.m) if self.best_cost < np.inf else None

    @property
    def best_cost(self) -> float:
        """Cost of `best`; ``inf`` if there is none."""
        return float(self.plan.cost[BEST])

    @property
    def cost(self) -> float:
        """Cost of the current plan."""
        return float(self.plan.cost[CURRENT])

    @property
    def current_makespan(self) -> float:
        """Makespan of the current plan in hours, for instances without travel times."""
        work = self.plan.demand[:-1] > 0
        with np.errstate(divide="ignore"):
            longest = (self.instance.workload[work] / self.plan.group_ability[:-1][work]).max()
        return float(longest / self.arrays.ability_unit)

    def _set_groups(self, group: Int32Array) -> None:
        slot, begin, size, position = group_slots(group, self.instance.m + 1, self._least_slots)
        self.plan.group_of_agent[:] = group
        self.plan = self.plan._replace(slot=slot, begin=begin, size=size, position=position)

    def _add_slots(self) -> None:
        """Double the slots of full groups."""
        self.plan.counter[FULL_GROUP] = 0
        capacity = np.diff(self.plan.begin)
        is_full = self.plan.size >= capacity
        self._least_slots = np.where(is_full, np.minimum(2 * capacity, self.instance.n), capacity)
        self._set_groups(self.plan.group_of_agent.copy())


class PenaltyFactor:
    """Strategic oscillation: a factor on the penalties of shortfalls, and returns to the best plan.

    The factor rises while plans have shortfalls, and falls while they have none. If the makespan leaves much slack, a
    low penalty lets shortfalls move between tasks, which saves energy. At the least makespan, few plans are without
    shortfalls, and a search that has left them seldom finds another: it then returns to the best plan.

    Parameters
    ----------
    state : AnnealingState
    exchanges : int
        Exchanges in an iteration.
    allowed : float
        Number of exchanges per agent that the budget allows.

    Attributes
    ----------
    value : float
    """

    def __init__(self, state: AnnealingState, exchanges: int, allowed: float) -> None:
        self.value, self._state = 1.0, state
        self._period = EXCHANGES_PER_AGENT * state.instance.n / exchanges if allowed >= MIN_EXCHANGES else math.inf
        self._iterations, self._short_periods = 0, 0

    def update(self, iterations: int) -> None:
        """Count further iterations, and adapt the factor at the end of a period."""
        self._iterations += iterations
        if self._iterations < self._period:
            return
        self._iterations = 0
        is_short = self._state.n_short > 0
        self.value = min(HIGHEST, max(LOWEST, self.value * (RISE if is_short else FALL)))
        self._short_periods = self._short_periods + 1 if is_short else 0
        if self._short_periods > PATIENCE:
            self._state.return_to_best()
            self._short_periods = 0


def _as_allocation(group: Int32Array, idle: int) -> Allocation:
    return Allocation(np.where(group == idle, IDLE, group))


def compile_loops() -> None:
    """Call every compiled loop once, so that none is compiled during a run."""
    instance = Instance(ability=[1.0, 2.0], workload=[1.0, 1.0], task_position=np.eye(2), start_task=[0, 1])
    state = AnnealingState(instance, 0, 1)
    state.begin(Allocation([1, 0]), 1.0)
    state.run(1, state.weights(1.0, 0.0, 1.0, 1.0))
