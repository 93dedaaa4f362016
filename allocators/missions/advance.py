"""Event loop of a mission, compiled: see `alloc.problems.missions.simulation.simulation`."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.missions.agenda import first_hour, pop, push
from alloc.allocators.missions.channel import deliver, is_silent, send_all
from alloc.allocators.missions.events import happen
from alloc.allocators.missions.grid import sort
from alloc.allocators.missions.knowledge import look_around, refresh
from alloc.allocators.missions.layout import (
    DONE,
    IDLE,
    MESSAGES,
    MISSED,
    NOBODY,
    OPEN,
    ORDERS,
    OVER,
    WORKING,
    MissionArrays,
)
from alloc.allocators.missions.motion import bring_up_to_date, distance_between, stop_work
from alloc.allocators.missions.orders import balance, close, land, let_decide, note_agent
from alloc.allocators.missions.records import Agent, Head
from alloc.allocators.missions.reports import find_oldest
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.missions.simulation.agenda import Turn
from alloc.problems.missions.simulation.motion import CLOSE

COMPLETION, DEADLINE, EVENT, ARRIVAL, DELIVERY, RADIO = (int(turn) for turn in Turn)
BETWEEN, WITHIN, TALKING, ORDERED = range(4)
"""Stages at which `advance` resumes: before the next hour, within it, after a request for messages or for orders."""


@compiled_in_place
def advance(state: MissionArrays) -> int:
    """Run to the next request for messages (`MESSAGES`) or orders (`ORDERS`), or to the end (`OVER`); return which.

    The agents that get orders are the first `head.deciding` entries of `deciding`. Of those that can send messages,
    agents with `Agent.speaks` do.
    """
    head, agents, agenda = state.head[0], state.agents, state.agenda
    if head.stage == TALKING:
        send(state)
    elif head.stage == ORDERED:
        balance(state)
        head.stage = BETWEEN
    while True:
        if head.stage == BETWEEN:
            if is_over(head, agents) or not first_hour(head, agenda) <= head.end:
                finish(state)
                return OVER
            head.hour, head.is_news = first_hour(head, agenda), 0
            head.turn += 1
            head.stage = WITHIN
        while first_hour(head, agenda) == head.hour:
            if take_first(state):
                head.stage = TALKING
                return MESSAGES
            if head.changed_agents or head.changed_tasks:
                balance(state)
        head.stage = BETWEEN
        if find_deciding(state) and not is_over(head, agents):
            look(state)
            head.stage = ORDERED
            return ORDERS


@inlined
def take_first(state: MissionArrays) -> bool:
    """Process the first entry of the agenda, unless it is void by now; return whether messages can be sent."""
    head = state.head[0]
    pop(head, state.agenda)
    entry = state.agenda[head.entries]
    turn, subject, version = entry.turn, entry.subject, entry.version
    if turn == RADIO:
        return talk(state)
    if turn == EVENT:
        happen(state, subject)
    elif turn == DELIVERY:
        deliver(state, subject)
    elif turn == ARRIVAL:
        if state.agents[subject].flight == version:
            arrive(state, subject)
    elif turn == COMPLETION:
        if state.tasks[subject].status == OPEN and state.tasks[subject].version == version:
            close(state, subject, DONE)
    elif state.tasks[subject].status == OPEN:
        task = state.tasks[subject]
        bring_up_to_date(head, state.agents, task, subject)
        is_done = task.left <= CLOSE * (task.appeared + task.grown)
        close(state, subject, DONE if is_done else MISSED)
    return False


@compiled_in_place
def arrive(state: MissionArrays, number: int) -> None:
    """End a flight; an agent with nothing to do at its goal has to decide."""
    agent = state.agents[number]
    task = agent.order_task if agent.order == 1 else NOBODY
    land(state, number)
    note_agent(state, number, task)
    if agent.status == IDLE:
        let_decide(state, number)
        state.head[0].is_news = 1


@inlined
def talk(state: MissionArrays) -> bool:
    """Let all agents sense; return whether any can send a message."""
    head, can_send = state.head[0], False
    for number in range(len(state.agents)):
        agent = state.agents[number]
        if IDLE <= agent.status <= WORKING:
            let_decide(state, number)
            agent.looked = head.turn
            state.lookers[head.lookers] = number
            head.lookers += 1
            can_send = can_send or not head.silences or not is_silent(state, number)
    find_oldest(state)
    look_around(state, True)
    if not can_send:
        head.tick += 1
        push(state, head.tick * head.period, RADIO, 0, 0)
    return can_send


@inlined
def send(state: MissionArrays) -> None:
    """Send the messages of all agents that can and want to, and schedule the next ones."""
    head = state.head[0]
    slot = head.tick % len(state.sent)
    if send_all(state, slot):
        push(state, head.hour + head.delay, DELIVERY, slot, 0)
    push(state, head.tick * head.period, RADIO, 0, 0)
    balance(state)
    head.stage = WITHIN


@inlined
def find_deciding(state: MissionArrays) -> bool:
    """Fill in the agents that get orders now, in the order of the mission; return whether there are any."""
    head, agents = state.head[0], state.agents
    sort(state.marked, 0, head.marked)
    head.deciding = 0
    for place in range(head.marked):
        number = state.marked[place]
        agents[number].decides = 0
        if head.is_local and IDLE <= agents[number].status <= WORKING:
            state.deciding[head.deciding] = number
            head.deciding += 1
    head.marked = 0
    if head.is_news and not head.is_local:
        for number in range(len(agents)):
            if IDLE <= agents[number].status <= WORKING:
                state.deciding[head.deciding] = number
                head.deciding += 1
    return head.deciding > 0


@inlined
def look(state: MissionArrays) -> None:
    """Let all deciding agents sense, unless they have done so in this turn."""
    head = state.head[0]
    if not head.is_local:
        refresh(state)
        return
    for place in range(head.deciding):
        number = state.deciding[place]
        if state.agents[number].looked != head.turn:
            state.agents[number].looked = head.turn
            state.lookers[head.lookers] = number
            head.lookers += 1
    if head.lookers:
        look_around(state, False)


@inlined
def is_over(head: Head, agents: Sequence[Agent]) -> bool:
    """Whether no task is open or still to come, or no agent is left, now or later."""
    return head.unfinished == 0 or head.failed == len(agents)


@compiled_in_place
def finish(state: MissionArrays) -> None:
    """End the mission: flights end, and agents that return fly home."""
    head = state.head[0]
    if not is_over(head, state.agents) and head.end < first_hour(head, state.agenda) < np.inf:
        head.hour = head.end
    for number in range(len(state.tasks)):
        bring_up_to_date(head, state.agents, state.tasks[number], number)
    for number in range(len(state.agents)):
        agent = state.agents[number]
        if agent.flight:
            fly_home(agent, agent.length)
            if not np.isnan(agent.goal_x):
                agent.x, agent.y, agent.z = agent.goal_x, agent.goal_y, agent.goal_z
        if agent.returns and agent.flown and IDLE <= agent.status <= WORKING:
            stop_work(head, state.agents, state.tasks, number)
            home = agent.home_x, agent.home_y, agent.home_z
            fly_home(agent, distance_between(head.is_manhattan, (agent.x, agent.y, agent.z), home))
            agent.x, agent.y, agent.z = home


@compiled_in_place
def fly_home(agent: Agent, length: float) -> None:
    """Book a flight home after the end of the mission."""
    agent.flown = 1
    agent.distance += length
    agent.energy += agent.energy_per_distance * length
    agent.battery -= agent.energy_per_distance * length
    agent.flight, agent.status = 0, IDLE
