"""Decisions of all agents in turn with common knowledge: the same as single ones, with shared parts computed once."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.network_arrays import MissionWeights, Singles
from alloc.allocators.learned.missions.options import (
    WAIT,
    completion_without,
    expect,
    fill_crowding,
    fill_shared,
    fill_task,
    insert_arrival,
    squashed_count,
    time_scale,
)
from alloc.allocators.learned.missions.play import Buffers, is_due, new_buffers
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import BoolArray, FloatArray, IntArray

NOT_DUE = -3
"""Choice of an agent that does not consider its options, and keeps its last order."""


class JointDecisions(NamedTuple):
    """The common knowledge of all agents, and that of each of itself.

    Attributes
    ----------
    buffers : Buffers
        Workspace, whose situation is that of the agent whose turn it is; all others count.
    own : ndarray, shape (n, OWN)
    distances : ndarray, shape (n, m)
        Distance of each agent from each task.
    can : ndarray of bool, shape (n, m)
    idle_distances : ndarray, shape (m, n)
        Distances of each task from the agents without a task, in the first columns; Euclidean ones are squared.
    idle : ndarray of int, shape (n + 1,)
        These agents by column; the last entry is their number.
    column : ndarray of int, shape (n,)
        Column of each agent, -1 if it has a task.
    crowding : ndarray, shape (m, features)
        Amount of work near each task; one column is used.
    crowded : ndarray of bool, shape (m,)
        The tasks to which `crowding` applies, which an agent can take.
    abilities : ndarray, shape (1,)
        Sum of the abilities of all agents.
    """

    buffers: Buffers
    own: FloatArray
    distances: FloatArray
    can: BoolArray
    idle_distances: FloatArray
    idle: IntArray
    column: IntArray
    crowding: Singles
    crowded: BoolArray
    abilities: FloatArray


def new_joint_decisions(n: int, m: int) -> JointDecisions:
    """Return a workspace for n agents and m tasks."""
    buffers = new_buffers(n, m)
    return JointDecisions(
        buffers=buffers,
        own=np.zeros((n, known.OWN)),
        distances=np.zeros((n, m)),
        can=np.zeros((n, m), np.bool_),
        idle_distances=np.zeros((m, n)),
        idle=np.zeros(n + 1, np.intp),
        column=np.zeros(n, np.intp),
        crowding=np.zeros_like(buffers.options[:m]),
        crowded=np.zeros(m, np.bool_),
        abilities=np.zeros(1),
    )


@compiled_in_place
def fill_shared_parts(joint: JointDecisions) -> None:
    """Compute the shared parts from `own`, `distances`, `can` and the tasks of the situation."""
    situation, own = joint.buffers.situation, joint.own
    other = situation.other
    joint.crowded[:] = False
    joint.abilities[0], joint.idle[-1], joint.column[:] = 0.0, 0, -1
    for i in range(len(own)):
        target = int(own[i, known.TARGET])
        situation.counts[i], situation.target[i] = True, target
        other[known.STRENGTH, i] = own[i, known.ABILITY]
        joint.abilities[0] += own[i, known.ABILITY]
        other[known.ARRIVES, i] = arrival(joint, i, target)
        note_idle(joint, i)
    situation.can[:] = True
    expect(situation)


@compiled_in_place
def note_idle(joint: JointDecisions, i: int) -> None:
    """Add an agent to those without a task, or remove it, depending on its target."""
    own, situation, idle_distances, column = joint.own[i], joint.buffers.situation, joint.idle_distances, joint.column
    tasks, idle, is_manhattan = situation.task, joint.idle, own[known.METRIC] == known.MANHATTAN_WAYS
    has_none, place = situation.target[i] == NOBODY, column[i]
    if has_none and place == NOBODY:
        place = column[i] = idle[-1]
        idle[place] = i
        idle[-1] += 1
        for j in range(len(idle_distances)):
            x, y = own[known.X] - tasks[known.TASK_X, j], own[known.Y] - tasks[known.TASK_Y, j]
            z = own[known.Z] - tasks[known.TASK_Z, j]
            idle_distances[j, place] = abs(x) + abs(y) + abs(z) if is_manhattan else x * x + y * y + z * z
    elif not has_none and place != NOBODY:
        idle[-1] -= 1
        last = idle[-1]
        for j in range(len(idle_distances)):
            idle_distances[j, place] = idle_distances[j, last]
        idle[place] = idle[last]
        column[idle[place]] = place
        column[i] = NOBODY


@compiled_in_place
def arrival(joint: JointDecisions, i: int, task: int) -> float:
    """Return the arrival hour of an agent at a task; ``-inf`` if it works there."""
    own = joint.own[i]
    if task == NOBODY or (own[known.IS_WORKING] > 0 and own[known.TARGET] == task):
        return -np.inf
    return float(own[known.HOUR] + joint.distances[i, task] / own[known.SPEED])


@compiled_in_place
def decide_in_turn(joint: JointDecisions, weights: MissionWeights, turns: IntArray, period: float, tasks: int) -> None:
    """Let agents decide in turn, each knowing the choices of those before it.

    Parameters
    ----------
    joint : JointDecisions
    weights : MissionWeights
    turns : ndarray of int
        Indices of the agents; replaced by their choices: a task, `WAIT` or `NOT_DUE`.
    period : float
        Hours between two messages, the unit of the time until options are reconsidered.
    tasks : int
        Number of open tasks.
    """
    buffers = joint.buffers
    for turn in range(len(turns)):
        i = turns[turn]
        own = joint.own[i]
        target = int(own[known.TARGET])
        is_busy = target < tasks if target != NOBODY else own[known.IS_FLYING] > 0
        if not is_due(buffers, i, own[known.HOUR], period, tasks, is_busy):
            turns[turn] = NOT_DUE
            continue
        buffers.decided[i], buffers.tasks[i] = own[known.HOUR], tasks
        remove_agent(joint, i, target)
        count = fill_turn(joint, i)
        score(buffers.options, count, weights, buffers.token, buffers.pooled, buffers.scores)
        turns[turn] = buffers.choice[np.argmax(buffers.scores[:count])]
        add_agent(joint, i, max(turns[turn], NOBODY))


@compiled_in_place
def remove_agent(joint: JointDecisions, i: int, target: int) -> None:
    """Remove an agent from the others, as it is its turn."""
    situation = joint.buffers.situation
    situation.counts[i] = False
    if target == NOBODY:
        return
    expected, before = situation.expected, NOBODY
    if expected.first[target] == i:
        expected.first[target] = expected.following[i]
    else:
        before = expected.first[target]
        while expected.following[before] != i:
            before = expected.following[before]
        expected.following[before] = expected.following[i]
    if expected.last[target] == i:
        expected.last[target] = before
    if expected.working[target] == i:
        expected.working[target] = before
    update_completion(situation, target)


@compiled_in_place
def add_agent(joint: JointDecisions, i: int, target: int) -> None:
    """Add an agent to the others again, with its target."""
    situation = joint.buffers.situation
    situation.counts[i], situation.target[i] = True, target
    note_idle(joint, i)
    if target == NOBODY:
        return
    situation.other[known.ARRIVES, i] = arrival(joint, i, target)
    insert_arrival(situation.expected, situation.other[known.ARRIVES], target, i)
    update_completion(situation, target)


@compiled_in_place
def update_completion(situation: Situation, task: int) -> None:
    """Recompute when a task is done."""
    expected = situation.expected
    expected.others[task], expected.without[task] = completion_without(situation, task)


@compiled_in_place
def fill_turn(joint: JointDecisions, i: int) -> int:
    """Write the options of an agent, as `fill_options` does; return the number of options."""
    buffers, situation = joint.buffers, joint.buffers.situation
    for number in range(known.OWN):
        situation.own[number] = joint.own[i, number]
    options, choice, count = buffers.options, buffers.choice, 0
    is_same = True
    for j in range(len(situation.can)):
        situation.can[j] = joint.can[i, j]
        situation.task[known.DISTANCE, j] = joint.distances[i, j]
        is_same &= situation.can[j] == joint.crowded[j]
        if situation.can[j]:
            choice[count] = j
            count += 1
    if not is_same:
        for j in range(len(situation.can)):
            joint.crowded[j] = situation.can[j]
        fill_crowding(situation, choice[:count], joint.crowding)
    options[: count + 1] = 0
    scale = time_scale(situation.own)
    for row in range(count):
        j = choice[row]
        fill_task(situation, j, options[row], 0, scale)
        options[row, names.CROWDING] = joint.crowding[row, names.CROWDING]
        options[row, names.RIVALS] = squashed_count(nearer(joint, i, j))
    choice[count] = WAIT
    options[count, names.STAYS] = 1
    others = float(len(joint.own))
    fill_shared(situation, choice, count, options[: count + 1], others, joint.abilities[0])
    return count + 1


@inlined
def nearer(joint: JointDecisions, i: int, task: int) -> int:
    """Return how many other agents without a task are nearer to a task than an agent."""
    idle_distances, limit, found = joint.idle_distances[task], joint.distances[i, task], 0
    if joint.own[i, known.METRIC] != known.MANHATTAN_WAYS:
        limit = limit**2
    for place in range(joint.idle[-1]):
        found += idle_distances[place] < limit
    place = joint.column[i]
    return int(found - (place != NOBODY and idle_distances[place] < limit))
