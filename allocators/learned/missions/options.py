"""The options of an agent in a mission, and what the network is told of each, compiled."""

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.densities import NOT_AS_FAR, fill_densities
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
        Others by the hours at which they arrive; then -1, and -2 - i for each i that has no task.
    others, rate, without : ndarray, shape (m,)
        Others at each task or on their way, their ability, and the hour at which they have done it.
    """
    arrives, target, counts = situation.other[known.ARRIVES], situation.target, situation.counts
    others[:] = 0
    rate[:] = 0.0
    without[:] = np.inf
    done = np.zeros(len(without))
    rank[:] = -1
    found, last = 0, len(rank)
    for i in range(len(target)):
        if counts[i] and target[i] < 0:
            last -= 1
            rank[last] = -2 - i
        elif counts[i]:
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


@compiled
def in_turn(rank: IntArray, target: IntArray, tasks: int) -> tuple[IntArray, IntArray]:
    """Return who comes to each task first, and who comes there after each other agent; -1 for nobody."""
    first, following = np.full(tasks, -1), np.full(len(rank), -1)
    for place in range(len(rank) - 1, -1, -1):
        i = rank[place]
        if i >= 0:
            following[i] = first[target[i]]
            first[target[i]] = i
    return first, following


@inlined
def done_with(
    situation: Situation, first: int, following: IntArray, arrival: float, left: float, since: float
) -> float:
    """Return the hour at which a task is done if the agent arrives at an hour, with others who come there in turn."""
    arrives, strength, ability = (
        situation.other[known.ARRIVES],
        situation.other[known.STRENGTH],
        situation.own[known.ABILITY],
    )
    rate = work = 0.0
    hour, i, is_in = np.inf, first, False
    while i >= 0 or not is_in:
        is_next = not is_in and (i < 0 or arrives[i] > arrival)
        begin = max(arrival if is_next else arrives[i], since)
        if begin >= hour:
            break
        added = ability if is_next else strength[i]
        rate += added
        work += added * begin
        hour = (left + work) / rate
        if is_next:
            is_in = True
        else:
            i = following[i]
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
    first, following = in_turn(rank, situation.target, len(without))
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
        j = choice[row]
        fill_task(situation, j, options[row], rank, first[j], following, others[j], without[j])
    fill_crowding(situation, choice[:tasks], options)
    for row in range(tasks, count):
        option = options[row]
        if choice[row] == LOOK:
            option[names.TRAVEL], option[names.UNSEEN], option[names.EXPLORES] = look[1], look[2], 1
            option[names.IS_ORDER] = situation.own[known.IS_FLYING] and situation.own[known.TARGET] < 0
        else:
            option[names.STAYS] = 1
    fill_whole(situation, choice, tasks, options[:count])
    fill_densities(situation, choice, tasks, others, options[:count])
    return count


@inlined
def fill_task(
    situation: Situation,
    j: int,
    option: Singles,
    rank: IntArray,
    first: int,
    following: IntArray,
    others: int,
    without: float,
) -> None:
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
    with_me = max(hour, done_with(situation, first, following, arrival, left, task[known.KNOWN_AT, j]))
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
    option[names.RIVALS] = squashed(rivals(situation, rank, j, distance) / 3.0)


@inlined
def rivals(situation: Situation, rank: IntArray, j: int, distance: float) -> float:
    """Return how many others that have no task are nearer to one."""
    other, found = situation.other, 0.0
    x, y, z = situation.task[known.TASK_X, j], situation.task[known.TASK_Y, j], situation.task[known.TASK_Z, j]
    for place in range(len(rank) - 1, -1, -1):
        if rank[place] >= -1:
            break
        i = -2 - rank[place]
        dx, dy, dz = other[known.OTHER_X, i] - x, other[known.OTHER_Y, i] - y, other[known.OTHER_Z, i] - z
        found += dx * dx + dy * dy + dz * dz < distance * distance * NOT_AS_FAR
    return found


@compiled
def fill_crowding(situation: Situation, tasks: IntArray, options: Singles) -> None:
    """Fill in how much other work there is near each task."""
    task, near = situation.task, (NEAR * situation.own[known.SPAN]) ** 2
    x, y, z = task[known.TASK_X][tasks], task[known.TASK_Y][tasks], task[known.TASK_Z][tasks]
    for row in range(len(tasks)):
        at_x, at_y, at_z, found = x[row], y[row], z[row], 0
        for place in range(len(tasks)):
            dx, dy, dz = x[place] - at_x, y[place] - at_y, z[place] - at_z
            found += dx * dx + dy * dy + dz * dz < near
        is_near_itself = near > 0.0 and at_x == at_x
        options[row, names.CROWDING] = squashed((found - is_near_itself) / 3.0)


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
