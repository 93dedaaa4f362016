"""The task of highest utility, compiled: see `alloc.allocators.online.policies.outlook`."""

import math

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.options import completion_with, expect
from alloc.allocators.learned.missions.play import Buffers
from alloc.allocators.learned.missions.situation import Situation, does_count, fill_others, fill_own, fill_tasks
from alloc.allocators.missions.layout import NOBODY, MissionArrays
from alloc.allocators.missions.motion import distance_between
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray


@compiled_in_place
def fill_with(state: MissionArrays, number: int, situation: Situation, memory: float, goals: FloatArray) -> None:
    """Fill in what an agent knows; reports of other agents count up to `memory` hours.

    Parameters
    ----------
    state : MissionArrays
    number : int
        Index of the agent.
    situation : Situation
    memory : float
    goals : ndarray, shape (n,) or (0,)
        Agreed task of each agent, -1 for none; if empty, the tasks in the last reports count.
    """
    fill_own(state, number, situation.own)
    fill_tasks(state, number, situation.task, situation.can)
    fill_others(state, number, situation, memory)
    if len(goals):
        redirect(state, number, situation, memory, goals)


@compiled_in_place
def redirect(state: MissionArrays, number: int, situation: Situation, memory: float, goals: FloatArray) -> None:
    """Replace the tasks of other agents by the agreed ones, with arrivals from their last reported places."""
    head, row, found = state.head[0], state.agents[number].known, 0
    for i in range(len(state.agents)):
        report = state.reports[state.known_report[row, i]]
        if not does_count(report, i, number, head.hour, memory):
            continue
        goal = int(goals[i])
        situation.target[found] = goal if goal != NOBODY and state.task_hour[row, goal] >= 0 else NOBODY
        if goal != report.task and situation.target[found] != NOBODY:
            facts = state.tasks[goal]
            way = distance_between(head.is_manhattan, (report.x, report.y, report.z), (facts.x, facts.y, facts.z))
            situation.other[known.ARRIVES, found] = report.hour + way / state.agents[i].speed
        found += 1


@compiled_in_place
def best_task(buffers: Buffers, home: int, parameters: FloatArray) -> int:
    """Return the task of highest utility in the situation of `buffers`, -1 for none.

    Parameters
    ----------
    buffers : Buffers
    home : int
        The agent's present task, -1 for none.
    parameters : ndarray
        In the order of `UtilityParameters`.
    """
    stay, _, missed, crowding, flight, age = parameters
    situation = buffers.situation
    expect(situation)
    others, without = situation.expected.others, situation.expected.without
    own, task, best, highest = situation.own, situation.task, NOBODY, 0.0
    hour = own[known.HOUR]
    for j in range(len(situation.can)):
        if not situation.can[j]:
            continue
        is_there = own[known.TARGET] == j and own[known.IS_WORKING] > 0
        arrival = hour + (0.0 if is_there else task[known.DISTANCE, j] / own[known.SPEED])
        left, since = task[known.LEFT, j], task[known.KNOWN_AT, j]
        if others[j] == 0 and not is_there:
            left += task[known.GROWTH, j] * (arrival - since)
        with_me = completion_with(situation, j, arrival, left)
        if with_me >= without[j]:
            continue
        hours = with_me - hour
        value = (1.0 if hours <= 0 else (with_me - arrival) / hours) * (task[known.PRIORITY, j] + 1e-6)
        value = value / (1 + crowding * others[j]) * math.exp(-flight * (arrival - hour) - age * (hour - since))
        value *= missed if with_me > task[known.DEADLINE, j] else 1.0
        value *= stay if home == j else 1.0
        if value > highest:
            best, highest = j, value
    return best
