"""The options of an agent in a mission, and what the network is told of each, compiled."""

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network_arrays import Singles
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems.fields import FloatArray, IntArray

LOOK, WAIT = -1, -2
"""Options that are no task: to look around, and to stay."""

NEAR = 0.15
"""Part of the span within which other work counts as near by."""


@inlined
def squashed(value: float) -> float:
    """Return a number in [0, 1] for one from 0 to infinity."""
    return 1.0 - 1.0 / (1.0 + value)


@compiled
def time_scale(own: FloatArray) -> float:
    """Return the hours of the longest flight of an agent; 1 where flights take no time."""
    hours = own[known.SPAN] / own[known.SPEED]
    return hours if hours > 0 else 1.0


@compiled
def expect(situation: Situation, rank: IntArray, others: IntArray, rate: FloatArray, without: FloatArray) -> None:
    """Fill in who comes to each task, and when it is done without the agent.

    Parameters
    ----------
    situation : Situation
    rank : ndarray of int, shape (n,)
        Others by the hours at which they arrive; those that have no task last.
    others, rate, without : ndarray, shape (m,)
        Others at each task or on their way, their ability, and the hour at which they have done it.
    """
    arrives, target, counts = situation.other[known.ARRIVES], situation.target, situation.counts
    others[:] = 0
    rate[:] = 0.0
    without[:] = np.inf
    done = np.zeros(len(without))
    found = 0
    for i in range(len(target)):
        if counts[i] and target[i] >= 0:
            place = found
            while place > 0 and arrives[rank[place - 1]] > arrives[i]:
                rank[place] = rank[place - 1]
                place -= 1
            rank[place] = i
            found += 1
    for place in range(found):
        i = rank[place]
        j = target[i]
        others[j] += 1
        begin = max(arrives[i], situation.task[known.KNOWN_AT, j])
        if begin < without[j]:
            rate[j] += situation.other[known.STRENGTH, i]
            done[j] += situation.other[known.STRENGTH, i] * begin
            without[j] = (situation.task[known.LEFT, j] + done[j]) / rate[j]
    rank[found:] = -1


@compiled
def done_with(situation: Situation, rank: IntArray, j: int, arrival: float, left: float) -> float:
    """Return the hour at which a task is done if the agent arrives at an hour."""
    arrives, since = situation.other[known.ARRIVES], situation.task[known.KNOWN_AT, j]
    rate = work = 0.0
    hour = np.inf
    is_in = False
    for place in range(len(rank) + 1):
        i = rank[place] if place < len(rank) else -1
        if i >= 0 and situation.target[i] != j:
            continue
        if not is_in and (i < 0 or arrives[i] > arrival):
            begin = max(arrival, since)
            if begin >= hour:
                return hour
            is_in = True
            rate += situation.own[known.ABILITY]
            work += situation.own[known.ABILITY] * begin
            hour = (left + work) / rate
        if i < 0:
            return hour
        begin = max(arrives[i], since)
        if begin >= hour:
            return hour
        rate += situation.other[known.STRENGTH, i]
        work += situation.other[known.STRENGTH, i] * begin
        hour = (left + work) / rate
    return hour


@compiled
def fill_options(
    situation: Situation,
    look: FloatArray,
    options: Singles,
    choice: IntArray,
    rank: IntArray,
    others: IntArray,
    rate: FloatArray,
    without: FloatArray,
) -> int:
    """Fill in the options of an agent and their features; return how many there are.

    Parameters
    ----------
    situation : Situation
    look : ndarray, shape (3,)
        Whether it can look around, and how far off and how long unseen that place is, both from 0 to 1.
    options : ndarray, shape (m + 2, FEATURES)
    choice : ndarray of int, shape (m + 2,)
        Task of each, `LOOK` or `WAIT`.
    rank, others, rate, without : ndarray
        Scratch, see `expect`.
    """
    expect(situation, rank, others, rate, without)
    count = 0
    for j in range(len(situation.can)):
        if situation.can[j]:
            choice[count] = j
            count += 1
    tasks = count
    if look[0]:
        choice[count] = LOOK
        count += 1
    choice[count] = WAIT
    count += 1
    options[:count] = 0
    for row in range(tasks):
        fill_task(situation, choice[row], options[row], rank, others[choice[row]], without[choice[row]])
    for row in range(tasks):
        options[row, names.CROWDING] = crowding(situation, choice, tasks, row)
    for row in range(tasks, count):
        option = options[row]
        if choice[row] == LOOK:
            option[names.TRAVEL], option[names.UNSEEN], option[names.EXPLORES] = look[1], look[2], 1
            option[names.IS_ORDER] = situation.own[known.IS_FLYING] and situation.own[known.TARGET] < 0
        else:
            option[names.STAYS] = 1
    fill_whole(situation, choice, tasks, options[:count])
    return count


@inlined
def fill_task(situation: Situation, j: int, option: Singles, rank: IntArray, others: int, without: float) -> None:
    """Fill the features of a task."""
    own, task = situation.own, situation.task
    hour, scale = own[known.HOUR], time_scale(own)
    is_order = own[known.TARGET] == j
    is_there = is_order and own[known.IS_WORKING] > 0
    distance = 0.0 if is_there else task[known.DISTANCE, j]
    arrival = hour + distance / own[known.SPEED]
    left = task[known.LEFT, j]
    if others == 0 and not is_there:
        left += task[known.GROWTH, j] * (arrival - task[known.KNOWN_AT, j])
    with_me = max(hour, done_with(situation, rank, j, arrival, left))
    option[names.TRAVEL] = min(distance / own[known.SPAN], 2.0) if own[known.SPAN] > 0 else 0.0
    option[names.WITH_ME] = squashed((with_me - hour) / scale)
    option[names.WITHOUT] = squashed(max(0.0, without - hour) / scale)
    option[names.IS_ORDER], option[names.IS_WORK] = is_order, is_there
    option[names.OTHERS], option[names.IS_ALONE] = squashed(others / 3.0), others == 0
    option[names.WORK] = squashed(left / own[known.ABILITY] / scale)
    option[names.IS_LATE] = without <= arrival
    option[names.AGE] = squashed((hour - task[known.KNOWN_AT, j]) / scale)
    option[names.SHARE] = (with_me - arrival) / (with_me - hour) if with_me > hour else 1.0
    option[names.SHARE] = max(option[names.SHARE], np.float32(0))
    option[names.GAIN] = squashed(max(0.0, without - with_me) / scale)
    deadline = task[known.DEADLINE, j]
    option[names.SLACK] = min(1.0, max(-1.0, (deadline - with_me) / scale))
    option[names.MISSES] = with_me > deadline
    option[names.GROWTH] = squashed(task[known.GROWTH, j] / own[known.ABILITY])
    energy = own[known.ENERGY_PER_DISTANCE] * distance
    option[names.ENERGY] = min(1.0, energy / own[known.BATTERY]) if energy > 0 else 0.0
    option[names.RIVALS] = squashed(rivals(situation, j, distance) / 3.0)


@inlined
def rivals(situation: Situation, j: int, distance: float) -> float:
    """Return how many others that have no task are nearer to one."""
    other, found = situation.other, 0.0
    for i in range(len(situation.counts)):
        if situation.counts[i] and situation.target[i] < 0:
            x = other[known.OTHER_X, i] - situation.task[known.TASK_X, j]
            y = other[known.OTHER_Y, i] - situation.task[known.TASK_Y, j]
            z = other[known.OTHER_Z, i] - situation.task[known.TASK_Z, j]
            found += x * x + y * y + z * z < distance * distance
    return found


@inlined
def crowding(situation: Situation, choice: IntArray, tasks: int, row: int) -> float:
    """Return how much other work there is near a task."""
    at, j, found = situation.task, choice[row], 0.0
    near = (NEAR * situation.own[known.SPAN]) ** 2
    for place in range(tasks):
        u = choice[place]
        x = at[known.TASK_X, u] - at[known.TASK_X, j]
        y = at[known.TASK_Y, u] - at[known.TASK_Y, j]
        z = at[known.TASK_Z, u] - at[known.TASK_Z, j]
        found += x * x + y * y + z * z < near and place != row
    return squashed(found / 3.0)


@compiled
def fill_whole(situation: Situation, choice: IntArray, tasks: int, options: Singles) -> None:
    """Fill the features that all options share, and those that compare with a mean."""
    own, agents, ability = situation.own, 1.0, situation.own[known.ABILITY]
    for i in range(len(situation.counts)):
        if situation.counts[i]:
            agents += 1
            ability += situation.other[known.STRENGTH, i]
    priority = work = 0.0
    for row in range(tasks):
        priority += situation.task[known.PRIORITY, choice[row]] / tasks
        work += situation.task[known.LEFT, choice[row]]
    for row in range(len(options)):
        option = options[row]
        option[names.TASKS_PER_AGENT] = squashed(tasks / agents)
        option[names.KNOWN_AGENTS] = squashed((agents - 1) / 5.0)
        option[names.WORK_AHEAD] = squashed(work / ability / time_scale(own))
        if row < tasks:
            option[names.STRENGTH] = min(3.0, own[known.ABILITY] * agents / ability - 1)
            own_priority = situation.task[known.PRIORITY, choice[row]]
            option[names.PRIORITY] = own_priority / (own_priority + priority) - 0.5 if priority > 0 else 0.0
