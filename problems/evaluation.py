"""Evaluation of allocations; the only scorer of the project."""

import sys
from dataclasses import dataclass

import numpy as np

from alloc.problems.allocation import Allocation, require_fit
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import ReadOnly
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.vocabulary import IDLE, Objective

RELATIVE_TOLERANCE = 1e-9
"""Relative difference up to which makespans and energies count as equal."""


def last_equal(hours: float) -> float:
    """Return the largest makespan that counts as equal to `hours`, for comparisons with a limit."""
    return min(hours * (1 + RELATIVE_TOLERANCE), sys.float_info.max)


@dataclass(frozen=True)
class Violation:
    """An agent assigned to a task that it cannot take; neither its ability nor its flight counts."""

    agent: int
    task: int
    reason: str


@dataclass(frozen=True, eq=False)
class Evaluation(ReadOnly):
    """Scores of one allocation; see `evaluate`.

    Attributes
    ----------
    completion_time : ndarray, shape (m,)
        T_j in hours (4): 0 without workload, ``inf`` if a task with workload has no agent; capped at the largest
        finite float.
    group_ability : ndarray, shape (m,)
        W_j, work per hour of the agents on each task.
    coverage : ndarray, shape (m,)
        W_j - h_j, the left side of (2).
    makespan : float or None
        max T_j in hours; None while a task is unserved.
    served_makespan : float
        max T_j over the served tasks, 0 if there is none.
    distance, energy : float
        Total distance that agents fly directly from start to task, and back if they return; and the energy for it
        (19), at each agent's energy per distance. Capped at the largest finite float.
    cost, cost_in_distance : float
        The secondary objective: energy, plus the price of moves if the instance has one; and the same divided by the
        energy per unit of cost, see `Reach.costs`.
    battery_remaining_percent : float or None
        Mean over the agents with a battery, idle ones at 100; None if no agent has one.
    reward : float
        Sum over tasks of (3), R_j = -tau^(W_j - h_j).
    reward_saturated : bool
        Whether a term of (3) overflows: `reward` is then the most negative finite float.
    unserved_tasks : tuple of int
        Tasks with workload and without an agent.
    unserved_priorities : tuple of float
        Their priorities, the highest first.
    violations : tuple of Violation
        Agents sent where they cannot go.
    """

    completion_time: FloatArray
    group_ability: FloatArray
    coverage: FloatArray
    makespan: float | None
    served_makespan: float
    distance: float
    energy: float
    cost: float
    cost_in_distance: float
    battery_remaining_percent: float | None
    reward: float
    reward_saturated: bool
    unserved_tasks: tuple[int, ...]
    unserved_priorities: tuple[float, ...]
    violations: tuple[Violation, ...]

    @property
    def unserved_rank(self) -> tuple[float, ...]:
        """Number of unserved tasks, then their priorities; compared first, smaller is better."""
        return float(len(self.unserved_tasks)), *self.unserved_priorities

    def key(self, objective: Objective) -> tuple[float, ...]:
        """Return the values to be compared lexicographically; smaller is better."""
        first = (*self.unserved_rank, self.served_makespan)
        return first if objective is Objective.MAKESPAN else (*first, self.cost)

    def is_better_than(self, other: "Evaluation", objective: Objective) -> bool:
        """Return whether this scores better than `other`; values within 1e-9 (relative) count as equal."""
        if self.unserved_rank != other.unserved_rank:
            return self.unserved_rank < other.unserved_rank
        for mine, theirs in zip(self.key(objective), other.key(objective), strict=True):
            if abs(mine - theirs) > RELATIVE_TOLERANCE * max(abs(mine), abs(theirs)):
                return mine < theirs
        return False


def evaluate(instance: Instance, allocation: Allocation) -> Evaluation:
    """Score `allocation` on `instance`.

    Takes O(n + m) time, or O(n log n) if agents have speeds.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation
        Of `instance`; it may break rules, see `Evaluation.violations`.

    Returns
    -------
    Evaluation

    Raises
    ------
    InputError
        If the number of agents differs, or a task index is out of range.

    References
    ----------
    Fang et al. (2025), equations (1)-(4) and (19), doi:10.20944/preprints202502.0192.v1.
    """
    task = require_fit(instance, allocation)
    sent = np.flatnonzero(task != IDLE)
    allowed = instance.reach.allows(sent, task[sent])
    agent, goal = sent[allowed], task[sent[allowed]]
    reach = instance.reach
    origin, distance = reach.origin[agent], reach.distance_of(agent, goal)
    flown = reach.flown(origin, goal, distance)
    group_ability = np.bincount(goal, weights=instance.ability[agent], minlength=instance.m).astype(np.float64)
    time = _completion_times(instance, agent, goal, distance, group_ability)
    unserved = (instance.workload > 0) & (group_ability == 0)
    coverage = group_ability - instance.workload
    reward, saturated = _reward(coverage, instance.tau)
    served_makespan = float(time[~unserved].max(initial=0.0))
    with np.errstate(over="ignore"):
        length = min(reach.trips(origin, goal, distance).sum(), sys.float_info.max)
        total = min(flown.sum(), sys.float_info.max)
        energy = min(total * reach.energy_per_distance, sys.float_info.max)
        cost = energy
        if reach.move is not None:
            total = min(reach.costs(origin, goal, distance).sum(), sys.float_info.max)
            cost = min(total * reach.energy_per_distance, sys.float_info.max)
    for array in (time, group_ability, coverage):
        array.setflags(write=False)
    return Evaluation(
        completion_time=time,
        group_ability=group_ability,
        coverage=coverage,
        makespan=None if unserved.any() else served_makespan,
        served_makespan=served_makespan,
        distance=float(length),
        energy=float(energy),
        cost=float(cost),
        cost_in_distance=float(total),
        battery_remaining_percent=_battery_percent(instance, agent, flown),
        reward=reward,
        reward_saturated=saturated,
        unserved_tasks=tuple(np.flatnonzero(unserved).tolist()),
        unserved_priorities=tuple(np.sort(instance.priority[unserved])[::-1].tolist()),
        violations=tuple(_violations(instance, sent[~allowed], task)),
    )


def _completion_times(
    instance: Instance, agent: IntArray, goal: IntArray, distance: FloatArray, group_ability: FloatArray
) -> FloatArray:
    work = instance.workload
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        time = np.where(work > 0, work / group_ability, 0.0)
        time[group_ability > 0] = np.minimum(time[group_ability > 0], sys.float_info.max)
        arrival = distance / instance.speed[agent]
    if not instance.has_travel_time:
        return time
    late = np.zeros(instance.m, dtype=bool)
    late[goal[arrival > 0]] = True
    order = np.argsort(goal, kind="stable")
    bounds = np.searchsorted(goal[order], np.arange(instance.m + 1))
    for task in np.flatnonzero(late & (work > 0)):
        group = order[bounds[task] : bounds[task + 1]]
        hour = completion_time(work[task], instance.ability[agent[group]], arrival[group])
        time[task] = min(hour, sys.float_info.max)
    return time


def completion_time(workload: float, ability: FloatArray, arrival: FloatArray) -> float:
    """Return the hour T at which a group finishes a task, if each member works from its arrival on.

    T is the root of ``sum_i ability_i * max(0, T - arrival_i) = workload``: the minimum over k of the time at which
    the first k members to arrive would finish alone.

    Parameters
    ----------
    workload : float
        Work to be done, > 0.
    ability, arrival : ndarray, shape (k,)
        Work per hour, and hour of arrival, of each member; k >= 1.
    """
    order = np.argsort(arrival)
    rate = np.cumsum(ability[order])
    with np.errstate(over="ignore"):
        return float(((workload + np.cumsum(ability[order] * arrival[order])) / rate).min())


def _reward(coverage: FloatArray, tau: float) -> tuple[float, bool]:
    exponent = coverage * np.log(tau)
    limit = np.log(sys.float_info.max)
    with np.errstate(over="ignore", under="ignore"):
        total = float(np.exp(np.minimum(exponent, limit)).sum())
    if (exponent > limit).any() or not np.isfinite(total):
        return -sys.float_info.max, True
    return -total, False


def _battery_percent(instance: Instance, agent: IntArray, flown: FloatArray) -> float | None:
    has_battery = np.isfinite(instance.battery)
    if not has_battery.any():
        return None
    used = np.zeros(instance.n)
    with np.errstate(over="ignore"):
        used[agent] = flown * instance.reach.energy_per_distance
    used, capacity = used[has_battery], instance.battery[has_battery]
    share = np.divide(used, capacity, out=np.zeros_like(used), where=capacity > 0)
    return float(100 * (1 - np.minimum(share, 1)).mean())


def _violations(instance: Instance, agents: IntArray, task: IntArray) -> list[Violation]:
    return [
        Violation(agent, int(task[agent]), reason_of(instance, agent, int(task[agent]))) for agent in agents.tolist()
    ]


def reason_of(instance: Instance, agent: int, task: int) -> str:
    """Return the reason why an agent cannot take a task, given that it cannot."""
    reach = instance.reach
    origin, goal = reach.origin[[agent]], np.array([task])
    away = reach.distances_between(origin, goal)
    allowed = None if instance.allowed_tasks is None else instance.allowed_tasks[agent]
    if allowed is not None and task not in allowed:
        return "the agent may not do this task"
    lacking = _lacking(instance, agent, task)
    if lacking:
        return f"the agent lacks {', '.join(map(repr, lacking))}"
    bound_to = reach.list_of[origin[0]]
    if bound_to >= 0 and task not in reach.lists[bound_to]:
        given = reach.geometry.given
        is_given = given is not None and task in given.chosen(origin).task
        home = f"from it back to {_return_name(instance, agent)}" if is_given else "to it"
        return f"there is no way {home} in the table of distances"
    if away[0] > instance.communication_range[agent] + TOLERANCE:
        return f"distance {away[0]:g} exceeds the range {instance.communication_range[agent]:g}"
    needed = reach.energy_per_distance * reach.flown(origin, goal, away)[0]
    back = f" (with the flight back to {_return_name(instance, agent)})" if instance.returns[agent] else ""
    return f"energy {needed:g} exceeds the battery {instance.battery[agent]:g}{back}"


def _return_name(instance: Instance, agent: int) -> str:
    base = instance.return_base[agent]
    return instance.bases.ids[base] if base >= 0 else "its start"


def _lacking(instance: Instance, agent: int, task: int) -> list[str]:
    """Return the skills that a task needs and an agent lacks."""
    if instance.needs is None:
        return []
    held = () if instance.skills is None else instance.skills[agent]
    return [name for name in instance.needs[task] if name not in held]
