"""Missions under the network of `gappo`, event by event, in compiled loops."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions.exploring import CELLS, centre, find_unseen, notice
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.neighbours import Swap, foresee, needs_foresight, swap_for
from alloc.allocators.learned.missions.network_arrays import HIDDEN, WIDTH, MissionWeights, Singles
from alloc.allocators.learned.missions.options import WAIT, fill_options
from alloc.allocators.learned.missions.situation import IS_FLYING, TARGET, Situation, empty, fill
from alloc.allocators.learned.missions.talking import MOST_SAVED, is_to_send
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.channel import is_silent
from alloc.allocators.missions.layout import (
    IDLE,
    MESSAGES,
    NOBODY,
    OVER,
    STAY,
    TO_PLACE,
    TO_TASK,
    WORKING,
    MissionArrays,
)
from alloc.allocators.missions.motion import place_of
from alloc.allocators.missions.orders import order
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import FloatArray, IntArray

REVIEW = 10
"""Number of radio periods after which a busy agent reconsiders its options without other cause."""


class Room(NamedTuple):
    """Workspace of decisions, and the memory of agents between them.

    Attributes
    ----------
    situation : Situation
    swap : Swap
    options, token, pooled, scores : ndarray
        See `score`.
    choice : ndarray of int
    look : ndarray, shape (3,)
        See `fill_options`.
    last : ndarray, shape (2, cells)
        See `find_unseen`.
    seen : ndarray, shape (n, cells)
        Hour at which each agent last saw each cell, -1 for never.
    goal : ndarray of int, shape (n,)
        Cell to which each agent flies for exploring.
    decided : ndarray, shape (n,)
        Hour at which each agent last considered its options.
    tasks : ndarray of int, shape (n,)
        Number of open tasks that it knew then.
    periods : int
    saved, counted, news : ndarray of int, shape (n,)
        See `is_to_send`.
    """

    situation: Situation
    swap: Swap
    options: Singles
    token: Singles
    pooled: Singles
    scores: Singles
    choice: IntArray
    look: FloatArray
    last: FloatArray
    seen: FloatArray
    goal: IntArray
    decided: FloatArray
    tasks: IntArray
    periods: int
    saved: IntArray
    counted: IntArray
    news: IntArray


def room_for(n: int, m: int, periods: int = 1) -> Room:
    """Return a workspace for n agents, which send a message every `periods` radio periods, and m tasks."""
    return Room(
        situation=empty(n, m),
        swap=swap_for(n, m),
        options=np.zeros((m + 2, WIDTH), np.float32),
        token=np.zeros((m + 2, HIDDEN), np.float32),
        pooled=np.zeros((2, HIDDEN), np.float32),
        scores=np.zeros(m + 2, np.float32),
        choice=np.zeros(m + 2, np.intp),
        look=np.zeros(3),
        last=np.zeros((2, CELLS * CELLS)),
        seen=np.full((n, CELLS * CELLS), -1.0),
        goal=np.full(n, -1),
        decided=np.full(n, -np.inf),
        tasks=np.zeros(n, np.intp),
        periods=periods,
        saved=np.full(n, MOST_SAVED * periods, np.intp),
        counted=np.zeros(n, np.intp),
        news=np.zeros(n, np.intp),
    )


@inlined
def is_due(room: Room, number: int, hour: float, period: float, tasks: int, is_busy: bool) -> bool:
    """Return whether an agent should consider its options: it is idle, knows other tasks, or a review is due."""
    return not is_busy or tasks != room.tasks[number] or hour - room.decided[number] >= REVIEW * period


@inlined
def score_options(
    room: Room, area: FloatArray, sensing: float, seed: int, number: int, row: int, weights: MissionWeights
) -> int:
    """Return the number of options of an agent in the given situation, and write their scores into `room`.

    Parameters
    ----------
    room : Room
    area : ndarray, shape (2, 3)
    sensing : float
        Sensing radius; ``inf`` without exploration. An agent that has a task does not explore.
    seed, number : int
        Seed of the run and index of the agent, for random numbers.
    row : int
        Row of the agent in the memory.
    weights : MissionWeights
    """
    own = room.situation.own
    room.look[:] = 0.0
    target = int(own[TARGET])
    if sensing < np.inf and (target < 0 or not room.situation.can[target]):
        goal = room.goal[row] if own[TARGET] < 0 and own[IS_FLYING] > 0 else -1
        for cell in range(CELLS * CELLS):
            room.last[0, cell] = room.seen[row, cell]
        room.goal[row] = find_unseen(room.situation, area, sensing, room.last, seed, number, goal, room.look)
    scratch = room.options, room.token, room.pooled, room.scores, room.choice
    if needs_foresight(own):
        foresee(room.situation, room.swap, room.look, scratch, weights)
    count = fill_options(room.situation, room.look, room.options, room.choice)
    score(room.options, count, weights, room.token, room.pooled, room.scores)
    return count


@compiled_in_place
def consider(
    room: Room, area: FloatArray, sensing: float, seed: int, number: int, row: int, weights: MissionWeights
) -> int:
    """Do the same as `score_options`, for callers that are not compiled."""
    return score_options(room, area, sensing, seed, number, row, weights)


@inlined
def open_tasks(state: MissionArrays, number: int) -> int:
    """Return the number of tasks that an agent knows to be open."""
    found = 0
    for task in range(len(state.tasks)):
        found += (state.task_hour[number, task] >= 0) & (state.task_left[number, task] >= 0)
    return found


@inlined
def is_busy(state: MissionArrays, number: int) -> bool:
    """Return whether an agent has a task that is open to its knowledge, or is flying to explore."""
    agent = state.agents[number]
    if agent.order == TO_TASK:
        return bool(state.task_left[agent.known, agent.order_task] >= 0)
    return agent.flight != 0


@inlined
def note_choice(room: Room, row: int, choice: int) -> None:
    """Record news for other agents if a choice differs from the last order."""
    if max(choice, NOBODY) != int(room.situation.own[TARGET]):
        room.news[row] = 1


@inlined
def talk(state: MissionArrays, room: Room) -> None:
    """Set which agents send a message now."""
    head = state.head[0]
    for number in range(len(state.agents)):
        agent = state.agents[number]
        agent.speaks = 0
        if IDLE <= agent.status <= WORKING and not (head.silences and is_silent(state, number)):
            agent.speaks = is_to_send(room.periods, room.saved, room.counted, room.news, number, head.tick)


@inlined
def act(state: MissionArrays, room: Room, number: int, choice: int) -> None:
    """Give the agent the order for its choice."""
    agent = state.agents[number]
    nowhere = (0.0, 0.0, 0.0)
    note_choice(room, number, choice)
    if choice >= 0:
        order(state, number, TO_TASK, choice, nowhere)
    elif choice == WAIT:
        order(state, number, STAY, -1, nowhere)
    elif agent.order != TO_PLACE:
        order(state, number, TO_PLACE, -1, centre(state.area, room.goal[number]))


@inlined
def wants(state: MissionArrays, room: Room, number: int) -> bool:
    """Return whether an agent should consider its options now; record what it sees."""
    head, agent = state.head[0], state.agents[number]
    tasks = open_tasks(state, agent.known)
    is_considered = is_due(room, number, head.hour, head.period, tasks, is_busy(state, number))
    if (is_considered or agent.flight != 0) and head.sensing < np.inf and head.is_local:
        x, y, _ = place_of(agent, head.hour)
        notice(state.area, head.sensing, x, y, head.hour, room.seen[number])
    if not is_considered:
        return False
    room.decided[number], room.tasks[number] = head.hour, tasks
    fill(state, number, room.situation)
    return True


@compiled_in_place
def play(state: MissionArrays, room: Room, weights: MissionWeights, seed: int) -> int:
    """Let the network decide for all agents until the end of a mission; return the number of decisions.

    Parameters
    ----------
    state : MissionArrays
    room : Room
        Workspace from `room_for`.
    weights : MissionWeights
    seed : int
        Seed of the run.
    """
    head, considered = state.head[0], 0
    sensing = head.sensing if head.is_local else np.inf
    while True:
        wanted = advance(state)
        if wanted == OVER:
            return considered
        if wanted == MESSAGES:
            talk(state, room)
            continue
        for place in range(head.deciding):
            number = state.deciding[place]
            if wants(state, room, number):
                count = score_options(room, state.area, sensing, seed, number, number, weights)
                act(state, room, number, room.choice[np.argmax(room.scores[:count])])
                considered += 1
