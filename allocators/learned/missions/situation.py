"""An agent's knowledge at a decision as arrays, the same from a compiled mission and from a view of the reference."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.missions.layout import IDLE, NOBODY, TO_TASK, WORKING, MissionArrays
from alloc.allocators.missions.motion import battery_of, can_fly, distance_between, place_of
from alloc.allocators.missions.records import Report
from alloc.allocators.runtime.compiled import inlined
from alloc.problems.fields import BoolArray, FloatArray, IntArray

MEMORY = 20
"""Number of radio periods after which reports on other agents are ignored."""


class Expected(NamedTuple):
    """The agents that come to each task, as determined by `expect`.

    Attributes
    ----------
    first : ndarray of int, shape (m,)
        First agent at each task, -1 for none.
    following : ndarray of int, shape (n,)
        Next agent that comes to the same task, -1 for none.
    others : ndarray of int, shape (m,)
        Number of other agents at each task or on their way to it.
    without : ndarray, shape (m,)
        Hour at which these complete the task, ``inf`` if there are none.
    idle : ndarray of int, shape (n,)
        Other agents without a task.
    last, working : ndarray of int, shape (m,)
        Last agent that comes to each task, and last of those that already work there.
    idle_places, task_places : ndarray, shape (3, n) and (3, m)
        Positions of the agents without a task, and of the tasks of the options.
    """

    first: IntArray
    following: IntArray
    others: IntArray
    without: FloatArray
    idle: IntArray
    last: IntArray
    working: IntArray
    idle_places: FloatArray
    task_places: FloatArray


class Situation(NamedTuple):
    """Knowledge of one agent of itself, tasks and other agents.

    Attributes
    ----------
    own : ndarray, shape (OWN,)
        Figures of the agent itself, by the indices below.
    task : ndarray, shape (TASK, m)
        Figures of each task, by the indices below.
    can : ndarray of bool, shape (m,)
        Whether the agent knows the task to be open, and can take it.
    other : ndarray, shape (OTHER, n)
        Figures of each other agent that counts, by the indices below; those from `OTHER_Z` on only of agents without a
        task.
    target : ndarray of int, shape (n,)
        Task to which another agent goes or at which it works, -1 for none.
    counts : ndarray of bool, shape (n,)
        Whether the entry is another agent with a recent report.
    others : ndarray of int, shape (1,)
        Number of entries of other agents in use; further ones are ignored.
    expected : Expected
        Workspace for derived figures.
    """

    own: FloatArray
    task: FloatArray
    can: BoolArray
    other: FloatArray
    target: IntArray
    counts: BoolArray
    others: IntArray
    expected: Expected


HOUR, X, Y, Z, ABILITY, SPEED, BATTERY, ENERGY_PER_DISTANCE, SPAN = range(9)
TARGET, IS_WORKING, IS_FLYING, METRIC, OWN = range(9, 14)
"""Indices of the agent's own figures; `SPAN` is the longest distance in the area, `TARGET` the task of its order, or
-1."""

EUCLIDEAN_WAYS, MANHATTAN_WAYS, OTHER_WAYS = range(3)
"""Values of `METRIC`; distances other than these two cannot be computed from coordinates."""

TASK_X, TASK_Y, TASK_Z, LEFT, KNOWN_AT, PRIORITY, DEADLINE, GROWTH, DISTANCE, TASK = range(10)
"""Indices of the figures of a task; `DISTANCE` is that from the agent."""

ARRIVES, STRENGTH, OTHER_X, OTHER_Y, OTHER_Z, PACE, CHARGE, PRICE, HEARD, IS_FREE, OTHER = range(11)
"""Indices of the figures of another agent: arrival hour at its task, ability, position, speed, battery, energy per
distance, hour of the report, and whether it was idle."""


def empty(n: int, m: int) -> Situation:
    """Return an empty situation."""
    return Situation(
        own=np.zeros(OWN),
        task=np.zeros((TASK, m)),
        can=np.zeros(m, np.bool_),
        other=np.zeros((OTHER, n)),
        target=np.full(n, NOBODY),
        counts=np.zeros(n, np.bool_),
        others=np.full(1, n, np.intp),
        expected=Expected(
            first=np.full(m, NOBODY),
            following=np.full(n, NOBODY),
            others=np.zeros(m, np.intp),
            without=np.full(m, np.inf),
            idle=np.full(n, NOBODY),
            last=np.full(m, NOBODY),
            working=np.full(m, NOBODY),
            idle_places=np.zeros((3, n)),
            task_places=np.zeros((3, m)),
        ),
    )


@inlined
def fill(state: MissionArrays, number: int, situation: Situation) -> None:
    """Write an agent's knowledge in a compiled mission."""
    fill_own(state, number, situation.own)
    fill_tasks(state, number, situation.task, situation.can)
    fill_others(state, number, situation, MEMORY * state.head[0].period)


@inlined
def fill_own(state: MissionArrays, number: int, own: FloatArray) -> None:
    """Write an agent's knowledge of itself."""
    head, agent = state.head[0], state.agents[number]
    own[HOUR] = head.hour
    own[X], own[Y], own[Z] = place_of(agent, head.hour)
    own[ABILITY], own[SPEED] = agent.ability, agent.speed
    own[BATTERY], own[ENERGY_PER_DISTANCE] = battery_of(agent, head.hour), agent.energy_per_distance
    own[SPAN] = head.span
    own[TARGET] = agent.order_task if agent.order == TO_TASK else NOBODY
    own[IS_WORKING], own[IS_FLYING] = agent.task != NOBODY, agent.flight != 0
    own[METRIC] = MANHATTAN_WAYS if head.is_manhattan else EUCLIDEAN_WAYS


@inlined
def fill_tasks(state: MissionArrays, number: int, task: FloatArray, can: BoolArray) -> None:
    """Write an agent's knowledge of tasks."""
    head, agent = state.head[0], state.agents[number]
    here, battery = place_of(agent, head.hour), battery_of(agent, head.hour)
    hours, left, allowed = state.task_hour[agent.known], state.task_left[agent.known], state.allowed[number]
    for j in range(len(can)):
        can[j] = hours[j] >= 0 and left[j] >= 0
        if can[j]:
            facts = state.tasks[j]
            place = (facts.x, facts.y, facts.z)
            is_order = agent.order == TO_TASK and agent.order_task == j
            can[j] = is_order or (allowed[j] and can_fly(head.is_manhattan, agent, here, battery, place))
            task[TASK_X, j], task[TASK_Y, j], task[TASK_Z, j] = place
            task[LEFT, j], task[KNOWN_AT, j] = left[j], hours[j]
            task[PRIORITY, j], task[DEADLINE, j] = facts.priority, facts.deadline
            task[GROWTH, j] = facts.growth
            task[DISTANCE, j] = distance_between(head.is_manhattan, here, place)


@inlined
def does_count(report: Report, who: int, number: int, hour: float, memory: float) -> bool:
    """Return whether a report on another agent counts: at most `memory` hours old, and the agent takes orders."""
    return who != number and hour - report.hour <= memory and IDLE <= report.status <= WORKING


@inlined
def fill_others(state: MissionArrays, number: int, situation: Situation, memory: float) -> None:
    """Write an agent's knowledge of the other agents that count, with reports at most `memory` hours old."""
    head, row, found = state.head[0], state.agents[number].known, 0
    oldest = head.oldest
    known, task_hours = state.known_report[row], state.task_hour[row]
    other, target, counts = situation.other, situation.target, situation.counts
    for who in range(len(known)):
        if known[who] < oldest:
            continue
        report = state.reports[known[who]]
        if not does_count(report, who, number, head.hour, memory):
            continue
        agent = state.agents[who]
        other[ARRIVES, found], other[STRENGTH, found] = report.arrives, agent.ability
        other[OTHER_X, found], other[OTHER_Y, found] = report.x, report.y
        target[found] = report.task if report.task != NOBODY and task_hours[report.task] >= 0 else NOBODY
        if target[found] == NOBODY:
            other[OTHER_Z, found], other[PACE, found] = report.z, agent.speed
            other[CHARGE, found], other[PRICE, found] = report.battery, agent.energy_per_distance
            other[HEARD, found], other[IS_FREE, found] = report.hour, report.status == IDLE
        counts[found] = True
        found += 1
    clear_others(situation, found)


@inlined
def clear_others(situation: Situation, found: int) -> None:
    """Mark only the first `found` entries of other agents as in use."""
    for place in range(found, situation.others[0]):
        situation.counts[place] = False
    situation.others[0] = found
