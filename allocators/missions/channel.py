"""The radio, compiled: see `alloc.problems.missions.simulation.channel`."""

import math

import numpy as np

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.grid import cells_near, find_within, limit_of, sort
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, MissionArrays, Numbers
from alloc.allocators.missions.motion import distance_between, place_of
from alloc.allocators.missions.records import Head
from alloc.allocators.missions.reports import count_known, hear_of_agents, keep_recent
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import FloatArray
from alloc.problems.missions.simulation.reports import BYTES_OF_AGENT, BYTES_OF_MESSAGE, BYTES_OF_TASK


@compiled_in_place
def is_silent(state: MissionArrays, number: int) -> bool:
    """Whether an agent can neither send nor receive now."""
    head = state.head[0]
    for place in range(head.silences):
        event = state.events[state.silences[place]]
        if head.hour >= event.until:
            continue
        if event.agent != NOBODY:
            if event.agent == number:
                return True
            continue
        here = place_of(state.agents[number], head.hour)
        if distance_between(head.is_manhattan, here, (event.x, event.y, event.z)) <= event.radius + TOLERANCE:
            return True
    return False


@inlined
def send_all(state: MissionArrays, slot: int) -> bool:
    """Send the knowledge of all agents that can and want to send; return whether any message is received."""
    head, agents, speaks = state.head[0], state.agents, state.speaks
    for number in range(len(agents)):
        agent = agents[number]
        speaks[number] = IDLE <= agent.status <= WORKING and agent.speaks != 0
        if speaks[number] and head.silences and is_silent(state, number):
            speaks[number] = False
        if speaks[number]:
            agent.messages += 1
            known = BYTES_OF_AGENT * count_known(state.known[number], state.heard_of[number])
            agent.bytes += BYTES_OF_MESSAGE + BYTES_OF_TASK * count(state.task_hour[number]) + known
    found = gather_speakers(state) > 0 and find_senders(state, slot)
    if found:
        for number in range(len(agents)):
            if speaks[number]:
                keep(state, slot, number)
    else:
        state.senders[slot] = 0
    head.tick += 1
    return found


@inlined
def gather_speakers(state: MissionArrays) -> int:
    """Fill in the senders and their places by the cells of the grid; return the number of senders."""
    places, speakers, to, at, count = state.places, state.speakers, state.speaker_places, state.speaker_cells, 0
    for cell in range(len(at) - 1):
        for place in range(state.cells[cell], state.cells[cell + 1]):
            number = state.in_cells[place]
            if state.speaks[number]:
                speakers[count] = number
                to[0, count], to[1, count], to[2, count] = places[0, place], places[1, place], places[2, place]
                count += 1
        at[cell + 1] = count
    return count


@compiled_in_place
def count(hours: FloatArray) -> int:
    """Return the number of known tasks."""
    known = 0
    for one in range(len(hours)):
        known += hours[one] >= 0
    return known


@compiled_in_place
def copy(row: FloatArray, to: FloatArray) -> None:
    """Copy a row with one value for each task."""
    for one in range(len(row)):
        to[one] = row[one]


@compiled_in_place
def keep(state: MissionArrays, slot: int, number: int) -> None:
    """Store the message of an agent, without reports that are too old for any policy."""
    copy(state.task_hour[number], state.sent_task_hour[slot, number])
    copy(state.task_left[number], state.sent_task_left[slot, number])
    known, told = state.known_report[number], state.sent_report[slot, number]
    state.sent[slot, number] = keep_recent(known, state.head[0].oldest, told)
    for word in range(state.heard_of.shape[1]):
        state.sent_of[slot, number, word] = state.heard_of[number, word]


@inlined
def find_senders(state: MissionArrays, slot: int) -> bool:
    """Fill in the senders whose messages each agent will receive; return whether there are any.

    For the returned value, messages lost in bursts count as received.
    """
    head, found, begin = state.head[0], False, 0
    limit = limit_of(head.is_manhattan, head.radius + TOLERANCE)
    for number in range(len(state.agents)):
        state.first_sender[slot, number] = begin
        end = begin
        if IDLE <= state.agents[number].status <= WORKING:
            end = find_near(state, number, limit, begin, state.sender[slot])
        found = found or end > begin
        if head.has_burst:
            end = lose_in_bursts(head, state.sender[slot], begin, end, number, state.links)
        state.senders[slot, number] = end - begin
        if len(state.cells) > 2:
            sort(state.sender[slot], begin, end - begin)
        begin = end
    return found


@inlined
def find_near(state: MissionArrays, number: int, limit: float, end: int, near: Numbers) -> int:
    """Append the senders within an agent's radius whose messages are not lost; return the end of the list.

    The radius is also given as `limit`, by `limit_of`.
    """
    head, here, output = state.head[0], place_of(state.agents[number], state.head[0].hour), (state.is_near, state.near)
    cells = state.speaker_cells
    first, last, low, high = cells_near(head, here[0], here[1], head.radius + TOLERANCE)
    for row in range(low, high + 1):
        begin, until = cells[row * head.columns + first], cells[row * head.columns + last + 1]
        if begin == until:
            continue
        for place in range(find_within(head.is_manhattan, limit, here, state.speaker_places, begin, until, output)):
            other = state.speakers[state.near[place]]
            is_heard = other != number
            if head.loss > 0:
                key = keyed(keyed(keyed(head.loss_key, other), number), head.tick)
                is_heard &= fraction(key) >= head.loss
            near[end] = other
            end += is_heard  # branchless: a branch could not be predicted
    return end


@compiled_in_place
def lose_in_bursts(head: Head, senders: Numbers, begin: int, end: int, hearer: int, links: Numbers) -> int:
    """Remove senders whose messages to an agent are lost in bursts in this tick; return the end of the list."""
    kept = begin
    for place in range(begin, end):
        sender = senders[place]
        key = keyed(keyed(keyed(keyed(head.loss_key, sender), hearer), head.tick), 1)
        loss = head.burst_loss_bad if is_link_bad(head, sender, hearer, links) else head.burst_loss_good
        senders[kept] = sender
        kept += fraction(key) >= loss
    return kept


@compiled_in_place
def is_link_bad(head: Head, sender: int, hearer: int, links: Numbers) -> bool:
    """Whether a link is bad now: a Markov chain over all message numbers up to this one, sent or not."""
    key = keyed(keyed(head.burst_key, sender), hearer)
    share = head.burst_bad / (head.burst_good + head.burst_bad)
    is_bad = links[sender, hearer] & 1
    for step in range(links[sender, hearer] >> 1, head.tick + 1):
        hours = head.period if step else np.inf
        forgotten = -math.expm1(-hours * (1 / head.burst_good + 1 / head.burst_bad))
        is_bad = int(fraction(keyed(key, step)) < share + (is_bad - share) * (1 - forgotten))
    links[sender, hearer] = 2 * (head.tick + 1) + is_bad
    return bool(is_bad != 0)


@inlined
def deliver(state: MissionArrays, slot: int) -> None:
    """Deliver the messages of a slot to all their receivers."""
    head, senders = state.head[0], state.senders[slot]
    for place in range(len(state.agents)):
        number = state.in_cells[place]  # neighbours in succession: they hear the same messages
        if not senders[number]:
            continue
        is_there = IDLE <= state.agents[number].status <= WORKING
        if not is_there or (head.silences and is_silent(state, number)):
            senders[number] = 0
            continue
        hear_of_tasks(state, slot, number)
        hear_of_agents(state, slot, number)
    state.sent[slot] = 0


@inlined
def hear_of_tasks(state: MissionArrays, slot: int, number: int) -> None:
    """Let an agent adopt newer knowledge of tasks from the messages that it receives."""
    first = state.first_sender[slot, number]
    hours, left = state.task_hour[number], state.task_left[number]
    for place in range(first, first + state.senders[slot, number]):
        sender = state.sender[slot, place]
        take_over(state.sent_task_hour[slot, sender], state.sent_task_left[slot, sender], hours, left)


@compiled_in_place
def take_over(told_hour: FloatArray, told: FloatArray, hour: FloatArray, known: FloatArray) -> None:
    """Adopt the values of a message that are newer than an agent's own."""
    for one in range(len(hour)):
        if told_hour[one] > hour[one]:
            hour[one] = told_hour[one]
            known[one] = told[one]
