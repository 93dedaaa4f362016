"""The options of an agent in a mission and their features, in compiled loops."""

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network_arrays import Singles
from alloc.allocators.learned.missions.situation import Expected, Situation
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.missions.motion import Point
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import FloatArray, IntArray

EXPLORE, WAIT = -1, -2
"""Options other than tasks: to explore, and to stay."""

NEAR = 0.15
"""Share of the span within which other work counts as nearby."""


THIRDS = (1.0 - 1.0 / (1.0 + np.arange(64) / 3.0)).astype(np.float32)
"""The values of `squashed_count` for small numbers, as divisions take long."""


@inlined
def squashed(value: float, unit: float) -> float:
    """Map a number in [0, inf] of units to [0, 1]: x to x / (1 + x)."""
    return 1.0 - unit / (unit + value)


@inlined
def squashed_count(count: int) -> np.float32:
    """Map a number of agents or tasks to [0, 1]."""
    return THIRDS[count] if count < len(THIRDS) else np.float32(squashed(count, 3.0))


@compiled_in_place
def time_scale(own: FloatArray) -> float:
    """Return the hours of the longest flight of an agent; 1 if flights take no time."""
    hours = own[known.SPAN] / own[known.SPEED]
    return hours if hours > 0 else 1.0


@inlined
def expect(situation: Situation) -> int:
    """Write which agents come to each task, and when it is done without the agent; return how many others are idle.

    Only tasks that the agent can take are considered.
    """
    expected, arrives, target = situation.expected, situation.other[known.ARRIVES], situation.target
    expected.first[:] = NOBODY
    found = 0
    for i in range(situation.others[0]):
        if not situation.counts[i]:
            continue
        if target[i] == NOBODY:
            expected.idle[found] = i
            for axis in range(3):
                expected.idle_places[axis, found] = situation.other[known.OTHER_X + axis, i]
            found += 1
        else:
            insert_arrival(expected, arrives, target[i], i)
    for j in range(len(situation.can)):
        if situation.can[j]:
            expected.others[j], expected.without[j] = completion_without(situation, j)
    return found


@inlined
def insert_arrival(expected: Expected, arrives: FloatArray, j: int, i: int) -> None:
    """Insert another agent that comes to a task after those that arrive no later, usually at the end."""
    first, following, last, working = expected.first, expected.following, expected.last, expected.working
    before, after = NOBODY, first[j]
    if after != NOBODY and arrives[last[j]] <= arrives[i]:
        before, after = last[j], NOBODY
    elif after != NOBODY and arrives[after] == -np.inf:
        before, after = working[j], following[working[j]]
    while after != NOBODY and arrives[after] <= arrives[i]:
        before, after = after, following[after]
    following[i] = after
    if before == NOBODY:
        first[j] = i
    else:
        following[before] = i
    if after == NOBODY:
        last[j] = i
    if arrives[i] == -np.inf:
        working[j] = i


@inlined
def completion_without(situation: Situation, j: int) -> tuple[int, float]:
    """Return how many other agents come to a task, and the hour at which they complete it."""
    arrives, strength, following = (
        situation.other[known.ARRIVES],
        situation.other[known.STRENGTH],
        situation.expected.following,
    )
    left, since = situation.task[known.LEFT, j], situation.task[known.KNOWN_AT, j]
    others, rate, work, hour, i = 0, 0.0, 0.0, np.inf, situation.expected.first[j]
    while i != NOBODY:
        others += 1
        begin = max(arrives[i], since)
        if begin < hour:
            rate += strength[i]
            work += strength[i] * begin
            hour = (left + work) / rate
        i = following[i]
    return others, hour


@inlined
def completion_with(situation: Situation, j: int, arrival: float, left: float) -> float:
    """Return the hour at which a task is done if the agent arrives at `arrival`, together with the other agents."""
    arrives, strength, following = (
        situation.other[known.ARRIVES],
        situation.other[known.STRENGTH],
        situation.expected.following,
    )
    ability, since = situation.own[known.ABILITY], situation.task[known.KNOWN_AT, j]
    rate = work = 0.0
    hour, i, is_in = np.inf, situation.expected.first[j], False
    while i != NOBODY or not is_in:
        is_next = not is_in and (i == NOBODY or arrives[i] > arrival)
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


@compiled_in_place
def fill_options(situation: Situation, look: FloatArray, options: Singles, choice: IntArray) -> int:
    """Write the options of an agent and their features; return the number of options.

    Parameters
    ----------
    situation : Situation
    look : ndarray, shape (3,)
        Whether it can explore, and the distance of that place and the time since it was last seen, both from 0 to 1.
    options : ndarray, shape (m + 2, FEATURES)
    choice : ndarray of int, shape (m + 2,)
        Task of each option, `EXPLORE` or `WAIT`.
    """
    idle = expect(situation)
    count = 0
    for j in range(len(situation.can)):
        if situation.can[j]:
            choice[count] = j
            count += 1
    tasks, scale = count, time_scale(situation.own)
    if look[0]:
        choice[count] = EXPLORE
        count += 1
    choice[count] = WAIT
    count += 1
    options[:count] = 0
    for row in range(tasks):
        fill_task(situation, choice[row], options[row], idle, scale)
    fill_crowding(situation, choice[:tasks], options)
    for row in range(tasks, count):
        option = options[row]
        if choice[row] == EXPLORE:
            option[names.TRAVEL], option[names.UNSEEN], option[names.EXPLORES] = look[1], look[2], 1
            option[names.IS_ORDER] = situation.own[known.IS_FLYING] and situation.own[known.TARGET] < 0
        else:
            option[names.STAYS] = 1
    fill_whole(situation, choice, tasks, options[:count])
    return count


@inlined
def fill_task(situation: Situation, j: int, option: Singles, idle: int, scale: float) -> None:
    """Write the features of a task; `scale` is the unit of times."""
    own, task = situation.own, situation.task
    others, without = situation.expected.others[j], situation.expected.without[j]
    hour = own[known.HOUR]
    is_order = own[known.TARGET] == j
    is_there = is_order and own[known.IS_WORKING] > 0
    distance = 0.0 if is_there else task[known.DISTANCE, j]
    arrival = hour + distance / own[known.SPEED]
    left = task[known.LEFT, j]
    if others == 0 and not is_there:
        left += task[known.GROWTH, j] * (arrival - task[known.KNOWN_AT, j])
    with_me = max(hour, completion_with(situation, j, arrival, left))
    option[names.TRAVEL] = min(distance / own[known.SPAN], 2.0) if own[known.SPAN] > 0 else 0.0
    option[names.WITH_ME] = squashed(with_me - hour, scale)
    option[names.WITHOUT] = squashed(max(0.0, without - hour), scale)
    option[names.IS_ORDER], option[names.IS_WORK] = is_order, is_there
    option[names.OTHERS], option[names.IS_ALONE] = squashed_count(others), others == 0
    option[names.WORK] = squashed(left, own[known.ABILITY] * scale)
    option[names.IS_LATE] = without <= arrival
    option[names.AGE] = squashed(hour - task[known.KNOWN_AT, j], scale)
    option[names.SHARE] = (with_me - arrival) / (with_me - hour) if with_me > hour else 1.0
    option[names.SHARE] = max(option[names.SHARE], np.float32(0))
    option[names.GAIN] = squashed(max(0.0, without - with_me), scale)
    deadline = task[known.DEADLINE, j]
    option[names.SLACK] = min(max(-1.0, (deadline - with_me) / scale), 1.0)
    option[names.MISSES] = with_me > deadline
    growth = task[known.GROWTH, j]
    option[names.GROWTH] = squashed(growth, own[known.ABILITY]) if growth > 0 else 0.0
    energy = own[known.ENERGY_PER_DISTANCE] * distance
    battery = own[known.BATTERY]  # an empty one may be below 0 by a rounding error
    option[names.ENERGY] = 0.0 if energy <= 0 else min(energy / battery, 1.0) if battery > 0 else 1.0
    option[names.RIVALS] = squashed_count(rivals(situation, j, distance, idle))


@inlined
def rivals(situation: Situation, j: int, distance: float, idle: int) -> int:
    """Return how many other agents without a task are nearer to a task."""
    x, y, z = situation.task[known.TASK_X, j], situation.task[known.TASK_Y, j], situation.task[known.TASK_Z, j]
    is_manhattan = situation.own[known.METRIC] == known.MANHATTAN_WAYS
    return nearer(situation.expected.idle_places, idle, (x, y, z), distance, is_manhattan)


@inlined
def nearer(places: FloatArray, count: int, to: Point, distance: float, is_manhattan: bool) -> int:
    """Return how many of the first places are within a distance of a place; Euclidean distances are squared."""
    x, y, z = to
    limit = distance if is_manhattan else distance * distance
    at_x, at_y, at_z = places[0], places[1], places[2]
    found = 0
    for place in range(count):
        dx, dy, dz = at_x[place] - x, at_y[place] - y, at_z[place] - z
        found += (abs(dx) + abs(dy) + abs(dz) if is_manhattan else dx * dx + dy * dy + dz * dz) < limit
    return found


@inlined
def fill_crowding(situation: Situation, tasks: IntArray, options: Singles) -> None:
    """Write the amount of other work near each task."""
    task, near = situation.task, NEAR * situation.own[known.SPAN]
    places = situation.expected.task_places
    for row in range(len(tasks)):
        for axis in range(3):
            places[axis, row] = task[known.TASK_X + axis, tasks[row]]
    for row in range(len(tasks)):
        x, y, z = places[0, row], places[1, row], places[2, row]
        found = nearer(places, len(tasks), (x, y, z), near, False)
        is_near_itself = near > 0.0 and x == x
        options[row, names.CROWDING] = squashed_count(found - is_near_itself)


@inlined
def fill_whole(situation: Situation, choice: IntArray, tasks: int, options: Singles) -> None:
    """Write the features that all options share, and those relative to a mean."""
    agents, ability = 1.0, situation.own[known.ABILITY]
    for i in range(situation.others[0]):
        if situation.counts[i]:
            agents += 1
            ability += situation.other[known.STRENGTH, i]
    fill_shared(situation, choice, tasks, options, agents, ability)


@inlined
def fill_shared(
    situation: Situation, choice: IntArray, tasks: int, options: Singles, agents: float, ability: float
) -> None:
    """Write these features, given the number of agents including this one, and the sum of their abilities."""
    own, priority, work = situation.own, 0.0, 0.0
    for row in range(tasks):
        priority += situation.task[known.PRIORITY, choice[row]]
        work += situation.task[known.LEFT, choice[row]]
    priority /= max(tasks, 1)
    per_agent, agents_known = squashed(tasks, agents), squashed(agents - 1, 5.0)
    ahead, strength = squashed(work, ability * time_scale(own)), min(own[known.ABILITY] * agents / ability - 1, 3.0)
    for row in range(len(options)):
        option = options[row]
        option[names.TASKS_PER_AGENT], option[names.KNOWN_AGENTS] = per_agent, agents_known
        option[names.WORK_AHEAD] = ahead
        if row < tasks:
            option[names.STRENGTH] = strength
            own_priority = situation.task[known.PRIORITY, choice[row]]
            option[names.PRIORITY] = own_priority / (own_priority + priority) - 0.5 if priority > 0 else 0.0
