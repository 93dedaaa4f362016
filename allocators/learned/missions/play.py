"""Missions under the network of `gappo`, event by event, in compiled loops."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions.exploring import CELLS, centre, find_unseen, record_seen
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.messages import MAX_SAVED, should_send
from alloc.allocators.learned.missions.neighbours import PeerView, needs_prediction, new_peer_view, predict_neighbours
from alloc.allocators.learned.missions.network_arrays import HIDDEN, WIDTH, MissionWeights, Singles
from alloc.allocators.learned.missions.options import WAIT, fill_options
from alloc.allocators.learned.missions.situation import IS_FLYING, TARGET, Situation, empty, fill
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


class Buffers(NamedTuple):
    """Workspace of decisions, and the memory of agents between them.

    Attributes
    ----------
    situation : Situation
    peer : PeerView
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
        See `should_send`.
    """

    situation: Situation
    peer: PeerView
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


def new_buffers(n: int, m: int, periods: int = 1) -> Buffers:
    """Return a workspace for n agents, which send a message every `periods` radio periods, and m tasks."""
    return Buffers(
        situation=empty(n, m),
        peer=new_peer_view(n, m),
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
        saved=np.full(n, MAX_SAVED * periods, np.intp),
        counted=np.zeros(n, np.intp),
        news=np.zeros(n, np.intp),
    )


@inlined
def is_due(buffers: Buffers, number: int, hour: float, period: float, tasks: int, is_busy: bool) -> bool:
    """Return whether an agent should consider its options: it is idle, knows other tasks, or a review is due."""
    return not is_busy or tasks != buffers.tasks[number] or hour - buffers.decided[number] >= REVIEW * period


@inlined
def score_options(
    buffers: Buffers, area: FloatArray, sensing: float, seed: int, number: int, row: int, weights: MissionWeights
) -> int:
    """Return the number of options of an agent in the given situation, and write their scores into `buffers`.

    Parameters
    ----------
    buffers : Buffers
    area : ndarray, shape (2, 3)
    sensing : float
        Sensing radius; ``inf`` without exploration. An agent that has a task does not explore.
    seed, number : int
        Seed of the run and index of the agent, for random numbers.
    row : int
        Row of the agent in the memory.
    weights : MissionWeights
    """
    own = buffers.situation.own
    buffers.look[:] = 0.0
    target = int(own[TARGET])
    if sensing < np.inf and (target < 0 or not buffers.situation.can[target]):
        goal = buffers.goal[row] if own[TARGET] < 0 and own[IS_FLYING] > 0 else -1
        for cell in range(CELLS * CELLS):
            buffers.last[0, cell] = buffers.seen[row, cell]
        buffers.goal[row] = find_unseen(
            buffers.situation, area, sensing, buffers.last, seed, number, goal, buffers.look
        )
    scratch = buffers.options, buffers.token, buffers.pooled, buffers.scores, buffers.choice
    if needs_prediction(own):
        predict_neighbours(buffers.situation, buffers.peer, buffers.look, scratch, weights)
    count = fill_options(buffers.situation, buffers.look, buffers.options, buffers.choice)
    score(buffers.options, count, weights, buffers.token, buffers.pooled, buffers.scores)
    return count


@compiled_in_place
def score_options_compiled(
    buffers: Buffers, area: FloatArray, sensing: float, seed: int, number: int, row: int, weights: MissionWeights
) -> int:
    """Do the same as `score_options`, for callers that are not compiled."""
    return score_options(buffers, area, sensing, seed, number, row, weights)


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
def record_change(buffers: Buffers, row: int, choice: int) -> None:
    """Record news for other agents if a choice differs from the last order."""
    if max(choice, NOBODY) != int(buffers.situation.own[TARGET]):
        buffers.news[row] = 1


@inlined
def choose_senders(state: MissionArrays, buffers: Buffers) -> None:
    """Set which agents send a message now."""
    head = state.head[0]
    for number in range(len(state.agents)):
        agent = state.agents[number]
        agent.speaks = 0
        if IDLE <= agent.status <= WORKING and not (head.silences and is_silent(state, number)):
            agent.speaks = should_send(buffers.periods, buffers.saved, buffers.counted, buffers.news, number, head.tick)


@inlined
def give_order(state: MissionArrays, buffers: Buffers, number: int, choice: int) -> None:
    """Give the agent the order for its choice."""
    agent = state.agents[number]
    nowhere = (0.0, 0.0, 0.0)
    record_change(buffers, number, choice)
    if choice >= 0:
        order(state, number, TO_TASK, choice, nowhere)
    elif choice == WAIT:
        order(state, number, STAY, -1, nowhere)
    elif agent.order != TO_PLACE:
        order(state, number, TO_PLACE, -1, centre(state.area, buffers.goal[number]))


@inlined
def should_decide(state: MissionArrays, buffers: Buffers, number: int) -> bool:
    """Return whether an agent should consider its options now; record what it sees."""
    head, agent = state.head[0], state.agents[number]
    tasks = open_tasks(state, agent.known)
    is_considered = is_due(buffers, number, head.hour, head.period, tasks, is_busy(state, number))
    if (is_considered or agent.flight != 0) and head.sensing < np.inf and head.is_local:
        x, y, _ = place_of(agent, head.hour)
        record_seen(state.area, head.sensing, x, y, head.hour, buffers.seen[number])
    if not is_considered:
        return False
    buffers.decided[number], buffers.tasks[number] = head.hour, tasks
    fill(state, number, buffers.situation)
    return True


@compiled_in_place
def play(state: MissionArrays, buffers: Buffers, weights: MissionWeights, seed: int) -> int:
    """Let the network decide for all agents until the end of a mission; return the number of decisions.

    Parameters
    ----------
    state : MissionArrays
    buffers : Buffers
        Workspace from `new_buffers`.
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
            choose_senders(state, buffers)
            continue
        for place in range(head.deciding):
            number = state.deciding[place]
            if should_decide(state, buffers, number):
                count = score_options(buffers, state.area, sensing, seed, number, number, weights)
                give_order(state, buffers, number, buffers.choice[np.argmax(buffers.scores[:count])])
                considered += 1
