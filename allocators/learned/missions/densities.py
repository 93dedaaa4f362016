"""Features of options that do not change with the density of tasks and agents, and products of others, compiled."""

import math

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.network_arrays import Singles
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import IntArray

NOT_AS_FAR = 1 - 1e-9
"""Factor on a squared distance below which another is nearer: agents at one place are equally far, however rounded."""


@compiled_in_place
def fill_densities(situation: Situation, choice: IntArray, tasks: int, options: Singles) -> None:
    """Fill in what comes after each task, who is nearer, how far it is beside others, and the products.

    Parameters
    ----------
    situation : Situation
    choice : ndarray of int
        Task of each option; the first `tasks` are tasks.
    tasks : int
    options : ndarray, shape (options, FEATURES)
        With all other features filled in.
    """
    mean = np.float32(0)
    for row in range(tasks):
        mean += options[row, names.TRAVEL] / np.float32(tasks)
    for row in range(tasks):
        option = options[row]
        option[names.APART] = apart(situation, choice, tasks, row)
        option[names.NEARER] = nearer(situation, choice[row])
        travel = option[names.TRAVEL]
        option[names.FARNESS] = travel / (travel + mean) if travel > 0 else 0.0
    for row in range(len(options)):
        option = options[row]
        option[names.SHARE_AHEAD] = option[names.SHARE] * option[names.WORK_AHEAD]
        option[names.GAIN_AHEAD] = option[names.GAIN] * option[names.WORK_AHEAD]
        option[names.OTHERS_PER_AGENT] = option[names.OTHERS] * option[names.TASKS_PER_AGENT]


@compiled_in_place
def apart(situation: Situation, choice: IntArray, tasks: int, row: int) -> float:
    """Return how far the next task is that nobody does, in spans; 1 where there is none."""
    task, others = situation.task, situation.coming.others
    span, least = situation.own[known.SPAN], np.inf
    j = choice[row]
    x, y, z = task[known.TASK_X, j], task[known.TASK_Y, j], task[known.TASK_Z, j]
    for place in range(tasks):
        i = choice[place]
        if place != row and others[i] == 0:
            dx, dy, dz = task[known.TASK_X, i] - x, task[known.TASK_Y, i] - y, task[known.TASK_Z, i] - z
            least = min(least, dx * dx + dy * dy + dz * dz)
    return min(1.0, math.sqrt(least) / span) if least < np.inf and span > 0 else 1.0


@compiled_in_place
def nearer(situation: Situation, j: int) -> float:
    """Return the share of others that are nearer to a task than the agent, as far as it knows."""
    task, other, distance = situation.task, situation.other, situation.task[known.DISTANCE, j]
    x, y, z = task[known.TASK_X, j], task[known.TASK_Y, j], task[known.TASK_Z, j]
    found = counted = 0
    for i in range(len(situation.counts)):
        if situation.counts[i]:
            dx, dy, dz = other[known.OTHER_X, i] - x, other[known.OTHER_Y, i] - y, other[known.OTHER_Z, i] - z
            counted += 1
            found += dx * dx + dy * dy + dz * dz < distance * distance * NOT_AS_FAR
    return found / counted if counted else 0.0
