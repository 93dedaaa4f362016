"""Decisions of all agents in turn with common knowledge: the same as single ones, with shared parts computed once."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions import feature_names as names
from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.network_arrays import MissionWeights, Singles
from alloc.allocators.learned.missions.options import (
    WAIT,
    done_without,
    expect,
    fill_crowding,
    fill_shared,
    fill_task,
    queue,
    squashed_count,
    time_scale,
)
from alloc.allocators.learned.missions.play import Room, is_due, room_for
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import BoolArray, FloatArray, IntArray

NOT_DUE = -3
"""Choice of an agent that does not consider its options, and keeps its last order."""


class Together(NamedTuple):
    """The common knowledge of all agents, and that of each of itself.

    Attributes
    ----------
    room : Room
        Workspace, whose situation is that of the agent whose turn it is; all others count.
    own : ndarray, shape (n, OWN)
    ways : ndarray, shape (n, m)
        Distance of each agent from each task.
    can : ndarray of bool, shape (n, m)
    gaps : ndarray, shape (m, n)
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

    room: Room
    own: FloatArray
    ways: FloatArray
    can: BoolArray
    gaps: FloatArray
    idle: IntArray
    column: IntArray
    crowding: Singles
    crowded: BoolArray
    abilities: FloatArray


def together_for(n: int, m: int) -> Together:
    """Return a workspace for n agents and m tasks."""
    room = room_for(n, m)
    return Together(
        room=room,
        own=np.zeros((n, known.OWN)),
        ways=np.zeros((n, m)),
        can=np.zeros((n, m), np.bool_),
        gaps=np.zeros((m, n)),
        idle=np.zeros(n + 1, np.intp),
        column=np.zeros(n, np.intp),
        crowding=np.zeros_like(room.options[:m]),
        crowded=np.zeros(m, np.bool_),
        abilities=np.zeros(1),
    )


@compiled_in_place
def meet(together: Together) -> None:
    """Compute the shared parts from `own`, `ways`, `can` and the tasks of the situation."""
    situation, own = together.room.situation, together.own
    other = situation.other
    together.crowded[:] = False
    together.abilities[0], together.idle[-1], together.column[:] = 0.0, 0, -1
    for i in range(len(own)):
        target = int(own[i, known.TARGET])
        situation.counts[i], situation.target[i] = True, target
        other[known.STRENGTH, i] = own[i, known.ABILITY]
        together.abilities[0] += own[i, known.ABILITY]
        other[known.ARRIVES, i] = arrival(together, i, target)
        note_idle(together, i)
    situation.can[:] = True
    expect(situation)


@compiled_in_place
def note_idle(together: Together, i: int) -> None:
    """Add an agent to those without a task, or remove it, depending on its target."""
    own, situation, gaps, column = together.own[i], together.room.situation, together.gaps, together.column
    tasks, idle, is_manhattan = situation.task, together.idle, own[known.METRIC] == known.MANHATTAN_WAYS
    has_none, place = situation.target[i] == NOBODY, column[i]
    if has_none and place == NOBODY:
        place = column[i] = idle[-1]
        idle[place] = i
        idle[-1] += 1
        for j in range(len(gaps)):
            x, y = own[known.X] - tasks[known.TASK_X, j], own[known.Y] - tasks[known.TASK_Y, j]
            z = own[known.Z] - tasks[known.TASK_Z, j]
            gaps[j, place] = abs(x) + abs(y) + abs(z) if is_manhattan else x * x + y * y + z * z
    elif not has_none and place != NOBODY:
        idle[-1] -= 1
        last = idle[-1]
        for j in range(len(gaps)):
            gaps[j, place] = gaps[j, last]
        idle[place] = idle[last]
        column[idle[place]] = place
        column[i] = NOBODY


@compiled_in_place
def arrival(together: Together, i: int, task: int) -> float:
    """Return the arrival hour of an agent at a task; ``-inf`` if it works there."""
    own = together.own[i]
    if task == NOBODY or (own[known.IS_WORKING] > 0 and own[known.TARGET] == task):
        return -np.inf
    return float(own[known.HOUR] + together.ways[i, task] / own[known.SPEED])


@compiled_in_place
def decide_together(together: Together, weights: MissionWeights, turns: IntArray, period: float, tasks: int) -> None:
    """Let agents decide in turn, each knowing the choices of those before it.

    Parameters
    ----------
    together : Together
    weights : MissionWeights
    turns : ndarray of int
        Indices of the agents; replaced by their choices: a task, `WAIT` or `NOT_DUE`.
    period : float
        Hours between two messages, the unit of the time until options are reconsidered.
    tasks : int
        Number of open tasks.
    """
    room = together.room
    for turn in range(len(turns)):
        i = turns[turn]
        own = together.own[i]
        target = int(own[known.TARGET])
        is_busy = target < tasks if target != NOBODY else own[known.IS_FLYING] > 0
        if not is_due(room, i, own[known.HOUR], period, tasks, is_busy):
            turns[turn] = NOT_DUE
            continue
        room.decided[i], room.tasks[i] = own[known.HOUR], tasks
        step_out(together, i, target)
        count = fill_turn(together, i)
        score(room.options, count, weights, room.token, room.pooled, room.scores)
        turns[turn] = room.choice[np.argmax(room.scores[:count])]
        step_in(together, i, max(turns[turn], NOBODY))


@compiled_in_place
def step_out(together: Together, i: int, target: int) -> None:
    """Remove an agent from the others, as it is its turn."""
    situation = together.room.situation
    situation.counts[i] = False
    if target == NOBODY:
        return
    coming, before = situation.coming, NOBODY
    if coming.first[target] == i:
        coming.first[target] = coming.following[i]
    else:
        before = coming.first[target]
        while coming.following[before] != i:
            before = coming.following[before]
        coming.following[before] = coming.following[i]
    if coming.last[target] == i:
        coming.last[target] = before
    if coming.working[target] == i:
        coming.working[target] = before
    renew(situation, target)


@compiled_in_place
def step_in(together: Together, i: int, target: int) -> None:
    """Add an agent to the others again, with its target."""
    situation = together.room.situation
    situation.counts[i], situation.target[i] = True, target
    note_idle(together, i)
    if target == NOBODY:
        return
    situation.other[known.ARRIVES, i] = arrival(together, i, target)
    queue(situation.coming, situation.other[known.ARRIVES], target, i)
    renew(situation, target)


@compiled_in_place
def renew(situation: Situation, task: int) -> None:
    """Recompute when a task is done."""
    coming = situation.coming
    coming.others[task], coming.without[task] = done_without(situation, task)


@compiled_in_place
def fill_turn(together: Together, i: int) -> int:
    """Write the options of an agent, as `fill_options` does; return the number of options."""
    room, situation = together.room, together.room.situation
    for number in range(known.OWN):
        situation.own[number] = together.own[i, number]
    options, choice, count = room.options, room.choice, 0
    is_same = True
    for j in range(len(situation.can)):
        situation.can[j] = together.can[i, j]
        situation.task[known.DISTANCE, j] = together.ways[i, j]
        is_same &= situation.can[j] == together.crowded[j]
        if situation.can[j]:
            choice[count] = j
            count += 1
    if not is_same:
        for j in range(len(situation.can)):
            together.crowded[j] = situation.can[j]
        fill_crowding(situation, choice[:count], together.crowding)
    options[: count + 1] = 0
    scale = time_scale(situation.own)
    for row in range(count):
        j = choice[row]
        fill_task(situation, j, options[row], 0, scale)
        options[row, names.CROWDING] = together.crowding[row, names.CROWDING]
        options[row, names.RIVALS] = squashed_count(nearer(together, i, j))
    choice[count] = WAIT
    options[count, names.STAYS] = 1
    others = float(len(together.own))
    fill_shared(situation, choice, count, options[: count + 1], others, together.abilities[0])
    return count + 1


@inlined
def nearer(together: Together, i: int, task: int) -> int:
    """Return how many other agents without a task are nearer to a task than an agent."""
    gaps, limit, found = together.gaps[task], together.ways[i, task], 0
    if together.own[i, known.METRIC] != known.MANHATTAN_WAYS:
        limit = limit**2
    for place in range(together.idle[-1]):
        found += gaps[place] < limit
    place = together.column[i]
    return int(found - (place != NOBODY and gaps[place] < limit))
